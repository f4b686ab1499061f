//! Polygons to triangles, concave ones too.

/// Cuts polygons into triangles.
#[derive(Default)]
pub(super) struct Cutter {
    earcut: Option<earcut::Earcut<f64>>,
    corners: Vec<[f64; 3]>,
    flat: Vec<[f64; 2]>,
    cut: Vec<u32>,
}

impl Cutter {
    /// Appends the triangles of `face`, a polygon of vertices whose places `corner` gives; none if it has fewer than
    /// three.
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

    /// Cuts `corners` into `cut`. False when the polygon is too degenerate to be flattened: then a fan serves as well.
    fn cut_ears(&mut self) -> bool {
        let size = self.corners.iter().flatten().fold(0.0, |size: f64, c| size.max(c.abs()));
        self.corners.iter_mut().flatten().for_each(|c| *c /= size);
        self.cut.clear();
        if size > 0.0 && earcut::utils3d::project3d_to_2d(&self.corners, self.corners.len(), &mut self.flat) {
            let earcut = self.earcut.get_or_insert_with(earcut::Earcut::new);
            earcut.earcut(self.flat.iter().copied(), &[] as &[u32], &mut self.cut);
        }
        !self.cut.is_empty()
    }
}

/// True if the polygon turns the same way at every corner.
fn is_convex(corners: &[[f64; 3]]) -> bool {
    let corner = |index: usize| glam::DVec3::from(corners[index % corners.len()]);
    let turn = |i: usize| (corner(i + 1) - corner(i)).cross(corner(i + 2) - corner(i + 1));
    let normal: glam::DVec3 = (0..corners.len()).map(|i| corner(i).cross(corner(i + 1))).sum();
    corners.len() <= 3 || (0..corners.len()).all(|i| turn(i).dot(normal) >= 0.0)
}
