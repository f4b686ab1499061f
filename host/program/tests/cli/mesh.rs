//! Meshes that something is wrong with, given to `capture` and `view` alike.

use crate::{Folder, command, fails, globe, holds, palpate, says, stderr, stdout, succeeds};
use std::path::Path;

/// A copy of an OBJ file with its lines changed.
fn changed(mesh: &Path, name: &str, change: impl Fn(usize, &str) -> Option<String>) {
    let text = std::fs::read_to_string(mesh).unwrap();
    let lines: Vec<String> = text.lines().enumerate().filter_map(|(index, line)| change(index, line)).collect();
    std::fs::write(mesh.with_file_name(name), lines.join("\n")).unwrap();
}

#[test]
fn a_capture_of_an_open_or_inside_out_mesh_says_so_in_one_line_for_each() {
    let at = &Folder::new();
    let good = globe(at, "good", 6);
    let first_face = std::fs::read_to_string(&good).unwrap().lines().position(|line| line.starts_with("f ")).unwrap();
    changed(&good, "open.obj", |index, line| (index != first_face).then(|| line.to_owned()));
    changed(&good, "turned.obj", |_, line| match line.split(' ').collect::<Vec<_>>()[..] {
        ["f", a, b, c] => Some(format!("f {a} {c} {b}")),
        _ => Some(line.to_owned()),
    });
    let said = captured(at, "good.obj open.obj turned.obj -o touches --touches 10", 0);
    let lines: Vec<&str> = said.lines().filter(|line| line.contains("The mesh is")).collect();
    assert_eq!(lines.len(), 2, "{said}");
    assert!(lines[0].starts_with("open: The mesh is open: 3 edges belong to one triangle only"), "{said}");
    assert!(lines[1].starts_with("turned: The mesh is inside out: "), "{said}");
    assert!(!captured(at, "good.obj -o more --touches 10", 0).contains("The mesh is"));
}

#[test]
fn a_file_named_like_a_built_in_object_comes_first_in_capture_and_view_alike() {
    let at = &Folder::new();
    let mesh = globe(at, "globe", 6);
    std::fs::rename(mesh, at.join("fork")).unwrap();
    let here = |words: &str| succeeds(at, words);
    here("view fork -o file.html");
    let page = |name: &str| std::fs::read_to_string(at.join(name)).unwrap();
    // 4 · 6 · 5 triangles, where the built-in fork has thousands.
    assert!(page("file.html").contains("<dt>Triangles</dt><dd>120"));
    here("capture fork -o file --touches 5");
    std::fs::remove_file(at.join("fork")).unwrap();
    here("view fork -o built-in.html");
    assert!(!page("built-in.html").contains("<dt>Triangles</dt><dd>120"));
    here("capture fork -o built-in --touches 5");
    let touches = |name: &str| std::fs::read(at.join(name).join("fork.txt")).unwrap();
    assert_ne!(touches("file"), touches("built-in"));
}

/// Runs `palpate capture` in a directory: what it prints to stderr.
fn captured(at: &Path, words: &str, code: i32) -> String {
    stderr(palpate(at, &format!("capture {words}")), code)
}

#[test]
fn bad_meshes_are_named_at_once_and_with_skip_bad_the_rest_is_captured() {
    let at = &Folder::new();
    std::fs::create_dir(at.join("set")).unwrap();
    let set = at.join("set");
    for (name, rings) in [("one", 5), ("two", 6)] {
        globe(&set, name, rings);
    }
    std::fs::copy(set.join("two.obj"), set.join("twin.obj")).unwrap();
    std::fs::write(set.join("._one.obj"), "\0\x05\x16\x07").unwrap();
    std::fs::write(set.join("cut.stl"), "solid x\nfacet").unwrap();
    std::fs::write(set.join("empty.ply"), "").unwrap();
    std::fs::write(set.join("mug.step"), "ISO-10303-21;").unwrap();
    let said = captured(at, "set -o data --touches 5", 1);
    assert!(said.starts_with("palpate: 2 of 5 meshes cannot be read:\n  set/cut.stl:2: the STL file"), "{said}");
    assert!(
        said.contains("\n  set/empty.ply:1: ") && said.ends_with("--skip-bad continues without what cannot be read.\n"),
        "{said}"
    );
    assert!(!at.join("data").exists());
    let said = captured(at, "set -o data --touches 5 --skip-bad", 0);
    let expected = [
        "palpate: left out: set/cut.stl:2: the STL file is damaged",
        "palpate: left out: set/empty.ply:1: ",
        "palpate: set/mug.step is not read. STEP: Export a mesh of it as STL",
        "palpate: twin and two have the same mesh: no touch distinguishes them",
    ];
    holds(&said, &expected);
    let listed = std::fs::read_to_string(at.join("data/dataset.json")).unwrap();
    assert_eq!(listed.matches("\"name\"").count(), 3, "{listed}");
    // Every command with such a set has the option.
    succeeds(at, "data objects set -o written --skip-bad");
    assert_eq!(crate::listing(&at.join("written")), ["one.obj", "twin.obj", "two.obj"]);
}

#[test]
fn objects_that_cannot_be_touched_are_named_with_their_sizes_before_anything_is_captured() {
    let at = &Folder::new();
    globe(at, "one", 4);
    // Two flat sheets, which a table hides.
    for name in ["flat", "sheet"] {
        std::fs::write(at.join(format!("{name}.obj")), "v 0 0 0\nv 9 0 0\nv 9 8 0\nv 0 8 0\nf 1 2 3 4\n").unwrap();
    }
    std::fs::write(at.join("probe.toml"), "unit = \"mm\"\nradius = 1.5\nspacing = 15\nspeed = 100\n").unwrap();
    let true_size = "flat.obj sheet.obj -o data --touches 5 --scene table --true-size mm --probe probe.toml";
    let said = captured(at, true_size, 1);
    assert!(said.contains("flat: 9 × 8 × 0 mm\n") && said.contains("sheet: 9 × 8 × 0 mm\n"), "{said}");
    let expected = "palpate: flat (9 × 8 × 0 mm), sheet (9 × 8 × 0 mm): none of 4194304 approaches touched with all three \
                    fingers, 30 mm from the first to the third, of radius 1.5 mm. If that is not the size, state another unit";
    assert!(said.contains(expected), "{said}");
    let options =
        "\n--approaches N keeps every approach. --skip-bad leaves such objects out. See also --probe and --true-size.";
    assert!(said.contains(options) && !said.contains("--length"), "{said}");
    assert!(!at.join("data").exists());
    let said = captured(at, "one.obj flat.obj -o data --touches 5 --scene table --skip-bad", 0);
    assert!(said.contains("palpate: left out: flat (10 × 8.89 × 0 units): none of"), "{said}");
    assert_eq!(crate::listing(&at.join("data")), ["dataset.json", "one"]);
}

#[test]
fn objects_without_a_known_unit_are_named_together_and_files_that_state_one_are_preferred() {
    let at = &Folder::new();
    std::fs::write(at.join("probe.toml"), "unit = \"mm\"\nradius = 1.5\nspacing = 15\nspeed = 100\n").unwrap();
    std::fs::create_dir(at.join("set")).unwrap();
    globe(&at.join("set"), "cup", 4);
    globe(&at.join("set"), "jug", 4);
    let stated = "set -o data --touches 5 --true-size stated --probe probe.toml";
    assert!(captured(at, stated, 1).contains("palpate: cup, jug: the true size is unknown"));
    // Triangles in meters, beside the mesh that states none.
    let positions: Vec<u8> = [[0.0_f32, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]]
        .into_iter()
        .flatten()
        .flat_map(f32::to_le_bytes)
        .collect();
    let bytes: Vec<u8> = positions.into_iter().chain([0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3]).collect();
    std::fs::write(at.join("set/cup.bin"), bytes).unwrap();
    let gltf = serde_json::json!({
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR"}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "buffers": [{"uri": "cup.bin", "byteLength": 60}]
    });
    std::fs::write(at.join("set/cup.gltf"), gltf.to_string()).unwrap();
    std::fs::remove_file(at.join("set/jug.obj")).unwrap();
    let said = captured(at, stated, 0);
    assert!(said.contains("cup.gltf is used; set/cup.obj") || said.contains("cup.gltf is used; cup.obj"), "{said}");
    assert!(said.contains("cup: 100 × 100 × 100 mm"), "{said}");
    assert!(captured(at, &stated.replace("stated", "mm").replace("data", "other"), 1).contains("cup: 2 × 2 × 2 mm"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_probe_file_may_be_a_pipe() {
    let at = &Folder::new();
    globe(at, "ball", 4);
    std::fs::write(at.join("probe.toml"), "radius = 0.2\nspacing = 1.5\nspeed = 10\n").unwrap();
    let capture = |out: &str, probe: &str| {
        let words = ["capture", "ball.obj", "-o", out, "--touches", "5", "--probe", probe];
        let file = std::fs::File::open(at.join("probe.toml")).unwrap();
        let mut cat =
            std::process::Command::new("cat").stdin(file).stdout(std::process::Stdio::piped()).spawn().unwrap();
        stdout(command(words).current_dir(at).stdin(cat.stdout.take().unwrap()).output().unwrap());
        cat.wait().unwrap();
        std::fs::read(at.join(out).join("ball.txt")).unwrap()
    };
    assert_eq!(capture("file", "probe.toml"), capture("pipe", "/dev/stdin"));
}

#[test]
fn touches_of_one_object_of_a_model_are_evaluated() {
    let at = &Folder::new();
    globe(at, "bowl", 6);
    succeeds(at, "capture bowl.obj --approaches 150 -o one");
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate");
    let evaluate = format!("evaluate {model} one --sequences 20");
    let text = succeeds(at, &evaluate);
    holds(&text, &["\nbowl ", "promised for all 10 objects of the model, tested on 1"]);
    // What needs a second object says so, and neither a model nor a promise comes of one.
    fails(at, "train one -o e.json", 1, "only one object here, bowl");
    says(at, "data check one", &["only bowl is here", "1 object, 150 touches"]);
}
