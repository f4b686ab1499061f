//! A Gem paper clip: one wire, three bends.

use super::shape::{Shape, below, rod, torus};
use super::{contour::Form, proportions::Proportions};
use glam::Vec3;

/// A half circle of wire about (`x`, `y`), on its side toward `sign`·x.
fn bend(x: f32, y: f32, radius: f32, wire: f32, sign: f32) -> Shape {
    // It overlaps the straight pieces by a hair, so that no gap opens between them.
    torus(radius, wire).and(&below(Vec3::X * -sign, wire * 0.02)).moved(Vec3::new(x, y, 0.0))
}

pub(super) fn form(p: &mut Proportions) -> Form {
    let length = p.about(3.2);
    let wire = p.within(0.05, 0.12);
    let outer = p.about(0.41);
    let second = outer * p.within(0.82, 0.05);
    let inner = second * p.within(0.74, 0.06);
    let inset = p.about(0.36);
    let free = [p.within(0.73, 0.1) * length, p.within(0.66, 0.1) * length];

    // Four straight legs along x, at these heights, joined by bends at alternate ends.
    let legs = [outer, -outer, 2.0 * second - outer, 2.0 * second - outer - 2.0 * inner];
    let centers = [outer, length - second, inset + inner];
    let leg =
        |i: usize, from: f32, to: f32| rod(Vec3::new(from, legs[i], 0.0), Vec3::new(to, legs[i], 0.0), wire, wire);
    let shape = leg(0, centers[0], free[0])
        + &bend(centers[0], (legs[0] + legs[1]) / 2.0, outer, wire, -1.0)
        + &leg(1, centers[0], centers[1])
        + &bend(centers[1], (legs[1] + legs[2]) / 2.0, second, wire, 1.0)
        + &leg(2, centers[1], centers[2])
        + &bend(centers[2], (legs[2] + legs[3]) / 2.0, inner, wire, -1.0)
        + &leg(3, centers[2], free[1]);
    Form {
        shape,
        bounds: [Vec3::new(-wire, -outer - wire, -wire), Vec3::new(length + wire, outer + wire, wire)],
        cells: 210.0,
    }
}
