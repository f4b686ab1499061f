//! Maps of meshes and of touches with a position, through every command that takes them.

use crate::fixtures::{self, HAND, LOCATED, MAPS, brick, pressed_box};
use crate::{Folder, fails, figures, lines, says, succeeds};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// The lines that a stream of touches gives.
pub(crate) fn recognized(at: &Path, words: &str, text: &str) -> Vec<Value> {
    fs::write(at.join("lines.txt"), text).unwrap();
    lines(&succeeds(at, &format!("maps recognize {words} lines.txt")))
}

#[test]
fn objects_are_located_with_maps_from_meshes_to_a_promise() {
    let at = &LOCATED.folder();
    let trained = figures(at, &format!("{MAPS} -o again.palpate --threads 1 --seed 9"));
    let bytes = fs::read(at.join("maps.palpate")).unwrap();
    assert_eq!(fs::read(at.join("again.palpate")).unwrap(), bytes);
    assert_eq!((trained["objects"].as_u64(), trained["bytes"].as_u64()), (Some(2), Some(bytes.len() as u64)));
    // A box lies on three kinds of sides.
    let placements = trained["placements"].as_array().unwrap();
    assert_eq!((placements.len(), trained["touches"].as_u64()), (6, Some(0)), "{trained}");
    let said = says(at, &format!("{MAPS} -o again.palpate"), &["maps of 6 placements of 2 objects, made in "]);
    assert!(!said.contains("left out") && !said.contains("cells met"), "{said}");
    brick(&at.join("card.obj"), [80.0, 60.0, 4.0]);
    let card = "maps train card.obj -o card.palpate --true-size mm --probe hand.toml";
    says(at, card, &["left out, since they are rare: card/"]);

    let inspected = figures(at, "inspect maps.palpate");
    assert_eq!(inspected["placements"].as_array().unwrap().len(), placements.len());
    assert_eq!((inspected["cell"].as_u64(), inspected["range"].as_f64()), (Some(2), Some(20.0)));
    assert!(inspected["promise"].is_null() && inspected["approach"]["ram"].as_u64().unwrap() > 100_000);
    says(at, "inspect maps.palpate", &["brick/", "noise of 5 ms, 2 % of contacts missed", "unknown test   none"]);

    let words = "maps calibrate maps.palpate meshes --true-size mm --error-rate 40% --sequences 20";
    let said = succeeds(at, &format!("{words} -o sure.palpate"));
    assert!(said.contains("It holds for chosen approaches, for noise of 5 ms, 2 % of contacts missed"), "{said}");
    assert!(!said.contains("Until the place is sure"), "{said}");
    let placed = figures(at, &format!("{words} -o placed.palpate --until 25mm/90deg"));
    let approaches =
        [&placed["mean_approaches"], &placed["until"]["mean_approaches"]].map(|mean| mean.as_f64().unwrap());
    assert!(approaches[0] < approaches[1] + 0.5, "{placed}");
    let never = "only 0 had a place as sure as 0.1 mm and 1° within 25 approaches. Ask for less";
    fails(at, &format!("{words} -o never.palpate --until 0.1mm/1deg"), 1, never);
    assert!(!at.join("never.palpate").exists());
    let noise = "--real none,noise=2ms,drift=1mm/1deg";
    let random = figures(at, &format!("{words} -o random.palpate --aimed random {noise}"));
    assert_eq!(random["aimed"], "random");
    assert!(random["noise"].as_str().unwrap().contains("moves by 1 mm and 1° per approach"), "{random}");
    for (model, aimed) in [("sure", "chosen"), ("random", "random")] {
        let promise = &figures(at, &format!("inspect {model}.palpate"))["promise"];
        assert_eq!((promise["aimed"].as_str(), promise["error_rate"].as_f64()), (Some(aimed), Some(0.4)));
    }
    let evaluate = "maps evaluate sure.palpate meshes --true-size mm --sequences 20";
    let evaluated = figures(at, evaluate);
    assert!(evaluated["given"].as_u64().unwrap() > 13, "{evaluated}");
    assert_eq!((evaluated["aimed"].as_str(), evaluated["promise"]["aimed"].as_str()), (Some("chosen"), Some("chosen")));
    assert!(evaluated["off"][0].as_f64().unwrap() < 10.0, "{evaluated}");
    says(at, &format!("{evaluate} --aimed random"), &["Void here: it was made for chosen approaches."]);
}

#[test]
fn each_touch_gives_a_verdict_a_place_and_the_next_approach_until_an_object_is_named() {
    let at = &LOCATED.folder();
    let touches = pressed_box([60.0, 40.0, 30.0], 30);
    let said = recognized(at, "maps.palpate --next", &touches.concat());
    let end = said.iter().position(|line| line["verdict"] != "undecided").unwrap();
    assert_eq!((said[end]["verdict"].as_str(), said[end]["object"].as_str()), (Some("recognized"), Some("brick")));
    assert!(said[end]["next"].is_null() && end < 25, "{end}");
    for line in &said[..end] {
        let next = ["x", "y", "roll"].map(|key| line["next"][key].as_f64().unwrap());
        assert!(next[0].abs() <= 40.0 && next[1].abs() <= 40.0 && next[2] < 360.0, "{line}");
        assert!(line["pose"]["share"].as_f64().unwrap() <= 1.0 && line["modes"].is_array(), "{line}");
    }
    assert_eq!(said[end + 1]["touch"], 1, "another object begins");
    // Never out of the workspace.
    for line in recognized(at, "maps.palpate --next --workspace 7.5", &touches.concat()) {
        let next = ["x", "y"].map(|key| line["next"][key].as_f64().unwrap_or(0.0).abs());
        assert!(next[0] <= 7.5 && next[1] <= 7.5, "{line}");
    }
    let only = recognized(at, "maps.palpate --next --only slab", &touches[0]);
    assert_eq!(only[0]["object"], "slab");
    let plain = succeeds(at, "maps recognize maps.palpate lines.txt --json");
    assert!(plain.contains("\"verdict\":") && !plain.contains("\"pose\":"), "{plain}");
}

#[test]
fn on_an_empty_table_it_is_said_that_nothing_but_the_table_was_met() {
    let at = &LOCATED.folder();
    let calibrate = "maps calibrate maps.palpate meshes --true-size mm --error-rate 40% --sequences 20";
    let said = succeeds(at, &format!("{calibrate} --detect-unknown -o sure.palpate"));
    assert!(said.contains("with each object left out in turn: "), "{said}");
    says(at, "inspect sure.palpate", &["unknown below ", "unknown test   from the eighth approach on"]);
    // All over the table, with the row along x.
    let press = |number: i32| {
        let (x, y) = (number % 5 * 15 - 30, number / 5 * 12 - 24);
        format!("0 0 {} 0 0 -1 1 0 0 {x} {y} 0\n", if number == 3 { "-" } else { "0" })
    };
    let presses: String = (0..25).map(press).collect();
    let said = recognized(at, "sure.palpate --next", &presses);
    let end = said.iter().find(|line| line["verdict"] != "undecided").unwrap();
    assert!(["unknown", "gave-up"].map(Value::from).contains(&end["verdict"]) && end["table_alone"] == true, "{end}");
    assert!(said[0].get("table_alone").is_none());
    says(at, "maps recognize sure.palpate lines.txt", &["  nothing but the table was met\n"]);
    // A finger that met something else once.
    let met = format!("0 0.1 0.1 0 0 -1 1 0 0 29 29 10\n{presses}");
    let said = recognized(at, "sure.palpate --next", &met);
    let end = said.iter().find(|line| line["verdict"] != "undecided").unwrap();
    assert!(end.get("table_alone").is_none(), "{end}");
}

#[test]
fn maps_and_trees_are_refused_where_the_other_is_needed_with_what_to_do() {
    let at = &LOCATED.folder();
    succeeds(at, "capture meshes -o free --touches 300");
    succeeds(at, "train free -o e.json --trees rounds=2,depth=2");
    succeeds(at, "export e.json -o trees.palpate");
    for (name, line) in [
        ("located", "0 0 0 0 0 -1 1 0 0 1 2 3\n"),
        ("plain", "0 0 0\n"),
        ("deep", "0 0 900 0 0 -1 1 0 0 1 2 3\n"),
        ("brick", "0 0 0 0 0 -1 1 0 0 1 2 3\n"),
    ] {
        fs::write(at.join(format!("{name}.txt")), line).unwrap();
    }
    for (words, code, expected) in [
        ("train data -o x.json", 1, "data: touches with a position … palpate maps train --teach"),
        ("train free --teach data -o x.json", 1, ": touches with a position … palpate maps train --teach"),
        ("train free -o x.palpate --maps cell=2mm", 2, "`train --maps` was removed: make maps with palpate maps train"),
        (&format!("{MAPS},noise=9mm -o x.palpate"), 2, "--maps is noise=9. Use a number of millimeters"),
        (&format!("{MAPS} -o x.palpate --real debounce=2ms"), 1, "a simulated table has other noise"),
        (&format!("{MAPS} -o x.palpate --teach brick.txt"), 2, "--teach is brick. Use objects that have no mesh"),
        ("maps train meshes -o x.palpate --true-size mm", 2, "--probe is not given"),
        ("maps train meshes -o x.palpate --probe hand.toml", 1, "the true size is unknown … --true-size"),
        ("maps train --teach plain.txt -o x.palpate --probe hand.toml", 1, "plain: touch 1 has no position"),
        ("maps train -o x.palpate", 2, "SOURCE"),
        (
            "data record located.txt -o x --object pot --pose --probe hand.toml",
            1,
            "located.txt: a position, where the touches recorded here have none",
        ),
        (
            "capture meshes -o x --position",
            2,
            "`capture --position` was removed: make maps of meshes with palpate maps train",
        ),
        ("capture meshes -o x --within 3", 2, "`--within` was removed: make maps of meshes with palpate maps train"),
        ("train free -o x.palpate --real drift=1mm/1deg", 2, "--real is drift"),
        ("maps recognize maps.palpate plain.txt", 1, "plain.txt:1: the touch has no position. Give twelve"),
        ("maps recognize maps.palpate deep.txt", 1, "below the table. Give times in seconds"),
        ("recognize maps.palpate located.txt", 1, "maps.palpate: a model of maps … Use `palpate maps recognize`."),
        ("maps recognize maps.palpate located.txt --max-touches 99", 2, "--max-touches is 99"),
        ("maps recognize maps.palpate located.txt --next --workspace 2000", 2, "is 2000. Use a number of millimeters"),
        ("recognize trees.palpate located.txt", 1, "located.txt:1: touches with a position"),
        ("maps recognize trees.palpate plain.txt", 1, "trees.palpate: a model of touches … Use `palpate recognize`."),
        ("evaluate maps.palpate data", 1, "maps.palpate: a model of maps … Use `palpate maps evaluate`."),
        ("evaluate trees.palpate data", 1, "data: touches with a position"),
        ("maps evaluate nothing.palpate bowl", 1, "nothing.palpate: cannot read the model"),
        ("calibrate trees.palpate data -o x.palpate", 1, "data: touches with a position"),
        (
            "calibrate maps.palpate data -o x.palpate",
            1,
            "maps.palpate: a model of maps … Use `palpate maps calibrate`.",
        ),
        (
            "maps calibrate trees.palpate meshes -o x.palpate",
            1,
            "trees.palpate: a model of touches … Use `palpate calibrate`.",
        ),
        ("maps calibrate maps.palpate meshes/brick.obj --true-size mm -o x.palpate", 1, "slab is not among"),
        ("inspect maps.palpate --chip m4f", 2, "--chip is"),
        ("verify maps.palpate e.json data", 1, "maps.palpate: a model of maps"),
    ] {
        fails(at, words, code, expected);
    }
}

#[test]
fn presses_on_the_bare_table_measure_it_and_the_fingertips() {
    let at = &Folder::new();
    fs::write(at.join("nominal.toml"), HAND.replace("stroke = 20\n", "")).unwrap();
    // The table at .8 mm; the first fingertip stands out by .6 mm, and the third one stands back by .9 mm.
    let press = |number: i32| {
        let (turn, x, y) = (1 - 2 * (number % 2), number * 7 % 41 - 20, number * 11 % 37 - 18);
        format!("0 0.006 0.015 0 0 -1 {turn} 0 0 {x} {y} 1.4\n")
    };
    let presses: String = (0..20).map(press).collect();
    fs::write(at.join("presses.txt"), &presses).unwrap();
    let words = "maps level presses.txt -o hand.toml --probe nominal.toml";
    let found = figures(at, words);
    let number = |path: &str| (found.pointer(path).and_then(Value::as_f64).unwrap() * 100.0).round();
    assert_eq!(["/height/value", "/tips/0/value", "/tips/1/value", "/noise"].map(number), [80.0, 60.0, -90.0, 0.0]);
    assert_eq!((found["contacts"].as_u64(), found["lost"].as_u64()), (Some(60), Some(0)));
    let said = succeeds(at, words);
    assert!(said.starts_with("20 presses on a bare table: 60 contacts with it, 0 missing, 0 left out\n"), "{said}");
    assert!(
        said.contains("first fingertip stands out       0.60  0.00\n") && said.ends_with("Wrote hand.toml\n"),
        "{said}"
    );
    let file = fs::read_to_string(at.join("hand.toml")).unwrap();
    assert!(file.contains("\noffsets = [0.600, 0.0, -0.900]"), "{file}");
    // The hand as it is makes touches of objects.
    brick(&at.join("brick.obj"), [60.0, 40.0, 30.0]);
    succeeds(at, "capture brick.obj -o data --scene table --pose --probe hand.toml --true-size mm --approaches 20");
    fs::write(at.join("few.txt"), presses.split_inclusive('\n').take(9).collect::<String>()).unwrap();
    fs::write(at.join("plain.txt"), "0 0 0\n").unwrap();
    for (words, code, expected) in [
        ("few.txt --probe nominal.toml", 1, "few.txt: finger 1 met the table in only 9 presses, of at least 10"),
        ("plain.txt --probe nominal.toml", 1, "plain.txt:1: the touch has no position. Give twelve columns"),
        ("presses.txt", 2, "--probe is not in millimeters. Use a probe file in millimeters"),
        ("data --probe nominal.toml", 1, "data: cannot read the touches"),
    ] {
        fails(at, &format!("maps level {words} -o x.toml"), code, expected);
    }
    assert!(!at.join("x.toml").exists());
}

/// Lines of a hand that presses an L of 20 and 10 mm height, scaled, which lies at a place and is turned.
fn pressed(scale: f64, place: [f64; 2], yaw: f64, count: usize) -> String {
    let height = |[x, y]: [f64; 2]| match () {
        () if (0.0..=60.0).contains(&x) && (0.0..=20.0).contains(&y) => 20.0 * scale,
        () if (0.0..=20.0).contains(&x) && (0.0..=50.0).contains(&y) => 10.0 * scale,
        () => 0.0,
    };
    fixtures::pressed(height, [[25.0; 2], [42.0, 36.0]], place, yaw, count).concat()
}

#[test]
fn an_object_without_a_mesh_is_taught_by_touches_with_a_position() {
    let at = &LOCATED.folder();
    fs::write(at.join("pot.txt"), pressed(1.0, [0.0; 2], 0.0, 300)).unwrap();
    let trained =
        figures(at, &format!("{} --teach pot.txt -o mixed.palpate", MAPS.replace("range=20mm", "range=30mm")));
    assert_eq!(trained["objects"], 3);
    let pot = trained["placements"].as_array().unwrap().iter().filter(|own| own["object"] == "pot").count();
    assert_eq!(pot, 1);
    let said = recognized(at, "mixed.palpate --next", &pressed(1.0, [-20.0, -15.0], 0.4, 8));
    assert_eq!(said.last().unwrap()["object"], "pot", "{said:?}");
    // The promise is for the taught object, too.
    let calibrate = "maps calibrate mixed.palpate meshes pot.txt --true-size mm -o sure.palpate";
    succeeds(at, &format!("{calibrate} --sequences 20 --error-rate 40%"));
    says(
        at,
        "maps train --teach pot.txt -o own.palpate --probe hand.toml",
        &["maps of 1 placements of 1 objects and 300 touches", " of its cells met"],
    );
    // Another recording, turned, is of the same surface.
    fs::create_dir(at.join("later")).unwrap();
    fs::write(at.join("later/pot.txt"), pressed(1.0, [10.0, 5.0], 1.0, 200)).unwrap();
    says(
        at,
        "maps train --teach pot.txt --teach later/pot.txt -o own.palpate --probe hand.toml",
        &["maps of 1 placements"],
    );
    fails(at, "maps train --teach pot.txt -o own.palpate", 1, "not of objects at their true size");
}

#[test]
fn recordings_of_objects_that_stood_still_test_a_promise() {
    let at = &Folder::new();
    fs::write(at.join("hand.toml"), HAND).unwrap();
    fs::write(at.join("other.toml"), HAND.replace("spacing = 15", "spacing = 12")).unwrap();
    for (name, scale) in [("pot", 1.0), ("lid", 0.5)] {
        fs::write(at.join(format!("{name}.txt")), pressed(scale, [0.0; 2], 0.0, 300)).unwrap();
        for stay in [0.0, 1.0, 2.0, 3.0, 4.0] {
            let place = [-25.0 + 4.0 * stay, -20.0 + 3.0 * stay];
            fs::write(at.join("stay.txt"), pressed(scale, place, 0.7 * stay, 40)).unwrap();
            succeeds(at, &format!("data record stay.txt -o stays --object {name} --position --probe hand.toml"));
        }
    }
    for hand in ["hand", "other"] {
        succeeds(at, &format!("maps train --teach pot.txt --teach lid.txt -o {hand}.palpate --probe {hand}.toml"));
    }
    let calibrate = "maps calibrate hand.palpate --recorded stays -o sure.palpate";
    let said = succeeds(at, &format!("{calibrate} --error-rate 40%"));
    assert!(said.contains("It holds for approaches like those of 10 recordings, in any order"), "{said}");
    assert!(said.contains("note: sequences of one recording share its pose"), "{said}");
    let promise = &figures(at, "inspect sure.palpate")["promise"];
    assert_eq!((promise["error_rate"].as_f64(), promise["aimed"].as_str()), (Some(0.4), Some("random")));
    // However many sequences each of them has.
    fails(at, calibrate, 1, "recordings are too few to promise 1 %: at least 299 are needed");
    for (words, code, expected) in [
        ("maps calibrate hand.palpate --recorded stays -o x.palpate --detect-unknown", 2, "--recorded"),
        ("maps calibrate hand.palpate --recorded stays -o x.palpate --real noise=1ms", 2, "--recorded"),
        ("maps calibrate hand.palpate stays --recorded stays -o x.palpate", 2, "--recorded"),
        ("maps calibrate other.palpate --recorded stays -o x.palpate", 1, "spacing 12 and 15"),
    ] {
        fails(at, words, code, expected);
    }
}

#[test]
fn touches_with_a_position_have_a_surface_and_a_page() {
    let at = &Folder::new();
    for (name, text) in [
        ("hand.toml", HAND.to_owned()),
        ("pot.txt", pressed(1.0, [0.0; 2], 0.0, 300)),
        ("later.txt", pressed(1.0, [10.0, 5.0], 1.0, 200)),
        ("bad.txt", pressed(1.0, [0.0; 2], 0.0, 2) + "NaN 0 0 0 0 -1 1 0 0 0 0 0\n"),
        ("bare.txt", "0 0 0 0 0 -1 1 0 0 0 0 0\n".to_owned()),
        ("plain.txt", "0 0.1 0.2\n".to_owned()),
    ] {
        fs::write(at.join(name), text).unwrap();
    }
    succeeds(at, "data objects pot.txt -o meshes --probe hand.toml");
    says(at, "view meshes/pot.obj -o mesh.html --true-size mm --probe hand.toml", &["nothing is wrong with the mesh"]);
    succeeds(at, "maps view pot.txt -o pot.html --probe hand.toml");
    let page = fs::read_to_string(at.join("pot.html")).unwrap();
    assert!(page.contains("300 approaches") && page.contains("url(#guessed)") && page.contains("class=\"contact\""));
    let two = figures(at, "maps view pot.txt later.txt -o two.html --probe hand.toml");
    assert_eq!(two["registered"], true);
    assert!(fs::read_to_string(at.join("two.html")).unwrap().contains("Difference"));
    for (words, code, expected) in [
        ("maps view pot.txt -o pot.html", 2, "a probe file in millimeters"),
        ("maps view bad.txt -o bad.html --probe hand.toml", 1, "bad.txt:3"),
        ("data objects bare.txt -o meshes --probe hand.toml", 1, "bare: no touch met it"),
        ("data objects plain.txt -o meshes --probe hand.toml", 1, "the touch has no position"),
    ] {
        fails(at, words, code, expected);
    }
}

#[test]
fn exploring_says_where_to_touch_next_until_the_map_is_known() {
    let at = &Folder::new();
    fs::write(at.join("hand.toml"), HAND).unwrap();
    fs::write(at.join("tenths.toml"), HAND.replace("mm", "unit")).unwrap();
    let touches = pressed(1.0, [-25.0, -20.0], 0.0, 40);
    fs::write(at.join("lines.txt"), touches).unwrap();
    let said = lines(&succeeds(at, "maps explore hand.toml lines.txt --known 2mm/30% --workspace 30"));
    let next = &said[0]["next"];
    assert!(next["x"].as_f64().unwrap().abs() <= 30.0 && next["roll"].is_number(), "{next}");
    assert_eq!(said[0]["state"], "exploring");
    let known = said.iter().find(|line| line["state"] == "known").unwrap();
    assert!(known["next"].is_null() && known["known"].as_f64().unwrap() >= 0.3, "{known}");
    for (words, code, expected) in [
        ("hand.toml lines.txt --known 2mm", 2, "such as 2mm/80%"),
        ("hand.toml lines.txt --workspace 900", 2, "from 1 to 200"),
        ("tenths.toml lines.txt", 1, "tenths.toml: not a usable probe file: its unit is not mm"),
        ("nothing.palpate lines.txt", 1, "nothing.palpate: cannot read the model"),
    ] {
        fails(at, &format!("maps explore {words}"), code, expected);
    }
}
