//! What a soak must hold: response times at any percentile, the rate, and how many requests may fail.

use std::{collections::BTreeMap, str::FromStr, time::Duration};

use serde::Serialize;

use super::{
    duration::{DurationError, parse_duration},
    record::Counts,
};

/// An objective, written `p99=1ms`, `max=10ms`, `rate=995` or `errors=0.1%`.
#[derive(Debug, Clone, PartialEq)]
pub struct Slo {
    name: String,
    limit: Limit,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Limit {
    /// The longest response time at this quantile that still holds.
    Response { quantile: f64, longest: Duration },
    /// The fewest answered requests a second [Hz].
    Rate { least_hz: f64 },
    /// The most requests that may be refused, lost or never sent.
    Errors(Most),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Most {
    Count(u64),
    Share(f64),
}

/// Why a text is no objective.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SloError {
    /// No equals sign.
    #[error("'{text}' is not of the form p99=1ms, max=10ms, rate=995 or errors=0.1%")]
    Form {
        /// What was given.
        text: String,
    },
    /// Nothing that is measured.
    #[error("'{name}' is no percentile such as p50, p99 or p99.99, nor max, rate or errors")]
    Name {
        /// What was given.
        name: String,
    },
    /// The limit is no time.
    #[error(transparent)]
    Limit(#[from] DurationError),
    /// The limit is no number.
    #[error("{name}={limit}: must be {expected}")]
    Number {
        /// The objective.
        name: String,
        /// What was given.
        limit: String,
        /// What is allowed.
        expected: &'static str,
    },
}

impl FromStr for Slo {
    type Err = SloError;

    fn from_str(text: &str) -> Result<Self, SloError> {
        let (name, limit) = text.split_once('=').ok_or_else(|| SloError::Form { text: text.to_owned() })?;
        let refused = |expected| {
            let (name, limit) = (name.to_owned(), limit.to_owned());
            SloError::Number { name, limit, expected }
        };
        let limit = match name {
            "rate" => {
                let expected = "a positive number of requests a second";
                let least_hz: f64 = limit.parse().map_err(|_| refused(expected))?;
                if !(least_hz > 0.0 && least_hz.is_finite()) {
                    return Err(refused(expected));
                }
                Limit::Rate { least_hz }
            }
            "errors" => Limit::Errors(
                most(limit).ok_or_else(|| refused("a count such as 0 or a share such as 0.1%"))?,
            ),
            _ => {
                let quantile = quantile(name).ok_or_else(|| SloError::Name { name: name.to_owned() })?;
                Limit::Response { quantile, longest: parse_duration(limit)? }
            }
        };
        Ok(Self { name: name.to_owned(), limit })
    }
}

fn most(text: &str) -> Option<Most> {
    let Some(percent) = text.strip_suffix('%') else { return text.parse().ok().map(Most::Count) };
    let percent: f64 = percent.parse().ok()?;
    (0.0..=100.0).contains(&percent).then_some(Most::Share(percent / 100.0))
}

/// The quantile of a name such as p99.9; 1 of max.
fn quantile(name: &str) -> Option<f64> {
    if name == "max" {
        return Some(1.0);
    }
    let percent: f64 = name.strip_prefix('p')?.parse().ok()?;
    // the binary fraction nearest to the decimal one: 99.9 / 100 lies above 0.999, which is the next response time's
    let quantile = (percent * 1e6).round() / 1e8;
    (quantile > 0.0 && quantile < 1.0).then_some(quantile)
}

impl Slo {
    /// The name used on the command line and in JSON.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// True of an objective for failed requests, which otherwise fail a run by themselves.
    pub(super) fn allows_errors(&self) -> bool {
        matches!(self.limit, Limit::Errors(_))
    }
}

/// How one objective came out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Outcome {
    /// Limit and measured value.
    #[serde(flatten)]
    pub figures: Figures,
    /// True when the measured value is within the limit.
    pub holds: bool,
}

/// Limit and measured value of an objective.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Figures {
    /// Of a response time.
    Time {
        /// The limit [us].
        limit_us: f64,
        /// The measured response time [us].
        measured_us: f64,
    },
    /// Of the rate.
    Rate {
        /// The limit [Hz].
        limit_hz: f64,
        /// Answered requests a second [Hz].
        measured_hz: f64,
    },
    /// Of requests that failed.
    Errors {
        /// The most that may fail: a count, or a share of all that were due.
        limit: f64,
        /// What failed, as a count or a share like the limit.
        measured: f64,
    },
}

/// What objectives are about.
pub(super) struct Measured<'a> {
    /// Response times [ns].
    pub response: &'a Counts,
    /// Answered requests.
    pub answered: u64,
    /// Answered requests a second [Hz].
    pub rate_hz: f64,
    /// Requests refused, lost or never sent.
    pub failed: u64,
}

impl Slo {
    fn judge(&self, measured: &Measured<'_>) -> Outcome {
        let (figures, holds) = match self.limit {
            Limit::Response { quantile, longest } => {
                let (limit_us, at) =
                    (longest.as_secs_f64() * 1e6, measured.response.value_at_quantile(quantile));
                let measured_us = at as f64 * 1e-3;
                (Figures::Time { limit_us, measured_us }, measured_us <= limit_us)
            }
            Limit::Rate { least_hz } => {
                let measured_hz = measured.rate_hz;
                (Figures::Rate { limit_hz: least_hz, measured_hz }, measured_hz >= least_hz)
            }
            Limit::Errors(most) => {
                let failed = measured.failed as f64;
                let due = (measured.answered + measured.failed).max(1) as f64;
                let (limit, found) = match most {
                    Most::Count(count) => (count as f64, failed),
                    Most::Share(share) => (share, failed / due),
                };
                (Figures::Errors { limit, measured: found }, found <= limit)
            }
        };
        Outcome { figures, holds: holds && measured.answered > 0 }
    }
}

/// Judges each objective by name; of two on the same point one that fails is kept. Without an answer none holds.
pub(super) fn judge(slos: &[Slo], measured: &Measured<'_>) -> BTreeMap<String, Outcome> {
    let mut outcomes = BTreeMap::<String, Outcome>::new();
    for slo in slos {
        let outcome = slo.judge(measured);
        let kept = outcomes.entry(slo.name.clone()).or_insert(outcome);
        if !outcome.holds {
            *kept = outcome;
        }
    }
    outcomes
}

#[cfg(test)]
mod tests {
    use super::{super::record::histogram, *};

    fn slos(texts: &[&str]) -> Vec<Slo> {
        texts.iter().map(|text| text.parse().expect(text)).collect()
    }

    /// A thousand response times of 1 to 1000 us, 990 of them answered, in a second.
    fn judged(texts: &[&str]) -> BTreeMap<String, Outcome> {
        let mut response: Counts = histogram(1_000_000_000);
        (1..=1000_u64).for_each(|us| response.record(us * 1000).expect("in range"));
        let measured = Measured { response: &response, answered: 990, rate_hz: 990.0, failed: 10 };
        judge(&slos(texts), &measured)
    }

    #[test]
    fn objectives_are_read_or_refused() {
        let slo: Slo = "p99.9=250us".parse().expect("an objective");
        let (quantile, longest) = (0.999, Duration::from_micros(250));
        assert_eq!((slo.name(), slo.limit), ("p99.9", Limit::Response { quantile, longest }));
        for text in ["p99.99=1ms", "p12=1s", "max=1s", "rate=995", "errors=3", "errors=0.1%"] {
            assert!(text.parse::<Slo>().is_ok(), "{text}");
        }
        assert!(matches!("p99".parse::<Slo>(), Err(SloError::Form { .. })));
        for text in ["p100=1ms", "p0=1ms", "q99=1ms", "p=1ms"] {
            assert!(matches!(text.parse::<Slo>(), Err(SloError::Name { .. })), "{text}");
        }
        assert!(matches!("p99=1".parse::<Slo>(), Err(SloError::Limit(_))));
        for text in ["rate=0", "rate=fast", "errors=-1", "errors=101%"] {
            assert!(matches!(text.parse::<Slo>(), Err(SloError::Number { .. })), "{text}");
        }
    }

    #[test]
    fn each_objective_is_judged_on_its_own_point() {
        for (text, holds) in [
            ("p50=501us", true),
            ("p50=499us", false),
            ("p99.9=999.5us", true),
            ("p12.5=124us", false),
            // a histogram of three digits: 1 ms reads as 1.0004
            ("max=1001us", true),
            ("max=999us", false),
            ("rate=990", true),
            ("rate=991", false),
            ("errors=10", true),
            ("errors=9", false),
            ("errors=1%", true),
            ("errors=0.9%", false),
        ] {
            let outcomes = judged(&[text]);
            let (_, outcome) = outcomes.first_key_value().expect("one");
            assert_eq!(outcome.holds, holds, "{text}: {outcome:?}");
        }
    }

    #[test]
    fn the_stricter_of_two_counts_in_either_order() {
        for texts in [["p99=1ms", "p99=500us"], ["p99=500us", "p99=1ms"]] {
            assert!(!judged(&texts)["p99"].holds);
        }
    }

    #[test]
    fn nothing_holds_without_an_answer() {
        let response: Counts = histogram(1_000_000_000);
        let measured = Measured { response: &response, answered: 0, rate_hz: 0.0, failed: 0 };
        let outcomes = judge(&slos(&["p50=1s", "errors=0"]), &measured);
        assert!(outcomes.values().all(|outcome| !outcome.holds));
    }
}
