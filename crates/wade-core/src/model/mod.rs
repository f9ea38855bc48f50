//! A vehicle with its weights: condition in, forces out.

pub mod kernel;
pub mod network;
mod reference;
mod weights;

pub use weights::{Anchored, Form, Paper, SPREAD, Weights};

use crate::anchor::{self, Anchor, Reading};
use crate::condition::{Condition, GroundContact};
use crate::domain::{Domain, Quantity};
use crate::features;
use crate::forces::{Forces, SurfaceForce};
use crate::frame::Vec3;
use crate::vehicle::{MAX_SURFACES, Vehicle};
use kernel::{Buffers, Isa, Kernel, MAX_DYNAMIC, MAX_OUTPUTS, StaticRows, WetSurface};

/// Working memory of [`Model::evaluate`], good for every vehicle.
#[derive(Debug, Clone)]
pub struct Workspace {
    buffers: Buffers,
    wet: Vec<WetSurface>,
    reading: Reading,
}

impl Workspace {
    /// Allocates for the largest vehicle.
    pub fn new() -> Self {
        Self {
            buffers: Buffers::new(MAX_SURFACES),
            wet: Vec::with_capacity(MAX_SURFACES),
            reading: Reading::with_capacity(MAX_SURFACES),
        }
    }
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}

/// One version of a vehicle's bundle, ready to answer.
#[derive(Debug)]
pub struct Model {
    vehicle: Vehicle,
    version: u32,
    domain: Domain,
    weights: Weights,
    kernel: Kernel,
    statics: StaticRows,
    /// What is known of the vehicle before anything is learnt, where the weights build on it.
    anchor: Option<Anchor>,
    /// How much of the learnt part of each surface counts at most: nothing of one that no case wetted.
    learnt: Vec<f64>,
}

impl Model {
    /// Packs the weights for an instruction set and precomputes what the vehicle contributes to layer 1.
    pub fn new(vehicle: Vehicle, version: u32, domain: Domain, weights: Weights, isa: Isa) -> Self {
        let network = &weights.network;
        let (kernel, statics, anchor, learnt) = match &weights.form {
            Form::Paper(_) => {
                let kernel = Kernel::new(network, (features::STATIC, features::DYNAMIC), isa);
                let fixed =
                    |surface| features::surface_static(surface, &vehicle.dimensions).map(|x| x as f32);
                let statics = kernel.static_rows(&vehicle.surfaces.iter().map(fixed).collect::<Vec<_>>());
                (kernel, statics, None, Vec::new())
            }
            Form::Anchored(form) => {
                let kernel = Kernel::new(network, (anchor::STATIC, anchor::DYNAMIC), isa);
                let anchor = Anchor::new(&vehicle);
                let statics = kernel.static_rows(&anchor.static_rows(&vehicle));
                let learnt = form.learnt(&anchor, &vehicle);
                (kernel, statics, Some(anchor), learnt)
            }
        };
        Self { vehicle, version, domain, weights, kernel, statics, anchor, learnt }
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

    /// The weights as they were stored.
    pub fn weights(&self) -> &Weights {
        &self.weights
    }

    /// Source of the training data.
    pub fn provenance(&self) -> &str {
        &self.weights.provenance
    }

    /// Name of the instruction set in use.
    pub fn isa(&self) -> Isa {
        self.kernel.isa()
    }

    /// Forces on every surface and the net wrench about the center of mass, body frame.
    ///
    /// Allocates nothing once `forces` has held this many surfaces. Angular rates and accelerations do not enter. A state
    /// with angular rates is marked as outside the training domain; accelerations are not judged.
    pub fn evaluate(&self, condition: &Condition, workspace: &mut Workspace, forces: &mut Forces) {
        forces.outside = self.domain.outside(condition);
        match (&self.weights.form, &self.anchor) {
            (Form::Anchored(form), Some(anchor)) => {
                self.evaluate_anchored((form, anchor), condition, workspace, forces);
            }
            (Form::Paper(form), _) => self.evaluate_paper(form, condition, workspace, forces),
            (Form::Anchored(_), None) => unreachable!("made together by `new`"),
        }
        forces.sum_about(&self.vehicle.center_of_mass);
    }

    fn evaluate_paper(
        &self,
        form: &Paper,
        condition: &Condition,
        workspace: &mut Workspace,
        forces: &mut Forces,
    ) {
        self.immerse(condition, workspace, forces);
        let global = form.scaling.standardize(&features::global(condition, &self.vehicle.dimensions));
        let outputs = self.kernel.forward(&global, &self.statics, &workspace.wet, &mut workspace.buffers);
        for (surface, [x, y, z, ..]) in workspace.wet.iter().zip(outputs) {
            let force = Vec3::from(form.scaling.target([*x, *y, *z])) * condition.density;
            forces.surfaces[surface.surface].force = force;
        }
        self.convert_ground_contact(form, condition, forces);
        forces.uncertainty = Vec3::from(form.held_out_rms) * condition.density;
    }

    /// Hydrostatics and simple drag, and the network's remainder as far as the state is near those that it learnt from and the
    /// surface was in the water there.
    fn evaluate_anchored(
        &self,
        (form, anchor): (&Anchored, &Anchor),
        condition: &Condition,
        workspace: &mut Workspace,
        forces: &mut Forces,
    ) {
        let Workspace { buffers, wet, reading } = workspace;
        anchor.read(&self.vehicle, condition, reading);
        let distance = form.distance(&reading.coordinates);
        forces.outside.excess[Quantity::Distance as usize - 1] = (distance - 1.0).max(0.0);
        let trust = Anchored::trust(distance);
        wet.clear();
        forces.surfaces.clear();
        for (index, surface) in reading.surfaces.iter().enumerate() {
            forces.surfaces.push(SurfaceForce { point: surface.center, ..SurfaceForce::default() });
            if surface.wet_fraction > 0.0 {
                wet.push(WetSurface { surface: index, dynamic: surface.dynamic });
            }
        }
        let global = form.standardize(&reading.global);
        let outputs = self.kernel.forward(&global, &self.statics, wet, buffers);
        let (mut doubtful, mut spread) = (Vec3::zeros(), 0.0);
        for (WetSurface { surface, .. }, output) in wet.iter().zip(outputs) {
            let (known, learnt) = (&reading.surfaces[*surface], self.learnt[*surface]);
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

// the buffers of the kernel hold what the anchored network is told and what it answers
const _: () = assert!(anchor::DYNAMIC == MAX_DYNAMIC && SPREAD < MAX_OUTPUTS);
