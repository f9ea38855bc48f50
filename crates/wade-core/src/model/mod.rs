//! A vehicle with what is known of its loads: condition in, forces out.
//!
//! There are three kinds. Weights alone, as the paper has them or anchored to a simple drag. The physical base alone
//! ([`crate::physics`]). And the base with anchored weights: near the cases that these were trained on the answer is theirs, far from
//! them it is the base's, and `Blend` keeps the sum from ever putting power into the hull.

mod blend;
mod jacobian;
pub mod kernel;
pub mod network;
mod reference;
mod weights;

pub(crate) use jacobian::stepped;
pub use jacobian::{COLUMNS, Jacobian, JacobianWorkspace};
pub use weights::{Anchored, Form, Paper, SPREAD, Weights};

use crate::anchor::{self, Anchor, Reading};
use crate::condition::{Condition, GroundContact};
use crate::domain::{Domain, Quantity};
use crate::features;
use crate::forces::{Forces, SurfaceForce};
use crate::frame::Vec3;
use crate::physics::drag::SurfaceDrag;
use crate::physics::{Base, BaseLoads, Memory, Motion, Physics, STATED_NONE};
use crate::sea::{Sea, Waters};
use crate::vehicle::{Dimensions, MAX_SURFACES, PerWheel, Vehicle};
use blend::Blend;
use kernel::{Buffers, Isa, Kernel, MAX_DYNAMIC, MAX_OUTPUTS, StaticRows, WetSurface};

/// Working memory of [`Model::evaluate`], good for every vehicle.
#[derive(Debug, Clone)]
pub struct Workspace {
    buffers: Buffers,
    wet: Vec<WetSurface>,
    reading: Reading,
    base: BaseLoads,
    level_drag: Vec<SurfaceDrag>,
}

impl Workspace {
    /// Allocates for the largest vehicle.
    pub fn new() -> Self {
        Self {
            buffers: Buffers::new(MAX_SURFACES),
            wet: Vec::with_capacity(MAX_SURFACES),
            reading: Reading::with_capacity(MAX_SURFACES),
            base: BaseLoads::with_capacity(MAX_SURFACES),
            level_drag: Vec::with_capacity(MAX_SURFACES),
        }
    }
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}

/// What weights that learned nothing are labelled as.
pub const PHYSICS: &str = "physics";

/// One version of a vehicle's bundle, ready to answer.
#[derive(Debug)]
pub struct Model {
    vehicle: Vehicle,
    /// Surfaces of the wheels in the order of their speeds.
    wheels: Vec<usize>,
    version: u32,
    domain: Domain,
    learned: Option<Learned>,
    base: Option<Base>,
}

/// The learned part, packed for an instruction set.
#[derive(Debug)]
struct Learned {
    weights: Weights,
    kernel: Kernel,
    statics: StaticRows,
    /// What is known of the vehicle before anything is learned, where the weights build on it.
    anchor: Option<Anchor>,
    /// How much of the learned part of each surface counts at most: nothing of one that no case wetted.
    coverage: Vec<f64>,
}

impl Learned {
    fn new(vehicle: &Vehicle, weights: Weights, isa: Isa) -> Self {
        let network = &weights.network;
        let (kernel, statics, anchor, coverage) = match &weights.form {
            Form::Paper(_) => {
                let kernel = Kernel::new(network, (features::STATIC, features::DYNAMIC), isa);
                let fixed =
                    |surface| features::surface_static(surface, &vehicle.dimensions).map(|x| x as f32);
                let statics = kernel.static_rows(&vehicle.surfaces.iter().map(fixed).collect::<Vec<_>>());
                (kernel, statics, None, Vec::new())
            }
            Form::Anchored(form) => {
                let kernel = Kernel::new(network, (anchor::STATIC, anchor::DYNAMIC), isa);
                let anchor = Anchor::new(vehicle, form.remainder);
                let statics = kernel.static_rows(&anchor.static_rows(vehicle));
                let coverage = form.learnt(&anchor, vehicle);
                (kernel, statics, Some(anchor), coverage)
            }
        };
        Self { weights, kernel, statics, anchor, coverage }
    }

    /// What the network says of the wet surfaces of a reading, which are listed in `wet`.
    fn answer<'b>(
        &self,
        form: &Anchored,
        (reading, wet, buffers): (&Reading, &mut Vec<WetSurface>, &'b mut Buffers),
    ) -> &'b [[f32; MAX_OUTPUTS]] {
        wet.clear();
        for (index, surface) in reading.surfaces.iter().enumerate() {
            if surface.wet_fraction > 0.0 {
                wet.push(WetSurface { surface: index, dynamic: surface.told() });
            }
        }
        let global = &form.standardize(&reading.global)[..form.remainder.global_names().len()];
        self.kernel.forward(global, &self.statics, wet, buffers)
    }
}

impl Model {
    /// Packs the weights for an instruction set and precomputes what the vehicle contributes to layer 1.
    pub fn new(vehicle: Vehicle, version: u32, domain: Domain, weights: Weights, isa: Isa) -> Self {
        let learned = Some(Learned::new(&vehicle, weights, isa));
        Self { wheels: vehicle.wheels(), vehicle, version, domain, learned, base: None }
    }

    /// A vehicle of which nothing was learned.
    pub fn of_physics(vehicle: Vehicle, version: u32, base: Base) -> Self {
        let (wheels, domain) = (vehicle.wheels(), Domain::EVERYWHERE);
        Self { vehicle, wheels, version, domain, learned: None, base: Some(base) }
    }

    /// The same weights on the physical base.
    pub fn with_base(self, base: Base) -> Self {
        Self { base: Some(base), ..self }
    }

    /// What the answer rests on besides weights, in words.
    pub fn base_name(&self) -> &'static str {
        match (&self.base, self.weights().map(|weights| &weights.form)) {
            (Some(_), _) => PHYSICS,
            (None, Some(Form::Anchored(form))) => form.remainder.name(),
            (None, _) => "none",
        }
    }

    /// The physical base, where the bundle has one.
    pub fn base(&self) -> Option<&Base> {
        self.base.as_ref()
    }

    /// The vehicle.
    pub fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    /// Version of the bundle.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// Training domain of the weights.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The weights as they were stored, where there are any.
    pub fn weights(&self) -> Option<&Weights> {
        self.learned.as_ref().map(|learned| &learned.weights)
    }

    /// Source of the training data, or [`PHYSICS`].
    pub fn provenance(&self) -> &str {
        self.weights().map_or(PHYSICS, |weights| &weights.provenance)
    }

    /// Surfaces of the wheels in the order in which their speeds are stated, see [`Vehicle::wheels`].
    pub fn wheels(&self) -> &[usize] {
        &self.wheels
    }

    /// Speed of each surface that is a wheel, NaN where none is stated [rad/s]. Speeds of another number of wheels are not stated.
    pub fn wheel_speeds(&self, stated: Option<&PerWheel<f64>>) -> [f64; MAX_SURFACES] {
        let mut speeds = STATED_NONE;
        if let Some(stated) = stated.filter(|stated| stated.len() == self.wheels.len()) {
            self.wheels.iter().zip(stated.iter()).for_each(|(&surface, &speed)| speeds[surface] = speed);
        }
        speeds
    }

    /// A state in a sea as one in the plane and the flow that stand for it, and what the sea is beside them; none of a model
    /// without the physical base, which knows still water alone.
    pub fn in_sea(&self, condition: &Condition, sea: &Sea) -> Option<(Condition, Waters)> {
        self.base.as_ref().map(|base| base.in_sea(condition, sea, &self.wheels))
    }

    /// The instruction set in use, where there is a network.
    pub fn isa(&self) -> Option<Isa> {
        self.learned.as_ref().map(|learned| learned.kernel.isa())
    }

    /// Forces on every surface and the net wrench about the center of mass, body frame, of a state that stands alone.
    ///
    /// Allocates nothing once `forces` has held this many surfaces. Without the physical base angular rates and accelerations
    /// do not enter; a state with angular rates is then marked as outside the training domain.
    pub fn evaluate(&self, condition: &Condition, workspace: &mut Workspace, forces: &mut Forces) {
        self.evaluate_moving(condition, (&Motion::ALONE, None), workspace, forces);
    }

    /// The same with the wheels, and with what a session remembers.
    pub fn evaluate_moving(
        &self,
        condition: &Condition,
        (motion, memory): (&Motion<'_>, Option<&mut Memory>),
        workspace: &mut Workspace,
        forces: &mut Forces,
    ) {
        let condition = &condition.resolved(self.vehicle.z0);
        forces.outside = self.domain.outside(condition);
        forces.base = None;
        match (&self.base, &self.learned) {
            (Some(base), learned) => {
                let Workspace { buffers, wet, reading, base: loads, level_drag } = workspace;
                base.evaluate(condition, motion, memory, loads);
                let mut blend = Blend::new(condition, loads, forces);
                if let Some(learned) = learned.as_ref().filter(|_| motion.physics != Physics::Hydrostatic)
                    && let (Form::Anchored(form), Some(anchor)) = (&learned.weights.form, &learned.anchor)
                {
                    // learned from hulls that neither rise nor turn
                    let level = condition.levelled(loads.bed_clearance);
                    base.drag_into(&level, loads, level_drag);
                    // it stands in the same water
                    loads.wetting_into(|x| x, reading.wetting_mut());
                    anchor.read_wet(&self.vehicle, &level, reading);
                    let outputs = learned.answer(form, (reading, wet, buffers));
                    blend.add(
                        (learned, form, reading),
                        (wet, outputs),
                        (&level.velocity, level_drag),
                        forces,
                    );
                }
                blend.finish(&self.vehicle, forces);
            }
            (None, Some(learned)) => self.evaluate_learned(learned, condition, workspace, forces),
            (None, None) => unreachable!("a model has weights or a base"),
        }
    }

    fn evaluate_learned(
        &self,
        learned: &Learned,
        condition: &Condition,
        workspace: &mut Workspace,
        forces: &mut Forces,
    ) {
        match (&learned.weights.form, &learned.anchor) {
            (Form::Anchored(form), Some(anchor)) => {
                self.evaluate_anchored((learned, form, anchor), condition, workspace, forces);
            }
            (Form::Paper(form), _) => self.evaluate_paper((learned, form), condition, workspace, forces),
            (Form::Anchored(_), None) => unreachable!("made together by `new`"),
        }
        forces.sum_about(&self.vehicle.center_of_mass);
        forces.moment_uncertainty = moment_deviation(&forces.uncertainty, &self.vehicle.dimensions);
    }

    fn evaluate_paper(
        &self,
        (learned, form): (&Learned, &Paper),
        condition: &Condition,
        workspace: &mut Workspace,
        forces: &mut Forces,
    ) {
        self.immerse(condition, workspace, forces);
        let global = form.scaling.standardize(&features::global(condition, &self.vehicle.dimensions));
        let Workspace { buffers, wet, .. } = workspace;
        let outputs = learned.kernel.forward(&global, &learned.statics, wet, buffers);
        for (surface, [x, y, z, ..]) in wet.iter().zip(outputs) {
            let force = Vec3::from(form.scaling.target([*x, *y, *z])) * condition.density;
            forces.surfaces[surface.surface].force = force;
        }
        self.convert_ground_contact(form, condition, forces);
        forces.uncertainty = Vec3::from(form.held_out_rms) * condition.density;
    }

    /// Hydrostatics and simple drag, and the network's remainder as far as the state is near those that it was trained on and the
    /// surface was in the water there.
    fn evaluate_anchored(
        &self,
        (learned, form, anchor): (&Learned, &Anchored, &Anchor),
        condition: &Condition,
        workspace: &mut Workspace,
        forces: &mut Forces,
    ) {
        let Workspace { buffers, wet, reading, .. } = workspace;
        anchor.read(&self.vehicle, condition, reading);
        let distance = form.distance(reading);
        forces.outside.excess[Quantity::Distance as usize - 1] = (distance - 1.0).max(0.0);
        let trust = Anchored::trust(distance);
        forces.surfaces.clear();
        for surface in &reading.surfaces {
            forces.surfaces.push(SurfaceForce { point: surface.center, ..SurfaceForce::default() });
        }
        let outputs = learned.answer(form, (reading, wet, buffers));
        let (mut doubtful, mut spread) = (Vec3::zeros(), 0.0);
        for (WetSurface { surface, .. }, output) in wet.iter().zip(outputs) {
            let (known, learnt) = (&reading.surfaces[*surface], learned.coverage[*surface]);
            forces.surfaces[*surface] = known.load(&faded(output, trust * learnt));
            let doubt = Anchored::doubt(distance).max(1.0 - learnt);
            doubtful += (known.force(&faded(output, 1.0)) - known.drag).abs() * doubt;
            spread += known.unit * Anchored::softplus(output[SPREAD]);
        }
        let stated = Vec3::from(form.spread.map(f64::from)) * spread;
        forces.uncertainty = stated + doubtful;
    }

    /// Fills in where the water reaches and lists the wet surfaces with their features.
    fn immerse(&self, condition: &Condition, workspace: &mut Workspace, forces: &mut Forces) {
        let plane = condition.water_plane(self.vehicle.z0);
        let direction = features::direction(&condition.velocity);
        workspace.wet.clear();
        forces.surfaces.clear();
        for (index, surface) in self.vehicle.surfaces.iter().enumerate() {
            let wet = self.vehicle.samples.surfaces[index].submergence(&plane);
            let mut load = SurfaceForce { point: surface.centroid, ..SurfaceForce::default() };
            if wet.fraction > 0.0 {
                load.point = wet.wet_centroid;
                load.wetted_fraction = wet.fraction;
                let told = features::surface_dynamic(surface, &wet, &direction, &self.vehicle.dimensions);
                let mut dynamic = [0.0; MAX_DYNAMIC];
                dynamic.iter_mut().zip(told).for_each(|(room, x)| *room = x as f32);
                workspace.wet.push(WetSurface { surface: index, dynamic });
            }
            forces.surfaces.push(load);
        }
    }

    /// Adds or takes away the water pressure under the contact patches where the question's convention is not that of
    /// the weights.
    fn convert_ground_contact(&self, form: &Paper, condition: &Condition, forces: &mut Forces) {
        if condition.ground_contact == form.ground_contact {
            return;
        }
        let sign = if condition.ground_contact == GroundContact::Wetted { 1.0 } else { -1.0 };
        let plane = condition.water_plane(self.vehicle.z0);
        for patch in &self.vehicle.contacts {
            if forces.surfaces[patch.surface].wetted_fraction == 0.0 {
                continue;
            }
            let lost = patch.lost_pressure(&plane, condition.density, &patch.center).force;
            forces.surfaces[patch.surface].force -= lost * sign;
        }
    }
}

/// The answers that mean forces and their place, as far as they are trusted.
fn faded(output: &[f32; MAX_OUTPUTS], trust: f64) -> [f32; anchor::OUTPUTS] {
    std::array::from_fn(|i| output[i] * trust as f32)
}

/// Deviation of a moment whose forces have this one: their errors act a quarter of the hull from its middle, along each axis.
fn moment_deviation(force: &Vec3, dimensions: &Dimensions) -> Vec3 {
    let arm = Vec3::new(dimensions.length, dimensions.width, dimensions.height) * 0.25;
    Vec3::new(
        (force.y * arm.z).hypot(force.z * arm.y),
        (force.x * arm.z).hypot(force.z * arm.x),
        (force.x * arm.y).hypot(force.y * arm.x),
    )
}

// the buffers of the kernel hold what the anchored network is told and what it answers
const _: () = assert!(anchor::DYNAMIC == MAX_DYNAMIC && SPREAD < MAX_OUTPUTS);
