//! Arbitrary bytes for everything that wade reads of others.
//!
//! A target takes bytes, does with them what the program does with bytes from outside, and panics where a promise is broken: an
//! answer that is no number, a connection that never ends, a file that is read and cannot be written. Whatever panics below
//! it is caught as well, on any thread ([`panics`]). `./run` has libFuzzer look for such bytes; those that were
//! found, and a few that lead far into the code, lie in `corpus` and are replayed by `cargo test`.

mod bundle;
#[path = "../../common/bundles.rs"]
mod bundles;
mod calls;
mod dataset;
mod frames;
mod http;
mod page;
pub mod panics;
mod robot;
mod server;
mod state;
mod stl;
mod trials;

pub use frames::pause_by;

/// One place where bytes of others are read.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    /// Its name, and that of its folder in `corpus`.
    pub name: &'static str,
    /// What is done with the bytes.
    pub run: fn(&[u8]),
    /// Bytes that are sound, to begin with.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Longest input that is tried [bytes].
    pub longest: usize,
}

/// All of them.
pub const TARGETS: [Target; 10] = [
    Target { name: "state", run: state::run, seeds: state::seeds, longest: 4 << 10 },
    Target { name: "calls", run: calls::run, seeds: calls::seeds, longest: 16 << 10 },
    Target { name: "frames", run: frames::run, seeds: frames::seeds, longest: 4 << 10 },
    Target { name: "http", run: http::run, seeds: http::seeds, longest: 4 << 10 },
    Target { name: "page", run: page::run, seeds: page::seeds, longest: page::LONGEST },
    Target { name: "bundle", run: bundle::run, seeds: bundle::seeds, longest: 16 << 10 },
    Target { name: "stl", run: stl::run, seeds: stl::seeds, longest: 8 << 10 },
    Target { name: "robot", run: robot::run, seeds: robot::seeds, longest: 8 << 10 },
    Target { name: "trials", run: trials::run, seeds: trials::seeds, longest: 8 << 10 },
    Target { name: "dataset", run: dataset::run, seeds: dataset::seeds, longest: 32 << 10 },
];

/// A target by name.
pub fn target(name: &str) -> Option<Target> {
    TARGETS.into_iter().find(|target| target.name == name)
}
