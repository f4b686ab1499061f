//! Rules for comments that hold for every file of the project.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const ONBOARD: &str = include_str!("../../onboard/src/lib.rs");
/// Folders with sources, from the root.
const FOLDERS: [&str; 5] = ["shared", "onboard", "host", "tests", "fuzz"];
/// Words that begin a question where the reader looks for the thing.
const QUESTIONS: [&str; 5] = ["What", "How", "Whether", "Which", "Why"];

/// Adds the sources under a folder; remains of a build or an interpreter do not count.
fn add_sources(folder: &Path, sources: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() && !path.is_symlink() {
            if name != "target" && name != "node_modules" && !name.starts_with('.') {
                add_sources(&path, sources);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            sources.push(path);
        }
    }
}

/// The text of a line of documentation, or none for any other line.
fn doc(line: &str) -> Option<&str> {
    let line = line.trim_start();
    let text = line.strip_prefix("//!").or_else(|| line.strip_prefix("///"))?;
    (!text.starts_with('/')).then(|| text.trim())
}

/// The lines, counted from 1, at which a block of documentation opens with a question.
fn questions(text: &str) -> Vec<usize> {
    let mut found = Vec::new();
    let mut inside = false;
    for (number, line) in (1..).zip(text.lines()) {
        let doc = doc(line);
        let opens = doc.filter(|_| !inside).and_then(|doc| doc.split(|letter: char| !letter.is_alphabetic()).next());
        if opens.is_some_and(|word| QUESTIONS.contains(&word)) {
            found.push(number);
        }
        inside = doc.is_some();
    }
    found
}

#[test]
fn no_doc_comment_opens_with_a_question() {
    let mut sources = Vec::new();
    for folder in FOLDERS {
        add_sources(&Path::new(ROOT).join(folder), &mut sources);
    }
    sources.sort();
    assert!(sources.len() > 100, "only {} sources: are these the project's folders?", sources.len());
    let mut found = Vec::new();
    for path in &sources {
        let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let shown = path.strip_prefix(ROOT).unwrap_or(path).display();
        found.extend(questions(&text).into_iter().map(|line| format!("{shown}:{line}")));
    }
    assert!(found.is_empty(), "{} doc comments open with a question:\n{}", found.len(), found.join("\n"));
}

#[test]
fn a_question_counts_only_at_the_start_of_a_block_of_documentation() {
    let block = "/// Number of touches.\n/// What follows is no start.\nstruct A;\n//// What\n// What\n";
    assert!(questions(block).is_empty());
    assert_eq!(questions("//! Whatever.\n\n    /// Whether it is.\n/// Why.\n\n///How\n"), [3, 6]);
}
/// Names between back quotes.
fn names(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// Features of the manifest, and those that each brings in.
fn features() -> BTreeMap<&'static str, Vec<&'static str>> {
    let manifest = include_str!("../../onboard/Cargo.toml");
    let (_, section) = manifest.split_once("[features]\n").expect("a section of features");
    let section = section.split("\n[").next().expect("its lines");
    let lines = section.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let feature = |line: &'static str| {
        let (name, others) = line.split_once(" = ").expect("a feature of one line");
        (name, others.split('"').skip(1).step_by(2).collect())
    };
    lines.map(feature).collect()
}

#[test]
fn the_crates_table_of_features_has_all_that_there_are_and_says_which_are_off() {
    let features = features();
    let mut on: BTreeSet<&str> = BTreeSet::new();
    let mut next = features["default"].clone();
    while let Some(feature) = next.pop() {
        if on.insert(feature) {
            next.extend(features.get(feature).into_iter().flatten());
        }
    }
    let table = ONBOARD.lines().skip_while(|line| !line.starts_with("//! | feature |")).skip(2);
    let rows = table.map_while(|line| line.strip_prefix("//! | ")?.strip_suffix(" |")?.split_once(" | "));
    let (mut stated, mut off) = (BTreeSet::new(), BTreeSet::new());
    for (first, what) in rows {
        for name in names(first) {
            assert!(stated.insert(name), "{name} is there twice");
            if what.ends_with("off by default") {
                off.insert(name);
            }
        }
    }
    let all: BTreeSet<&str> = features.keys().copied().filter(|name| *name != "default").collect();
    assert_eq!(stated, all);
    assert_eq!(off, all.iter().copied().filter(|name| !on.contains(name)).collect());
    // The documentation mentions no other defaults.
    let text: String = ONBOARD.lines().take_while(|line| line.starts_with("//!")).collect();
    assert_eq!(text.matches("by default").count(), off.len());
}
