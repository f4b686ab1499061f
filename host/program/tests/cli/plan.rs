//! Plans of approaches, as a user makes, evaluates and follows them.

use crate::fixtures::PLANNED;
use crate::{command, fails, figures, lines, says, stdout, succeeds};
use serde_json::Value;
use std::fs;

#[test]
fn a_plan_is_made_evaluated_shown_and_followed() {
    let at = &PLANNED.folder();
    let length = |name: &str| fs::metadata(at.join(name)).unwrap().len();
    // 26 directions, three pairs, four bytes before them, eight before the section, and zeros.
    assert_eq!(length("planned.palpate"), length("model.palpate") + 4 + 26 * 3 + 8 + 2);
    let planned = figures(at, "plan model.palpate fresh -o again.palpate --rolls 1");
    assert_eq!((&planned["poses"], &planned["plan_bytes"]), (&26.into(), &82.into()));
    assert_eq!(fs::read(at.join("again.palpate")).unwrap(), fs::read(at.join("planned.palpate")).unwrap());
    let inspected = figures(at, "inspect planned.palpate");
    assert_eq!((&inspected["plan"]["rolls"], &inspected["plan"]["left_out"]), (&1.into(), &0.into()));
    assert!(figures(at, "inspect model.palpate")["plan"].is_null());

    let evaluate = "evaluate planned.palpate unseen --at 2,5 --sequences 300";
    let random = figures(at, evaluate);
    let active = figures(at, &format!("{evaluate} --active"));
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
    let text = succeeds(at, "evaluate planned.palpate unseen --sequences 100 --active");
    assert!(text.contains("Each approach is in the pose that the plan proposed, of 26"), "{text}");

    let follow = "recognize planned.palpate unseen/cigar.txt --next";
    says(at, follow, &["next: pose "]);
    let said = lines(&succeeds(at, &format!("{follow} --json")));
    let line = said.iter().find(|line| line["verdict"] == "undecided").unwrap();
    assert!(line["next"]["pose"].as_u64().unwrap() < 26 && line["next"]["direction"].is_array(), "{line}");
}

#[test]
fn an_evaluation_under_a_plan_is_the_same_on_any_number_of_threads() {
    let at = &PLANNED.folder();
    let evaluate = "evaluate planned.palpate unseen --sequences 50 --active --json";
    let on = |threads: &str| {
        let mut command = command(evaluate.split(' '));
        stdout(command.current_dir(at).env("RAYON_NUM_THREADS", threads).output().unwrap())
    };
    assert_eq!(on("1"), on("3"));
}

#[test]
fn what_cannot_be_planned_or_followed_is_refused_with_what_to_do() {
    let at = &PLANNED.folder();
    succeeds(at, "capture meshes -o full --pose --touches 100");
    succeeds(at, "capture meshes -o blind --approaches 500");
    let make = "palpate plan MODEL DIR -o OUT";
    for (words, code, expected) in [
        ("plan model.palpate fresh -o out.palpate --rolls 3", 2, "--rolls is 3. Use 1, 2 or 4"),
        ("plan model.palpate fresh -o out.palpate", 1, "are in one of the poses"),
        ("plan ensemble.json fresh -o out.palpate", 1, "not a Palpate model"),
        ("plan model.palpate full -o out.palpate", 1, "--approaches N --pose"),
        ("plan model.palpate blind -o out.palpate", 1, "pose"),
        ("calibrate model.palpate fresh -o out.palpate --active", 1, "has no plan"),
        ("evaluate model.palpate unseen --active", 1, make),
        ("evaluate ensemble.json unseen --active", 1, "has no plan"),
        ("recognize model.palpate unseen/disc.txt --next", 1, make),
        ("evaluate planned.palpate full --active", 1, "--approaches N --pose"),
        // Nothing is written over what is read.
        ("plan model.palpate fresh -o model.palpate", 2, "model.palpate"),
    ] {
        fails(at, words, code, expected);
    }
    assert!(!at.join("out.palpate").exists());
}

#[test]
fn a_promise_is_calibrated_under_the_plan_kept_under_it_and_another_one_at_random() {
    let at = &PLANNED.folder();
    succeeds(at, "capture meshes -o more --approaches 12000 --pose --seed 4");
    let calibrate = "calibrate planned.palpate more -o calibrated.palpate --error-rate 10%";
    let random = figures(at, calibrate);
    let active = figures(at, &format!("{calibrate} --active"));
    let sequences = |figures: &Value| figures["sequences"].as_u64().unwrap();
    // A few poses are proposed again and again, and used up long before the others.
    assert!(sequences(&active) > 30 && sequences(&active) < sequences(&random), "{active:#} {random:#}");
    assert!(active["error"].as_f64().unwrap() <= 0.1, "{active:#}");
    let evaluated = figures(at, "evaluate calibrated.palpate unseen --active --sequences 200");
    let sequential = &evaluated["approaches"]["sequential"];
    assert_eq!(sequential["promised"], 0.1);
    assert!(sequential["error"].as_f64().unwrap() < 0.12, "{sequential:#}");
    assert_eq!(evaluated["promise"]["void"], serde_json::json!([]));
    let passive = figures(at, "evaluate calibrated.palpate unseen --sequences 200");
    let void = passive["promise"]["void"].to_string();
    assert!(void.contains("as the plan proposes") && void.contains("at random"), "{void}");
}
