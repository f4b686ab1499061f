//! Output of commands: a file is replaced as by any tool, a directory that holds anything else only with `--force`.

use crate::fixtures::ONE_SPLIT;
use crate::{Folder, command, complains, fails, globe, listing, palpate, read, stderr, succeeds};

/// A file that a user might have where a command writes.
const FOREIGN: &str = "// Recognizes with palpate_onboard.\nfn main() {}\n";

/// Commands that write and take little time, with the files that they write.
const WRITERS: &[(&str, &[&str])] = &[
    ("export ensemble.json -o out/m.palpate --emit c,rust,json", &["m.palpate", "m.h", "palpate.h", "m.rs", "m.json"]),
    ("export ensemble.json -o out/t.palpate --emit rust-code", &["t.palpate", "t.rs"]),
    ("export ensemble.json -o out/c.palpate --emit c-code", &["c.palpate", "c.h", "palpate.h"]),
    ("export model.palpate -o out/copy.palpate --emit rust,c", &["copy.palpate", "copy.rs", "copy.h", "palpate.h"]),
    ("train data -o out/trained.json --trees rounds=2", &["trained.json"]),
    ("view ball.obj -o out/ball.html", &["ball.html"]),
    ("play ball.obj --model model.palpate -o out/play.html", &["play.html"]),
    ("watch -o out/port.html", &["port.html"]),
    ("data objects ball.obj -o out", &["ball.obj"]),
];

/// Commands that fill a directory, with what it must not hold.
const FOLDERS: &[(&str, &[&str])] = &[
    ("capture ball.obj -o out --touches 3", &["ball.txt", "dataset.json", "notes.md"]),
    (
        "run ball.obj -o out",
        &[
            "paper.json",
            "paper.palpate",
            "full.json",
            "full.palpate",
            "ensemble.json",
            "model.palpate",
            "report.html",
            "play.html",
            "summary.json",
        ],
    ),
    ("report ball.obj -o out", &["index.html", "summary.json"]),
    ("data record touches.txt -o out --object ball", &["ball.txt"]),
];

fn set_up() -> Folder {
    let at = ONE_SPLIT.folder();
    globe(&at, "ball", 8);
    std::fs::write(at.join("touches.txt"), "0 0 0.08\n0 0 0.01\n").unwrap();
    at
}

#[test]
fn a_file_is_replaced_as_by_any_tool() {
    let at = &set_up();
    let out = at.join("out");
    for (words, files) in WRITERS {
        std::fs::create_dir(&out).unwrap();
        files.iter().for_each(|file| std::fs::write(out.join(file), FOREIGN).unwrap());
        succeeds(at, words);
        for file in *files {
            assert!(std::fs::read(out.join(file)).unwrap() != FOREIGN.as_bytes(), "{words}, {file}");
        }
        std::fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn a_directory_that_holds_anything_else_is_refused() {
    let at = &set_up();
    let out = at.join("out");
    for (words, files) in FOLDERS {
        for file in *files {
            std::fs::create_dir(&out).unwrap();
            std::fs::write(out.join(file), FOREIGN).unwrap();
            complains(palpate(at, words), words, 1, file);
            assert_eq!(std::fs::read_to_string(out.join(file)).unwrap(), FOREIGN, "{words}, {file}");
            let others: Vec<String> =
                listing(&out).into_iter().filter(|other| other != file && other != ".lock").collect();
            assert!(others.is_empty(), "{words}, {file}: wrote {others:?}");
            std::fs::remove_dir_all(&out).unwrap();
        }
    }
}

#[test]
fn with_force_a_data_set_is_replaced_and_other_files_stay() {
    let at = &set_up();
    let out = at.join("out");
    succeeds(at, "capture ball.obj -o out --touches 3");
    std::fs::write(out.join("notes.md"), FOREIGN).unwrap();
    let again = "capture ball.obj -o out --touches 5";
    fails(at, again, 1, "out: holds ball.txt, dataset.json, notes.md, which this capture would not write … --force");
    succeeds(at, &format!("{again} --force"));
    assert_eq!(listing(&out), ["ball.txt", "dataset.json", "notes.md"]);
    assert_eq!(read(&out.join("dataset.json"))["objects"][0]["pools"][0]["touches"], 5);
    assert_eq!(std::fs::read_to_string(out.join("notes.md")).unwrap(), FOREIGN);
    let current =
        command(["capture", "ball.obj", "-o", ".", "--touches", "3", "--force"]).current_dir(at.join("")).output();
    let error = stderr(current.unwrap(), 2);
    assert!(error.contains("Use another directory than the current one"), "{error}");
}
