//! A cereal bowl: a thin round shell with a thicker rim, on a foot ring.

use super::shape::{Shape, bar, below, ellipse, torus};
use super::{contour::Form, proportions::Proportions};
use glam::{Vec2, Vec3};

pub(super) fn form(p: &mut Proportions) -> Form {
    let radius = p.about(8.0);
    let height = p.about(6.4);
    let wall = p.about(0.5);
    let foot = p.about(3.5);
    let foot_height = p.about(0.8);
    let rim = wall * p.within(0.74, 0.1);

    let middle = Vec3::new(0.0, height, 0.0);
    let outside = ellipse(radius, height - foot_height * 0.5).moved(middle).revolve();
    let inside = ellipse(radius - wall, height - foot_height * 0.5 - wall).moved(middle).revolve();
    let shell = (outside - &inside).and(&below(Vec3::Z, height));
    let rim: Shape = torus(radius - wall / 2.0, rim).moved(Vec3::Z * height);
    // The ring reaches up to where the shell passes above it.
    let top = height - (height - foot_height * 0.5) * (1.0 - (foot / radius).powi(2)).sqrt();
    let ring = bar(Vec2::new(foot - 0.1, 0.3), Vec2::new(foot, top.max(foot_height)), 0.3, 0.35).revolve();
    let ring = ring - &inside;
    Form {
        shape: shell.joined(&rim, 0.2).joined(&ring, 0.5),
        bounds: [Vec3::new(-radius - 0.5, -radius - 0.5, -0.1), Vec3::new(radius + 0.5, radius + 0.5, height + 0.7)],
        cells: 74.0,
    }
}
