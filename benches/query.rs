//! Time of a query in process, by vehicle and instruction set, beside its controls from the same run: an empty
//! measurement, the plain-loop reference, and the floor, what layer 2 would take at the peak of the core if no input were
//! left out. Nothing here fails on a time.
//!
//! `cargo bench --bench query [-- --out benches/results]` prints a table, and writes it as CSV with machine and commit.
#![allow(unsafe_code, reason = "the peak of the core is measured behind a CPU check")]

#[path = "../tests/common/bundles.rs"]
mod bundles;
mod common;

use std::cell::RefCell;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

use common::{Row, Subject, Table};
use wade_core::bundle;
use wade_core::condition::Condition;
use wade_core::effects::{
    ActiveEffect, ActiveEffects, Answer, Circumstances, Effect, EffectLoads, EffectRegion, EffectsFile,
    EffectsSession, Elsewhere, Evidence, Kind, ParameterValue, Shape, Validity,
};
use wade_core::forces::Forces;
use wade_core::frame::{Vec3, WaterPlane, up_from_roll_pitch};
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::model::kernel::Isa;
use wade_core::model::{JacobianWorkspace, Model, Workspace};
use wade_core::physics::base::{BaseLoads, Motion};
use wade_core::physics::{Physics, STATED_NONE};

/// Water levels of the base's rows, from below the hull to over its middle.
const BASE_STATES: usize = 16;

fn vehicles() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("vehicles")
}

fn load(path: &Path, isa: Isa) -> Model {
    bundle::load(path, isa).expect("the shipped bundles are sound")
}

fn model(vehicle: &str, isa: Isa) -> Model {
    load(&vehicles().join(vehicle), isa)
}

/// The vehicle with the paper's network.
fn paper(vehicle: &str, isa: Isa) -> Model {
    let copy = tempfile::TempDir::new().expect("a temporary folder");
    let bundle = copy.path().join(vehicle);
    std::fs::create_dir(&bundle).expect("a folder");
    for entry in std::fs::read_dir(vehicles().join(vehicle)).expect("readable") {
        let entry = entry.expect("readable");
        std::fs::copy(entry.path(), bundle.join(entry.file_name())).expect("copied");
    }
    bundles::paper::put_into(&bundle);
    load(&bundle, isa)
}

/// Deep enough that every surface is wet.
fn all_wet(model: &Model) -> Condition {
    let condition = Condition::level(Vec3::new(0.6, 0.2, 0.0), 0.95 * model.vehicle().dimensions.height);
    let mut forces = Forces::default();
    model.evaluate(&condition, &mut Workspace::new(), &mut forces);
    assert!(forces.surfaces.iter().all(|load| load.wetted_fraction > 0.0), "every surface is wet");
    condition
}

fn layer2(model: &Model) -> u64 {
    let width = model.weights().map_or(0, |weights| weights.network.width);
    (model.vehicle().surfaces.len() * width * width) as u64
}

/// Rounds of twelve independent vector multiply-adds on registers alone: what the core can do at most.
#[cfg(target_arch = "x86_64")]
mod peak {
    use std::arch::x86_64::{
        _mm256_add_ps, _mm256_cvtss_f32, _mm256_fmadd_ps, _mm256_set1_ps, _mm512_add_ps, _mm512_cvtss_f32,
        _mm512_fmadd_ps, _mm512_set1_ps,
    };
    use std::hint::black_box;

    macro_rules! peak {
        ($name:ident, $features:literal, $set:ident, $fma:ident, $add:ident, $first:ident) => {
            #[target_feature(enable = $features)]
            pub fn $name(rounds: usize) -> f32 {
                let (a, b) = ($set(black_box(0.999)), $set(black_box(1e-3)));
                let mut sums = [$set(1.0); 12];
                for _ in 0..rounds {
                    for sum in &mut sums {
                        *sum = $fma(*sum, a, b);
                    }
                }
                $first(sums.into_iter().reduce(|x, y| $add(x, y)).unwrap_or(a))
            }
        };
    }

    peak!(avx512, "avx512f", _mm512_set1_ps, _mm512_fmadd_ps, _mm512_add_ps, _mm512_cvtss_f32);
    peak!(avx2, "avx2,fma", _mm256_set1_ps, _mm256_fmadd_ps, _mm256_add_ps, _mm256_cvtss_f32);
}

/// Multiply-adds a second on this core [1/s], the best of many short runs; NaN where there is no kernel by hand.
fn peak() -> f64 {
    const ROUNDS: usize = 20_000;
    #[cfg(target_arch = "x86_64")]
    let (lanes, run): (usize, fn(usize) -> f32) = match Isa::available()[0].name() {
        // SAFETY: `Isa::available` found the CPU features.
        "avx512" => (16, |rounds| unsafe { peak::avx512(rounds) }),
        // SAFETY: as above.
        "avx2+fma" => (8, |rounds| unsafe { peak::avx2(rounds) }),
        _ => return f64::NAN,
    };
    #[cfg(not(target_arch = "x86_64"))]
    let (lanes, run): (usize, fn(usize) -> f32) = return f64::NAN;
    let times = (0..100).map(|_| {
        let start = Instant::now();
        black_box(run(ROUNDS));
        (ROUNDS * 12 * lanes) as f64 / start.elapsed().as_secs_f64()
    });
    times.fold(0.0, f64::max)
}

/// The query of a model in a state, `times` in a row.
fn query(name: String, model: Model, condition: Condition, times: u64) -> Subject {
    let row = Row::new(name, times * layer2(&model));
    let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
    let work = move || {
        for _ in 0..times {
            model.evaluate(black_box(&condition), &mut workspace, &mut forces);
        }
    };
    (row, Box::new(work))
}

/// The query of a model in a state, with its derivatives.
fn with_derivatives(name: String, model: Model, condition: Condition) -> Subject {
    let row = Row::new(name, layer2(&model));
    let mut room = (Workspace::new(), JacobianWorkspace::new(), Forces::default());
    let motion = Motion {
        wheel_speeds: &STATED_NONE,
        time_step: 0.0,
        implicit_added_mass: false,
        physics: Physics::Full,
        waters: None,
    };
    let work = move || {
        let (values, slopes, forces) = &mut room;
        let asked = (&motion, None);
        black_box(model.evaluate_with_jacobian(black_box(&condition), asked, (values, slopes), forces));
    };
    (row, Box::new(work))
}

fn queries(vehicle: &str) -> Vec<Subject> {
    let best = Isa::available()[0];
    let of = |isa: Isa| model(vehicle, isa);
    let name = |what: &str, isa: Isa| format!("{vehicle} {what} {}", isa.name());
    let wet = all_wet(&of(best));
    let tilted = Condition { up: up_from_roll_pitch(0.02, 0.05), ..wet };
    let every_isa = Isa::available().into_iter().map(|isa| query(name("query", isa), of(isa), wet, 1));
    let mut subjects: Vec<Subject> = every_isa.collect();
    subjects.push(query(name("query of the paper's network", best), paper(vehicle, best), wet, 1));
    subjects.push(query(name("tilted query", best), of(best), tilted, 1));
    // the water crosses most surfaces
    let half = Condition { depth: 0.5 * wet.depth, ..tilted };
    subjects.push(query(name("half wet tilted query", best), of(best), half, 1));
    let of_paper = name("half wet tilted query of the paper's network", best);
    subjects.push(query(of_paper, paper(vehicle, best), half, 1));
    for (what, state) in [("query", wet), ("tilted query", tilted), ("half wet tilted query", half)] {
        subjects.push(with_derivatives(name(&format!("{what} with derivatives"), best), of(best), state));
    }
    subjects.push(query(name("256 queries", best), of(best), wet, 256));
    let plain = of(best);
    let row = Row::new(format!("{vehicle} reference, plain loops"), layer2(&plain));
    let work = move || {
        black_box(plain.reference(black_box(&wet)));
    };
    subjects.push((row, Box::new(work)));
    subjects
}

/// Every physical effect of the library with made-up numbers.
fn every_effect(vehicle: &str) -> EffectsFile {
    let physics = Effect::ALL.into_iter().filter(|effect| effect.kind() == Kind::Physics);
    let effect = |name: Effect| {
        let parameter = |name: &str, value: f64, unit: &str| {
            (name.to_owned(), ParameterValue { value, std: 0.0, unit: unit.to_owned() })
        };
        let numbers = if name == Effect::WaveMemory { [0.8, 2.0, 0.0] } else { [1e-3, 0.0, 0.0] };
        // a law without a number in the first place has one form
        let shape = Shape::from_numbers(name, numbers).unwrap_or_else(|_| name.plain());
        let coefficients = name.coefficients().iter();
        ActiveEffect {
            equation: name.equation().to_owned(),
            provisional: false,
            share_of_gap: 0.1,
            shape,
            base_drag: [1.0; 3],
            channel_width: Some(4.0),
            region: EffectRegion::default(),
            coefficients: coefficients.clone().map(|c| c.name.to_owned()).collect(),
            covariance: Vec::new(),
            parameters: coefficients.map(|c| parameter(c.name, 0.1, c.unit)).collect(),
        }
    };
    let wide = [0.0, 1e4];
    let validity = Validity {
        depth_m: wide,
        speed_mps: wide,
        acceleration_mps2: wide,
        angular_speed_radps: wide,
        density_kgpm3: wide,
    };
    EffectsFile::new(vehicle.to_owned(), Evidence::default(), validity, physics.map(effect).collect())
}

/// All effects of a vehicle together, beside the query that they are added to: half under water, level and tilted.
fn effects(vehicle: &str) -> Vec<Subject> {
    let model = model(vehicle, Isa::available()[0]);
    let depth = 0.5 * model.vehicle().dimensions.height;
    let level = Condition {
        angular_velocity: Vec3::new(0.0, 0.1, 0.4),
        acceleration: Vec3::new(0.5, 0.1, 0.0),
        ..Condition::level(Vec3::new(0.6, 0.2, 0.0), depth)
    };
    let tilted = Condition { up: up_from_roll_pitch(0.02, 0.05), ..level };
    let told = Circumstances {
        heading: Some(0.4),
        depth_rate: Some(0.1),
        wheel_speeds: Some([3.0; 4].into()),
        time_step: 0.001,
        implicit_added_mass: false,
        ..Circumstances::default()
    };
    let mut subjects: Vec<Subject> = Vec::new();
    for (name, condition) in [("level", level), ("tilted", tilted)] {
        let active = ActiveEffects::new(every_effect(vehicle), model.vehicle());
        let mut forces = Forces::default();
        model.evaluate(&condition, &mut Workspace::new(), &mut forces);
        let (mut session, mut loads) = (EffectsSession::default(), EffectLoads::default());
        let asked = self::model(vehicle, Isa::available()[0]);
        let room = RefCell::new((Workspace::new(), Forces::default()));
        let work = move || {
            let elsewhere = |there: &Elsewhere| {
                let (workspace, forces) = &mut *room.borrow_mut();
                asked.evaluate(&there.condition, workspace, forces);
                forces.wrench
            };
            let answer = Answer {
                condition: black_box(&condition),
                surfaces: &forces.surfaces,
                wrench: forces.wrench,
                wet_parts_known: true,
                is_calm: true,
                elsewhere: &elsewhere,
            };
            active.evaluate(&told, &answer, Some(&mut session), &mut loads);
        };
        subjects.push((Row::new(format!("{vehicle} all 14 effects {name}"), 0), Box::new(work)));
    }
    subjects
}

fn parts(vehicle: &str) -> Vec<Subject> {
    let model = model(vehicle, Isa::available()[0]);
    let level = WaterPlane::level(model.vehicle().z0, 0.5 * model.vehicle().dimensions.height);
    let tilted = WaterPlane { normal: up_from_roll_pitch(0.05, 0.1), ..level };
    let mut subjects: Vec<Subject> = Vec::new();
    for (name, plane) in [("level", level), ("tilted", tilted)] {
        let samples = model.vehicle().samples.clone();
        let work = move || {
            for surface in &samples.surfaces {
                black_box(surface.submergence(black_box(&plane)));
            }
        };
        subjects.push((Row::new(format!("{vehicle} submergence {name}"), 0), Box::new(work)));
    }
    subjects.extend(base(vehicle));
    let work = move || {
        let vehicle = model.vehicle();
        black_box(hydrostatics(&vehicle.hull.mesh, black_box(&level), 1000.0, &vehicle.center_of_mass));
    };
    subjects.push((Row::new(format!("{vehicle} exact hydrostatics"), 0), Box::new(work)));
    subjects
}

/// The physical base alone, with rates and added mass, in water level and tilted by an angle [deg].
fn base(vehicle: &str) -> impl Iterator<Item = Subject> {
    ["level", "tilted by 5", "tilted by 10", "on its side"].into_iter().zip([0.0, 5.0, 10.0, 90.0]).map(
        move |(name, angle): (&str, f64)| {
            let model = model(vehicle, Isa::available()[0]);
            let tilt = angle.to_radians() / std::f64::consts::SQRT_2;
            let height = model.vehicle().dimensions.height;
            let states: Vec<Condition> = (0..BASE_STATES)
                .map(|i| Condition {
                    angular_velocity: Vec3::new(0.1, -0.2, 0.3),
                    up: up_from_roll_pitch(tilt, tilt),
                    water_level: Some((i as f64 / BASE_STATES as f64 - 0.5) * height),
                    ..Condition::level(Vec3::new(0.6, 0.2, -0.1), 0.0)
                })
                .collect();
            let surfaces = model.vehicle().surfaces.len();
            let mut loads = BaseLoads::with_capacity(surfaces);
            let work = move || {
                let motion = Motion {
                    wheel_speeds: &STATED_NONE[..surfaces],
                    time_step: 0.0,
                    implicit_added_mass: true,
                    physics: Physics::Full,
                    waters: None,
                };
                let base = model.base().expect("the shipped bundles have one");
                states.iter().for_each(|state| base.evaluate(black_box(state), &motion, None, &mut loads));
                black_box(&loads);
            };
            (Row::new(format!("{vehicle} {BASE_STATES} levels of the base {name}"), 0), Box::new(work) as _)
        },
    )
}

fn main() {
    let mut subjects: Vec<Subject> = vec![(Row::new("control: nothing", 0), Box::new(|| ()))];
    for vehicle in ["husky", "warthog"] {
        subjects.extend(queries(vehicle));
        subjects.extend(parts(vehicle));
        subjects.extend(effects(vehicle));
    }
    common::measure(&mut subjects);
    let mut table = Table::new("query");
    table.set_peak(peak());
    table.add(subjects);
    table.print();
    table.write_where_asked();
}
