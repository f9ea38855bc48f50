//! The loads of the base on a vehicle in any state: still water exactly, drag by elements, added mass and waves.
//!
//! `W = W_hydrostatic + sum_elements f + W_added + W_waves` with
//! `W_added = -(A nu_dot + C_A(nu) nu + k max(y', 0) dA/dy nu)` about the body origin. `nu` is the velocity through the water, `C_A`
//! Kirchhoff's cross terms (Newman, Marine Hydrodynamics, section 4.14), `y` the place in the table of [`Radiation`], which
//! rises with the share of the height of [`Ellipsoid`] that is under water. The last term is the momentum that entering water is given (von Karman 1929), by the
//! share `ENTRY` that conserves energy; it acts while `y` rises alone, so that a hull that leaves the water gets nothing
//! back. So the energy of body, added mass, memory and position never rises by what the water does.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::drag::{Drag, SurfaceDrag};
use super::elements::{COUNT, elements};
use super::immersion::Ellipsoid;
use super::radiation::{NODES, Node, POLES, Pole, Radiation, STEP};
use crate::condition::{Condition, GroundContact};
use crate::frame::{GRAVITY, Vec3, WaterPlane};
use crate::geometry::hydrostatics::float_depth;
use crate::geometry::wetting::{Wetting, WettingTable};
use crate::real::{Dual, Real};
use crate::sea::{Draft, Sea, Waters};
use crate::vehicle::{ContactPatch, MAX_SURFACES, MAX_WHEELS, Vehicle};
use crate::wrench::Wrench;

crate::named_enum! {
    /// How much of the base answers: for tests, and to see what a term does.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
    #[serde(rename_all = "snake_case")]
    #[repr(u8)]
    pub enum Physics {
        /// The pressure of still water.
        Hydrostatic = 1 => "hydrostatic",
        /// And drag and friction of the local velocity.
        QuasiSteady = 2 => "quasi_steady",
        /// And added mass, entry and the waves that the hull makes.
        #[default]
        Full = 3 => "full",
    }
}

/// Clearance of a hull a height deeper than afloat of which nobody stated it, over its height [-]: the bed is then next to
/// nothing.
const LIFTED: f64 = 2.0;
/// Share of the momentum that entering water takes from the hull at once [-]. At a half the energy of added mass and body stays
/// what it is; von Karman's 1 spends as much again on the spray, which a hull with frame and tilt makes less of.
const ENTRY: f64 = 0.5;
/// Share of a surface that is wet from which its elements bear all of their drag [-].
const REACHED: f64 = 0.05;
/// What is remembered from state to state: waves made, and the acceleration of explicit integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Memory<T = f64> {
    /// Output of each oscillator and its integral.
    waves: [[Vector6<T>; 2]; POLES],
    /// Acceleration that the added mass resists in explicit integration.
    rate: Option<Vector6<T>>,
    /// The states are of a recording.
    recorded: bool,
    /// Time has passed.
    begun: bool,
}

impl<T: Real> Default for Memory<T> {
    fn default() -> Self {
        Self { waves: [[Vector6::zeros(); 2]; POLES], rate: None, recorded: false, begun: false }
    }
}

impl Memory {
    /// Of a recording: its accelerations are those that the body had, not those that a loop goes on from, and its motion was
    /// steady before it begins.
    pub fn of_recording() -> Self {
        Self { recorded: true, ..Self::default() }
    }

    /// The same without what waves remember.
    pub fn without_waves(&self) -> Self {
        Self { waves: Self::default().waves, ..*self }
    }

    fn with_slopes<const N: usize>(&self) -> Memory<Dual<N>> {
        let dual = |vector: &Vector6<f64>| vector.map(Dual::from);
        Memory {
            waves: self.waves.each_ref().map(|wave| wave.each_ref().map(dual)),
            rate: self.rate.as_ref().map(dual),
            recorded: self.recorded,
            begun: self.begun,
        }
    }

    /// Energy in the oscillators over the density, `sum (y^2 + w^2 q^2) / 2` [m5/s2].
    pub fn energy(&self, poles: &[Pole; POLES]) -> f64 {
        let stored = |([y, q], pole): (&[Vector6<f64>; 2], &Pole)| {
            0.5 * (y.norm_squared() + pole.frequency.powi(2) * q.norm_squared())
        };
        self.waves.iter().zip(poles).map(stored).sum()
    }
}

/// The load of the base on one surface; body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceLoad<T = f64> {
    /// Pressure of still water about the body origin [N, N m].
    pub hydrostatic: Wrench<T>,
    /// Drag and friction about the body origin [N, N m].
    pub drag: Wrench<T>,
    /// Share under water.
    pub wet_fraction: T,
    /// Centroid of the wet part; of the surface where it is dry [m].
    pub center: Vector3<T>,
}

/// What the base says of a state. Reused from query to query.
#[derive(Debug, Clone)]
pub struct BaseLoads<T = f64> {
    /// One entry a surface.
    pub surfaces: Vec<SurfaceLoad<T>>,
    /// Added mass and waves about the body origin [N, N m]: loads of the whole hull.
    pub hull: Wrench<T>,
    /// Added mass and inertia about the body origin, forces first [kg, kg m, kg m2].
    pub added_mass: Matrix6<T>,
    /// Of the added mass the part that turns with the hull, which the bed does not add to.
    far_from_bed: Matrix6<T>,
    /// Derivative of the linear wave load with respect to the velocity, with the sign changed [kg/s, kg m/s, kg m2/s].
    pub damping: Matrix6<f64>,
    /// Clearance over the bed that was used [m].
    pub bed_clearance: T,
    /// Share of the motion through the water that is motion over the bed, as used.
    pub bed: T,
    /// Power that the shafts of the wheels put in [W].
    pub shaft_power: T,
    wetting: Vec<Wetting<T>>,
    drags: Vec<SurfaceDrag<T>>,
}

impl<T: Real> Default for BaseLoads<T> {
    fn default() -> Self {
        Self::with_capacity(0)
    }
}

impl<T: Real> BaseLoads<T> {
    /// Room for a vehicle of so many surfaces.
    pub fn with_capacity(surfaces: usize) -> Self {
        Self {
            surfaces: Vec::with_capacity(surfaces),
            wetting: Vec::with_capacity(surfaces),
            drags: Vec::with_capacity(surfaces),
            hull: Wrench::default(),
            added_mass: Matrix6::zeros(),
            far_from_bed: Matrix6::zeros(),
            damping: Matrix6::zeros(),
            bed_clearance: T::zero(),
            bed: T::zero(),
            shaft_power: T::zero(),
        }
    }
}

impl<T: Real> BaseLoads<T> {
    /// The load of the hull as a whole in steady motion, about the body origin, in other numbers: the moment of the added mass
    /// in an oblique stream, `-v x M_A v` (Munk, The aerodynamic forces on airship hulls, NACA report 184, 1924).
    pub(crate) fn steady_hull<U: Real>(&self, velocity: &Vector3<U>, with: impl Fn(T) -> U) -> Wrench<U> {
        Wrench::from_column(&-cross_terms(&self.far_from_bed.map(with), velocity, &Vector3::zeros()))
    }

    /// What the water reaches on each surface, in other numbers.
    pub(crate) fn wetting_into<U: Real>(&self, with: impl Fn(T) -> U, out: &mut Vec<Wetting<U>>) {
        out.clear();
        out.extend(self.wetting.iter().map(|wetting| wetting.map(&with)));
    }
}

/// What the base needs to know beside the state.
#[derive(Debug, Clone, Copy)]
pub struct Motion<'a> {
    /// Speed of each surface that is a wheel about the body's y [rad/s]; NaN where none is stated.
    pub wheel_speeds: &'a [f64],
    /// Time since the state before it in the session [s].
    pub time_step: f64,
    /// The caller integrates added mass with the matrix.
    pub implicit_added_mass: bool,
    /// How much of the base answers.
    pub physics: Physics,
    /// The sea about the hull, of a state that [`Base::in_sea`] gave.
    pub waters: Option<&'a Waters>,
}

impl Motion<'static> {
    /// Of a state that stands alone, in calm water.
    pub const ALONE: Self = Self {
        wheel_speeds: &STATED_NONE,
        time_step: 0.0,
        implicit_added_mass: false,
        physics: Physics::Full,
        waters: None,
    };
    /// The same without added mass and waves.
    pub const QUASI_STEADY: Self = Self { physics: Physics::QuasiSteady, ..Self::ALONE };
}

/// A vehicle prepared for the base.
#[derive(Debug, Clone)]
pub struct Base {
    table: WettingTable,
    drag: Drag,
    radiation: Radiation,
    /// Rows of the table at [`Radiation::frequency`], as a state without a session is answered.
    steady: [Vec<Steady>; 2],
    ellipsoid: Ellipsoid,
    z0: f64,
    height: f64,
    /// Share of the height under water of the hull afloat in fresh water, upright; 1 where it sinks.
    float_share: f64,
    rigid: Matrix6<f64>,
    contacts: Vec<ContactPatch>,
    areas: Vec<f64>,
    centers: Vec<Vec3>,
}

/// Takes velocities of a point `about` and of the body to those of the origin: a matrix `A` about the origin is
/// `T^T A T` about the point.
pub fn origin_from(about: &Vec3) -> Matrix6<f64> {
    let mut matrix = Matrix6::identity();
    // v at the origin is v at the point less omega x about
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&about.cross_matrix());
    matrix
}

/// Added mass and damping of a row at one frequency.
#[derive(Debug, Clone, Copy)]
struct Steady {
    mass: Matrix6<f64>,
    damping: Matrix6<f64>,
}

impl Base {
    /// Prepares a vehicle with the table of its waves.
    pub fn new(vehicle: &Vehicle, radiation: Radiation) -> Self {
        let count = vehicle.surfaces.len();
        let ellipsoid = Ellipsoid::within(&vehicle.hull.mesh);
        let steady = steady(&radiation);
        let afloat = vehicle.z0 + float_depth(&vehicle.hull.mesh, vehicle.z0, vehicle.mass);
        Self {
            table: WettingTable::new(&vehicle.hull, count),
            drag: Drag::new(vehicle, &elements(vehicle, COUNT)),
            radiation,
            steady,
            ellipsoid,
            z0: vehicle.z0,
            height: vehicle.dimensions.height,
            float_share: ellipsoid.share_under(&WaterPlane::level(afloat, 0.0)).clamp(0.0, 1.0),
            rigid: rigid_mass(vehicle),
            contacts: vehicle.contacts.clone(),
            areas: vehicle.surfaces.iter().map(|s| s.area).collect(),
            centers: vehicle.surfaces.iter().map(|s| s.centroid).collect(),
        }
    }

    /// The table of waves.
    pub fn radiation(&self) -> &Radiation {
        &self.radiation
    }

    /// Elements that are evaluated a query.
    pub fn elements(&self) -> usize {
        self.drag.len()
    }

    /// The loads in a state. Allocates nothing once `out` has held this many surfaces.
    pub fn evaluate(
        &self,
        condition: &Condition,
        motion: &Motion<'_>,
        memory: Option<&mut Memory>,
        out: &mut BaseLoads,
    ) {
        let plane = condition.water_plane(self.z0);
        let count = self.areas.len();
        out.wetting.resize(count, Wetting::default());
        out.drags.resize(count, SurfaceDrag::default());
        self.table.wetting_into(&plane, &mut out.wetting);
        let Some(waters) = motion.waters else {
            self.drag.evaluate(&plane, condition, motion.wheel_speeds, &mut out.drags);
            return self.combine(condition, motion, memory, out);
        };
        let mut pressures = [Wrench::default(); MAX_SURFACES];
        let into = (&mut out.drags[..], &mut pressures[..count]);
        self.drag.evaluate_in_sea((&plane, condition), motion.wheel_speeds, waters, into);
        self.combine(condition, motion, memory, out);
        for (surface, pressure) in out.surfaces.iter_mut().zip(&pressures) {
            surface.hydrostatic = surface.hydrostatic * waters.steepness + *pressure;
        }
        // water that is accelerated presses on the hull as on what it displaces, and on what moves with the hull besides; the
        // first is in the pressure
        let water = joined(&waters.acceleration, &Vec3::zeros());
        out.hull += Wrench::from_column(&(out.added_mass * water));
    }

    /// A state in a sea as one in the plane and the flow that stand for it, and what the sea is beside them.
    pub fn in_sea(&self, condition: &Condition, sea: &Sea, wheels: &[usize]) -> (Condition, Waters) {
        let plane = condition.water_plane(self.z0);
        let condition = Condition { water_level: Some(plane.offset), ..*condition };
        let up = plane.normal.into_inner();
        let immersion = self.ellipsoid.share_under(&plane);
        let clearance = condition.bed_clearance.unwrap_or_else(|| self.usual_clearance(immersion));
        let [low, high] = self.ellipsoid.span(&plane);
        let draft = Draft {
            center: self.ellipsoid.center(),
            half: self.ellipsoid.half_axes(),
            low: low.min(0.0),
            high: high.min(0.0),
            water: plane.offset - self.z0 * up.z + clearance,
        };
        let mut places = [(0, Vec3::zeros()); MAX_WHEELS];
        for (place, &surface) in places.iter_mut().zip(wheels) {
            *place = (surface, self.centers[surface]);
        }
        sea.about(&condition, &draft, &places[..wheels.len().min(MAX_WHEELS)])
    }

    /// The loads in a state from what the water reaches and the motion does, which `out` holds.
    fn combine<T: Real>(
        &self,
        condition: &Condition<T>,
        motion: &Motion<'_>,
        memory: Option<&mut Memory<T>>,
        out: &mut BaseLoads<T>,
    ) {
        let plane = condition.water_plane(self.z0);
        if motion.physics == Physics::Hydrostatic {
            out.drags.iter_mut().for_each(|drag| (drag.load, drag.shaft_power) = Default::default());
        }
        self.sum_surfaces(condition, out);
        if condition.ground_contact == GroundContact::Dry {
            for patch in &self.contacts {
                let surface = &mut out.surfaces[patch.surface];
                if surface.wet_fraction.value() > 0.0 {
                    surface.hydrostatic += patch.lost_pressure(&plane, condition.density, &Vec3::zeros());
                }
            }
        }
        out.bed = condition.bed();
        let immersion = self.ellipsoid.immersion(condition, &plane);
        out.bed_clearance = condition.bed_clearance.unwrap_or_else(|| self.usual_clearance(immersion[0]));
        (out.hull, out.added_mass, out.far_from_bed, out.damping) = Default::default();
        if motion.physics == Physics::Full {
            // in a session in which no time has passed yet there is nothing to remember
            let memory = memory.filter(|memory| motion.time_step > 0.0 || !memory.is_empty());
            self.add_waves(condition, motion, (immersion, memory), out);
        }
    }

    /// The same with derivatives, of a session that stays as it is; `values` holds the loads of the state.
    pub fn evaluate_dual<const N: usize>(
        &self,
        condition: &Condition<Dual<N>>,
        motion: &Motion<'_>,
        (values, memory): (&BaseLoads, Option<&Memory>),
        out: &mut BaseLoads<Dual<N>>,
    ) {
        let plane = condition.water_plane(self.z0);
        let count = self.areas.len();
        out.wetting.resize(count, Wetting::default());
        out.drags.resize(count, SurfaceDrag::default());
        self.table.dual_into(&plane, &values.wetting, &mut out.wetting);
        self.drag.evaluate_dual(&plane, condition, motion.wheel_speeds, &mut out.drags);
        let mut memory = memory.map(Memory::with_slopes);
        self.combine(condition, motion, memory.as_mut(), out);
    }

    /// The same as [`Self::drag_into`] with derivatives, in water that reaches as far as `wetting` says.
    pub fn drag_dual_into<const N: usize>(
        &self,
        condition: &Condition<Dual<N>>,
        wetting: &[Wetting<Dual<N>>],
        out: &mut Vec<SurfaceDrag<Dual<N>>>,
    ) {
        out.resize(self.areas.len(), SurfaceDrag::default());
        let plane = condition.water_plane(self.z0);
        self.drag.evaluate_dual(&plane, condition, &STATED_NONE[..self.areas.len()], out);
        self.reach_into(wetting, out);
    }

    /// Drag and friction on each surface of the same hull in the same water, moving in another way, about the body origin; `of`
    /// holds the loads of the state asked for.
    pub fn drag_into(&self, condition: &Condition, of: &BaseLoads, out: &mut Vec<SurfaceDrag>) {
        out.resize(self.areas.len(), SurfaceDrag::default());
        let plane = condition.water_plane(self.z0);
        self.drag.evaluate(&plane, condition, &STATED_NONE[..self.areas.len()], out);
        self.reach_into(&of.wetting, out);
    }

    /// Leaves of each drag what a surface bears that the water reaches so far.
    fn reach_into<T: Real>(&self, wetting: &[Wetting<T>], out: &mut [SurfaceDrag<T>]) {
        for ((drag, wetting), area) in out.iter_mut().zip(wetting).zip(&self.areas) {
            drag.load = drag.load * reached(wetting, *area);
        }
    }

    fn sum_surfaces<T: Real>(&self, condition: &Condition<T>, out: &mut BaseLoads<T>) {
        let weight = condition.density * GRAVITY;
        out.surfaces.clear();
        out.shaft_power = T::zero();
        for (index, (wetting, drag)) in out.wetting.iter().zip(&out.drags).enumerate() {
            let reached = reached(wetting, self.areas[index]);
            out.shaft_power += drag.shaft_power * reached;
            out.surfaces.push(SurfaceLoad {
                hydrostatic: wetting.pressure * weight,
                drag: drag.load * reached,
                wet_fraction: (wetting.area / self.areas[index]).min(T::one()),
                center: wetting.centroid().unwrap_or_else(|| self.centers[index].map(T::from)),
            });
        }
    }

    /// Clearance of a hull of which nobody stated it [m]: it stands on the bed up to the level at which it floats, and is lifted
    /// smoothly from there.
    fn usual_clearance<T: Real>(&self, immersion: T) -> T {
        self.lifted(immersion).powi(2) * (LIFTED * self.height)
    }

    fn add_waves<T: Real>(
        &self,
        condition: &Condition<T>,
        motion: &Motion<'_>,
        ([immersion, immersion_rate], memory): ([T; 2], Option<&mut Memory<T>>),
        out: &mut BaseLoads<T>,
    ) {
        let soaked = out.wetting.iter().fold(T::zero(), |sum, wetting| sum + wetting.soaked_area);
        if soaked.value() <= 0.0 {
            if let Some(memory) = memory {
                memory.advance(&self.radiation.poles, &[Vector6::zeros(); POLES], motion.time_step);
            }
            return;
        }
        let (density, up) = (condition.density, condition.up.into_inner());
        let (v, omega) = (condition.velocity, condition.angular_velocity);
        let nu = joined(&v, &omega);
        let place = place(immersion, immersion_rate);
        let bed = self.near_bed(out.bed_clearance);
        let remembers = memory.is_some();
        // a state alone is answered at the natural frequency of heave
        let mass_of = |table: usize, row: usize| match remembers {
            true => self.rows(table)[row].mass,
            false => self.steady[table][row].mass,
        };
        let (mut far_from_bed, mut growth) = (Matrix6::zeros(), Matrix6::zeros());
        let mut bed_adds = Matrix6::zeros();
        for &(row, weight, slope) in &place.rows {
            let deep = mass_of(0, row);
            let added = mass_of(1, row) - deep;
            far_from_bed += times(&deep, weight);
            growth += (deep.map(T::from) + times(&added, bed.share)) * slope;
            bed_adds += times(&added, weight);
        }
        let mass = (far_from_bed + bed_adds * bed.share) * density;
        // entry gives momentum to the water; so does a hull that sinks toward the bed
        let closing = match condition.bed_clearance {
            Some(_) => (-up.dot(&condition.ground_velocity)).max(T::zero()),
            None => (-self.clearance_rate(immersion, immersion_rate)).max(T::zero()),
        };
        let entry = growth * place.rate.max(T::zero()) + bed_adds * (bed.closing * closing);
        // what the bed adds resists motion toward it, and turns with nothing
        out.far_from_bed = far_from_bed * density;
        let mut load = -(entry * nu) * (density * ENTRY) - cross_terms(&out.far_from_bed, &v, &omega);
        let rate = joined(
            &(condition.acceleration - omega.cross(&condition.velocity)),
            &condition.angular_acceleration,
        );
        if let Some(memory) = memory {
            let factors = self.factors(&place, bed.share);
            let push: [Vector6<T>; POLES] = std::array::from_fn(|m| factors[m].transpose() * nu);
            memory.advance(&self.radiation.poles, &push, motion.time_step);
            for (factor, [output, _]) in factors.iter().zip(&memory.waves) {
                load -= factor * output * density;
            }
            if !motion.implicit_added_mass {
                load -= mass * memory.settled(&self.rigid, &mass, rate, motion.time_step);
            }
        } else {
            let mut damping = Matrix6::zeros();
            for &(row, weight, _) in &place.rows {
                let (deep, standing) = (self.steady[0][row].damping, self.steady[1][row].damping);
                damping += (deep.map(T::from) + times(&(standing - deep), bed.share)) * weight;
            }
            // only what moves up and down or tilts makes waves in steady motion
            load -= lifted(&up, &(damping * lifted(&up, &nu))) * density;
            let (up, damping) = (up.map(Real::value), damping.map(Real::value));
            let lifted_columns = |matrix: &Matrix6<f64>| {
                Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|i| {
                    lifted(&up, &matrix.column(i).into_owned())
                }))
            };
            out.damping = lifted_columns(&lifted_columns(&damping).transpose()) * density.value();
            if !motion.implicit_added_mass {
                load -= mass * rate;
            }
        }
        out.added_mass = mass;
        out.hull = Wrench::from_column(&load);
    }

    fn rows(&self, table: usize) -> &[Node] {
        if table == 0 { &self.radiation.deep } else { &self.radiation.standing }
    }

    /// How much of what the bed adds is left at a clearance, and how that grows as it closes [-, 1/m].
    fn near_bed<T: Real>(&self, clearance: T) -> NearBed<T> {
        let x = clearance.max(T::zero()) / self.radiation.bed_reach + 1.0;
        NearBed { share: x.powi(-2), closing: x.powi(-3) * 2.0 / self.radiation.bed_reach }
    }

    /// Rate of [`Self::usual_clearance`] [m/s].
    fn clearance_rate<T: Real>(&self, immersion: T, rate: T) -> T {
        self.lifted(immersion) * (LIFTED * self.height * 2.0) * rate
    }

    /// How much deeper a hull is than afloat, over its height, up to 1.
    fn lifted<T: Real>(&self, immersion: T) -> T {
        (immersion - self.float_share).clamp(0.0, 1.0)
    }

    /// Square roots of the gains at a place.
    fn factors<T: Real>(&self, place: &Place<T>, near_bed: T) -> [Matrix6<T>; POLES] {
        std::array::from_fn(|m| {
            let mut gain = Matrix6::zeros();
            for &(row, weight, _) in &place.rows {
                let (deep, standing) =
                    (self.radiation.deep[row].gains[m], self.radiation.standing[row].gains[m]);
                gain += (deep.map(T::from) + times(&(standing - deep), near_bed)) * weight;
            }
            factor(&gain)
        })
    }
}

/// Wheel speeds of which none is stated.
pub const STATED_NONE: [f64; MAX_SURFACES] = [f64::NAN; MAX_SURFACES];

/// How much of the loads of its elements a surface bears: these know its lowest points by their spread alone.
fn reached<T: Real>(wetting: &Wetting<T>, area: f64) -> T {
    (wetting.soaked_area / (REACHED * area)).min(T::one())
}

/// Place in the table: rows with weights and slopes, and the rate of the coordinate [1/s].
struct Place<T> {
    rows: [(usize, T, T); 3],
    rate: T,
}

/// Where a hull is in the table at an immersion, and how fast it goes down there.
fn place<T: Real>(immersion: T, immersion_rate: T) -> Place<T> {
    // a row weighs most in the middle of its step
    let y = immersion.max(T::zero()) / STEP;
    let rate = immersion_rate / STEP;
    let end = NODES as f64 - 1e-9;
    let (y, rate) = if y.value() < end { (y, rate) } else { (end.into(), T::zero()) };
    let row = (y.value().floor() as usize).min(NODES - 1);
    let t = y - row as f64;
    // quadratic B-splines: weights that are never negative, sums with a continuous slope
    let last = (t * 0.5 * t, t);
    // the row before the first is dry as well, so that the slope begins at zero
    let [a, b] = match row {
        0 => [(T::zero(), T::zero()); 2],
        _ => [((-t + 1.0).powi(2) * 0.5, t - 1.0), (t + 0.5 - t * t, -(t * 2.0) + 1.0)],
    };
    let next = (row + 1).min(NODES - 1);
    let before = row.saturating_sub(1);
    Place { rows: [(before, a.0, a.1), (row, b.0, b.1), (next, last.0, last.1)], rate }
}

struct NearBed<T> {
    share: T,
    closing: T,
}

impl<T: Real> Memory<T> {
    fn is_empty(&self) -> bool {
        *self == Self { recorded: self.recorded, ..Self::default() }
    }

    /// Moves on by a time step under a push that is constant meanwhile, exactly.
    fn advance(&mut self, poles: &[Pole; POLES], push: &[Vector6<T>; POLES], dt: f64) {
        let begins_in_motion = self.recorded && !self.begun;
        self.begun = true;
        for ((pole, push), [output, integral]) in poles.iter().zip(push).zip(&mut self.waves) {
            if begins_in_motion {
                *integral = push / T::from(pole.frequency.powi(2));
            }
            let decay = pole.damping * pole.frequency;
            let swing = pole.frequency * (1.0 - pole.damping * pole.damping).sqrt();
            // q'' + 2 zeta w q' + w^2 q = u about its resting place
            let rest = push / T::from(pole.frequency.powi(2));
            let (q, p) = (*integral - rest, *output);
            let (sine, cosine) = (swing * dt).sin_cos();
            let fade = (-decay * dt).exp();
            let s = sine / swing;
            let [q_stays, p_adds] = [cosine + decay * s, s].map(T::from);
            let [p_stays, q_adds] = [cosine - decay * s, pole.frequency.powi(2) * s].map(T::from);
            *integral = rest + (q * q_stays + p * p_adds) * T::from(fade);
            *output = (p * p_stays - q * q_adds) * T::from(fade);
        }
    }

    /// The acceleration that the added mass resists in explicit integration, stable whatever the added mass:
    /// `(M + A) a = M a_measured + A a_before`, which is the true one where the body followed the load of before.
    fn settled(
        &mut self,
        rigid: &Matrix6<f64>,
        added: &Matrix6<T>,
        measured: Vector6<T>,
        dt: f64,
    ) -> Vector6<T> {
        if self.recorded {
            return measured;
        }
        let before = self.rate.unwrap_or(measured);
        if dt > 0.0 || self.rate.is_none() {
            let rigid = rigid.map(T::from);
            self.rate = Some(solved(&(rigid + added), rigid * measured + added * before));
        }
        self.rate.unwrap_or(measured)
    }
}

fn steady(radiation: &Radiation) -> [Vec<Steady>; 2] {
    let responses = radiation.poles.map(|pole| pole.response(radiation.frequency));
    let sum = |row: &Node, part: usize| {
        let terms = row.gains.iter().zip(&responses).map(|(gain, response)| gain * response[part]);
        terms.fold(Matrix6::zeros(), |sum, term| sum + term)
    };
    let tables = [&radiation.deep, &radiation.standing];
    let masses = tables.map(|rows| rows.iter().map(|row| row.mass + sum(row, 0)).collect());
    let [deep, standing] = super::radiation::rising(masses);
    let joined = |masses: Vec<Matrix6<f64>>, rows: &[Node]| {
        masses.into_iter().zip(rows).map(|(mass, row)| Steady { mass, damping: sum(row, 1) }).collect()
    };
    [joined(deep, &radiation.deep), joined(standing, &radiation.standing)]
}

/// Mass and inertia of the vehicle about the body origin, forces first.
fn rigid_mass(vehicle: &Vehicle) -> Matrix6<f64> {
    let arm = vehicle.center_of_mass.cross_matrix();
    let mut matrix = Matrix6::identity() * vehicle.mass;
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&(arm * -vehicle.mass));
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&(arm * vehicle.mass));
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&(vehicle.inertia - arm * arm * vehicle.mass));
    matrix
}

/// Kirchhoff's `C_A(nu) nu`: momentum that turns with the body.
fn cross_terms<T: Real>(mass: &Matrix6<T>, v: &Vector3<T>, omega: &Vector3<T>) -> Vector6<T> {
    let momentum = mass * joined(v, omega);
    let linear = momentum.fixed_rows::<3>(0).into_owned();
    let angular = momentum.fixed_rows::<3>(3).into_owned();
    joined(&omega.cross(&linear), &(omega.cross(&angular) + v.cross(&linear)))
}

fn joined<T: Real>(linear: &Vector3<T>, angular: &Vector3<T>) -> Vector6<T> {
    Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
}

/// The part of a motion, or of a load, that is up and down or about horizontal axes.
fn lifted<T: Real>(up: &Vector3<T>, of: &Vector6<T>) -> Vector6<T> {
    let (linear, angular) = (of.fixed_rows::<3>(0).into_owned(), of.fixed_rows::<3>(3).into_owned());
    joined(&(up * up.dot(&linear)), &(angular - up * up.dot(&angular)))
}

/// A matrix by a factor.
fn times<T: Real>(matrix: &Matrix6<f64>, factor: T) -> Matrix6<T> {
    matrix.map(|x| factor * x)
}

/// A lower triangle `L` with `L L^T` the matrix, which is not negative; rows without size are zero.
fn factor<T: Real>(matrix: &Matrix6<T>) -> Matrix6<T> {
    let mut lower = Matrix6::zeros();
    for column in 0..6 {
        let square = (0..column).fold(T::zero(), |sum, k| sum + lower[(column, k)] * lower[(column, k)]);
        let pivot = matrix[(column, column)] - square;
        if pivot.value() <= 1e-12 * matrix[(column, column)].value().abs() || pivot.value() <= 0.0 {
            continue;
        }
        let pivot = pivot.sqrt();
        lower[(column, column)] = pivot;
        for row in column + 1..6 {
            let dot = (0..column).fold(T::zero(), |sum, k| sum + lower[(row, k)] * lower[(column, k)]);
            lower[(row, column)] = (matrix[(row, column)] - dot) / pivot;
        }
    }
    lower
}

/// `x` of `matrix x = right`, of a symmetric and positive matrix.
fn solved<T: Real>(matrix: &Matrix6<T>, right: Vector6<T>) -> Vector6<T> {
    let lower = factor(matrix);
    let mut x = right;
    for row in 0..6 {
        let known = (0..row).fold(T::zero(), |sum, k| sum + lower[(row, k)] * x[k]);
        x[row] = (x[row] - known) / lower[(row, row)];
    }
    for row in (0..6).rev() {
        let known = (row + 1..6).fold(T::zero(), |sum, k| sum + lower[(k, row)] * x[k]);
        x[row] = (x[row] - known) / lower[(row, row)];
    }
    x
}
