//! Mistakes in how a recording is read: axes, the order of the quaternion, the unit of length. The depth that was
//! measured at rest tells them.

use std::fmt;

use nalgebra::{Quaternion, UnitQuaternion};

use super::mocap::Rig;
use super::recording::{Recording, RecordingFault};
use wade_core::frame::{Vec3, up_from_quaternion};

/// The depth of the recording and the depth measured at rest may differ by this [m]: markers, tires and waves. Chosen.
const TOLERANCE: f64 = 0.05;
/// Cosine of the tilt up to which a vehicle stands on flat ground: 15 degrees, which is less than twice a ramp's slope.
const LEVEL: f64 = 0.966;
/// Share of the frames that a recording has on the flat ground at least; the others may be on ramps. Chosen.
const LEAST_SHARE: f64 = 0.1;
/// Share of the frames that must not lie deeper than the flat ground: a few may be damaged.
const SHALLOW_SHARE: f64 = 0.95;

/// A mistake that a recording may have been made with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misreading {
    /// Axes with y up.
    YUp,
    /// Axes north, east, down, and forward, right, down.
    Ned,
    /// The quaternion's scalar as the last of the four columns.
    ScalarLast,
    /// Positions in millimeters.
    Millimeters,
}

impl Misreading {
    const ALL: [Self; 4] = [Self::YUp, Self::Ned, Self::ScalarLast, Self::Millimeters];

    /// The pose without the mistake.
    fn corrected(self, position: Vec3, rotation: &UnitQuaternion<f64>) -> (Vec3, UnitQuaternion<f64>) {
        let (w, v) = (rotation.w, rotation.imag());
        let rotation = |w: f64, v: Vec3| UnitQuaternion::new_unchecked(Quaternion::from_parts(w, v));
        let y_up = |v: Vec3| Vec3::new(v.x, -v.z, v.y);
        let down = |v: Vec3| Vec3::new(v.x, -v.y, -v.z);
        match self {
            Self::YUp => (y_up(position), rotation(w, y_up(v))),
            Self::Ned => (down(position), rotation(w, down(v))),
            Self::ScalarLast => (position, rotation(v.z, Vec3::new(w, v.x, v.y))),
            Self::Millimeters => (position * 1e-3, rotation(w, v)),
        }
    }
}

impl fmt::Display for Misreading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::YUp => {
                "y up (the default of OptiTrack's export): export with z up, or write x, -z, y as x, y, z and qx, -qz, qy as qx, qy, qz"
            }
            Self::Ned => "axes with z down (NED): write -y, -z as y, z and -qy, -qz as qy, qz, so that z is up",
            Self::ScalarLast => "a quaternion in the order x y z w: name its columns qx, qy, qz, qw",
            Self::Millimeters => "positions in millimeters: divide x, y, z by 1000",
        })
    }
}

/// What a reading makes of the depth.
struct Depths {
    /// Deepest but for a twentieth of the frames [m].
    deepest: f64,
    /// Median tilt [rad].
    tilt: f64,
    /// Share of the frames at the measured depth on level wheels.
    share: f64,
}

impl Depths {
    fn new(recording: &Recording, rig: &Rig, measured: f64, mistakes: &[Misreading]) -> Self {
        let mut depths = Vec::with_capacity(recording.t.len());
        let mut ups = Vec::with_capacity(recording.t.len());
        for (position, rotation) in recording.position.iter().zip(&recording.rotation) {
            let pose = mistakes.iter().fold((*position, *rotation), |(p, r), m| m.corrected(p, &r));
            ups.push(up_from_quaternion(&pose.1).z);
            depths.push(rig.depth(pose.0.z, &pose.1));
        }
        let stands = |(depth, up): (&f64, &f64)| *up >= LEVEL && (depth - measured).abs() < TOLERANCE;
        let share = depths.iter().zip(&ups).filter(|pair| stands(*pair)).count() as f64 / depths.len() as f64;
        let quantile = |values: &mut [f64], share: f64| {
            values.sort_unstable_by(f64::total_cmp);
            values[(share * (values.len() - 1) as f64) as usize]
        };
        let up = quantile(&mut ups, 0.5);
        Self { deepest: quantile(&mut depths, SHALLOW_SHARE), tilt: up.clamp(-1.0, 1.0).acos(), share }
    }

    fn fits(&self, measured: f64) -> bool {
        self.share >= LEAST_SHARE && self.deepest <= measured + TOLERANCE
    }
}

/// Refuses a recording that does not give the depth that was measured at rest over the flat ground [m], and names the
/// mistake, or the two, without which it would.
pub(super) fn check_depth(recording: &Recording, rig: &Rig, measured: f64) -> Result<(), RecordingFault> {
    let as_it_is = Depths::new(recording, rig, measured, &[]);
    if as_it_is.fits(measured) {
        return Ok(());
    }
    let one = Misreading::ALL.map(|mistake| vec![mistake]);
    let pairs = Misreading::ALL.into_iter().flat_map(|first| {
        Misreading::ALL
            .into_iter()
            .filter(move |second| *second != first)
            .map(move |second| vec![first, second])
    });
    let explains =
        |mistakes: &Vec<Misreading>| Depths::new(recording, rig, measured, mistakes).fits(measured);
    let mistakes = one.into_iter().chain(pairs).find(explains).unwrap_or_default();
    Err(RecordingFault::Depth {
        measured,
        deepest: as_it_is.deepest,
        tilt: as_it_is.tilt.to_degrees(),
        mistakes,
    })
}

/// The mistakes in words, or what else may be wrong.
pub(super) fn explanation(mistakes: &[Misreading]) -> String {
    if mistakes.is_empty() {
        return "neither y up, NED, the order of the quaternion nor millimeters explain it: check water_level_m, center_of_mass_from_marker_m and depth_m, or leave depth_m out if the vehicle never stands on the flat ground".to_owned();
    }
    let words: Vec<String> = mistakes.iter().map(Misreading::to_string).collect();
    format!("it fits {}", words.join("; and "))
}
