//! Links between documents lead somewhere, and every page of the book is in its summary.

use std::path::{Component, Path, PathBuf};

use super::{documents, root, text};

/// Targets of the links of a document, outside code.
fn targets(markdown: &str) -> Vec<String> {
    let mut in_code = false;
    let mut found = Vec::new();
    for line in markdown.lines() {
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
        }
        if in_code {
            continue;
        }
        // code spans hold no links
        let plain: String = line.split('`').step_by(2).collect::<Vec<_>>().join("`");
        let links = plain.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
        found.extend(links.map(|(target, _)| target.trim_matches(['<', '>']).to_owned()));
    }
    found
}

/// The anchor that a heading gets, as on the pages of code hosts.
fn anchor(heading: &str) -> String {
    let kept = heading.trim_start_matches('#').trim().to_lowercase();
    let kept = kept.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.collect::<String>().replace(' ', "-")
}

/// A path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => assert!(out.pop(), "{} leaves the repository", path.display()),
            Component::CurDir => {}
            part => out.push(part),
        }
    }
    out
}

#[test]
fn links_between_documents_lead_somewhere() {
    let mut checked = 0;
    let mut broken = Vec::new();
    for document in documents() {
        for target in targets(&text(&document)) {
            if ["http://", "https://", "mailto:"].iter().any(|scheme| target.starts_with(scheme)) {
                continue;
            }
            checked += 1;
            let (file, wanted) = target.split_once('#').unwrap_or((&target, ""));
            let folder = document.parent().expect("a folder");
            let path = if file.is_empty() { document.clone() } else { plain(&folder.join(file)) };
            let is_there = root().join(&path).exists();
            let has_anchor = || {
                let text = text(&path);
                let headings = text.lines().filter(|line| line.starts_with('#'));
                headings.map(anchor).any(|anchor| anchor == wanted)
            };
            if !is_there || (!wanted.is_empty() && !has_anchor()) {
                broken.push(format!("{}: {target}", document.display()));
            }
        }
    }
    assert!(broken.is_empty(), "broken links:\n{}", broken.join("\n"));
    assert!(checked > 50, "the test reads the links: {checked}");
}

#[test]
fn every_page_is_in_the_summary() {
    let summary = targets(&text("docs/src/SUMMARY.md"));
    for page in documents().iter().filter_map(|path| path.strip_prefix("docs/src").ok()) {
        let name = page.to_str().expect("UTF-8");
        assert!(
            name == "SUMMARY.md" || summary.iter().any(|target| target == name),
            "{name} is not in the summary"
        );
    }
}
