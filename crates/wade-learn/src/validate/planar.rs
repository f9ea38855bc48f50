//! The part of a trial on flat ground: where the tests look.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::signal::pieces;
use crate::trials::Trial;

/// What makes a section planar.
///
/// The source paper states the first three; how it finds the section it does not say. Here it is the longest run of
/// moving samples whose depth is the one the trial spends most samples at, within the tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlanarConfig {
    /// A section lasts longer than this [s].
    pub duration_s: f64,
    /// A section has more samples than this.
    pub samples: usize,
    /// The mean vertical velocity in the world is smaller than this [m/s].
    pub vertical_speed_mps: f64,
    /// The depth stays within this of its most frequent value [m].
    pub depth_tolerance_m: f64,
    /// A vehicle slower than this stands [m/s].
    pub least_speed_mps: f64,
}

impl Default for PlanarConfig {
    fn default() -> Self {
        Self {
            duration_s: 0.2,
            samples: 20,
            vertical_speed_mps: 0.05,
            depth_tolerance_m: 0.01,
            least_speed_mps: 0.1,
        }
    }
}

/// Why a trial has no planar section.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotPlanar {
    /// Never in water while moving.
    #[error("it never moves in water")]
    Dry,
    /// Too short a stay at one depth.
    #[error("at its most frequent depth it stays for {samples} samples, {duration_s:.2} s")]
    Short {
        /// Samples in the longest run.
        samples: usize,
        /// Its duration [s].
        duration_s: f64,
    },
    /// It rises or sinks.
    #[error("its mean vertical velocity is {vertical_speed_mps:.3} m/s")]
    Climbing {
        /// The mean [m/s].
        vertical_speed_mps: f64,
    },
}

/// Horizontal speed [m/s], squared.
pub(super) fn speed_squared(trial: &Trial, sample: usize) -> f64 {
    let (v, up) = (trial.velocity[sample], trial.up(sample));
    (v - up.into_inner() * up.dot(&v)).norm_squared()
}

/// The samples of the planar section of a trial with these depths [m].
pub fn planar_section(
    trial: &Trial,
    depths: &[f64],
    config: &PlanarConfig,
) -> Result<Range<usize>, NotPlanar> {
    let moving: Vec<bool> = (0..trial.len())
        .map(|i| depths[i] > 0.0 && speed_squared(trial, i) > config.least_speed_mps.powi(2))
        .collect();
    let depth = most_frequent_depth(depths, &moving, config).ok_or(NotPlanar::Dry)?;
    let inside = |i: &usize| moving[*i] && (depths[*i] - depth).abs() <= config.depth_tolerance_m;
    let run = longest_run(trial, inside);
    // few samples at the ends of the window may all be a rounding farther from their mean than the tolerance
    let duration_s = run.clone().last().map_or(0.0, |last| trial.t[last] - trial.t[run.start]);
    if duration_s <= config.duration_s || run.len() <= config.samples {
        return Err(NotPlanar::Short { samples: run.len(), duration_s });
    }
    let rising = run.clone().map(|i| trial.up(i).dot(&trial.velocity[i])).sum::<f64>();
    let vertical_speed_mps = rising / run.len() as f64;
    match vertical_speed_mps.abs() < config.vertical_speed_mps {
        true => Ok(run),
        false => Err(NotPlanar::Climbing { vertical_speed_mps }),
    }
}

/// The mean of the samples in the window of twice the tolerance that holds most of them.
fn most_frequent_depth(depths: &[f64], moving: &[bool], config: &PlanarConfig) -> Option<f64> {
    let mut depths: Vec<f64> =
        depths.iter().zip(moving).filter(|(_, moving)| **moving).map(|(depth, _)| *depth).collect();
    depths.sort_by(f64::total_cmp);
    let window = 2.0 * config.depth_tolerance_m;
    let within = |start: usize| depths.partition_point(|depth| *depth <= depths[start] + window) - start;
    let (start, count) = (0..depths.len()).map(|start| (start, within(start))).max_by_key(|(_, n)| *n)?;
    Some(depths[start..start + count].iter().sum::<f64>() / count as f64)
}

/// The longest run of samples without a hole in time; empty where none is inside.
fn longest_run(trial: &Trial, inside: impl Fn(&usize) -> bool) -> Range<usize> {
    let mut longest = 0..0;
    for piece in pieces(&trial.t) {
        let mut start = piece.start;
        for i in piece.clone() {
            if !inside(&i) {
                start = i + 1;
            } else if i + 1 - start > longest.len() {
                longest = start..i + 1;
            }
        }
    }
    longest
}
