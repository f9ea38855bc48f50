//! What effects remember of the runs of many clients: bounded, without allocating once it is made.
//!
//! Two generations: a run that asks moves to the younger one, and when that is full the older one is forgotten. So the last
//! [`Sessions::CAPACITY`] runs that asked are always known, at most twice as many are held, and a run that comes back after
//! it was forgotten begins again, which its answer says.

use std::collections::HashMap;
use std::hash::Hash;

use wade_core::served::Session;

/// Sessions by key.
#[derive(Debug)]
pub struct Sessions<K> {
    young: HashMap<K, Session>,
    old: HashMap<K, Session>,
    capacity: usize,
}

impl<K> Sessions<K> {
    /// Runs that are surely known, unless a caller wants another number.
    pub const CAPACITY: usize = 4096;
}

impl<K: Hash + Eq> Sessions<K> {
    /// Room for the runs that are surely known, and as many again.
    pub fn new(capacity: usize) -> Self {
        Self { young: HashMap::with_capacity(capacity), old: HashMap::with_capacity(capacity), capacity }
    }

    /// The session of a key, and whether it begins.
    pub fn get(&mut self, key: K) -> (&mut Session, bool) {
        let mut begins = false;
        if !self.young.contains_key(&key) {
            let known = self.old.remove(&key);
            begins = known.is_none();
            if self.young.len() == self.capacity {
                std::mem::swap(&mut self.young, &mut self.old);
                self.young.clear();
            }
            return (self.young.entry(key).or_insert(known.unwrap_or_default()), begins);
        }
        (self.young.entry(key).or_default(), begins)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_runs_are_known_and_the_number_is_bounded() {
        let mut sessions = Sessions::new(4);
        for key in 0..100 {
            assert!(sessions.get(key).1, "run {key} is new");
            // the last four are known, whatever came before
            for known in (key - 3).max(0)..=key {
                assert!(!sessions.get(known).1, "run {known} is known after {key}");
            }
            assert!(sessions.young.len() + sessions.old.len() <= 8);
        }
        assert!(sessions.get(0).1, "the first was forgotten");
    }
}
