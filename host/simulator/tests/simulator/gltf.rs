use crate::assert_says;
use crate::samples::{buffer, corners, document, glb_of};
use palpate_simulator::error::Result;
use palpate_simulator::mesh::Mesh;
use palpate_simulator::mesh::file::parse;
use serde_json::{Value, json};
use std::path::Path;

/// A square of two triangles, as a GLB file whose document was changed.
fn changed(change: impl FnOnce(&mut Value)) -> Result<Mesh> {
    let square = square();
    let mut document = document(&square, None);
    change(&mut document);
    read(&document, &buffer(&square))
}

fn read(document: &Value, bytes: &[u8]) -> Result<Mesh> {
    parse(&glb_of(document, bytes), Path::new("cup.glb")).map(|contents| contents.mesh)
}

fn square() -> Mesh {
    Mesh {
        vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

#[track_caller]
fn refused(pointer: &str, value: Value, expected: &str) {
    let error = changed(|document| match document.pointer_mut(pointer) {
        Some(place) => *place = value,
        None => {
            let (parent, name) = pointer.rsplit_once('/').unwrap();
            document.pointer_mut(parent).unwrap()[name] = value;
        }
    });
    let error = error.unwrap_err().to_string();
    assert!(error.starts_with("cup.glb: ") && error.contains(expected), "{pointer}: {error}");
}

#[test]
fn nodes_place_their_meshes_and_a_mirror_keeps_the_outside() {
    let half = 0.5_f64;
    let mesh = changed(|document| {
        document["nodes"] = json!([
            {"children": [1, 2], "translation": [10, 0, 0], "rotation": [0, 0, half.sqrt(), half.sqrt()]},
            {"mesh": 0, "scale": [2, 2, 2]},
            {"mesh": 1, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 5, 1]}
        ]);
    });
    // A quarter of a turn about z: x becomes y, y becomes -x.
    let near = |corners: &[[f32; 3]; 3], expected: [[f32; 3]; 3]| {
        corners.iter().flatten().zip(expected.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-5)
    };
    let corners = corners(&mesh.unwrap());
    assert!(near(&corners[0], [[10.0, 0.0, 0.0], [10.0, 2.0, 0.0], [8.0, 2.0, 0.0]]), "{corners:?}");
    assert!(near(&corners[1], [[10.0, 0.0, 5.0], [9.0, 0.0, 5.0], [9.0, 1.0, 5.0]]), "{corners:?}");
}

#[test]
fn hidden_nodes_are_left_out_with_all_below_them_and_a_note_says_so() {
    let square = square();
    let mut document = document(&square, None);
    document["extensionsRequired"] = json!(["KHR_node_visibility"]);
    document["nodes"] = json!([
        {"children": [1, 2]},
        {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": true}, "VENDOR_remark": 5}},
        {"children": [3], "extensions": {"KHR_node_visibility": {"visible": false}}},
        {"mesh": 1}
    ]);
    let contents = |document: &Value| parse(&glb_of(document, &buffer(&square)), Path::new("cup.glb"));
    let shown = contents(&document).unwrap();
    assert_eq!(corners(&shown.mesh), [corners(&square)[0]]);
    assert_eq!(shown.notes, ["cup.glb hides 1 node (KHR_node_visibility), left out with all below"]);
    document["nodes"][2]["extensions"]["KHR_node_visibility"] = json!({});
    let shown = contents(&document).unwrap();
    assert_eq!((corners(&shown.mesh), shown.notes.len()), (corners(&square), 0));
    document["nodes"][0]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
    assert_says(contents(&document).unwrap_err(), &["cup.glb: the mesh has no faces"]);
}

#[test]
fn strips_fans_missing_indices_and_short_ones_make_triangles_and_lines_do_not() {
    let strip = changed(|document| {
        document["meshes"] = json!([{"primitives": [
            {"attributes": {"POSITION": 0}, "mode": 5}, {"attributes": {"POSITION": 0}, "mode": 6},
            {"attributes": {"POSITION": 0}, "mode": 1}, {"attributes": {}, "mode": 0}
        ]}, {"primitives": []}]);
    });
    assert_eq!(strip.unwrap().triangles, [[0, 1, 2], [2, 1, 3], [0, 1, 2], [0, 2, 3]]);
    let shorts = changed(|document| document["accessors"][1]["componentType"] = 5123.into()).unwrap();
    assert_eq!(shorts.triangles[0], [0, 0, 1]);
}

#[test]
fn what_would_change_the_surface_is_refused_by_name() {
    let draco = json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}});
    refused(
        "/extensionsRequired",
        json!(["KHR_draco_mesh_compression"]),
        "Draco compression (KHR_draco_mesh_compression)",
    );
    refused("/extensionsRequired", json!(["EXT_meshopt_compression"]), "meshopt compression (EXT_meshopt_compression)");
    refused("/extensionsRequired", json!(["VENDOR_shape"]), "an extension (VENDOR_shape)");
    refused("/accessors/0/componentType", json!(5122), "positions that are not floats (KHR_mesh_quantization)");
    refused("/nodes/1/skin", json!(0), "a skin");
    refused("/meshes/0/weights", json!([0.0, 0.5]), "a morph");
    refused("/nodes/1/extensions", json!({"EXT_mesh_gpu_instancing": {}}), "EXT_mesh_gpu_instancing");
    refused("/asset/version", json!("1.0"), "glTF of version 1.0");
    // Only used, and an accessor that stands nowhere.
    for (used, name) in [("KHR_draco_mesh_compression", "Draco"), ("EXT_meshopt_compression", "meshopt")] {
        let error = changed(|document| {
            document["extensionsUsed"] = json!([used]);
            document["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        });
        assert_says(error.unwrap_err(), &[used, name]);
    }
    // Draco with plain numbers beside it is read.
    assert_eq!(
        changed(|document| document["meshes"][0]["primitives"][0]["extensions"] = draco).unwrap().triangles.len(),
        2
    );
    // Quantization of other attributes than positions does not matter.
    assert!(changed(|document| document["extensionsRequired"] = json!(["KHR_mesh_quantization"])).is_ok());
}

#[test]
fn numbers_that_cannot_be_are_refused_by_their_place() {
    for (pointer, value, expected) in [
        ("/accessors/0/count", json!(5), "accessors[0] of 5 elements goes beyond the end of bufferViews[0]"),
        ("/accessors/0/count", json!(u64::MAX), "goes beyond the end"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "goes beyond the end"),
        ("/accessors/0/type", json!("VEC4"), "is not VEC3"),
        ("/accessors/1/componentType", json!(5126), "not unsigned whole numbers"),
        ("/accessors/1/count", json!(2), "not a multiple of 3"),
        ("/accessors/1/bufferView", json!(9), "bufferViews[9], where accessors[1] is, is missing"),
        ("/bufferViews/0/byteStride", json!(4), "a stride of 4 bytes"),
        ("/bufferViews/0/byteLength", json!(u64::MAX), "beyond the end of its buffer"),
        ("/bufferViews/0/buffer", json!(1), "buffers[1], where accessors[0] is, is missing"),
        ("/buffers/0/byteLength", json!(1_000_000), "buffers[0] states 1000000 bytes, but 72 are there"),
        ("/buffers/0/uri", json!("https://example.com/cup.bin"), "not beside the file"),
        ("/buffers/0/uri", json!("/etc/passwd"), "not beside the file"),
        ("/buffers/0/uri", json!("cup.bin"), "in another file"),
        ("/buffers/0/uri", json!("data:,plain"), "without base64"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(7), "accessors[7] is missing"),
        ("/meshes/0/primitives/0/mode", json!(7), "7 is not a primitive mode"),
        ("/meshes/0/primitives/0/attributes", json!({}), "without positions"),
        ("/nodes/1/mesh", json!(5), "meshes[5] is missing"),
        ("/nodes/0/children", json!([9]), "nodes[9] is missing"),
        ("/nodes/1/children", json!([0]), "two parents, or is above itself"),
        ("/nodes/0/children", json!([1, 1]), "two parents"),
        ("/nodes/0/rotation", json!([0, 0, 0, 0]), "a rotation of a length other than 1"),
        ("/nodes/0/matrix", json!([1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]), "last row is not 0 0 0 1"),
        ("/nodes/0/scale", json!([1e300, 1, 1]), "is not finite"),
        ("/scene", json!(3), "scenes[3] is missing"),
        ("/nodes/0/children", json!("x"), "invalid type"),
    ] {
        refused(pointer, value, expected);
    }
}

#[test]
fn a_mesh_placed_a_million_times_is_refused_before_it_fills_the_memory() {
    let error = changed(|document| {
        let nodes: Vec<Value> = (0..20_000).map(|_| json!({"mesh": 0})).collect();
        document["scenes"][0]["nodes"] = (0..nodes.len()).collect();
        document["nodes"] = nodes.into();
        // Each of the twenty thousand has two hundred primitives.
        document["meshes"][0]["primitives"] = vec![document["meshes"][0]["primitives"][0].clone(); 200].into();
    });
    assert_says(error.unwrap_err(), &["the mesh would take more than"]);
}

#[test]
fn a_sparse_accessor_replaces_some_elements() {
    let square = square();
    let mut document = document(&square, None);
    let start = 12 * square.vertices.len() + 4 * 6;
    document["bufferViews"].as_array_mut().unwrap().extend([
        json!({"buffer": 0, "byteOffset": start, "byteLength": 1}),
        json!({"buffer": 0, "byteOffset": start + 1, "byteLength": 12}),
    ]);
    document["accessors"][0]["sparse"] =
        json!({"count": 1, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 3}});
    document["buffers"][0]["byteLength"] = (start + 13).into();
    let mut bytes = buffer(&square);
    bytes.push(2);
    [5.0_f32, 6.0, 7.0].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
    assert_eq!(corners(&read(&document, &bytes).unwrap())[0][2], [5.0, 6.0, 7.0]);
    bytes[start] = 4;
    assert!(read(&document, &bytes).unwrap_err().to_string().contains("replaces its element 4"));
    document["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    document["accessors"][0]["count"] = u64::MAX.into();
    assert!(read(&document, &bytes).unwrap_err().to_string().contains("more than the file can hold"));
}

#[test]
fn buffers_beside_the_file_are_read_also_with_escaped_names_and_never_more_than_stated() {
    let directory = tempfile::tempdir().unwrap();
    let square = square();
    std::fs::write(directory.path().join("a b.bin"), buffer(&square)).unwrap();
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n";
    std::fs::write(directory.path().join("pointer.bin"), pointer).unwrap();
    let mut document = document(&square, Some("a%20b.bin".into()));
    let path = directory.path().join("cup.gltf");
    let read = |document: &Value| {
        std::fs::write(&path, serde_json::to_vec(document).unwrap()).unwrap();
        palpate_simulator::mesh::file::read(&path).map(|contents| contents.mesh)
    };
    assert_eq!(corners(&read(&document).unwrap()), corners(&square));
    for (uri, expected) in [
        ("gone.bin", "gone.bin: cannot read the buffer of a glTF file"),
        (".", "buffers[0] of"),
        ("../../../../../../../../../dev/zero", "but the file has 0"),
        ("pointer.bin", "pointer.bin: this is a pointer of Git LFS"),
    ] {
        document["buffers"][0]["uri"] = uri.into();
        assert_says(read(&document).unwrap_err(), &[expected]);
    }
}

#[test]
fn a_document_of_version_1_is_called_that_and_not_damaged() {
    let document = json!({
        "asset": {"generator": "collada2gltf", "version": "1.0"},
        "accessors": {"accessor_1": {"bufferView": "view_1", "componentType": 5123, "count": 3, "type": "SCALAR"}},
        "meshes": {"mesh_1": {"primitives": [{"attributes": {"POSITION": "accessor_2"}, "mode": 4}]}},
    });
    let error = parse(document.to_string().as_bytes(), Path::new("cup.gltf")).unwrap_err().to_string();
    assert_eq!(error, "cup.gltf: glTF of version 1.0 is not read. Export it as glTF 2.0.");
}

#[test]
fn chunks_that_do_not_fit_are_refused_with_their_byte() {
    let whole = crate::samples::glb(&square());
    let complaint = |bytes: &[u8]| parse(bytes, Path::new("cup.glb")).unwrap_err().to_string();
    let cut = complaint(&whole[..whole.len() - 4]);
    assert_says(cut, &["cup.glb: byte 8: the GLB file is damaged: it states a length"]);
    for (place, value, expected) in
        [(4, 1, "glTF of version 1"), (12, 1 << 30, "goes beyond its end"), (16, 0, "first chunk is not JSON")]
    {
        let mut bytes = whole.clone();
        bytes[place..place + 4].copy_from_slice(&(value as u32).to_le_bytes());
        assert!(complaint(&bytes).contains(expected), "{}", complaint(&bytes));
    }
    let mut bytes = whole.clone();
    bytes[20] = b'!';
    assert!(complaint(&bytes).contains("cup.glb: byte 20: the glTF file"), "{}", complaint(&bytes));
    let text = parse(b"{\n\"asset\": 1}", Path::new("cup.gltf")).unwrap_err().to_string();
    assert!(text.starts_with("cup.gltf:2: the glTF file is damaged: invalid type"), "{text}");
    let deep = parse("[".repeat(100_000).as_bytes(), Path::new("cup.gltf"));
    assert!(deep.is_err());
}
