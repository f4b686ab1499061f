//! `palpate probe fit`, `palpate capture --probe` and `palpate data check`, as a user calls them.

use crate::{json, listing, run, stderr, stdout};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// An imperfect probe.
const CROOKED: &str = "radius = 0.15\nspacing = 1.5\nspeed = 10.0\n[real]\nspeed_factor = 0.9\n\
                       offsets = [0.0, -0.04, 0.0]\nnoise = \"2ms\"\ntimer = \"1ms\"\nmissed = [\"0%\", \"4%\", \"0%\"]\n";

/// The program's arguments, including paths.
macro_rules! arguments {
    ($($argument:expr),* $(,)?) => { [$(std::ffi::OsStr::new($argument)),*] };
}

/// Approaches by the imperfect probe, as a robot's: without a listing.
fn recorded(directory: &Path, name: &str, approaches: &str) -> PathBuf {
    let (probe, data) = (directory.join("true.toml"), directory.join(name));
    std::fs::write(&probe, CROOKED).unwrap();
    let seed = arguments!["--seed", "5", "--approaches", approaches];
    stdout(run([&arguments!["capture", "bowl", "mouse", "-o", &data, "--probe", &probe][..], &seed].concat()));
    let stated: Value = serde_json::from_slice(&std::fs::read(data.join("dataset.json")).unwrap()).unwrap();
    assert_eq!(stated["settings"]["real"]["speed"], 0.9);
    assert_eq!(stated["settings"]["real"]["missed"], serde_json::json!([0.0, 0.04, 0.0]));
    std::fs::remove_file(data.join("dataset.json")).unwrap();
    data
}

#[test]
fn a_crooked_probe_is_fitted_and_touches_are_captured_as_it_gives_them() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let (data, probe) = (recorded(at, "recorded", "400"), at.join("fitted.toml"));
    let fit = arguments!["probe", "fit", &data, "bowl", "mouse", "-o", &probe, "--approaches", "12000"];
    let found = json(run([&fit[..], &arguments!["--json"]].concat()));
    let number = |path: &str| found.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {found}"));
    assert!((number("/speed_factor/value") - 0.9).abs() < 0.05, "{found}");
    assert!(number("/speed_factor/low") < 0.91 && number("/speed_factor/high") > 0.88, "{found}");
    assert_eq!(number("/timer"), 1.0);
    assert!((number("/missed/1/value") - 0.04).abs() < 0.03, "{found}");
    let text = std::fs::read_to_string(&probe).unwrap();
    assert!(text.contains("speed_factor = 0.") && text.contains("timer = \"1ms\"") && text.contains(" to "), "{text}");
    let table = stdout(run(fit));
    assert!(
        table.contains("\nsecond finger ") && table.contains("95 % interval") && table.contains("Wrote "),
        "{table}"
    );
    assert_eq!(std::fs::read_to_string(&probe).unwrap(), text, "the same recordings give the same bytes");

    let (touches, ensemble) = (at.join("touches"), at.join("ensemble.json"));
    let capture = arguments!["capture", "bowl", "mouse", "-o", &touches, "--approaches", "2000"];
    stdout(run([&capture[..], &arguments!["--probe", &probe]].concat()));
    let stated: Value = serde_json::from_slice(&std::fs::read(touches.join("dataset.json")).unwrap()).unwrap();
    let real = stated["settings"]["real"].clone();
    assert!((real["speed"].as_f64().unwrap() - number("/speed_factor/value")).abs() < 1e-3, "{real}");
    // Whole milliseconds: the timer is in the touches.
    let lines = std::fs::read_to_string(touches.join("bowl.txt")).unwrap();
    let mut times = lines.split_whitespace().filter(|time| *time != "-");
    assert!(times.all(|time| time.ends_with("000")), "{}", &lines[..200]);
    // Training with the file adds nothing again; the ensemble states what there is.
    stdout(run(arguments!["train", &touches, "-o", &ensemble, "--trees", "rounds=3", "--probe", &probe]));
    let saved: Value = serde_json::from_slice(&std::fs::read(&ensemble).unwrap()).unwrap();
    let noise: Value = serde_json::from_str(saved["learner"]["attributes"]["palpate_noise"].as_str().unwrap()).unwrap();
    assert_eq!(noise, real);
    // Nor does testing.
    let evaluate = |more: &[&std::ffi::OsStr]| {
        json(run([&arguments!["evaluate", &ensemble, &touches, "--sequences", "50", "--json"], more].concat()))["accuracy"]
            .clone()
    };
    assert_eq!(evaluate(&[]), evaluate(&arguments!["--probe", &probe]));
    let error = stderr(run(arguments!["evaluate", &ensemble, &touches, "--probe", &at.join("true.toml")]), 1);
    assert!(error.contains("true.toml and the data set state different probes: [real]: "), "{error}");
    // Another probe's touches are not added to a data set.
    let add = arguments!["capture", "fork", "-o", &touches, "--approaches", "2000", "--add", "--probe"];
    let error = stderr(run([&add[..], &arguments![&at.join("true.toml")]].concat()), 1);
    assert!(error.contains("real is "), "{error}");
}

#[test]
fn recordings_that_look_wrong_are_named_and_nothing_is_written() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let (data, probe) = (recorded(at, "recorded", "250"), at.join("fitted.toml"));
    std::fs::copy(data.join("mouse.txt"), data.join("fork.txt")).unwrap();
    let fit = arguments!["probe", "fit", &data, "bowl", "mouse", "fork", "-o", &probe, "--approaches", "12000"];
    let error = stderr(run(fit), 1);
    assert!(
        error.contains("fork: these look like touches of the mouse") && error.contains("Nothing was written"),
        "{error}"
    );
    assert!(!probe.exists());
    let output = run([&fit[..], &arguments!["--force"]].concat());
    assert!(output.status.success());
    assert!(std::fs::read_to_string(&probe).unwrap().contains("# LOOKS WRONG: fork: "));
    assert!(listing(at).contains(&"fitted.toml".to_owned()));
    let error = stderr(run(arguments!["probe", "fit", &data, "bowl", "mouse", "-o", &probe]), 1);
    assert!(error.contains("fork was recorded, but is not among the objects"), "{error}");
}

#[test]
fn recorded_touches_are_compared_with_simulated_ones() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let data = recorded(at, "recorded", "300");
    let (clean, right) = (at.join("clean"), at.join("right"));
    let capture = arguments!["capture", "bowl", "mouse", "--approaches", "3000", "-o"];
    stdout(run([&capture[..], &arguments![&clean]].concat()));
    stdout(run([&capture[..], &arguments![&right, "--probe", &at.join("true.toml")]].concat()));
    let compare = |simulated: &Path| {
        let words = arguments!["data", "check", &data, simulated, "--sequences", "100", "--json"];
        json(run(words))
    };
    let [wrong, right_one] = [&clean, &right].map(|simulated| compare(simulated));
    let told = |of: &Value| of["told_apart"]["value"].as_f64().unwrap();
    assert!(told(&right_one) < 0.56 && told(&wrong) > told(&right_one) + 0.02, "{wrong} {right_one}");
    assert!(right_one["told_apart"]["low"].as_f64().unwrap() < 0.53, "{right_one}");
    let text = stdout(run(arguments!["data", "check", &data, &right, "--sequences", "100"]));
    assert!(text.contains("50 % is guessing") && text.contains("on recorded"), "{text}");
    let full = at.join("full");
    stdout(run(arguments!["capture", "bowl", "mouse", "--touches", "300", "-o", &full]));
    let error = stderr(run(arguments!["data", "check", &data, &full]), 1);
    assert!(error.contains("full touches only") && error.contains("--approaches"), "{error}");
}
