//! The commands that make and measure models, as a user calls them: train, evaluate, calibrate.

use crate::fixtures::{BOWL_AND_FORK, CALIBRATED, boxes};
use crate::{Folder, cut, fails, figures, parts_are_all_bytes, read, says, shapes, succeeds};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

#[test]
fn an_ensemble_and_its_compiled_model_evaluate_side_by_side_and_noise_of_every_kind_makes_them_worse() {
    let at = &BOWL_AND_FORK.folder();
    let trained = figures(at, "train data -o again.json --trees rounds=5");
    assert_eq!((&trained["trees"], &trained["touches"]), (&5.into(), &800.into()));
    let evaluate =
        |model: &str, more: &str| figures(at, &format!("evaluate {model} data --at 5,20 --sequences 100{more}"));
    let found = ["ensemble.json", "model.palpate"].map(|model| evaluate(model, ""));
    for found in &found {
        assert!(found["accuracy"]["20"].as_f64() >= found["accuracy"]["5"].as_f64());
        assert!(found["per_object"]["fork"]["5"].is_number());
        assert!(found["sequential"]["mean_touches"].as_f64() >= Some(1.0));
    }
    let after_10 = "evaluate ensemble.json data --at 10 --sequences 100";
    let clean = figures(at, after_10);
    assert_eq!(clean["robots"], 1);
    for noise in ["noise=0..400ms", "timer=200ms", "debounce=400ms", "bent=0ms/150ms/0ms", "speed_error=90%"] {
        let noisy = figures(at, &format!("{after_10} --real {noise}"));
        assert!(noisy["accuracy"]["10"].as_f64() < clean["accuracy"]["10"].as_f64(), "{noise}: {noisy}");
    }
    let noisy = evaluate("model.palpate", " --real noise=200ms");
    assert!(noisy["accuracy"]["20"].as_f64() < found[1]["accuracy"]["20"].as_f64());
    says(at, "evaluate model.palpate data", &["bowl", "Stopping at an error rate of 1 %"]);
}

#[test]
fn training_says_what_a_millisecond_of_noise_would_cost_and_an_ensemble_states_its_noise() {
    let at = &BOWL_AND_FORK.folder();
    let noise = || read(&at.join("e.json"))["learner"]["attributes"]["palpate_noise"].take();
    let train = "train data -o e.json --trees rounds=3";
    says(at, train, &["1 ms of noise on contact times would cost", "--real noise=1ms"]);
    assert_eq!(noise(), Value::Null);
    let found = figures(at, train);
    assert!(found["cost_of_noise"]["clean"].as_f64() > Some(0.5) && found["cost_of_noise"]["touches"] == 10, "{found}");
    let text = succeeds(at, &format!("{train} --real noise=0..10ms,timer=1ms"));
    assert!(!text.contains("would cost"), "{text}");
    let noise: Value = serde_json::from_str(noise().as_str().unwrap()).unwrap();
    assert_eq!((&noise["deviation"]["largest"], &noise["timer"]), (&10_000.0.into(), &1_000.0.into()));
    // The model that it is compiled to is read again.
    succeeds(at, "export e.json -o noisy.palpate");
    for file in ["data/bowl.txt", "data/fork.txt"] {
        cut(&at.join(file), &at.join(file), 99);
    }
    says(at, train, &["was not measured: an object has fewer than 100 touches"]);
}

#[test]
fn smaller_presets_make_smaller_models_that_are_exact() {
    let at = &BOWL_AND_FORK.folder();
    let bytes = ["compact", "small", "tiny"].map(|preset| {
        succeeds(at, &format!("train data -o e.json --preset {preset} --trees min_child_weight=5"));
        let exported = figures(at, "export e.json -o m.palpate");
        assert_eq!(exported["margin_error"], 0.0, "{exported:#}");
        exported["bytes"].as_u64().unwrap()
    });
    assert!(bytes[0] > bytes[1] && bytes[1] > bytes[2], "{bytes:?}");
    fails(at, "train data -o e.json --preset large", 2, "use one of compact, small, tiny, paper");
}

#[test]
fn what_cannot_be_trained_is_refused_and_an_older_ensemble_stays() {
    let at = &BOWL_AND_FORK.folder();
    let before = fs::read(at.join("ensemble.json")).unwrap();
    let write = |name: &str, text: &str| {
        fs::create_dir_all(at.join(name).parent().unwrap()).unwrap();
        fs::write(at.join(name), text).unwrap();
    };
    let touches = "0 0 0.01\n0 0 0.02\n";
    write("lonely/bowl.txt", touches);
    write("broken/bowl.txt", touches);
    write("broken/fork.txt", "0.0 0.1 0.2\n0.0 -0.1 inf\n");
    write("tab/bowl.txt", touches);
    write("tab/fo\trk.txt", touches);
    (0..300).for_each(|number| write(&format!("many/{number}.txt"), touches));
    fs::create_dir(at.join("empty")).unwrap();
    for (words, code, expected) in [
        ("lonely", 1, "lonely"),
        ("empty", 1, "empty"),
        ("broken", 1, "fork.txt:2:"),
        ("missing", 1, "missing"),
        ("tab", 1, "tab: the object's name \"fo\\trk\" has a control character"),
        ("many", 1, "many: there are 300 objects to train on, more than the 256"),
        ("data --descriptor gravity", 1, "with their pose"),
        ("data --descriptor shape", 2, "curvature"),
        ("data --trees rounds=0", 2, "rounds is 0"),
        ("data --real noise=5", 2, "unit"),
        ("data --trees bins=9/9", 2, "bins is "),
        ("data --no-such-option", 2, "--no-such-option"),
    ] {
        fails(at, &format!("train {words} -o ensemble.json"), code, expected);
    }
    assert_eq!(fs::read(at.join("ensemble.json")).unwrap(), before);
    let left = ["broken", "data", "empty", "ensemble.json", "lonely", "many", "model.palpate", "tab"];
    assert_eq!(crate::listing(at), left);
}

#[test]
fn what_cannot_be_evaluated_is_refused() {
    let at = &BOWL_AND_FORK.folder();
    fs::write(at.join("cut.palpate"), &fs::read(at.join("model.palpate")).unwrap()[..100]).unwrap();
    for (from, to) in [("bowl", "others/bowl"), ("fork", "others/spoon"), ("bowl", "few/bowl"), ("fork", "few/fork")] {
        cut(&at.join(format!("data/{from}.txt")), &at.join(format!("{to}.txt")), 30);
    }
    for (words, code, expected) in [
        ("cut.palpate data", 1, "cut.palpate: byte 100:"),
        ("missing.palpate data", 1, "missing.palpate: cannot read"),
        ("data/bowl.txt data", 1, "bowl.txt"),
        ("model.palpate others", 1, "does not know the object spoon"),
        ("model.palpate data --at 401", 2, "bowl has only 400"),
        ("model.palpate data --error-rate 0.7", 2, "--error-rate"),
        ("model.palpate data --sequences 0", 2, "--sequences"),
        ("model.palpate data --max-touches 0", 2, "touches is 0. Use at least 1."),
        ("model.palpate data --real missed=200%", 2, "missed is \"200%\"; use a share from 0 to 1"),
        ("model.palpate data --real bent=9:1ms", 2, "bent is \"9:1ms\"; use a duration"),
        ("model.palpate few --at 30", 2, "of 30 touches only 1 different groups of 30"),
        ("model.palpate few --at 31", 2, "has only 30"),
    ] {
        fails(at, &format!("evaluate {words}"), code, expected);
    }
    // No accuracy rests on the one group that a small set has.
    let found = figures(at, "evaluate model.palpate few --sequences 50");
    let given: Vec<&String> = found["accuracy"].as_object().unwrap().keys().collect();
    assert_eq!(given, ["10", "20", "5"]);
}

#[test]
fn evaluating_on_the_training_touches_says_so() {
    let at = &BOWL_AND_FORK.folder();
    succeeds(at, "train data -o ensemble.json --trees rounds=3 --real noise=1ms");
    let said = "The model was trained on these touches of bowl, fork";
    let evaluate = "evaluate ensemble.json data --sequences 50";
    says(at, evaluate, &[said]);
    says(at, &format!("{evaluate} --real noise=5ms"), &[said]);
    assert_eq!(figures(at, evaluate)["trained_on"], json!(["bowl", "fork"]));
    // The same touches from the other end: other touches.
    for file in ["data/bowl.txt", "data/fork.txt"] {
        let text = fs::read_to_string(at.join(file)).unwrap();
        fs::write(at.join(file), text.lines().rev().collect::<Vec<_>>().join("\n")).unwrap();
    }
    assert!(!succeeds(at, evaluate).contains("was trained on"));
}

#[test]
fn a_compiled_model_knows_the_touches_that_it_was_trained_on_and_no_promise_is_made_on_them() {
    let at = &Folder::new();
    shapes(at);
    for (objects, out, more) in [
        ("meshes", "data", "--touches 60"),
        ("meshes", "more", "--touches 90 --pose"),
        ("meshes", "unseen", "--touches 90 --seed 2"),
        ("meshes/cigar.obj meshes/disc.obj", "fewer", "--touches 30"),
    ] {
        succeeds(at, &format!("capture {objects} -o {out} {more}"));
    }
    succeeds(at, "train data -o ensemble.json --trees rounds=2");
    succeeds(at, "export ensemble.json -o model.palpate");
    for model in ["ensemble.json", "model.palpate"] {
        for (data, expected) in [
            ("data", json!(["ball", "cigar", "disc"])),
            ("more", json!(["ball", "cigar", "disc"])),
            ("fewer", json!(["cigar", "disc"])),
            ("unseen", json!([])),
        ] {
            let found = figures(at, &format!("evaluate {model} {data} --sequences 20"));
            assert_eq!(found["trained_on"], expected, "{model}, {data}");
        }
    }
    let said =
        "the model was trained on these touches of ball, cigar, disc: a promise calibrated on them would not hold";
    fails(at, "calibrate model.palpate more -o sure.palpate", 1, said);
    assert!(!at.join("sure.palpate").exists());
    // Others are too few here, which is another problem.
    fails(at, "calibrate model.palpate unseen -o sure.palpate", 1, "too few to promise");
}

#[test]
fn evaluate_shows_undecided_sequences() {
    let at = &BOWL_AND_FORK.folder();
    let evaluate = "evaluate ensemble.json data --sequences 100 --max-touches 1";
    let table = succeeds(at, evaluate);
    assert!(table.lines().next().unwrap().ends_with("undecided"), "{table}");
    let found = figures(at, evaluate);
    let sequential = &found["sequential"];
    assert!(sequential["undecided"].as_f64() > Some(0.5), "{sequential}");
    assert!(sequential["undecided_per_object"]["bowl"].is_number());
}

#[test]
fn a_calibrated_model_promises_in_all_or_by_name_and_evaluate_shows_whether_it_keeps_it() {
    let at = &CALIBRATED.folder();
    let before = figures(at, "evaluate model.palpate unseen");
    assert_eq!((&before["sequential"]["promised"], &before["sequential"]["error_rate"]), (&Value::Null, &0.01.into()));
    assert!(before.get("promise").is_none());
    let calibrated = figures(at, "calibrate model.palpate fresh -o calibrated.palpate --error-rate 5%");
    assert_eq!((&calibrated["promised"], &calibrated["per"]), (&0.05.into(), &"average".into()));
    assert!(calibrated["error"].as_f64().unwrap() <= 0.05 && calibrated["sequences"].as_u64().unwrap() > 500);
    let given = ["bowl", "fork"].map(|object| calibrated["objects"][object]["given"].as_u64().unwrap());
    assert!(given.iter().sum::<u64>() > 500, "{calibrated}");
    let inspected = figures(at, "inspect calibrated.palpate");
    let promise = &inspected["promise"];
    assert_eq!((&promise["error_rate"], &promise["confidence"]), (&0.05.into(), &0.95.into()));
    assert_eq!(promise["sequences"], calibrated["sequences"]);
    assert_eq!(promise["margins"]["bowl"], promise["margins"]["fork"]);
    parts_are_all_bytes(&inspected);
    says(at, "inspect calibrated.palpate", &["at most 5 % of all names given wrong"]);

    let evaluate = "evaluate calibrated.palpate unseen";
    let evaluated = figures(at, evaluate);
    let (sequential, promise) = (&evaluated["sequential"], &evaluated["promise"]);
    assert_eq!((&sequential["promised"], &sequential["per"]), (&0.05.into(), &"average".into()));
    assert_eq!((&promise["promised"], promise["void"].as_array().unwrap().len()), (&0.05.into(), 0));
    assert!(sequential["error"].as_f64().unwrap() <= 0.05 + 3.0 * sequential["error_standard_error"].as_f64().unwrap());
    says(at, evaluate, &["Promised: at most 5 % wrong"]);
    // Another error rate is that of the posterior, which nothing promises.
    let replaced = figures(at, &format!("{evaluate} --error-rate 0.05"));
    assert_eq!(replaced["sequential"]["promised"], Value::Null);
    assert!(replaced.get("promise").is_none());
    // Other noise makes the promise void; how far it is broken is said.
    let evaluate = format!("{evaluate} --real noise=50ms");
    let noisy = figures(at, &evaluate);
    assert!(noisy["promise"]["void"][0].as_str().unwrap().contains("noise of 50 ms"));
    assert!(noisy["promise"]["exceeded_by"].as_f64().unwrap() > 0.0);
    says(at, &evaluate, &["the promise is broken by ", "void: promised with no noise"]);
    // Thresholds by name are stated for each and evaluated for each.
    let per = "calibrate model.palpate fresh -o names.palpate --error-rate 0.1 --per name";
    says(at, per, &["Each name is wrong at most 10 % of the times that it is given."]);
    assert_eq!(figures(at, "inspect names.palpate")["promise"]["per"], "name");
    let evaluated = figures(at, "evaluate names.palpate unseen");
    assert_eq!(evaluated["sequential"]["per"], "name");
    let errors = evaluated["sequential"]["error_per_name"].as_object().unwrap();
    assert_eq!(errors.keys().collect::<Vec<_>>(), ["bowl", "fork"]);
    let largest = errors.values().map(|error| error.as_f64().unwrap()).fold(0.0, f64::max);
    assert!((evaluated["promise"]["error"].as_f64().unwrap() - largest).abs() < 1e-12);
}

/// Records touches of both objects.
fn record(at: &Path, data: &str, to: &str) {
    for object in ["bowl", "fork"] {
        succeeds(at, &format!("data record {data}/{object}.txt -o {to} --object {object}"));
    }
}

#[test]
fn a_promise_for_a_robot_is_tested_on_its_recordings_and_too_few_say_what_they_support() {
    let at = &CALIBRATED.folder();
    for object in ["bowl", "fork"] {
        cut(&at.join(format!("unseen/{object}.txt")), &at.join(format!("some/{object}.txt")), 60);
    }
    record(at, "unseen", "robot");
    record(at, "some", "few");
    let with = |recorded: &str, rate: &str| {
        format!("calibrate model.palpate fresh --recorded {recorded} -o robot.palpate --error-rate {rate}")
    };
    let made = figures(at, &with("robot", "5%"));
    assert_eq!((&made["promised"], &made["recorded"]["recordings"]), (&0.05.into(), &2.into()), "{made}");
    assert_eq!(made["recorded"]["approaches"], 3_000, "{made}");
    says(at, &with("robot", "5%"), &["Tested on recorded touches", "are not independent"]);
    says(at, "evaluate robot.palpate unseen", &["Promised: at most 5 % wrong"]);
    fs::remove_file(at.join("robot.palpate")).unwrap();
    let few =
        "60 recorded approaches to each object support about … are too few to promise 1 %: at least 299 are needed";
    fails(at, &with("few", "1%"), 1, few);
    fails(at, &with("train", "5%"), 1, "the model was trained on these touches");
    assert!(!at.join("robot.palpate").exists());
}

#[test]
fn a_promise_made_with_noise_is_tested_on_recorded_touches_and_not_void_for_their_own() {
    let at = &CALIBRATED.folder();
    succeeds(at, "calibrate model.palpate fresh -o noisy.palpate --error-rate 5% --real noise=1ms");
    record(at, "unseen", "recorded");
    let evaluate = "evaluate noisy.palpate recorded";
    let promise = &figures(at, evaluate)["promise"];
    assert_eq!((&promise["void"], &promise["recorded"]), (&json!([]), &"noise of 1 ms".into()), "{promise}");
    let text = succeeds(at, evaluate);
    let said = "It was made for simulated touches with noise of 1 ms; recorded ones hold the noise of their probe.";
    assert!(text.contains(said) && !text.contains("void"), "{text}");
    // More noise than they hold is another matter.
    let text = succeeds(at, &format!("{evaluate} --real noise=9ms"));
    assert!(text.contains("void: promised with noise of 1 ms, tested on recorded touches with more noise"), "{text}");
}

#[test]
fn priors_and_subsets_are_expected_at_run_time_and_void_the_promise() {
    let at = &CALIBRATED.folder();
    let evaluate = |more: &str| figures(at, &format!("evaluate calibrated.palpate unseen {more}"));
    let only = evaluate("--only fork --at 1");
    assert_eq!((&only["accuracy"]["1"], &only["sequential"]["mean_touches"]), (&1.0.into(), &1.0.into()));
    assert_eq!(only["sequential"]["promised"], Value::Null);
    let void = only["promise"]["void"].as_array().unwrap();
    assert!(void.iter().any(|why| why.as_str().unwrap().contains("priors")), "{void:?}");
    assert_eq!(only["per_object"].as_object().unwrap().keys().collect::<Vec<_>>(), ["fork"]);
    let [sooner, later] = ["fork=0.95", "fork=0.5"]
        .map(|prior| evaluate(&format!("--prior {prior}"))["sequential"]["per_object"]["fork"].as_f64().unwrap());
    assert!(sooner < later);
    let recognized = succeeds(at, "recognize calibrated.palpate unseen/bowl.txt --only fork");
    assert!(recognized.lines().all(|line| line.contains("recognized  fork 1.0000")));
    fails(at, "recognize calibrated.palpate unseen/bowl.txt --only knife", 2, "--only is knife");
    succeeds(at, "export ensemble.json -o kitchen.palpate --prior fork=0.9");
    let inspected = figures(at, "inspect kitchen.palpate");
    assert!((inspected["priors"]["bowl"].as_f64().unwrap() + 9.0_f64.ln()).abs() < 0.01);
    fails(at, "export ensemble.json -o kitchen.palpate --prior fork=1.5", 2, "--prior is 1.5");
}

#[test]
fn what_cannot_be_promised_is_said_and_nothing_is_written() {
    let at = &CALIBRATED.folder();
    for (words, code, expected) in [
        ("model.palpate unseen --error-rate 0.001", 1, "too few to promise 0.1 %: at least 2995 are needed"),
        ("model.palpate unseen --error-rate 0.6", 2, "'0.6' for '--error-rate"),
        ("model.palpate unseen --confidence 1", 2, "--confidence is 1"),
        ("model.palpate unseen --sequences 0", 2, "--sequences is 0"),
        ("model.palpate unseen --per touch", 2, "use one of average, name, object"),
        ("ensemble.json fresh", 1, "ensemble.json"),
    ] {
        fails(at, &format!("calibrate {words} -o none.palpate"), code, expected);
        assert!(!at.join("none.palpate").exists());
    }
    // Its own input may be replaced by the calibrated model.
    succeeds(at, "calibrate model.palpate fresh -o model.palpate --error-rate 0.1");
}

#[test]
fn a_promise_whatever_the_placements_shares_is_one_of_each_placement_and_says_what_it_takes() {
    let at = &Folder::new();
    boxes(at);
    for (data, approaches, seed) in [("touches", 3000, 1), ("fresh", 20000, 2)] {
        let scene = format!("--scene table --approaches {approaches} --pose --seed {seed}");
        succeeds(at, &format!("capture meshes -o {data} {scene}"));
    }
    for (outputs, model) in [("placements", "model"), ("objects", "plain")] {
        let train = format!("train touches -o {model}.json --descriptor gravity --outputs {outputs}");
        succeeds(at, &format!("{train} --trees rounds=10"));
        let said = succeeds(at, &format!("export {model}.json -o {model}.palpate --verbose"));
        assert_eq!(said.contains("-leaves, outputs\n"), outputs == "placements", "{said}");
    }
    let calibrate = "calibrate model.palpate fresh -o sure.palpate --error-rate 5% --per object";
    let said = says(at, calibrate, &["The rate holds in each of 6 placements"]);
    assert!(said.contains("5 % takes 59 names of each") && said.contains("2.5 % takes 119"), "{said}");
    says(at, "inspect sure.palpate", &["5 % of the names given to each object wrong"]);
}
