//! `palpate data`: data sets of recorded touches.

mod record;

use crate::Result;

#[derive(clap::Args)]
#[command(arg_required_else_help = true, subcommand_required = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Add the touches of a real probe to a data set, from a file of lines
    Record(record::Arguments),
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    match arguments.command {
        Command::Record(arguments) => record::run(&arguments),
    }
}
