//! `palpate maps`: objects on a table, by height maps of them.

mod calibrate;
mod evaluate;
mod explore;
mod level;
mod play;
mod recognize;
mod train;
mod view;

pub(super) use recognize::print_located;

use super::Global;
use palpate::Result;

#[derive(clap::Args)]
#[command(arg_required_else_help = true, subcommand_required = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Make maps of objects, from meshes or recorded touches
    Train(Box<train::Arguments>),
    /// Set the threshold that keeps an error rate, on a simulated table or on recordings
    Calibrate(Box<calibrate::Arguments>),
    /// Measure on a simulated table how often names and places are right
    Evaluate(Box<evaluate::Arguments>),
    /// Recognize objects and where they lie, from a stream of touches
    Recognize(Box<recognize::Arguments>),
    /// Say where to touch an object without a mesh, until its heights are known
    Explore(Box<explore::Arguments>),
    /// Measure the table and the fingertips, by presses on the bare table
    Level(Box<level::Arguments>),
    /// Show the map of a touched object on a page, or two of them
    View(Box<view::Arguments>),
    /// Make a page on which a hidden object is found on a table
    Play(Box<play::Arguments>),
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    match arguments.command {
        Command::Train(arguments) => train::run(*arguments, global),
        Command::Calibrate(arguments) => calibrate::run(&arguments, global),
        Command::Evaluate(arguments) => evaluate::run(&arguments, global),
        Command::Recognize(arguments) => recognize::run(&arguments, global),
        Command::Explore(arguments) => explore::run(&arguments),
        Command::Level(arguments) => level::run(&arguments, global),
        Command::View(arguments) => view::run(&arguments, global),
        Command::Play(arguments) => play::run(*arguments, global),
    }
}

/// The name of a placement with that of its object.
pub(super) fn name(object: &str, placement: &str) -> String {
    if placement.is_empty() { object.to_owned() } else { format!("{object}/{placement}") }
}
