//! Models that need no network: three fitted to the training states of one vehicle by least squares, and the physical base.

use nalgebra::{DMatrix, RowVector6};

use super::predict::{Prediction, served};
use super::states::State;
use wade_core::condition::Condition;
use wade_core::frame::{GRAVITY, Vec3, WaterPlane};
use wade_core::geometry::distance::signed_distances;
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::model::Model;
use wade_core::physics::Base;
use wade_core::physics::radiation::Radiation;
use wade_core::vehicle::Vehicle;
use wade_core::wrench::Wrench;

/// Cells along the shortest edge of the hull's box that pontoons are placed in.
const CELLS: f64 = 3.0;

/// Why a model cannot be fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BaselineError {
    /// No state to fit to.
    #[error("no training state of vehicle `{vehicle}`: its simple models cannot be fitted")]
    NoStates {
        /// The vehicle.
        vehicle: String,
    },
    /// No cell of the grid lies inside.
    #[error("no pontoon fits into the hull of `{vehicle}`")]
    NoPontoon {
        /// The vehicle.
        vehicle: String,
    },
}

/// A fitted model of one vehicle.
#[derive(Debug, Clone, PartialEq)]
pub enum Baseline {
    /// Exact hydrostatics and `-0.5 rho C W d |v| v` at half the depth, W the width and d the depth.
    Archimedes {
        /// C.
        drag: f64,
    },
    /// Spheres as game engines use them: each lifts with the volume of its cap under water, and drags with its cross
    /// section times the wet share of its volume. Together they have the volume of the hull.
    Pontoons {
        /// Centers [m].
        centers: Vec<Vec3>,
        /// Radius of each [m].
        radius: f64,
        /// Factor of the lift.
        lift: f64,
        /// Drag coefficient.
        drag: f64,
    },
    /// Constant coefficients as of marine craft (Fossen, Handbook of Marine Craft Hydrodynamics, 2011): linear and
    /// quadratic damping by surge and sway, restoring linear in depth; wrench over density about the center of mass.
    /// Added mass does not act in steady motion.
    Fossen {
        /// A row a term (1, d, u, v, u|u|, v|v|), a column a component of force and moment.
        coefficients: DMatrix<f64>,
        /// False where the data set has no moments to fit to.
        moments: bool,
    },
}

impl Baseline {
    /// All three.
    pub fn fit(vehicle: &Vehicle, training: &[&State]) -> Result<[Self; 3], BaselineError> {
        if training.is_empty() {
            return Err(BaselineError::NoStates { vehicle: vehicle.name.clone() });
        }
        let pontoons = pontoons(vehicle, training);
        let pontoons = pontoons.ok_or_else(|| BaselineError::NoPontoon { vehicle: vehicle.name.clone() })?;
        Ok([archimedes(vehicle, training), pontoons, fossen(vehicle, training)])
    }

    /// The name in reports.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Archimedes { .. } => "Archimedes + one drag constant",
            Self::Pontoons { .. } => "spherical pontoons",
            Self::Fossen { .. } => "constant coefficients (Fossen)",
        }
    }

    /// Net wrench about the center of mass.
    pub fn wrench(&self, vehicle: &Vehicle, condition: &Condition) -> Wrench {
        let about = &vehicle.center_of_mass;
        match self {
            Self::Archimedes { drag } => {
                let at = Vec3::new(0.0, 0.0, vehicle.z0 + 0.5 * condition.depth);
                let drag = unit_drag(vehicle, condition) * *drag;
                rest(vehicle, condition) + Wrench::from_force_at(drag, &at, about)
            }
            Self::Pontoons { centers, radius, lift, drag } => {
                let (mut sum, up) = (Wrench::default(), condition.up.into_inner());
                for (center, volume) in wet(vehicle, condition, centers, *radius) {
                    let force = up * (lift * condition.density * GRAVITY * volume)
                        + sphere_drag(condition, volume, *radius) * *drag;
                    sum += Wrench::from_force_at(force, center, about);
                }
                sum
            }
            Self::Fossen { coefficients, .. } => {
                let row = terms(condition) * coefficients * condition.density;
                Wrench { force: Vec3::new(row[0], row[1], row[2]), moment: Vec3::new(row[3], row[4], row[5]) }
            }
        }
    }

    /// What it says of states.
    pub fn predict(&self, vehicle: &Vehicle, states: &[&State]) -> Vec<Prediction> {
        let moments = !matches!(self, Self::Fossen { moments: false, .. });
        let predict = |state: &&State| {
            let Wrench { force, moment } = self.wrench(vehicle, &state.condition);
            let moment = moments.then_some(moment);
            Prediction { force, moment, surface_errors: Vec::new(), uncertainty: None }
        };
        states.iter().map(predict).collect()
    }
}

/// The name of [`known`] in reports.
pub const KNOWN: &str = "known physics alone";

/// What the physical base says of states, which the `anchored` weights are a remainder of.
pub fn known(vehicle: &Vehicle, states: &[&State]) -> Vec<Prediction> {
    let base = Base::new(vehicle, Radiation::estimate(vehicle));
    let model = Model::of_physics(vehicle.clone(), 0, base);
    let known =
        |prediction: Prediction| Prediction { surface_errors: Vec::new(), uncertainty: None, ..prediction };
    served(&model, states).into_iter().map(known).collect()
}

/// The load of still water about the center of mass.
pub(super) fn rest(vehicle: &Vehicle, condition: &Condition) -> Wrench {
    let loads = vehicle.at_rest(condition).into_iter();
    loads.fold(Wrench::default(), |sum, load| sum + load).moved(&Vec3::zeros(), &vehicle.center_of_mass)
}

/// Drag for a coefficient of 1.
fn unit_drag(vehicle: &Vehicle, condition: &Condition) -> Vec3 {
    let v = horizontal(condition);
    v * (-0.5 * condition.density * vehicle.dimensions.width * condition.depth * v.norm())
}

fn horizontal(condition: &Condition) -> Vec3 {
    Vec3::new(condition.velocity.x, condition.velocity.y, 0.0)
}

/// The factor with which `of` comes nearest to `to` over all pairs.
fn factor(pairs: impl Iterator<Item = (Vec3, Vec3)>) -> f64 {
    let (product, square) = pairs
        .fold((0.0, 0.0), |(product, square), (of, to)| (product + of.dot(&to), square + of.norm_squared()));
    if square > 0.0 { product / square } else { 0.0 }
}

fn planar(force: Vec3) -> Vec3 {
    Vec3::new(force.x, force.y, 0.0)
}

fn archimedes(vehicle: &Vehicle, training: &[&State]) -> Baseline {
    let pair = |state: &&State| {
        let dynamic = state.force() - rest(vehicle, &state.condition).force;
        (unit_drag(vehicle, &state.condition), planar(dynamic))
    };
    Baseline::Archimedes { drag: factor(training.iter().map(pair)) }
}

fn pontoons(vehicle: &Vehicle, training: &[&State]) -> Option<Baseline> {
    let bounds = vehicle.hull.mesh.bounds()?;
    let size = bounds.max - bounds.min;
    let cell = size.min() / CELLS;
    let counts = size.map(|length| (length / cell).round().max(1.0));
    let mut centers = Vec::new();
    for i in 0..(counts.x * counts.y * counts.z) as usize {
        let (nx, ny) = (counts.x as usize, counts.y as usize);
        let place = Vec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64);
        let center = bounds.min + (place.add_scalar(0.5)).component_div(&counts).component_mul(&size);
        centers.push(center);
    }
    let inside = signed_distances(&vehicle.hull.mesh, &centers).ok()?;
    let mut inside = inside.into_iter().map(|distance| distance < 0.0);
    centers.retain(|_| inside.next().unwrap_or(false));
    let under = WaterPlane::level(vehicle.z0, 10.0 * size.norm());
    let volume = hydrostatics(&vehicle.hull.mesh, &under, 1.0, &Vec3::zeros()).displaced_volume;
    if centers.is_empty() {
        return None;
    }
    let radius = (volume / centers.len() as f64 * 0.75 / std::f64::consts::PI).cbrt();
    let lift = |state: &&State| {
        let c = &state.condition;
        let volume: f64 = wet(vehicle, c, &centers, radius).map(|(_, volume)| volume).sum();
        (Vec3::z() * (c.density * GRAVITY * volume), Vec3::z() * state.force().z)
    };
    let drag = |state: &&State| {
        let c = &state.condition;
        let drag = wet(vehicle, c, &centers, radius).map(|(_, volume)| sphere_drag(c, volume, radius)).sum();
        (drag, planar(state.force()))
    };
    let (lift, drag) = (factor(training.iter().map(lift)), factor(training.iter().map(drag)));
    Some(Baseline::Pontoons { centers, radius, lift, drag })
}

/// Each sphere with its volume under water: a cap of height h has `pi h^2 (3 r - h) / 3`.
fn wet<'a>(
    vehicle: &Vehicle,
    condition: &Condition,
    centers: &'a [Vec3],
    radius: f64,
) -> impl Iterator<Item = (&'a Vec3, f64)> {
    let plane = condition.water_plane(vehicle.z0);
    centers.iter().map(move |center| {
        let height = (plane.depth_below(center) + radius).clamp(0.0, 2.0 * radius);
        (center, std::f64::consts::PI * height.powi(2) * (3.0 * radius - height) / 3.0)
    })
}

/// `-0.5 rho pi r^2 |v| v` times the wet share of the sphere.
fn sphere_drag(condition: &Condition, volume: f64, radius: f64) -> Vec3 {
    let share = volume / (4.0 / 3.0 * std::f64::consts::PI * radius.powi(3));
    let v = horizontal(condition);
    v * (-0.5 * condition.density * std::f64::consts::PI * radius.powi(2) * share * v.norm())
}

fn terms(condition: &Condition) -> RowVector6<f64> {
    let (u, v) = (condition.velocity.x, condition.velocity.y);
    RowVector6::new(1.0, condition.depth, u, v, u * u.abs(), v * v.abs())
}

fn fossen(vehicle: &Vehicle, training: &[&State]) -> Baseline {
    let wrench = |state: &State| {
        let density = state.condition.density;
        let moment = state.moment(&vehicle.center_of_mass).unwrap_or_default();
        (state.force() / density, moment / density)
    };
    let wrenches: Vec<(Vec3, Vec3)> = training.iter().map(|state| wrench(state)).collect();
    let (mut normal, mut right) = (DMatrix::zeros(6, 6), DMatrix::zeros(6, 6));
    for (state, (force, moment)) in training.iter().zip(&wrenches) {
        let row = terms(&state.condition);
        let wrench = RowVector6::from_iterator(force.iter().chain(moment).copied());
        normal += row.transpose() * row;
        right += row.transpose() * wrench;
    }
    // a term that never varies, as sway of cases that all go ahead, has no coefficient: the pseudo-inverse gives it none
    let largest = normal.iter().fold(0.0_f64, |largest: f64, x: &f64| largest.max(x.abs()));
    let inverse = normal.pseudo_inverse(1e-12 * largest).unwrap_or_else(|_| DMatrix::zeros(6, 6));
    let moments = training.iter().all(|state| state.moment(&vehicle.center_of_mass).is_some());
    Baseline::Fossen { coefficients: inverse * right, moments }
}
