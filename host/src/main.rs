//! The `palpate` program: parses, calls the library, prints.

mod commands;

fn main() -> std::process::ExitCode {
    commands::run()
}
