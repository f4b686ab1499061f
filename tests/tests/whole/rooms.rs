//! Crates depend on each other in one direction, and so do rooms, the top-level modules of a crate. Trees know no touch. The
//! features that a document lists are those of the code.

use palpate_tests::ROOT;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::read_to_string;
use std::path::{Path, PathBuf};

/// Sources of the crates whose rooms have an order, relative to the root of the project.
const CRATES: [&str; 6] =
    ["shared/src", "onboard/src", "host/base/src", "host/trees/src", "host/simulator/src", "host/src"];
/// Crates in their order, by folder, and those of the same project that each is built on.
const BUILT_ON: [(&str, &[&str]); 8] = [
    ("shared", &[]),
    ("onboard", &["shared"]),
    ("host/base", &[]),
    ("host/trees", &["base", "onboard", "shared"]),
    ("host/simulator", &["base", "shared"]),
    ("host", &["base", "onboard", "shared", "simulator", "trees"]),
    ("host/report", &["palpate", "onboard", "shared"]),
    ("host/program", &["palpate", "onboard", "report", "shared"]),
];
/// Modules that gather names of all rooms, and modules of tests.
const OUTSIDE: [&str; 3] = ["error", "lib", "tests"];

/// Source files below a folder, except those of tests.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let (folders, files): (Vec<_>, Vec<_>) = entries.partition(|path| path.is_dir());
    let below = folders.into_iter().filter(|path| !path.ends_with("tests")).flat_map(|path| sources(&path));
    let is_source = |path: &PathBuf| path.extension().is_some_and(|end| end == "rs") && !path.ends_with("tests.rs");
    files.into_iter().filter(is_source).chain(below).collect()
}

/// The room that a source file belongs to.
fn room(file: &Path, source: &Path) -> String {
    let inside = file.strip_prefix(source).unwrap().iter().next().unwrap();
    Path::new(inside).file_stem().unwrap().to_str().unwrap().to_owned()
}

/// First names of the paths that start with `crate::` in code, inline tests and comments left out.
fn used(text: &str) -> BTreeSet<String> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let code = text.split("\nmod tests {").next().unwrap_or_default();
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    let code: String = lines.flat_map(|line| [line, "\n"]).collect();
    let mut names = BTreeSet::new();
    for path in code.split("crate::").skip(1) {
        let Some(group) = path.strip_prefix('{') else {
            names.extend(path.split(|c| !is_name(c)).next().map(str::to_owned));
            continue;
        };
        // Names at the first level of the braces start a path, those further in continue one.
        let (mut depth, mut name) = (1, String::new());
        for c in group.chars() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 1 => names.extend(name.split(':').next().map(|name| name.trim().to_owned())),
                _ => {}
            }
            match (depth, c) {
                (0, _) => break,
                (1, ',') => name.clear(),
                _ => name.push(c),
            }
        }
        names.extend(name.split(':').next().map(|name| name.trim().to_owned()));
    }
    names
}

/// The rooms that each room uses.
fn uses(source: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let files = sources(source);
    let is_room = |name: &String| !OUTSIDE.contains(&name.as_str());
    let rooms: BTreeSet<String> = files.iter().map(|file| room(file, source)).filter(is_room).collect();
    let mut uses: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for file in files {
        let own = room(&file, source);
        if is_room(&own) {
            let mut others = used(&read_to_string(&file).unwrap());
            others.retain(|other| rooms.contains(other) && *other != own);
            uses.entry(own).or_default().extend(others);
        }
    }
    uses
}

/// Rooms that use each other in a circle, and those that use them: those left after rooms that use no other have been
/// removed one by one.
fn circle(mut uses: BTreeMap<String, BTreeSet<String>>) -> BTreeMap<String, BTreeSet<String>> {
    while let Some(free) = uses.iter().find(|(_, others)| others.is_empty()).map(|(room, _)| room.clone()) {
        uses.remove(&free);
        uses.values_mut().for_each(|others| others.retain(|other| *other != free));
    }
    uses
}

#[test]
fn crates_are_built_on_those_below_them_alone() {
    let root = Path::new(ROOT);
    for (folder, expected) in BUILT_ON {
        let manifest = read_to_string(root.join(folder).join("Cargo.toml")).unwrap();
        let lines = manifest.lines().skip_while(|line| *line != "[dependencies]").skip(1);
        let keys = lines.take_while(|line| !line.starts_with('[')).filter_map(|line| line.split(['.', ' ']).next());
        let own = keys.filter(|key| key.starts_with("palpate")).map(|key| key.trim_start_matches("palpate-"));
        assert_eq!(own.collect::<Vec<_>>(), expected, "{folder}");
    }
}

#[test]
fn zephyrs_options_are_the_macros_that_the_c_header_takes() {
    let root = Path::new(ROOT).join("onboard/c");
    let options = read_to_string(root.join("zephyr/Kconfig")).unwrap();
    let options: BTreeSet<&str> = options.lines().filter_map(|line| line.strip_prefix("config PALPATE_")).collect();
    let header = read_to_string(root.join("palpate.h")).unwrap();
    let macros = header.split("Macros that may be defined").nth(1).unwrap().lines().skip(1);
    let macros = macros.map_while(|line| line.strip_prefix(" *   PALPATE_")?.split([' ', '(']).next());
    // Lists have an option for each of their values, and the others are code.
    let values = ["COMPACT", "WIDE", "CODE", "I8", "I16", "F32", "SETTINGS"];
    let expected: BTreeSet<&str> =
        macros.filter(|name| !["LAYOUTS", "LEAVES", "BYTE", "API"].contains(name)).chain(values).collect();
    assert_eq!(options, expected);
}

#[test]
fn trees_know_no_touch() {
    // The format's limit of steps and statement of the training, and ordinary words.
    let others = [
        "max_touches",
        "trained_touches",
        "needs_pose",
        "compos",
        "dispos",
        "expos",
        "oppos",
        "propos",
        "purpos",
        "suppos",
        "transpos",
    ];
    let root = Path::new(ROOT);
    for file in sources(&root.join("host/trees/src")) {
        for (number, line) in read_to_string(&file).unwrap().lines().enumerate() {
            let words = others.iter().fold(line.to_lowercase(), |line, other| line.replace(other, ""));
            let known = ["touch", "probe", "finger", "pose"].into_iter().find(|word| words.contains(word));
            assert_eq!(known, None, "{}:{}: {line}", file.display(), number + 1);
        }
    }
}

#[test]
fn rooms_have_no_circle() {
    let root = Path::new(ROOT);
    for source in CRATES.map(|source| root.join(source)).iter().filter(|source| source.exists()) {
        let uses = uses(source);
        assert!(uses.len() > 2, "{}: {uses:?}", source.display());
        let circle = circle(uses);
        assert!(circle.is_empty(), "rooms of {} use each other in a circle: {circle:#?}", source.display());
    }
}

#[test]
fn a_circle_is_found_whatever_way_paths_are_written() {
    let text = "use crate::{mesh::{Mesh, triangles}, probe};\nuse crate::error::Kind;\n/// crate::touches\nlet x = crate::capture::sample();\n\
                #[cfg(test)]\nmod tests {\nuse crate::chip;";
    assert_eq!(used(text).into_iter().collect::<Vec<_>>(), ["capture", "error", "mesh", "probe"]);
    let uses = |pairs: &[(&str, &str)]| {
        let mut uses: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (room, other) in pairs {
            uses.entry((*other).into()).or_default();
            uses.entry((*room).into()).or_default().insert((*other).into());
        }
        uses
    };
    assert!(circle(uses(&[("a", "b"), ("b", "c"), ("a", "c")])).is_empty());
    assert_eq!(circle(uses(&[("a", "b"), ("b", "c"), ("c", "a"), ("a", "d")])).len(), 3);
}

/// Names between back quotes.
fn names(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// Features of the manifest, and those that each brings in.
fn features() -> BTreeMap<&'static str, Vec<&'static str>> {
    let manifest = include_str!("../../../onboard/Cargo.toml");
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
    let documentation = include_str!("../../../onboard/src/lib.rs");
    let mut on: BTreeSet<&str> = BTreeSet::new();
    let mut next = features["default"].clone();
    while let Some(feature) = next.pop() {
        if on.insert(feature) {
            next.extend(features.get(feature).into_iter().flatten());
        }
    }
    let table = documentation.lines().skip_while(|line| !line.starts_with("//! | feature |")).skip(2);
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
    let text: String = documentation.lines().take_while(|line| line.starts_with("//!")).collect();
    assert_eq!(text.matches("by default").count(), off.len());
}
