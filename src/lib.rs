//! The server: what serves the vehicles over gRPC, HTTP and shared memory, and the soak that measures it. The command is in
//! `cli`; the forces come from `wade-core`, the contract with clients is `wade-wire`.
//!
//! Modules in reading order; each uses only those above it: the vehicles that are served ([`engine`]) and the [`metrics`], the
//! transports ([`service`]), the settings ([`config`]) and the server as a whole ([`server`]); beside them the table of
//! states that a file holds ([`states`]), and load with its measurement ([`cores`], [`soak`]).

pub mod engine;
pub mod metrics;

pub mod service;

pub mod config;
pub mod server;

pub mod cores;
pub mod soak;
pub mod states;
