//! What is known about a state without training, for the `anchored` model: exact hydrostatics, a simple
//! drag (on the windward part of the box around the wet part), and the inputs of the network, all without a dimension.
//! The drag is what is left far from the training data, so it has to be right in the mean: that of whole boxes, a front, a rear
//! and four wheels one behind the other, was twice the Warthog's.
//!
//! The model is `F_s = H_s + D_s + q A_s R_s`: the pressure load `H_s` of still water, the drag `D_s`, and a remainder
//! `R_s` that the network answers, in units of the dynamic pressure `q = rho U^2 / 2` on the area `A_s` that the water may
//! reach. A surface above still water gets nothing, continuously; a vehicle at rest gets Archimedes. Of a remainder of the
//! physical base ([`Remainder::OfPhysics`]) `D_s` is left out here: it is the base's, which serving adds.
//!
//! `A_s` is the share of the surface's area that its height has below the head of the stream, `U^2 / 2g` above still water:
//! a fast bow wave climbs a front that stands in the water by a centimeter, and would be a remainder without bound on
//! the wet area alone. It rises from zero over the first centimeters of still water on the surface. What the network is told
//! of the wet part is of the soaked area, which does not step where the water reaches a level underside.
//!
//! The remainder's moment about the centroid of the wet part is answered too, in units of `q A_s a` with the root `a` of the
//! surface's area: a bow wave on one end of a side and the trough behind it make a couple whose force is next to nothing, which
//! no place of that force inside the surface could tell. Force and moment of still water and flow together are then one force
//! at one point, as far as it lies where the water may reach.
//!
//! Left and right: what is told of a surface on one side is told in terms of that side (toward it is positive), and of a
//! surface on the plane of symmetry only what does not change under reflection, with lateral answers multiplied by
//! something that does. So the mirror image of a state gets the mirror image of the answer, by construction.

use nalgebra::{UnitVector3, Vector3};

use crate::condition::{Condition, GroundContact, LEAST_UPRIGHT};
use crate::forces::SurfaceForce;
use crate::frame::{GRAVITY, VISCOSITY, Vec3};
use crate::geometry::mesh::Bounds;
use crate::geometry::wetting::{Wetting, WettingTable};
use crate::real::{Real, norm, smoothstep};
use crate::vehicle::Vehicle;
use crate::wrench::Wrench;

/// What the network's answer is a remainder of, which decides its inputs too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Remainder {
    /// Archimedes and the simple drag of this module: level or nearly so, the wheels on the bed.
    OfDrag,
    /// The physical base ([`crate::physics`]) without waves: any attitude, any height over the bed.
    OfPhysics,
}

impl Remainder {
    /// Name in the file of the weights: weights with another are refused.
    pub fn name(self) -> &'static str {
        match self {
            Self::OfDrag => "archimedes + windward drag of the soaked part, force and moment",
            Self::OfPhysics => "physical base without waves, force and moment",
        }
    }

    /// The remainder of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::OfDrag, Self::OfPhysics].into_iter().find(|remainder| remainder.name() == name)
    }

    /// Names of its inputs that are the same for all surfaces, in order.
    pub fn global_names(self) -> &'static [&'static str] {
        match self {
            Self::OfDrag => &GLOBAL_NAMES[..GLOBAL - 2],
            Self::OfPhysics => &GLOBAL_NAMES,
        }
    }

    /// Coordinates that tell its states apart.
    pub fn coordinates(self) -> usize {
        match self {
            Self::OfDrag => COORDINATES - 1,
            Self::OfPhysics => COORDINATES,
        }
    }
}

/// Names of the inputs that are the same for all surfaces, in order; the last two of a remainder of the physical base alone.
pub const GLOBAL_NAMES: [&str; 13] = [
    "froude_depth",
    "froude_length",
    "depth",
    "ahead",
    "aside_squared",
    "reynolds",
    "bed",
    "up_x",
    "up_y_squared",
    "width",
    "height",
    "bed_clearance",
    "lean_aside",
];

/// Names of what is told of a surface in a state, in order.
pub const DYNAMIC_NAMES: [&str; 12] = [
    "wet_fraction",
    "mean_depth",
    "aside",
    "up_aside",
    "facing",
    "wet_facing",
    "upstream",
    "off_track",
    "below_surface",
    "above_top",
    "wet_area",
    "clearance",
];

/// Names of what is told of a surface whatever the state, in order.
pub const STATIC_NAMES: [&str; 12] =
    ["bottom", "front", "rear", "side", "wheel", "x", "y_outward", "z", "nx", "n_outward", "nz", "area"];

/// Names of what the network answers for a surface, in order.
pub const OUTPUT_NAMES: [&str; 7] =
    ["force_x", "force_aside", "force_z", "force_up_aside", "moment_x_aside", "moment_y", "moment_z_aside"];

/// Number of global features.
pub const GLOBAL: usize = GLOBAL_NAMES.len();
/// Number of features of a surface that change with the state.
pub const DYNAMIC: usize = DYNAMIC_NAMES.len();
/// Number of features of a surface that do not.
pub const STATIC: usize = STATIC_NAMES.len();
/// Number of answers for a surface.
pub const OUTPUTS: usize = OUTPUT_NAMES.len();
/// Coordinates of a state among the cases that were learnt from.
pub const COORDINATES: usize = 9;

/// Drag coefficient of a box in open-channel flow (Qi, Eames, Johnson, JFM 2014) [-].
const CD0: f64 = 1.9;
/// Share of the drag that depends on how far upstream a surface is; see `effects::form_drag`.
const SHELTERING: f64 = 0.5;
/// Height of water on a surface over which its loads set in [m].
const RAMP: f64 = 0.02;
/// Depth below which Froude numbers no longer grow [m].
const LEAST_DEPTH: f64 = 1e-3;
/// Clearance over the bed, in lengths, at which half of what the bed does is thought to be gone: the gap blocks the flow under
/// the hull while it is a few times lower than the wheels are high.
const CLEAR: f64 = 0.1;
/// Reynolds number below which its logarithm is held.
const LEAST_REYNOLDS: f64 = 1e3;

/// A vehicle prepared to be read in any state; body frame.
#[derive(Debug, Clone)]
pub struct Anchor {
    table: WettingTable,
    surfaces: Vec<AnchorSurface>,
    /// Ends of the hull along x and y, from the origin [m].
    bounds: Bounds,
    /// Depth up to which the coordinates of a state are told apart, the height of the hull [m].
    height: f64,
    remainder: Remainder,
}

#[derive(Debug, Clone)]
struct AnchorSurface {
    bounds: Bounds,
    /// 1 to the left, -1 to the right, 0 on the plane of symmetry.
    side: f64,
    normal: Vec3,
    area: f64,
    windward: Windward,
}

/// Shares of the sides of a surface's box that it takes up as seen from along an axis; a face that looks back takes up nothing.
/// For motion ahead and astern, to the left and to the right.
#[derive(Debug, Clone, Copy)]
struct Windward([[f64; 2]; 2]);

impl Windward {
    fn of(area_vectors: impl Iterator<Item = Vec3>, bounds: &Bounds) -> Self {
        let box_sides = [bounds.extent().y, bounds.extent().x].map(|width| width * bounds.extent().z);
        let mut shares = [[0.0; 2]; 2];
        for area in area_vectors {
            for (axis, side) in box_sides.into_iter().enumerate().filter(|(_, side)| *side > 0.0) {
                shares[axis][usize::from(area[axis] < 0.0)] += area[axis].abs() / side;
            }
        }
        Self(shares)
    }

    /// Share of the side that motion along an axis meets.
    fn share<T: Real>(&self, axis: usize, ahead: T) -> f64 {
        self.0[axis][usize::from(ahead.value() < 0.0)]
    }
}

/// What is known of a state.
#[derive(Debug, Clone)]
pub struct Reading<T = f64> {
    /// Dynamic pressure [Pa].
    pub pressure: T,
    /// Features of the state.
    pub global: [T; GLOBAL],
    /// Where the state lies among the cases that were learnt from.
    pub coordinates: [T; COORDINATES],
    /// Component of up along body z, which the coordinates do not tell: an overturned hull has those of an upright one.
    pub upright: T,
    /// One entry a surface, in the vehicle's order.
    pub surfaces: Vec<SurfaceReading<T>>,
    wetting: Vec<Wetting<T>>,
}

impl<T: Real> Default for Reading<T> {
    fn default() -> Self {
        Self::with_capacity(0)
    }
}

/// What is known of a surface in a state; body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceReading<T = f64> {
    /// Share under water.
    pub wet_fraction: T,
    /// Centroid of the soaked part [m]; of the whole surface where it is dry.
    pub center: Vector3<T>,
    /// Load of still water about the body origin [N, N m].
    pub hydrostatic: Wrench<T>,
    /// Simple drag [N].
    pub drag: Vector3<T>,
    /// How far loads have set in: 0 above still water, 1 where water stands a few centimeters high on the surface.
    pub onset: T,
    /// `q A_s`: what a coefficient of one is worth [N].
    pub unit: T,
    /// Length that a coefficient of a moment has beside `unit` [m].
    pub arm: f64,
    /// Factors of the two lateral coefficients.
    pub lateral: [T; 2],
    /// The box around the part that the water may reach, up to the head of the stream above still water [m].
    pub reach: [Vector3<T>; 2],
    /// Features.
    pub dynamic: [T; DYNAMIC],
}

impl<T: Real> Default for SurfaceReading<T> {
    fn default() -> Self {
        let (zero, none) = (T::zero(), Vector3::zeros());
        Self {
            wet_fraction: zero,
            center: none,
            hydrostatic: Wrench::default(),
            drag: none,
            onset: zero,
            unit: zero,
            arm: 0.0,
            lateral: [zero; 2],
            reach: [none; 2],
            dynamic: [zero; DYNAMIC],
        }
    }
}

impl<T: Real> Reading<T> {
    /// Room for a vehicle of so many surfaces.
    pub fn with_capacity(surfaces: usize) -> Self {
        Self {
            surfaces: Vec::with_capacity(surfaces),
            wetting: Vec::with_capacity(surfaces),
            pressure: T::zero(),
            global: [T::zero(); GLOBAL],
            coordinates: [T::zero(); COORDINATES],
            upright: T::zero(),
        }
    }

    /// What the water reaches, for [`Anchor::read_wet`].
    pub(crate) fn wetting_mut(&mut self) -> &mut Vec<Wetting<T>> {
        &mut self.wetting
    }
}

impl Reading {
    /// What coefficients of one on all surfaces are worth [N].
    pub fn dynamic_load(&self) -> f64 {
        self.surfaces.iter().map(|surface| surface.unit).sum()
    }
}

impl<T: Real> SurfaceReading<T> {
    /// The dynamic force and its moment about the centroid of the wet part that the network's answer means [N, N m].
    pub fn dynamic_load(&self, output: &[T; OUTPUTS]) -> Wrench<T> {
        let o = output;
        let aside = o[1] * self.lateral[0] + o[3] * self.lateral[1];
        let force = self.drag + Vector3::new(o[0], aside, o[2]) * self.unit;
        let aside = self.lateral[0];
        let moment = Vector3::new(o[4] * aside, o[5], o[6] * aside) * (self.unit * self.arm);
        Wrench { force, moment }
    }
}

impl SurfaceReading {
    /// Features as the network takes them. The cast to single precision happens here and nowhere else.
    pub fn told(&self) -> [f32; DYNAMIC] {
        self.dynamic.map(|x| x as f32)
    }

    /// The dynamic force that the network's answer means [N].
    pub fn force(&self, output: &[f32; OUTPUTS]) -> Vec3 {
        self.dynamic_load(&output.map(f64::from)).force
    }

    /// The moment of the dynamic force that the network's answer means, about the centroid of the wet part [N m].
    pub fn moment(&self, output: &[f32; OUTPUTS]) -> Vec3 {
        self.dynamic_load(&output.map(f64::from)).moment
    }

    /// The whole load that the network's answer means, hydrostatics included, as a force at one point: on the line along
    /// which it has the moment of its parts the point nearest to the wet centroid, as far as the water may reach there.
    pub fn load(&self, output: &[f32; OUTPUTS]) -> SurfaceForce {
        let force = self.hydrostatic.force + self.force(output);
        // about the wet centroid
        let still = self.hydrostatic.moment - self.center.cross(&self.hydrostatic.force);
        let moment = still + self.moment(output);
        let [low, high] = self.reach;
        // x cross F = M - (M . F) F / F^2 for x = F cross M / F^2
        let size = force.norm_squared();
        let point = if size > 0.0 { self.center + force.cross(&moment) / size } else { self.center };
        SurfaceForce {
            force,
            point: point.sup(&low).inf(&high),
            wetted_fraction: self.wet_fraction,
            couple: Vec3::zeros(),
        }
    }
}

impl Anchor {
    /// Prepares a vehicle to be read for weights that answer such a remainder.
    pub fn new(vehicle: &Vehicle, remainder: Remainder) -> Self {
        let count = vehicle.surfaces.len();
        let whole = vehicle.hull.mesh.bounds().unwrap_or(Bounds { min: Vec3::zeros(), max: Vec3::zeros() });
        let surface = |(index, surface): (usize, &crate::vehicle::Surface)| {
            let corners = vehicle.hull.faces_of(index).flat_map(|face| vehicle.hull.mesh.triangle(face));
            let corners: Vec<Vec3> = corners.collect();
            let alone = surface.mirror_left_right == index;
            let bounds = Bounds::around(&corners).unwrap_or(whole);
            let faces = vehicle.hull.faces_of(index).map(|face| vehicle.hull.mesh.area_vector(face));
            AnchorSurface {
                windward: Windward::of(faces, &bounds),
                bounds,
                side: if alone { 0.0 } else { surface.centroid.y.signum() },
                normal: surface.normal,
                area: surface.area,
            }
        };
        Self {
            table: WettingTable::new(&vehicle.hull, count),
            surfaces: vehicle.surfaces.iter().enumerate().map(surface).collect(),
            bounds: whole,
            height: vehicle.dimensions.height,
            remainder,
        }
    }

    /// Features of each surface that do not change with the state.
    pub fn static_rows(&self, vehicle: &Vehicle) -> Vec<[f32; STATIC]> {
        let dimensions = &vehicle.dimensions;
        let row = |(surface, anchor): (&crate::vehicle::Surface, &AnchorSurface)| {
            let mut row = crate::features::surface_static(surface, dimensions);
            (row[6], row[9]) = (row[6].abs(), row[9] * anchor.side);
            row.map(|x| x as f32)
        };
        vehicle.surfaces.iter().zip(&self.surfaces).map(row).collect()
    }

    /// Reads a state. Allocates nothing once `out` has held this vehicle.
    pub fn read(&self, vehicle: &Vehicle, condition: &Condition, out: &mut Reading) {
        out.wetting.resize(self.surfaces.len(), Wetting::default());
        self.table.wetting_into(&condition.water_plane(vehicle.z0), &mut out.wetting);
        self.read_wet(vehicle, condition, out);
    }

    /// Reads a state of which `out` holds what the water reaches.
    pub(crate) fn read_wet<T: Real>(
        &self,
        vehicle: &Vehicle,
        condition: &Condition<T>,
        out: &mut Reading<T>,
    ) {
        let plane = condition.water_plane(vehicle.z0);
        let flow = Flow::of(vehicle, condition, self.remainder);
        out.pressure = condition.density * 0.5 * flow.speed * flow.speed;
        out.global = flow.global(vehicle, condition);
        out.coordinates = self.coordinates(&flow, condition);
        out.upright = condition.up.z;
        out.surfaces.clear();
        let surroundings = Surroundings { vehicle, condition, flow: &flow };
        for (index, (surface, wetting)) in self.surfaces.iter().zip(&out.wetting).enumerate() {
            let mut reading = self.surface(&surroundings, surface, wetting);
            if reading.wet_fraction.value() == 0.0 {
                reading.center = vehicle.surfaces[index].centroid.map(T::from);
            }
            out.surfaces.push(reading);
        }
        if condition.ground_contact == GroundContact::Dry {
            for patch in &vehicle.contacts {
                let reading = &mut out.surfaces[patch.surface];
                if reading.wet_fraction.value() > 0.0 {
                    reading.hydrostatic += patch.lost_pressure(&plane, condition.density, &Vec3::zeros());
                }
            }
        }
    }

    /// How far loads had set in on each surface in a case of these coordinates: 0 on one that it left dry.
    pub fn onsets(&self, vehicle: &Vehicle, coordinates: &[f64; COORDINATES]) -> impl Iterator<Item = f64> {
        let [_, _, depth, _, _, x, y, ..] = *coordinates;
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        // the side to which it leaned is not told: either may have been the lower one
        let planes = [y, -y].map(|y| {
            let up = UnitVector3::new_normalize(Vec3::new(x, y, z));
            let state = Condition { up, ..Condition::level(Vec3::zeros(), depth * self.height) };
            state.water_plane(vehicle.z0)
        });
        self.surfaces.iter().map(move |surface| {
            let corners = surface.bounds.corners();
            let depths =
                corners.iter().flat_map(|corner| planes.iter().map(|plane| plane.depth_below(corner)));
            ramp(depths.fold(0.0, f64::max))
        })
    }

    fn surface<T: Real>(
        &self,
        state: &Surroundings<'_, T>,
        surface: &AnchorSurface,
        wetting: &Wetting<T>,
    ) -> SurfaceReading<T> {
        let Surroundings { vehicle, condition, flow } = *state;
        let Some(center) = wetting.centroid() else { return SurfaceReading::default() };
        let (length, width, height) =
            (vehicle.dimensions.length, vehicle.dimensions.width, vehicle.dimensions.height);
        let plane = condition.water_plane(vehicle.z0);
        let Bounds { min, max } = surface.bounds;
        // of next to nothing it is the quotient of two roundings
        let center = Vector3::from_fn(|axis, _| center[axis].clamp(min[axis], max[axis]));
        // the water level in the body frame where the surface is; a vehicle on its side has none
        let level = center.z + plane.depth_below(&center) / plane.normal.z.max(LEAST_UPRIGHT.into());
        let top = level.clamp(min.z, max.z);
        let high = top - min.z;
        let wet_fraction = (wetting.area / surface.area).min(T::one());
        let fraction = (wetting.soaked_area / surface.area).min(T::one());
        let hydrostatic = wetting.pressure * (condition.density * GRAVITY);
        let ahead = &flow.direction;
        // pressure acts along the sides' normals: across for the sides, along for the ends
        let met = |axis: usize| ahead[axis] * surface.windward.share(axis, ahead[axis]);
        let sides = [max.y - min.y, max.x - min.x];
        let front = Vector3::new(met(0) * sides[0] * high, met(1) * sides[1] * high, T::zero());
        let place = center.dot(ahead) / flow.half_length(&self.bounds);
        let shelter = (place.clamp(-1.0, 1.0) * SHELTERING + 1.0) * 0.5;
        let pressure = condition.density * 0.5 * flow.speed * flow.speed;
        let head = flow.speed * flow.speed / (2.0 * GRAVITY);
        let reached = ((level + head - min.z) / (max.z - min.z).max(RAMP)).clamp(0.0, 1.0);
        // of a hull that is tilted the water meets another point first than the lowest in the body frame; of an upright plate the
        // soaked part is twice as high as its middle is deep
        let onset = ramp(match self.remainder {
            Remainder::OfDrag => level - min.z,
            Remainder::OfPhysics => plane.depth_below(&center) * 2.0,
        });
        let facing = ahead.dot(&surface.normal.map(T::from));
        let off_track = (center.x * ahead.y - center.y * ahead.x).abs();
        let dynamic = [
            fraction,
            plane.depth_below(&center) / height,
            ahead.y * surface.side,
            condition.up.y * surface.side,
            facing,
            facing.abs() * fraction,
            center.dot(ahead) / length,
            off_track / width,
            ((level - min.z) / height).clamp(0.0, 2.0),
            ((level - max.z) / height).clamp(-1.0, 1.0),
            wetting.soaked_area / (length * width),
            (T::from(min.z - vehicle.z0) / condition.depth.max(LEAST_DEPTH.into())).clamp(0.0, 4.0),
        ];
        let [low, high] = [min, max].map(|corner| corner.map(T::from));
        let reach_top = (level.max(min.z.into()) + head).min(high.z).max(center.z);
        let lateral = [ahead.y, condition.up.y];
        SurfaceReading {
            wet_fraction,
            center,
            hydrostatic,
            drag: match self.remainder {
                Remainder::OfDrag => front * -(shelter * pressure * CD0),
                Remainder::OfPhysics => Vector3::zeros(),
            },
            onset,
            unit: pressure * surface.area * reached * onset,
            arm: surface.area.sqrt(),
            lateral: if surface.side == 0.0 { lateral } else { [surface.side.into(), T::zero()] },
            reach: [low, Vector3::new(high.x, high.y, reach_top)],
            dynamic,
        }
    }

    fn coordinates<T: Real>(&self, flow: &Flow<T>, condition: &Condition<T>) -> [T; COORDINATES] {
        let aside = |y: T| match self.remainder {
            Remainder::OfDrag => y.abs(),
            Remainder::OfPhysics => y,
        };
        [
            bounded(flow.froude_depth),
            flow.froude_length,
            condition.depth / self.height,
            flow.direction.x,
            aside(flow.direction.y),
            condition.up.x,
            aside(condition.up.y),
            flow.bed,
            flow.clearance,
        ]
    }
}

/// 0 to 1 over the first [`RAMP`] of a height, with no kink.
fn ramp<T: Real>(height: T) -> T {
    smoothstep(height / RAMP)
}

/// `x / (1 + x)`: a Froude number of any size, in 0 to 1.
fn bounded<T: Real>(x: T) -> T {
    x / (x + 1.0)
}

/// What every surface of a vehicle is read in.
struct Surroundings<'a, T: Real> {
    vehicle: &'a Vehicle,
    condition: &'a Condition<T>,
    flow: &'a Flow<T>,
}

/// The motion through the water and over the bed.
struct Flow<T> {
    speed: T,
    direction: Vector3<T>,
    froude_depth: T,
    froude_length: T,
    /// How much of the velocity through the water the bed sees: 1 driving in still water, 0 parked in a current.
    bed: T,
    /// Height of the wheels over the bed, of any size, in 0 to 1.
    clearance: T,
}

impl<T: Real> Flow<T> {
    fn of(vehicle: &Vehicle, condition: &Condition<T>, remainder: Remainder) -> Self {
        let speed = norm(&condition.velocity);
        let moves = speed.value() > 0.0;
        let ahead = if moves { condition.velocity / speed } else { Vector3::zeros() };
        let (bed, clearance) = match remainder {
            Remainder::OfDrag => {
                let bed = if moves { condition.ground_velocity.dot(&ahead) / speed } else { T::zero() };
                (bed.clamp(-2.0, 2.0), T::zero())
            }
            Remainder::OfPhysics => (condition.bed(), condition.bed_clearance.unwrap_or_else(T::zero)),
        };
        let depth = (condition.depth + clearance).max(LEAST_DEPTH.into());
        Self {
            speed,
            direction: ahead,
            froude_depth: speed / (depth * GRAVITY).sqrt(),
            froude_length: speed / (GRAVITY * vehicle.dimensions.length).sqrt(),
            bed,
            clearance: bounded(clearance / (CLEAR * vehicle.dimensions.length)),
        }
    }

    fn global(&self, vehicle: &Vehicle, condition: &Condition<T>) -> [T; GLOBAL] {
        let dimensions = &vehicle.dimensions;
        let reynolds = condition.density * self.speed * dimensions.length / VISCOSITY;
        [
            bounded(self.froude_depth),
            self.froude_length,
            condition.depth / dimensions.height,
            self.direction.x,
            self.direction.y * self.direction.y,
            reynolds.max(LEAST_REYNOLDS.into()).log10() - 6.0,
            self.bed,
            condition.up.x,
            condition.up.y * condition.up.y,
            (dimensions.width / dimensions.length).into(),
            (dimensions.height / dimensions.length).into(),
            self.clearance,
            self.direction.y * condition.up.y,
        ]
    }

    /// Half the length of the hull along the motion [m].
    fn half_length(&self, bounds: &Bounds) -> T {
        let half = bounds.extent() * 0.5;
        let along = self.direction.map(T::abs);
        (along.x * half.x + along.y * half.y + along.z * half.z).max(1e-6.into())
    }
}
