//! A bundle of which somebody wrote one file, with checksums that hold: refused with the file's name, or served.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use tempfile::TempDir;
use wade_core::bundle;
use wade_core::digest::sha256;
use wade_core::model::kernel::Isa;
use wade_simulation::bundle::tiny;
use wade_wire::State;

use crate::bundles::every_effect;
use crate::state::answered;

/// The files that serving reads, but for those whose bytes are a hundred times as many as they say something: weights
/// and samples, which `read` gets with their first bytes replaced.
const FILES: [&str; 7] = [
    "vehicle.toml",
    "hull.stl",
    "patches.safetensors",
    "radiation.safetensors",
    "effects.toml",
    "network.safetensors",
    "submergence.safetensors",
];

struct Base {
    folder: TempDir,
    files: BTreeMap<&'static str, Vec<u8>>,
}

thread_local! {
    static BASE: Base = base();
}

fn base() -> Base {
    let folder = TempDir::new_in("/dev/shm").expect("a temporary folder");
    let place = folder.path().join("tiny");
    bundle::write(&place, &tiny()).expect("a bundle");
    bundle::apply(&place, every_effect("tiny")).expect("effects");
    let files = FILES.map(|name| (name, fs::read(place.join(name)).expect("a file of the bundle"))).into();
    Base { folder, files }
}

/// Which file, then its bytes; of the last two the first ones.
pub fn run(bytes: &[u8]) {
    let Some((&number, bytes)) = bytes.split_first() else { return };
    BASE.with(|base| {
        let name = FILES[usize::from(number) % FILES.len()];
        let mut files = base.files.clone();
        let file = files.entry(name).or_default();
        match name {
            "network.safetensors" | "submergence.safetensors" => {
                let len = bytes.len().min(file.len());
                file[..len].copy_from_slice(&bytes[..len]);
            }
            _ => *file = bytes.to_vec(),
        }
        // what the effects were fitted to is the weights that are there
        if name == "network.safetensors" {
            files.remove("effects.toml");
        }
        let place = base.folder.path().join("tiny");
        read(&place, &files);
    });
}

fn read(place: &Path, files: &BTreeMap<&str, Vec<u8>>) {
    let _ = fs::remove_dir_all(place);
    fs::create_dir(place).expect("a folder");
    let sums: String = files.iter().map(|(name, bytes)| format!("{}  {name}\n", sha256(bytes))).collect();
    fs::write(place.join("SHA256SUMS"), sums).expect("written");
    for (name, bytes) in files {
        fs::write(place.join(name), bytes).expect("written");
    }
    match bundle::load_served(place, Isa::available()[0]) {
        Err(error) => assert!(error.to_string().contains("tiny"), "{error}"),
        Ok(vehicle) => {
            let state = |depth, velocity, gravity| State { depth, velocity, gravity, ..State::default() };
            answered(&vehicle, &state(0.2, [0.5, 0.1, 0.0], [0.0, 0.0, -1.0]));
            answered(&vehicle, &state(0.1, [0.0, 0.0, -0.1], [0.1, 0.2, -0.97]));
        }
    }
}

/// Each file as it is written, or its first bytes.
pub fn seeds() -> Vec<Vec<u8>> {
    let most = 4 << 10;
    BASE.with(|base| {
        let seed = |(number, name): (usize, &&str)| {
            let bytes = &base.files[name];
            [&[u8::try_from(number).expect("few")], &bytes[..bytes.len().min(most)]].concat()
        };
        let whole = FILES.iter().enumerate().filter(|(_, name)| base.files[**name].len() <= most * 4);
        let whole = whole
            .map(|(number, name)| [&[u8::try_from(number).expect("few")], &base.files[name][..]].concat());
        FILES.iter().enumerate().map(seed).chain(whole).collect()
    })
}
