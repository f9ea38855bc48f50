//! The OpenFOAM that is installed: where it is, which version, and whether it can be trusted on cells that are not
//! boxes along the axes.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde::{Deserialize, Serialize};

/// How to get one.
const HOW_TO_INSTALL: &str = "install it with `apt-get install openfoam` (Debian, v1912) or from openfoam.com \
    (v2212 or later), or set WM_PROJECT_DIR to where it is";

/// The oldest version that the case files are written for.
const OLDEST: u32 = 1912;

/// Programs that a case needs.
const PROGRAMS: [&str; 5] = ["blockMesh", "snappyHexMesh", "setFields", "potentialFoam", "interFoam"];

/// Whether the cells at the hull follow it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MeshKind {
    /// Boxes along the axes; the hull is a staircase.
    Castellated,
    /// The cells at the hull are moved onto it.
    Snapped,
}

/// A solver that can run here.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OpenFoam {
    /// Its folder.
    pub root: PathBuf,
    /// Version as year and month, 1912 for December 2019.
    pub version: u32,
    /// The mesh that it computes rightly.
    pub mesh_kind: MeshKind,
    /// Folder of its programs; `None` where they are on the path already.
    programs: Option<PathBuf>,
}

/// Why there is none.
#[derive(Debug, thiserror::Error)]
pub enum OpenFoamError {
    /// Not found.
    #[error("no OpenFOAM found: {HOW_TO_INSTALL}")]
    Missing,
    /// A program of it is missing.
    #[error("OpenFOAM in {root} has no `{program}`: {HOW_TO_INSTALL}")]
    Program {
        /// Its folder.
        root: PathBuf,
        /// Name of the program.
        program: &'static str,
    },
    /// A version that cannot be read or is too old.
    #[error(
        "OpenFOAM in {root} says it is version `{version}`; v{OLDEST} and later of openfoam.com are supported"
    )]
    Version {
        /// Its folder.
        root: PathBuf,
        /// What it says.
        version: String,
    },
    /// The check on a turned cell did not run.
    #[error("the check of OpenFOAM on a turned cell failed: {message}")]
    Check {
        /// What went wrong.
        message: String,
    },
    /// A file that cannot be written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

impl OpenFoam {
    /// Finds one: `WM_PROJECT_DIR`, else the places of the usual packages; then checks it on a cell.
    pub fn find() -> Result<Self, OpenFoamError> {
        let root = std::env::var_os("WM_PROJECT_DIR").map(PathBuf::from).or_else(usual_place);
        let root = root.ok_or(OpenFoamError::Missing)?;
        let version = version_of(&root)?;
        let programs = (!on_path(PROGRAMS[4])).then(|| program_folder(&root)).flatten();
        let mut found = Self { root, version, mesh_kind: MeshKind::Castellated, programs };
        for program in PROGRAMS {
            if !found.programs.as_ref().map_or_else(|| on_path(program), |dir| dir.join(program).is_file()) {
                return Err(OpenFoamError::Program { root: found.root, program });
            }
        }
        if found.reconstructs_turned_cells()? {
            found.mesh_kind = MeshKind::Snapped;
        }
        Ok(found)
    }

    /// What data of this solver are labelled with.
    pub fn label(&self) -> String {
        let mesh = match self.mesh_kind {
            MeshKind::Castellated => "castellated",
            MeshKind::Snapped => "snapped",
        };
        format!("openfoam v{} interFoam k-omega-SST, {mesh} mesh", self.version)
    }

    /// A program of it, with the environment that it needs.
    pub fn command(&self, program: &str) -> Command {
        let path = self.programs.as_ref().map_or_else(|| PathBuf::from(program), |dir| dir.join(program));
        let mut command = Command::new(path);
        command
            .env("WM_PROJECT", "OpenFOAM")
            .env("WM_PROJECT_DIR", &self.root)
            .env("WM_PROJECT_VERSION", format!("v{}", self.version))
            .stdin(Stdio::null());
        command
    }

    /// True when the velocity that is rebuilt from the fluxes of a uniform flow is uniform on turned cells.
    ///
    /// Debian's v1912 gets it wrong there, and only there: snapped meshes blow up within steps.
    fn reconstructs_turned_cells(&self) -> Result<bool, OpenFoamError> {
        let folder = tempfile::tempdir().map_err(|source| io(Path::new("temporary folder"), source))?;
        for (path, text) in turned_cells() {
            let path = folder.path().join(path);
            path.parent().map_or(Ok(()), std::fs::create_dir_all).map_err(|source| io(&path, source))?;
            std::fs::write(&path, text).map_err(|source| io(&path, source))?;
        }
        for program in ["blockMesh", "potentialFoam"] {
            let output = self.command(program).current_dir(folder.path()).output();
            let output = output.map_err(|source| io(Path::new(program), source))?;
            if !output.status.success() {
                let text = String::from_utf8_lossy(&output.stderr);
                let message = format!("{program}: {}", text.lines().take(6).collect::<Vec<_>>().join(" "));
                return Err(OpenFoamError::Check { message });
            }
        }
        let path = folder.path().join("0/U");
        let text = std::fs::read_to_string(&path).map_err(|source| io(&path, source))?;
        let velocities = internal_vectors(&text);
        if velocities.is_empty() {
            return Err(OpenFoamError::Check { message: "potentialFoam wrote no velocity".into() });
        }
        let (sin, cos) = TURN.sin_cos();
        Ok(velocities.iter().all(|u| (u[0] - cos).hypot(u[1] - sin).hypot(u[2]) < 1e-2))
    }
}

/// The vectors of the internal field of an ASCII `volVectorField`; a uniform one gives a single vector.
pub fn internal_vectors(text: &str) -> Vec<[f64; 3]> {
    let start = text.find("internalField").unwrap_or(text.len());
    let end = text.find("boundaryField").unwrap_or(text.len());
    let field = text.get(start..end).unwrap_or_default();
    let triples = field.split('(').skip(1).filter_map(|rest| rest.split(')').next());
    triples
        .filter_map(|triple| {
            let mut numbers = triple.split_ascii_whitespace().map(str::parse);
            match (numbers.next(), numbers.next(), numbers.next(), numbers.next()) {
                (Some(Ok(x)), Some(Ok(y)), Some(Ok(z)), None) => Some([x, y, z]),
                _ => None,
            }
        })
        .collect()
}

fn io(path: &Path, source: std::io::Error) -> OpenFoamError {
    OpenFoamError::Io { path: path.to_owned(), source }
}

fn usual_place() -> Option<PathBuf> {
    let debian = PathBuf::from("/usr/share/openfoam");
    if debian.join("etc").is_dir() {
        return Some(debian);
    }
    let packages = std::fs::read_dir("/usr/lib/openfoam").ok()?;
    let mut folders: Vec<PathBuf> = packages.flatten().map(|entry| entry.path()).collect();
    folders.sort();
    folders.into_iter().rfind(|folder| folder.join("etc/bashrc").is_file())
}

/// `v2212` from `etc/bashrc`, where every package of openfoam.com states it, else from the name of the folder.
fn version_of(root: &Path) -> Result<u32, OpenFoamError> {
    let bashrc = std::fs::read_to_string(root.join("etc/bashrc")).unwrap_or_default();
    let stated = bashrc.lines().find_map(|line| line.trim().strip_prefix("export WM_PROJECT_VERSION="));
    let stated = stated.map(|rest| rest.split_ascii_whitespace().next().unwrap_or_default().to_owned());
    let named = || root.file_name().map(|name| name.to_string_lossy().replace("openfoam", ""));
    let text = stated.or_else(named).unwrap_or_default();
    let digits = text.trim_start_matches(['v', 'V']);
    match digits.parse() {
        // OpenFOAM-9 and the like are of the other foundation, whose dictionaries differ
        Ok(version) if version >= OLDEST => Ok(version),
        _ => Err(OpenFoamError::Version { root: root.to_owned(), version: text }),
    }
}

fn on_path(program: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(program).is_file())
}

fn program_folder(root: &Path) -> Option<PathBuf> {
    let platforms = std::fs::read_dir(root.join("platforms")).ok()?;
    let folders = platforms.flatten().map(|entry| entry.path().join("bin"));
    folders.into_iter().find(|folder| folder.join("interFoam").is_file())
}

/// By how much the cells of the check are turned about z [rad].
const TURN: f64 = std::f64::consts::FRAC_PI_6;

/// A turned block of eight cells with a uniform flow of 1 m/s through it.
fn turned_cells() -> [(&'static str, String); 6] {
    let (sin, cos) = TURN.sin_cos();
    let corner = |x: f64, y: f64, z: f64| format!("({} {} {z})", cos * x - sin * y, sin * x + cos * y);
    // a cube would not do: the area tensor of its faces is the same however it is turned
    let base = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.0, 0.5)];
    let corners: String = [0.0, 0.25].iter().flat_map(|z| base.map(|(x, y)| corner(x, y, *z))).collect();
    let header =
        |class: &str| format!("FoamFile {{ version 2.0; format ascii; class {class}; object x; }}\n");
    let dictionary = header("dictionary");
    [
        (
            "system/blockMeshDict",
            format!(
                "{dictionary}vertices ({corners});\nblocks (hex (0 1 2 3 4 5 6 7) (2 2 2) simpleGrading (1 1 1));\n\
                 boundary (inlet {{ type patch; faces ((3 0 4 7)); }} outlet {{ type patch; faces ((1 2 6 5)); }} \
                 sides {{ type patch; faces ((0 3 2 1) (4 5 6 7) (0 1 5 4) (2 3 7 6)); }});\n"
            ),
        ),
        (
            "system/controlDict",
            format!(
                "{dictionary}application potentialFoam; startTime 0; endTime 1; deltaT 1; writeControl timeStep; \
                 writeInterval 1; writeFormat ascii; writePrecision 9;\n"
            ),
        ),
        (
            "system/fvSchemes",
            format!(
                "{dictionary}ddtSchemes {{ default steadyState; }} gradSchemes {{ default Gauss linear; }} \
                 divSchemes {{ default none; div(phi,U) Gauss linear; div(div(phi,U)) Gauss linear; }} \
                 laplacianSchemes {{ default Gauss linear corrected; }} interpolationSchemes {{ default linear; }} \
                 snGradSchemes {{ default corrected; }}\n"
            ),
        ),
        (
            "system/fvSolution",
            format!(
                "{dictionary}solvers {{ Phi {{ solver PCG; preconditioner DIC; tolerance 1e-12; relTol 0; }} }} \
                 potentialFlow {{ nNonOrthogonalCorrectors 0; }}\n"
            ),
        ),
        (
            "0/U",
            format!(
                "{}dimensions [0 1 -1 0 0 0 0];\ninternalField uniform (0 0 0);\nboundaryField {{ \
                 inlet {{ type fixedValue; value uniform ({cos} {sin} 0); }} outlet {{ type zeroGradient; }} \
                 sides {{ type slip; }} }}\n",
                header("volVectorField")
            ),
        ),
        (
            "0/p",
            format!(
                "{}dimensions [0 2 -2 0 0 0 0];\ninternalField uniform 0;\nboundaryField {{ \
                 outlet {{ type fixedValue; value uniform 0; }} \"(inlet|sides)\" {{ type zeroGradient; }} }}\n",
                header("volScalarField")
            ),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_vectors_of_uniform_and_listed_fields() {
        let listed = "dimensions [0 1 -1 0 0 0 0];\ninternalField nonuniform List<vector>\n2\n(\n(1 0 -2e-3)\n(0 1 2)\n)\n;\nboundaryField { a { value uniform (9 9 9); } }";
        assert_eq!(internal_vectors(listed), [[1.0, 0.0, -2e-3], [0.0, 1.0, 2.0]]);
        assert_eq!(internal_vectors("internalField uniform (1 2 3);\nboundaryField"), [[1.0, 2.0, 3.0]]);
    }
}
