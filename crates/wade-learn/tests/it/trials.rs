//! Promise: a folder of trials is read as it is described, and what is wrong with it is named with file, row and column.

use std::path::Path;

use tempfile::TempDir;
use wade_core::condition::GroundContact;
use wade_core::physics::Physics;
use wade_learn::trials::{Fault, Method, Remark, Trial, TrialError, Trials, acceleration, derivative};

const MANIFEST: &str = "vehicle = \"warthog\"\n";

fn folder(manifest: &str, files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().expect("a folder");
    std::fs::write(folder.path().join("trials.toml"), manifest).expect("written");
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    folder
}

fn read(manifest: &str, files: &[(&str, &str)]) -> Result<Trials, TrialError> {
    Trials::read(folder(manifest, files).path())
}

/// A CSV of the required columns and more, of which each is a function of time, at 100 Hz.
fn table(more: &[(&str, &dyn Fn(f64) -> f64)], rows: usize) -> String {
    let mut columns: Vec<(&str, &dyn Fn(f64) -> f64)> = vec![
        ("t", &|t| t),
        ("vx", &|_| 1.0),
        ("vy", &|_| 0.0),
        ("vz", &|_| 0.0),
        ("wx", &|_| 0.0),
        ("wy", &|_| 0.0),
        ("wz", &|_| 0.0),
        ("depth", &|_| 0.2),
    ];
    for (name, of) in more {
        match columns.iter_mut().find(|(known, _)| known == name) {
            Some(known) => known.1 = *of,
            None => columns.push((name, *of)),
        }
    }
    let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..rows {
        let values: Vec<String> = columns.iter().map(|(_, of)| of(row as f64 * 0.01).to_string()).collect();
        text += &(values.join(",") + "\n");
    }
    text
}

fn trial(more: &[(&str, &dyn Fn(f64) -> f64)]) -> Trial {
    read(MANIFEST, &[("run.csv", &table(more, 200))]).expect("sound").trials.remove(0)
}

fn fault(more: &[(&str, &dyn Fn(f64) -> f64)]) -> (Fault, String) {
    let error = read(MANIFEST, &[("run.csv", &table(more, 200))]).expect_err("refused");
    let message = error.to_string();
    assert!(message.contains("run.csv"), "{message}");
    (error.fault, message)
}

#[test]
fn a_full_folder_is_read_in_the_terms_of_the_body_frame() {
    let manifest = r#"
        vehicle = "warthog"
        fluid_density = 1025.0
        channel_width = 6.0
        mass = 280.0
        [channel_widths]
        b = inf
        [nominal_depth]
        "a.csv" = 0.2032
        [measured]
        columns = ["fx", "my"]
        method = "load_cell"
        repeats = [["a", "b.csv"]]
        dry_twins = { a = "b.csv" }
        other_forces = ["drive_fx"]
        known_loads = ["hung_fz"]
        [sensor_noise]
        fx = 4.0
        [trial_offset]
        fx = 2.0
        [trial_offsets.b]
        fx = 3.0
        [body]
        length = 1.5
        width = 1.4
        draft = 0.2
        mass = 280.0
        displaced_volume = 0.07
        center_of_mass = [0.0, 0.0, -0.06]
    "#;
    let text = "# a comment\n\
        depth, vz,vy,vx,t,wx,wy,wz,roll,pitch,fx,fz,my,drive_fx,sim_fx,wheel_fl,temperature\n\
        0.2,0,0.1,1.5,10,0,0,0.3,0.01,-0.02,-50,9,1,70,-48,4.5,20\n\
        0.21,0,0.1,1.6,10.1,0,0,0.3,0.01,-0.02,-51,9,2,71,-49,4.6,20\n";
    let weighed = text.replace("temperature", "hung_fz");
    let files = [("b.csv", &weighed[..]), ("a.csv", text), ("notes.txt", "not a trial")];
    let read = read(manifest, &files).expect("sound");
    let names: Vec<&str> = read.trials.iter().map(|trial| trial.name.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
    assert_eq!(read.manifest.measured.method, Some(Method::LoadCell));
    assert_eq!(read.manifest.nominal_depth["a"], 0.2032);
    let widths = ["a", "b"].map(|trial| read.manifest.channel_width_of(trial));
    assert_eq!(widths, [Some(6.0), Some(f64::INFINITY)]);
    let open = manifest.replace("channel_width = 6.0", "channel_width = inf");
    assert!(self::read(&open, &files).is_ok(), "open water is a width as well");
    // trials are named with or without the extension of their files
    assert_eq!(read.manifest.measured.repeats, [["a", "b"]]);
    assert_eq!(read.manifest.measured.dry_twins["a"], "b");
    let offsets =
        [("a", "fx"), ("b", "fx"), ("b", "fy")].map(|(trial, c)| read.manifest.trial_offset_of(trial, c));
    assert_eq!(offsets, [2.0, 3.0, 0.0]);
    let trial = &read.trials[0];
    assert_eq!((trial.len(), &trial.rows[..]), (2, &[3, 4][..]));
    assert_eq!(trial.measured[0].as_deref(), Some(&[-50.0, -51.0][..]));
    assert_eq!(trial.measured[2], None, "fz is there but not among the measured columns");
    assert_eq!(trial.measured[4].as_deref(), Some(&[1.0, 2.0][..]));
    assert_eq!(trial.simulated[0].as_deref(), Some(&[-48.0, -49.0][..]));
    assert_eq!(trial.other_forces["drive_fx"], [70.0, 71.0]);
    assert_eq!(trial.known_loads.get("hung_fz"), None, "a trial without the column bears none");
    assert_eq!(read.trials[1].known_loads["hung_fz"], [20.0, 20.0]);
    assert_eq!(trial.wheel_speeds[0].as_deref(), Some(&[4.5, 4.6][..]));
    assert_eq!(trial.wheel_speeds[1], None);
    let condition = trial.condition(1, GroundContact::Dry, 0.0);
    assert_eq!((condition.velocity.x, condition.velocity.y, condition.depth), (1.6, 0.1, 0.21));
    assert_eq!((condition.density, condition.ground_contact), (1025.0, GroundContact::Dry));
    assert!((condition.up.x - 0.02_f64.sin()).abs() < 1e-12, "a negative pitch raises the nose");
    let remarks: Vec<String> = read.remarks().iter().map(ToString::to_string).collect();
    assert_eq!(remarks, ["a: column temperature is not used"]);
}

#[test]
fn a_length_of_the_body_that_is_none_is_named() {
    let manifest = "vehicle = \"box\"\n[body]\nlength = 1.5\nwidth = -1.4\ndraft = 0.2\nmass = 280.0\n\
        displaced_volume = 0.07\ncenter_of_mass = [0.0, 0.0, 0.0]\n";
    let error = read(manifest, &[("a.csv", "t,vx,vy,vz,wx,wy,wz,depth\n")]).expect_err("refused").to_string();
    assert!(error.contains("body.width"), "{error}");
}

#[test]
fn missing_optional_columns_have_their_defaults_and_acceleration_is_that_of_the_vehicle() {
    // a steady turn: the velocity in the body frame is constant, and yet the vehicle accelerates to the left
    let trial = trial(&[("wz", &|_| 0.5)]);
    assert!(!trial.acceleration_is_measured);
    assert!(
        trial.acceleration.iter().all(|a| (a - wade_core::frame::Vec3::new(0.0, 0.5, 0.0)).norm() < 1e-9)
    );
    assert!(trial.measured.iter().chain(&trial.simulated).all(Option::is_none));
    assert!(trial.density.iter().all(|density| *density == 1000.0));
    assert!(trial.roll.iter().chain(&trial.pitch).chain(&trial.yaw).all(|angle| *angle == 0.0));
}

#[test]
fn measured_accelerations_are_kept() {
    let omega = 6.0;
    let trial = trial_with_accelerometer(omega, 1.0, 0.0).expect("sound");
    assert!(trial.acceleration_is_measured);
    assert!((trial.acceleration[10].x - omega * (omega * 0.1).cos()).abs() < 1e-12);
}

#[test]
fn accelerations_that_are_rates_of_the_components_get_what_the_turning_adds() {
    // a slalom at 1 m/s: dv/dt along the axes is that of vx alone, and omega x v stands across
    let turning = |t: f64| 0.8 * (2.0 * t).sin();
    let slalom = |across: f64, noise: f64| {
        let ay = move |t: f64| across * turning(t) + noise * (t * 400.0).sin();
        let more: [(&str, &dyn Fn(f64) -> f64); 5] =
            [("vx", &|_| 1.0), ("wz", &turning), ("ax", &|_| 0.0), ("ay", &ay), ("az", &|_| 0.0)];
        read(MANIFEST, &[("run.csv", &table(&more, 200))]).expect("sound")
    };
    let says_so = |trials: &Trials| trials.remarks().iter().any(|remark| matches!(remark, Remark::Rates));
    let across = |trials: &Trials| {
        let trial = &trials.trials[0];
        trial.t.iter().zip(&trial.acceleration).map(|(t, a)| (a.y - turning(*t)).abs()).fold(0.0, f64::max)
    };
    for (given, noise, is_rate) in
        [(0.0, 0.0, true), (0.0, 0.05, true), (1.0, 0.0, false), (1.0, 0.05, false)]
    {
        let trials = slalom(given, noise);
        assert_eq!(says_so(&trials), is_rate, "{given} {noise}");
        assert!(across(&trials) <= noise + 1e-9, "{given} {noise}: {}", across(&trials));
    }
    // so much noise hides which it is: it stays as it is
    let unclear = slalom(0.0, 2.0);
    assert!(!says_so(&unclear) && across(&unclear) > 0.5);
}

/// The vehicle sways by sin(omega t); its accelerometer has a scale and an offset along z.
fn trial_with_accelerometer(omega: f64, scale: f64, offset: f64) -> Result<Trial, TrialError> {
    let more: [(&str, &dyn Fn(f64) -> f64); 4] = [
        ("vx", &|t| (omega * t).sin()),
        ("ax", &|t| scale * omega * (omega * t).cos()),
        ("ay", &|_| 0.0),
        ("az", &|_| offset),
    ];
    read(MANIFEST, &[("run.csv", &table(&more, 200))]).map(|mut trials| trials.trials.remove(0))
}

#[test]
fn an_accelerometer_in_g_or_with_gravity_is_named() {
    let message = |scale: f64, offset: f64| {
        let error = trial_with_accelerometer(6.0, scale, offset).expect_err("refused");
        error.to_string()
    };
    let in_g = message(1.0 / 9.81, 0.0);
    assert!(in_g.contains("column ax") && in_g.contains("in g") && in_g.contains("row "), "{in_g}");
    let with_gravity = message(1.0, 9.81);
    assert!(with_gravity.contains("column az") && with_gravity.contains("gravity"), "{with_gravity}");
    // clocks that run at 50 times and at twice the speed beside an acceleration in m/s2
    // and one of the two against the other
    for scale in [50.0, 2.0, -1.0] {
        let clock = message(scale, 0.0);
        assert!(clock.contains("column t") && clock.contains("ax is"), "{clock}");
    }
    // at rest an accelerometer in g shows nothing but its one g
    let still = fault(&[("vx", &|_| 0.0), ("ax", &|_| 0.0), ("ay", &|_| 0.0), ("az", &|_| 1.0)]).1;
    assert!(still.contains("column az") && still.contains("gravity in g"), "{still}");
}

#[test]
fn angles_in_degrees_are_told_from_the_angular_velocity() {
    let rate = |t: f64| 0.06 * (2.0 * t).cos();
    let angle = |t: f64| 0.03 * (2.0 * t).sin();
    trial(&[("pitch", &angle), ("wy", &rate)]);
    let degrees = |t: f64| angle(t).to_degrees();
    let (found, message) = fault(&[("pitch", &degrees), ("wy", &rate)]);
    assert!(matches!(found, Fault::Degrees { column: "pitch", rate_column: "wy", .. }), "{message}");
    let (found, message) = fault(&[("yaw", &angle), ("wz", &|t| rate(t).to_degrees())]);
    assert!(matches!(found, Fault::DegreesPerSecond { rate_column: "wz", .. }), "{message}");
    let (found, message) = fault(&[("yaw", &angle), ("wz", &|t| rate(t) * 9.549)]);
    assert!(matches!(found, Fault::TurnsPerMinute { rate_column: "wz", .. }), "{message}");
    let (found, message) = fault(&[("pitch", &|t| -5.0 * angle(t)), ("wy", &|t| 5.0 * rate(t))]);
    assert!(matches!(found, Fault::Opposed { column: "pitch", rate_column: "wy", .. }), "{message}");
    // a heading that crosses north is no jump
    let heading = |t: f64| {
        let turned = 0.5 * t + 5.9;
        if turned > std::f64::consts::TAU { turned - std::f64::consts::TAU } else { turned }
    };
    trial(&[("yaw", &heading), ("wz", &|_| 0.5)]);
}

#[test]
fn a_clock_that_does_not_count_seconds_is_told_from_the_angular_velocity() {
    let told = |of_second: f64, unit: &str| {
        let text = table(&[("yaw", &|t| 0.5 * (2.0 * t).sin()), ("wz", &|t| (2.0 * t).cos())], 200);
        let mut lines = text.lines().map(str::to_owned);
        let header = lines.next().expect("a header");
        let rows = lines.enumerate().map(|(row, line)| {
            let rest = line.split_once(',').expect("columns").1;
            format!("{},{rest}", (row as f64 * 0.01 * of_second).round())
        });
        let text = std::iter::once(header).chain(rows).collect::<Vec<_>>().join("\n");
        let error = read(MANIFEST, &[("run.csv", &text)]).expect_err("refused");
        assert!(matches!(error.fault, Fault::TimeUnit { unit: u, .. } if u == unit), "{error}");
    };
    told(1000.0, "milliseconds");
    told(100.0, "frames");
}

#[test]
fn a_depth_and_a_velocity_in_other_units_show_in_each_other() {
    // bobs, pitched, while it drives ahead: what is forward goes up as well
    let pitch: f64 = -0.2;
    let ahead = |t: f64| 0.4 + 0.3 * t.sin();
    let up = |t: f64| 0.4 * (3.0 * t).cos();
    let rises = |t: f64| up(t) * pitch.cos() - pitch.sin() * ahead(t);
    let risen = |t: f64| {
        let steps = (t / 1e-3).round() as usize;
        (0..steps).map(|i| 1e-3 * rises(1e-3 * (i as f64 + 0.5))).sum::<f64>()
    };
    let of = |depths: f64, velocities: f64| {
        let (vx, vz) = (move |t: f64| velocities * ahead(t), move |t: f64| velocities * up(t));
        let depth = move |t: f64| depths * (0.5 - risen(t)) / pitch.cos();
        let columns: [(&str, &dyn Fn(f64) -> f64); 4] =
            [("vx", &vx), ("vz", &vz), ("pitch", &|_| pitch), ("depth", &depth)];
        read(MANIFEST, &[("run.csv", &table(&columns, 200))])
    };
    assert!(of(1.0, 1.0).is_ok(), "{:?}", of(1.0, 1.0).err());
    for (depths, velocities, said) in [
        (3.2808, 1.0, "in feet?"),
        (39.37, 1.0, "in inches?"),
        (1.0, 3.6, "in km/h?"),
        (1.0, 1.9438, "in knots?"),
        (1.0, 3.2808, "in feet a second?"),
    ] {
        let message = of(depths, velocities).expect_err(said).to_string();
        assert!(message.contains("column depth") && message.contains(said), "{message}");
    }
    let turned = of(1.0, -1.0).expect_err("it rises as it sinks");
    assert!(matches!(turned.fault, Fault::Rising { column: "depth", .. }), "{turned}");
}

#[test]
fn values_in_other_units_are_named_with_row_and_column() {
    for (column, value, unit) in
        [("depth", 203.0, "m"), ("rho", 1.0, "kg/m3"), ("roll", 3.0, "rad"), ("vx", 1500.0, "m/s")]
    {
        let (found, message) = fault(&[(column, &move |t| if t == 0.05 { value } else { 0.0 })]);
        // rho of 0 is out of range from the first row on
        let row = if column == "rho" { 2 } else { 7 };
        assert!(
            matches!(&found, Fault::Implausible { row: r, column: c, unit: u, .. } if (*r, c.as_str(), *u) == (row, column, unit)),
            "{message}"
        );
    }
}

#[test]
fn bad_cells_and_bad_time_are_named_with_row_and_column() {
    let good = table(&[], 5);
    for bad in ["NaN", "inf", "", "fast"] {
        let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
        lines[3] = lines[3].replacen(",1,", &format!(",{bad},"), 1);
        let error = read(MANIFEST, &[("run.csv", &lines.join("\n"))]).expect_err("refused");
        assert!(
            matches!(&error.fault, Fault::NotANumber { row: 4, column, value } if column == "vx" && value == bad),
            "{error}"
        );
    }
    for (row, t) in [(4, "0.01"), (3, "-1")] {
        let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
        let rest = lines[row - 1].split_once(',').expect("columns").1.to_owned();
        lines[row - 1] = format!("{t},{rest}");
        let error = read(MANIFEST, &[("run.csv", &lines.join("\n"))]).expect_err("refused");
        assert!(matches!(error.fault, Fault::Time { row: r, .. } if r == row as u64), "{error}");
    }
    let cut = good.trim_end().rsplit_once(',').expect("columns").0;
    let error = read(MANIFEST, &[("run.csv", cut)]).expect_err("refused");
    assert!(error.to_string().contains("line: 6"), "{error}");
    let error = read(MANIFEST, &[("run.csv", &table(&[], 1))]).expect_err("refused");
    assert!(matches!(error.fault, Fault::TooShort { rows: 1, least: 2 }), "{error}");
}

#[test]
fn missing_and_doubled_columns_are_named() {
    let missing = read(MANIFEST, &[("run.csv", "t,vx,vy,vz,wx,wy,depth\n")]).expect_err("refused");
    assert!(missing.to_string().contains("column wz is missing; there are: t, vx"), "{missing}");
    let twice = read(MANIFEST, &[("run.csv", "t,vx,vx\n")]).expect_err("refused");
    assert!(matches!(twice.fault, Fault::DuplicateColumn { .. }), "{twice}");
    assert!(twice.to_string().contains("column \"vx\" is there twice, as number 2 and 3"), "{twice}");
    let (half, message) = fault(&[("ax", &|_| 0.0)]);
    assert!(matches!(half, Fault::MissingColumn { column, .. } if column == "ay"), "{message}");
    let promised = format!("{MANIFEST}[measured]\ncolumns = [\"fz\"]\n");
    let error = read(&promised, &[("run.csv", &table(&[], 5))]).expect_err("refused");
    assert!(matches!(error.fault, Fault::MissingColumn { column, .. } if column == "fz"));
}

#[test]
fn a_hole_in_time_is_remarked_and_not_differentiated_across() {
    // at 1 m/s before the hole and at 3 m/s after it, never accelerating
    let text: String = table(&[("vx", &|t| if t < 0.5 { 1.0 } else { 3.0 })], 100)
        .lines()
        .enumerate()
        .map(|(line, text)| match (line, text.split_once(',')) {
            (51.., Some((t, rest))) => format!("{},{rest}\n", t.parse::<f64>().expect("a number") + 4.0),
            _ => format!("{text}\n"),
        })
        .collect();
    let trials = read(MANIFEST, &[("run.csv", &text)]).expect("sound");
    assert_eq!(trials.trials[0].gaps.len(), 1);
    assert!(trials.trials[0].acceleration.iter().all(|a| a.norm() < 1e-9));
    let remark = trials.remarks()[0].to_string();
    assert_eq!(remark, "run: a gap of 4.010 s before row 52");
}

#[test]
fn a_clock_in_milliseconds_is_remarked() {
    let seconds = table(&[], 20);
    let text = seconds.lines().enumerate().map(|(line, text)| match text.split_once(',') {
        Some((_, rest)) if line > 0 => format!("{},{rest}\n", line * 9),
        _ => format!("{text}\n"),
    });
    let trials = read(MANIFEST, &[("run.csv", &text.collect::<String>())]).expect("sound");
    assert!(trials.remarks()[0].to_string().contains("is t in another unit"));
}

#[test]
fn a_folder_that_is_none_says_what_it_lacks() {
    let empty = TempDir::new().expect("a folder");
    let error = Trials::read(empty.path()).expect_err("refused");
    assert!(matches!(error.fault, Fault::NoManifest), "{error}");
    let error = read(MANIFEST, &[]).expect_err("refused");
    assert!(matches!(error.fault, Fault::NoTrial), "{error}");
    let error = Trials::read(Path::new("/nowhere/at/all")).expect_err("refused");
    assert!(error.to_string().contains("/nowhere/at/all"), "{error}");
}

#[test]
fn an_ending_in_capitals_is_a_trial_too_and_not_another_of_the_same_name() {
    let run = table(&[], 20);
    let trials = read(MANIFEST, &[("one.csv", &run), ("two.CSV", &run)]).expect("sound");
    assert_eq!(trials.trials.iter().map(|trial| trial.name.as_str()).collect::<Vec<_>>(), ["one", "two"]);
    let error = read(MANIFEST, &[("one.csv", &run), ("one.CSV", &run)]).expect_err("refused");
    assert!(matches!(&error.fault, Fault::SameName { name } if name == "one"), "{error}");
}

#[test]
fn a_manifest_with_unknown_names_or_numbers_is_refused() {
    let run = table(&[], 5);
    for (manifest, expected) in [
        ("vehicel = \"warthog\"", "vehicel"),
        ("vehicle = \"w\"\nmass = -1.0", "mass = -1 must be positive"),
        (
            "vehicle = \"w\"\ninertia = [[1.0, 0.1, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
            "inertia is not symmetric: state it by rows",
        ),
        (
            "vehicle = \"w\"\ninertia = [[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]",
            "inertia has a principal moment of inertia that is not positive",
        ),
        (
            "vehicle = \"w\"\ninertia = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]",
            "larger than the other two together",
        ),
        ("vehicle = \"w\"\ninertia = [1.0, 1.0, 1.0]", "inertia"),
        ("vehicle = \"w\"\n[nominal_depth]\nrun2 = 0.1", "nominal_depth names \"run2\""),
        ("vehicle = \"w\"\n[measured]\nrepeats = [[\"run\", \"again\"]]", "measured.repeats names \"again\""),
        ("vehicle = \"w\"\n[channel_widths]\nrun2 = 3.0", "channel_widths names \"run2\""),
        ("vehicle = \"w\"\n[channel_widths]\nrun = 0.0", "channel_widths.run = 0 must be positive, or inf"),
        (
            "vehicle = \"w\"\n[measured]\nknown_loads = [\"weight\"]",
            "names \"weight\", which ends in none of",
        ),
        ("vehicle = \"w\"\n[measured]\nother_forces = [\"drive\"]", "names \"drive\", which ends in none of"),
        ("vehicle = \"w\"\n[measured]\nknown_loads = [\"hung_fz\"]", "\"hung_fz\", which is a column of no"),
        (
            "vehicle = \"w\"\n[measured]\nmethod = \"inverse_dynamics\"\nknown_loads = [\"hung_fz\"]",
            "name the columns in other_forces",
        ),
        ("vehicle = \"w\"\n[measured]\nmethod = \"guess\"", "guess"),
        ("vehicle = \"w\"\n[sensor_noise]\nfw = 1.0", "sensor_noise names \"fw\""),
        ("vehicle = \"w\"\n[trial_offset]\nfx = -1.0", "trial_offset.fx = -1"),
        ("vehicle = \"w\"\n[trial_offsets.run]\nfx = -1.0", "trial_offsets.run.fx = -1"),
        ("vehicle = \"w\"\n[trial_offsets.run]\nfw = 1.0", "names \"fw\""),
        ("vehicle = \"w\"\n[trial_offsets.ran]\nfx = 1.0", "trial_offsets names \"ran\""),
    ] {
        let error = read(manifest, &[("run.csv", &run)]).expect_err("refused");
        assert!(error.to_string().contains("trials.toml") && error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn loads_that_cannot_be_are_named_with_row_and_column() {
    for (column, value, unit) in
        [("fx", 2e7, "N"), ("my", -2e8, "N m"), ("sim_fz", 1e300, "N"), ("sim_mx", f64::MAX, "N m")]
    {
        let (found, message) = fault(&[(column, &move |t| if t == 0.05 { value } else { 0.0 })]);
        assert!(
            matches!(&found, Fault::Implausible { row: 7, column: c, unit: u, .. } if (c.as_str(), *u) == (column, unit)),
            "{message}"
        );
    }
    let manifest = format!("{MANIFEST}[measured]\nother_forces = [\"drive_fx\"]\n");
    let drive = |force: f64| read(&manifest, &[("run.csv", &table(&[("drive_fx", &move |_| force)], 200))]);
    assert!(drive(9e6).is_ok());
    let error = drive(-2e7).expect_err("refused");
    assert!(
        matches!(&error.fault, Fault::Implausible { row: 2, column, .. } if column == "drive_fx"),
        "{error}"
    );
}

#[test]
fn a_clock_in_nanoseconds_is_refused_and_seconds_since_1970_are_not() {
    let (found, message) = fault(&[("t", &|t| 1e9 * t + 1.7e18)]);
    assert!(
        matches!(&found, Fault::Implausible { row: 3, column, unit: "s", .. } if column == "t"),
        "{message}"
    );
    trial(&[("t", &|t| t + 1.7e9)]);
}

#[test]
fn numbers_of_the_manifest_beyond_any_measure_are_refused() {
    let run = table(&[], 5);
    let body = |center: &str, length: &str| {
        format!(
            "vehicle = \"w\"\n[body]\nlength = {length}\nwidth = 1.4\ndraft = 0.2\nmass = 280.0\n\
             displaced_volume = 0.07\ncenter_of_mass = {center}"
        )
    };
    for (manifest, expected) in [
        ("vehicle = \"w\"\nfluid_density = 1e300".to_owned(), "must be between 1.1 and 3000 kg/m3"),
        ("vehicle = \"w\"\nfluid_density = 1.0".to_owned(), "fluid_density = 1 must be between 1.1"),
        ("vehicle = \"w\"\nmass = 1e20".to_owned(), "must be between 1e-6 and 1e8 kg"),
        ("vehicle = \"w\"\nchannel_width = -inf".to_owned(), "channel_width = -inf must be positive, or inf"),
        ("vehicle = \"w\"\nchannel_width = 1e9".to_owned(), "channel_width = 1000000000 must be between"),
        ("vehicle = \"w\"\n[nominal_depth]\nrun = 200.0".to_owned(), "nominal_depth.run = 200 must be"),
        ("vehicle = \"w\"\n[nominal_depth]\nrun = 0.1".to_owned(), "run.csv lie 0.200 m deep at most"),
        ("vehicle = \"w\"\n[nominal_depth]\nrun = 0.66".to_owned(), "nominal_depth.run = 0.66, in meters"),
        ("vehicle = \"w\"\n[sensor_noise]\nfx = 1e9".to_owned(), "sensor_noise.fx = 1000000000 must be"),
        (body("[nan, 0.0, 0.0]", "1.5"), "body.center_of_mass = NaN must be within 1000 m"),
        (body("[0.0, 0.0, -inf]", "1.5"), "body.center_of_mass = -inf must be within 1000 m"),
        (body("[0.0, 0.0, 0.0]", "1500.0"), "body.length = 1500 must be between 0.001 and 1000 m"),
    ] {
        let error = read(&manifest, &[("run.csv", &run)]).expect_err("refused").to_string();
        assert!(error.contains("trials.toml") && error.contains(expected), "{error}");
    }
    // air, in which bodies fall
    let air = read("vehicle = \"ball\"\nfluid_density = 1.204", &[("run.csv", &run)]).expect("sound");
    assert_eq!(air.trials[0].density, [1.204; 5]);
}

#[test]
fn repeats_twins_and_columns_that_say_nothing_are_the_fault_of_the_manifest() {
    let run = table(&[], 5);
    let files = [("a.csv", &run[..]), ("b.csv", &run[..]), ("c.csv", &run[..])];
    for (measured, expected) in [
        ("repeats = [[\"a\", \"a\"]]", "measured.repeats lists \"a\" twice"),
        ("repeats = [[\"a\", \"b\"], [\"b\", \"c\"]]", "measured.repeats lists \"b\" twice"),
        ("dry_twins = { a = \"a\" }", "makes \"a\" the dry twin of \"a\" and a trial in water"),
        ("dry_twins = { a = \"b\", b = \"c\" }", "makes \"b\" the dry twin of \"a\" and a trial in water"),
        ("columns = []", "measured.columns is empty"),
    ] {
        let error = read(&format!("{MANIFEST}[measured]\n{measured}\n"), &files).expect_err("refused");
        let message = error.to_string();
        assert!(message.contains("trials.toml") && message.contains(expected), "{message}");
    }
    // two trials may have one twin, and a list of one says nothing
    let fine = "repeats = [[\"a\", \"b\"], [\"c\"]]\ndry_twins = { a = \"c\", b = \"c\" }";
    read(&format!("{MANIFEST}[measured]\n{fine}\n"), &files).expect("sound");
    // what is inferred has no column
    let inferred = "columns = []\nmethod = \"inverse_dynamics\"";
    read(&format!("{MANIFEST}[measured]\n{inferred}\n"), &files).expect("sound");
}

#[test]
fn a_sample_that_stands_alone_is_remarked_and_an_impact_is_not() {
    let remarks = |force: &dyn Fn(f64) -> f64| -> Vec<String> {
        let text = table(&[("fx", force)], 200);
        let trials = read(MANIFEST, &[("run.csv", &text)]).expect("sound");
        trials.remarks().iter().map(ToString::to_string).collect()
    };
    let drag = |t: f64| -20.0 + (97.0 * t).sin();
    let alone = remarks(&|t| if t == 0.05 { 1e4 } else { drag(t) });
    assert!(
        matches!(&alone[..], [one] if one.starts_with("run: row 7, column fx: 10000 stands alone")),
        "{alone:?}"
    );
    let nothing: [String; 0] = [];
    let slam = |t: f64| drag(t) + 1e4 * (-((t - 1.0) / 0.02).powi(2)).exp();
    assert_eq!(remarks(&slam), nothing);
    // one in a hundred is left out, one in twenty is no accident
    let often = table(&[("fx", &|t| if (t * 100.0).round() % 20.0 == 7.0 { 1e4 } else { drag(t) })], 200);
    let error = read(MANIFEST, &[("run.csv", &often)]).expect_err("refused").to_string();
    assert!(error.contains("run.csv: 10 of 200 rows stand alone") && error.contains("row 9"), "{error}");
    let once = table(&[("fx", &|t| if t == 0.05 { 1e4 } else { drag(t) })], 200);
    let trial = read(MANIFEST, &[("run.csv", &once)]).expect("sound").trials.remove(0);
    assert_eq!((trial.len(), trial.rows[4], trial.rows[5]), (199, 6, 8));
    // most of it the same: no noise to judge by
    assert_eq!(remarks(&|t| if t == 0.05 { 1e4 } else { 0.0 }), nothing);
}

/// The table with another column in the place of `depth`.
fn with_level(level: &dyn Fn(f64) -> f64, more: &[(&str, &dyn Fn(f64) -> f64)]) -> String {
    let more: Vec<(&str, &dyn Fn(f64) -> f64)> =
        [("depth", level)].into_iter().chain(more.iter().copied()).collect();
    table(&more, 200).replacen("depth", "water_level", 1)
}

#[test]
fn a_water_level_stands_in_the_place_of_the_depth_in_every_attitude() {
    const Z0: f64 = -0.25;
    // from upright over the side onto the back
    let roll = |t: f64| std::f64::consts::PI * t / 2.0;
    let rate = |_: f64| std::f64::consts::PI / 2.0;
    let text = with_level(
        &|_| 0.0625,
        &[("roll", &roll), ("wx", &rate), ("bed_clearance", &|t| t), ("bed", &|_| 0.5)],
    );
    let trial = read(MANIFEST, &[("run.csv", &text)]).expect("sound").trials.remove(0);
    let state = |sample: usize| trial.condition(sample, GroundContact::Wetted, Z0);
    assert_eq!((state(0).water_level, state(0).depth), (Some(0.0625), 0.0625 - Z0));
    assert_eq!((state(100).bed_clearance, state(100).stated_bed), (Some(1.0), Some(0.5)));
    for sample in [50, 199] {
        let depth = 0.0625 / roll(0.01 * sample as f64).cos().max(0.1) - Z0;
        assert!((trial.depth(sample, Z0) - depth).abs() < 1e-12, "{sample}");
    }
    let level = self::trial(&[]).condition(0, GroundContact::Wetted, Z0);
    assert_eq!((level.water_level, level.bed_clearance, level.stated_bed), (None, None, None));
}

#[test]
fn depth_and_level_are_given_once_and_the_bed_is_where_it_can_be() {
    let message = |text: &str| {
        let message = read(MANIFEST, &[("run.csv", text)]).expect_err("refused").to_string();
        assert!(message.contains("run.csv"), "{message}");
        message
    };
    let both = message(&table(&[("water_level", &|_| 0.0)], 20));
    assert!(both.contains("columns depth and water_level are both there: give one of the two"), "{both}");
    let none = message(&table(&[], 20).replacen("depth", "height", 1));
    assert!(none.contains("column depth is missing, or water_level in its place; there are: "), "{none}");
    let cell = |column: &str, value: f64| {
        message(&table(&[(column, &move |t| if t == 0.05 { value } else { 0.0 })], 200))
    };
    for (column, value, expected) in [
        ("bed_clearance", f64::NAN, "is no finite number"),
        ("bed_clearance", f64::INFINITY, "is no finite number"),
        ("bed_clearance", -0.1, "must not be negative"),
        ("bed", f64::NAN, "is no finite number"),
        ("bed", 1.5, "must lie between 0 (parked) and 1 (driving)"),
        ("bed", -0.1, "must lie between 0 (parked) and 1 (driving)"),
        ("roll", 1.55, "on its side or its back"),
    ] {
        let message = cell(column, value);
        let column = if column == "roll" { "depth" } else { column };
        let named = message.contains(&format!("row 7, column {column}: "));
        assert!(named && message.contains(expected), "{message}");
    }
    let step = |t: f64| if t == 0.05 { f64::NAN } else { 0.0 };
    let level = message(&with_level(&step, &[]));
    assert!(level.contains("row 7, column water_level: \"NaN\" is no finite number"), "{level}");
    let level = message(&with_level(&|t| if t == 0.05 { 203.0 } else { 0.0 }, &[]));
    assert!(level.contains("row 7, column water_level: 203 lies outside"), "{level}");
}

#[test]
fn accelerations_of_means_are_derivatives_of_means_unless_they_were_measured() {
    let speed = |t: f64| (3.0 * t).sin();
    let windows: Vec<_> = (0..20).map(|window| 10 * window..10 * (window + 1)).collect();
    let derived = trial(&[("vx", &speed), ("wz", &|t| 0.2 * t)]).averaged(&windows);
    let rates = acceleration(&derived.t, &derived.velocity, &derived.angular_velocity);
    assert_eq!(derived.acceleration, rates);
    assert_eq!(derived.angular_acceleration, derivative(&derived.t, &derived.angular_velocity));
    let recorded =
        trial(&[("vx", &speed), ("ax", &|t| 3.0 * (3.0 * t).cos()), ("ay", &|_| 0.0), ("az", &|_| 0.0)]);
    let means = recorded.averaged(&windows);
    let first = recorded.acceleration[..10].iter().map(|a| a.x).sum::<f64>() / 10.0;
    assert!((means.acceleration[0].x - first).abs() < 1e-12);
    assert_eq!((means.len(), means.rows[1]), (20, recorded.rows[10]));
    // a window of one sample is the sample, and what has no window is left out
    let some = recorded.averaged(&[3..4, 5..6]);
    assert_eq!(some.velocity, [recorded.velocity[3], recorded.velocity[5]]);
}

#[test]
fn the_bed_is_a_share_or_one_of_two_words_and_the_manifest_states_the_physics() {
    let rows = "t,vx,vy,vz,wx,wy,wz,depth,bed\n0,1,0,0,0,0,0,0.2,parked\n0.01,1,0,0,0,0,0,0.2,0.25\n0.02,1,0,0,0,0,0,0.2,driving\n";
    let manifest = "vehicle = \"w\"\nphysics = \"quasi_steady\"";
    let sound = read(manifest, &[("run.csv", rows)]).expect("sound");
    assert_eq!(sound.trials[0].bed.as_deref(), Some(&[0.0, 0.25, 1.0][..]));
    assert_eq!(sound.manifest.physics, Some(Physics::QuasiSteady));
    let error = read(manifest, &[("run.csv", &rows.replace("parked", "towed"))]).expect_err("refused");
    assert!(
        matches!(&error.fault, Fault::NotANumber { column, value, .. } if column == "bed" && value == "towed")
    );
    let error =
        read("vehicle = \"w\"\nphysics = \"half\"", &[("run.csv", rows)]).expect_err("refused").to_string();
    assert!(error.contains("trials.toml") && error.contains("hydrostatic"), "{error}");
}
