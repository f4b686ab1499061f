use crate::fixtures::{CALIBRATED, ONE_SPLIT};
use crate::{Folder, complains, fails, figures, globe, holds, palpate, says, succeeds};
use std::fs;
use std::path::Path;

#[test]
fn a_data_set_is_summed_up_and_one_that_would_train_badly_ends_with_1() {
    let at = &Folder::new();
    ["bowl", "fork"].into_iter().zip([4, 5]).for_each(|(name, rings)| _ = globe(at, name, rings));
    succeeds(at, "capture bowl.obj fork.obj --touches 120 -o touches");
    let check = "data check touches";
    let expected = ["bowl", "fork", "curvature", "slope", "probe: radius 0.15 units", "2 objects, 240 touches"];
    says(at, check, &expected);
    let read = figures(at, check);
    assert_eq!(read["summary"]["objects"][1]["patterns"], serde_json::json!([0, 0, 0, 0, 0, 120]));
    assert_eq!(read["findings"], serde_json::json!([]));
    let fork = at.join("touches/fork.txt");
    let text = std::fs::read_to_string(&fork).unwrap();
    std::fs::write(&fork, text.replacen("0.", "0,x", 1)).unwrap();
    let output = palpate(at, check);
    let listed = String::from_utf8_lossy(&output.stdout);
    assert!(listed.contains("wrong: ") && listed.contains("fork.txt:1: "), "{listed}");
    complains(output, check, 1, "training on these touches would be wrong, for 1 reason. Correct");
    fails(at, "data check", 2, "");
    complains(palpate(at, "data check nowhere"), "data check nowhere", 1, "");
}

/// The lines of a file, with every time multiplied.
fn times(from: &Path, to: &Path, factor: f64) {
    let field = |field: &str| field.parse::<f64>().map_or(field.to_owned(), |time| (factor * time).to_string());
    let line = |line: &str| line.split(' ').map(field).collect::<Vec<_>>().join(" ") + "\n";
    let text: String = fs::read_to_string(from).unwrap().lines().take(300).map(line).collect();
    fs::create_dir_all(to.parent().unwrap()).unwrap();
    fs::write(to, text).unwrap();
}

#[test]
fn times_in_milliseconds_are_refused_by_every_command_that_takes_recorded_touches() {
    let at = &CALIBRATED.folder();
    for name in ["bowl", "fork"] {
        let from = at.join(format!("unseen/{name}.txt"));
        times(&from, &at.join(format!("ms/{name}.txt")), 1_000.0);
        // Longer than any object takes, and within what a feature holds.
        times(&from, &at.join(format!("slow/{name}.txt")), 50.0);
    }
    fs::copy(at.join("ms/bowl.txt"), at.join("pot.txt")).unwrap();
    fs::create_dir(at.join("pots")).unwrap();
    fs::copy(at.join("slow/bowl.txt"), at.join("pots/pot.txt")).unwrap();
    let features = "but features of a touch hold at most 16.8 s";
    let of = |place: &str, whose: &str| {
        format!("{place}: a finger … s after the first, but no object of the {whose}'s scale takes longer than")
    };
    let beyond = |place: &str| format!("{place}: a finger touched … {features}");
    for (words, why) in [
        ("data record ms/bowl.txt -o recorded --object bowl", of("ms/bowl.txt:1", "data set")),
        ("data record slow/bowl.txt -o recorded --object bowl", of("slow/bowl.txt:1", "data set")),
        ("train ms -o t.json", beyond("ms/bowl.txt:1")),
        ("train train --teach pot.txt -o t.json", beyond("pot.txt:1")),
        ("train train --teach pots -o t.json --trees rounds=2", of("touch 1 of pot", "simulation")),
        ("evaluate model.palpate ms", beyond("ms/bowl.txt:1")),
        ("evaluate model.palpate slow", of("touch 1 of bowl", "model")),
        ("evaluate ensemble.json slow", of("touch 1 of bowl", "model")),
        ("calibrate model.palpate slow -o c.palpate", of("touch 1 of bowl", "model")),
        ("calibrate model.palpate fresh -o c.palpate --recorded slow", of("touch 1 of bowl", "model")),
        ("probe fit slow bowl fork -o p.toml", of("touch 1 of bowl", "simulation")),
        ("recognize model.palpate slow/bowl.txt", of("slow/bowl.txt:1", "model")),
    ] {
        fails(at, words, 1, &format!("{why} … Give times in seconds, not in milliseconds"));
    }
    for made in ["recorded", "t.json", "c.palpate", "p.toml"] {
        assert!(!at.join(made).exists(), "{made}");
    }
    let checked = palpate(at, "data check ms");
    let text = String::from_utf8(checked.stdout.clone()).unwrap();
    let wrong = ["bowl", "fork"].map(|name| format!("wrong: ms/{name}.txt:1: a finger touched"));
    holds(&text, &[&wrong[0], &wrong[1], features, "Give times in seconds, not in milliseconds"]);
    complains(checked, "data check ms", 1, "training on these touches would be wrong, for 2 reasons");
}

#[test]
fn lines_of_a_spreadsheet_or_of_a_robots_clock_are_read_by_every_command() {
    let at = &ONE_SPLIT.folder();
    let names = "\u{feff}first,middle,last\r\n# Monday\n";
    let epoch = "1732819200.01,1732819200,-\n1732819201,1732819201.02,1732819201.03\n";
    fs::write(at.join("touches.csv"), names.to_owned() + epoch).unwrap();
    fs::write(at.join("plain.txt"), "0.01 0 -\n0 0.02 0.03\n").unwrap();
    succeeds(at, "data record touches.csv -o recorded --object bowl");
    let recorded = fs::read_to_string(at.join("recorded/bowl.txt")).unwrap();
    assert_eq!(recorded, "0.010000 0.000000 -\n0.000000 0.020000 0.030000\n");
    fs::create_dir(at.join("own")).unwrap();
    fs::copy(at.join("touches.csv"), at.join("own/bowl.txt")).unwrap();
    succeeds(at, "data check own");
    for file in ["touches.csv", "own/bowl.txt"] {
        let recognize = |file: &str| succeeds(at, &format!("recognize model.palpate {file}"));
        assert_eq!(recognize(file), recognize("plain.txt"));
    }
}

#[test]
fn bags_that_are_not_mcap_are_refused_with_what_converts_them() {
    let at = &ONE_SPLIT.folder();
    for (name, bytes) in [("x.bag", &b"#ROSBAG V2.0\nE\0\0\0"[..]), ("x.db3", b"SQLite format 3\0\x10\0\xff")] {
        fs::write(at.join(name), bytes).unwrap();
        let why = "a bag of ROS 1, or of ROS 2 in SQLite, is not read. Convert it to MCAP: mcap convert";
        for words in [
            "data record @ -o out --object bowl",
            "recognize model.palpate @",
            "evaluate model.palpate @",
            "data check @",
        ] {
            fails(at, &words.replace('@', name), 1, &format!("{name} … {why}"));
        }
    }
}
