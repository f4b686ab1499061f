//! One file per command: its arguments, its help, and the call into the library.

mod calibrate;
mod capture;
mod cast;
mod chips;
mod completions;
mod data;
mod design;
mod evaluate;
mod expected;
mod export;
mod figures;
mod fit;
mod inspect;
mod link;
mod noise;
mod numbers;
mod objects;
mod parity;
mod plan;
mod play;
mod probe;
mod progress;
mod recognize;
mod recognize_rows;
mod record;
mod report;
mod run;
mod shell;
mod stated;
mod strangers;
mod teach;
mod train;
mod tune;
mod unstated;
mod verify;
mod view;
mod watch;

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use palpate::error::{Setting, TouchesProblem};
use palpate::touches::{Dataset, Format, Listing, Log, Warning};
use palpate::{Error, Result};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Declares the enum that clap parses and the dispatch, from one list.
macro_rules! commands {
    ($($(#[$meta:meta])* $name:ident => $module:ident,)*) => {
        #[derive(Subcommand)]
        enum Command {
            $($(#[$meta])* $name($module::Arguments),)*
        }

        impl Command {
            fn run(self) -> Result<()> {
                match self {
                    $(Self::$name(arguments) => $module::run(arguments),)*
                }
            }
        }
    };
}

commands! {
    /// Do all of it: capture, train, export, recognize, report
    Run => run,
    /// Write the ten built-in objects as OBJ files
    Objects => objects,
    /// Make a page that shows an object and some touches, to look at in a browser
    View => view,
    /// Make a page on which objects can be touched, with the recognizer inside
    Play => play,
    /// Touch objects with the virtual probe
    Capture => capture,
    /// Move spheres against a mesh as a file says, to compare the simulator with another engine
    Cast => cast,
    /// Look after data sets of touches: record, check, compare
    Data => data,
    /// Train an ensemble on captured touches
    Train => train,
    /// Compile an ensemble to the bytes that the chip reads
    Export => export,
    /// Say what is in a compiled model
    Inspect => inspect,
    /// Recognize objects from a stream of touches
    Recognize => recognize,
    /// Add a plan of approaches to a model: where to touch next
    Plan => plan,
    /// Measure how often a model is right, and after how many touches
    Evaluate => evaluate,
    /// Set a model's thresholds so that it keeps a promised error rate
    Calibrate => calibrate,
    /// Find the best model that fits a chip
    Tune => tune,
    /// Find out which probe to build for your objects, and what is crooked about the one you have
    Probe => design,
    /// Compare a compiled model with its ensemble
    Parity => parity,
    /// Compare a model over rows of features with the file that it was exported from
    Verify => verify,
    /// Remake the whole evaluation: every figure, the limit, speed against error
    Report => report,
    /// Recognize on a chip at the end of a line
    Link => link,
    /// Watch a chip while it recognizes
    Watch => watch,
    /// Print a script that completes this program's commands and options in a shell
    Completions => completions,
}

/// Recognize objects by touch: virtual touches, boosted trees, a model of a few kilobytes for a microcontroller.
#[derive(Parser)]
#[command(
    name = "palpate",
    version,
    about,
    max_term_width = 120,
    arg_required_else_help = true,
    subcommand_required = true,
    after_help = "\
Examples:
  palpate run                 capture, train and recognize built-in objects
  palpate run meshes/ -o out  the same for your own meshes
  palpate help capture        what a command does, with examples

What the words of the output mean: docs/reference/words.md"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

impl Command {
    /// What to add to an error with which the command ends: which of its options help.
    fn hint(&self) -> fn(&Error) -> Option<&'static str> {
        match self {
            Self::Capture(_) => capture::hint,
            _ => |error| match error.problem() {
                Some(TouchesProblem::Incomplete) => Some("Repeat the command of the capture with --resume."),
                _ => None,
            },
        }
    }
}

/// The program's commands and arguments.
fn cli() -> clap::Command {
    Cli::command().mut_subcommands(|command| match command.get_after_help().map(|text| unwrapped(&text.to_string())) {
        Some(text) => command.after_help(text),
        None => command,
    })
}

/// Joins the lines of each paragraph, so that they can be wrapped to the terminal's width. Indented lines stay as they are.
fn unwrapped(text: &str) -> String {
    let mut unwrapped = String::new();
    let mut joins = false;
    for line in text.lines() {
        let is_prose = !line.is_empty() && !line.starts_with(' ');
        if !unwrapped.is_empty() {
            unwrapped.push(if joins && is_prose { ' ' } else { '\n' });
        }
        unwrapped.push_str(line);
        joins = is_prose;
    }
    unwrapped
}

/// Runs the command that the arguments name, prints its error if it has one, and returns the exit code.
pub fn main() -> ExitCode {
    let matches = cli().try_get_matches().unwrap_or_else(|error| without_trailing(error).exit());
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let hint = cli.command.hint();
    match cli.command.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if !matches!(error, Error::Closed) {
                eprintln!("palpate: {}", message(&error, matches.subcommand_name().unwrap_or_default()));
                if let Some(hint) = hint(&error) {
                    eprintln!("{hint}");
                }
            }
            ExitCode::from(error.exit_code())
        }
    }
}

/// The error without the advice to give an option that does not exist as a value: no file or object begins with a dash.
fn without_trailing(mut error: clap::Error) -> clap::Error {
    if let Some(ContextValue::StyledStrs(advice)) = error.remove(ContextKind::Suggested) {
        let others: Vec<_> = advice.into_iter().filter(|advice| !advice.to_string().starts_with("to pass ")).collect();
        if !others.is_empty() {
            error.insert(ContextKind::Suggested, ContextValue::StyledStrs(others));
        }
    }
    error
}

/// The error as the user of `command` understands it: where the library names a setting, this names the option.
fn message(error: &Error, command: &str) -> String {
    let (Error::At { place, problem }, Some(Setting { name, value, .. })) = (error, error.problem()) else {
        return error.to_string();
    };
    let option = name.replace('_', "-");
    let cli = cli();
    // The command's own options, and those of the commands below it.
    let named = cli.find_subcommand(command).into_iter();
    let mut arguments = named
        .flat_map(|command| std::iter::once(command).chain(command.get_subcommands()))
        .flat_map(|command| command.get_arguments());
    if arguments.any(|argument| argument.get_long() == Some(&option)) {
        return format!("{place}--{option} is {value}. {}", problem.fix());
    }
    error.to_string()
}

/// A share in percent, as it was meant: without the last bits.
fn percent(share: f64) -> f64 {
    (share * 1e9).round() / 1e7
}

/// Reads a data set; its warnings go to stderr.
fn dataset(directory: &Path) -> Result<Dataset> {
    Dataset::read(directory).map(checked)
}

/// A data set whose warnings went to stderr.
fn checked(dataset: Dataset) -> Dataset {
    dataset.warnings.iter().for_each(say);
    dataset
}

/// Says to stderr what looks wrong, or what was skipped.
fn say(warning: &Warning) {
    match warning {
        Warning::SkippedChannels { .. } => eprintln!("palpate: {warning}"),
        _ => eprintln!("palpate: warning: {warning}"),
    }
}

/// Of fewer touches it is no surprise if all are full.
const MANY: usize = 30;

/// Warns where a model to which it is evidence which fingers touch gets full touches alone: those that were left out speak
/// for other objects.
fn warn_of_full(touches: usize, is_any_partial: bool) {
    if touches >= MANY && !is_any_partial {
        eprintln!(
            "palpate: warning: all {touches} touches are full, and to this model it is evidence which fingers touch: if others were left out, its verdicts are wrong. Keep every approach (palpate capture --approaches), or train for full touches (palpate train --touches full)."
        );
    }
}

/// The files that a data set consists of, as far as they can be found: what a command that reads it must not write.
fn files_of(directory: &Path) -> Vec<PathBuf> {
    if directory.is_file() {
        return vec![directory.into()];
    }
    let is_touches = |path: &PathBuf| {
        let extension = path.extension().unwrap_or_default();
        path.file_name().is_some_and(|name| name == Listing::FILE)
            || extension == Log::EXTENSION
            || Format::ALL.iter().any(|format| extension == format.extension())
    };
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).filter(is_touches).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_commands_arguments_are_consistent() {
        cli().debug_assert();
    }

    #[test]
    fn paragraphs_of_help_are_joined_and_lists_are_not() {
        let text = "One\ntwo.\n\nExamples:\n  palpate run\n  palpate view\n\nThree\nfour.";
        assert_eq!(unwrapped(text), "One two.\n\nExamples:\n  palpate run\n  palpate view\n\nThree four.");
    }

    #[test]
    fn an_unknown_option_is_not_said_to_be_a_value() {
        for words in [&["palpate", "report", "--touches", "5"][..], &["palpate", "view", "bowl", "--touch", "5"]] {
            let error = without_trailing(cli().try_get_matches_from(words).unwrap_err()).to_string();
            assert!(error.contains("unexpected argument") && !error.contains("-- --touch"), "{error}");
        }
        // The option that may have been meant is still named.
        let error = cli().try_get_matches_from(["palpate", "view", "bowl", "--touch", "5"]).unwrap_err();
        assert!(without_trailing(error).to_string().contains("--touches"));
    }

    #[test]
    fn a_setting_out_of_range_is_shown_with_its_options_name() {
        let error = Error::setting("max_touches", 0, "1 to 1000");
        assert_eq!(message(&error, "recognize"), "--max-touches is 0. Use 1 to 1000.");
        assert_eq!(error.exit_code(), 2);
        let error = Error::setting("spacing", 9, "less");
        assert_eq!(message(&error, "probe"), "--spacing is 9. Use less.");
        let error = Error::setting("max_touches", 0, "1 to 1000");
        // No option of this name, and no command: the setting's own name.
        assert_eq!(message(&error, "view"), "max_touches is 0. Use 1 to 1000.");
        assert_eq!(message(&error, ""), "max_touches is 0. Use 1 to 1000.");
        let error = Error::setting("seed", "x", "a number").in_file("probe.json");
        assert_eq!(message(&error, "run"), "probe.json: --seed is x. Use a number.");
    }
}
