//! Is a vehicle of a size, a mass and a trim that vehicles have? Its wrong unit is a plausible number to everything else.

use std::f64::consts::PI;
use std::fmt;

use nalgebra::{Unit, UnitQuaternion};

use super::Vehicle;
use crate::condition::FRESH_WATER;
use crate::frame::{Vec3, WaterPlane};
use crate::geometry::hydrostatics::{float_depth, float_plane, hydrostatics};
use crate::geometry::mesh::Bounds;

/// Shortest longest edge of a vehicle [m]: a toy.
pub const LEAST_LENGTH: f64 = 0.02;

/// Longest edge of a vehicle [m]: a mining truck.
pub const MOST_LENGTH: f64 = 20.0;

/// Share by which a length may miss a bound: what f32 leaves of an edge of 2 cm that stands 10 m from the origin.
const LENGTH_ROUNDING: f64 = 1e-4;

/// Mass over displaced volume below which a body would rise in air [kg/m3]: air at 15 C.
pub const LEAST_DENSITY: f64 = 1.225;

/// Mass over displaced volume above which no solid is [kg/m3]: osmium.
pub const MOST_DENSITY: f64 = 22_590.0;

/// Mass over displaced volume of vehicles as they are built [kg/m3]: rigid foam to solid steel.
const USUAL_DENSITY: [f64; 2] = [20.0, 7_850.0];

/// Largest angle afloat up to which the righting moment is taken as linear [rad]: the error is of the order of its square.
const LINEAR_TRIM: f64 = 0.1;

/// Angle between the keel and the water afloat above which the center of mass is questioned [rad]: 10 degrees.
const MOST_TRIM: f64 = 0.175;

/// A size that no vehicle has, with a mass that rules it out.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the hull is {length:.4} x {width:.4} x {height:.4} m and displaces {displaced_kg:.4e} kg of water, but weighs {mass} kg{}",
    hint(*length)
)]
pub struct Implausible {
    /// Along x [m].
    pub length: f64,
    /// Along y [m].
    pub width: f64,
    /// Along z [m].
    pub height: f64,
    /// Mass of the water that it displaces as a whole [kg].
    pub displaced_kg: f64,
    /// Its mass [kg].
    pub mass: f64,
}

/// Refuses a size that no vehicle has where the mass does not fit it either.
pub fn check_size(mass: f64, bounds: &Bounds, volume: f64) -> Result<(), Implausible> {
    let extent = bounds.extent();
    let density = mass / volume;
    if !(LEAST_DENSITY..=MOST_DENSITY).contains(&density) && !is_usual_length(extent.max()) {
        let [length, width, height] = extent.into();
        return Err(Implausible { length, width, height, displaced_kg: volume * FRESH_WATER, mass });
    }
    Ok(())
}

/// True of the longest edge of a vehicle [m], both bounds included.
pub fn is_usual_length(length: f64) -> bool {
    (LEAST_LENGTH * (1.0 - LENGTH_ROUNDING)..=MOST_LENGTH * (1.0 + LENGTH_ROUNDING)).contains(&length)
}

/// The unit that would make a length usual.
fn hint(length: f64) -> &'static str {
    if length > MOST_LENGTH {
        "; is the file in millimeters? scale = 0.001"
    } else {
        "; is the file in meters? scale = 1.0"
    }
}

/// Size, displacement and floating position of a vehicle in fresh water.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floating {
    /// Volume that it displaces as a whole [m3].
    pub displaced_volume: f64,
    /// Depth at which it floats level [m]; `None` where it sinks.
    pub depth: Option<f64>,
    /// Angle by which the nose goes down afloat, in (-pi, pi] [rad]; `None` where it sinks or has no stable trim.
    pub pitch: Option<f64>,
    /// Angle by which the right side goes down afloat, in (-pi, pi] [rad]; `None` where it sinks or capsizes.
    pub roll: Option<f64>,
}

impl Floating {
    /// Computes the floating position.
    pub fn of(vehicle: &Vehicle) -> Self {
        let mesh = &vehicle.hull.mesh;
        let displaced_volume = mesh.volume();
        let sinks = displaced_volume * FRESH_WATER <= vehicle.mass;
        if sinks {
            return Self { displaced_volume, depth: None, pitch: None, roll: None };
        }
        let depth = float_depth(mesh, vehicle.z0, vehicle.mass);
        let angle = |direction: Vec3| trim(vehicle, depth, direction);
        Self { displaced_volume, depth: Some(depth), pitch: angle(Vec3::y()), roll: angle(Vec3::x()) }
    }
}

impl Floating {
    /// Trim and heel of the vehicle afloat.
    pub fn trim_in_words(&self) -> String {
        let pitch = lean(self.pitch, ["nose down", "nose up"]);
        format!("{pitch}, {}", lean(self.roll, ["to the right", "to the left"]))
    }
}

/// Angle of equilibrium about an axis of the body, from the righting moment about the center of mass level and a
/// thousandth of a radian over [rad]; `None` where it capsizes.
fn trim(vehicle: &Vehicle, depth: f64, axis: Vec3) -> Option<f64> {
    const STEP: f64 = 1e-3;
    let moment = |angle: f64| {
        // the body turned by an angle about its axis sees up turned by the opposite
        let up = Vec3::z() - axis.cross(&Vec3::z()) * angle;
        let about = &vehicle.center_of_mass;
        // turning about the center of mass, at the displacement of the level position to first order
        let plane = plane_through_float(vehicle, depth, up);
        hydrostatics(&vehicle.hull.mesh, &plane, FRESH_WATER, about).wrench.moment.dot(&axis)
    };
    let (level, over, under) = (moment(0.0), moment(STEP), moment(-STEP));
    let stiffness = (under - over) / (2.0 * STEP);
    (stiffness > 0.0).then(|| level / stiffness).map(|first_order| match first_order.abs() <= LINEAR_TRIM {
        true => first_order,
        false => large_trim(vehicle, axis, first_order.signum()),
    })
}

/// The first stable angle about an axis of the body beyond the level position, in (-pi, pi] [rad]: steps to where the
/// moment changes its sign, then bisection. The displaced volume is that of the mass at every angle.
fn large_trim(vehicle: &Vehicle, axis: Vec3, direction: f64) -> f64 {
    const STEP: f64 = PI / 36.0;
    const BISECTIONS: u32 = 16;
    let drives_on = |angle: f64| {
        let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), -angle * direction);
        let plane = float_plane(&vehicle.hull.mesh, turn * Vec3::z_axis(), vehicle.mass);
        let still = hydrostatics(&vehicle.hull.mesh, &plane, FRESH_WATER, &vehicle.center_of_mass);
        still.wrench.moment.dot(&axis) * direction > 0.0
    };
    let mut on = 0.0;
    while on < 2.0 * PI && drives_on(on + STEP) {
        on += STEP;
    }
    let mut back = on + STEP;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (on + back);
        if drives_on(middle) { on = middle } else { back = middle }
    }
    let angle = on * direction;
    if angle > PI {
        angle - 2.0 * PI
    } else if angle <= -PI {
        angle + 2.0 * PI
    } else {
        angle
    }
}

/// The water plane across `up` through the point of the level one above the center of flotation, which keeps the
/// displaced volume to first order.
fn plane_through_float(vehicle: &Vehicle, depth: f64, up: Vec3) -> WaterPlane {
    let level = WaterPlane::level(vehicle.z0, depth);
    let center = waterplane_center(vehicle, &level);
    let normal = nalgebra::Unit::new_normalize(up);
    WaterPlane { normal, offset: normal.dot(&center) }
}

/// Centroid of the area that the hull cuts out of level water [m].
fn waterplane_center(vehicle: &Vehicle, level: &WaterPlane) -> Vec3 {
    const STEP: f64 = 1e-4;
    let lower = WaterPlane { offset: level.offset - STEP, ..*level };
    let volume = |plane: &WaterPlane| {
        let still = hydrostatics(&vehicle.hull.mesh, plane, FRESH_WATER, &Vec3::zeros());
        (still.displaced_volume, still.center_of_buoyancy.unwrap_or_default())
    };
    let ((above, at), (below, from)) = (volume(level), volume(&lower));
    let mut center = (at * above - from * below) / (above - below);
    if !center.iter().all(|c| c.is_finite()) {
        center = Vec3::zeros();
    }
    Vec3::new(center.x, center.y, level.offset)
}

/// What looks wrong about a vehicle, each a sentence with a way to mend it; empty for one that looks right.
pub fn questions(vehicle: &Vehicle, floating: &Floating) -> Vec<String> {
    let mut found = Vec::new();
    let extent = vehicle.hull.mesh.bounds().map_or(Vec3::zeros(), |bounds| bounds.extent());
    if !is_usual_length(extent.max()) {
        found.push(format!(
            "the longest edge is {:.4} m, and vehicles have {LEAST_LENGTH} to {MOST_LENGTH} m{}",
            extent.max(),
            hint(extent.max())
        ));
    }
    let density = vehicle.mass / floating.displaced_volume;
    let [light, heavy] = USUAL_DENSITY;
    if density < light {
        found.push(format!(
            "the mass is {density:.2} kg a cubic meter of hull, lighter than foam: check mass and scale"
        ));
    }
    if density > heavy {
        found.push(format!(
            "the mass is {density:.0} kg a cubic meter of hull, heavier than steel: is the hull a thin shell that \
             floods, or the scale too small?"
        ));
    }
    if !vehicle.hull.mesh.bounds().is_some_and(|bounds| holds(&bounds, &vehicle.center_of_mass)) {
        let c = vehicle.center_of_mass;
        found.push(format!(
            "the center of mass ({}, {}, {}) m lies outside the hull's bounding box: check its frame and unit",
            Rounded(c.x),
            Rounded(c.y),
            Rounded(c.z)
        ));
    }
    if [floating.pitch, floating.roll].into_iter().flatten().any(|angle| angle.abs() > MOST_TRIM) {
        found.push(format!("afloat it would lie {}: check the center of mass", floating.trim_in_words()));
    }
    found
}

/// An angle with its direction.
fn lean(angle: Option<f64>, [positive, negative]: [&str; 2]) -> String {
    let Some(degrees) = angle.map(f64::to_degrees) else {
        return format!("without a stable angle {positive} or {negative}");
    };
    // what rounds to zero has the first direction
    let is_negative = degrees < -0.05;
    format!("{:.1} degrees {}", degrees.abs(), if is_negative { negative } else { positive })
}

fn holds(bounds: &Bounds, point: &Vec3) -> bool {
    (0..3).all(|i| (bounds.min[i]..=bounds.max[i]).contains(&point[i]))
}

/// A length with four decimals [m], without the sign of a rounded zero.
#[derive(Debug, Clone, Copy)]
pub struct Rounded(pub f64);

impl fmt::Display for Rounded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.4}", (self.0 * 1e4).round() / 1e4 + 0.0)
    }
}
