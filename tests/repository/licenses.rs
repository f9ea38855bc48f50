//! Every package of this repository is MIT OR Apache-2.0, and whatever it links allows that.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::{output, root, text};

const OURS: &str = "MIT OR Apache-2.0";

/// Licences that a linked crate may have: permissive, with notices at most.
const LINKED: [&str; 10] = [
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "Unicode-3.0",
    "Zlib",
];

/// More that a tool may have which only builds or tests: nothing of it is in what is distributed.
const TOOLS: [&str; 1] = ["MPL-2.0"];

/// Whether an SPDX expression can be met with the allowed licences. `/` is the old way to write OR.
fn is_allowed(expression: &str, allowed: &[&str]) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut parser = Expression { words: &words, allowed };
    parser.any() == Some(true) && parser.words.is_empty()
}

struct Expression<'a> {
    words: &'a [&'a str],
    allowed: &'a [&'a str],
}

impl Expression<'_> {
    fn takes(&mut self, word: &str) -> bool {
        let found = self.words.first() == Some(&word);
        if found {
            self.words = &self.words[1..];
        }
        found
    }

    /// None where the expression is malformed.
    fn any(&mut self) -> Option<bool> {
        let mut value = self.all()?;
        while self.takes("OR") {
            value |= self.all()?;
        }
        Some(value)
    }

    fn all(&mut self) -> Option<bool> {
        let mut value = self.one()?;
        while self.takes("AND") {
            value &= self.one()?;
        }
        Some(value)
    }

    fn one(&mut self) -> Option<bool> {
        if self.takes("(") {
            let value = self.any()?;
            return self.takes(")").then_some(value);
        }
        let (name, rest) = self.words.split_first()?;
        self.words = rest;
        if self.takes("WITH") {
            // an exception only adds rights
            self.words = self.words.get(1..)?;
        }
        Some(self.allowed.contains(name))
    }
}

#[test]
fn expressions_are_evaluated_as_spdx_defines_them() {
    let allowed = ["MIT", "Apache-2.0"];
    for expression in
        ["MIT", "GPL-3.0 OR MIT", "MIT/GPL-3.0", "(GPL-3.0 OR MIT) AND Apache-2.0 WITH LLVM-exception"]
    {
        assert!(is_allowed(expression, &allowed), "{expression}");
    }
    for expression in
        ["", "GPL-3.0", "MIT AND GPL-3.0", "GPL-3.0 AND MIT OR GPL-2.0", "MIT OR", "(MIT", "MIT MIT"]
    {
        assert!(!is_allowed(expression, &allowed), "{expression}");
    }
}

fn metadata() -> Value {
    let host = output("rustc", &["-vV"]);
    let host = host.lines().find_map(|line| line.strip_prefix("host: ")).expect("rustc names its host");
    let arguments = ["metadata", "--offline", "--locked", "--format-version", "1", "--filter-platform", host];
    serde_json::from_str(&output(env!("CARGO"), &arguments)).expect("JSON")
}

/// Ids of all packages that are linked into what the members build: no build scripts, no tests.
fn linked(metadata: &Value) -> BTreeSet<String> {
    let id = |value: &Value| value.as_str().expect("an id").to_owned();
    let nodes = metadata["resolve"]["nodes"].as_array().expect("a list");
    let nodes: BTreeMap<String, &Value> = nodes.iter().map(|node| (id(&node["id"]), node)).collect();
    let members = metadata["workspace_members"].as_array().expect("a list");
    let mut open: Vec<String> = members.iter().map(id).collect();
    let mut found = BTreeSet::new();
    while let Some(next) = open.pop() {
        for dependency in nodes[&next]["deps"].as_array().expect("a list") {
            let kinds = dependency["dep_kinds"].as_array().expect("a list");
            if kinds.iter().any(|kind| kind["kind"].is_null()) {
                open.push(id(&dependency["pkg"]));
            }
        }
        if !found.insert(next) {
            open.retain(|id| !found.contains(id));
        }
    }
    found
}

#[test]
fn packages_state_their_license_and_dependencies_allow_it() {
    let metadata = metadata();
    let linked = linked(&metadata);
    let members = metadata["workspace_members"].as_array().expect("a list");
    let packages = metadata["packages"].as_array().expect("a list");
    for package in packages {
        let (name, license) = (&package["name"], package["license"].as_str().unwrap_or_default());
        if members.contains(&package["id"]) {
            assert_eq!(license, OURS, "{name}");
            assert_eq!(package["version"], env!("CARGO_PKG_VERSION"), "{name}: one version for all packages");
        }
        let is_linked = linked.contains(package["id"].as_str().expect("an id"));
        let allowed = if is_linked { LINKED.to_vec() } else { [&LINKED[..], &TOOLS[..]].concat() };
        assert!(
            is_allowed(license, &allowed),
            "{name} {}: `{license}` is not in the list of tests/repository/licenses.rs",
            package["version"]
        );
    }
    assert!(members.len() >= 2 && linked.len() > 100 && linked.len() < packages.len(), "{}", linked.len());
}

#[test]
fn packages_outside_cargo_have_the_same_license_and_version() {
    let version = env!("CARGO_PKG_VERSION");
    for name in ["python", "trials"] {
        let python: toml::Table = text(format!("clients/{name}/pyproject.toml")).parse().expect("TOML");
        assert_eq!(python["project"]["license"].as_str(), Some(OURS), "{name}");
        assert_eq!(python["project"]["version"].as_str(), Some(version), "{name}");
    }
    let native: toml::Table = text("clients/python/native/pyproject.toml").parse().expect("TOML");
    assert_eq!(native["project"]["license"].as_str(), Some(OURS));
    let dynamic = native["project"]["dynamic"].as_array().expect("a list");
    assert!(dynamic.iter().any(|field| field.as_str() == Some("version")), "it has Cargo's version");
    let required = text("clients/python/src/wade/version.py");
    assert!(required.contains(&format!("\nVERSION = \"{version}\"\n")), "version.py has another version");
    let unreal: Value = serde_json::from_str(&text("clients/unreal/Wade/Wade.uplugin")).expect("JSON");
    assert_eq!(unreal["VersionName"], version);
    let citation = text("CITATION.cff");
    assert!(citation.contains(&format!("\nversion: {version}\n")), "CITATION.cff has another version");
    assert!(text("CHANGELOG.md").contains(&format!("\n## {version}")), "CHANGELOG.md lacks this version");
}

#[test]
fn the_license_texts_are_there_whole() {
    let mit = text("LICENSE-MIT");
    assert!(mit.contains("the wade authors") && mit.contains("WITHOUT WARRANTY OF ANY KIND"));
    let apache = text("LICENSE-APACHE");
    assert!(apache.contains("END OF TERMS AND CONDITIONS") && apache.contains("9. Accepting Warranty"));
}

#[test]
fn no_toolchain_file_makes_rustup_download() {
    for name in ["rust-toolchain", "rust-toolchain.toml"] {
        assert!(!root().join(name).exists(), "{name}");
    }
}

/// `just` reads the file where it is installed; otherwise the recipes are looked for.
#[test]
fn the_justfile_has_its_recipes() {
    let justfile = text("justfile");
    for recipe in ["check", "test", "ci", "long", "results"] {
        let mut lines = justfile.lines().skip_while(|line| *line != format!("{recipe}:"));
        assert!(lines.next().is_some(), "no recipe {recipe}");
        let command = lines.next().unwrap_or_default();
        assert!(command.starts_with("    ") && !command.trim().is_empty(), "{recipe} does nothing");
    }
    if std::process::Command::new("just").arg("--version").output().is_ok() {
        output("just", &["--list"]);
    }
}
