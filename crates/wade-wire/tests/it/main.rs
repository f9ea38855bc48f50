//! What the contract promises, a module a promise.

#![allow(clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;

mod shm_pages;
mod wire;
