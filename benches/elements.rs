//! Error against cost of the elements on which the physical base computes drag: by their number, the time of an evaluation, and
//! how far force and moment are from those of the finest division. Nothing here fails on a time.
//!
//! `cargo bench --bench elements [-- --out benches/results]` prints a table, and writes it as CSV with machine and commit.

#[path = "../tests/common/bundles.rs"]
mod bundles;
#[allow(dead_code, reason = "the other benches time calls")]
mod common;

use std::hint::black_box;
use std::time::Instant;

use bundles::{Numbers, VEHICLES, model};
use nalgebra::UnitVector3;
use wade_core::condition::Condition;
use wade_core::frame::Vec3;
use wade_core::physics::STATED_NONE;
use wade_core::physics::drag::{Drag, SurfaceDrag};
use wade_core::physics::elements::elements;
use wade_core::vehicle::Vehicle;
use wade_core::wrench::Wrench;

/// Elements aimed at; the last is the reference.
const COUNTS: [usize; 7] = [64, 128, 256, 512, 1024, 2048, 8192];
/// States of the comparison: any attitude, level, velocity and rate.
const STATES: usize = 2_000;
/// Turns of the timing through all states.
const TURNS: usize = 7;

fn states(vehicle: &Vehicle) -> Vec<Condition> {
    let mut numbers = Numbers::new(3);
    let size = vehicle.dimensions.length;
    let mut vector = |most: f64| Vec3::from_fn(|_, _| f64::from(numbers.between(-1.0, 1.0)) * most);
    (0..STATES)
        .map(|_| {
            let (velocity, up, level) = (vector(2.0), vector(1.0), vector(0.3 * size).x);
            Condition {
                angular_velocity: vector(1.0),
                up: UnitVector3::new_normalize(up + Vec3::z() * 1e-3),
                water_level: Some(level),
                ..Condition::level(velocity, 0.0)
            }
        })
        .collect()
}

struct Divided {
    drag: Drag,
    loads: Vec<SurfaceDrag>,
    z0: f64,
}

impl Divided {
    fn new(vehicle: &Vehicle, count: usize) -> Self {
        let loads = vec![SurfaceDrag::default(); vehicle.surfaces.len()];
        Self { drag: Drag::new(vehicle, &elements(vehicle, count)), loads, z0: vehicle.z0 }
    }

    fn wrench(&mut self, state: &Condition) -> Wrench {
        let speeds = &STATED_NONE[..self.loads.len()];
        self.drag.evaluate(&state.water_plane(self.z0), state, speeds, &mut self.loads);
        self.loads.iter().fold(Wrench::default(), |sum, load| sum + load.load)
    }

    /// Median over the turns of the mean time of an evaluation [us].
    fn cost(&mut self, states: &[Condition]) -> f64 {
        let mut turns: Vec<f64> = (0..TURNS)
            .map(|_| {
                let start = Instant::now();
                states.iter().for_each(|state| {
                    black_box(self.wrench(state));
                });
                start.elapsed().as_secs_f64() * 1e6 / states.len() as f64
            })
            .collect();
        turns.sort_by(f64::total_cmp);
        turns[TURNS / 2]
    }
}

fn main() {
    let mut csv =
        format!("# {}\nvehicle,elements,evaluated,us,force,force_p90,moment,moment_p90\n", common::machine());
    for name in VEHICLES {
        let model = model(name);
        let vehicle = model.vehicle();
        let states = states(vehicle);
        let mut finest = Divided::new(vehicle, COUNTS[COUNTS.len() - 1]);
        let reference: Vec<Wrench> = states.iter().map(|state| finest.wrench(state)).collect();
        for count in COUNTS {
            let mut divided = Divided::new(vehicle, count);
            let answers: Vec<Wrench> = states.iter().map(|state| divided.wrench(state)).collect();
            let share = |size: fn(&Wrench) -> Vec3| {
                let error = |(answer, right): (&Wrench, &Wrench)| {
                    let right = size(right);
                    (right.norm() > 1e-6).then(|| (size(answer) - right).norm() / right.norm())
                };
                let mut errors: Vec<f64> = answers.iter().zip(&reference).filter_map(error).collect();
                errors.sort_by(f64::total_cmp);
                [0.5, 0.9].map(|quantile| errors[(errors.len() as f64 * quantile) as usize])
            };
            let [force, moment] = [share(|wrench| wrench.force), share(|wrench| wrench.moment)];
            let cost = divided.cost(&states);
            let row = format!(
                "{name},{count},{},{cost:.2},{:.4},{:.4},{:.4},{:.4}",
                divided.drag.len(),
                force[0],
                force[1],
                moment[0],
                moment[1]
            );
            println!("{row}");
            csv += &row;
            csv.push('\n');
        }
    }
    common::write("elements", &csv);
}
