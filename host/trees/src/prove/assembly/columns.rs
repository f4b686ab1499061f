//! From a feature to the number of a column: a step function of its key.

use super::super::ProofProblem;
use super::super::boxes::{Keys, Values};
use super::machine::{Flow, State, Value, immediate, is_true};
use super::text::{Text, problem};
use palpate_shared::format::f32_key;

/// A column's number for every key of its feature.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    pub(super) feature: usize,
    /// Number of a missing feature.
    missing: u8,
    /// Ascending keys at which the number grows, each with the new number.
    steps: Vec<(i64, u8)>,
}

impl Column {
    /// The first key whose number is above `at`, and true if a missing feature's is not.
    pub(super) fn cut(&self, at: u8) -> (i64, bool) {
        let cut = self.steps.iter().find(|step| step.1 > at).map_or(i64::MAX, |step| step.0);
        (cut, self.missing <= at)
    }
}

/// Keys that are on one way, and the number that they get.
type Piece = (Values, u8);

/// Walk through the instructions that make one column's number.
pub(super) struct Walk<'w> {
    pub(super) text: &'w Text,
    pub(super) keys: &'w Keys,
    /// Keys that are taken as missing.
    pub(super) sentinel: Option<[i64; 2]>,
    pieces: Vec<Piece>,
    /// The state after the number is stored, its address, and the next instruction.
    end: Option<(State, i32, usize)>,
    /// Instructions of the longest way.
    longest: usize,
    /// Ways so far.
    ways: usize,
}

/// Instructions that a column may take, for programs that do not end.
const MOST: usize = 400;
/// Ways of a column: those of generated code have a number of eight bits at their end, and branch for few other reasons.
const MOST_WAYS: usize = 1 << 12;

impl<'w> Walk<'w> {
    pub(super) fn new(text: &'w Text, keys: &'w Keys, sentinel: Option<[i64; 2]>) -> Self {
        Self { text, keys, sentinel, pieces: Vec::new(), end: None, longest: 0, ways: 0 }
    }

    /// The column whose feature was just loaded, the state after it with its address on the stack, the next instruction, and how
    /// many the longest way has.
    pub(super) fn column(
        mut self,
        feature: usize,
        state: State,
        at: usize,
    ) -> Result<(Column, State, i32, [usize; 2]), ProofProblem> {
        let line = self.text.instructions.get(at).map_or(0, |own| own.line);
        self.walk(state, at, self.keys.all(1)[0], false, 0)?;
        let (state, address, next) = self.end.take().ok_or_else(|| problem(line, "a column has no number"))?;
        let longest = self.longest;
        let column =
            self.steps(feature).ok_or_else(|| problem(line, "a column's number does not grow with its feature"))?;
        Ok((column, state, address, [next, longest]))
    }

    fn steps(mut self, feature: usize) -> Option<Column> {
        let is_missing = |values: &Values| values.missing;
        let missing = self.pieces.iter().find(|piece| is_missing(&piece.0))?.1;
        if self.pieces.iter().any(|(values, number)| values.missing && *number != missing) {
            return None;
        }
        self.pieces.retain(|(values, _)| values.low <= values.high);
        if let Some([low, high]) = self.sentinel {
            // These keys are missing, and no others are by themselves.
            let inside = |values: &Values| values.low >= low && values.high <= high;
            let overlaps = |values: &Values| values.low <= high && values.high >= low;
            if self.pieces.iter().any(|(values, number)| overlaps(values) && !(inside(values) && *number == missing)) {
                return None;
            }
            self.pieces.retain(|(values, _)| !inside(values));
        }
        self.pieces.sort_by_key(|(values, _)| values.low);
        let numbers = || self.pieces.iter().map(|piece| piece.1);
        if numbers().zip(numbers().skip(1)).any(|(a, b)| a > b) {
            return None;
        }
        // What is below the first step has the least number: no cut tells it from less.
        let mut steps = Vec::new();
        let mut last = None;
        for (values, number) in &self.pieces {
            if last != Some(*number) {
                steps.push((values.low, *number));
                last = Some(*number);
            }
        }
        Some(Column { feature, missing, steps })
    }

    /// One way on, for the keys `values`; `is_negative` if the feature's highest bit is set.
    fn walk(
        &mut self,
        mut state: State,
        mut at: usize,
        values: Values,
        is_negative: bool,
        mut count: usize,
    ) -> Result<(), ProofProblem> {
        self.ways += 1;
        if self.ways > MOST_WAYS {
            return Err(problem(0, "a column branches without end"));
        }
        loop {
            let instruction = self.text.instructions.get(at).ok_or_else(|| problem(0, "it runs past its end"))?;
            let line = instruction.line;
            count += 1;
            if count > MOST {
                return Err(problem(line, "a column takes no end"));
            }
            if state.registers[4] == Value::Feature
                && *self.keys == Keys::Real
                && !values.missing
                && let Some((next, bits, before)) = grid(self.text, at)
            {
                state.registers[3..=5].fill(Value::Unknown);
                let count = count + next - at;
                for number in 0..=255_u8 {
                    let [first, after] =
                        [number, number.saturating_add(1)].map(|number| first_key(number, bits, before));
                    let high = if number == 255 { values.high } else { after - 1 };
                    let low = if number == 0 { values.low } else { first };
                    if low <= high {
                        let mut state = state.clone();
                        state.registers[5] = Value::Number(number.into());
                        self.walk(state, next, Values::of(low, high, false), false, count)?;
                    }
                }
                return Ok(());
            }
            if instruction.name == "strb" {
                self.longest = self.longest.max(count);
                return self.store(state, at, values);
            }
            if instruction.text() == "subs r4, r3, r4" && !is_negative {
                return Err(problem(line, "it changes the sign of a number that has none"));
            }
            match state.step(self.text, at)? {
                Flow::Next => at += 1,
                Flow::Jump(to) => at = to,
                Flow::Branch(condition, to) => {
                    let (taken, other) = self.sides(&state, condition, values, line)?;
                    let is_empty = |values: Values| values.low > values.high && !values.missing;
                    // Where the sign is asked for, what does not branch is negative.
                    let is_sign = condition == "ge" && state.compared == Some((Value::Feature, Value::Number(0)));
                    if !is_empty(taken) {
                        self.walk(state.clone(), to, taken, is_negative, count)?;
                    }
                    if is_empty(other) {
                        return Ok(());
                    }
                    return self.walk(state, at + 1, other, is_negative || is_sign, count);
                }
                Flow::Call(_) | Flow::Return => return Err(problem(line, "it leaves a column")),
            }
        }
    }

    /// The keys with which a branch is taken, and the others.
    fn sides(
        &self,
        state: &State,
        condition: &str,
        values: Values,
        line: usize,
    ) -> Result<(Values, Values), ProofProblem> {
        let Values { low, high, missing } = values;
        let none = Values::of(1, 0, false);
        let known = Values::of(low, high, false);
        let gone = Values::of(1, 0, missing);
        let real = *self.keys == Keys::Real;
        let below = |cut: i64| Values::of(low, high.min(cut - 1), false);
        let from = |cut: i64| Values::of(low.max(cut), high, false);
        let is_key = |value: Value| matches!(value, Value::Key | Value::Feature);
        let error = || problem(line, "a comparison that is not known");
        let (a, b) = state.compared.ok_or_else(error)?;
        Ok(match (a, b, condition) {
            (Value::Number(a), Value::Number(b), _) => match is_true(condition, a, b) {
                true => (values, none),
                false => (none, values),
            },
            // The bits of NaN are above those of infinity.
            (Value::Twice, Value::Number(limit), "hi") if real && limit as u32 == 0xff00_0000 => (gone, known),
            (key, Value::Number(i32::MIN), "eq") if !real && key == Value::Feature => (gone, known),
            // The key of -0 is 0.
            (Value::Feature, Value::Number(0), "ge") if real && !missing => (from(0), below(1)),
            // Bits compare as keys do, where one of them is positive.
            (Value::Number(cut), key, "gt") if is_key(key) && (key == Value::Key || !real || cut > 0 || low >= 0) => {
                if missing && real {
                    return Err(error());
                }
                // The missing whole number is below all others.
                (Values { missing, ..below(cut.into()) }, from(cut.into()))
            }
            (key, Value::Number(cut), "lt") if is_key(key) && !missing && (key == Value::Key || !real || low >= 0) => {
                (below(cut.into()), from(cut.into()))
            }
            (key, Value::Number(cut), "le") if is_key(key) && !missing && (key == Value::Key || !real || low >= 0) => {
                (below(i64::from(cut) + 1), from(i64::from(cut) + 1))
            }
            _ => return Err(error()),
        })
    }

    /// The end of a way, the same for all columns except for the column's number.
    fn store(&mut self, mut state: State, at: usize, values: Values) -> Result<(), ProofProblem> {
        let instruction = &self.text.instructions[at];
        let error = || problem(instruction.line, format!("{} is not known here", instruction.text()));
        let Value::Number(number) = state.registers[5] else { return Err(error()) };
        let number = u8::try_from(number).map_err(|_| error())?;
        let Value::Stack(address) = state.registers[6] else { return Err(error()) };
        match instruction.operands.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["r5", "[r6]"] => {}
            ["r5", "[r6]", step] => {
                let step = immediate(step).ok_or_else(error)?;
                state.registers[6] = Value::Stack(address + step);
            }
            _ => return Err(error()),
        }
        state.registers[3..=5].fill(Value::Unknown);
        state.compared = None;
        self.pieces.push((values, number));
        match &self.end {
            None => self.end = Some((state, address, at + 1)),
            Some((own, to, next)) => {
                let is_same = own.registers == state.registers && own.stack == state.stack && *to == address;
                if !is_same || *next != at + 1 {
                    return Err(error());
                }
            }
        }
        Ok(())
    }
}

/// A conversion to a number on a grid: the instruction after it, the bits after the point, and true if it is of the f32 before
/// the feature.
fn grid(text: &Text, at: usize) -> Option<(usize, i32, bool)> {
    let operand = |at: usize, index: usize| Some(text.instructions.get(at)?.operands.get(index)?.as_str());
    let before = text.is(at, &["subs r4, #1"]);
    let start = at + usize::from(before);
    if text.is(start, &["vmov s0, r4"]) {
        let convert = text.instructions.get(start + 1).filter(|own| own.name == "vcvt.s32.f32")?;
        let bits = match convert.operands.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["s0", "s0"] => 0,
            ["s0", "s0", bits] => immediate(bits)?,
            _ => return None,
        };
        let cut = text.instructions.get(start + 3).filter(|own| own.name == "usat")?;
        let shift = match cut.operands.join(" ").as_str() {
            "r5 #8 r5" => 0,
            other => immediate(other.strip_prefix("r5 #8 r5 asr ")?)?,
        };
        let fits = text.is(start + 2, &["vmov r5, s0"]) && (bits == 0 || shift == 0);
        return fits.then_some((start + 4, bits - shift, before));
    }
    // Without a float unit: from the exponent.
    let before = text.is(at + 3, &["subs r4, #1"]);
    let start = at + 3 + usize::from(before);
    let exponent = operand(start + 1, 1).and_then(immediate)?;
    let (first, full) = (operand(at + 2, 0)?, operand(start + 5, 0)?);
    let least = format!("{} {first}", if before { "ble" } else { "blt" });
    let (shift, most) = (format!("movs r5, #{exponent}"), format!("blt {full}"));
    let expected = [
        "lsrs r3, r4, #23",
        &shift,
        "subs r3, r5, r3",
        "movs r5, #255",
        "cmp r3, #24",
        &most,
        "lsls r4, r4, #8",
        "movs r5, #128",
        "lsls r5, r5, #24",
        "orrs r5, r4",
        "lsrs r5, r3",
    ];
    let end = start + expected.len();
    let is_end = |label: &str| text.target(0, label).ok() == Some(end);
    let fits = text.is(at, &["movs r5, #0", "cmp r4, #0", &least]) && text.is(start, &expected);
    (fits && is_end(first) && is_end(full)).then_some((end, 158 - exponent, before))
}

/// The first key with this number on a grid of 2^-bits, from 0.
fn first_key(number: u8, bits: i32, before: bool) -> i64 {
    // Exact: a number of eight bits times a power of two.
    let value = f64::from(number) * f64::from(-bits).exp2();
    i64::from(f32_key(value as f32)) + i64::from(before)
}
