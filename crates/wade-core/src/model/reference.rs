//! The answer by plain loops over whole rows of features: slow, obvious, and what the fast path is tested against.

use super::{Anchored, Form, Learned, Model, Paper};
use crate::anchor::{self, Anchor, Reading, Remainder};
use crate::condition::Condition;
use crate::features::{self, STATIC};
use crate::frame::Vec3;
use crate::geometry::submergence::Submergence;
use crate::physics::drag::SurfaceDrag;
use crate::physics::{BaseLoads, Motion};
use crate::vehicle::Surface;

impl Model {
    /// Force on each surface by the weights alone, body frame [N]; by weights that have a ground-contact convention baked in,
    /// in that one. Empty without weights.
    pub fn reference(&self, condition: &Condition) -> Vec<Vec3> {
        let Some(learned) = &self.learned else { return Vec::new() };
        match &learned.weights.form {
            Form::Paper(form) => self.reference_paper((learned, form), condition),
            Form::Anchored(form) => self.reference_anchored((learned, form), condition),
        }
    }

    fn reference_paper(&self, (learned, form): (&Learned, &Paper), condition: &Condition) -> Vec<Vec3> {
        let plane = condition.water_plane(self.vehicle.z0);
        let surfaces = self.vehicle.surfaces.iter().zip(&self.vehicle.samples.surfaces);
        let force = surfaces.map(|(surface, samples)| {
            let wet = samples.submergence(&plane);
            if wet.fraction == 0.0 {
                return Vec3::zeros();
            }
            let output = learned.weights.network.forward(&self.row(form, condition, surface, &wet));
            Vec3::from(form.scaling.target(std::array::from_fn(|c| output[c]))) * condition.density
        });
        force.collect()
    }

    /// A surface's row of inputs: its 15 features, then the 12 global ones, standardised.
    fn row(&self, form: &Paper, condition: &Condition, surface: &Surface, wet: &Submergence) -> Vec<f32> {
        let dimensions = &self.vehicle.dimensions;
        let direction = features::direction(&condition.velocity);
        let fixed: [f64; STATIC] = features::surface_static(surface, dimensions);
        let dynamic = features::surface_dynamic(surface, wet, &direction, dimensions);
        let of_surface = fixed.into_iter().chain(dynamic).map(|x| x as f32);
        of_surface.chain(form.scaling.standardize(&features::global(condition, dimensions))).collect()
    }

    fn reference_anchored(&self, (learned, form): (&Learned, &Anchored), condition: &Condition) -> Vec<Vec3> {
        let anchor = Anchor::new(&self.vehicle, form.remainder);
        let (condition, drag) = self.known_drag(form.remainder, condition);
        let mut reading = Reading::default();
        anchor.read(&self.vehicle, &condition, &mut reading);
        let trust = Anchored::trust(form.distance(&reading));
        let global = form.standardize(&reading.global);
        let global = &global[..form.remainder.global_names().len()];
        let surfaces = reading.surfaces.iter().zip(anchor.static_rows(&self.vehicle)).zip(&learned.coverage);
        let force = surfaces.zip(drag).map(|(((known, fixed), learnt), drag)| {
            if known.wet_fraction == 0.0 {
                return drag;
            }
            let of_surface = fixed.into_iter().chain(known.told());
            let row: Vec<f32> = of_surface.chain(global.iter().copied()).collect();
            let output = learned.weights.network.forward(&row);
            let answer: [f32; anchor::OUTPUTS] = std::array::from_fn(|i| output[i] * (trust * learnt) as f32);
            known.hydrostatic.force + drag + known.force(&answer)
        });
        force.collect()
    }

    /// The state as weights read it, and the drag of each surface that they do not answer [N].
    fn known_drag(&self, remainder: Remainder, condition: &Condition) -> (Condition, Vec<Vec3>) {
        let mut drags = vec![SurfaceDrag::default(); self.vehicle.surfaces.len()];
        let Some(base) = self.base.as_ref().filter(|_| remainder == Remainder::OfPhysics) else {
            return (*condition, vec![Vec3::zeros(); drags.len()]);
        };
        let mut loads = BaseLoads::default();
        base.evaluate(condition, &Motion::QUASI_STEADY, None, &mut loads);
        let level = condition.levelled(loads.bed_clearance);
        base.drag_into(&level, &loads, &mut drags);
        (level, drags.into_iter().map(|drag| drag.load.force).collect())
    }
}
