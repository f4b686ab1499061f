//! The bounding volume hierarchy: built by `obvhs`, then flattened to four children a node.

use super::Precision;
use super::flat::Flats;
use super::narrow::{Motion, Triangle};
use super::pack::{LANES, Pack, Ray, WIDTH};
use glam::{BVec4A, DVec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Boxes of four children in f32, axis by axis, and where the children are. An unused child has a box that nothing
/// meets.
#[derive(Clone, Debug)]
struct Node {
    center: [Vec4; 3],
    /// Half the box's sides.
    half: [Vec4; 3],
    children: [u32; WIDTH],
}

/// A child that is a pack has this bit set.
const PACK: u32 = 1 << 31;

/// A child that may have to be looked into.
struct Open {
    /// The sphere does not touch it before this.
    near: f32,
    /// What is expected to be touched first is looked into first.
    expected: f32,
    node: u32,
    child: u32,
}

/// A tree over the triangles of a surface.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    nodes: Vec<Node>,
    /// For each node.
    flats: Vec<Flats>,
    packs: Vec<Pack>,
    /// Half the longest side of a pack's box, on average.
    grain: f32,
}

/// Where the sphere is this many times as large as the packs, many boxes touch it that the surface in them does not.
const FINE: f32 = 2.0;

struct Bounds(Aabb);

impl obvhs::Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl Tree {
    /// The tree over these triangles, and the triangles in its order.
    pub(super) fn new(triangles: Vec<Triangle>) -> (Vec<Triangle>, Self) {
        let bounds: Vec<Bounds> = triangles.iter().map(bounds).collect();
        let bvh = build(&bounds);
        drop(bounds);
        let mut flattened = Flattened {
            bvh: &bvh,
            triangles: &triangles,
            ordered: Vec::with_capacity(triangles.len()),
            tree: Self { nodes: Vec::new(), flats: Vec::new(), packs: Vec::new(), grain: 0.0 },
        };
        flattened.add_node(0);
        flattened.tree.grain /= flattened.tree.packs.len() as f32;
        (flattened.ordered, flattened.tree)
    }

    /// The distance that the sphere travels until it touches one of the triangles.
    pub(super) fn first_contact<P: Precision>(&self, triangles: &[Triangle], motion: &Motion) -> Option<f64> {
        let ray = Ray::new(motion);
        if ray.margin > FINE * self.grain {
            self.search::<P, true>(triangles, motion, &ray)
        } else {
            self.search::<P, false>(triangles, motion, &ray)
        }
    }

    /// `IS_FINE`: what lies flat in the boxes is worth a look.
    fn search<P: Precision, const IS_FINE: bool>(
        &self,
        triangles: &[Triangle],
        motion: &Motion,
        ray: &Ray,
    ) -> Option<f64> {
        let mut first = if motion.direction == DVec3::ZERO { f64::MIN_POSITIVE } else { f64::INFINITY };
        let mut limit = first as f32;
        // Every node on the way down leaves at most three siblings behind; obvhs trees are far less deep than this.
        let mut stack = Vec::with_capacity(96);
        self.visit::<IS_FINE>(0, ray, limit, &mut stack);
        while let Some(Open { near, node, child, .. }) = stack.pop() {
            // The limit may have come nearer since the child was put there.
            if near > limit || self.passed::<IS_FINE>(node, ray, limit).test(child as usize) {
                continue;
            }
            let link = self.nodes[node as usize].children[child as usize];
            if link & PACK == 0 {
                self.visit::<IS_FINE>(link, ray, limit, &mut stack);
                continue;
            }
            let pack = &self.packs[(link & !PACK) as usize];
            let mut earliest = if P::REJECT { pack.earliest(ray, limit) } else { pack.unknown() };
            while let Some(lane) = pop_least(&mut earliest, limit) {
                let triangle = &triangles[pack.first as usize + lane];
                if let Some(distance) = P::first_contact(motion, triangle, first) {
                    first = distance;
                    // Rounded up, and with room for the boxes' own rounding.
                    limit = first as f32 + 2.0 * (ray.margin - motion.radius as f32);
                }
            }
        }
        let is_contact = if motion.direction == DVec3::ZERO { first == 0.0 } else { first < f64::INFINITY };
        is_contact.then_some(first)
    }

    /// Puts the node's children that the sphere may touch before `limit` on the stack, which has the one that is expected
    /// to be touched first on top.
    #[inline]
    fn visit<const IS_FINE: bool>(&self, index: u32, ray: &Ray, limit: f32, stack: &mut Vec<Open>) {
        let node = &self.nodes[index as usize];
        let (mut near, mut met) = node.met(ray, limit);
        let mut expected = near;
        if IS_FINE {
            let reach = self.flats[index as usize].reach(&node.center, ray, near);
            (near, expected) = (reach.near, reach.expected);
            met &= near.cmple(Vec4::splat(limit));
        }
        if limit < f32::INFINITY {
            met &= !self.passed::<IS_FINE>(index, ray, limit);
        }
        let (mut met, near, expected) = (met.bitmask(), near.to_array(), expected.to_array());
        while met != 0 {
            let child = met.trailing_zeros();
            met &= met - 1;
            let open = Open { near: near[child as usize], expected: expected[child as usize], node: index, child };
            let mut place = stack.len();
            stack.push(open);
            while place > 0 && stack[place - 1].expected < expected[child as usize] {
                stack.swap(place - 1, place);
                place -= 1;
            }
        }
    }

    /// Which children the sphere has not reached when it has gone as far as `limit`, nor before.
    #[inline]
    fn passed<const IS_FINE: bool>(&self, index: u32, ray: &Ray, limit: f32) -> BVec4A {
        let node = &self.nodes[index as usize];
        let mut passed = node.passed(ray, limit);
        if IS_FINE {
            passed |= self.flats[index as usize].passed(&node.center, ray, limit);
        }
        passed
    }
}

impl Node {
    const EMPTY: Self = Self { center: [Vec4::ZERO; 3], half: [Vec4::splat(-1e30); 3], children: [0; WIDTH] };

    /// For each child, a distance before which the sphere does not touch its box, and whether it may before `limit`.
    #[inline]
    fn met(&self, ray: &Ray, limit: f32) -> (Vec4, BVec4A) {
        let (mut near, mut far) = (Vec4::ZERO, Vec4::splat(limit));
        for axis in 0..3 {
            let middle = (self.center[axis] - ray.origin[axis]) * ray.inverse[axis];
            let half = (self.half[axis] + ray.margin) * ray.inverse[axis].abs();
            near = near.max(middle - half);
            far = far.min(middle + half);
        }
        // A box that is inflated like that has corners where the sphere is round. Seen along the motion, a box at a
        // distance from the path is met later than its depth says, or never: on fine meshes this is what keeps the
        // search to the few triangles about the point of contact.
        let [beside, above, depth] = [0, 1, 2].map(|axis| ray.extent(&self.center, &self.half, axis));
        let u = (beside[0].abs() - beside[1]).max(Vec4::ZERO);
        let v = (above[0].abs() - above[1]).max(Vec4::ZERO);
        let reach = Vec4::splat(ray.margin * ray.margin) - (u * u + v * v);
        near = near.max(depth[0] - depth[1] - reach.max(Vec4::ZERO).sqrt());
        (near, near.cmple(far) & reach.cmpge(Vec4::ZERO))
    }

    /// Which boxes the sphere has not reached when it has gone as far as `limit`: from there, all of the box lies beyond
    /// the radius in a direction that points forward, and so from everywhere before it.
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

/// The lane with the least value, if that is at most `limit`; it does not come again.
#[inline]
fn pop_least(values: &mut [f32; LANES], limit: f32) -> Option<usize> {
    let (mut least, mut lane) = (f32::INFINITY, 0);
    for (index, &value) in values.iter().enumerate() {
        if value < least {
            (least, lane) = (value, index);
        }
    }
    values[lane] = f32::INFINITY;
    (least <= limit && least < f32::INFINITY).then_some(lane)
}

/// As obvhs's fast preset, but with full packs rather than many.
fn build(bounds: &[Bounds]) -> Bvh2 {
    let indices = (0..bounds.len() as u32).collect();
    let mut builder = PlocBuilder::with_capacity(bounds.len());
    let mut bvh = builder.build(PlocSearchDistance::Low, bounds, indices, SortPrecision::U64, 2);
    ReinsertionOptimizer::default().run(&mut bvh, 0.02, None);
    collapse(&mut bvh, LANES as u32, 8.0);
    bvh
}

struct Flattened<'a> {
    bvh: &'a Bvh2,
    triangles: &'a [Triangle],
    ordered: Vec<Triangle>,
    tree: Tree,
}

impl Flattened<'_> {
    /// Adds the node that stands for this one of the binary tree, and all below it.
    fn add_node(&mut self, root: u32) -> u32 {
        let bvh = self.bvh;
        let node = |index: u32| &bvh.nodes[index as usize];
        let mut members = vec![root];
        // Open the member with the largest box until there are enough.
        while members.len() < WIDTH {
            let largest = (0..members.len())
                .filter(|&member| !node(members[member]).is_leaf())
                .max_by(|&a, &b| half_area(node(members[a]).aabb()).total_cmp(&half_area(node(members[b]).aabb())));
            let Some(largest) = largest else { break };
            let first = node(members.swap_remove(largest)).first_index;
            members.extend([first, first + 1]);
        }
        let index = self.tree.nodes.len();
        self.tree.nodes.push(Node::EMPTY);
        self.tree.flats.push(Flats::UNKNOWN);
        for (child, member) in members.into_iter().enumerate() {
            let aabb = *node(member).aabb();
            let first = self.ordered.len();
            let link = if node(member).is_leaf() { self.add_pack(member) } else { self.add_node(member) };
            let place = &mut self.tree.nodes[index];
            for axis in 0..3 {
                let (low, high) = (aabb.min[axis], aabb.max[axis]);
                let center = (low + high) / 2.0;
                place.center[axis][child] = center;
                place.half[axis][child] = (high - center).max(center - low);
            }
            place.children[child] = link;
            let center = [0, 1, 2].map(|axis| f64::from(place.center[axis][child])).into();
            self.tree.flats[index].set(child, &self.ordered[first..], center);
        }
        index as u32
    }

    fn add_pack(&mut self, leaf: u32) -> u32 {
        let leaf = &self.bvh.nodes[leaf as usize];
        let first = self.ordered.len();
        for index in leaf.first_index..leaf.first_index + leaf.prim_count {
            self.ordered.push(self.triangles[self.bvh.primitive_indices[index as usize] as usize]);
        }
        let side = leaf.aabb().max - leaf.aabb().min;
        self.tree.grain += side.max_element() / 2.0;
        self.tree.packs.push(Pack::new(&self.ordered[first..], first as u32));
        (self.tree.packs.len() - 1) as u32 | PACK
    }
}

fn bounds(triangle: &Triangle) -> Bounds {
    let [a, b, c] = triangle.map(|corner| Vec3A::from(corner.as_vec3()));
    Bounds(Aabb { min: a.min(b).min(c), max: a.max(b).max(c) })
}

fn half_area(aabb: &Aabb) -> f32 {
    let side = aabb.max - aabb.min;
    side.x * side.y + side.y * side.z + side.z * side.x
}
