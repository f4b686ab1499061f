//! A table fork: four tines on a hollowed head, a neck that rises from it, a handle that widens and droops.

use super::shape::{Shape, bar, curve, rectangle};
use super::{contour::Form, proportions::Proportions};
use fidget_core::context::Tree;
use glam::{Vec2, Vec3};

pub(super) fn form(p: &mut Proportions) -> Form {
    let tine = p.about(4.6);
    let tine_width = p.within(0.19, 0.12);
    let gap = p.within(0.31, 0.12);
    let palm = p.about(2.6);
    let handle = p.about(12.4);
    let neck_width = p.within(0.36, 0.15);
    let end_width = p.about(0.98);
    let dip = p.about(0.55);
    let arch = p.about(1.25);
    let thickness = p.within(0.15, 0.1);

    // The tines begin at x = 0 and point toward −x; the head goes on to the neck at x = `palm`.
    let spacing = 2.0 * tine_width + gap;
    let half_width = 1.5 * spacing + tine_width;
    let head =
        rectangle(Vec2::new(palm * 0.5 + 0.2, half_width), half_width * 0.45).moved(Vec3::X * (palm * 0.5 - 0.2));
    let end = palm + handle;
    let stem = bar(Vec2::new(palm * 0.8, 0.0), Vec2::new(end - end_width, 0.0), neck_width, end_width);
    let tines = |y: f32| bar(Vec2::new(-tine + 0.1, y), Vec2::new(0.4, y), tine_width * 0.62, tine_width);
    let comb: Shape = (tines(spacing * 0.5) + &tines(spacing * 1.5)).twice_y();
    // The head's leading edge is cut back between the tines, so that their roots are round.
    let root = bar(Vec2::new(-tine, 0.0), Vec2::new(0.0, 0.0), gap * 0.5, gap * 0.5);
    let roots = root.clone() + &root.moved(Vec3::Y * spacing).twice_y();
    let outline = head.joined(&stem, 2.2).carved(&roots, 0.05) + &comb;

    let height = curve(
        &Tree::x(),
        &[(-tine - 0.6, dip * 1.3), (palm * 0.1, -dip), (palm + handle * 0.22, arch), (end, 0.1 * arch)],
    );
    Form {
        shape: outline.sheet(&height, thickness, thickness * 0.8),
        bounds: [
            Vec3::new(-tine - 0.4, -half_width - 0.4, -dip - 0.4),
            Vec3::new(end + 0.3, half_width + 0.4, arch + 0.5),
        ],
        cells: 250.0,
    }
}
