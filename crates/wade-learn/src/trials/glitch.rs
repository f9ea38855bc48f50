//! Samples that no load explains: alone among those before and after them.

use crate::signal::median;

/// Fewest samples of which there is noise to speak of.
const ENOUGH: usize = 20;
/// Samples on either side that a sample is held against.
const AROUND: usize = 5;
/// A sample stands alone that lies further than this from the median of those around it, in noises of a sample, ...
const FAR: f64 = 100.0;
/// ... while those beside it lie nearer than this share of that, or within so many noises: the water's loads last longer
/// than a sample.
const NEAR: f64 = 0.01;
const NOISES: f64 = 5.0;

/// A sample that was left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Glitch {
    /// Line of the file.
    pub row: u64,
    /// The column.
    pub column: &'static str,
    /// The value.
    pub value: f64,
    /// Its distance from the median of the samples around it, over the noise of a sample.
    pub ratio: f64,
}

/// The samples that stand alone, each with its distance from those around it in noises of a sample; none where most samples are
/// the same, since there is no noise to judge by.
pub(super) fn glitches(values: &[f64]) -> Vec<(usize, f64)> {
    if values.len() < ENOUGH {
        return Vec::new();
    }
    // a sample less the mean of its neighbors has 1.5 times the variance of noise, and hardly anything of a load
    let differences = values.windows(3).map(|three| (three[1] - 0.5 * (three[0] + three[2])).abs());
    let noise = median(&mut differences.collect::<Vec<_>>()).unwrap_or_default() * 1.4826 / 1.5_f64.sqrt();
    let alone = |at: usize| {
        let around = at.saturating_sub(AROUND)..(at + AROUND + 1).min(values.len());
        let center = median(&mut around.map(|i| values[i]).collect::<Vec<_>>())?;
        let distance = |i: usize| values.get(i).map_or(0.0, |value| (value - center).abs());
        let near = f64::max(NEAR * distance(at), NOISES * noise);
        let beside = at.checked_sub(1).map_or(0.0, distance).max(distance(at + 1));
        (distance(at) > FAR * noise && beside < near).then(|| (at, distance(at) / noise))
    };
    if noise > 0.0 { (0..values.len()).filter_map(alone).collect() } else { Vec::new() }
}
