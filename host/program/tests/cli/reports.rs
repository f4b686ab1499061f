//! The commands that do everything and write pages: run and report.

use crate::{Folder, globe, listing, read, says, succeeds};
use std::fs;
use std::path::Path;

/// Two meshes that can be distinguished.
fn meshes(directory: &Path) {
    fs::create_dir(directory.join("meshes")).unwrap();
    globe(&directory.join("meshes"), "globe", 12);
    globe(&directory.join("meshes"), "lump", 3);
}

#[test]
fn run_goes_from_meshes_to_models_and_a_page_with_noise_which_its_command_states() {
    let at = &Folder::new();
    meshes(at);
    let words = "run meshes -o out --touches 300 --seed 3 --real noise=0..20ms,timer=1ms";
    let text = says(at, words, &["report.html"]);
    let out = at.join("out");
    for name in
        ["ensemble.json", "model.palpate", "paper.json", "paper.palpate", "play.html", "report.html", "summary.json"]
    {
        assert!(listing(&out).iter().any(|file| file == name), "{name}: {:?}", listing(&out));
    }
    let summary = read(&out.join("summary.json"));
    assert_eq!(
        (&summary["seed"], &summary["touches"]["train"], &summary["touches"]["test"]),
        (&3.into(), &540.into(), &60.into())
    );
    assert_eq!(summary["ours"]["model_bytes"], fs::metadata(out.join("model.palpate")).unwrap().len());
    assert!(summary["command"].as_str().unwrap().ends_with("--real noise=0..20ms,timer=1ms"), "{}", summary["command"]);
    assert_eq!(summary["made_from"]["noise"]["deviation"]["largest"], 20_000.0);
    // Ours is trained for it, the paper's method stays as published.
    let noise = |name: &str| read(&out.join(name))["learner"]["attributes"]["palpate_noise"].take();
    assert!(noise("ensemble.json").is_string() && noise("paper.json").is_null());
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("globe") && page.contains("lump") && page.contains("</html>"));
    // The methods have one name each, wherever they are.
    let played = fs::read_to_string(out.join("play.html")).unwrap();
    for method in ["paper, full touches", "ours, full touches", "ours, every contact"] {
        assert!(text.contains(method) && page.contains(method) && played.contains(method), "{method}");
    }
    assert!(!page.contains("ours on ") && !played.contains("curvature, full touches"));
    assert!(page.contains("class=\"within\""), "rows that belong to the one above");
}

#[test]
fn report_writes_a_page_with_every_figure_it_names() {
    let at = &Folder::new();
    meshes(at);
    let text = succeeds(at, "report meshes -o report --quick --real noise=0..10ms");
    assert!(text.trim_end().ends_with("index.html"), "{text}");
    let page = fs::read_to_string(at.join("report/index.html")).unwrap();
    assert!(page.contains("globe") && page.contains("lump"));
    assert!(page.contains("<svg") && page.contains("</html>"));
    assert!(page.contains("touches with noise of 0 to 10 ms") && page.contains("2 % of contacts missed"));
}
