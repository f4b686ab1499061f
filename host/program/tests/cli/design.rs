//! `palpate probe design`, as a user calls it.

use crate::{command, globe, json, listing, run, shapes, stderr, stdout};
use std::path::Path;

/// The least work that a search can do.
const QUICK: [&str; 10] =
    ["probe", "design", "meshes", "--approaches", "200", "--sequences", "30", "--error-rate", "5%", "-o"];

/// A search of one probe, with the settings of `more`.
fn search(more: &str) -> String {
    format!("radius=0.15,tilt=10,aim=box,{more}")
}

/// A folder with meshes.
fn place() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    shapes(directory.path());
    directory
}

fn design(directory: &Path, more: &[&str]) -> std::process::Output {
    let words: Vec<&str> = QUICK.iter().chain(more).copied().collect();
    command(words).current_dir(directory).output().unwrap()
}

#[test]
fn a_probe_is_designed_for_two_objects_and_written_with_a_page() {
    let directory = place();
    let at = directory.path();
    let found = json(design(at, &["one", "--search", &search("spacing=0.5..2"), "--json"]));
    assert_eq!(listing(&at.join("one")), ["design.html", "probe.toml"]);
    assert_eq!(found["best"]["reached"], true);
    let spacings: Vec<f64> =
        found["by_spacing"].as_array().unwrap().iter().map(|trial| trial["spacing"].as_f64().unwrap()).collect();
    assert_eq!((spacings[0], *spacings.last().unwrap()), (0.5, 2.0));
    assert!(spacings.contains(&found["best"]["spacing"].as_f64().unwrap()));
    let toml = std::fs::read_to_string(at.join("one/probe.toml")).unwrap();
    let stated = |key: &str| toml.lines().find_map(|line| line.strip_prefix(&format!("{key} = "))).unwrap().to_owned();
    assert_eq!(stated("unit"), "\"unit\"");
    for key in ["radius", "spacing", "speed", "tilt"] {
        assert_eq!(stated(key).parse::<f64>().unwrap(), found["best"][key].as_f64().unwrap());
    }
    let page = std::fs::read_to_string(at.join("one/design.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("The best probe to build") && page.contains("cigar"));
}

#[test]
fn the_same_seed_designs_the_same_files_on_any_number_of_threads() {
    let directory = place();
    let at = directory.path();
    let search = search("spacing=1..1.5");
    let words: Vec<&str> = QUICK.iter().copied().chain(["out", "--search", &search]).collect();
    let mut files = Vec::new();
    for threads in ["1", "3"] {
        let output = command(&words).args(["--threads", threads]).current_dir(at).output().unwrap();
        let table = stdout(output);
        let read = |name: &str| std::fs::read(at.join("out").join(name)).unwrap();
        files.push((table, read("probe.toml"), read("design.html")));
    }
    assert!(files[0].0.contains("* the best: spacing"), "{}", files[0].0);
    assert_eq!(files[0], files[1]);
}

#[test]
fn a_probe_design_that_cannot_be_says_which_option_is_wrong() {
    let directory = place();
    let error = stderr(design(directory.path(), &["out", "--search", "spacing=2..1"]), 2);
    assert!(error.contains("0.5..3"), "{error}");
    let error = stderr(design(directory.path(), &["out", "--search", "speed=0"]), 2);
    assert!(error.contains("speed is 0"), "{error}");
    for (search, expected) in
        [("gap=2", "use spacing=1..2"), ("aim=box+away", "box, middle, mass"), ("tilt=1,tilt=2", "twice")]
    {
        let error = stderr(design(directory.path(), &["out", "--search", search]), 2);
        assert!(error.contains(expected), "{error}");
    }
    let error = stderr(design(directory.path(), &["out", "--real", "missed=2%"]), 2);
    assert!(error.contains("one level of noise on contact times, such as noise=5ms"), "{error}");
    let one = globe(directory.path(), "globe", 8);
    let output = directory.path().join("out");
    let error = stderr(run(["probe", "design", one.to_str().unwrap(), "-o", output.to_str().unwrap()]), 1);
    assert!(error.contains("two or more objects"), "{error}");
    assert!(!output.exists());
}

#[test]
fn a_capture_aims_where_it_is_told_and_its_data_set_says_so() {
    let directory = place();
    let capture = |name: &str, more: &[&str]| {
        let words = ["capture", "meshes", "--approaches", "200", "-o", name];
        stdout(command(words.iter().chain(more)).current_dir(directory.path()).output().unwrap());
        let read = |file: &str| std::fs::read_to_string(directory.path().join(name).join(file)).unwrap();
        let touched = read("cigar.txt").lines().filter(|line| *line != "- - -").count();
        (read("dataset.json").contains("\"aim\""), touched, read("cigar.txt"))
    };
    let (states, usual, text) = capture("usual", &[]);
    let (_, _, named) = capture("named", &["--aim", "box"]);
    assert!(!states);
    assert_eq!(text, named);
    let (states, middle, _) = capture("middle", &["--aim", "middle"]);
    let (_, mass, _) = capture("mass", &["--aim", "mass"]);
    assert!(states && middle > usual && mass > usual, "{usual} {middle} {mass}");
}
