//! Balls dropped from a bridge, filmed.
//!
//! Source: de Silva, Higdon, Brunton, Kutz, "Discovery of physics from data: universal laws and discrepancies", 2020 (MIT).
//! Files: each sheet of `Ball_drops_data.xls` saved as CSV under the ball's name (`golfball.csv`: drop, time, height,
//! velocity), and `balls.txt` with weights and circumferences.
//!
//! Against a fall without drag the literature finds drag on the light balls, nearly quadratic in the speed; the heavy ones
//! show nothing that the film resolves, so that they are real nulls. Added mass is a thousandth of a ball's mass.
//!
//! The fluid is air. The measured force is mass times acceleration plus weight; the simulation is buoyancy alone. Heights
//! are differentiated twice at 15 Hz; the last samples of a drop, where the ball leaves the picture, are left out.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use super::ImportError;
use wade_core::frame::GRAVITY;
use wade_learn::signal::SavitzkyGolay;
use wade_learn::trials::{self, Body, Columns, Manifest, Measured, Method, Table};

/// Density of air at 20 degrees Celsius [kg/m3].
const AIR: f64 = 1.204;
/// Kilograms in an ounce.
const OUNCE: f64 = 0.028_349_523;
/// Window of the filter [samples].
const WINDOW: usize = 9;
/// Samples at the end of a drop that are left out.
const LEFT_OUT: usize = 5;
const TABLE: &str = "balls.txt";
const COLUMNS: [&str; 3] = ["Drop #", "Time (s)", "Height (m)"];

/// Writes one folder of trials for each ball whose sheet is in a folder.
pub fn import(from: &Path, out: &Path) -> Result<(), ImportError> {
    let path = from.join(TABLE);
    let masses = fs::read_to_string(&path).map_err(|error| ImportError::Io { path: path.clone(), error })?;
    let entries = fs::read_dir(from).map_err(|error| ImportError::Io { path: from.to_owned(), error })?;
    let mut sheets: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    sheets.retain(|path| path.extension().is_some_and(|extension| extension == "csv"));
    sheets.sort();
    if sheets.is_empty() {
        return Err(ImportError::Nothing { path: from.to_owned(), expected: "golfball.csv and the like" });
    }
    for sheet in sheets {
        let name = sheet.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let Some(ball) = ball(&masses, &name) else {
            // a ball that was never weighed says nothing of a force
            if mentions(&masses, &name) {
                continue;
            }
            return Err(ImportError::UnknownBody { path, name });
        };
        import_ball(&sheet, &ball, &name, &out.join(&name))?;
    }
    Ok(())
}

/// Mass [kg] and diameter [m].
struct Ball {
    mass: f64,
    diameter: f64,
}

/// The spelling of sheets and table differs.
fn plain(name: &str) -> String {
    name.to_lowercase().replace("ball", "").replace("whiffle", "wiffle")
}

fn mentions(masses: &str, name: &str) -> bool {
    masses.lines().any(|line| line.split_whitespace().next().is_some_and(|first| plain(first) == plain(name)))
}

fn ball(masses: &str, name: &str) -> Option<Ball> {
    let row = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let [first, ounces, circumference] = words[..] else { return None };
        let (ounces, centimeters) = (ounces.parse::<f64>().ok()?, circumference.parse::<f64>().ok()?);
        (plain(first) == plain(name))
            .then_some(Ball { mass: ounces * OUNCE, diameter: 0.01 * centimeters / PI })
    };
    masses.lines().find_map(row)
}

fn import_ball(sheet: &Path, ball: &Ball, name: &str, out: &Path) -> Result<(), ImportError> {
    let table = Table::read(sheet, &COLUMNS, &[])?;
    let [drop, time, height] = COLUMNS.map(|column| table.column(column));
    let volume = PI / 6.0 * ball.diameter.powi(3);
    let filter = |error| ImportError::Filter { path: sheet.to_owned(), error };
    let mut trials: Vec<Columns> = Vec::new();
    for number in [1.0, 2.0] {
        let rows: Vec<usize> = (0..drop.len()).filter(|&i| drop[i] == number).collect();
        if rows.len() < WINDOW + LEFT_OUT {
            continue;
        }
        let t: Vec<f64> = rows.iter().map(|&i| time[i]).collect();
        let heights: Vec<f64> = rows.iter().map(|&i| height[i]).collect();
        let step = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
        let savitzky = SavitzkyGolay::new(WINDOW, 3).map_err(filter)?;
        let velocity = savitzky.derivative(&heights, 1, step).map_err(filter)?;
        let acceleration = savitzky.derivative(&heights, 2, step).map_err(filter)?;
        let used = t.len() - LEFT_OUT;
        let still = vec![0.0; used];
        let fz = acceleration[..used].iter().map(|a| ball.mass * (a + GRAVITY)).collect();
        let columns = vec![
            ("t", t[..used].to_vec()),
            ("vz", velocity[..used].to_vec()),
            ("ax", still.clone()),
            ("ay", still),
            ("az", acceleration[..used].to_vec()),
            ("depth", vec![ball.diameter; used]),
            ("fz", fz),
            ("sim_fz", vec![AIR * GRAVITY * volume; used]),
        ];
        trials.push((format!("{name}-{number}"), columns));
    }
    let repeats: Vec<String> = trials.iter().map(|(name, _)| name.clone()).collect();
    let manifest = Manifest {
        vehicle: name.to_owned(),
        fluid_density: Some(AIR),
        mass: Some(ball.mass),
        measured: Measured {
            method: Some(Method::InverseDynamics),
            repeats: vec![repeats],
            ..Measured::default()
        },
        body: Some(Body {
            length: ball.diameter,
            width: ball.diameter,
            draft: ball.diameter,
            mass: ball.mass,
            displaced_volume: volume,
            center_of_mass: [0.0; 3],
        }),
        ..Manifest::default()
    };
    Ok(trials::write(out, &manifest, &trials)?)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use wade_learn::trials::Trials;

    #[test]
    fn a_ball_that_falls_with_drag_shows_it() {
        // terminal velocity 20 m/s: v = -vt tanh(g t / vt), z = -vt^2 / g ln cosh
        let place = tempfile::tempdir().unwrap();
        let mut sheet = String::from("Drop #,Time (s),Height (m),Velocity (m/s)\n");
        for i in 0..45 {
            let t = f64::from(i) / 15.0;
            let height = 48.0 - 400.0 / GRAVITY * (GRAVITY * t / 20.0).cosh().ln();
            sheet += &format!("1,{t},{height},0\n");
        }
        fs::write(place.path().join("testball.csv"), sheet).unwrap();
        fs::write(place.path().join(TABLE), "ball weight(oz) circumference(cm)\ntestball 2 20\n").unwrap();
        let out = place.path().join("out");
        import(place.path(), &out).unwrap();
        let trials = Trials::read(&out.join("testball")).unwrap();
        let trial = &trials.trials[0];
        let mass = 2.0 * OUNCE;
        for (i, fz) in trial.measured[2].as_ref().unwrap().iter().enumerate().skip(5) {
            let drag = mass * GRAVITY * (GRAVITY * trial.t[i] / 20.0).tanh().powi(2);
            assert!((fz - drag).abs() < 0.02 * mass * GRAVITY, "{i}: {fz} {drag}");
        }
        assert!(matches!(import_name(place.path(), "other.csv"), Err(ImportError::UnknownBody { .. })));
    }

    fn import_name(from: &Path, name: &str) -> Result<(), ImportError> {
        fs::write(from.join(name), "Drop #,Time (s),Height (m)\n").unwrap();
        import(from, &from.join("out"))
    }
}
