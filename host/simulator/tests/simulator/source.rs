use crate::assert_says;
use palpate_simulator::mesh::source::{Search, Source, files, load, object, objects, objects_of_instances};
use std::path::Path;
use tempfile::TempDir;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn place(directory: &Path, files: &[&str]) -> String {
    for file in files {
        let path = directory.join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, TRIANGLE).unwrap();
    }
    directory.to_str().unwrap().to_owned()
}

/// A directory of these files, and its path.
fn placed(files: &[&str]) -> (TempDir, String) {
    let directory = tempfile::tempdir().unwrap();
    let source = place(directory.path(), files);
    (directory, source)
}

fn names(sources: &[String]) -> Vec<String> {
    objects(sources).unwrap().into_iter().map(|object| object.name).collect()
}

#[test]
fn files_and_directories_together_are_sorted_by_name() {
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let one = place(one.path(), &["spoon.OBJ", "deep/er/fork.obj", "notes.txt"]);
    let two = place(two.path(), &["a cup.obj"]) + "/a cup.obj";
    assert_eq!(names(&[one, two]), ["a cup", "fork", "spoon"]);
}

#[cfg(feature = "objects")]
#[test]
fn a_built_in_object_is_found_by_its_name_unless_a_file_has_it() {
    assert_eq!(names(&["mouse".into(), "bowl".into()]), ["bowl", "mouse"]);
    assert_says(objects(&["builtin".into(), "mouse".into()]).unwrap_err(), &["two objects are called mouse"]);
}

#[test]
fn shapenet_objects_are_named_after_category_and_id() {
    let files = ["mug/1a/models/model_normalized.obj", "bowl/2b/models/model_normalized.obj"];
    let (directory, source) = placed(&files);
    assert_eq!(names(&[format!("{source}/mug/1a/models/model_normalized.obj")]), ["mug"]);
    assert_eq!(names(&[source]), ["bowl", "mug"]);
    let source = place(directory.path(), &["mug/3c/models/model_normalized.obj"]);
    assert_eq!(names(&[source]), ["bowl", "mug-1a", "mug-3c"]);
}

#[test]
fn a_directory_inside_a_directory_is_one_object_with_instances() {
    let files = ["cup/red.obj", "cup/blue.obj", "cup/far/green.obj", "fork/one.obj", "spoon.obj", "empty/notes.txt"];
    let (directory, source) = placed(&files);
    let objects = objects_of_instances(std::slice::from_ref(&source)).unwrap();
    let found: Vec<(&str, Vec<&str>)> = objects
        .iter()
        .map(|object| (object.name.as_str(), object.instances().map(|one| one.name.as_str()).collect()))
        .collect();
    let cup = vec!["blue", "far/green", "red"];
    assert_eq!(found, [("cup", cup), ("fork", vec!["one"]), ("spoon", vec!["spoon"])]);
    // Without instances, each file is an object.
    assert_eq!(names(std::slice::from_ref(&source)), ["blue", "green", "one", "red", "spoon"]);
    place(directory.path(), &["cup.obj"]);
    assert_says(objects_of_instances(&[source]).unwrap_err(), &["two objects are called cup"]);
}

#[test]
fn two_objects_of_one_name_are_refused() {
    let (_directory, source) = placed(&["a/cup.obj", "b/cup.obj"]);
    assert_says(objects(&[source]).unwrap_err(), &["two objects are called cup", "b/cup.obj"]);
}

#[test]
fn missing_and_empty_sources_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let source = directory.path().to_str().unwrap().to_owned();
    assert!(objects(std::slice::from_ref(&source)).unwrap_err().to_string().contains("no mesh here"));
    let error = objects(&[source + "/bultin"]).unwrap_err();
    assert!(error.to_string().contains("bultin: cannot read the mesh: this is neither"), "{error}");
}

#[cfg(feature = "objects")]
#[test]
fn a_misspelled_built_in_object_is_refused_with_the_names_of_all() {
    for error in
        [objects(&["builtin".into(), "mug".into()]), objects(&["mug".into()]), object("mug").map(|one| vec![one])]
    {
        let error = error.unwrap_err().to_string();
        assert!(error.starts_with("mug: ") && !error.contains("os error"), "{error}");
        assert!(palpate_simulator::mesh::builtin::names().iter().all(|name| error.contains(name)), "{error}");
    }
}

#[cfg(feature = "objects")]
#[test]
fn several_objects_where_one_is_needed_are_refused_with_their_number() {
    let error = object("builtin").unwrap_err().to_string();
    assert!(error.starts_with("builtin: 10 objects"), "{error}");
    let (directory, source) = placed(&["cup.obj"]);
    assert_eq!(object(&source).unwrap().name, "cup");
    place(directory.path(), &["bowl.obj"]);
    assert!(object(&source).unwrap_err().to_string().contains("2 objects, where one is needed"));
}

#[test]
fn a_name_in_several_formats_is_one_object_of_the_first_of_them_and_a_note_says_so() {
    let (_directory, source) = placed(&["cup.dae", "cup.STL", "cup.ply", "fork.glb", "deep/cup2.gltf", "cup.mtl"]);
    let found = files(&[source]).unwrap();
    let expected = ["cup.STL", "deep/cup2.gltf", "fork.glb"];
    for (one, expected) in found.iter().zip(expected) {
        let Source::File { path, notes, .. } = one else { panic!("{one:?}") };
        assert!(path.ends_with(expected), "{path:?}");
        assert_eq!(notes.is_empty(), expected != "cup.STL", "{notes:?}");
    }
    let Source::File { notes, .. } = &found[0] else { unreachable!() };
    assert!(notes[0].ends_with("cup.STL is used; cup.ply, cup.dae are passed over, of the same object"), "{notes:?}");
}

#[test]
fn data_sets_of_meshes_give_the_names_of_their_objects() {
    let files = [
        "025_mug/google_16k/nontextured.ply",
        "025_mug/google_16k/nontextured.stl",
        "025_mug/google_16k/textured.obj",
        "025_mug/google_64k/textured.obj",
        "025_mug/clouds/merged_cloud.ply",
        "072-a_toy_airplane/tsdf/nontextured.stl",
        "Threshold_Bowl/meshes/model.obj",
        "Threshold_Bowl/materials/textures/texture.png",
        "02958343/10155655850468db78d106ce0a280f87/model.obj",
        "chair/1a/models/model_normalized.obj",
        "plain/textured.obj",
    ];
    let (_directory, source) = placed(&files);
    let expected = ["025_mug", "02958343", "072-a_toy_airplane", "Threshold_Bowl", "chair", "textured"];
    let found = self::files(std::slice::from_ref(&source)).unwrap();
    assert_eq!(found.iter().map(Source::name).collect::<Vec<_>>(), expected);
    let Source::File { path, notes, .. } = &found[0] else { panic!("{found:?}") };
    assert!(path.ends_with("google_16k/textured.obj") && notes[0].contains("merged_cloud.ply"), "{path:?} {notes:?}");
    // One file, named outright.
    for (file, name) in [(files[0], "025_mug"), (files[6], "Threshold_Bowl"), (files[8], "02958343")] {
        assert_eq!(self::files(&[format!("{source}/{file}")]).unwrap()[0].name(), name);
    }
    let mug = &objects_of_instances(&[source]).unwrap()[0];
    let instances: Vec<&str> = mug.instances().map(|one| one.name.as_str()).collect();
    assert_eq!((mug.name.as_str(), instances), ("025_mug", vec!["google_16k/textured"]));
}

#[test]
fn instances_whose_files_state_their_units_are_brought_to_one() {
    let directory = tempfile::tempdir().unwrap();
    let globe = palpate_simulator::mesh::Mesh::globe(3);
    let dae = crate::samples::collada(&globe);
    std::fs::create_dir(directory.path().join("cup")).unwrap();
    std::fs::write(directory.path().join("cup/a.dae"), &dae).unwrap();
    std::fs::write(directory.path().join("cup/b.dae"), dae.replace("0.0254", "0.0508")).unwrap();
    let source = directory.path().to_str().unwrap().to_owned();
    let read = |source: &String| objects_of_instances(std::slice::from_ref(source)).unwrap().remove(0);
    let cup = read(&source);
    assert_eq!(cup.millimeters, Some(25.4));
    let lengths: Vec<f64> = cup.instances().map(|one| cup.true_length(one).unwrap()).collect();
    assert!((lengths[1] / lengths[0] - 2.0).abs() < 1e-6, "{lengths:?}");
    place(&directory.path().join("cup"), &["c.obj"]);
    let cup = read(&source);
    assert!(cup.millimeters.is_none() && cup.notes[0].contains("its size is unknown"));
}

#[test]
fn hidden_files_and_what_macs_put_beside_files_are_no_meshes() {
    let directory = tempfile::tempdir().unwrap();
    let source = place(
        directory.path(),
        &["cup.obj", "._cup.obj", ".hidden.stl", "__MACOSX/._cup.obj", "__MACOSX/jug.obj", ".git/jug.obj", ".DS_Store"],
    );
    assert_eq!(names(std::slice::from_ref(&source)), ["cup"]);
    let cups = objects_of_instances(std::slice::from_ref(&source)).unwrap();
    assert_eq!(cups.iter().map(|object| object.name.as_str()).collect::<Vec<_>>(), ["cup"]);
    // Named outright, they are read.
    assert_eq!(names(&[format!("{source}/.git")]), ["jug"]);
    let only = place(&directory.path().join("only"), &["._cup.obj"]);
    assert!(objects(&[only]).unwrap_err().to_string().contains("no mesh here"));
}

#[test]
fn files_of_formats_that_are_not_read_are_named_with_what_converts_them() {
    let (directory, source) =
        placed(&["box.obj", "cup.off", "deep/mug.step", "jug.OFF", "box.fbx", "box.blend", "notes.txt"]);
    let loaded = load(std::slice::from_ref(&source), Search::default()).unwrap();
    assert_eq!(loaded.objects.len(), 1);
    let expected = format!(
        "{source}/cup.off, {source}/deep/mug.step, {source}/jug.OFF are not read. OFF: Convert it to PLY or STL, for example \
         with MeshLab. STEP: Export a mesh of it as STL, for example with FreeCAD."
    );
    assert_eq!(loaded.notes, [expected]);
    // A name that is read in another format is passed over as others are.
    assert!(loaded.objects[0].notes[0].ends_with("box.blend, box.fbx are passed over, of the same object"));
    let only = place(&directory.path().join("only"), &["1.off", "2.off", "3.off", "4.off", "5.off", "6.off", "7.off"]);
    assert_says(objects(&[only]).unwrap_err(), &["no mesh that is read here", "5.off and 2 more are not read. OFF: "]);
    assert!(object(&source).unwrap().notes.last().unwrap().contains("mug.step"));
}

#[test]
fn all_meshes_that_cannot_be_read_are_named_at_once_and_left_out_if_that_is_wanted() {
    let (directory, source) = placed(&["a/one.obj", "a/two.obj", "b/three.obj", "c/four.obj"]);
    let path = |name: &str| directory.path().join(name);
    std::fs::write(path("a/two.obj"), "v 0 0\n").unwrap();
    std::fs::write(path("c/four.obj"), "").unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("nowhere", path("a/dead.obj")).unwrap();
    let dead = if cfg!(unix) { 1 } else { 0 };
    let sources = std::slice::from_ref(&source);
    for instances in [false, true] {
        let search = Search { instances, ..Search::default() };
        let error = load(sources, search).unwrap_err();
        let text = error.to_string();
        assert!(text.starts_with(&format!("{} of {} meshes cannot be read:\n  ", 2 + dead, 4 + dead)), "{text}");
        assert!(
            text.contains("two.obj:1: a vertex without z") && text.contains("four.obj: the mesh has no faces"),
            "{text}"
        );
        assert_eq!((error.exit_code(), text.contains("dead.obj: cannot read the mesh")), (1, cfg!(unix)), "{text}");
        let loaded = load(sources, Search { skips_bad: true, ..search }).unwrap();
        let expected = if instances { ["a", "b"] } else { ["one", "three"] };
        assert_eq!(loaded.objects.iter().map(|object| object.name.as_str()).collect::<Vec<_>>(), expected);
        assert_eq!(loaded.notes.iter().filter(|note| note.starts_with("left out: ")).count(), 2 + dead);
    }
    // One file alone is refused as it always was, and nothing is left out of nothing.
    let alone = format!("{source}/c");
    for skips_bad in [false, true] {
        let error =
            load(std::slice::from_ref(&alone), Search { skips_bad, ..Search::default() }).unwrap_err().to_string();
        assert!(
            error.ends_with(
                "four.obj: the mesh has no faces. Export the mesh as a file with faces: OBJ, STL, PLY, GLB or COLLADA."
            ),
            "{error}"
        );
    }
}

#[test]
fn objects_with_the_same_mesh_are_named() {
    let (directory, source) = placed(&["cup.obj", "mug.obj", "jug.obj"]);
    std::fs::write(directory.path().join("jug.obj"), TRIANGLE.replace("v 1 0 0", "v 2 0 0")).unwrap();
    let notes = load(&[source], Search::default()).unwrap().notes;
    assert_eq!(notes, ["cup and mug have the same mesh: no touch distinguishes them"]);
}

#[test]
fn files_that_may_state_their_unit_come_first_where_that_is_wanted() {
    let (_directory, source) = placed(&["cup.obj", "cup.glb", "cup.stl", "fork.stl"]);
    for (prefers_units, expected) in [(false, "cup.obj is used;"), (true, "cup.glb is used;")] {
        let found = load(std::slice::from_ref(&source), Search { prefers_units, ..Search::default() }).unwrap();
        assert!(found.objects[0].notes[0].contains(expected), "{:?}", found.objects[0].notes);
    }
}

#[cfg(unix)]
#[test]
fn a_link_to_the_directory_that_it_is_in_is_not_followed() {
    let (directory, source) = placed(&["deep/cup.obj"]);
    std::os::unix::fs::symlink(".", directory.path().join("self")).unwrap();
    std::os::unix::fs::symlink("..", directory.path().join("deep/up")).unwrap();
    assert_eq!(names(&[source]), ["cup"]);
}
