//! A Bordeaux bottle: high shoulders, a ring below the mouth, a label, a punt in its bottom.

use super::shape::{Shape, below, curve, cylinder, disc, ellipsoid, rectangle, rod};
use super::{Form, Proportions};
use fidget_core::context::Tree;
use fidget_core::var::Var;
use glam::{Vec2, Vec3};

pub(super) fn form(p: &mut Proportions) -> Form {
    let radius = p.within(3.75, 0.15);
    let body = p.about(18.5);
    let shoulder = p.about(4.6);
    let neck = p.about(6.9);
    let neck_radius = p.within(1.38, 0.12);
    let punt = p.about(2.6);
    let lip = p.within(0.24, 0.2);
    let label = [p.within(0.22, 0.2) * body, p.within(0.78, 0.1) * body];

    let height = body + shoulder + neck;
    let outline = curve(&Tree::y(), &[(body, radius), (body + shoulder, neck_radius + 0.08), (height, neck_radius)]);
    let slope = outline.deriv(Var::Y);
    let outline = Shape((Tree::x() - outline) / (slope.square() + 1.0).sqrt());
    let side = outline.revolve();
    let glass = side.cut(&below(-Vec3::Z, 0.0), 0.9).cut(&below(Vec3::Z, height), 0.25);
    let ring = cylinder(neck_radius + lip, 0.42, 0.2).moved(Vec3::Z * (height - 1.0));
    let bore = rod(Vec3::Z * (height - 5.0), Vec3::Z * (height + 1.0), 0.93, 0.93);
    let punt = ellipsoid(Vec3::new(radius * 0.72, radius * 0.72, punt));
    let paper = rectangle(Vec2::new(radius * 0.9, (label[1] - label[0]) / 2.0), 0.4)
        .in_axes(Tree::x(), Tree::z() - (label[0] + label[1]) / 2.0, Tree::constant(0.0))
        .and(&below(Vec3::Y, 0.0))
        .and(&side.grown(0.09));
    let foil = (side.grown(0.05)).and(&below(-Vec3::Z, -(height - neck * 0.95))).and(&below(Vec3::Z, height - 0.9));
    let foil = foil.and(&disc(neck_radius * 2.0));
    Form {
        shape: ((glass.joined(&ring, 0.2) + &foil) + &paper).carved(&bore, 0.25).carved(&punt, 0.6),
        bounds: [Vec3::new(-radius, -radius, 0.0), Vec3::new(radius, radius, height)],
        cells: 188.0,
    }
}
