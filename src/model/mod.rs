//! A vehicle with its weights: condition in, forces out.

pub mod kernel;
pub mod network;
mod reference;

use crate::condition::{Condition, GroundContact};
use crate::domain::Domain;
use crate::features;
use crate::forces::{Forces, SurfaceForce};
use crate::frame::Vec3;
use crate::vehicle::{MAX_SURFACES, Vehicle};
use kernel::{Buffers, Isa, Kernel, StaticRows, WetSurface};
use network::{Network, OUTPUTS, Scaling};

/// What the weights are and where they come from.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// Layers.
    pub network: Network,
    /// Standardisation of inputs and targets.
    pub scaling: Scaling,
    /// Source of the training data, such as `analytic`.
    pub provenance: String,
    /// Convention of the training data for the contact patches, which the weights have baked in.
    pub ground_contact: GroundContact,
    /// Root mean square of the error of the net force over density on held-out cases of this vehicle [m4/s2].
    pub held_out_rms: [f64; OUTPUTS],
}

/// Working memory of [`Model::evaluate`], good for every vehicle.
#[derive(Debug, Clone)]
pub struct Workspace {
    buffers: Buffers,
    wet: Vec<WetSurface>,
}

impl Workspace {
    /// Allocates for the largest vehicle.
    pub fn new() -> Self {
        Self { buffers: Buffers::new(MAX_SURFACES), wet: Vec::with_capacity(MAX_SURFACES) }
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
}

impl Model {
    /// Packs the weights for an instruction set and precomputes what the vehicle contributes to layer 1.
    pub fn new(vehicle: Vehicle, version: u32, domain: Domain, weights: Weights, isa: Isa) -> Self {
        let kernel = Kernel::new(&weights.network, isa);
        let statics: Vec<_> = vehicle
            .surfaces
            .iter()
            .map(|surface| features::surface_static(surface, &vehicle.dimensions).map(|x| x as f32))
            .collect();
        let statics = kernel.static_rows(&statics);
        Self { vehicle, version, domain, weights, kernel, statics }
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

    /// Name of the instruction set in use.
    pub fn isa(&self) -> Isa {
        self.kernel.isa()
    }

    /// Forces on every surface and the net wrench about the center of mass, body frame.
    ///
    /// Allocates nothing once `forces` has held this many surfaces. Angular rates and accelerations do not enter the
    /// paper's network. A state with angular rates is marked as outside the training domain; accelerations are not judged.
    pub fn evaluate(&self, condition: &Condition, workspace: &mut Workspace, forces: &mut Forces) {
        forces.outside = self.domain.outside(condition);
        self.immerse(condition, workspace, forces);
        let global = features::global(condition, &self.vehicle.dimensions);
        let global = self.weights.scaling.standardize(&global);
        let outputs = self.kernel.forward(&global, &self.statics, &workspace.wet, &mut workspace.buffers);
        for (surface, output) in workspace.wet.iter().zip(outputs) {
            let force = Vec3::from(self.weights.scaling.target(*output)) * condition.density;
            forces.surfaces[surface.surface].force = force;
        }
        self.convert_ground_contact(condition, forces);
        forces.sum_about(&self.vehicle.center_of_mass);
        forces.uncertainty = Vec3::from(self.weights.held_out_rms) * condition.density;
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
                let dynamic = features::surface_dynamic(surface, &wet, &direction, &self.vehicle.dimensions)
                    .map(|x| x as f32);
                workspace.wet.push(WetSurface { surface: index, dynamic });
            }
            forces.surfaces.push(load);
        }
    }

    /// Adds or takes away the water pressure under the contact patches where the question's convention is not that of
    /// the weights.
    fn convert_ground_contact(&self, condition: &Condition, forces: &mut Forces) {
        if condition.ground_contact == self.weights.ground_contact {
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
