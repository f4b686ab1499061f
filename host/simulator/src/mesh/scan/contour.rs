//! A level of a field as triangles, by marching tetrahedra: a closed surface on which each edge belongs to two triangles.

use super::field::Field;
use crate::mesh::Mesh;
use glam::DVec3;
use std::collections::HashMap;

/// The corners of the six tetrahedra of a cell, which share its diagonal; a corner's bits are its steps along x, y and z.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// The surface on which the field has its level, with larger values inside.
pub(super) fn contour(field: &Field) -> Mesh {
    let grid = field.grid();
    let [width, height, depth] = grid.0;
    let steps = grid.steps();
    let offset = |corner: usize| (corner & 1) * steps[0] + (corner >> 1 & 1) * steps[1] + (corner >> 2) * steps[2];
    let place = |node: usize| {
        DVec3::new((node % width) as f64, (node / width % height) as f64, (node / (width * height)) as f64)
    };
    let mut mesh = Mesh::default();
    let mut places: Vec<DVec3> = Vec::new();
    let mut known: HashMap<(usize, usize), u32> = HashMap::new();
    for k in 0..depth - 1 {
        // Edges below this layer of cells do not come again.
        known.retain(|&(node, _), _| node >= k * width * height);
        for j in 0..height - 1 {
            for i in 0..width - 1 {
                let first = i + width * (j + height * k);
                let is_inside = |corner: usize| field.values[first + offset(corner)] > field.level;
                let inside = (0..8).filter(|&corner| is_inside(corner)).count();
                if inside == 0 || inside == 8 {
                    continue;
                }
                for tetrahedron in TETRAHEDRA {
                    let (within, without): (Vec<usize>, Vec<usize>) =
                        tetrahedron.into_iter().partition(|&corner| is_inside(corner));
                    let mut crossing = |inner: usize, outer: usize| {
                        let [inner, outer] = [inner, outer].map(|corner| first + offset(corner));
                        *known.entry((inner.min(outer), inner.max(outer))).or_insert_with(|| {
                            let [above, below] = [inner, outer].map(|node| f64::from(field.values[node]));
                            // Never at a node itself, where vertices of several edges would be one.
                            let share = ((above - f64::from(field.level)) / (above - below)).clamp(0.02, 0.98);
                            places.push(place(inner).lerp(place(outer), share));
                            places.len() as u32 - 1
                        })
                    };
                    let corners: Vec<u32> = match (within.as_slice(), without.as_slice()) {
                        (&[a], &[b, c, d]) => vec![crossing(a, b), crossing(a, c), crossing(a, d)],
                        (&[b, c, d], &[a]) => vec![crossing(b, a), crossing(c, a), crossing(d, a)],
                        (&[a, b], &[c, d]) => vec![crossing(a, c), crossing(a, d), crossing(b, d), crossing(b, c)],
                        _ => continue,
                    };
                    let outward = place(first + offset(without[0])) - place(first + offset(within[0]));
                    for second in 1..corners.len() - 1 {
                        let triangle = [corners[0], corners[second], corners[second + 1]];
                        let [a, b, c] = triangle.map(|corner| places[corner as usize]);
                        let is_outward = (b - a).cross(c - a).dot(outward) > 0.0;
                        mesh.triangles.push(if is_outward {
                            triangle
                        } else {
                            [triangle[0], triangle[2], triangle[1]]
                        });
                    }
                }
            }
        }
    }
    mesh.vertices = places.into_iter().map(|cells| field.place(cells).as_vec3().to_array()).collect();
    mesh
}
