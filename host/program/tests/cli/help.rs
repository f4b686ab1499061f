//! The program's own texts: help and completions.

use crate::{command, run, stderr, stdout};

/// The program's commands, as its help lists them.
fn commands() -> Vec<String> {
    let help = help(&["--help"], 100);
    let list = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = list.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    names.map(|line| line.split_whitespace().next().unwrap().to_owned()).filter(|name| name != "help").collect()
}

fn help(arguments: &[&str], columns: usize) -> String {
    stdout(command(arguments).env("COLUMNS", columns.to_string()).output().unwrap())
}

/// The lines of lists after the options, such as `Examples:`, and all others.
fn lists(help: &str) -> (Vec<&str>, Vec<&str>) {
    let mut inside = false;
    help.lines().partition(|line| {
        let is_heading = line.ends_with(':') && !line.starts_with(' ');
        let is_claps_own = ["Arguments:", "Options:", "Commands:"].contains(line);
        inside = is_heading && !is_claps_own || inside && !line.is_empty();
        inside
    })
}

/// The column at which a line's text begins: after a name and a gap in lists, else after its indentation.
fn text_column(line: &str) -> usize {
    let indentation = line.len() - line.trim_start().len();
    let gap = line.trim_start().find("  ").map(|at| indentation + at);
    gap.map_or(indentation, |at| at + line[at..].len() - line[at..].trim_start().len())
}

/// The first line that ends early, although the first word of the next line of its paragraph would fit into `width`.
fn ragged<'h>(lines: &[&'h str], width: usize) -> Option<&'h str> {
    let pair = lines.windows(2).find(|pair| {
        let [line, next] = [pair[0], pair[1]];
        let continues = !line.trim().is_empty()
            && !next.trim().is_empty()
            && !next.trim_start().starts_with("- ")
            && next.len() - next.trim_start().len() == text_column(line);
        let word = next.split_whitespace().next().unwrap_or_default();
        continues && line.chars().count() + 1 + word.chars().count() < width
    });
    pair.map(|pair| pair[0])
}

#[test]
fn ragged_lines_are_found() {
    assert_eq!(ragged(&["One two", "three four"], 20), Some("One two"));
    assert_eq!(ragged(&["One two three", "fourteen", "", "five"], 20), None);
    assert_eq!(
        ragged(&["  --option <N>  Some text", "                that goes on"], 40),
        Some("  --option <N>  Some text")
    );
    assert_eq!(ragged(&["  --one  Text", "  --two  Text"], 40), None);
}

#[test]
fn every_commands_help_wraps_well_at_80_and_at_120_columns() {
    let commands = commands();
    assert!(commands.len() >= 15, "{commands:?}");
    let mut faults = Vec::new();
    for command in commands.iter().map(String::as_str).chain([""]) {
        for flag in ["--help", "-h"] {
            let arguments: Vec<&str> = [command, flag].into_iter().filter(|word| !word.is_empty()).collect();
            let unwrapped = help(&arguments, 1_000);
            for width in [80, 120] {
                let help = help(&arguments, width);
                let mut fault =
                    |what: &str, line: &str| faults.push(format!("{arguments:?} at {width}: {what}: {line}"));
                for line in help.lines().filter(|line| line.chars().count() > width) {
                    fault("too long", line);
                }
                let (shown, text) = lists(&help);
                for line in shown.iter().filter(|line| !lists(&unwrapped).0.contains(line)) {
                    fault("a list is wrapped", line);
                }
                if let Some(line) = ragged(&text, width) {
                    fault("ends early", line);
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn the_program_without_a_command_prints_its_help() {
    let directory = tempfile::tempdir().unwrap();
    let error = stderr(command([""; 0]).current_dir(&directory).output().unwrap(), 2);
    assert!(error.contains("Usage: palpate <COMMAND>") && error.contains("palpate run"), "{error}");
    assert!(crate::listing(directory.path()).is_empty());
}

#[test]
fn completions_know_every_command_in_every_shell() {
    let commands = commands();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = stdout(run(["completions", shell]));
        for command in &commands {
            assert!(script.contains(command.as_str()), "{shell}: {command}");
        }
        assert!(script.contains("bad-line"), "{shell}");
    }
    let error = stderr(run(["completions", "tcsh"]), 2);
    assert!(error.contains("bash"), "{error}");
}
