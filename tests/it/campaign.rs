//! Promise: a campaign survives a kill, never computes a case twice, refuses what was changed behind its back, and its
//! forces have the right size and sign. Where OpenFOAM is not installed these tests say so and are skipped.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use wade_core::bundle;
use wade_core::frame::Vec3;
use wade_learn::cfd::collect::Collected;
use wade_learn::cfd::means::Means;
use wade_learn::cfd::openfoam::{MeshKind, OpenFoam};
use wade_learn::cfd::plan::{Bed, Case, Ground, Plan};
use wade_learn::cfd::solve::{Load, Measured, Outcome, Section, method};
use wade_learn::dataset;

/// Coarse, and too short to settle: seconds a case.
const COARSE: &str = "settle_s = [0.6, 0.6]\nwindow_s = 0.4\nwindows = 1\n[mesh]\ncells_per_length = 4.0\n\
                      channel_m = [6.0, 5.0, 1.5]\n";
/// As coarse, and long enough for a surface that is not held still to have moved.
const STILL: &str = "settle_s = [2.0, 2.0]\nwindow_s = 1.0\nwindows = 1\n[mesh]\ncells_per_length = 4.0\n\
                     channel_m = [6.0, 5.0, 1.5]\n";

fn openfoam() -> Option<OpenFoam> {
    match OpenFoam::find() {
        Ok(solver) => Some(solver),
        Err(error) => {
            println!("skipped: {error}");
            None
        }
    }
}

fn wade(arguments: &[&str]) -> Output {
    command(arguments).output().expect("wade runs")
}

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command.args(arguments).env("WADE_VEHICLES", crate::common::vehicles());
    command
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A campaign of two coarse cases of the Husky.
fn planned(settings: &str) -> (TempDir, String) {
    let folder = TempDir::new().expect("a temporary folder");
    let settings_file = folder.path().join("settings.toml");
    std::fs::write(&settings_file, settings).expect("written");
    let campaign = folder.path().join("campaign").display().to_string();
    let plan = ["campaign", "plan", "--vehicle", "husky", "--set", "paper", "--cases", "2", "--seed", "4"];
    let settings_file = settings_file.display().to_string();
    let output = wade(&[&plan[..], &["--settings", &settings_file, "--out", &campaign]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    (folder, campaign)
}

#[test]
fn a_killed_campaign_goes_on_and_its_forces_make_sense() {
    let Some(solver) = openfoam() else { return };
    let (_folder, campaign) = planned(COARSE);
    let mut first = command(&["campaign", "run", &campaign, "--jobs", "1"]).spawn().expect("wade runs");
    let outcomes = Path::new(&campaign).join("work/outcomes");
    let started = Instant::now();
    // one that is being written has another name
    let is_whole = |entry: &std::io::Result<std::fs::DirEntry>| {
        entry.as_ref().is_ok_and(|entry| entry.path().extension().is_some_and(|end| end == "json"))
    };
    let done = || std::fs::read_dir(&outcomes).map_or(0, |entries| entries.filter(is_whole).count());
    while done() == 0 {
        assert!(started.elapsed() < Duration::from_secs(300), "no case was done");
        std::thread::sleep(Duration::from_millis(20));
    }
    // in the middle of the second case
    first.kill().expect("killed");
    first.wait().expect("ended");
    assert_eq!(done(), 1);

    let second = wade(&["campaign", "run", &campaign, "--jobs", "2"]);
    assert!(second.status.success(), "{}", stderr(&second));
    assert!(stdout(&second).contains("1 computed, 0 set aside"), "{}", stdout(&second));
    let collected = wade(&["campaign", "collect", &campaign]);
    assert!(stdout(&collected).contains("2 of 2 cases, 2 of them new"), "{}", stderr(&collected));

    // what is collected stays done when the work is gone, and is not added twice
    std::fs::remove_dir_all(Path::new(&campaign).join("work")).expect("removed");
    let third = wade(&["campaign", "run", &campaign]);
    assert!(stdout(&third).contains("0 computed, 0 set aside"), "{}", stderr(&third));
    let again = wade(&["campaign", "collect", &campaign]);
    assert!(stdout(&again).contains("0 of them new"), "{}", stdout(&again));

    // one by an older method stays until it is asked for, and is replaced
    let summaries = Path::new(&campaign).join("cases.csv");
    let text = std::fs::read_to_string(&summaries).expect("summaries");
    let at = text.lines().next().and_then(|names| names.split(',').position(|name| name == "method"));
    let at = at.expect("a column");
    let older = |line: &str| {
        let mut fields: Vec<&str> = line.split(',').collect();
        if fields[0] == "husky-paper-0001" {
            fields[at] = "1";
        }
        fields.join(",") + "\n"
    };
    std::fs::write(&summaries, text.lines().map(older).collect::<String>()).expect("written");
    let report = wade(&["campaign", "report", &campaign]);
    assert!(stdout(&report).contains("1 of them are of an older method"), "{}", stdout(&report));
    let left = wade(&["campaign", "run", &campaign]);
    assert!(stdout(&left).contains("0 computed, 0 set aside"), "{}", stderr(&left));
    let anew = wade(&["campaign", "run", &campaign, "--outdated"]);
    assert!(stdout(&anew).contains("1 computed, 0 set aside"), "{}", stderr(&anew));
    let collected = wade(&["campaign", "collect", &campaign]);
    assert!(stdout(&collected).contains("2 of 2 cases, 1 of them new"), "{}", stdout(&collected));

    // neither another solver's cases nor those of other settings join the data set
    let sections = std::fs::read(Path::new(&campaign).join("sections.parquet")).expect("a data set");
    let outcome = outcomes.join("husky-paper-0001.json");
    let settings = Path::new(&campaign).join("campaign.toml");
    let label = solver.label();
    let edited = [
        (vec![(&outcome, label.as_str(), "another solver")], "computed by", "wade dataset merge"),
        (vec![(&settings, "windows = ", "windows = 1")], "other settings", "move it away"),
        (
            vec![
                (&settings, "windows = ", "windows = 1"),
                (&outcome, "\"windows\":1,\"sample_s", "\"windows\":11,\"sample_s"),
            ],
            "with the settings",
            "wade dataset merge",
        ),
    ];
    for (edits, says, way_out) in edited {
        let texts: Vec<String> =
            edits.iter().map(|(path, ..)| std::fs::read_to_string(path).expect("a file")).collect();
        for ((path, from, to), text) in edits.iter().zip(&texts) {
            assert!(text.contains(from), "{text}");
            std::fs::write(path, text.replace(from, to)).expect("written");
        }
        let whole = std::fs::read_to_string(&summaries).expect("summaries");
        std::fs::write(&summaries, whole.lines().map(older).collect::<String>()).expect("written");
        let mixed = wade(&["campaign", "collect", &campaign]);
        let said = stderr(&mixed);
        assert!(!mixed.status.success() && said.contains(says), "{said}");
        assert!(said.contains("husky-paper-0001") && said.contains(way_out), "{said}");
        std::fs::write(&summaries, whole).expect("written");
        for ((path, ..), text) in edits.iter().zip(&texts) {
            std::fs::write(path, text).expect("written");
        }
    }
    assert_eq!(std::fs::read(Path::new(&campaign).join("sections.parquet")).expect("still there"), sections);

    let data = dataset::read(&Path::new(&campaign).join("sections.parquet")).expect("a data set");
    assert_eq!(data.meta.provenance, solver.label());
    assert_eq!(data.samples.len(), 2 * 4);
    for sample in &data.samples {
        let net = sample.net_force();
        assert!(net.dot(&sample.condition.velocity) < 0.0, "drag opposes the motion: {net}");
        let rest: f64 = sample.surfaces.iter().map(|s| s.rest.expect("at rest").force.z).sum();
        assert!((0.5..1.6).contains(&(net.z / rest)), "{} N of {rest} N at rest", net.z);
    }
    let report = wade(&["campaign", "report", &campaign, "--json"]);
    assert!(report.status.success() && stdout(&report).contains("\"suspicious\""), "{}", stderr(&report));
    assert!(stdout(&report).contains("\"outdated\": 0"), "{}", stdout(&report));
}

/// Puts down the outcome of a case that no solver computed, in which each surface feels `force` newtons along x.
fn put_outcome(campaign: &str, number: usize, force: f64) -> PathBuf {
    let plan = Plan::read(Path::new(campaign)).expect("a plan");
    let vehicle = bundle::read(&crate::common::vehicles().join("husky")).expect("a bundle").vehicle;
    let surfaces: Vec<String> = vehicle.surfaces.iter().map(|surface| surface.name.clone()).collect();
    let case = plan.cases[number].clone();
    let section = Section {
        start_s: 1.0,
        end_s: 1.1,
        speed_mps: case.speed_mps,
        acceleration_mps2: 0.0,
        loads: vec![Load { force: [force, 0.0, 0.0], ..Load::default() }; surfaces.len()],
    };
    let outcome = Outcome {
        solver: "generated for a test".to_owned(),
        method: method(&case),
        settings: plan.campaign.settings,
        hull_sha256: plan.campaign.hull_sha256,
        mesh_kind: MeshKind::Castellated,
        cells: 1000,
        courant: 1.0,
        attempts: 1,
        steps: 10,
        core_s: 1.0,
        windows: 1,
        settled: true,
        drift: [0.0; 3],
        mass_imbalance: 0.0,
        rest: vec![Load::default(); surfaces.len()],
        surfaces,
        measured: None,
        sections: vec![section],
        case,
    };
    let folder = Path::new(campaign).join("work/outcomes");
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join(format!("{}.json", outcome.case.id));
    std::fs::write(&path, serde_json::to_string(&outcome).expect("JSON")).expect("written");
    path
}

#[test]
fn an_outcome_that_the_data_set_cannot_hold_is_refused_and_what_was_collected_stays() {
    let (_folder, campaign) = planned(COARSE);
    put_outcome(&campaign, 0, -1.0);
    let first = wade(&["campaign", "collect", &campaign]);
    assert!(stdout(&first).contains("1 of 2 cases, 1 of them new"), "{}", stderr(&first));
    let files = ["sections.parquet", "cases.csv"].map(|name| Path::new(&campaign).join(name));
    let contents = || files.each_ref().map(|file| std::fs::read(file).expect("collected"));
    let before = contents();
    put_outcome(&campaign, 1, 1e39);
    let refused = wade(&["campaign", "collect", &campaign]);
    let said = stderr(&refused);
    assert_eq!(refused.status.code(), Some(1), "{said}");
    let expected = "case `husky-paper-0001`, section 0, surface `front_lower`: fx_n is 1e39, beyond";
    assert!(said.contains("sections.parquet: ") && said.contains(expected), "{said}");
    assert_eq!(contents(), before);
    put_outcome(&campaign, 1, -1.0);
    let second = wade(&["campaign", "collect", &campaign]);
    assert!(stdout(&second).contains("2 of 2 cases, 1 of them new"), "{}", stderr(&second));
}

#[test]
fn a_data_set_without_its_summaries_or_the_reverse_is_refused_and_nothing_is_written() {
    let (_folder, campaign) = planned(COARSE);
    let collect = || wade(&["campaign", "collect", &campaign]);
    let outcome = put_outcome(&campaign, 0, -1.0);
    assert!(collect().status.success());
    let files = ["sections.parquet", "cases.csv"].map(|name| Path::new(&campaign).join(name));
    let whole = files.each_ref().map(|file| std::fs::read(file).expect("collected"));
    // cut off between the two files: the outcome is still there
    std::fs::remove_file(&files[1]).expect("removed");
    let again = collect();
    assert!(stdout(&again).contains("1 of 2 cases, 1 of them new"), "{}", stderr(&again));

    std::fs::remove_file(outcome).expect("removed");
    let refused = |what: &str| {
        let before = files.each_ref().map(|file| std::fs::read(file).ok());
        let output = collect();
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{what}: {said}");
        for part in [what, "campaign/sections.parquet", "campaign/cases.csv", "restore", "remove both"] {
            assert!(said.contains(part), "{part}: {said}");
        }
        assert_eq!(files.each_ref().map(|file| std::fs::read(file).ok()), before, "{what}");
    };
    let summaries = std::fs::read_to_string(&files[1]).expect("summaries");
    let names = format!("{}\n", summaries.lines().next().expect("names of columns"));
    for has_new in [false, true] {
        if has_new {
            put_outcome(&campaign, 1, -1.0);
        }
        for (file, content, what) in [
            (&files[0], None, "sections.parquet is missing"),
            (&files[0], Some("damaged"), "sections.parquet cannot be read"),
            (&files[1], None, "cases.csv is missing"),
            (&files[1], Some(names.as_str()), "cases.csv has no row for case `husky-paper-0000`"),
        ] {
            match content {
                Some(content) => std::fs::write(file, content).expect("written"),
                None => std::fs::remove_file(file).expect("removed"),
            }
            refused(what);
            files.iter().zip(&whole).for_each(|(file, bytes)| std::fs::write(file, bytes).expect("restored"));
        }
    }
    let second = collect();
    assert!(stdout(&second).contains("2 of 2 cases, 1 of them new"), "{}", stderr(&second));
    // a data set from before the second case
    std::fs::write(&files[0], &whole[0]).expect("written");
    refused("sections.parquet has no section of case `husky-paper-0001`");
}

#[test]
fn two_runs_in_one_folder_compute_each_case_once() {
    if openfoam().is_none() {
        return;
    }
    let (_folder, campaign) = planned(COARSE);
    let run = || {
        let mut run = command(&["campaign", "run", &campaign, "--jobs", "1"]);
        run.stdout(Stdio::piped()).spawn().expect("wade runs")
    };
    let computed = [run(), run()].map(|run| {
        let output = run.wait_with_output().expect("it ends");
        let said = stdout(&output);
        assert!(output.status.success() && said.contains(" 0 set aside"), "{said}");
        said.split(' ').next().and_then(|count| count.parse::<usize>().ok()).expect("a count")
    });
    assert_eq!(computed.iter().sum::<usize>(), 2, "{computed:?}");
    let collected = wade(&["campaign", "collect", &campaign]);
    assert!(stdout(&collected).contains("2 of 2 cases, 2 of them new"), "{}", stderr(&collected));
}

#[test]
fn a_still_case_feels_archimedes_on_its_own_mesh() {
    if openfoam().is_none() {
        return;
    }
    let (_folder, campaign) = planned(STILL);
    let path = Path::new(&campaign);
    let mut plan = Plan::read(path).expect("a plan");
    plan.cases.truncate(1);
    (plan.cases[0].speed_mps, plan.cases[0].end_speed_mps, plan.cases[0].depth_m) = (0.0, 0.0, 0.10);
    plan.write(path).expect("written");
    let output = wade(&["campaign", "run", &campaign, "--jobs", "1"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(wade(&["campaign", "collect", &campaign]).status.success());
    let data = dataset::read(&path.join("sections.parquet")).expect("a data set");
    let first = &data.samples[0];
    let rest: f64 = first.surfaces.iter().map(|s| s.rest.expect("at rest").force.z).sum();
    let error = first.net_force().z / rest - 1.0;
    println!("at rest the solver is {:+.2} % off Archimedes on the mesh", 100.0 * error);
    // -2.5 % where faces between cells of two sizes drive the air above them
    assert!(error.abs() < 0.01, "{error}");
}

/// Net force along x of the sections of a case, with their times and accelerations.
fn along(data: &dataset::Dataset, case: &str) -> Vec<(f64, f64, f64)> {
    let of_case = data.samples.iter().filter(|sample| sample.case == case);
    of_case.map(|sample| (sample.start_s, sample.condition.acceleration.x, sample.net_force().x)).collect()
}

#[test]
fn a_ramp_pulls_back_as_added_mass_does_a_bed_may_move_and_an_unsettled_case_gets_another_window() {
    if openfoam().is_none() {
        return;
    }
    let (_folder, campaign) = planned(&COARSE.replace("windows = 1", "windows = 2\ndrift = 0.0"));
    let rows = "id,set,speed_mps,heading_deg,depth_m,density_kgpm3,roll_deg,pitch_deg,bed,cell_scale,end_speed_mps,ramp_s\n\
                steady,paper,0.5,0,0.15,1000,0,0,parked,1,0.5,0\nrolling,driving,0.5,0,0.15,1000,0,0,driving,1,0.5,0\n\
                ramp,unsteady,0.25,0,0.15,1000,0,0,parked,1,0.75,0.5\n";
    std::fs::write(Path::new(&campaign).join("plan.csv"), rows).expect("written");
    let run = wade(&["campaign", "run", &campaign, "--jobs", "2", "--keep"]);
    assert!(run.status.success(), "{}", stderr(&run));
    assert!(wade(&["campaign", "collect", &campaign]).status.success());
    let data = dataset::read(&Path::new(&campaign).join("sections.parquet")).expect("a data set");
    let mean = |rows: &[(f64, f64, f64)]| rows.iter().map(|row| row.2).sum::<f64>() / rows.len() as f64;

    // the second window follows the first, over a restart of the solver
    let steady = along(&data, "steady");
    assert_eq!(steady.len(), 4);
    assert!((steady[0].0 - 1.0).abs() < 1e-9 && (steady[3].0 - 1.3).abs() < 1e-9, "{steady:?}");
    let ratio = mean(&along(&data, "rolling")) / mean(&steady);
    println!("with a moving bed and turning wheels {ratio:.3} of the drag");
    assert!((0.6..1.4).contains(&ratio), "{ratio}");

    // what the ramp adds at its start pulls against the acceleration, and is as large as the water about the hull can make it
    let ramp = along(&data, "ramp");
    let before = mean(&ramp.iter().copied().filter(|row| row.0 < 0.55).collect::<Vec<_>>());
    let first = ramp.iter().find(|row| row.1 > 0.0).expect("a section within the ramp");
    let displaced = {
        let sample = data.samples.iter().find(|sample| sample.case == "ramp").expect("a sample");
        sample.surfaces.iter().map(|surface| surface.rest.expect("at rest").force.z).sum::<f64>() / 9.81
    };
    let share = (before - first.2) / (displaced * first.1);
    println!("added mass over the displaced: {share:.2}");
    assert!((0.1..1.0).contains(&share), "{share}: {ramp:?}");
    // the solver's steps meet both ends of the ramp
    let log = std::fs::read_to_string(Path::new(&campaign).join("work/ramp/log.interFoam")).expect("a log");
    for time in ["Time = 0.6\n", "Time = 1.1\n"] {
        assert!(log.contains(time), "no step ends at {time}");
    }
}

/// Coarse, and with flow times that are too short to settle.
const MEANS: &str = "limit_s = 600.0\n[flow_time]\nlengths = [2.0, 2.0, 2.0, 2.0]\nwindow = 1.0\nshift = 0.5\n\
                     [mesh]\ncells_per_length = 4.0\nchannel_m = [6.0, 5.0, 1.5]\n";

/// A campaign of one round of the set `drive`.
fn planned_round(settings: &str) -> (TempDir, String) {
    let folder = TempDir::new().expect("a temporary folder");
    let settings_file = folder.path().join("settings.toml");
    std::fs::write(&settings_file, settings).expect("written");
    let campaign = folder.path().join("campaign").display().to_string();
    let plan = ["campaign", "plan", "--vehicle", "husky", "--set", "drive", "--cases", "10", "--repeat"];
    let repeat = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/husky").display().to_string();
    let settings_file = settings_file.display().to_string();
    let output = wade(&[&plan[..], &[&repeat, "--settings", &settings_file, "--out", &campaign]].concat());
    assert!(stdout(&output).contains("12 cases, 12 of them new"), "{}", stderr(&output));
    (folder, campaign)
}

#[test]
fn means_of_a_round_take_two_kilobytes_a_case_and_read_back_as_a_data_set() {
    let (_folder, campaign) = planned_round(MEANS);
    let path = Path::new(&campaign);
    let outcome = put_outcome(&campaign, 0, -12.345_678);
    let text = std::fs::read_to_string(&outcome).expect("an outcome");
    let mut outcomes: Vec<Outcome> = vec![serde_json::from_str(&text).expect("an outcome")];
    let surfaces = outcomes[0].surfaces.len();
    // no two numbers are alike, as of a computed case
    let odd = |i: usize| 123.456_78 + 7.654_321 * i as f64;
    for (i, load) in outcomes[0].sections[0].loads.iter_mut().enumerate() {
        (load.force, load.moment) = ([odd(i), -odd(i + 1), odd(i + 2)], [odd(i + 3), odd(i + 4), odd(i + 5)]);
    }
    let measured = Measured {
        depth_m: 0.123_456,
        speed_mps: 0.456_789,
        bed_clearance_m: 0.012_345,
        drift: (0..surfaces).map(|i| [odd(i); 3]).collect(),
    };
    outcomes[0].measured = Some(measured);
    std::fs::write(&outcome, serde_json::to_string(&outcomes[0]).expect("JSON")).expect("written");
    let collected = wade(&["campaign", "collect", &campaign]);
    assert!(stdout(&collected).contains("1 of 12 cases, 1 of them new"), "{}", stderr(&collected));
    let again = wade(&["campaign", "collect", &campaign]);
    assert!(stdout(&again).contains("1 of 12 cases, 0 of them new"), "{}", stderr(&again));
    let written = path.join("means.parquet").display().to_string();
    let again = wade(&["campaign", "collect", &campaign, "--dataset", &written]);
    assert!(again.status.success(), "{}", stderr(&again));
    let report = wade(&["campaign", "report", &campaign]);
    assert!(stdout(&report).contains("drive     1 of 12 cases, 1 settled"), "{}", stderr(&report));
    let rows = |name: &str| {
        let text = std::fs::read_to_string(path.join(name)).expect("collected");
        let rows = text.lines().filter(|line| line.starts_with("husky-drive-0000"));
        rows.map(|row| row.len() + 1).sum::<usize>()
    };
    let bytes = rows("surfaces.csv") + rows("cases.csv");
    assert!(rows("surfaces.csv") > 1000 && bytes <= 2048, "{bytes} bytes");

    let plan = Plan::read(path).expect("a plan");
    let summaries = Collected::read(path, &plan).expect("summaries");
    let means = Means::read(path).expect("means").expect("some");
    let data = means.dataset(path, &plan, &summaries.cases).expect("a data set");
    assert_eq!((data.samples.len(), data.samples[0].surfaces.len()), (1, surfaces));
    let read = dataset::read(Path::new(&written)).expect("a data set");
    assert_eq!((read.samples.len(), &read.meta), (1, &data.meta));
    let sample = &data.samples[0];
    assert!((sample.surfaces[1].force.x - odd(1)).abs() < 0.1);
    assert!((sample.condition.velocity.norm() - 0.4568).abs() < 1e-9);
    assert!((sample.condition.depth - 0.1235).abs() < 1e-9);
    let planned = plan.cases[0].share_of_bed() * plan.cases[0].speed_mps;
    assert!((sample.condition.ground_velocity.norm() - planned).abs() < 1e-9);

    // a summary without its surfaces
    std::fs::remove_file(path.join("surfaces.csv")).expect("removed");
    std::fs::remove_file(&outcome).expect("removed");
    let refused = wade(&["campaign", "collect", &campaign]);
    assert!(stderr(&refused).contains("surfaces.csv has no row of case"), "{}", stderr(&refused));
}

#[test]
fn a_ramp_a_deep_bed_and_a_tilted_hull_are_computed_and_labelled_with_the_measured_flow() {
    if openfoam().is_none() {
        return;
    }
    let (_folder, campaign) = planned_round(MEANS);
    let path = Path::new(&campaign);
    let mut plan = Plan::read(path).expect("a plan");
    let level = Case { depth_m: 0.17, speed_mps: 0.8, end_speed_mps: 0.8, ..plan.cases[0].clone() };
    let level = Case { heading_deg: 30.0, density_kgpm3: 1000.0, ..level };
    let state = |name: &str, roll_deg: f64, pitch_deg: f64| {
        let id = format!("husky-drive-{name}");
        let (bed, bed_share, ground, clearance_m) = (Bed::Driving, Some(1.0), Ground::Flat, 0.0);
        Case { id, roll_deg, pitch_deg, bed, bed_share, ground, clearance_m, ..level.clone() }
    };
    plan.cases = vec![
        Case { ground: Ground::Ramp, ..state("ramp", -8.0, 10.0) },
        Case { clearance_m: 0.8, ..state("deep", 5.0, -12.0) },
        state("tilted", 5.0, -12.0),
    ];
    plan.write(path).expect("written");
    let output = wade(&["campaign", "run", &campaign, "--jobs", "2"]);
    assert!(output.status.success(), "{}{}", stdout(&output), stderr(&output));
    assert!(wade(&["campaign", "collect", &campaign]).status.success());
    let summaries = Collected::read(path, &plan).expect("summaries");
    let means = Means::read(path).expect("means").expect("some");
    let data = means.dataset(path, &plan, &summaries.cases).expect("a data set");
    assert_eq!(data.samples.len(), 3);
    for sample in &data.samples {
        let (velocity, case) = (sample.condition.velocity, &sample.case);
        assert!((velocity.norm() / 0.8 - 1.0).abs() < 0.1, "{case}: {velocity}");
        let rest: Vec3 = sample.surfaces.iter().map(|s| s.rest.expect("at rest").force).sum();
        let dynamic = sample.net_force() - rest;
        assert!(dynamic.dot(&velocity) < 0.0, "{case}: drag opposes the motion: {dynamic}");
        assert!(dynamic.norm() < 0.8 * rest.norm(), "{case}: {dynamic} of {rest} at rest");
        let up = sample.condition.up.dot(&rest);
        // the dry contact of wheels that stand on the steps of a ramp is not small
        let is_vertical = rest.norm() - up < 0.01 * up;
        assert!(is_vertical || case.contains("ramp"), "{case}: {rest}");
    }
}

#[test]
fn a_case_that_takes_too_long_is_tried_twice_then_set_aside_and_named() {
    if openfoam().is_none() {
        return;
    }
    let (_folder, campaign) = planned(&format!("limit_s = 0.2\n{COARSE}"));
    let output = wade(&["campaign", "run", &campaign, "--jobs", "2"]);
    assert_eq!(output.status.code(), Some(1));
    let said = stdout(&output);
    assert!(said.contains("set aside: husky-paper-0000") && said.contains("2 set aside"), "{said}");
    assert!(stderr(&output).contains("once more with smaller steps"), "{}", stderr(&output));
    let later = wade(&["campaign", "run", &campaign]);
    assert!(stdout(&later).contains("2 set aside earlier"), "{}", stdout(&later));
}

#[test]
fn a_case_folder_edited_by_hand_is_refused_before_anything_starts() {
    if openfoam().is_none() {
        return;
    }
    let (_folder, campaign) = planned(&format!("limit_s = 0.2\n{COARSE}"));
    wade(&["campaign", "run", &campaign]);
    let edited = Path::new(&campaign).join("work/husky-paper-0001/system/fvSolution");
    let text = std::fs::read_to_string(&edited).expect("a case folder");
    std::fs::write(&edited, text.replace("cAlpha          1", "cAlpha          2")).expect("written");
    let output = wade(&["campaign", "run", &campaign, "--again"]);
    let said = stderr(&output);
    assert!(!output.status.success() && said.contains("husky-paper-0001/system/fvSolution"), "{said}");
}

#[test]
fn the_fault_of_debians_build_is_found_by_computing_a_turned_cell() {
    let Some(solver) = openfoam() else { return };
    // other builds of v1912 may be sound; a snapped mesh must never be used with one that is not
    println!("v{}: {:?}", solver.version, solver.mesh_kind);
    if solver.root == Path::new("/usr/share/openfoam") && solver.version == 1912 {
        assert_eq!(solver.mesh_kind, MeshKind::Castellated);
    }
}

#[test]
fn a_plan_for_another_hull_a_twisted_table_and_a_missing_solver_are_refused() {
    let (folder, campaign) = planned(COARSE);
    let path = Path::new(&campaign).join("campaign.toml");
    let text = std::fs::read_to_string(&path).expect("a campaign");
    let hash = text.lines().find(|line| line.starts_with("hull_sha256")).expect("a hash").to_owned();
    std::fs::write(&path, text.replace(&hash, "hull_sha256 = \"0\"")).expect("written");
    let output = wade(&["campaign", "run", &campaign]);
    assert!(stderr(&output).contains("another hull"), "{}", stderr(&output));
    std::fs::write(&path, text).expect("written");

    let output =
        command(&["campaign", "run", &campaign]).env("WM_PROJECT_DIR", "/nowhere").output().expect("runs");
    assert!(!output.status.success() && stderr(&output).contains("/nowhere"), "{}", stderr(&output));
    assert!(!Path::new(&campaign).join("work").exists(), "nothing was begun");

    let table = folder.path().join("table.toml");
    let range = "{ min = 1.0, max = 0.5 }";
    let twisted =
        ["speed_mps", "angle_deg", "density_kgpm3", "depth_m"].map(|key| format!("{key} = {range}\n"));
    std::fs::write(&table, twisted.concat()).expect("written");
    let (table, out) = (table.display().to_string(), folder.path().join("other").display().to_string());
    let plan = ["campaign", "plan", "--vehicle", "husky", "--set", "paper"];
    let output = wade(&[&plan[..], &["--table", &table, "--out", &out]].concat());
    assert!(stderr(&output).contains("upside down"), "{}", stderr(&output));
    assert!(!Path::new(&out).exists());
}

#[test]
fn the_committed_campaigns_are_what_their_plans_say() {
    for vehicle in ["husky", "warthog"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns").join(vehicle);
        let report = wade(&["campaign", "report", folder.to_str().expect("a name")]);
        assert!(report.status.success(), "{}", stderr(&report));
        let said = String::from_utf8_lossy(&report.stdout).into_owned();
        assert!(said.contains("paper     175 of 175 cases"), "{said}");
        // in its own channel, and in one half as large again
        let in_channel = |line: &&str| line.contains("cells x 1.00, channel x");
        assert_eq!(said.lines().filter(in_channel).count(), 2, "{said}");
    }
}
