//! The `palpate` program. Everything that it does stands in the library's `commands`, so that a first build compiles it
//! beside the trainer, and not after it.

fn main() -> std::process::ExitCode {
    palpate::commands::main()
}
