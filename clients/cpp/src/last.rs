//! The last answer: written by one thread at a time, read by any, and neither waits for the other.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{RwLock, TryLockError};
use std::time::Instant;

use crate::abi::WadeForces;

/// A reader misses a place only where two answers came while it looked.
const LOOKS: u32 = 64;

/// Three places: the newest, which readers copy, and two to write the next one to, should a reader hold one of them.
pub struct Last {
    places: [RwLock<Answered>; 3],
    newest: AtomicUsize,
    count: AtomicU64,
}

struct Answered {
    forces: WadeForces,
    /// When the state was handed over that these answer; none where there was no answer yet.
    asked: Option<Instant>,
}

impl Last {
    /// No answer yet.
    pub fn new() -> Self {
        let place = || RwLock::new(Answered { forces: WadeForces::NONE, asked: None });
        Self { places: [place(), place(), place()], newest: AtomicUsize::new(0), count: AtomicU64::new(0) }
    }

    /// Makes this the last answer. Not to be called by two threads at a time.
    pub fn put(&self, mut forces: WadeForces, asked: Instant) {
        forces.answer = self.count.fetch_add(1, Ordering::Relaxed) + 1;
        let newest = self.newest.load(Ordering::Relaxed);
        for place in [(newest + 1) % 3, (newest + 2) % 3] {
            let mut slot = match self.places[place].try_write() {
                Ok(slot) => slot,
                Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
                // a reader was stopped in the middle of its copy
                Err(TryLockError::WouldBlock) => continue,
            };
            *slot = Answered { forces, asked: Some(asked) };
            drop(slot);
            self.newest.store(place, Ordering::Release);
            return;
        }
    }

    /// Copies the last answer, with its age.
    pub fn get(&self, forces: &mut WadeForces) {
        for _ in 0..LOOKS {
            let slot = match self.places[self.newest.load(Ordering::Acquire)].try_read() {
                Ok(slot) => slot,
                Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
                Err(TryLockError::WouldBlock) => continue,
            };
            *forces = slot.forces;
            if let Some(asked) = slot.asked {
                forces.age_ns = nanoseconds_since(asked);
            }
            return;
        }
        *forces = WadeForces::NONE;
    }
}

/// Time since an instant [ns].
pub fn nanoseconds_since(start: Instant) -> u64 {
    u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX - 1)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;
    use std::time::Duration;

    use super::*;
    use crate::abi::WADE_NEVER;

    fn forces(value: f32) -> WadeForces {
        WadeForces { force_n: [value; 3], added_mass: [value; 36], ..WadeForces::NONE }
    }

    #[test]
    fn before_the_first_answer_there_is_none() {
        let mut got = forces(3.0);
        Last::new().get(&mut got);
        assert_eq!((got.age_ns, got.answer, got.force_n), (WADE_NEVER, 0, [0.0; 3]));
    }

    #[test]
    fn the_age_is_that_of_the_question() {
        let (last, mut got) = (Last::new(), forces(0.0));
        last.put(forces(1.0), Instant::now() - Duration::from_secs(5));
        last.get(&mut got);
        assert!((5_000_000_000..60_000_000_000).contains(&got.age_ns), "{}", got.age_ns);
        assert_eq!((got.answer, got.force_n), (1, [1.0; 3]));
    }

    #[test]
    fn readers_see_whole_answers_in_order_while_a_writer_writes() {
        let (last, done) = (Last::new(), AtomicBool::new(false));
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    let (mut got, mut before) = (forces(0.0), 0);
                    while !done.load(Ordering::Relaxed) {
                        last.get(&mut got);
                        assert!(got.answer >= before, "an older answer after a newer one");
                        before = got.answer;
                        assert!(
                            got.added_mass.iter().all(|&value| value == got.force_n[0]),
                            "two answers in one"
                        );
                    }
                });
            }
            for number in 1..20_000 {
                last.put(forces(number as f32), Instant::now());
            }
            done.store(true, Ordering::Relaxed);
        });
    }
}
