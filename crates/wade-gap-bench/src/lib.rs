//! A blind benchmark of tools that name what a simulation lacks: trials with an effect hidden in them, and scores.
//!
//! The hidden effects are written apart from those of the library, by another formula or a finer model where there is
//! one, and this module uses neither. A tool is any closure from trials to an answer in the terms of `report.json`, so
//! that another program can be scored too. All trials that are written here are labelled generated.
//!
//! Words: the *floor* of a component is the root mean square of the gap of the same trials with nothing hidden in them;
//! the *strength* of an effect is the root mean square of its wrench over the floor, over the samples in which it acts
//! and the components that it acts on (`hidden::strength`).
//!
//! Reading order: `profile` (a quantity over time), `track` (the exact motion of a trial), `schedule` (which trials),
//! `hull` and `simulator` (the body and the prediction), `hidden` (effects), `noise` (what instruments make of it),
//! `case` (what is hidden where), `generate` (trials of a case), `folder` (their files), `answer` (what a tool says),
//! `score` and `baselines`; `real` turns published measurements into trials; `motion` is a benchmark of its own, of a
//! wrench that is inferred from the motion of a driven vehicle.

pub mod answer;
pub mod baselines;
pub mod case;
pub mod folder;
pub mod generate;
pub mod hidden;
mod hull;
mod invariance;
pub mod motion;
mod noise;
mod profile;
pub mod real;
mod region;
mod run;
mod schedule;
pub mod score;
mod simulator;
mod track;

pub use hull::Hull;
pub use noise::{Gaussian, NoiseKind};
pub use region::{Feature, Region};
pub use run::{Outcome, Progress, Setup, Tool, ToolError, command_tool, run};
pub use schedule::{Plan, Schedule};
pub use simulator::{Asked, Model, Modeled, Prediction, Simulator};
pub use track::{State, Track};

/// Force and moment about the center of mass, body frame, in the order of [`wade_learn::trials::WRENCH`] [N, N m].
pub type Wrench6 = nalgebra::Vector6<f64>;
