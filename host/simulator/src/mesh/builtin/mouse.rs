//! A computer mouse: a domed body with two buttons, the seams around them, a wheel, and two keys for the thumb.

use super::shape::{Shape, bar, cuboid, cylinder, ellipsoid, rectangle};
use super::{contour::Form, proportions::Proportions};
use fidget_core::context::Tree;
use glam::{Vec2, Vec3};

pub(super) fn form(p: &mut Proportions) -> Form {
    let half_length = p.within(5.8, 0.12);
    let half_width = p.within(3.15, 0.12);
    let height = p.about(3.9);
    let waist = p.about(0.28);
    let hump = p.about(-0.9);
    let wheel = p.within(1.15, 0.12);
    let wheel_at = half_length * p.within(0.56, 0.08);
    let split = half_length * p.about(0.06);

    // The front, where the buttons are, is +x.
    let (x, y, z) = Tree::axes();
    let narrowing = 1.0 - waist / half_width * 0.6 / (1.0 + (x.clone() - 0.8).square() * 0.12);
    let outline = rectangle(Vec2::new(half_length, half_width), half_width * 0.8).in_axes(
        x.clone(),
        y.clone() / narrowing,
        z.clone(),
    );
    let walls = outline.extrude(height, 0.3).moved(Vec3::Z * height);
    let dome =
        ellipsoid(Vec3::new(half_length * 1.28, half_width * 1.5, height + 1.6)).moved(Vec3::new(hump, 0.0, -1.6));
    let body = walls.cut(&dome, 1.1);

    // Seams are as deep as they are wide: what lies within their width of the surface and in their plane.
    let seam = 0.09;
    let skin = Shape(-body.grown(-2.2 * seam).0);
    let plane = |tree: Tree| Shape(tree.abs() - seam);
    let front = Shape(split - x.clone());
    let top = Shape(1.15 - z.clone());
    let middle = plane(y.clone()).and(&front).and(&top);
    let across = plane(x.clone() - split - y.square() * 0.05).and(&top);
    let around = plane(z.clone() - 1.15 - x.clone() * 0.02);
    let seams = (middle + &across + &around).and(&skin);

    // Where the dome is at the wheel.
    let rise = (1.0 - ((wheel_at - hump) / (half_length * 1.28)).powi(2)).max(0.0).sqrt() * (height + 1.6) - 1.6;
    let slot = bar(Vec2::new(-wheel * 0.75, 0.0), Vec2::new(wheel * 0.75, 0.0), 0.52, 0.52)
        .extrude(height, 0.1)
        .moved(Vec3::new(wheel_at, 0.0, rise - 1.2 + height));
    let tyre = cylinder(wheel, 0.36, 0.16).in_axes(x.clone() - wheel_at, z.clone() - (rise - wheel * 0.5), y.clone());
    let key = cuboid(Vec3::new(0.95, 0.3, 0.24), 0.2);
    let side = half_width * 0.94;
    let keys = key.moved(Vec3::new(1.35, side, 1.75)) + &key.moved(Vec3::new(-0.75, side, 1.8));
    Form {
        shape: body.carved(&seams, 0.12).joined(&keys, 0.1).carved(&slot, 0.15) + &tyre,
        bounds: [
            Vec3::new(-half_length, -half_width - 0.2, 0.0),
            Vec3::new(half_length, half_width + 0.2, height + 0.6),
        ],
        cells: 175.0,
    }
}
