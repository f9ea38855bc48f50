//! What a soak is asked to do.

use std::{num::NonZeroUsize, time::Duration};

use super::{schedule::Rate, slo::Slo};

/// How a client waits until its next request is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Pace {
    /// It reads the clock without pause, on a core that it has to itself: the request leaves in time.
    #[default]
    Spin,
    /// It sleeps, and leaves the core to others: the request leaves some 0.05 ms late.
    Sleep,
}

/// One soak.
#[derive(Debug, Clone, PartialEq)]
pub struct Config {
    /// Name of the vehicle, for the report; several with commas between.
    pub vehicle: String,
    /// Name of the transport, for the report.
    pub transport: String,
    /// How often a request is due, of all clients together.
    pub rate: Rate,
    /// Clients that ask at the same time, each from a thread of its own.
    pub clients: NonZeroUsize,
    /// Length of the measured part.
    pub duration: Duration,
    /// Load before the measured part, recorded apart.
    pub warm_up: Duration,
    /// States in a request.
    pub batch: NonZeroUsize,
    /// How a client waits until its next request is due.
    pub pace: Pace,
    /// What the response time must hold.
    pub slo: Vec<Slo>,
    /// The core on which the machine's control sleeps; by default where the system puts it. Best is the core of
    /// the thread that calls `run`: that one idles between requests, when the control wakes.
    pub control_core: Option<usize>,
    /// Commit of the build, for the report.
    pub commit: String,
}

impl Pace {
    /// Its word in the report.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Spin => "spin",
            Self::Sleep => "sleep",
        }
    }
}

impl Default for Config {
    fn default() -> Self {
        Self {
            vehicle: String::new(),
            transport: String::new(),
            rate: Rate::Hz(1000.0),
            clients: NonZeroUsize::MIN,
            duration: Duration::from_secs(300),
            warm_up: Duration::from_secs(5),
            batch: NonZeroUsize::MIN,
            pace: Pace::default(),
            slo: Vec::new(),
            control_core: None,
            commit: String::new(),
        }
    }
}

impl Config {
    /// How often a request of one client is due.
    pub(super) fn rate_of_client(&self) -> Rate {
        match self.rate {
            Rate::Hz(hz) => Rate::Hz(hz / self.clients.get() as f64),
            Rate::Max => Rate::Max,
        }
    }
}
