//! `palpate data`: data sets of touches.

mod check;

use crate::Result;

#[derive(clap::Args)]
#[command(arg_required_else_help = true, subcommand_required = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Say what is wrong with a data set, line by line, and what it holds
    Check(check::Arguments),
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    match arguments.command {
        Command::Check(arguments) => check::run(&arguments),
    }
}
