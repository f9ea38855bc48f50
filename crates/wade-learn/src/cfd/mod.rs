//! A CFD campaign with OpenFOAM: plan the cases, run them, collect per-surface forces into a data set, report.
//!
//! Reading order: `plan` (the folder of a campaign), `sets` and `drive` (which states), `openfoam` (the solver that is installed, its version and its faults),
//! `placement` (the vehicle in the channel), `mesh` (channel and refinement), `case` (the files of one case),
//! `poly_mesh` (the hull that the mesh really has and its load at rest), `solve` and `gauges` (one case from mesh to section
//! averages), `claim` (one process a case), `run` (many at a time, resumable), `collect`, `means` and `backwater` (the data set), `report`, `trials` (cases as trials for `wade gap`),
//! `slurm`.
//!
//! The frame of a case: x forward along the vehicle's velocity through the water, y left, z up, bed at z = 0; the
//! vehicle is at rest, yawed by its heading, and the water comes along -x.

pub mod backwater;
pub mod case;
pub mod claim;
pub mod collect;
pub mod drive;
mod foreword;
pub mod gauges;
pub mod means;
pub mod mesh;
pub mod openfoam;
pub mod placement;
pub mod plan;
pub mod poly_mesh;
pub mod report;
pub mod run;
mod sets;
pub mod slurm;
pub mod solve;
pub mod trials;
