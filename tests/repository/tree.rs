//! Promise: the repository stays small. No file is there twice, and none that a command makes from the others.

#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::process::Command;

/// Bytes of all files that git tracks: 14.5 MB, of which 5.4 are the campaigns that the shipped weights were trained on, and 2 kB
/// for each of the 300 cases of the campaign `drive` and the 500 of other hulls.
const MAX_TREE_BYTES: u64 = 14_500_000 + 800 * 2_000;

/// Files that git tracks and that are there; none outside a checkout, such as a source archive.
fn tracked() -> Vec<PathBuf> {
    let root = crate::root();
    let output = Command::new("git").args(["ls-files", "-z"]).current_dir(&root).output();
    let Some(output) = output.ok().filter(|output| output.status.success()) else {
        println!("no checkout: the tree is not looked at");
        return Vec::new();
    };
    let names = String::from_utf8(output.stdout).unwrap();
    let paths = names.split('\0').filter(|name| !name.is_empty()).map(|name| root.join(name));
    paths.filter(|path| path.is_file()).collect()
}

/// What one sees at the root; beside it there are dot files alone.
const ROOT: [&str; 18] = [
    "CHANGELOG.md",
    "CITATION.cff",
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "README.md",
    "benches",
    "campaigns",
    "clients",
    "crates",
    "deploy",
    "docs",
    "justfile",
    "proto",
    "src",
    "tests",
    "vehicles",
];

#[test]
fn the_root_holds_what_is_listed_and_nothing_else() {
    let root = crate::root();
    let first = |path: PathBuf| {
        let relative = path.strip_prefix(&root).unwrap().to_owned();
        relative.components().next().unwrap().as_os_str().to_str().unwrap().to_owned()
    };
    let mut seen: BTreeSet<String> = tracked().into_iter().map(first).collect();
    seen.retain(|name| !name.starts_with('.'));
    if !seen.is_empty() {
        assert_eq!(seen, ROOT.map(str::to_owned).into());
    }
}

#[test]
fn the_tree_holds_no_more_than_what_it_has_room_for() {
    let mut sizes: Vec<(u64, PathBuf)> =
        tracked().into_iter().map(|path| (path.metadata().unwrap().len(), path)).collect();
    sizes.sort();
    let total: u64 = sizes.iter().map(|(bytes, _)| bytes).sum();
    println!("{} files, {total} bytes", sizes.len());
    let largest = &sizes[sizes.len().saturating_sub(12)..];
    assert!(total <= MAX_TREE_BYTES, "{total} bytes; the largest: {largest:#?}");
}

#[test]
fn no_large_file_is_there_twice_and_none_is_a_page_or_a_distance_grid() {
    // licences, empty modules and small fixtures may well be alike
    const SMALL_BYTES: u64 = 8_192;
    let mut seen: BTreeMap<Vec<u8>, PathBuf> = BTreeMap::new();
    for path in tracked() {
        let name = path.file_name().unwrap().to_str().unwrap();
        let folder = path.parent().unwrap().to_str().unwrap();
        assert!(!name.starts_with("sdf."), "{}: wade vehicle sdf makes it", path.display());
        assert!(!folder.contains(".versions"), "{}: versions are for whoever made them", path.display());
        let page =
            name.ends_with(".html") && ["/campaigns", "/benches"].iter().any(|part| folder.contains(part));
        assert!(!page, "{}: a command renders it", path.display());
        if path.metadata().unwrap().len() >= SMALL_BYTES {
            let same = seen.insert(std::fs::read(&path).unwrap(), path.clone());
            assert!(same.is_none(), "{} has the bytes of {}", path.display(), same.unwrap().display());
        }
    }
}
