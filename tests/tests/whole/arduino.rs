//! The Arduino sketch on this machine, over stubs: it compiles without warnings, and finds touches and a name in edges.

use palpate_tests::ROOT;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// The clock at the start, which goes round in the middle of it all, and when it ends; then edges: pin, whether it closes, when.
const SCRIPT: &str = "4292967296 6000000
    2 1 1000000  2 0 1000500  2 1 1001000  3 1 1020000  4 1 1050000
    2 0 1400000  3 0 1400000  4 0 1400000
    4 1 1600000  4 0 1604000
    3 1 2000000  3 0 2060000
    2 1 3000000  2 0 3040000  2 1 3070000  3 1 3080000  4 1 3090000
    2 0 3400000  3 0 3400000  4 0 3400000
    2 1 4000000  3 1 4020000  3 0 4028000  3 1 4032000  3 0 4036000  3 1 4040000  3 0 4044000  3 1 4048000  3 0 4052000
    2 0 4100000
    2 1 5000000  3 1 5000000  4 1 5000100
    2 0 5400000  3 0 5400000  4 0 5400000";

/// A switch that bounces counts from its first edge, a glitch not at all, a finger that touches twice the first time, and a
/// switch that does not settle ends its touch. The toy model of the sketch takes full touches, and is sure after three of them.
const PRINTED: &str = "touch 0 20000 50000
touch 4294967295 0 4294967295
The model was not trained on such touches.
touch 0 80000 90000
touch 0 0 100
ab
";

#[test]
fn the_sketch_compiles_and_makes_touches_and_a_name_of_edges() {
    let directory = tempfile::tempdir().unwrap();
    let program = directory.path().join("sketch");
    let root = Path::new(ROOT);
    let sketch = root.join("onboard/c/examples/Recognize");
    let compiler = std::env::var("CXX").unwrap_or_else(|_| "c++".into());
    let mut command = Command::new(&compiler);
    command.args(["-std=c++11", "-O1", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-o"]).arg(&program);
    command.arg(format!("-DSKETCH=\"{}\"", sketch.join("Recognize.ino").display())).arg("-I").arg(&sketch);
    command.arg("-I").arg(root.join("onboard/c")).arg(root.join("tests/c/arduino.cpp"));
    let Ok(output) = command.output() else { return println!("SKIPPED: there is no {compiler}") };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut child = Command::new(program).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(SCRIPT.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!((String::from_utf8_lossy(&output.stdout).as_ref(), output.status.success()), (PRINTED, true));
}
