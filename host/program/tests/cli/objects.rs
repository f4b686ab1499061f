use crate::{command, fails, globe, listing, run, stderr, stdout, succeeds};
use palpate::mesh::facts::Facts;
use palpate::mesh::{Mesh, builtin, obj};

/// The triangles' corners: a file that is read has its vertices in the order in which faces use them.
fn corners(mesh: &Mesh) -> Vec<[[f32; 3]; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|i| mesh.vertices[i as usize])).collect()
}

#[test]
fn an_object_is_written_as_a_closed_mesh_and_the_same_each_time() {
    let directory = tempfile::tempdir().unwrap();
    let (once, again) = (directory.path().join("once"), directory.path().join("again"));
    let said = stdout(command(["data", "objects", "bowl", "-o"]).arg(&once).output().unwrap());
    assert!(said.contains("bowl.obj: ") && said.contains(" triangles"), "{said}");
    assert_eq!(listing(&once), ["bowl.obj"]);
    let mesh = obj::read(&once.join("bowl.obj")).unwrap();
    assert!(corners(&mesh) == corners(builtin::one("bowl").unwrap().mesh()), "the file holds another bowl");
    assert!(Facts::of(&mesh).is_right_side_out());
    stdout(command(["data", "objects", "bowl", "-o"]).arg(&again).output().unwrap());
    assert_eq!(std::fs::read(once.join("bowl.obj")).unwrap(), std::fs::read(again.join("bowl.obj")).unwrap());
}

#[test]
fn varied_objects_and_a_picture_are_written_and_listed_as_json() {
    let directory = tempfile::tempdir().unwrap();
    let picture = directory.path().join("sheet.png");
    let mut command = command(["data", "objects", "spoon", "bowl", "--varied", "7", "--json", "--picture"]);
    let json = stdout(command.arg(&picture).arg("-o").arg(directory.path()).output().unwrap());
    let written: serde_json::Value = serde_json::from_str(&json).unwrap();
    // In the order in which the built-in objects are listed, whatever the order of the arguments.
    for (index, name) in ["bowl", "spoon"].into_iter().enumerate() {
        let mesh = obj::read(&directory.path().join(format!("{name}.obj"))).unwrap();
        assert_eq!(written[index]["name"], name);
        assert_eq!(written[index]["triangles"], mesh.triangles.len());
        assert!(corners(&mesh) == corners(builtin::varied(name, 7).unwrap().mesh()), "the file holds another {name}");
        assert!(!mesh.triangles.is_empty());
    }
    assert!(std::fs::read(&picture).unwrap().starts_with(b"\x89PNG"));
    assert_eq!(listing(directory.path()), ["bowl.obj", "sheet.png", "spoon.obj"]);
}

#[test]
fn an_unknown_name_is_refused_and_all_names_are_listed() {
    let error = stderr(run(["data", "objects", "-o", "nowhere", "teapot"]), 1);
    assert!(error.contains("teapot") && builtin::names().iter().all(|name| error.contains(name)), "{error}");
    stderr(run(["data", "objects"]), 2);
    stderr(run(["data", "objects", "-o", "nowhere", "--varied", "seven"]), 2);
    assert!(!std::path::Path::new("nowhere").exists());
}

#[test]
fn a_directory_that_cannot_be_made_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("file");
    std::fs::write(&file, "kept").unwrap();
    let error = stderr(command(["data", "objects", "bowl", "-o"]).arg(&file).output().unwrap(), 1);
    assert!(error.contains("bowl.obj: cannot write"), "{error}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "kept");
}

#[test]
fn a_mesh_is_written_but_neither_varied_nor_written_onto_itself() {
    let directory = tempfile::tempdir().unwrap();
    let at = directory.path();
    let bowl = globe(at, "bowl", 6);
    let before = std::fs::read(&bowl).unwrap();
    let said = succeeds(at, "data objects bowl.obj -o again");
    assert!(said.contains("bowl.obj: ") && listing(&at.join("again")) == ["bowl.obj"], "{said}");
    assert!(corners(&obj::read(&at.join("again/bowl.obj")).unwrap()) == corners(&obj::read(&bowl).unwrap()));
    for (words, expected) in [
        ("data objects --varied 1 bowl.obj -o again", "only they can be varied"),
        ("data objects bowl.obj -o .", "another file than what is read"),
        ("data objects bowl.obj -o again --picture bowl.obj", "another file than what is read"),
    ] {
        fails(at, words, 2, expected);
        assert!(std::fs::read(&bowl).unwrap() == before);
    }
}
