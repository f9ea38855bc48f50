//! Promise: planted loads come back from the files of each solver, in the body frame; what is wrong with a case is named
//! with its file and line, and then nothing is written.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;
use tempfile::TempDir;
use wade_core::condition::GroundContact;
use wade_core::frame::Vec3;
use wade_learn::dataset::{self, Dataset, Image, Sample};

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}

fn wade(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_wade"));
    command
        .args(["dataset"])
        .args(arguments)
        .env("WADE_VEHICLES", crate::common::vehicles())
        .output()
        .unwrap()
}

fn done(arguments: &[&str]) -> String {
    let output = wade(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn import(format: &str, vehicle: &str, cases: &Path, out: &Path, further: &[&str]) -> Output {
    let fixed =
        ["import", "--format", format, "--vehicle", vehicle, "--cases", text(cases), "--out", text(out)];
    wade(&[&fixed[..], further].concat())
}

fn imported(format: &str, vehicle: &str, further: &[&str]) -> Dataset {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("data.parquet");
    let output = import(format, vehicle, &data().join(format), &out, further);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    dataset::read(&out).unwrap()
}

/// A copy of the cases of one format that a test may spoil.
fn copy(format: &str) -> TempDir {
    let copy = TempDir::new().unwrap();
    copy_tree(&data().join(format), copy.path());
    copy
}

fn copy_tree(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(Result::unwrap) {
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy_tree(&entry.path(), &to)
        } else {
            _ = fs::copy(entry.path(), to).unwrap()
        }
    }
}

/// Imports the OpenFOAM cases after `spoil` had its way with them; returns what the refusal says.
fn refused(format: &str, vehicle: &str, spoil: impl FnOnce(&Path)) -> String {
    let cases = copy(format);
    spoil(cases.path());
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("data.parquet");
    fs::write(&out, "what was there before").unwrap();
    let output = import(format, vehicle, cases.path(), &out, &[]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(fs::read_to_string(&out).unwrap(), "what was there before");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing half-written is left");
    String::from_utf8(output.stderr).unwrap()
}

fn edit(path: &Path, change: impl FnOnce(String) -> String) {
    let before = fs::read_to_string(path).unwrap();
    let after = change(before.clone());
    assert_ne!(before, after, "the change must change something");
    fs::write(path, after).unwrap();
}

const FORCE: &str = "warthog-head-on/postProcessing/wheel_fr/0/force.dat";

/// The formulas of tests/data/README.md. Files hold six digits.
fn check_loads(sample: &Sample, viscous: bool, rest: bool) {
    let close = |a: &Vec3, b: [f64; 3]| (a - Vec3::from(b)).norm() < 2e-3;
    let middle = 0.5 * (sample.start_s + sample.end_s);
    for (i, load) in sample.surfaces.iter().enumerate() {
        let at = format!("{} section {} surface {i}", sample.case, sample.section);
        let i = i as f64;
        let force = [-(10.0 + i) - 2.0 * (middle - 3.0), 0.5 * (i - 4.0), 20.0 + i];
        assert!(close(&load.force, force), "{at}: {}", load.force);
        assert!(close(&load.moment.unwrap(), [0.1 * i, -(1.0 + i), 0.3]), "{at}: {:?}", load.moment);
        assert_eq!(load.viscous.is_some(), viscous, "{at}");
        assert!(load.viscous.is_none_or(|v| close(&v, force.map(|x| 0.02 * x))), "{at}: {:?}", load.viscous);
        assert_eq!(load.rest.is_some(), rest, "{at}");
        if let Some(rest) = load.rest {
            assert!(close(&rest.force, [0.0, 0.0, 15.0 + i]), "{at}: {rest:?}");
            assert!(close(&rest.moment, [0.0, 0.05 * i, 0.0]), "{at}: {rest:?}");
        }
    }
}

fn of_case<'a>(data: &'a Dataset, case: &str) -> Vec<&'a Sample> {
    let samples: Vec<_> = data.samples.iter().filter(|sample| sample.case == case).collect();
    assert_eq!(samples.len(), 20, "{case}");
    samples
}

fn near(v: &Vec3, x: f64, y: f64) -> bool {
    (v - Vec3::new(x, y, 0.0)).norm() < 1e-12
}

#[test]
fn openfoam_in_its_three_formats_gives_back_what_was_planted() {
    let data = imported("openfoam", "warthog", &["--provenance", "planted"]);
    data.samples.iter().for_each(|s| check_loads(s, true, s.case == "warthog-driving"));
    assert_eq!((data.meta.provenance.as_str(), data.meta.ground_contact), ("planted", GroundContact::Dry));
    assert_eq!(data.meta.vehicles["warthog"][6..], ["wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"]);

    let head_on = of_case(&data, "warthog-head-on")[0];
    assert_eq!((head_on.set.as_str(), head_on.image, head_on.section), ("paper", Image::Original, 0));
    assert_eq!((head_on.start_s, head_on.end_s), (2.0, 2.1));
    let state = &head_on.condition;
    assert!(near(&state.velocity, 2.0, 0.0) && near(&state.ground_velocity, 0.0, 0.0), "parked: {state:?}");
    assert_eq!((state.depth, state.density), (0.2, 1000.0));

    // the hull is turned to the right, so the water comes from its front left
    let oblique = &of_case(&data, "warthog-oblique")[19].condition;
    let (sin, cos) = 30_f64.to_radians().sin_cos();
    assert!(near(&oblique.velocity, 1.5 * cos, 1.5 * sin), "{}", oblique.velocity);

    let driving = &of_case(&data, "warthog-driving")[0].condition;
    assert!(near(&driving.velocity, 1.0, 0.0) && near(&driving.ground_velocity, 1.0, 0.0), "{driving:?}");
}

#[test]
fn forces_of_no_surface_are_left_out_and_said_so() {
    let (cases, out) = (copy("openfoam"), TempDir::new().unwrap());
    let reports = cases.path().join("warthog-head-on/postProcessing");
    let taken = fs::read_dir(&reports).unwrap().next().unwrap().unwrap().path();
    copy_tree(&taken, &reports.join("antenna"));
    fs::create_dir_all(reports.join("residuals/0")).unwrap();
    let out = out.path().join("data.parquet");
    let output = import("openfoam", "warthog", cases.path(), &out, &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("reported of antenna too"), "{said}");
    assert_eq!(dataset::read(&out).unwrap().meta.notes["left_out"], "antenna");
}

#[test]
fn fluent_gives_back_what_was_planted() {
    let data = imported("fluent", "husky", &[]);
    of_case(&data, "husky-oblique").into_iter().for_each(|sample| check_loads(sample, false, false));
    let (sin, cos) = 60_f64.to_radians().sin_cos();
    let velocity = &data.samples[0].condition.velocity;
    assert!(near(velocity, 0.8 * sin, 0.8 * cos), "{velocity}");
    assert_eq!(data.meta.vehicles["husky"].len(), 13);
}

#[test]
fn sections_can_be_chosen() {
    let data =
        imported("openfoam", "warthog", &["--transient", "3", "--sections", "2", "--section-length", "0.5"]);
    assert_eq!(data.samples.len(), 6);
    data.samples.iter().for_each(|s| check_loads(s, true, s.case == "warthog-driving"));
}

#[test]
fn a_case_without_its_description_is_named() {
    let error = refused("openfoam", "warthog", |cases| {
        fs::remove_file(cases.join("warthog-oblique/case.toml")).unwrap()
    });
    assert!(error.contains("warthog-oblique: case without its description case.toml"), "{error}");
}

#[test]
fn a_description_that_describes_nothing_is_named() {
    let error = refused("openfoam", "warthog", |cases| {
        edit(&cases.join("warthog-oblique/case.toml"), |text| text.replace("depth_m = 0.3", "depth = 0.3"));
    });
    assert!(error.contains("warthog-oblique/case.toml") && error.contains("depth"), "{error}");
    let error = refused("openfoam", "husky", |_| ());
    assert!(error.contains("case.toml: vehicle `warthog` is none of those asked for: husky"), "{error}");
    let error = refused("openfoam", "warthog", |cases| {
        edit(&cases.join("warthog-oblique/case.toml"), |text| text.replace("wheel_fl = ", "wheel_lf = "));
    });
    assert!(error.contains("warthog-oblique/case.toml") && error.contains("`wheel_lf`"), "{error}");
}

#[test]
fn a_force_file_that_is_cut_off_is_named_with_its_line() {
    let error = refused("openfoam", "warthog", |cases| {
        edit(&cases.join(FORCE), |text| text[..text.len() - 30].to_owned());
    });
    assert!(error.contains(&format!("{FORCE}, line 26")) && error.contains("cut off"), "{error}");
    // cut between two digits, the line still has all its numbers
    let error = refused("openfoam", "warthog", |cases| {
        edit(&cases.join(FORCE), |text| text.trim_end().trim_end_matches(')').to_owned());
    });
    assert!(error.contains("line 26") && error.contains("cut off"), "{error}");
}

#[test]
fn a_file_that_is_being_written_counts_up_to_its_last_whole_line() {
    let cases = copy("openfoam");
    edit(&cases.path().join(FORCE), |text| format!("{text}4.1\t(-20.2 1"));
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("data.parquet");
    assert_eq!(import("openfoam", "warthog", cases.path(), &out, &[]).status.code(), Some(1));
    let output = import("openfoam", "warthog", cases.path(), &out, &["--running"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    dataset::read(&out)
        .unwrap()
        .samples
        .iter()
        .for_each(|s| check_loads(s, true, s.case == "warthog-driving"));
}

#[test]
fn forces_that_are_not_numbers_are_named_with_their_line() {
    let error = refused("openfoam", "warthog", |cases| {
        edit(&cases.join(FORCE), |text| text.replace("\n3\t(-17 ", "\n3\t(nan "));
    });
    assert!(error.contains(&format!("{FORCE}, line 16, number 2: NaN")), "{error}");
    let error = refused("fluent", "husky", |cases| {
        edit(&cases.join("husky-oblique/report-file-1.out"), |text| text.replace("\n150 ", "\n150 1e999 "));
    });
    assert!(error.contains("report-file-1.out, line 15"), "{error}");
}

#[test]
fn a_force_beyond_what_the_file_holds_is_named_with_its_surface_and_column() {
    let error = refused("openfoam", "warthog", |cases| {
        edit(&cases.join(FORCE), |text| text.replace("\n3\t(-17 ", "\n3\t(1e300 "));
    });
    assert!(error.contains("case `warthog-head-on`"), "{error}");
    assert!(error.contains("surface `wheel_fr`: fx_n is ") && error.contains("beyond single"), "{error}");
}

#[test]
fn a_patch_that_feeds_two_surfaces_is_refused() {
    let error = refused("openfoam", "warthog", |cases| {
        let names = "\n[surfaces]\nfront = \"rear\"\n";
        edit(&cases.join("warthog-head-on/case.toml"), |text| text + names);
    });
    let expected = "warthog-head-on/case.toml: surfaces `front` and `rear` are both `rear` of the solver";
    assert!(error.contains(expected), "{error}");
    let error = refused("fluent", "husky", |cases| {
        let line = "wheel_fl = \"wheel-front-left\"\n";
        edit(&cases.join("husky-oblique/case.toml"), |text| {
            text.replace(line, &format!("{line}wheel_fr = \"wheel-front-left\"\n"))
        });
    });
    assert!(error.contains("surfaces `wheel_fl` and `wheel_fr` are both"), "{error}");
}

#[test]
fn moments_about_an_unknown_point_are_refused() {
    let lose_center = |path: PathBuf| edit(&path, |text| text.replace("CofR", "Point"));
    let error = refused("openfoam", "warthog", |cases| {
        for name in ["force.dat", "moment.dat"] {
            lose_center(cases.join(FORCE).with_file_name(name));
        }
    });
    assert!(error.contains("warthog-head-on/postProcessing/wheel_fr, surface `wheel_fr`"), "{error}");
    assert!(error.contains("# CofR : (x y z)"), "{error}");

    // what wrote the moments wrote the forces beside them, about the same point
    let cases = copy("openfoam");
    lose_center(cases.path().join("warthog-oblique/postProcessing/hull_wheel_fr/0/moment.dat"));
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("data.parquet");
    let output = import("openfoam", "warthog", cases.path(), &out, &[]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let data = dataset::read(&out).unwrap();
    of_case(&data, "warthog-oblique").into_iter().for_each(|sample| check_loads(sample, true, false));
}

#[test]
fn a_damaged_line_in_the_middle_is_named() {
    let error = refused("openfoam", "warthog", |cases| {
        edit(&cases.join(FORCE), |text| text.replace("\n3\t(-17 ", "\n3\t"));
    });
    assert!(error.contains("line 16: 9 numbers can be read where there must be 10"), "{error}");
}

#[test]
fn missing_files_and_columns_are_named() {
    let error = refused("openfoam", "warthog", |cases| {
        fs::remove_dir_all(cases.join("warthog-head-on/postProcessing/rear")).unwrap();
    });
    assert!(
        error.contains("surface `rear`") && error.contains("warthog-head-on/postProcessing/rear"),
        "{error}"
    );
    let error = refused("openfoam", "warthog", |cases| fs::remove_file(cases.join(FORCE)).unwrap());
    assert!(error.contains("wheel_fr") && error.contains("force.dat"), "{error}");
    let error = refused("fluent", "husky", |cases| {
        fs::remove_file(cases.join("husky-oblique/report-file-0.out")).unwrap();
    });
    assert!(error.contains("no report file has a column"), "{error}");
    let error = refused("fluent", "husky", |cases| {
        edit(&cases.join("husky-oblique/report-file-0.out"), |text| text.replace("flow-time", "time"));
    });
    assert!(error.contains("report-file-0.out: no column flow-time"), "{error}");
}

#[test]
fn a_run_that_is_too_short_is_named() {
    let error = refused("openfoam", "warthog", |cases| {
        edit(&cases.join(FORCE), |text| text.lines().take(20).map(|line| format!("{line}\n")).collect());
    });
    let expected =
        "surface `wheel_fr`: 3.4000 s to 3.5000 s is wanted and the history covers 1.9000 s to 3.4000 s";
    assert!(error.contains("warthog-head-on") && error.contains(expected), "{error}");
    assert!(error.contains(FORCE.rsplit_once('/').expect("a file").1), "the file that ends there: {error}");
}

#[test]
fn cases_without_moments_are_told() {
    let cases = copy("openfoam");
    let said = |cases: &Path| {
        let folder = TempDir::new().unwrap();
        let output = import("openfoam", "warthog", cases, &folder.path().join("data.parquet"), &[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        said
    };
    let whole = said(cases.path());
    assert!(!whole.contains("moments"), "{whole}");
    fs::remove_file(cases.path().join("warthog-oblique/postProcessing/hull_front/0/moment.dat")).unwrap();
    let less = said(cases.path());
    assert!(less.contains("warning: 1 of the cases, `warthog-oblique` the first, have no moments"), "{less}");
}

#[test]
fn cases_of_two_conventions_are_kept_apart() {
    let error = refused("openfoam", "warthog", |cases| {
        edit(&cases.join("warthog-oblique/case.toml"), |text| text.replace("\"dry\"", "\"wetted\""));
    });
    assert!(error.contains("warthog-oblique") && error.contains("ground contact"), "{error}");
}

#[test]
fn a_second_run_in_the_same_folder_replaces_the_first() {
    let cases = copy("openfoam");
    let reports = cases.path().join("warthog-head-on/postProcessing");
    for surface in fs::read_dir(reports).unwrap().map(Result::unwrap) {
        for name in ["force", "moment"] {
            let first = surface.path().join("0").join(name).with_extension("dat");
            let again = first.with_file_name(format!("{name}_0.dat"));
            fs::rename(&first, &again).unwrap();
            let stale = fs::read_to_string(&again).unwrap().replace("\t(-", "\t(-9");
            fs::write(&first, stale).unwrap();
        }
    }
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("data.parquet");
    assert!(import("openfoam", "warthog", cases.path(), &out, &[]).status.success());
    dataset::read(&out)
        .unwrap()
        .samples
        .iter()
        .for_each(|s| check_loads(s, true, s.case == "warthog-driving"));
}

#[test]
fn from_cases_to_two_sides_of_a_split_on_the_command_line() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (warthog, husky, both) = (at("warthog.parquet"), at("husky.parquet"), at("both.parquet"));
    assert!(import("openfoam", "warthog", &data().join("openfoam"), &warthog, &[]).status.success());
    assert!(import("fluent", "husky", &data().join("fluent"), &husky, &[]).status.success());
    done(&["merge", text(&warthog), text(&husky), "--out", text(&both)]);
    let augmented = at("augmented.parquet");
    let said = done(&["augment", text(&both), "--out", text(&augmented)]);
    assert!(
        said.contains("husky: 1 cases, 80 samples") && said.contains("warthog: 3 cases, 120 samples"),
        "{said}"
    );

    let split = at("split");
    let said = done(&["split", text(&augmented), "--by", "vehicle", "--out", text(&split), "--json"]);
    let said: Value = serde_json::from_str(&said).unwrap();
    assert_eq!((&said[0]["training"], &said[0]["held_out"]), (&Value::from(120), &Value::from(80)));
    let held_out = dataset::read(&split.join("1/held-out.parquet")).unwrap();
    assert!(held_out.samples.iter().all(|sample| sample.vehicle == "husky"));
    let training = dataset::read(&split.join("1/train.parquet")).unwrap();
    assert!(training.samples.iter().all(|sample| sample.vehicle == "warthog"));

    let again = wade(&["split", text(&augmented), "--by", "case", "--out", text(&split)]);
    let error = String::from_utf8(again.stderr).unwrap();
    assert!(again.status.code() == Some(1) && error.contains("is not empty"), "{error}");

    let page = at("page.html");
    let described = done(&["describe", text(&augmented), "--json", "--html", text(&page)]);
    let described: Value = serde_json::from_str(&described).unwrap();
    assert_eq!(described["vehicles"][1]["sets"]["driving"]["samples"], 40);
    assert_eq!(described["vehicles"][1]["ranges"]["speed_mps"]["max"], 2.0);
    let page = fs::read_to_string(page).unwrap();
    assert!(page.matches("<svg").count() == 10 && !page.contains("http-equiv"), "a plot is missing");
    assert!(!page.contains("src=") && !page.contains("href="), "the page needs no other file");
}

#[test]
fn an_empty_side_ends_with_its_reason_and_wrong_flags_are_usage() {
    let folder = TempDir::new().unwrap();
    let (husky, split) = (folder.path().join("husky.parquet"), folder.path().join("split"));
    assert!(import("fluent", "husky", &data().join("fluent"), &husky, &[]).status.success());
    let output = wade(&["split", text(&husky), "--by", "case", "--out", text(&split)]);
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && error.contains("husky` has 1 cases"), "{error}");
    assert!(!split.exists(), "nothing is written");
    let flags = ["split", text(&husky), "--by", "depth", "--share", "0.2", "--out", text(&split)];
    assert_eq!(wade(&flags).status.code(), Some(2));
}

#[test]
fn a_data_set_that_is_read_is_not_written_over() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (warthog, husky, link) = (at("warthog.parquet"), at("husky.parquet"), at("link.parquet"));
    assert!(import("openfoam", "warthog", &data().join("openfoam"), &warthog, &[]).status.success());
    assert!(import("fluent", "husky", &data().join("fluent"), &husky, &[]).status.success());
    std::os::unix::fs::symlink(&husky, &link).unwrap();
    let whole = fs::read(&husky).unwrap();
    let around = folder.path().join("../").join(folder.path().file_name().unwrap()).join("husky.parquet");
    for out in [&husky, &link, &around].map(|path| text(path)) {
        for arguments in [
            vec!["describe", text(&husky), "--html", out],
            vec!["augment", text(&husky), "--out", out],
            vec!["merge", text(&warthog), text(&husky), "--out", out],
            vec!["split", text(&husky), "--out", out],
        ] {
            let output = wade(&arguments);
            let error = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(1), "{arguments:?}: {error}");
            assert!(error.contains("husky.parquet, which is read"), "{arguments:?}: {error}");
            assert_eq!(fs::read(&husky).unwrap(), whole, "{arguments:?}");
            assert!(link.is_symlink(), "{arguments:?}");
        }
    }
}

#[test]
fn a_damaged_file_is_named_and_no_panic_is_shown() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("damaged.parquet");
    let mut bytes = fs::read(data().join("parquet/rewritten.parquet")).unwrap();
    bytes[5482] ^= 1;
    fs::write(&path, bytes).unwrap();
    let output = wade(&["describe", text(&path)]);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("damaged.parquet: ") && !error.contains("panicked"), "{error}");
}

#[test]
fn counts_that_make_no_data_set_are_usage() {
    let folder = TempDir::new().unwrap();
    let (husky, out) = (folder.path().join("husky.parquet"), folder.path().join("out"));
    assert!(import("fluent", "husky", &data().join("fluent"), &husky, &[]).status.success());
    for (arguments, option, range) in [
        (vec!["analytic", "--vehicle", "husky", "--cases"], "--cases", "1..=1000000"),
        (vec!["split", text(&husky), "--by", "depth", "--parts"], "--parts", "2..=1000"),
    ] {
        for count in ["0", "18446744073709551615"] {
            let output = wade(&[&arguments[..], &[count, "--out", text(&out)]].concat());
            let error = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(2), "{error}");
            assert!(error.contains(option) && error.contains(range), "{error}");
            assert!(!out.exists(), "nothing is written");
        }
    }
}

#[test]
fn every_subcommand_shows_an_example() {
    for command in ["", "import", "analytic", "augment", "split", "merge", "describe"] {
        let arguments: Vec<&str> = command.split_whitespace().chain(["--help"]).collect();
        assert!(done(&arguments).contains("Example"), "{command}");
    }
}
