//! The program's own texts: help and completions.

use crate::{Folder, command, fails, holds, palpate, run, says, stderr, stdout, succeeds};
use std::process::Stdio;

/// The program's commands, as its help lists them in groups: what stands before two blanks.
fn commands() -> Vec<String> {
    let help = help(&["--help"], 100);
    let list = help.lines().take_while(|line| *line != "Global options:").filter(|line| line.starts_with("  "));
    let names: std::collections::BTreeSet<String> =
        list.map(|line| line.trim_start().split("  ").next().unwrap().to_owned()).collect();
    names.into_iter().collect()
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
fn the_program_without_a_command_prints_its_help_and_a_misspelled_one_is_answered_with_the_right_one() {
    let at = &Folder::new();
    fails(at, "", 2, "Usage: palpate [OPTIONS] <COMMAND> … palpate run");
    assert!(crate::listing(at).is_empty());
    fails(at, "help captre", 2, "captre … 'capture'");
    says(at, "help capture", &["--approaches"]);
}

#[test]
fn completions_know_every_command_in_every_shell() {
    let commands = commands();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = stdout(run(["completions", shell]));
        for command in commands.iter().flat_map(|path| path.split(' ')) {
            assert!(script.contains(command), "{shell}: {command}");
        }
        assert!(script.contains("bad-line"), "{shell}");
    }
    fails(&Folder::new(), "completions tcsh", 2, "bash");
}

#[test]
fn keys_of_options_are_completed_after_a_comma_too_where_the_shell_is_there() {
    let at = &Folder::new();
    let script = |shell: &str| {
        let path = at.join(shell);
        std::fs::write(&path, stdout(run(["completions", shell]))).unwrap();
        path
    };
    // Bash calls the function with the words as it breaks them, at `=` too.
    let bash = |line: &str, word: &str| {
        let ask = format!(
            "source {}; COMP_LINE='{line}' COMP_POINT={}; _palpate_keys palpate '{word}' ''; echo \"${{COMPREPLY[@]}}\"",
            script("bash").display(),
            line.len()
        );
        stdout(std::process::Command::new("bash").args(["-c", &ask]).output().unwrap())
    };
    assert_eq!(bash("palpate train data --trees leaf", "leaf"), "leaf_bits=\n");
    assert_eq!(bash("palpate train data --trees rounds=3,d", "3,d"), "3,depth=\n");
    assert_eq!(bash("palpate run --real timer=1ms,missed=2%,b", "2%,b"), "2%,bent=\n");
    assert_eq!(bash("palpate run --real noise=", ""), "\n");
    assert_eq!(bash("palpate export e.json --layout comp", "comp"), "compact complete\n");
    assert_eq!(bash("palpate export e.json --emit c,rust-", "c,rust-"), "c,rust-code\n");
    assert!(bash("palpate capture cup b", "b").contains("builtin"), "names of objects, where a command takes some");
    assert!(!bash("palpate export b", "b").contains("builtin"));
    let fish = std::process::Command::new("fish")
        .args(["-c", "source $argv[1]; complete -C 'palpate train data --trees rounds=3,dep'"])
        .arg(script("fish"))
        .output();
    match fish {
        Ok(output) => assert!(stdout(output).starts_with("rounds=3,depth=")),
        Err(_) => println!("SKIPPED: no fish"),
    }
    let zsh = std::fs::read_to_string(script("zsh")).unwrap();
    holds(&zsh, &[":_palpate_trees'", "_values -s , key 'i8' 'i16' 'f32'", "_values -s , key 'rounds:value: '"]);
}

#[test]
#[cfg(unix)]
fn ctrl_c_says_how_far_a_capture_came_and_how_it_goes_on() {
    let at = &Folder::new();
    let mut capture = command(["capture", "bowl", "-o", "data", "--touches", "10000000"]);
    let capture = capture.current_dir(at).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    while !at.join("data").exists() {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let process = capture.id().to_string();
    assert!(std::process::Command::new("kill").args(["-INT", &process]).status().unwrap().success());
    let output = capture.wait_with_output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(
        error.contains("palpate: interrupted") && error.ends_with("repeat the command with --resume.\n"),
        "{error}"
    );
    assert_eq!(output.status.code(), Some(130));
}

#[test]
fn fish_does_not_complete_what_help_does_not_list() {
    let script = stdout(run(["completions", "fish"]));
    assert!(script.contains("-a \"check\"") && !script.contains("-a \"cast\""), "{script}");
}

#[test]
fn help_lists_commands_in_groups_of_what_one_wants_to_do() {
    for arguments in [&["help"][..], &["--help"]] {
        let text = help(arguments, 80);
        let places = ["Everything at once:", "Step by step:", "A real probe:", "Models from elsewhere:", "Look:"]
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
