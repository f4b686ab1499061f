//! The connected parts of a mesh, and whether each is closed and right side out.

use crate::mesh::Mesh;
use glam::{DVec3, Vec3};

/// Triangles that hang together by edges that exactly two of them share.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Part {
    /// Number of triangles.
    pub triangles: usize,
    /// The lowest corner of its bounding box, in the units of the file.
    pub low: Vec3,
    /// The highest corner of its bounding box.
    pub high: Vec3,
    /// Edges that belong to one triangle only, in the whole mesh.
    pub open_edges: usize,
    /// Edges whose two triangles face opposite sides.
    pub contrary_edges: usize,
    /// True if each edge belongs to an even number of its triangles.
    pub is_closed: bool,
    /// The volume that it encloses, negative if its triangles face inward; meaningless if it is open.
    pub volume: f64,
    /// True if it is closed and its triangles face inward, although it is not a cavity of another part.
    pub is_inside_out: bool,
}

impl Part {
    /// True if it encloses something, its triangles all facing one side.
    fn is_solid(&self) -> bool {
        // Less is a sheet with two sides, or the rounding of one.
        let size = f64::from((self.high - self.low).max_element());
        self.is_closed && self.contrary_edges == 0 && self.volume.abs() > 1e-12 * size * size * size
    }
}

/// Largest number of tests of rays against triangles that distinguish cavities from parts that are inside out, which take
/// about a second. Beyond it, a part that faces inward counts as a cavity of each part whose box encloses its own.
const MAX_TESTS: usize = 100_000_000;

/// Number of vertices of a part that must be inside another part for it to be a cavity.
const SAMPLES: usize = 64;

/// The parts of a welded mesh, the largest first, and how many edges three or more of its triangles share.
pub(super) fn parts(mesh: &Mesh) -> (Vec<Part>, usize) {
    let Mesh { vertices, triangles } = mesh;
    // Each edge of each triangle: its ends, the lower one first, the triangle, whether it runs from the lower one.
    let mut edges: Vec<(u32, u32, u32, bool)> = (0..)
        .zip(triangles)
        .flat_map(|(index, &[a, b, c])| [(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b), index, a < b)))
        .collect();
    edges.sort_unstable();
    let mut sets = Sets::new(triangles.len());
    for uses in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        if let [first, second] = uses {
            sets.join(first.2, second.2);
        }
    }
    let (numbers, count) = sets.numbers();
    let empty = Part {
        triangles: 0,
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
        open_edges: 0,
        contrary_edges: 0,
        is_closed: true,
        volume: 0.0,
        is_inside_out: false,
    };
    let mut parts = vec![empty; count];
    // From a corner of the box, so that a mesh far from its origin loses no digits.
    let [low, _] = mesh.bounds();
    let corner = |i: u32| -> DVec3 { (Vec3::from(vertices[i as usize]) - low).as_dvec3() };
    for (triangle, &number) in triangles.iter().zip(&numbers) {
        let part = &mut parts[number];
        part.triangles += 1;
        for vertex in triangle.map(|i| Vec3::from(vertices[i as usize])) {
            (part.low, part.high) = (part.low.min(vertex), part.high.max(vertex));
        }
        let [a, b, c] = triangle.map(corner);
        part.volume += a.dot(b.cross(c)) / 6.0;
    }
    let mut branching_edges = 0;
    for uses in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        match uses {
            [only] => {
                let part = &mut parts[numbers[only.2 as usize]];
                part.open_edges += 1;
                part.is_closed = false;
            }
            [first, second] if first.3 == second.3 => parts[numbers[first.2 as usize]].contrary_edges += 1,
            [_, _] => {}
            uses => {
                branching_edges += 1;
                let uses_by = |part: usize| uses.iter().filter(|edge| numbers[edge.2 as usize] == part).count();
                // Three to a few: a part goes on across the edge if it has two of its triangles there.
                for part in uses.iter().take(16).map(|edge| numbers[edge.2 as usize]) {
                    parts[part].is_closed &= uses_by(part) % 2 == 0;
                }
            }
        }
    }
    find_inside_out(&mut parts, &numbers, mesh);
    parts.sort_by_key(|part| std::cmp::Reverse(part.triangles));
    (parts, branching_edges)
}

/// Marks the parts that are inside out. A part that faces inward and lies inside another one is a cavity of it.
fn find_inside_out(parts: &mut [Part], numbers: &[usize], mesh: &Mesh) {
    let solid = |sign: f64| -> Vec<usize> {
        (0..parts.len()).filter(|&number| parts[number].is_solid() && sign * parts[number].volume > 0.0).collect()
    };
    let (inward, outward) = (solid(-1.0), solid(1.0));
    let mut tests_left = MAX_TESTS;
    for number in inward {
        let Some(left) = tests_left.checked_sub(outward.len()) else { return };
        tests_left = left;
        let part = &parts[number];
        let encloses = |other: &Part| other.low.cmple(part.low).all() && part.high.cmple(other.high).all();
        let candidates: Vec<usize> = outward.iter().copied().filter(|&other| encloses(&parts[other])).collect();
        let samples = if candidates.is_empty() { Vec::new() } else { samples(number, numbers, mesh) };
        let is_cavity = candidates.into_iter().any(|other| {
            let cost = samples.len() * mesh.triangles.len();
            if cost > tests_left {
                // Too many tests: the box decides.
                return true;
            }
            tests_left -= cost;
            samples.iter().all(|&sample| is_inside(sample, other, numbers, mesh))
        });
        parts[number].is_inside_out = !is_cavity;
    }
}

/// Some vertices of a part, evenly spread over its triangles.
fn samples(number: usize, numbers: &[usize], mesh: &Mesh) -> Vec<DVec3> {
    let of_part = mesh.triangles.iter().zip(numbers).filter(|(_, part)| **part == number);
    let triangles: Vec<&[u32; 3]> = of_part.map(|(triangle, _)| triangle).collect();
    let step = triangles.len().div_ceil(SAMPLES).max(1);
    triangles.into_iter().step_by(step).map(|&[a, ..]| Vec3::from(mesh.vertices[a as usize]).as_dvec3()).collect()
}

/// True if a point is inside a closed part: a ray leaves it more often than it enters it.
fn is_inside(point: DVec3, part: usize, numbers: &[usize], mesh: &Mesh) -> bool {
    // A direction that no edge of a modeled object is likely to have.
    let direction = DVec3::new(0.836_516_303_737_8, 0.482_962_913_144_5, 0.258_819_045_102_5);
    let mut crossings = 0;
    for (triangle, _) in mesh.triangles.iter().zip(numbers).filter(|(_, number)| **number == part) {
        let [a, b, c] = triangle.map(|i| Vec3::from(mesh.vertices[i as usize]).as_dvec3() - point);
        // The ray passes the triangle if it has all edges on one side.
        let sides = [a.cross(b), b.cross(c), c.cross(a)].map(|normal| normal.dot(direction));
        let volume = a.dot(b.cross(c));
        if sides.iter().all(|&side| side > 0.0) && volume > 0.0 {
            crossings += 1;
        } else if sides.iter().all(|&side| side < 0.0) && volume < 0.0 {
            crossings -= 1;
        }
    }
    crossings > 0
}

/// Sets of connected triangles: each refers to another one of its set, the first to itself.
pub(super) struct Sets(Vec<u32>);

impl Sets {
    pub(super) fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// The first triangle of a triangle's set.
    fn first(&mut self, mut triangle: u32) -> u32 {
        while self.0[triangle as usize] != triangle {
            let parent = self.0[triangle as usize];
            self.0[triangle as usize] = self.0[parent as usize];
            triangle = parent;
        }
        triangle
    }

    /// Unites the sets of two triangles.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.first(a), self.first(b));
        // The lower one stays first, so that numbers follow the order of the triangles.
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// For each triangle the number of its set, and the number of sets.
    pub(super) fn numbers(mut self) -> (Vec<usize>, usize) {
        let mut numbers = vec![0; self.0.len()];
        let mut count = 0;
        for index in 0..numbers.len() {
            let first = self.first(index as u32) as usize;
            if first == index {
                numbers[index] = count;
                count += 1;
            } else {
                numbers[index] = numbers[first];
            }
        }
        (numbers, count)
    }
}
