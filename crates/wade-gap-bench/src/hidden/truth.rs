//! The planted parameters, as a tool may state them.

use super::{Effect, Hidden, Setting};
use crate::simulator::DRAG;
use crate::track::DENSITY;
use crate::{Prediction, State, Track};
use wade_core::frame::GRAVITY;

/// A planted parameter with the names that a report may give it. A tool that states it in another way adds its name here:
/// the numbers stay as they are.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Parameter {
    /// Names of it in reports.
    pub names: &'static [&'static str],
    /// Unit; `1` where it has none.
    pub unit: &'static str,
    /// Value.
    pub value: f64,
}

/// Parameters of a hidden effect over the tracks it acts in.
pub fn parameters(hidden: &Hidden, setting: &Setting, tracks: &[Track]) -> Vec<Parameter> {
    let size = hidden.size;
    let one = |names, unit, value| vec![Parameter { names, unit, value }];
    match hidden.effect {
        Effect::AddedMass => added_mass(size, setting, tracks),
        Effect::LinearDamping => linear_damping(size, setting, mean_depth(tracks)),
        Effect::DragCoefficientError => {
            let of = |names, value| Parameter { names, unit: "1", value };
            let [surge, sway] = match setting.simulator.prediction {
                Prediction::Analytic => [of(&["surge"], size * DRAG[0]), of(&["sway"], size * DRAG[1])],
                // a model has no coefficients of its own
                Prediction::Model(_) => [of(&["surge_share"], size), of(&["sway_share"], size)],
            };
            vec![of(&["relative_error", "share", "factor", "error"], size), surge, sway]
        }
        Effect::Rotation => {
            let factor = Parameter { names: &["coefficient", "factor", "scale"], unit: "1", value: size };
            // of strips as high as the mean of the body over its width, on the sides that look along y
            let (hull, depth) = (setting.simulator.hull, mean_depth(tracks));
            let of_sides = 2.0 * hull.volume(depth) / hull.width / hull.facing(depth, 1);
            let drag = size * DRAG[1] * of_sides;
            vec![factor, Parameter { names: &["drag_coefficient"], unit: "1", value: drag }]
        }
        Effect::Current => {
            let along = |names, value| Parameter { names, unit: "m/s", value };
            let [direction, ..] = hidden.shape;
            vec![
                along(&["x", "u_x", "current_x", "cx", "u", "east"], size * direction.cos()),
                along(&["y", "u_y", "current_y", "cy", "v", "north"], size * direction.sin()),
            ]
        }
        Effect::WaterLevelOffset => one(&["offset", "level", "water_level"], "m", size),
        Effect::DensityError => {
            let relative =
                Parameter { names: &["relative_error", "share", "factor", "error"], unit: "1", value: size };
            let difference =
                Parameter { names: &["density", "difference"], unit: "kg/m3", value: size * DENSITY };
            vec![relative, difference]
        }
        Effect::HullFlooding => one(&["share", "permeability", "fraction", "flooded_share"], "1", size),
        Effect::WaterEntrySlamming => one(&["coefficient", "c_s", "factor"], "1", size),
        Effect::WaveMemory => wave_memory(size, setting),
        Effect::ChannelBlockage => one(&["coefficient", "factor", "scale", "strength"], "1", size),
        Effect::Squat => one(&["coefficient", "factor", "scale"], "1", size),
        Effect::WheelPaddleThrust => one(&["lug_coefficient"], "1", size),
        Effect::BedMotion => {
            // it pushes forward: a drag that is taken away
            let push = Parameter { names: &["coefficient", "c_x"], unit: "1", value: size };
            vec![push, Parameter { names: &["drag"], unit: "1", value: -size }]
        }
        Effect::SensorDelay => one(&["delay", "tau", "time"], "s", size),
        Effect::SensorBias | Effect::SensorBiasStep => {
            one([&["fx", "bias_fx"], &["fy", "bias_fy"], &["fz", "bias_fz"]][component(hidden)], "N", size)
        }
        Effect::SensorDrift => one(
            [&["fx", "drift_fx"], &["fy", "drift_fy"], &["fz", "drift_fz"]][component(hidden)],
            "N/s",
            size,
        ),
        Effect::SensorGain => {
            let error = Parameter { names: &["error", "relative_error", "share"], unit: "1", value: size };
            let gain = Parameter { names: &["gain"], unit: "1", value: 1.0 + size };
            let names: &[&str] =
                if hidden.shape[0] < 0.0 { &["all"] } else { [&["fx"], &["fy"], &["fz"]][component(hidden)] };
            vec![error, gain, Parameter { names, unit: "1", value: size }]
        }
        Effect::AxisMisalignment => one(&["pitch", "angle_y", "y", "about_y"], "rad", size),
        Effect::RollingResistance => one(&["coefficient", "c_rr"], "1", size),
        Effect::DriveGain => {
            let error = Parameter { names: &["error", "relative_error", "share"], unit: "1", value: size };
            let gain = Parameter { names: &["gain"], unit: "1", value: 1.0 + size };
            vec![error, gain]
        }
        Effect::MassError => {
            let stated = Parameter { names: &["mass", "error", "difference"], unit: "kg", value: size };
            // what is stated is too much, so that the truth is less
            let relative = -size / setting.simulator.hull.mass;
            vec![stated, Parameter { names: &["relative_error"], unit: "1", value: relative }]
        }
        Effect::VortexShedding
        | Effect::Tether
        | Effect::ThermalGain
        | Effect::MudSuction
        | Effect::Seiche => Vec::new(),
    }
}

/// Of the whole body along x, and over the density and the speed of waves as long as the body.
fn linear_damping(size: f64, setting: &Setting, depth: f64) -> Vec<Parameter> {
    let hull = setting.simulator.hull;
    let per_area = Parameter { names: &["b", "coefficient"], unit: "N s/m3", value: size };
    let whole = size * 0.5 * hull.facing(depth, 0);
    let along = Parameter { names: &["b_x", "surge", "coefficient_x"], unit: "N s/m", value: whole };
    let waves = (GRAVITY * hull.length).sqrt();
    let number = 0.5 * size / (DENSITY * waves);
    let of = |names| Parameter { names, unit: "1", value: number };
    vec![per_area, along, of(&["surge"]), of(&["sway"])]
}

/// The kernel at the draft for which it is stated, and over the weight of the water displaced there and the length.
fn wave_memory(size: f64, setting: &Setting) -> Vec<Parameter> {
    let hull = setting.simulator.hull;
    let number = size * hull.length / (DENSITY * GRAVITY * hull.volume(super::memory::DRAFT));
    let [surge, sway, _] = super::memory::RATIO.map(|ratio| ratio * number);
    vec![
        Parameter { names: &["k0", "kernel", "stiffness"], unit: "N/m", value: size },
        Parameter { names: &["surge"], unit: "1", value: surge },
        Parameter { names: &["sway"], unit: "1", value: sway },
    ]
}

fn component(hidden: &Hidden) -> usize {
    (hidden.shape[0] as usize).min(2)
}

fn wet(tracks: &[Track]) -> impl Iterator<Item = &State> {
    tracks.iter().flat_map(|track| &track.states).filter(|state| state.depth > 0.02)
}

fn mean_depth(tracks: &[Track]) -> f64 {
    let (sum, count) = wet(tracks).fold((0.0, 0.0), |(sum, count), state| (sum + state.depth, count + 1.0));
    sum / f64::max(count, 1.0)
}

/// Masses at the mean depth under water, and over the displaced mass there.
fn added_mass(size: f64, setting: &Setting, tracks: &[Track]) -> Vec<Parameter> {
    let hull = setting.simulator.hull;
    let depth = mean_depth(tracks);
    let strips = hull.strips(&State { depth, ..State::default() }, 0.0);
    let side: f64 = strips.iter().map(|strip| super::strips::section_mass(strip)[0] * strip.dx).sum();
    let displaced = DENSITY * hull.volume(depth);
    let along = super::strips::SURGE_SHARE * displaced;
    vec![
        Parameter {
            names: &["mass_x", "m_x", "surge", "added_mass_x", "x"],
            unit: "kg",
            value: size * along,
        },
        Parameter { names: &["mass_y", "m_y", "sway", "added_mass_y", "y"], unit: "kg", value: size * side },
        Parameter {
            names: &["c_a_x", "coefficient_x", "surge", "x"],
            unit: "1",
            value: size * along / displaced,
        },
        Parameter {
            names: &["c_a_y", "coefficient_y", "sway", "y"],
            unit: "1",
            value: size * side / displaced,
        },
    ]
}
