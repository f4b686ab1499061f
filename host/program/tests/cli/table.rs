//! A robot over a table, as its user goes: recordings of objects in their placements, and of objects that lie in any, through every
//! command that takes recordings.

use crate::fixtures::TABLE;
use crate::{cut, fails, figures, listing, read, says, succeeds};

#[test]
fn recordings_on_a_table_are_taken_by_every_command_with_their_placements_or_without() {
    let at = &TABLE.folder();
    let stated = read(&at.join("stated/dataset.json"));
    let mut sessions = Vec::new();
    for object in stated["objects"].as_array().unwrap() {
        let name = object["name"].as_str().unwrap();
        sessions.extend(object["pools"].as_array().unwrap().iter().map(|pool| (name, &pool["recorded"])));
    }
    assert!(sessions.iter().all(|(_, session)| session["placement"].is_string()), "{sessions:?}");
    // The same touches, of objects that lie in any placement.
    for (object, session) in &sessions {
        let file = session["source"].as_str().unwrap();
        let said = succeeds(at, &format!("data record {file} -o unstated --object {object} --pose"));
        assert!(said.contains(&format!("touches of {object} into unstated, which holds ")), "{said}");
    }
    assert_eq!(
        listing(&at.join("stated")),
        [".lock", "brick", "brick.txt", "dataset.json", "slab", "slab.txt"],
        "a file for the first recording of each object, and a directory for the others"
    );
    for (recorded, names) in [("stated", sessions.len()), ("unstated", 2)] {
        let evaluated = figures(at, &format!("evaluate model.palpate {recorded} --at 20 --sequences 100"));
        assert_eq!(evaluated["per_object"].as_object().unwrap().len(), names, "{evaluated}");
        assert!(evaluated["accuracy"]["20"].as_f64().unwrap() > 0.8, "{evaluated}");
        succeeds(at, &format!("data check {recorded}"));
        let calibrate = format!("calibrate model.palpate fresh -o sure.palpate --recorded {recorded} --error-rate 40%");
        let calibrated = figures(at, &format!("{calibrate} --max-touches 60 --sequences 500"));
        assert_eq!(calibrated["objects"].as_object().unwrap().len(), names, "{calibrated}");
        let lines = succeeds(at, &format!("recognize model.palpate {recorded}/brick.txt --only brick,slab --json"));
        assert!(lines.lines().count() > 50);
    }
}

#[test]
fn a_probe_over_a_table_is_fitted_from_objects_that_stand_on_it() {
    let at = &TABLE.folder();
    for object in ["brick", "slab"] {
        cut(&at.join(format!("{object}+z.txt")), &at.join("short.txt"), 60);
        succeeds(at, &format!("data record short.txt -o recorded --object {object}/+z --pose"));
    }
    let fit = "probe fit recorded meshes -o probe.toml";
    let expected = "scene is floating. Use table: the recordings state placements on one, such as brick/";
    fails(at, fit, 2, expected);
    fails(at, &format!("{fit} --cone 45"), 2, "--scene table");
    let said = says(at, &format!("{fit} --scene table --approaches 1000"), &[" on a table: ", "Wrote probe.toml"]);
    let speed = said.lines().find_map(|line| line.strip_prefix("speed over nominal")).unwrap();
    let speed: f64 = speed.split_whitespace().next().unwrap().parse().unwrap();
    assert!((speed - 1.0).abs() < 0.05, "{said}");
}
