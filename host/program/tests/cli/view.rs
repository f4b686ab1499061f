use crate::{command, fails, globe, listing, stderr, stdout};

#[test]
fn a_page_shows_a_mesh_of_ones_own_with_the_touches_that_were_asked_for() {
    let directory = tempfile::tempdir().unwrap();
    let (mesh, page) = (globe(directory.path(), "my globe", 8), directory.path().join("pages/globe.html"));
    let view = || {
        let mut command = command(["view", "--touches", "5", "--misses", "2"]);
        let said = stdout(command.arg(&mesh).arg("-o").arg(&page).output().unwrap());
        assert!(said.contains("globe.html"), "{said}");
        std::fs::read_to_string(&page).unwrap()
    };
    let text = view();
    assert!(text.contains("<title>my globe"));
    assert_eq!(text.matches("<tr data-approach=").count(), 7);
    assert_eq!(listing(page.parent().unwrap()), ["globe.html"]);
    // The same seed gives the same page.
    assert_eq!(view(), text);
}

#[test]
fn a_built_in_object_is_shown_by_its_name() {
    let directory = tempfile::tempdir().unwrap();
    let page = directory.path().join("bowl.html");
    stdout(command(["view", "bowl", "-o"]).arg(&page).output().unwrap());
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.contains("<title>bowl") && text.contains("<dt>Right side out</dt><dd class=\"\">yes</dd>"));
}

#[test]
fn wrong_arguments_write_no_page() {
    let directory = tempfile::tempdir().unwrap();
    let page = directory.path().join("page.html");
    for (wrong, expected) in [
        ("-o page.html --misses -1", "-1"),
        ("-o page.html --real noise=5ms", "--real is given. Use it with --play"),
        ("-o page.html --length 9", "unexpected argument '--length'"),
        ("-o page.html --touches many", "many"),
        ("", "--output"),
    ] {
        fails(directory.path(), &format!("view bowl {wrong}"), 2, expected);
    }
    assert!(!page.exists());
}

#[test]
fn a_directory_of_several_objects_is_refused_with_their_number() {
    let directory = tempfile::tempdir().unwrap();
    globe(directory.path(), "one", 4);
    globe(directory.path(), "two", 4);
    let page = directory.path().join("page.html");
    let error = stderr(command(["view", "-o"]).args([&page, directory.path()]).output().unwrap(), 1);
    assert!(error.contains("2 objects, where one is needed. Give one mesh file"), "{error}");
    assert!(!page.exists());
}

#[test]
fn a_page_that_watches_a_chip_needs_no_object_and_takes_one_model() {
    let directory = tempfile::tempdir().unwrap();
    let page = directory.path().join("chip.html");
    let view = |arguments: &[&str], code| {
        let mut command = command(["view", "--port", "-o"]);
        let output = command.arg(&page).args(arguments).output().unwrap();
        if code == 0 { stdout(output) } else { stderr(output, code) }
    };
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate");
    for (wrong, expected) in [
        (&["bowl"][..], "cannot be used"),
        (&["--play"], "cannot be used"),
        (&["--probe", "probe.toml"], "cannot be used"),
        (&["--true-size", "mm"], "cannot be used"),
        (&["--scene", "table"], "cannot be used"),
        (&["--real", "noise=1ms"], "cannot be used"),
        (&["--trace", "trace.txt"], "cannot be used"),
        (&["--model", model, "--model", model], "one with --port"),
    ] {
        let error = view(wrong, 2);
        assert!(error.contains(expected), "{wrong:?}: {error}");
    }
    assert!(!page.exists());
    assert!(view(&[], 0).contains("chip.html"));
    assert!(std::fs::read_to_string(&page).unwrap().contains("\"model\":null"));
    view(&["--model", model], 0);
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.contains("\"thresholds\":[0.9") && text.contains(&format!("--model {model}")));
}
