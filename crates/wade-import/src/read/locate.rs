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
        let name = reference.rsplit(['/', '\\']).next().unwrap_or(reference);
        let named = self.beside.iter().find(|file| file.file_name().is_some_and(|own| own == name));
        if let Some(named) = named {
            return Ok(named.clone());
        }
        let mut tried: Vec<PathBuf> = Vec::new();
        let package = ["package://", "model://"].iter().find_map(|scheme| reference.strip_prefix(scheme));
        match package {
            Some(path) => {
                let (package, rest) = path.split_once('/').unwrap_or(("", path));
                for parent in self.folder.ancestors().take(MOST_PARENTS) {
                    tried.push(parent.join(package).join(rest));
                    if parent.file_name().is_some_and(|own| own == package) {
                        tried.push(parent.join(rest));
                    }
                }
                tried.push(self.folder.join(rest));
            }
            None => {
                let path = reference.strip_prefix("file://").unwrap_or(reference);
                tried.extend(folders.iter().map(|folder| self.folder.join(folder).join(path)));
                tried.push(self.folder.join(path));
            }
        }
        tried.iter().find(|path| path.is_file()).cloned().ok_or(tried)
    }
}
