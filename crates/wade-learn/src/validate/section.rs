//! What the predicted forces are, on the mean, in each planar section.

use serde::Serialize;

use super::planar::{NotPlanar, planar_section, speed_squared};
use super::{Config, ValidateError};
use crate::trials::{Trial, Trials};
use wade_core::condition::Condition;
use wade_core::frame::{Vec3, level_axes};

/// The answer of whatever is being tested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Net force, body frame [N].
    pub force: Vec3,
    /// False where the state lies outside what the answer was made for.
    pub in_domain: bool,
}

/// One planar section: one point of each test.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Section {
    /// Name of the trial.
    pub trial: String,
    /// First sample [s].
    pub start_s: f64,
    /// Last sample [s].
    pub end_s: f64,
    /// Number of samples.
    pub samples: usize,
    /// Mean depth as measured in motion [m].
    pub measured_depth_m: f64,
    /// Depth of the fill, measured at rest, where it is known; else the one above [m].
    pub depth_m: f64,
    /// Mean density [kg/m3].
    pub density_kgpm3: f64,
    /// Mean squared horizontal speed [m2/s2].
    pub speed_squared_m2ps2: f64,
    /// Mean of the magnitude of the predicted Fx [N].
    pub drag_n: f64,
    /// Mean predicted force along the direction of travel [N]; negative for drag.
    pub along_motion_n: f64,
    /// Mean predicted Fz [N].
    pub fz_n: f64,
    /// Share of the samples within what the answer was made for.
    pub in_domain: f64,
}

impl Section {
    /// Root of the mean squared speed [m/s].
    pub fn speed(&self) -> f64 {
        self.speed_squared_m2ps2.sqrt()
    }

    /// Mean drag over mean squared speed [N s2/m2].
    pub fn c_d_eff(&self) -> f64 {
        self.drag_n / self.speed_squared_m2ps2
    }
}

/// A trial without a planar section.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// Name of the trial.
    pub trial: String,
    /// Why, in words.
    pub why: String,
}

/// Predicts every sample of every planar section of a vehicle whose ground-contact plane is at `z0` [m].
pub fn sections(
    trials: &Trials,
    z0: f64,
    config: &Config,
    predict: &mut dyn FnMut(&Condition) -> Prediction,
) -> Result<(Vec<Section>, Vec<LeftOut>), ValidateError> {
    let (mut found, mut left_out) = (Vec::new(), Vec::new());
    for trial in &trials.trials {
        let states: Vec<Condition> =
            (0..trial.len()).map(|i| trial.condition(i, config.ground_contact, z0)).collect();
        let depths: Vec<f64> = states.iter().map(|state| state.depth).collect();
        match planar_section(trial, &depths, &config.planar) {
            Ok(samples) => {
                let nominal = trials.manifest.nominal_depth.get(&trial.name).copied();
                found.push(section(trial, &states, samples, nominal, predict)?);
            }
            Err(why) => left_out.push((trial.name.clone(), why)),
        }
    }
    match left_out.first() {
        Some((trial, why)) if found.is_empty() => Err(no_section(trial, why, left_out.len())),
        _ => {
            let named = |(trial, why): (String, NotPlanar)| LeftOut { trial, why: why.to_string() };
            Ok((found, left_out.into_iter().map(named).collect()))
        }
    }
}

fn no_section(trial: &str, why: &NotPlanar, trials: usize) -> ValidateError {
    ValidateError::NoSection { trials, trial: trial.to_owned(), why: why.clone() }
}

fn section(
    trial: &Trial,
    states: &[Condition],
    samples: std::ops::Range<usize>,
    nominal_depth: Option<f64>,
    predict: &mut dyn FnMut(&Condition) -> Prediction,
) -> Result<Section, ValidateError> {
    let n = samples.len() as f64;
    let mean = |values: &[f64]| values[samples.clone()].iter().sum::<f64>() / n;
    let measured_depth_m = states[samples.clone()].iter().map(|state| state.depth).sum::<f64>() / n;
    let mut sum = Section {
        trial: trial.name.clone(),
        start_s: trial.t[samples.start],
        end_s: trial.t[samples.end - 1],
        samples: samples.len(),
        measured_depth_m,
        depth_m: nominal_depth.unwrap_or(measured_depth_m),
        density_kgpm3: mean(&trial.density),
        speed_squared_m2ps2: 0.0,
        drag_n: 0.0,
        along_motion_n: 0.0,
        fz_n: 0.0,
        in_domain: 0.0,
    };
    for sample in samples.clone() {
        let Prediction { force, in_domain } = predict(&levelled(&states[sample]));
        if !force.iter().all(|component| component.is_finite()) {
            return Err(ValidateError::NotFinite { trial: trial.name.clone(), row: trial.rows[sample] });
        }
        sum.speed_squared_m2ps2 += speed_squared(trial, sample) / n;
        sum.drag_n += force.x.abs() / n;
        sum.along_motion_n += force.x * trial.velocity[sample].x.signum() / n;
        sum.fz_n += force.z / n;
        sum.in_domain += f64::from(u8::from(in_domain)) / n;
    }
    Ok(sum)
}

/// The same motion of a vehicle that stands level. Both tests are of such; a model that knows of tilt would add the part of
/// the buoyancy along its own x, at low speed more than the drag.
fn levelled(condition: &Condition) -> Condition {
    let axes = level_axes(&condition.up);
    let level = |v: &Vec3| Vec3::from(axes.map(|axis| axis.dot(v)));
    Condition {
        velocity: level(&condition.velocity),
        ground_velocity: level(&condition.ground_velocity),
        up: Vec3::z_axis(),
        // the level is that of the tilted vehicle; its depth stays
        water_level: None,
        ..*condition
    }
}

/// The sections of one fill.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthGroup<'a> {
    /// Mean depth of its sections [m].
    pub depth_m: f64,
    /// Mean density [kg/m3].
    pub density_kgpm3: f64,
    /// Its sections, in the order of the trials.
    pub sections: Vec<&'a Section>,
}

impl<'a> DepthGroup<'a> {
    fn new(sections: &[&'a Section]) -> Self {
        let mut group = Self { depth_m: 0.0, density_kgpm3: 0.0, sections: sections.to_vec() };
        group.depth_m = group.mean(|section| section.depth_m);
        group.density_kgpm3 = group.mean(|section| section.density_kgpm3);
        group
    }

    /// A quantity of each section.
    pub fn values(&self, of: impl Fn(&Section) -> f64) -> Vec<f64> {
        self.sections.iter().map(|section| of(section)).collect()
    }

    /// The mean of a quantity.
    pub fn mean(&self, of: impl Fn(&Section) -> f64) -> f64 {
        self.values(of).iter().sum::<f64>() / self.sections.len() as f64
    }
}

/// Sections by rising depth: a new group begins where the depth jumps by more than `tolerance` [m].
pub fn by_depth(sections: &[Section], tolerance: f64) -> Vec<DepthGroup<'_>> {
    let mut sorted: Vec<&Section> = sections.iter().collect();
    sorted.sort_by(|a, b| a.depth_m.total_cmp(&b.depth_m));
    sorted.chunk_by(|a, b| b.depth_m - a.depth_m <= tolerance).map(DepthGroup::new).collect()
}
