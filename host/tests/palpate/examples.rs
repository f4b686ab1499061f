//! Every program in `examples/` runs as it is, without arguments.

use std::process::{Command, Stdio};

/// Runs an example, which `cargo test` has built beside the tests, and returns its output.
#[track_caller]
fn run(name: &str) -> String {
    let mut path = std::env::current_exe().unwrap();
    path.pop(); // from target/PROFILE/deps/examples-HASH
    path.pop();
    path.push("examples");
    path.push(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    let output = Command::new(&path).stdin(Stdio::null()).output().unwrap_or_else(|error| {
        panic!(
            "{}: {error}; `cargo test --release -p palpate` builds it, `cargo test --release --test palpate` does not",
            path.display()
        )
    });
    assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn mesh_to_model_touches_two_meshes_and_writes_a_model() {
    let printed = run("mesh_to_model");
    assert!(printed.contains("disc         2000 touches in "), "{printed}");
    assert!(printed.contains("model.palpate: "), "{printed}");
    assert!(printed.contains(" bytes, 30 trees, about "), "{printed}");
}

#[test]
fn touches_to_verdicts_recognizes_what_is_touched() {
    let printed = run("touches_to_verdicts");
    let verdicts: Vec<&str> = printed.lines().filter_map(|line| line.split(" after ").next()).collect();
    let right = |name| verdicts.iter().filter(|verdict| **verdict == name).count();
    assert!(right("bowl") >= 5 && right("wristwatch") >= 5, "{printed}");
}

#[test]
fn own_trees_gives_the_margins_of_the_trees_that_were_compiled() {
    let printed = run("own_trees");
    // κ is 73 ms and the slope 11 ms: round, from the first tree and the second.
    assert!(printed.contains("features [73000.0, 11000.0]"), "{printed}");
    assert!(printed.contains("flat   full -1.5000, compiled -1.5000"), "{printed}");
    assert!(printed.contains("round  full +1.7500, compiled +1.7500"), "{printed}");
}

#[test]
fn compare_models_measures_both_on_the_same_touches() {
    let printed = run("compare_models");
    assert!(printed.contains("published ") && printed.contains("compact "), "{printed}");
    assert_eq!(printed.matches(" of 1000 verdicts differ from the full model's").count(), 2, "{printed}");
}

#[test]
fn growth_measures_every_way_on_the_same_approaches() {
    let printed = run("growth");
    assert!(printed.starts_with("12 objects made in "), "{printed}");
    for way in ["4x3 ", "4x3:i8 "] {
        assert_eq!(printed.lines().filter(|line| line.starts_with(way)).count(), 1, "{way}: {printed}");
    }
}
