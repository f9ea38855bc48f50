//! Drag and friction of the hull by elements, each with its own velocity through the water.
//!
//! An element of area `A`, outward normal `n` and wet share `w` that moves with `u = v + omega x r` through the water bears
//!
//! `f = -1/2 rho w s A [C |u| u_n (4 + pi) / (4 + pi |u_n| / |u|) n + C_f |u_t| u_t]`,
//!
//! with `u_n = u . n` and `u_t` the rest. The first term is Rayleigh's law of the inclined plate (Lamb, Hydrodynamics, section
//! 77), scaled to `C` head-on: the force of a blunt body grows with the sine of the angle of incidence, not with its square. `C` is
//! [`WINDWARD`] on a side that moves outward and [`LEEWARD`] on one that moves inward, together the drag of a square
//! cylinder in open-channel flow (Qi, Eames, Johnson, JFM 2014). `C_f` is the ITTC 1957 line (UFC 4-159-03). `s` is the
//! share that the shelter of the parts upstream leaves.
//!
//! Elements of a wheel whose speed `W` is stated have the velocity of its rim too. Along the rim it drags water with it and presses
//! on none: in the first term `u_t` is that of the hull. Beside `C_f` stands the coefficient
//! [`TREAD`] `(W r)^2 / ((W r)^2 + |u|^2) min(1, |W r - u_x| / |W r|)` of its lugs on the share `1 - n_y^2` that is tread: a wheel
//! that stands still has the drag of one of which nothing is stated, and lugs push by their slip.
//!
//! Elements of a track whose speed `W` is stated, that of its drive sprocket of the radius `r`, have besides the velocity of the
//! belt `W r (n_z, 0, -n_x)`, which runs round about the body's y, and such lugs: the sides of a track stand still.
//!
//! Every term opposes the velocity of its own element and every factor is positive, so the sum over the elements takes
//! power from the motion through the water in every state; wheels and tracks that turn put in their shaft power at most.

use super::elements::{Element, LANES};
use crate::condition::Condition;
use crate::frame::{VISCOSITY, Vec3, WaterPlane};
use crate::lanes::{Instructions, run_for};
use crate::vehicle::{SurfaceKind, Vehicle};
use crate::wrench::Wrench;

/// Pressure coefficient of a side that moves outward, head-on [-]: with [`LEEWARD`] the 1.9 of Qi, Eames, Johnson (JFM 2014).
pub const WINDWARD: f64 = 1.2;
/// Coefficient of the suction on a side that moves inward [-].
pub const LEEWARD: f64 = 0.7;
/// Share of the drag that the rearmost parts lose to the wake of those upstream [-]: of two cylinders in tandem at two to
/// four diameters the downstream one keeps 0.2 to 0.6 of its drag (Zdravkovich, Flow Around Circular Cylinders, 1997).
pub const SHELTERING: f64 = 0.5;
/// Rise of the water over the lowest point of a vertical element by which it is as wet as it gets, over the height of the hull [-].
const SIDE_FILM: f64 = 0.01;
/// The same of a horizontal element, which the water reaches at once: the time that a real bottom, with frame and tilt, takes.
const BOTTOM_FILM: f64 = 0.5;
/// Tangential coefficient of a tread that spins in still water [-]: lugs that close a tenth of the annulus they sweep, as
/// plates of a coefficient of 1.2.
/// Uncertain by a factor of two.
pub const TREAD: f64 = 0.12;
/// Reynolds number below which the friction line is held.
const LEAST_REYNOLDS: f64 = 1e4;

/// The elements of a hull prepared for [`Drag::evaluate`], padded with elements without area.
#[derive(Debug, Clone)]
pub struct Drag {
    blocks: Vec<Block>,
    /// Blocks of each surface: from, to.
    ranges: Vec<[usize; 2]>,
    /// How each surface that turns does so.
    turning: Vec<Option<Turning>>,
    half_length: f64,
    half_width: f64,
    length: f64,
    instructions: Instructions,
}

type Lane = [f64; LANES];

/// A wheel or a track.
#[derive(Debug, Clone, Copy)]
struct Turning {
    center: Vec3,
    /// Of the rim of a wheel, or of the sprocket of a track [m].
    radius: f64,
    is_track: bool,
}

/// A turning surface in a state: what its elements need of it.
#[derive(Debug, Clone, Copy, Default)]
struct Skin {
    /// Speed of a wheel [rad/s], or of the belt of a track [m/s].
    speed: f64,
    axle_x: f64,
    axle_z: f64,
    /// Tangential coefficient of the lugs.
    lugs: f64,
}

/// [`LANES`] elements, in lock step.
#[derive(Debug, Clone, Copy)]
struct Block {
    center: [Lane; 3],
    normal: [Lane; 3],
    area: Lane,
    /// Three times the spread: xx, yy, zz, and twice xy, xz, yz [m2].
    spread: [Lane; 6],
    /// Films of vertical and of horizontal elements [m]; between them by the sixth power of the normal along up.
    film: [f64; 2],
}

/// What the motion does on one surface, about the body origin.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfaceDrag {
    /// Force and moment about the body origin [N, N m].
    pub load: Wrench,
    /// Power that a turning wheel must be given at its shaft [W]: what the rim's own velocity takes.
    pub shaft_power: f64,
}

/// The state in the form that every block uses.
struct Flow {
    up: [f64; 3],
    offset: f64,
    velocity: [f64; 3],
    rate: [f64; 3],
    /// Horizontal direction of motion over half the length of the hull along it, times how much of the motion it is [1/m].
    ahead: [f64; 3],
    /// Mean sheltering: half of [`SHELTERING`] times how much of the motion is along the hull.
    sheltering: f64,
    friction: f64,
    half_density: f64,
}

impl Drag {
    /// Prepares the elements of a vehicle; those of a surface stand side by side.
    pub fn new(vehicle: &Vehicle, elements: &[Element]) -> Self {
        let film = [SIDE_FILM, BOTTOM_FILM].map(|share| share * vehicle.dimensions.height);
        let (mut blocks, mut ranges) = (Vec::new(), Vec::new());
        for surface in 0..vehicle.surfaces.len() {
            let own: Vec<&Element> = elements.iter().filter(|e| e.surface == surface).collect();
            let from = blocks.len();
            blocks.extend(own.chunks(LANES).map(|chunk| Block::new(chunk, film)));
            ranges.push([from, blocks.len()]);
        }
        let turning = |(index, surface): (usize, &crate::vehicle::Surface)| {
            let from_axle = |e: &Element| {
                let arm = e.center - surface.centroid;
                arm.x.hypot(arm.z)
            };
            let own = elements.iter().filter(|e| e.surface == index);
            let radius = || own.map(from_axle).fold(0.0, f64::max);
            let turning =
                |radius: f64, is_track: bool| Turning { center: surface.centroid, radius, is_track };
            match surface.kind {
                SurfaceKind::Wheel => Some(turning(radius(), false)),
                // a vehicle that was checked has the radius
                SurfaceKind::Track => Some(turning(surface.sprocket_radius.unwrap_or(0.0), true)),
                SurfaceKind::Bottom | SurfaceKind::Front | SurfaceKind::Rear | SurfaceKind::Side => None,
            }
        };
        Self {
            blocks,
            ranges,
            turning: vehicle.surfaces.iter().enumerate().map(turning).collect(),
            half_length: 0.5 * vehicle.dimensions.length,
            half_width: 0.5 * vehicle.dimensions.width,
            length: vehicle.dimensions.length,
            instructions: Instructions::fastest(),
        }
    }

    /// Number of elements, padding included.
    pub fn len(&self) -> usize {
        self.blocks.len() * LANES
    }

    /// True of a hull without a face.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// Loads of the motion through the water on each surface; `wheel_speeds` has one entry a surface, the speed of a wheel
    /// or of the sprocket of a track about the body's y [rad/s], NaN where none is stated. `out` has one entry a surface. No allocation.
    pub fn evaluate(
        &self,
        plane: &WaterPlane,
        condition: &Condition,
        wheel_speeds: &[f64],
        out: &mut [SurfaceDrag],
    ) {
        let flow = self.flow(plane, condition);
        let flow = &flow;
        run_for!(
            self.instructions,
            Drag::sum(self, flow: &Flow, condition: &Condition, wheel_speeds: &[f64], out: &mut [SurfaceDrag])
        );
    }

    #[inline(always)]
    fn sum(&self, flow: &Flow, condition: &Condition, wheel_speeds: &[f64], out: &mut [SurfaceDrag]) {
        for (surface, out) in out.iter_mut().enumerate() {
            let [from, to] = self.ranges[surface];
            let speed = wheel_speeds[surface];
            let turning = self.turning[surface].filter(|_| !speed.is_nan());
            let mut sums = Sums::default();
            let skin = turning.map(|Turning { center, radius, is_track }| {
                let axle = condition.velocity + condition.angular_velocity.cross(&center);
                let rim = speed * radius;
                let (spin, past) = (rim.powi(2), axle.norm_squared());
                let slip = ((rim - axle.x) / rim).abs().min(1.0);
                let lugs = if spin > 0.0 { TREAD * slip * spin / (spin + past) } else { 0.0 };
                let speed = if is_track { speed * radius } else { speed };
                Skin { speed, axle_x: center.x, axle_z: center.z, lugs }
            });
            let skin = skin.unwrap_or_default();
            let is_track = turning.is_some_and(|turning| turning.is_track);
            for block in &self.blocks[from..to] {
                match is_track {
                    true => block.add::<true>(flow, skin, &mut sums),
                    false => block.add::<false>(flow, skin, &mut sums),
                }
            }
            *out = sums.finish();
        }
    }

    fn flow(&self, plane: &WaterPlane, condition: &Condition) -> Flow {
        let up = plane.normal.into_inner();
        let v = condition.velocity;
        let level = v - up * up.dot(&v);
        let turning = condition.angular_velocity.norm() * self.half_length;
        let along = level.norm_squared();
        let all = v.norm_squared() + turning * turning;
        let share = if all > 0.0 { along / all } else { 0.0 };
        let direction = level.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        let half = self.half_length * direction.x.abs() + self.half_width * direction.y.abs();
        let ahead = direction / half.max(0.1 * self.half_width);
        let speed = all.sqrt();
        let reynolds = (condition.density * speed * self.length / VISCOSITY).max(LEAST_REYNOLDS);
        let line = reynolds.log10() - 2.0;
        Flow {
            up: up.into(),
            offset: plane.offset,
            velocity: v.into(),
            rate: condition.angular_velocity.into(),
            ahead: ahead.into(),
            sheltering: 0.5 * SHELTERING * share,
            friction: 0.075 / (line * line),
            half_density: 0.5 * condition.density,
        }
    }
}

#[derive(Default)]
struct Sums {
    force: [Lane; 3],
    moment: [Lane; 3],
    power: Lane,
}

impl Sums {
    fn finish(&self) -> SurfaceDrag {
        // in one order whatever the instruction set
        let sum = |lane: &Lane| lane.iter().sum::<f64>();
        let vector = |lanes: &[Lane; 3]| Vec3::from(lanes.each_ref().map(sum));
        SurfaceDrag {
            load: Wrench { force: vector(&self.force), moment: vector(&self.moment) },
            shaft_power: sum(&self.power),
        }
    }
}

impl Block {
    fn new(elements: &[&Element], film: [f64; 2]) -> Self {
        let mut block = Self {
            center: [[0.0; LANES]; 3],
            normal: [[0.0; LANES]; 3],
            area: [0.0; LANES],
            spread: [[0.0; LANES]; 6],
            film,
        };
        for (lane, element) in elements.iter().enumerate() {
            for axis in 0..3 {
                block.center[axis][lane] = element.center[axis];
                block.normal[axis][lane] = element.normal[axis];
            }
            block.area[lane] = element.area;
            let c = element.spread * 3.0;
            let terms = [c.m11, c.m22, c.m33, 2.0 * c.m12, 2.0 * c.m13, 2.0 * c.m23];
            terms.iter().enumerate().for_each(|(term, x)| block.spread[term][lane] = *x);
        }
        block
    }

    #[inline(always)]
    fn add<const IS_TRACK: bool>(&self, flow: &Flow, skin: Skin, sums: &mut Sums) {
        let [ux, uy, uz] = flow.up;
        let Skin { speed, axle_x, axle_z, lugs } = skin;
        let pi = std::f64::consts::PI;
        for i in 0..LANES {
            let [x, y, z] = [self.center[0][i], self.center[1][i], self.center[2][i]];
            let [nx, ny, nz] = [self.normal[0][i], self.normal[1][i], self.normal[2][i]];
            let s = |term: usize| self.spread[term][i];
            let variance = s(0) * ux * ux
                + s(1) * uy * uy
                + s(2) * uz * uz
                + s(3) * ux * uy
                + s(4) * ux * uz
                + s(5) * uy * uz;
            let reach = variance.max(0.0).sqrt();
            let facing = nx * ux + ny * uy + nz * uz;
            let square = facing * facing;
            // of what is nearly horizontal alone
            let sixth = square * square * square;
            let film = self.film[0] + (self.film[1] - self.film[0]) * sixth;
            let depth = flow.offset - (x * ux + y * uy + z * uz);
            let range = 2.0 * reach + film;
            let share = ((depth + reach) / range).clamp(0.0, 1.0);
            let wet = share * self.area[i];
            let [wx, wy, wz] = flow.rate;
            let hull = [
                flow.velocity[0] + (wy * z - wz * y),
                flow.velocity[1] + (wz * x - wx * z),
                flow.velocity[2] + (wx * y - wy * x),
            ];
            let skin = if IS_TRACK {
                [speed * nz, -speed * nx]
            } else {
                [speed * (z - axle_z), -speed * (x - axle_x)]
            };
            // on the tread, not on the sides
            let tangential = flow.friction + lugs * (1.0 - ny * ny);
            let (vx, vy, vz) = (hull[0] + skin[0], hull[1], hull[2] + skin[1]);
            let across = vx * nx + vy * ny + vz * nz;
            // of the hull along the element and of both across it
            let [hx, hy, hz] = hull;
            let of_hull = hx * nx + hy * ny + hz * nz;
            let squared = hx * hx + hy * hy + hz * hz + (across * across - of_hull * of_hull);
            let total = squared.max(0.0).sqrt();
            let along = [vx - across * nx, vy - across * ny, vz - across * nz];
            let slip = (along[0] * along[0] + along[1] * along[1] + along[2] * along[2]).sqrt();
            let coefficient = if across > 0.0 { WINDWARD } else { LEEWARD };
            let place = (x * flow.ahead[0] + y * flow.ahead[1] + z * flow.ahead[2]).clamp(-1.0, 1.0);
            let exposed = 1.0 - flow.sheltering * (1.0 - place);
            let scale = -flow.half_density * exposed * wet;
            // at rest both are zero
            let rayleigh =
                squared * across * (4.0 + pi) / (4.0 * total + pi * across.abs() + f64::MIN_POSITIVE);
            let normal = scale * coefficient * rayleigh;
            let tangent = scale * tangential * slip;
            let fx = normal * nx + tangent * along[0];
            let fy = normal * ny + tangent * along[1];
            let fz = normal * nz + tangent * along[2];
            sums.force[0][i] += fx;
            sums.force[1][i] += fy;
            sums.force[2][i] += fz;
            sums.moment[0][i] += y * fz - z * fy;
            sums.moment[1][i] += z * fx - x * fz;
            sums.moment[2][i] += x * fy - y * fx;
            sums.power[i] -= fx * skin[0] + fz * skin[1];
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitVector3;

    use super::super::elements::{COUNT, elements};
    use super::*;
    use crate::vehicle::shipped;

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let vehicle = shipped::husky().expect("sound").vehicle().expect("sound");
        let fast = Drag::new(&vehicle, &elements(&vehicle, COUNT));
        let plain = Drag { instructions: Instructions::Portable, ..fast.clone() };
        let mut loads = [0, 1].map(|_| vec![SurfaceDrag::default(); vehicle.surfaces.len()]);
        let mut speeds = vec![f64::NAN; vehicle.surfaces.len()];
        if let Some(wheel) = vehicle.surfaces.iter().position(|s| s.kind == SurfaceKind::Wheel) {
            speeds[wheel] = 7.0;
        }
        for i in 0..200 {
            let turn = f64::from(i);
            let state = Condition {
                angular_velocity: Vec3::new(turn.sin(), (2.0 * turn).cos(), (3.0 * turn).sin()),
                up: UnitVector3::new_normalize(Vec3::new((0.7 * turn).sin(), (0.3 * turn).cos(), 0.4)),
                water_level: Some(0.2 * (0.9 * turn).sin()),
                ..Condition::level(Vec3::new(turn.cos(), (5.0 * turn).sin(), (4.0 * turn).cos()), 0.0)
            };
            let plane = state.water_plane(vehicle.z0);
            fast.evaluate(&plane, &state, &speeds, &mut loads[0]);
            plain.evaluate(&plane, &state, &speeds, &mut loads[1]);
            assert_eq!(loads[0], loads[1]);
        }
    }
}
