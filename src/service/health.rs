//! Which transports answer, and whether that is enough for the server to call itself ready.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};
use tokio::sync::watch;

use crate::metrics::Metrics;

wade_core::named_enum! {
    /// A transport that can be up or down by itself.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum Part {
        /// gRPC over TCP and the Unix socket.
        Grpc => "grpc",
        /// HTTP.
        Http => "http",
        /// Shared memory.
        Shm => "shared_memory",
    }
}

/// When the server calls itself ready.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Transports that have to answer.
    pub require: Vec<Part>,
}

impl Default for Config {
    fn default() -> Self {
        Self { require: vec![Part::Grpc] }
    }
}

/// The state of one transport.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum State {
    /// It is turned off by the configuration.
    #[default]
    Off,
    /// It has not answered yet.
    Starting,
    /// It answers.
    Ok,
    /// It does not answer, with the reason.
    Unavailable(String),
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Off => f.write_str("off"),
            Self::Starting => f.write_str("starting"),
            Self::Ok => f.write_str("ok"),
            Self::Unavailable(reason) => write!(f, "unavailable: {reason}"),
        }
    }
}

/// The state of every transport, shared by those that report it and those that ask.
#[derive(Debug)]
pub struct Health {
    required: Vec<Part>,
    parts: Mutex<Parts>,
    metrics: Arc<Metrics>,
    changes: watch::Sender<()>,
}

#[derive(Debug, Default)]
struct Parts {
    /// The vehicles are loaded and the server does not drain.
    serving: bool,
    /// By [`Part`].
    states: [State; Part::ALL.len()],
}

/// What a probe reads.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Report {
    /// Whether everything required answers.
    pub ready: bool,
    /// As [`State`] is displayed.
    pub grpc: String,
    /// As [`State`] is displayed.
    pub http: String,
    /// As [`State`] is displayed.
    pub shared_memory: String,
}

impl Health {
    /// Nothing is served yet, and every transport is off.
    pub fn new(config: &Config, metrics: Arc<Metrics>) -> Self {
        let required = config.require.clone();
        Self { required, parts: Mutex::default(), metrics, changes: watch::Sender::new(()) }
    }

    /// States whether vehicles are served at all: false before they are loaded and while the server drains.
    pub fn set_serving(&self, serving: bool) {
        self.parts().serving = serving;
        self.changes.send_replace(());
    }

    /// Reports the state of a transport; a change is logged and counted.
    pub fn set(&self, part: Part, state: State) {
        let mut parts = self.parts();
        let place = &mut parts.states[part as usize];
        if *place == state {
            return;
        }
        let before = std::mem::replace(place, state.clone());
        drop(parts);
        self.metrics.set_transport_up(part.name(), state == State::Ok);
        let transport = part.name();
        match (&before, &state) {
            (_, State::Unavailable(reason)) => tracing::warn!(transport, reason, "unavailable"),
            (State::Unavailable(_), State::Ok) => tracing::info!(transport, "available again"),
            _ => {}
        }
        self.changes.send_replace(());
    }

    /// The state of a transport.
    pub fn state(&self, part: Part) -> State {
        self.parts().states[part as usize].clone()
    }

    /// Whether vehicles are served and everything that is required and turned on answers.
    pub fn is_ready(&self) -> bool {
        self.parts().is_ready(&self.required)
    }

    /// Whether vehicles are served at all.
    pub fn is_serving(&self) -> bool {
        self.parts().serving
    }

    /// Everything at one moment.
    pub fn report(&self) -> Report {
        let parts = self.parts();
        let [grpc, http, shared_memory] = parts.states.each_ref().map(ToString::to_string);
        Report { ready: parts.is_ready(&self.required), grpc, http, shared_memory }
    }

    /// Marks a change for everybody who waits for one.
    pub fn changes(&self) -> watch::Receiver<()> {
        self.changes.subscribe()
    }

    /// The states are sound even if a thread panicked while it held the lock.
    fn parts(&self) -> MutexGuard<'_, Parts> {
        self.parts.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Parts {
    fn is_ready(&self, required: &[Part]) -> bool {
        let answers = |part: &Part| matches!(self.states[*part as usize], State::Ok | State::Off);
        self.serving && required.iter().all(answers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_required_decides() {
        let down = || State::Unavailable("no room".into());
        for (require, ready) in [(vec![Part::Grpc], true), (vec![Part::Grpc, Part::Shm], false)] {
            let health = Health::new(&Config { require }, Arc::new(Metrics::new()));
            health.set(Part::Grpc, State::Ok);
            health.set(Part::Shm, down());
            assert!(!health.is_ready(), "no vehicle is served yet");
            health.set_serving(true);
            let report = health.report();
            assert_eq!((report.ready, report.shared_memory.as_str()), (ready, "unavailable: no room"));
            health.set(Part::Grpc, down());
            assert!(!health.is_ready());
        }
    }
}
