//! Meshes, what holds of them, one mesh in every format, and damage to files.

use base64::Engine;
use glam::Vec3;
use palpate_simulator::mesh::{Mesh, obj};
use rand::{Rng, RngExt, SeedableRng};
use serde_ply::PlyFormat;
use std::collections::HashMap;
use std::fmt::Write as _;

/// A box, closed and right side out.
pub(crate) fn cuboid(sides: [f32; 3]) -> Mesh {
    let vertices =
        (0..8_u32).map(|i| std::array::from_fn(|axis| if i >> axis & 1 == 1 { sides[axis] } else { 0.0 })).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Mesh { vertices, triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect() }
}

/// The signed volume, in cubic centimeters: positive if the triangles are anticlockwise seen from outside.
pub(crate) fn volume(mesh: &Mesh) -> f64 {
    let at = |i: u32| Vec3::from(mesh.vertices[i as usize]).as_dvec3();
    mesh.triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))) / 6.0).sum()
}

/// Number of times that every directed edge occurs.
fn edges(mesh: &Mesh) -> HashMap<(u32, u32), usize> {
    let mut count = HashMap::new();
    for &[a, b, c] in &mesh.triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *count.entry(edge).or_insert(0) += 1;
        }
    }
    count
}

/// Checks that every edge is shared by two triangles that agree which side is out.
pub(crate) fn assert_closed(name: &str, mesh: &Mesh) {
    let edges = edges(mesh);
    for (&(a, b), &count) in &edges {
        assert_ne!(a, b, "{name}: a triangle uses a vertex twice");
        assert_eq!(count, 1, "{name}: an edge is used {count} times in one direction");
        assert_eq!(edges.get(&(b, a)), Some(&1), "{name}: an edge has no opposite");
    }
    assert!(mesh.vertices.iter().flatten().all(|x| x.is_finite()), "{name}: a vertex is not finite");
}

/// The mesh in every kind of file, each under a name.
pub(crate) fn all(mesh: &Mesh) -> Vec<(&'static str, Vec<u8>)> {
    let mut text = Vec::new();
    obj::write(mesh, &mut text).unwrap();
    vec![
        ("cup.obj", text),
        ("cup.stl", stl_binary(mesh)),
        ("text.stl", stl_text(mesh).into_bytes()),
        ("text.ply", ply(mesh, PlyFormat::Ascii)),
        ("little.ply", ply(mesh, PlyFormat::BinaryLittleEndian)),
        ("big.ply", ply(mesh, PlyFormat::BinaryBigEndian)),
        ("cup.gltf", gltf(mesh)),
        ("cup.glb", glb(mesh)),
        ("cup.dae", collada(mesh).into_bytes()),
    ]
}

/// The triangles' corners, in the order of the file.
pub(crate) fn corners(mesh: &Mesh) -> Vec<[[f32; 3]; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|i| mesh.vertices[i as usize])).collect()
}

pub(crate) fn stl_binary(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = [b"solid a header that lies".to_vec(), vec![0; 56]].concat();
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in corners(mesh) {
        bytes.extend([0; 12]);
        triangle.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([7, 0]);
    }
    bytes
}

/// Two solids, of half the triangles each.
pub(crate) fn stl_text(mesh: &Mesh) -> String {
    let mut text = String::new();
    let corners = corners(mesh);
    for (name, half) in [("solid", &corners[..corners.len() / 2]), ("SOLID the rest", &corners[corners.len() / 2..])] {
        writeln!(text, "{name}").unwrap();
        for triangle in half {
            text += " facet normal 0 nan 1e0\n  outer loop\n";
            triangle.iter().for_each(|[x, y, z]| writeln!(text, "   vertex {x} {y} {z}").unwrap());
            text += "  endloop\n endfacet\n";
        }
        text += "endsolid\n";
    }
    text
}

pub(crate) fn ply(mesh: &Mesh, format: PlyFormat) -> Vec<u8> {
    let (vertices, faces) = (mesh.vertices.len(), mesh.triangles.len());
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment by hand\nelement material 1\nproperty list uchar uchar name\n\
         element vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
         element face {faces}\nproperty ushort flags\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    if format == PlyFormat::Ascii {
        bytes.extend(b"2 9 9\n");
        mesh.vertices.iter().for_each(|[x, y, z]| bytes.extend(format!("{x} {y} {z} 255\n").bytes()));
        mesh.triangles.iter().for_each(|[a, b, c]| bytes.extend(format!("0 3 {a} {b} {c}\n").bytes()));
        // No end of the last line.
        bytes.pop();
        return bytes;
    }
    let little = format == PlyFormat::BinaryLittleEndian;
    let word = |word: u32| if little { word.to_le_bytes() } else { word.to_be_bytes() };
    bytes.extend([2, 9, 9]);
    for vertex in &mesh.vertices {
        vertex.iter().for_each(|x| bytes.extend(word(x.to_bits())));
        bytes.push(255);
    }
    for triangle in &mesh.triangles {
        bytes.extend([0, 0, 3]);
        triangle.iter().for_each(|&index| bytes.extend(word(index)));
    }
    bytes
}

/// The vertices, then the indices, as they stand in a buffer of glTF.
pub(crate) fn buffer(mesh: &Mesh) -> Vec<u8> {
    let vertices = mesh.vertices.iter().flatten().flat_map(|x| x.to_le_bytes());
    vertices.chain(mesh.triangles.iter().flatten().flat_map(|index| index.to_le_bytes())).collect()
}

/// A document over that buffer, with this URI or none: half the triangles in one primitive of one mesh, half in another.
pub(crate) fn document(mesh: &Mesh, uri: Option<String>) -> serde_json::Value {
    let (vertices, corners) = (mesh.vertices.len(), 3 * mesh.triangles.len());
    let half = corners / 6 * 3;
    let mut buffer = serde_json::json!({"byteLength": 12 * vertices + 4 * corners});
    if let Some(uri) = uri {
        buffer["uri"] = uri.into();
    }
    serde_json::json!({
        "asset": {"version": "2.0", "generator": "by hand"},
        "extensionsUsed": ["KHR_materials_clearcoat"],
        "extensionsRequired": ["KHR_materials_clearcoat"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"children": [1, 2]}, {"mesh": 0, "name": "one"}, {"mesh": 1}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]},
            {"primitives": [{"attributes": {"POSITION": 0}, "indices": 2, "mode": 4}]}
        ],
        "materials": [{}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": half, "type": "SCALAR"},
            {"bufferView": 1, "byteOffset": 4 * half, "componentType": 5125, "count": corners - half, "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 12 * vertices, "target": 34962},
            {"buffer": 0, "byteOffset": 12 * vertices, "byteLength": 4 * corners}
        ],
        "buffers": [buffer]
    })
}

pub(crate) fn gltf(mesh: &Mesh) -> Vec<u8> {
    let data = base64::engine::general_purpose::STANDARD.encode(buffer(mesh));
    serde_json::to_vec_pretty(&document(mesh, Some(format!("data:application/octet-stream;base64,{data}")))).unwrap()
}

pub(crate) fn glb(mesh: &Mesh) -> Vec<u8> {
    glb_of(&document(mesh, None), &buffer(mesh))
}

/// A GLB file of a document and a buffer.
pub(crate) fn glb_of(document: &serde_json::Value, buffer: &[u8]) -> Vec<u8> {
    let mut json = serde_json::to_vec(document).unwrap();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = buffer.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let word = |word: usize| (word as u32).to_le_bytes();
    let header = [*b"glTF", word(2), word(28 + json.len() + binary.len())].concat();
    let chunks = [&word(json.len()), b"JSON".as_slice(), &json, &word(binary.len()), b"BIN\0", &binary].concat();
    [header, chunks].concat()
}

/// A quarter of the triangles each as triangles, polylist and polygons, and the rest in a nested node.
pub(crate) fn collada(mesh: &Mesh) -> String {
    let numbers = |mut text: String, number: &dyn std::fmt::Display| {
        write!(text, "{number} ").unwrap();
        text
    };
    let places = mesh.vertices.iter().flatten().fold(String::new(), |text, x| numbers(text, x));
    let quarter = mesh.triangles.len().div_ceil(4);
    let mut quarters = mesh.triangles.chunks(quarter);
    // Each corner has a vertex and a normal.
    let mut indices = |kind: &str| {
        let faces = quarters.next().unwrap_or_default();
        let input = "<input semantic=\"NORMAL\" source=\"#gone\" offset=\"0\"/><input semantic=\"VERTEX\" source=\"#v\" offset=\"1\"/>";
        let list = |faces: &[[u32; 3]]| {
            faces.iter().flatten().fold(String::new(), |text, index| text + &format!("0 {index} "))
        };
        let inside = match kind {
            "polygons" => faces.iter().map(|face| format!("<p>{}</p>", list(&[*face]))).collect(),
            "polylist" => format!("<vcount>{}</vcount><p>{}</p>", "3 ".repeat(faces.len()), list(faces)),
            _ => format!("<p>{}</p>", list(faces)),
        };
        format!("<{kind} count=\"{}\">{input}{inside}</{kind}>\n", faces.len())
    };
    let first = ["triangles", "polylist", "polygons"].map(&mut indices).concat();
    let second = indices("triangles");
    let count = mesh.vertices.len();
    let source = |id: &str| {
        format!(
            "<source id=\"s{id}\"><float_array id=\"a{id}\" count=\"{}\">{places}</float_array>\
             <technique_common><accessor source=\"#a{id}\" count=\"{count}\" stride=\"3\"><param name=\"X\" type=\"float\"/>\
             <param name=\"Y\" type=\"float\"/><param name=\"Z\" type=\"float\"/></accessor></technique_common></source>\
             <vertices id=\"{id}\"><input semantic=\"POSITION\" source=\"#s{id}\"/></vertices>\n",
            3 * count
        )
    };
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n\
         <COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\">\n\
         <asset><unit name=\"inch\" meter=\"0.0254\"/><up_axis>Z_UP</up_axis></asset>\n\
         <library_geometries><geometry id=\"g\"><mesh>{}{first}</mesh></geometry>\n\
         <geometry id=\"h\"><mesh>{}{}</mesh></geometry></library_geometries>\n\
         <library_nodes><node id=\"n\"><node><instance_geometry url=\"#h\"/></node></node></library_nodes>\n\
         <library_visual_scenes><visual_scene id=\"scene\"><node><instance_geometry url=\"#g\"/>\
         <translate>1 2 3</translate><translate>-1 -2 -3</translate><instance_node url=\"#n\"/></node></visual_scene>\n\
         </library_visual_scenes><scene><instance_visual_scene url=\"#scene\"/></scene></COLLADA>\n",
        source("v"),
        source("w"),
        second.replace("#v", "#w"),
    )
}

/// A file with damage that the seed chooses: bytes changed, removed or repeated, the end cut, a number replaced.
pub(crate) fn damaged(bytes: &[u8], seed: u64) -> Vec<u8> {
    let mut rng = rand::rngs::ChaCha8Rng::seed_from_u64(seed);
    let mut bytes = bytes.to_vec();
    for _ in 0..rng.random_range(1..4) {
        if bytes.is_empty() {
            break;
        }
        // The start of a file says more than the rest.
        let end = if rng.random_bool(0.5) { bytes.len().min(400) } else { bytes.len() };
        let place = rng.random_range(0..end);
        match rng.random_range(0..8) {
            0 => bytes[place] = rng.next_u32() as u8,
            1 => bytes[place] ^= 1 << rng.random_range(0..8),
            2 => bytes.truncate(place),
            3 => drop(bytes.drain(place..(place + rng.random_range(1..60)).min(bytes.len()))),
            4 => {
                let copy = bytes[place..(place + rng.random_range(1..60)).min(bytes.len())].to_vec();
                bytes.splice(place..place, copy);
            }
            5 => {
                let words: [&[u8]; 8] = [
                    b"-1",
                    b"4294967295",
                    b"nan",
                    b"1e39",
                    b"99999999999999999999",
                    b"\xff\xff\xff\xff",
                    b"\0\0\0\0",
                    b"\"",
                ];
                let word = words[rng.random_range(0..words.len())];
                let end = (place + word.len()).min(bytes.len());
                bytes.splice(place..end, word.iter().copied());
            }
            _ => {
                // A digit, where there is one near.
                if let Some(digit) = bytes[place..].iter().position(u8::is_ascii_digit) {
                    bytes[place + digit] = b"0123456789.-"[rng.random_range(0..12)];
                }
            }
        }
    }
    bytes
}
