//! The ranges of the states of one vehicle: the source paper's parameter table, and a Latin hypercube over it.

use serde::{Deserialize, Serialize};

use crate::random::Random;
use wade_core::condition::Condition;
use wade_core::domain::{Domain, Range};
use wade_core::frame::Vec3;

/// Room for the tilt [rad], heave [m/s] and turning [rad/s] of a vehicle that is level, planar and straight but for noise.
pub(crate) const TILT: f64 = 0.01;
pub(crate) const HEAVE: f64 = 0.05;
pub(crate) const TURN: f64 = 0.05;

/// The parameter table of one vehicle; level, planar motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterTable {
    /// Speed through the water [m/s].
    pub speed_mps: Range,
    /// Flow angle [degrees]: 90 head-on, 0 from the side.
    pub angle_deg: Range,
    /// Density [kg/m3].
    pub density_kgpm3: Range,
    /// Depth [m].
    pub depth_m: Range,
}

impl ParameterTable {
    /// The paper's table for the Husky.
    pub const HUSKY: Self = Self::paper(Range { min: 0.2, max: 1.0 }, Range { min: 0.06, max: 0.20 });
    /// The paper's table for the Warthog.
    pub const WARTHOG: Self = Self::paper(Range { min: 0.5, max: 4.0 }, Range { min: 0.10, max: 0.40 });

    const fn paper(speed_mps: Range, depth_m: Range) -> Self {
        let angle_deg = Range { min: 30.0, max: 90.0 };
        Self { speed_mps, angle_deg, density_kgpm3: Range { min: 1000.0, max: 1900.0 }, depth_m }
    }

    /// True where every range is, speed and density are positive, and depth is not negative.
    pub fn is_valid(&self) -> bool {
        let ranges = [self.speed_mps, self.angle_deg, self.density_kgpm3, self.depth_m];
        let positive = self.speed_mps.min > 0.0 && self.density_kgpm3.min > 0.0 && self.depth_m.min >= 0.0;
        ranges.iter().all(|r| r.is_valid()) && positive
    }

    /// The training domain: the table, with room for the tilt, heave and turning of a vehicle that is level, planar
    /// and straight but for noise.
    pub fn domain(&self) -> Domain {
        let radians = |degrees: f64| degrees.to_radians();
        Domain {
            speed_mps: self.speed_mps,
            angle_rad: Range { min: radians(self.angle_deg.min), max: radians(self.angle_deg.max) },
            density_kgpm3: self.density_kgpm3,
            depth_m: self.depth_m,
            tilt_rad: Range { min: 0.0, max: TILT },
            vertical_speed_mps: Range { min: -HEAVE, max: HEAVE },
            angular_speed_radps: Range { min: 0.0, max: TURN },
        }
    }

    /// `count` cases, one in each of `count` equal strata of every variable, at a random place in it (McKay, Beckman,
    /// Conover, Technometrics 1979).
    pub fn latin_hypercube(&self, count: usize, random: &mut Random) -> Vec<Condition> {
        let axes = [self.speed_mps, self.angle_deg, self.density_kgpm3, self.depth_m];
        let [speed, angle, density, depth] = axes.map(|range| strata(range, count, random));
        (0..count).map(|i| case(speed[i], angle[i].to_radians(), density[i], depth[i])).collect()
    }
}

fn strata(range: Range, count: usize, random: &mut Random) -> Vec<f64> {
    let width = (range.max - range.min) / count as f64;
    let order = random.permutation(count);
    order.into_iter().map(|stratum| range.min + width * (stratum as f64 + random.unit())).collect()
}

fn case(speed: f64, angle: f64, density: f64, depth: f64) -> Condition {
    Condition { density, ..Condition::level(Vec3::new(angle.sin(), angle.cos(), 0.0) * speed, depth) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(seed: u64) -> Vec<Condition> {
        ParameterTable::HUSKY.latin_hypercube(175, &mut Random::new(seed))
    }

    #[test]
    fn hits_each_stratum_of_each_variable_once() {
        let cases = plan(3);
        let check = |range: Range, value: &dyn Fn(&Condition) -> f64| {
            let stratum = |c: &Condition| ((value(c) - range.min) / (range.max - range.min) * 175.0) as usize;
            let mut strata: Vec<usize> = cases.iter().map(stratum).collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..175).collect::<Vec<_>>());
        };
        check(ParameterTable::HUSKY.speed_mps, &|c| c.velocity.norm());
        check(ParameterTable::HUSKY.angle_deg, &|c| c.velocity.x.atan2(c.velocity.y).to_degrees());
        check(ParameterTable::HUSKY.density_kgpm3, &|c| c.density);
        check(ParameterTable::HUSKY.depth_m, &|c| c.depth);
    }

    #[test]
    fn a_seed_gives_its_plan_and_no_other() {
        assert_eq!(plan(7), plan(7));
        assert_ne!(plan(7), plan(8));
    }

    #[test]
    fn every_case_is_inside_the_domain() {
        let domain = ParameterTable::HUSKY.domain();
        assert!(plan(1).iter().all(|case| domain.outside(case).is_inside()));
    }
}
