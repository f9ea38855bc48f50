//! The folder of a report: there as a whole, or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use nix::fcntl::{AT_FDCWD, RenameFlags, renameat2};
use tempfile::TempDir;

/// The report for programs.
pub(super) const REPORT: &str = "report.json";
/// The report for people.
pub(super) const PAGE: &str = "index.html";
/// Folder of the trials that were made from recordings.
const TRIALS: &str = "trials";
/// Folder of the recordings that were generated.
const RECORDINGS: &str = "recordings";

/// A folder in the making beside its place; gone again unless it is placed.
#[derive(Debug)]
pub struct OutFolder {
    place: PathBuf,
    staged: TempDir,
}

/// Why a report cannot be put in a folder.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The disk refused.
    #[error("cannot write {}: {source}", .path.display())]
    Io {
        /// Which file or folder.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Not the name of a folder.
    #[error("{} does not name a folder: a report needs one of its own", .path.display())]
    NoName {
        /// What was given.
        path: PathBuf,
    },
    /// Something that is no part of a report.
    #[error("{} holds {name}, which is no part of a report, and would be deleted: name another folder", .path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// What it holds.
        name: String,
    },
    /// What is read lies where the report is to go.
    #[error("{} holds the data that is read, and would be deleted: name another folder", .path.display())]
    Input {
        /// The folder.
        path: PathBuf,
    },
}

impl OutFolder {
    /// Begins a folder that will take the place of `place`, which may be absent, empty, or an earlier report that does
    /// not hold `input`.
    pub fn stage(place: &Path, input: Option<&Path>) -> Result<Self, FolderError> {
        let io = |path: &Path, source| FolderError::Io { path: path.to_owned(), source };
        if place.file_name().is_none() {
            return Err(FolderError::NoName { path: place.to_owned() });
        }
        if let (Ok(place), Some(Ok(input))) = (place.canonicalize(), input.map(Path::canonicalize))
            && input.starts_with(&place)
        {
            return Err(FolderError::Input { path: place });
        }
        if let Some(name) = foreign(place).map_err(|source| io(place, source))? {
            return Err(FolderError::Foreign { path: place.to_owned(), name });
        }
        let parent = existing_ancestor(place);
        let staged =
            tempfile::Builder::new().prefix(".wade-validate-").permissions(everyone()).tempdir_in(parent);
        Ok(Self { place: place.to_owned(), staged: staged.map_err(|source| io(parent, source))? })
    }

    /// Where recordings go.
    pub fn recordings(&self) -> PathBuf {
        self.staged.path().join(RECORDINGS)
    }

    /// Where trials go.
    pub fn trials(&self) -> PathBuf {
        self.staged.path().join(TRIALS)
    }

    /// Writes the report and puts the folder in its place in one step.
    pub fn place(self, json: &str, page: &str) -> Result<(), FolderError> {
        let io = |path: &Path| {
            let path = path.to_owned();
            move |source| FolderError::Io { path, source }
        };
        for (name, text) in [(REPORT, json), (PAGE, page)] {
            let path = self.staged.path().join(name);
            fs::write(&path, text).map_err(io(&path))?;
        }
        if self.place.exists() {
            // what was there leaves with the temporary folder
            renameat2(AT_FDCWD, self.staged.path(), AT_FDCWD, &self.place, RenameFlags::RENAME_EXCHANGE)
                .map_err(|error| io(&self.place)(error.into()))
        } else {
            if let Some(parent) = self.place.parent() {
                fs::create_dir_all(parent).map_err(io(parent))?;
            }
            fs::rename(self.staged.path(), &self.place).map_err(io(&self.place))
        }
    }
}

fn everyone() -> fs::Permissions {
    std::os::unix::fs::PermissionsExt::from_mode(0o777)
}

/// The nearest folder above that exists, for the same disk.
fn existing_ancestor(place: &Path) -> &Path {
    let above = place.ancestors().skip(1).find(|path| path.is_dir());
    above.unwrap_or(Path::new("."))
}

/// What lies in a folder that is no part of a report; a folder without a report is not one to be replaced.
fn foreign(place: &Path) -> std::io::Result<Option<String>> {
    let entries = match fs::read_dir(place) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        entries => entries?,
    };
    let is_report = is_report(place);
    for entry in entries {
        let name = entry?.file_name().to_string_lossy().into_owned();
        let known = is_report && [REPORT, PAGE, TRIALS, RECORDINGS].contains(&name.as_str());
        if !known {
            return Ok(Some(name));
        }
    }
    Ok(None)
}

/// True where the report in a folder is one that `wade validate` wrote: others are of other commands, with files of their own.
fn is_report(place: &Path) -> bool {
    let text = fs::read_to_string(place.join(REPORT)).unwrap_or_default();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    ["passed", "not_tested", "subject"].iter().all(|key| report.get(key).is_some())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    #[test]
    fn the_report_of_another_command_and_what_lies_beside_it_stay() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(REPORT), r#"{"verdict": "named", "effects": []}"#).unwrap();
        fs::create_dir(folder.path().join(TRIALS)).unwrap();
        assert!(matches!(OutFolder::stage(folder.path(), None), Err(FolderError::Foreign { .. })));
        fs::write(folder.path().join(REPORT), r#"{"passed": true, "not_tested": [], "subject": {}}"#)
            .unwrap();
        assert!(OutFolder::stage(folder.path(), None).is_ok());
    }
}
