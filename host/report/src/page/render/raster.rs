//! Triangles to shaded pixels.

use super::viewpoint::Viewpoint;
use glam::{Vec2, Vec3};
use palpate::mesh::Mesh;

/// Samples per pixel, each way.
const SAMPLES: u32 = 3;
/// Faces that meet at less than this share a smooth normal: the cosine of 40°.
const CREASE: f32 = 0.766;

/// A square picture of one mesh: brightness and coverage.
pub(super) struct Raster {
    /// Its width and height in pixels.
    pub(super) size: u32,
    /// Brightness and coverage of each pixel, row by row from the top, both 0 to 1.
    pub(super) pixels: Vec<(f32, f32)>,
}

/// Draws `mesh` as large as the picture holds, with a small margin.
pub(super) fn render(mesh: &Mesh, size: u32, view: Viewpoint) -> Raster {
    let wide = size * SAMPLES;
    let placed: Vec<Vec3> = mesh.vertices.iter().map(|&v| view.turn * Vec3::from(v)).collect();
    let finite = placed.iter().copied().filter(|v| v.is_finite());
    let [low, high] =
        finite.map(|v| [v, v]).reduce(|[low, high], [v, _]| [low.min(v), high.max(v)]).unwrap_or([Vec3::ZERO; 2]);
    let extent = (high - low).truncate().max_element();
    let mut nearest = vec![(f32::NEG_INFINITY, Vec3::ZERO); (wide as usize).pow(2)];
    if extent > 0.0 {
        let scale = 0.92 * wide as f32 / extent;
        let middle = (low + high) / 2.0;
        let half = wide as f32 / 2.0;
        let screen: Vec<Vec3> = placed
            .iter()
            .map(|&v| {
                let p = (v - middle) * scale;
                Vec3::new(half + p.x, half - p.y, p.z)
            })
            .collect();
        let normals = normals(mesh, &placed);
        for (triangle, normals) in mesh.triangles.iter().zip(&normals) {
            fill(&mut nearest, wide, triangle.map(|i| screen[i as usize]), normals);
        }
    }
    Raster { size, pixels: resolve(&nearest, wide, size) }
}

/// The normal of each triangle's corners: the mean over the faces around the vertex that are not beyond a crease.
fn normals(mesh: &Mesh, placed: &[Vec3]) -> Vec<[Vec3; 3]> {
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); placed.len()];
    let faces: Vec<Vec3> = (0..)
        .zip(&mesh.triangles)
        .map(|(face, &[a, b, c])| {
            [a, b, c].iter().for_each(|&i| around[i as usize].push(face));
            let [a, b, c] = [a, b, c].map(|i| placed[i as usize]);
            (b - a).cross(c - a)
        })
        .collect();
    mesh.triangles
        .iter()
        .zip(&faces)
        .map(|(triangle, face)| {
            let own = face.normalize_or_zero();
            triangle.map(|i| {
                let near = around[i as usize].iter().map(|&f| faces[f as usize]);
                let sum: Vec3 = near.filter(|n| n.normalize_or_zero().dot(own) > CREASE).sum();
                (own * 1e-6 + sum).normalize_or_zero()
            })
        })
        .collect()
}

/// Writes depth and normal of a triangle where it is the nearest so far.
fn fill(nearest: &mut [(f32, Vec3)], wide: u32, corners: [Vec3; 3], normals: &[Vec3; 3]) {
    let [a, b, c] = corners;
    let area = (b - a).truncate().perp_dot((c - a).truncate());
    if area == 0.0 || !area.is_finite() {
        return;
    }
    let low = a.min(b).min(c).truncate().floor().max(Vec2::ZERO);
    let high = a.max(b).max(c).truncate().ceil().min(Vec2::splat(wide as f32 - 1.0));
    for y in low.y as u32..=high.y as u32 {
        for x in low.x as u32..=high.x as u32 {
            let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let u = (c - b).truncate().perp_dot(p - b.truncate()) / area;
            let v = (a - c).truncate().perp_dot(p - c.truncate()) / area;
            let w = 1.0 - u - v;
            if u < 0.0 || v < 0.0 || w < 0.0 {
                continue;
            }
            let depth = u * a.z + v * b.z + w * c.z;
            let sample = &mut nearest[(y * wide + x) as usize];
            if depth > sample.0 {
                *sample = (depth, u * normals[0] + v * normals[1] + w * normals[2]);
            }
        }
    }
}

/// Shades the samples and averages them to pixels.
fn resolve(nearest: &[(f32, Vec3)], wide: u32, size: u32) -> Vec<(f32, f32)> {
    let at = |x: u32, y: u32| nearest[(y * wide + x) as usize];
    (0..size * size)
        .map(|pixel| {
            let (left, top) = (pixel % size * SAMPLES, pixel / size * SAMPLES);
            let (mut light, mut hits) = (0.0, 0.0);
            for y in top..top + SAMPLES {
                for x in left..left + SAMPLES {
                    let (depth, normal) = at(x, y);
                    if depth > f32::NEG_INFINITY {
                        light += shade(normal.normalize_or_zero()) * openness(nearest, wide, x, y, depth);
                        hits += 1.0;
                    }
                }
            }
            let coverage = hits / (SAMPLES * SAMPLES) as f32;
            (if hits > 0.0 { light / hits } else { 0.0 }, coverage)
        })
        .collect()
}

/// Brightness of a surface with this normal, in the viewer's axes: a soft key light, a weak fill, a highlight.
fn shade(normal: Vec3) -> f32 {
    let key = Vec3::new(-0.45, 0.68, 0.58);
    let fill = Vec3::new(0.75, -0.1, 0.65);
    let half = (key + Vec3::Z).normalize_or_zero();
    let diffuse = (normal.dot(key) * 0.5 + 0.5).max(0.0).powi(2);
    let gloss = normal.dot(half).max(0.0).powi(40);
    0.1 + 0.62 * diffuse + 0.14 * normal.dot(fill).max(0.0) + 0.2 * gloss
}

/// Share of the sky that a sample sees, judged from the depths around it: dark in grooves and at the foot of steps.
fn openness(nearest: &[(f32, Vec3)], wide: u32, x: u32, y: u32, depth: f32) -> f32 {
    let mut hidden = 0.0;
    let mut count = 0.0;
    for radius in [wide as f32 * 0.006, wide as f32 * 0.016] {
        for (dx, dy) in
            [(1.0, 0.0), (0.7, 0.7), (0.0, 1.0), (-0.7, 0.7), (-1.0, 0.0), (-0.7, -0.7), (0.0, -1.0), (0.7, -0.7)]
        {
            let (nx, ny) = (x as f32 + dx * radius, y as f32 + dy * radius);
            count += 1.0;
            if nx >= 0.0 && ny >= 0.0 && nx < wide as f32 && ny < wide as f32 {
                let step = nearest[(ny as u32 * wide + nx as u32) as usize].0 - depth;
                if step.is_finite() {
                    hidden += (step / radius - 0.4).clamp(0.0, 1.0);
                }
            }
        }
    }
    1.0 - 0.75 * hidden / count
}
