//! What the server and the command promise, a module a promise. Tests that need a process of their own are beside this one.

#![allow(clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;

mod access;
mod balanced;
mod campaign;
mod campaign_trials;
mod cli;
mod config;
mod dataset_import;
mod deploy;
mod distance;
mod effects_transports;
mod evaluate;
mod gap_apply;
mod gap_bench;
mod gap_cli;
mod gap_served;
mod grpc;
mod http;
mod import;
mod inference;
mod install;
mod jacobian;
mod page;
mod reload;
mod sea;
mod shipped_weights;
mod shm;
mod soak;
mod soak_transports;
mod stability;
mod start_log;
mod traces;
mod training;
mod validate;
mod wheels;
