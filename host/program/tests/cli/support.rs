//! Running the program, and files for it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program with these arguments.
pub(crate) fn command<S: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
    command.args(arguments);
    command
}

pub(crate) fn run<S: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = S>) -> Output {
    command(arguments).output().unwrap()
}

/// The output of a run that must succeed.
#[track_caller]
pub(crate) fn stdout(output: Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The JSON that a run prints, which must succeed.
#[track_caller]
pub(crate) fn json(output: Output) -> serde_json::Value {
    serde_json::from_str(&stdout(output)).unwrap()
}

/// The one message of a run that must fail with this code, without a backtrace.
#[track_caller]
pub(crate) fn stderr(output: Output, code: i32) -> String {
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{error}");
    assert!(!error.contains("panicked") && !error.contains("RUST_BACKTRACE"), "{error}");
    error
}

/// A mesh of this many triangles, roughly, as an OBJ file.
pub(crate) fn globe(directory: &Path, name: &str, rings: u32) -> PathBuf {
    let path = directory.join(format!("{name}.obj"));
    let mut text = Vec::new();
    palpate::mesh::obj::write(&palpate::mesh::Mesh::globe(rings), &mut text).unwrap();
    std::fs::write(&path, text).unwrap();
    path
}

/// The names of what a directory holds, sorted.
pub(crate) fn listing(directory: &Path) -> Vec<String> {
    let names = std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}
