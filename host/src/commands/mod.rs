//! One file a command: its arguments, its help, and the call into the library.

mod capture;
mod cast;
mod evaluate;
mod export;
mod inspect;
mod link;
mod numbers;
mod objects;
mod parity;
mod progress;
mod recognize;
mod report;
mod run;
mod train;
mod tune;
mod view;
mod watch;

use clap::{Parser, Subcommand};
use palpate::error::{Problem, TouchesProblem};
use palpate::touches::{Dataset, Format, Listing};
use palpate::{Error, Result};
use std::path::{Path, PathBuf};

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
    /// Do all of it: capture, train, export, recognize, report (the default)
    Run => run,
    /// Write the ten built-in objects as OBJ files
    Objects => objects,
    /// Make a page that shows an object and some touches, to look at in a browser
    View => view,
    /// Touch objects with the virtual probe
    Capture => capture,
    /// Move spheres against a mesh as a file says, to hold the simulator against another engine
    Cast => cast,
    /// Train an ensemble on captured touches
    Train => train,
    /// Compile an ensemble to the bytes that the chip reads
    Export => export,
    /// Say what is in a compiled model
    Inspect => inspect,
    /// Recognize objects from a stream of touches
    Recognize => recognize,
    /// Measure how often a model is right, and after how many touches
    Evaluate => evaluate,
    /// Find the best model that fits a chip
    Tune => tune,
    /// Hold a compiled model against its ensemble
    Parity => parity,
    /// Remake the whole evaluation: every figure, the limit, speed against error
    Report => report,
    /// Recognize on a chip at the end of a line
    Link => link,
    /// Look on while a chip recognizes
    Watch => watch,
}

/// Recognize objects by touch: virtual touches, boosted trees, a model of a few kilobytes for a microcontroller.
#[derive(Parser)]
#[command(
    name = "palpate",
    version,
    about,
    arg_required_else_help = false,
    after_help = "\
Examples:
  palpate                            touch, learn, pack and recognize ten built-in objects
  palpate run meshes/ -o out         the same for your own OBJ files
  palpate help capture               what a command does, with examples"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

impl Cli {
    /// What to add to the error with which the command ends: which of its options help.
    pub(crate) fn hints(&self) -> fn(&Error) -> Option<&'static str> {
        match self.command {
            Some(Command::Capture(_)) => capture::hint,
            _ => |error| match error.problem() {
                Some(Problem::Touches(TouchesProblem::Incomplete)) => {
                    Some("Repeat the command of the capture with --resume.")
                }
                _ => None,
            },
        }
    }

    pub(crate) fn run(self) -> Result<()> {
        self.command
            .unwrap_or_else(|| Self::parse_from(["palpate", "run"]).command.unwrap_or_else(|| unreachable!()))
            .run()
    }
}

/// Reads a data set; its warnings go to stderr.
fn dataset(directory: &Path) -> Result<Dataset> {
    let dataset = Dataset::read(directory)?;
    for warning in &dataset.warnings {
        eprintln!("palpate: warning: {warning}");
    }
    Ok(dataset)
}

/// The files that a data set consists of, as far as they can be found: what a command that reads it must not write.
fn files_of(directory: &Path) -> Vec<PathBuf> {
    let is_touches = |path: &PathBuf| {
        let extension = path.extension().unwrap_or_default();
        path.file_name().is_some_and(|name| name == Listing::FILE)
            || Format::ALL.iter().any(|format| extension == format.extension())
    };
    let entries = std::fs::read_dir(directory).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).filter(is_touches).collect()
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    #[test]
    fn every_commands_arguments_are_consistent() {
        super::Cli::command().debug_assert();
    }
}
