//! First contact of a moving sphere with a triangle mesh.
//!
//! Boxes in f32 with slack find the leaves that the sphere may reach (`tree`; in fine meshes with the help of `disc`), a
//! test on eight triangles at once in f32 rejects those that it cannot touch (`pack`), and the rest is decided in f64
//! ([`narrow`]). `budget` says by how much each step may be wrong.

mod budget;
mod disc;
pub mod narrow;
mod nearest;
mod pack;
mod tree;

use glam::DVec3;
use narrow::{Motion, Triangle};
use tree::{Search, Tree};

/// A triangle mesh, ready for casting spheres at it.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The center of the mesh's box.
    center: DVec3,
    /// Number of the mesh's units in one unit in the frame of the casts, where the box's longest side is between 1 and
    /// 2. A power of two, so that scaling is exact; it keeps meshes of any size in the range of f32.
    unit: f64,
    /// One over `unit`, also exact.
    per_unit: f64,
    /// Half the box's sides, in the frame of the casts.
    half: DVec3,
    /// In the frame of the casts, in the order of the tree.
    triangles: Vec<Triangle>,
    tree: Tree,
}

impl Surface {
    /// A surface of these triangles, in any unit.
    ///
    /// # Panics
    /// If there are no triangles, or a coordinate is not finite. [`Scene`](crate::probe::Scene) returns an error instead.
    pub fn new(triangles: Vec<Triangle>) -> Self {
        Self::with_bounds(triangles).0
    }

    /// A surface, and the triangles' bounding box: its lowest and highest corner, not rounded as [`bounds`](Self::bounds).
    pub(super) fn with_bounds(mut triangles: Vec<Triangle>) -> (Self, [DVec3; 2]) {
        assert!(!triangles.is_empty(), "a surface needs a triangle");
        let (mut low, mut high, mut is_finite) = (DVec3::INFINITY, DVec3::NEG_INFINITY, true);
        // Millions of triangles do not fit a cache: one pass.
        for triangle in &triangles {
            for &corner in triangle {
                is_finite &= corner.is_finite();
                (low, high) = (low.min(corner), high.max(corner));
            }
        }
        assert!(is_finite, "a surface needs finite corners");
        let center = (low + high) / 2.0;
        let longest = (high - low).max_element();
        // Not so small that one over it is out of range.
        let unit = if longest > 0.0 { libm::ldexp(1.0, libm::ilogb(longest).max(-1000)) } else { 1.0 };
        for triangle in &mut triangles {
            for corner in triangle {
                *corner = (*corner - center) / unit;
            }
        }
        let (triangles, tree) = Tree::new(without_repeats(triangles));
        let half = (high - low) / (2.0 * unit);
        (Self { center, unit, per_unit: 1.0 / unit, half, triangles, tree }, [low, high])
    }

    /// The triangles, in the order of the tree; repeated ones only once.
    pub fn triangles(&self) -> impl ExactSizeIterator<Item = Triangle> + '_ {
        self.triangles.iter().map(|triangle| triangle.map(|corner| corner * self.unit + self.center))
    }

    /// The first time t ≥ 0 at which a sphere of this radius (greater than 0), centered at origin + t · direction, touches
    /// the surface; 0 when it starts in contact, none when it never does. The direction need not have unit length;
    /// without a direction (zero, or not finite) only a contact at the start counts.
    pub fn first_contact(&self, origin: DVec3, direction: DVec3, radius: f64) -> Option<f64> {
        let start = self.start(origin, direction, radius)?;
        let distance = start.skipped + self.tree.first_contact(&self.triangles, &start.motion)?;
        Some(distance * self.unit / start.length)
    }

    /// The [first contact](Self::first_contact) by another test of a single triangle, with the reject before it or without:
    /// for the comparison of precisions.
    pub fn first_contact_by<const REJECT: bool>(
        &self,
        origin: DVec3,
        direction: DVec3,
        radius: f64,
        test: impl Fn(&Motion, &Triangle, f64) -> Option<f64>,
    ) -> Option<f64> {
        let Start { motion, skipped, length } = self.start(origin, direction, radius)?;
        let search = Search::new(&self.tree, &motion);
        let distance = skipped + search.first_by::<REJECT>(&self.tree, &self.triangles, &motion, test)?;
        Some(distance * self.unit / length)
    }

    /// The [first contact](Self::first_contact), and how the surface is oriented there.
    pub fn contact(&self, origin: DVec3, direction: DVec3, radius: f64) -> Option<Contact> {
        let Start { motion, skipped, length } = self.start(origin, direction, radius)?;
        let (way, triangle) = Search::new(&self.tree, &motion).first_triangle(&self.tree, &self.triangles, &motion)?;
        let center = motion.origin + motion.direction * way;
        let away = center - nearest::nearest_point(&self.triangles[triangle], center);
        Some(Contact { distance: (skipped + way) * self.unit / length, normal: away.normalize_or(-motion.direction) })
    }

    /// The [first contacts](Self::first_contact) of these origins if all of them touch; none as soon as one does not,
    /// which takes a part of the time.
    pub(crate) fn all_contacts<const N: usize>(
        &self,
        origins: [DVec3; N],
        direction: DVec3,
        radius: f64,
    ) -> Option<[f64; N]> {
        let mut starts = [const { None }; N];
        for (start, origin) in starts.iter_mut().zip(origins) {
            *start = Some(self.start(origin, direction, radius)?);
        }
        // The path farthest from the middle of the mesh is the one that most likely misses.
        let away = |start: &Option<Start>| {
            start.as_ref().map_or(0.0, |Start { motion, .. }| motion.origin.cross(motion.direction).length_squared())
        };
        let mut order: [usize; N] = std::array::from_fn(|index| index);
        order.sort_by(|&a, &b| away(&starts[b]).total_cmp(&away(&starts[a])));
        let mut searches = [const { None }; N];
        for index in order {
            let Start { motion, .. } = starts[index].as_ref()?;
            let mut search = Search::new(&self.tree, motion);
            if !search.touches(&self.tree, &self.triangles, motion) {
                return None;
            }
            searches[index] = Some(search);
        }
        let mut contacts = [0.0; N];
        for ((contact, start), search) in contacts.iter_mut().zip(starts).zip(searches) {
            let Start { motion, skipped, length } = start?;
            let distance = skipped + search?.first(&self.tree, &self.triangles, &motion)?;
            *contact = distance * self.unit / length;
        }
        Some(contacts)
    }

    /// The cast in the frame of the casts, its start moved up to the mesh's box; none if it never gets there.
    #[inline]
    fn start(&self, origin: DVec3, direction: DVec3, radius: f64) -> Option<Start> {
        let length = direction.length();
        let moves = length > 0.0 && length.is_finite();
        let motion = Motion {
            origin: (origin - self.center) * self.per_unit,
            direction: if moves { direction / length } else { DVec3::ZERO },
            radius: radius * self.per_unit,
        };
        let skipped = self.entry(&motion)?;
        let motion = Motion { origin: motion.origin + motion.direction * skipped, ..motion };
        Some(Start { motion, skipped, length: if moves { length } else { f64::INFINITY } })
    }

    /// Distance that the sphere can move toward the mesh's box without any contact; none when it never gets there. This
    /// saves the digits that a start from far away would cost.
    fn entry(&self, motion: &Motion) -> Option<f64> {
        // Rounding moves a point that is far away by this much at most.
        let slack = budget::ENTRY + budget::ENTRY_FAR * motion.origin.abs().max_element();
        let reach = self.half + DVec3::splat(motion.radius + slack);
        let (mut near, mut far) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let (o, d, h) = (motion.origin[axis], motion.direction[axis], reach[axis]);
            if d == 0.0 {
                if o.abs() > h {
                    return None;
                }
            } else {
                let (a, b) = ((-h - o) / d, (h - o) / d);
                near = near.max(a.min(b));
                far = far.min(a.max(b));
            }
        }
        (near <= far).then_some(near)
    }
}

/// First contact of a sphere with a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Distance from [`Surface::first_contact`].
    pub distance: f64,
    /// Unit vector from the point of contact to the sphere's center; against the direction where the sphere starts on the
    /// surface.
    pub normal: DVec3,
}

/// A cast in the frame of the casts, with its start at the mesh's box.
struct Start {
    motion: Motion,
    /// Distance that the start was moved.
    skipped: f64,
    /// The length of the direction that was given; infinite for a sphere that does not move.
    length: f64,
}

/// Leaves out triangles that have the same corners as an earlier one. They change no contact, but the time to build the
/// tree grows with the square of the number of boxes that coincide.
fn without_repeats(mut triangles: Vec<Triangle>) -> Vec<Triangle> {
    // A bitmap with 32 bits or more per triangle: few share a bit by chance, and only those that share one are compared.
    let bits = (32 * triangles.len()).next_power_of_two().max(64);
    let place = |triangle: &Triangle| {
        let hash = hash_of(triangle) >> (64 - bits.ilog2());
        (hash / 64, 1_u64 << (hash % 64))
    };
    let (mut met, mut met_again) = (vec![0_u64; bits / 64], Vec::new());
    for triangle in &triangles {
        let (word, bit) = place(triangle);
        let word = word as usize;
        if met[word] & bit != 0 {
            met_again.resize(bits / 64, 0_u64);
            met_again[word] |= bit;
        }
        met[word] |= bit;
    }
    if met_again.is_empty() {
        return triangles;
    }
    let shares = |triangle: &Triangle| {
        let (word, bit) = place(triangle);
        met_again[word as usize] & bit != 0
    };
    let mut suspects: Vec<([[u64; 3]; 3], usize)> = triangles
        .iter()
        .enumerate()
        .filter(|(_, triangle)| shares(triangle))
        .map(|(index, triangle)| {
            let mut corners = triangle.map(bits_of);
            corners.sort_unstable();
            (corners, index)
        })
        .collect();
    suspects.sort_unstable();
    let mut repeats = vec![false; triangles.len()];
    for pair in suspects.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        repeats[pair[1].1] = true;
    }
    let mut repeats = repeats.into_iter();
    triangles.retain(|_| repeats.next() == Some(false));
    triangles
}

/// A hash of a triangle's corners, in any order.
fn hash_of(triangle: &Triangle) -> u64 {
    // From the golden ratio and the square roots of 2 and 3.
    const SEEDS: [u64; 3] = [0x9e37_79b9_7f4a_7c15, 0x6a09_e667_f3bc_c909, 0xbb67_ae85_84ca_a73b];
    // Both halves of the product, so that each bit depends on all.
    let mixed = |a: u64, b: u64| {
        let product = u128::from(a) * u128::from(b);
        (product >> 64) as u64 ^ product as u64
    };
    let corner = |corner: &DVec3| {
        let [x, y, z] = bits_of(*corner);
        mixed(mixed(x ^ SEEDS[0], y ^ SEEDS[1]) ^ z, SEEDS[2])
    };
    mixed(triangle.iter().map(corner).fold(0, u64::wrapping_add), SEEDS[0])
}

/// A point's bits, the same for both zeros.
fn bits_of(point: DVec3) -> [u64; 3] {
    point.to_array().map(|value| (value + 0.0).to_bits())
}
