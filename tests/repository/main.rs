//! Promise: the repository is what its documents say: licences, documents, their links, their language, the raw results
//! behind their figures.

mod layers;
mod licenses;
mod links;
mod prose;
mod readme;
mod results;
mod tree;

use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn text(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Standard output of a command that succeeds in the root of the repository.
fn output(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).current_dir(root()).output();
    let output = output.unwrap_or_else(|error| panic!("{program} cannot be run: {error}"));
    assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// Files that git tracks or would track, relative to the root.
fn files() -> Vec<PathBuf> {
    let listed = output("git", &["ls-files", "--cached", "--others", "--exclude-standard"]);
    let found: Vec<PathBuf> =
        listed.lines().map(PathBuf::from).filter(|path| root().join(path).exists()).collect();
    assert!(found.len() > 100, "git lists the files");
    found
}

/// Every document in Markdown.
fn documents() -> Vec<PathBuf> {
    files().into_iter().filter(|path| path.extension().is_some_and(|kind| kind == "md")).collect()
}
