#![allow(clippy::unwrap_used)]

use super::capture::Instruments;
use super::command::{Command, Plan, commands};
use super::dynamics::{CAMERA_RATE, SUBSTEPS, Vehicle};
use super::*;
use crate::answer::Answer;
use crate::profile::Profile;
use crate::simulator::DRAG;
use crate::track::DENSITY;
use wade_learn::random::Random;

fn vehicle<'a>(hull: &'a Hull, planted: &'a [Planted]) -> Vehicle<'a> {
    Vehicle { simulator: simulator(hull), planted, friction: 0.0 }
}

fn planted(cause: Cause) -> Planted {
    Planted::draw(cause, &mut Random::new(4))
}

fn straight(force: f64, depth: f64) -> Command {
    Command {
        name: "generated".to_owned(),
        drive: [Profile::constant(force), Profile::default()],
        depth,
        heading: 0.3,
        speed: 0.0,
        duration: 8.0,
    }
}

#[test]
fn a_constant_force_against_quadratic_drag_is_a_hyperbolic_tangent() {
    let hull = hull();
    let (force, depth) = (150.0, 0.2);
    let k = 0.5 * DENSITY * DRAG[0] * hull.width * depth;
    let solution = |mass: f64, t: f64| {
        let limit = f64::sqrt(force / k);
        (limit * (k * limit / mass * t).tanh(), mass / k * (k * limit / mass * t).cosh().ln())
    };
    let inertia = [Planted { cause: Cause::DrivetrainInertia, size: 30.0, shape: [0.0; 3] }];
    let added = [Planted { cause: Cause::AddedMass, size: 0.8, shape: [0.0; 3] }];
    let moved = 0.8 * 0.25 * DENSITY * hull.volume(depth);
    for (planted, mass) in [(&[][..], MASS), (&inertia, MASS + 30.0), (&added, MASS + moved)] {
        for instant in vehicle(&hull, planted).drive(&straight(force, depth), SUBSTEPS).iter().step_by(97) {
            let state = &instant.state;
            let (speed, way) = solution(mass, state.t);
            assert!((state.velocity.x - speed).abs() < 1e-8, "{} {speed}", state.velocity.x);
            assert!((state.place[0].hypot(state.place[1]) - way).abs() < 1e-7);
            let balance = mass * state.acceleration.x - (force - k * speed * speed);
            assert!(balance.abs() < 1e-5, "{balance}");
        }
    }
}

#[test]
fn energy_and_momentum_balance_in_a_slalom() {
    let hull = hull();
    for cause in [None, Some(Cause::WaveMemory), Some(Cause::Current), Some(Cause::LinearDamping)] {
        let planted: Vec<Planted> = cause.map(planted).into_iter().collect();
        let command = commands(Plan::Rich, &mut Random::new(2)).pop().unwrap();
        let instants = vehicle(&hull, &planted).drive(&command, SUBSTEPS);
        let step = 1.0 / (CAMERA_RATE * SUBSTEPS as f64);
        // momentum along x of the body and the angular one, by Simpson's rule over two steps
        for three in instants.windows(3).step_by(2) {
            let simpson = |of: &dyn Fn(usize) -> f64| step / 3.0 * (of(0) + 4.0 * of(1) + of(2));
            let [first, _, last] = [0, 1, 2].map(|i| three[i].state);
            let force = |i: usize| {
                let state = &three[i].state;
                three[i].drive[0] + three[i].water[0] + MASS * state.angular_velocity.z * state.velocity.y
            };
            let gained = MASS * (last.velocity.x - first.velocity.x);
            assert!((simpson(&force) - gained).abs() < 1e-4, "{cause:?} {}", simpson(&force) - gained);
            let moment = |i: usize| three[i].drive[1] + three[i].water[1];
            let gained = yaw_inertia(&hull) * (last.angular_velocity.z - first.angular_velocity.z);
            assert!((simpson(&moment) - gained).abs() < 1e-4, "{cause:?}");
        }
    }
}

#[test]
fn half_the_step_changes_no_velocity() {
    let hull = hull();
    let causes = Cause::ALL.into_iter().filter(|cause| !cause.is_fault());
    for planted in causes.map(|cause| [planted(cause)]) {
        let vehicle = vehicle(&hull, &planted);
        for command in commands(Plan::Rich, &mut Random::new(3)).iter().step_by(5) {
            let (coarse, fine) = (vehicle.drive(command, SUBSTEPS), vehicle.drive(command, 2 * SUBSTEPS));
            let change = coarse.iter().zip(fine.iter().step_by(2)).map(|(a, b)| {
                let turned = (a.state.angular_velocity - b.state.angular_velocity).norm();
                (a.state.velocity - b.state.velocity).norm().max(turned)
            });
            let change = change.fold(0.0, f64::max);
            assert!(change < 1e-6, "{} {}: {change}", planted[0].cause.name(), command.name);
        }
    }
}

#[test]
fn the_wrench_inferred_from_an_exact_null_is_the_model_s() {
    let hull = hull();
    let simulator = simulator(&hull);
    let instruments = Instruments {
        marker: 0.0,
        flaw: Flaw::White,
        planted: &[],
        mass: MASS,
        yaw_inertia: yaw_inertia(&hull),
    };
    for command in commands(Plan::Rich, &mut Random::new(5)) {
        let instants = vehicle(&hull, &[]).drive(&command, SUBSTEPS);
        for instant in &instants {
            let state = &instant.state;
            let [force, moment] = instruments.change(&command, &instants, &simulator, state.t);
            let scale = MASS * state.acceleration.norm() + instant.drive[0].abs() + 1.0;
            assert!(force.abs() < 1e-9 * scale && moment.abs() < 1e-9 * scale, "{force} {moment}");
        }
        // and the acceleration is that of the velocity in an inertial frame
        for pair in instants.windows(3) {
            let h = pair[1].state.t - pair[0].state.t;
            let rate = (pair[2].state.velocity - pair[0].state.velocity) / (2.0 * h);
            let turned = pair[1].state.angular_velocity.cross(&pair[1].state.velocity);
            assert!((rate + turned - pair[1].state.acceleration).norm() < 2e-3, "{}", command.name);
        }
        // without noise the cameras' processing misses the ends of the ramps alone
        let record = instruments.record(&command, &instants, &simulator, &mut Random::new(1)).unwrap();
        let errors = record.states.iter().map(|state| {
            let exact = &instants[(state.t * CAMERA_RATE * SUBSTEPS as f64).round() as usize].state;
            assert!((state.velocity - exact.velocity).norm() < 5e-3, "{} {}", command.name, state.t);
            (state.acceleration - exact.acceleration).norm_squared()
        });
        let errors: Vec<f64> = errors.collect();
        let error = (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
        assert!(error < 0.04, "{}: {error}", command.name);
    }
}

#[test]
fn the_mirror_image_of_a_command_is_the_mirror_image_of_the_motion() {
    let hull = hull();
    let causes = Cause::ALL.into_iter().filter(|cause| !cause.is_fault());
    for planted in causes.map(planted) {
        // a current turns its direction about
        let [direction, ..] = planted.shape;
        let is_current = planted.cause == Cause::Current;
        let mirrored =
            Planted { shape: if is_current { [-direction, 0.0, 0.0] } else { planted.shape }, ..planted };
        let command = commands(Plan::Rich, &mut Random::new(6)).pop().unwrap();
        let motion = vehicle(&hull, &[planted]).drive(&command, SUBSTEPS);
        let image = vehicle(&hull, &[mirrored]).drive(&command.mirrored(), SUBSTEPS);
        for (a, b) in motion.iter().zip(&image).step_by(53) {
            let (v, w) = (a.state.velocity, b.state.velocity);
            assert!((v.x - w.x).abs() < 1e-9 && (v.y + w.y).abs() < 1e-9, "{:?}", planted.cause);
            assert!((a.state.angular_velocity.z + b.state.angular_velocity.z).abs() < 1e-9);
            assert!((a.water[0] - b.water[0]).abs() < 1e-6 && (a.water[1] + b.water[1]).abs() < 1e-6);
        }
    }
}

#[test]
fn cases_repeat_by_seed_and_cover_the_plan() {
    let all = cases(1, 5);
    assert_eq!(all.len(), 210);
    assert_eq!(all, cases(1, 5));
    assert_ne!(all, cases(2, 5));
    let count = |group: Group| all.iter().filter(|case| case.group == group).count();
    assert_eq!(Group::ALL.map(count), [120, 40, 40, 2, 4, 4]);
    for marker in MarkerNoise::ALL {
        for cause in Cause::ALL {
            let is_it = |case: &Case| case.marker == marker && case.planted.iter().any(|p| p.cause == cause);
            assert!(all.iter().any(is_it), "{cause:?} {marker:?}");
        }
    }
    let nulls = || all.iter().filter(|case| case.group == Group::Null);
    assert!(Flaw::ALL.into_iter().all(|flaw| nulls().any(|case| case.flaw == flaw)));
    assert!(all.iter().any(|case| case.plan == Plan::OneDepth));
    let names: std::collections::BTreeSet<_> = all.iter().map(|case| &case.name).collect();
    assert_eq!(names.len(), all.len());
}

#[test]
fn floor_and_strength_are_as_stated_and_a_seed_gives_the_same_bytes() {
    let all = cases(3, 1);
    let simulated = |trial: &wade_learn::trials::Trial, i: usize| trial.simulated[0].as_ref().unwrap()[i];
    for case in all.iter().step_by(3) {
        let generated = generate(case);
        assert_eq!(generated, generate(case), "{}", case.name);
        let key = &generated.key;
        let text = serde_json::to_string(key).unwrap();
        assert!(text.contains("generated by") && generated.trials.manifest.generated.is_some());
        assert_eq!(case.planted.is_empty(), key.strength == 0.0, "{}", case.name);
        assert!((key.amplitude - key.strength * key.floor[0]).abs() < 1e-9);
        if case.plan.has_twins() {
            continue;
        }
        // what remains of the gap beside the exact change is the floor, but for the trajectory that the effect bends
        let (mut rest, mut count) = (0.0, 0.0);
        let mass = generated.trials.manifest.mass.unwrap();
        for (trial, change) in generated.trials.trials.iter().zip(&generated.change) {
            for (i, [change, _]) in change.iter().enumerate() {
                let inferred = mass * trial.acceleration[i].x - trial.other_forces["drive_fx"][i];
                let left: f64 = inferred - simulated(trial, i) - change;
                rest += left * left;
                count += 1.0;
            }
        }
        let ratio = f64::sqrt(rest / count) / key.floor[0];
        assert!((0.75..1.33).contains(&ratio), "{}: {ratio}", case.name);
        if case.group == Group::Null {
            assert!((ratio - 1.0).abs() < 1e-6, "{}: {ratio}", case.name);
        }
    }
}

#[test]
fn a_folder_of_trials_reads_back() {
    let all = cases(4, 1);
    let of = |plan: Plan| all.iter().find(|case| case.plan == plan).unwrap();
    let lost = all.iter().find(|case| case.flaw == Flaw::JitteredClock || case.flaw == Flaw::LostRows);
    for case in Plan::ALL.map(of).into_iter().chain(lost) {
        let generated = generate(case);
        let place = tempfile::tempdir().unwrap();
        crate::folder::write(place.path(), &generated.trials).unwrap();
        let read = wade_learn::trials::Trials::read(place.path()).unwrap();
        assert_eq!(read.manifest, generated.trials.manifest);
        assert_eq!(read.trials.len(), generated.trials.trials.len());
        let text = std::fs::read_to_string(place.path().join("trials.toml")).unwrap();
        assert!(text.contains("generated by"));
        assert!(case.planted.iter().all(|planted| !text.contains(planted.cause.name())));
    }
}

fn answer(verdict: &str, names: &[&str], alternatives: &[&[&str]]) -> Answer {
    let effects: Vec<_> = names.iter().map(|name| serde_json::json!({"name": name})).collect();
    let report = serde_json::json!({"verdict": verdict, "effects": effects, "alternatives": alternatives});
    Answer::from_report(&report).unwrap()
}

#[test]
fn answers_are_graded_by_what_trials_can_tell() {
    let grade = |causes: &[Cause], plan: Plan, answer: &Answer| {
        let planted: Vec<Planted> = causes.iter().map(|&cause| planted(cause)).collect();
        Allowed::of(&planted, plan).grade(answer).0
    };
    let named = |names: &[&str]| answer("named", names, &[]);
    let open = |alternatives: &[&[&str]]| answer("ambiguous", &[], alternatives);
    use Grade::*;
    let added = [Cause::AddedMass];
    assert_eq!(grade(&added, Plan::Rich, &named(&["added_mass"])), Right);
    assert_eq!(grade(&added, Plan::Rich, &named(&["added_mass", "squat"])), Wrong);
    assert_eq!(grade(&added, Plan::Rich, &open(&[&["added_mass"], &["mass_error"]])), Abstained);
    assert_eq!(grade(&added, Plan::OneDepth, &open(&[&["added_mass"], &["mass_error"]])), Right);
    assert_eq!(grade(&added, Plan::OneDepth, &named(&["mass_error"])), Wrong);
    assert_eq!(grade(&added, Plan::OneDepth, &open(&[&["current"], &["mass_error"]])), Wrong);
    assert_eq!(grade(&added, Plan::Rich, &answer("nothing_missing", &[], &[])), Abstained);
    let inertia = [Cause::DrivetrainInertia];
    assert_eq!(grade(&inertia, Plan::Rich, &named(&["mass_error"])), Right);
    assert_eq!(grade(&inertia, Plan::OneDepth, &named(&["mass_error"])), Wrong);
    assert_eq!(grade(&inertia, Plan::OneDepth, &open(&[&["added_mass"], &["mass_error"]])), Right);
    // a share of the drag is the same share of mass and drive
    let drag = [Cause::DragCoefficientError];
    assert_eq!(grade(&drag, Plan::Rich, &named(&["drive_gain", "mass_error"])), Wrong);
    let sets: [&[&str]; 2] = [&["drag_coefficient_error"], &["mass_error", "drive_gain"]];
    assert_eq!(grade(&drag, Plan::Rich, &open(&sets)), Right);
    let identity = [Cause::MassError, Cause::DriveGain];
    assert_eq!(grade(&identity, Plan::Rich, &named(&["density_error"])), Wrong);
    assert_eq!(grade(&identity, Plan::Rich, &named(&["drive_gain", "mass_error"])), Right);
    assert_eq!(grade(&identity, Plan::Rich, &named(&["mass_error"])), Abstained);
    let sets: [&[&str]; 2] = [&["density_error"], &["mass_error", "drive_gain"]];
    assert_eq!(grade(&identity, Plan::Rich, &open(&sets)), Right);
    assert_eq!(grade(&identity, Plan::Rich, &open(&sets[..1])), Abstained);
    assert_eq!(grade(&[], Plan::Rich, &answer("no_candidate_fits", &[], &[])), Abstained);
    assert_eq!(grade(&[], Plan::Rich, &named(&["current"])), Wrong);
    assert_eq!(grade(&[Cause::PoseDelay], Plan::Rich, &answer("no_candidate_fits", &[], &[])), Abstained);
}
