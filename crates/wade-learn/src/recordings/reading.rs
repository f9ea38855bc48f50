//! Mistakes in how a recording is read: axes, the order and the direction of the quaternion, the unit of length. The depth
//! that was measured at rest tells them, and that wheels roll along body x.

use std::fmt;

use nalgebra::{Quaternion, UnitQuaternion};

use super::mocap::Rig;
use super::recording::{Recording, RecordingFault};
use crate::signal::median_step;
use wade_core::frame::{Vec3, up_from_quaternion};

/// The depth of the recording and the depth measured at rest may differ by this [m]: markers, tires and waves. Chosen.
const TOLERANCE: f64 = 0.05;
/// Cosine of the tilt up to which a vehicle stands on flat ground: 15 degrees, which is less than twice a ramp's slope.
const LEVEL: f64 = 0.966;
/// Share of the frames that a recording has on the flat ground at least; the others may be on ramps. Chosen.
const LEAST_SHARE: f64 = 0.1;
/// Share of the frames that must not lie deeper than the flat ground: a few may be damaged.
const SHALLOW_SHARE: f64 = 0.95;
/// Time between the two frames of a velocity [s]: a millimeter of noise makes 0.01 m/s.
const DIFFERENCE: f64 = 0.1;
/// Speed from which a vehicle moves [m/s].
const MOVING: f64 = 0.3;
/// Fewest velocities that tell a direction.
const ENOUGH: usize = 10;
/// Sine of the angle to body x, rms over a recording, above which another reading that halves it is the right one: 6 degrees,
/// more than a slope's change under the wheels makes.
const ASTRAY: f64 = 0.1;
/// The same above which no wheels roll that way: half of the velocity is sideways.
const SIDEWAYS: f64 = 0.5;

/// A mistake that a recording may have been made with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misreading {
    /// Axes with y up.
    YUp,
    /// Axes north, east, down, and forward, right, down.
    Ned,
    /// The quaternion's scalar as the last of the four columns.
    ScalarLast,
    /// Rotations from the frame of the cameras to the vehicle.
    Conjugate,
    /// Positions in millimeters.
    Millimeters,
}

impl Misreading {
    const ALL: [Self; 5] = [Self::YUp, Self::Ned, Self::ScalarLast, Self::Conjugate, Self::Millimeters];

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
            Self::Conjugate => (position, rotation(w, -v)),
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
            Self::Conjugate => {
                "rotations from the frame of the cameras to the vehicle: write -qx, -qy, -qz as qx, qy, qz"
            }
            Self::Millimeters => "positions in millimeters: divide x, y, z by 1000",
        })
    }
}

/// What a reading makes of a recording.
struct Looks {
    /// Deepest but for a twentieth of the frames [m].
    deepest: f64,
    /// Median tilt [rad].
    tilt: f64,
    /// Share of the frames at the measured depth on level wheels.
    share: f64,
    /// Sine of the angle between velocity and body x, rms; `None` where the vehicle hardly moves.
    astray: Option<f64>,
}

impl Looks {
    fn new(recording: &Recording, rig: &Rig, measured: Option<f64>, mistakes: &[Misreading]) -> Self {
        let poses = recording.position.iter().zip(&recording.rotation);
        let poses: Vec<_> = poses
            .map(|(position, rotation)| {
                mistakes.iter().fold((*position, *rotation), |(p, r), m| m.corrected(p, &r))
            })
            .collect();
        let mut ups: Vec<f64> = poses.iter().map(|pose| up_from_quaternion(&pose.1).z).collect();
        let mut depths: Vec<f64> = poses.iter().map(|pose| rig.depth(pose.0.z, &pose.1)).collect();
        let stands = |(depth, up): (&f64, &f64)| {
            *up >= LEVEL && measured.is_some_and(|measured| (depth - measured).abs() < TOLERANCE)
        };
        let share = depths.iter().zip(&ups).filter(|pair| stands(*pair)).count() as f64 / depths.len() as f64;
        let quantile = |values: &mut [f64], share: f64| {
            values.sort_unstable_by(f64::total_cmp);
            values[(share * (values.len() - 1) as f64) as usize]
        };
        let up = quantile(&mut ups, 0.5);
        Self {
            deepest: quantile(&mut depths, SHALLOW_SHARE),
            tilt: up.clamp(-1.0, 1.0).acos(),
            share,
            astray: astray(&recording.t, &poses, rig),
        }
    }

    fn fits(&self, measured: Option<f64>) -> bool {
        measured.is_none_or(|measured| self.share >= LEAST_SHARE && self.deepest <= measured + TOLERANCE)
    }
}

/// Sine of the angle between the velocity of the body origin and body x, rms over the frames in which it moves.
fn astray(t: &[f64], poses: &[(Vec3, UnitQuaternion<f64>)], rig: &Rig) -> Option<f64> {
    let step = median_step(t)?;
    let span = (DIFFERENCE / step).round().max(2.0) as usize;
    let across = |at: usize| {
        let [(before, turned), (_, middle), (after, turned_after)] =
            [0, span / 2, span].map(|by| poses[at + by]);
        let seconds = t[at + span] - t[at];
        let way = after - before + turned_after * rig.origin_from_marker - turned * rig.origin_from_marker;
        let velocity = middle.inverse_transform_vector(&way) / seconds;
        let is_whole = seconds < 2.0 * DIFFERENCE.max(2.0 * step);
        (is_whole && velocity.norm() > MOVING).then(|| 1.0 - (velocity.x / velocity.norm()).powi(2))
    };
    let squares: Vec<f64> = (0..t.len().saturating_sub(span)).filter_map(across).collect();
    (squares.len() >= ENOUGH).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).max(0.0).sqrt())
}

/// Refuses a recording that does not give the depth that was measured at rest over the flat ground [m], or that goes sideways,
/// and names the mistake, or the two, without which it would not.
pub(super) fn check_reading(
    recording: &Recording,
    rig: &Rig,
    measured: Option<f64>,
) -> Result<(), RecordingFault> {
    let looks = |mistakes: &[Misreading]| Looks::new(recording, rig, measured, mistakes);
    let as_it_is = looks(&[]);
    let astray = as_it_is.astray.unwrap_or_default();
    let fits = as_it_is.fits(measured);
    if fits && astray <= ASTRAY {
        return Ok(());
    }
    let pairs = Misreading::ALL.into_iter().flat_map(|first| {
        let others = Misreading::ALL.into_iter().filter(move |second| *second != first);
        others.map(move |second| vec![first, second])
    });
    let explains = |mistakes: &Vec<Misreading>| {
        let other = looks(mistakes);
        let goes_straight = other.astray.is_none_or(|other| other <= ASTRAY.max(0.5 * astray));
        other.fits(measured) && goes_straight && other.tilt.cos() >= LEVEL
    };
    let singles = Misreading::ALL.map(|mistake| vec![mistake]).into_iter();
    let mistakes = singles.chain(pairs).find(explains).unwrap_or_default();
    if let Some(measured) = measured.filter(|_| !fits) {
        let tilt = as_it_is.tilt.to_degrees();
        return Err(RecordingFault::Depth { measured, deepest: as_it_is.deepest, tilt, mistakes });
    }
    match mistakes.is_empty() && astray <= SIDEWAYS {
        true => Ok(()),
        false => Err(RecordingFault::Direction { astray: astray.asin().to_degrees(), mistakes }),
    }
}

/// The mistakes behind a wrong depth in words, or what else may be wrong.
pub(super) fn explanation(mistakes: &[Misreading]) -> String {
    if mistakes.is_empty() {
        return "neither y up, NED, the order or the direction of the quaternion nor millimeters explain it: check water_level_m, center_of_mass_from_marker_m and depth_m, or leave depth_m out if the vehicle never stands on the flat ground".to_owned();
    }
    fitting(mistakes)
}

/// The same behind a wrong direction of motion.
pub(super) fn direction(mistakes: &[Misreading]) -> String {
    if mistakes.is_empty() {
        return "the axes of the markers' frame must be the vehicle's, x ahead: were they made while it faced elsewhere?".to_owned();
    }
    fitting(mistakes)
}

fn fitting(mistakes: &[Misreading]) -> String {
    let words: Vec<String> = mistakes.iter().map(Misreading::to_string).collect();
    format!("it fits {}", words.join("; and "))
}
