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
fn a_page_that_watches_a_chip_needs_no_object_and_takes_a_model() {
    let at = &Folder::new();
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate");
    says(at, "watch -o chip.html", &["chip.html"]);
    assert!(std::fs::read_to_string(at.join("chip.html")).unwrap().contains("\"model\":null"));
    succeeds(at, &format!("watch {model} -o chip.html"));
    let text = std::fs::read_to_string(at.join("chip.html")).unwrap();
    assert!(text.contains("\"thresholds\":[0.9") && text.contains(&format!("palpate watch {model} -o chip.html")));
}

#[test]
fn wrong_arguments_write_no_page() {
    let at = &Folder::new();
    std::fs::create_dir(at.join("set")).unwrap();
    ["one", "two"].iter().for_each(|name| _ = globe(&at.join("set"), name, 4));
    for (wrong, code, expected) in [
        ("bowl -o page.html --real noise=5ms", 2, "unexpected argument '--real'"),
        ("touches.txt -o page.html", 1, "touches.txt: touches, and no mesh. Use `palpate maps view`."),
        ("bowl -o page.html --length 9", 2, "unexpected argument '--length'"),
        ("bowl -o page.html --touches many", 2, "many"),
        ("bowl", 2, "--output"),
        ("set -o page.html", 1, "2 objects, where one is needed. Give one mesh file"),
    ] {
        fails(at, &format!("view {wrong}"), code, expected);
    }
    assert_eq!(listing(at), ["set"]);
}
