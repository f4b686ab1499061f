//! A small vocabulary of implicit shapes: negative inside, positive outside, about the distance to the surface near it.
//!
//! Formulas after Inigo Quilez, *Distance functions* (iquilezles.org/articles/distfunctions): exact for the simple
//! shapes, first-order for ellipsoids, sheets and smooth unions. Meshing needs only the sign and the gradient near the
//! surface, so first order is enough. Profiles are shapes that ignore z; [`Shape::extrude`] and [`Shape::revolve`] make
//! solids of them.

use fidget_core::context::Tree;
use glam::{Vec2, Vec3};
use std::ops::{Add, Sub};

/// An implicit shape.
#[derive(Clone)]
pub(super) struct Shape(pub(super) Tree);

/// √(a² + b²), with a finite gradient at 0.
fn hypot(a: Tree, b: Tree) -> Tree {
    (a.square() + b.square() + 1e-12).sqrt()
}

/// √(a² + b² + c²), with a finite gradient at 0.
fn length(a: Tree, b: Tree, c: Tree) -> Tree {
    (a.square() + b.square() + c.square() + 1e-12).sqrt()
}

/// `t` limited to 0..=1.
fn unit(t: Tree) -> Tree {
    t.max(0.0).min(1.0)
}

/// A smooth curve through `knots` (x rising, y), level at each knot and beyond the ends.
pub(super) fn curve(x: &Tree, knots: &[(f32, f32)]) -> Tree {
    let first = knots.first().map_or(0.0, |knot| knot.1);
    knots.windows(2).fold(Tree::constant(first), |sum, pair| {
        let ((x0, y0), (x1, y1)) = (pair[0], pair[1]);
        let t = unit((x.clone() - x0) / (x1 - x0));
        sum + t.square() * (3.0 - 2.0 * t) * (y1 - y0)
    })
}

/// An ellipsoid about the origin, by its semi-axes.
pub(super) fn ellipsoid(axes: Vec3) -> Shape {
    let (x, y, z) = Tree::axes();
    let k0 = length(x.clone() / axes.x, y.clone() / axes.y, z.clone() / axes.z);
    let k1 = length(x / axes.x.powi(2), y / axes.y.powi(2), z / axes.z.powi(2));
    Shape(k0.clone() * (k0 - 1.0) / k1)
}

/// A box about the origin, by its half sides, its edges rounded with radius `round`.
pub(super) fn cuboid(half: Vec3, round: f32) -> Shape {
    rectangle(half.truncate(), round).extrude(half.z, round)
}

/// A cylinder about the z axis, from −`half` to `half`, its rims rounded with radius `round`.
pub(super) fn cylinder(radius: f32, half: f32, round: f32) -> Shape {
    disc(radius).extrude(half, round)
}

/// A rod from `a` to `b` with ball ends, its radius going from `ra` to `rb`.
pub(super) fn rod(a: Vec3, b: Vec3, ra: f32, rb: f32) -> Shape {
    let along = b - a;
    let p = [Tree::x() - a.x, Tree::y() - a.y, Tree::z() - a.z];
    let dot = p[0].clone() * along.x + p[1].clone() * along.y + p[2].clone() * along.z;
    let t = unit(dot / along.length_squared());
    let [x, y, z] = p;
    let distance = length(x - t.clone() * along.x, y - t.clone() * along.y, z - t.clone() * along.z);
    Shape(distance - (t * (rb - ra) + ra))
}

/// A ring about the z axis.
pub(super) fn torus(radius: f32, thickness: f32) -> Shape {
    disc(thickness).moved(Vec3::new(radius, 0.0, 0.0)).revolve()
}

/// The half space below `normal`·p = `offset`, for a unit `normal`.
pub(super) fn below(normal: Vec3, offset: f32) -> Shape {
    let (x, y, z) = Tree::axes();
    Shape(x * normal.x + y * normal.y + z * normal.z - offset)
}

/// Profile: a disc about the origin.
pub(super) fn disc(radius: f32) -> Shape {
    Shape(hypot(Tree::x(), Tree::y()) - radius)
}

/// Profile: an ellipse about the origin, by its semi-axes.
pub(super) fn ellipse(a: f32, b: f32) -> Shape {
    let (x, y, _) = Tree::axes();
    let k0 = hypot(x.clone() / a, y.clone() / b);
    let k1 = hypot(x / (a * a), y / (b * b));
    Shape(k0.clone() * (k0 - 1.0) / k1)
}

/// Profile: a rectangle about the origin, by its half sides, its corners rounded with radius `round`.
pub(super) fn rectangle(half: Vec2, round: f32) -> Shape {
    let dx = Tree::x().abs() - (half.x - round);
    let dy = Tree::y().abs() - (half.y - round);
    Shape(corner(dx, dy) - round)
}

/// Profile: a bar from `a` to `b` with round ends, its half width going from `ra` to `rb`.
pub(super) fn bar(a: Vec2, b: Vec2, ra: f32, rb: f32) -> Shape {
    let along = b - a;
    let (x, y) = (Tree::x() - a.x, Tree::y() - a.y);
    let t = unit((x.clone() * along.x + y.clone() * along.y) / along.length_squared());
    let distance = hypot(x - t.clone() * along.x, y - t.clone() * along.y);
    Shape(distance - (t * (rb - ra) + ra))
}

/// The distance to the quadrant x < 0, y < 0 from the two signed distances to its sides.
fn corner(dx: Tree, dy: Tree) -> Tree {
    let outside = hypot(dx.max(0.0), dy.max(0.0));
    dx.max(dy).min(0.0) + outside
}

impl Shape {
    /// This profile made solid from −`half` to `half` in z, its edges rounded with radius `round`.
    pub(super) fn extrude(&self, half: f32, round: f32) -> Self {
        Self(corner(self.0.clone() + round, Tree::z().abs() - (half - round)) - round)
    }

    /// This profile turned about the z axis: its x is the distance from the axis, its y is z.
    pub(super) fn revolve(&self) -> Self {
        Self(self.0.remap_xyz(hypot(Tree::x(), Tree::y()), Tree::z(), Tree::constant(0.0)))
    }

    /// A sheet as thick as twice `half` over this profile, its middle at the height `height` (a function of x and y),
    /// its edges rounded with radius `round`.
    pub(super) fn sheet(&self, height: &Tree, half: impl Into<Tree>, round: f32) -> Self {
        use fidget_core::var::Var;
        // Divided by the gradient's length, so that slopes are as thick as levels.
        let (gx, gy) = (height.deriv(Var::X), height.deriv(Var::Y));
        let rise = (Tree::z() - height.clone()) / (gx.square() + gy.square() + 1.0).sqrt();
        Self(corner(self.0.clone() + round, rise.abs() - (half.into() - round)) - round)
    }

    /// Moved by `by`.
    pub(super) fn moved(&self, by: Vec3) -> Self {
        Self(self.0.remap_xyz(Tree::x() - by.x, Tree::y() - by.y, Tree::z() - by.z))
    }

    /// Turned about the z axis, anticlockwise from above.
    pub(super) fn turned_z(&self, degrees: f32) -> Self {
        let (sin, cos) = libm::sincosf(degrees.to_radians());
        let (x, y, z) = Tree::axes();
        Self(self.0.remap_xyz(x.clone() * cos + y.clone() * sin, y * cos - x * sin, z))
    }

    /// Turned about the x axis, from y toward z.
    pub(super) fn turned_x(&self, degrees: f32) -> Self {
        let (sin, cos) = libm::sincosf(degrees.to_radians());
        let (x, y, z) = Tree::axes();
        Self(self.0.remap_xyz(x, y.clone() * cos + z.clone() * sin, z * cos - y * sin))
    }

    /// Mirrored in the plane x = 0, so that the half x > 0 appears on both sides.
    pub(super) fn twice_x(&self) -> Self {
        Self(self.0.remap_xyz(Tree::x().abs(), Tree::y(), Tree::z()))
    }

    /// Mirrored in the plane y = 0, so that the half y > 0 appears on both sides.
    pub(super) fn twice_y(&self) -> Self {
        Self(self.0.remap_xyz(Tree::x(), Tree::y().abs(), Tree::z()))
    }

    /// Seen in other axes: this shape's x, y and z are the given functions of the place.
    pub(super) fn in_axes(&self, x: Tree, y: Tree, z: Tree) -> Self {
        Self(self.0.remap_xyz(x, y, z))
    }

    /// Grown by `by` on every side.
    pub(super) fn grown(&self, by: f32) -> Self {
        Self(self.0.clone() - by)
    }

    /// Intersection of both.
    pub(super) fn and(&self, other: &Self) -> Self {
        Self(self.0.max(other.0.clone()))
    }

    /// Both, joined with a fillet of about `fillet`.
    pub(super) fn joined(&self, other: &Self, fillet: f32) -> Self {
        let (a, b) = (self.0.clone(), other.0.clone());
        let h = (1.0 - (a.clone() - b.clone()).abs() / fillet).max(0.0);
        Self(a.min(b) - h.square() * (fillet / 4.0))
    }

    /// This without `other`, the new edge rounded with about `round`.
    pub(super) fn carved(&self, other: &Self, round: f32) -> Self {
        let inverse = Self(-self.0.clone());
        Self(-inverse.joined(other, round).0)
    }

    /// Intersection of both, the new edge rounded with about `round`.
    pub(super) fn cut(&self, other: &Self, round: f32) -> Self {
        self.carved(&Self(-other.0.clone()), round)
    }
}

impl Add<&Shape> for Shape {
    type Output = Shape;

    /// Both.
    fn add(self, other: &Shape) -> Shape {
        Shape(self.0.min(other.0.clone()))
    }
}

impl Sub<&Shape> for Shape {
    type Output = Shape;

    /// The first without the second.
    fn sub(self, other: &Shape) -> Shape {
        Shape(self.0.max(-other.0.clone()))
    }
}
