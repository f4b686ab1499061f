//! Implicit shapes, their values and their meshes, compiled from their sources.

#[path = "../../src/mesh/builtin/contour.rs"]
mod contour;
#[expect(dead_code, reason = "built-in objects are made of more kinds")]
#[path = "../../src/mesh/builtin/shape.rs"]
mod shape;
#[path = "../../src/mesh/builtin/slices.rs"]
mod slices;

use contour::{Form, mesh};
use fidget_core::context::Tree;
use fidget_core::vm::{EmptyTapeStorage, VmShape};
use glam::Vec3;
use shape::ellipsoid;
use slices::Shape;

/// Points at and around those where steps do something special.
fn points() -> Vec<f32> {
    let mut points = vec![0.0, -0.0, 1.0, -1.0, 0.5, 1e-30, -1e30, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    points.extend((0..41).map(|step| (step as f32 - 20.0) * 0.37));
    points
}

fn holds_the_interpreters_values(tree: &Tree) {
    let (fast, slow) = (Shape::from(tree.clone()), VmShape::from(tree.clone()));
    let (fast_tape, slow_tape) = (fast.float_slice_tape(EmptyTapeStorage), slow.float_slice_tape(EmptyTapeStorage));
    let (mut fast, mut slow) = (Shape::new_float_slice_eval(), VmShape::new_float_slice_eval());
    let xs = points();
    let ys: Vec<f32> = xs.iter().rev().copied().collect();
    let zs: Vec<f32> = xs.iter().cycle().skip(7).take(xs.len()).copied().collect();
    for count in [1, 7, 8, 9, 16, xs.len()] {
        let [x, y, z] = [&xs[..count], &ys[..count], &zs[..count]];
        let bits = |values: &[f32]| -> Vec<Option<u32>> {
            values.iter().map(|value| (!value.is_nan()).then_some(value.to_bits())).collect()
        };
        let expected = bits(slow.eval(&slow_tape, x, y, z).unwrap());
        assert_eq!(bits(fast.eval(&fast_tape, x, y, z).unwrap()), expected, "{count} points of {tree:?}");
    }
}

#[test]
fn every_step_gives_the_interpreters_values_to_the_bit_at_zeros_infinities_and_what_is_no_number() {
    let (x, y, z) = Tree::axes();
    let one: [fn(Tree) -> Tree; 17] = [
        |a| -a,
        |a| a.abs(),
        |a| 1.0 / a,
        |a| a.sqrt(),
        |a| a.square(),
        |a| a.floor(),
        |a| a.ceil(),
        |a| a.round(),
        |a| a.sin(),
        |a| a.cos(),
        |a| a.tan(),
        |a| a.asin(),
        |a| a.acos(),
        |a| a.atan(),
        |a| a.exp(),
        |a| a.ln(),
        |a| a.not(),
    ];
    for step in one {
        holds_the_interpreters_values(&step(x.clone()));
    }
    let two: [fn(Tree, Tree) -> Tree; 11] = [
        |a, b| a + b,
        |a, b| a - b,
        |a, b| a * b,
        |a, b| a / b,
        |a, b| a.min(b),
        |a, b| a.max(b),
        |a, b| a.atan2(b),
        |a, b| a.compare(b),
        |a, b| a.modulo(b),
        |a, b| a.and(b),
        |a, b| a.or(b),
    ];
    for step in two {
        holds_the_interpreters_values(&step(x.clone(), y.clone()));
        holds_the_interpreters_values(&step(x.clone(), Tree::constant(0.75)));
        holds_the_interpreters_values(&step(Tree::constant(-1.5), y.clone()));
    }
    // More values at once than there are registers go through memory.
    let many = (0..400).map(|k| (x.clone() + y.clone() * k as f32).square());
    let parts: Vec<Tree> = many.collect();
    let sum = parts.iter().fold(z.clone(), |sum, part| sum + part.clone());
    let least = parts.iter().rev().fold(z.clone(), |least, part| least.min(part.clone()));
    let product = sum * least;
    holds_the_interpreters_values(&product);
}

/// In a box of 2 units, so finely meshed that the mesher's cube is hardly larger.
fn form(shape: shape::Shape) -> Form {
    Form { shape, bounds: [Vec3::splat(-1.0), Vec3::splat(1.0)], cells: 512.0 }
}

#[test]
fn a_shape_that_has_no_closed_mesh_gives_no_empty_mesh() {
    let ball = ellipsoid(Vec3::splat(0.12));
    assert!(mesh(&form(ball.clone())).is_some());
    // Cut by the cube's side, whichever of the resolutions is tried, and outside of the cube.
    assert_eq!(mesh(&form(ball.moved(Vec3::X * 1.06))), None);
    assert_eq!(mesh(&form(ball.moved(Vec3::X * 9.0))), None);
}
