//! What OpenFOAM's function object `forces` writes: `<name>/<start time>/force.dat` and `moment.dat`.
//!
//! Three forms: vectors in parentheses (v1912), plain columns with the same names (v2212), and the Foundation's one
//! `forces.dat` with the pressure and viscous parts of forces and moments and no totals. In all of them a run that was
//! started again adds a folder named by its start time, and a file that is there already is not overwritten but joined by
//! `force_<time>.dat`, with the start time or the time of the first step. The header of all of them states the point that moments are taken about, `CofR`; a file
//! that lost it is read, and says so.

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
    /// Forces of a start time without the moments that other start times have.
    #[error("{}: moments start at {found} s and forces at {expected} s", .path.display())]
    NoMoments {
        /// The folder of the function object.
        path: PathBuf,
        /// First start time with moments [s].
        found: f64,
        /// First start time with forces [s].
        expected: f64,
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
    for (start, path) in starts(folder)? {
        for part in parts(&path, start, "forces", cut_off)? {
            // force and moment stand side by side in one file
            let [force, moment] = part.both()?;
            join(&mut forces, force, start)?;
            join(&mut moments, moment, start)?;
        }
        for part in parts(&path, start, "force", cut_off)? {
            join(&mut forces, part.one()?, start)?;
        }
        for part in parts(&path, start, "moment", cut_off)? {
            join(&mut moments, part.one()?, start)?;
        }
    }
    let forces = forces.ok_or_else(|| OpenFoamError::NoForces { path: folder.to_owned() })?;
    if let Some(moments) = &moments
        && moments.start != forces.start
    {
        let (found, expected) = (moments.start, forces.start);
        return Err(OpenFoamError::NoMoments { path: folder.to_owned(), found, expected });
    }
    Ok(SurfaceHistory {
        // one function object writes both, about one point
        about: moments.as_ref().and_then(|moments| moments.about).or(forces.about),
        force_file: forces.path,
        force: forces.total,
        viscous: forces.viscous,
        moment_file: moments.as_ref().map(|moments| moments.path.clone()),
        moment: moments.map(|moments| moments.total),
    })
}

/// Force or moment of a run, or of several joined.
struct Loads {
    path: PathBuf,
    start: f64,
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

/// A file of a start time, and the one of a second run from the same time.
fn parts(folder: &Path, start: f64, stem: &str, cut_off: CutOff) -> Result<Vec<Part>, OpenFoamError> {
    runs(folder, stem)?.into_iter().map(|path| Part::read(path, start, cut_off)).collect()
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
        let Some(rest) = name.strip_suffix(".dat").and_then(|name| name.strip_prefix(stem)) else { continue };
        let is_time = |text: &str| text.parse::<f64>().is_ok_and(f64::is_finite);
        match rest.strip_prefix('_') {
            _ if rest.is_empty() => first.push(path),
            Some(time) if is_time(time) => again.push(path),
            _ => {}
        }
    }
    again.sort();
    if let [first, second, ..] = &again[..] {
        return Err(OpenFoamError::SeveralRuns { first: first.clone(), second: second.clone() });
    }
    first.extend(again);
    Ok(first)
}

/// One file: the groups of three columns by their names, and the rows.
struct Part {
    path: PathBuf,
    start: f64,
    about: Option<Vec3>,
    groups: Vec<String>,
    rows: Vec<(f64, Vec<f64>)>,
}

impl Part {
    fn read(path: PathBuf, start: f64, cut_off: CutOff) -> Result<Self, OpenFoamError> {
        let text = match fs::read_to_string(&path) {
            Ok(text) => text.replace(['(', ')'], " "),
            Err(fault) => return Err(OpenFoamError::Io { path, fault }),
        };
        let mut part = Self { path, start, about: None, groups: Vec::new(), rows: Vec::new() };
        let lines = Lines::new(&text, cut_off);
        for (number, line) in lines.iter() {
            if let Some(comment) = line.strip_prefix('#') {
                part.header(comment);
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
        Ok(Loads {
            path: self.path.clone(),
            start: self.start,
            total: history(parts)?,
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

    #[test]
    fn moments_that_begin_later_than_forces_are_refused() {
        let load = plain("0 0 0", &[1.5]);
        let files = [("0/force.dat", &*load), ("1/force.dat", &*load), ("1/moment.dat", &*load)];
        assert!(matches!(output(&files), Err(OpenFoamError::NoMoments { found: 1.0, expected: 0.0, .. })));
        assert!(output(&files[..2]).unwrap().moment.is_none(), "a force without moments is a force");
    }

    #[test]
    fn what_is_no_output_is_refused() {
        assert!(matches!(output(&[("0/coefficient.dat", "1 2")]), Err(OpenFoamError::NoForces { .. })));
        assert!(matches!(output(&[("0/force.dat", "1 2 3\n")]), Err(OpenFoamError::NoHeader { .. })));
        assert!(matches!(output(&[("0/force.dat", PLAIN)]), Err(OpenFoamError::History { .. })));
    }
}
