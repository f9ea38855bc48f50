//! Outcomes of cases to what is kept of a campaign: `sections.parquet`, the data set, and `cases.csv`, a row a case.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::backwater;
use super::means::{Means, SURFACES_FILE};
use super::plan::{Bed, CAMPAIGN_FILE, Case, Ground, Plan, Set, as_set};
use super::run::{RunError, Work};
use super::solve::{Load, Measured, Outcome, method};
use crate::dataset::{self, Dataset, DatasetError, Image, Meta, Rest, Sample, SurfaceLoad};
use crate::files::write_whole;
use wade_core::condition::GroundContact;
use wade_core::digest::sha256;
use wade_core::frame::Vec3;
use wade_core::vehicle::Vehicle;

/// File of the data set in the folder of the campaign.
pub const SECTIONS_FILE: &str = "sections.parquet";
/// File of the summaries.
pub const CASES_FILE: &str = "cases.csv";

/// The method of summaries from before methods had a number.
fn first_method() -> u32 {
    1
}

/// What is kept of a case beside its sections.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CaseSummary {
    /// Its name.
    pub id: String,
    /// What it is for.
    pub set: Set,
    /// First half of the SHA-256 of its row in the plan, so that a row that was edited since is noticed.
    pub state: String,
    /// What the bed does.
    pub bed: Bed,
    /// Speed, of an unsteady case at the start [m/s].
    pub speed_mps: f64,
    /// Heading [degrees].
    pub heading_deg: f64,
    /// Depth [m].
    pub depth_m: f64,
    /// Density [kg/m3].
    pub density_kgpm3: f64,
    /// Size of the cells relative to the settings.
    pub cell_scale: f64,
    /// How it was computed, see [`method`].
    #[serde(default = "first_method")]
    pub method: u32,
    /// Cells of the mesh.
    pub cells: usize,
    /// Time steps.
    pub steps: usize,
    /// Processor time [s].
    pub core_s: f64,
    /// Attempts.
    pub attempts: u32,
    /// Courant number of the attempt that held.
    pub courant: f64,
    /// End of the last section [s].
    pub end_s: f64,
    /// Windows that were computed.
    pub windows: u32,
    /// True where the mean had settled.
    pub settled: bool,
    /// Mean net force over the last window, body frame [N].
    pub fx_n: f64,
    /// See `fx_n`.
    pub fy_n: f64,
    /// See `fx_n`.
    pub fz_n: f64,
    /// Net force at rest on the mesh of the case, along body z [N].
    pub rest_fz_n: f64,
    /// Standard deviation of the sections about their mean [N].
    pub scatter_fx_n: f64,
    /// See `scatter_fx_n`.
    pub scatter_fy_n: f64,
    /// See `scatter_fx_n`.
    pub scatter_fz_n: f64,
    /// Change of the mean from the first to the second half of the window [N].
    pub drift_fx_n: f64,
    /// See `drift_fx_n`.
    pub drift_fy_n: f64,
    /// See `drift_fx_n`.
    pub drift_fz_n: f64,
    /// Mass that went in and did not come out over the water that went in.
    pub mass_imbalance: f64,
    /// Size of the channel relative to the settings.
    #[serde(default = "super::plan::as_set")]
    pub channel_scale: f64,
    /// Form of the bed; this and what follows only where the flow was measured.
    #[serde(default)]
    pub ground: Option<Ground>,
    /// Velocity of the bed over that of the water far away, both relative to the vehicle.
    #[serde(default)]
    pub bed_share: Option<f64>,
    /// Roll [degrees].
    #[serde(default)]
    pub roll_deg: Option<f64>,
    /// Pitch [degrees].
    #[serde(default)]
    pub pitch_deg: Option<f64>,
    /// Distance of the ground-contact plane from the bed under the body origin [m].
    #[serde(default)]
    pub bed_clearance_m: Option<f64>,
    /// Depth at the body origin that the gauges measured [m].
    #[serde(default)]
    pub measured_depth_m: Option<f64>,
    /// Speed of the water relative to the vehicle that the gauges measured [m/s].
    #[serde(default)]
    pub measured_speed_mps: Option<f64>,
}

impl CaseSummary {
    /// True where this version would compute the case of this summary another way.
    pub fn is_outdated(&self, case: &Case) -> bool {
        self.method < method(case)
    }

    /// Summary of an outcome.
    pub fn of(outcome: &Outcome) -> Self {
        let nets: Vec<Vec3> = outcome.sections.iter().map(|section| net(&section.loads)).collect();
        let count = nets.len().max(1) as f64;
        let mean = nets.iter().sum::<Vec3>() / count;
        let variance = nets.iter().map(|f| (f - mean).component_mul(&(f - mean))).sum::<Vec3>() / count;
        let scatter = variance.map(f64::sqrt);
        let case = &outcome.case;
        let summary = Self {
            id: case.id.clone(),
            set: case.set,
            state: state_hash(case),
            bed: case.bed,
            speed_mps: case.speed_mps,
            heading_deg: case.heading_deg,
            depth_m: case.depth_m,
            density_kgpm3: case.density_kgpm3,
            cell_scale: case.cell_scale,
            method: outcome.method,
            cells: outcome.cells,
            steps: outcome.steps,
            core_s: outcome.core_s,
            attempts: outcome.attempts,
            courant: outcome.courant,
            end_s: outcome.sections.last().map_or(0.0, |section| section.end_s),
            windows: outcome.windows,
            settled: outcome.settled,
            fx_n: mean.x,
            fy_n: mean.y,
            fz_n: mean.z,
            rest_fz_n: net(&outcome.rest).z,
            scatter_fx_n: scatter.x,
            scatter_fy_n: scatter.y,
            scatter_fz_n: scatter.z,
            drift_fx_n: outcome.drift[0],
            drift_fy_n: outcome.drift[1],
            drift_fz_n: outcome.drift[2],
            mass_imbalance: outcome.mass_imbalance,
            channel_scale: case.channel_scale,
            ground: None,
            bed_share: None,
            roll_deg: None,
            pitch_deg: None,
            bed_clearance_m: None,
            measured_depth_m: None,
            measured_speed_mps: None,
        };
        let summary = summary.shortened();
        match &outcome.measured {
            Some(flow) => summary.with_flow(case, flow),
            None => summary,
        }
    }

    /// The same with numbers as long as they can be told apart.
    fn shortened(self) -> Self {
        Self {
            fx_n: to_four_places(self.fx_n),
            fy_n: to_four_places(self.fy_n),
            fz_n: to_four_places(self.fz_n),
            rest_fz_n: to_four_places(self.rest_fz_n),
            scatter_fx_n: to_four_places(self.scatter_fx_n),
            scatter_fy_n: to_four_places(self.scatter_fy_n),
            scatter_fz_n: to_four_places(self.scatter_fz_n),
            drift_fx_n: to_four_places(self.drift_fx_n),
            drift_fy_n: to_four_places(self.drift_fy_n),
            drift_fz_n: to_four_places(self.drift_fz_n),
            core_s: to_four_places(self.core_s),
            mass_imbalance: to_four_places(self.mass_imbalance),
            end_s: to_four_places(self.end_s),
            ..self
        }
    }

    /// The same with the flow that was measured.
    fn with_flow(self, case: &Case, flow: &Measured) -> Self {
        Self {
            ground: Some(case.ground),
            bed_share: Some(case.share_of_bed()),
            roll_deg: Some(case.roll_deg),
            pitch_deg: Some(case.pitch_deg),
            bed_clearance_m: Some(to_four_places(flow.bed_clearance_m)),
            measured_depth_m: Some(to_four_places(flow.depth_m)),
            measured_speed_mps: Some(to_four_places(flow.speed_mps)),
            ..self
        }
    }
}

/// To 0.0001 of the unit.
fn to_four_places(value: f64) -> f64 {
    // never -0
    (1e4 * value).round() / 1e4 + 0.0
}

fn net(loads: &[Load]) -> Vec3 {
    loads.iter().map(|load| Vec3::from(load.force)).sum()
}

/// First half of the SHA-256 of a case's row in the plan as JSON. What differs from
/// the default is a part of it from `channel_scale` on: the first data sets were computed before a case had these.
pub fn state_hash(case: &Case) -> String {
    #[derive(Serialize)]
    struct Hashed<'a> {
        id: &'a str,
        set: Set,
        speed_mps: f64,
        heading_deg: f64,
        depth_m: f64,
        density_kgpm3: f64,
        roll_deg: f64,
        pitch_deg: f64,
        bed: Bed,
        cell_scale: f64,
        end_speed_mps: f64,
        ramp_s: f64,
        #[serde(skip_serializing_if = "Option::is_none")]
        channel_scale: Option<f64>,
        #[serde(skip_serializing_if = "Option::is_none")]
        bed_share: Option<f64>,
        #[serde(skip_serializing_if = "Option::is_none")]
        clearance_m: Option<f64>,
        #[serde(skip_serializing_if = "Option::is_none")]
        ground: Option<Ground>,
    }
    let hashed = Hashed {
        id: &case.id,
        set: case.set,
        speed_mps: case.speed_mps,
        heading_deg: case.heading_deg,
        depth_m: case.depth_m,
        density_kgpm3: case.density_kgpm3,
        roll_deg: case.roll_deg,
        pitch_deg: case.pitch_deg,
        bed: case.bed,
        cell_scale: case.cell_scale,
        end_speed_mps: case.end_speed_mps,
        ramp_s: case.ramp_s,
        channel_scale: Some(case.channel_scale).filter(|scale| *scale != as_set()),
        bed_share: case.bed_share,
        clearance_m: Some(case.clearance_m).filter(|clearance| *clearance != 0.0),
        ground: Some(case.ground).filter(|ground| *ground != Ground::default()),
    };
    let text = serde_json::to_string(&hashed).expect("numbers and names are JSON");
    sha256(text.as_bytes())[..32].to_owned()
}

/// Why a campaign could not be collected.
#[derive(Debug, thiserror::Error)]
pub enum CollectError {
    /// A bundle with other surfaces than the data set.
    #[error(transparent)]
    Surfaces(#[from] dataset::label::OtherSurfaces),
    /// A file that cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Summaries that do not parse.
    #[error("{path}: {message}")]
    Syntax {
        /// The file.
        path: PathBuf,
        /// Where and what.
        message: String,
    },
    /// A row of the plan that was edited after its case was computed.
    #[error(
        "{path}: case `{id}` was computed for another state than the plan has now: bring the old row back, or give the new one a name of its own"
    )]
    Edited {
        /// The summaries.
        path: PathBuf,
        /// The case.
        id: String,
    },
    /// Cases of two kinds, which are not one data set.
    #[error(
        "{path}: was computed {what} {before}, and case `{id}` {what} {now}: begin another campaign for the one or the other, `wade dataset merge` joins their data sets"
    )]
    Mixed {
        /// The data set.
        path: PathBuf,
        /// `by` a solver or `with the settings`.
        what: &'static str,
        /// Those of the data set.
        before: String,
        /// The case that differs.
        id: String,
        /// Its own.
        now: String,
    },
    /// A data set and summaries that are not of the same cases: what is added to one would go on without the other.
    #[error(
        "{sections} and {cases} do not belong together: {what}: restore what was there, or remove both and collect again from the work folder"
    )]
    Apart {
        /// The data set.
        sections: PathBuf,
        /// The summaries.
        cases: PathBuf,
        /// What is missing, and where.
        what: String,
    },
    /// Nothing is done yet.
    #[error("{path}: no case is done yet: `wade campaign run` computes them")]
    Nothing {
        /// The folder of the campaign.
        path: PathBuf,
    },
    /// The data set.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The outcomes.
    #[error(transparent)]
    Outcomes(#[from] RunError),
}

/// What has been collected of a campaign.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Collected {
    /// One summary a case, by its name.
    pub cases: BTreeMap<String, CaseSummary>,
}

impl Collected {
    /// Reads the summaries of a campaign; none where nothing was collected yet.
    pub fn read(folder: &Path, plan: &Plan) -> Result<Self, CollectError> {
        let path = folder.join(CASES_FILE);
        if !path.exists() {
            return Ok(Self::default());
        }
        let syntax =
            |error: csv::Error| CollectError::Syntax { path: path.clone(), message: error.to_string() };
        let mut reader = csv::Reader::from_path(&path).map_err(syntax)?;
        let rows: Vec<CaseSummary> = reader.deserialize().collect::<Result<_, _>>().map_err(syntax)?;
        let planned: BTreeMap<&str, &Case> = plan.cases.iter().map(|case| (case.id.as_str(), case)).collect();
        for row in &rows {
            if planned.get(row.id.as_str()).is_none_or(|case| state_hash(case) != row.state) {
                return Err(CollectError::Edited { path, id: row.id.clone() });
            }
        }
        Ok(Self { cases: rows.into_iter().map(|row| (row.id.clone(), row)).collect() })
    }

    /// The same state over a parked bed as a case over a driving one, where both flows have settled.
    pub fn settled_twin(&self, driving: &CaseSummary) -> Option<&CaseSummary> {
        let state = |case: &CaseSummary| {
            let CaseSummary {
                speed_mps, heading_deg, depth_m, density_kgpm3, cell_scale, channel_scale, ..
            } = *case;
            [speed_mps, heading_deg, depth_m, density_kgpm3, cell_scale, channel_scale]
        };
        let is_twin = |case: &&CaseSummary| Set::TWINNED.contains(&case.set) && state(case) == state(driving);
        let parked = self.cases.values().find(is_twin)?;
        (driving.set == Set::Driving && driving.settled && parked.settled).then_some(parked)
    }

    fn write(&self, folder: &Path) -> Result<(), CollectError> {
        let path = folder.join(CASES_FILE);
        let syntax = |message: String| CollectError::Syntax { path: path.clone(), message };
        let mut writer = csv::Writer::from_writer(Vec::new());
        for case in self.cases.values() {
            writer.serialize(case).map_err(|error| syntax(error.to_string()))?;
        }
        let bytes = writer.into_inner().map_err(|error| syntax(error.to_string()))?;
        write_whole(&path, &bytes).map_err(|source| CollectError::Io { path: path.clone(), source })
    }
}

/// The data set of a campaign: its sections, or its means as a sample a case.
pub fn dataset(folder: &Path, plan: &Plan, collected: &Collected) -> Result<Dataset, CollectError> {
    if plan.campaign.settings.flow_time.is_none() {
        return Ok(dataset::read(&folder.join(SECTIONS_FILE))?);
    }
    let means = Means::read(folder)?.ok_or_else(|| CollectError::Nothing { path: folder.to_owned() })?;
    means.dataset(folder, plan, &collected.cases)
}

/// The same in the flow ahead of the vehicle, also where no gauge measured it.
pub fn dataset_ahead(
    folder: &Path,
    plan: &Plan,
    vehicle: &Vehicle,
    collected: &Collected,
) -> Result<Dataset, CollectError> {
    let mut data = dataset(folder, plan, collected)?;
    if plan.campaign.settings.flow_time.is_none() {
        backwater::state_ahead(&mut data, plan, vehicle)?;
    }
    Ok(data)
}

/// Adds the outcomes of `work` to the data set and the summaries in `folder`; gives the number of new cases.
///
/// A case that was collected before and was computed again since, by a newer method, is replaced.
pub fn collect(folder: &Path, plan: &Plan, vehicle: &Vehicle, work: &Work) -> Result<usize, CollectError> {
    // one after the other: each adds to what it has read
    let path = folder.join(CAMPAIGN_FILE);
    let campaign = File::open(&path).and_then(|file| file.lock().map(|()| file));
    let _alone = campaign.map_err(|source| CollectError::Io { path, source })?;
    let mut collected = Collected::read(folder, plan)?;
    let mut fresh = Vec::new();
    for case in &plan.cases {
        let before = collected.cases.get(&case.id).map_or(0, |summary| summary.method);
        fresh.extend(work.outcome(&plan.campaign, case)?.filter(|outcome| outcome.method > before));
    }
    if plan.campaign.settings.flow_time.is_some() {
        return collect_means(folder, plan, vehicle, &fresh, collected);
    }
    let so_far = data_so_far(folder, &collected, &fresh)?;
    if fresh.is_empty() {
        return if collected.cases.is_empty() {
            Err(CollectError::Nothing { path: folder.to_owned() })
        } else {
            Ok(0)
        };
    }
    let path = folder.join(SECTIONS_FILE);
    let mut dataset = so_far.unwrap_or_else(|| empty(plan, vehicle, &fresh[0]));
    check_alike(&path, plan, &dataset, &fresh)?;
    let replaced: BTreeSet<&str> = fresh.iter().map(|outcome| outcome.case.id.as_str()).collect();
    dataset.samples.retain(|sample| !replaced.contains(sample.case.as_str()));
    for outcome in &fresh {
        collected.cases.insert(outcome.case.id.clone(), CaseSummary::of(outcome));
        dataset.samples.extend(samples(&plan.campaign.vehicle, outcome));
    }
    dataset.samples.sort_by(|a, b| a.case.cmp(&b.case).then(a.section.cmp(&b.section)));
    // the data set first: a summary without its sections would never be computed again
    dataset::write_compact(&path, &dataset)?;
    collected.write(folder)?;
    Ok(fresh.len())
}

/// As [`collect`], for a campaign of which means are kept.
fn collect_means(
    folder: &Path,
    plan: &Plan,
    vehicle: &Vehicle,
    fresh: &[Outcome],
    mut collected: Collected,
) -> Result<usize, CollectError> {
    let (path, cases) = (folder.join(SURFACES_FILE), folder.join(CASES_FILE));
    let so_far = Means::read(folder)?;
    let there = so_far.as_ref().map(Means::cases).unwrap_or_default();
    let unknown = there.iter().find(|id| !collected.cases.contains_key(**id) && !is_fresh(fresh, id));
    let what = match (lacking(&there, &collected, fresh), unknown) {
        (Some(id), _) => Some(format!("{SURFACES_FILE} has no row of case `{id}`")),
        (None, Some(id)) => Some(format!("{CASES_FILE} has no row for case `{id}`")),
        (None, None) => None,
    };
    if let Some(what) = what {
        return Err(CollectError::Apart { sections: path, cases, what });
    }
    let Some(first) = fresh.first() else {
        return match collected.cases.is_empty() {
            true => Err(CollectError::Nothing { path: folder.to_owned() }),
            false => Ok(0),
        };
    };
    let meta = so_far.as_ref().map_or_else(|| empty(plan, vehicle, first).meta, |means| means.meta.clone());
    let dataset = Dataset { meta, samples: Vec::new() };
    check_alike(&path, plan, &dataset, fresh)?;
    let mut means = Means { meta: dataset.meta, rows: so_far.map_or_else(Vec::new, |means| means.rows) };
    means.add(fresh);
    collected.cases.extend(fresh.iter().map(|outcome| (outcome.case.id.clone(), CaseSummary::of(outcome))));
    // the means first: a summary without its surfaces would never be computed again
    means.write(folder)?;
    collected.write(folder)?;
    Ok(fresh.len())
}

/// The data set so far, if there is one. Refuses one that does not hold the cases of the summaries.
fn data_so_far(
    folder: &Path,
    collected: &Collected,
    fresh: &[Outcome],
) -> Result<Option<Dataset>, CollectError> {
    let (sections, cases) = (folder.join(SECTIONS_FILE), folder.join(CASES_FILE));
    let dataset = sections.exists().then(|| dataset::read(&sections));
    let what = match &dataset {
        Some(Err(DatasetError { fault, .. })) => Some(format!("{SECTIONS_FILE} cannot be read ({fault})")),
        Some(Ok(dataset)) => difference(&dataset.samples, collected, fresh, cases.exists()),
        None => lacking(&BTreeSet::new(), collected, fresh).map(|_| format!("{SECTIONS_FILE} is missing")),
    };
    match what {
        Some(what) => Err(CollectError::Apart { sections, cases, what }),
        None => Ok(dataset.transpose()?),
    }
}

/// What a data set and the summaries do not have in common.
fn difference(
    samples: &[Sample],
    collected: &Collected,
    fresh: &[Outcome],
    has_summaries: bool,
) -> Option<String> {
    let there: BTreeSet<&str> = samples.iter().map(|sample| sample.case.as_str()).collect();
    if let Some(id) = lacking(&there, collected, fresh) {
        return Some(format!("{SECTIONS_FILE} has no section of case `{id}`"));
    }
    let is_known = |id: &str| collected.cases.contains_key(id) || is_fresh(fresh, id);
    let unknown = there.into_iter().find(|&id| !is_known(id))?;
    Some(match has_summaries {
        true => format!("{CASES_FILE} has no row for case `{unknown}`"),
        false => format!("{CASES_FILE} is missing"),
    })
}

/// A case that the summaries hold and the data set does not.
fn lacking<'a>(there: &BTreeSet<&str>, collected: &'a Collected, fresh: &[Outcome]) -> Option<&'a str> {
    let mut ids = collected.cases.keys().map(String::as_str);
    ids.find(|&id| !there.contains(id) && !is_fresh(fresh, id))
}

/// True for a case that is about to be added: a collection that was cut off between the two files may have left the
/// sections of such a one alone.
fn is_fresh(fresh: &[Outcome], id: &str) -> bool {
    fresh.iter().any(|outcome| outcome.case.id == id)
}

/// Refuses outcomes of another solver than the data set's, and settings that were changed since it was begun.
fn check_alike(path: &Path, plan: &Plan, dataset: &Dataset, fresh: &[Outcome]) -> Result<(), CollectError> {
    let mixed = |what: &'static str, before: &str, id: &str, now: &str| CollectError::Mixed {
        path: path.to_owned(),
        what,
        before: before.to_owned(),
        id: id.to_owned(),
        now: now.to_owned(),
    };
    if let Some(other) = fresh.iter().find(|outcome| outcome.solver != dataset.meta.provenance) {
        let (before, id) = (&dataset.meta.provenance, &other.case.id);
        return Err(mixed("by", before, id, &other.solver));
    }
    let settings = settings_note(plan);
    match dataset.meta.notes.get("settings") {
        Some(before) if *before != settings => {
            Err(mixed("with the settings", before, &fresh[0].case.id, &settings))
        }
        // one that was begun before they were noted keeps its notes: what learnt from it names it by its hash
        _ => Ok(()),
    }
}

fn settings_note(plan: &Plan) -> String {
    // settings always have a JSON form
    serde_json::to_string(&plan.campaign.settings).unwrap_or_default()
}

fn empty(plan: &Plan, vehicle: &Vehicle, first: &Outcome) -> Dataset {
    let names = vehicle.surfaces.iter().map(|surface| surface.name.clone()).collect();
    let notes = [
        ("hull_sha256", plan.campaign.hull_sha256.clone()),
        ("settings", settings_note(plan)),
        (
            "loads",
            "pressure and viscous; moments about the body origin; `rest` on the mesh of the case".to_owned(),
        ),
    ];
    let meta = Meta {
        provenance: first.solver.clone(),
        ground_contact: GroundContact::Dry,
        vehicles: BTreeMap::from([(plan.campaign.vehicle.clone(), names)]),
        notes: notes.map(|(key, value)| (key.to_owned(), value)).into(),
    };
    Dataset { meta, samples: Vec::new() }
}

fn samples(vehicle: &str, outcome: &Outcome) -> Vec<Sample> {
    let sample = |(index, section): (usize, &super::solve::Section)| Sample {
        vehicle: vehicle.to_owned(),
        case: outcome.case.id.clone(),
        set: outcome.case.set.to_string(),
        image: Image::Original,
        section: index as u32,
        start_s: section.start_s,
        end_s: section.end_s,
        condition: outcome.case.condition(section.speed_mps, section.acceleration_mps2),
        surfaces: section
            .loads
            .iter()
            .zip(&outcome.rest)
            .map(|(load, rest)| surface_load(load, rest))
            .collect(),
    };
    outcome.sections.iter().enumerate().map(sample).collect()
}

fn surface_load(load: &Load, rest: &Load) -> SurfaceLoad {
    SurfaceLoad {
        force: load.force.into(),
        moment: Some(load.moment.into()),
        viscous: Some(load.viscous.into()),
        rest: Some(Rest { force: rest.force.into(), moment: rest.moment.into() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_of_a_case_is_that_of_its_row_and_of_its_channel_where_it_has_one_of_its_own() {
        let case = Case::steady("husky", Set::Paper, 7, 0.5, 0.1);
        let row = "{\"id\":\"husky-paper-0007\",\"set\":\"paper\",\"speed_mps\":0.5,\"heading_deg\":0.0,\"depth_m\":0.1,\
                   \"density_kgpm3\":1000.0,\"roll_deg\":0.0,\"pitch_deg\":0.0,\"bed\":\"parked\",\"cell_scale\":1.0,\
                   \"end_speed_mps\":0.5,\"ramp_s\":0.0";
        let hash = |text: String| sha256(text.as_bytes())[..32].to_owned();
        assert_eq!(state_hash(&case), hash(format!("{row}}}")));
        let wide = Case { channel_scale: 1.5, ..case };
        assert_eq!(state_hash(&wide), hash(format!("{row},\"channel_scale\":1.5}}")));
    }
}
