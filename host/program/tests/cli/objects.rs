use crate::{Folder, fails, figures, globe, listing, says, succeeds};
use palpate::mesh::facts::Facts;
use palpate::mesh::{Mesh, builtin, obj};

/// The triangles' corners: a file that is read has its vertices in the order in which faces use them.
fn corners(mesh: &Mesh) -> Vec<[[f32; 3]; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|i| mesh.vertices[i as usize])).collect()
}

#[test]
fn an_object_is_written_as_a_closed_mesh_and_the_same_each_time() {
    let at = &Folder::new();
    says(at, "data objects bowl -o once", &["bowl.obj ", " triangles"]);
    assert_eq!(listing(&at.join("once")), ["bowl.obj"]);
    let mesh = obj::read(&at.join("once/bowl.obj")).unwrap();
    assert!(corners(&mesh) == corners(builtin::one("bowl").unwrap().mesh()), "the file holds another bowl");
    assert!(Facts::of(&mesh).is_right_side_out());
    succeeds(at, "data objects bowl -o again");
    assert_eq!(std::fs::read(at.join("once/bowl.obj")).unwrap(), std::fs::read(at.join("again/bowl.obj")).unwrap());
}

#[test]
fn objects_are_written_and_listed_as_json() {
    let at = &Folder::new();
    let written = figures(at, "data objects spoon bowl -o .");
    for (index, name) in ["bowl", "spoon"].into_iter().enumerate() {
        let mesh = obj::read(&at.join(format!("{name}.obj"))).unwrap();
        assert_eq!(written[index]["name"], name);
        assert_eq!(written[index]["triangles"], mesh.triangles.len());
    }
    assert_eq!(listing(at), ["bowl.obj", "spoon.obj"]);
}

#[test]
fn objects_that_cannot_be_written_are_refused_and_the_names_of_all_are_listed() {
    let at = &Folder::new();
    std::fs::write(at.join("file"), "kept").unwrap();
    let names = format!("teapot … {}", builtin::names().join(" … "));
    for (words, code, expected) in [
        ("data objects -o nowhere teapot", 1, names.as_str()),
        ("data objects", 2, ""),
        ("data objects bowl -o file", 1, "bowl.obj: cannot write"),
    ] {
        fails(at, words, code, expected);
    }
    assert_eq!(listing(at), ["file"]);
    assert_eq!(std::fs::read_to_string(at.join("file")).unwrap(), "kept");
}

#[test]
fn a_mesh_is_written_but_not_onto_itself() {
    let at = &Folder::new();
    let bowl = globe(at, "bowl", 6);
    let before = std::fs::read(&bowl).unwrap();
    says(at, "data objects bowl.obj -o again", &["bowl.obj "]);
    assert_eq!(listing(&at.join("again")), ["bowl.obj"]);
    assert!(corners(&obj::read(&at.join("again/bowl.obj")).unwrap()) == corners(&obj::read(&bowl).unwrap()));
    fails(at, "data objects bowl.obj -o .", 2, "another file than what is read");
    assert!(std::fs::read(&bowl).unwrap() == before);
}
