//! Computed cases as trials, so that `wade gap` can hold a model against the flow that it was not told of: speed that
//! changes, a bed that moves.
//!
//! A row is a section, stamped at its middle. The wrench is that of the water on the hull about the center of mass: the load
//! of the case less its own load at rest on the mesh, and the exact hydrostatics of the hull with water under the tires.
//!
//! Signs. An unsteady case is computed in the frame of the vehicle, whose acceleration `a` the water feels as `g - a`, with
//! an inflow that changes by `-a`. Far from the hull `grad p = rho (g - a) - rho (-a) = rho g`: no pressure gradient along
//! the way. So the force holds no buoyancy along `a`, which a parked vehicle would feel in a current that speeds up, and is
//! that of a vehicle that speeds up in still water: an added mass pulls against `a`.
//! Where the bed is parked the velocity over ground is 0, and the current is minus the velocity through the water.

use std::collections::BTreeMap;

use super::collect::Collected;
use super::mesh::Channel;
use super::placement::Placement;
use super::plan::{Plan, Set};
use crate::dataset::label::{OtherSurfaces, labels, order};
use crate::dataset::{Dataset, Image, Sample};
use crate::trials::{Columns, Manifest, Measured, Method, SIMULATED, SimIs, WHEELS, WRENCH};
use wade_core::condition::{Condition, GroundContact};
use wade_core::effects;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::vehicle::Vehicle;
use wade_core::wrench::Wrench;

/// The components that count unless the manifest is edited. A flow is so little noisy that the few centimeters between where
/// a load acts and where its law puts it would show in the moments before anything else, and bend the coefficient.
const FORCES: [&str; 3] = ["fx", "fy", "fz"];

/// Why cases could not be turned into trials.
#[derive(Debug, thiserror::Error)]
pub enum CaseTrialsError {
    /// Nothing of this set is in the data set.
    #[error(
        "no case of {set} is in the data set of the campaign: plan it (wade campaign plan --set), run it, collect it"
    )]
    Nothing {
        /// The set.
        set: Set,
    },
    /// No two flows to hold against each other.
    #[error(
        "no case of the chosen sets has a twin over a parked bed such that both have settled and are not choked: choose driving, and run and collect paper too"
    )]
    NoTwins,
    /// Surfaces that are not the vehicle's.
    #[error(transparent)]
    Surfaces(#[from] OtherSurfaces),
    /// A load without a moment.
    #[error("case `{case}` has no moments, which a wrench about the center of mass needs")]
    NoMoments {
        /// The case.
        case: String,
    },
}

/// Trials of the computed cases of some sets, one a case, with what holds for all. With `pairs`, of those that have a twin over
/// a parked bed and of the twins, the mean wrench of the twin standing beside both as the prediction; where a steady flow
/// passes the hull at all, and each flow by its mean, since what it does within its window is no load of the bed's.
pub fn trials(
    plan: &Plan,
    dataset: &Dataset,
    vehicle: &Vehicle,
    sets: &[Set],
    pairs: Option<&Collected>,
) -> Result<(Manifest, Vec<Columns>), CaseTrialsError> {
    let names = sets.iter().map(Set::to_string).collect::<Vec<_>>().join(" and ");
    let mut cases: BTreeMap<&str, Vec<&Sample>> = BTreeMap::new();
    for sample in dataset.samples.iter().filter(|sample| sample.image == Image::Original) {
        cases.entry(&sample.case).or_default().push(sample);
    }
    cases.values_mut().for_each(|samples| samples.sort_by_key(|sample| sample.section));
    let is_of = |samples: &[&Sample], set: &Set| samples[0].set == set.to_string();
    if let Some(set) = sets.iter().find(|set| !cases.values().any(|samples| is_of(samples, set))) {
        return Err(CaseTrialsError::Nothing { set: *set });
    }
    // a sample of a case has surfaces
    let order = order(vehicle, dataset.meta.vehicles.get(&vehicle.name).map_or(&[], Vec::as_slice))?;
    let (wheels, channel_width) = (wheels(plan, vehicle), channel_width(plan, vehicle));
    let (mut trials, mut noise, mut loads) = (Vec::new(), Noise::default(), BTreeMap::new());
    let heard = |samples: &[&Sample]| -> Result<Vec<[f64; 6]>, CaseTrialsError> {
        let wrenches = samples.iter().map(|sample| wrench(vehicle, &order, sample)).collect::<Option<_>>();
        wrenches.ok_or_else(|| CaseTrialsError::NoMoments { case: samples[0].case.clone() })
    };
    for (case, samples) in &cases {
        let twin = pairs.and_then(|all| cases.get(all.settled_twin(all.cases.get(*case)?)?.id.as_str()));
        let twin = twin.filter(|parked| !is_choked(&parked[0].condition, vehicle, channel_width));
        if !sets.iter().any(|set| is_of(samples, set)) || (pairs.is_some() && twin.is_none()) {
            continue;
        }
        let mut flows = Vec::new();
        for samples in [Some(samples), twin].into_iter().flatten() {
            let wrenches = heard(samples)?;
            noise.hear(samples, &wrenches, vehicle);
            flows.push((samples, wrenches));
        }
        if twin.is_some() {
            for (_, wrenches) in &mut flows {
                let mean = mean(wrenches);
                wrenches.fill(mean);
            }
        }
        // right of the parked flow itself, which what does not go with the bed would change as well
        let predicted = flows.get(1).map(|(_, parked)| parked[0]);
        for (samples, wrenches) in flows {
            let mut columns = columns(samples, &wrenches, &wheels);
            if let Some(predicted) = predicted {
                columns.extend((0..6).map(|c| (SIMULATED[c], vec![predicted[c]; samples.len()])));
            }
            loads.insert(samples[0].case.clone(), dynamic_load(samples, vehicle));
            trials.push((samples[0].case.clone(), columns));
        }
    }
    if trials.is_empty() {
        return Err(CaseTrialsError::NoTwins);
    }
    let manifest = Manifest {
        vehicle: vehicle.name.clone(),
        generated: Some(format!(
            "computed by {}, cases of {names}, means of {}; nothing of it was measured",
            dataset.meta.provenance,
            if pairs.is_some() {
                "whole windows, beside that of the same state over a parked bed"
            } else {
                "a tenth of a second"
            }
        )),
        channel_width,
        measured: Measured {
            columns: Some(FORCES.map(str::to_owned).into()),
            method: Some(Method::Cfd),
            // the parked flow is what the vehicle's model learnt
            sim_is: if pairs.is_some() { SimIs::Control } else { SimIs::Simulator },
            ..Measured::default()
        },
        sensor_noise: noise.of_a_section(),
        // of a pair both means are in the gap
        trial_offsets: noise.of_means(if pairs.is_some() { 2.0 } else { 1.0 }, &loads),
        ..Manifest::default()
    };
    Ok((manifest, trials))
}

/// Width of the channel of the plan's cases [m].
fn channel_width(plan: &Plan, vehicle: &Vehicle) -> Option<f64> {
    let case = plan.cases.first()?;
    let (settings, placement) = (&plan.campaign.settings.mesh, Placement::new(vehicle, case));
    let scales = [1.0, case.channel_scale];
    let length = vehicle.dimensions.length;
    Some(Channel::new(settings, &placement, length, case.speed_mps, scales).size.y)
}

/// True where a bore leaves the hull as long as the flow is computed, taking it to fill the depth in its whole width.
fn is_choked(condition: &Condition, vehicle: &Vehicle, channel_width: Option<f64>) -> bool {
    let Some(width) = channel_width else { return false };
    let froude = condition.velocity.norm() / (GRAVITY * condition.depth).sqrt();
    effects::is_choked(froude, vehicle.dimensions.width / width)
}

/// Wheels that have a column, with their radius [m].
fn wheels(plan: &Plan, vehicle: &Vehicle) -> Vec<(&'static str, f64)> {
    let Some(case) = plan.cases.first() else { return Vec::new() };
    let wheels = Placement::new(vehicle, case).wheels(vehicle);
    let radius = |name: &'static str| Some((name, wheels.iter().find(|w| w.surface == name)?.radius));
    WHEELS.into_iter().filter_map(radius).collect()
}

/// The wrench of a section about the center of mass, as if water reached under the tires [N, N m].
fn wrench(vehicle: &Vehicle, order: &[usize], sample: &Sample) -> Option<[f64; 6]> {
    let mut sum = Wrench::default();
    for label in labels(vehicle, order, sample) {
        sum += Wrench { force: label.force, moment: label.moment? };
    }
    let wetted = Condition { ground_contact: GroundContact::Wetted, ..sample.condition };
    for (wetted, stated) in vehicle.at_rest(&wetted).into_iter().zip(vehicle.at_rest(&sample.condition)) {
        sum += wetted + stated * -1.0;
    }
    let Wrench { force: f, moment: m } = sum.moved(&Vec3::zeros(), &vehicle.center_of_mass);
    Some([f.x, f.y, f.z, m.x, m.y, m.z])
}

fn columns(
    samples: &[&Sample],
    wrenches: &[[f64; 6]],
    wheels: &[(&'static str, f64)],
) -> Vec<(&'static str, Vec<f64>)> {
    let of =
        |value: &dyn Fn(&Sample) -> f64| samples.iter().map(|sample| value(sample)).collect::<Vec<f64>>();
    let mut columns = vec![
        ("t", of(&|s| 0.5 * (s.start_s + s.end_s))),
        ("depth", of(&|s| s.condition.depth)),
        ("rho", of(&|s| s.condition.density)),
        // up = (-sin pitch, sin roll cos pitch, cos roll cos pitch)
        ("roll", of(&|s| s.condition.up.y.atan2(s.condition.up.z))),
        ("pitch", of(&|s| (-s.condition.up.x).asin())),
    ];
    type Vector = fn(&Condition) -> Vec3;
    let vectors: [([&'static str; 3], Vector); 5] = [
        (["vx", "vy", "vz"], |c| c.ground_velocity),
        (["cx", "cy", "cz"], |c| c.ground_velocity - c.velocity),
        (["wx", "wy", "wz"], |c| c.angular_velocity),
        (["ax", "ay", "az"], |c| c.acceleration),
        (["alx", "aly", "alz"], |c| c.angular_acceleration),
    ];
    for (names, vector) in vectors {
        columns.extend((0..3).map(|axis| (names[axis], of(&|s| vector(&s.condition)[axis]))));
    }
    // wheels roll on a bed that moves, and stand on one that is parked
    columns
        .extend(wheels.iter().map(|&(name, radius)| (name, of(&|s| s.condition.ground_velocity.x / radius))));
    columns.extend((0..6).map(|c| (WRENCH[c], wrenches.iter().map(|w| w[c]).collect())));
    columns
}

/// What a coefficient of one is worth in a case [N]: `rho v^2 / 2` over width times depth, in the mean.
fn dynamic_load(samples: &[&Sample], vehicle: &Vehicle) -> f64 {
    let load = |sample: &&Sample| {
        let Condition { density, velocity, depth, .. } = sample.condition;
        0.5 * density * velocity.norm_squared() * vehicle.dimensions.width * depth
    };
    samples.iter().map(load).sum::<f64>() / samples.len() as f64
}

/// What the flow does of itself: sums of squares and their numbers.
#[derive(Debug, Default)]
struct Noise {
    section: [f64; 6],
    sections: f64,
    /// Of means over the dynamic load, with which they wander.
    mean: [f64; 6],
    means: f64,
}

impl Noise {
    /// Takes a case in: second differences of sections where the acceleration stays what it is, which trends do not touch;
    /// and, where the state stays the same and moves, half the difference of the means of both halves of the window.
    fn hear(&mut self, samples: &[&Sample], wrenches: &[[f64; 6]], vehicle: &Vehicle) {
        for (three, w) in samples.windows(3).zip(wrenches.windows(3)) {
            let acceleration = three[0].condition.acceleration;
            if three.iter().any(|sample| sample.condition.acceleration != acceleration) {
                continue;
            }
            (0..6).for_each(|c| self.section[c] += (w[0][c] - 2.0 * w[1][c] + w[2][c]).powi(2) / 6.0);
            self.sections += 1.0;
        }
        let (half, load) = (wrenches.len() / 2, dynamic_load(samples, vehicle));
        if half > 0 && load > 0.0 && samples.iter().all(|sample| sample.condition == samples[0].condition) {
            let [early, late] = [&wrenches[..half], &wrenches[half..]].map(mean);
            (0..6).for_each(|c| self.mean[c] += (0.5 * (late[c] - early[c]) / load).powi(2));
            self.means += 1.0;
        }
    }

    fn of_a_section(&self) -> BTreeMap<String, f64> {
        deviations(&self.section, self.sections)
    }

    /// Of the means of so many flows, by trial: in proportion to its dynamic load.
    fn of_means(&self, flows: f64, loads: &BTreeMap<String, f64>) -> BTreeMap<String, BTreeMap<String, f64>> {
        let of = |load: f64| deviations(&self.mean.map(|squares| flows * squares * load * load), self.means);
        let heard = loads.iter().filter(|_| self.means > 0.0);
        heard.map(|(case, load)| (case.clone(), of(*load))).collect()
    }
}

fn mean(wrenches: &[[f64; 6]]) -> [f64; 6] {
    let count = wrenches.len() as f64;
    std::array::from_fn(|c| wrenches.iter().map(|wrench| wrench[c]).sum::<f64>() / count)
}

/// Standard deviations by component; none where nothing was heard.
fn deviations(squares: &[f64; 6], count: f64) -> BTreeMap<String, f64> {
    let heard = WRENCH.into_iter().zip(squares).filter(|_| count > 0.0);
    heard.map(|(name, sum)| (name.to_owned(), (sum / count).sqrt())).collect()
}
