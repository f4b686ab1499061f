//! `palpate probe fit` and `palpate capture --probe`, as a user calls them.

use crate::fixtures::CROOKED;
use crate::{fails, figures, read, says, succeeds};
use serde_json::Value;
use std::fs;

#[test]
fn a_crooked_probe_is_fitted_and_touches_are_captured_as_it_gives_them() {
    let at = &CROOKED.folder();
    let fit = "probe fit recorded meshes -o fitted.toml --approaches 4000";
    let found = figures(at, fit);
    let number = |path: &str| found.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {found}"));
    assert!((number("/speed_factor/value") - 0.9).abs() < 0.05, "{found}");
    assert!(number("/speed_factor/low") < 0.91 && number("/speed_factor/high") > 0.88, "{found}");
    assert_eq!(number("/timer"), 1.0);
    assert!((number("/missed/1/value") - 0.04).abs() < 0.03, "{found}");
    let text = fs::read_to_string(at.join("fitted.toml")).unwrap();
    assert!(text.contains("speed_factor = 0.") && text.contains("timer = \"1ms\"") && text.contains(" to "), "{text}");
    says(at, fit, &["\nsecond finger ", "95 % interval", "Wrote "]);
    assert_eq!(fs::read_to_string(at.join("fitted.toml")).unwrap(), text, "the same recordings give the same bytes");

    succeeds(at, "capture meshes -o touches --approaches 500 --probe fitted.toml");
    let real = read(&at.join("touches/dataset.json"))["settings"]["real"].take();
    assert!((real["speed"].as_f64().unwrap() - number("/speed_factor/value")).abs() < 1e-3, "{real}");
    // Whole milliseconds: the timer is in the touches.
    let lines = fs::read_to_string(at.join("touches/bowl.txt")).unwrap();
    let mut times = lines.split_whitespace().filter(|time| *time != "-");
    assert!(times.all(|time| time.ends_with("000")), "{}", &lines[..200]);
    // Training with the file adds nothing again; the ensemble states what there is.
    succeeds(at, "train touches -o ensemble.json --trees rounds=3 --probe fitted.toml");
    let noise = read(&at.join("ensemble.json"))["learner"]["attributes"]["palpate_noise"].take();
    assert_eq!(serde_json::from_str::<Value>(noise.as_str().unwrap()).unwrap(), real);
    // Nor does testing.
    let evaluate = "evaluate ensemble.json touches --sequences 50";
    let with_probe = figures(at, &format!("{evaluate} --probe fitted.toml"));
    assert_eq!(figures(at, evaluate)["accuracy"], with_probe["accuracy"]);
    let expected = "true.toml and the data set state different probes: [real]: ";
    fails(at, "evaluate ensemble.json touches --probe true.toml", 1, expected);
    let expected = "mouse was recorded, but is not among the objects: bowl";
    fails(at, "probe fit recorded meshes/bowl.obj -o other.toml", 1, expected);
}

#[test]
fn evaluation_on_recordings_shows_the_cost_of_a_wrong_probe() {
    let at = &CROOKED.folder();
    let right = ["clean", "right --probe true.toml"].map(|how| {
        let (name, _) = how.split_once(' ').unwrap_or((how, ""));
        succeeds(at, &format!("capture meshes --approaches 3000 -o {how}"));
        succeeds(at, &format!("train {name} -o {name}.json --trees rounds=10"));
        let evaluated = figures(at, &format!("evaluate {name}.json recorded --at 10 --sequences 300"));
        evaluated["accuracy"]["10"].as_f64().unwrap()
    });
    assert!(right[1] > right[0], "{right:?}");
}
