//! The paper's network, trained on the committed CFD: the weights that the shipped ones are compared with.

use std::path::{Path, PathBuf};

/// Weights of the paper's form, of the same data and held-out cases as the shipped ones.
pub fn network() -> PathBuf {
    super::root().join("tests/fixtures/paper/network.safetensors")
}

/// Puts the paper's network in the place of the weights of a bundle, which is a copy of a shipped one.
///
/// Both vehicles share the network; the standard deviations that it states are those of the Husky.
pub fn put_into(bundle: &Path) {
    let bytes = std::fs::read(network()).expect("the fixture is there");
    let sums = std::fs::read_to_string(bundle.join("SHA256SUMS")).expect("readable");
    let line = |line: &str| match line.ends_with("  network.safetensors") {
        true => format!("{}  network.safetensors\n", wade_core::digest::sha256(&bytes)),
        false => format!("{line}\n"),
    };
    std::fs::write(bundle.join("SHA256SUMS"), sums.lines().map(line).collect::<String>()).expect("written");
    std::fs::write(bundle.join("network.safetensors"), bytes).expect("written");
}
