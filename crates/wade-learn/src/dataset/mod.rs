//! Data sets: loads on each surface of a vehicle with the state that they belong to, from CFD or by formula.
//!
//! Body frame FLU, SI units. A *case* is one run of a solver; a *sample* is the average over one section of its
//! history, or a mirror image of that. Reading order: `check` (what holds for every data set), `schema`, `file`, `encode`,
//! `pages` and `decode` (Parquet), `history` and `sections` (force histories and their averages), `openfoam` and `fluent` (the solvers'
//! files), `case` and `import` (a folder of cases), `label` (loads with the hull's own hydrostatics), `mirror` (augmentation), `split`, `merge`, `analytic`, `summary`, `page`.

pub mod analytic;
pub mod case;
mod check;
mod decode;
mod encode;
mod file;
pub mod fluent;
pub mod history;
pub mod import;
pub mod label;
pub mod lift;
mod lines;
mod merge;
pub mod mirror;
pub mod openfoam;
pub mod page;
mod pages;
mod schema;
pub mod sections;
pub mod split;
pub mod summary;
mod table;
mod thrift;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::{Deserialize, Serialize};

pub use check::Flaw;
pub use file::{DatasetError, FORMAT, Fault, read, write, write_compact};
pub use lines::{CutOff, LineError};
pub use merge::MergeError;

use wade_core::condition::{Condition, GroundContact};
use wade_core::frame::Vec3;

/// Below this speed the motion has no direction [m/s].
const DIRECTION_SPEED: f64 = 1e-6;

/// Samples and what holds for all of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// What holds for all samples.
    pub meta: Meta,
    /// The samples.
    pub samples: Vec<Sample>,
}

/// What holds for a data set as a whole.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Meta {
    /// Where the loads come from: a solver with its version, or "analytic".
    pub provenance: String,
    /// Convention of the static part of the loads; that of every sample.
    pub ground_contact: GroundContact,
    /// Surfaces of each vehicle, in the order of a sample's loads.
    pub vehicles: BTreeMap<String, Vec<String>>,
    /// Anything else that a reader should know.
    #[serde(default)]
    pub notes: BTreeMap<String, String>,
}

/// The average over one section of one case, or a mirror image of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Name of the case, unique over the data set: what a split keeps together.
    pub case: String,
    /// Name of the set that the case was planned in: "paper", "wide", "driving".
    pub set: String,
    /// Which mirror image of the case it is.
    pub image: Image,
    /// Number of the section, from 0.
    pub section: u32,
    /// Start of the section in the case's own time [s].
    pub start_s: f64,
    /// End of the section [s]; that of the start where the loads are steady.
    pub end_s: f64,
    /// The state; velocities are the vehicle's, body frame.
    pub condition: Condition,
    /// Load on each surface, in the order of [`Meta::vehicles`].
    pub surfaces: Vec<SurfaceLoad>,
}

/// The load on one surface, body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceLoad {
    /// Pressure and viscous force [N].
    pub force: Vec3,
    /// Moment of that force about the body origin [N m].
    pub moment: Option<Vec3>,
    /// The viscous part of the force [N].
    pub viscous: Option<Vec3>,
    /// The hydrostatic load on the case's own mesh.
    pub rest: Option<Rest>,
}

/// The load on a surface of the case's own mesh at rest: what is left without it is dynamic. Body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rest {
    /// Force [N].
    pub force: Vec3,
    /// Moment about the body origin [N m].
    pub moment: Vec3,
}

wade_core::named_enum! {
    /// Which mirror image of a case a sample is.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Image {
        /// As it was computed.
        Original => "original",
        /// Reflected across the plane y = 0.
        LeftRight => "left_right",
        /// Reflected across the plane x = 0.
        FrontRear => "front_rear",
        /// Reflected across both.
        Both => "both",
    }
}

impl fmt::Display for Image {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Sample {
    /// Sum of the forces on all surfaces, body frame [N].
    pub fn net_force(&self) -> Vec3 {
        self.surfaces.iter().map(|load| load.force).sum()
    }

    /// Angle of the motion through the water from the lateral axis [degrees]: 90 ahead or astern, 0 to either side, the
    /// same for every mirror image; `None` at rest.
    pub fn flow_angle_deg(&self) -> Option<f64> {
        let v = &self.condition.velocity;
        (v.x.hypot(v.y) > DIRECTION_SPEED).then(|| v.x.abs().atan2(v.y.abs()).to_degrees())
    }
}

/// The sections of one flow each: places in a list by case, image and condition, which tells the sections of an unsteady case
/// apart.
pub fn flows<'a>(sections: impl Iterator<Item = (&'a str, Image, &'a Condition)>) -> Vec<Vec<usize>> {
    let mut flows: Vec<(&Condition, Vec<usize>)> = Vec::new();
    let mut last: BTreeMap<(&str, Image), usize> = BTreeMap::new();
    for (place, (case, image, condition)) in sections.enumerate() {
        match last.get(&(case, image)).filter(|&&flow| flows[flow].0 == condition) {
            Some(&flow) => flows[flow].1.push(place),
            None => {
                last.insert((case, image), flows.len());
                flows.push((condition, vec![place]));
            }
        }
    }
    flows.into_iter().map(|(_, places)| places).collect()
}

impl Dataset {
    /// The samples of these numbers, in that order, with the same meta data.
    pub fn subset(&self, samples: &[usize]) -> Self {
        Self { meta: self.meta.clone(), samples: samples.iter().map(|&i| self.samples[i].clone()).collect() }
    }

    /// Cases of which some surface has no moment, by name.
    pub fn without_moments(&self) -> BTreeSet<&str> {
        let lacks = |sample: &&Sample| sample.surfaces.iter().any(|surface| surface.moment.is_none());
        self.samples.iter().filter(lacks).map(|sample| sample.case.as_str()).collect()
    }
}
