//! Meshes that something is wrong with, given to `capture` and `view` alike.

use crate::{command, globe, run, stderr, stdout};
use palpate::mesh::builtin;
use std::path::{Path, PathBuf};

/// A copy of an OBJ file with its lines changed.
fn changed(mesh: &Path, name: &str, change: impl Fn(usize, &str) -> Option<String>) -> PathBuf {
    let text = std::fs::read_to_string(mesh).unwrap();
    let lines: Vec<String> = text.lines().enumerate().filter_map(|(index, line)| change(index, line)).collect();
    let path = mesh.with_file_name(name);
    std::fs::write(&path, lines.join("\n")).unwrap();
    path
}

#[test]
fn a_capture_of_an_open_or_inside_out_mesh_says_so_in_one_line_for_each() {
    let directory = tempfile::tempdir().unwrap();
    let good = globe(directory.path(), "good", 6);
    let faces = std::fs::read_to_string(&good).unwrap().lines().filter(|line| line.starts_with("v ")).count();
    let open = changed(&good, "open.obj", |index, line| (index != faces).then(|| line.to_owned()));
    let inside_out = changed(&good, "turned.obj", |_, line| match line.split(' ').collect::<Vec<_>>()[..] {
        ["f", a, b, c] => Some(format!("f {a} {c} {b}")),
        _ => Some(line.to_owned()),
    });
    let capture = |meshes: &[&Path], out: &str| {
        let mut command = command(["capture", "--touches", "10", "-o"]);
        let output = command.arg(directory.path().join(out)).args(meshes).output().unwrap();
        assert!(output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    let said = capture(&[&good, &open, &inside_out], "touches");
    let lines: Vec<&str> = said.lines().filter(|line| line.contains("The mesh is")).collect();
    assert_eq!(lines.len(), 2, "{said}");
    assert!(lines[0].starts_with("open: The mesh is open: 3 edges belong to one triangle only"), "{said}");
    assert!(lines[1].starts_with("turned: The mesh is inside out: "), "{said}");
    assert!(!capture(&[&good], "more").contains("The mesh is"));
}

#[test]
fn a_capture_of_a_misspelled_object_lists_the_names_as_view_does() {
    let directory = tempfile::tempdir().unwrap();
    let (touches, page) = (directory.path().join("touches"), directory.path().join("mug.html"));
    let captured = stderr(command(["capture", "builtin", "mug", "-o"]).arg(&touches).output().unwrap(), 1);
    let viewed = stderr(command(["view", "mug", "-o"]).arg(&page).output().unwrap(), 1);
    for error in [&captured, &viewed] {
        assert!(error.contains("mug: cannot read the mesh: this is neither a file"), "{error}");
        assert!(builtin::names().iter().all(|name| error.contains(name)), "{error}");
        assert!(!error.contains("os error"), "{error}");
    }
    assert!(!touches.exists() && !page.exists());
}

#[test]
fn a_file_named_like_a_built_in_object_comes_first_in_capture_and_view_alike() {
    let directory = tempfile::tempdir().unwrap();
    let mesh = globe(directory.path(), "globe", 6);
    std::fs::rename(mesh, directory.path().join("fork")).unwrap();
    let here = |arguments: &[&str]| stdout(command(arguments).current_dir(&directory).output().unwrap());
    here(&["view", "fork", "-o", "file.html"]);
    let page = |name: &str| std::fs::read_to_string(directory.path().join(name)).unwrap();
    // 4 · 6 · 5 triangles, where the built-in fork has thousands.
    assert!(page("file.html").contains("<dt>Triangles</dt><dd>120"));
    here(&["capture", "fork", "-o", "file", "--touches", "5"]);
    std::fs::remove_file(directory.path().join("fork")).unwrap();
    here(&["view", "fork", "-o", "built-in.html"]);
    assert!(!page("built-in.html").contains("<dt>Triangles</dt><dd>120"));
    here(&["capture", "fork", "-o", "built-in", "--touches", "5"]);
    let touches = |name: &str| std::fs::read(directory.path().join(name).join("fork.txt")).unwrap();
    assert_ne!(touches("file"), touches("built-in"));
}

#[test]
fn a_broken_mesh_is_refused_with_its_file_its_line_and_a_cure() {
    let directory = tempfile::tempdir().unwrap();
    let (mesh, out) = (directory.path().join("cup.obj"), directory.path().join("out"));
    for (text, expected) in [
        (
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n",
            "cup.obj:4: vertex 4 of a face is out of range: the file has 3 vertices.",
        ),
        ("v 0 0 0\nv 1 zero 0\n", "cup.obj:2: \"zero\" is not a number."),
        ("v 0 0 0\n\nf 1 1 x\n", "cup.obj:3: \"x\" is not a vertex of a face."),
    ] {
        std::fs::write(&mesh, text).unwrap();
        for name in ["capture", "view"] {
            let error = stderr(command([name, "-o"]).args([&out, &mesh]).output().unwrap(), 1);
            assert!(error.contains(expected), "{error}");
            assert!(error.contains("Correct the line, or export the mesh again."), "{error}");
        }
    }
    std::fs::write(&mesh, "v 0 0 0\n").unwrap();
    let error = stderr(run(["view", mesh.to_str().unwrap(), "-o", out.to_str().unwrap()]), 1);
    assert!(error.contains("cup.obj: the mesh has no faces. Export the mesh as"), "{error}");
    assert!(!out.exists());
}
