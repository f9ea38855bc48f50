//! Locks that are waited for until a deadline.

use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};

/// The time that one call may take.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    /// When the call began.
    pub start: Instant,
    /// When it must return.
    pub deadline: Instant,
}

/// Tries between two looks at the clock; whoever holds a lock for a copy is done by then.
const TRIES: u32 = 100;
/// Longest sleep between tries: whoever holds a lock for a question keeps it for tens of microseconds at least.
pub const PAUSE: Duration = Duration::from_micros(50);

/// The lock, unless somebody holds it until the deadline. One that has passed means a few tries.
///
/// What a thread left that panicked is still good: every value behind these locks is whole at any time.
pub fn lock_until<T>(mutex: &Mutex<T>, deadline: Instant) -> Option<MutexGuard<'_, T>> {
    loop {
        for _ in 0..TRIES {
            match mutex.try_lock() {
                Ok(guard) => return Some(guard),
                Err(TryLockError::Poisoned(poisoned)) => return Some(poisoned.into_inner()),
                Err(TryLockError::WouldBlock) => std::hint::spin_loop(),
            }
        }
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return None;
        }
        std::thread::sleep(left.min(PAUSE));
    }
}

/// The lock, for threads that have time.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn a_lock_that_is_held_is_given_up_at_the_deadline() {
        let mutex = Mutex::new(7);
        let held = lock(&mutex);
        for budget in [Duration::ZERO, Duration::from_millis(20)] {
            let start = Instant::now();
            std::thread::scope(|scope| {
                scope.spawn(|| assert!(lock_until(&mutex, start + budget).is_none())).join().unwrap();
            });
            assert!(start.elapsed() >= budget);
        }
        drop(held);
        assert_eq!(lock_until(&mutex, Instant::now()).as_deref(), Some(&7));
    }
}
