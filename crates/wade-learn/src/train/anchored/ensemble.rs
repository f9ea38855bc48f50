//! Teachers that each know all but a part of the cases: what a case is missed by where it is not known, and how far the
//! answers between the cases go apart with the cases that are known.
//!
//! The served network is one. What the ensemble says of uncertainty is distilled into it ([`super::spread`]).

use std::collections::BTreeMap;

use super::super::TrainError;
use super::known::{Known, Prepared};
use super::teacher::Teacher;
use crate::random::Random;
use wade_core::anchor::COORDINATES;
use wade_core::frame::Vec3;

/// Teachers, and parts of the cases of each vehicle.
pub const MEMBERS: usize = 5;

/// The teachers.
#[derive(Debug, Clone)]
pub struct Ensemble {
    /// Each without one part.
    members: Vec<Teacher>,
    /// The part of each training state.
    pub parts: Vec<usize>,
}

impl Ensemble {
    /// Deals the states out to the parts, those together that share a number in `state_of` (a case and its images, a state on
    /// several meshes), and learns from them as the whole teacher did.
    pub fn new(
        training: &[Known],
        state_of: &dyn Fn(&Known) -> usize,
        vehicles: &[Prepared],
        (whole, unit): (&Teacher, [f64; COORDINATES]),
        random: &mut Random,
    ) -> Result<Self, TrainError> {
        let mut part_of: BTreeMap<usize, usize> = BTreeMap::new();
        for vehicle in 0..vehicles.len() {
            let of_vehicle = training.iter().filter(|state| state.vehicle == vehicle);
            let mut states: Vec<usize> = of_vehicle.map(state_of).collect();
            states.sort_unstable();
            states.dedup();
            random.fork().shuffle(&mut states);
            part_of.extend(states.into_iter().enumerate().map(|(index, state)| (state, index % MEMBERS)));
        }
        let parts: Vec<usize> = training.iter().map(|state| part_of[&state_of(state)]).collect();
        let without = |part: usize| {
            let others = training.iter().zip(&parts).filter(move |(_, of)| **of != part);
            Teacher::new(others.map(|(state, _)| state), vehicles, unit, Some(whole))
        };
        let members = (0..MEMBERS).map(without).collect::<Result<_, _>>()?;
        Ok(Self { members, parts })
    }

    /// What a training state is missed by where its part is not known [N]; `None` where nothing else of its vehicle is.
    pub fn missed(&self, number: usize, state: &Known, prepared: &Prepared) -> Option<Vec3> {
        apart(&self.members[self.parts[number]], state, prepared)
    }

    /// Standard deviation of the net force that the whole teacher answered a state with, by its members [N]: with a part left
    /// out each, `(n - 1) / n sum (f_i - f)^2` (the jackknife; Efron, Tibshirani, An Introduction to the Bootstrap, chapter 11).
    pub fn deviation(&self, state: &Known, prepared: &Prepared) -> Vec3 {
        let apart = self.members.iter().filter_map(|member| apart(member, state, prepared));
        let squares: Vec<Vec3> = apart.map(|apart| apart.component_mul(&apart)).collect();
        let count = squares.len().max(1) as f64;
        (squares.iter().sum::<Vec3>() * ((count - 1.0) / count)).map(f64::sqrt)
    }
}

/// The net force that a member answers a state with, less the state's own [N]; `None` of a vehicle that it does not know.
fn apart(member: &Teacher, state: &Known, prepared: &Prepared) -> Option<Vec3> {
    let loads = member.loads(state.vehicle, &state.prior, prepared)?;
    Some(loads.iter().map(|load| load.0).sum::<Vec3>() - state.remainder())
}
