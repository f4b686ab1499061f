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

/// Runs the program in a directory.
pub(crate) fn palpate(directory: &Path, arguments: &[&str]) -> Output {
    command(arguments).current_dir(directory).output().unwrap()
}

/// The output of a run in a directory that must succeed.
#[track_caller]
pub(crate) fn succeeds(directory: &Path, arguments: &[&str]) -> String {
    stdout(palpate(directory, arguments))
}

/// Runs and fails with this exit code; the message must contain `expected`.
#[track_caller]
pub(crate) fn fails(directory: &Path, arguments: &[&str], code: i32, expected: &str) {
    let output = palpate(directory, arguments);
    assert!(output.stdout.is_empty());
    let message = stderr(output, code);
    assert!(message.contains(expected), "{message}");
}

/// Writes touches of an object that bends by up to `most` microseconds, in any order; other seeds are other touches. A touch
/// may miss a finger if they are `partial`.
pub(crate) fn touches(path: &Path, [most, count, seed]: [u64; 3], partial: bool, pose: &str) {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ most;
    let mut random = |range: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % range
    };
    let mut line = || {
        let (slope, bend) = (random(300_000), random(most) / 2 + random(most) / 2);
        let missing = if partial { random(10) } else { 3 };
        let times = [0, slope / 2 + bend, slope].map(|micros| format!("{:.6}", micros as f64 * 1e-6));
        let field = |finger: u64| if finger == missing { "-" } else { times[finger as usize].as_str() };
        format!("{} {} {}{pose}\n", field(0), field(1), field(2))
    };
    std::fs::write(path, (0..count).map(|_| line()).collect::<String>()).unwrap();
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
