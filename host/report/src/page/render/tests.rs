use super::*;
use crate::small::BOWL;

fn decoded(png: &[u8]) -> (png::OutputInfo, Vec<u8>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut data).unwrap();
    (info, data)
}

#[test]
fn a_thumbnail_is_transparent_around_the_object_and_opaque_on_it() {
    let (info, data) = decoded(&thumbnail(BOWL.mesh(), 64));
    assert_eq!((info.width, info.height, info.color_type), (64, 64, png::ColorType::Rgba));
    let alpha = |x: usize, y: usize| data[(y * 64 + x) * 4 + 3];
    assert_eq!(alpha(0, 0), 0);
    assert_eq!(alpha(32, 32), 255);
}

#[test]
fn a_mesh_that_is_thin_in_any_axis_is_seen_from_its_broad_side() {
    let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0_f32]];
    for axis in 0..3 {
        let vertices = corners.map(|v| std::array::from_fn(|i| v[(i + 2 + 3 - axis) % 3])).to_vec();
        let mesh = Mesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] };
        let (_, data) = decoded(&thumbnail(&mesh, 32));
        let covered = data.chunks(4).filter(|pixel| pixel[3] == 255).count();
        assert!(covered > 32 * 32 / 4, "axis {axis}: {covered} pixels");
    }
}

#[test]
fn meshes_without_extent_give_an_empty_picture() {
    let point = Mesh { vertices: vec![[1.0; 3]; 3], triangles: vec![[0, 1, 2]] };
    for mesh in [Mesh::default(), point] {
        let (_, data) = decoded(&thumbnail(&mesh, 8));
        assert!(data.iter().all(|&byte| byte == 0));
    }
}

#[test]
fn thumbnails_are_small_enough_to_embed_ten_of_them_in_a_page() {
    let camera = palpate::mesh::builtin::one("camera").unwrap();
    let bytes = thumbnail(camera.mesh(), 160).len();
    assert!(bytes < 16_000, "{bytes} bytes");
}
