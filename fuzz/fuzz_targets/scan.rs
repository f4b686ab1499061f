//! Any bytes offered as a scan of any kind, depth images with poses included, give an error that names a file, or a closed
//! surface that can be touched.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::mesh::facts::Facts;
use palpate::mesh::file;
use palpate::probe::Scene;
use std::fs;
use std::io::BufWriter;
use std::path::Path;

/// A depth image in gray with 16 bits; pixels that `bytes` do not reach are 0.
fn write_image(path: &Path, width: u32, bytes: &[u8]) {
    let height = (bytes.len() as u32 / 2).div_ceil(width).max(1);
    let mut pixels = bytes.to_vec();
    pixels.resize(2 * (width * height) as usize, 0);
    let mut encoder = png::Encoder::new(BufWriter::new(fs::File::create(path).unwrap()), width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
}

/// Offers `list` as `scene_camera.json`, with two images of half of `pixels`.
fn of_images(list: &[u8], width: u32, pixels: &[u8]) -> palpate::Result<file::Contents> {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("depth")).unwrap();
    for (number, half) in pixels.chunks(pixels.len().div_ceil(2).max(1)).enumerate() {
        write_image(&folder.path().join(format!("depth/{number:06}.png")), width, half);
    }
    let path = folder.path().join("scene_camera.json");
    fs::write(&path, list).unwrap();
    file::read(&path)
}

fuzz_target!(|bytes: &[u8]| {
    // The first byte chooses the kind.
    let Some((&first, bytes)) = bytes.split_first() else { return };
    let parsed = match first % 4 {
        0 => file::parse(bytes, Path::new("fuzz.xyz")),
        1 => file::parse(bytes, Path::new("fuzz.pcd")),
        2 => file::parse(bytes, Path::new("fuzz.ply")),
        _ => {
            // The images follow the list's last brace.
            let end = bytes.iter().rposition(|byte| *byte == b'}').map_or(0, |last| last + 1);
            of_images(&bytes[..end], 1 + u32::from(first / 4), &bytes[end..])
        }
    };
    match parsed {
        Err(error) => assert!(
            ["fuzz.", "scene_camera.json", ".png"].iter().any(|name| error.to_string().contains(name)),
            "{error}"
        ),
        Ok(contents) if contents.points.is_empty() => {}
        Ok(contents) => {
            let mesh = contents.mesh;
            assert!(mesh.vertices.iter().flatten().all(|coordinate| coordinate.is_finite()));
            let facts = Facts::of(&mesh);
            assert_eq!(facts.open_edges, 0);
            Scene::new(&mesh, 10.0).expect("a surface has an extent");
        }
    }
});
