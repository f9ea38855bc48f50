//! Whose fault a late send was.

use super::{record::Counts, schedule::Rate};

/// What the generator may spend between an answer and the next send without being called late [ns]: reading the
/// clock, recording, filling in the next states.
const BOOKKEEPING_NS: u64 = 1_000;

/// The generator is late when 1 % of its sends are later, by its own fault, than this share of the interval.
const SHARE_OF_INTERVAL: f64 = 0.1;

/// The share is never read as more than this, however low the rate [ns].
const LONGEST_NS: f64 = 1e6;

/// A generator that is never held up, fed with the service times that were measured.
///
/// It sends a request when it is due or, behind a slow server, when the one before has been answered. What the
/// real one is later than that is its own delay. Simulated along, because after a stall of its own the requests
/// that pile up are its fault too, though each of them waited for the answer before.
#[derive(Debug, Default)]
pub(super) struct Ideal {
    free_at: u64,
}

impl Ideal {
    /// The generator's own share of a send's lag [ns], from the times of one request [ns].
    pub(super) fn own_lag(&mut self, intended: u64, sent: u64, done: u64) -> u64 {
        let send = intended.max(self.free_at);
        self.free_at = send + (done - sent) + BOOKKEEPING_NS;
        sent.saturating_sub(send)
    }
}

/// The longest p99 of the generator's own lag that is not late [us]; none in a closed loop.
pub(super) fn limit_us(rate: Rate) -> Option<f64> {
    rate.interval_ns().map(|interval| (interval * SHARE_OF_INTERVAL).min(LONGEST_NS) * 1e-3)
}

/// True when the generator was late by its own fault.
pub(super) fn is_late(rate: Rate, own_lag: &Counts) -> bool {
    limit_us(rate).is_some_and(|limit| own_lag.value_at_quantile(0.99) as f64 * 1e-3 > limit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_for_a_slow_server_is_not_the_generators_fault() {
        let mut ideal = Ideal::default();
        let mut now = 0;
        for index in 0..1000 {
            let sent = now.max(index * 1_000_000) + 200;
            now = sent + 3_000_000;
            assert!(ideal.own_lag(index * 1_000_000, sent, now) <= 200);
        }
    }

    #[test]
    fn requests_that_piled_up_in_its_own_stall_are() {
        let mut ideal = Ideal::default();
        let stall = 50_000_000;
        let mut now = stall;
        for index in 0..40 {
            let due = index * 1_000_000;
            let sent = now;
            now = sent + 10_000;
            let own = ideal.own_lag(due, sent, now);
            assert!(own >= stall - due, "request {index}: {own} ns");
        }
    }

    #[test]
    fn the_limit_is_a_share_of_the_interval_up_to_a_millisecond() {
        assert_eq!(limit_us(Rate::Hz(1000.0)), Some(100.0));
        assert_eq!(limit_us(Rate::Hz(1.0)), Some(1000.0));
        assert_eq!(limit_us(Rate::Max), None);
    }
}
