//! Promise: cars in floods float, slide and lose their hold near where others measured or computed it; where not, the table in
//! docs/src/results/stability.md says so. `WADE_WRITE=1` writes its figures.
//!
//! The hulls are generated from the outer dimensions of the cars: a closed tub between the wheels, a body above them, four
//! cylinders. No figure here is fitted to the publications.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::path::PathBuf;

use wade_core::condition::Condition;
use wade_core::forces::Forces;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::geometry::parametric::{Section, cylinder, loft};
use wade_core::model::{Model, Workspace};
use wade_core::physics::Base;
use wade_core::stability::{Friction, Stability, Stance};
use wade_core::vehicle::{SurfaceKind, Vehicle};

use crate::bodies::{body, radiation};

/// Outer dimensions of a car [m] and its mass [kg]: usual figures of the model, not those of the tested car, which the papers do not all
/// state.
struct Car {
    name: &'static str,
    length: f64,
    width: f64,
    height: f64,
    wheelbase: f64,
    track: f64,
    clearance: f64,
    tire: [f64; 2],
    mass: f64,
}

const YARIS: Car = Car {
    name: "Toyota Yaris",
    length: 3.75,
    width: 1.695,
    height: 1.53,
    wheelbase: 2.46,
    track: 1.47,
    clearance: 0.14,
    tire: [0.30, 0.185],
    mass: 1050.0,
};
const PATROL: Car = Car {
    name: "Nissan Patrol",
    length: 5.05,
    width: 1.94,
    height: 1.855,
    wheelbase: 2.97,
    track: 1.605,
    clearance: 0.215,
    tire: [0.39, 0.265],
    mass: 2500.0,
};
const POLO: Car = Car {
    name: "Volkswagen Polo",
    length: 3.97,
    width: 1.682,
    height: 1.462,
    wheelbase: 2.47,
    track: 1.46,
    clearance: 0.13,
    tire: [0.30, 0.185],
    mass: 1100.0,
};
/// The abstract does not say which car: these are those of a usual saloon.
const SALOON: Car = Car {
    name: "medium passenger car",
    length: 4.4,
    width: 1.75,
    height: 1.45,
    wheelbase: 2.6,
    track: 1.5,
    clearance: 0.14,
    tire: [0.31, 0.195],
    mass: 1250.0,
};

impl Car {
    fn vehicle(&self) -> Vehicle {
        let ([radius, tread], half) = (self.tire, 0.5 * self.width);
        let inside = 0.5 * (self.track - tread) - 0.03;
        let arch = 2.0 * radius + 0.05;
        let section = |z: f64, length: f64, half: f64| Section {
            z,
            x: [-0.5 * length, 0.5 * length],
            y: [-half, half],
        };
        let tub = loft(
            &[
                section(self.clearance, 0.84 * self.length, inside),
                section(arch, 0.94 * self.length, inside),
                section(arch + 0.01, 0.98 * self.length, half),
                section(0.6 * self.height, self.length, half),
                section(self.height, 0.45 * self.length, 0.7 * half),
            ],
            [0.0, 0.0],
        );
        let wheel = |x: f64, y: f64| cylinder(&Vec3::new(x, y, radius), radius, tread, 32);
        let corners = [(0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5)];
        let wheels = corners.map(|(x, y)| (wheel(x * self.wheelbase, y * self.track), SurfaceKind::Wheel));
        let parts: Vec<_> = wheels.into_iter().chain([(tub, SurfaceKind::Bottom)]).collect();
        let vehicle = body(self.name, self.mass, &parts);
        let center_of_mass = Vec3::new(0.0, 0.0, vehicle.z0 + 0.36 * self.height);
        Vehicle { center_of_mass, ..vehicle }
    }
}

struct Flood {
    model: Model,
    stance: Stance,
    workspace: Workspace,
    forces: Forces,
}

/// Deepest and fastest water that is looked at [m], [m/s].
const DEEPEST: f64 = 1.5;
const FASTEST: f64 = 6.0;

impl Flood {
    fn new(car: &Car) -> Self {
        let vehicle = car.vehicle();
        let base = Base::new(&vehicle, radiation(&vehicle));
        let stance = Stance::of(&vehicle);
        let model = Model::of_physics(vehicle, 1, base);
        Self { model, stance, workspace: Workspace::new(), forces: Forces::default() }
    }

    /// Parked in a current that comes from `heading`.
    fn stands(&mut self, depth: f64, speed: f64, heading: f64, friction: &Friction) -> Stability {
        let velocity = Vec3::new(heading.cos(), heading.sin(), 0.0) * speed;
        let condition = Condition {
            ground_velocity: Vec3::zeros(),
            bed_clearance: Some(0.0),
            stated_bed: Some(0.0),
            ..Condition::level(velocity, depth)
        };
        self.model.evaluate(&condition, &mut self.workspace, &mut self.forces);
        self.stance.stability(&self.forces, &Vec3::z_axis(), friction)
    }

    fn floats_at(&mut self) -> f64 {
        bisect(0.0, DEEPEST, |depth| self.stands(depth, 0.0, 0.0, &Friction::PUBLISHED).margins.floats < 0.0)
    }

    /// Speed from which the probability to slide is greater, across the flow; [`FASTEST`] where it never is.
    fn slides_at(&mut self, depth: f64, probability: f64) -> f64 {
        bisect(0.0, FASTEST, |speed| {
            self.stands(depth, speed, FRAC_PI_2, &Friction::PUBLISHED).chances.slides > probability
        })
    }

    /// The least of a measure of depth and speed at which the probability to slide is greater.
    fn least(&mut self, probability: f64, measure: impl Fn(f64, f64) -> f64) -> f64 {
        let floats = self.floats_at();
        let depths = (5..100).map(|i| floats * f64::from(i) / 100.0);
        let at = |depth: f64| match self.slides_at(depth, probability) {
            speed if speed >= FASTEST => f64::INFINITY,
            speed => measure(depth, speed),
        };
        depths.map(at).fold(f64::INFINITY, f64::min)
    }
}

/// Where something begins to hold, between two numbers.
fn bisect(mut low: f64, mut high: f64, mut holds: impl FnMut(f64) -> bool) -> f64 {
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if holds(middle) { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// A row of the table.
#[derive(serde::Serialize, serde::Deserialize, PartialEq, Debug)]
struct Row {
    car: String,
    quantity: String,
    published: f64,
    source: String,
    ours: Vec<f64>,
}

fn rows() -> Vec<Row> {
    let row = |car: &Car, quantity: &str, published: f64, source: &str, ours: &[f64]| Row {
        car: car.name.into(),
        quantity: quantity.into(),
        published,
        source: source.into(),
        ours: ours.iter().map(|value| (value * 1e3).round() * 1e-3).collect(),
    };
    let (mut rows, floats) = (Vec::new(), "depth at which it floats [m]");
    let smith = "Smith et al. 2017, full scale";
    for (car, published) in [(&YARIS, 0.60), (&PATROL, 0.95)] {
        rows.push(row(car, floats, published, smith, &[Flood::new(car).floats_at()]));
    }
    let al_qadami = "Al-Qadami et al. 2023, CFD";
    let mut saloon = Flood::new(&SALOON);
    rows.push(row(&SALOON, floats, 0.38, al_qadami, &[saloon.floats_at()]));
    // in the middle, and where one in twenty and nineteen in twenty slide
    const CHANCES: [f64; 3] = [0.05, 0.5, 0.95];
    let slides =
        "depth times speed at which it slides at 0.5, 0.75 and 0.9 of the depth at which it floats [m2/s]";
    let mut polo = Flood::new(&POLO);
    let flume = "flume, friction of the tires 0.32 to 0.90";
    for (car, flood, published, source) in
        [(&SALOON, &mut saloon, 0.36, al_qadami), (&POLO, &mut polo, 0.81, flume)]
    {
        let floats = flood.floats_at();
        let ours = [0.5, 0.75, 0.9].map(|share| share * floats * flood.slides_at(share * floats, 0.5));
        rows.push(row(car, slides, published, source, &ours));
    }
    for (car, depth, published) in [(&YARIS, 0.15, 1.0), (&PATROL, 0.45, 1.0)] {
        let mut flood = Flood::new(car);
        let ours = CHANCES.map(|chance| flood.slides_at(depth, chance));
        let quantity = format!("speed at which one in 20, one in 2, 19 in 20 slide in {depth} m [m/s]");
        rows.push(row(car, &quantity, published, smith, &ours));
    }
    let head = |depth: f64, speed: f64| depth + speed * speed / (2.0 * GRAVITY);
    let ours = CHANCES.map(|chance| saloon.least(chance, head));
    let kramer = "Kramer et al. 2016, flume";
    rows.push(row(
        &SALOON,
        "least total head at which one in 20, one in 2, 19 in 20 slide [m]",
        0.30,
        kramer,
        &ours,
    ));
    // Australian Rainfall and Runoff, interim criteria (Shand et al. 2011): deepest still water, and depth times speed
    for (car, deepest, most) in [(&YARIS, 0.3, 0.3), (&SALOON, 0.4, 0.45), (&PATROL, 0.5, 0.6)] {
        let mut flood = Flood::new(car);
        let (mut worst, mut lost, mut count) = (0.0_f64, 0.0, 0.0);
        for i in 1..=20 {
            for j in 0..=20 {
                let (depth, speed) = (deepest * f64::from(i) / 20.0, 3.0 * f64::from(j) / 20.0);
                if depth * speed <= most {
                    let slides = flood.stands(depth, speed, FRAC_PI_2, &Friction::PUBLISHED).chances.slides;
                    worst = worst.max(slides);
                    (lost, count) = (lost + f64::from(slides > 0.05), count + 1.0);
                }
            }
        }
        let quantity = format!(
            "limits of {deepest} m and {most} m2/s: share of states within that slide with more than 0.05, greatest probability"
        );
        rows.push(row(car, &quantity, 0.0, "Australian Rainfall and Runoff, 2011", &[lost / count, worst]));
    }
    rows
}

fn file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../benches/results/2026-11-28/floods.json")
}

#[test]
fn the_figures_of_published_floods_are_those_on_record() {
    let rows = rows();
    if std::env::var_os("WADE_WRITE").is_some() {
        let text = serde_json::to_string_pretty(&rows).expect("numbers and text");
        std::fs::create_dir_all(file().parent().expect("a folder")).expect("written");
        std::fs::write(file(), text + "\n").expect("written");
    }
    let recorded: Vec<Row> =
        serde_json::from_slice(&std::fs::read(file()).expect("WADE_WRITE=1 writes it")).expect("rows");
    assert_eq!(rows.len(), recorded.len());
    for (row, recorded) in rows.iter().zip(&recorded) {
        assert_eq!(
            (&row.car, &row.quantity, row.published),
            (&recorded.car, &recorded.quantity, recorded.published)
        );
        for (ours, recorded) in row.ours.iter().zip(&recorded.ours) {
            assert!((ours - recorded).abs() <= 0.01 * recorded.abs() + 0.002, "{row:?} {recorded}");
        }
    }
}

#[test]
fn a_sealed_car_floats_where_archimedes_says_and_faster_water_takes_it_sooner() {
    for car in [YARIS, PATROL, POLO, SALOON] {
        let mut flood = Flood::new(&car);
        let floats = flood.floats_at();
        let wet = flood.model.vehicle().at_rest(&Condition::level(Vec3::zeros(), floats));
        let lift: f64 = wet.iter().map(|load| load.force.z).sum();
        assert!((lift / (car.mass * GRAVITY) - 1.0).abs() < 1e-3, "{}: {lift}", car.name);
        let speeds: Vec<f64> = [0.5, 0.7, 0.9].map(|share| flood.slides_at(share * floats, 0.5)).to_vec();
        assert!(speeds.windows(2).all(|pair| pair[1] <= pair[0]), "{}: {speeds:?}", car.name);
        let by_heading: BTreeMap<&str, f64> = [("ahead", 0.0), ("across", FRAC_PI_2)]
            .map(|(name, heading)| {
                (name, flood.stands(0.8 * floats, 1.5, heading, &Friction::PUBLISHED).friction_needed)
            })
            .into();
        assert!(by_heading["across"] > by_heading["ahead"], "{}: {by_heading:?}", car.name);
    }
}
