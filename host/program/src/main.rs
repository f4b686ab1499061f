//! The `palpate` program. Its commands are in the library beside it, where unit tests reach them.

fn main() -> std::process::ExitCode {
    palpate_cli::main()
}
