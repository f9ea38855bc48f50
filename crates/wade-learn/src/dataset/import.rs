//! A folder of CFD cases, one sub-folder each with its `case.toml`, as a data set.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::case::{CaseError, CaseFile, Placement};
use super::fluent::{FluentError, Reports};
use super::history::{History, HistoryError};
use super::openfoam::{self, OpenFoamError, Run, SurfaceHistory};
use super::sections::Sections;
use super::{CutOff, Dataset, Flaw, Image, Meta, Rest, Sample, SurfaceLoad};
use wade_core::frame::Vec3;

/// The file that makes a folder a case.
pub const CASE_FILE: &str = "case.toml";

/// Whose files the cases hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// `postProcessing/<surface>/<start time>/force.dat` and `moment.dat`.
    OpenFoam,
    /// Report files, `*.out`.
    Fluent,
}

/// How to import.
#[derive(Debug, Clone, PartialEq)]
pub struct Import {
    /// Whose files.
    pub format: Format,
    /// The vehicles that cases may be of, with their surfaces.
    pub vehicles: BTreeMap<String, Vec<String>>,
    /// Which part of the histories counts.
    pub sections: Sections,
    /// What to do with a last line that is not whole.
    pub cut_off: CutOff,
    /// Solver and version, for the meta data.
    pub provenance: String,
}

/// Why cases were refused. The message names the file or the case, and the surface.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// A file or folder that cannot be read.
    #[error("{}: {fault}", .path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        fault: std::io::Error,
    },
    /// No sub-folder.
    #[error("{}: no case in it; a case is a folder with a {CASE_FILE}", .path.display())]
    NoCases {
        /// The folder.
        path: PathBuf,
    },
    /// A sub-folder without description.
    #[error("{}: case without its description {CASE_FILE}", .path.display())]
    NoDescription {
        /// The folder of the case.
        path: PathBuf,
    },
    /// A description that describes nothing.
    #[error("{}: {fault}", .path.display())]
    Description {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        fault: CaseError,
    },
    /// A vehicle that was not asked for.
    #[error("{}: vehicle `{vehicle}` is none of those asked for: {}", .path.display(), .known.join(", "))]
    Vehicle {
        /// The description.
        path: PathBuf,
        /// The vehicle.
        vehicle: String,
        /// The vehicles asked for.
        known: Vec<String>,
    },
    /// A name for a surface that the vehicle has not.
    #[error("{}: surfaces names `{surface}`, which vehicle `{vehicle}` has not", .path.display())]
    Surface {
        /// The description.
        path: PathBuf,
        /// The surface.
        surface: String,
        /// The vehicle.
        vehicle: String,
    },
    /// The load of one patch for two surfaces, which would count it twice.
    #[error(
        "{}: surfaces `{}` and `{}` are both `{patch}` of the solver, whose load would count twice",
        .path.display(), .surfaces[0], .surfaces[1]
    )]
    SharedPatch {
        /// The description.
        path: PathBuf,
        /// Both surfaces.
        surfaces: [String; 2],
        /// The solver's name.
        patch: String,
    },
    /// A Fluent case whose description does not name the columns.
    #[error("{}: a Fluent case needs the table [report] with the names of the columns", .path.display())]
    NoReport {
        /// The description.
        path: PathBuf,
    },
    /// Forces that OpenFOAM wrote.
    #[error("surface `{surface}`: {fault}")]
    OpenFoam {
        /// The surface.
        surface: String,
        /// What is wrong.
        fault: OpenFoamError,
    },
    /// Surfaces whose loads come from different runs.
    #[error(
        "surface `{surface}`: {} holds no loads of the run that wrote {} for surface `{other}`: the loads of one case must come from the same \
         runs; restore what is missing, or move the outdated run out of the folders",
        .folder.display(), .file.display()
    )]
    MixedRuns {
        /// The surface that lacks the run.
        surface: String,
        /// The folder where the run would be.
        folder: PathBuf,
        /// A surface that has the run.
        other: String,
        /// Its file.
        file: PathBuf,
    },
    /// Moments about an unknown point.
    #[error(
        "{}, surface `{surface}`: no header states the point that the moments are taken about: put the line `# CofR : (x y z)` above the names of the columns",
        .path.display()
    )]
    MomentCenter {
        /// The folder of the function object.
        path: PathBuf,
        /// The surface.
        surface: String,
    },
    /// Report files.
    #[error(transparent)]
    Fluent(#[from] FluentError),
    /// A history without the sections asked for.
    #[error("{}, surface `{surface}`: {fault}", .path.display())]
    Sections {
        /// The file that holds the end of the history.
        path: PathBuf,
        /// The surface.
        surface: String,
        /// What is wrong.
        fault: HistoryError,
    },
    /// Loads at rest need moments.
    #[error("{}, surface `{surface}`: the loads at rest have no moments", .path.display())]
    RestMoment {
        /// The folder of the loads at rest.
        path: PathBuf,
        /// The surface.
        surface: String,
    },
    /// Cases that make no data set.
    #[error(transparent)]
    Flaw(#[from] Flaw),
}

/// Which values of a history are wanted.
#[derive(Clone, Copy)]
enum Take {
    Sections(Sections),
    Last,
}

impl Take {
    /// First and last time that are wanted [s].
    fn window(self) -> (f64, f64) {
        match self {
            Self::Sections(Sections { transient_s, count, length_s }) => {
                (transient_s, transient_s + length_s * f64::from(count))
            }
            Self::Last => (f64::MAX, f64::MAX),
        }
    }

    fn from<const N: usize>(self, history: &History<N>) -> Result<Vec<[f64; N]>, HistoryError> {
        match self {
            Self::Sections(sections) => sections.means(history),
            Self::Last => Ok(history.values().last().copied().into_iter().collect()),
        }
    }
}

/// What a surface feels, in the axes of the CFD, one value a section.
struct Taken {
    force: Vec<Vec3>,
    viscous: Option<Vec<Vec3>>,
    moment: Option<Vec<Vec3>>,
    about: Vec3,
}

impl Import {
    /// Imports every case of a folder; `progress` hears how many of how many are done.
    pub fn run(&self, folder: &Path, progress: &dyn Fn(usize, usize)) -> Result<Dataset, ImportError> {
        let folders = case_folders(folder)?;
        let (mut samples, mut contacts, mut domains) = (Vec::new(), Vec::new(), BTreeSet::new());
        let (mut left_out, mut passed_over) = (BTreeSet::new(), BTreeSet::new());
        for (done, path) in folders.iter().enumerate() {
            progress(done, folders.len());
            let (case, of_case, not_read) = self.case(path)?;
            samples.extend(of_case);
            passed_over.extend(not_read);
            left_out.extend(self.left_out(path, &case));
            contacts.push(case.ground_contact);
            domains.extend(case.domain_m.map(|[x, y, z]| format!("{x} x {y} x {z} ({})", case.vehicle)));
        }
        progress(folders.len(), folders.len());
        let Sections { transient_s, count, length_s } = self.sections;
        let mut notes = BTreeMap::from([(
            "sections".to_owned(),
            format!("{count} of {length_s} s after {transient_s} s, means weighted by time"),
        )]);
        if !domains.is_empty() {
            notes.insert("domain_m".to_owned(), domains.into_iter().collect::<Vec<_>>().join(", "));
        }
        if !left_out.is_empty() {
            notes.insert(LEFT_OUT.to_owned(), left_out.into_iter().collect::<Vec<_>>().join(", "));
        }
        if !passed_over.is_empty() {
            notes.insert(PASSED_OVER.to_owned(), first_names(&passed_over));
        }
        let used = |(name, _): &(&String, &Vec<String>)| samples.iter().any(|s: &Sample| s.vehicle == **name);
        let meta = Meta {
            provenance: self.provenance.clone(),
            ground_contact: contacts[0],
            vehicles: self.vehicles.iter().filter(used).map(|(n, s)| (n.clone(), s.clone())).collect(),
            notes,
        };
        let dataset = Dataset { meta, samples };
        dataset.check()?;
        Ok(dataset)
    }

    /// Names under which the solver of a case reports what is none of the vehicle's surfaces, such as the whole vehicle.
    fn left_out(&self, folder: &Path, case: &CaseFile) -> Vec<String> {
        let surfaces = &self.vehicles[&case.vehicle];
        let is_read = |name: &String| surfaces.iter().any(|surface| case.name_in_solver(surface) == name);
        let reported = match self.format {
            Format::OpenFoam => fs::read_dir(folder.join("postProcessing")).into_iter().flatten().flatten(),
            // a report file holds any of many quantities, none of which need be a load
            Format::Fluent => return Vec::new(),
        };
        reported
            .filter(|entry| openfoam::has_forces(&entry.path()))
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .filter(|name| !is_read(name))
            .collect()
    }

    fn description(&self, folder: &Path) -> Result<CaseFile, ImportError> {
        let path = folder.join(CASE_FILE);
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Err(ImportError::NoDescription { path: folder.to_owned() });
            }
            Err(fault) => return Err(ImportError::Io { path, fault }),
        };
        let case = match CaseFile::parse(&text) {
            Ok(case) => case,
            Err(fault) => return Err(ImportError::Description { path, fault }),
        };
        let Some(surfaces) = self.vehicles.get(&case.vehicle) else {
            let known = self.vehicles.keys().cloned().collect();
            return Err(ImportError::Vehicle { path, vehicle: case.vehicle, known });
        };
        if let Some(surface) = case.surfaces.keys().find(|surface| !surfaces.contains(surface)) {
            return Err(ImportError::Surface { path, surface: surface.clone(), vehicle: case.vehicle });
        }
        match shared_patch(&case, surfaces) {
            Some((surfaces, patch)) => Err(ImportError::SharedPatch { path, surfaces, patch }),
            None => Ok(case),
        }
    }

    /// The description and the samples of one case, whose name is that of its folder, and the files that were passed over.
    fn case(&self, folder: &Path) -> Result<(CaseFile, Vec<Sample>, Vec<String>), ImportError> {
        let case = self.description(folder)?;
        let mut passed_over = Vec::new();
        let samples = self.samples(folder, &case, &mut passed_over)?;
        let within = |path: &PathBuf| {
            let parent = folder.parent().unwrap_or(folder);
            path.strip_prefix(parent).unwrap_or(path).display().to_string()
        };
        Ok((case, samples, passed_over.iter().map(within).collect()))
    }

    fn samples(
        &self,
        folder: &Path,
        case: &CaseFile,
        passed_over: &mut Vec<PathBuf>,
    ) -> Result<Vec<Sample>, ImportError> {
        let described = |fault| ImportError::Description { path: folder.join(CASE_FILE), fault };
        let condition = case.condition().map_err(described)?;
        let placement = case.placement();
        let loads = self.loads(folder, case, Take::Sections(self.sections), passed_over)?;
        let rest = match &case.rest {
            Some(name) => Some(self.rest(&folder.join(name), case, passed_over)?),
            None => None,
        };
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let sample = |section: super::sections::Section| {
            let index = section.index as usize;
            let surface = |(at, taken): (usize, &Taken)| SurfaceLoad {
                force: placement.force(&taken.force[index]),
                moment: taken
                    .moment
                    .as_ref()
                    .map(|moment| placement.moment(&moment[index], &taken.force[index], &taken.about)),
                viscous: taken.viscous.as_ref().map(|viscous| placement.force(&viscous[index])),
                rest: rest.as_ref().map(|rest| rest[at]),
            };
            Sample {
                vehicle: case.vehicle.clone(),
                case: name.clone(),
                set: case.set.clone(),
                image: Image::Original,
                section: section.index,
                start_s: section.start_s,
                end_s: section.end_s,
                condition,
                surfaces: loads.iter().enumerate().map(surface).collect(),
            }
        };
        Ok(self.sections.iter().map(sample).collect())
    }

    /// The last values of the case at rest.
    fn rest(
        &self,
        folder: &Path,
        case: &CaseFile,
        passed_over: &mut Vec<PathBuf>,
    ) -> Result<Vec<Rest>, ImportError> {
        let loads = self.loads(folder, case, Take::Last, passed_over)?;
        let placement: Placement = case.placement();
        let rest = |(taken, surface): (&Taken, &String)| {
            let no_moment = || ImportError::RestMoment { path: folder.to_owned(), surface: surface.clone() };
            let moment = taken.moment.as_ref().ok_or_else(no_moment)?;
            Ok(Rest {
                force: placement.force(&taken.force[0]),
                moment: placement.moment(&moment[0], &taken.force[0], &taken.about),
            })
        };
        loads.iter().zip(&self.vehicles[&case.vehicle]).map(rest).collect()
    }

    fn loads(
        &self,
        folder: &Path,
        case: &CaseFile,
        take: Take,
        passed_over: &mut Vec<PathBuf>,
    ) -> Result<Vec<Taken>, ImportError> {
        let surfaces = &self.vehicles[&case.vehicle];
        match self.format {
            Format::OpenFoam => {
                let mut outputs = Vec::new();
                for surface in surfaces {
                    let folder = folder.join("postProcessing").join(case.name_in_solver(surface));
                    let history = openfoam::read(&folder, self.cut_off)
                        .map_err(|fault| ImportError::OpenFoam { surface: surface.clone(), fault })?;
                    outputs.push(SurfaceOutput { surface, folder, history });
                }
                check_runs(&outputs, take.window())?;
                outputs.iter().map(|output| output.take(take)).collect()
            }
            Format::Fluent => {
                let reports = Reports::read(folder, self.cut_off)?;
                let taken = surfaces.iter().map(|surface| fluent(folder, case, &reports, surface, take));
                let taken = taken.collect::<Result<_, _>>()?;
                passed_over.extend(reports.passed_over().map(Path::to_owned));
                Ok(taken)
            }
        }
    }
}

/// What OpenFOAM wrote for one surface.
struct SurfaceOutput<'a> {
    surface: &'a str,
    folder: PathBuf,
    history: SurfaceHistory,
}

impl SurfaceOutput<'_> {
    fn take(&self, take: Take) -> Result<Taken, ImportError> {
        let Self { surface, folder, history } = self;
        if history.moment.is_some() && history.about.is_none() {
            let surface = (*surface).to_owned();
            return Err(ImportError::MomentCenter { path: folder.clone(), surface });
        }
        let means = |history: &History<3>, file: &Path| {
            let means = take.from(history).map_err(|fault| sections_error(file, surface, fault))?;
            Ok::<_, ImportError>(means.into_iter().map(Vec3::from).collect::<Vec<_>>())
        };
        let moments = history.moment.as_ref().zip(history.moment_file.as_ref());
        Ok(Taken {
            force: means(&history.force, &history.force_file)?,
            viscous: Some(means(&history.viscous, &history.force_file)?),
            moment: moments.map(|(moment, file)| means(moment, file)).transpose()?,
            about: history.about.unwrap_or_else(Vec3::zeros),
        })
    }
}

/// Note of a data set on what was reported and belongs to no surface.
pub const LEFT_OUT: &str = "left_out";

/// Note of a data set on files beside those that were read, of the same ending, that are no reports or cannot be read.
pub const PASSED_OVER: &str = "passed_over";

/// Files that the note names.
const NAMED_FILES: usize = 5;

/// The first of many names, and how many more there are.
fn first_names(names: &BTreeSet<String>) -> String {
    let first: Vec<&str> = names.iter().take(NAMED_FILES).map(String::as_str).collect();
    match names.len() - first.len() {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}

/// Refuses surfaces of which one lacks a run that another has in the times that are wanted: their sum would mix two runs.
fn check_runs(outputs: &[SurfaceOutput], (from, to): (f64, f64)) -> Result<(), ImportError> {
    let runs = |output: &SurfaceOutput| output.history.runs_between(from, to).to_vec();
    let mut all: Vec<(&SurfaceOutput, Run)> = Vec::new();
    for output in outputs {
        all.extend(runs(output).into_iter().map(|run| (output, run)));
    }
    // what lacks the latest run is the surface to look at
    all.sort_by(|(_, a), (_, b)| b.since.total_cmp(&a.since).then_with(|| b.name.cmp(&a.name)));
    for (has, run) in all {
        let lacks = |output: &&SurfaceOutput| runs(output).iter().all(|other| other.name != run.name);
        if let Some(lacks) = outputs.iter().find(lacks) {
            return Err(ImportError::MixedRuns {
                surface: lacks.surface.to_owned(),
                folder: lacks.folder.clone(),
                other: has.surface.to_owned(),
                file: run.file,
            });
        }
    }
    Ok(())
}

/// Two surfaces for which the solver has the same name, and that.
fn shared_patch(case: &CaseFile, surfaces: &[String]) -> Option<([String; 2], String)> {
    let mut fed: BTreeMap<&str, &String> = BTreeMap::new();
    surfaces.iter().find_map(|surface| {
        let patch = case.name_in_solver(surface);
        let other = fed.insert(patch, surface)?;
        Some(([other.clone(), surface.clone()], patch.to_owned()))
    })
}

fn fluent(
    folder: &Path,
    case: &CaseFile,
    reports: &Reports,
    surface: &str,
    take: Take,
) -> Result<Taken, ImportError> {
    let Some(report) = &case.report else {
        return Err(ImportError::NoReport { path: folder.join(CASE_FILE) });
    };
    let vectors = |pattern: &String| {
        let pattern = pattern.replace("{surface}", case.name_in_solver(surface));
        let mut components = Vec::new();
        for axis in ["x", "y", "z"] {
            let (history, file) = reports.column(&pattern.replace("{axis}", axis))?;
            components.push(take.from(&history).map_err(|fault| sections_error(file, surface, fault))?);
        }
        let vector = |i: usize| Vec3::new(components[0][i][0], components[1][i][0], components[2][i][0]);
        Ok::<_, ImportError>((0..components[0].len()).map(vector).collect::<Vec<_>>())
    };
    Ok(Taken {
        force: vectors(&report.force)?,
        viscous: report.viscous.as_ref().map(vectors).transpose()?,
        moment: report.moment.as_ref().map(vectors).transpose()?,
        about: report.moment_center_m.map_or(Vec3::zeros(), Vec3::from),
    })
}

fn sections_error(file: &Path, surface: &str, fault: HistoryError) -> ImportError {
    ImportError::Sections { path: file.to_owned(), surface: surface.to_owned(), fault }
}

/// The sub-folders by name; files and hidden folders beside them are no cases.
fn case_folders(folder: &Path) -> Result<Vec<PathBuf>, ImportError> {
    let io = |fault| ImportError::Io { path: folder.to_owned(), fault };
    let mut folders = Vec::new();
    for entry in fs::read_dir(folder).map_err(io)? {
        let entry = entry.map_err(io)?;
        let hidden = entry.file_name().to_string_lossy().starts_with('.');
        if entry.path().is_dir() && !hidden {
            folders.push(entry.path());
        }
    }
    if folders.is_empty() {
        return Err(ImportError::NoCases { path: folder.to_owned() });
    }
    folders.sort();
    Ok(folders)
}
