//! Promise: the cases of a campaign become trials with the signs of a vehicle that drives: its wrench about the center of
//! mass, its acceleration, the current past a parked one, its turning wheels, and the noise of the flow.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;
use wade_core::condition::GroundContact;
use wade_core::forces::Forces;
use wade_core::frame::Vec3;
use wade_core::model::{Model, Workspace};
use wade_learn::cfd::case::Settings;
use wade_learn::cfd::collect::{CASES_FILE, CaseSummary};
use wade_learn::cfd::openfoam::MeshKind;
use wade_learn::cfd::plan::{Bed, Campaign, Case, FORMAT, Plan, Set, hull_hash};
use wade_learn::cfd::solve::Outcome;
use wade_learn::dataset::{self, Dataset, Image, Meta, Rest, Sample, SurfaceLoad};
use wade_learn::train;
use wade_learn::trials::{Method, Trials};

/// Water that moves with the hull in the generated loads [kg].
const ADDED_KG: f64 = 80.0;
/// Where its inertia acts [m].
const POINT: [f64; 3] = [0.2, 0.0, -0.3];
/// What a bed that moves does in the generated loads [N].
const BED_N: f64 = -7.0;
/// What the mesh displaces over what the hull does.
const STAIRCASE: f64 = 1.04;

/// Unsteady cases head-on and broadside, cases of the paper's, driving twins of some: planned, not computed.
fn plan(model: &Model) -> Plan {
    let campaign = Campaign {
        format: FORMAT,
        vehicle: "warthog".into(),
        hull_sha256: hull_hash(model.vehicle()),
        table: train::Config::default().analytic.tables["warthog"],
        settings: Settings::default(),
    };
    let mut plan = Plan { campaign, cases: Vec::new() };
    plan.extend(Set::Unsteady, 0, 1, 0.5).expect("planned");
    plan.extend(Set::Paper, 12, 1, 0.5).expect("planned");
    plan.extend(Set::Driving, 6, 1, 0.5).expect("planned");
    plan
}

/// The state in the middle of a section: half a second before the ramp, the ramp, two seconds after it.
fn state(case: &Case, section: u32) -> (f64, f64) {
    let t = 0.1 * (f64::from(section) + 0.5) - 0.5;
    let progress = if case.is_unsteady() { (t / case.ramp_s).clamp(0.0, 1.0) } else { 0.0 };
    let change = case.end_speed_mps - case.speed_mps;
    let acceleration = if progress > 0.0 && progress < 1.0 { change / case.ramp_s } else { 0.0 };
    (case.speed_mps + progress * change, acceleration)
}

/// Loads that no solver computed: what the model says, the mesh's own load at rest, and `added` kilograms of inertia at
/// [`POINT`]; a force of `flutter` newtons that changes its sign from section to section.
fn sample(model: &Model, case: &Case, section: u32, added: f64, flutter: f64) -> Sample {
    let vehicle = model.vehicle();
    let (speed, acceleration) = state(case, section);
    let condition = case.condition(speed, acceleration);
    let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
    model.evaluate(&condition, &mut workspace, &mut forces);
    let exact = vehicle.at_rest(&condition);
    let mut surfaces: Vec<SurfaceLoad> = forces
        .surfaces
        .iter()
        .zip(&exact)
        .map(|(load, exact)| {
            let rest = Rest { force: exact.force * STAIRCASE, moment: exact.moment * STAIRCASE };
            SurfaceLoad {
                force: load.force - exact.force + rest.force,
                moment: Some(load.point.cross(&load.force) - exact.moment + rest.moment),
                viscous: None,
                rest: Some(rest),
            }
        })
        .collect();
    let sign = if section.is_multiple_of(2) { 1.0 } else { -1.0 };
    let bed = if case.bed == Bed::Driving { BED_N } else { 0.0 };
    let force = condition.acceleration * -added + Vec3::x() * (flutter * sign + bed);
    surfaces[0].force += force;
    surfaces[0].moment = surfaces[0].moment.map(|moment| moment + Vec3::from(POINT).cross(&force));
    let start_s = 4.9 + 0.1 * f64::from(section);
    Sample {
        vehicle: "warthog".into(),
        case: case.id.clone(),
        set: case.set.to_string(),
        image: Image::Original,
        section,
        start_s,
        end_s: start_s + 0.1,
        condition,
        surfaces,
    }
}

/// A campaign whose loads are generated.
fn campaign(folder: &Path, model: &Model, added: f64, flutter: f64) {
    let plan = plan(model);
    plan.write(folder).expect("written");
    let names = model.vehicle().surfaces.iter().map(|surface| surface.name.clone()).collect();
    let meta = Meta {
        provenance: "generated for a test".into(),
        ground_contact: GroundContact::Dry,
        vehicles: [("warthog".to_owned(), names)].into(),
        notes: [].into(),
    };
    let sections = |case: &Case| if case.is_unsteady() { (10.0 * (2.5 + case.ramp_s)) as u32 } else { 20 };
    let of =
        |case: &Case| (0..sections(case)).map(|i| sample(model, case, i, added, flutter)).collect::<Vec<_>>();
    let dataset = Dataset { meta, samples: plan.cases.iter().flat_map(of).collect() };
    dataset::write(&folder.join("sections.parquet"), &dataset).expect("written");
}

/// What is kept of steady cases beside their sections; parked ones may still have drifted.
fn summaries(folder: &Path, model: &Model, parked_settled: bool) {
    let mut writer = csv::Writer::from_path(folder.join(CASES_FILE)).expect("written");
    for case in plan(model).cases.into_iter().filter(|case| !case.is_unsteady()) {
        let outcome = Outcome {
            settled: parked_settled || case.bed == Bed::Driving,
            case,
            solver: "none".into(),
            method: 2,
            settings: Settings::default(),
            hull_sha256: hull_hash(model.vehicle()),
            mesh_kind: MeshKind::Castellated,
            cells: 1,
            courant: 5.0,
            attempts: 1,
            steps: 1,
            core_s: 1.0,
            windows: 1,
            drift: [0.0; 3],
            mass_imbalance: 0.0,
            rest: Vec::new(),
            surfaces: Vec::new(),
            measured: None,
            sections: Vec::new(),
        };
        writer.serialize(CaseSummary::of(&outcome)).expect("written");
    }
}

fn wade(campaign: &Path, arguments: &[&str], out: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command.args(["campaign", "trials"]).arg(campaign).env("WADE_VEHICLES", crate::common::vehicles());
    command.args(arguments).arg("--out").arg(out).output().expect("wade runs")
}

fn wade_of(campaign: &Path, sets: &[&str], out: &Path) -> Output {
    wade(campaign, &sets.iter().flat_map(|set| ["--set", set]).collect::<Vec<_>>(), out)
}

fn trials(model: &Model, added: f64, flutter: f64, sets: &[&str]) -> Trials {
    let folder = TempDir::new().expect("a folder");
    let (source, out) = (folder.path().join("campaign"), folder.path().join("trials"));
    campaign(&source, model, added, flutter);
    let output = wade_of(&source, sets, &out);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    with_moments(&out)
}

/// The trials of a folder, whose manifest names the forces alone unless it is edited.
fn with_moments(folder: &Path) -> Trials {
    let manifest = folder.join("trials.toml");
    let text = std::fs::read_to_string(&manifest).expect("written");
    let forces = "columns = [\"fx\", \"fy\", \"fz\"]\n";
    assert!(text.contains(forces), "{text}");
    std::fs::write(&manifest, text.replace(forces, "")).expect("written");
    Trials::read(folder).expect("sound trials")
}

#[test]
fn an_accelerating_hull_is_held_back_by_the_water_that_moves_with_it() {
    let model = crate::common::model("warthog");
    let (with, without) =
        (trials(&model, ADDED_KG, 0.0, &["unsteady"]), trials(&model, 0.0, 0.0, &["unsteady"]));
    assert_eq!((with.trials.len(), with.manifest.measured.method), (36, Some(Method::Cfd)));
    assert!(with.manifest.generated.as_ref().is_some_and(|how| how.contains("nothing of it was measured")));
    let arm = Vec3::from(POINT) - model.vehicle().center_of_mass;
    let (mut workspace, mut forces) = (Workspace::new(), Forces::default());
    let mut sped_up = 0;
    for (with, without) in with.trials.iter().zip(&without.trials) {
        for i in 0..with.len() {
            let wrench = |trial: &wade_learn::trials::Trial| {
                let of = |c: usize| trial.measured[c].as_ref().expect("measured")[i];
                (Vec3::new(of(0), of(1), of(2)), Vec3::new(of(3), of(4), of(5)))
            };
            let ((force, moment), (still, still_moment)) = (wrench(with), wrench(without));
            let inertia = with.acceleration[i] * -ADDED_KG;
            assert!((force - still - inertia).norm() < 0.01, "{} {i}", with.name);
            assert!((moment - still_moment - arm.cross(&inertia)).norm() < 0.01, "{} {i}", with.name);
            // forward, faster: held back, and with it about the center of mass
            if with.acceleration[i].x > 0.0 {
                sped_up += 1;
                assert!(force.x < still.x && with.condition(i, GroundContact::Wetted, 0.0).velocity.x > 0.0);
            }
            // without it, what the model says, with water under the tires as in every query
            let condition = without.condition(i, GroundContact::Wetted, 0.0);
            model.evaluate(&condition, &mut workspace, &mut forces);
            assert!((still - forces.wrench.force).norm() < 0.05, "{} {i}", with.name);
        }
        assert!(with.velocity.iter().all(|v| *v == Vec3::zeros()), "the bed is parked");
    }
    assert!(sped_up > 50, "{sped_up}");
}

#[test]
fn a_driving_vehicle_moves_over_ground_and_its_wheels_roll() {
    let model = crate::common::model("warthog");
    let trials = trials(&model, 0.0, 3.0, &["driving", "paper"]);
    let driving = trials.trials.iter().find(|trial| trial.name.contains("driving")).expect("a driving case");
    let parked = driving.name.replace("driving", "paper");
    let parked = trials.trials.iter().find(|trial| trial.name == parked).expect("its twin");
    let through = |trial: &wade_learn::trials::Trial| trial.condition(0, GroundContact::Wetted, 0.0).velocity;
    assert!((through(driving) - through(parked)).norm() < 1e-6, "the same state through the water");
    assert!(through(driving).x > 0.3);
    assert_eq!((driving.current[0], parked.velocity[0]), (Vec3::zeros(), Vec3::zeros()));
    let wheel = |trial: &wade_learn::trials::Trial| trial.wheel_speeds[0].as_ref().expect("a wheel")[0];
    assert_eq!(wheel(parked), 0.0);
    let vehicle = model.vehicle();
    let tire: Vec<usize> = vehicle.hull.faces_of(vehicle.surface_index("wheel_fl").expect("there")).collect();
    let height = vehicle.hull.mesh.part(&tire).bounds().expect("faces").extent().z;
    assert!((wheel(driving) * 0.5 * height - driving.velocity[0].x).abs() < 1e-6, "it rolls, without slip");
    // +3, -3, +3 N: second differences of 12 N, of which white noise has the root of 6 times its own
    let noise = trials.manifest.sensor_noise["fx"];
    assert!((noise - 12.0 / 6_f64.sqrt()).abs() < 0.05, "{noise}");
    let offset = |trial: &wade_learn::trials::Trial| trials.manifest.trial_offset_of(&trial.name, "fx");
    assert!(offset(driving) < 0.05, "both halves of the window have the same mean");
    assert!((trials.manifest.channel_width.expect("known") - 3.94 * vehicle.dimensions.length).abs() < 1e-6);
}

#[test]
fn a_parked_flow_predicts_its_driving_twin_and_the_gap_is_what_the_bed_does() {
    let model = crate::common::model("warthog");
    let folder = TempDir::new().expect("a folder");
    let (source, out) = (folder.path().join("campaign"), folder.path().join("trials"));
    campaign(&source, &model, 0.0, 3.0);
    let pairs = ["--set", "driving", "--pairs"];
    let refused = |says: &str| {
        let output = wade(&source, &pairs, &out);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && message.contains(says) && !out.exists(), "{message}");
    };
    refused("such that both have settled");
    summaries(&source, &model, false);
    refused("such that both have settled");
    summaries(&source, &model, true);
    let output = wade(&source, &pairs, &out);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let trials = with_moments(&out);
    let width = trials.manifest.channel_width.expect("known");
    // Schijf: the energy of the flow is less than that of the critical one beside the hull
    let is_choked = |case: &&Case| {
        let froude = case.speed_mps / (9.81 * case.depth_m).sqrt();
        let free = 1.0 - model.vehicle().dimensions.width / width;
        1.5 * (froude / free).powf(2.0 / 3.0) > 1.0 + 0.5 * froude * froude
    };
    let cases = plan(&model).cases;
    let (choked, free): (Vec<&Case>, Vec<&Case>) =
        cases.iter().filter(|case| case.set == Set::Driving).partition(is_choked);
    assert!(!choked.is_empty() && !free.is_empty(), "some of each");
    assert_eq!(trials.trials.len(), 2 * free.len(), "driving cases and their twins");
    assert!(free.iter().all(|case| trials.trials.iter().any(|trial| trial.name == case.id)));
    assert!(trials.manifest.generated.is_some_and(|how| how.contains("over a parked bed")));
    let mean = |column: &Option<Vec<f64>>| {
        let values = column.as_ref().expect("a column");
        values.iter().sum::<f64>() / values.len() as f64
    };
    let arm = Vec3::from(POINT) - model.vehicle().center_of_mass;
    for trial in &trials.trials {
        let bed = if trial.name.contains("driving") { BED_N } else { 0.0 };
        let gap = [0, 1, 2, 4].map(|c| mean(&trial.measured[c]) - mean(&trial.simulated[c]));
        let expected = [bed, 0.0, 0.0, arm.z * bed];
        assert!(gap.iter().zip(expected).all(|(gap, expected)| (gap - expected).abs() < 0.01), "{gap:?}");
    }
}

#[test]
fn what_is_not_there_or_would_be_mixed_is_refused() {
    let model = crate::common::model("warthog");
    let folder = TempDir::new().expect("a folder");
    let (source, out) = (folder.path().join("campaign"), folder.path().join("trials"));
    campaign(&source, &model, 0.0, 0.0);
    let refused = |sets: &[&str], says: &str| {
        let output = wade_of(&source, sets, &out);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && message.contains(says), "{message}");
    };
    refused(&["wide"], "no case of wide");
    refused(&["paper", "wide"], "no case of wide");
    assert!(!out.exists());
    assert!(wade_of(&source, &["paper"], &out).status.success());
    refused(&["paper"], "holds files already");
}

/// What the workflow says of the committed ramps of a vehicle against a part of the base, with the seed that says what is kept
/// back.
fn of_ramps(vehicle: &str, physics: &str, seed: u64) -> Value {
    let folder = TempDir::new().expect("a folder");
    let (trials, out) = (folder.path().join("trials"), folder.path().join("gap"));
    let campaign = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns").join(vehicle);
    let output = wade(&campaign, &["--set", "unsteady"], &trials);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let config = folder.path().join("gap.toml");
    std::fs::write(&config, format!("seed = {seed}\n")).expect("written");
    let output = Command::new(env!("CARGO_BIN_EXE_wade"))
        .args(["gap", "--vehicle", vehicle, "--physics", physics, "--json", "--trials"])
        .args([trials.as_path(), Path::new("--out"), &out, Path::new("--config"), &config])
        .env("WADE_VEHICLES", crate::common::vehicles())
        .output()
        .expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(report["gap"]["worse_regions"], Value::Array(Vec::new()), "{}", report["summary"]);
    report
}

/// An effect's parameters lie within bands.
fn within(effect: &Value, name: &str, bands: &[(&str, [f64; 2])]) {
    assert_eq!(effect["name"], name);
    for (parameter, [least, most]) in bands {
        let value = effect["parameters"][parameter]["value"].as_f64().expect("a number");
        assert!((*least..*most).contains(&value), "{parameter}: {value}");
    }
}

/// Gap of the trials kept back with what was named over that without it.
fn left(report: &Value, component: &str) -> f64 {
    let size = |key: &str| report["gap"]["held_out"][component][key].as_f64().expect("a number");
    size("after") / size("before")
}

// the force steps by 0.1 to 0.35 of the displaced water along the hull, and by 0.2 to 0.8 across it, where a ramp begins and ends;
// 0.15 s later it is 0.3 to 0.7 and 0.9 to 1.8, and half a second after the ramp most of that is gone

#[test]
fn the_water_that_the_husky_moves_and_its_waves_are_named_from_computed_ramps() {
    let report = of_ramps("husky", "quasi_steady", 1);
    // the step at the ends of a ramp is within what the bundle says of itself where it learnt nothing, so that waves that forget
    // quickly can stand for it; they cannot be left out
    assert_eq!(report["verdict"], "ambiguous", "{}", report["summary"]);
    assert_eq!(report["alternatives"], serde_json::json!([["wave_memory"]]), "{}", report["summary"]);
    within(&report["effects"][0], "added_mass", &[("surge", [0.1, 0.35])]);
    let memory = [("surge", [0.15, 0.6]), ("sway", [0.8, 2.0]), ("time_constant", [0.3, 0.9])];
    within(&report["effects"][1], "wave_memory", &memory);
    assert_eq!(report["effects"].as_array().map(Vec::len), Some(2));
    assert!(left(&report, "fx") < 0.45, "{}", left(&report, "fx"));
}

#[test]
fn what_outlasts_the_ramps_of_the_warthog_is_named_and_brings_the_model_nearer() {
    let report = of_ramps("warthog", "quasi_steady", 5);
    assert_eq!(report["verdict"], "named", "{}", report["summary"]);
    let memory = [("surge", [0.2, 0.6]), ("sway", [0.8, 2.0]), ("time_constant", [0.3, 0.9])];
    within(&report["effects"][0], "wave_memory", &memory);
    assert_eq!(report["effects"].as_array().map(Vec::len), Some(1));
    let (along, across) = (left(&report, "fx"), left(&report, "fy"));
    assert!(along < 0.95 && across < 0.5, "{along} {across}");
}
