//! Recordings that were never made: a vehicle in a channel with a ramp at each end, after the source paper's table of 71
//! trials, seen by cameras with noise and stamped with jitter.
//!
//! The paper's recordings are not public. These follow what it states (directions, depths, numbers of trials, largest and
//! mean commanded speed, rates, marker error); the slope of the ramps, accelerations and what the cameras see are chosen.
//! All of it is labelled generated: file names, descriptions, report and page.
//!
//! Reading order: `schedule` (which trials), `run` (the exact motion of one), `cameras` (what is recorded of it).

mod cameras;
mod run;
mod schedule;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

pub use cameras::{CAMERA_RATE, Cameras};
pub use run::{Motion, Run};
pub use schedule::{Direction, PAPER_TABLE, Planned, TableRow, schedule};

use super::recording::{RECORDINGS_FILE, Recording, RecordingEntry, RecordingsFile};
use crate::random::Random;
use wade_core::condition::FRESH_WATER;
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;

/// From the marker origin to the center of mass, vehicle frame [m]: the paper's.
pub const CENTER_OF_MASS_FROM_MARKER: [f64; 3] = [0.2, 0.0, -0.63];

/// A generated recording and the motion that it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Generated {
    /// Name, which says that it is generated.
    pub name: String,
    /// Water depth over the flat ground, and altitude of the water, since the ground is at 0 [m].
    pub depth: f64,
    /// The exact motion.
    pub run: Run,
    /// What the cameras recorded.
    pub recording: Recording,
}

/// All trials of the paper's table for a vehicle.
pub fn recordings(vehicle: &Vehicle, seed: u64) -> Vec<Generated> {
    let mut random = Random::new(seed);
    let cameras = Cameras::default();
    let generate = |planned: Planned| {
        let mut random = random.fork();
        let run = Run::new(&planned, vehicle, &mut random);
        let recording = cameras.record(&run, &mut random);
        Generated { name: planned.name, depth: planned.depth, run, recording }
    };
    schedule().into_iter().map(generate).collect()
}

/// How the recordings of a seed were generated, in words.
pub fn description(seed: u64) -> String {
    let Cameras { marker_std, jitter_std } = Cameras::default();
    format!(
        "generated, seed {seed}: motion after the paper's table of 71 trials, marker noise {:.1} mm an axis, stamp \
         jitter {:.1} ms; nothing of it was measured",
        marker_std * 1e3,
        jitter_std * 1e3
    )
}

/// Writes the recordings of a seed with their description to a folder, which is made.
pub fn write(folder: &Path, vehicle: &Vehicle, seed: u64) -> std::io::Result<()> {
    fs::create_dir_all(folder)?;
    let mut entries = BTreeMap::new();
    for Generated { name, depth, recording, .. } in recordings(vehicle, seed) {
        fs::write(folder.join(format!("{name}.csv")), recording.to_csv())?;
        entries.insert(name, RecordingEntry { water_level_m: depth, depth_m: Some(depth) });
    }
    let file = RecordingsFile {
        vehicle: vehicle.name.clone(),
        generated: Some(description(seed)),
        fluid_density_kgpm3: FRESH_WATER,
        center_of_mass_from_marker_m: CENTER_OF_MASS_FROM_MARKER,
        recording: entries,
    };
    fs::write(folder.join(RECORDINGS_FILE), file.to_toml())
}

/// Gaussian numbers with mean 0 and variance 1 (Box and Muller, 1958).
fn gaussian(random: &mut Random) -> f64 {
    // 1 - unit() lies in (0, 1]
    let radius = (-2.0 * (1.0 - random.unit()).ln()).sqrt();
    radius * (std::f64::consts::TAU * random.unit()).cos()
}

fn gaussian_vector(random: &mut Random) -> Vec3 {
    Vec3::from_fn(|_, _| gaussian(random))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaussian_numbers_have_their_moments() {
        let mut random = Random::new(3);
        let numbers: Vec<f64> = (0..100_000).map(|_| gaussian(&mut random)).collect();
        let moment = |power: i32| numbers.iter().map(|x| x.powi(power)).sum::<f64>() / 1e5;
        assert!(moment(1).abs() < 0.01 && (moment(2) - 1.0).abs() < 0.02 && (moment(4) - 3.0).abs() < 0.15);
    }
}
