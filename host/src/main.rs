//! The `palpate` program: parses, calls the library, prints.

mod commands;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = commands::Cli::parse();
    let hint = cli.hints();
    match cli.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if !matches!(error, palpate::Error::Closed) {
                eprintln!("palpate: {error}");
                if let Some(hint) = hint(&error) {
                    eprintln!("{hint}");
                }
            }
            ExitCode::from(error.exit_code())
        }
    }
}
