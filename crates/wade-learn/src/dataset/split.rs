//! Which samples a network learns from, and which it is judged by.
//!
//! Every split but the one by sample keeps a case together, all its sections and mirror images, and with it the cases of the
//! same state on another mesh or over another bed, which know its load within a few per cent: the unit that is dealt out is
//! the state.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use serde::Serialize;

use super::{Dataset, Sample};
use crate::random::Random;

/// Most parts of a range: each is a training of its own, and holds a case.
pub const MOST_PARTS: usize = 1000;

/// What is held out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum By {
    /// A share of the cases of each vehicle, at random.
    Case {
        /// Between 0 and 1.
        share: f64,
    },
    /// A share of the samples of each vehicle, at random, as the source paper seems to do: sections and images of one
    /// case are on both sides, which tests interpolation within known runs only.
    Sample {
        /// Between 0 and 1.
        share: f64,
    },
    /// Each of `count` random groups of cases in turn.
    Folds {
        /// Number of groups.
        count: usize,
    },
    /// Each of `bins` equal parts of the range of depths in turn, that of each vehicle for itself.
    Depth {
        /// Number of parts.
        bins: usize,
    },
    /// Each of `bins` equal parts of the range of flow angles in turn, which is the same for all mirror images: 90
    /// degrees from ahead and from behind, 0 from both sides.
    Heading {
        /// Number of parts.
        bins: usize,
    },
    /// Each vehicle in turn.
    Vehicle,
}

/// The numbers of the samples on either side.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Split {
    /// What is held out.
    pub name: String,
    /// To learn from.
    pub training: Vec<usize>,
    /// To be judged by.
    pub held_out: Vec<usize>,
}

/// Why there is no such split.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SplitError {
    /// A share that leaves one side empty.
    #[error("a share of {share} is held out; it must lie between 0 and 1")]
    Share {
        /// The share.
        share: f64,
    },
    /// Fewer than two parts, or more than [`MOST_PARTS`] of a range.
    #[error("{count} parts: with fewer than 2 one side would be empty, and {MOST_PARTS} are the most")]
    Parts {
        /// Number of parts.
        count: usize,
    },
    /// A vehicle with a single case.
    #[error("vehicle `{vehicle}` has {found} {what}; with fewer than {needed} one side would be empty")]
    TooFew {
        /// The vehicle.
        vehicle: String,
        /// What it has.
        found: usize,
        /// Cases of different states, or samples.
        what: &'static str,
        /// What it needs.
        needed: usize,
    },
    /// A quantity that does not vary.
    #[error("every case of vehicle `{vehicle}` has {quantity} {value:.4}: nothing can be held out by it")]
    Constant {
        /// The vehicle.
        vehicle: String,
        /// The quantity with its unit.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// A part without a case.
    #[error("no case has {name}: take fewer parts")]
    EmptyPart {
        /// The range of the part.
        name: String,
    },
    /// Nothing else to learn from.
    #[error("all cases are of vehicle `{vehicle}`: without it there is nothing to learn from")]
    OneVehicle {
        /// The vehicle.
        vehicle: String,
    },
}

impl Split {
    /// The held-out cases whose state is learnt from.
    pub fn leaks(&self, dataset: &Dataset) -> BTreeSet<String> {
        let state_of = state_of(dataset);
        let case = |&index: &usize| dataset.samples[index].case.as_str();
        let learnt: BTreeSet<usize> = self.training.iter().map(|number| state_of[case(number)]).collect();
        let leaks = self.held_out.iter().map(case).filter(|case| learnt.contains(&state_of[case]));
        leaks.map(str::to_owned).collect()
    }

    /// Both sides as data sets.
    pub fn parts(&self, dataset: &Dataset) -> (Dataset, Dataset) {
        (dataset.subset(&self.training), dataset.subset(&self.held_out))
    }

    /// Deals samples out: those that `is_held_out` says, and the others.
    fn new(name: String, dataset: &Dataset, is_held_out: impl Fn(usize, &Sample) -> bool) -> Self {
        let (held_out, training) =
            (0..dataset.samples.len()).partition(|&index| is_held_out(index, &dataset.samples[index]));
        Self { name, training, held_out }
    }
}

/// The splits of a data set, one or, where each part is held out in turn, several. The same seed gives the same splits.
pub fn split(dataset: &Dataset, by: By, seed: u64) -> Result<Vec<Split>, SplitError> {
    let mut random = Random::new(seed);
    match by {
        By::Case { share } => by_case(dataset, share, &mut random).map(|split| vec![split]),
        By::Sample { share } => by_sample(dataset, share, &mut random).map(|split| vec![split]),
        By::Folds { count } => folds(dataset, count, &mut random),
        By::Depth { bins } => {
            let depth = |sample: &Sample| Some(sample.condition.depth);
            ranges(dataset, bins, &Quantity { name: "depth [m]", of: &depth })
        }
        By::Heading { bins } => {
            ranges(dataset, bins, &Quantity { name: "flow angle [deg]", of: &Sample::flow_angle_deg })
        }
        By::Vehicle => by_vehicle(dataset),
    }
}

/// What a case asks for: the state of its vehicle to a millionth, whatever the bed does.
fn asked(sample: &Sample) -> [i64; 10] {
    let (v, w, up) = (&sample.condition.velocity, &sample.condition.angular_velocity, &sample.condition.up);
    let numbers =
        [v.x, v.y, v.z, w.x, w.y, w.z, up.x, up.y, sample.condition.depth, 1e-3 * sample.condition.density];
    numbers.map(|x| (1e6 * x).round() as i64)
}

/// The states of each vehicle, in the order of the samples: the cases of each.
fn states(dataset: &Dataset) -> BTreeMap<&str, Vec<Vec<&str>>> {
    let mut seen = BTreeSet::new();
    let mut states: BTreeMap<&str, Vec<Vec<&str>>> = BTreeMap::new();
    let mut known: HashMap<(&str, [i64; 10]), usize> = HashMap::new();
    for sample in dataset.samples.iter().filter(|sample| seen.insert(sample.case.as_str())) {
        let of_vehicle = states.entry(&sample.vehicle).or_default();
        let state = *known.entry((&sample.vehicle, asked(sample))).or_insert(of_vehicle.len());
        if state == of_vehicle.len() {
            of_vehicle.push(Vec::new());
        }
        of_vehicle[state].push(&sample.case);
    }
    states
}

/// A number for the state of each case, the same for cases of one state.
pub fn state_of(dataset: &Dataset) -> HashMap<&str, usize> {
    let states = states(dataset).into_values().flatten().enumerate();
    states.flat_map(|(number, cases)| cases.into_iter().map(move |case| (case, number))).collect()
}

/// How many of `count` are held out: rounded, and at least one on either side.
fn held_out_count(count: usize, share: f64, vehicle: &str, what: &'static str) -> Result<usize, SplitError> {
    if !(share > 0.0 && share < 1.0) {
        return Err(SplitError::Share { share });
    }
    if count < 2 {
        return Err(SplitError::TooFew { vehicle: vehicle.to_owned(), found: count, what, needed: 2 });
    }
    Ok(((share * count as f64).round() as usize).clamp(1, count - 1))
}

fn by_case(dataset: &Dataset, share: f64, random: &mut Random) -> Result<Split, SplitError> {
    let mut held_out = BTreeSet::new();
    for (vehicle, mut states) in states(dataset) {
        let count = held_out_count(states.len(), share, vehicle, "cases of different states")?;
        random.fork().shuffle(&mut states);
        held_out.extend(states.into_iter().take(count).flatten());
    }
    let name = format!("{:.0} % of the cases of each vehicle", 100.0 * share);
    Ok(Split::new(name, dataset, |_, sample| held_out.contains(sample.case.as_str())))
}

fn by_sample(dataset: &Dataset, share: f64, random: &mut Random) -> Result<Split, SplitError> {
    let mut samples: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (index, sample) in dataset.samples.iter().enumerate() {
        samples.entry(&sample.vehicle).or_default().push(index);
    }
    let mut held_out = BTreeSet::new();
    for (vehicle, mut samples) in samples {
        let count = held_out_count(samples.len(), share, vehicle, "samples")?;
        random.fork().shuffle(&mut samples);
        held_out.extend(samples.into_iter().take(count));
    }
    let name = format!("{:.0} % of the samples of each vehicle", 100.0 * share);
    Ok(Split::new(name, dataset, |index, _| held_out.contains(&index)))
}

fn folds(dataset: &Dataset, count: usize, random: &mut Random) -> Result<Vec<Split>, SplitError> {
    if count < 2 {
        return Err(SplitError::Parts { count });
    }
    let mut fold_of: HashMap<&str, usize> = HashMap::new();
    for (vehicle, mut states) in states(dataset) {
        if states.len() < count {
            let (vehicle, found) = (vehicle.to_owned(), states.len());
            return Err(SplitError::TooFew {
                vehicle,
                found,
                what: "cases of different states",
                needed: count,
            });
        }
        random.fork().shuffle(&mut states);
        let dealt = states.into_iter().enumerate();
        fold_of.extend(dealt.flat_map(|(i, cases)| cases.into_iter().map(move |case| (case, i % count))));
    }
    let fold = |number: usize| {
        let name = format!("group {} of {count}", number + 1);
        Split::new(name, dataset, |_, sample| fold_of[sample.case.as_str()] == number)
    };
    Ok((0..count).map(fold).collect())
}

fn by_vehicle(dataset: &Dataset) -> Result<Vec<Split>, SplitError> {
    let states = states(dataset);
    if let (1, Some(vehicle)) = (states.len(), states.keys().next()) {
        return Err(SplitError::OneVehicle { vehicle: (*vehicle).to_owned() });
    }
    let without = |vehicle: &&str| {
        let name = format!("vehicle {vehicle}");
        Split::new(name, dataset, |_, sample| sample.vehicle == **vehicle)
    };
    Ok(states.keys().map(without).collect())
}

/// What the parts are made by.
struct Quantity<'a> {
    name: &'static str,
    of: &'a dyn Fn(&Sample) -> Option<f64>,
}

/// Equal parts of the range of a quantity, each held out in turn. A case that has no value of it is never held out.
fn ranges(dataset: &Dataset, bins: usize, quantity: &Quantity<'_>) -> Result<Vec<Split>, SplitError> {
    if !(2..=MOST_PARTS).contains(&bins) {
        return Err(SplitError::Parts { count: bins });
    }
    let mut part_of: HashMap<&str, usize> = HashMap::new();
    let mut names = vec![Vec::new(); bins];
    for vehicle in states(dataset).into_keys() {
        let values = case_means(dataset, vehicle, quantity);
        let (min, max) = values.values().fold((f64::MAX, f64::MIN), |(a, b), &x| (a.min(x), b.max(x)));
        if max - min < 1e-9 * max.abs() || values.is_empty() {
            let (vehicle, quantity) = (vehicle.to_owned(), quantity.name);
            return Err(SplitError::Constant { vehicle, quantity, value: max });
        }
        let width = (max - min) / bins as f64;
        let part = |value: f64| (((value - min) / width) as usize).min(bins - 1);
        part_of.extend(values.iter().map(|(case, &value)| (*case, part(value))));
        for (index, name) in names.iter_mut().enumerate() {
            let edge = |index: usize| min + width * index as f64;
            name.push(format!("{:.4} to {:.4} ({vehicle})", edge(index), edge(index + 1)));
        }
    }
    let mut splits = Vec::new();
    for (index, name) in names.into_iter().enumerate() {
        let name = format!("{} {}", quantity.name, name.join(", "));
        let split = Split::new(name, dataset, |_, s| part_of.get(s.case.as_str()) == Some(&index));
        if split.held_out.is_empty() {
            return Err(SplitError::EmptyPart { name: split.name });
        }
        splits.push(split);
    }
    Ok(splits)
}

/// Mean of a quantity over the samples of each case of a vehicle.
fn case_means<'a>(dataset: &'a Dataset, vehicle: &str, quantity: &Quantity<'_>) -> BTreeMap<&'a str, f64> {
    let mut sums: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
    for sample in dataset.samples.iter().filter(|sample| sample.vehicle == vehicle) {
        if let Some(value) = (quantity.of)(sample) {
            let (sum, count) = sums.entry(&sample.case).or_default();
            (*sum, *count) = (*sum + value, *count + 1.0);
        }
    }
    sums.into_iter().map(|(case, (sum, count))| (case, sum / count)).collect()
}
