//! A soup spoon: an egg-shaped hollow bowl, a narrow neck that rises from it, a handle that widens and droops.

use super::shape::{bar, curve, ellipse};
use super::{contour::Form, proportions::Proportions};
use fidget_core::context::Tree;
use glam::{Vec2, Vec3};

pub(super) fn form(p: &mut Proportions) -> Form {
    let half_length = p.about(3.3);
    let half_width = p.within(2.15, 0.15);
    let depth = p.about(1.0);
    let handle = p.about(12.2);
    let neck_width = p.within(0.36, 0.15);
    let end_width = p.about(0.95);
    let arch = p.about(1.5);
    let thickness = p.within(0.14, 0.12);

    // The bowl's middle is the origin, the handle goes toward +x; the tip (x < 0) is narrower than the other end.
    let (x, y, z) = Tree::axes();
    let egg = 1.0 + x.clone() * (0.13 / half_length);
    let bowl = ellipse(half_length, half_width).in_axes(x.clone(), y.clone() / egg.clone(), z);
    let neck = half_length - 0.3;
    let end = half_length + handle;
    let stem = bar(Vec2::new(neck, 0.0), Vec2::new(end - end_width, 0.0), neck_width, end_width);
    let outline = bowl.joined(&stem, 1.6);

    let inside = 1.0 - (x.clone() / half_length).square() - (y / (egg * half_width)).square();
    let hollow = (inside.clone() + (inside.square() + 0.02).sqrt()) * (-0.5 * depth);
    let rise = curve(&x, &[(half_length * 0.7, 0.0), (half_length + handle * 0.3, arch), (end, 0.15 * arch)]);
    Form {
        shape: outline.sheet(&(hollow + rise), thickness, thickness * 0.8),
        bounds: [
            Vec3::new(-half_length - 0.3, -half_width * 1.2 - 0.3, -depth - 0.4),
            Vec3::new(end + 0.3, half_width * 1.2 + 0.3, arch + 0.4),
        ],
        cells: 240.0,
    }
}
