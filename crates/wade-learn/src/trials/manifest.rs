//! `trials.toml`: what holds for all trials of a folder.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use super::trial::WRENCH;
use super::{Fault, stem};
use wade_core::physics::Physics;

/// Name of the file.
pub const MANIFEST_FILE: &str = "trials.toml";

/// Least and largest value of a quantity, and how that is said.
type Bounds = (f64, f64, &'static str);

/// From air, in which bodies fall, on: fresh water in g/cm3 lies below it.
const DENSITY: Bounds = (1.1, 3000.0, "between 1.1 and 3000 kg/m3");
const LENGTH: Bounds = (1e-3, 1e3, "between 0.001 and 1000 m");
const DEPTH: Bounds = (1e-4, 20.0, "between 0.0001 and 20 m");
const WIDTH: Bounds = (1e-2, 1e6, "between 0.01 and 1000000 m");
const MASS: Bounds = (1e-6, 1e8, "between 1e-6 and 1e8 kg");
const INERTIA: Bounds = (-1e10, 1e10, "between -1e10 and 1e10 kg m2");
const VOLUME: Bounds = (1e-9, 1e8, "between 1e-9 and 1e8 m3");
/// Of the center of mass, from the middle of the body.
const PLACE: Bounds = (-1e3, 1e3, "within 1000 m");
const DEVIATION: Bounds = (0.0, 1e8, "between 0 and 1e8 N or N m");

/// What was measured, how, and on what; only the vehicle must be stated. SI units.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Name of a bundle; with another simulator's prediction any name.
    pub vehicle: String,
    /// How the data was generated, where it was not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub generated: Option<String>,
    /// Fluid density [kg/m3]; fresh water where neither this nor a column states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fluid_density: Option<f64>,
    /// Width of the channel [m]; `inf` is open water.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel_width: Option<f64>,
    /// How much of the bundle's physical base predicts in `wade gap`, which `--physics` overrides.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub physics: Option<Physics>,
    /// Mass of the vehicle as it was tested [kg].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
    /// Inertia of the vehicle as it was tested, by rows, about the center of mass, body axes [kg m2].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inertia: Option<[[f64; 3]; 3]>,
    /// Water depth over the flat ground, by trial, as it was measured at rest [m].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub nominal_depth: BTreeMap<String, f64>,
    /// Width of the channel of trials that were run in another, by trial [m]; `inf` is open water.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub channel_widths: BTreeMap<String, f64>,
    /// What was measured.
    #[serde(default, skip_serializing_if = "Measured::is_default")]
    pub measured: Measured,
    /// Standard deviation of one sample, by component [N, N m].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sensor_noise: BTreeMap<String, f64>,
    /// Standard deviation of the zero from trial to trial, by component [N, N m].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub trial_offset: BTreeMap<String, f64>,
    /// The same of trials whose zero wanders more or less than that of the others, by trial and component [N, N m].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub trial_offsets: BTreeMap<String, BTreeMap<String, f64>>,
    /// The body, where another simulator's prediction stands in the trials.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<Body>,
}

/// What was measured and which trials belong together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Measured {
    /// Components of the wrench that every trial has; where absent, those that a trial has.
    pub columns: Option<Vec<String>>,
    /// How.
    pub method: Option<Method>,
    /// Trials that repeat each other.
    pub repeats: Vec<Vec<String>>,
    /// The same command without water, by trial.
    pub dry_twins: BTreeMap<String, String>,
    /// Columns of known other forces, for inverse dynamics.
    pub other_forces: Vec<String>,
    /// What the `sim_` columns are.
    #[serde(skip_serializing_if = "SimIs::is_default")]
    pub sim_is: SimIs,
    /// Columns of loads that a load cell bears besides the water's, such as known weights hung on it. A trial without the
    /// column bears none.
    pub known_loads: Vec<String>,
}

impl Measured {
    /// True for a component of the wrench that is held against the prediction where a trial has it.
    pub fn is_compared(&self, name: &str) -> bool {
        self.columns.as_ref().is_none_or(|columns| columns.iter().any(|column| column == name))
    }

    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// What stands in the `sim_` columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SimIs {
    /// Another simulator's prediction: the gap is that simulator's.
    #[default]
    Simulator,
    /// The same trial without what is looked for, measured or computed as the wrench was: the gap is that alone, and what explains it
    /// may be added to the vehicle's own model.
    Control,
}

impl SimIs {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// How a wrench was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// A load cell between carriage and body.
    LoadCell,
    /// Mass times acceleration less the other forces.
    InverseDynamics,
    /// Computed by a resolved flow.
    Cfd,
}

/// A body of which there is no bundle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Along x [m].
    pub length: f64,
    /// Along y [m].
    pub width: f64,
    /// Height under water [m].
    pub draft: f64,
    /// Mass [kg].
    pub mass: f64,
    /// Volume under water [m3].
    pub displaced_volume: f64,
    /// Center of mass, from a point amidships half a draft above the ground-contact plane [m].
    pub center_of_mass: [f64; 3],
}

/// The component on which a column of known forces acts, by the end of its name (`drive_fx`).
pub fn component_of(column: &str) -> Option<usize> {
    WRENCH.iter().position(|name| column.strip_suffix(name).is_some_and(|rest| rest.ends_with('_')))
}

impl Manifest {
    /// Stated inertia about the center of mass, body axes [kg m2].
    pub fn inertia_matrix(&self) -> Option<Matrix3<f64>> {
        self.inertia.map(|rows| Matrix3::from_fn(|i, j| rows[i][j]))
    }

    /// The text of the file.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("plain numbers, strings and tables are always TOML")
    }

    /// Trials are named as their files are, with or without `.csv`.
    pub(super) fn without_extensions(&mut self) {
        fn bare(name: &str) -> String {
            name.strip_suffix(".csv").unwrap_or(name).to_owned()
        }
        fn by_trial<T>(table: &mut BTreeMap<String, T>) {
            *table = std::mem::take(table).into_iter().map(|(name, value)| (bare(&name), value)).collect();
        }
        by_trial(&mut self.nominal_depth);
        by_trial(&mut self.channel_widths);
        by_trial(&mut self.trial_offsets);
        self.measured.repeats.iter_mut().flatten().for_each(|name| *name = bare(name));
        let twins = std::mem::take(&mut self.measured.dry_twins);
        self.measured.dry_twins = twins.into_iter().map(|(wet, dry)| (bare(&wet), bare(&dry))).collect();
    }

    /// Names must be those of files and components, and numbers must be numbers.
    pub(super) fn check(&self, files: &[PathBuf]) -> Result<(), Fault> {
        let trials: Vec<String> = files.iter().map(|file| stem(file)).collect();
        let known = |key: &'static str, name: &String| match trials.contains(name) {
            true => Ok(()),
            false => Err(Fault::UnknownTrial { key, name: name.clone() }),
        };
        self.nominal_depth.keys().try_for_each(|name| known("nominal_depth", name))?;
        self.channel_widths.keys().try_for_each(|name| known("channel_widths", name))?;
        self.trial_offsets.keys().try_for_each(|name| known("trial_offsets", name))?;
        self.measured.repeats.iter().flatten().try_for_each(|name| known("measured.repeats", name))?;
        let twins = self.measured.dry_twins.iter().flat_map(|(wet, dry)| [wet, dry]);
        twins.into_iter().try_for_each(|name| known("measured.dry_twins", name))?;
        let component = |key: &'static str, name: &String| match WRENCH.contains(&name.as_str()) {
            true => Ok(()),
            false => Err(Fault::UnknownComponent { key, name: name.clone() }),
        };
        let empty = self.measured.columns.as_ref().is_some_and(Vec::is_empty);
        // with inverse dynamics it says that all is to be inferred
        if empty && self.measured.method != Some(Method::InverseDynamics) {
            return Err(Fault::NoColumns);
        }
        let columns = self.measured.columns.iter().flatten();
        columns.into_iter().try_for_each(|name| component("measured.columns", name))?;
        self.sensor_noise.keys().try_for_each(|name| component("sensor_noise", name))?;
        let offsets = self.trial_offset.keys().chain(self.trial_offsets.values().flat_map(BTreeMap::keys));
        offsets.into_iter().try_for_each(|name| component("trial_offset", name))?;
        let Measured { other_forces, known_loads, method, .. } = &self.measured;
        for (key, columns) in [("measured.other_forces", other_forces), ("measured.known_loads", known_loads)]
        {
            if let Some(name) = columns.iter().find(|name| component_of(name).is_none()) {
                return Err(Fault::NoComponentInName { key, name: name.clone() });
            }
        }
        if *method == Some(Method::InverseDynamics) && !known_loads.is_empty() {
            return Err(Fault::KnownLoadsInferred);
        }
        self.check_groups()?;
        self.check_numbers()
    }

    /// A trial is a repeat of those in one list, and of no other; a dry twin is another trial, and none in water.
    fn check_groups(&self) -> Result<(), Fault> {
        let Measured { repeats, dry_twins, .. } = &self.measured;
        let mut listed = BTreeSet::new();
        if let Some(name) = repeats.iter().flatten().find(|name| !listed.insert(*name)) {
            return Err(Fault::RepeatTwice { name: name.clone() });
        }
        match dry_twins.iter().find(|(_, dry)| dry_twins.contains_key(*dry)) {
            Some((wet, dry)) => Err(Fault::WetTwin { wet: wet.clone(), dry: dry.clone() }),
            None => Ok(()),
        }
    }

    /// Width of the channel in which a trial was run [m].
    pub fn channel_width_of(&self, trial: &str) -> Option<f64> {
        self.channel_widths.get(trial).copied().or(self.channel_width)
    }

    /// Standard deviation of the zero of a trial [N, N m]; 0 where none is stated.
    pub fn trial_offset_of(&self, trial: &str, component: &str) -> f64 {
        let own = self.trial_offsets.get(trial).and_then(|of| of.get(component));
        own.or(self.trial_offset.get(component)).copied().unwrap_or(0.0)
    }

    /// Symmetric, and of masses: no principal moment of inertia is negative or larger than the other two together.
    fn check_inertia(&self) -> Result<(), Fault> {
        let Some(matrix) = self.inertia_matrix() else { return Ok(()) };
        for &value in &matrix {
            within("inertia".to_owned(), value, INERTIA)?;
        }
        // as far as a file of six digits states them
        let rounding = 1e-5 * matrix.norm();
        let skew = matrix - matrix.transpose();
        if skew.amax() > rounding {
            return Err(Fault::Inertia { why: "is not symmetric" });
        }
        let moments = matrix.symmetric_eigenvalues();
        if moments.min() <= 0.0 {
            return Err(Fault::Inertia { why: "has a principal moment of inertia that is not positive" });
        }
        if 2.0 * moments.max() > moments.sum() + rounding {
            return Err(Fault::Inertia {
                why: "has a principal moment of inertia larger than the other two together, which no body has",
            });
        }
        Ok(())
    }

    fn check_numbers(&self) -> Result<(), Fault> {
        let stated = |key: &str, value: Option<f64>, bounds: Bounds| {
            value.map(|value| (key.to_owned(), value, bounds))
        };
        let of_body = self.body.iter().flat_map(|body| {
            let Body { length, width, draft, mass, displaced_volume, center_of_mass: _ } = *body;
            [
                ("length", length, LENGTH),
                ("width", width, LENGTH),
                ("draft", draft, LENGTH),
                ("mass", mass, MASS),
                ("displaced_volume", displaced_volume, VOLUME),
            ]
            .map(|(key, value, bounds)| (format!("body.{key}"), value, bounds))
        });
        let depths =
            self.nominal_depth.iter().map(|(name, value)| (format!("nominal_depth.{name}"), *value, DEPTH));
        let positive = stated("fluid_density", self.fluid_density, DENSITY)
            .into_iter()
            .chain(stated("mass", self.mass, MASS))
            .chain(depths)
            .chain(of_body);
        for (key, value, bounds) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Fault::Number { key, value, expected: "positive" });
            }
            within(key, value, bounds)?;
        }
        self.check_inertia()?;
        let widths =
            self.channel_widths.iter().map(|(name, &value)| (format!("channel_widths.{name}"), value));
        for (key, value) in widths.chain(self.channel_width.map(|value| ("channel_width".to_owned(), value)))
        {
            if value.is_nan() || value <= 0.0 {
                return Err(Fault::Number { key, value, expected: "positive, or inf for open water" });
            }
            if value.is_finite() {
                within(key, value, WIDTH)?;
            }
        }
        for value in self.body.iter().flat_map(|body| body.center_of_mass) {
            within("body.center_of_mass".to_owned(), value, PLACE)?;
        }
        let of_all = [
            ("sensor_noise".to_owned(), &self.sensor_noise),
            ("trial_offset".to_owned(), &self.trial_offset),
        ];
        let of_trials = self.trial_offsets.iter().map(|(trial, of)| (format!("trial_offsets.{trial}"), of));
        for (table, deviations) in of_all.into_iter().chain(of_trials) {
            for (name, &value) in deviations {
                within(format!("{table}.{name}"), value, DEVIATION)?;
            }
        }
        Ok(())
    }
}

/// Refuses what is no number or lies beyond its bounds.
fn within(key: String, value: f64, (least, most, expected): Bounds) -> Result<(), Fault> {
    match (least..=most).contains(&value) {
        true => Ok(()),
        false => Err(Fault::Number { key, value, expected }),
    }
}
