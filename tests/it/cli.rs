//! Promise: the command line keeps its names, its JSON and its exit codes.

use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;

fn wade(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command
        .args(arguments)
        .env("WADE_VEHICLES", crate::common::vehicles())
        .output()
        .expect("the program runs")
}

fn json(arguments: &[&str]) -> Value {
    let output = wade(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn every_subcommand_shows_an_example() {
    let commands = [
        "",
        "serve",
        "query",
        "predict",
        "soak",
        "vehicle",
        "vehicle build",
        "vehicle import",
        "vehicle generate",
        "vehicle check",
        "vehicle list",
        "vehicle show",
        "vehicle reload",
        "train",
        "eval",
        "campaign",
        "campaign plan",
        "validate",
        "gap",
        "doctor",
        "completions",
        "man",
    ];
    for command in commands {
        let arguments: Vec<&str> = command.split_whitespace().chain(["--help"]).collect();
        let output = wade(&arguments);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && text.contains("Example"), "{command}: {text}");
    }
}

#[test]
fn help_says_all_that_stands_above_a_command() {
    for (command, says) in [
        ("predict", "Columns: vx vy vz"),
        ("soak", "Exit status 1"),
        ("validate", "Exit status 1"),
        ("gap", "Exit status 1"),
        ("campaign run", "Killed at any time"),
    ] {
        let arguments: Vec<&str> = command.split_whitespace().chain(["--help"]).collect();
        let output = wade(&arguments);
        let text = String::from_utf8_lossy(&output.stdout).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains(says), "{command}: {text}");
    }
}

#[test]
fn a_query_prints_the_names_that_scripts_rely_on() {
    let answer = json(&["query", "--vehicle", "husky", "--speed", "0.8", "--depth", "0.18", "--json"]);
    for key in [
        "vehicle",
        "version",
        "provenance",
        "surfaces",
        "wrench",
        "uncertainty",
        "in_domain",
        "outside",
        "effects",
        "compute_ns",
    ] {
        assert!(!answer[key].is_null(), "{key} is missing");
    }
    assert_eq!(answer["surfaces"].as_array().map(Vec::len), Some(13));
    let surface = &answer["surfaces"][0];
    assert_eq!(surface["force"].as_array().map(Vec::len), Some(3));
    assert_eq!(surface["point"].as_array().map(Vec::len), Some(3));
    assert!(surface["name"].is_string() && surface["wetted_fraction"].is_number());
    for key in ["force", "moment", "about"] {
        assert_eq!(answer["wrench"][key].as_array().map(Vec::len), Some(3), "{key}");
    }
    assert_eq!(answer["uncertainty"]["force"].as_array().map(Vec::len), Some(3));
    assert_eq!(answer["in_domain"], Value::Bool(true));
    let outside = json(&["query", "--vehicle", "husky", "--speed", "0.8", "--depth", "0.5", "--json"]);
    assert_eq!(outside["outside"][0]["quantity"], "depth_m");
}

#[test]
fn over_the_same_bed_a_current_and_its_opposite_velocity_are_the_same() {
    let parked = [
        "query",
        "--vehicle",
        "husky",
        "--velocity",
        "0,0,0",
        "--current",
        "-0.5,0,0",
        "--depth",
        "0.1",
        "--json",
    ];
    let driving = ["query", "--vehicle", "husky", "--velocity", "0.5,0,0", "--depth", "0.1", "--json"];
    for bed in ["parked", "driving"] {
        let over = |state: &[&'static str]| json(&[state, &["--bed", bed]].concat())["wrench"].clone();
        assert_eq!(over(&parked), over(&driving));
    }
}

#[test]
fn exit_codes_tell_usage_from_failure() {
    assert_eq!(wade(&["query", "--vehicle", "husky"]).status.code(), Some(2), "the depth is missing");
    for (bad, field) in
        [(["--depth", "1e9"].as_slice(), "depth_m"), (&["--depth", "0.1", "--bed", "2"], "bed")]
    {
        let bad = wade(&[&["query", "--vehicle", "husky", "--speed", "1"], bad].concat());
        assert_eq!(bad.status.code(), Some(1));
        assert!(String::from_utf8_lossy(&bad.stderr).contains(field));
    }
    let both = ["query", "--vehicle", "husky", "--depth", "0.1", "--water-level", "0.1"];
    assert_eq!(wade(&both).status.code(), Some(2), "a depth and a water level");
    let unknown = wade(&["query", "--vehicle", "nautilus", "--speed", "1", "--depth", "0.1"]);
    assert_eq!(unknown.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("nautilus"));
}

#[test]
fn a_state_outside_the_training_domain_is_said_loudly_with_what_was_probably_meant() {
    let ask = |more: &[&str]| wade(&[&["query", "--vehicle", "husky", "--speed", "0.8"], more].concat());
    let stderr = |output: &Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let inside = ask(&["--depth", "0.18", "--strict"]);
    assert_eq!((inside.status.code(), stderr(&inside).as_str()), (Some(0), ""));
    for (arguments, says) in [
        (["--depth", "18"].as_slice(), "were 18 cm meant? Write 0.18"),
        (&["--depth", "18"], "times the usual spacing of the training states"),
        (&["--depth", "0.18", "--roll", "7"], "were 7 degrees meant? --roll 0.1222"),
        (&["--depth", "0.18", "--density", "1"], "were 1 g/cm3 meant? Write 1000"),
    ] {
        for more in [[].as_slice(), &["--json"]] {
            let output = ask(&[arguments, more].concat());
            let text = stderr(&output);
            assert_eq!(output.status.code(), Some(0), "{text}");
            assert!(text.starts_with("warning: the state is outside") && text.contains(says), "{text}");
        }
        assert_eq!(ask(&[arguments, &["--strict"]].concat()).status.code(), Some(1));
    }
    // on its back a vehicle has no depth
    let inverted = ask(&["--depth", "0.18", "--roll", "10"]);
    assert_eq!(inverted.status.code(), Some(1));
    let text = stderr(&inverted);
    assert!(
        text.contains("were 10 degrees meant? --roll 0.1745") && text.contains("water_level_m"),
        "{text}"
    );
}

#[test]
fn a_bundle_is_checked() {
    let good = crate::common::vehicles().join("husky");
    assert_eq!(wade(&["vehicle", "check", &good.to_string_lossy()]).status.code(), Some(0));
    let copy = crate::common::copy_of_vehicles();
    let bad = copy.path().join("husky");
    std::fs::write(bad.join("hull.stl"), b"nothing").expect("written");
    let output = wade(&["vehicle", "check", &bad.to_string_lossy()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("hull.stl"));
}

#[test]
fn a_vehicle_is_built_from_an_stl_and_a_vehicle_file() {
    let folder = TempDir::new().expect("a folder");
    let (stl, out) = (crate::common::vehicles().join("husky/hull.stl"), folder.path().join("rover"));
    let spec = std::fs::read_to_string(crate::common::vehicles().join("husky/spec.toml")).expect("readable");
    let spec_path = folder.path().join("rover.toml");
    std::fs::write(&spec_path, spec.replacen("name = \"husky\"", "name = \"rover\"", 1)).expect("written");
    let build = |version: u32| {
        let output = wade(&[
            "vehicle",
            "build",
            "--stl",
            &stl.to_string_lossy(),
            "--spec",
            &spec_path.to_string_lossy(),
            "--out",
            &out.to_string_lossy(),
        ]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            text.contains(&format!("version {version}")),
            "{text}{}",
            String::from_utf8_lossy(&output.stderr)
        );
    };
    build(1);
    build(2);
    let shown = json(&["vehicle", "show", "rover", "--vehicles", &folder.path().to_string_lossy(), "--json"]);
    assert_eq!(shown["surfaces"].as_array().map(Vec::len), Some(13));
    assert_eq!(shown["provenance"], Value::Null);
}

#[test]
fn a_recording_without_accelerations_accelerates_as_its_velocity_says() {
    let folder = TempDir::new().expect("a folder");
    let fx = |name: &str, header: &str, row: &dyn Fn(f64) -> String| -> Vec<f64> {
        let path = |end: &str| folder.path().join(format!("{name}{end}")).to_string_lossy().into_owned();
        let rows: String = (0..60).map(|i| row(0.02 * f64::from(i)) + "\n").collect();
        std::fs::write(path(".csv"), format!("{header}\n{rows}")).expect("written");
        let (states, out) = (path(".csv"), path("-out.csv"));
        let output = wade(&["predict", "--vehicle", "warthog", "--states", &states, "--out", &out]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut reader = csv::Reader::from_path(out).expect("a table");
        let at = reader.headers().expect("headers").iter().position(|header| header == "fx").expect("fx");
        reader.records().map(|record| record.expect("a row")[at].parse().expect("a number")).collect()
    };
    let speed = |t: f64| 0.5 + 0.7 * t;
    let told = fx("told", "t,vx,vy,vz,depth,ax,ay,az", &|t| format!("{t},{},0,0,0.3,0.7,0,0", speed(t)));
    let derived = fx("derived", "t,vx,vy,vz,depth", &|t| format!("{t},{},0,0,0.3", speed(t)));
    let single = fx("single", "vx,vy,vz,depth", &|t| format!("{},0,0,0.3", speed(t)));
    for ((told, derived), single) in told.iter().zip(&derived).zip(&single).skip(5) {
        assert!((told - derived).abs() < 1e-3, "{told} {derived}");
        // some 40 kg of water accelerate along
        assert!(derived < &(single - 10.0), "{derived} {single}");
    }
    // round a circle, where the components of the velocity stay
    let circle = |t: f64| format!("{t},0.5,0.5,0,0.5,0.3");
    let derived = fx("round", "t,vx,vy,vz,wz,depth", &circle);
    let inertial = fx("inertial", "t,vx,vy,vz,wz,depth,ax,ay,az", &|t| format!("{},-0.25,0.25,0", circle(t)));
    let rates = fx("rates", "t,vx,vy,vz,wz,depth,ax,ay,az", &|t| format!("{},0,0,0", circle(t)));
    assert_eq!(rates, inertial);
    for (derived, inertial) in derived.iter().zip(&inertial) {
        assert!((derived - inertial).abs() < 1e-3, "{derived} {inertial}");
    }
    // an acceleration that is of neither kind counts as it is
    let pushed = fx("pushed", "t,vx,vy,vz,wz,depth,ax,ay,az", &|t| format!("{},0.75,0.25,0", circle(t)));
    assert!(pushed[30] < inertial[30] - 10.0, "{} {}", pushed[30], inertial[30]);
}

#[test]
fn a_table_of_states_gets_its_forces() {
    let folder = TempDir::new().expect("a folder");
    let (states, out) = (folder.path().join("in.csv"), folder.path().join("out.csv"));
    std::fs::write(&states, "vx,vy,vz,depth,note\n0.5,0,0,0.1,a\n0.8,0,0,0.18,b\n").expect("written");
    let arguments = [
        "predict",
        "--vehicle",
        "husky",
        "--states",
        &states.to_string_lossy(),
        "--out",
        &out.to_string_lossy(),
        "--per-surface",
    ];
    assert!(wade(&arguments).status.success());
    let mut reader = csv::Reader::from_path(&out).expect("a table");
    let headers = reader.headers().expect("headers").clone();
    let column =
        |name: &str| headers.iter().position(|header| header == name).unwrap_or_else(|| panic!("no {name}"));
    let rows: Vec<csv::StringRecord> = reader.records().collect::<Result<_, _>>().expect("rows");
    assert_eq!((rows.len(), &rows[1][column("note")]), (2, "b"));
    let answer = json(&["query", "--vehicle", "husky", "--speed", "0.8", "--depth", "0.18", "--json"]);
    for (name, expected) in [
        ("fx", &answer["wrench"]["force"][0]),
        ("my", &answer["wrench"]["moment"][1]),
        ("wheel_fl_fz", &answer["surfaces"][9]["force"][2]),
    ] {
        let value: f64 = rows[1][column(name)].parse().expect("a number");
        let expected = expected.as_f64().expect("a number");
        assert!((value - expected).abs() <= 1e-6 * expected.abs(), "{name}: {value} and {expected}");
    }
    // straight ahead nothing acts to the side, and what rounding leaves is no force
    assert_eq!(&rows[1][column("fy")], "0");
    assert!(rows.iter().flatten().all(|cell| cell != "-0" && !cell.starts_with("-0.00000")), "{rows:?}");
    let deviation: f64 = rows[1][column("sfx")].parse().expect("a number");
    let expected = answer["uncertainty"]["force"][0].as_f64().expect("a number");
    assert!((deviation - expected).abs() <= 1e-6 * expected, "{deviation} and {expected}");
    let deviation: f64 = rows[1][column("smy")].parse().expect("a number");
    assert!(deviation > 0.0);
    for (name, expected) in [("in_domain", "1"), ("outside", "")] {
        assert_eq!(&rows[1][column(name)], expected, "{name}");
    }
    std::fs::write(&states, "vx,vy,vz,depth,rho\n0.5,0,0,0.1,1000\n0.5,0,0,18,1\n").expect("written");
    let output = wade(&arguments);
    let warning = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && warning.contains("1 of 2 rows are outside"), "{warning}");
    let mut reader = csv::Reader::from_path(&out).expect("a table");
    let headers = reader.headers().expect("headers").clone();
    let last = reader.records().last().expect("two rows").expect("a row");
    let at = headers.iter().position(|header| header == "outside").expect("the column");
    assert_eq!(&last[at], "density_kgpm3;depth_m;distance");
    assert_eq!(wade(&[&arguments[..], &["--strict"]].concat()).status.code(), Some(1));

    std::fs::write(&states, "t,vx,vy,vz,depth\n0,0.5,0,0,0.1\n1,oops,0,0,0.18\n").expect("written");
    let output = wade(&arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.code() == Some(1) && message.contains("row 3") && message.contains("oops"),
        "{message}"
    );
    assert_eq!(
        csv::Reader::from_path(&out).expect("the table before").records().count(),
        2,
        "nothing is lost"
    );
}

#[test]
fn a_bundle_never_takes_the_place_of_other_files() {
    let folder = TempDir::new().expect("a folder");
    let husky = folder.path().join("husky");
    std::fs::create_dir(&husky).expect("made");
    std::fs::write(husky.join("thesis.tex"), "irreplaceable").expect("written");
    for out in [husky.clone(), folder.path().to_owned(), folder.path().join(".")] {
        let output = wade(&["vehicle", "generate", "husky", "--out", &out.to_string_lossy()]);
        assert_eq!(output.status.code(), Some(1), "{}", out.display());
    }
    assert_eq!(std::fs::read_to_string(husky.join("thesis.tex")).expect("still there"), "irreplaceable");
}

#[test]
fn the_readme_is_finished() {
    let readme =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/README.md")).expect("readable");
    assert!(!readme.contains("@@"), "a figure is missing");
}

#[test]
fn a_reason_is_told_once() {
    for arguments in [
        ["vehicle", "check", "/nowhere/husky"].as_slice(),
        &["eval", "--data", "analytic", "--trained", "/nowhere"],
        &["dataset", "describe", "/nowhere/a.parquet"],
    ] {
        let output = wade(arguments);
        let error = String::from_utf8(output.stderr).expect("text");
        assert!(!output.status.success() && error.contains("/nowhere"), "{error}");
        assert_eq!(error.matches("os error 2").count(), 1, "{error}");
    }
}

fn refused(arguments: &[&str], says: &str) {
    let output = wade(arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(1) && message.contains(says), "{arguments:?}: {message}");
}

#[test]
fn what_is_written_takes_the_place_of_nothing_else() {
    let folder = crate::common::copy_of_vehicles();
    let path = |name: &str| folder.path().join(name).to_str().expect("UTF-8").to_owned();
    let sums = || std::fs::read_to_string(path("husky/SHA256SUMS")).expect("readable");
    let before = (sums(), std::fs::read_dir(path("husky")).expect("readable").count());
    let bundles = path("");
    for command in [
        &["gap", "--vehicle", "husky", "--trials", "tests/data/wading"] as &[&str],
        &["train", "--data", "analytic", "--epochs", "1"],
    ] {
        let out = path("husky");
        refused(&[command, &["--vehicles", &bundles, "--out", &out]].concat(), "holds a vehicle bundle");
    }
    assert_eq!((sums(), std::fs::read_dir(path("husky")).expect("readable").count()), before);

    std::fs::write(path("a.partial"), "vx,vy,vz,depth\n0.5,0,0,0.1\n").expect("written");
    let predict =
        |states: &str, out: &str| wade(&["predict", "--vehicle", "husky", "--states", states, "--out", out]);
    assert!(predict(&path("a.partial"), &path("a.csv")).status.success());
    assert_eq!(std::fs::read_to_string(path("a.csv")).expect("written").lines().count(), 2);
    assert!(path_has(&path("a.partial"), "0.5"));
    let milliseconds = "t,vx,vy,vz,depth\n0,0.5,0,0,0.1\n10,0.5,0,0,0.1\n20,0.5,0,0,0.1\n";
    std::fs::write(path("clock.csv"), milliseconds).expect("written");
    let said = predict(&path("clock.csv"), &path("b.csv"));
    assert!(String::from_utf8_lossy(&said.stderr).contains("is t in another unit?"), "{said:?}");
    std::fs::write(path("words.csv"), "vx,vy,vz,depth,bed\n0.5,0,0,0.1,parked\n0.5,0,0,0.1,driving\n")
        .expect("written");
    std::fs::write(path("shares.csv"), "vx,vy,vz,depth,bed\n0.5,0,0,0.1,0\n0.5,0,0,0.1,1\n")
        .expect("written");
    let loads = |name: &str| {
        assert!(predict(&path(name), &path("c.csv")).status.success());
        let text = std::fs::read_to_string(path("c.csv")).expect("written");
        text.lines().map(|line| line.split(',').skip(5).collect::<Vec<_>>().join(",")).collect::<Vec<_>>()
    };
    assert_eq!(loads("words.csv"), loads("shares.csv"));
    std::fs::write(path("towed.csv"), "vx,vy,vz,depth,bed\n0.5,0,0,0.1,towed\n").expect("written");
    let said = predict(&path("towed.csv"), &path("c.csv"));
    assert!(String::from_utf8_lossy(&said.stderr).contains("\"towed\" in column bed"), "{said:?}");
    std::fs::write(path("bad.csv"), "vx,vy,vz,depth\n0.5,0,0,none\n").expect("written");
    assert!(!predict(&path("bad.csv"), &path("a.csv")).status.success());
    assert!(path_has(&path("a.csv"), "in_domain"), "a table that failed leaves the one before");
    let names =
        std::fs::read_dir(folder.path()).expect("readable").map(|entry| entry.expect("readable").file_name());
    assert!(
        names.into_iter().all(|name| !name.to_string_lossy().starts_with(".wade")),
        "nothing half is left"
    );
    let (states, folder) = (path("a.partial"), path("warthog"));
    refused(&["predict", "--vehicle", "husky", "--states", &states, "--out", &folder], "is no file");
    refused(&["query", "--vehicle", "rover", "--depth", "0.1"], "husky, warthog");
}

fn path_has(path: &str, text: &str) -> bool {
    std::fs::read_to_string(path).expect("readable").contains(text)
}

#[test]
fn a_plan_without_its_campaign_is_not_begun_anew() {
    let folder = TempDir::new().expect("a folder");
    let out = folder.path().to_str().expect("UTF-8");
    let plan = ["campaign", "plan", "--vehicle", "husky", "--set", "check", "--out", out];
    assert!(wade(&plan).status.success());
    let (campaign, cases) = (folder.path().join("campaign.toml"), folder.path().join("plan.csv"));
    let noted = std::fs::read_to_string(&campaign).expect("readable") + "# my settings\n";
    std::fs::write(&campaign, &noted).expect("written");
    assert!(
        wade(&["campaign", "plan", "--vehicle", "husky", "--set", "mesh", "--out", out]).status.success()
    );
    assert_eq!(std::fs::read_to_string(&campaign).expect("readable"), noted, "what was written there stays");
    let before = std::fs::read_to_string(&cases).expect("readable");
    std::fs::remove_file(&campaign).expect("removed");
    refused(&plan, "holds plan.csv and no campaign.toml");
    assert_eq!(std::fs::read_to_string(&cases).expect("readable"), before);
}

#[test]
fn completions_and_man_pages_know_every_command() {
    for shell in ["bash", "zsh", "fish"] {
        let output = wade(&["completions", shell]);
        let script = String::from_utf8(output.stdout).expect("text");
        for word in ["soak", "rollback", "clients"] {
            assert!(script.contains(word), "{shell}: {word} is missing");
        }
    }
    let folder = TempDir::new().expect("a folder");
    let script = folder.path().join("wade.bash");
    std::fs::write(&script, wade(&["completions", "bash"]).stdout).expect("written");
    assert!(Command::new("bash").arg("-n").arg(&script).status().expect("bash runs").success());
    let out = folder.path().join("man1");
    assert!(wade(&["man", "--out", &out.to_string_lossy()]).status.success());
    for page in
        ["wade.1", "wade-serve.1", "wade-soak-compare.1", "wade-gap-bench-import.1", "wade-vehicle-check.1"]
    {
        let text = std::fs::read_to_string(out.join(page)).expect(page);
        assert!(text.starts_with(".ie") || text.contains(".TH wade"), "{page}: {text}");
    }
}

#[test]
fn the_doctor_names_what_is_wrong_and_the_way_out() {
    let folder = TempDir::new().expect("a folder");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = taken.local_addr().expect("an address");
    let settings = |grpc: &str| {
        let path = folder.path().join("wade.toml");
        let socket = folder.path().join("wade.sock");
        let namespace = format!("doctor-{}", std::process::id());
        let text = format!(
            "[grpc]\nlisten = \"{grpc}\"\nunix_socket = \"{}\"\n[http]\nlisten = \"\"\n[shm]\nnamespace = \"{namespace}\"",
            socket.display()
        );
        std::fs::write(&path, text).expect("written");
        path.to_string_lossy().into_owned()
    };
    let doctor = |config: &str| {
        let output = wade(&["doctor", "--json", "--config", config]);
        let document: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        (output.status.code(), document)
    };
    let check = |document: &Value, name: &str| {
        let checks = document["checks"].as_array().expect("an array").clone();
        checks.into_iter().find(|check| check["name"] == name).unwrap_or_else(|| panic!("no {name}"))
    };
    let (code, document) = doctor(&settings(&port.to_string()));
    let address = check(&document, "gRPC address");
    assert_eq!((code, &address["status"]), (Some(1), &"fail".into()), "{document:#}");
    assert!(address["found"].as_str().expect("text").contains(&std::process::id().to_string()), "{address}");
    assert!(address["way_out"].as_str().expect("text").contains("--listen"), "{address}");
    drop(taken);
    let (_, document) = doctor(&settings(&port.to_string()));
    for name in ["gRPC address", "Unix socket", "vehicles", "settings", "server, gRPC", "server, shm"] {
        assert_eq!(check(&document, name)["status"], "ok", "{name}: {document:#}");
    }
    for name in
        ["shared memory", "iceoryx2 folder", "descriptors", "CPU", "CPU governor", "hiccups", "OpenFOAM"]
    {
        let found = check(&document, name);
        let said = !found["way_out"].as_str().expect("text").is_empty();
        assert_eq!(found["status"] != "ok", said, "whatever is not well has a way out: {found}");
    }
    let (code, document) = doctor(&settings("nowhere"));
    assert_eq!(code, Some(1), "{document:#}");
}

/// Flags behind which commands name what they write.
const WRITES: [&str; 3] = ["--out", "--html", "--checkpoint"];

#[test]
fn git_ignores_what_the_commands_of_the_manual_write() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let guide = std::fs::read_dir(root.join("docs/src/guide")).expect("the guide");
    let pages = guide.map(|page| page.expect("readable").path()).chain([root.join("README.md")]);
    let mut written = std::collections::BTreeSet::new();
    for page in pages {
        let text = std::fs::read_to_string(&page).expect("readable");
        for block in text.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next()) {
            let words: Vec<&str> = block.split_whitespace().collect();
            let outputs =
                words.windows(2).filter(|pair| WRITES.contains(&pair[0])).map(|pair| pair[1].to_owned());
            written.extend(outputs.filter(|path| !path.starts_with(['/', '~', '$'])));
        }
    }
    assert!(written.len() > 3, "{written:?}");
    for path in written {
        let status = Command::new("git").args(["check-ignore", "--quiet", &path]).current_dir(root).status();
        assert!(
            status.expect("git runs").success(),
            "{path} is left in the working directory: see .gitignore"
        );
    }
}
