//! `palpate data`: data sets of touches, and built-in objects.

mod check;
mod objects;
mod record;

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
    /// Check a data set
    Check(check::Arguments),
    /// Record touches of a real probe: from lines, a log, or a chip
    Record(Box<record::Arguments>),
    /// Write built-in objects, meshes or maps of touched objects as OBJ
    Objects(Box<objects::Arguments>),
}

pub(crate) fn run(arguments: Arguments, global: &Global) -> Result<()> {
    match arguments.command {
        Command::Check(arguments) => check::run(&arguments, global),
        Command::Record(arguments) => record::run(&arguments, global),
        Command::Objects(arguments) => objects::run(&arguments, global),
    }
}
