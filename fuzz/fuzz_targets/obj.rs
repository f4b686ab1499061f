//! Any bytes offered as an OBJ file give an error or a mesh whose indices are in range, finite, and not larger than the
//! file's size accounts for.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::scene::Scene;
use std::path::Path;

fuzz_target!(|bytes: &[u8]| {
    let Ok(mesh) = palpate::obj::parse(bytes, Path::new("fuzz.obj")) else { return };
    // A vertex takes at least `v 0 0 0`, a corner of a face at least two bytes.
    assert!(mesh.vertices.len() <= bytes.len() && mesh.triangles.len() <= bytes.len());
    assert!(mesh.vertices.iter().flatten().all(|coordinate| coordinate.is_finite()));
    assert!(mesh.triangles.iter().flatten().all(|&index| (index as usize) < mesh.vertices.len()));
    let _ = Scene::new(&mesh, 10.0);
});
