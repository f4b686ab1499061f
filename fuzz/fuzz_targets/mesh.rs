//! Any bytes offered as a mesh file of any kind give an error that names it, or a mesh whose indices are in range, and take
//! memory in proportion to their length; a mesh can be touched, and facts can be said about it.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::glam::DVec3;
use palpate::mesh::facts::Facts;
use palpate::mesh::file::{self, EXTENSIONS};
use palpate::probe::Scene;
use peak_alloc::PeakAlloc;
use std::path::Path;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The memory that any file may take, and how much more for each of its bytes.
const BASE: usize = 1 << 20;
const EACH: usize = 256;

fuzz_target!(|bytes: &[u8]| {
    // The first byte chooses the name: it counts where the content says nothing.
    let Some((&first, bytes)) = bytes.split_first() else { return };
    let name = format!("fuzz.{}", EXTENSIONS[usize::from(first) % EXTENSIONS.len()]);
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let parsed = file::parse(bytes, Path::new(&name));
    let taken = MEMORY.peak_usage() - before;
    assert!(taken <= BASE + EACH * bytes.len(), "{taken} bytes of memory for {} bytes of file", bytes.len());
    if let Err(error) = &parsed {
        assert!(error.to_string().starts_with("fuzz."), "{error}");
    }
    if let Ok(contents) = parsed {
        let mesh = contents.mesh;
        assert!(mesh.triangles.iter().flatten().all(|&index| (index as usize) < mesh.vertices.len()));
        assert!(mesh.vertices.iter().flatten().all(|coordinate| coordinate.is_finite()));
        let facts = Facts::of(&mesh);
        assert_eq!(facts.triangles, mesh.triangles.len());
        let _ = facts.complaints(contents.millimeters);
        let scene = Scene::new(&mesh, 10.0).expect("a mesh that was read has an extent");
        for corner in scene.triangles().take(4).flatten() {
            // Aimed at a corner, a sphere touches that or something before it.
            let start = DVec3::new(9.0, 8.0, 7.0);
            let time = scene.first_contact(start, corner - start, 0.15);
            assert!(time.is_some_and(|time| (0.0..=1.0).contains(&time)), "{corner}: {time:?}");
        }
    }
});
