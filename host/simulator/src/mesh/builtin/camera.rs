//! A single-lens reflex camera: body with grip, prism hump and hot shoe, lens with rings, shutter button, dials, screen.

use super::shape::{Shape, below, cuboid, cylinder, ellipsoid, rod, torus};
use super::{contour::Form, proportions::Proportions};
use fidget_core::context::Tree;
use glam::Vec3;

pub(super) fn form(p: &mut Proportions) -> Form {
    let half_width = p.within(6.7, 0.12);
    let half_depth = p.within(2.0, 0.15);
    let height = p.within(8.4, 0.12);
    let prism = p.about(2.5);
    let prism_half = p.within(2.7, 0.12);
    let barrel = p.within(3.1, 0.12);
    let lens = p.about(5.6);
    let grip = p.about(1.7);

    // The lens looks toward −y, up is z; the grip is on the photographer's right, −x.
    let (x, y, z) = Tree::axes();
    let body = cuboid(Vec3::new(half_width, half_depth, height / 2.0), 0.7).moved(Vec3::Z * height / 2.0);
    let grip_shape = cuboid(Vec3::new(1.45, grip, height * 0.46), 0.95).moved(Vec3::new(
        -half_width + 1.35,
        -half_depth,
        height * 0.5,
    ));
    let axis = Vec3::new(0.4, 0.0, height * 0.48);

    let slant = Vec3::new(0.86, 0.0, 0.51);
    let hump = Shape(x.clone().abs() * slant.x + z.clone() * slant.z - (prism_half * slant.x + height * slant.z))
        .cut(&below(Vec3::Z, height + prism), 0.5)
        .cut(&below(Vec3::new(0.0, -0.92, 0.39), half_depth * 0.92 + 0.5 + height * 0.39), 0.3)
        .cut(&below(Vec3::Y, half_depth + 0.1), 0.4)
        .cut(&below(Vec3::NEG_Z, 0.9 - height), 0.5)
        .moved(Vec3::X * axis.x);
    let shoe = cuboid(Vec3::new(0.95, 0.9, 0.12), 0.04) - &cuboid(Vec3::new(0.7, 1.2, 0.06), 0.02).moved(Vec3::Z * 0.1);
    let shoe = shoe.moved(Vec3::new(axis.x, 0.5, height + prism + 0.1));
    let eyepiece = cuboid(Vec3::new(1.25, 0.6, 0.85), 0.25)
        .carved(&cuboid(Vec3::new(0.85, 0.5, 0.5), 0.2).moved(Vec3::Y * 0.7), 0.1)
        .moved(Vec3::new(axis.x, half_depth + 0.3, height + prism * 0.35));
    let screen = cuboid(Vec3::new(3.6, 0.2, 2.6), 0.15).moved(Vec3::new(-0.6, half_depth, height * 0.45));

    // Rings of the lens: from where to where along it, and the radius.
    let ring = |from: f32, to: f32, radius: f32| {
        cylinder(radius, (to - from) / 2.0, 0.22).moved(Vec3::Z * ((from + to) / 2.0))
    };
    let mut tube = ring(-0.5, 0.7, barrel * 1.12) + &ring(0.3, lens, barrel * 0.95);
    tube = tube + &ring(1.0, lens * 0.32, barrel) + &ring(lens * 0.87, lens + 0.25, barrel * 1.06);
    let mut zoom = ring(lens * 0.42, lens * 0.78, barrel * 1.05);
    for rib in 0..24 {
        let groove =
            rod(Vec3::new(barrel * 1.07, 0.0, lens * 0.46), Vec3::new(barrel * 1.07, 0.0, lens * 0.74), 0.16, 0.16);
        zoom = zoom - &groove.turned_z(15.0 * rib as f32);
    }
    let bore = cylinder(barrel * 0.82, 0.9, 0.1).moved(Vec3::Z * (lens + 0.25));
    let glass = ellipsoid(Vec3::new(barrel * 0.78, barrel * 0.78, 0.7)).moved(Vec3::Z * (lens - 0.75));
    let tube = ((tube + &zoom) - &bore) + &glass;
    let tube = tube.in_axes(x.clone() - axis.x, z.clone() - axis.z, -y.clone() - half_depth);

    let button = (cylinder(0.85, 0.28, 0.2) + &cylinder(0.55, 0.6, 0.25)).turned_x(18.0);
    let button = button.moved(Vec3::new(-half_width + 1.4, -half_depth - grip * 0.35, height * 0.96 + 0.15));
    let mut dial = cylinder(1.25, 0.55, 0.2);
    for ridge in 0..12 {
        let groove = rod(Vec3::new(1.3, 0.0, -1.0), Vec3::new(1.3, 0.0, 1.0), 0.2, 0.2);
        dial = dial.carved(&groove.turned_z(30.0 * ridge as f32), 0.1);
    }
    let dial = dial.moved(Vec3::new(half_width - 1.9, 0.3, height + 0.4));
    let wheel = cylinder(0.85, 0.4, 0.2).moved(Vec3::new(-half_width + 2.2, 0.6, height + 0.2));
    let eyelet = torus(0.38, 0.13).in_axes(y.clone(), z.clone() - height * 0.86, x.abs() - half_width - 0.06);

    let solid = body.joined(&grip_shape, 1.0).joined(&hump, 0.5);
    let solid = solid.joined(&eyepiece, 0.2).joined(&screen, 0.1) + &shoe + &tube + &button + &dial + &wheel + &eyelet;
    Form {
        shape: solid,
        bounds: [
            Vec3::new(-half_width - 0.6, -half_depth - lens - 0.4, 0.0),
            Vec3::new(half_width + 0.6, half_depth + 1.0, height + prism + 0.4),
        ],
        cells: 124.0,
    }
}
