//! Packed data of a page: bytes compressed by DEFLATE, and a mesh as few of them.
//!
//! Corners are multiples of a step, so that a vertex is three whole numbers of 16 bits. Vertices stand in the order in
//! which triangles first use them, each as its differences from the one before; an index is how far it lies behind the
//! first vertex that was not used before (the "high-water mark" of Blaze's WebGL loader, 2011). Low and high bytes of all
//! of them stand apart, and the whole is compressed.

use crate::mesh::Mesh;
use miniz_oxide::deflate::compress_to_vec_zlib;
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

/// The most bytes that are unpacked.
const MOST: usize = 1 << 28;

/// The level of compression: the slowest that is not exhaustive.
const LEVEL: u8 = 9;

/// Bytes, compressed.
pub fn compress(bytes: &[u8]) -> Vec<u8> {
    compress_to_vec_zlib(bytes, LEVEL)
}

/// The bytes that [`compress`] was given; `None` for others, or more than 268 MB.
pub fn decompress(bytes: &[u8]) -> Option<Vec<u8>> {
    decompress_to_vec_zlib_with_limit(bytes, MOST).ok()
}

/// Packs vertices, as whole numbers of steps, and the triangles between them. Vertices that no triangle uses are left out.
///
/// # Panics
/// If a triangle names a vertex that does not exist.
pub fn pack(vertices: &[[u16; 3]], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut number = vec![u32::MAX; vertices.len()];
    let mut used: Vec<[u16; 3]> = Vec::new();
    let mut indices = Vec::with_capacity(3 * triangles.len());
    for &index in triangles.iter().flatten() {
        let next = used.len() as u32;
        let number = &mut number[index as usize];
        if *number == u32::MAX {
            *number = next;
            used.push(vertices[index as usize]);
        }
        indices.push(next - *number);
    }
    let mut last = [0_u16; 3];
    let mut steps = Vec::with_capacity(3 * used.len());
    for vertex in &used {
        for axis in 0..3 {
            let difference = vertex[axis].wrapping_sub(last[axis]).cast_signed();
            steps.push(((difference << 1) ^ (difference >> 15)).cast_unsigned());
        }
        last = *vertex;
    }
    let mut bytes = Vec::new();
    bytes.extend((used.len() as u32).to_le_bytes());
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for axis in 0..3 {
        let of_axis = || steps.iter().skip(axis).step_by(3);
        bytes.extend(of_axis().map(|step| step.to_le_bytes()[0]));
        bytes.extend(of_axis().map(|step| step.to_le_bytes()[1]));
    }
    for byte in 0..4 {
        bytes.extend(indices.iter().map(|index| index.to_le_bytes()[byte]));
    }
    compress(&bytes)
}

/// The mesh that was packed, in steps; `None` for bytes that [`pack`] did not write.
pub fn unpack(packed: &[u8]) -> Option<Mesh> {
    let bytes = decompress(packed)?;
    let (counts, rest) = bytes.split_first_chunk::<8>()?;
    let [vertices, triangles] = [0, 4].map(|at| u32::from_le_bytes(std::array::from_fn(|byte| counts[at + byte])));
    let (vertices, indices) = (usize::try_from(vertices).ok()?, usize::try_from(triangles).ok()?.checked_mul(3)?);
    let (steps, planes) = rest.split_at_checked(vertices.checked_mul(6)?)?;
    if planes.len() != indices.checked_mul(4)? {
        return None;
    }
    let mut mesh = Mesh { vertices: Vec::with_capacity(vertices), triangles: Vec::with_capacity(indices / 3) };
    let mut last = [0_u16; 3];
    for vertex in 0..vertices {
        for (axis, value) in last.iter_mut().enumerate() {
            let byte = |high: usize| steps.get((2 * axis + high) * vertices + vertex).copied();
            let step = u16::from_le_bytes([byte(0)?, byte(1)?]);
            *value = value.wrapping_add((step >> 1) ^ (step & 1).wrapping_neg());
        }
        mesh.vertices.push(last.map(f32::from));
    }
    let mut next = 0_u32;
    let mut index = |at: usize| {
        let byte = |plane: usize| planes.get(plane * indices + at).copied();
        let behind = u32::from_le_bytes([byte(0)?, byte(1)?, byte(2)?, byte(3)?]);
        let index = next.checked_sub(behind)?;
        next += u32::from(behind == 0);
        (usize::try_from(index).ok()? < vertices).then_some(index)
    };
    for at in (0..indices).step_by(3) {
        mesh.triangles.push([index(at)?, index(at + 1)?, index(at + 2)?]);
    }
    Some(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn globe() -> (Vec<[u16; 3]>, Vec<[u32; 3]>) {
        let Mesh { vertices, triangles } = Mesh::globe(40);
        (vertices.iter().map(|vertex| vertex.map(|x| ((x + 1.5) * 21_000.0) as u16)).collect(), triangles)
    }

    #[test]
    fn a_mesh_comes_back_triangle_by_triangle_and_takes_less_than_a_third_of_its_bytes() {
        let (vertices, triangles) = globe();
        let packed = pack(&vertices, &triangles);
        assert!(packed.len() * 3 < 6 * vertices.len() + 12 * triangles.len(), "{}", packed.len());
        let mesh = unpack(&packed).unwrap();
        let corners = |mesh: &Mesh| -> Vec<[f32; 3]> {
            mesh.triangles.iter().flatten().map(|&index| mesh.vertices[index as usize]).collect()
        };
        let whole = Mesh { vertices: vertices.iter().map(|vertex| vertex.map(f32::from)).collect(), triangles };
        assert_eq!(corners(&mesh), corners(&whole));
    }

    #[test]
    fn the_largest_steps_and_unused_vertices_are_no_exception() {
        let vertices = [[0; 3], [u16::MAX; 3], [7; 3], [0, u16::MAX, 32_768]];
        let mesh = unpack(&pack(&vertices, &[[3, 1, 0], [0, 1, 3]])).unwrap();
        assert_eq!(mesh.vertices, [[0.0, 65_535.0, 32_768.0], [65_535.0; 3], [0.0; 3]]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 0]]);
    }

    #[test]
    fn bytes_that_are_no_mesh_are_refused() {
        let (vertices, triangles) = globe();
        let packed = pack(&vertices, &triangles);
        for bytes in [&[][..], &packed[..packed.len() / 2], &[0x78, 0xda]] {
            assert_eq!(unpack(bytes), None);
        }
        // Of one triangle and no vertex; of counts that no bytes follow.
        let mut one = [0; 20];
        one[4] = 1;
        for bytes in [&one[..], &[1, 0, 0, 0, 0, 0, 0, 0], &[0xff; 8], &[0xff; 9], &[1]] {
            assert_eq!(unpack(&compress(bytes)), None);
        }
    }
}
