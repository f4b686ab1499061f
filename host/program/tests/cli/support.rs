//! Running the program, and files for it.

use palpate::mesh::{Mesh, obj};
use std::io::Write;
use std::net::TcpListener;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread::JoinHandle;
use tempfile::TempDir;

/// A folder of one test.
pub(crate) struct Folder(TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// The absolute path of a file in it.
    pub(crate) fn text(&self, name: &str) -> String {
        self.join(name).to_str().unwrap().to_owned()
    }
}

impl Deref for Folder {
    type Target = Path;

    fn deref(&self) -> &Path {
        self.0.path()
    }
}

impl AsRef<Path> for Folder {
    fn as_ref(&self) -> &Path {
        self
    }
}

/// The program with these arguments.
pub(crate) fn command<S: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
    command.args(arguments);
    command
}

pub(crate) fn run<S: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = S>) -> Output {
    command(arguments).output().unwrap()
}

/// Runs a command that reads this input, or ends before it has read it.
pub(crate) fn piped(mut command: Command, input: &[u8]) -> Output {
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let _ = child.stdin.take().unwrap().write_all(input);
    child.wait_with_output().unwrap()
}

/// A port at which `chip` takes connections, in a thread of its own.
pub(crate) fn listen(chip: impl FnOnce(TcpListener) + Send + 'static) -> (String, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp://{}", listener.local_addr().unwrap());
    (port, std::thread::spawn(move || chip(listener)))
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

/// Runs the program in a directory, with these words.
pub(crate) fn palpate(directory: &Path, words: &str) -> Output {
    command(words.split_whitespace()).current_dir(directory).output().unwrap()
}

/// The output of a run in a directory that must succeed.
#[track_caller]
pub(crate) fn succeeds(directory: &Path, words: &str) -> String {
    stdout(palpate(directory, words))
}

/// The JSON that a command prints with `--json`.
#[track_caller]
pub(crate) fn figures(directory: &Path, words: &str) -> serde_json::Value {
    json(palpate(directory, &format!("{words} --json")))
}

/// The output of a run in a directory that must succeed and say all of `expected`.
#[track_caller]
pub(crate) fn says(directory: &Path, words: &str, expected: &[&str]) -> String {
    let text = succeeds(directory, words);
    holds(&text, expected);
    text
}

/// A text contains all of `expected`.
#[track_caller]
pub(crate) fn holds(text: &str, expected: &[&str]) {
    for part in expected {
        assert!(text.contains(part), "{part:?} is not in {text}");
    }
}

/// Runs and fails with this exit code and nothing on standard output; the message must contain `expected`.
#[track_caller]
pub(crate) fn fails(directory: &Path, words: &str, code: i32, expected: &str) {
    let output = palpate(directory, words);
    assert!(output.stdout.is_empty(), "{words}");
    complains(output, words, code, expected);
}

/// A run `of` these words failed with this exit code, and its message contains every part of `expected`; ` … ` separates parts.
#[track_caller]
pub(crate) fn complains(output: Output, of: &str, code: i32, expected: &str) {
    let message = stderr(output, code);
    for part in expected.split(" … ") {
        assert!(message.contains(part), "{of}: {part:?} is not in {message}");
    }
}

/// The bytes that `inspect` states for a model's parts add up to all of its bytes.
#[track_caller]
pub(crate) fn parts_are_all_bytes(inspected: &serde_json::Value) {
    let parts = inspected["bytes_by_part"].as_object().unwrap().values();
    assert_eq!(inspected["bytes"], parts.map(|bytes| bytes.as_u64().unwrap()).sum::<u64>());
}

/// The JSON of a file.
pub(crate) fn read(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// The JSON of each line.
pub(crate) fn lines(text: &str) -> Vec<serde_json::Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Copies the first lines of a file into another one.
pub(crate) fn cut(from: &Path, to: &Path, count: usize) {
    let text = std::fs::read_to_string(from).unwrap();
    std::fs::create_dir_all(to.parent().unwrap()).unwrap();
    std::fs::write(to, text.split_inclusive('\n').take(count).collect::<String>()).unwrap();
}

/// A normal number of deviation 1, nearly, from a state that it changes.
pub(crate) fn normal(state: &mut u64) -> f64 {
    let mut uniform = || {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..12).map(|_| uniform()).sum::<f64>() - 6.0
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

/// Three shapes in `meshes`, each of few triangles.
pub(crate) fn shapes(directory: &Path) {
    std::fs::create_dir(directory.join("meshes")).unwrap();
    for (name, sides) in [("ball", [1.0, 1.0, 1.0]), ("cigar", [1.0, 0.4, 0.4]), ("disc", [1.0, 1.0, 0.3])] {
        let mut text = Vec::new();
        obj::write(&Mesh::globe(8).stretched(sides), &mut text).unwrap();
        std::fs::write(directory.join(format!("meshes/{name}.obj")), text).unwrap();
    }
}

/// A mesh of this many triangles, roughly, as an OBJ file.
pub(crate) fn globe(directory: &Path, name: &str, rings: u32) -> PathBuf {
    let path = directory.join(format!("{name}.obj"));
    let mut text = Vec::new();
    obj::write(&Mesh::globe(rings), &mut text).unwrap();
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
