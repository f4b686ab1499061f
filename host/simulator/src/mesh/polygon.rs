//! Polygons to triangles, concave ones too.

use glam::DVec2;

/// Cuts polygons into triangles.
#[derive(Default)]
pub(super) struct Cutter {
    earcut: Option<earcut::Earcut<f64>>,
    corners: Vec<[f64; 3]>,
    flat: Vec<[f64; 2]>,
    cut: Vec<u32>,
}

/// The most corners of a polygon that is cut corner by corner, which takes time with the square of their number.
const MOST_CORNERS: usize = 4096;

/// Twice the area up to which a triangle is flat within rounding, in a polygon whose coordinates are at most 1.
const FLAT: f64 = 1e-12;

impl Cutter {
    /// Appends the triangles of `face`, a polygon of vertices whose places `corner` gives: two fewer than it has corners.
    pub(super) fn cut(&mut self, face: &[u32], corner: impl Fn(u32) -> [f64; 3], triangles: &mut Vec<[u32; 3]>) {
        let [first, others @ ..] = face else { return };
        if others.len() > 2 {
            self.corners.clear();
            self.corners.extend(face.iter().map(|&index| corner(index)));
            if !is_convex(&self.corners) && self.cut_ears() {
                triangles.extend(self.cut.as_chunks().0.iter().map(|cut: &[u32; 3]| cut.map(|i| face[i as usize])));
                return;
            }
        }
        triangles.extend(others.windows(2).map(|pair| [*first, pair[0], pair[1]]));
    }

    /// Cuts `corners` into `cut`. False for a polygon that has no area, or crosses itself when it is flattened: then a fan
    /// serves as well.
    fn cut_ears(&mut self) -> bool {
        let size = self.corners.iter().flatten().fold(0.0, |size: f64, c| size.max(c.abs()));
        self.corners.iter_mut().flatten().for_each(|c| *c /= size);
        self.cut.clear();
        let count = self.corners.len();
        if size == 0.0 || !earcut::utils3d::project3d_to_2d(&self.corners, count, &mut self.flat) {
            return false;
        }
        let earcut = self.earcut.get_or_insert_with(earcut::Earcut::new);
        earcut.earcut(self.flat.iter().copied(), &[] as &[u32], &mut self.cut);
        // It leaves out corners that are in line with their neighbors, which other faces may have.
        self.cut.len() == 3 * (count - 2) || (count <= MOST_CORNERS && clip(&self.flat, &mut self.cut))
    }
}

/// Cuts a flat polygon, anticlockwise, into `cut`, corner by corner, none left out. False if it crosses itself.
fn clip(flat: &[[f64; 2]], cut: &mut Vec<u32>) -> bool {
    cut.clear();
    let place = |corner: u32| flat.get(corner as usize).map_or(DVec2::ZERO, |&place| DVec2::from(place));
    let turn = |[a, b, c]: [u32; 3]| (place(b) - place(a)).perp_dot(place(c) - place(b));
    let covers = |[a, b, c]: [u32; 3], other: u32| {
        let is_corner = [a, b, c].iter().any(|&corner| place(corner) == place(other));
        !is_corner && [[a, b, other], [b, c, other], [c, a, other]].into_iter().all(|side| turn(side) >= 0.0)
    };
    let mut rest: Vec<u32> = (0..).take(flat.len()).collect();
    let mut start = 0;
    while let count @ 4.. = rest.len() {
        let ear = |at: usize| [at + count - 1, at, at + 1].map(|at| rest[at % count]);
        let all = (start..start + count).map(|at| at % count);
        let is_ear = |&at: &usize| {
            let ear = ear(at);
            turn(ear) > 0.0 && !rest.iter().any(|&other| covers(ear, other))
        };
        let is_flat = |&at: &usize| turn(ear(at)).abs() <= FLAT;
        let Some(at) = all.clone().find(is_ear).or_else(|| all.clone().find(is_flat)) else { return false };
        cut.extend(ear(at));
        rest.remove(at);
        start = at;
    }
    cut.extend(&rest);
    <[u32; 3]>::try_from(rest).is_ok_and(|last| turn(last) >= -FLAT)
}

/// True if the polygon turns the same way at every corner.
fn is_convex(corners: &[[f64; 3]]) -> bool {
    let corner = |index: usize| glam::DVec3::from(corners[index % corners.len()]);
    let turn = |i: usize| (corner(i + 1) - corner(i)).cross(corner(i + 2) - corner(i + 1));
    let normal: glam::DVec3 = (0..corners.len()).map(|i| corner(i).cross(corner(i + 1))).sum();
    corners.len() <= 3 || (0..corners.len()).all(|i| turn(i).dot(normal) >= 0.0)
}
