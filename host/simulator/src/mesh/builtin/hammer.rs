//! A claw hammer, lying on its side: a round face, a cheek with the handle's eye, a split and curved claw.

use super::shape::{Shape, bar, below, cuboid, curve, cylinder, rod};
use super::{contour::Form, proportions::Proportions};
use fidget_core::context::Tree;
use glam::{Vec2, Vec3};

pub(super) fn form(p: &mut Proportions) -> Form {
    let handle = p.about(28.0);
    let grip = p.within(1.5, 0.15);
    let face = p.about(1.5);
    let face_at = p.about(5.4);
    let claw = p.about(6.4);
    let droop = p.about(2.6);
    let cheek = p.within(1.35, 0.12);
    let flare = p.within(1.5, 0.12);

    // The head lies along y with its face at +y; the handle goes from the origin toward +x.
    let (x, y, z) = Tree::axes();
    let face_disc = cylinder(face, 0.75, 0.15).in_axes(x.clone(), z.clone(), y.clone() - (face_at - 0.75));
    let poll = rod(Vec3::Y * 0.5, Vec3::Y * (face_at - 1.3), cheek * 0.9, cheek * 0.72);
    let eye = cuboid(Vec3::new(cheek * 1.05, cheek * 1.2, cheek), 0.35);

    // In the claw's own axes x points outwards from the head, y across, z toward the handle.
    let across = bar(Vec2::ZERO, Vec2::new(claw - flare * 0.9, 0.0), cheek * 0.85, flare);
    let squared = across.cut(&below(Vec3::X, claw - 0.25), 0.4);
    let slot = bar(Vec2::new(claw * 0.45, 0.0), Vec2::new(claw * 1.1, 0.0), 0.14, 0.62);
    let bent = x.square() * (droop / (claw * claw)) - 0.25;
    let taper = curve(&x, &[(-claw * 0.2, cheek * 0.95), (claw * 1.1, 0.12)]);
    let claw_shape = squared.carved(&slot, 0.1).sheet(&bent, taper, 0.1).in_axes(-y.clone(), z.clone(), x.clone());

    let head: Shape = face_disc.joined(&poll, 0.7).joined(&eye, 0.9).joined(&claw_shape, 0.8);

    let depth_of = curve(
        &x,
        &[
            (0.0, grip * 0.72),
            (handle * 0.3, grip * 0.68),
            (handle * 0.72, grip),
            (handle * 0.88, grip * 0.9),
            (handle, grip * 1.12),
        ],
    );
    let ratio = (y / depth_of.clone()).square() + (z / (depth_of.clone() * 0.72)).square();
    let shaft = Shape(((ratio + 1e-9).sqrt() - 1.0) * depth_of * 0.8);
    let shaft = shaft.cut(&below(Vec3::X, handle), 0.5).cut(&below(Vec3::NEG_X, cheek * 1.05 + 0.25), 0.15);
    Form {
        shape: head.joined(&shaft, 0.1),
        bounds: [
            Vec3::new(-cheek * 1.4 - 0.6, -claw - 0.3, -flare - 0.4),
            Vec3::new(handle + 0.2, face_at + 0.3, flare + 0.4),
        ],
        cells: 215.0,
    }
}
