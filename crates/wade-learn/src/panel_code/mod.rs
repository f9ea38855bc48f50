//! Added mass and waves of a hull by capytaine, a boundary-element code for linear waves in Python.

mod net;

use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use nalgebra::Matrix6;
use serde::{Deserialize, Serialize};

use wade_core::physics::panel::{Basin, Panel, impulse};
use wade_core::physics::radiation::{Radiation, Solved, SolvedWaves, frequencies};
use wade_core::vehicle::Vehicle;

/// How to get it.
const HOW_TO_INSTALL: &str = "`python3 -m pip install capytaine==3.0.0 trimesh meshio`, into an environment whose Python \
    stands in WADE_PYTHON or is given with --python";

/// What solves a case: JSON in, a line of JSON a case out.
const SCRIPT: &str = include_str!("solve.py");

/// Most that an added mass may differ from its transpose, over its norm [-]: ten times what sound panels come to.
const MOST_SKEW: f64 = 0.03;

/// Factor to which two solvers must agree on the added mass of the same panels [-]: `wade_core::physics::panel` has the
/// velocities of a grid of points a panel where capytaine integrates, and is within a tenth of it for sound panels.
const FARTHEST: f64 = 1.3;

/// Most panels of a hull: a table takes minutes, and twice as many change its heave by a tenth.
const PANELS: usize = 800;

/// The Python that has capytaine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Capytaine {
    python: PathBuf,
    /// Its version.
    pub version: String,
}

/// Why there are no waves.
#[derive(Debug, thiserror::Error)]
pub enum PanelCodeError {
    /// Not found.
    #[error("{}: no capytaine ({reason}): {HOW_TO_INSTALL}", .python.display())]
    Missing {
        /// The Python that was asked.
        python: PathBuf,
        /// What it said.
        reason: String,
    },
    /// It ended early.
    #[error("capytaine ended after {done} of {cases} water levels: {reason}")]
    Ended {
        /// How many were solved.
        done: usize,
        /// How many there are.
        cases: usize,
        /// The last line that it wrote to its standard error.
        reason: String,
    },
    /// The hull has no panels that describe it.
    #[error(
        "at a water level of {level:.3} m (over the body origin): {fault}; the bundle keeps the table it has"
    )]
    Unresolved {
        /// Level of the case [m].
        level: f64,
        /// How far off they are.
        fault: net::Unresolved,
    },
    /// It answers for panels that it cannot solve.
    #[error(
        "capytaine gives no added mass that water has at a water level of {level:.3} m (over the body origin): {reason}; \
         the bundle keeps the table it has"
    )]
    Unsound {
        /// Level of the case [m].
        level: f64,
        /// What is wrong.
        reason: String,
    },
    /// It says what no panel code says.
    #[error("capytaine answers what cannot be read: {0}")]
    Answer(#[from] serde_json::Error),
    /// The process could not be run.
    #[error("capytaine cannot be run: {0}")]
    Io(#[from] std::io::Error),
}

#[derive(Serialize)]
struct Task {
    cases: Vec<Case>,
    frequencies: Vec<f64>,
}

/// Water of a depth, `None` for deep, and the wet part of the hull in it.
#[derive(Serialize)]
struct Case {
    level: f64,
    depth: Option<f64>,
    panels: Vec<net::Panel>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Answer {
    #[serde(rename = "case")]
    _case: usize,
    /// Of infinite frequency.
    mass: [[f64; 6]; 6],
    waves: Vec<Waves>,
}

/// At a frequency.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Waves {
    mass: [[f64; 6]; 6],
    damping: [[f64; 6]; 6],
}

impl Capytaine {
    /// Finds it in a Python: the one given, `WADE_PYTHON`, or `python3`.
    pub fn find(python: Option<PathBuf>) -> Result<Self, PanelCodeError> {
        let python = python
            .or_else(|| std::env::var_os("WADE_PYTHON").filter(|name| !name.is_empty()).map(PathBuf::from))
            .unwrap_or_else(|| "python3".into());
        let asked = Command::new(&python)
            .args(["-c", "import capytaine; print(capytaine.__version__)"])
            .stdin(Stdio::null())
            .output();
        let missing = |reason: String| PanelCodeError::Missing { python: python.clone(), reason };
        let asked = asked.map_err(|error| missing(error.to_string()))?;
        if !asked.status.success() {
            return Err(missing(last_line(&asked.stderr)));
        }
        let version = String::from_utf8_lossy(&asked.stdout).trim().to_owned();
        Ok(Self { python, version })
    }

    /// The table of a vehicle; `progress` hears how many of how many water levels are solved.
    pub fn radiation(
        &self,
        vehicle: &Vehicle,
        progress: &dyn Fn(usize, usize),
    ) -> Result<Radiation, PanelCodeError> {
        let mut asked = Vec::new();
        // what is asked for, in order; the answers are not used
        Radiation::from_solved(vehicle, "", |level, clearance| {
            asked.push((level, clearance));
            Solved {
                mass: Matrix6::identity(),
                waves: vec![SolvedWaves::damped(Matrix6::zeros()); frequencies(vehicle).len()],
            }
        });
        let cases = asked.into_iter().map(|(level, clearance)| {
            let bed = clearance.map(|clearance| vehicle.z0 - clearance);
            let panels = net::wet_panels(&vehicle.hull.mesh, level, PANELS)
                .map_err(|fault| PanelCodeError::Unresolved { level, fault })?;
            Ok(Case { level, depth: bed.map(|bed| level - bed), panels })
        });
        let cases = cases.collect::<Result<Vec<Case>, PanelCodeError>>()?;
        let count = cases.len();
        let task = Task { cases, frequencies: frequencies(vehicle).to_vec() };
        let solved = self.solve(&task, count, progress)?;
        for (case, solved) in task.cases.iter().zip(&solved) {
            // next to the bed wade's own solver is the rougher one
            let deep = case.depth.is_none().then(|| {
                let panels: Vec<Panel> = case.panels.iter().map(Panel::from_corners).collect();
                impulse(&panels, &Basin { level: case.level, bed: None }).mass
            });
            if let Some(reason) = unsound(&solved.mass, deep.as_ref()) {
                return Err(PanelCodeError::Unsound { level: case.level, reason });
            }
        }
        let mut solved = solved.into_iter();
        let source = format!("capytaine {}", self.version);
        Ok(Radiation::from_solved(vehicle, &source, |_, _| {
            solved.next().unwrap_or_else(|| unreachable!("as many answers as cases"))
        }))
    }

    fn solve(
        &self,
        task: &Task,
        count: usize,
        progress: &dyn Fn(usize, usize),
    ) -> Result<Vec<Solved>, PanelCodeError> {
        let mut child = Command::new(&self.python)
            .args(["-c", SCRIPT])
            // one core: others may have work on this machine
            .env("OMP_NUM_THREADS", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        if let Some(mut input) = child.stdin.take() {
            input.write_all(serde_json::to_string(task)?.as_bytes())?;
        }
        let mut solved = Vec::new();
        if let Some(output) = child.stdout.take() {
            for line in BufReader::new(output).lines() {
                let answer: Answer = serde_json::from_str(&line?)?;
                let matrix = |rows: &[[f64; 6]; 6]| Matrix6::from_fn(|i, j| rows[i][j]);
                solved.push(Solved {
                    mass: matrix(&answer.mass),
                    waves: answer
                        .waves
                        .iter()
                        .map(|waves| SolvedWaves {
                            mass: Some(matrix(&waves.mass)),
                            damping: matrix(&waves.damping),
                        })
                        .collect(),
                });
                progress(solved.len(), count);
            }
        }
        let ended = child.wait_with_output()?;
        if !ended.status.success() || solved.len() != count {
            let reason = last_line(&ended.stderr);
            return Err(PanelCodeError::Ended { done: solved.len(), cases: count, reason });
        }
        Ok(solved)
    }
}

/// Why a matrix is no added mass: that of water is symmetric, positive and of the size that another solver finds.
fn unsound(mass: &Matrix6<f64>, other: Option<&Matrix6<f64>>) -> Option<String> {
    let skew = (mass - mass.transpose()).norm() / mass.norm().max(f64::MIN_POSITIVE);
    if skew > MOST_SKEW {
        return Some(format!("it is not symmetric by {:.0} %", 100.0 * skew));
    }
    let modes = ["surge", "sway", "heave", "roll", "pitch", "yaw"];
    (0..6).find_map(|mode| {
        let own = mass[(mode, mode)];
        if own.is_nan() || own <= 0.0 {
            return Some(format!("in {} it is {own:.3}, which is not positive", modes[mode]));
        }
        let times = own / other?[(mode, mode)];
        (!(1.0 / FARTHEST..FARTHEST).contains(&times)).then(|| {
            format!(
                "in {} it has {times:.2} times what wade's own solver finds for the same panels",
                modes[mode]
            )
        })
    })
}

fn last_line(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    text.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("no reason given").trim().to_owned()
}
