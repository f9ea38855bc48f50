//! Motion capture to body-frame kinematics, by the source paper's processing.

use std::fs;
use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};

use super::reading::check_reading;
use super::recording::{Recording, RecordingError, RecordingFault, Recordings, at};
use super::tracking::check_tracking;
use crate::signal::{
    FilterError, SavitzkyGolay, UniformGrid, angular_velocity, interpolate, pieces, slerp, without_sign_flips,
};
use crate::trials::{MANIFEST_FILE, Manifest, csv_text};
use wade_core::frame::{Vec3, up_from_quaternion};
use wade_core::vehicle::Vehicle;

/// A recording is resampled to at most this many samples for each of its own, and some more: with `t` in milliseconds it
/// would be to a thousand.
const MOST_SAMPLES: [f64; 2] = [100.0, 1000.0];

/// Rates and filter; the defaults are the paper's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MocapConfig {
    /// Rate after resampling [Hz].
    pub rate_hz: f64,
    /// Window of the Savitzky-Golay filter [samples].
    pub window: usize,
    /// Order of its polynomial.
    pub order: usize,
}

impl Default for MocapConfig {
    fn default() -> Self {
        Self { rate_hz: 111.0, window: 9, order: 2 }
    }
}

/// Motion of the center of mass in the terms of a trial, a value a sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Kinematics {
    /// Time [s]: uniform but for holes.
    pub t: Vec<f64>,
    /// Velocity of the center of mass, body frame [m/s].
    pub velocity: Vec<Vec3>,
    /// Angular velocity, body frame [rad/s].
    pub angular_velocity: Vec<Vec3>,
    /// Roll, pitch and yaw [rad].
    pub attitude: Vec<Vec3>,
    /// Water surface above the ground-contact plane at the body origin [m]; negative on dry ground.
    pub depth: Vec<f64>,
}

impl Kinematics {
    /// The file of a trial.
    pub fn to_csv(&self) -> String {
        let axis = |vectors: &[Vec3], axis: usize| vectors.iter().map(|v| v[axis]).collect::<Vec<f64>>();
        let vectors = [
            (["vx", "vy", "vz"], &self.velocity),
            (["wx", "wy", "wz"], &self.angular_velocity),
            (["roll", "pitch", "yaw"], &self.attitude),
        ];
        let components: Vec<(&str, Vec<f64>)> = vectors
            .iter()
            .flat_map(|(names, values)| (0..3).map(|component| (names[component], axis(values, component))))
            .collect();
        let mut columns: Vec<(&str, &[f64])> = vec![("t", &self.t)];
        columns.extend(components.iter().map(|(name, values)| (*name, values.as_slice())));
        columns.push(("depth", &self.depth));
        csv_text(&columns)
    }
}

/// What the processing knows beside the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rig {
    /// From the marker origin to the center of mass, body frame [m].
    pub center_of_mass_from_marker: Vec3,
    /// From the marker origin to the body origin, body frame [m].
    pub origin_from_marker: Vec3,
    /// Height of the ground-contact plane in the body frame [m].
    pub z0: f64,
    /// Altitude of the still water in the frame of the cameras [m].
    pub water_level: f64,
}

impl Rig {
    /// The rig of one recording of a vehicle.
    pub fn new(center_of_mass_from_marker: Vec3, vehicle: &Vehicle, water_level: f64) -> Self {
        let origin_from_marker = center_of_mass_from_marker - vehicle.center_of_mass;
        Self { center_of_mass_from_marker, origin_from_marker, z0: vehicle.z0, water_level }
    }

    /// Depth from the altitude of the marker and the attitude, in closed form for any tilt: the body origin lies
    /// `up . r` above the marker, and the water plane crosses body z at `(level - altitude of the origin) / up_z`. With
    /// roll 0 this is the paper's correction by pitch.
    pub fn depth(&self, marker_altitude: f64, world_from_body: &UnitQuaternion<f64>) -> f64 {
        let up = up_from_quaternion(world_from_body);
        let origin_altitude = marker_altitude + up.dot(&self.origin_from_marker);
        (self.water_level - origin_altitude) / up.z - self.z0
    }
}

/// Resamples to a uniform rate (positions linearly, rotations by slerp), smooths and differentiates, and moves the
/// velocity to the center of mass: `v_COM = v_marker + omega x r_CP`. Pieces between holes in time are processed apart,
/// and those shorter than the filter's window left out; when nothing remains, the longest one's fault is the answer.
pub fn process(recording: &Recording, rig: &Rig, config: &MocapConfig) -> Result<Kinematics, FilterError> {
    let filter = SavitzkyGolay::new(config.window, config.order)?;
    let mut all = Kinematics::default();
    let mut longest = 0;
    for piece in pieces(&recording.t) {
        let t = &recording.t[piece.clone()];
        let grid = UniformGrid::within(t[0], t[t.len() - 1], config.rate_hz);
        longest = longest.max(grid.count);
        if grid.count >= config.window {
            let (position, rotation) = (&recording.position[piece.clone()], &recording.rotation[piece]);
            add_piece(&mut all, Piece { t, position, rotation }, &grid, &filter, rig)?;
        }
    }
    match all.t.is_empty() {
        true => Err(FilterError::TooShort { samples: longest, window: config.window }),
        false => Ok(all),
    }
}

/// A part of a recording without a hole in time.
struct Piece<'a> {
    t: &'a [f64],
    position: &'a [Vec3],
    rotation: &'a [UnitQuaternion<f64>],
}

fn add_piece(
    all: &mut Kinematics,
    piece: Piece<'_>,
    grid: &UniformGrid,
    filter: &SavitzkyGolay,
    rig: &Rig,
) -> Result<(), FilterError> {
    let Piece { t, position, rotation } = piece;
    let instants = grid.times();
    let mut smooth = [const { Vec::new() }; 3];
    let mut rate = [const { Vec::new() }; 3];
    for axis in 0..3 {
        let samples: Vec<f64> = position.iter().map(|p| p[axis]).collect();
        let samples = interpolate(t, &samples, &instants);
        smooth[axis] = filter.smooth(&samples)?;
        rate[axis] = filter.derivative(&samples, 1, grid.step)?;
    }
    let quaternions = without_sign_flips(&slerp(t, rotation, &instants));
    let components = |derivative: usize| -> Result<Vec<Quaternion<f64>>, FilterError> {
        let mut filtered = [const { Vec::new() }; 4];
        for (component, filtered) in filtered.iter_mut().enumerate() {
            let samples: Vec<f64> = quaternions.iter().map(|q| q.coords[component]).collect();
            *filtered = filter.derivative(&samples, derivative, grid.step)?;
        }
        let [i, j, k, w] = filtered;
        Ok((0..i.len()).map(|n| Quaternion::new(w[n], i[n], j[n], k[n])).collect())
    };
    for (n, (quaternion, quaternion_rate)) in components(0)?.iter().zip(components(1)?).enumerate() {
        let omega = angular_velocity(quaternion, &quaternion_rate);
        let world_from_body = UnitQuaternion::from_quaternion(*quaternion);
        let marker_velocity = Vec3::new(rate[0][n], rate[1][n], rate[2][n]);
        let (roll, pitch, yaw) = world_from_body.euler_angles();
        all.t.push(instants[n]);
        all.velocity
            .push(world_from_body.inverse() * marker_velocity + omega.cross(&rig.center_of_mass_from_marker));
        all.angular_velocity.push(omega);
        all.attitude.push(Vec3::new(roll, pitch, yaw));
        all.depth.push(rig.depth(smooth[2][n], &world_from_body));
    }
    Ok(())
}

/// Refuses stamps that cannot be seconds: between its holes a recording may not become far more samples than it has.
fn check_clock(recording: &Recording, rate_hz: f64) -> Result<(), RecordingFault> {
    let t = &recording.t;
    let span = pieces(t).into_iter().map(|piece| t[piece.end - 1] - t[piece.start]).sum::<f64>();
    let (rows, samples) = (t.len(), span * rate_hz);
    let [each, more] = MOST_SAMPLES;
    match samples > each * rows as f64 + more {
        true => Err(RecordingFault::Clock { rows, span, samples, rate_hz }),
        false => Ok(()),
    }
}

/// Processes every recording of a vehicle and writes the trials with their `trials.toml` to a folder, which is made.
pub fn trials_from_recordings(
    recordings: &Recordings,
    vehicle: &Vehicle,
    config: &MocapConfig,
    folder: &Path,
) -> Result<(), RecordingError> {
    let file = &recordings.file;
    let described = recordings.directory.join(super::RECORDINGS_FILE);
    if file.vehicle != vehicle.name {
        let (recordings, asked) = (file.vehicle.clone(), vehicle.name.clone());
        return Err(at(&described)(RecordingFault::Vehicle { recordings, asked }));
    }
    let nominal = file.recording.iter().filter_map(|(name, entry)| Some((name.clone(), entry.depth_m?)));
    let manifest = Manifest {
        vehicle: file.vehicle.clone(),
        generated: file.generated.clone(),
        fluid_density: Some(file.fluid_density_kgpm3),
        nominal_depth: nominal.collect(),
        ..Manifest::default()
    };
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::write(&path, text).map_err(|error| at(&path)(error.into()))
    };
    fs::create_dir_all(folder).map_err(|error| at(folder)(error.into()))?;
    for (name, recording) in &recordings.recordings {
        let rig = Rig::new(
            Vec3::from(file.center_of_mass_from_marker_m),
            vehicle,
            file.recording[name].water_level_m,
        );
        let path = recordings.directory.join(format!("{name}.csv"));
        check_clock(recording, config.rate_hz).map_err(at(&path))?;
        let kinematics = process(recording, &rig, config)
            .map_err(|source| at(&path)(RecordingFault::Filter { rate_hz: config.rate_hz, source }))?;
        let reading = check_reading(recording, &rig, file.recording[name].depth_m);
        // frames that are wrong make the whole look wrong, too, but no mistake explains it then
        if !reading.as_ref().is_err_and(RecordingFault::is_explained) {
            check_tracking(recording).map_err(at(&path))?;
        }
        reading.map_err(at(&path))?;
        write(&format!("{name}.csv"), &kinematics.to_csv())?;
    }
    write(MANIFEST_FILE, &manifest.to_toml())
}
