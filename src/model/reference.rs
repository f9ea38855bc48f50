//! The answer by plain loops over whole rows of features: slow, obvious, and what the fast path is tested against.

use super::Model;
use crate::condition::Condition;
use crate::features::{self, INPUTS, STATIC};
use crate::frame::Vec3;
use crate::geometry::submergence::Submergence;
use crate::vehicle::Surface;

impl Model {
    /// Force on each surface, body frame [N], in the ground-contact convention of the weights.
    pub fn reference(&self, condition: &Condition) -> Vec<Vec3> {
        let plane = condition.water_plane(self.vehicle.z0);
        let surfaces = self.vehicle.surfaces.iter().zip(&self.vehicle.samples.surfaces);
        let force = surfaces.map(|(surface, samples)| {
            let wet = samples.submergence(&plane);
            if wet.fraction == 0.0 {
                return Vec3::zeros();
            }
            let output = self.weights.network.forward(&self.row(condition, surface, &wet));
            Vec3::from(self.weights.scaling.target(output)) * condition.density
        });
        force.collect()
    }

    /// A surface's row of inputs: its 15 features, then the 12 global ones, standardised.
    fn row(&self, condition: &Condition, surface: &Surface, wet: &Submergence) -> [f32; INPUTS] {
        let dimensions = &self.vehicle.dimensions;
        let direction = features::direction(&condition.velocity);
        let fixed = features::surface_static(surface, dimensions).map(|x| x as f32);
        let dynamic = features::surface_dynamic(surface, wet, &direction, dimensions).map(|x| x as f32);
        let global = self.weights.scaling.standardize(&features::global(condition, dimensions));
        let mut row = [0.0; INPUTS];
        let (of_surface, of_all) = row.split_at_mut(STATIC + dynamic.len());
        of_surface[..STATIC].copy_from_slice(&fixed);
        of_surface[STATIC..].copy_from_slice(&dynamic);
        of_all.copy_from_slice(&global);
        row
    }
}
