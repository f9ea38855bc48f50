//! What is kept of cases of which only means are: `surfaces.csv`, a row a surface of a case. With the row of the case in
//! `cases.csv` it is below 2 kB a case, and a new round adds lines where a Parquet file would be another file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::collect::{CaseSummary, CollectError};
use super::plan::Plan;
use super::solve::{Load, Outcome};
use crate::dataset::{Dataset, Image, Meta, Rest, Sample, SurfaceLoad};
use crate::files::write_whole;
use wade_core::condition::Condition;
use wade_core::frame::Vec3;

/// File of the means in the folder of the campaign.
pub const SURFACES_FILE: &str = "surfaces.csv";

/// Digits that count, and places behind the point at most: the waves of the channel move a mean by a percent.
const DIGITS: i32 = 4;
const MOST_PLACES: i32 = 3;

/// The load on one surface of one case; body frame, moments about the body origin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs, reason = "the columns of a vector stand below its first one")]
pub struct SurfaceMean {
    /// Name of the case.
    pub case: String,
    /// Name of the surface.
    pub surface: String,
    /// Mean force of the water [N].
    pub fx_n: f64,
    pub fy_n: f64,
    pub fz_n: f64,
    /// Mean moment [N m].
    pub mx_nm: f64,
    pub my_nm: f64,
    pub mz_nm: f64,
    /// The same at rest on the mesh of the case at the measured water level.
    pub rest_fx_n: f64,
    pub rest_fy_n: f64,
    pub rest_fz_n: f64,
    pub rest_mx_nm: f64,
    pub rest_my_nm: f64,
    pub rest_mz_nm: f64,
    /// Standard deviation of the force over sections of 0.1 s [N].
    pub deviation_fx_n: f64,
    pub deviation_fy_n: f64,
    pub deviation_fz_n: f64,
    /// Change of the dynamic force since the window before, at equal depth times speed squared [N].
    pub drift_fx_n: f64,
    pub drift_fy_n: f64,
    pub drift_fz_n: f64,
}

impl SurfaceMean {
    /// The surfaces of an outcome.
    pub fn of(outcome: &Outcome) -> Vec<Self> {
        let drift = |index: usize| outcome.measured.as_ref().map_or([0.0; 3], |flow| flow.drift[index]);
        let surfaces = outcome.surfaces.iter().zip(&outcome.rest).enumerate();
        surfaces
            .map(|(index, (surface, rest))| Self::new(outcome, index, surface, rest, drift(index)))
            .collect()
    }

    fn new(outcome: &Outcome, index: usize, surface: &str, rest: &Load, drift: [f64; 3]) -> Self {
        let count = outcome.sections.len().max(1) as f64;
        let mean = |part: &dyn Fn(&Load) -> [f64; 3]| -> Vec3 {
            outcome.sections.iter().map(|section| Vec3::from(part(&section.loads[index]))).sum::<Vec3>()
                / count
        };
        let (force, moment) = (mean(&|load| load.force), mean(&|load| load.moment));
        let squares = mean(&|load| {
            let change = Vec3::from(load.force) - force;
            change.component_mul(&change).into()
        });
        let deviation = squares.map(f64::sqrt);
        let [fx_n, fy_n, fz_n] = short(force.into());
        let [mx_nm, my_nm, mz_nm] = short(moment.into());
        let [rest_fx_n, rest_fy_n, rest_fz_n] = short(rest.force);
        let [rest_mx_nm, rest_my_nm, rest_mz_nm] = short(rest.moment);
        let [deviation_fx_n, deviation_fy_n, deviation_fz_n] = short(deviation.into());
        let [drift_fx_n, drift_fy_n, drift_fz_n] = short(drift);
        Self {
            case: outcome.case.id.clone(),
            surface: surface.to_owned(),
            fx_n,
            fy_n,
            fz_n,
            mx_nm,
            my_nm,
            mz_nm,
            rest_fx_n,
            rest_fy_n,
            rest_fz_n,
            rest_mx_nm,
            rest_my_nm,
            rest_mz_nm,
            deviation_fx_n,
            deviation_fy_n,
            deviation_fz_n,
            drift_fx_n,
            drift_fy_n,
            drift_fz_n,
        }
    }

    fn load(&self) -> SurfaceLoad {
        SurfaceLoad {
            force: Vec3::new(self.fx_n, self.fy_n, self.fz_n),
            moment: Some(Vec3::new(self.mx_nm, self.my_nm, self.mz_nm)),
            viscous: None,
            rest: Some(Rest {
                force: Vec3::new(self.rest_fx_n, self.rest_fy_n, self.rest_fz_n),
                moment: Vec3::new(self.rest_mx_nm, self.rest_my_nm, self.rest_mz_nm),
            }),
        }
    }
}

/// A number with as many digits as count.
pub fn short_number(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let places = (DIGITS - 1 - value.abs().log10().floor() as i32).min(MOST_PLACES);
    let scale = 10_f64.powi(places.abs());
    // by division where it has places, so that what is written is short; and never -0
    let rounded = if places >= 0 { (value * scale).round() / scale } else { (value / scale).round() * scale };
    rounded + 0.0
}

fn short(values: [f64; 3]) -> [f64; 3] {
    values.map(short_number)
}

/// The means of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Means {
    /// Solver, surfaces and notes, as of a data set.
    pub meta: Meta,
    /// By case, then in the order of the surfaces.
    pub rows: Vec<SurfaceMean>,
}

impl Means {
    /// Reads the means of a campaign; `None` where there are none yet.
    pub fn read(folder: &Path) -> Result<Option<Self>, CollectError> {
        let path = folder.join(SURFACES_FILE);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(CollectError::Io { path, source }),
        };
        let syntax = |message: String| CollectError::Syntax { path: path.clone(), message };
        let (head, table) = text.split_once('\n').unwrap_or((&text, ""));
        let meta =
            head.strip_prefix("# ").ok_or_else(|| syntax("the first line is no `# {...}`".to_owned()))?;
        let meta = serde_json::from_str(meta).map_err(|error| syntax(error.to_string()))?;
        let mut reader = csv::Reader::from_reader(table.as_bytes());
        let rows =
            reader.deserialize().collect::<Result<_, _>>().map_err(|error| syntax(error.to_string()))?;
        Ok(Some(Self { meta, rows }))
    }

    /// Replaces the cases of these outcomes, or adds them.
    pub fn add(&mut self, fresh: &[Outcome]) {
        let replaced: BTreeSet<&str> = fresh.iter().map(|outcome| outcome.case.id.as_str()).collect();
        self.rows.retain(|row| !replaced.contains(row.case.as_str()));
        self.rows.extend(fresh.iter().flat_map(SurfaceMean::of));
        // stable: the surfaces of a case stay in order
        self.rows.sort_by(|a, b| a.case.cmp(&b.case));
    }

    /// Writes the means of a campaign.
    pub fn write(&self, folder: &Path) -> Result<(), CollectError> {
        let path = folder.join(SURFACES_FILE);
        let syntax = |message: String| CollectError::Syntax { path: path.clone(), message };
        let meta = serde_json::to_string(&self.meta).map_err(|error| syntax(error.to_string()))?;
        let mut writer = csv::Writer::from_writer(format!("# {meta}\n").into_bytes());
        for row in &self.rows {
            writer.serialize(row).map_err(|error| syntax(error.to_string()))?;
        }
        let bytes = writer.into_inner().map_err(|error| syntax(error.to_string()))?;
        write_whole(&path, &bytes).map_err(|source| CollectError::Io { path: path.clone(), source })
    }

    /// Names of the cases.
    pub fn cases(&self) -> BTreeSet<&str> {
        self.rows.iter().map(|row| row.case.as_str()).collect()
    }

    /// The means as a data set, a sample a case, with the depth and the speed that were measured. `folder` names the campaign in
    /// messages.
    pub fn dataset(
        &self,
        folder: &Path,
        plan: &Plan,
        cases: &BTreeMap<String, CaseSummary>,
    ) -> Result<Dataset, CollectError> {
        let mut by_case: BTreeMap<&str, Vec<&SurfaceMean>> = BTreeMap::new();
        for row in &self.rows {
            by_case.entry(&row.case).or_default().push(row);
        }
        let apart = |id: &str| CollectError::Syntax {
            path: PathBuf::from(folder).join(SURFACES_FILE),
            message: format!("case `{id}` is in no plan or has no summary with a measured flow"),
        };
        let sample = |(id, rows): (&str, Vec<&SurfaceMean>)| {
            let planned = plan.cases.iter().find(|case| case.id == id).ok_or_else(|| apart(id))?;
            let summary = cases.get(id).ok_or_else(|| apart(id))?;
            let flow = summary.measured_depth_m.zip(summary.measured_speed_mps);
            let (depth, speed) = flow.ok_or_else(|| apart(id))?;
            let state = planned.condition(speed, 0.0);
            // the bed moves as planned, whatever the water does
            let ground_velocity = planned.condition(planned.speed_mps, 0.0).ground_velocity;
            let bed_clearance = summary.bed_clearance_m;
            Ok(Sample {
                vehicle: plan.campaign.vehicle.clone(),
                case: id.to_owned(),
                set: planned.set.to_string(),
                image: Image::Original,
                section: 0,
                start_s: summary.end_s,
                end_s: summary.end_s,
                condition: Condition { depth, ground_velocity, bed_clearance, ..state },
                surfaces: rows.into_iter().map(SurfaceMean::load).collect(),
            })
        };
        let samples = by_case.into_iter().map(sample).collect::<Result<_, CollectError>>()?;
        Ok(Dataset { meta: self.meta.clone(), samples })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_they_are_uncertain() {
        let written = [12.345_678, -0.000_4, 0.002_6, 123_456.0, 98.764_9, -1234.56, 0.0]
            .map(|value| short_number(value).to_string());
        assert_eq!(written, ["12.35", "0", "0.003", "123500", "98.76", "-1235", "0"]);
    }
}
