//! `effects.toml`: the effects that are switched on in a bundle, with what they rest on.
//!
//! Written by the gap workflow, read by whatever serves the bundle. A file is taken as a whole or refused as a whole.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::input::BaseDrag;
use super::law::Numbers;
use super::library::{Effect, MAX_COEFFICIENTS, Shape};
use super::region::EffectRegion;
use super::spec::Kind;
use super::validity::Validity;
use crate::frame::Vec3;

/// Newest version of the file's format that this program reads. What no older program would read is written in it, and everything
/// else as version 1.
pub const FORMAT: u32 = 3;
/// The first format with covariances between effects, and that with effects that act in a region.
const WITH_BETWEEN: u32 = 2;
const WITH_REGIONS: u32 = 3;

/// The whole file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectsFile {
    format: u32,
    /// The vehicle that the effects were fitted for.
    pub vehicle: String,
    /// What the fit rests on.
    pub evidence: Evidence,
    /// Ranges of the state in which the effects were seen.
    pub validity: Validity,
    /// The effects; at least one, each once.
    #[serde(rename = "effect")]
    pub effects: Vec<ActiveEffect>,
    /// Covariances between effects that were fitted together; since format 2.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    between: Vec<Between>,
}

/// Covariance between the coefficients of two effects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Between {
    /// The two.
    pub effects: [Effect; 2],
    /// A row each coefficient of the first, in it a number each coefficient of the second, in the product of their units.
    pub covariance: Vec<Vec<f64>>,
}

/// What a fit rests on.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evidence {
    /// Names of the trials.
    pub trials: Vec<String>,
    /// Hash of the numbers in the trials.
    pub trials_sha256: String,
    /// How the trials were generated, where they were not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub generated: Option<String>,
    /// Samples used.
    pub samples: usize,
    /// Hash of the bundle that the effects were fitted to.
    pub model_sha256: String,
    /// Hash of the weights in that bundle: with other weights the effects mean nothing. Empty of a bundle without weights.
    pub weights_sha256: String,
    /// What the weights stood on: "physics" for the physical base, and nothing for what came before it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<String>,
    /// Version and commit of the program.
    pub tool: String,
    /// Share of the gap above the noise that the effects close on trials that took no part.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closure: Option<f64>,
}

/// One effect with its numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Row", into = "Row")]
pub struct ActiveEffect {
    /// Its equation, for the reader.
    pub equation: String,
    /// Seen in one condition only.
    pub provisional: bool,
    /// Share of the gap above the floor that goes when it is added to the others.
    pub share_of_gap: f64,
    /// Which effect of the library, with the form of its law and the nonlinear parameters.
    pub shape: Shape,
    /// Drag coefficients of the model that the effect scales with, along x, y, z [-].
    pub base_drag: [f64; 3],
    /// Width of the channel in which it was seen [m].
    pub channel_width: Option<f64>,
    /// Where it acts; since format 3.
    pub region: EffectRegion,
    /// Names of the coefficients in the order of the covariance.
    pub coefficients: Vec<String>,
    /// Covariance of the coefficients, in the product of their units.
    pub covariance: Vec<Vec<f64>>,
    /// The coefficients and the nonlinear parameters by name.
    pub parameters: BTreeMap<String, ParameterValue>,
}

/// An effect as it stands in the file, where the numbers of a shape may mean nothing.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Row {
    name: Effect,
    equation: String,
    provisional: bool,
    share_of_gap: f64,
    shape: Numbers,
    base_drag: [f64; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    channel_width: Option<f64>,
    #[serde(default, skip_serializing_if = "EffectRegion::is_everywhere")]
    region: EffectRegion,
    coefficients: Vec<String>,
    covariance: Vec<Vec<f64>>,
    parameters: BTreeMap<String, ParameterValue>,
}

impl TryFrom<Row> for ActiveEffect {
    type Error = EffectsFileError;

    fn try_from(row: Row) -> Result<Self, EffectsFileError> {
        let shape = Shape::from_numbers(row.name, row.shape).map_err(|fault| EffectsFileError::Field {
            effect: row.name.name(),
            field: format!("shape[{}]", fault.index),
            expected: fault.expected,
        })?;
        Ok(Self {
            equation: row.equation,
            provisional: row.provisional,
            share_of_gap: row.share_of_gap,
            shape,
            base_drag: row.base_drag,
            channel_width: row.channel_width,
            region: row.region,
            coefficients: row.coefficients,
            covariance: row.covariance,
            parameters: row.parameters,
        })
    }
}

impl From<ActiveEffect> for Row {
    fn from(effect: ActiveEffect) -> Self {
        Self {
            name: effect.effect(),
            equation: effect.equation,
            provisional: effect.provisional,
            share_of_gap: effect.share_of_gap,
            shape: effect.shape.to_numbers(),
            base_drag: effect.base_drag,
            channel_width: effect.channel_width,
            region: effect.region,
            coefficients: effect.coefficients,
            covariance: effect.covariance,
            parameters: effect.parameters,
        }
    }
}

/// A value with its standard error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterValue {
    /// Best estimate.
    pub value: f64,
    /// Standard error.
    pub std: f64,
    /// Unit; 1 where it has none.
    pub unit: String,
}

/// Why a file was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EffectsFileError {
    /// Not TOML, or a key is missing, unknown or of the wrong type.
    #[error("{0}")]
    Toml(#[from] toml::de::Error),
    /// Written by a newer program.
    #[error("format {found} is newer than {FORMAT}, the newest that this program reads: update wade")]
    NewerFormat {
        /// The format of the file.
        found: u32,
    },
    /// Fitted for another vehicle.
    #[error("vehicle = \"{found}\", but the bundle is of \"{expected}\"")]
    Vehicle {
        /// In the file.
        found: String,
        /// Of the bundle.
        expected: String,
    },
    /// Fitted to other weights.
    #[error(
        "evidence.weights_sha256 is not that of the bundle's weights: effects are fitted to a model and go with it"
    )]
    OtherWeights,
    /// Fitted to another base.
    #[error(
        "evidence.base is {}, and the bundle stands on {}: an effect is what a base lacks, so that it must be fitted again, by `wade gap`",
        .found.as_deref().unwrap_or("a simple drag"), .expected.as_deref().unwrap_or("a simple drag")
    )]
    OtherBase {
        /// In the file.
        found: Option<String>,
        /// Of the bundle.
        expected: Option<String>,
    },
    /// No effect.
    #[error("no [[effect]]: without an effect there is no file")]
    Empty,
    /// The same effect twice.
    #[error("effect {effect} is there twice")]
    Twice {
        /// Its name.
        effect: &'static str,
    },
    /// Not a load of the water.
    #[error("effect {effect} is a fault of the measuring chain or the drive, not a load of the water")]
    NotPhysics {
        /// Its name.
        effect: &'static str,
    },
    /// A field that is not what it must be.
    #[error("effect {effect}: {field} must be {expected}")]
    Field {
        /// Its name.
        effect: &'static str,
        /// The field, such as `parameters.surge.value`.
        field: String,
        /// What it must be.
        expected: String,
    },
    /// A range whose ends are not finite and in order.
    #[error("validity.{quantity} must be two finite numbers, the smaller first")]
    Validity {
        /// The quantity.
        quantity: &'static str,
    },
}

impl EffectsFile {
    /// A file of effects by themselves, which is of format 1 where all of them act everywhere.
    pub fn new(vehicle: String, evidence: Evidence, validity: Validity, effects: Vec<ActiveEffect>) -> Self {
        let is_limited = effects.iter().any(|effect| !effect.region.is_everywhere());
        let format = if is_limited { WITH_REGIONS } else { 1 };
        Self { format, vehicle, evidence, validity, effects, between: Vec::new() }
    }

    /// The same with the covariances between its effects.
    pub fn with_between(self, between: Vec<Between>) -> Self {
        let format = if between.is_empty() { self.format } else { self.format.max(WITH_BETWEEN) };
        Self { format, between, ..self }
    }

    /// Covariances between effects that were fitted together.
    pub fn between(&self) -> &[Between] {
        &self.between
    }

    /// Reads the file of a vehicle and checks everything in it.
    pub fn parse(bytes: &[u8], vehicle: &str) -> Result<Self, EffectsFileError> {
        #[derive(Deserialize)]
        struct Format {
            format: u32,
        }
        let text = String::from_utf8_lossy(bytes);
        let Format { format } = toml::from_str(&text)?;
        if format > FORMAT {
            return Err(EffectsFileError::NewerFormat { found: format });
        }
        let file: Self = toml::from_str(&text)?;
        file.check(vehicle)?;
        Ok(file)
    }

    /// Checks what the types do not.
    pub fn check(&self, vehicle: &str) -> Result<(), EffectsFileError> {
        if self.vehicle != vehicle {
            let (found, expected) = (self.vehicle.clone(), vehicle.to_owned());
            return Err(EffectsFileError::Vehicle { found, expected });
        }
        if let Some(quantity) = self.validity.bad_range() {
            return Err(EffectsFileError::Validity { quantity });
        }
        if self.effects.is_empty() {
            return Err(EffectsFileError::Empty);
        }
        let mut seen = BTreeSet::new();
        for effect in &self.effects {
            if !seen.insert(effect.effect()) {
                return Err(EffectsFileError::Twice { effect: effect.effect().name() });
            }
            effect.check()?;
            let limited = !effect.region.is_everywhere();
            if limited && self.format < WITH_REGIONS {
                let expected = format!("in a file of format {WITH_REGIONS} or newer");
                let (effect, field) = (effect.effect().name(), "region".to_owned());
                return Err(EffectsFileError::Field { effect, field, expected });
            }
        }
        self.between.iter().try_for_each(|between| self.check_between(between))
    }

    /// Both effects are there, a number each pair of their coefficients, none larger than the two allow.
    fn check_between(&self, between: &Between) -> Result<(), EffectsFileError> {
        let [first, second] = between.effects;
        let of = |name: Effect| self.effects.iter().find(|effect| effect.effect() == name);
        let is_same = |other: &&Between| other.effects == [first, second] || other.effects == [second, first];
        let once = self.format >= WITH_BETWEEN && self.between.iter().filter(is_same).count() == 1;
        let sound = match (of(first), of(second)) {
            (Some(a), Some(b)) if first != second && once => {
                let possible = |i: usize, j: usize, value: f64| {
                    value * value <= (1.0 + 1e-6) * a.covariance[i][i] * b.covariance[j][j]
                };
                between.covariance.len() == a.coefficients.len()
                    && between.covariance.iter().enumerate().all(|(i, row)| {
                        let mut each = row.iter().enumerate();
                        row.len() == b.coefficients.len() && each.all(|(j, value)| possible(i, j, *value))
                    })
            }
            _ => false,
        };
        if sound {
            return Ok(());
        }
        let (effect, field) = (first.name(), format!("between {} and {}", first.name(), second.name()));
        let expected = "of two effects of a file of format 2, once, a row each coefficient of the first, a number each of the second, none beyond what their variances allow";
        Err(EffectsFileError::Field { effect, field, expected: expected.to_owned() })
    }

    /// The text of the file.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("plain numbers, strings and tables are always TOML")
    }
}

impl ActiveEffect {
    /// Which effect of the library.
    pub fn effect(&self) -> Effect {
        self.shape.effect()
    }

    /// Value of every coefficient of the library in its order; 0 for those that were not fitted.
    pub(super) fn values(&self) -> [f64; MAX_COEFFICIENTS] {
        let mut values = [0.0; MAX_COEFFICIENTS];
        for (value, coefficient) in values.iter_mut().zip(self.effect().coefficients()) {
            if self.coefficients.iter().any(|name| name == coefficient.name) {
                *value = self.parameters.get(coefficient.name).map_or(0.0, |parameter| parameter.value);
            }
        }
        values
    }

    pub(super) fn base_drag(&self) -> BaseDrag {
        Vec3::from(self.base_drag)
    }

    fn check(&self) -> Result<(), EffectsFileError> {
        let effect = self.effect().name();
        if self.effect().kind() != Kind::Physics {
            return Err(EffectsFileError::NotPhysics { effect });
        }
        let must = |holds: bool, field: &str, expected: &str| match holds {
            true => Ok(()),
            false => Err(EffectsFileError::Field {
                effect,
                field: field.to_owned(),
                expected: expected.to_owned(),
            }),
        };
        must((0.0..=1.0).contains(&self.share_of_gap), "share_of_gap", "between 0 and 1")?;
        must(self.base_drag.iter().all(|x| (0.0..=10.0).contains(x)), "base_drag", "between 0 and 10")?;
        let width = self.channel_width.is_none_or(|width| width.is_finite() && width > 0.0);
        must(width, "channel_width", "greater than 0")?;
        let in_channel = !self.shape.needs_channel_width() || self.channel_width.is_some();
        must(in_channel, "channel_width", "there: this effect depends on it")?;
        self.check_region(&must)?;
        self.check_coefficients(&must)?;
        self.check_parameters(&must)
    }

    fn check_region(
        &self,
        must: &impl Fn(bool, &str, &str) -> Result<(), EffectsFileError>,
    ) -> Result<(), EffectsFileError> {
        let remembers = self.effect().spec().has_memory && !self.region.is_everywhere();
        must(!remembers, "region", "left out: this effect remembers, and has no border in the state")?;
        for (index, limit) in self.region.limits.iter().enumerate() {
            let again = self.region.limits[..index].iter().any(|other| other.quantity == limit.quantity);
            let field = format!("region[{index}]");
            must(!again, &format!("{field}.quantity"), "each quantity once")?;
            must(
                limit.is_sound(),
                &field,
                "above and at_most, or one of them, each two finite numbers that rise, above below at_most",
            )?;
        }
        Ok(())
    }

    fn check_coefficients(
        &self,
        must: &impl Fn(bool, &str, &str) -> Result<(), EffectsFileError>,
    ) -> Result<(), EffectsFileError> {
        let specs = self.effect().coefficients();
        let names: Vec<&str> = specs.iter().map(|spec| spec.name).collect();
        let known = self.coefficients.iter().all(|name| names.contains(&name.as_str()));
        must(
            known && !self.coefficients.is_empty(),
            "coefficients",
            &format!("some of {}", names.join(", ")),
        )?;
        let distinct: BTreeSet<&String> = self.coefficients.iter().collect();
        must(distinct.len() == self.coefficients.len(), "coefficients", "different from each other")?;
        let count = self.coefficients.len();
        let square = self.covariance.len() == count && self.covariance.iter().all(|row| row.len() == count);
        must(square, "covariance", &format!("{count} rows of {count} numbers, one a coefficient"))?;
        let sound = (0..count).all(|i| {
            let symmetric = |j: usize| {
                let (a, b) = (self.covariance[i][j], self.covariance[j][i]);
                a.is_finite() && (a - b).abs() <= 1e-6 * a.abs().max(b.abs())
            };
            self.covariance[i][i] >= 0.0 && (0..count).all(symmetric)
        });
        must(sound, "covariance", "finite, symmetric, and not negative on its diagonal")
    }

    fn check_parameters(
        &self,
        must: &impl Fn(bool, &str, &str) -> Result<(), EffectsFileError>,
    ) -> Result<(), EffectsFileError> {
        let nonlinear = self.effect().spec().parameters;
        let fitted = self
            .effect()
            .coefficients()
            .iter()
            .filter(|spec| self.coefficients.iter().any(|c| c == spec.name));
        let coefficients = fitted.map(|spec| (spec.name, spec.unit, spec.bounds));
        let limit = f64::MAX;
        let expected: Vec<(&str, &str, [f64; 2])> =
            coefficients.chain(nonlinear.iter().map(|spec| (spec.name, spec.unit, [0.0, limit]))).collect();
        let names = expected.iter().map(|(name, ..)| *name).collect::<Vec<_>>().join(", ");
        let unknown = self.parameters.keys().find(|key| !expected.iter().any(|(name, ..)| name == key));
        must(
            unknown.is_none(),
            &format!("parameters.{}", unknown.map_or("", String::as_str)),
            &format!("one of {names}"),
        )?;
        for (name, unit, [low, high]) in expected {
            let field = |part: &str| format!("parameters.{name}{part}");
            let Some(parameter) = self.parameters.get(name) else {
                return must(false, &field(""), "there");
            };
            must(parameter.unit == unit, &field(".unit"), &format!("\"{unit}\""))?;
            let physical = (low..=high).contains(&parameter.value);
            must(
                physical,
                &field(".value"),
                &format!("between {low} and {high}, what is physically possible"),
            )?;
            must(parameter.std.is_finite() && parameter.std >= 0.0, &field(".std"), "0 or greater")?;
        }
        for (index, spec) in nonlinear.iter().enumerate() {
            let stated = self.parameters.get(spec.name).map(|parameter| parameter.value);
            let same = stated == Some(self.shape.parameter(index));
            must(same, &format!("shape[{index}]"), &format!("parameters.{}.value", spec.name))?;
        }
        Ok(())
    }
}
