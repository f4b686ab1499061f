//! A pair of household scissors, half open: two blades that cross at a screw, two finger rings of different size.

use super::shape::{Shape, bar, below, cuboid, cylinder, ellipse};
use super::{contour::Form, proportions::Proportions};
use fidget_core::context::Tree;
use glam::{Vec2, Vec3};

/// Parts of one half, in centimeters.
struct Half {
    blade: f32,
    width: f32,
    shank: f32,
    ring: Vec2,
    wire: f32,
}

/// A half with its blade along +x, its ring on the side of −y; from z = 0 upwards, but the ring about z = 0.
fn half(h: &Half) -> Shape {
    let back = h.width * 0.45;
    let blade = bar(Vec2::new(-0.2, back), Vec2::new(h.blade - 0.1, 0.12), h.width, 0.1);
    // The cutting edge is straight, and ground thin.
    let edge = below(Vec3::NEG_Y, h.width * 0.35);
    let blade = blade.cut(&edge, 0.15);
    let knee = Vec2::new(-h.shank * 0.5, -h.width * 0.55);
    let center = Vec2::new(-h.shank - h.ring.x, -h.ring.y * 0.95);
    let shank = bar(Vec2::new(0.0, 0.0), knee, h.width * 0.9, h.wire * 1.35)
        .joined(&bar(knee, center + Vec2::new(h.ring.x * 0.9, h.ring.y * 0.5), h.wire * 1.35, h.wire * 1.1), 0.6);
    let flat = blade.joined(&shank, 0.8).extrude(0.19, 0.05).moved(Vec3::Z * 0.17);
    let grind = below(Vec3::new(0.0, -0.45, 0.893), 0.36 + h.width * 0.08);
    let flat = flat.and(&grind);
    let oval = ellipse(h.ring.x, h.ring.y).0;
    let tube = Shape((oval.square() + (Tree::z() * 0.85).square() + 1e-9).sqrt() - h.wire);
    let tube = tube.turned_z(8.0).moved(center.extend(0.0));
    flat.joined(&tube, 0.35)
}

pub(super) fn form(p: &mut Proportions) -> Form {
    let blade = p.about(10.5);
    let width = p.within(0.85, 0.12);
    let shank = p.about(3.6);
    let wire = p.within(0.46, 0.12);
    let small = Vec2::new(p.within(1.75, 0.15), p.within(1.4, 0.12));
    let large = Vec2::new(p.within(2.5, 0.15), p.within(1.6, 0.12));
    let opening = p.about(13.0);

    let upper = half(&Half { blade, width, shank, ring: small, wire }).turned_z(opening);
    let (x, y, z) = Tree::axes();
    let lower = half(&Half { blade, width, shank, ring: large, wire }).turned_z(opening).in_axes(x, -y, -z);
    let screw =
        cylinder(0.62, 0.52, 0.15) - &cuboid(Vec3::new(0.9, 0.09, 0.2), 0.02).turned_z(35.0).moved(Vec3::Z * 0.6);
    let spread = libm::sinf(opening.to_radians());
    let back = shank + 2.0 * large.x.max(small.x) + 2.0 * wire;
    let side = (blade * spread).max(back * spread + 2.2 * large.y.max(small.y) + 2.0 * wire) + 0.4;
    Form {
        shape: upper + &lower + &screw,
        bounds: [Vec3::new(-back - 0.4, -side, -0.7), Vec3::new(blade + 0.2, side, 0.7)],
        cells: 250.0,
    }
}
