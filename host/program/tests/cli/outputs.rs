//! Output of commands: a file of Palpate's is replaced, and no other one, unless `--force` is given.

use crate::fixtures::ONE_SPLIT;
use crate::{Folder, fails, globe, listing, palpate, stderr, succeeds};

/// A file that a user might have where a command writes.
const FOREIGN: &str = "// Recognizes with palpate_onboard.\nfn main() {}\n";

/// A command and the files that it writes.
struct Writer {
    words: &'static str,
    files: &'static [&'static str],
    /// True if it takes little time, so that its own files are tried, too.
    is_quick: bool,
}

const fn quick(words: &'static str, files: &'static [&'static str]) -> Writer {
    Writer { words, files, is_quick: true }
}

/// A command that works for long, once it has found its outputs free. Its own files are replaced in tests of that command.
const fn slow(words: &'static str, files: &'static [&'static str]) -> Writer {
    Writer { words, files, is_quick: false }
}

/// Every command that writes, by every option that names or adds a file. What writes through the same call as another one, such
/// as a page, is tried once to its end.
const WRITERS: &[Writer] = &[
    quick(
        "export ensemble.json -o out/m.palpate --emit c,rust,json",
        &["m.palpate", "m.h", "palpate.h", "m.rs", "m.json"],
    ),
    quick("export ensemble.json -o out/t.palpate --emit rust-code", &["t.palpate", "t.rs"]),
    quick("export ensemble.json -o out/c.palpate --emit c-code", &["c.palpate", "c.h", "palpate.h"]),
    quick(
        "export model.palpate -o out/copy.palpate --emit rust,c",
        &["copy.palpate", "copy.rs", "copy.h", "palpate.h"],
    ),
    quick("recognize model.palpate touches.txt --mcap out/log.mcap", &["log.mcap"]),
    quick("train data -o out/trained.json --trees rounds=2", &["trained.json"]),
    quick("view ball.obj -o out/ball.html", &["ball.html"]),
    quick("view --port -o out/port.html", &["port.html"]),
    quick("data objects ball.obj -o out --picture out/all.png", &["ball.obj", "all.png"]),
    quick("data cast ball.obj casts.csv -o out/times.csv", &["times.csv"]),
    quick("capture ball.obj -o out --touches 3", &["ball.txt", "dataset.json"]),
    slow("capture ball.obj -o out --touches 3", &["ball.part", "ball.parquet"]),
    slow("train data -o out/t.json --teach touches.txt", &["t.json"]),
    slow("calibrate model.palpate data -o out/sure.palpate", &["sure.palpate"]),
    slow("calibrate model.palpate data -o out/planned.palpate --plan 1", &["planned.palpate"]),
    slow("calibrate model.palpate casts.csv -o out/rows.palpate --label kind --sequence-column id", &["rows.palpate"]),
    slow("evaluate rows.palpate casts.csv --label kind --sequence-column id --page out/page.html", &["page.html"]),
    quick("view --play ball.obj --model model.palpate -o out/play.html", &["play.html"]),
    slow("probe fit data bowl -o out/probe.toml", &["probe.toml"]),
    slow(
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
    slow("report ball.obj -o out", &["index.html", "summary.json"]),
    slow("link tcp://127.0.0.1:9 data --journal out/journal.jsonl", &["journal.jsonl"]),
    slow("data record touches.txt -o out --object ball", &["ball.txt"]),
];

fn set_up() -> Folder {
    let at = ONE_SPLIT.folder();
    globe(&at, "ball", 8);
    std::fs::write(at.join("touches.txt"), "0 0 0.08\n0 0 0.01\n").unwrap();
    std::fs::write(at.join("casts.csv"), "a,-9,0,0,1,0,0\n").unwrap();
    let rows = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/data/import/xgboost-3.4-softprob.ubj");
    succeeds(&at, &format!("export {rows} -o rows.palpate"));
    at
}

#[test]
fn no_command_replaces_a_file_that_palpate_did_not_write() {
    let at = &set_up();
    let out = at.join("out");
    for Writer { words, files, .. } in WRITERS {
        for file in *files {
            std::fs::create_dir(&out).unwrap();
            std::fs::write(out.join(file), FOREIGN).unwrap();
            let error = stderr(palpate(at, words), 1);
            assert!(error.contains(file), "{words}, {file}: {error}");
            assert_eq!(std::fs::read_to_string(out.join(file)).unwrap(), FOREIGN, "{words}, {file}");
            let others: Vec<String> =
                listing(&out).into_iter().filter(|other| other != file && other != ".lock").collect();
            assert!(others.is_empty(), "{words}, {file}: wrote {others:?}");
            std::fs::remove_dir_all(&out).unwrap();
        }
    }
}

#[test]
fn with_force_such_a_file_is_replaced_and_then_as_one_of_palpates_without() {
    let at = &set_up();
    let out = at.join("out");
    for Writer { words, files, is_quick } in WRITERS {
        if !is_quick {
            continue;
        }
        std::fs::create_dir(&out).unwrap();
        files.iter().for_each(|file| std::fs::write(out.join(file), FOREIGN).unwrap());
        for more in [" --force", ""] {
            succeeds(at, &format!("{words}{more}"));
            for file in *files {
                assert!(std::fs::read(out.join(file)).unwrap() != FOREIGN.as_bytes(), "{words}, {file}");
            }
        }
        std::fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn export_leaves_the_program_that_it_is_called_beside() {
    let at = &set_up();
    std::fs::create_dir(at.join("src")).unwrap();
    std::fs::write(at.join("src/main.rs"), FOREIGN).unwrap();
    let export = "export ensemble.json -o src/main.palpate --emit rust";
    let error = stderr(palpate(at, export), 1);
    assert_eq!(
        error,
        "palpate: src/main.rs: a file is there already that Palpate did not write, and it is not replaced. Give another path, \
         or move that file away.\n--force replaces it.\n"
    );
    assert_eq!(listing(&at.join("src")), ["main.rs"]);
    // An empty file is nobody's.
    std::fs::write(at.join("src/main.rs"), "").unwrap();
    succeeds(at, export);
}

#[test]
fn force_does_not_go_with_what_keeps_what_is_there() {
    let at = &set_up();
    for words in ["capture ball.obj -o out --resume --force", "--force capture ball.obj -o out --add"] {
        fails(at, words, 2, "--force is given. Use it without --resume and --add");
    }
}
