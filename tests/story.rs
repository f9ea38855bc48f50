//! Promise: the story of the README ("What the model lacks") runs as it is written there on the trials that are shipped:
//! the folder does not say what is hidden, it is named, the gap closes, and the served answer changes by it. So does the
//! short way from force files to weights (docs/src/guide/training.md, "Try the whole chain").

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;
use wade_core::digest::sha256;
use wade_core::effects::Effect;

/// Velocity of the water to the east in the trials [m/s], as in tests/make_trials.py.
const HIDDEN: f64 = 0.25;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn trials() -> PathBuf {
    root().join("tests/data/wading")
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).expect("readable")
}

/// The first block of commands of a section of a document.
fn block(document: &str, section: &str) -> String {
    let document = text(&root().join(document));
    let (_, section) = document.split_once(&format!("## {section}\n")).expect("the section");
    let (_, block) = section.split_once("```sh\n").expect("a block");
    block.split("```").next().expect("its end").to_owned()
}

/// The commands of the story.
fn commands() -> Vec<String> {
    let block = block("README.md", "What the model lacks");
    block.lines().filter(|line| line.starts_with("wade ")).map(str::to_owned).collect()
}

/// Numbers of the line of an answer that starts so.
fn line(answer: &str, start: &str) -> Option<Vec<f64>> {
    let rest = answer.lines().find_map(|line| line.strip_prefix(start))?;
    Some(rest.split_whitespace().filter_map(|word| word.parse().ok()).collect())
}

#[test]
fn the_folder_is_labeled_and_does_not_name_what_it_hides() {
    for entry in std::fs::read_dir(trials()).expect("readable") {
        let path = entry.expect("readable").path();
        let text = text(&path);
        assert!(text.contains("generated"), "{}", path.display());
        for effect in Effect::ALL {
            assert!(!text.contains(effect.name()), "{} names {}", path.display(), effect.name());
            assert!(!text.contains(&effect.name().replace('_', " ")), "{}", path.display());
        }
    }
}

#[test]
fn three_commands_name_the_effect_and_serve_it() {
    let weights = std::fs::read(root().join("vehicles/husky/network.safetensors")).expect("readable");
    let weights = sha256(&weights);
    assert!(
        text(&trials().join("trials.toml")).contains(&weights),
        "the Husky has other weights than the trials were generated from: run tests/make_trials.py"
    );
    let (place, vehicles) = (TempDir::new().expect("a folder"), common::copy_of_vehicles());
    std::os::unix::fs::symlink(root().join("tests"), place.path().join("tests")).expect("linked");
    let run = |command: &str| {
        let mut arguments: Vec<&str> = command.split_whitespace().skip(1).collect();
        if arguments[0] == "gap" {
            // not a server that happens to run on this machine
            arguments.extend(["--server", "unix:/nowhere"]);
        }
        let mut wade = Command::new(env!("CARGO_BIN_EXE_wade"));
        wade.args(arguments).env("WADE_VEHICLES", vehicles.path()).current_dir(place.path());
        let output = wade.output().expect("the program runs");
        assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let commands = commands();
    assert_eq!(commands.len(), 3, "{commands:?}");
    assert_eq!(commands[0], commands[2], "the same question before and after");
    let [before, _, after] = [0, 1, 2].map(|i| run(&commands[i]));

    let report: Value = serde_json::from_str(&text(&place.path().join("gap/report.json"))).expect("JSON");
    assert_eq!(report["verdict"], "named", "{}", report["summary"]);
    let closure = |name: &str| report["gap"]["held_out"][name]["closure"].as_f64().expect("a gap");
    assert!(closure("fx") > 0.8, "{}", report["gap"]["held_out"]);
    let effects = report["effects"].as_array().expect("a list");
    let name = effects[0]["name"].as_str().expect("a name");
    let interval = &effects[0]["parameters"]["east"]["interval"];
    let [low, high] = [0_usize, 1].map(|i| interval[i].as_f64().expect("a number"));
    assert!((name, effects.len()) == ("current", 1) && low < HIDDEN && high > HIDDEN, "{effects:#?}");

    let added = line(&after, &format!("+ {name}")).expect("a line of its own");
    let net = |answer: &str| line(answer, "net force [N]").expect("a net force");
    assert!(line(&before, "+ ").is_none() && added[0] > 1.0, "{before}{after}");
    assert!((net(&after)[0] - net(&before)[0] - added[0]).abs() < 0.02, "{before}{after}");
    // the answer of a model that knows how the water moves
    let told = run(&format!("{} --current {HIDDEN},0,0", commands[0]));
    let [missed, left] = [&before, &after].map(|answer| (net(answer)[0] - net(&told)[0]).abs());
    assert!(left < 0.1 * missed, "{before}{after}{told}");
}

#[test]
fn a_few_committed_cases_become_weights_by_the_commands_of_the_guide() {
    let place = TempDir::new().expect("a folder");
    for name in ["tests", "campaigns"] {
        std::os::unix::fs::symlink(root().join(name), place.path().join(name)).expect("linked");
    }
    // no link, through which the shipped bundles would be written
    for vehicle in common::VEHICLES {
        common::copy_folder(
            &root().join("vehicles").join(vehicle),
            &place.path().join("vehicles").join(vehicle),
        );
    }
    let commands = block("docs/src/guide/training.md", "Try the whole chain");
    let program = Path::new(env!("CARGO_BIN_EXE_wade")).parent().expect("a folder");
    let path = format!("{}:{}", program.display(), std::env::var("PATH").expect("a path"));
    let output = Command::new("sh")
        .args(["-e", "-c", &commands])
        .current_dir(place.path())
        .env("PATH", path)
        .env_remove("WADE_VEHICLES")
        .output()
        .expect("a shell");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    for page in ["three.html", "few.html", "few/index.html"] {
        assert!(text(&place.path().join(page)).contains("<svg"), "{page}");
    }
    let version = |folder: &str| {
        let file = text(&place.path().join(folder).join("husky/vehicle.toml"));
        line(&file, "version =").expect("a version")[0]
    };
    assert_eq!(version("scratch"), version("vehicles") + 1.0, "the copy has the new weights, and it alone");
}
