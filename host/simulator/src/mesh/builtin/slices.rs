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
