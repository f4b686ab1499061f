//! A wristwatch, its strap closed as around a wrist: case, bezel, dial with hands and hour marks, crown, lugs, buckle.

use super::shape::{Shape, cuboid, curve, cylinder, ellipse, rod, torus};
use super::{contour::Form, proportions::Proportions};
use fidget_core::context::Tree;
use glam::{Vec2, Vec3};

pub(super) fn form(p: &mut Proportions) -> Form {
    let radius = p.within(2.0, 0.15);
    let half_height = p.within(0.48, 0.15);
    let wrist = Vec2::new(radius * p.within(1.58, 0.08), p.within(2.75, 0.12));
    let strap_width = p.within(1.0, 0.1);
    let strap = p.within(0.15, 0.12);
    let crown = p.about(0.33);

    // The strap goes round in the plane of x and z; twelve o'clock is toward +x, the crown toward −y.
    let (x, y, z) = Tree::axes();
    let narrowing = curve(&z, &[(-wrist.y, 0.78), (wrist.y, 1.0)]);
    let loop_ = ellipse(wrist.x, wrist.y).0.remap_xyz(x.clone(), z.clone(), y.clone());
    let band = Shape(loop_.abs() - strap + 0.08);
    let across = y.clone().abs() - narrowing * strap_width + 0.08;
    let band = Shape({
        let (a, b) = (band.0, across);
        a.max(b.clone()).min(0.0) + (a.max(0.0).square() + b.max(0.0).square() + 1e-12).sqrt() - 0.08
    });

    let top = wrist.y + half_height * 0.55;
    let dial = top + half_height - 0.16;
    let case = cylinder(radius, half_height, 0.2).moved(Vec3::Z * top);
    let bezel = torus(radius - 0.2, 0.16).moved(Vec3::Z * (top + half_height - 0.04));
    let well = cylinder(radius - 0.34, 0.3, 0.02).moved(Vec3::Z * (dial + 0.3));
    let mut face = case.joined(&bezel, 0.1) - &well;
    for hour in 0..12 {
        let long = if hour % 3 == 0 { 0.26 } else { 0.17 };
        let mark = cuboid(Vec3::new(long, 0.09, 0.11), 0.05).moved(Vec3::X * (radius - 0.46 - long));
        face = face + &mark.turned_z(30.0 * hour as f32).moved(Vec3::Z * dial);
    }
    // Ten past ten, as in every shop window.
    let hand = |length: f32, width: f32, degrees: f32| {
        rod(Vec3::X * -0.2, Vec3::X * length, width, width * 0.6).turned_z(degrees).moved(Vec3::Z * (dial + 0.04))
    };
    let hands = hand(radius * 0.42, 0.1, 55.0) + &hand(radius * 0.62, 0.08, -60.0);
    let hub = cylinder(0.16, 0.16, 0.03).moved(Vec3::Z * dial);

    let stem = cylinder(crown, 0.24, 0.08);
    let mut knob = stem.clone();
    for ridge in 0..12 {
        let groove = rod(Vec3::new(crown + 0.02, 0.0, -0.4), Vec3::new(crown + 0.02, 0.0, 0.4), 0.045, 0.045);
        knob = knob - &groove.turned_z(30.0 * ridge as f32);
    }
    let knob =
        (knob + &cylinder(crown * 0.5, 0.5, 0.05)).in_axes(x.clone(), z.clone() - top, y.clone() + radius + 0.26);

    // The lugs reach down to the strap, where a bar holds it.
    let out = radius + 0.22;
    let down = wrist.y * (1.0 - (out / wrist.x).powi(2)).sqrt() + 0.08;
    let side = strap_width + 0.12;
    let lug = rod(Vec3::new(radius * 0.78, side, top), Vec3::new(out, side, down), 0.3, 0.2);
    let lug = lug + &rod(Vec3::new(out, 0.0, down), Vec3::new(out, side, down), 0.12, 0.12);
    let lugs = lug.twice_x().twice_y();
    let buckle = cuboid(Vec3::new(0.55, strap_width * 0.78 + 0.24, 0.16), 0.1)
        - &cuboid(Vec3::new(0.36, strap_width * 0.78 + 0.05, 0.5), 0.05);
    let buckle = buckle.moved(Vec3::new(-0.3, 0.0, -wrist.y - 0.12));
    let pin = rod(Vec3::new(-0.8, 0.0, -wrist.y - 0.2), Vec3::new(0.2, 0.0, -wrist.y - 0.22), 0.07, 0.07);
    Form {
        shape: (face + &hands + &hub + &knob).joined(&lugs, 0.15) + &band + &buckle + &pin,
        bounds: [
            Vec3::new(-wrist.x - 0.5, -radius - 0.8, -wrist.y - 0.5),
            Vec3::new(wrist.x + 0.5, radius + 0.8, top + half_height + 0.3),
        ],
        cells: 136.0,
    }
}
