//! How much of the plan is computed, and how far it can be trusted: at rest against Archimedes, head-on against the
//! source paper, on finer and finer meshes, and the cases that look odd.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;

use super::collect::{self, CaseSummary, CollectError, Collected};
use super::foreword::foreword;
use super::plan::{Case, Plan, Set};
use crate::dataset::page;
use crate::dataset::summary::Summary;
use crate::page::PlotError;
use crate::published::{self, PaperDepth};
use crate::signal;
use wade_core::analytic;
use wade_core::condition::{Condition, GroundContact};
use wade_core::domain::Range;
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;

/// Water that may be lost before a case looks odd, as a share of what went in.
const MASS_LOSS: f64 = 0.25;
/// Median absolute deviations of the drag coefficient from the median that look odd.
const OUTLIER: f64 = 6.0;
/// A campaign seen from above.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Name of the vehicle.
    pub vehicle: String,
    /// The solver.
    pub provenance: String,
    /// Planned and computed cases of each set.
    pub sets: BTreeMap<String, Count>,
    /// Of the computed ones, those that this version would compute another way.
    pub outdated: usize,
    /// Processor time of all cases [h].
    pub core_hours: f64,
    /// Processor time of a case, median [s].
    pub core_s_median: f64,
    /// Cells of a case, least and most.
    pub cells: [usize; 2],
    /// Share of the cases whose mean had settled.
    pub settled: f64,
    /// Cases at rest.
    pub at_rest: Vec<AtRest>,
    /// Head-on cases in fresh water.
    pub head_on: Vec<HeadOn>,
    /// The same case on finer and finer meshes, then in a larger channel.
    pub meshes: Vec<OnMesh>,
    /// Driving twins against parked ones.
    pub twins: Option<Twins>,
    /// Cases that look odd.
    pub suspicious: Vec<Suspicious>,
}

/// Planned and computed cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Count {
    /// In the plan.
    pub planned: usize,
    /// Computed and collected.
    pub done: usize,
    /// Of these, with a mean that had settled.
    pub settled: usize,
}

/// Vertical force at rest [N].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AtRest {
    /// The case.
    pub id: String,
    /// Depth [m].
    pub depth_m: f64,
    /// The solver's pressure integral.
    pub computed_n: f64,
    /// Archimedes on the same mesh.
    pub mesh_n: f64,
    /// Archimedes on the vehicle's own hull, no water under the tires.
    pub hull_dry_n: f64,
    /// Archimedes on the vehicle's own hull, water under the tires.
    pub hull_wetted_n: f64,
}

/// Drag of a head-on case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeadOn {
    /// The case.
    pub id: String,
    /// Depth [m].
    pub depth_m: f64,
    /// Speed [m/s].
    pub speed_mps: f64,
    /// `-Fx / v^2` [N s2/m2].
    pub c: f64,
    /// The paper's, where it has this vehicle at this depth; other data.
    pub paper_c: Option<f64>,
}

/// One case on one mesh in one channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OnMesh {
    /// The case.
    pub id: String,
    /// Size of the cells relative to the campaign's.
    pub cell_scale: f64,
    /// Size of the channel relative to the campaign's.
    pub channel_scale: f64,
    /// Cells.
    pub cells: usize,
    /// Longitudinal force [N].
    pub fx_n: f64,
    /// Vertical force [N].
    pub fz_n: f64,
    /// The same at rest on this mesh [N].
    pub rest_fz_n: f64,
}

/// Driving against parked, over the pairs of the driving set that have both settled.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Twins {
    /// Pairs.
    pub pairs: usize,
    /// Median ratio of the drag along the motion, driving over parked.
    pub drag_ratio: f64,
    /// Median difference of the vertical force, driving minus parked, over the dynamic pressure on the wet front
    /// `rho v^2 / 2 * breadth * depth`, as broad as the box round the vehicle is along the motion.
    pub lift_difference: f64,
}

/// A case that looks odd.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Suspicious {
    /// The case.
    pub id: String,
    /// Why.
    pub why: String,
}

impl Report {
    /// Reads what was collected.
    pub fn of(folder: &Path, plan: &Plan, vehicle: &Vehicle) -> Result<Self, CollectError> {
        let collected = Collected::read(folder, plan)?;
        let cases: Vec<&CaseSummary> = collected.cases.values().collect();
        if cases.is_empty() {
            return Err(CollectError::Nothing { path: folder.to_owned() });
        }
        let done: Vec<(&Case, &CaseSummary)> =
            plan.cases.iter().filter_map(|case| Some((case, collected.cases.get(&case.id)?))).collect();
        let mut sets: BTreeMap<String, Count> = BTreeMap::new();
        for case in &plan.cases {
            let count = sets.entry(case.set.to_string()).or_default();
            count.planned += 1;
            let summary = collected.cases.get(&case.id);
            count.done += usize::from(summary.is_some());
            count.settled += usize::from(summary.is_some_and(|summary| summary.settled));
        }
        let least = cases.iter().map(|case| case.cells).min().unwrap_or(0);
        let most = cases.iter().map(|case| case.cells).max().unwrap_or(0);
        Ok(Self {
            vehicle: vehicle.name.clone(),
            provenance: collect::dataset(folder, plan, &collected)?.meta.provenance,
            sets,
            outdated: done.iter().filter(|(case, summary)| summary.is_outdated(case)).count(),
            core_hours: cases.iter().map(|case| case.core_s).sum::<f64>() / 3600.0,
            core_s_median: median(cases.iter().map(|case| case.core_s)),
            cells: [least, most],
            settled: cases.iter().filter(|case| case.settled).count() as f64 / cases.len() as f64,
            at_rest: of_set(&cases, Set::Check)
                .filter(|c| c.speed_mps == 0.0)
                .map(|c| at_rest(vehicle, c))
                .collect(),
            head_on: straight_ahead(&cases).into_iter().map(|c| head_on(vehicle, c)).collect(),
            meshes: meshes(&cases),
            twins: twins(&collected, vehicle),
            suspicious: suspicious(&done, vehicle),
        })
    }

    /// For a terminal.
    pub fn text(&self) -> String {
        let mut text = format!("{}: {}\n", self.vehicle, self.provenance);
        let mut line = |arguments: std::fmt::Arguments<'_>| {
            // writing to a String cannot fail
            let _ = writeln!(text, "{arguments}");
        };
        for (set, count) in &self.sets {
            let Count { planned, done, settled } = count;
            line(format_args!("  {set:<9} {done} of {planned} cases, {settled} settled"));
        }
        if self.outdated > 0 {
            line(format_args!(
                "  {} of them are of an older method: `wade campaign run --outdated` computes them again",
                self.outdated
            ));
        }
        let [least, most] = self.cells;
        line(format_args!(
            "  {least} to {most} cells, {:.0} s of a core a case, {:.1} h in all, {:.0} % settled",
            self.core_s_median,
            self.core_hours,
            100.0 * self.settled
        ));
        for rest in &self.at_rest {
            let error = 100.0 * (rest.computed_n / rest.mesh_n - 1.0);
            line(format_args!(
                "  at rest, {:.3} m: {:.1} N computed, {:.1} N by Archimedes on the mesh ({error:+.1} %), hull {:.1} dry, {:.1} wetted",
                rest.depth_m, rest.computed_n, rest.mesh_n, rest.hull_dry_n, rest.hull_wetted_n
            ));
        }
        for case in &self.head_on {
            let paper = case.paper_c.map_or_else(String::new, |c| {
                format!(", published, different data: {c:.1} ({:+.0} %)", 100.0 * (case.c / c - 1.0))
            });
            line(format_args!(
                "  head-on, {:.3} m, {:.2} m/s: C = -Fx / v2 = {:.1} N s2/m2{paper}",
                case.depth_m, case.speed_mps, case.c
            ));
        }
        for mesh in &self.meshes {
            line(format_args!(
                "  mesh, cells x {:.2}, channel x {:.2}: {} cells, Fx {:.2} N, Fz {:.1} N ({:.1} at rest)",
                mesh.cell_scale, mesh.channel_scale, mesh.cells, mesh.fx_n, mesh.fz_n, mesh.rest_fz_n
            ));
        }
        if let Some(twins) = &self.twins {
            line(format_args!(
                "  driving over parked, {} settled pairs: drag x {:.3}, lift {:+.3} of the dynamic pressure on the wet front",
                twins.pairs, twins.drag_ratio, twins.lift_difference
            ));
        }
        for case in &self.suspicious {
            line(format_args!("  look at {}: {}", case.id, case.why));
        }
        text
    }

    /// The same with plots, as a page of its own.
    pub fn page(&self, folder: &Path, plan: &Plan, vehicle: &Vehicle) -> Result<String, PageError> {
        let dataset = collect::dataset(folder, plan, &Collected::read(folder, plan)?)?;
        let kinds: BTreeMap<String, String> = vehicle
            .surfaces
            .iter()
            .map(|surface| (surface.name.clone(), surface.kind.name().to_owned()))
            .collect();
        let summary = Summary::of(&dataset, &|_, surface| kinds.get(surface).cloned());
        let title = format!("CFD campaign: {}", self.vehicle);
        Ok(page::page_with(&title, &foreword(self), &summary)?)
    }
}

/// Why there is no page.
#[derive(Debug, thiserror::Error)]
pub enum PageError {
    /// What was collected.
    #[error(transparent)]
    Collected(#[from] CollectError),
    /// A plot.
    #[error(transparent)]
    Plot(#[from] PlotError),
}

fn of_set<'a>(cases: &'a [&CaseSummary], set: Set) -> impl Iterator<Item = &'a CaseSummary> {
    cases.iter().copied().filter(move |case| case.set == set)
}

fn at_rest(vehicle: &Vehicle, case: &CaseSummary) -> AtRest {
    let hull = |ground_contact| {
        let level = Condition::level(Vec3::zeros(), case.depth_m);
        let condition = Condition { density: case.density_kgpm3, ground_contact, ..level };
        analytic::loads(vehicle, &condition).iter().map(|force| force.z).sum()
    };
    AtRest {
        id: case.id.clone(),
        depth_m: case.depth_m,
        computed_n: case.fz_n,
        mesh_n: case.rest_fz_n,
        hull_dry_n: hull(GroundContact::Dry),
        hull_wetted_n: hull(GroundContact::Wetted),
    }
}

fn head_on(vehicle: &Vehicle, case: &CaseSummary) -> HeadOn {
    let is_the_papers = |depth: &&PaperDepth| {
        vehicle.name == published::VEHICLE && (depth.depth_m - case.depth_m).abs() < 1e-3
    };
    HeadOn {
        id: case.id.clone(),
        depth_m: case.depth_m,
        speed_mps: case.speed_mps,
        c: -case.fx_n / case.speed_mps.powi(2),
        paper_c: published::DEPTHS.iter().find(is_the_papers).map(|depth| depth.c_d_eff),
    }
}

/// Cases straight ahead on the campaign's mesh, by depth and speed.
fn straight_ahead<'a>(cases: &'a [&CaseSummary]) -> Vec<&'a CaseSummary> {
    let both = of_set(cases, Set::Check).chain(of_set(cases, Set::Ahead));
    let mut ahead: Vec<&CaseSummary> = both.filter(|c| c.speed_mps > 0.0 && c.cell_scale == 1.0).collect();
    ahead.sort_by(|a, b| a.depth_m.total_cmp(&b.depth_m).then(a.speed_mps.total_cmp(&b.speed_mps)));
    ahead
}

/// The check case that was computed on several meshes, coarsest first, and in a larger channel.
fn meshes(cases: &[&CaseSummary]) -> Vec<OnMesh> {
    let all = || [Set::Check, Set::Mesh, Set::Ahead].into_iter().flat_map(|set| of_set(cases, set));
    let Some(first) = all().find(|case| case.cell_scale != 1.0) else { return Vec::new() };
    let same = |case: &&CaseSummary| {
        case.speed_mps == first.speed_mps && (case.depth_m - first.depth_m).abs() < 1e-9
    };
    let mut all: Vec<&CaseSummary> = all().filter(same).collect();
    let order = |case: &CaseSummary| (case.channel_scale, -case.cell_scale);
    all.sort_by(|a, b| order(a).partial_cmp(&order(b)).unwrap_or(std::cmp::Ordering::Equal));
    let row = |case: &CaseSummary| OnMesh {
        id: case.id.clone(),
        cell_scale: case.cell_scale,
        channel_scale: case.channel_scale,
        cells: case.cells,
        fx_n: case.fx_n,
        fz_n: case.fz_n,
        rest_fz_n: case.rest_fz_n,
    };
    all.into_iter().map(row).collect()
}

/// Force against the motion [N].
fn drag(case: &CaseSummary) -> f64 {
    let (sin, cos) = case.heading_deg.to_radians().sin_cos();
    -(case.fx_n * cos + case.fy_n * sin)
}

/// Dynamic pressure on the box round the vehicle, seen along the motion, up to the water level [N].
fn scale(case: &CaseSummary, vehicle: &Vehicle) -> f64 {
    let (sin, cos) = case.heading_deg.to_radians().sin_cos();
    let breadth = vehicle.dimensions.width * cos.abs() + vehicle.dimensions.length * sin.abs();
    0.5 * case.density_kgpm3 * case.speed_mps.powi(2) * breadth * case.depth_m
}

fn twins(collected: &Collected, vehicle: &Vehicle) -> Option<Twins> {
    let pairs: Vec<(&CaseSummary, &CaseSummary)> = collected
        .cases
        .values()
        .filter_map(|driving| Some((driving, collected.settled_twin(driving)?)))
        .collect();
    (!pairs.is_empty()).then(|| Twins {
        pairs: pairs.len(),
        drag_ratio: median(pairs.iter().map(|(driving, parked)| drag(driving) / drag(parked))),
        lift_difference: median(
            pairs.iter().map(|(driving, parked)| (driving.fz_n - parked.fz_n) / scale(driving, vehicle)),
        ),
    })
}

fn suspicious(cases: &[(&Case, &CaseSummary)], vehicle: &Vehicle) -> Vec<Suspicious> {
    // slow cases have coefficients of noise, and of a tilted one buoyancy is part of the force along the body's axes
    let fast = |case: &Case| case.speed_mps > 0.1 && case.is_level() && !case.is_unsteady();
    let coefficient = |case: &CaseSummary| drag(case) / scale(case, vehicle);
    let usual: Vec<f64> =
        cases.iter().filter(|(case, _)| fast(case)).map(|(_, case)| coefficient(case)).collect();
    let middle = median(usual.iter().copied());
    let deviation = median(usual.iter().map(|c| (c - middle).abs()));
    let usual = Range { min: middle - OUTLIER * deviation, max: middle + OUTLIER * deviation };
    let mut found = Vec::new();
    for (state, case) in cases {
        let mut note = |why: String| found.push(Suspicious { id: case.id.clone(), why });
        if case.attempts > 1 {
            note(format!("it diverged once and was computed with Courant {:.1}", case.courant));
        }
        if case.mass_imbalance > MASS_LOSS {
            note(format!("inflow and outflow differ by {:.0} %", 100.0 * case.mass_imbalance));
        }
        if fast(state) {
            let c = coefficient(case);
            if c < usual.min || c > usual.max {
                note(format!(
                    "drag coefficient {c:.2} on the wet front, usual are {:.2} to {:.2}",
                    usual.min, usual.max
                ));
            }
        }
        if !case.settled {
            let drift = case.drift_fx_n.abs().max(case.drift_fy_n.abs()).max(case.drift_fz_n.abs());
            note(format!("the mean still drifts by {drift:.1} N"));
        }
    }
    found
}

/// The median; 0 of nothing.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    signal::median(&mut values.collect::<Vec<_>>()).unwrap_or(0.0)
}
