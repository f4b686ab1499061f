//! Probe files, true sizes and objects with several instances, as a user gives them.

use crate::{Folder, fails, figures, globe, read, succeeds};
use serde_json::Value;
use std::fs;
use std::path::Path;

const MILLIMETERS: &str = "unit = \"mm\"\nradius = 0.1\nspacing = 0.3\nspeed = 2.0\n";
const PUBLISHED: &str = "radius = 0.15\nspacing = 1.5\nspeed = 10\n";
const THICK: &str = "radius = 0.3\nspacing = 1.5\nspeed = 10\n[real]\nnoise = \"0..5ms\"\n";

/// A folder with two meshes about 2 long, and probe files.
fn set_up() -> Folder {
    let at = Folder::new();
    fs::create_dir(at.join("meshes")).unwrap();
    globe(&at.join("meshes"), "globe", 12);
    globe(&at.join("meshes"), "lump", 3);
    for (name, text) in [
        ("probe", MILLIMETERS),
        ("tenths", &MILLIMETERS.replace("mm", "unit")),
        ("broken", &format!("{MILLIMETERS}weight = 1\n")),
        ("published", PUBLISHED),
        ("thick", THICK),
    ] {
        fs::write(at.join(format!("{name}.toml")), text).unwrap();
    }
    at
}

#[test]
fn objects_keep_their_true_sizes_and_the_manifest_says_so() {
    let at = &set_up();
    let capture = "capture meshes -o data --touches 200 --probe probe.toml --true-size";
    fails(at, &format!("{capture} stated"), 1, "globe, lump: the true size is unknown … See --true-size");
    succeeds(at, &format!("{capture} mm,lump=cm"));
    let stated = read(&at.join("data/dataset.json"));
    assert_eq!(stated["settings"]["unit"], "mm");
    assert_eq!(stated["settings"]["probe"]["spacing"], 0.3);
    assert_eq!([0, 1].map(|object| stated["objects"][object]["millimeters"].as_f64()), [Some(1.0), Some(10.0)]);
    // Ten times as large, touched with the same probe: times are longer.
    let text = fs::read_to_string(at.join("data/globe.txt")).unwrap();
    let longest = text.split_whitespace().map(|time| time.parse::<f64>().unwrap()).fold(0.0, f64::max);
    assert!(longest < 1.2 && longest > 0.1, "{longest}");
    // Another unit of the mesh is another size.
    fails(
        at,
        &format!("{capture} in"),
        1,
        "data: holds dataset.json, globe.txt, lump.txt, which this capture would not write",
    );
    fails(at, &format!("{capture} plate=mm"), 2, "--true-size is plate");
}

#[test]
fn a_probe_in_another_unit_than_the_objects_is_refused() {
    let at = &set_up();
    for (more, code, expected) in [
        ("--probe probe.toml", 1, "probe.toml: … --true-size"),
        ("--probe tenths.toml --true-size mm", 1, "tenths.toml: … unit = \"mm\""),
        ("--true-size mm", 2, "--probe is not given … unit = \"mm\", radius = 1.5, spacing = 15, speed = 100"),
        ("--true-size mm --length 12 --probe probe.toml", 2, "--length"),
        ("--probe broken.toml", 1, "broken.toml:5: not a usable probe file: … weight"),
    ] {
        fails(at, &format!("capture meshes -o data --touches 200 {more}"), code, expected);
    }
    assert!(!at.join("data").exists());
    // The published probe is the one without a file.
    succeeds(at, "capture meshes -o data --touches 200 --probe published");
    assert_eq!(read(&at.join("data/dataset.json"))["settings"]["probe"]["radius"], 0.15);
}

#[test]
fn two_probes_that_meet_have_to_be_the_same() {
    let at = &set_up();
    for (data, probe) in [("other", "thick"), ("data", "published")] {
        succeeds(at, &format!("capture meshes -o {data} --touches 300 --probe {probe}.toml"));
    }
    assert_eq!(read(&at.join("other/dataset.json"))["settings"]["probe"]["radius"], 0.3);
    let train = "train data -o ensemble.json --trees rounds=3 --probe";
    let expected = "thick.toml and the data set state different probes: radius 0.3 and 0.15";
    fails(at, &format!("{train} thick.toml"), 1, expected);
    succeeds(at, &format!("{train} published.toml"));
    let [own, other] = ["data", "other"].map(|data| format!("evaluate ensemble.json {data} --sequences 50"));
    succeeds(at, &own);
    fails(at, &other, 1, "the model and the data set state different probes: radius 0.15 and 0.3");
    // A data set that states no probe is accepted.
    fs::remove_file(at.join("other/dataset.json")).unwrap();
    succeeds(at, &other);
    // It is then the file that says for which probe the ensemble is, and what the real one adds.
    succeeds(at, "train other -o ensemble.json --trees rounds=3 --probe thick.toml");
    let saved = read(&at.join("ensemble.json"));
    let attribute =
        |name: &str| -> Value { serde_json::from_str(saved["learner"]["attributes"][name].as_str().unwrap()).unwrap() };
    let probe = attribute("palpate_probe");
    assert_eq!((&probe["radius"], &probe["unit"]), (&0.3.into(), &"unit".into()));
    assert_eq!(attribute("palpate_noise")["deviation"]["largest"], 5_000.0);
    fails(at, &own, 1, "radius 0.3 and 0.15");
}

#[test]
fn run_and_view_take_the_probe_file() {
    let at = &set_up();
    succeeds(at, "run meshes -o out --touches 300 --true-size mm --probe probe.toml");
    assert_eq!(read(&at.join("out/data/dataset.json"))["settings"]["unit"], "mm");
    let saved = fs::read_to_string(at.join("out/ensemble.json")).unwrap();
    assert!(saved.contains(r#"\"unit\":\"mm\""#), "{}", &saved[..400]);
    assert_eq!(figures(at, "inspect out/model.palpate")["probe"]["speed"], 2.0);
    succeeds(at, "view meshes/globe.obj -o globe.html --true-size mm --probe probe.toml");
    assert!(fs::read_to_string(at.join("globe.html")).unwrap().contains("globe"));
    let expected = "state different probes: unit \"unit\" and \"mm\"";
    fails(at, "train out/data -o x.json --probe published.toml", 1, expected);
    fails(at, "run meshes -o out --true-size mm", 2, "--probe is not given");
}

/// The names of an object's instances in a data set.
fn instances(data: &Path, object: usize) -> Vec<String> {
    let listed = read(&data.join("dataset.json"))["objects"][object]["pools"].take();
    listed.as_array().unwrap().iter().map(|pool| pool["instance"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn a_directory_of_meshes_is_one_object_with_instances() {
    let at = &Folder::new();
    for (object, rings) in [("globe", [12, 9, 14]), ("lump", [3, 4, 5])] {
        let meshes = at.join("meshes").join(object);
        fs::create_dir_all(&meshes).unwrap();
        rings.into_iter().zip(["a", "b", "c"]).for_each(|(rings, name)| _ = globe(&meshes, name, rings));
    }
    let expected = "two objects are called a … \nIf each directory is one object, --instances takes it as such";
    fails(at, "capture meshes -o data --touches 300", 1, expected);
    let capture = "capture meshes -o data --touches 300 --instances";
    assert_eq!(figures(at, capture)["objects"].as_array().unwrap().len(), 2);
    assert_eq!(instances(&at.join("data"), 1), ["a", "b", "c"]);
    succeeds(at, "train data -o ensemble.json --trees rounds=3");
    succeeds(at, "capture meshes -o unseen --touches 300 --seed 2 --instances");
    assert_eq!(figures(at, "evaluate ensemble.json unseen --sequences 50")["touches"], 600);
    // Other instances are other touches.
    fs::remove_file(at.join("meshes/globe/c.obj")).unwrap();
    fails(at, capture, 1, "which this capture would not write");
}

#[test]
fn built_in_objects_vary_in_as_many_instances_as_asked_for() {
    let at = &Folder::new();
    let [one, other] = ["1", "2"].map(|seed| {
        succeeds(at, &format!("capture bowl --touches 60 --instances 2 -o {seed} --seed {seed}"));
        instances(&at.join(seed), 0)
    });
    assert_eq!(one.len(), 2);
    assert!(one.iter().all(|name| !other.contains(name)));
    fails(at, "capture --instances bowl -o 1", 2, "write what to touch before the option");
}
