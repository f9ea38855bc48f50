//! Which cases a set has: hypercubes, twins and lists.

use std::collections::BTreeSet;

use super::plan::{Bed, Case, Plan, PlanError, Set};
use crate::parameter_table::ParameterTable;
use crate::random::Random;
use wade_core::domain::Range;

impl Plan {
    /// Adds cases of a set; no name and no state is repeated, and the earlier ones stay as they are.
    pub fn extend(&mut self, set: Set, count: usize, seed: u64, float_depth: f64) -> Result<(), PlanError> {
        // two vehicles of one seed get two plans
        let name =
            self.campaign.vehicle.bytes().fold(0_u64, |sum, byte| sum.wrapping_mul(31) + u64::from(byte));
        let mut random = Random::new(seed ^ name);
        let fresh = match set {
            Set::Paper => self.hypercube(set, count, &paper_ranges(&self.campaign.table), &mut random),
            Set::Wide => {
                self.hypercube(set, count, &wide_ranges(&self.campaign.table, float_depth), &mut random)
            }
            Set::Driving => self.twins(count)?,
            Set::Unsteady => self.surges(),
            Set::Check => self.checks(),
            Set::Mesh => self.finest(),
            Set::Ahead => self.ahead(),
            // its rounds need the hull
            Set::Drive => Vec::new(),
        };
        for case in fresh {
            // a table of one depth asks for each state of a list several times
            if !self.cases.iter().any(|known| known.id == case.id || known.is_same_state(&case)) {
                self.cases.push(case);
            }
        }
        Ok(())
    }

    fn of(&self, set: Set) -> impl Iterator<Item = &Case> {
        self.cases.iter().filter(move |case| case.set == set)
    }

    fn hypercube(&self, set: Set, count: usize, ranges: &[Range; 6], random: &mut Random) -> Vec<Case> {
        let taken: Vec<[f64; 6]> = self.of(set).map(coordinates).collect();
        // rows may have been taken out of the middle
        let number = |case: &Case| case.id.rsplit('-').next()?.parse::<usize>().ok();
        let first = self.of(set).filter_map(number).max().map_or(0, |last| last + 1);
        let axes: Vec<Vec<f64>> = (0..6)
            .map(|axis| {
                let taken: Vec<f64> = taken.iter().map(|point| point[axis]).collect();
                free_strata(ranges[axis], &taken, count, random)
            })
            .collect();
        (0..count)
            .map(|i| {
                let [speed, heading, depth, density, roll, pitch] = std::array::from_fn(|axis| axes[axis][i]);
                Case {
                    heading_deg: heading,
                    density_kgpm3: density,
                    roll_deg: roll,
                    pitch_deg: pitch,
                    ..Case::steady(&self.campaign.vehicle, set, first + i, speed, depth)
                }
            })
            .collect()
    }

    /// The steady cases that move most nearly straight ahead, as vehicles drive, once more with a driving bed.
    fn twins(&self, count: usize) -> Result<Vec<Case>, PlanError> {
        let twin = |case: &Case| {
            let origin = match case.set {
                Set::Paper => String::new(),
                set => format!("{set}-"),
            };
            let id = case.id.replacen(&format!("-{}-", case.set), &format!("-{}-{origin}", Set::Driving), 1);
            Case { id, set: Set::Driving, bed: Bed::Driving, ..case.clone() }
        };
        let known = |twin: &Case| self.cases.iter().any(|case| case.is_same_state(twin));
        let moves = |case: &&Case| case.speed_mps > 0.0 && case.cell_scale == 1.0;
        let steady = Set::TWINNED.into_iter().flat_map(|set| self.of(set));
        let mut free: Vec<Case> = steady.filter(moves).map(twin).filter(|twin| !known(twin)).collect();
        if free.len() < count {
            return Err(PlanError::NoTwin { available: free.len(), wanted: count });
        }
        free.sort_by(|a, b| a.heading_deg.abs().total_cmp(&b.heading_deg.abs()));
        free.truncate(count);
        Ok(free)
    }

    /// Ramps of the speed at three depths, up and down, gentle and hard; head-on, and one broadside. And from rest and to it, where
    /// neither drag nor waves hide what the acceleration does: below Fr_h = 1 at every depth, the last four below the speed at
    /// which a channel chokes, within 60 degrees of ahead.
    fn surges(&self) -> Vec<Case> {
        let ParameterTable { speed_mps, depth_m, .. } = self.campaign.table;
        let depth = |share: f64| depth_m.min + share * (depth_m.max - depth_m.min);
        let (slow, fast) = (0.25 * speed_mps.max, 0.5 * speed_mps.max);
        let moving = [
            (slow, fast, 1.0, 0.0),
            (fast, slow, 1.0, 0.0),
            (slow, fast, 0.5, 0.0),
            (slow, fast, 2.0, 0.0),
            (slow, fast, 1.0, 90.0),
        ];
        let from_rest = [(0.0, slow, 1.0, 0.0), (0.0, slow, 0.5, 0.0), (0.0, slow, 1.0, 60.0)];
        let creep = 0.5 * slow;
        let gentle = [
            (0.0, creep, 0.5, 0.0),
            (creep, 0.0, 0.5, 0.0),
            (0.0, creep, 0.5, 60.0),
            (creep, 0.0, 0.5, 30.0),
        ];
        let depths = [0.33, 0.67, 1.0].map(depth);
        let at_each = |ramps: &[(f64, f64, f64, f64)]| {
            depths.iter().flat_map(|depth| ramps.iter().map(|ramp| (*depth, *ramp))).collect::<Vec<_>>()
        };
        // later ramps at the end: a case keeps its number
        [at_each(&moving), at_each(&from_rest), at_each(&gentle)]
            .concat()
            .into_iter()
            .enumerate()
            .map(|(i, (depth, (from, to, ramp_s, heading_deg)))| Case {
                end_speed_mps: to,
                ramp_s,
                heading_deg,
                ..Case::steady(&self.campaign.vehicle, Set::Unsteady, i, from, depth)
            })
            .collect()
    }

    /// At rest at three depths; head-on at two speeds for each; one of them on three meshes.
    fn checks(&self) -> Vec<Case> {
        let speed = self.campaign.table.speed_mps.max;
        let depths = self.trial_depths();
        let speeds = [0.0, 0.25 * speed, 0.5 * speed];
        let states = depths.iter().flat_map(|&depth| speeds.map(|speed| (speed, depth, 1.0)));
        let meshes = [0.72, 0.5].map(|scale| (speeds[2], depths[1], scale));
        states
            .chain(meshes)
            .enumerate()
            .map(|(i, (speed, depth, cell_scale))| Case {
                cell_scale,
                ..Case::steady(&self.campaign.vehicle, Set::Check, i, speed, depth)
            })
            .collect()
    }

    /// The check's state of several meshes on cells 0.36 times as long, and in a channel half as large again.
    fn finest(&self) -> Vec<Case> {
        let speed = 0.5 * self.campaign.table.speed_mps.max;
        let [_, depth, _] = self.trial_depths();
        let case = |number| Case::steady(&self.campaign.vehicle, Set::Mesh, number, speed, depth);
        vec![Case { cell_scale: 0.36, ..case(0) }, Case { channel_scale: 1.5, ..case(1) }]
    }

    /// Straight ahead at quarters of the highest speed: what the checks leave out at their depths, and all of it at
    /// three depths between and above them.
    fn ahead(&self) -> Vec<Case> {
        let ParameterTable { speed_mps, depth_m, .. } = self.campaign.table;
        let depth = |share: f64| depth_m.min + share * (depth_m.max - depth_m.min);
        let between = [1.0 / 6.0, 0.75, 1.0].map(|share| (depth(share), [0.25, 0.5, 0.75, 1.0].as_slice()));
        let checked = self.trial_depths().map(|depth| (depth, [0.75, 1.0].as_slice()));
        checked
            .into_iter()
            .chain(between)
            .flat_map(|(depth, shares)| shares.iter().map(move |share| (depth, share * speed_mps.max)))
            .enumerate()
            .map(|(i, (depth, speed))| Case::steady(&self.campaign.vehicle, Set::Ahead, i, speed, depth))
            .collect()
    }

    /// The depths of the paper's trials with the Warthog, and the same shares of the table for other vehicles.
    fn trial_depths(&self) -> [f64; 3] {
        let Range { min, max } = self.campaign.table.depth_m;
        let inch = 0.0254;
        [4.0, 8.0, 10.0].map(|inches: f64| min + (inches * inch - 0.10) / 0.30 * (max - min))
    }
}

fn coordinates(case: &Case) -> [f64; 6] {
    [case.speed_mps, case.heading_deg, case.depth_m, case.density_kgpm3, case.roll_deg, case.pitch_deg]
}

const ZERO: Range = Range { min: 0.0, max: 0.0 };

/// Speed, heading, depth, density, roll, pitch; a flow angle of 90 degrees is a heading of 0.
fn paper_ranges(table: &ParameterTable) -> [Range; 6] {
    let heading = Range { min: 90.0 - table.angle_deg.max, max: 90.0 - table.angle_deg.min };
    [table.speed_mps, heading, table.depth_m, table.density_kgpm3, ZERO, ZERO]
}

fn wide_ranges(table: &ParameterTable, float_depth: f64) -> [Range; 6] {
    let speed = Range { min: 0.0, max: table.speed_mps.max };
    let heading = Range { min: 0.0, max: 180.0 };
    let depth = Range { min: table.depth_m.min, max: table.depth_m.max.max(float_depth) };
    let tilt = Range { min: -10.0, max: 10.0 };
    [speed, heading, depth, table.density_kgpm3, tilt, tilt]
}

/// `count` new values for an axis that has `taken`: the range in as many strata as there will be points, one new
/// value in each of `count` strata that hold none, in random order.
///
/// With nothing taken this is a Latin hypercube (McKay, Beckman, Conover, Technometrics 1979); extended it stays near
/// one (as the augmented designs of Stein, Technometrics 1987).
fn free_strata(range: Range, taken: &[f64], count: usize, random: &mut Random) -> Vec<f64> {
    let total = taken.len() + count;
    let width = (range.max - range.min) / total as f64;
    let stratum = |value: f64| if width > 0.0 { ((value - range.min) / width) as usize } else { 0 };
    let occupied: BTreeSet<usize> =
        if width > 0.0 { taken.iter().map(|v| stratum(*v)).collect() } else { BTreeSet::new() };
    let mut free: Vec<usize> = (0..total).filter(|s| !occupied.contains(s)).collect();
    random.shuffle(&mut free);
    free.truncate(count);
    free.into_iter().map(|s| range.min + width * (s as f64 + random.unit())).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::super::plan::empty;
    use super::*;

    #[test]
    fn a_seed_gives_its_plan_and_an_extension_keeps_it() {
        let (mut once, mut twice) = (empty(), empty());
        once.extend(Set::Paper, 40, 7, 0.378).unwrap();
        twice.extend(Set::Paper, 40, 7, 0.378).unwrap();
        assert_eq!(once, twice);
        twice.extend(Set::Paper, 20, 8, 0.378).unwrap();
        assert_eq!(twice.cases[..40], once.cases[..]);
        assert_eq!(twice.cases.len(), 60);
        let speeds: BTreeSet<u64> = twice.cases.iter().map(|c| c.speed_mps.to_bits()).collect();
        assert_eq!(speeds.len(), 60, "no case is repeated");
        let ids: BTreeSet<&str> = twice.cases.iter().map(|c| c.id.as_str()).collect();
        assert_eq!(ids.len(), 60);
    }

    #[test]
    fn hits_each_stratum_once_and_fills_the_gaps_when_extended() {
        let range = Range { min: 0.5, max: 4.0 };
        let mut random = Random::new(3);
        let mut values = free_strata(range, &[], 30, &mut random);
        let stratum = |v: f64, n: f64| ((v - 0.5) / 3.5 * n) as usize;
        let hit: BTreeSet<usize> = values.iter().map(|v| stratum(*v, 30.0)).collect();
        assert_eq!(hit.len(), 30);
        values.extend(free_strata(range, &values, 30, &mut random));
        let hit: BTreeSet<usize> = values.iter().map(|v| stratum(*v, 60.0)).collect();
        assert!(hit.len() >= 58, "of 60 strata {} hold a value", hit.len());
    }

    #[test]
    fn driving_twins_are_the_straightest_steady_cases_and_never_twice() {
        let mut plan = empty();
        plan.extend(Set::Paper, 10, 1, 0.378).unwrap();
        plan.extend(Set::Driving, 4, 1, 0.378).unwrap();
        plan.extend(Set::Driving, 4, 1, 0.378).unwrap();
        let twins: Vec<&Case> = plan.of(Set::Driving).collect();
        assert_eq!(twins.len(), 8);
        assert!(twins.iter().all(|c| c.bed == Bed::Driving));
        assert!(plan.extend(Set::Driving, 4, 1, 0.378).is_err());
        plan.extend(Set::Check, 0, 1, 0.378).unwrap();
        plan.extend(Set::Ahead, 0, 1, 0.378).unwrap();
        plan.extend(Set::Driving, 24, 1, 0.378).unwrap();
        let ahead: Vec<&Case> = plan.of(Set::Driving).skip(8).collect();
        assert!(ahead.iter().all(|c| c.heading_deg == 0.0 && c.speed_mps > 0.0 && c.cell_scale == 1.0));
        let ids: BTreeSet<&str> = plan.cases.iter().map(|case| case.id.as_str()).collect();
        assert_eq!(ids.len(), plan.cases.len());
        assert!(
            ids.contains("warthog-driving-ahead-0003") && ids.contains("warthog-driving-check-0001"),
            "{ids:?}"
        );
    }

    #[test]
    fn straight_ahead_no_state_is_computed_twice() {
        let mut plan = empty();
        plan.extend(Set::Check, 0, 1, 0.378).unwrap();
        plan.extend(Set::Ahead, 0, 1, 0.378).unwrap();
        let moving = |case: &&Case| case.speed_mps > 0.0 && case.cell_scale == 1.0;
        let states: Vec<[f64; 6]> = plan.cases.iter().filter(moving).map(coordinates).collect();
        assert_eq!(states.len(), 6 * 4, "six depths, four speeds");
        for (i, state) in states.iter().enumerate() {
            assert!(!states[..i].contains(state), "{state:?}");
        }
    }

    #[test]
    fn a_table_of_one_depth_plans_each_state_once() {
        let mut plan = empty();
        plan.campaign.table.depth_m = Range { min: 0.3, max: 0.3 };
        for set in [Set::Check, Set::Ahead, Set::Unsteady, Set::Check] {
            plan.extend(set, 0, 1, 0.378).unwrap();
        }
        // at rest and four speeds, two finer meshes, twelve ramps
        assert_eq!(plan.cases.len(), 1 + 4 + 2 + 12);
        assert!(plan.cases.iter().any(|case| case.id == "warthog-check-0010"), "numbers as of many depths");
    }

    #[test]
    fn a_row_taken_out_of_the_middle_makes_no_number_twice() {
        let mut plan = empty();
        plan.extend(Set::Paper, 10, 1, 0.378).unwrap();
        plan.cases.remove(4);
        plan.extend(Set::Paper, 5, 2, 0.378).unwrap();
        assert_eq!(plan.cases.len(), 14);
    }

    #[test]
    fn the_fourth_mesh_and_the_larger_channel_are_of_the_state_of_the_other_meshes() {
        let mut plan = empty();
        plan.extend(Set::Check, 0, 1, 0.378).unwrap();
        plan.extend(Set::Mesh, 0, 1, 0.378).unwrap();
        let finer: Vec<&Case> = plan.cases.iter().filter(|case| case.cell_scale != 1.0).collect();
        let scales: Vec<f64> = finer.iter().map(|case| case.cell_scale).collect();
        assert_eq!(scales, [0.72, 0.5, 0.36]);
        assert!(finer.iter().all(|case| coordinates(case) == coordinates(finer[0])));
        let larger: Vec<&Case> = plan.cases.iter().filter(|case| case.channel_scale != 1.0).collect();
        assert_eq!(
            larger.iter().map(|case| (case.cell_scale, case.channel_scale)).collect::<Vec<_>>(),
            [(1.0, 1.5)]
        );
        assert_eq!(coordinates(larger[0]), coordinates(finer[0]));
    }
}
