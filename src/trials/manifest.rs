//! `trials.toml`: what holds for all trials of a folder.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::trial::WRENCH;
use super::{Fault, stem};

/// Name of the file.
pub const MANIFEST_FILE: &str = "trials.toml";

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
    /// Width of the channel [m].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel_width: Option<f64>,
    /// Mass of the vehicle as it was tested [kg].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<f64>,
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
    /// Columns of loads that a load cell bears besides the water's, such as known weights hung on it. A trial without the
    /// column bears none.
    pub known_loads: Vec<String>,
}

impl Measured {
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
    /// The text of the file.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("plain numbers, strings and tables are always TOML")
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
        self.measured.repeats.iter().flatten().try_for_each(|name| known("measured.repeats", name))?;
        let twins = self.measured.dry_twins.iter().flat_map(|(wet, dry)| [wet, dry]);
        twins.into_iter().try_for_each(|name| known("measured.dry_twins", name))?;
        let component = |key: &'static str, name: &String| match WRENCH.contains(&name.as_str()) {
            true => Ok(()),
            false => Err(Fault::UnknownComponent { key, name: name.clone() }),
        };
        let columns = self.measured.columns.iter().flatten();
        columns.into_iter().try_for_each(|name| component("measured.columns", name))?;
        self.sensor_noise.keys().try_for_each(|name| component("sensor_noise", name))?;
        self.trial_offset.keys().try_for_each(|name| component("trial_offset", name))?;
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
        self.check_numbers()
    }

    /// Width of the channel in which a trial was run [m].
    pub fn channel_width_of(&self, trial: &str) -> Option<f64> {
        self.channel_widths.get(trial).copied().or(self.channel_width)
    }

    fn check_numbers(&self) -> Result<(), Fault> {
        let stated = |key: &str, value: Option<f64>| value.map(|value| (key.to_owned(), value));
        let of_body = self.body.iter().flat_map(|body| {
            let Body { length, width, draft, mass, displaced_volume, center_of_mass: _ } = *body;
            [
                ("length", length),
                ("width", width),
                ("draft", draft),
                ("mass", mass),
                ("displaced_volume", displaced_volume),
            ]
            .map(|(key, value)| (format!("body.{key}"), value))
        });
        let lengths =
            self.nominal_depth.iter().map(|(name, value)| (format!("nominal_depth.{name}"), *value));
        let positive = stated("fluid_density", self.fluid_density)
            .into_iter()
            .chain(stated("channel_width", self.channel_width))
            .chain(stated("mass", self.mass))
            .chain(lengths)
            .chain(of_body);
        for (key, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Fault::Number { key, value, expected: "positive" });
            }
        }
        if let Some((name, &value)) =
            self.channel_widths.iter().find(|(_, width)| width.is_nan() || **width <= 0.0)
        {
            let key = format!("channel_widths.{name}");
            return Err(Fault::Number { key, value, expected: "positive, or inf for open water" });
        }
        for (table, deviations) in
            [("sensor_noise", &self.sensor_noise), ("trial_offset", &self.trial_offset)]
        {
            for (name, &value) in deviations {
                if !(value >= 0.0 && value.is_finite()) {
                    let key = format!("{table}.{name}");
                    return Err(Fault::Number { key, value, expected: "0 or positive" });
                }
            }
        }
        Ok(())
    }
}
