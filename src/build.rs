//! Embeds the commit. Nothing else.

use std::{env, path::PathBuf, process::Command};

/// Embeds the short commit, with a plus sign where the tree differs from it; `unknown` outside a checkout. The variable
/// WADE_COMMIT wins, for builds from an archive. Only a release build watches the checkout: a debug build would compile
/// everything again after each commit, and names the commit of its last build.
fn main() {
    println!("cargo:rerun-if-env-changed=WADE_COMMIT");
    let given = env::var("WADE_COMMIT").ok().filter(|commit| !commit.is_empty());
    let commit = given.or_else(|| git(&["describe", "--always", "--dirty=+", "--abbrev=12"]));
    println!("cargo:rustc-env=WADE_COMMIT={}", commit.unwrap_or_else(|| "unknown".into()));
    if env::var("PROFILE").is_ok_and(|profile| profile == "release") {
        // git appends to this file whenever HEAD moves; in a worktree it lies outside the folder of the sources
        let log = git(&["rev-parse", "--git-path", "logs/HEAD"]).map(PathBuf::from);
        if let Some(log) = log.filter(|log| log.exists()) {
            println!("cargo:rerun-if-changed={}", log.display());
        }
    }
}

/// What git prints; none without git, and outside a checkout.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
