//! Promise: a bundle comes back as it was written, and a damaged one is refused with the file and the fault named.

use std::path::Path;

use crate::common::{VEHICLES, copy_of_vehicles, vehicles};
use proptest::prelude::*;
use sha2::{Digest, Sha256};
use wade_core::bundle::{self, Bundle};
use wade_core::geometry::distance::SignedDistanceGrid;
use wade_core::model::kernel::Isa;

fn refusal(folder: &Path) -> String {
    let isa = Isa::available()[0];
    bundle::load(folder, isa).expect_err("refused").to_string()
}

/// Changes a file and mends its checksum, so that what is tested is the check behind it.
fn replace(folder: &Path, name: &str, change: impl FnOnce(Vec<u8>) -> Vec<u8>) {
    let bytes = change(std::fs::read(folder.join(name)).expect("readable"));
    let sum: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    std::fs::write(folder.join(name), bytes).expect("written");
    let sums = std::fs::read_to_string(folder.join("SHA256SUMS")).expect("readable");
    let mend = |line: &str| {
        if line.ends_with(&format!("  {name}")) { format!("{sum}  {name}\n") } else { format!("{line}\n") }
    };
    std::fs::write(folder.join("SHA256SUMS"), sums.lines().map(mend).collect::<String>()).expect("written");
}

fn text(change: impl FnOnce(String) -> String) -> impl FnOnce(Vec<u8>) -> Vec<u8> {
    move |bytes| change(String::from_utf8(bytes).expect("text")).into_bytes()
}

/// Puts one text in the place of another as long.
fn header(from: &'static str, to: &'static str) -> impl FnOnce(Vec<u8>) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    move |mut bytes| {
        let at = bytes.windows(from.len()).position(|window| window == from.as_bytes()).expect("in the file");
        bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
        bytes
    }
}

#[test]
fn what_is_written_is_read_back() {
    let folder = tempfile::TempDir::new().expect("a folder");
    for name in VEHICLES {
        let original = bundle::read(&vehicles().join(name)).expect("sound");
        let copy_path = folder.path().join(name);
        bundle::write(&copy_path, &original).expect("written");
        let Bundle { vehicle, version, trained, radiation, effects, distance, spec } =
            bundle::read(&copy_path).expect("sound");
        assert_eq!((vehicle, version, spec), (original.vehicle, original.version, original.spec));
        assert_eq!((effects, radiation), (original.effects, original.radiation));
        let (weights, domain) = trained.expect("trained");
        let (original_weights, original_domain) = original.trained.expect("trained");
        assert_eq!((weights, domain), (original_weights, original_domain));
        assert_eq!(distance, None, "nothing that is served needs a grid");
    }
}

#[test]
fn a_bundle_with_a_distance_grid_is_read_and_its_grid_verified() {
    let copy = copy_of_vehicles();
    let folder = copy.path().join("husky");
    let mut bundle = bundle::read(&folder).expect("sound");
    let grid = SignedDistanceGrid::with_spacing(&bundle.vehicle.hull.mesh, 0.1, 0.5, &|_, _| {});
    let grid = grid.expect("a closed hull");
    bundle.distance = Some(grid.clone());
    bundle::write(&folder, &bundle).expect("written");
    let read = bundle::read(&folder).expect("sound").distance.expect("a grid");
    let rounding = read.values.iter().zip(&grid.values).map(|(a, b)| (a - b).abs());
    assert!(rounding.fold(0.0, f32::max) < 1e-4);
    let path = folder.join("sdf.safetensors");
    let mut bytes = std::fs::read(&path).expect("readable");
    *bytes.last_mut().expect("not empty") ^= 1;
    std::fs::write(&path, bytes).expect("written");
    assert!(refusal(&folder).contains("sdf.safetensors"), "{}", refusal(&folder));
    std::fs::remove_file(&path).expect("removed");
    assert!(refusal(&folder).contains("sdf.safetensors"), "listed in SHA256SUMS: {}", refusal(&folder));
}

#[test]
fn writing_twice_gives_the_same_bytes() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let original = bundle::read(&vehicles().join("husky")).expect("sound");
    let sums = |name: &str| {
        let path = folder.path().join(name).join("husky");
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("made");
        bundle::write(&path, &original).expect("written");
        std::fs::read(path.join("SHA256SUMS")).expect("readable")
    };
    assert_eq!(sums("first"), sums("second"));
}

#[test]
fn the_shipped_hulls_are_what_the_generator_makes() {
    for (name, shipped) in VEHICLES
        .into_iter()
        .zip([wade_core::vehicle::shipped::husky(), wade_core::vehicle::shipped::warthog()])
    {
        let made = shipped.expect("a sound spec").vehicle().expect("a sound hull");
        let read = bundle::read(&vehicles().join(name)).expect("sound").vehicle;
        assert_eq!(made, read, "{name}: run wade vehicle generate, then wade train");
    }
}

#[test]
fn every_file_is_needed_and_its_absence_named() {
    for name in [
        "vehicle.toml",
        "hull.stl",
        "patches.safetensors",
        "submergence.safetensors",
        "network.safetensors",
        "SHA256SUMS",
    ] {
        let copy = copy_of_vehicles();
        let folder = copy.path().join("husky");
        std::fs::remove_file(folder.join(name)).expect("removed");
        assert!(refusal(&folder).contains(name), "{name}: {}", refusal(&folder));
    }
}

/// What a test does to the bytes of a file.
type Change = Box<dyn FnOnce(Vec<u8>) -> Vec<u8>>;

#[test]
fn faults_behind_a_good_checksum_are_named() {
    let nan = |tensor: &'static str| {
        move |mut bytes: Vec<u8>| {
            // the header's length, the header, then the tensors where the header says
            let header = u64::from_le_bytes(bytes[..8].try_into().expect("eight bytes")) as usize;
            let json: serde_json::Value = serde_json::from_slice(&bytes[8..8 + header]).expect("a header");
            let start = 8 + header + json[tensor]["data_offsets"][0].as_u64().expect("an offset") as usize;
            bytes[start..start + 4].copy_from_slice(&f32::NAN.to_le_bytes());
            bytes
        }
    };
    let cases: Vec<(&str, Change, &str)> = vec![
        ("network.safetensors", Box::new(nan("w2")), "tensor w2"),
        ("network.safetensors", Box::new(nan("global_std")), "tensor global_std"),
        ("network.safetensors", Box::new(header("[256,256]", "[128,512]")), "network.safetensors"),
        (
            "network.safetensors",
            Box::new(header("froude_depth", "froude_width")),
            "trained on other features",
        ),
        (
            "network.safetensors",
            Box::new(header("windward drag", "standing drag")),
            "the weights are a remainder of archimedes + standing drag of the soaked part, force and moment, not of physical base without waves, force and moment or of archimedes + windward drag of the soaked part, force and moment: train them again",
        ),
        ("vehicle.toml", Box::new(text(|t| t.replacen("format = 1", "format = 2", 1))), "newer"),
        (
            "vehicle.toml",
            Box::new(text(|t| t.replacen("name = \"husky\"", "name = \"../../etc\"", 1))),
            "name",
        ),
        ("vehicle.toml", Box::new(text(|t| t.replacen("name = \"husky\"", "name = \"other\"", 1))), "folder"),
        ("vehicle.toml", Box::new(text(|t| t.replacen("mass_kg = 50.0", "mass_kg = nan", 1))), "mass"),
        (
            "vehicle.toml",
            Box::new(text(|t| t.replacen("provenance = \"", "provenance = \"another ", 1))),
            "provenance",
        ),
        ("vehicle.toml", Box::new(text(|t| format!("colour = \"red\"\n{t}"))), "colour"),
        (
            "patches.safetensors",
            Box::new(|mut bytes| {
                let end = bytes.len();
                bytes[end - 1] = 0xff;
                bytes
            }),
            "vehicle.toml",
        ),
        (
            "hull.stl",
            Box::new(|mut bytes| {
                bytes.truncate(1000);
                bytes
            }),
            "hull.stl",
        ),
        ("submergence.safetensors", Box::new(nan("points")), "tensor points"),
    ];
    for (file, change, expected) in cases {
        let copy = copy_of_vehicles();
        let folder = copy.path().join("husky");
        replace(&folder, file, change);
        let message = refusal(&folder);
        assert!(message.contains(expected), "{file}, expected {expected}: {message}");
    }
}

#[test]
fn weights_of_another_release_do_not_stand_in_the_way_of_new_ones() {
    let copy = copy_of_vehicles();
    let folder = copy.path().join("husky");
    replace(&folder, "network.safetensors", header("windward drag", "standing drag"));
    let refused = bundle::read(&folder).expect_err("refused").to_string();
    assert!(refused.contains("train them again"), "{refused}");
    let bundle = bundle::read_without_weights(&folder).expect("the vehicle is as it was");
    assert!(bundle.trained.is_none() && bundle.vehicle.name == "husky");
    replace(&folder, "hull.stl", |_| Vec::new());
    bundle::read_without_weights(&folder).expect_err("another fault");
}

#[test]
fn a_bundle_without_weights_and_base_is_sound_but_not_served() {
    let copy = copy_of_vehicles();
    let folder = copy.path().join("husky");
    let mut untrained = bundle::read(&folder).expect("sound");
    (untrained.trained, untrained.radiation) = (None, None);
    bundle::write(&folder, &untrained).expect("written");
    assert!(bundle::read(&folder).expect("sound").trained.is_none());
    assert!(refusal(&folder).contains("train"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_flipped_bit_anywhere_is_found(file in 0..7_usize, place in 0.0..1.0_f64, bit in 0..8_u8) {
        let names = ["vehicle.toml", "hull.stl", "patches.safetensors", "submergence.safetensors", "network.safetensors",
                     "radiation.safetensors", "SHA256SUMS"];
        let copy = copy_of_vehicles();
        let path = copy.path().join("husky").join(names[file]);
        let mut bytes = std::fs::read(&path).expect("readable");
        let at = ((bytes.len() - 1) as f64 * place) as usize;
        bytes[at] ^= 1 << bit;
        std::fs::write(&path, bytes).expect("written");
        bundle::load(&copy.path().join("husky"), Isa::available()[0]).expect_err("refused");
    }

    #[test]
    fn a_truncated_or_garbled_file_never_panics(file in 0..5_usize, keep in 0.0..1.0_f64, garbage in any::<Vec<u8>>()) {
        let names = ["vehicle.toml", "hull.stl", "patches.safetensors", "submergence.safetensors", "network.safetensors"];
        let copy = copy_of_vehicles();
        let folder = copy.path().join("husky");
        replace(&folder, names[file], |mut bytes| {
            bytes.truncate((bytes.len() as f64 * keep) as usize);
            bytes.extend(garbage);
            bytes
        });
        // with its checksum mended the parsers themselves are reached; some changes are harmless, none may panic
        let _ = bundle::read(&folder);
    }
}
