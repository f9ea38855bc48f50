//! Promise: the program alone answers, with the vehicles that it carries; a folder of vehicles replaces them by name, a broken
//! one is an error that names it, and a change goes to the first folder that can be written to.

#![allow(clippy::unwrap_used)]

use std::os::unix::fs::symlink;
use std::path::PathBuf;
use std::process::{Command, Output};

use crate::common::{copy_folder, every_effect, rover, vehicles};
use serde_json::Value;
use tempfile::TempDir;
use wade_core::bundle::{self, Carried, Library};

/// An installation: the program in `bin`, a home, and a working directory that is none of ours.
struct Installed {
    folder: TempDir,
}

impl Installed {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        for name in ["bin", "home", "elsewhere"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        let program = folder.path().join("bin/wade");
        // a link would lead beside the program that was built
        std::fs::hard_link(env!("CARGO_BIN_EXE_wade"), &program)
            .or_else(|_| std::fs::copy(env!("CARGO_BIN_EXE_wade"), &program).map(|_| ()))
            .unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(self.path("bin/wade"));
        command.args(arguments).current_dir(self.path("elsewhere"));
        command.env("HOME", self.path("home")).env_remove("WADE_VEHICLES").env_remove("XDG_DATA_HOME");
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn answers(&self, arguments: &[&str]) -> String {
        text(self.run(arguments), true)
    }

    fn refuses(&self, arguments: &[&str]) -> String {
        text(self.run(arguments), false)
    }

    /// Where each vehicle is from.
    fn origins(&self) -> Vec<(String, String)> {
        let list: Value = serde_json::from_str(&self.answers(&["vehicle", "list", "--json"])).unwrap();
        let of = |row: &Value, key: &str| row[key].as_str().unwrap().to_owned();
        list.as_array().unwrap().iter().map(|row| (of(row, "name"), of(row, "origin"))).collect()
    }
}

/// Standard output of a command that succeeds, standard error of one that does not.
fn text(output: Output, succeeds: bool) -> String {
    let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    assert_eq!(output.status.success(), succeeds, "{out}{err}");
    if succeeds { out } else { err }
}

const QUERY: [&str; 7] = ["query", "--vehicle", "husky", "--speed", "0.8", "--depth", "0.18"];
const CARRIED: &str = "carried by the binary";

#[test]
fn the_carried_vehicles_are_the_shipped_ones_to_the_bit() {
    let library = Library::open(Some(&vehicles())).unwrap();
    for carried in Carried::all() {
        let installed = Installed::new();
        let alone =
            text(installed.command(&["vehicle", "versions", carried.name, "--json"]).output().unwrap(), true);
        let alone: Value = serde_json::from_str(&alone).unwrap();
        let (shipped, _) = library.versions(carried.name).unwrap();
        assert_eq!(alone["versions"][0]["network_sha256"].as_str(), shipped.network_sha256.as_deref());
        assert_eq!(alone["versions"][0]["version"], shipped.version);
        assert_eq!(alone["versions"][0]["origin"], CARRIED);
    }
    let names: Vec<&str> = Carried::all().iter().map(|carried| carried.name).collect();
    assert_eq!(names, crate::common::VEHICLES);
}

#[test]
fn the_program_alone_answers_from_any_folder_and_leaves_nothing_behind() {
    let installed = Installed::new();
    // the working directory's vehicles are nobody's business
    std::fs::create_dir_all(installed.path("elsewhere/vehicles/husky")).unwrap();
    let answer = installed.answers(&QUERY);
    assert!(answer.contains("husky") && answer.contains("version 11"), "{answer}");
    let carried = |name: &str| (name.to_owned(), CARRIED.to_owned());
    assert_eq!(installed.origins(), [carried("husky"), carried("warthog")]);
    assert_eq!(std::fs::read_dir(installed.path("home")).unwrap().count(), 0);
}

#[test]
fn the_first_folder_that_exists_is_used_and_replaces_by_name() {
    let installed = Installed::new();
    let places = ["bin/vehicles", "bin/../share/wade/vehicles", "home/.local/share/wade/vehicles"];
    let [beside, share, data] = places.map(|place| installed.path(place));
    // from the last to the first
    rover(&share);
    let origins = installed.origins();
    assert_eq!(origins[1], ("rover".to_owned(), share.join("rover").display().to_string()));
    copy_folder(&vehicles().join("husky"), &beside.join("husky"));
    let origins = installed.origins();
    assert_eq!(origins.len(), 2, "the folder behind it is not looked at: {origins:?}");
    assert_eq!(origins[0].1, beside.join("husky").display().to_string());
    std::fs::create_dir_all(&data).unwrap();
    assert!(installed.origins().iter().all(|(_, origin)| origin == CARRIED), "an empty folder is one too");
    // what is named comes before all
    let named = installed.path("named");
    rover(&named);
    let list = |command: &mut Command| text(command.output().unwrap(), true);
    let by_variable = list(installed.command(&["vehicle", "list"]).env("WADE_VEHICLES", &named));
    let by_flag = list(&mut installed.command(&["vehicle", "list", "--vehicles", named.to_str().unwrap()]));
    assert_eq!(by_variable, by_flag);
    assert!(by_flag.contains("named/rover") && by_flag.contains(CARRIED), "{by_flag}");
    let empty = list(installed.command(&["vehicle", "list"]).env("WADE_VEHICLES", ""));
    assert!(!empty.contains("rover"), "{empty}");
}

#[test]
fn a_folder_that_is_broken_is_named_and_nothing_is_served_in_its_place() {
    let installed = Installed::new();
    let data = installed.path("home/.local/share/wade/vehicles");
    let refused = |expected: &str| {
        for arguments in [&QUERY[..], &["serve", "--listen", "127.0.0.1:0", "--http", "", "--shm", "off"]] {
            let socket = installed.path("wade.sock");
            let mut command = installed.command(arguments);
            if arguments[0] == "serve" {
                command.args(["--unix-socket", socket.to_str().unwrap()]);
            }
            let said = text(command.output().unwrap(), false);
            assert!(said.contains("wade/vehicles") && said.contains(expected), "{expected}: {said}");
        }
    };
    std::fs::create_dir_all(data.parent().unwrap()).unwrap();
    std::fs::write(&data, b"no folder").unwrap();
    refused("cannot be read as a folder");
    std::fs::remove_file(&data).unwrap();
    symlink("nowhere", &data).unwrap();
    refused("cannot be read as a folder");
    std::fs::remove_file(&data).unwrap();
    // a bundle that lost a file, or all
    std::fs::create_dir_all(data.join("husky")).unwrap();
    refused("husky/vehicle.toml");
    std::fs::remove_dir(data.join("husky")).unwrap();
    symlink("nowhere", data.join("husky")).unwrap();
    refused("husky");
    std::fs::remove_file(data.join("husky")).unwrap();
    copy_folder(&vehicles().join("husky"), &data.join("husky"));
    let hull = data.join("husky/hull.stl");
    let mut bytes = std::fs::read(&hull).unwrap();
    bytes[500] ^= 1;
    std::fs::write(&hull, bytes).unwrap();
    refused("husky/hull.stl: damaged: its SHA-256");
    // and one that was named and is not there
    let said = installed.refuses(&["vehicle", "list", "--vehicles", "/no/such/folder"]);
    assert!(said.contains("/no/such/folder") && said.contains("WADE_VEHICLES"), "{said}");
    let said = installed.refuses(&["query", "--vehicle", "rower", "--depth", "0.1", "--vehicles", "/"]);
    assert!(said.contains("husky, warthog"), "{said}");
}

#[test]
fn a_change_of_a_carried_vehicle_goes_to_a_new_folder_and_is_taken_back_for_good() {
    let installed = Installed::new();
    let data = installed.path("home/.local/share/wade/vehicles");
    let library = || Library::open(Some(&data)).unwrap();
    let (place, version) =
        Library::open_to_write(Some(&data)).unwrap().apply("husky", every_effect("husky")).unwrap();
    assert_eq!((place, version), (data.join("husky"), 12));
    let shown = installed.answers(&["vehicle", "versions", "husky"]);
    assert!(shown.contains(CARRIED) && shown.contains("in place"), "{shown}");
    let back = ["vehicle", "rollback", "husky", "--server", "unix:/no/such/socket"];
    let said = installed.answers(&back);
    assert!(
        said.contains("version 11") && said.contains(CARRIED) && said.contains("taken back: added_mass"),
        "{said}"
    );
    assert!(!data.join("husky").exists());
    // what was taken back stays away, however often
    for next in [13, 14] {
        assert_eq!(library().apply("husky", every_effect("husky")).unwrap().1, next);
        let said = installed.answers(&back);
        assert!(said.contains("version 11"), "{said}");
    }
    let said = installed.refuses(&back);
    assert!(said.contains("no version before this one"), "{said}");
    // but can be had by its number
    let said = installed.answers(&[&back[..], &["--to", "12"]].concat());
    assert!(said.contains("version 12"), "{said}");
    assert_eq!(library().versions("husky").unwrap().0.version, 12);
}

#[test]
fn going_back_to_another_network_needs_a_yes() {
    let copy = crate::common::copy_of_vehicles();
    let husky = copy.path().join("husky");
    let trained = bundle::read(&husky).unwrap();
    crate::common::paper::put_into(&husky);
    assert_eq!(bundle::succeed(&husky, trained).unwrap(), 12);
    let installed = Installed::new();
    let folder = copy.path().to_str().unwrap();
    let back = ["vehicle", "rollback", "husky", "--vehicles", folder, "--server", "unix:/no/such/socket"];
    let said = installed.refuses(&back);
    assert!(said.contains("another network (paper") && said.contains("--yes"), "{said}");
    assert_eq!(Library::open(Some(copy.path())).unwrap().versions("husky").unwrap().0.version, 12);
    let said = installed.answers(&[&back[..], &["--yes"]].concat());
    assert!(said.contains("version 11") && said.contains("weights: paper"), "{said}");
}

#[test]
fn a_named_place_that_cannot_be_a_folder_is_refused_before_any_work() {
    let folder = TempDir::new().unwrap();
    // a file in the way of a folder: nobody, root included, can write there
    std::fs::write(folder.path().join("file"), b"").unwrap();
    let blocked = folder.path().join("file/vehicles");
    let error = Library::open_to_write(Some(&blocked)).unwrap_err().to_string();
    assert!(error.contains("file/vehicles"), "{error}");
}
