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
}

#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
struct GapReport {
    #[serde(default)]
    held_out: BTreeMap<String, HeldOut>,
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
        Self::deserialize(report)
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
}
