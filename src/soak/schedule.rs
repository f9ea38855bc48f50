//! When each request is due.

use std::{fmt, str::FromStr};

/// How often a request is due.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rate {
    /// Open loop: this many requests a second, whatever the server does [Hz].
    Hz(f64),
    /// Closed loop: the next request leaves when the last was answered.
    Max,
}

/// Why a text is no rate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RateError {
    /// Neither a number nor `max`.
    #[error("'{text}' is neither a rate in Hz nor 'max'")]
    Number {
        /// What was given.
        text: String,
    },
    /// Zero, negative, or beyond one request a nanosecond.
    #[error("a rate of {hz} Hz is outside 0.001 to 10000000 Hz")]
    Range {
        /// What was given [Hz].
        hz: f64,
    },
}

impl FromStr for Rate {
    type Err = RateError;

    fn from_str(text: &str) -> Result<Self, RateError> {
        if text == "max" {
            return Ok(Self::Max);
        }
        let hz: f64 = text.parse().map_err(|_| RateError::Number { text: text.to_owned() })?;
        if !(1e-3..=1e7).contains(&hz) {
            return Err(RateError::Range { hz });
        }
        Ok(Self::Hz(hz))
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hz(hz) => write!(f, "{hz} Hz"),
            Self::Max => f.write_str("max"),
        }
    }
}

impl Rate {
    /// Name of the folder for the report of this rate.
    pub fn folder(self) -> String {
        match self {
            Self::Hz(hz) => format!("{hz}hz"),
            Self::Max => "max".into(),
        }
    }

    /// Time between two requests [ns]; none in a closed loop.
    pub fn interval_ns(self) -> Option<f64> {
        match self {
            Self::Hz(hz) => Some(1e9 / hz),
            Self::Max => None,
        }
    }

    /// Intended start of request `index` after the first [ns]; none in a closed loop.
    ///
    /// Multiplied, not added up: an error of rounding stays below a nanosecond however long the run.
    pub fn intended_ns(self, index: u64) -> Option<u64> {
        self.interval_ns().map(|interval| (index as f64 * interval).round() as u64)
    }

    /// How many requests are due before `end_ns`; none in a closed loop.
    pub fn due_before(self, end_ns: u64) -> Option<u64> {
        let mut count = (end_ns as f64 / self.interval_ns()?).ceil() as u64;
        while count > 0 && self.intended_ns(count - 1)? >= end_ns {
            count -= 1;
        }
        while self.intended_ns(count)? < end_ns {
            count += 1;
        }
        Some(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_day_at_an_awkward_rate_does_not_drift() {
        let rate = Rate::Hz(333.0);
        let day = 86_400_u64;
        assert_eq!(rate.intended_ns(333 * day), Some(day * 1_000_000_000));
        assert_eq!(rate.due_before(day * 1_000_000_000), Some(333 * day));
    }

    #[test]
    fn requests_due_are_counted_to_the_last() {
        assert_eq!(Rate::Hz(1000.0).due_before(3_000_000_000), Some(3000));
        assert_eq!(Rate::Hz(1000.0).due_before(3_000_000_001), Some(3001));
        assert_eq!(Rate::Hz(3.0).due_before(1), Some(1));
        assert_eq!(Rate::Max.due_before(1), None);
    }

    #[test]
    fn rates_are_read_or_refused() {
        assert_eq!("max".parse(), Ok(Rate::Max));
        assert_eq!("1e3".parse(), Ok(Rate::Hz(1000.0)));
        assert!(matches!("fast".parse::<Rate>(), Err(RateError::Number { .. })));
        for text in ["0", "-5", "NaN", "inf"] {
            assert!(matches!(text.parse::<Rate>(), Err(RateError::Range { .. })), "{text}");
        }
    }
}
