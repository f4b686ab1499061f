use crate::{command, run, stderr, stdout};
use std::path::{Path, PathBuf};

fn slivers(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data").join(name)
}

#[test]
fn the_reference_comes_back_with_our_times_appended() {
    let directory = tempfile::tempdir().unwrap();
    let (mesh, casts, ours) = (slivers("slivers.obj"), slivers("slivers.casts.csv"), directory.path().join("ours.csv"));
    let table = stdout(command(["data", "cast", "--as-is", "-o"]).args([&ours, &mesh, &casts]).output().unwrap());
    assert!(table.starts_with("set "), "{table}");
    let written = std::fs::read_to_string(&ours).unwrap();
    let given = std::fs::read_to_string(&casts).unwrap();
    assert_eq!(written.lines().count(), given.lines().count());
    for (written, given) in written.lines().zip(given.lines()) {
        if given.starts_with('#') {
            assert_eq!(written, given);
        } else {
            let ours = written.strip_prefix(given).unwrap().strip_prefix(',').unwrap();
            assert_eq!(ours == "miss", given.ends_with("miss"), "{written}");
        }
    }
    assert_eq!(stdout(command(["data", "cast", "--as-is"]).args([&mesh, &casts]).output().unwrap()), written);
    let json =
        stdout(command(["data", "cast", "--as-is", "--json", "-o"]).args([&ours, &mesh, &casts]).output().unwrap());
    let sets: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(sets[0]["set"], "approach");
    assert_eq!(sets[0]["missed"], 0);
}

#[test]
fn a_mesh_far_from_its_origin_is_cast_at_where_it_is() {
    let directory = tempfile::tempdir().unwrap();
    let (mesh, casts) = (directory.path().join("far.obj"), directory.path().join("casts.csv"));
    std::fs::write(&mesh, "v 65536 -5 -5\nv 65536 5 -5\nv 65536 0 5\nf 1 2 3\n").unwrap();
    std::fs::write(&casts, "a,65532,0,0,2,0,0\n").unwrap();
    let arguments = command(["data", "cast", "--as-is", "--radius", "0.5"]).args([&mesh, &casts]).output();
    assert_eq!(stdout(arguments.unwrap()), "a,65532,0,0,2,0,0,1.75\n");
}

#[test]
fn wrong_input_writes_nothing_and_says_why() {
    let directory = tempfile::tempdir().unwrap();
    let (mesh, casts, out) =
        (slivers("slivers.obj"), directory.path().join("casts.csv"), directory.path().join("out.csv"));
    std::fs::write(&casts, "a,0,0,0,1,0,0\na,0,0,0,1,0\n").unwrap();
    let error = stderr(command(["data", "cast", "-o"]).args([&out, &mesh, &casts]).output().unwrap(), 1);
    assert!(error.contains("casts.csv:2: 6 fields"), "{error}");
    assert!(!out.exists());
    let error = stderr(command(["data", "cast", "--radius", "0"]).args([&mesh, &casts]).output().unwrap(), 2);
    assert!(error.contains("radius is 0. Use a number greater than 0."), "{error}");
    stderr(run(["data", "cast", "a.obj", "b.csv", "--as-is", "--length", "3"]), 2);
    let broken = directory.path().join("broken.obj");
    std::fs::write(&broken, "v 0 0 0\nv 0 1\n").unwrap();
    let error = stderr(
        command(["data", "cast", "-o"]).args([&out, &broken, &slivers("slivers.casts.csv")]).output().unwrap(),
        1,
    );
    assert!(error.contains("broken.obj:2: a vertex without z. Correct the line"), "{error}");
    assert!(!out.exists());
}
