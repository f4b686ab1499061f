//! Probe files, true sizes and objects with several instances, as a user gives them.

use crate::{globe, json, run, stderr, stdout};
use serde_json::Value;
use std::path::{Path, PathBuf};

const MILLIMETERS: &str = "unit = \"mm\"\nradius = 0.1\nspacing = 0.3\nspeed = 2.0\n";

fn write(directory: &Path, name: &str, text: &str) -> PathBuf {
    let path = directory.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

/// A directory of two meshes about 2 long, and one with a probe file.
fn set_up() -> (tempfile::TempDir, PathBuf, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let meshes = directory.path().join("meshes");
    std::fs::create_dir(&meshes).unwrap();
    globe(&meshes, "globe", 12);
    globe(&meshes, "lump", 3);
    let probe = write(directory.path(), "probe.toml", MILLIMETERS);
    (directory, meshes, probe)
}

fn listing(data: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(data.join("dataset.json")).unwrap()).unwrap()
}

/// Arguments of the program: words and paths.
macro_rules! arguments {
    ($($argument:expr),* $(,)?) => { [$(std::ffi::OsStr::new($argument)),*] };
}

#[test]
fn objects_keep_their_true_sizes_and_the_manifest_says_so() {
    let (directory, meshes, probe) = set_up();
    let data = directory.path().join("data");
    let capture = arguments!["capture", &meshes, "-o", &data, "--touches", "200", "--probe", &probe, "--true-size"];
    let error = stderr(run([&capture[..], &arguments!["stated"]].concat()), 1);
    assert!(error.contains("globe, lump: the true size is unknown") && error.contains("See --true-size"), "{error}");
    stdout(run([&capture[..], &arguments!["mm,lump=cm"]].concat()));
    let stated = listing(&data);
    assert_eq!(stated["settings"]["unit"], "mm");
    assert_eq!(stated["settings"]["probe"]["spacing"], 0.3);
    assert_eq!(
        (&stated["objects"][0]["millimeters"], &stated["objects"][1]["millimeters"]),
        (&1.0.into(), &10.0.into())
    );
    // Ten times as large, touched with the same probe: times are longer.
    let longest = |name: &str| -> f64 {
        let text = std::fs::read_to_string(data.join(name)).unwrap();
        text.split_whitespace().map(|time| time.parse::<f64>().unwrap()).fold(0.0, f64::max)
    };
    assert!(longest("globe.txt") < 1.2 && longest("globe.txt") > 0.1, "{}", longest("globe.txt"));
    // Another unit of the mesh is another size.
    let resumed = stderr(run([&capture[..], &arguments!["in", "--resume"]].concat()), 1);
    assert!(resumed.contains("a unit of globe's mesh is 1 mm there and 25.4 mm here"), "{resumed}");
    let error = stderr(run([&capture[..], &arguments!["plate=mm"]].concat()), 2);
    assert!(error.contains("--true-size is plate"), "{error}");
}

#[test]
fn a_probe_in_another_unit_than_the_objects_is_refused() {
    let (directory, meshes, probe) = set_up();
    let data = directory.path().join("data");
    let capture = arguments!["capture", &meshes, "-o", &data, "--touches", "200"];
    let error = stderr(run([&capture[..], &arguments!["--probe", &probe]].concat()), 1);
    assert!(error.contains("probe.toml: ") && error.contains("--true-size"), "{error}");
    let tenths = write(directory.path(), "tenths.toml", &MILLIMETERS.replace("mm", "unit"));
    let true_size = arguments!["--true-size", "mm"];
    let error = stderr(run([&capture[..], &true_size, &arguments!["--probe", &tenths]].concat()), 1);
    assert!(error.contains("tenths.toml: ") && error.contains("unit = \"mm\""), "{error}");
    let error = stderr(run([&capture[..], &true_size].concat()), 2);
    assert!(error.contains("--probe is not given"), "{error}");
    let error = stderr(run([&capture[..], &true_size, &arguments!["--length", "12", "--probe", &probe]].concat()), 2);
    assert!(error.contains("--length"), "{error}");
    let broken = write(directory.path(), "broken.toml", &format!("{MILLIMETERS}weight = 1\n"));
    let error = stderr(run([&capture[..], &arguments!["--probe", &broken]].concat()), 1);
    assert!(error.contains("broken.toml:5: not a usable probe file: ") && error.contains("weight"), "{error}");
    assert!(!data.exists());
    // The published probe is the one without a file.
    stdout(run([&capture[..], &arguments!["--probe", "published"]].concat()));
    assert_eq!(listing(&data)["settings"]["probe"]["radius"], 0.15);
}

#[test]
fn two_probes_that_meet_have_to_be_the_same() {
    let (directory, meshes, _) = set_up();
    let at = directory.path();
    let thick = write(at, "thick.toml", "radius = 0.3\nspacing = 1.5\nspeed = 10\n[real]\nnoise = \"0..5ms\"\n");
    let published = write(at, "published.toml", "radius = 0.15\nspacing = 1.5\nspeed = 10\n");
    let capture = |data: &Path, probe: &Path| {
        stdout(run(arguments!["capture", &meshes, "-o", data, "--touches", "300", "--probe", probe]));
    };
    let (thick_data, data, ensemble) = (at.join("thick"), at.join("data"), at.join("ensemble.json"));
    capture(&thick_data, &thick);
    capture(&data, &published);
    assert_eq!(listing(&thick_data)["settings"]["probe"]["radius"], 0.3);
    let train = arguments!["train", &data, "-o", &ensemble, "--trees", "rounds=3", "--probe"];
    let error = stderr(run([&train[..], &arguments![&thick]].concat()), 1);
    assert!(error.contains("thick.toml and the data set state different probes: radius 0.3 and 0.15"), "{error}");
    stdout(run([&train[..], &arguments![&published]].concat()));
    let evaluate = |data: &Path| run(arguments!["evaluate", &ensemble, data, "--sequences", "50"]);
    stdout(evaluate(&data));
    let error = stderr(evaluate(&thick_data), 1);
    assert!(error.contains("the model and the data set state different probes: radius 0.15 and 0.3"), "{error}");
    // A data set that states no probe is accepted.
    std::fs::remove_file(thick_data.join("dataset.json")).unwrap();
    stdout(evaluate(&thick_data));
    // It is then the file that says for which probe the ensemble is, and what the real one adds.
    let train = arguments!["train", &thick_data, "-o", &ensemble, "--trees", "rounds=3", "--probe", &thick];
    stdout(run(train));
    let saved: Value = serde_json::from_slice(&std::fs::read(&ensemble).unwrap()).unwrap();
    let attribute =
        |name: &str| -> Value { serde_json::from_str(saved["learner"]["attributes"][name].as_str().unwrap()).unwrap() };
    assert_eq!(
        (&attribute("palpate_probe")["radius"], &attribute("palpate_probe")["unit"]),
        (&0.3.into(), &"unit".into())
    );
    assert_eq!(attribute("palpate_noise")["deviation"]["largest"], 5_000.0);
    let error = stderr(evaluate(&data), 1);
    assert!(error.contains("radius 0.3 and 0.15"), "{error}");
    // Adding touches of another probe to a data set is refused as well.
    let ball = globe(at, "ball", 5);
    let add = arguments!["capture", &ball, "-o", &data, "--add", "--touches", "300", "--probe", &thick];
    assert!(stderr(run(add), 1).contains("\"radius\":0.15"));
}

#[test]
fn run_tune_and_view_take_the_probe_file() {
    let (directory, meshes, probe) = set_up();
    let at = directory.path();
    let (out, page, data) = (at.join("out"), at.join("globe.html"), at.join("out/data"));
    let size = arguments!["--true-size", "mm", "--probe", &probe];
    stdout(run([&arguments!["run", &meshes, "-o", &out, "--touches", "300"][..], &size].concat()));
    assert_eq!(listing(&data)["settings"]["unit"], "mm");
    let saved = std::fs::read_to_string(out.join("ensemble.json")).unwrap();
    assert!(saved.contains(r#"\"unit\":\"mm\""#), "{}", &saved[..400]);
    stdout(run([&arguments!["view", &meshes.join("globe.obj"), "-o", &page][..], &size].concat()));
    assert!(std::fs::read_to_string(&page).unwrap().contains("globe"));
    let published = write(at, "published.toml", "radius = 0.15\nspacing = 1.5\nspeed = 10\n");
    let error = stderr(run(arguments!["tune", &data, "--probe", &published]), 1);
    assert!(error.contains("state different probes: unit \"unit\" and \"mm\""), "{error}");
    let error = stderr(run(arguments!["run", &meshes, "-o", &out, "--true-size", "mm"]), 2);
    assert!(error.contains("--probe is not given"), "{error}");
}

#[test]
fn a_directory_of_meshes_is_one_object_with_instances() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    for (object, rings) in [("globe", [12, 9, 14]), ("lump", [3, 4, 5])] {
        let meshes = at.join("meshes").join(object);
        std::fs::create_dir_all(&meshes).unwrap();
        rings.into_iter().zip(["a", "b", "c"]).for_each(|(rings, name)| _ = globe(&meshes, name, rings));
    }
    let (meshes, data) = (at.join("meshes"), at.join("data"));
    let summary = json(run(arguments!["capture", &meshes, "-o", &data, "--touches", "300", "--instances", "--json"]));
    assert_eq!(summary["objects"].as_array().unwrap().len(), 2);
    assert_eq!(listing(&data)["objects"][1]["instances"], serde_json::json!(["a", "b", "c"]));
    let (ensemble, evaluated) = (at.join("ensemble.json"), at.join("unseen"));
    stdout(run(arguments!["train", &data, "-o", &ensemble, "--trees", "rounds=3"]));
    let unseen = arguments!["capture", &meshes, "-o", &evaluated, "--touches", "300", "--seed", "2", "--instances"];
    stdout(run(unseen));
    let figures = json(run(arguments!["evaluate", &ensemble, &evaluated, "--sequences", "50", "--json"]));
    assert_eq!(figures["touches"], 600);
    // Other instances are other touches.
    std::fs::remove_file(meshes.join("globe/c.obj")).unwrap();
    let again = arguments!["capture", &meshes, "-o", &data, "--touches", "300", "--instances"];
    let error = stderr(run(again), 1);
    assert!(error.contains("globe has 3 instances there and 2 here"), "{error}");
}

#[test]
fn built_in_objects_vary_in_as_many_instances_as_asked_for() {
    let directory = tempfile::tempdir().unwrap();
    let [one, other] = ["one", "other"].map(|name| directory.path().join(name));
    let capture = arguments!["capture", "bowl", "mouse", "--touches", "60", "--instances", "3", "-o"];
    stdout(run([&capture[..], &arguments![&one]].concat()));
    stdout(run([&capture[..], &arguments![&other, "--seed", "2"]].concat()));
    let instances = |data: &Path| listing(data)["objects"][0]["instances"].as_array().unwrap().clone();
    assert_eq!(instances(&one).len(), 3);
    assert!(instances(&one).iter().all(|name| !instances(&other).contains(name)));
    let error = stderr(run(arguments!["capture", "--instances", "bowl", "-o", &one]), 2);
    assert!(error.contains("write what to touch before the option"), "{error}");
}
