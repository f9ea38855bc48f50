//! `wade soak`: a paced, open-loop load and its report.
//!
//! The load knows no transport: it calls a closure with a batch of states. Every request has an intended start
//! on a schedule fixed beforehand, and its response time counts from there, so that a stall delays all the
//! requests that were due in it (no coordinated omission). Service time counts from the actual send.
//!
//! Layout in reading order: `schedule` (when), `input` and `trace` (what), `load` (the measured loop), `record`
//! (its memory), `lateness` (whose fault a late send was), `hiccup` (the machine's own control), `slo` (the
//! verdict), `report` with `hlog`, `page` and `plot` (the files), `steps` (several rates), `compare` (two reports).

mod clock;
pub mod compare;
mod config;
mod duration;
mod hiccup;
pub mod hlog;
pub mod input;
mod lateness;
mod load;
mod machine;
mod page;
mod plot;
mod record;
pub mod report;
mod schedule;
mod slo;
pub mod steps;
mod trace;

pub use config::{Config, Pace};
pub use duration::{DurationError, parse_duration};
pub use input::{Domain, Input};
pub use load::{Ask, Clients, Progress, SendError, run, run_clients};
pub use report::Report;
pub use schedule::{Rate, RateError};
pub use slo::{Slo, SloError};
pub use trace::TraceError;
