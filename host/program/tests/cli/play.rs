use crate::{command, globe, listing, stderr, stdout};
use std::path::Path;

/// The model that the repository ships.
fn household() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/household.palpate")
}

#[test]
fn a_page_is_made_of_a_model_and_objects_with_a_trace_of_a_thousand_approaches_to_each() {
    let directory = tempfile::tempdir().unwrap();
    let page = directory.path().join("pages/play.html");
    let trace = directory.path().join("pages/trace.txt");
    let mesh = globe(directory.path(), "my globe", 8);
    let play = || {
        let mut command = command(["view", "--play", "mouse"]);
        command.arg(&mesh).arg("--model").arg(household()).arg("-o").arg(&page).arg("--trace").arg(&trace);
        let said = stdout(command.output().unwrap());
        assert!(said.contains("play.html"), "{said}");
        std::fs::read_to_string(&page).unwrap()
    };
    let text = play();
    assert!(text.contains("my globe") && text.contains("curvature, every contact"));
    // The model does not know one of the objects, so nobody knows what to expect.
    assert!(text.contains("\"expected\":null"));
    assert_eq!(listing(page.parent().unwrap()), ["play.html", "trace.txt"]);
    assert_eq!(std::fs::read_to_string(&trace).unwrap().lines().count(), 2_000);
    // The same seed gives the same page.
    assert_eq!(play(), text);
}

#[test]
fn a_page_without_a_model_trains_four_and_says_what_each_is_expected_to_cost() {
    let directory = tempfile::tempdir().unwrap();
    let page = directory.path().join("play.html");
    let meshes = [("round", 8), ("rough", 5)].map(|(name, rings)| globe(directory.path(), name, rings));
    stdout(command(["view", "--play", "--touches", "300", "-o"]).arg(&page).args(meshes).output().unwrap());
    let text = std::fs::read_to_string(&page).unwrap();
    for name in
        ["times, full touches", "curvature, full touches", "curvature, every contact", "oriented, every approach"]
    {
        assert!(text.contains(name), "{name}");
    }
    assert!(text.contains("\"plan\":true") && !text.contains("\"expected\":null"));
}

#[test]
fn a_page_of_a_table_holds_maps_of_its_objects_and_says_what_they_were_learned_from() {
    let directory = tempfile::tempdir().unwrap();
    let page = directory.path().join("table.html");
    let made = |arguments: &[&str]| {
        let mut command = command(["view", "--play", "--scene", "table", "--touches", "4000", "-o"]);
        command.arg(&page).args(arguments).output().unwrap()
    };
    stdout(made(&["bowl", "mouse", "--placements", "bowl/+z=1", "--real", "missed=5%"]));
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.contains("from 4,000 simulated approaches") && text.contains("5 % of contacts to be lost"));
    assert!(text.contains("\"maps\":") && text.contains("\"name\":\"mouse\""));
    std::fs::remove_file(&page).unwrap();
    for (wrong, said) in [
        (&["bowl"][..], "2 to 16 objects"),
        (&["bowl", "mouse", "--model", household().to_str().unwrap()], "model"),
        (&["bowl", "mouse", "--trace", "trace.txt"], "trace"),
        (&["bowl", "mouse", "--cone", "30"], "cone"),
        (&["bowl", "mouse", "--real", "debounce=1ms"], "noise"),
    ] {
        let error = String::from_utf8(made(wrong).stderr).unwrap();
        assert!(error.contains(said) && !page.exists(), "{wrong:?}: {error}");
    }
}

#[test]
fn what_cannot_be_played_with_writes_no_page() {
    let directory = tempfile::tempdir().unwrap();
    let page = directory.path().join("play.html");
    let with = |arguments: &[&str], code| {
        let mut command = command(["view", "--play", "-o"]);
        stderr(command.arg(&page).args(arguments).output().unwrap(), code)
    };
    let bad = directory.path().join("bad.palpate");
    std::fs::write(&bad, b"no model").unwrap();
    let error = with(&["bowl", "--model", bad.to_str().unwrap()], 1);
    assert!(error.contains("bad.palpate"), "{error}");
    let error = with(&["bowl", "--true-size", "stated", "--model", household().to_str().unwrap()], 2);
    assert!(error.contains("probe"), "{error}");
    let error = with(&["bowl", "--real", "noise=much"], 2);
    assert!(error.contains("5ms"), "{error}");
    assert!(!page.exists());
}
