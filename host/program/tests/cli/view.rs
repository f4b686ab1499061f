use crate::{Folder, command, fails, globe, listing, says, stdout, succeeds};

#[test]
fn a_page_shows_a_mesh_of_ones_own_with_the_touches_that_were_asked_for() {
    let at = &Folder::new();
    globe(at, "my globe", 8);
    let view = || {
        let mut command = command(["view", "--touches", "5", "my globe.obj", "-o", "pages/globe.html"]);
        let said = stdout(command.current_dir(at).output().unwrap());
        assert!(said.contains("globe.html"), "{said}");
        std::fs::read_to_string(at.join("pages/globe.html")).unwrap()
    };
    let text = view();
    assert!(text.contains("<title>my globe"));
    assert_eq!(text.matches("<tr data-approach=").count(), 17);
    assert_eq!(listing(&at.join("pages")), ["globe.html"]);
    // The same seed gives the same page.
    assert_eq!(view(), text);
}

#[test]
fn a_page_that_watches_a_chip_needs_no_object_and_takes_one_model() {
    let at = &Folder::new();
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate");
    says(at, "view --port -o chip.html", &["chip.html"]);
    assert!(std::fs::read_to_string(at.join("chip.html")).unwrap().contains("\"model\":null"));
    succeeds(at, &format!("view --port -o chip.html --model {model}"));
    let text = std::fs::read_to_string(at.join("chip.html")).unwrap();
    assert!(text.contains("\"thresholds\":[0.9") && text.contains(&format!("--model {model}")));
}

#[test]
fn wrong_arguments_write_no_page() {
    let at = &Folder::new();
    std::fs::create_dir(at.join("set")).unwrap();
    ["one", "two"].iter().for_each(|name| _ = globe(&at.join("set"), name, 4));
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate");
    for (wrong, code, expected) in [
        ("bowl -o page.html --real noise=5ms", 2, "--real is given. Use it with --play"),
        ("bowl -o page.html --length 9", 2, "unexpected argument '--length'"),
        ("bowl -o page.html --touches many", 2, "many"),
        ("bowl", 2, "--output"),
        ("set -o page.html", 1, "2 objects, where one is needed. Give one mesh file"),
        ("--port -o page.html bowl", 2, "cannot be used"),
        ("--port -o page.html --play", 2, "cannot be used"),
        ("--port -o page.html --probe probe.toml", 2, "cannot be used"),
        ("--port -o page.html --true-size mm", 2, "cannot be used"),
        ("--port -o page.html --scene table", 2, "cannot be used"),
        ("--port -o page.html --real noise=1ms", 2, "cannot be used"),
        (&format!("--port -o page.html --model {model} --model {model}"), 2, "one with --port"),
    ] {
        fails(at, &format!("view {wrong}"), code, expected);
    }
    assert_eq!(listing(at), ["set"]);
}
