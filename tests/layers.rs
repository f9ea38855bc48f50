//! Promise: imports go down only, and the unsafe code is where it is said to be.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The layers from the lowest to the highest.
const LAYERS: [&[&str]; 8] = [
    &["files", "frame", "wrench", "condition", "domain", "forces", "page", "random", "signal"],
    &["geometry", "vehicle"],
    &["features", "effects", "analytic", "anchor"],
    &["model", "served", "bundle"],
    &["wire"],
    &["engine", "metrics", "parameter_table", "published", "dataset", "trials", "recordings"],
    &[
        "cores",
        "service",
        "states",
        "client",
        "soak",
        "train",
        "cfd",
        "validate",
        "evaluate",
        "gap",
        "gap_bench",
    ],
    &["config"],
    &["server"],
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("readable") {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Top-level module of each source file of the library, with its text.
fn modules() -> Vec<(String, PathBuf, String)> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    let module = |path: &PathBuf| {
        let relative = path.strip_prefix(&root).expect("below src");
        let first = relative.components().next().expect("a file").as_os_str().to_string_lossy().into_owned();
        first.trim_end_matches(".rs").to_owned()
    };
    let library = files.into_iter().filter(|path| !["main", "cli", "lib"].contains(&module(path).as_str()));
    library
        .map(|path| (module(&path), path.clone(), std::fs::read_to_string(&path).expect("readable")))
        .collect()
}

fn layer(module: &str) -> usize {
    let found = LAYERS.iter().position(|layer| layer.contains(&module));
    found.unwrap_or_else(|| {
        panic!(
            "module {module} has no layer: add it to tests/layers.rs and docs/src/developer/architecture.md"
        )
    })
}

fn imports(text: &str) -> BTreeSet<String> {
    let uses = text.match_indices("crate::").map(|(at, prefix)| &text[at + prefix.len()..]);
    let name = |rest: &str| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    uses.map(name)
        .filter(|name| !name.is_empty() && name.chars().all(|c| c.is_lowercase() || c == '_'))
        .collect()
}

#[test]
fn imports_go_down_only() {
    let mut checked = 0;
    for (module, path, text) in modules() {
        for import in imports(&text) {
            checked += 1;
            assert!(
                layer(&import) <= layer(&module),
                "{}: {module} imports {import} from a higher layer",
                path.display()
            );
        }
    }
    assert!(checked > 100, "the test reads the imports: {checked}");
}

#[test]
fn learning_and_serving_do_not_import_each_other() {
    for (module, path, text) in modules() {
        let forbidden: &[&str] = match module.as_str() {
            "train" | "cfd" | "analytic" | "effects" | "trials" | "dataset" => &["service", "client", "soak"],
            "validate" | "evaluate" | "gap" => &["service", "client", "soak", "engine"],
            // blind: what is hidden is not what is looked for
            "gap_bench" => &["service", "client", "soak", "engine", "effects", "gap"],
            "wire" | "service" | "client" | "soak" => {
                &["train", "cfd", "validate", "evaluate", "gap", "gap_bench", "dataset", "trials"]
            }
            _ => continue,
        };
        let imports = imports(&text);
        assert!(!forbidden.iter().any(|name| imports.contains(*name)), "{}", path.display());
    }
}

#[test]
fn no_clock_and_no_wire_type_below_the_engine() {
    for (module, path, text) in modules().into_iter().filter(|(module, ..)| layer(module) < layer("wire")) {
        for word in ["Instant::now", "SystemTime", "proto::", "tokio", "tonic"] {
            assert!(!text.contains(word), "{}: {module} mentions {word}", path.display());
        }
    }
}

#[test]
fn unsafe_code_is_in_the_kernel_and_at_shared_memory_alone() {
    let allowed = |path: &Path| {
        path.ends_with("src/model/kernel.rs")
            || path.ends_with("src/service/shm.rs")
            || path.ends_with("src/wire/shm/mod.rs")
    };
    for (_, path, text) in modules() {
        assert_eq!(text.contains("allow(unsafe_code)"), allowed(&path), "{}", path.display());
    }
}
