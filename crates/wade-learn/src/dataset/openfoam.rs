//! What OpenFOAM's function object `forces` writes: `<name>/<start time>/force.dat` and `moment.dat`.
//!
//! Three forms: vectors in parentheses (v1912), plain columns with the same names (v2212), and the Foundation's one
//! `forces.dat` with the pressure and viscous parts of forces and moments and no totals. In all of them a run that was
//! started again adds a folder named by its start time, and a file that is there already is not overwritten but joined by
//! `force_<time>.dat`, with the start time or the time of the first step. The header of all of them states the point that moments are taken about, `CofR`; a file
//! that lost it is read, and says so.
//!
//! A file that is passed over leaves the loads of an older run in its place, which nothing shows later. So what lies in a
//! folder of a start time and cannot be read is refused: compressed files, forces without their moments, two forms at once.

use std::fs;
use std::path::{Path, PathBuf};

use super::history::{History, HistoryError};
use super::lines::{CutOff, LineError, Lines};
use wade_core::frame::Vec3;

/// The loads on one surface over time, in the axes of the solver.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceHistory {
    /// Pressure and viscous force [N].
    pub force: History<3>,
    /// The viscous part [N].
    pub viscous: History<3>,
    /// Moment about `about` [N m].
    pub moment: Option<History<3>>,
    /// The point that the moment is taken about [m]; `None` where no header states it.
    pub about: Option<Vec3>,
    /// The file with the last forces.
    pub force_file: PathBuf,
    /// The file with the last moments.
    pub moment_file: Option<PathBuf>,
    /// The runs that the forces are joined from, in the order of time.
    pub runs: Vec<Run>,
}

/// One run of a solver, of which a history has a part.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// First time that counts [s].
    pub since: f64,
    /// Folder of its start time, with what tells a second run from the first: the same for all surfaces of the run.
    pub name: String,
    /// Its file with forces.
    pub file: PathBuf,
}

impl SurfaceHistory {
    /// The runs that the loads between two times come from [s].
    pub fn runs_between(&self, from: f64, to: f64) -> &[Run] {
        let first = self.runs.partition_point(|run| run.since <= from).saturating_sub(1);
        let end = self.runs.partition_point(|run| run.since < to).max(first + 1);
        &self.runs[first..end]
    }
}

/// Why the output of a function object was refused.
#[derive(Debug, thiserror::Error)]
pub enum OpenFoamError {
    /// A file or folder that cannot be read.
    #[error("{}: {fault}", .path.display())]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        fault: std::io::Error,
    },
    /// No folder with forces.
    #[error("{}: no folder in it, named by a time, holds force.dat or forces.dat", .path.display())]
    NoForces {
        /// The folder of the function object.
        path: PathBuf,
    },
    /// Forces of a run without the moments that other runs have, or moments without forces.
    #[error(
        "{} is missing beside {}: forces and moments must come from the same runs; restore it, or move the other out of the folder",
        .missing.display(), .beside.display()
    )]
    Unpaired {
        /// The file that is missing.
        missing: PathBuf,
        /// The file that it belongs to.
        beside: PathBuf,
    },
    /// A compressed file, which may be a later run than those that can be read.
    #[error("{} is compressed: unpack it with gunzip, or move it out of the folder", .path.display())]
    Compressed {
        /// The file.
        path: PathBuf,
    },
    /// Forces of one start time in both forms.
    #[error(
        "{} and {} are both forces from one start time, of two versions of OpenFOAM: move the outdated file out of the folder",
        .both.display(), .force.display()
    )]
    TwoForms {
        /// The file with forces and moments.
        both: PathBuf,
        /// The file with forces or moments alone.
        force: PathBuf,
    },
    /// Loads in the axes of a coordinate system.
    #[error(
        "{} has localForces, which a coordinateSystem adds and wade does not read: remove the coordinateSystem from the function \
         object, move this file out of the folder, and run the case or `foamPostProcess` (`postProcess` before version 11) again",
        .path.display()
    )]
    LocalAxes {
        /// The file.
        path: PathBuf,
    },
    /// Another moment center or other columns below the first rows.
    #[error(
        "{}, line {line}: the moment center (CofR) or the columns differ from those of the rows above, so the file holds two runs: \
         remove the rows and the header of the outdated one",
        .path.display()
    )]
    SecondHeader {
        /// The file.
        path: PathBuf,
        /// Number of the line, from 1.
        line: usize,
    },
    /// A file without the header that names its columns.
    #[error("{}: no header line in it names the columns total or pressure, and viscous", .path.display())]
    NoHeader {
        /// The file.
        path: PathBuf,
    },
    /// A line that is no row.
    #[error("{}, {fault}", .path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line and what is wrong with it.
        fault: LineError,
    },
    /// Rows that are no history.
    #[error("{}: {fault}", .path.display())]
    History {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        fault: HistoryError,
    },
    /// More than one run again from one start time, which no name puts in order.
    #[error(
        "{} and {} both come from runs that began again at one start time, and nothing says which is the later: move the other out of the folder",
        .first.display(), .second.display()
    )]
    SeveralRuns {
        /// One file.
        first: PathBuf,
        /// The other.
        second: PathBuf,
    },
    /// A moment center that moves.
    #[error("{}: the moment center (CofR) differs from that of the files before", .path.display())]
    MomentCenter {
        /// The file.
        path: PathBuf,
    },
}

/// Reads the folder of one function object, `postProcessing/<name>`, over all its start times; where two overlap the
/// later one counts.
pub fn read(folder: &Path, cut_off: CutOff) -> Result<SurfaceHistory, OpenFoamError> {
    let mut forces: Option<Loads> = None;
    let mut moments: Option<Loads> = None;
    let outputs: Vec<Output> = starts(folder)?.into_iter().map(Output::list).collect::<Result<_, _>>()?;
    check_pairs(&outputs)?;
    for Output { start, both, force, moment } in outputs {
        for path in both {
            // force and moment stand side by side in one file
            let [force, moment] = Part::read(path, cut_off)?.both()?;
            join(&mut forces, force, start)?;
            join(&mut moments, moment, start)?;
        }
        for path in force {
            join(&mut forces, Part::read(path, cut_off)?.one()?, start)?;
        }
        for path in moment {
            join(&mut moments, Part::read(path, cut_off)?.one()?, start)?;
        }
    }
    let forces = forces.ok_or_else(|| OpenFoamError::NoForces { path: folder.to_owned() })?;
    Ok(SurfaceHistory {
        // one function object writes both, about one point
        about: moments.as_ref().and_then(|moments| moments.about).or(forces.about),
        force_file: forces.path,
        force: forces.total,
        viscous: forces.viscous,
        moment_file: moments.as_ref().map(|moments| moments.path.clone()),
        moment: moments.map(|moments| moments.total),
        runs: forces.runs,
    })
}

/// The files of one start time, those of a second run last.
struct Output {
    start: f64,
    both: Vec<PathBuf>,
    force: Vec<PathBuf>,
    moment: Vec<PathBuf>,
}

impl Output {
    fn list((start, folder): (f64, PathBuf)) -> Result<Self, OpenFoamError> {
        let [both, force, moment] = ["forces", "force", "moment"].map(|stem| runs(&folder, stem));
        let output = Self { start, both: both?, force: force?, moment: moment? };
        match (output.both.first(), output.force.first().or(output.moment.first())) {
            (Some(both), Some(force)) => {
                Err(OpenFoamError::TwoForms { both: both.clone(), force: force.clone() })
            }
            _ => Ok(output),
        }
    }
}

/// Refuses forces without moments where other forces have them, and moments without forces: joined, they would be of
/// different runs.
fn check_pairs(outputs: &[Output]) -> Result<(), OpenFoamError> {
    let partner = |path: &PathBuf, stem: &str, other: &str| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        path.with_file_name(name.replacen(stem, other, 1))
    };
    let with_moments = outputs.iter().any(|output| !(output.both.is_empty() && output.moment.is_empty()));
    for Output { force, moment, .. } in outputs {
        let forces = force.iter().filter(|_| with_moments).map(|path| (path, "force", "moment", moment));
        let moments = moment.iter().map(|path| (path, "moment", "force", force));
        for (path, stem, other, others) in forces.chain(moments) {
            let missing = partner(path, stem, other);
            if !others.contains(&missing) {
                return Err(OpenFoamError::Unpaired { missing, beside: path.clone() });
            }
        }
    }
    Ok(())
}

/// Force or moment of a run, or of several joined.
struct Loads {
    path: PathBuf,
    runs: Vec<Run>,
    total: History<3>,
    viscous: History<3>,
    about: Option<Vec3>,
}

fn join(to: &mut Option<Loads>, later: Loads, since: f64) -> Result<(), OpenFoamError> {
    match to {
        None => *to = Some(later),
        Some(loads) if loads.about != later.about => {
            return Err(OpenFoamError::MomentCenter { path: later.path });
        }
        Some(loads) => {
            loads.path = later.path;
            let first = later.total.times()[0];
            loads.runs.retain(|run| run.since < first);
            loads.runs.extend(later.runs);
            loads.total.overlay(later.total, since);
            loads.viscous.overlay(later.viscous, since);
        }
    }
    Ok(())
}

/// True for the output of a function object that reports forces.
pub fn has_forces(folder: &Path) -> bool {
    let is_forces = |path: &Path| {
        ["force", "forces"].iter().any(|stem| !matches!(runs(path, stem), Ok(runs) if runs.is_empty()))
    };
    starts(folder).is_ok_and(|starts| starts.iter().any(|(_, path)| is_forces(path)))
}

/// The folders named by a time, in the order of time.
fn starts(folder: &Path) -> Result<Vec<(f64, PathBuf)>, OpenFoamError> {
    let io = |fault| OpenFoamError::Io { path: folder.to_owned(), fault };
    let mut starts = Vec::new();
    for entry in fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let time = path.file_name().and_then(|name| name.to_str()).and_then(|name| name.parse::<f64>().ok());
        starts.extend(time.filter(|time| time.is_finite()).map(|time| (time, path)));
    }
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(starts)
}

/// `<stem>.dat`, then `<stem>_<time>.dat`, whatever the time.
fn runs(folder: &Path, stem: &str) -> Result<Vec<PathBuf>, OpenFoamError> {
    let io = |fault| OpenFoamError::Io { path: folder.to_owned(), fault };
    let (mut first, mut again) = (Vec::new(), Vec::new());
    if !folder.is_dir() {
        return Ok(first);
    }
    for entry in fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let unpacked = name.strip_suffix(".gz");
        let Some(rest) = run_suffix(unpacked.unwrap_or(name), stem) else { continue };
        if unpacked.is_some() {
            return Err(OpenFoamError::Compressed { path });
        }
        if rest.is_empty() {
            first.push(path);
        } else {
            again.push(path);
        }
    }
    again.sort();
    if let [first, second, ..] = &again[..] {
        return Err(OpenFoamError::SeveralRuns { first: first.clone(), second: second.clone() });
    }
    first.extend(again);
    Ok(first)
}

/// What stands behind the stem of `<stem>.dat` or `<stem>_<time>.dat`: nothing, or `_<time>`.
fn run_suffix<'a>(name: &'a str, stem: &str) -> Option<&'a str> {
    let suffix = name.strip_suffix(".dat")?.strip_prefix(stem)?;
    let is_time = |text: &str| text.parse::<f64>().is_ok_and(f64::is_finite);
    (suffix.is_empty() || suffix.strip_prefix('_').is_some_and(is_time)).then_some(suffix)
}

/// One file: the groups of three columns by their names, and the rows.
struct Part {
    path: PathBuf,
    about: Option<Vec3>,
    groups: Vec<String>,
    rows: Vec<(f64, Vec<f64>)>,
}

impl Part {
    fn read(path: PathBuf, cut_off: CutOff) -> Result<Self, OpenFoamError> {
        let text = match fs::read_to_string(&path) {
            Ok(text) => text.replace(['(', ')'], " "),
            Err(fault) => return Err(OpenFoamError::Io { path, fault }),
        };
        let mut part = Self { path, about: None, groups: Vec::new(), rows: Vec::new() };
        let lines = Lines::new(&text, cut_off);
        for (number, line) in lines.iter() {
            if let Some(comment) = line.strip_prefix('#') {
                if comment.contains("localForces") {
                    return Err(OpenFoamError::LocalAxes { path: part.path });
                }
                let before = (part.about, part.groups.clone());
                part.header(comment);
                if !part.rows.is_empty() && before != (part.about, part.groups.clone()) {
                    return Err(OpenFoamError::SecondHeader { path: part.path, line: number });
                }
                continue;
            }
            if part.groups.is_empty() {
                return Err(OpenFoamError::NoHeader { path: part.path });
            }
            match lines.row(number, line, 1 + 3 * part.groups.len()) {
                Ok(row) => part.rows.extend(row.map(|row| (row[0], row[1..].to_vec()))),
                Err(fault) => return Err(OpenFoamError::Line { path: part.path, fault }),
            }
        }
        Ok(part)
    }

    /// Takes the moment center and the names of the columns. The parentheses are gone by now.
    fn header(&mut self, comment: &str) {
        let words: Vec<&str> = comment.split_whitespace().collect();
        match words[..] {
            ["CofR", ":", x, y, z] => {
                if let [Ok(x), Ok(y), Ok(z)] = [x, y, z].map(str::parse) {
                    self.about = Some(Vec3::new(x, y, z));
                }
            }
            // one file for both, without totals
            ["Time", "forces", ref rest @ ..] => {
                let rest = rest.iter().map(|word| if word.starts_with("moment") { "moment" } else { word });
                self.groups = ["forces"].into_iter().chain(rest).map(str::to_owned).collect();
                self.groups.retain(|group| !["forces", "moment"].contains(&group.as_str()));
            }
            ["Time", ref rest @ ..] => {
                let group = |word: &&str| word.strip_suffix("_x").map(str::to_owned);
                self.groups = rest.iter().filter_map(group).collect();
            }
            _ => {}
        }
    }

    /// The folder of the start time, with the suffix of a run after it.
    fn run_name(&self) -> String {
        let start = self.path.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let suffix = ["forces", "force", "moment"].iter().find_map(|stem| run_suffix(&name, stem));
        format!("{start}{}", suffix.unwrap_or_default())
    }

    /// The only quantity of the file.
    fn one(self) -> Result<Loads, OpenFoamError> {
        let at = |name: &str| self.groups.iter().position(|group| group == name);
        match (at("total"), at("viscous")) {
            (Some(total), Some(viscous)) => self.loads(&[total], viscous),
            _ => Err(OpenFoamError::NoHeader { path: self.path }),
        }
    }

    /// The two quantities of the file, each the sum of its parts.
    fn both(self) -> Result<[Loads; 2], OpenFoamError> {
        let half = self.groups.len() / 2;
        let viscous = self.groups[..half].iter().position(|group| group == "viscous");
        let Some(viscous) = viscous.filter(|_| self.groups[..half] == self.groups[half..]) else {
            return Err(OpenFoamError::NoHeader { path: self.path });
        };
        let all = |from: usize| (from..from + half).collect::<Vec<_>>();
        Ok([self.loads(&all(0), viscous)?, self.loads(&all(half), half + viscous)?])
    }

    fn loads(&self, parts: &[usize], viscous: usize) -> Result<Loads, OpenFoamError> {
        let sum = |row: &[f64], groups: &[usize]| {
            std::array::from_fn(|axis| groups.iter().map(|group| row[3 * group + axis]).sum())
        };
        let history = |groups: &[usize]| {
            let rows = self.rows.iter().map(|(time, row)| (*time, sum(row, groups)));
            let history = History::new(rows);
            history.map_err(|fault| OpenFoamError::History { path: self.path.clone(), fault })
        };
        let total = history(parts)?;
        Ok(Loads {
            path: self.path.clone(),
            runs: vec![Run { since: total.times()[0], name: self.run_name(), file: self.path.clone() }],
            total,
            viscous: history(&[viscous])?,
            about: self.about,
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    const PLAIN: &str =
        "# Time total_x total_y total_z pressure_x pressure_y pressure_z viscous_x viscous_y viscous_z\n";

    /// Reads a function object of these files.
    fn output(files: &[(&str, &str)]) -> Result<SurfaceHistory, OpenFoamError> {
        let folder = tempfile::TempDir::new().unwrap();
        for (path, text) in files {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        read(folder.path(), CutOff::Refuse)
    }

    fn plain(center: &str, rows: &[f64]) -> String {
        let rows = rows.iter().map(|time| format!("{time} 1 2 3 0.9 1.9 2.9 0.1 0.1 0.1\n"));
        format!("# CofR : ({center})\n{PLAIN}{}", rows.collect::<String>())
    }

    /// As the Foundation writes it: no totals, and moments in the same file.
    fn foundation(center: &str, rows: &[f64]) -> String {
        let rows = rows.iter().map(|time| format!("{time} ((1 2 3) (0 0 0)) ((1 1 1) (0 0 0))\n"));
        let names = "# Time forces(pressure viscous) moment(pressure viscous)\n";
        format!("# CofR : ({center})\n{names}{}", rows.collect::<String>())
    }

    #[test]
    fn porous_parts_count_in_the_total() {
        let text = "# Time forces(pressure viscous porous) moment(pressure viscous porous)\n\
                    0.5 ((1 2 3) (10 20 30) (100 200 300)) ((1 1 1) (2 2 2) (3 3 3))\n";
        let load = output(&[("0/forces.dat", text)]).unwrap();
        assert_eq!(
            (load.force.values(), load.viscous.values()),
            (&[[111.0, 222.0, 333.0]][..], &[[10.0, 20.0, 30.0]][..])
        );
        assert_eq!(load.moment.unwrap().values(), [[6.0, 6.0, 6.0]]);
    }

    #[test]
    fn start_times_are_joined_in_the_order_of_time_not_of_names() {
        let (first, second, third) =
            (plain("0 0 0", &[1.0, 9.0]), plain("0 0 0", &[9.5]), plain("0 0 0", &[10.5]));
        let files = [("10/force.dat", &*third), ("0/force.dat", &*first), ("9/force.dat", &*second)];
        assert_eq!(output(&files).unwrap().force.times(), [1.0, 9.0, 9.5, 10.5]);
    }

    #[test]
    fn a_second_run_from_one_start_time_replaces_the_first() {
        // the Foundation names it by its first step, others by the start time
        for name in ["0/force_0.5.dat", "0/force_0.dat"] {
            let (first, second) = (plain("0 0 0", &[0.5, 1.0, 9.0]), plain("0 0 0", &[0.5, 0.75]));
            let load = output(&[("0/force.dat", &first), (name, &second)]).unwrap();
            assert_eq!(load.force.times(), [0.5, 0.75], "{name}");
            let alone = output(&[(name, &second)]).unwrap();
            assert_eq!(alone.force.times(), [0.5, 0.75], "{name} alone");
        }
    }

    #[test]
    fn several_second_runs_are_refused_by_name() {
        let run = plain("0 0 0", &[1.0]);
        let files = [("0/force.dat", &*run), ("0/force_0.1.dat", &*run), ("0/force_0.2.dat", &*run)];
        let error = output(&files).unwrap_err();
        assert!(matches!(error, OpenFoamError::SeveralRuns { .. }), "{error}");
        assert!(error.to_string().contains("force_0.1.dat") && error.to_string().contains("force_0.2.dat"));
    }

    #[test]
    fn a_moment_center_that_moves_is_refused() {
        let (force, moved) = (plain("0 0 0", &[1.0]), plain("0 0 1", &[2.0]));
        let files = [("0/force.dat", &*force), ("1/force.dat", &*moved)];
        assert!(matches!(output(&files), Err(OpenFoamError::MomentCenter { .. })));
    }

    /// What the refusal of these files says.
    fn refusal(files: &[(&str, &str)]) -> String {
        output(files).unwrap_err().to_string()
    }

    #[test]
    fn forces_of_a_run_without_its_moments_are_refused_by_the_missing_file() {
        let load = plain("0 0 0", &[1.5]);
        let (force, moment) = (("0/force.dat", &*load), ("0/moment.dat", &*load));
        for (files, missing) in [
            (vec![force, moment, ("1/force.dat", &*load)], "1/moment.dat is missing"),
            (vec![force, moment, ("0/force_0.5.dat", &*load)], "0/moment_0.5.dat is missing"),
            (vec![force, ("1/force.dat", &*load), ("1/moment.dat", &*load)], "0/moment.dat is missing"),
            (vec![force, moment, ("1/moment.dat", &*load)], "1/force.dat is missing"),
        ] {
            let said = refusal(&files);
            assert!(said.contains(missing), "{said}");
        }
        let forces_alone = output(&[force, ("1/force.dat", &*load)]).unwrap();
        assert!(forces_alone.moment.is_none(), "a force without moments is a force");
    }

    #[test]
    fn a_compressed_run_is_refused_and_the_message_says_gunzip() {
        let load = plain("0 0 0", &[1.5]);
        for files in [
            vec![("0/force.dat", &*load), ("1/force.dat.gz", "")],
            vec![("0/force.dat", &*load), ("0/force_0.5.dat.gz", "")],
            vec![("0/force.dat", &*load), ("0/moment.dat", &*load), ("0/moment.dat.gz", "")],
            vec![("0/forces.dat.gz", "")],
        ] {
            let (said, compressed) = (refusal(&files), files[files.len() - 1].0);
            assert!(
                said.contains(&format!("{compressed} is compressed")) && said.contains("gunzip"),
                "{said}"
            );
        }
        let unrelated = [("0/force.dat", &*load), ("0/coefficient.dat.gz", "")];
        assert!(output(&unrelated).is_ok(), "what holds no forces is not read");
    }

    #[test]
    fn two_forms_of_forces_from_one_start_time_are_refused_by_name() {
        let (old, new) = (foundation("0 0 0", &[1.0]), plain("0 0 0", &[2.0]));
        for name in ["0/force.dat", "0/force_0.5.dat"] {
            let said = refusal(&[("0/forces.dat", &old), (name, &new)]);
            assert!(
                said.contains("0/forces.dat and ") && said.contains(&format!("{name} are both")),
                "{said}"
            );
            assert!(said.contains("move the outdated file"), "{said}");
        }
        let apart = [("0/forces.dat", &*old), ("1/force.dat", &*new), ("1/moment.dat", &*new)];
        assert_eq!(output(&apart).unwrap().force.times(), [1.0, 2.0], "a restart with another version");
    }

    #[test]
    fn a_second_header_with_another_moment_center_is_refused_at_its_line() {
        let first = foundation("0 0 0", &[1.0, 2.0]);
        let moved = first.clone() + &foundation("0 0 1", &[3.0]);
        let said = refusal(&[("0/forces.dat", &moved)]);
        assert!(said.contains("forces.dat, line 5: the moment center (CofR)"), "{said}");
        let columns = plain("0 0 0", &[1.0]) + &PLAIN.replace("total", "internal") + "2 1 2 3 1 2 3 0 0 0\n";
        let said = refusal(&[("0/force.dat", &columns)]);
        assert!(said.contains("force.dat, line 4: the moment center (CofR) or the columns"), "{said}");
        let same = first + &foundation("0 0 0", &[3.0]);
        assert_eq!(output(&[("0/forces.dat", &same)]).unwrap().force.times(), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn loads_of_a_coordinate_system_are_refused_with_the_way_out() {
        let text = "# CofR : (0 0 0)\n\
                    # Time forces(pressure viscous porous) moment(pressure viscous porous)\t\
                    localForces(pressure,viscous,porous) localMoments(pressure,viscous,porous)\n\
                    1 ((1 2 3) (0 0 0) (0 0 0)) ((0 0 0) (0 0 0) (0 0 0))\n\
                    1 ((3 2 1) (0 0 0) (0 0 0)) ((0 0 0) (0 0 0) (0 0 0))\n";
        let said = refusal(&[("0/forces.dat", text)]);
        assert!(said.contains("0/forces.dat has localForces"), "{said}");
        assert!(said.contains("remove the coordinateSystem") && said.contains("foamPostProcess"), "{said}");
    }

    #[test]
    fn the_runs_of_a_history_are_those_of_its_rows() {
        let runs =
            [plain("0 0 0", &[1.0, 2.0, 3.0]), plain("0 0 0", &[2.5, 3.0]), plain("0 0 0", &[2.25, 4.0])];
        let files = [("0/force.dat", &*runs[0]), ("2/force.dat", &*runs[1]), ("2/force_2.25.dat", &*runs[2])];
        let names = |load: &SurfaceHistory, from, to| {
            load.runs_between(from, to).iter().map(|run| run.name.clone()).collect::<Vec<_>>()
        };
        let load = output(&files[..2]).unwrap();
        assert_eq!(names(&load, 0.0, 9.0), ["0", "2"]);
        assert_eq!(names(&load, 1.0, 2.0), ["0"]);
        assert_eq!(names(&load, 2.5, 3.0), ["2"]);
        let replaced = output(&files).unwrap();
        assert_eq!(names(&replaced, 0.0, 9.0), ["0", "2_2.25"], "the second run from 2 s replaces the first");
        assert_eq!(names(&replaced, f64::MAX, f64::MAX), ["2_2.25"]);
    }

    #[test]
    fn what_is_no_output_is_refused() {
        assert!(matches!(output(&[("0/coefficient.dat", "1 2")]), Err(OpenFoamError::NoForces { .. })));
        assert!(matches!(output(&[("0/force.dat", "1 2 3\n")]), Err(OpenFoamError::NoHeader { .. })));
        assert!(matches!(output(&[("0/force.dat", PLAIN)]), Err(OpenFoamError::History { .. })));
    }
}
