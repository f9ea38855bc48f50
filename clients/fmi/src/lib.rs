//! A vehicle in the water as a functional mock-up unit: FMI 3.0, co-simulation, for tools that exchange models.
//!
//! One library serves two kinds of unit. What lies in its resources says which: a bundle, with which it answers by itself, or
//! the address of a server. `variables` is what a unit takes and gives, `description` says so in XML, `archive` packs it;
//! `instance` is one run of a simulator, and `exports` the functions of the standard around it.

mod archive;
mod description;
mod exports;
mod instance;
mod settings;
mod variables;

pub use archive::{Fmu, FmuError, LIBRARY, write};
pub use settings::Settings;
