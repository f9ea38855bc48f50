//! A limit on what one line of the source writes to the log: whoever makes the server complain a thousand times a second
//! must not fill its disk.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use tracing::callsite::Identifier;
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::layer::{Context, Layer};
use wade::service::admin::AUDIT;

/// Lines of one kind that are written in each interval; further ones are counted.
const MOST: u32 = 10;
/// The interval, after which the count is written.
const INTERVAL: Duration = Duration::from_secs(10);

/// Where a line comes from, and how often it came in the interval.
#[derive(Debug)]
struct Kind {
    target: &'static str,
    line: u32,
    began: Instant,
    lines: u32,
}

/// The limit. Levels below INFO are written in full: somebody asked for them. So is what administrators did.
#[derive(Debug, Clone, Default)]
pub struct Limit {
    kinds: Arc<Mutex<HashMap<Identifier, Kind>>>,
}

impl Limit {
    /// Whether one more line of this kind is written.
    fn admits(&self, event: &Event<'_>, now: Instant) -> bool {
        let metadata = event.metadata();
        let mut kinds = self.kinds.lock().unwrap_or_else(PoisonError::into_inner);
        let kind = kinds.entry(metadata.callsite()).or_insert_with(|| Kind {
            target: metadata.target(),
            line: metadata.line().unwrap_or(0),
            began: now,
            lines: 0,
        });
        kind.lines = kind.lines.saturating_add(1);
        kind.lines <= MOST
    }

    /// How many lines were left out in intervals that are over, by where they come from.
    fn left_out(&self, now: Instant) -> Vec<(&'static str, u32, u32)> {
        let mut kinds = self.kinds.lock().unwrap_or_else(PoisonError::into_inner);
        let mut left_out = Vec::new();
        kinds.retain(|_, kind| {
            let over = now.saturating_duration_since(kind.began) >= INTERVAL;
            if over && kind.lines > MOST {
                left_out.push((kind.target, kind.line, kind.lines - MOST));
            }
            !over
        });
        left_out
    }

    /// Writes the counts for as long as the process lives.
    pub fn report(&self) -> std::io::Result<()> {
        let limit = self.clone();
        let thread = std::thread::Builder::new().name("wade-log".into());
        thread.spawn(move || {
            loop {
                std::thread::sleep(INTERVAL / 10);
                for (target, line, lines) in limit.left_out(Instant::now()) {
                    tracing::warn!(
                        lines,
                        "{target}, line {line}: further lines like those above were left out"
                    );
                }
            }
        })?;
        Ok(())
    }
}

impl<S: Subscriber> Layer<S> for Limit {
    fn event_enabled(&self, event: &Event<'_>, _: Context<'_, S>) -> bool {
        let metadata = event.metadata();
        *metadata.level() > Level::INFO || metadata.target() == AUDIT || self.admits(event, Instant::now())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use tracing_subscriber::prelude::*;

    use super::*;

    #[derive(Clone, Default)]
    struct Count(Arc<AtomicU32>);

    impl<S: Subscriber> Layer<S> for Count {
        fn on_event(&self, _: &Event<'_>, _: Context<'_, S>) {
            self.0.fetch_add(1, Ordering::Relaxed);
        }
    }

    #[test]
    fn a_flood_of_one_kind_is_cut_and_counted_and_another_kind_is_written() {
        let (limit, written) = (Limit::default(), Count::default());
        let subscriber = tracing_subscriber::registry().with(limit.clone()).with(written.clone());
        tracing::subscriber::with_default(subscriber, || {
            for index in 0..1000 {
                tracing::warn!(index, "a flood");
            }
            tracing::info!("something else");
            for _ in 0..100 {
                tracing::debug!("asked for");
                tracing::info!(target: AUDIT, "administration");
            }
        });
        assert_eq!(written.0.load(Ordering::Relaxed), MOST + 1 + 200);
        assert_eq!(limit.left_out(Instant::now()), []);
        let left_out = limit.left_out(Instant::now() + INTERVAL);
        assert_eq!(left_out.iter().map(|(.., lines)| *lines).collect::<Vec<_>>(), [1000 - MOST]);
    }
}
