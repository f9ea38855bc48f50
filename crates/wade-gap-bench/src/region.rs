//! Boxes in the space of states, as text and as sets of samples.

use super::State;

/// A quantity that a region bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Feature {
    /// Water depth [m].
    Depth,
    /// Depth Froude number.
    Froude,
    /// Speed over ground [m/s].
    Speed,
    /// Velocity along x [m/s].
    Surge,
    /// Velocity along y [m/s].
    Sway,
    /// Size of the acceleration [m/s2].
    Acceleration,
    /// Rate of yaw [rad/s].
    YawRate,
    /// Rate at which the depth grows [m/s].
    WettingRate,
    /// Time since the trial began [s].
    Time,
    /// Roll and pitch [rad].
    Roll,
    /// Nose down.
    Pitch,
}

/// Words of reports, in lower case, for each feature.
const WORDS: [(Feature, &[&str]); 11] = [
    (Feature::Depth, &["depth", "water_depth", "d"]),
    (Feature::Froude, &["froude", "fr_h", "froude_depth", "depth_froude", "fr"]),
    (Feature::Speed, &["speed", "v"]),
    (Feature::Surge, &["vx", "surge", "u"]),
    (Feature::Sway, &["vy", "sway"]),
    (Feature::Acceleration, &["acceleration", "a", "accel"]),
    (Feature::YawRate, &["yaw_rate", "wz", "r"]),
    (Feature::WettingRate, &["wetting_rate", "depth_rate"]),
    (Feature::Time, &["t", "time", "time_in_water"]),
    (Feature::Roll, &["roll"]),
    (Feature::Pitch, &["pitch"]),
];

impl Feature {
    /// Its value in a state; `depth_rate` in m/s.
    pub fn value(self, state: &State, depth_rate: f64) -> f64 {
        match self {
            Self::Depth => state.depth,
            Self::Froude => state.froude(),
            Self::Speed => state.velocity.norm(),
            Self::Surge => state.velocity.x,
            Self::Sway => state.velocity.y,
            Self::Acceleration => state.acceleration.norm(),
            Self::YawRate => state.angular_velocity.z,
            Self::WettingRate => depth_rate,
            Self::Time => state.t,
            Self::Roll => state.attitude[0],
            Self::Pitch => state.attitude[1],
        }
    }

    fn of_word(word: &str) -> Option<(Self, bool)> {
        let word = word.trim().to_lowercase();
        // |yaw_rate| or abs(yaw_rate)
        let inner = word.strip_prefix('|').and_then(|w| w.strip_suffix('|'));
        let inner = inner.or_else(|| word.strip_prefix("abs(").and_then(|w| w.strip_suffix(')')));
        let name = inner.unwrap_or(&word).trim().replace([' ', '-'], "_");
        let found = WORDS.iter().find(|(_, words)| words.contains(&name.as_str()))?;
        Some((found.0, inner.is_some()))
    }
}

/// One bound.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
struct Bound {
    feature: Feature,
    absolute: bool,
    /// True where values above the limit are inside.
    above: bool,
    limit: f64,
}

/// States that keep every bound.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Region(Vec<Bound>);

impl Region {
    /// All states with more of a feature than a limit.
    pub fn above(feature: Feature, limit: f64) -> Self {
        Self(vec![Bound { feature, absolute: false, above: true, limit }])
    }

    /// With a further bound from above.
    pub fn and_below(mut self, feature: Feature, limit: f64) -> Self {
        self.0.push(Bound { feature, absolute: false, above: false, limit });
        self
    }

    /// True for a state inside.
    pub fn holds(&self, state: &State, depth_rate: f64) -> bool {
        self.0.iter().all(|bound| {
            let value = bound.feature.value(state, depth_rate);
            let value = if bound.absolute { value.abs() } else { value };
            if bound.above { value > bound.limit } else { value <= bound.limit }
        })
    }

    /// Reads conditions such as `depth > 0.15 m and 0.4 < froude <= 1.2`; `None` where a part is none.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.replace("<=", "<").replace(">=", ">").replace('≤', "<").replace('≥', ">");
        let parts = text.replace(" & ", " and ").replace(", ", " and ");
        let bounds: Option<Vec<Vec<Bound>>> = parts.split(" and ").map(condition).collect();
        bounds.map(|bounds| Self(bounds.into_iter().flatten().collect()))
    }
}

/// `feature > limit`, `limit < feature` or `limit < feature < limit`.
fn condition(text: &str) -> Option<Vec<Bound>> {
    let signs: Vec<char> = text.chars().filter(|c| ['<', '>'].contains(c)).collect();
    let terms: Vec<&str> = text.split(['<', '>']).collect();
    let bound = |word: &str, above: bool, limit: &str| {
        let (feature, absolute) = Feature::of_word(word)?;
        Some(Bound { feature, absolute, above, limit: number(limit)? })
    };
    match (signs.as_slice(), terms.as_slice()) {
        ([sign], [left, right]) if number(left).is_none() => Some(vec![bound(left, *sign == '>', right)?]),
        ([sign], [left, right]) => Some(vec![bound(right, *sign == '<', left)?]),
        (['<', '<'], [low, word, high]) => Some(vec![bound(word, true, low)?, bound(word, false, high)?]),
        _ => None,
    }
}

/// The number at the start of a text, whatever unit follows.
fn number(text: &str) -> Option<f64> {
    text.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn reads_what_reports_say() {
        let region = Region::parse("depth > 0.15 m and 0.4 <= fr_h < 1.2").unwrap();
        let state = |depth: f64, speed: f64| State {
            depth,
            velocity: wade_core::frame::Vec3::new(speed, 0.0, 0.0),
            ..State::default()
        };
        assert!(region.holds(&state(0.2, 1.0), 0.0));
        assert!(!region.holds(&state(0.1, 0.7), 0.0) && !region.holds(&state(0.2, 3.0), 0.0));
        assert!(Region::parse("|yaw_rate| > 0.3, speed <= 2").is_some());
        assert_eq!(Region::parse("in the morning"), None);
        assert_eq!(Region::parse("depth > 0.1"), Some(Region::above(Feature::Depth, 0.1)));
    }
}
