//! Any bytes offered as an OBJ file give an error that names it, or a mesh whose indices are in range, and take memory in
//! proportion to their length; a mesh can be touched.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::glam::DVec3;
use palpate::mesh::facts::Facts;
use palpate::mesh::obj;
use palpate::probe::Scene;
use peak_alloc::PeakAlloc;
use std::path::Path;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The memory that any text may take, and how much more for each of its bytes: a vertex of a polygon is two bytes of text,
/// and in memory an index, a corner, a node of the ear clipping, each in a growing vector.
const BASE: usize = 1 << 20;
const EACH: usize = 256;

fuzz_target!(|bytes: &[u8]| {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let parsed = obj::parse(bytes, Path::new("fuzz.obj"));
    let taken = MEMORY.peak_usage() - before;
    assert!(taken <= BASE + EACH * bytes.len(), "{taken} bytes of memory for {} bytes of text", bytes.len());
    if let Err(error) = &parsed {
        assert!(error.to_string().starts_with("fuzz.obj:"), "{error}");
    }
    if let Ok(mesh) = parsed {
        assert!(mesh.triangles.iter().flatten().all(|&index| (index as usize) < mesh.vertices.len()));
        assert!(mesh.vertices.iter().flatten().all(|coordinate| coordinate.is_finite()));
        let facts = Facts::of(&mesh);
        assert_eq!(facts.triangles, mesh.triangles.len());
        let scene = Scene::new(&mesh, 10.0).expect("a mesh that was read has an extent");
        for corner in scene.triangles().take(4).flatten() {
            // Aimed at a corner, a sphere touches that or something before it.
            let start = DVec3::new(9.0, 8.0, 7.0);
            let time = scene.first_contact(start, corner - start, 0.15);
            assert!(time.is_some_and(|time| (0.0..=1.0).contains(&time)), "{corner}: {time:?}");
        }
        let mut text = Vec::new();
        obj::write(&mesh, &mut text).expect("memory takes it");
        let again = obj::parse(text.as_slice(), Path::new("again.obj")).expect("what was written can be read");
        assert_eq!(again.triangles.len(), mesh.triangles.len());
    }
});
