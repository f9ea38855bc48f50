//! Rounds of the set `drive`: any course, attitude, water level and bed share, in cases that are few enough to be computed and
//! collected round by round.
//!
//! A round of `n` cases has one case in each of `n` equal strata of every quantity (McKay, Beckman, Conover, Technometrics
//! 1979), so that each round covers all of them. Within its stratum a value moves from round to round by the golden ratio, so
//! that the rounds together are even too. Of many such rounds the one is taken whose closest two cases are farthest apart
//! (maximin; Johnson, Moore, Ylvisaker, J. Stat. Plan. Inference 1990).

use super::placement::Placement;
use super::plan::{Bed, Case, Ground, Plan, Set};
use crate::random::Random;
use wade_core::condition::FRESH_WATER;
use wade_core::domain::Range;
use wade_core::frame::WaterPlane;
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::vehicle::Vehicle;

/// Course of the vehicle through the water [degrees].
const HEADING_DEG: Range = Range { min: -180.0, max: 180.0 };
/// Pitch [degrees].
const PITCH_DEG: Range = Range { min: -20.0, max: 20.0 };
/// Roll [degrees].
const ROLL_DEG: Range = Range { min: -15.0, max: 15.0 };
/// Least speed over that of the table: a slower case takes hours.
const LEAST_SPEED: f64 = 0.1;
/// Distance of the lowest point from the bed where it is off the bed [m]; its logarithm is what is even.
const CLEARANCE_M: Range = Range { min: 0.02, max: 1.0 };
/// Density of the heavier fluids [kg/m3].
const HEAVY_KGPM3: Range = Range { min: 1300.0, max: 1900.0 };
/// Water over the lowest point of the hull, and over the head of a ramp, at least, in lengths of the vehicle.
const FIRST_WETTING: f64 = 0.04;
const OVER_RAMP: f64 = 0.06;

/// Shares of the cases: over a bed that goes with the water, over one that goes with the vehicle, off the bed, on a ramp, in a
/// heavier fluid.
const MOVING: f64 = 0.5;
const PARKED: f64 = 0.3;
const LIFTED: f64 = 0.2;
const RAMPS: f64 = 0.15;
const HEAVY: f64 = 0.125;
/// New cases for one that is repeated.
const PER_REPEAT: usize = 5;

/// Designs of a round of which one is taken.
const DESIGNS: usize = 500;
/// Quantities of a design: speed, heading, level, pitch, roll, then clearance, bed share and density of those that have one.
const AXES: usize = 8;
/// Quantities that every case has.
const SHARED: usize = 5;
/// Fraction of the golden ratio.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl Plan {
    /// Adds a round of `count` cases, and after them for every five one of `repeats` that no round has repeated yet: cases of
    /// another campaign that had not settled.
    pub fn add_round(&mut self, vehicle: &Vehicle, count: usize, seed: u64, repeats: &[Case]) {
        let round = self.cases.iter().map(|case| case.round).max().unwrap_or(0) + 1;
        let number = |case: &Case| case.id.rsplit('-').next()?.parse::<usize>().ok();
        let is_new = |case: &&Case| case.set == Set::Drive && !case.id.contains(REPEATED);
        let first = self.cases.iter().filter(is_new).filter_map(number).max().map_or(0, |last| last + 1);
        let before = self.cases.iter().filter(is_new).count();
        let top_speed = self.campaign.table.speed_mps.max;
        let name =
            self.campaign.vehicle.bytes().fold(seed, |sum, byte| sum.wrapping_mul(31) + u64::from(byte));
        let design = Design { first, top_speed, ..Design::new(count, round, before, name) };
        let new = (0..count).map(|i| design.case(vehicle, i));
        let new: Vec<Case> = new.collect();
        let known = |case: &Case| self.cases.iter().any(|planned| planned.id == case.id);
        let again = repeats.iter().map(|case| repeated(case, round)).filter(|case| !known(case));
        let again: Vec<Case> = again.take(count / PER_REPEAT).collect();
        self.cases.extend(new);
        self.cases.extend(again);
    }
}

/// What stands in the name of a case of another set.
const REPEATED: &str = "-drive-paper-";

/// A case of the set `paper` as one of a round.
fn repeated(case: &Case, round: u32) -> Case {
    let id = case.id.replacen("-paper-", REPEATED, 1);
    Case { id, set: Set::Drive, bed_share: Some(case.share_of_bed()), round, ..case.clone() }
}

/// How many of the first `count` cases belong to a share of all.
fn quota(share: f64, count: usize) -> usize {
    (share * count as f64 - 1e-9).ceil() as usize
}

/// One round: a place from 0 to 1 of each case in each quantity, and which cases are of which kind.
struct Design {
    round: u32,
    /// Number of the first case.
    first: usize,
    /// Greatest speed [m/s].
    top_speed: f64,
    places: [Vec<f64>; AXES],
    moving: Vec<usize>,
    parked: Vec<usize>,
    lifted: Vec<usize>,
    ramps: Vec<usize>,
    heavy: Vec<usize>,
}

impl Design {
    fn new(count: usize, round: u32, before: usize, seed: u64) -> Self {
        // the same offsets for every round, other orders for each
        let mut offsets = Random::new(seed);
        let offsets: [f64; AXES] = std::array::from_fn(|_| offsets.unit());
        let mut random = Random::new(seed ^ (u64::from(round) << 32));
        let due = |share: f64| quota(share, before + count) - quota(share, before);
        let mut kinds = |counts: [usize; 2]| {
            let order = random.permutation(count);
            let (one, rest) = order.split_at(counts[0].min(count));
            (one.to_vec(), rest[..counts[1].min(rest.len())].to_vec())
        };
        let (moving, parked) = kinds([due(MOVING), due(PARKED)]);
        let (lifted, mut ramps) = kinds([due(LIFTED), count]);
        // a current chokes over the head of a ramp: there the water is still
        ramps.retain(|index| moving.contains(index));
        ramps.truncate(due(RAMPS));
        let (heavy, _) = kinds([due(HEAVY), 0]);
        let between = count - moving.len() - parked.len();
        let sizes = [count, count, count, count, count, lifted.len(), between, heavy.len()];
        let mut draw = || -> [Vec<f64>; AXES] {
            std::array::from_fn(|axis| {
                let inside = (offsets[axis] + f64::from(round) * GOLDEN).fract();
                let order = random.permutation(sizes[axis]);
                order.into_iter().map(|stratum| (stratum as f64 + inside) / sizes[axis] as f64).collect()
            })
        };
        let mut best = draw();
        for _ in 1..DESIGNS {
            let other = draw();
            if closest(&other) > closest(&best) {
                best = other;
            }
        }
        Self { round, first: 0, top_speed: 1.0, places: best, moving, parked, lifted, ramps, heavy }
    }

    fn case(&self, vehicle: &Vehicle, index: usize) -> Case {
        let [speed, heading, level, pitch, roll, clearance, share, density] = &self.places;
        let within = |range: Range, place: f64| range.min + place * (range.max - range.min);
        let position = |kind: &[usize]| kind.iter().position(|&other| other == index);
        let speeds = Range { min: LEAST_SPEED * self.top_speed, max: self.top_speed };
        let bed_share = if position(&self.moving).is_some() {
            1.0
        } else if position(&self.parked).is_some() {
            0.0
        } else {
            let fixed = |other: &usize| self.moving.contains(other) || self.parked.contains(other);
            let rank = (0..index).filter(|other| !fixed(other)).count();
            rounded(share[rank].clamp(0.01, 0.99), 2)
        };
        let logarithms = Range { min: CLEARANCE_M.min.ln(), max: CLEARANCE_M.max.ln() };
        let clearance_m =
            position(&self.lifted).map_or(0.0, |rank| rounded(within(logarithms, clearance[rank]).exp(), 3));
        let density_kgpm3 =
            position(&self.heavy).map_or(FRESH_WATER, |rank| rounded(within(HEAVY_KGPM3, density[rank]), 0));
        let ground = if position(&self.ramps).is_some() { Ground::Ramp } else { Ground::Flat };
        let name = &vehicle.name;
        let mut case = Case {
            heading_deg: rounded(within(HEADING_DEG, heading[index]), 1),
            density_kgpm3,
            roll_deg: rounded(within(ROLL_DEG, roll[index]), 1),
            pitch_deg: rounded(within(PITCH_DEG, pitch[index]), 1),
            bed: if bed_share > 0.0 { Bed::Driving } else { Bed::Parked },
            bed_share: Some(bed_share),
            clearance_m,
            ground,
            round: self.round,
            ..Case::steady(
                name,
                Set::Drive,
                self.first + index,
                rounded(within(speeds, speed[index]), 3),
                0.0,
            )
        };
        // on a steep ramp the vehicle may float before its last wheel is in the water
        let mut depths = depths(vehicle, &case);
        while depths.min >= depths.max && ground == Ground::Ramp {
            case.pitch_deg = rounded(0.9 * case.pitch_deg, 1);
            case.roll_deg = rounded(0.9 * case.roll_deg, 1);
            depths = self::depths(vehicle, &case);
        }
        case.depth_m = rounded(within(depths, level[index]), 4);
        case
    }
}

/// Smallest distance of two cases of a design.
fn closest(places: &[Vec<f64>; AXES]) -> f64 {
    let count = places[0].len();
    let distance = |i: usize, j: usize| {
        let of_axis = |axis: &Vec<f64>| (axis[i] - axis[j]).powi(2);
        places[..SHARED].iter().map(of_axis).sum::<f64>()
    };
    let pairs = (0..count).flat_map(|i| (0..i).map(move |j| (i, j)));
    pairs.map(|(i, j)| distance(i, j)).fold(f64::INFINITY, f64::min)
}

/// Depths at the body origin from first wetting to afloat [m], in the attitude, on the ground and in the fluid of a case; below
/// zero where a tilted hull gets wet below its origin.
pub fn depths(vehicle: &Vehicle, case: &Case) -> Range {
    let length = vehicle.dimensions.length;
    let up = case.up();
    // heights along up from the body origin
    let heights = || vehicle.hull.mesh.vertices.iter().map(|vertex| up.dot(vertex));
    let (lowest, highest) =
        (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    let placement = Placement::new(vehicle, case);
    let first = match placement.ramp {
        Some(ramp) => ramp.top() + OVER_RAMP * length - placement.origin.z,
        None => lowest + FIRST_WETTING * length,
    };
    let depth = |level: f64| level / up.z - vehicle.z0;
    Range { min: depth(first), max: depth(afloat(vehicle, case, [lowest, highest])) }
}

/// Height of the water level at which the vehicle floats in its attitude, along up from the body origin [m]; its top where it
/// sinks.
fn afloat(vehicle: &Vehicle, case: &Case, [mut sinks, mut floats]: [f64; 2]) -> f64 {
    let volume = |level: f64| {
        let plane = WaterPlane { normal: case.up(), offset: level };
        hydrostatics(&vehicle.hull.mesh, &plane, case.density_kgpm3, &vehicle.center_of_mass).displaced_volume
    };
    while floats - sinks > 1e-5 {
        let level = 0.5 * (sinks + floats);
        if volume(level) * case.density_kgpm3 < vehicle.mass { sinks = level } else { floats = level }
    }
    floats
}

fn rounded(value: f64, digits: i32) -> f64 {
    let unit = 10_f64.powi(digits);
    (value * unit).round() / unit
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::collections::BTreeSet;

    use super::super::plan::empty;
    use super::*;
    use wade_core::vehicle::shipped;

    fn rounds(count: usize, seed: u64) -> (Vehicle, Plan) {
        let vehicle = shipped::warthog().unwrap().vehicle().unwrap();
        let mut plan = empty();
        let old = |i| Case::steady("warthog", Set::Paper, i, 1.0, 0.2);
        let repeats: Vec<Case> = (0..3).map(old).collect();
        for _ in 0..count {
            plan.add_round(&vehicle, 10, seed, &repeats);
        }
        (vehicle, plan)
    }

    #[test]
    fn each_round_has_one_case_in_each_stratum() {
        let (_, plan) = rounds(3, 1);
        for round in 1..=3 {
            let cases: Vec<&Case> =
                plan.cases.iter().filter(|c| c.round == round && !c.id.contains(REPEATED)).collect();
            assert_eq!(cases.len(), 10);
            let strata = |value: &dyn Fn(&Case) -> f64, range: Range| -> BTreeSet<usize> {
                let place = |case: &&Case| (value(case) - range.min) / (range.max - range.min);
                cases.iter().map(|case| (10.0 * place(case) + 1e-3) as usize).collect()
            };
            assert_eq!(strata(&|c| c.heading_deg, HEADING_DEG).len(), 10, "round {round}");
            assert_eq!(strata(&|c| c.speed_mps, Range { min: 0.4, max: 4.0 }).len(), 10);
            // a steep ramp may be made less so
            assert!(strata(&|c| c.pitch_deg, PITCH_DEG).len() >= 9);
        }
    }

    #[test]
    fn fifteen_rounds_have_the_shares_of_the_plan() {
        let (_, plan) = rounds(15, 1);
        let new: Vec<&Case> = plan.cases.iter().filter(|c| !c.id.contains(REPEATED)).collect();
        let count = |is: &dyn Fn(&Case) -> bool| new.iter().filter(|case| is(case)).count();
        assert_eq!(new.len(), 150);
        assert_eq!(count(&|c| c.bed_share == Some(1.0)), 75);
        assert_eq!(count(&|c| c.bed_share == Some(0.0)), 45);
        assert_eq!(count(&|c| c.clearance_m > 0.0), 30);
        assert!(new.iter().all(|c| c.clearance_m == 0.0 || (0.02..=1.0).contains(&c.clearance_m)));
        assert_eq!(count(&|c| c.ground == Ground::Ramp), 23);
        assert!(new.iter().all(|c| c.ground == Ground::Flat || c.bed_share == Some(1.0)));
        assert_eq!(count(&|c| c.density_kgpm3 > 1299.0), 19);
        let ids: BTreeSet<&str> = plan.cases.iter().map(|case| case.id.as_str()).collect();
        assert_eq!(ids.len(), plan.cases.len());
        assert_eq!(plan.cases.len(), 153, "each old case is repeated once");
        let folder = tempfile::tempdir().unwrap();
        plan.write(folder.path()).unwrap();
        assert_eq!(Plan::read(folder.path()).unwrap(), plan);
    }

    #[test]
    fn a_seed_gives_its_rounds_and_a_later_round_changes_none() {
        let cases = |count, seed| rounds(count, seed).1.cases;
        let (two, three) = (cases(2, 7), cases(3, 7));
        assert_eq!(cases(3, 7), three);
        assert_eq!(two[..], three[..two.len()]);
        assert_ne!(cases(1, 8), cases(1, 7));
    }

    #[test]
    fn every_hull_is_wet_and_none_is_held_under_the_water_in_which_it_floats() {
        let (vehicle, plan) = rounds(6, 3);
        for case in plan.cases.iter().filter(|c| !c.id.contains(REPEATED)) {
            let condition = case.condition(1.0, 0.0);
            let plane = condition.water_plane(vehicle.z0);
            let under =
                hydrostatics(&vehicle.hull.mesh, &plane, 1.0, &vehicle.center_of_mass).displaced_volume;
            let most = vehicle.mass / case.density_kgpm3;
            assert!(under > 0.0 && under < 1.01 * most, "{case:?}: {under} of {most} m3");
            let placement = Placement::new(&vehicle, case);
            let shallowest = placement.ramp.map_or(0.0, |ramp| ramp.top());
            assert!(placement.water_level > shallowest + 0.05, "{case:?}");
        }
    }
}
