//! What the cases say together, before a network learns it: smooth functions of the state, one for the load on each
//! surface, by [`super::gaussian`].
//!
//! A hundred cases are few for a network of 76,000 weights, which may do anything between them, and every case carries the
//! scatter of its own flow and mesh. A regression on the few coordinates that a state has knows which of them matter over
//! which distance, and how much of a case is noise. Measured in five folds: a network on 61 cases of the Warthog missed its Fx
//! by 120 N in the mean, a regression through 72 by 38 N.
//!
//! Its answers are what is left of the base, `q V^(2/3)` (dynamic pressure, displaced volume) times functions of the
//! coordinates and of the coefficients of the base's own drag, which know how much of the hull meets the flow in an attitude.
//! All surfaces share the lengths and noise that the net force along each axis asks for, so that the sum over surfaces is what
//! it would say of the net force. Serving does without it: the network learns its answers, in the cases and in states between these.
//!
//! Of mirror images one is looked at, motion ahead (where the data set has front-rear images) and to the left (where the
//! hull is symmetric): an image has the noise of its original, and two cases that agree to the last bit would say that
//! there is none.

use nalgebra::{DMatrix, DVector};

use super::super::TrainError;
use super::gaussian::{LINEAR, Regression};
use super::known::{Known, Load, Prepared, Prior};
use crate::dataset::Image;
use crate::dataset::mirror::Plane;
use wade_core::anchor::COORDINATES;
use wade_core::condition::Condition;
use wade_core::features::direction;
use wade_core::frame::Vec3;

/// Where direction and tilt stand among the coordinates, along x and y.
const DIRECTION: [usize; 2] = [3, 4];
const UP: [usize; 2] = [5, 6];

/// Numbers that tell states apart: their coordinates, and the coefficients of the base's drag along each axis, in which the mean is
/// linear: what all states say of them is a correction of the base.
const PLACE: usize = COORDINATES + LINEAR;

/// Share of the weight by which no load of a case is known better: the CFD's own load at rest differs by as much from Archimedes
/// on the same mesh.
const LEAST_SCATTER: f64 = 0.002;

/// Which numbers of a surface's load go with which axis of the force: `[Fx, Fy, Fz, Mx, My, Mz]`.
const OF_AXIS: [&[usize]; 3] = [&[0], &[1, 5], &[2, 3, 4]];

/// The regressions of every vehicle.
#[derive(Debug, Clone)]
pub struct Teacher {
    /// One a vehicle; none where no case of it moves.
    vehicles: Vec<Option<OfVehicle>>,
}

#[derive(Debug, Clone)]
struct OfVehicle {
    unit: [f64; COORDINATES],
    /// Whether a state may be seen in the mirror: in that across x = 0, in that across y = 0.
    mirrors: [bool; 2],
    has_moments: bool,
    /// One an axis of the force.
    axes: Vec<Regression<PLACE>>,
}

impl Teacher {
    /// Learns from states, with the unit of each coordinate; from nearly the same as another did, where there is one.
    pub fn new<'a>(
        training: impl Iterator<Item = &'a Known> + Clone,
        vehicles: &[Prepared],
        unit: [f64; COORDINATES],
        like: Option<&Self>,
    ) -> Result<Self, TrainError> {
        let of = |(index, prepared): (usize, &Prepared)| {
            let moves = |state: &&Known| scale(&state.prior) > 0.0;
            let of_vehicle = training.clone().filter(|state| state.vehicle == index);
            let (states, images): (Vec<_>, Vec<_>) =
                of_vehicle.filter(moves).partition(|state| state.image == Image::Original);
            if states.is_empty() {
                return Ok(None);
            }
            let failed = || TrainError::Covariance { vehicle: prepared.name.clone() };
            let mirrors = [!images.is_empty(), prepared.vehicle.symmetric_left_right];
            let like = like.and_then(|other| other.vehicles[index].as_ref());
            OfVehicle::new(&states, prepared, (unit, mirrors), like).map(Some).ok_or_else(failed)
        };
        let vehicles = vehicles.iter().enumerate().map(of).collect::<Result<_, _>>()?;
        Ok(Self { vehicles })
    }

    /// The load on each surface in a state besides the base; nothing where nothing moves, `None` of a vehicle that was not learnt.
    pub fn loads(&self, vehicle: usize, prior: &Prior, prepared: &Prepared) -> Option<Vec<Load>> {
        self.vehicles[vehicle].as_ref().map(|of| of.loads(prior, prepared))
    }

    /// Standard deviation of what the net force in a state has for noise, as the cases say it [N]; nothing where nothing moves
    /// and of a vehicle that was not learnt.
    pub fn noise(&self, state: &Known) -> Vec3 {
        let axes = self.vehicles[state.vehicle].iter().flat_map(|of| &of.axes);
        let noise = Vec3::from_iterator(axes.map(|axis| axis.noise).chain([0.0; 3]).take(3));
        noise * scale(&state.prior)
    }
}

impl OfVehicle {
    fn new(
        states: &[&Known],
        prepared: &Prepared,
        (unit, mirrors): ([f64; COORDINATES], [bool; 2]),
        like: Option<&Self>,
    ) -> Option<Self> {
        let scale_of = |state: &Known| scale(&state.prior);
        let least = LEAST_SCATTER * prepared.weight();
        let has_moments = states.iter().all(|state| state.loads.iter().all(|load| load.1.is_some()));
        let surfaces = prepared.vehicle.surfaces.len();
        // a row a state: six numbers a surface, without a dimension
        let mut rows = DMatrix::zeros(states.len(), 6 * surfaces);
        for (row, state) in states.iter().enumerate() {
            let loads = View::of(&state.prior.condition, mirrors).loads(&state.loads, prepared);
            for (surface, (force, moment)) in loads.iter().enumerate() {
                let moment = moment.unwrap_or_default() / prepared.vehicle.dimensions.length;
                let numbers = force.iter().chain(moment.iter()).enumerate();
                numbers.for_each(|(i, x)| rows[(row, 6 * surface + i)] = x / scale_of(state));
            }
        }
        let places: Vec<_> =
            states.iter().map(|s| View::of(&s.prior.condition, mirrors).place(&s.prior, &unit)).collect();
        let mut axes = Vec::with_capacity(3);
        for (axis, members) in OF_AXIS.into_iter().enumerate() {
            let columns: Vec<usize> =
                (0..surfaces).flat_map(|surface| members.iter().map(move |i| 6 * surface + i)).collect();
            let values = rows.select_columns(&columns);
            // the first of the members is the force itself
            let net = DVector::from_fn(values.ncols(), |i, _| if i % members.len() == 0 { 1.0 } else { 0.0 });
            let leading = &values * &net;
            let of = |s: &&Known| s.scatter.map(|scatter| scatter[axis].max(least) / scale_of(s));
            let scatter: Vec<Option<f64>> = states.iter().map(of).collect();
            let like = like.map(|other| &other.axes[axis]);
            axes.push(Regression::new(places.clone(), leading.as_slice(), &scatter, &values, like)?);
        }
        Some(Self { unit, mirrors, has_moments, axes })
    }

    fn loads(&self, prior: &Prior, prepared: &Prepared) -> Vec<Load> {
        let scale = scale(prior);
        let view = View::of(&prior.condition, self.mirrors);
        let place = view.place(prior, &self.unit);
        let mut numbers = vec![[0.0; 6]; prepared.vehicle.surfaces.len()];
        for (regression, members) in self.axes.iter().zip(OF_AXIS) {
            let found = regression.at(&place);
            for (surface, values) in numbers.iter_mut().zip(found.as_slice().chunks(members.len())) {
                members.iter().zip(values).for_each(|(&i, value)| surface[i] = value * scale);
            }
        }
        let length = prepared.vehicle.dimensions.length;
        let load = |n: [f64; 6]| {
            let moment = Vec3::new(n[3], n[4], n[5]) * length;
            (Vec3::new(n[0], n[1], n[2]), self.has_moments.then_some(moment))
        };
        let loads: Vec<Load> = numbers.into_iter().map(load).collect();
        view.loads(&loads, prepared)
    }
}

/// What a coefficient of one is worth [N].
fn scale(prior: &Prior) -> f64 {
    prior.reading.pressure * prior.volume.powf(2.0 / 3.0)
}

/// The mirrors in which a state is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
struct View([Option<Plane>; 2]);

impl View {
    fn of(condition: &Condition, mirrors: [bool; 2]) -> Self {
        let planes = [Plane::FrontRear, Plane::LeftRight];
        Self([0, 1].map(|i| (mirrors[i] && condition.velocity[i] < 0.0).then_some(planes[i])))
    }

    fn polar(self, v: Vec3) -> Vec3 {
        self.0.into_iter().flatten().fold(v, |v, plane| plane.polar(&v))
    }

    fn axial(self, v: Vec3) -> Vec3 {
        self.0.into_iter().flatten().fold(v, |v, plane| plane.axial(&v))
    }

    /// Where the state lies among others, as it is seen.
    fn place(self, prior: &Prior, unit: &[f64; COORDINATES]) -> [f64; PLACE] {
        let Prior { condition, reading, .. } = prior;
        let mut place = reading.coordinates;
        let (ahead, up) = (self.polar(direction(&condition.velocity)), self.polar(*condition.up));
        for axis in [0, 1] {
            place[DIRECTION[axis]] = ahead[axis];
            place[UP[axis]] = up[axis];
        }
        let drag = self.polar(prior.drag_force()) / scale(prior).max(f64::MIN_POSITIVE);
        std::array::from_fn(|i| if i < COORDINATES { place[i] / unit[i] } else { drag[i - COORDINATES] })
    }

    /// Loads as they are seen, and those that are seen so as they are.
    fn loads(self, loads: &[Load], prepared: &Prepared) -> Vec<Load> {
        let surfaces = &prepared.vehicle.surfaces;
        let image = |index: usize| {
            let seen = self.0.into_iter().flatten();
            let from = seen.fold(index, |at, plane| plane.partner(&surfaces[at]).unwrap_or(at));
            let (force, moment) = loads[from];
            (self.polar(force), moment.map(|m| self.axial(m)))
        };
        (0..loads.len()).map(image).collect()
    }
}
