//! A vehicle that is small enough to be read a thousand times: a box, whose versions answer alike.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use wade_core::bundle::{self, Bundle};
use wade_core::digest::sha256;
use wade_core::vehicle::build::build;
use wade_core::vehicle::spec::VehicleSpec;

/// Its name.
pub const NAME: &str = "tiny";

const SPEC: &str = r#"
name = "tiny"
mass_kg = 20.0
center_of_mass_m = [0.0, 0.0, 0.0]
symmetric_left_right = true
[[patch]]
name = "top"
kind = "side"
normal = [0.0, 0.0, 1.0]
[[patch]]
name = "front"
kind = "front"
[[patch]]
name = "rear"
kind = "rear"
[[patch]]
name = "bottom"
kind = "bottom"
[[rule]]
patch = "bottom"
facing = [0.0, 0.0, -1.0]
within_deg = 20.0
[[rule]]
patch = "front"
facing = [1.0, 0.0, 0.0]
within_deg = 20.0
[[rule]]
patch = "rear"
facing = [-1.0, 0.0, 0.0]
within_deg = 20.0
[[rule]]
patch = "top"
"#;

/// A box around the origin as binary STL [m].
pub fn block(size: [f64; 3]) -> Vec<u8> {
    use wade_core::frame::Vec3;
    use wade_core::geometry::{mesh::Mesh, stl::write_stl};
    let corner = |i: usize| {
        let side = |bit: usize, length: f64| if i & bit == 0 { -0.5 * length } else { 0.5 * length };
        Vec3::new(side(1, size[0]), side(2, size[1]), side(4, size[2]))
    };
    let squares = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = squares.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    write_stl(&Mesh { vertices: (0..8).map(corner).collect(), faces })
}

/// The box with the weights and the waves of a shipped vehicle.
pub fn tiny() -> Bundle {
    let spec: VehicleSpec = toml::from_str(SPEC).expect("a sound spec");
    let husky = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles/husky");
    let husky = bundle::read(&husky).expect("the shipped bundles are sound");
    let vehicle = build(&spec, &block([0.8, 0.6, 0.4]), false).expect("a sound hull");
    Bundle { vehicle, effects: None, spec: None, distance: None, version: 1, ..husky }
}

/// A folder of vehicles that holds the box, without weights.
pub struct Folder {
    folder: TempDir,
    files: BTreeMap<String, Vec<u8>>,
}

impl Folder {
    /// Version 1.
    pub fn new() -> Self {
        let folder = TempDir::new_in("/dev/shm").expect("a temporary folder");
        let place = folder.path().join(NAME);
        bundle::write(&place, &Bundle { trained: None, ..tiny() }).expect("a bundle");
        let entries = fs::read_dir(&place).expect("readable").map(|entry| entry.expect("readable"));
        let read = |entry: fs::DirEntry| {
            let name = entry.file_name().into_string().expect("a name");
            (name, fs::read(entry.path()).expect("readable"))
        };
        let files = entries.map(read).filter(|(name, _)| name != "SHA256SUMS").collect();
        Self { folder, files }
    }

    /// Where it is.
    pub fn path(&self) -> PathBuf {
        self.folder.path().to_owned()
    }

    /// Puts another version in place.
    pub fn put(&self, version: u32) {
        let mut files = self.files.clone();
        let vehicle = String::from_utf8(files["vehicle.toml"].clone()).expect("text");
        let vehicle = vehicle.replacen("version = 1\n", &format!("version = {version}\n"), 1);
        files.insert("vehicle.toml".to_owned(), vehicle.clone().into_bytes());
        let sums: String = files.iter().map(|(name, bytes)| format!("{}  {name}\n", sha256(bytes))).collect();
        let place = self.folder.path().join(NAME);
        fs::write(place.join("vehicle.toml"), vehicle).expect("written");
        fs::write(place.join("SHA256SUMS"), sums).expect("written");
    }
}

impl Default for Folder {
    fn default() -> Self {
        Self::new()
    }
}
