//! The commands that do everything and write pages: run and report.

use crate::{command, globe, listing, stdout};
use serde_json::Value;
use std::path::Path;

/// Two meshes that can be distinguished.
fn meshes(directory: &Path) {
    std::fs::create_dir(directory.join("meshes")).unwrap();
    globe(&directory.join("meshes"), "globe", 12);
    globe(&directory.join("meshes"), "lump", 3);
}

#[test]
fn run_goes_from_meshes_to_models_and_a_page() {
    let directory = tempfile::tempdir().unwrap();
    meshes(directory.path());
    let mut command = command(["run", "meshes", "-o", "out", "--touches", "300", "--seed", "3"]);
    let text = stdout(command.current_dir(&directory).output().unwrap());
    assert!(text.contains("report.html"), "{text}");
    let out = directory.path().join("out");
    for name in
        ["ensemble.json", "model.palpate", "paper.json", "paper.palpate", "play.html", "report.html", "summary.json"]
    {
        assert!(listing(&out).iter().any(|file| file == name), "{name}: {:?}", listing(&out));
    }
    let summary: Value = serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(
        (&summary["seed"], &summary["touches"]["train"], &summary["touches"]["test"]),
        (&3.into(), &540.into(), &60.into())
    );
    assert_eq!(summary["ours"]["model_bytes"], std::fs::metadata(out.join("model.palpate")).unwrap().len());
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("globe") && page.contains("lump") && page.contains("</html>"));
}

#[test]
fn run_trains_and_tests_with_noise_and_says_so_in_its_command() {
    let directory = tempfile::tempdir().unwrap();
    meshes(directory.path());
    let mut command = command(["run", "meshes", "-o", "out", "--touches", "300", "--real", "noise=0..20ms,timer=1ms"]);
    stdout(command.current_dir(&directory).output().unwrap());
    let read = |name: &str| -> Value {
        serde_json::from_slice(&std::fs::read(directory.path().join("out").join(name)).unwrap()).unwrap()
    };
    let summary = read("summary.json");
    assert!(summary["command"].as_str().unwrap().ends_with("--real noise=0..20ms,timer=1ms"), "{}", summary["command"]);
    assert_eq!(summary["made_from"]["noise"]["deviation"]["largest"], 20_000.0);
    // Ours is trained for it, the paper's method stays as published.
    assert!(read("ensemble.json")["learner"]["attributes"]["palpate_noise"].is_string());
    assert!(read("paper.json")["learner"]["attributes"]["palpate_noise"].is_null());
}

#[test]
fn report_writes_a_page_with_every_figure_it_names() {
    let directory = tempfile::tempdir().unwrap();
    meshes(directory.path());
    let text = stdout(
        command(["report", "meshes", "-o", "report", "--quick", "--real", "noise=0..10ms"])
            .current_dir(&directory)
            .output()
            .unwrap(),
    );
    let page = directory.path().join("report/index.html");
    assert!(text.trim_end().ends_with("index.html"), "{text}");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains("globe") && page.contains("lump"));
    assert!(page.contains("<svg") && page.contains("</html>"));
    assert!(page.contains("touches with noise of 0 to 10 ms") && page.contains("2 % of contacts missed"));
}
