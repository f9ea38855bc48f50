//! Promise: in whatever order threads meet, no latency is lost and none is counted twice. The table of sessions needs no such test:
//! one thread has it (`&mut`), which the compiler checks.

use std::sync::Arc;

use loom::thread;

mod sync {
    pub use loom::sync::{Mutex, MutexGuard};
}

#[allow(dead_code, reason = "the server reads more of it")]
#[path = "../../../src/metrics/exchange.rs"]
mod exchange;

use exchange::Exchange;

#[test]
fn what_is_recorded_while_windows_turn_is_counted_once() {
    loom::model(|| {
        let latencies = Arc::new(Exchange::new());
        let recording = {
            let latencies = Arc::clone(&latencies);
            thread::spawn(move || (1..=2).for_each(|ns| latencies.record(ns, 1)))
        };
        let turning = {
            let latencies = Arc::clone(&latencies);
            thread::spawn(move || latencies.rotate())
        };
        let seen = latencies.collect().since_start.len();
        assert!(seen <= 2);
        recording.join().expect("no panic");
        turning.join().expect("no panic");
        let accounts = latencies.collect();
        assert_eq!(accounts.since_start.len(), 2);
        assert_eq!(accounts.window.len() + accounts.last_window.len(), 2);
    });
}

#[test]
fn what_is_drained_by_two_is_drained_once() {
    loom::model(|| {
        let latencies = Arc::new(Exchange::new());
        let outside = Arc::new(loom::sync::atomic::AtomicU64::new(0));
        let recording = {
            let (latencies, outside) = (Arc::clone(&latencies), Arc::clone(&outside));
            thread::spawn(move || {
                outside.fetch_add(3, loom::sync::atomic::Ordering::Relaxed);
                latencies.record(1, 1);
            })
        };
        let drained = {
            let (latencies, outside) = (Arc::clone(&latencies), Arc::clone(&outside));
            move || latencies.drain(|| outside.load(loom::sync::atomic::Ordering::Relaxed))
        };
        let other = thread::spawn(drained.clone());
        let mut all = vec![drained(), other.join().expect("no panic")];
        recording.join().expect("no panic");
        all.push(drained());
        assert_eq!(all.iter().map(|(_, outside)| outside).sum::<u64>(), 3);
        assert_eq!(all.iter().flat_map(|(times, _)| times).map(|(_, count)| count).sum::<u64>(), 1);
    });
}
