//! `palpate data`: what is done with data sets of touches.

mod check;
mod compare;
mod record;

use palpate::Result;

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
    /// Add the touches of a real probe to a data set, from a file of lines
    Record(record::Arguments),
    /// Say how far recorded touches are from simulated ones, and what that costs
    Compare(compare::CompareArguments),
}

pub(crate) fn run(arguments: Arguments) -> Result<()> {
    match arguments.command {
        Command::Check(arguments) => check::run(&arguments),
        Command::Record(arguments) => record::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
    }
}
