//! The anchored model learns, and is served as it was learnt: its gradient is right, the bundle answers as the trainer
//! does, nothing is left of the network far from what it learnt from, and every instruction set agrees.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use tempfile::TempDir;
use wade_core::anchor::OUTPUTS;
use wade_core::bundle::{self, Bundle};
use wade_core::condition::{Condition, GroundContact};
use wade_core::domain::Quantity;
use wade_core::forces::Forces;
use wade_core::frame::Vec3;
use wade_core::geometry::hydrostatics::hydrostatics;
use wade_core::model::kernel::Isa;
use wade_core::model::{JacobianWorkspace, Model, SPREAD, Workspace};
use wade_core::physics::Motion;
use wade_core::vehicle::Vehicle;
use wade_learn::dataset::Sample;
use wade_learn::dataset::split::{By, Split, split};
use wade_learn::random::Random;
use wade_learn::train::anchored;
use wade_learn::train::anchored::known::{Known, Prepared};
use wade_learn::train::anchored::loss::{AnchoredLoss, TARGETS, loss, targets};
use wade_learn::train::checkpoint::Checkpoint;
use wade_learn::train::layers::{Layers, Sizes};
use wade_learn::train::loss::Batch;
use wade_learn::train::{self, Analytic, Config, Run, Sides, Source, Trained};

const BY: By = By::Case { share: 0.2 };

struct Lesson {
    source: Source,
    split: Split,
}

impl Lesson {
    /// Loads by formula, of which the hydrostatic part is exactly what the model knows beforehand.
    fn new() -> Self {
        Self::of(20, |_| true)
    }

    /// Of so many cases of each vehicle, and some of their samples.
    fn of(cases: usize, wanted: impl Fn(&Sample) -> bool) -> Self {
        let vehicle = |name: &str| crate::common::model(name).vehicle().clone();
        let vehicles: BTreeMap<String, Vehicle> =
            crate::common::VEHICLES.map(|name| (name.to_owned(), vehicle(name))).into();
        let settings = Analytic { cases, ..Analytic::default() };
        let mut data = train::analytic::dataset(&vehicles, &settings, 1).unwrap();
        data.samples.retain(wanted);
        let source = Source::new(data, &vehicles, false).unwrap();
        let split = split(&source.data, BY, 1).unwrap().remove(0);
        Self { source, split }
    }

    fn sides(&self) -> Sides<'_> {
        Sides { split: &self.split, by: BY }
    }

    fn train(&self, config: &Config, checkpoint: Option<&Checkpoint>) -> Trained<anchored::Learnt> {
        let run = Run { source: &self.source, sides: self.sides(), config, checkpoint };
        anchored::train(run, &|_| ()).unwrap()
    }

    fn vehicles(&self) -> Vec<Prepared> {
        Prepared::all(&self.source.data, &self.source.vehicles).unwrap()
    }

    fn states(&self, numbers: &[usize]) -> Vec<Known> {
        Known::states(&self.source.data, numbers, &self.vehicles())
    }
}

fn short() -> Config {
    let mut config = Config { epochs: 12, ..Config::anchored() };
    config.anchored.between = 2;
    config
}

fn bundles(trained: &Trained<anchored::Learnt>, isa: Isa) -> BTreeMap<String, Model> {
    let folder = TempDir::new().unwrap();
    let model = |of_vehicle: &train::TrainedVehicle| {
        let path = folder.path().join(&of_vehicle.name);
        let mut bundle: Bundle = bundle::read(&crate::common::vehicles().join(&of_vehicle.name)).unwrap();
        bundle.trained = Some((trained.weights(of_vehicle, "test".into()), of_vehicle.domain));
        bundle::write(&path, &bundle).unwrap();
        (of_vehicle.name.clone(), bundle::load(&path, isa).unwrap())
    };
    trained.vehicles.iter().map(model).collect()
}

fn evaluate(model: &Model, condition: &Condition) -> Forces {
    let mut forces = Forces::default();
    model.evaluate(condition, &mut Workspace::new(), &mut forces);
    forces
}

#[test]
fn the_gradient_agrees_with_finite_differences() {
    const SMALL: Sizes = Sizes { inputs: 9, width: 12, outputs: SPREAD + 1 };
    const SURFACES: usize = 5;
    let mut random = Random::new(11);
    let layers = Layers::<f64>::random(SMALL, &mut random);
    let columns = 3 * SURFACES;
    let mut draw = |rows| DMatrix::from_fn(rows, columns, |_, _| 2.0 * random.unit() - 1.0);
    let (inputs, mut targets) = (draw(SMALL.inputs), draw(TARGETS));
    targets.row_mut(16).fill(0.7);
    let batch = Batch { surfaces: SURFACES, inputs, targets, dry: vec![false; columns] };
    let only = |net_weight, moment_weight, net_moment_weight| AnchoredLoss {
        net_weight,
        moment_weight,
        net_moment_weight,
        delta: 0.4,
        ..AnchoredLoss::default()
    };
    let terms = [
        ("surfaces", only(0.0, 0.0, 0.0)),
        ("net", only(5.0, 0.0, 0.0)),
        ("net moment", only(0.0, 0.0, 5.0)),
        ("all", only(1.0, 2.0, 3.0)),
    ];
    for (term, config) in terms {
        let total = |layers: &Layers<f64>| {
            loss(&config, &batch, &batch.counts(), &layers.forward(&batch.inputs).output).0
        };
        let activations = layers.forward(&batch.inputs);
        let (_, by_output) = loss(&config, &batch, &batch.counts(), &activations.output);
        let mut gradient = vec![f64::NAN; layers.parameters.len()];
        layers.backward(&batch.inputs, &activations, &by_output, &mut gradient);
        let size = gradient.iter().fold(0.0_f64, |size, g| size.max(g.abs()));
        for (index, slope) in gradient.iter().enumerate() {
            let moved = |by: f64| {
                let mut layers = layers.clone();
                layers.parameters[index] += by;
                total(&layers)
            };
            let numeric = (moved(1e-6) - moved(-1e-6)) / 2e-6;
            assert!((slope - numeric).abs() < 1e-5 * size, "{term} [{index}]: {slope} against {numeric}");
        }
    }
}

#[test]
fn the_loss_reads_an_answer_as_the_model_does() {
    let lesson = Lesson::new();
    let states = lesson.states(&lesson.split.training);
    let mut random = Random::new(5);
    let config = AnchoredLoss {
        net_weight: 0.0,
        moment_weight: 1.0,
        net_moment_weight: 2.0,
        delta: 1e9,
        ..AnchoredLoss::default()
    };
    let (scale, vehicles) = (7.0, lesson.vehicles());
    for state in &states {
        let prepared = &vehicles[state.vehicle];
        let (length, mass) = (prepared.vehicle.dimensions.length, prepared.vehicle.center_of_mass);
        for (surface, (force, _)) in state.prior.reading.surfaces.iter().zip(&state.loads) {
            if surface.wet_fraction == 0.0 {
                continue;
            }
            let answer: [f32; OUTPUTS] = std::array::from_fn(|_| 4.0 * random.unit() as f32 - 2.0);
            let found = Vec3::new(0.3, -0.2, 0.5);
            let row = targets(surface, &(*force, Some(found)), prepared, scale);
            let batch = Batch {
                surfaces: 1,
                inputs: DMatrix::zeros(0, 1),
                targets: DMatrix::from_column_slice(TARGETS, 1, &row.map(f64::from)),
                dry: vec![false],
            };
            let mut output = DMatrix::zeros(SPREAD + 1, 1);
            output.as_mut_slice()[..OUTPUTS].copy_from_slice(&answer.map(f64::from));
            let (value, _) = loss(&config, &batch, &batch.counts(), &output);
            let error = (surface.force(&answer) - force) / scale;
            // moments about the body origin, then about the center of mass
            let moment = surface.center.cross(&surface.force(&answer)) + surface.moment(&answer);
            let turn = (surface.moment(&answer) - (found - surface.center.cross(force))) / (scale * length);
            let net = (moment - mass.cross(&surface.force(&answer)) - (found - mass.cross(force)))
                / (scale * length);
            let expected =
                0.5 * (error.norm_squared() + turn.norm_squared()) + 2.0 * 0.5 * net.norm_squared();
            assert!((value - expected).abs() < 1e-4 * expected.max(1e-3), "{value} {expected}");
        }
    }
}

#[test]
fn the_bundle_answers_as_the_trainer_s_own_forward_pass() {
    let lesson = Lesson::new();
    let trained = lesson.train(&short(), None);
    let (states, vehicles) = (lesson.states(&lesson.split.held_out), lesson.vehicles());
    for isa in Isa::available() {
        let models = bundles(&trained, isa);
        let names: Vec<&String> = models.keys().collect();
        let mut compared = 0;
        for state in &states {
            let model = &models[names[state.vehicle]];
            let forces = evaluate(model, &state.prior.condition);
            let near = forces.outside.excess[Quantity::Distance as usize - 1] == 0.0;
            let own = trained.net_force(state, &vehicles);
            let scale: f64 = forces.surfaces.iter().map(|load| load.force.norm()).sum();
            if near {
                compared += 1;
                assert!((forces.wrench.force - own).norm() < 1e-5 * scale, "{} {own}", forces.wrench.force);
            }
            for (load, expected) in forces.surfaces.iter().zip(model.reference(&state.prior.condition)) {
                assert!((load.force - expected).norm() < 1e-5 * scale, "{}", isa.name());
            }
        }
        assert!(compared > 5, "{compared}");
    }
    let name = &trained.vehicles[0].name;
    let mut bundle = bundle::read(&crate::common::vehicles().join(name)).unwrap();
    bundle.trained = Some((trained.weights(&trained.vehicles[0], "test".into()), trained.vehicles[0].domain));
    bundle.radiation = None;
    let refused = bundle.into_model(Isa::available()[0]).unwrap_err().to_string();
    assert!(
        refused.contains("a remainder of the physical base, and radiation.safetensors is missing"),
        "{refused}"
    );
}

#[test]
fn derivatives_of_what_was_trained_are_those_of_its_loads() {
    const STEP: f64 = 5e-4;
    let lesson = Lesson::new();
    let trained = lesson.train(&short(), None);
    let (mut close, mut all) = (0, 0);
    for model in bundles(&trained, Isa::available()[0]).values() {
        let z0 = model.vehicle().z0;
        let mut random = Random::new(3);
        for _ in 0..40 {
            let mut draw = |size: f64| size * (2.0 * random.unit() - 1.0);
            let up = wade_core::frame::up_from_roll_pitch(draw(0.05), draw(0.05));
            let (velocity, level) = (Vec3::new(0.6 + draw(0.3), draw(0.4), 0.0), z0 + 0.15 + draw(0.04));
            let bed_clearance = Some(0.01 + draw(0.01));
            let state =
                Condition { up, water_level: Some(level), bed_clearance, ..Condition::level(velocity, 0.0) };
            let mut forces = Forces::default();
            let rooms = (&mut Workspace::new(), &mut JacobianWorkspace::new());
            let asked = (&Motion::ALONE, None);
            let jacobian = model.evaluate_with_jacobian(&state, asked, rooms, &mut forces).unwrap();
            let stepped = |column: usize, by: f64| {
                let mut state = state;
                match column {
                    0..3 => {
                        state.velocity[column] += by;
                        state.ground_velocity[column] += by;
                    }
                    6 => state.water_level = Some(level + by),
                    _ => state.density += 1e3 * by,
                }
                evaluate(model, &state).wrench.column()
            };
            for (column, unit) in [(0, 1.0), (1, 1.0), (6, 1.0), (10, 1e3)] {
                let numeric = (stepped(column, STEP) - stepped(column, -STEP)) / (2.0 * STEP * unit);
                let found = jacobian.column(column);
                all += 1;
                close += usize::from((found - numeric).norm() < 0.02 * numeric.norm());
            }
        }
    }
    // the rest lies at kinks of the network, which single precision makes wide
    assert!(close as f64 > 0.9 * f64::from(all), "{close} of {all}");
}

#[test]
fn training_lowers_the_loss_and_a_run_that_stopped_goes_on_with_the_same_bits() {
    let lesson = Lesson::new();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("state");
    let checkpoint = |resume| Checkpoint { path: path.clone(), resume };
    let whole = lesson.train(&Config { epochs: 24, ..short() }, None);
    let (first, last) = (whole.history.first().unwrap(), whole.history.last().unwrap());
    assert!(last.validation_loss < 0.5 * first.validation_loss, "{first:?} {last:?}");
    lesson.train(&Config { epochs: 17, ..short() }, Some(&checkpoint(false)));
    let resumed = lesson.train(&Config { epochs: 24, ..short() }, Some(&checkpoint(true)));
    assert_eq!((&whole.layers, &whole.learnt), (&resumed.layers, &resumed.learnt));
    checkpoint(true).remove().unwrap();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// What the model has besides its weights.
fn base_of(model: &Model) -> Model {
    let base = model.base().expect("the shipped bundles have it").clone();
    Model::of_physics(model.vehicle().clone(), model.version(), base)
}

#[test]
fn far_from_what_was_learnt_the_known_physics_is_left_and_marked() {
    let lesson = Lesson::new();
    let trained = lesson.train(&short(), None);
    let models = bundles(&trained, Isa::available()[0]);
    let model = &models["husky"];
    // lying on its side, of which nothing was taught
    let up = wade_core::frame::up_from_roll_pitch(1.2, 0.0);
    let far = Condition { up, ..Condition::level(Vec3::new(0.3, 0.9, 0.0), 0.1) };
    let forces = evaluate(model, &far);
    assert!(forces.outside.excess[Quantity::Distance as usize - 1] > 2.0);
    let known = evaluate(&base_of(model), &far).wrench.force;
    assert!((forces.wrench.force - known).norm() < 1e-9 * known.norm());
    assert!(forces.uncertainty.iter().all(|x| x.is_finite() && *x > 0.0), "{}", forces.uncertainty);
}

#[test]
fn a_vehicle_is_far_from_what_only_another_did() {
    // the Husky is symmetric, so its cases have images astern; of the Warthog none is learnt
    let lesson = Lesson::of(20, |sample| sample.vehicle == "husky" || sample.condition.velocity.x > 0.0);
    let models = bundles(&lesson.train(&short(), None), Isa::available()[0]);
    let distance = |name: &str, speed: f64| {
        let astern = Condition::level(Vec3::new(speed, 0.1, 0.0), 0.19);
        evaluate(&models[name], &astern).outside.excess[Quantity::Distance as usize - 1]
    };
    assert_eq!([distance("husky", 0.9), distance("husky", -0.9), distance("warthog", 0.9)], [0.0; 3]);
    assert!(distance("warthog", -0.9) > 0.0, "near to nothing that is known of it");
}

#[test]
fn a_surface_that_no_case_wetted_has_nothing_learnt_however_near_the_state() {
    let lesson = Lesson::new();
    let trained = lesson.train(&short(), None);
    let models = bundles(&trained, Isa::available()[0]);
    let model = &models["husky"];
    // the paper's Husky stands in 0.20 m at most; its upper front begins at 0.25 m
    let deep = Condition::level(Vec3::new(0.8, 0.2, 0.0), 0.27);
    let forces = evaluate(model, &deep);
    assert!(
        forces.outside.excess[Quantity::Distance as usize - 1] < 1.0,
        "not far: the rest is what was learnt"
    );
    let known = evaluate(&base_of(model), &deep);
    let learnt = |name: &str| {
        let index = model.vehicle().surface_index(name).unwrap();
        let known = &known.surfaces[index];
        assert!(known.wetted_fraction > 0.0 && known.force.norm() > 0.1, "{name} {known:?}");
        (forces.surfaces[index].force - known.force).norm() / known.force.norm()
    };
    assert!(learnt("front_upper") < 1e-12);
    assert!(learnt("front_lower") > 1e-3 && learnt("wheel_fl") > 1e-3);
    let shallow = evaluate(model, &Condition::level(Vec3::new(0.8, 0.2, 0.0), 0.19));
    let upper = model.vehicle().surface_index("front_upper").unwrap();
    assert!(forces.uncertainty.x > shallow.uncertainty.x && shallow.surfaces[upper].wetted_fraction == 0.0);
}

#[test]
fn a_network_that_learnt_little_states_how_far_it_is_off() {
    let lesson = Lesson::of(40, |_| true);
    let models = bundles(&lesson.train(&short(), None), Isa::available()[0]);
    let names: Vec<&String> = models.keys().collect();
    let (mut stated, mut missed) = (0.0, 0.0);
    for state in
        lesson.states(&lesson.split.held_out).iter().filter(|s| s.prior.condition.velocity.norm() > 0.0)
    {
        let forces = evaluate(&models[names[state.vehicle]], &state.prior.condition);
        let size = state.prior.reading.surfaces.iter().map(|surface| surface.unit).sum::<f64>();
        stated += forces.uncertainty.abs().sum() / size;
        missed += (forces.wrench.force - state.prior.force() - state.remainder()).abs().sum() / size;
    }
    // the mean of |error| is 0.71 to 0.80 of a deviation, and the factors are those of cases that were not known; 0.50 to 0.68 with
    // 20 and 40 cases and three seeds. The loads are a formula, of which the regressions miss next to nothing: what is missed
    // here the network has lost
    let share = missed / stated;
    assert!((0.4..1.2).contains(&share), "missed {missed}, stated {stated}");
}

#[test]
fn at_rest_the_served_wrench_is_that_of_the_hull_by_archimedes() {
    let lesson = Lesson::new();
    let models = bundles(&lesson.train(&short(), None), Isa::available()[0]);
    for model in models.values() {
        for depth in [0.08, 0.13, 0.18] {
            let state = Condition::level(Vec3::zeros(), depth);
            let plane = state.water_plane(model.vehicle().z0);
            let about = &model.vehicle().center_of_mass;
            let exact = hydrostatics(&model.vehicle().hull.mesh, &plane, state.density, about).wrench;
            let served = evaluate(model, &state).wrench;
            assert!((served.force - exact.force).norm() < 1e-6 * exact.force.norm());
            let arm = (served.moment - exact.moment).norm() / exact.force.norm();
            assert!(arm < 2e-3, "the force of still water acts {arm} m beside its place");
        }
    }
}

#[test]
fn weights_serve_both_conventions_of_ground_contact() {
    let lesson = Lesson::new();
    let models = bundles(&lesson.train(&short(), None), Isa::available()[0]);
    let model = &models["warthog"];
    let wetted = Condition::level(Vec3::new(1.0, 0.3, 0.0), 0.2);
    let dry = Condition { ground_contact: GroundContact::Dry, ..wetted };
    let lost = evaluate(model, &wetted).wrench.force - evaluate(model, &dry).wrench.force;
    let area: f64 = model.vehicle().contacts.iter().map(|patch| patch.area).sum();
    let pressure = wetted.density * wade_core::frame::GRAVITY * wetted.depth;
    assert!((lost - Vec3::z() * (pressure * area)).norm() < 1e-6 * pressure * area, "{lost}");
}

#[test]
fn loads_above_still_water_are_carried_by_wet_surfaces() {
    let lesson = Lesson::new();
    let mut source = lesson.source.clone();
    // a bow wave on every surface, wet or not
    let push = Vec3::new(-5.0, 1.0, 2.0);
    for load in source.data.samples.iter_mut().flat_map(|sample| &mut sample.surfaces) {
        load.force += push;
    }
    let states = Known::states(&source.data, &lesson.split.training, &lesson.vehicles());
    for (state, before) in states.iter().zip(lesson.states(&lesson.split.training)) {
        let carried = state.carried();
        let count = carried.len() as f64;
        let sum: Vec3 = carried.iter().map(|load| load.0).sum();
        assert!((sum - state.remainder()).norm() < 1e-9 * count);
        assert!((state.remainder() - before.remainder() - push * count).norm() < 1e-9 * count);
        for ((force, _), surface) in carried.iter().zip(&state.prior.reading.surfaces) {
            assert!(surface.wet_fraction > 0.0 || *force == Vec3::zeros());
        }
    }
    let dry = |state: &Known| state.prior.reading.surfaces.iter().any(|surface| surface.wet_fraction == 0.0);
    assert!(states.iter().filter(|state| dry(state)).count() > 10);
}
