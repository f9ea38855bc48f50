//! Times as people type them: `300s`, `5m`, `1.5ms`.

use std::time::Duration;

const UNITS: [(&str, f64); 6] =
    [("ns", 1e-9), ("us", 1e-6), ("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0)];

/// Why a text is no time.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DurationError {
    /// The number is missing or cannot be read.
    #[error("'{text}' does not start with a number; write for example 300s or 1.5ms")]
    Number {
        /// What was given.
        text: String,
    },
    /// The unit is missing or unknown.
    #[error("'{text}' needs a unit: ns, us, ms, s, m or h")]
    Unit {
        /// What was given.
        text: String,
    },
    /// Zero, or longer than a Duration holds.
    #[error("'{text}' must be longer than nothing and shorter than a year")]
    Range {
        /// What was given.
        text: String,
    },
}

/// Reads a positive time with its unit (ns, us, ms, s, m, h).
pub fn parse_duration(text: &str) -> Result<Duration, DurationError> {
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let number: f64 = number.trim().parse().map_err(|_| DurationError::Number { text: text.to_owned() })?;
    let scale = UNITS.iter().find(|(name, _)| *name == unit).map(|(_, scale)| scale);
    let seconds = number * scale.ok_or_else(|| DurationError::Unit { text: text.to_owned() })?;
    if !(1e-9..31_536_000.0).contains(&seconds) {
        return Err(DurationError::Range { text: text.to_owned() });
    }
    Ok(Duration::from_secs_f64(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_is_read() {
        for (text, nanoseconds) in [
            ("7ns", 7),
            ("1.5us", 1_500),
            ("1ms", 1_000_000),
            ("300s", 300_000_000_000),
            ("5m", 300_000_000_000),
            ("1h", 3_600_000_000_000),
        ] {
            assert_eq!(parse_duration(text).map(|d| d.as_nanos()), Ok(nanoseconds), "{text}");
        }
    }

    #[test]
    fn the_error_says_what_is_missing() {
        assert!(matches!(parse_duration("300"), Err(DurationError::Unit { .. })));
        assert!(matches!(parse_duration("3 parsecs"), Err(DurationError::Unit { .. })));
        assert!(matches!(parse_duration("ms"), Err(DurationError::Number { .. })));
        assert!(matches!(parse_duration("-1s"), Err(DurationError::Range { .. })));
        assert!(matches!(parse_duration("0s"), Err(DurationError::Range { .. })));
    }
}
