//! Shapes of no kind, for training a background column.
//!
//! Each is drawn from one of ten families (lumps, carved lumps, turned solids, vessels, wires, rings, plates, bars with
//! a head, combs, stars) with random parts, lengths and angles. Together they should be as varied as the objects that a
//! robot may meet; none is made after one of the ten built-in objects.

use super::contour::Form;
use super::shape::{Shape, bar, below, cuboid, curve, cylinder, disc, ellipse, ellipsoid, rectangle, rod, torus};
use fidget_core::context::Tree;
use glam::{Vec2, Vec3};
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};

/// A family: its shape, and how thick the thinnest part of it is.
type Family = fn(&mut Dice) -> (Shape, f32);

const FAMILIES: [Family; 10] = [lumps, carved, turned, vessel, wire, rings, plate, headed, comb, star];

/// Half the side of the box that a shape is made in. Its own size does not matter: it is scaled before it is touched.
const REACH: f32 = 7.0;

/// The shape that `seed` gives.
pub(super) fn form(seed: u64) -> Form {
    let mut dice = Dice(Xoshiro256PlusPlus::seed_from_u64(seed));
    // In turn, so that few shapes are as varied as many.
    let family = FAMILIES[(seed % FAMILIES.len() as u64) as usize];
    let (shape, thinnest) = family(&mut dice);
    // Three cells through the thinnest part.
    let cells = (3.0 * 2.0 * REACH / thinnest).clamp(80.0, 200.0);
    Form { shape, bounds: [Vec3::splat(-REACH), Vec3::splat(REACH)], cells }
}

/// Random numbers of one shape.
struct Dice(Xoshiro256PlusPlus);

impl Dice {
    /// Any number of the range is as likely.
    fn between(&mut self, least: f32, most: f32) -> f32 {
        self.0.random_range(least..=most)
    }

    /// Any ratio is as likely: as often from 1 to 2 as from 2 to 4.
    fn ratio(&mut self, least: f32, most: f32) -> f32 {
        libm::expf(self.between(libm::logf(least), libm::logf(most)))
    }

    fn whole(&mut self, least: u32, most: u32) -> u32 {
        self.0.random_range(least..=most)
    }

    fn half_the_time(&mut self) -> bool {
        self.0.random_range(0..2) == 0
    }

    /// A place in a box about the origin, by its half sides.
    fn place(&mut self, half: Vec3) -> Vec3 {
        Vec3::new(self.between(-half.x, half.x), self.between(-half.y, half.y), self.between(-half.z, half.z))
    }

    fn sizes(&mut self, least: f32, most: f32) -> Vec3 {
        Vec3::new(self.ratio(least, most), self.ratio(least, most), self.ratio(least, most))
    }

    /// A direction, none likelier than another: of points in the unit ball.
    fn direction(&mut self) -> Vec3 {
        loop {
            let place = self.place(Vec3::ONE);
            if (0.01..=1.0).contains(&place.length_squared()) {
                return place.normalize();
            }
        }
    }

    fn turned(&mut self, shape: &Shape) -> Shape {
        let angles = [self.between(0.0, 360.0), self.between(0.0, 360.0), self.between(0.0, 360.0)];
        shape.turned_z(angles[0]).turned_x(angles[1]).turned_z(angles[2])
    }

    /// A solid about the origin, turned any way, its half sides between these.
    fn solid(&mut self, least: f32, most: f32) -> Shape {
        let half = self.sizes(least, most);
        let round = half.min_element() * self.between(0.1, 0.9);
        let solid = match self.whole(0, 3) {
            0 => ellipsoid(half),
            1 => cuboid(half, round),
            2 => cylinder(half.x, half.z, round.min(half.x.min(half.z) * 0.9)),
            _ => rod(Vec3::Z * -half.z, Vec3::Z * half.z, half.x * 0.7, half.x * self.between(0.2, 1.0)),
        };
        self.turned(&solid)
    }
}

/// A few solids, grown together.
fn lumps(dice: &mut Dice) -> (Shape, f32) {
    let mut shape = dice.solid(1.0, 4.5);
    for _ in 0..dice.whole(0, 4) {
        let by = dice.place(Vec3::splat(2.5));
        let fillet = dice.between(0.1, 1.5);
        shape = shape.joined(&dice.solid(0.7, 3.0).moved(by), fillet);
    }
    (shape, 0.6)
}

/// A solid from which others were cut.
fn carved(dice: &mut Dice) -> (Shape, f32) {
    let half = dice.sizes(1.5, 4.5);
    let mut shape = if dice.half_the_time() { cuboid(half, 0.3) } else { ellipsoid(half) };
    for _ in 0..dice.whole(1, 4) {
        let toward = dice.direction() * half;
        let round = dice.between(0.05, 0.4);
        shape = shape.carved(&dice.solid(0.5, 2.5).moved(toward), round);
    }
    (shape, 0.5)
}

/// The radius of a turned solid over z from −5 to 5.
fn profile(dice: &mut Dice) -> Tree {
    let widest = dice.ratio(0.5, 4.0);
    let count = dice.whole(2, 5);
    let knots: Vec<(f32, f32)> =
        (0..=count).map(|knot| (-5.0 + 10.0 * knot as f32 / count as f32, widest * dice.between(0.25, 1.0))).collect();
    curve(&Tree::z(), &knots)
}

/// Solid within `radius` of the z axis, from `bottom` to `top`.
fn turned_solid(radius: Tree, bottom: f32, top: f32) -> Shape {
    let (x, y, _) = Tree::axes();
    let side = Shape((x.square() + y.square() + 1e-9).sqrt() - radius);
    side.cut(&below(Vec3::Z, top), 0.1).cut(&below(Vec3::NEG_Z, -bottom), 0.1)
}

/// A solid turned on a lathe.
fn turned(dice: &mut Dice) -> (Shape, f32) {
    (turned_solid(profile(dice), -5.0, 5.0), 0.4)
}

/// A hollow one, open at the top, with or without a handle.
fn vessel(dice: &mut Dice) -> (Shape, f32) {
    let radius = profile(dice) + 0.6;
    let wall = dice.ratio(0.2, 0.6);
    let height = dice.ratio(2.0, 10.0) / 2.0;
    let outer = turned_solid(radius.clone(), -height, height);
    let inner = turned_solid(radius - wall, wall - height, height + 2.0);
    let mut shape = outer.carved(&inner, 0.08);
    if dice.half_the_time() {
        let thickness = dice.between(0.2, 0.5);
        let ring = torus(height * dice.between(0.3, 0.6), thickness).turned_x(90.0);
        let at = dice.between(1.2, 3.5);
        let ring = ring.moved(Vec3::X * at).carved(&inner, 0.05);
        shape = shape.joined(&ring, 0.2);
    }
    (shape, wall)
}

/// A bent wire.
fn wire(dice: &mut Dice) -> (Shape, f32) {
    let radius = dice.ratio(0.12, 0.6);
    let flat = dice.half_the_time();
    let mut at = Vec3::ZERO;
    let mut shape: Option<Shape> = None;
    for _ in 0..dice.whole(2, 8) {
        let mut direction = dice.direction();
        if flat {
            direction.z = 0.0;
        }
        let mut next = at + direction * dice.between(1.5, 6.0);
        next = next.clamp(Vec3::splat(-5.0), Vec3::splat(5.0));
        let part = rod(at, next, radius, radius);
        shape = Some(match shape {
            Some(shape) => shape.joined(&part, radius * 0.5),
            None => part,
        });
        at = next;
    }
    (shape.unwrap_or_else(|| ellipsoid(Vec3::ONE)), 2.0 * radius)
}

/// Rings and rods through each other.
fn rings(dice: &mut Dice) -> (Shape, f32) {
    let thickness = dice.ratio(0.15, 0.9);
    let first = torus(dice.between(2.0, 4.5), thickness);
    let mut shape = dice.turned(&first);
    for _ in 0..dice.whole(0, 3) {
        let by = dice.place(Vec3::splat(2.0));
        let part = if dice.half_the_time() {
            let ring = torus(dice.between(1.0, 4.0), thickness);
            dice.turned(&ring).moved(by)
        } else {
            rod(by - dice.direction() * 4.5, by, thickness, thickness * dice.between(0.7, 1.3))
        };
        shape = shape.joined(&part, 0.2);
    }
    (shape, 1.4 * thickness)
}

/// A plate with a random outline and holes, flat or bent.
fn plate(dice: &mut Dice) -> (Shape, f32) {
    let half = dice.ratio(0.12, 0.9);
    let mut outline = rectangle(Vec2::new(dice.ratio(1.0, 5.0), dice.ratio(0.6, 4.0)), 0.3);
    for _ in 0..dice.whole(0, 4) {
        let at = dice.place(Vec3::new(4.0, 2.5, 0.0)).truncate();
        let part = match dice.whole(0, 2) {
            0 => disc(dice.ratio(0.5, 2.5)).moved(at.extend(0.0)),
            1 => ellipse(dice.ratio(0.5, 3.5), dice.ratio(0.5, 2.5)).moved(at.extend(0.0)),
            _ => bar(Vec2::ZERO, at, dice.ratio(0.3, 1.2), dice.ratio(0.3, 1.2)),
        };
        outline = outline.joined(&part, 0.4);
    }
    for _ in 0..dice.whole(0, 3) {
        let at = dice.place(Vec3::new(3.5, 2.0, 0.0));
        outline = outline.carved(&disc(dice.ratio(0.3, 1.5)).moved(at), 0.1);
    }
    let round = half * dice.between(0.2, 0.8);
    let shape = if dice.half_the_time() {
        outline.extrude(half, round)
    } else {
        let bend = dice.between(-2.5, 2.5);
        let other = dice.between(-2.5, 2.5);
        let height = curve(&Tree::x(), &[(-4.5, bend), (0.0, 0.0), (4.5, other)]);
        outline.sheet(&height, half, round)
    };
    (shape, 2.0 * half)
}

/// A bar with something at one end, or at both.
fn headed(dice: &mut Dice) -> (Shape, f32) {
    let radius = dice.ratio(0.2, 0.9);
    let handle = if dice.half_the_time() {
        rod(Vec3::X * -5.0, Vec3::X * 5.0, radius, radius * dice.between(0.5, 1.0))
    } else {
        cuboid(Vec3::new(5.0, radius * dice.ratio(0.6, 2.5), radius * 0.6), radius * 0.3)
    };
    let head = dice.solid(0.6, 2.4).moved(Vec3::X * 4.2);
    let mut shape = handle.joined(&head, 0.3);
    if dice.half_the_time() {
        shape = shape.joined(&dice.solid(0.5, 2.0).moved(Vec3::X * -4.2), 0.3);
    }
    (shape, 0.7 * radius)
}

/// Teeth along a bar.
fn comb(dice: &mut Dice) -> (Shape, f32) {
    let (thickness, length) = (dice.ratio(0.2, 0.7), dice.ratio(1.5, 6.0));
    let count = dice.whole(3, 9);
    let mut shape = rod(Vec3::X * -4.5, Vec3::X * 4.5, thickness * 1.4, thickness * 1.4);
    for tooth in 0..count {
        let x = -4.2 + 8.4 * tooth as f32 / (count - 1) as f32;
        let lean = Vec3::new(dice.between(-0.4, 0.4), length, dice.between(-0.6, 0.6));
        let foot = Vec3::X * x;
        shape = shape.joined(&rod(foot, foot + lean, thickness, thickness * 0.7), 0.1);
    }
    (shape, 1.4 * thickness)
}

/// Rods from one place, or legs below a slab.
fn star(dice: &mut Dice) -> (Shape, f32) {
    let radius = dice.ratio(0.25, 1.0);
    let slab = dice.half_the_time();
    let half = Vec3::new(dice.between(2.0, 4.5), dice.between(2.0, 4.5), dice.between(0.2, 0.8));
    let mut shape = if slab { cuboid(half, 0.15) } else { ellipsoid(Vec3::splat(radius * dice.between(1.0, 2.5))) };
    for _ in 0..dice.whole(3, 7) {
        let (from, to) = if slab {
            let from = dice.place(Vec3::new(0.85 * half.x, 0.85 * half.y, 0.0));
            (from, from - Vec3::Z * dice.between(1.5, 5.0))
        } else {
            (Vec3::ZERO, dice.direction() * dice.between(2.0, 5.0))
        };
        shape = shape.joined(&rod(from, to, radius, radius * dice.between(0.4, 1.0)), 0.2);
    }
    (shape, (1.2 * radius).min(0.6))
}
