//! An implicit shape's values at many points at once.
//!
//! Meshing a shape is mostly that: at the corners of each of the smallest cells that the surface may pass through, and
//! then along their edges. `fidget`'s interpreter takes one step at one point at a time there. [`Function`] is its
//! [`VmFunction`] in all but that: the same steps in the same order, each at [`LANES`] points, in registers. Every value
//! is the same, to the bit.

use fidget_core::compiler::RegOp;
use fidget_core::context::{Context, Node};
use fidget_core::eval::{self, BulkEvalError, BulkEvaluator, BulkOutput, MathFunction, Tape};
use fidget_core::render::{RenderHints, TileSizes};
use fidget_core::types::FloatExt;
use fidget_core::var::VarMap;
use fidget_core::vm::{
    BadTrace, EmptyTapeStorage, GenericVmTape, VmData, VmFunction, VmGradSliceEval, VmIntervalEval, VmPointEval,
    VmTrace, VmWorkspace,
};

/// An implicit shape that is evaluated here.
pub(super) type Shape = fidget_core::shape::Shape<Function>;

/// Registers of `fidget`'s interpreter.
const REGISTERS: usize = u8::MAX as usize;

/// A shape's function.
#[derive(Clone)]
pub(super) struct Function(VmFunction);

impl eval::Function for Function {
    type Trace = VmTrace;
    type Storage = VmData<REGISTERS>;
    type Workspace = VmWorkspace<REGISTERS>;
    type TapeStorage = EmptyTapeStorage;
    type PointEval = VmPointEval<REGISTERS>;
    type IntervalEval = VmIntervalEval<REGISTERS>;
    type FloatSliceEval = Slices;
    type GradSliceEval = VmGradSliceEval<REGISTERS>;

    fn point_tape(&self, storage: EmptyTapeStorage) -> GenericVmTape<REGISTERS> {
        self.0.point_tape(storage)
    }

    fn interval_tape(&self, storage: EmptyTapeStorage) -> GenericVmTape<REGISTERS> {
        self.0.interval_tape(storage)
    }

    fn float_slice_tape(&self, storage: EmptyTapeStorage) -> GenericVmTape<REGISTERS> {
        self.0.float_slice_tape(storage)
    }

    fn grad_slice_tape(&self, storage: EmptyTapeStorage) -> GenericVmTape<REGISTERS> {
        self.0.grad_slice_tape(storage)
    }

    fn simplify(
        &self,
        trace: &VmTrace,
        storage: VmData<REGISTERS>,
        workspace: &mut VmWorkspace<REGISTERS>,
    ) -> Result<Self, BadTrace> {
        eval::Function::simplify(&self.0, trace, storage, workspace).map(Self)
    }

    fn recycle(self) -> Option<VmData<REGISTERS>> {
        self.0.recycle()
    }

    fn size(&self) -> usize {
        self.0.size()
    }

    fn vars(&self) -> &VarMap {
        eval::Function::vars(&self.0)
    }

    fn output_count(&self) -> usize {
        self.0.output_count()
    }

    fn can_simplify(&self) -> bool {
        self.0.can_simplify()
    }
}

impl RenderHints for Function {
    fn tile_sizes_3d() -> TileSizes {
        VmFunction::tile_sizes_3d()
    }

    fn tile_sizes_2d() -> TileSizes {
        VmFunction::tile_sizes_2d()
    }
}

impl MathFunction for Function {
    fn new(context: &Context, nodes: &[Node]) -> Result<Self, fidget_core::context::BadNode> {
        VmFunction::new(context, nodes).map(Self)
    }
}

/// Points that a step is taken at together: two registers of four lanes.
const LANES: usize = 8;

type Lanes = [f32; LANES];

/// Evaluates a tape at many points.
#[derive(Default)]
pub(super) struct Slices {
    /// Values of the tape's registers and memory.
    slots: Vec<Lanes>,
    /// One list of values for each output of the tape.
    outputs: Vec<Vec<f32>>,
}

impl BulkEvaluator for Slices {
    type Data = f32;
    type Tape = GenericVmTape<REGISTERS>;
    type TapeStorage = EmptyTapeStorage;

    fn eval<V: std::ops::Deref<Target = [f32]>>(
        &mut self,
        tape: &Self::Tape,
        vars: &[V],
    ) -> Result<BulkOutput<'_, f32>, BulkEvalError> {
        tape.vars().check_bulk_arguments(vars)?;
        let points = vars.first().map_or(0, |values| values.len());
        let data = tape.data();
        self.slots.resize(data.slot_count().max(self.slots.len()), [0.0; LANES]);
        self.outputs.resize_with(data.output_count(), Vec::new);
        self.outputs.iter_mut().for_each(|values| values.resize(points, 0.0));
        for start in (0..points).step_by(LANES) {
            let range = start..points.min(start + LANES);
            for step in data.iter_asm() {
                self.take(step, vars, range.clone());
            }
        }
        Ok(BulkOutput::new(&self.outputs, points))
    }
}

impl Slices {
    /// Takes a step of a tape for the points in `range`.
    #[inline]
    fn take<V: std::ops::Deref<Target = [f32]>>(&mut self, step: RegOp, vars: &[V], range: std::ops::Range<usize>) {
        let slots = &mut self.slots[..];
        match step {
            RegOp::Output(from, output) => {
                let places = &mut self.outputs[output as usize][range];
                places.copy_from_slice(&slots[usize::from(from)][..places.len()]);
            }
            RegOp::Input(to, input) => {
                let values = &vars[input as usize][range];
                slots[usize::from(to)][..values.len()].copy_from_slice(values);
            }
            RegOp::NegReg(to, a) => one(slots, to, a, |a| -a),
            RegOp::AbsReg(to, a) => one(slots, to, a, f32::abs),
            RegOp::RecipReg(to, a) => one(slots, to, a, |a| 1.0 / a),
            RegOp::SqrtReg(to, a) => one(slots, to, a, f32::sqrt),
            RegOp::SquareReg(to, a) => one(slots, to, a, |a| a * a),
            RegOp::FloorReg(to, a) => one(slots, to, a, f32::floor),
            RegOp::CeilReg(to, a) => one(slots, to, a, f32::ceil),
            RegOp::RoundReg(to, a) => one(slots, to, a, f32::round),
            RegOp::SinReg(to, a) => one(slots, to, a, f32::sin),
            RegOp::CosReg(to, a) => one(slots, to, a, f32::cos),
            RegOp::TanReg(to, a) => one(slots, to, a, f32::tan),
            RegOp::AsinReg(to, a) => one(slots, to, a, f32::asin),
            RegOp::AcosReg(to, a) => one(slots, to, a, f32::acos),
            RegOp::AtanReg(to, a) => one(slots, to, a, f32::atan),
            RegOp::ExpReg(to, a) => one(slots, to, a, f32::exp),
            RegOp::LnReg(to, a) => one(slots, to, a, f32::ln),
            RegOp::CopyReg(to, a) => one(slots, to, a, |a| a),
            RegOp::AddRegImm(to, a, b) => one(slots, to, a, |a| a + b),
            RegOp::MulRegImm(to, a, b) => one(slots, to, a, |a| a * b),
            RegOp::DivRegImm(to, a, b) => one(slots, to, a, |a| a / b),
            RegOp::DivImmReg(to, a, b) => one(slots, to, a, |a| b / a),
            RegOp::SubImmReg(to, a, b) => one(slots, to, a, |a| b - a),
            RegOp::SubRegImm(to, a, b) => one(slots, to, a, |a| a - b),
            RegOp::AtanRegImm(to, a, b) => one(slots, to, a, |a| a.atan2(b)),
            RegOp::AtanImmReg(to, a, b) => one(slots, to, a, |a| b.atan2(a)),
            RegOp::AtanRegReg(to, a, b) => two(slots, to, [a, b], f32::atan2),
            RegOp::MinRegImm(to, a, b) => one(slots, to, a, |a| least(a, b)),
            RegOp::MaxRegImm(to, a, b) => one(slots, to, a, |a| most(a, b)),
            RegOp::AddRegReg(to, a, b) => two(slots, to, [a, b], |a, b| a + b),
            RegOp::MulRegReg(to, a, b) => two(slots, to, [a, b], |a, b| a * b),
            RegOp::DivRegReg(to, a, b) => two(slots, to, [a, b], |a, b| a / b),
            RegOp::SubRegReg(to, a, b) => two(slots, to, [a, b], |a, b| a - b),
            RegOp::MinRegReg(to, a, b) => two(slots, to, [a, b], least),
            RegOp::MaxRegReg(to, a, b) => two(slots, to, [a, b], most),
            RegOp::CopyImm(to, value) => slots[usize::from(to)] = [value; LANES],
            RegOp::Load(to, memory) => slots[usize::from(to)] = slots[memory as usize],
            RegOp::Store(from, memory) => slots[memory as usize] = slots[usize::from(from)],
            RegOp::NotReg(to, a) => one(slots, to, a, |a| f32::from(u8::from(a == 0.0))),
            RegOp::RandReg(to, a) => one(slots, to, a, FloatExt::rand),
            RegOp::CompareImmReg(to, a, b) => one(slots, to, a, |a| b.compare(a)),
            RegOp::CompareRegImm(to, a, b) => one(slots, to, a, |a| a.compare(b)),
            RegOp::CompareRegReg(to, a, b) => two(slots, to, [a, b], FloatExt::compare),
            RegOp::MixImmReg(to, a, b) => one(slots, to, a, |a| b.mix(a)),
            RegOp::MixRegImm(to, a, b) => one(slots, to, a, |a| a.mix(b)),
            RegOp::MixRegReg(to, a, b) => two(slots, to, [a, b], FloatExt::mix),
            RegOp::AndRegImm(to, a, b) => one(slots, to, a, |a| a.and_choice(b).0),
            RegOp::AndRegReg(to, a, b) => two(slots, to, [a, b], |a, b| a.and_choice(b).0),
            RegOp::OrRegImm(to, a, b) => one(slots, to, a, |a| a.or_choice(b).0),
            RegOp::OrRegReg(to, a, b) => two(slots, to, [a, b], |a, b| a.or_choice(b).0),
            RegOp::ModImmReg(to, a, b) => one(slots, to, a, |a| b.rem_euclid(a)),
            RegOp::ModRegImm(to, a, b) => one(slots, to, a, |a| a.rem_euclid(b)),
            RegOp::ModRegReg(to, a, b) => two(slots, to, [a, b], f32::rem_euclid),
        }
    }
}

#[inline]
fn one(slots: &mut [Lanes], to: u8, a: u8, step: impl Fn(f32) -> f32) {
    slots[usize::from(to)] = slots[usize::from(a)].map(step);
}

#[inline]
fn two(slots: &mut [Lanes], to: u8, [a, b]: [u8; 2], step: impl Fn(f32, f32) -> f32) {
    let (a, b) = (slots[usize::from(a)], slots[usize::from(b)]);
    slots[usize::from(to)] = std::array::from_fn(|lane| step(a[lane], b[lane]));
}

/// The smaller one; NaN if either is NaN.
#[inline]
fn least(a: f32, b: f32) -> f32 {
    if a < b || a.is_nan() { a } else { b }
}

/// The larger one; NaN if either is NaN.
#[inline]
fn most(a: f32, b: f32) -> f32 {
    if a > b || a.is_nan() { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fidget_core::context::Tree;
    use fidget_core::vm::VmShape;

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

    #[test]
    fn a_built_in_objects_values_are_the_interpreters() {
        for (_, form) in super::super::KINDS {
            let form = form(&mut super::super::proportions::Proportions::canonical());
            holds_the_interpreters_values(&form.shape.0);
        }
    }
}
