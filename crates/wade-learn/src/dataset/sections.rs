//! Transient removal and section averages (source paper, "Transient Removal & Section-based Averaging").

use serde::{Deserialize, Serialize};

use super::history::{History, HistoryError};

/// Which part of a history counts, and how it is cut.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sections {
    /// Time before which the flow still develops [s].
    pub transient_s: f64,
    /// Number of sections, one after the other.
    pub count: u32,
    /// Length of each [s].
    pub length_s: f64,
}

impl Default for Sections {
    /// The paper's: 20 sections of 0.1 s after 2 s.
    fn default() -> Self {
        Self { transient_s: 2.0, count: 20, length_s: 0.1 }
    }
}

/// The part of a history from one time to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Its number, from 0.
    pub index: u32,
    /// Start [s].
    pub start_s: f64,
    /// End [s].
    pub end_s: f64,
}

impl Sections {
    /// True where there is at least one section and it has a length.
    pub fn is_valid(&self) -> bool {
        let finite = self.transient_s.is_finite() && self.length_s.is_finite();
        finite && self.count > 0 && self.length_s > 0.0 && self.transient_s >= 0.0
    }

    /// The sections.
    pub fn iter(&self) -> impl Iterator<Item = Section> + use<> {
        let Self { transient_s, count, length_s } = *self;
        let edge = move |index: u32| transient_s + length_s * f64::from(index);
        (0..count).map(move |index| Section { index, start_s: edge(index), end_s: edge(index + 1) })
    }

    /// The mean of each section.
    pub fn means<const N: usize>(&self, history: &History<N>) -> Result<Vec<[f64; N]>, HistoryError> {
        self.iter().map(|section| history.mean(section.start_s, section.end_s)).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn the_defaults_are_the_papers_window_of_four_seconds() {
        let sections: Vec<_> = Sections::default().iter().collect();
        assert_eq!((sections.len(), sections[0].start_s), (20, 2.0));
        assert!((sections[19].end_s - 4.0).abs() < 1e-12);
        assert!(sections.windows(2).all(|pair| pair[0].end_s == pair[1].start_s));
    }

    #[test]
    fn sections_of_a_decay_are_those_of_its_integral() {
        // 10 + 1e6 exp(-t / tau), tau 0.1 s: the mean from a to b is 10 + 1e6 tau (exp(-a / tau) - exp(-b / tau)) / (b - a)
        let decay = |t: f64| 1e6 * (-t / 0.1).exp();
        let history = History::new((0..=4000).map(|i| {
            let t = f64::from(i) * 0.001;
            (t, [10.0 + decay(t)])
        }));
        let sections = Sections::default();
        let means = sections.means(&history.unwrap()).unwrap();
        for (section, mean) in sections.iter().zip(&means) {
            let expected = 10.0 + decay(section.start_s) - decay(section.end_s);
            assert!((mean[0] - expected).abs() < 1e-6, "{section:?}: {mean:?}, {expected}");
        }
        assert!((means[0][0] - 10.0013).abs() < 1e-4, "what was 1e6 at the start is gone at 2 s");
    }
}
