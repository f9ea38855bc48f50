//! What a tool says of trials: `report.json` by its stable names.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;
use serde_json::Value;

/// The verdict in a word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// No gap beyond the noise.
    NothingMissing,
    /// Effects are named.
    Named,
    /// Several sets of effects explain as much.
    Ambiguous,
    /// There is structure that no effect explains.
    NoCandidateFits,
}

/// An estimated parameter.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Estimate {
    /// Value.
    pub value: f64,
    /// Standard error; absent where the tool knows none.
    pub std: Option<f64>,
    /// 90 % interval; absent where the tool states none.
    pub interval: Option<[f64; 2]>,
    /// Unit.
    #[serde(default)]
    pub unit: String,
}

/// An effect that is named.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct NamedEffect {
    /// Name in the library.
    pub name: String,
    /// Parameters by name.
    #[serde(default)]
    pub parameters: BTreeMap<String, Estimate>,
    /// Drag of the prediction itself as coefficients along x, y, z; absent where the tool states none.
    #[serde(default)]
    base_drag: [f64; 3],
}

impl NamedEffect {
    /// Adds coefficients of drag as shares of the prediction's own, which differ less from tool to tool.
    fn add_shares(&mut self) {
        for (name, of) in ["surge", "sway"].into_iter().zip(self.base_drag).filter(|(_, of)| *of > 0.0) {
            let Some(coefficient) = self.parameters.get(name) else { continue };
            let share = Estimate {
                value: coefficient.value / of,
                std: coefficient.std.map(|std| std / of),
                interval: coefficient.interval.map(|ends| ends.map(|end| end / of)),
                unit: coefficient.unit.clone(),
            };
            self.parameters.insert(format!("{name}_share"), share);
        }
    }
}

/// Names that explain as much: a list, or a table that holds one.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
enum Alternative {
    One(String),
    Names(Vec<String>),
    Table {
        #[serde(alias = "effects", alias = "set")]
        names: Vec<String>,
    },
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct NotTestable {
    name: String,
}

/// A region of the state space.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct FoundRegion {
    /// Its conditions in words.
    #[serde(rename = "where")]
    pub conditions: String,
}

/// The gap on trials that took no part.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct HeldOut {
    /// Share of the gap above the floor that is closed; absent where there is none.
    pub closure: Option<f64>,
    /// Root mean square without the named effects [N, N m]; absent where the tool states none, as the others are.
    before: Option<f64>,
    /// With them.
    after: Option<f64>,
    /// Of noise alone.
    noise_floor: Option<f64>,
}

/// Size of the gap of a component over all trials.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct Size {
    /// Interval of its root mean square.
    interval: Option<[f64; 2]>,
    /// Of noise and the model's own error.
    expected_at_most: Option<f64>,
}

impl Size {
    fn is_above_what_is_expected(&self) -> bool {
        self.interval.zip(self.expected_at_most).is_some_and(|(interval, expected)| interval[0] > expected)
    }
}

/// What is expected of a component without anything missing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
struct Floor {
    /// Deviation that the model states of itself [N, N m].
    #[serde(default)]
    model: f64,
}

#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
struct GapReport {
    #[serde(default)]
    held_out: BTreeMap<String, HeldOut>,
    #[serde(default)]
    size: BTreeMap<String, Size>,
    #[serde(default)]
    floors: BTreeMap<String, Floor>,
}

/// An answer; what is not scored is not kept.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// What is named.
    #[serde(default)]
    pub effects: Vec<NamedEffect>,
    #[serde(default)]
    alternatives: Vec<Alternative>,
    #[serde(default)]
    not_testable: Vec<NotTestable>,
    /// Where the gap is.
    #[serde(default)]
    pub regions: Vec<FoundRegion>,
    #[serde(default)]
    gap: GapReport,
}

impl Answer {
    /// Reads a report.
    pub fn from_report(report: &Value) -> Result<Self, serde_json::Error> {
        let mut answer = Self::deserialize(report)?;
        answer.effects.iter_mut().for_each(NamedEffect::add_shares);
        Ok(answer)
    }

    /// What the numbers of the report say against its verdict.
    pub fn contradiction(&self) -> Option<String> {
        /// Floors that a law may leave, and share of the squared gap: formulas of one effect differ by as much.
        const LEFT: [f64; 2] = [2.0, 0.2];
        let GapReport { held_out, size, floors } = &self.gap;
        let states_a_name = matches!(self.verdict, Verdict::Named | Verdict::Ambiguous);
        if states_a_name && self.effects.is_empty() {
            return Some("something is named, and no effect is stated".to_owned());
        }
        match self.verdict {
            Verdict::NothingMissing => {
                let above = size.iter().find(|(_, size)| size.is_above_what_is_expected());
                above.map(|(name, _)| {
                    format!("nothing is missing, and the gap of {name} lies above what is expected")
                })
            }
            Verdict::Named => {
                let leaves = |(name, held): (&String, &HeldOut)| -> Option<bool> {
                    let model = floors.get(name)?.model;
                    let (before, after) = (held.before?.powi(2), held.after?.powi(2));
                    let floor = held.noise_floor?.powi(2) + model * model;
                    let acts = (before - after).abs() > floor;
                    Some(acts && after > LEFT[0].powi(2) * floor && after > LEFT[1] * before)
                };
                let grows = self.closure().is_some_and(|closure| closure < 0.0);
                let left = held_out.iter().find(|entry| leaves(*entry).unwrap_or(false));
                let left = left.map(|(name, _)| format!("what is named leaves most of the gap of {name}"));
                left.or_else(|| grows.then(|| "the held-out gap grows with what is named".to_owned()))
            }
            Verdict::Ambiguous | Verdict::NoCandidateFits => None,
        }
    }

    /// Names of the effects.
    pub fn names(&self) -> BTreeSet<&str> {
        self.effects.iter().map(|effect| effect.name.as_str()).collect()
    }

    /// Every name that the answer holds possible.
    pub fn possible(&self) -> BTreeSet<&str> {
        let alternatives = self.alternatives.iter().flat_map(|alternative| match alternative {
            Alternative::One(name) => vec![name.as_str()],
            Alternative::Names(names) | Alternative::Table { names } => {
                names.iter().map(String::as_str).collect()
            }
        });
        self.names().into_iter().chain(alternatives).collect()
    }

    /// True where the trials are said not to excite an effect.
    pub fn says_not_testable(&self, name: &str) -> bool {
        self.not_testable.iter().any(|effect| effect.name == name)
    }

    /// Closure over all components on held-out trials.
    pub fn closure(&self) -> Option<f64> {
        self.gap.held_out.get("all")?.closure
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn reads_the_stable_names() {
        let report = serde_json::json!({
            "verdict": "ambiguous",
            "effects": [{"name": "added_mass", "kind": "physics", "share_of_gap": 0.7, "provisional": false,
                "parameters": {"surge": {"value": 31.0, "std": 2.0, "interval": [27.5, 34.0], "unit": "kg"}}}],
            "alternatives": [["mass_error"], {"names": ["sensor_delay", "sensor_gain"]}],
            "separating_experiment": "the same on dry ground",
            "not_testable": [{"name": "rotation", "why": "no yaw", "minimum_detectable": null}],
            "regions": [{"where": "acceleration > 0.4", "share_of_gap": 0.6, "trials": 9}],
            "gap": {"held_out": {"all": {"before": 9.0, "after": 4.0, "noise_floor": 3.5, "closure": 0.91}}},
            "sources": {}
        });
        let answer = Answer::from_report(&report).unwrap();
        assert_eq!(answer.verdict, Verdict::Ambiguous);
        assert!(answer.possible().contains("sensor_gain") && !answer.names().contains("mass_error"));
        assert!(answer.says_not_testable("rotation") && !answer.says_not_testable("squat"));
        assert_eq!(answer.closure(), Some(0.91));
        let surge = &answer.effects[0].parameters["surge"];
        assert_eq!((surge.std, surge.interval), (Some(2.0), Some([27.5, 34.0])));
        assert!(Answer::from_report(&serde_json::json!({"verdict": "perhaps"})).is_err());
    }

    #[test]
    fn the_numbers_of_a_report_can_contradict_its_verdict() {
        let held = |after: f64, closure: f64| {
            serde_json::json!({
                "verdict": "named",
                "effects": [{"name": "squat", "kind": "physics"}],
                "gap": {
                    "held_out": {
                        "fx": {"before": 90.0, "after": after, "noise_floor": 3.0, "closure": closure},
                        "all": {"before": 9.0, "after": 4.0, "noise_floor": 1.0, "closure": closure}
                    },
                    "floors": {"fx": {"model": 4.0}}
                }
            })
        };
        let why = |report: &Value| Answer::from_report(report).unwrap().contradiction();
        assert_eq!(why(&held(9.0, 0.9)), None);
        assert_eq!(why(&held(39.0, 0.6)), None, "a fifth of the squared gap");
        assert!(why(&held(45.0, 0.5)).unwrap().contains("most of the gap of fx"));
        assert!(why(&held(9.0, -0.1)).unwrap().contains("grows"));
        for verdict in ["named", "ambiguous"] {
            assert!(why(&serde_json::json!({"verdict": verdict})).unwrap().contains("no effect is stated"));
        }
        let size = |expected: f64| {
            let fz = serde_json::json!({"interval": [4.0, 6.0], "expected_at_most": expected});
            serde_json::json!({"verdict": "nothing_missing", "gap": {"size": {"fz": fz}}})
        };
        assert_eq!(why(&size(4.1)), None);
        assert!(why(&size(3.9)).unwrap().contains("gap of fz lies above what is expected"));
    }
}
