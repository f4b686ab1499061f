//! The program's own texts: help and completions.

use crate::{Folder, command, fails, palpate, run, says, stderr, stdout, succeeds};
use std::process::Stdio;

/// The program's commands, as its help lists them, with those below them.
fn commands() -> Vec<String> {
    let help = help(&["--help"], 100);
    let list = help.lines().take_while(|line| *line != "Global options:").filter(|line| line.starts_with("  "));
    let mut names: std::collections::BTreeSet<String> = list.map(first).collect();
    for above in names.clone() {
        names.extend(below(&above).into_iter().map(|name| format!("{above} {name}")));
    }
    names.into_iter().collect()
}

/// The text before two blanks.
fn first(line: &str) -> String {
    line.trim_start().split("  ").next().unwrap().to_owned()
}

/// The commands below one, as its help lists them.
fn below(command: &str) -> Vec<String> {
    let help = help(&command.split(' ').chain(["--help"]).collect::<Vec<_>>(), 100);
    let list = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    list.map(first).filter(|name| name != "help").collect()
}

fn help(arguments: &[&str], columns: usize) -> String {
    stdout(command(arguments).env("COLUMNS", columns.to_string()).output().unwrap())
}

#[test]
fn every_command_prints_its_usage_and_options_within_the_columns_of_the_terminal() {
    let commands = commands();
    assert!(commands.len() >= 15, "{commands:?}");
    for command in &commands {
        for flag in ["--help", "-h"] {
            let text = help(&command.split(' ').chain([flag]).collect::<Vec<_>>(), 80);
            assert!(text.contains(&format!("Usage: palpate {command}")) && text.contains("--help"), "{text}");
            assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
        }
    }
    assert!(help(&["capture", "--help"], 80).contains("Examples:\n  palpate capture builtin -o data"));
}

#[test]
fn the_help_of_every_command_fits_a_screen() {
    for command in commands().into_iter().chain([String::new()]) {
        let text = help(&command.split_whitespace().chain(["--help"]).collect::<Vec<_>>(), 100);
        // These are the same for every command.
        let global = text.lines().skip_while(|line| *line != "Global options:").take_while(|line| !line.is_empty());
        let lines = text.lines().count() - global.count();
        assert!(lines <= 50, "{command}: {lines} lines");
    }
}

#[test]
fn the_program_without_a_command_prints_its_help_and_a_misspelled_one_is_answered_with_the_right_one() {
    let at = &Folder::new();
    fails(at, "", 2, "Usage: palpate [OPTIONS] <COMMAND> … palpate run");
    assert!(crate::listing(at).is_empty());
    fails(at, "help captre", 2, "captre … 'capture'");
    says(at, "help capture", &["--approaches"]);
}

#[test]
fn what_was_removed_is_refused_with_what_to_use_instead() {
    let at = &Folder::new();
    for words in [
        "tune data",
        "probe design meshes",
        "data cast mesh casts",
        "data check a b",
        "report builtin --resume",
        "report builtin --recorded a",
        "capture builtin --add",
        "capture builtin --shard 1/2",
        "capture builtin --format text",
        "recognize a b --mcap c",
        "export a --early-exit always",
        "export a --emit thumb",
        "verify a b --certificate c",
        "evaluate a b --switch 5",
        "evaluate a b --confusion 3",
        "evaluate a b --config c",
        "calibrate a b --events 0",
        "calibrate a b --rows-per-second 9",
        "calibrate a b --strangers likely",
        "calibrate a b --placement-prior any",
        "calibrate a b --label kind",
        "calibrate a b --plan 4",
        "calibrate a --objects meshes",
        "evaluate a b --label kind",
        "evaluate a --objects meshes",
        "recognize a b --features",
        "recognize a b --active",
        "recognize a --explore",
        "link a --active",
        "view --play -o a",
        "view --port -o a",
        "capture builtin --position",
        "capture builtin --within 30",
        "train a --maps cell=2mm",
        "view fork --trace t",
        "view fork --misses 3",
        "data objects builtin --picture a",
        "data objects builtin --varied 2",
        "link a --watch",
        "link a --journal j",
        "link a --against b",
        "link a --per-object 4",
        "link a --bad-line 1",
        "link a --firmware b",
        "inspect a --mhz 64",
    ] {
        fails(at, words, 2, "was removed: ");
    }
    // No similar word is suggested.
    let message = stderr(palpate(at, "tune data"), 2);
    assert!(message.contains("--preset small") && !message.contains("similar"), "{message}");
}

#[test]
fn completions_know_every_command_in_every_shell() {
    let commands = commands();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = stdout(run(["completions", shell]));
        for command in commands.iter().flat_map(|path| path.split(' ')) {
            assert!(script.contains(command), "{shell}: {command}");
        }
        assert!(script.contains("error-rate"), "{shell}");
    }
    fails(&Folder::new(), "completions tcsh", 2, "bash");
}

#[test]
#[cfg(unix)]
fn ctrl_c_leaves_nothing_of_a_capture() {
    let at = &Folder::new();
    let mut capture = command(["capture", "bowl", "-o", "data", "--touches", "10000000"]);
    let capture = capture.current_dir(at).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    while crate::listing(at).is_empty() {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let process = capture.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &process]).status().unwrap().success());
    let output = capture.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(crate::listing(at), [""; 0]);
}

#[test]
fn help_lists_commands_in_groups_of_what_one_wants_to_do() {
    for arguments in [&["help"][..], &["--help"]] {
        let text = help(arguments, 80);
        let places = [
            "Everything at once:",
            "Step by step:",
            "A real probe:",
            "Objects on a table:",
            "Models from elsewhere:",
            "Look:",
        ]
        .map(|title| text.find(title).unwrap_or_else(|| panic!("{title}\n{text}")));
        assert!(places.is_sorted(), "{text}");
    }
}

#[test]
fn quiet_prints_no_remark_and_still_results_and_errors() {
    let at = &Folder::new();
    let lines = (0..40).map(|i| format!("0 0.00{} 0.0{}\n", i % 7, 10 + i % 50)).collect::<String>();
    std::fs::create_dir(at.join("data")).unwrap();
    for name in ["bowl.txt", "cup.txt"] {
        std::fs::write(at.join("data").join(name), &lines).unwrap();
    }
    let trained = succeeds(at, "--quiet train data -o e.json --trees rounds=2");
    assert_eq!(trained.lines().count(), 1, "{trained}");
    succeeds(at, "export e.json -o m.palpate");
    fails(at, "--quiet evaluate m.palpate nowhere", 1, "nowhere");
    let quiet = palpate(at, "evaluate m.palpate data --quiet");
    assert!(quiet.stderr.is_empty() && !stdout(quiet).is_empty());
}

#[test]
fn an_error_is_json_on_standard_output_where_results_would_be() {
    for (words, code, expected) in
        [("inspect no-such-file --json", 1, "no-such-file"), ("inspect --chp m4f --json", 2, "--chip")]
    {
        let output = run(words.split(' '));
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let error = stderr(output, code);
        assert!(error.contains(found["error"].as_str().unwrap()) && error.contains(expected), "{found}, {error}");
    }
}
