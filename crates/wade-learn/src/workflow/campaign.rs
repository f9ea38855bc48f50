//! A folder of a campaign from its plan to a data set and trials.

use std::path::{Path, PathBuf};

use wade_core::geometry::hydrostatics::float_depth;
use wade_core::vehicle::Vehicle;

use crate::cfd::case::Settings;
use crate::cfd::collect::{self, CollectError, Collected};
use crate::cfd::means;
use crate::cfd::plan::{self, Campaign, Case, Plan, PlanError, Set};
use crate::cfd::run::Work;
use crate::cfd::trials::{self, CaseTrialsError};
use crate::dataset::{self, DatasetError};
use crate::parameter_table::ParameterTable;
use crate::train::Config;
use crate::trials::{TrialError, write};

/// Why a step of a campaign did not end.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum CampaignError {
    /// Files of a campaign whose settings are gone.
    #[error("{} holds {left} and no {}: bring that back, or name another folder", .folder.display(), plan::CAMPAIGN_FILE)]
    Headless { folder: PathBuf, left: &'static str },
    /// Settings for a campaign that has them.
    #[error("{} has its settings and its table already: edit them there", .folder.display())]
    Begun { folder: PathBuf },
    /// A vehicle that the source paper does not have.
    #[error("no ranges are known for `{vehicle}`: give them with --table (wade campaign plan --help)")]
    NoTable { vehicle: String },
    /// A case that is not in the plan.
    #[error("{} has no case `{id}`", .folder.display())]
    NoCase { folder: PathBuf, id: String },
    /// Files that trials would be mixed with.
    #[error("{} holds files already, which would be mixed with these trials: name another folder", .folder.display())]
    NotEmpty { folder: PathBuf },
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error(transparent)]
    Collect(#[from] CollectError),
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    #[error(transparent)]
    CaseTrials(#[from] CaseTrialsError),
    #[error(transparent)]
    Trial(#[from] TrialError),
}

/// A folder of a campaign and the vehicle that it is about.
#[derive(Debug, Clone, Copy)]
pub struct Folder<'a> {
    /// The folder.
    pub path: &'a Path,
    /// The vehicle.
    pub vehicle: &'a Vehicle,
}

/// What a campaign begins with.
#[derive(Debug, Clone, Default)]
pub struct Beginning {
    /// Ranges of the plan; the source paper's where it has some of this vehicle.
    pub table: Option<ParameterTable>,
    /// Settings of every case.
    pub settings: Option<Settings>,
}

/// Cases to add to a plan.
#[derive(Debug, Clone)]
pub struct Addition {
    /// Which kind.
    pub set: Set,
    /// How many, where the set has no list of its own.
    pub cases: usize,
    /// Seed of the hypercube.
    pub seed: u64,
    /// A campaign whose cases that had not settled a round repeats.
    pub repeat: Option<PathBuf>,
}

/// Which cases are computed.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// Of these sets; of all where there is none.
    pub sets: Vec<Set>,
    /// These cases; all where there is none.
    pub cases: Vec<String>,
    /// Also those that were set aside.
    pub again: bool,
    /// Also those that an older version computed in another way.
    pub outdated: bool,
}

impl Folder<'_> {
    /// Adds cases to the plan, or begins one. Returns the plan and how many cases it had before.
    pub fn extend(&self, beginning: Beginning, add: Addition) -> Result<(Plan, usize), CampaignError> {
        let exists = self.path.join(plan::CAMPAIGN_FILE).exists();
        let folder = || self.path.to_owned();
        let of_a_campaign =
            [plan::PLAN_FILE, collect::CASES_FILE, collect::SECTIONS_FILE, means::SURFACES_FILE];
        if let Some(left) = of_a_campaign.into_iter().find(|name| !exists && self.path.join(name).exists()) {
            return Err(CampaignError::Headless { folder: folder(), left });
        }
        let mut plan = if exists { Plan::read(self.path)? } else { self.begin(&beginning)? };
        plan.check_vehicle(self.path, self.vehicle)?;
        if exists && (beginning.settings.is_some() || beginning.table.is_some()) {
            return Err(CampaignError::Begun { folder: folder() });
        }
        let before = plan.cases.len();
        let float = float_depth(&self.vehicle.hull.mesh, self.vehicle.z0, self.vehicle.mass);
        match add.set {
            Set::Drive => {
                let repeats = add.repeat.as_deref().map(|other| self.unsettled(other)).transpose()?;
                plan.add_round(self.vehicle, add.cases, add.seed, &repeats.unwrap_or_default());
            }
            set => plan.extend(set, add.cases, add.seed, float)?,
        }
        if exists {
            plan.write_cases(self.path)?
        } else {
            plan.write(self.path)?
        }
        Ok((plan, before))
    }

    /// The cases of the set `paper` of another campaign of the same vehicle that had not settled.
    fn unsettled(&self, other: &Path) -> Result<Vec<Case>, CampaignError> {
        let plan = Plan::read(other)?;
        plan.check_vehicle(other, self.vehicle)?;
        let collected = Collected::read(other, &plan)?;
        let has_not_settled = |case: &Case| collected.cases.get(&case.id).is_some_and(|row| !row.settled);
        Ok(plan.cases.into_iter().filter(|case| case.set == Set::Paper && has_not_settled(case)).collect())
    }

    fn begin(&self, beginning: &Beginning) -> Result<Plan, CampaignError> {
        let vehicle = &self.vehicle.name;
        let known = Config::default().analytic.tables;
        let no_table = || CampaignError::NoTable { vehicle: vehicle.clone() };
        let table = beginning.table.or_else(|| known.get(vehicle).copied()).ok_or_else(no_table)?;
        let settings = beginning.settings.unwrap_or_default();
        let hull_sha256 = plan::hull_hash(self.vehicle);
        let campaign =
            Campaign { format: plan::FORMAT, vehicle: vehicle.clone(), hull_sha256, table, settings };
        Ok(Plan { campaign, cases: Vec::new() })
    }

    /// The cases of a selection that are due.
    pub fn due(&self, plan: &Plan, work: &Work, selection: &Selection) -> Result<Vec<Case>, CampaignError> {
        let Selection { sets, cases, again, outdated } = selection;
        if let Some(unknown) = cases.iter().find(|id| !plan.cases.iter().any(|case| case.id == **id)) {
            return Err(CampaignError::NoCase { folder: self.path.to_owned(), id: unknown.clone() });
        }
        let collected = Collected::read(self.path, plan)?;
        let is_due = |case: &Case| {
            let summary = collected.cases.get(&case.id);
            summary.is_none_or(|summary| *outdated && summary.is_outdated(case))
        };
        let is_chosen = |case: &&Case| {
            is_due(case)
                && (sets.is_empty() || sets.contains(&case.set))
                && (cases.is_empty() || cases.contains(&case.id))
                && (*again || !work.failure_path(&case.id).exists())
        };
        Ok(plan.cases.iter().filter(is_chosen).cloned().collect())
    }

    /// Makes trials of computed cases of some sets, and writes them to a folder that holds none. Returns how many.
    pub fn write_trials(
        &self,
        plan: &Plan,
        sets: &[Set],
        pairs: bool,
        out: &Path,
    ) -> Result<usize, CampaignError> {
        let dataset = dataset::read(&self.path.join(collect::SECTIONS_FILE))?;
        let collected = pairs.then(|| Collected::read(self.path, plan)).transpose()?;
        let (manifest, trials) = trials::trials(plan, &dataset, self.vehicle, sets, collected.as_ref())?;
        if std::fs::read_dir(out).is_ok_and(|mut entries| entries.next().is_some()) {
            return Err(CampaignError::NotEmpty { folder: out.to_owned() });
        }
        write(out, &manifest, &trials)?;
        Ok(trials.len())
    }
}
