//! The turns of those who ask for much: one slice each, however much of it they have.

use std::collections::VecDeque;

/// Work that waits, by who asked for it: each has its turn, and the work of each stays in its order.
#[derive(Debug)]
pub(super) struct Turns<K, T>(VecDeque<(K, VecDeque<T>)>);

impl<K: PartialEq, T> Turns<K, T> {
    /// Nobody waits.
    pub(super) const fn new() -> Self {
        Self(VecDeque::new())
    }

    fn of(&mut self, who: K) -> &mut VecDeque<T> {
        let place = self.0.iter().position(|(other, _)| *other == who).unwrap_or_else(|| {
            self.0.push_back((who, VecDeque::new()));
            self.0.len() - 1
        });
        &mut self.0[place].1
    }

    /// Adds work behind all other of the same asker.
    pub(super) fn push(&mut self, who: K, work: T) {
        self.of(who).push_back(work);
    }

    /// The work whose turn it is; who asked for it comes after all others now.
    pub(super) fn next(&mut self) -> Option<(K, T)>
    where
        K: Copy,
    {
        let (who, mut works) = self.0.pop_front()?;
        let work = works.pop_front()?;
        if !works.is_empty() {
            self.0.push_back((who, works));
        }
        Some((who, work))
    }

    /// Gives back work that has not ended: it is the next of its asker's.
    pub(super) fn give_back(&mut self, who: K, work: T) {
        self.of(who).push_front(work);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_asks_for_three_gets_no_more_turns_than_who_asks_for_one_and_has_them_in_order() {
        let mut turns = Turns::new();
        for (who, name) in [('a', "a1"), ('a', "a2"), ('a', "a3"), ('b', "b1")] {
            turns.push(who, (name, 2));
        }
        let mut order = Vec::new();
        while let Some((who, (name, slices))) = turns.next() {
            order.push(name);
            if slices > 1 {
                turns.give_back(who, (name, slices - 1));
            }
        }
        assert_eq!(order, ["a1", "b1", "a1", "b1", "a2", "a2", "a3", "a3"]);
    }
}
