//! Stops the library of repair and union when it takes too long.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use manifold_rust::cancel::CancelToken;

use crate::limits::MOST_UNION_SECONDS;

/// How often the clock is looked at.
const STEP: Duration = Duration::from_millis(50);

/// Runs until it is dropped.
pub struct Watch {
    token: Arc<CancelToken>,
    done: Arc<AtomicBool>,
}

impl Watch {
    /// Starts the clock.
    pub fn start() -> Self {
        let watch = Self { token: Arc::new(CancelToken::new()), done: Arc::new(AtomicBool::new(false)) };
        let (token, done) = (Arc::clone(&watch.token), Arc::clone(&watch.done));
        let limit = Instant::now() + Duration::from_secs(MOST_UNION_SECONDS);
        std::thread::spawn(move || {
            while !done.load(Ordering::Relaxed) {
                if Instant::now() > limit {
                    return token.cancel();
                }
                std::thread::sleep(STEP);
            }
        });
        watch
    }

    /// What the library asks.
    pub fn token(&self) -> &CancelToken {
        &self.token
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.done.store(true, Ordering::Relaxed);
    }
}
