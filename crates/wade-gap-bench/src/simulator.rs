//! The prediction that the hidden effects are missing from.

use super::track::DENSITY;
use super::{Hull, State, Wrench6};
use wade_core::frame::Vec3;

/// Drag coefficients of the box on its wet front and side: a blunt body's, chosen.
pub(super) const DRAG: [f64; 2] = [1.2, 1.5];

/// Where the prediction comes from.
#[derive(Clone, Copy)]
pub enum Prediction<'a> {
    /// Hydrostatics of the hull's columns and drag that grows with the square of the speed.
    Analytic,
    /// A model, such as a shipped vehicle's.
    Model(&'a Model<'a>),
}

/// A model's answers to the samples of a run, in which it may remember those before.
pub type Model<'a> = dyn Fn(&[Asked]) -> Vec<Modeled> + 'a;

/// A sample that a model is asked about.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asked {
    /// The state, whose velocity over ground is that of the vehicle.
    pub state: State,
    /// Velocity through the water, body frame [m/s].
    pub through_water: Vec3,
}

/// A model's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Modeled {
    /// Wrench about the center of mass.
    pub wrench: Wrench6,
    /// The standard deviation that the model states.
    pub deviation: Wrench6,
}

/// A body and what is predicted for it.
#[derive(Clone, Copy)]
pub struct Simulator<'a> {
    /// The body.
    pub hull: &'a Hull,
    /// The prediction.
    pub prediction: Prediction<'a>,
    /// Name of the vehicle, for `trials.toml`.
    pub vehicle: &'a str,
}

impl Simulator<'_> {
    /// Wrench in still water, of a sample alone.
    pub fn predict(&self, state: &State) -> Wrench6 {
        self.predict_moving(state, &state.velocity)
    }

    /// Wrench with another velocity through the water, body frame [m/s], of a sample alone.
    pub fn predict_moving(&self, state: &State, through_water: &Vec3) -> Wrench6 {
        match self.prediction {
            Prediction::Analytic => {
                self.hull.buoyancy(state, DENSITY, |_, _| 0.0) + self.drag(state, through_water)
            }
            Prediction::Model(model) => {
                let asked = Asked { state: *state, through_water: *through_water };
                model(&[asked]).first().map_or_else(Wrench6::zeros, |answer| answer.wrench)
            }
        }
    }

    /// Wrenches of a run in still water, and what the model states of them; an analytic simulation states nothing.
    pub fn predict_run(&self, states: &[State]) -> Vec<Modeled> {
        match self.prediction {
            Prediction::Analytic => {
                let exact = |state| Modeled { wrench: self.predict(state), deviation: Wrench6::zeros() };
                states.iter().map(exact).collect()
            }
            Prediction::Model(model) => {
                let asked = |state: &State| Asked { state: *state, through_water: state.velocity };
                model(&states.iter().map(asked).collect::<Vec<_>>())
            }
        }
    }

    /// The share of the prediction that is due to the motion: with the velocity less at rest.
    pub fn drag_share(&self, state: &State) -> Wrench6 {
        match self.prediction {
            Prediction::Analytic => self.drag(state, &state.velocity),
            Prediction::Model(_) => {
                let at_rest = State { velocity: Vec3::zeros(), wheels: [0.0; 4], ..*state };
                self.predict(state) - self.predict(&at_rest)
            }
        }
    }

    /// `-0.5 rho Cd A v abs(v)` along x and y, at the middle of the wet height.
    fn drag(&self, state: &State, v: &Vec3) -> Wrench6 {
        let hull = self.hull;
        let draft = state.depth.clamp(0.0, hull.height);
        let force = |cd: f64, across: f64, v: f64| -0.5 * DENSITY * cd * across * draft * v * v.abs();
        let force = Vec3::new(force(DRAG[0], hull.width, v.x), force(DRAG[1], hull.length, v.y), 0.0);
        super::hull::wrench(force, Vec3::new(0.0, 0.0, hull.z0 + 0.5 * draft) - hull.center_of_mass)
    }
}
