//! What the response time must hold.

use std::{collections::BTreeMap, str::FromStr, time::Duration};

use serde::Serialize;

use super::{
    duration::{DurationError, parse_duration},
    record::Percentiles,
};

/// A point of the response-time distribution that a promise can be made about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantile {
    /// Half of the requests are faster.
    P50,
    /// 95 of 100.
    P95,
    /// 99 of 100.
    P99,
    /// 999 of 1000.
    P99_9,
    /// The slowest one.
    Max,
}

impl Quantile {
    const ALL: [Self; 5] = [Self::P50, Self::P95, Self::P99, Self::P99_9, Self::Max];

    /// The name used on the command line and in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::P50 => "p50",
            Self::P95 => "p95",
            Self::P99 => "p99",
            Self::P99_9 => "p99.9",
            Self::Max => "max",
        }
    }

    fn of(self, p: &Percentiles) -> f64 {
        match self {
            Self::P50 => p.p50,
            Self::P95 => p.p95,
            Self::P99 => p.p99,
            Self::P99_9 => p.p99_9,
            Self::Max => p.max,
        }
    }
}

/// A limit on one point of the response-time distribution, written `p99=1ms`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slo {
    /// Which point.
    pub quantile: Quantile,
    /// The longest response time that still holds.
    pub limit: Duration,
}

/// Why a text is no objective.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SloError {
    /// No equals sign.
    #[error("'{text}' is not of the form p99=1ms")]
    Form {
        /// What was given.
        text: String,
    },
    /// Not one of the five points that are measured.
    #[error("'{name}' is none of p50, p95, p99, p99.9, max")]
    Quantile {
        /// What was given.
        name: String,
    },
    /// The limit is no time.
    #[error(transparent)]
    Limit(#[from] DurationError),
}

impl FromStr for Slo {
    type Err = SloError;

    fn from_str(text: &str) -> Result<Self, SloError> {
        let (name, limit) = text.split_once('=').ok_or_else(|| SloError::Form { text: text.to_owned() })?;
        let quantile = Quantile::ALL.into_iter().find(|q| q.name() == name);
        let quantile = quantile.ok_or_else(|| SloError::Quantile { name: name.to_owned() })?;
        Ok(Self { quantile, limit: parse_duration(limit)? })
    }
}

/// How one objective came out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Outcome {
    /// The limit [us].
    pub limit_us: f64,
    /// The measured response time [us].
    pub measured_us: f64,
    /// True when the measured time is within the limit.
    pub holds: bool,
}

/// Judges each objective by name; of two on the same point the stricter is kept. Without an answer none holds.
pub(super) fn judge(slos: &[Slo], response: &Percentiles, answered: u64) -> BTreeMap<&'static str, Outcome> {
    let mut outcomes = BTreeMap::<_, Outcome>::new();
    for slo in slos {
        let limit_us = slo.limit.as_secs_f64() * 1e6;
        let measured_us = slo.quantile.of(response);
        let outcome = Outcome { limit_us, measured_us, holds: answered > 0 && measured_us <= limit_us };
        outcomes
            .entry(slo.quantile.name())
            .and_modify(|kept| {
                if limit_us < kept.limit_us {
                    *kept = outcome;
                }
            })
            .or_insert(outcome);
    }
    outcomes
}

#[cfg(test)]
mod tests {
    use super::*;

    const MEASURED: Percentiles =
        Percentiles { p50: 10.0, p95: 20.0, p99: 999.0, p99_9: 1500.0, max: 9000.0 };

    fn slos(texts: &[&str]) -> Vec<Slo> {
        texts.iter().map(|text| text.parse().expect(text)).collect()
    }

    #[test]
    fn objectives_are_read_or_refused() {
        assert_eq!(
            "p99.9=250us".parse(),
            Ok(Slo { quantile: Quantile::P99_9, limit: Duration::from_micros(250) })
        );
        assert!(matches!("p99".parse::<Slo>(), Err(SloError::Form { .. })));
        assert!(matches!("p98=1ms".parse::<Slo>(), Err(SloError::Quantile { .. })));
        assert!(matches!("p99=1".parse::<Slo>(), Err(SloError::Limit(_))));
    }

    #[test]
    fn each_objective_is_judged_on_its_own_point() {
        let outcomes = judge(&slos(&["p99=1ms", "p99.9=1ms", "max=10ms"]), &MEASURED, 1);
        assert!(outcomes["p99"].holds);
        assert!(!outcomes["p99.9"].holds);
        assert!(outcomes["max"].holds);
    }

    #[test]
    fn the_stricter_of_two_counts_in_either_order() {
        for texts in [["p99=1ms", "p99=500us"], ["p99=500us", "p99=1ms"]] {
            assert!(!judge(&slos(&texts), &MEASURED, 1)["p99"].holds);
        }
    }

    #[test]
    fn nothing_holds_without_an_answer() {
        assert!(!judge(&slos(&["p50=1s"]), &MEASURED, 0)["p50"].holds);
    }
}
