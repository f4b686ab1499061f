use crate::{Folder, fails, globe, listing, says, succeeds};
use std::fs;

/// The model that the repository ships.
const HOUSEHOLD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate");

#[test]
fn a_page_is_made_of_a_model_and_objects() {
    let at = &Folder::new();
    globe(at, "my_globe", 8);
    let words = format!("play mouse my_globe.obj --model {HOUSEHOLD} -o pages/play.html");
    let play = || {
        says(at, &words, &["play.html"]);
        fs::read_to_string(at.join("pages/play.html")).unwrap()
    };
    let text = play();
    assert!(text.contains("my_globe") && text.contains("curvature, every contact"));
    assert_eq!(listing(&at.join("pages")), ["play.html"]);
    // The same seed gives the same page.
    assert_eq!(play(), text);
}

#[test]
fn a_page_without_a_model_has_that_of_the_built_in_objects() {
    let at = &Folder::new();
    succeeds(at, "play -o play.html bowl mouse");
    let text = fs::read_to_string(at.join("play.html")).unwrap();
    assert!(text.contains("curvature, every contact") && text.contains("\"name\":\"mouse\""));
}

#[test]
fn a_page_of_a_table_holds_maps_of_its_objects_and_says_what_they_expect() {
    let at = &Folder::new();
    let objects = "bowl mouse --placements bowl/+z=1 --real missed=5%";
    succeeds(at, &format!("maps play -o table.html {objects}"));
    let text = fs::read_to_string(at.join("table.html")).unwrap();
    assert!(text.contains("The maps are of the meshes: ") && text.contains("5 % of contacts to be lost"));
    assert!(text.contains("\"maps\":") && text.contains("\"name\":\"mouse\""));
}

#[test]
fn what_cannot_be_played_with_writes_no_page() {
    let at = &Folder::new();
    fs::write(at.join("bad.palpate"), b"no model").unwrap();
    fs::write(at.join("wide.toml"), "radius = 0.15\nspacing = 2\nspeed = 10\n").unwrap();
    globe(at, "round", 8);
    for (wrong, code, expected) in [
        ("bowl --model bad.palpate", 1, "bad.palpate"),
        ("bowl --touches 300", 2, "--touches"),
        ("round.obj", 2, "--model is not given. Use a model of these objects and this probe"),
        (&format!("bowl --probe wide.toml --model {HOUSEHOLD}"), 1, "spacing 1.5 and 2"),
        (&format!("bowl --true-size stated --model {HOUSEHOLD}"), 2, "probe"),
        ("bowl --real noise=much", 2, "5ms"),
    ] {
        fails(at, &format!("play -o play.html {wrong}"), code, expected);
    }
    fails(at, "maps play -o play.html bowl", 2, "2 to 16 objects");
    fails(at, "maps play -o play.html bowl mouse --real debounce=1ms", 1, "noise");
    assert_eq!(listing(at), ["bad.palpate", "round.obj", "wide.toml"]);
}
