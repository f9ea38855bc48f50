//! One case from its files to section averages.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, ExitStatus};
use std::time::{Duration, Instant};

use nix::time::{clock_getcpuclockid, clock_gettime};
use nix::unistd::Pid;
use serde::{Deserialize, Serialize};

use super::case::{Inputs, RAMP_PATCH, Settings};
use super::claim::Claim;
use super::gauges::{self, GaugeError};
use super::openfoam::{MeshKind, internal_vectors};
use super::placement::Placement;
use super::plan::{Campaign, Case};
use super::poly_mesh::{MeshHull, PolyMeshError};
use crate::dataset::CutOff;
use crate::dataset::history::{History, HistoryError};
use crate::dataset::openfoam;
use wade_core::condition::Condition;
use wade_core::frame::{GRAVITY, Vec3};
use wade_core::wrench::Wrench;

/// Duration of a section [s], as the source paper averages.
pub const SECTION_S: f64 = 0.1;
/// How many times the inflow the potential flow may be fast. Round the corners of a staircase it is up to five times as
/// fast; the fault of Debian's build shows as thousands.
const FASTEST: f64 = 10.0;
/// Share of the force at rest below which a dynamic force does not matter.
const UNSEEN: f64 = 0.05;

/// Load on one surface about the body origin, body frame.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Pressure and viscous force [N].
    pub force: [f64; 3],
    /// Moment about the body origin [N m].
    pub moment: [f64; 3],
    /// The viscous part of the force [N].
    pub viscous: [f64; 3],
}

/// Averages over one section.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Start [s].
    pub start_s: f64,
    /// End [s].
    pub end_s: f64,
    /// Mean speed through the water [m/s].
    pub speed_mps: f64,
    /// Mean acceleration along the velocity [m/s2].
    pub acceleration_mps2: f64,
    /// Load on each surface.
    pub loads: Vec<Load>,
}

/// What a case gave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outcome {
    /// The case.
    pub case: Case,
    /// The solver, as data are labelled with it.
    pub solver: String,
    /// How it was computed: [`method`] of the version that did.
    pub method: u32,
    /// The campaign's settings.
    pub settings: Settings,
    /// SHA-256 of the vehicle's hull and surfaces.
    pub hull_sha256: String,
    /// Kind of the mesh.
    pub mesh_kind: MeshKind,
    /// Cells of the mesh.
    pub cells: usize,
    /// Courant number of the attempt that held.
    pub courant: f64,
    /// Attempts, 1 or 2.
    pub attempts: u32,
    /// Time steps.
    pub steps: usize,
    /// Processor time of all programs of the attempt that held [s].
    pub core_s: f64,
    /// Windows computed until the mean had settled.
    pub windows: u32,
    /// True when it had, and for an unsteady case, which has no mean to settle.
    pub settled: bool,
    /// Change of the mean net force from the first to the second half of the last window, body frame [N].
    pub drift: [f64; 3],
    /// Mass that went in and did not come out over what went in, mean of the last window.
    pub mass_imbalance: f64,
    /// Load on each surface at rest on the mesh of the case.
    pub rest: Vec<Load>,
    /// Names of the surfaces.
    pub surfaces: Vec<String>,
    /// The flow ahead of the vehicle, where it was measured; `rest` and `drift` are then those of the measured water level.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<Measured>,
    /// The sections of the last window; of an unsteady case, from half a second before the ramp to the end.
    pub sections: Vec<Section>,
}

/// The flow that gauges ahead of the vehicle measured, means over the window.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// Depth at the body origin [m].
    pub depth_m: f64,
    /// Speed of the water relative to the vehicle [m/s].
    pub speed_mps: f64,
    /// Distance of the ground-contact plane from the bed under the body origin [m].
    pub bed_clearance_m: f64,
    /// Change of the dynamic force on each surface from the earlier window to the last one, at equal depth times speed squared
    /// [N].
    pub drift: Vec<[f64; 3]>,
}

/// How this version computes a case: raised whenever the same case with the same settings would come out otherwise.
///
/// 1: the gradient of the density was corrected for the tilt between cells of two sizes. 2: on castellated meshes it is
/// not, since the correction drives the air above still water. 3, of unsteady cases alone: the steps are as long as the
/// delay of the body force supposes.
pub fn method(case: &Case) -> u32 {
    if case.is_unsteady() { 3 } else { 2 }
}

/// Why a case gave nothing.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// A file that cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A program that failed.
    #[error("{program} failed after {seconds:.0} s: {last_lines} (whole log: {log})")]
    Program {
        /// Its name.
        program: &'static str,
        /// How long it ran.
        seconds: f64,
        /// The end of its log.
        last_lines: String,
        /// Its log.
        log: PathBuf,
    },
    /// A program that took too long.
    #[error(
        "{program} was ended after {seconds:.0} s of processor time, the limit of the settings (log: {log})"
    )]
    TooLong {
        /// Its name.
        program: &'static str,
        /// The limit of its processor time [s].
        seconds: f64,
        /// Its log.
        log: PathBuf,
    },
    /// The potential flow is absurd.
    #[error(
        "the potential flow reaches {speed:.1} m/s in an inflow of {inflow:.2} m/s: mesh or solver is broken"
    )]
    PotentialFlow {
        /// Largest speed [m/s].
        speed: f64,
        /// Inflow [m/s].
        inflow: f64,
    },
    /// The mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] PolyMeshError),
    /// A force file that cannot be read, or holds what is no number.
    #[error(transparent)]
    Forces(#[from] openfoam::OpenFoamError),
    /// A function object without moments.
    #[error("{path}: no moments were written")]
    NoMoments {
        /// Its folder.
        path: PathBuf,
    },
    /// Gauges that cannot be read.
    #[error(transparent)]
    Gauges(#[from] GaugeError),
    /// A force history that does not cover the window.
    #[error("{path}: {fault}")]
    History {
        /// The folder of the function object.
        path: PathBuf,
        /// What is wrong.
        fault: HistoryError,
    },
}

impl SolveError {
    /// True where smaller time steps may help: the solver gave up, wrote what is no number, or took too long, as it does
    /// where its adaptive steps collapse.
    pub fn is_divergence(&self) -> bool {
        matches!(self, Self::Program { program: "interFoam", .. } | Self::TooLong { .. } | Self::Forces(_))
    }
}

/// Computes the case of `campaign` whose files are in `folder`, which `claim` gives to this process alone.
pub fn solve(
    folder: &Path,
    claim: &Claim,
    campaign: &Campaign,
    inputs: &Inputs,
    attempts: u32,
) -> Result<Outcome, SolveError> {
    let placement = Placement::new(inputs.vehicle, inputs.case);
    let mut running = Running { folder, claim, inputs };
    running.program("blockMesh", &[])?;
    running.program("snappyHexMesh", &["-overwrite"])?;
    let hull = MeshHull::read(folder, inputs.vehicle, &placement)?;
    running.program("setFields", &[])?;
    running.start_flow(&placement)?;

    let settings = inputs.settings;
    let (mut windows, mut end) = (1, inputs.first_end(&placement));
    let still = inputs.case.condition(0.0, 0.0);
    let mut window = loop {
        running.program("interFoam", &[])?;
        let window = match &settings.flow_time {
            Some(time) => {
                Window::read_labelled(folder, inputs, &placement, &hull, inputs.windows(time, end))?
            }
            None => Window::read(folder, inputs, &placement, [inputs.window_start(end), end])?,
        };
        let rest = hull.at_rest(inputs.vehicle, &still);
        if settings.flow_time.is_some()
            || inputs.case.is_unsteady()
            || windows >= settings.windows
            || window.is_settled(&rest, settings.drift)
        {
            break window;
        }
        windows += 1;
        end += settings.window_s;
        let path = folder.join("system/controlDict");
        std::fs::write(&path, inputs.control(&placement, end - settings.window_s, end))
            .map_err(|source| io(&path, source))?;
    };
    let condition = window.measured.as_ref().map_or(still, |flow| Condition { depth: flow.depth_m, ..still });
    let rest = hull.at_rest(inputs.vehicle, &condition);
    let settled = match &window.measured {
        Some(_) => window.has_settled_flow(&rest, &inputs.case.up(), settings.drift),
        None => inputs.case.is_unsteady() || window.is_settled(&rest, settings.drift),
    };
    let (steps, core_s) = running.cost();
    Ok(Outcome {
        case: inputs.case.clone(),
        solver: inputs.solver.label(),
        method: method(inputs.case),
        settings: campaign.settings,
        hull_sha256: campaign.hull_sha256.clone(),
        mesh_kind: inputs.solver.mesh_kind,
        cells: hull.cells,
        courant: settings.courant,
        attempts,
        steps,
        core_s,
        windows,
        settled,
        drift: window.drift.into(),
        mass_imbalance: mass_imbalance(folder, window.from, end),
        rest: rest
            .iter()
            .map(|w| Load { force: w.force.into(), moment: w.moment.into(), viscous: [0.0; 3] })
            .collect(),
        surfaces: inputs.vehicle.surfaces.iter().map(|s| s.name.clone()).collect(),
        measured: window.measured.take(),
        sections: std::mem::take(&mut window.sections),
    })
}

fn io(path: &Path, source: std::io::Error) -> SolveError {
    SolveError::Io { path: path.to_owned(), source }
}

struct Running<'a> {
    folder: &'a Path,
    claim: &'a Claim,
    inputs: &'a Inputs<'a>,
}

/// Waits for a program; one that has taken more processor time than `limit_s` is ended, and none comes back. The time on a
/// busy machine does not count: a case must not fail for its neighbors. What waits without computing is not ended.
fn wait(child: &mut Child, limit_s: f64) -> std::io::Result<Option<ExitStatus>> {
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        // a program that ends in between has no clock any more
        if processor_s(child).is_some_and(|seconds| seconds > limit_s) {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Processor time that a child has taken [s].
fn processor_s(child: &Child) -> Option<f64> {
    let pid = Pid::from_raw(i32::try_from(child.id()).ok()?);
    let time = clock_gettime(clock_getcpuclockid(pid).ok()?).ok()?;
    Some(time.tv_sec() as f64 + 1e-9 * time.tv_nsec() as f64)
}

impl Running<'_> {
    /// Runs a program to its end; its log is appended to `log.<program>`.
    fn program(&mut self, program: &'static str, arguments: &[&str]) -> Result<(), SolveError> {
        let log = self.folder.join(format!("log.{program}"));
        let file = File::options().create(true).append(true).open(&log).map_err(|source| io(&log, source))?;
        let errors = file.try_clone().map_err(|source| io(&log, source))?;
        let mut command = self.inputs.solver.command(program);
        let stdin = self.claim.stdin().map_err(|source| io(self.folder, source))?;
        let command =
            command.args(arguments).current_dir(self.folder).stdin(stdin).stdout(file).stderr(errors);
        let mut child = command.spawn().map_err(|source| io(Path::new(program), source))?;
        if let Err(source) = self.claim.note(&child) {
            let _ = child.kill();
            let _ = child.wait();
            return Err(io(self.folder, source));
        }
        let limit = self.inputs.settings.limit(self.inputs.case.cell_scale);
        let started = Instant::now();
        let ended = wait(&mut child, limit).map_err(|source| io(Path::new(program), source))?;
        let Some(status) = ended else { return Err(SolveError::TooLong { program, seconds: limit, log }) };
        if status.success() {
            return Ok(());
        }
        let text =
            std::fs::read(&log).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).unwrap_or_default();
        let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let is_reason = |line: &&str| line.contains("FATAL") || line.contains("sigFpe");
        let from = lines.iter().rposition(is_reason).unwrap_or(lines.len().saturating_sub(3));
        let last_lines = lines[from..].iter().take(6).copied().collect::<Vec<_>>().join(" | ");
        Err(SolveError::Program { program, seconds: started.elapsed().as_secs_f64(), last_lines, log })
    }

    /// The potential flow round the vehicle, with the boundary conditions of the viscous flow.
    fn start_flow(&mut self, placement: &Placement) -> Result<(), SolveError> {
        let inflow = self.inputs.case.speed_mps;
        if inflow > 0.0 {
            self.program("potentialFoam", &[])?;
        }
        let path = self.folder.join("0/U");
        let text = std::fs::read_to_string(&path).map_err(|source| io(&path, source))?;
        let speeds = internal_vectors(&text).into_iter().map(|u| u[0].hypot(u[1]).hypot(u[2]));
        // NaN is larger than anything here: max() alone would drop it
        let speed = speeds.fold(0.0, |most, speed: f64| if speed <= most { most } else { speed });
        if inflow > 0.0 && (speed.is_nan() || speed > FASTEST * inflow) {
            return Err(SolveError::PotentialFlow { speed, inflow });
        }
        let head = text.split("boundaryField").next().unwrap_or_default();
        let text = head.to_owned() + &self.inputs.viscous_boundary(placement);
        std::fs::write(&path, text).map_err(|source| io(&path, source))?;
        let pressure = self.folder.join("0/p");
        std::fs::remove_file(&pressure).map_err(|source| io(&pressure, source))
    }

    /// Time steps, and processor time of all programs [s].
    fn cost(&self) -> (usize, f64) {
        let programs = ["blockMesh", "snappyHexMesh", "setFields", "potentialFoam", "interFoam"];
        let mut steps = 0;
        let mut core_s = 0.0;
        for program in programs {
            let text = std::fs::read(self.folder.join(format!("log.{program}"))).unwrap_or_default();
            let text = String::from_utf8_lossy(&text);
            if program == "interFoam" {
                steps = text.lines().filter(|line| line.starts_with("Time = ")).count();
            }
            core_s += processor_time(&text);
        }
        (steps, core_s)
    }
}

/// Sum over the runs in a log of the last `ExecutionTime` or `Finished meshing in` of each [s].
fn processor_time(log: &str) -> f64 {
    let (mut sum, mut last) = (0.0, 0.0);
    for line in log.lines() {
        let value =
            line.strip_prefix("ExecutionTime = ").or_else(|| line.strip_prefix("Finished meshing in = "));
        if let Some(seconds) = value.and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok()) {
            if seconds < last {
                sum += last;
            }
            last = seconds;
        }
    }
    sum + last
}

/// The last window of a case.
struct Window {
    from: f64,
    drift: Vec3,
    mean: Vec3,
    measured: Option<Measured>,
    sections: Vec<Section>,
}

impl Window {
    fn read(
        folder: &Path,
        inputs: &Inputs,
        placement: &Placement,
        [from, end]: [f64; 2],
    ) -> Result<Self, SolveError> {
        let count = ((end - from) / SECTION_S).round().max(1.0) as usize;
        // a window in lengths of the vehicle is seldom a whole number of tenths of a second
        let long = (end - from) / count as f64;
        let long = if (long - SECTION_S).abs() < 1e-6 { SECTION_S } else { long };
        let mut sections: Vec<Section> = (0..count)
            .map(|i| section(inputs, from + i as f64 * long, from + (i + 1) as f64 * long))
            .collect();
        let back = placement.cfd_from_body.inverse();
        for surface in &inputs.vehicle.surfaces {
            let post = folder.join("postProcessing").join(&surface.name);
            let history = openfoam::read(&post, CutOff::Refuse)?;
            let moments =
                history.moment.as_ref().ok_or_else(|| SolveError::NoMoments { path: post.clone() })?;
            for section in &mut sections {
                let mean = |history: &History<3>| -> Result<[f64; 3], SolveError> {
                    let mean = history.mean(section.start_s, section.end_s);
                    let mean = mean.map_err(|fault| SolveError::History { path: post.clone(), fault })?;
                    Ok((back * Vec3::from(mean)).into())
                };
                let load = Load {
                    force: mean(&history.force)?,
                    moment: mean(moments)?,
                    viscous: mean(&history.viscous)?,
                };
                section.loads.push(load);
            }
        }
        let half = sections.len() / 2;
        let mean = |sections: &[Section]| {
            let nets = sections.iter().map(|s| s.loads.iter().map(|l| Vec3::from(l.force)).sum::<Vec3>());
            nets.sum::<Vec3>() / sections.len().max(1) as f64
        };
        let drift = mean(&sections[half..]) - mean(&sections[..half]);
        Ok(Self { from, drift, mean: mean(&sections), measured: None, sections })
    }

    /// The last of two windows, with the flow that the gauges measured. Its drift is the change of the dynamic force since the
    /// earlier one, which is brought to the depth times speed squared of the last one.
    fn read_labelled(
        folder: &Path,
        inputs: &Inputs,
        placement: &Placement,
        hull: &MeshHull,
        [earlier, last]: [[f64; 2]; 2],
    ) -> Result<Self, SolveError> {
        let weight = inputs.case.density_kgpm3 * GRAVITY;
        let gauges = gauges::read(folder, weight)?;
        let dynamic = |window: &Self, depth: f64| -> Vec<Vec3> {
            let still = inputs.case.condition(0.0, 0.0);
            let rest = hull.at_rest(inputs.vehicle, &Condition { depth, ..still });
            let count = window.sections.len().max(1) as f64;
            let mean = |surface: usize| {
                window.sections.iter().map(|s| Vec3::from(s.loads[surface].force)).sum::<Vec3>() / count
            };
            rest.iter()
                .enumerate()
                .map(|(surface, rest): (usize, &Wrench)| mean(surface) - rest.force)
                .collect()
        };
        let labelled = |bounds: [f64; 2]| -> Result<_, SolveError> {
            let window = Self::read(folder, inputs, placement, bounds)?;
            let path = folder.join("postProcessing/gauges");
            let [rise, speed] =
                gauges.mean(bounds[0], bounds[1]).map_err(|fault| SolveError::History { path, fault })?;
            let flow = inputs.flow_at_vehicle(placement, rise, speed);
            let loads = dynamic(&window, flow.depth_m);
            Ok((window, flow, loads))
        };
        let (mut window, flow, loads) = labelled(last)?;
        let (_, before, loads_before) = labelled(earlier)?;
        let ratio = (flow.pressure / before.pressure).clamp(0.25, 4.0);
        let ratio = if ratio.is_nan() { 1.0 } else { ratio };
        let drift: Vec<Vec3> =
            loads.iter().zip(&loads_before).map(|(now, before)| now - before * ratio).collect();
        window.drift = drift.iter().sum();
        window.measured = Some(Measured {
            depth_m: flow.depth_m,
            speed_mps: flow.speed_mps,
            bed_clearance_m: placement.bed_clearance,
            drift: drift.iter().map(|drift| (*drift).into()).collect(),
        });
        Ok(window)
    }

    /// True when the halves differ by less than `share` of the dynamic force in every component, or by what no one
    /// can see beside the force at rest.
    fn is_settled(&self, rest: &[Wrench], share: f64) -> bool {
        let still: Vec3 = rest.iter().map(|w| w.force).sum();
        let dynamic = (self.mean - still).norm();
        self.drift.amax() <= share * dynamic.max(UNSEEN * still.norm())
    }
}

impl Window {
    /// True when two windows differ by less than `share` of the horizontal dynamic force, or by what no one can see beside the
    /// force at rest, and by less than `share` of the whole vertical force.
    fn has_settled_flow(&self, rest: &[Wrench], up: &Vec3, share: f64) -> bool {
        let still: Vec3 = rest.iter().map(|w| w.force).sum();
        let horizontal = |force: Vec3| (force - up * up.dot(&force)).norm();
        let least = UNSEEN * still.norm();
        horizontal(self.drift) <= share * horizontal(self.mean - still).max(least)
            && up.dot(&self.drift).abs() <= share * up.dot(&self.mean).abs()
    }
}

fn section(inputs: &Inputs, start_s: f64, end_s: f64) -> Section {
    let case = inputs.case;
    let settle = inputs.settings.settle(inputs.vehicle.dimensions.length, case.speed_mps);
    let middle = 0.5 * (start_s + end_s);
    let progress = if case.is_unsteady() { ((middle - settle) / case.ramp_s).clamp(0.0, 1.0) } else { 0.0 };
    let ramping = progress > 0.0 && progress < 1.0;
    let change = case.end_speed_mps - case.speed_mps;
    Section {
        start_s,
        end_s,
        speed_mps: case.speed_mps + progress * change,
        acceleration_mps2: if ramping { change / case.ramp_s } else { 0.0 },
        loads: Vec::new(),
    }
}

/// Mean of (inflow - outflow) over inflow; NaN never: 0 where nothing flows or nothing was recorded.
fn mass_imbalance(folder: &Path, start: f64, end: f64) -> f64 {
    let flow = |patch: &str| {
        let folder = folder.join("postProcessing").join(format!("mass_flow_{patch}"));
        let mut values = Vec::new();
        for run in std::fs::read_dir(&folder).ok()?.flatten() {
            let text = std::fs::read_to_string(run.path().join("surfaceFieldValue.dat")).ok()?;
            let rows = text.lines().filter_map(|line| {
                let mut numbers = line.split_ascii_whitespace().map(str::parse::<f64>);
                Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
            });
            values.extend(rows.filter(|(time, _)| *time > start && *time <= end).map(|(_, flow)| flow));
        }
        Some(values.iter().sum::<f64>() / values.len().max(1) as f64)
    };
    let flows: Option<Vec<f64>> =
        ["inlet_water", "inlet_air", "outlet", "top"].map(flow).into_iter().collect();
    let through_ramp = flow(RAMP_PATCH).unwrap_or(0.0);
    match flows {
        // flows out of the domain are positive
        Some(flows) if flows[0].abs() > 1e-9 => {
            (flows.iter().sum::<f64>() + through_ramp).abs() / flows[0].abs()
        }
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_program_is_ended_for_the_time_that_it_computes_and_not_for_that_in_which_it_waits() {
        let run = |script: &str| {
            wait(&mut std::process::Command::new("sh").args(["-c", script]).spawn().unwrap(), 0.1).unwrap()
        };
        assert!(run("sleep 0.4").is_some_and(|status| status.success()));
        assert_eq!(run("while :; do :; done"), None);
    }

    #[test]
    fn a_flow_has_settled_by_its_horizontal_and_its_vertical_force() {
        let force = |x: f64, z: f64| Vec3::new(x, 0.0, z);
        let rest = [Wrench { force: force(0.0, 200.0), moment: Vec3::zeros() }];
        let settles = |mean: Vec3, drift: Vec3| {
            let window = Window { from: 0.0, drift, mean, measured: None, sections: Vec::new() };
            window.has_settled_flow(&rest, &Vec3::z(), 0.05)
        };
        assert!(settles(force(-40.0, 150.0), force(1.9, 7.0)));
        assert!(!settles(force(-40.0, 150.0), force(2.1, 0.0)));
        assert!(!settles(force(-40.0, 150.0), force(0.0, 8.0)));
        assert!(settles(force(-1.0, 200.0), force(0.4, 0.0)), "half a newton beside 200 N");
    }

    #[test]
    fn processor_time_adds_up_over_restarts() {
        let log = "ExecutionTime = 3.5 s  ClockTime = 4 s\nExecutionTime = 9 s\nExecutionTime = 1 s\n";
        assert!((processor_time(log) - 10.0).abs() < 1e-12);
    }
}
