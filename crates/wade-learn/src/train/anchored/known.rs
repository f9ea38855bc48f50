//! States to learn the remainder from: what is known of each beforehand, and what CFD found besides.

use std::collections::BTreeMap;

use super::super::TrainError;
use super::super::label;
use crate::dataset::{Dataset, Image, flows};
use wade_core::anchor::{Anchor, Reading, Remainder, STATIC};
use wade_core::condition::{Condition, GroundContact};
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::physics::radiation::Radiation;
use wade_core::physics::{Base, BaseLoads, Motion};
use wade_core::vehicle::Vehicle;
use wade_core::wrench::Wrench;

/// Load on a surface: force [N], and moment about the body origin [N m] where the data set has it.
pub type Load = (Vec3, Option<Vec3>);

/// What is known of a state before anything is learned.
#[derive(Debug, Clone)]
pub struct Prior {
    /// The state, over the bed that the base finds below it.
    pub condition: Condition,
    /// The inputs of the network.
    pub reading: Reading,
    /// Drag that the physical base puts on each surface, about the body origin.
    pub drag: Vec<Wrench>,
    /// Water that the hull displaces [m3].
    pub volume: f64,
}

impl Prior {
    /// Net force of the base, hydrostatic and drag [N].
    pub fn force(&self) -> Vec3 {
        let hydrostatic: Vec3 = self.reading.surfaces.iter().map(|surface| surface.hydrostatic.force).sum();
        hydrostatic + self.drag_force()
    }

    /// Net drag of the base [N].
    pub fn drag_force(&self) -> Vec3 {
        self.drag.iter().map(|drag| drag.force).sum()
    }
}

/// A vehicle as the anchored network sees it.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// Name.
    pub name: String,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// What tells the network of its states.
    pub anchor: Anchor,
    base: Base,
    /// Static features of its surfaces.
    pub fixed: Vec<[f32; STATIC]>,
    /// Where each of its surfaces stands in the data set.
    order: Vec<usize>,
}

impl Prepared {
    /// Every vehicle of a data set, in the order of their names.
    pub fn all(data: &Dataset, vehicles: &BTreeMap<String, Vehicle>) -> Result<Vec<Self>, TrainError> {
        let prepare = |(name, surfaces): (&String, &Vec<String>)| {
            let unknown = || TrainError::UnknownVehicle { vehicle: name.clone() };
            let vehicle = vehicles.get(name).ok_or_else(unknown)?;
            let anchor = Anchor::new(vehicle, Remainder::OfPhysics);
            Ok(Self {
                name: name.clone(),
                fixed: anchor.static_rows(vehicle),
                anchor,
                // steady states make no waves, so that any table of them will do
                base: Base::new(vehicle, Radiation::estimate(vehicle)),
                order: label::order(vehicle, surfaces)?,
                vehicle: vehicle.clone(),
            })
        };
        data.meta.vehicles.iter().map(prepare).collect()
    }

    /// What is known of a state.
    pub fn prior(&self, condition: &Condition) -> Prior {
        let mut loads = BaseLoads::default();
        let wetted = Condition { ground_contact: GroundContact::Wetted, ..*condition };
        self.base.evaluate(&wetted, &Motion::QUASI_STEADY, None, &mut loads);
        let lift: Vec3 = loads.surfaces.iter().map(|surface| surface.hydrostatic.force).sum();
        let condition = condition.levelled(loads.bed_clearance);
        let mut drags = Vec::new();
        self.base.drag_into(&condition, &loads, &mut drags);
        let mut reading = Reading::default();
        self.anchor.read(&self.vehicle, &condition, &mut reading);
        Prior {
            condition,
            reading,
            drag: drags.into_iter().map(|drag| drag.load).collect(),
            volume: lift.norm() / (condition.density * GRAVITY),
        }
    }

    /// Weight of the vehicle in the air [N], the unit in which its loads are judged.
    pub fn weight(&self) -> f64 {
        self.vehicle.mass * GRAVITY
    }
}

/// One state, averaged over the sections of its case.
#[derive(Debug, Clone)]
pub struct Known {
    /// Index of the vehicle.
    pub vehicle: usize,
    /// Name of the case.
    pub case: String,
    /// Whether it is a mirror image.
    pub image: Image,
    /// What is known of it.
    pub prior: Prior,
    /// What was found on each surface besides.
    pub loads: Vec<Load>,
    /// Standard deviation of the net force over the sections, a component each [N]; `None` of a case of one section, which does not
    /// say how much it scatters.
    pub scatter: Option<Vec3>,
}

impl Known {
    /// The states of some samples of a data set: one a case, image and condition, averaged over sections.
    ///
    /// Images across the plane y = 0 are left out: the model answers them with the mirror image of the original's
    /// answer whatever its weights, so they would count each case twice and teach nothing.
    pub fn states(data: &Dataset, numbers: &[usize], vehicles: &[Prepared]) -> Vec<Self> {
        let taught =
            |number: &usize| matches!(data.samples[*number].image, Image::Original | Image::FrontRear);
        let numbers: Vec<usize> = numbers.iter().copied().filter(taught).collect();
        let sections = numbers.iter().map(|&number| &data.samples[number]);
        let flows = flows(sections.map(|s| (s.case.as_str(), s.image, &s.condition)));
        let state = |places: Vec<usize>| {
            let members: Vec<usize> = places.into_iter().map(|place| numbers[place]).collect();
            let first = &data.samples[members[0]];
            let index = vehicles.iter().position(|prepared| prepared.name == first.vehicle)?;
            let prepared = &vehicles[index];
            let prior = prepared.prior(&first.condition);
            let (mut loads, scatter) = mean_loads(data, &members, prepared);
            for (load, drag) in loads.iter_mut().zip(&prior.drag) {
                *load = (load.0 - drag.force, load.1.map(|moment| moment - drag.moment));
            }
            Some(Self { vehicle: index, case: first.case.clone(), image: first.image, prior, loads, scatter })
        };
        flows.into_iter().filter_map(state).collect()
    }

    /// The load that each surface is to answer: what was found besides the base, but what was found on surfaces above still water on
    /// the wet ones, in proportion to what a coefficient is worth there; of a surface on which loads are setting in, the part
    /// that has not set in.
    ///
    /// A bow wave climbs surfaces that the model keeps dry by construction. Their loads belong to the vehicle all the same:
    /// without this the net force would lack them, or be torn between them and the loads of the single surfaces.
    pub fn carried(&self) -> Vec<Load> {
        let mut loads = self.loads.clone();
        carry(&mut loads, &self.prior.reading);
        loads
    }

    /// Net force that was found besides the base [N].
    pub fn remainder(&self) -> Vec3 {
        self.loads.iter().map(|(force, _)| *force).sum()
    }
}

/// Loads averaged over samples, and the standard deviation of their net force.
fn mean_loads(data: &Dataset, members: &[usize], prepared: &Prepared) -> (Vec<Load>, Option<Vec3>) {
    let mut sums = vec![(Vec3::zeros(), Some(Vec3::zeros())); prepared.order.len()];
    let mut nets = Vec::with_capacity(members.len());
    for &member in members {
        let found = label::dynamic(&prepared.vehicle, &prepared.order, &data.samples[member]);
        let mut net = Vec3::zeros();
        for (sum, load) in sums.iter_mut().zip(found) {
            net += load.force;
            sum.0 += load.force;
            sum.1 = sum.1.zip(load.moment).map(|(sum, moment)| sum + moment);
        }
        nets.push(net);
    }
    let count = members.len() as f64;
    let mean = nets.iter().sum::<Vec3>() / count;
    let variance = nets.iter().map(|net| (net - mean).map(|x| x * x)).sum::<Vec3>() / count;
    let loads = sums.into_iter().map(|(force, moment)| (force / count, moment.map(|m| m / count)));
    (loads.collect(), (members.len() > 1).then(|| variance.map(f64::sqrt)))
}

/// See [`Known::carried`].
fn carry(loads: &mut [Load], reading: &Reading) {
    let whole = reading.dynamic_load();
    if whole == 0.0 {
        return;
    }
    let (mut force, mut moment) = (Vec3::zeros(), Some(Vec3::zeros()));
    for (load, surface) in loads.iter_mut().zip(&reading.surfaces) {
        let rest = 1.0 - surface.onset;
        force += load.0 * rest;
        moment = moment.zip(load.1).map(|(sum, moment)| sum + moment * rest);
        *load = (load.0 * surface.onset, load.1.map(|moment| moment * surface.onset));
    }
    for (load, surface) in loads.iter_mut().zip(&reading.surfaces) {
        let share = surface.unit / whole;
        *load = (load.0 + force * share, load.1.zip(moment).map(|(own, carried)| own + carried * share));
    }
}

/// Moment about `point` of a load with a moment about the origin [N m].
pub fn about(load: &Wrench, point: &Vec3) -> Vec3 {
    load.moment - point.cross(&load.force)
}
