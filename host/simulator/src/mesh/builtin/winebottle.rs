//! A Bordeaux bottle: high shoulders, a ring below the mouth, a punt in its bottom.

use super::shape::{Shape, below, curve, cylinder, ellipsoid, rod};
use super::{contour::Form, proportions::Proportions};
use fidget_core::context::Tree;
use fidget_core::var::Var;
use glam::Vec3;

pub(super) fn form(p: &mut Proportions) -> Form {
    let radius = p.within(3.75, 0.15);
    let body = p.about(18.5);
    let shoulder = p.about(4.6);
    let neck = p.about(6.9);
    let neck_radius = p.within(1.38, 0.12);
    let punt = p.about(2.6);
    let lip = p.within(0.24, 0.2);

    let height = body + shoulder + neck;
    let outline = curve(&Tree::y(), &[(body, radius), (body + shoulder, neck_radius + 0.08), (height, neck_radius)]);
    let slope = outline.deriv(Var::Y);
    let outline = Shape((Tree::x() - outline) / (slope.square() + 1.0).sqrt());
    let side = outline.revolve();
    let glass = side.cut(&below(-Vec3::Z, 0.0), 0.9).cut(&below(Vec3::Z, height), 0.25);
    let ring = cylinder(neck_radius + lip, 0.42, 0.2).moved(Vec3::Z * (height - 1.0));
    let bore = rod(Vec3::Z * (height - 5.0), Vec3::Z * (height + 1.0), 0.93, 0.93);
    let punt = ellipsoid(Vec3::new(radius * 0.72, radius * 0.72, punt));
    Form {
        shape: glass.joined(&ring, 0.2).carved(&bore, 0.25).carved(&punt, 0.6),
        bounds: [Vec3::new(-radius, -radius, 0.0), Vec3::new(radius, radius, height)],
        cells: 188.0,
    }
}
