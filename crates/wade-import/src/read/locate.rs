//! Where the mesh files of a robot are.

use std::path::{Path, PathBuf};

/// Folders above the description in which packages are looked for.
const MOST_PARENTS: usize = 8;

/// Looks for the meshes of one description.
#[derive(Debug, Clone, PartialEq)]
pub struct Locator {
    folder: PathBuf,
    beside: Vec<PathBuf>,
}

impl Locator {
    /// Meshes of `description`, or of the files named beside it.
    pub fn new(description: &Path, beside: Vec<PathBuf>) -> Self {
        let absolute = std::fs::canonicalize(description).unwrap_or_else(|_| description.to_owned());
        let folder = absolute.parent().map_or_else(PathBuf::new, Path::to_owned);
        Self { folder, beside }
    }

    /// The file of a reference, or the places where it is not. `package://` and `model://` start with a folder that
    /// the description or one of its parents lies in.
    pub fn find(&self, reference: &str, folders: &[&str]) -> Result<PathBuf, Vec<PathBuf>> {
        // as it stands, and as the address that it may be
        let address = decoded(reference);
        let references = [Some(reference), Some(&*address).filter(|address| *address != reference)];
        let references: Vec<&str> = references.into_iter().flatten().collect();
        if let Some(named) = references.iter().find_map(|reference| self.named(reference)) {
            return Ok(named.to_owned());
        }
        let tried: Vec<PathBuf> =
            references.iter().flat_map(|reference| self.places(reference, folders)).collect();
        tried.iter().find(|path| path.is_file()).cloned().ok_or(tried)
    }

    fn places(&self, reference: &str, folders: &[&str]) -> Vec<PathBuf> {
        let mut places = Vec::new();
        let package = ["package://", "model://"].iter().find_map(|scheme| reference.strip_prefix(scheme));
        match package {
            Some(path) => {
                let (package, rest) = path.split_once('/').unwrap_or(("", path));
                for parent in self.folder.ancestors().take(MOST_PARENTS) {
                    places.push(parent.join(package).join(rest));
                    if parent.file_name().is_some_and(|own| own == package) {
                        places.push(parent.join(rest));
                    }
                }
                places.push(self.folder.join(rest));
            }
            None => {
                let path = reference.strip_prefix("file://").unwrap_or(reference);
                places.extend(folders.iter().map(|folder| self.folder.join(folder).join(path)));
                places.push(self.folder.join(path));
            }
        }
        places
    }

    /// Of the files that were named beside the description the one whose path ends as the reference does, in as many parts as
    /// any of them and in its file name at least.
    fn named(&self, reference: &str) -> Option<&Path> {
        let parts = |path: &str| -> Vec<String> {
            path.rsplit(['/', '\\'])
                .filter(|part| !matches!(*part, "" | "." | ".."))
                .map(str::to_owned)
                .collect()
        };
        let asked = parts(reference);
        let alike = |file: &PathBuf| {
            let own = parts(&file.to_string_lossy());
            own.iter().zip(&asked).take_while(|(own, asked)| own == asked).count()
        };
        let best = self.beside.iter().rev().max_by_key(|file| alike(file))?;
        (alike(best) > 0).then_some(best)
    }
}

/// A reference with the bytes that an address writes as `%20`.
pub fn decoded(reference: &str) -> String {
    percent_encoding::percent_decode_str(reference).decode_utf8_lossy().into_owned()
}
