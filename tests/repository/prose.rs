//! Documents are readable: short README, short lines, short sentences, the field's terms.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{documents, files, root, text};

const README_LINES: usize = 120;
/// Columns at which a line of prose ends.
pub const COLUMNS: usize = 100;
/// Bytes of the picture in README.
const LARGEST_PICTURE: u64 = 150_000;
/// Words of a sentence in README and the guide: nine of ten sentences, and all of them.
const MOST_SENTENCES: usize = 30;
const LONGEST_SENTENCE: usize = 45;

/// Lines of a document outside code blocks, with their numbers; tables and comments are left out.
fn prose(markdown: &str) -> Vec<(usize, &str)> {
    let mut in_code = false;
    let mut found = Vec::new();
    for (index, line) in markdown.lines().enumerate() {
        let start = line.trim_start();
        if start.starts_with("```") {
            in_code = !in_code;
            // a paragraph ends here
            found.push((index + 1, ""));
        } else if !in_code && !start.starts_with('|') && !start.starts_with("<!--") {
            found.push((index + 1, line));
        }
    }
    found
}

/// A line with the targets of its links left out: they cannot be broken.
fn without_targets(line: &str) -> String {
    let mut out = String::new();
    let mut rest = line;
    while let Some((before, after)) = rest.split_once("](") {
        out += before;
        out.push(']');
        rest = after.split_once(')').map_or("", |(_, after)| after);
    }
    out + rest
}

/// Sentences of a document: each item of a list and each heading is a paragraph of its own.
fn sentences(markdown: &str) -> Vec<String> {
    let mut paragraphs = vec![String::new()];
    for (_, line) in prose(markdown) {
        let start = line.trim();
        let is_item =
            start.starts_with("- ") || start.split_once(". ").is_some_and(|(n, _)| n.parse::<u8>().is_ok());
        if start.is_empty() || start.starts_with('#') || is_item {
            paragraphs.push(String::new());
        }
        if !start.starts_with('#') {
            let paragraph = paragraphs.last_mut().expect("never empty");
            *paragraph += &format!(" {}", without_targets(start));
        }
    }
    let ends = |word: &str| word.trim_end_matches(['"', ')', '*', '`']).ends_with(['.', '!', '?', ':']);
    let mut found = Vec::new();
    for paragraph in paragraphs {
        let mut sentence = Vec::new();
        for word in paragraph.split_whitespace() {
            sentence.push(word);
            if ends(word) {
                found.push(std::mem::take(&mut sentence).join(" "));
            }
        }
        found.push(sentence.join(" "));
    }
    found.retain(|sentence| words(sentence) > 0);
    found
}

fn words(sentence: &str) -> usize {
    sentence.split_whitespace().filter(|word| word.contains(char::is_alphanumeric)).count()
}

#[test]
fn sentences_are_found() {
    let text = "# A title\n\nOne two three. Four\nfive six!\n\n- item one\n- item [two](far/away.md)\n\n```\ncode. Here\n```\n| a. b | c |\n";
    assert_eq!(sentences(text), ["One two three.", "Four five six!", "- item one", "- item [two]"]);
}

#[test]
fn the_readme_is_short() {
    let lines = text("README.md").lines().count();
    assert!(lines <= README_LINES, "README.md has {lines} lines, {README_LINES} are allowed");
}

#[test]
fn the_picture_of_the_readme_is_small() {
    let length = root().join("docs/page.png").metadata().expect("the picture of README").len();
    assert!(length <= LARGEST_PICTURE, "docs/page.png has {length} bytes");
}

#[test]
fn lines_of_prose_end_in_time() {
    let mut long = Vec::new();
    for path in documents() {
        let text = text(&path);
        for (number, line) in prose(&text) {
            if without_targets(line).chars().count() > COLUMNS {
                long.push(format!("{}:{number}", path.display()));
            }
        }
    }
    assert!(long.is_empty(), "lines of prose over {COLUMNS} columns: {}", long.join(" "));
}

#[test]
fn sentences_are_short_in_readme_and_guide() {
    let guide = documents().into_iter().filter(|path| path.starts_with("docs/src/guide"));
    for path in std::iter::once(PathBuf::from("README.md")).chain(guide) {
        let mut sentences = sentences(&text(&path));
        sentences.sort_by_key(|sentence| words(sentence));
        let Some(longest) = sentences.last() else { panic!("{} has no sentence", path.display()) };
        assert!(words(longest) <= LONGEST_SENTENCE, "{}: {longest}", path.display());
        let ninth = &sentences[(sentences.len() - 1) * 9 / 10];
        assert!(words(ninth) <= MOST_SENTENCES, "{}: {ninth}", path.display());
    }
}

/// Words that we wrote and no field uses; the glossary has what is written in their place.
const DIALECT: [&str; 31] = [
    "anew",
    "contest",
    "deviate",
    "deviates",
    "door",
    "doors",
    "desk",
    "forgotten itself",
    "hangs together",
    "hang together",
    "heat",
    "held against",
    "is told",
    "are told",
    "was told",
    "kept back",
    "learnt",
    "loud",
    "nobody's",
    "novelty",
    "of a second run",
    "other data",
    "placebo",
    "placebos",
    "rival",
    "rivals",
    "says the same as",
    "sets the pace",
    "taught",
    "took no part",
    "unless told",
];

/// How often the words stand in a text, as whole words and across line ends.
fn dialect(text: &str) -> usize {
    let words = text.split(|c: char| !c.is_alphanumeric() && c != '\'').filter(|word| !word.is_empty());
    let plain = format!(" {} ", words.map(str::to_lowercase).collect::<Vec<_>>().join(" "));
    DIALECT.iter().map(|phrase| plain.matches(&format!(" {phrase} ")).count()).sum()
}

#[test]
fn dialect_is_counted() {
    assert_eq!(dialect("Taught anew: it hangs\n// together. Heater, tolda, door-step"), 4);
}

/// Where a file is counted: a crate, a folder below src, or a folder at the root.
fn folder(path: &Path) -> String {
    let parts: Vec<&str> = path.iter().filter_map(|part| part.to_str()).collect();
    let depth = if ["src", "crates"].contains(&parts[0]) && parts.len() > 2 { 2 } else { 1 };
    parts[..depth].join("/")
}

/// The count of each folder may fall, never rise: `just results` writes lower counts.
#[test]
fn results_of_counting_dialect_do_not_rise() {
    const COUNTS: &str = "tests/repository/dialect.toml";
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let prefixes = [
        "src/",
        "crates/",
        "docs/",
        "README.md",
        "clients/",
        "deploy/",
        "proto/",
        "campaigns/README.md",
        ".github/",
    ];
    let kinds = ["rs", "md", "proto", "toml", "py", "h", "hpp", "cpp", "js", "html", "cs"];
    for path in files() {
        let name = path.to_string_lossy();
        let is_text = path.extension().is_some_and(|kind| kinds.iter().any(|known| kind == *known));
        // tests of a crate were counted nowhere
        let is_test = name.starts_with("crates/") && name.contains("/tests/");
        if is_text && !is_test && prefixes.iter().any(|prefix| name.starts_with(prefix)) {
            *counts.entry(folder(&path)).or_default() += dialect(&text(&path));
        }
    }
    if std::env::var_os("WADE_WRITE").is_some() {
        let mut out =
            "# Words of our dialect in each folder: see DIALECT in prose.rs. A count may fall, never rise.\n"
                .to_owned();
        for (folder, count) in &counts {
            out += &format!("\"{folder}\" = {count}\n");
        }
        std::fs::write(root().join(COUNTS), out).expect("written");
        return;
    }
    let committed: toml::Table = text(COUNTS).parse().expect("TOML");
    for (folder, count) in counts {
        let allowed = committed.get(&folder).and_then(toml::Value::as_integer).unwrap_or(0);
        let allowed = usize::try_from(allowed).expect("a count");
        assert!(
            count <= allowed,
            "{folder} has {count} words of dialect, {allowed} before: see DIALECT in prose.rs"
        );
    }
}
