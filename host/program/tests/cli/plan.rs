//! Plans of approaches, as a user makes, evaluates and follows them.

use crate::{command, json, run, stderr, stdout};
use palpate::mesh::{Mesh, obj};
use serde_json::Value;
use std::path::PathBuf;

/// Three shapes, touched; a model that knows the pose, and the same with a plan.
struct Place {
    directory: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let place = Self { directory: tempfile::tempdir().unwrap() };
        std::fs::create_dir(place.path("meshes")).unwrap();
        for (name, sides) in [("ball", [1.0, 1.0, 1.0]), ("cigar", [1.0, 0.4, 0.4]), ("disc", [1.0, 1.0, 0.3])] {
            let (mut mesh, mut text) = (Mesh::globe(8), Vec::new());
            for vertex in &mut mesh.vertices {
                vertex.iter_mut().zip(sides).for_each(|(coordinate, side)| *coordinate *= side);
            }
            obj::write(&mesh, &mut text).unwrap();
            std::fs::write(place.path("meshes").join(format!("{name}.obj")), text).unwrap();
        }
        for (data, seed) in [("train", "1"), ("fresh", "2"), ("unseen", "3")] {
            place.capture(data, &["--approaches", "1500", "--pose", "--seed", seed]);
        }
        place.ok(&[
            "train",
            "train",
            "-o",
            "ensemble.json",
            "--descriptor",
            "oriented",
            "--evidence",
            "all",
            "--trees",
            "rounds=8",
        ]);
        place.ok(&["export", "ensemble.json", "-o", "model.palpate"]);
        place.ok(&["calibrate", "model.palpate", "fresh", "-o", "planned.palpate", "--plan", "1"]);
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn capture(&self, data: &str, options: &[&str]) {
        self.ok(&[&["capture", "meshes", "-o", data], options].concat());
    }

    fn ok(&self, arguments: &[&str]) -> String {
        stdout(command(arguments).current_dir(self.directory.path()).output().unwrap())
    }

    fn json(&self, arguments: &[&str]) -> Value {
        json(command(arguments).current_dir(self.directory.path()).output().unwrap())
    }

    fn fails(&self, arguments: &[&str], code: i32, expected: &str) {
        let message = stderr(command(arguments).current_dir(self.directory.path()).output().unwrap(), code);
        assert!(message.contains(expected), "{message}");
    }
}

#[test]
fn a_plan_is_made_evaluated_shown_and_followed() {
    let place = Place::new();
    let length = |name: &str| std::fs::metadata(place.path(name)).unwrap().len();
    // 26 directions, three pairs, four bytes before them, eight before the section, and zeros.
    assert_eq!(length("planned.palpate"), length("model.palpate") + 4 + 26 * 3 + 8 + 2);
    let planned = place.json(&["calibrate", "model.palpate", "fresh", "-o", "again.palpate", "--plan", "1", "--json"]);
    assert_eq!((&planned["poses"], &planned["plan_bytes"]), (&26.into(), &82.into()));
    assert_eq!(
        std::fs::read(place.path("again.palpate")).unwrap(),
        std::fs::read(place.path("planned.palpate")).unwrap()
    );
    let inspected = place.json(&["inspect", "planned.palpate", "--json"]);
    assert_eq!((&inspected["plan"]["rolls"], &inspected["plan"]["left_out"]), (&1.into(), &0.into()));
    assert!(place.json(&["inspect", "model.palpate", "--json"])["plan"].is_null());

    let evaluate = ["evaluate", "planned.palpate", "unseen", "--at", "2,5", "--sequences", "300", "--json"];
    let random = place.json(&evaluate);
    let active = place.json(&[&evaluate[..], &["--active"]].concat());
    let fields = |figures: &Value| figures.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    let mut expected = fields(&random);
    expected.push("active".into());
    expected.sort();
    assert_eq!(fields(&active), expected);
    assert_eq!(fields(&active["approaches"]), fields(&random["approaches"]));
    let mean = |figures: &Value| figures["approaches"]["sequential"]["mean_approaches"].as_f64().unwrap();
    assert!(mean(&active) < mean(&random), "{} {}", mean(&active), mean(&random));
    let accuracy = |figures: &Value| figures["approaches"]["accuracy"]["5"].as_f64().unwrap();
    // On three ellipsoids a direction changes little in the first approaches.
    assert!(accuracy(&active) > accuracy(&random) - 0.05, "{} {}", accuracy(&active), accuracy(&random));
    // Every approach counts as evidence to this model, up to late contacts.
    let touches = active["sequential"]["mean_touches"].as_f64().unwrap();
    assert!((touches - mean(&active)).abs() < 0.1 * touches, "{touches}");
    let text = place.ok(&["evaluate", "planned.palpate", "unseen", "--sequences", "100", "--active"]);
    assert!(text.contains("Each approach is in the pose that the plan proposed, of 26"), "{text}");

    let followed = place.ok(&["recognize", "planned.palpate", "unseen/cigar.txt", "--active"]);
    assert!(followed.contains("next: pose "), "{followed}");
    let line = place.ok(&["recognize", "planned.palpate", "unseen/cigar.txt", "--active", "--json"]);
    let line: Value = serde_json::from_str(line.lines().find(|line| line.contains("undecided")).unwrap()).unwrap();
    assert!(line["next"]["pose"].as_u64().unwrap() < 26 && line["next"]["direction"].is_array(), "{line}");
}

#[test]
fn an_evaluation_under_a_plan_is_the_same_on_any_number_of_threads() {
    let place = Place::new();
    let evaluate = ["evaluate", "planned.palpate", "unseen", "--sequences", "50", "--active", "--switch", "--json"];
    let on = |threads: &str| {
        let mut command = command(evaluate);
        stdout(command.current_dir(place.directory.path()).env("RAYON_NUM_THREADS", threads).output().unwrap())
    };
    assert_eq!(on("1"), on("3"));
}

#[test]
fn what_cannot_be_planned_or_followed_is_refused_with_what_to_do() {
    let place = Place::new();
    let plan = |model: &'static str, data: &'static str, rolls: &'static str| {
        ["calibrate", model, data, "-o", "out.palpate", "--plan", rolls]
    };
    place.fails(&plan("model.palpate", "fresh", "3"), 2, "--plan is 3. Use 1, 2 or 4");
    place.fails(&plan("model.palpate", "fresh", "4"), 1, "are in one of the poses");
    place.fails(&plan("ensemble.json", "fresh", "1"), 1, "not a Palpate model");
    place.capture("full", &["--pose", "--touches", "100"]);
    place.fails(&plan("model.palpate", "full", "1"), 1, "--approaches N --pose");
    place.capture("blind", &["--approaches", "500"]);
    place.fails(&plan("model.palpate", "blind", "1"), 1, "pose");
    assert!(!place.path("out.palpate").exists());
    place.fails(&["evaluate", "model.palpate", "unseen", "--active"], 1, "palpate calibrate MODEL DIR -o OUT --plan 4");
    place.fails(&["evaluate", "ensemble.json", "unseen", "--active"], 1, "has no plan");
    place.fails(
        &["recognize", "model.palpate", "unseen/disc.txt", "--active"],
        1,
        "palpate calibrate MODEL DIR -o OUT --plan 4",
    );
    place.fails(&["evaluate", "planned.palpate", "full", "--active"], 1, "--approaches N --pose");
    place.fails(&["evaluate", "ensemble.json", "unseen", "--switch"], 1, "Export the ensemble first");
    place.fails(&["evaluate", "model.palpate", "unseen", "--switch", "0"], 2, "--switch is 0");
    // Nothing is written over what is read.
    place.fails(&["calibrate", "model.palpate", "fresh", "-o", "model.palpate", "--plan", "1"], 2, "model.palpate");
}

#[test]
fn a_promise_is_calibrated_under_the_plan_and_kept_under_it() {
    let place = Place::new();
    place.capture("more", &["--approaches", "30000", "--pose", "--seed", "4"]);
    let calibrate =
        ["calibrate", "planned.palpate", "more", "-o", "calibrated.palpate", "--error-rate", "5%", "--json"];
    let random = place.json(&calibrate);
    let active = place.json(&[&calibrate[..], &["--active"]].concat());
    let sequences = |figures: &Value| figures["sequences"].as_u64().unwrap();
    // A few poses are proposed again and again, and used up long before the others.
    assert!(sequences(&active) > 60 && sequences(&active) < sequences(&random), "{active:#} {random:#}");
    assert!(active["error"].as_f64().unwrap() <= 0.05, "{active:#}");
    let evaluated =
        place.json(&["evaluate", "calibrated.palpate", "unseen", "--active", "--sequences", "2000", "--json"]);
    let sequential = &evaluated["approaches"]["sequential"];
    assert_eq!(sequential["promised"], 0.05);
    assert!(sequential["error"].as_f64().unwrap() < 0.06, "{sequential:#}");
    assert_eq!(evaluated["promise"]["void"], serde_json::json!([]));
    // At random it is another promise.
    let passive = place.json(&["evaluate", "calibrated.palpate", "unseen", "--sequences", "200", "--json"]);
    let void = passive["promise"]["void"].to_string();
    assert!(void.contains("as the plan proposes") && void.contains("at random"), "{void}");
    place.fails(&["calibrate", "model.palpate", "more", "-o", "x.palpate", "--active"], 1, "has no plan");
}

#[test]
fn forgetting_finds_an_exchanged_object_sooner() {
    let place = Place::new();
    let figures = place.json(&["evaluate", "model.palpate", "unseen", "--sequences", "500", "--switch", "3", "--json"]);
    let of = |rule: &str, case: &str, figure: &str| figures["switch"][rule][case][figure].as_f64().unwrap();
    assert_eq!(figures["switch"]["nats"], 3.0);
    let after = |rule| of(rule, "switched", "mean_approaches");
    assert!(after("on") < after("off"), "{figures:#}");
    // Nearly all errors of the exchanged are decisions before the exchange, which no rule can mend.
    let beyond = |case| of("on", case, "error") - of("off", case, "error");
    assert!(beyond("switched") <= 2.0 * of("off", "switched", "error_standard_error"), "{figures:#}");
    assert!(beyond("still") < 0.01, "{figures:#}");
    let old = figures["switch"]["on"]["old"].as_f64().unwrap();
    assert!(of("on", "switched", "error") - old < 0.02, "{figures:#}");
    let text = place.ok(&["evaluate", "model.palpate", "unseen", "--switch"]);
    assert!(text.contains("at 5 nats"), "{text}");
}

#[test]
fn a_plan_takes_no_option_of_a_promise() {
    let error = stderr(run(["calibrate", "m.palpate", "d", "-o", "x", "--plan", "4", "--error-rate", "1%"]), 2);
    assert!(error.contains("--plan") && error.contains("cannot be used with"), "{error}");
}
