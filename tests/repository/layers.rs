//! Dependencies go down only: between the crates by what Cargo resolves, inside a crate by its imports.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::{output, root};

/// What each crate may depend on, and does.
const EDGES: [(&str, &[&str]); 13] = [
    ("wade-core", &[]),
    ("wade-wire", &["wade-core"]),
    ("wade-client", &["wade-core", "wade-wire"]),
    ("wade-client-c", &["wade-client", "wade-core", "wade-wire"]),
    ("wade-fmu", &["wade-client", "wade-core", "wade-wire"]),
    // in process: no client, no server
    ("wade-python", &["wade-core", "wade-wire"]),
    ("wade-learn", &["wade-core"]),
    ("wade-gap", &["wade-core", "wade-learn"]),
    // blind: it does not know the workflow that it scores
    ("wade-gap-bench", &["wade-core", "wade-learn"]),
    // files of robots and CAD programs to a vehicle: no learning, no server
    ("wade-import", &["wade-core"]),
    // tests of the whole
    ("wade-simulation", &["wade", "wade-core", "wade-wire"]),
    ("wade-fuzz", &["wade", "wade-core", "wade-import", "wade-learn", "wade-simulation", "wade-wire"]),
    (
        "wade",
        &[
            "wade-client",
            "wade-core",
            "wade-fmu",
            "wade-gap",
            "wade-gap-bench",
            "wade-import",
            "wade-learn",
            "wade-wire",
        ],
    ),
];

/// The modules of a crate from the lowest layer to the highest, with the folder of its sources.
const LAYERS: [(&str, &[&[&str]]); 3] = [
    (
        "crates/wade-core/src",
        &[
            &[
                "at",
                "condition",
                "digest",
                "domain",
                "forces",
                "frame",
                "lanes",
                "named_enum",
                "real",
                "wrench",
            ],
            &["geometry", "sea", "vehicle"],
            &["features", "physics", "stability"],
            &["analytic", "anchor", "effects"],
            &["bundle", "model", "served"],
        ],
    ),
    (
        "crates/wade-learn/src",
        &[
            &["files", "page", "random", "signal"],
            &["parameter_table", "published"],
            &["dataset", "recordings", "trials"],
            &["cfd", "panel_code", "train", "validate"],
            &["evaluate"],
            &["workflow"],
        ],
    ),
    ("src", &[&["cores", "states"], &["engine", "metrics"], &["service", "soak"], &["config"], &["server"]]),
];

/// Crates that serving in process may cost, without and with the feature `build`.
const MOST_CRATES: [usize; 2] = [50, 90];

/// What an embedder of the model must not compile.
const NOT_IN_CORE: [&str; 8] =
    ["parry3d-f64", "tokio", "tonic", "hyper", "axum", "iceoryx2", "parquet", "plotters"];

/// What a client must not compile.
const NOT_IN_A_CLIENT: [&str; 7] =
    ["wade-learn", "wade-gap", "wade-gap-bench", "parry3d-f64", "parquet", "plotters", "axum"];

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

/// Top-level module of each source file of a library, with its path and text.
fn modules(folder: &str) -> Vec<(String, PathBuf, String)> {
    let folder = root().join(folder);
    let mut files = Vec::new();
    sources(&folder, &mut files);
    let module = |path: &PathBuf| {
        let relative = path.strip_prefix(&folder).expect("below the folder");
        let first = relative.components().next().expect("a file").as_os_str().to_string_lossy().into_owned();
        first.trim_end_matches(".rs").to_owned()
    };
    let library =
        files.into_iter().filter(|path| !["main", "build", "cli", "lib"].contains(&module(path).as_str()));
    library
        .map(|path| (module(&path), path.clone(), std::fs::read_to_string(&path).expect("readable")))
        .collect()
}

fn imports(text: &str) -> BTreeSet<String> {
    let uses = text.match_indices("crate::").map(|(at, prefix)| &text[at + prefix.len()..]);
    let name = |rest: &str| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    uses.map(name)
        .filter(|name| !name.is_empty() && name.chars().all(|c| c.is_lowercase() || c == '_'))
        .collect()
}

/// Every source of the workspace's Rust packages, but for tests and benchmarks.
fn all_sources() -> Vec<PathBuf> {
    let mut found = Vec::new();
    for folder in ["src", "crates", "clients/cpp/src", "clients/fmi/src", "clients/python/native/src"] {
        sources(&root().join(folder), &mut found);
    }
    found.retain(|path| !path.components().any(|part| part.as_os_str() == "tests"));
    assert!(found.len() > 300, "{} sources", found.len());
    found
}

/// Names of the crates that a package depends on in a build for use, its own among them.
fn crates_of(package: &str, features: &[&str]) -> BTreeSet<String> {
    let fixed = ["tree", "--offline", "--locked", "--edges", "normal", "--prefix", "none", "--format", "{p}"];
    let listed = output("cargo", &[&fixed[..], &["--package", package], features].concat());
    let crates: BTreeSet<String> =
        listed.lines().filter_map(|line| line.split(' ').next()).map(str::to_owned).collect();
    assert!(crates.contains(package), "{package} is listed: {crates:?}");
    crates
}

#[test]
fn crates_depend_on_each_other_as_the_list_says() {
    let metadata =
        output("cargo", &["metadata", "--no-deps", "--format-version", "1", "--offline", "--locked"]);
    let metadata: Value = serde_json::from_str(&metadata).expect("JSON");
    let packages = metadata["packages"].as_array().expect("a list");
    assert_eq!(packages.len(), EDGES.len(), "a crate has no line in EDGES");
    for package in packages {
        let name = package["name"].as_str().expect("a name");
        let (_, allowed) = EDGES.iter().find(|(of, _)| *of == name).expect(name);
        // those for tests may go anywhere: nothing that is used is built with them
        let dependencies = package["dependencies"].as_array().expect("a list");
        let used = dependencies.iter().filter(|dependency| dependency["kind"] != "dev");
        let names = used.filter_map(|dependency| dependency["name"].as_str());
        let ours: BTreeSet<&str> = names.filter(|name| name.starts_with("wade")).collect();
        assert_eq!(ours, allowed.iter().copied().collect(), "{name}");
    }
}

#[test]
fn an_embedder_compiles_no_more_than_the_model_needs() {
    for (features, most) in [&[][..], &["--features", "build"]].into_iter().zip(MOST_CRATES) {
        let mut crates = crates_of("wade-core", features);
        crates.remove("wade-core");
        assert!(crates.len() <= most, "{} crates {features:?}: {crates:?}", crates.len());
        for name in NOT_IN_CORE.into_iter().filter(|name| features.is_empty() || *name != "parry3d-f64") {
            assert!(!crates.contains(name), "wade-core depends on {name}");
        }
    }
    for package in ["wade-client", "wade-client-c", "wade-fmu", "wade-python"] {
        let crates = crates_of(package, &[]);
        for name in NOT_IN_A_CLIENT {
            assert!(!crates.contains(name), "{package} depends on {name}");
        }
    }
}

#[test]
fn no_crate_re_exports_another_whole() {
    for path in all_sources() {
        let text = std::fs::read_to_string(&path).expect("readable");
        for line in text.lines().map(str::trim).filter(|line| line.starts_with("pub use wade_")) {
            let whole = line.ends_with("::*;") || !line.contains("::");
            assert!(!whole, "{}: {line}", path.display());
        }
    }
}

#[test]
fn imports_go_down_only_inside_a_crate() {
    for (folder, layers) in LAYERS {
        let layer = |module: &str| {
            let found = layers.iter().position(|layer| layer.contains(&module));
            found.unwrap_or_else(|| {
                panic!("module {module} of {folder} has no layer: add it here and to docs/src/developer/architecture.md")
            })
        };
        let mut checked = 0;
        for (module, path, text) in modules(folder) {
            // names that a crate exports at its root are not modules
            for import in imports(&text) {
                checked += 1;
                assert!(
                    layer(&import) <= layer(&module),
                    "{}: {module} imports {import} from a higher layer",
                    path.display()
                );
            }
        }
        assert!(checked > 10, "the test reads the imports of {folder}: {checked}");
    }
}

#[test]
fn serving_does_not_depend_on_learning_and_the_benchmark_does_not_know_the_effects() {
    // the soak measures a server from outside, and writes pages as learning does
    for (module, path, text) in modules("src").into_iter().filter(|(module, ..)| module != "soak") {
        for learning in ["wade_learn", "wade_gap"] {
            assert!(!text.contains(learning), "{}: {module} mentions {learning}", path.display());
        }
    }
    for (_, path, text) in modules("crates/wade-gap-bench/src") {
        assert!(
            !text.contains("wade_core::effects"),
            "{}: what is hidden is not what is looked for",
            path.display()
        );
    }
}

#[test]
fn no_clock_and_no_wire_type_in_the_core() {
    for (module, path, text) in modules("crates/wade-core/src") {
        for word in ["Instant::now", "SystemTime", "proto::", "tokio", "tonic"] {
            assert!(!text.contains(word), "{}: {module} mentions {word}", path.display());
        }
    }
}

#[test]
fn unsafe_code_is_in_the_kernel_and_at_shared_memory_and_foreign_interfaces_alone() {
    let allowed =
        ["crates/wade-core/src/model/kernel.rs", "crates/wade-wire/src/shm/mod.rs", "src/service/shm.rs"];
    for path in all_sources().into_iter().filter(|path| !path.starts_with(root().join("clients"))) {
        let text = std::fs::read_to_string(&path).expect("readable");
        let relative = path.strip_prefix(root()).expect("below the root");
        let is_allowed = allowed.iter().any(|allowed| relative == Path::new(allowed));
        assert_eq!(text.contains("allow(unsafe_code)"), is_allowed, "{}", path.display());
    }
}
