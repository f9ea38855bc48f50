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

use nalgebra::Vector3;

use super::elements::{Element, LANES};
use crate::condition::Condition;
use crate::frame::{GRAVITY, VISCOSITY, Vec3, WaterPlane};
use crate::lanes::{self, Instructions, run_for};
use crate::real::{Dual, Real, norm};
use crate::sea::{Water, Waters};
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
/// Half the height of an element below which it is level [m]: rounding.
const FLAT: f64 = 1e-7;
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
struct Skin<T = f64> {
    /// Speed of a wheel [rad/s], or of the belt of a track [m/s].
    speed: f64,
    axle_x: f64,
    axle_z: f64,
    /// Tangential coefficient of the lugs.
    lugs: T,
}

impl<const N: usize> Skin<Dual<N>> {
    fn value(self) -> Skin {
        Skin { speed: self.speed, axle_x: self.axle_x, axle_z: self.axle_z, lugs: self.lugs.value }
    }
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceDrag<T = f64> {
    /// Force and moment about the body origin [N, N m].
    pub load: Wrench<T>,
    /// Power that a turning wheel must be given at its shaft [W]: what the rim's own velocity takes.
    pub shaft_power: T,
}

impl<T: Real> Default for SurfaceDrag<T> {
    fn default() -> Self {
        Self { load: Wrench::default(), shaft_power: T::zero() }
    }
}

/// The state in the form that every block uses.
struct Flow<T = f64> {
    up: [T; 3],
    offset: T,
    velocity: [T; 3],
    rate: [T; 3],
    /// Horizontal direction of motion over half the length of the hull along it, times how much of the motion it is [1/m].
    ahead: [T; 3],
    /// Mean sheltering: half of [`SHELTERING`] times how much of the motion is along the hull.
    sheltering: T,
    friction: T,
    half_density: T,
}

impl<const N: usize> Flow<Dual<N>> {
    fn value(&self) -> Flow {
        let values = |vector: [Dual<N>; 3]| vector.map(Real::value);
        Flow {
            up: values(self.up),
            offset: self.offset.value,
            velocity: values(self.velocity),
            rate: values(self.rate),
            ahead: values(self.ahead),
            sheltering: self.sheltering.value,
            friction: self.friction.value,
            half_density: self.half_density.value,
        }
    }

    /// What the loads of the elements depend on, in the order of [`Columns`].
    fn inputs(&self, lugs: Dual<N>) -> [Dual<N>; INPUTS] {
        let Self { velocity: v, rate: w, up: u, ahead: a, .. } = *self;
        [
            v[0],
            v[1],
            v[2],
            w[0],
            w[1],
            w[2],
            self.offset,
            u[0],
            u[1],
            u[2],
            a[0],
            a[1],
            a[2],
            self.sheltering,
            self.friction,
            lugs,
        ]
    }
}

/// Numbers that the loads of a surface's elements depend on, besides the density.
const INPUTS: usize = 16;
/// Components of a load: force, moment, and power at the shaft.
const COMPONENTS: usize = 7;
/// Derivatives of a load with respect to each input: velocity and rate of the hull, level, up, direction of the motion,
/// sheltering, friction and the coefficient of the lugs.
type Columns = [[Lane; COMPONENTS]; INPUTS];
const NO_COLUMNS: Columns = [[[0.0; LANES]; COMPONENTS]; INPUTS];

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

    /// The same in a sea, in which the water moves past each element as it does there; and in `pressures` what the pressure of the
    /// sea adds to that under its plane (the Froude-Krylov load), about the body origin.
    pub fn evaluate_in_sea(
        &self,
        (plane, condition): (&WaterPlane, &Condition),
        wheel_speeds: &[f64],
        waters: &Waters,
        (out, pressures): (&mut [SurfaceDrag], &mut [Wrench]),
    ) {
        let flow = &self.flow(plane, condition);
        let (weight, up) = (condition.density * GRAVITY, plane.normal.into_inner().into());
        let has_heads = waters.has_heads();
        let mut unused = Slopes::NONE;
        for (surface, (out, pressure)) in out.iter_mut().zip(pressures).enumerate() {
            let (skin, is_track) = self.skin(condition, surface, wheel_speeds[surface]);
            let mut sums = Sums::default();
            *pressure = Wrench::default();
            let [from, to] = self.ranges[surface];
            for block in &self.blocks[from..to] {
                let mut water = [[0.0; LANES]; 3];
                for lane in 0..LANES {
                    let at = Vec3::from(block.center.map(|axis| axis[lane]));
                    let Water { velocity, heads: [under, real] } = waters.at(surface, &at);
                    (0..3).for_each(|axis| water[axis][lane] = velocity[axis]);
                    if has_heads {
                        let half = block.half_height(lane, up);
                        let head = mean_head(real, half) - mean_head(under, half);
                        let normal = Vec3::from(block.normal.map(|axis| axis[lane]));
                        let force = normal * (-weight * block.area[lane] * head);
                        *pressure += Wrench { force, moment: at.cross(&force) };
                    }
                }
                match is_track {
                    true => block.add::<true, false>((flow, Some(&water)), skin, &mut sums, &mut unused),
                    false => block.add::<false, false>((flow, Some(&water)), skin, &mut sums, &mut unused),
                }
            }
            *out = sums.finish();
        }
    }

    /// The same as [`Self::evaluate`] with derivatives.
    pub fn evaluate_dual<const N: usize>(
        &self,
        plane: &WaterPlane<Dual<N>>,
        condition: &Condition<Dual<N>>,
        wheel_speeds: &[f64],
        out: &mut [SurfaceDrag<Dual<N>>],
    ) {
        let inputs = self.flow(plane, condition);
        let flow = &inputs.value();
        let mut work = Work { sums: Sums::default(), slopes: Slopes::NONE, columns: NO_COLUMNS, wet: false };
        for (surface, out) in out.iter_mut().enumerate() {
            let (skin, is_track) = self.skin(condition, surface, wheel_speeds[surface]);
            work.begin();
            let (part, into) = ((surface, skin.value(), is_track), &mut work);
            run_for!(
                self.instructions,
                Drag::sum_columns(self, flow: &Flow, part: (usize, Skin, bool), into: &mut Work)
            );
            *out = work.finish((&inputs.inputs(skin.lugs), condition.density));
        }
    }

    #[inline(always)]
    fn sum_columns(&self, flow: &Flow, (surface, skin, is_track): (usize, Skin, bool), work: &mut Work) {
        let [from, to] = self.ranges[surface];
        let Work { sums, slopes, columns, wet } = work;
        for block in &self.blocks[from..to] {
            match is_track {
                true => block.add::<true, true>((flow, None), skin, sums, slopes),
                false => block.add::<false, true>((flow, None), skin, sums, slopes),
            }
            if slopes.share.iter().any(|share| *share > 0.0) {
                slopes.add_to(columns, &block.center);
                *wet = true;
            }
        }
    }

    #[inline(always)]
    fn sum(&self, flow: &Flow, condition: &Condition, wheel_speeds: &[f64], out: &mut [SurfaceDrag]) {
        let mut unused = Slopes::NONE;
        for (surface, out) in out.iter_mut().enumerate() {
            let (skin, is_track) = self.skin(condition, surface, wheel_speeds[surface]);
            let mut sums = Sums::default();
            let [from, to] = self.ranges[surface];
            for block in &self.blocks[from..to] {
                match is_track {
                    true => block.add::<true, false>((flow, None), skin, &mut sums, &mut unused),
                    false => block.add::<false, false>((flow, None), skin, &mut sums, &mut unused),
                }
            }
            *out = sums.finish();
        }
    }

    /// A surface that turns at a speed, where one is stated, and whether it is a track.
    #[inline(always)]
    fn skin<T: Real>(&self, condition: &Condition<T>, surface: usize, speed: f64) -> (Skin<T>, bool) {
        let turning = self.turning[surface].filter(|_| !speed.is_nan());
        let skin = turning.map(|Turning { center, radius, is_track }| {
            let axle = condition.velocity + condition.angular_velocity.cross(&center.map(T::from));
            let rim = speed * radius;
            let (spin, past) = (rim.powi(2), axle.dot(&axle));
            let slip = ((-axle.x + rim) / rim).abs().min(T::one());
            let lugs = if spin > 0.0 { slip * TREAD * spin / (past + spin) } else { T::zero() };
            let speed = if is_track { speed * radius } else { speed };
            Skin { speed, axle_x: center.x, axle_z: center.z, lugs }
        });
        (skin.unwrap_or_default(), turning.is_some_and(|turning| turning.is_track))
    }

    fn flow<T: Real>(&self, plane: &WaterPlane<T>, condition: &Condition<T>) -> Flow<T> {
        let up = plane.normal.into_inner();
        let v = condition.velocity;
        let level = v - up * up.dot(&v);
        let turning = norm(&condition.angular_velocity) * self.half_length;
        let along = level.dot(&level);
        let all = v.dot(&v) + turning * turning;
        let share = if all.value() > 0.0 { along / all } else { T::zero() };
        let ahead = norm(&level);
        let direction = if ahead.value() > 0.0 { level / ahead } else { Vector3::zeros() };
        let half = direction.x.abs() * self.half_length + direction.y.abs() * self.half_width;
        let ahead = direction / half.max((0.1 * self.half_width).into());
        let speed = all.sqrt();
        let reynolds = (condition.density * speed * self.length / VISCOSITY).max(LEAST_REYNOLDS.into());
        let line = reynolds.log10() - 2.0;
        Flow {
            up: up.into(),
            offset: plane.offset,
            velocity: v.into(),
            rate: condition.angular_velocity.into(),
            ahead: ahead.into(),
            sheltering: share * (0.5 * SHELTERING),
            friction: T::from(0.075) / (line * line),
            half_density: condition.density * 0.5,
        }
    }
}

/// Sums over the elements of a surface, with their derivatives.
struct Work {
    sums: Sums,
    slopes: Slopes,
    columns: Columns,
    /// Some element is wet, so that the columns hold something.
    wet: bool,
}

impl Work {
    fn begin(&mut self) {
        self.sums = Sums::default();
        if self.wet {
            (self.columns, self.wet) = (NO_COLUMNS, false);
        }
    }

    /// With the derivatives that follow from those of the inputs and of the density, to which a load is proportional.
    fn finish<const N: usize>(
        &self,
        (inputs, density): (&[Dual<N>; INPUTS], Dual<N>),
    ) -> SurfaceDrag<Dual<N>> {
        if !self.wet {
            return SurfaceDrag::default();
        }
        let SurfaceDrag { load: Wrench { force: f, moment: m }, shaft_power } = self.sums.finish();
        let values = [f.x, f.y, f.z, m.x, m.y, m.z, shaft_power];
        let mut duals = values.map(|value| density * (value / density.value));
        for (column, input) in self.columns.iter().zip(inputs) {
            for (dual, lane) in duals.iter_mut().zip(column) {
                let slope = lanes::sum(lane);
                for (own, of_input) in dual.slope.iter_mut().zip(input.slope) {
                    *own += slope * of_input;
                }
            }
        }
        let [fx, fy, fz, mx, my, mz, shaft_power] = duals;
        let load = Wrench { force: Vector3::new(fx, fy, fz), moment: Vector3::new(mx, my, mz) };
        SurfaceDrag { load, shaft_power }
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

    /// Half the height of an element that is spread evenly about its center [m].
    #[inline(always)]
    fn half_height(&self, lane: usize, [ux, uy, uz]: [f64; 3]) -> f64 {
        let s = |term: usize| self.spread[term][lane];
        let variance = s(0) * ux * ux
            + s(1) * uy * uy
            + s(2) * uz * uz
            + s(3) * ux * uy
            + s(4) * ux * uz
            + s(5) * uy * uz;
        variance.max(0.0).sqrt()
    }

    #[inline(always)]
    fn add<const IS_TRACK: bool, const SLOPES: bool>(
        &self,
        (flow, water): (&Flow, Option<&[Lane; 3]>),
        skin: Skin,
        sums: &mut Sums,
        slopes: &mut Slopes,
    ) {
        let [ux, uy, uz] = flow.up;
        let Skin { speed, axle_x, axle_z, lugs } = skin;
        let pi = std::f64::consts::PI;
        for i in 0..LANES {
            let [x, y, z] = [self.center[0][i], self.center[1][i], self.center[2][i]];
            let [nx, ny, nz] = [self.normal[0][i], self.normal[1][i], self.normal[2][i]];
            let s = |term: usize| self.spread[term][i];
            let reach = self.half_height(i, [ux, uy, uz]);
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
            let mut hull = [
                flow.velocity[0] + (wy * z - wz * y),
                flow.velocity[1] + (wz * x - wx * z),
                flow.velocity[2] + (wx * y - wy * x),
            ];
            if let Some(water) = water {
                (0..3).for_each(|axis| hull[axis] -= water[axis][i]);
            }
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
            if !SLOPES {
                continue;
            }
            let n = [nx, ny, nz];
            // with the velocity of the hull here: of the square, of Rayleigh's term, and of the load
            let below = 4.0 * total + pi * across.abs() + f64::MIN_POSITIVE;
            let share_of_all = across / below;
            // at rest there is a kink
            let linear = if total + across.abs() > 0.0 { (4.0 + pi) / below } else { 0.0 };
            let sign = if across > 0.0 { pi } else { -pi };
            let grows = 2.0 * (across - 2.0 * total * share_of_all);
            let turns = (across - of_hull) * grows + squared * (1.0 - sign * share_of_all);
            let (press, rub) = (scale * coefficient * linear, scale * tangential);
            let bend = if slip > 0.0 { rub / slip } else { 0.0 };
            for k in 0..3 {
                let of_rayleigh = press * (hull[k] * grows + n[k] * turns) - rub * slip * n[k];
                for c in 0..3 {
                    let own = if c == k { rub * slip } else { 0.0 };
                    slopes.of_velocity[k][c][i] = own + n[c] * of_rayleigh + bend * along[c] * along[k];
                }
            }
            // with the share that is wet, where it changes
            let partly = if share > 0.0 && share < 1.0 { 1.0 / range } else { 0.0 };
            let all_wet = -flow.half_density * exposed * self.area[i] * partly;
            let (normal, tangent) = (all_wet * coefficient * rayleigh, all_wet * tangential * slip);
            let of_film = 6.0 * (self.film[1] - self.film[0]) * square * square * facing * share;
            // an element that is level has none
            let of_reach = if reach > FLAT { (1.0 - 2.0 * share) / (2.0 * reach) } else { 0.0 };
            let of_variance = [
                2.0 * s(0) * ux + s(3) * uy + s(4) * uz,
                2.0 * s(1) * uy + s(3) * ux + s(5) * uz,
                2.0 * s(2) * uz + s(4) * ux + s(5) * uy,
            ];
            // with what shelters
            let sheltered = if place.abs() < 1.0 { flow.sheltering / exposed } else { 0.0 };
            let (force, at) = ([fx, fy, fz], [x, y, z]);
            for k in 0..3 {
                slopes.force[k][i] = force[k];
                slopes.of_share[k][i] = normal * n[k] + tangent * along[k];
                slopes.of_friction[k][i] = scale * slip * along[k];
                slopes.share_of_up[k][i] = of_variance[k] * of_reach - at[k] - of_film * n[k];
                slopes.shelter_of_ahead[k][i] = sheltered * at[k];
            }
            slopes.of_sheltering[i] = (place - 1.0) / exposed;
            slopes.tread[i] = 1.0 - ny * ny;
            (slopes.skin[0][i], slopes.skin[1][i]) = (skin[0], skin[1]);
            slopes.share[i] = share;
        }
    }
}

/// Mean of the head on an element whose center is at a head, above the surface none [m].
fn mean_head(head: f64, half_height: f64) -> f64 {
    if head >= half_height {
        head
    } else if head <= -half_height {
        0.0
    } else {
        (head + half_height).powi(2) / (4.0 * half_height)
    }
}

/// Derivatives of the force on each of [`LANES`] elements, in the form of few factors.
struct Slopes {
    /// With each component of the velocity of the hull here.
    of_velocity: [[Lane; 3]; 3],
    force: [Lane; 3],
    /// With the share that is wet, over the range in which it grows, and how that goes with up.
    of_share: [Lane; 3],
    share_of_up: [Lane; 3],
    share: Lane,
    of_friction: [Lane; 3],
    tread: Lane,
    /// Over the force.
    of_sheltering: Lane,
    shelter_of_ahead: [Lane; 3],
    skin: [Lane; 2],
}

impl Slopes {
    const NONE: Self = Self {
        of_velocity: [[[0.0; LANES]; 3]; 3],
        force: [[0.0; LANES]; 3],
        of_share: [[0.0; LANES]; 3],
        share_of_up: [[0.0; LANES]; 3],
        share: [0.0; LANES],
        of_friction: [[0.0; LANES]; 3],
        tread: [0.0; LANES],
        of_sheltering: [0.0; LANES],
        shelter_of_ahead: [[0.0; LANES]; 3],
        skin: [[0.0; LANES]; 2],
    };

    /// Adds the derivatives of force, moment and power with each of the [`INPUTS`].
    #[inline(always)]
    fn add_to(&self, columns: &mut Columns, at: &[Lane; 3]) {
        let of = &self.of_velocity;
        for k in 0..3 {
            let (next, last) = ((k + 1) % 3, (k + 2) % 3);
            self.add(&mut columns[k], at, |c, i| of[k][c][i]);
            // a rate moves the place across its axis
            self.add(&mut columns[3 + k], at, |c, i| {
                of[last][c][i] * at[next][i] - of[next][c][i] * at[last][i]
            });
            self.add(&mut columns[7 + k], at, |c, i| self.of_share[c][i] * self.share_of_up[k][i]);
            self.add(&mut columns[10 + k], at, |c, i| self.force[c][i] * self.shelter_of_ahead[k][i]);
        }
        self.add(&mut columns[6], at, |c, i| self.of_share[c][i]);
        self.add(&mut columns[13], at, |c, i| self.force[c][i] * self.of_sheltering[i]);
        self.add(&mut columns[14], at, |c, i| self.of_friction[c][i]);
        self.add(&mut columns[15], at, |c, i| self.of_friction[c][i] * self.tread[i]);
    }

    #[inline(always)]
    fn add(&self, column: &mut [Lane; COMPONENTS], at: &[Lane; 3], force: impl Fn(usize, usize) -> f64) {
        for i in 0..LANES {
            let [fx, fy, fz] = [force(0, i), force(1, i), force(2, i)];
            let [x, y, z] = [at[0][i], at[1][i], at[2][i]];
            column[0][i] += fx;
            column[1][i] += fy;
            column[2][i] += fz;
            column[3][i] += y * fz - z * fy;
            column[4][i] += z * fx - x * fz;
            column[5][i] += x * fy - y * fx;
            column[6][i] -= fx * self.skin[0][i] + fz * self.skin[1][i];
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
