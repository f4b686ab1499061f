//! The bounding volume hierarchy: built by `obvhs`, then flattened to nodes of four children.

use super::disc::Discs;
use super::narrow::{self, Motion, Triangle};
use super::pack::{Earliest, LANES, Pack, Ray, WIDTH};
use glam::{BVec4A, DVec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// The boxes of four children in f32, axis by axis, and where the children are. An unused child has a box that nothing
/// meets.
#[derive(Clone, Debug)]
struct Node {
    center: [Vec4; 3],
    /// Half the box's sides.
    half: [Vec4; 3],
    children: [u32; WIDTH],
}

/// This bit is set in the link to a child that is a pack.
const PACK: u32 = 1 << 31;

/// A child that the sphere may touch.
pub(super) struct Child {
    /// The sphere does not touch it before this.
    near: f32,
    /// When it is likely to be touched: the candidate where this is least is searched first.
    expected: f32,
    link: u32,
    /// Four times its node's index, plus its own place among the node's children.
    place: u32,
}

/// A tree over the triangles of a surface.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// For each node, those of its children.
    discs: Vec<Discs>,
    packs: Vec<Pack>,
    /// Half the longest side of a pack's box, on average.
    grain: f32,
}

/// Classes of the sphere's size relative to the packs, which decide the tests before a box is opened.
pub(super) mod scale {
    /// The sphere is small: it hardly touches a box without touching its content, so boxes alone do.
    pub(in super::super) const COARSE: u8 = 0;
    /// The sphere is about as large as the packs: the corners of boxes that it is too round to touch are left out.
    pub(in super::super) const MIDDLE: u8 = 1;
    /// The sphere is larger than the packs and touches many boxes without touching the surface inside: discs are tried.
    pub(in super::super) const FINE: u8 = 2;
}

/// The least radius of a sphere, as a multiple of the packs' size, for which a mesh is not coarse.
const MIDDLE_FROM: f32 = 0.6;

/// Least ratio for which it is fine.
const FINE_FROM: f32 = 2.0;

/// A triangle, as the builder takes it.
struct Bounded(Triangle);

impl obvhs::Boundable for Bounded {
    fn aabb(&self) -> Aabb {
        let [a, b, c] = self.0.map(|corner| Vec3A::from(corner.as_vec3()));
        Aabb { min: a.min(b).min(c), max: a.max(b).max(c) }
    }
}

impl Tree {
    /// The tree over these triangles, and the triangles in its order.
    pub(super) fn new(triangles: Vec<Triangle>) -> (Vec<Triangle>, Self) {
        // In place.
        let triangles: Vec<Bounded> = triangles.into_iter().map(Bounded).collect();
        let bvh = build(&triangles);
        let mut flattened = Flattened {
            bvh: &bvh,
            packed: packed(&bvh),
            triangles: &triangles,
            ordered: Vec::with_capacity(triangles.len()),
            open: Vec::new(),
            tree: Self { nodes: Vec::new(), discs: Vec::new(), packs: Vec::new(), grain: 0.0 },
        };
        flattened.add_node(0);
        flattened.tree.grain /= flattened.tree.packs.len() as f32;
        (flattened.ordered, flattened.tree)
    }

    /// Class of the sphere's size relative to the mesh: one of [`scale`].
    #[inline]
    pub(super) fn scale_for(&self, ray: &Ray) -> u8 {
        if ray.margin > FINE_FROM * self.grain {
            scale::FINE
        } else if ray.margin > MIDDLE_FROM * self.grain {
            scale::MIDDLE
        } else {
            scale::COARSE
        }
    }

    /// The distance that the sphere travels until it touches one of the triangles.
    pub(super) fn first_contact(&self, triangles: &[Triangle], motion: &Motion) -> Option<f64> {
        Search::new(self, motion).first(self, triangles, motion)
    }

    /// The children of the root that the sphere may touch before `limit`.
    #[inline]
    pub(super) fn candidates<const SCALE: u8>(&self, ray: &Ray, limit: f32) -> Vec<Child> {
        // Every node on the way down leaves at most three siblings behind; obvhs trees are far less deep than this. A
        // kilobyte is also what allocators have at hand.
        let mut stack = Vec::with_capacity(1024 / size_of::<Child>());
        self.visit::<SCALE>(0, ray, limit, &mut stack);
        stack
    }

    /// The candidate, if it is a pack that the sphere may touch before `limit`; if it is a node, its children go on the
    /// stack.
    #[inline]
    pub(super) fn resolve<const SCALE: u8>(
        &self,
        &Child { near, link, place, .. }: &Child,
        ray: &Ray,
        limit: f32,
        stack: &mut Vec<Child>,
    ) -> Option<&Pack> {
        // The limit may have become lower since the child was put there.
        if near > limit || self.passed::<SCALE>(place / WIDTH as u32, ray, limit) >> (place % WIDTH as u32) & 1 == 1 {
            return None;
        }
        if link & PACK == 0 {
            self.visit::<SCALE>(link, ray, limit, stack);
            return None;
        }
        Some(&self.packs[(link & !PACK) as usize])
    }

    /// Puts the node's children that the sphere may touch before `limit` on the stack; the one that is expected to be
    /// touched first comes on top.
    #[inline]
    fn visit<const SCALE: u8>(&self, index: u32, ray: &Ray, limit: f32, stack: &mut Vec<Child>) {
        let node = &self.nodes[index as usize];
        let (mut near, mut met) = node.met::<SCALE>(ray, limit);
        let mut expected = near;
        if SCALE == scale::FINE {
            let bounds = self.discs[index as usize].contact_bounds(&node.center, ray, near);
            (near, expected) = (bounds.near, bounds.expected);
            met &= near.cmple(Vec4::splat(limit));
        }
        let mut met = met.bitmask() & !self.passed::<SCALE>(index, ray, limit);
        let (near, expected) = (near.to_array(), expected.to_array());
        // In a coarse mesh the nearest child nearly always has the first contact: its siblings wait below it. In others
        // the most promising of all candidates is next.
        let bottom = if SCALE == scale::COARSE { stack.len() } else { 0 };
        while met != 0 {
            let child = met.trailing_zeros() as usize;
            met &= met - 1;
            let (near, expected) = (near[child], expected[child]);
            let mut above = stack.len();
            stack.push(Child {
                near,
                expected,
                link: node.children[child],
                place: index * WIDTH as u32 + child as u32,
            });
            while above > bottom && stack[above - 1].expected < expected {
                stack.swap(above - 1, above);
                above -= 1;
            }
        }
    }

    /// The children that the sphere has not reached when it has traveled as far as `limit`: a bit for each.
    #[inline]
    fn passed<const SCALE: u8>(&self, index: u32, ray: &Ray, limit: f32) -> u32 {
        if SCALE == scale::COARSE || limit == f32::INFINITY {
            return 0;
        }
        let node = &self.nodes[index as usize];
        let mut passed = node.passed(ray, limit);
        if SCALE == scale::FINE {
            passed |= self.discs[index as usize].passed(&node.center, ray, limit);
        }
        passed.bitmask()
    }
}

/// A search for the first contact of a sphere, which can pause at any contact.
pub(super) struct Search {
    ray: Ray,
    scale: u8,
    stack: Vec<Child>,
    /// Distance of the first contact so far.
    first: f64,
    /// The limit for boxes and packs.
    limit: f32,
    /// The triangle that it touches, in the tree's order.
    touched: usize,
}

impl Search {
    pub(super) fn new(tree: &Tree, motion: &Motion) -> Self {
        let (ray, first) = (Ray::new(motion), farthest(motion));
        let (scale, limit) = (tree.scale_for(&ray), first as f32);
        let stack = match scale {
            scale::COARSE => tree.candidates::<{ scale::COARSE }>(&ray, limit),
            scale::MIDDLE => tree.candidates::<{ scale::MIDDLE }>(&ray, limit),
            _ => tree.candidates::<{ scale::FINE }>(&ray, limit),
        };
        Self { ray, scale, stack, first, limit, touched: 0 }
    }

    /// True if the sphere touches a triangle, early or late: much is left to search then.
    pub(super) fn touches(&mut self, tree: &Tree, triangles: &[Triangle], motion: &Motion) -> bool {
        self.go_on::<true, true>(tree, triangles, motion, narrow::first_contact);
        self.first < farthest(motion)
    }

    /// The distance of the first contact.
    pub(super) fn first(self, tree: &Tree, triangles: &[Triangle], motion: &Motion) -> Option<f64> {
        Some(self.first_triangle(tree, triangles, motion)?.0)
    }

    /// The distance of the first contact, and the index of the triangle that is touched.
    pub(super) fn first_triangle(
        mut self,
        tree: &Tree,
        triangles: &[Triangle],
        motion: &Motion,
    ) -> Option<(f64, usize)> {
        self.go_on::<false, true>(tree, triangles, motion, narrow::first_contact);
        (self.first < farthest(motion)).then_some((self.first, self.touched))
    }

    /// The distance of the first contact by another test of a triangle, with the reject before it or without.
    pub(super) fn first_by<const REJECT: bool>(
        mut self,
        tree: &Tree,
        triangles: &[Triangle],
        motion: &Motion,
        test: impl Fn(&Motion, &Triangle, f64) -> Option<f64>,
    ) -> Option<f64> {
        self.go_on::<false, REJECT>(tree, triangles, motion, test);
        (self.first < farthest(motion)).then_some(self.first)
    }

    #[inline]
    fn go_on<const PAUSES: bool, const REJECT: bool>(
        &mut self,
        tree: &Tree,
        triangles: &[Triangle],
        motion: &Motion,
        test: impl Fn(&Motion, &Triangle, f64) -> Option<f64>,
    ) {
        match self.scale {
            scale::COARSE => self.go_on_at::<PAUSES, REJECT, { scale::COARSE }>(tree, triangles, motion, test),
            scale::MIDDLE => self.go_on_at::<PAUSES, REJECT, { scale::MIDDLE }>(tree, triangles, motion, test),
            _ => self.go_on_at::<PAUSES, REJECT, { scale::FINE }>(tree, triangles, motion, test),
        }
    }

    /// Searches all candidates that are left, or those up to the first pack with a contact.
    fn go_on_at<const PAUSES: bool, const REJECT: bool, const SCALE: u8>(
        &mut self,
        tree: &Tree,
        triangles: &[Triangle],
        motion: &Motion,
        test: impl Fn(&Motion, &Triangle, f64) -> Option<f64>,
    ) {
        let Self { ray, stack, first, limit, touched, .. } = self;
        while let Some(candidate) = stack.pop() {
            let Some(pack) = tree.resolve::<SCALE>(&candidate, ray, *limit, stack) else { continue };
            let mut earliest = if REJECT { pack.earliest(ray, *limit) } else { Earliest::at_once(pack.count) };
            let mut touches = false;
            while let Some(lane) = earliest.pop(*limit) {
                let triangle = &triangles[pack.first as usize + lane];
                if let Some(distance) = test(motion, triangle, *first) {
                    *first = distance;
                    *touched = pack.first as usize + lane;
                    *limit = limit_after(*first, motion, ray);
                    touches = true;
                    if REJECT && earliest.has_some() {
                        earliest.retain(&pack.earliest(ray, *limit));
                    }
                }
            }
            if PAUSES && touches {
                return;
            }
        }
    }
}

impl Node {
    const EMPTY: Self = Self { center: [Vec4::ZERO; 3], half: [Vec4::splat(-1e30); 3], children: [0; WIDTH] };

    /// For each child, a distance before which the sphere does not touch its box, and whether it may before `limit`.
    #[inline]
    fn met<const SCALE: u8>(&self, ray: &Ray, limit: f32) -> (Vec4, BVec4A) {
        let (mut near, mut far) = (Vec4::ZERO, Vec4::splat(limit));
        for axis in 0..3 {
            let middle = (self.center[axis] - ray.origins[axis]) * ray.inverse[axis];
            let half = (self.half[axis] + ray.margin) * ray.spread[axis];
            near = near.max(middle - half);
            far = far.min(middle + half);
        }
        if SCALE == scale::COARSE {
            return (near, near.cmple(far));
        }
        // A box that is inflated like that has corners where the sphere is round. Seen along the motion, a box at a
        // distance from the path is met later than its depth says, or never: in fine meshes this limits the search to the
        // few triangles around the point of contact.
        let [beside, above, depth] = [0, 1, 2].map(|axis| ray.extent(&self.center, &self.half, axis));
        let u = (beside[0].abs() - beside[1]).max(Vec4::ZERO);
        let v = (above[0].abs() - above[1]).max(Vec4::ZERO);
        let reach = Vec4::splat(ray.margin * ray.margin) - (u * u + v * v);
        near = near.max(depth[0] - depth[1] - reach.max(Vec4::ZERO).sqrt());
        (near, near.cmple(far) & reach.cmpge(Vec4::ZERO))
    }

    /// The boxes that the sphere has not reached when it has traveled as far as `limit`: from there, all of the box
    /// lies beyond the radius in a direction that points forward, and so from everywhere before it.
    #[inline]
    fn passed(&self, ray: &Ray, limit: f32) -> BVec4A {
        let end = ray.origin + ray.direction() * limit;
        let (mut square, mut forward) = (Vec4::ZERO, Vec4::ZERO);
        for axis in 0..3 {
            let way = self.center[axis] - end[axis];
            let gap = (way.abs() - self.half[axis]).max(Vec4::ZERO).copysign(way);
            square += gap * gap;
            forward += gap * ray.direction()[axis];
        }
        forward.cmpge(Vec4::ZERO) & square.cmpgt(Vec4::splat(ray.margin * ray.margin))
    }
}

/// Start of the search: beyond any contact. A sphere that does not move touches at 0 or never.
#[inline]
pub(super) fn farthest(motion: &Motion) -> f64 {
    if motion.direction == DVec3::ZERO { f64::MIN_POSITIVE } else { f64::INFINITY }
}

/// The limit for boxes and packs once there is a contact at `first`: rounded up, with room for the boxes' own rounding.
#[inline]
pub(super) fn limit_after(first: f64, motion: &Motion, ray: &Ray) -> f32 {
    first as f32 + 2.0 * (ray.margin - motion.radius as f32)
}

/// Builds the tree like the fast preset of obvhs, without the collapse of its leaves.
fn build(bounds: &[Bounded]) -> Bvh2 {
    let indices = (0..bounds.len() as u32).collect();
    let mut builder = PlocBuilder::with_capacity(bounds.len());
    let mut bvh = builder.build(PlocSearchDistance::Low, bounds, indices, SortPrecision::U64, 2);
    ReinsertionOptimizer::default().run(&mut bvh, 0.02, None);
    bvh
}

/// Cost of a step down, relative to testing one triangle of a pack: high, so that packs are few and full.
const STEP: f32 = 8.0;

/// For each node of the binary tree the number of triangles of a pack of everything below it; 0 if that is not a pack. Decided
/// from below by the surface area heuristic, as `obvhs::bvh2::leaf_collapser` does, but without making the tree again.
fn packed(bvh: &Bvh2) -> Vec<u8> {
    let mut packed = vec![0; bvh.nodes.len()];
    pack_below(bvh, 0, &mut packed);
    packed
}

/// Decides for a node and all below it; how many triangles its pack has, or 0.
fn pack_below(bvh: &Bvh2, index: u32, packed: &mut [u8]) -> u8 {
    let node = &bvh.nodes[index as usize];
    let count = if node.is_leaf() {
        1
    } else {
        let [left, right] = [node.first_index, node.first_index + 1].map(|child| {
            let count = pack_below(bvh, child, packed);
            (count, half_area(bvh.nodes[child as usize].aabb()) * f32::from(count))
        });
        let count = left.0 + right.0;
        let may_be = left.0 > 0 && right.0 > 0 && usize::from(count) <= LANES;
        let is_better = may_be && half_area(node.aabb()) * (f32::from(count) - STEP) <= left.1 + right.1;
        if is_better { count } else { 0 }
    };
    packed[index as usize] = count;
    count
}

struct Flattened<'a> {
    bvh: &'a Bvh2,
    /// For each of its nodes how many triangles it has as a pack, if it is one.
    packed: Vec<u8>,
    triangles: &'a [Bounded],
    ordered: Vec<Triangle>,
    /// Nodes of a pack that are still to be looked at.
    open: Vec<u32>,
    tree: Tree,
}

impl Flattened<'_> {
    /// Adds a node for the node `root` of the binary tree, and all nodes below it. Returns its index.
    fn add_node(&mut self, root: u32) -> u32 {
        let bvh = self.bvh;
        let node = |index: u32| &bvh.nodes[index as usize];
        let is_pack = |flattened: &Self, index: u32| flattened.packed[index as usize] > 0;
        let mut members = vec![root];
        // Replace the member with the largest box by its children until there are enough.
        while members.len() < WIDTH {
            let largest = (0..members.len())
                .filter(|&member| !is_pack(self, members[member]))
                .max_by(|&a, &b| half_area(node(members[a]).aabb()).total_cmp(&half_area(node(members[b]).aabb())));
            let Some(largest) = largest else { break };
            let first = node(members.swap_remove(largest)).first_index;
            members.extend([first, first + 1]);
        }
        let index = self.tree.nodes.len();
        self.tree.nodes.push(Node::EMPTY);
        self.tree.discs.push(Discs::UNKNOWN);
        for (child, member) in members.into_iter().enumerate() {
            let aabb = *node(member).aabb();
            let first = self.ordered.len();
            let link = if is_pack(self, member) { self.add_pack(member) } else { self.add_node(member) };
            let place = &mut self.tree.nodes[index];
            for axis in 0..3 {
                let (low, high) = (aabb.min[axis], aabb.max[axis]);
                let center = (low + high) / 2.0;
                place.center[axis][child] = center;
                place.half[axis][child] = (high - center).max(center - low);
            }
            place.children[child] = link;
            let center = [0, 1, 2].map(|axis| f64::from(place.center[axis][child])).into();
            self.tree.discs[index].set(child, &self.ordered[first..], center);
        }
        index as u32
    }

    /// Adds a pack of all that is below the node `root` of the binary tree. Returns its link.
    fn add_pack(&mut self, root: u32) -> u32 {
        let first = self.ordered.len();
        self.open.push(root);
        while let Some(index) = self.open.pop() {
            let node = &self.bvh.nodes[index as usize];
            if node.is_leaf() {
                // The builder puts a single triangle in a leaf.
                let triangle = self.bvh.primitive_indices[node.first_index as usize];
                self.ordered.push(self.triangles[triangle as usize].0);
            } else {
                self.open.extend([node.first_index + 1, node.first_index]);
            }
        }
        let leaf = &self.bvh.nodes[root as usize];
        let side = leaf.aabb().max - leaf.aabb().min;
        self.tree.grain += side.max_element() / 2.0;
        self.tree.packs.push(Pack::new(&self.ordered[first..], first as u32));
        (self.tree.packs.len() - 1) as u32 | PACK
    }
}

fn half_area(aabb: &Aabb) -> f32 {
    let side = aabb.max - aabb.min;
    side.x * side.y + side.y * side.z + side.z * side.x
}
