//! A machine that executes the instructions of generated assembly on known numbers and partly known values.

use super::super::ProofProblem;
use super::text::{Instruction, Text, problem};
use std::collections::BTreeMap;

/// Content of a register, or of a word on the stack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Value {
    Unknown,
    Number(i32),
    /// A register's content at the start.
    Saved(u8),
    /// An address on the stack, from the stack pointer at the start.
    Stack(i32),
    /// The address of the features.
    Row,
    /// An address among the margins, from the first one.
    Margins(i32),
    /// The number of a column.
    Column(usize),
    /// A feature as it is in memory.
    Feature,
    /// The value without its highest bit, times 2.
    Twice,
    /// The key of a feature that is not missing, from the bits of a negative one.
    Key,
    /// The high and the low sum of an object's trees: a number, and the leaves that are reached.
    High(i32),
    Low(i32),
    /// 256 times the high sum.
    Shifted(i32),
    /// The whole sum.
    Sum(i32),
    /// A margin in memory, of this object.
    Margin(usize),
    /// A value with a number, or the sum of trees, added.
    Added(usize, i32, bool),
}

use Value::*;

/// State of the machine.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) registers: [Value; 16],
    /// Words, and bytes, by their distance from the stack pointer at the start.
    pub(super) stack: BTreeMap<i32, Value>,
    /// The two that were compared last.
    pub(super) compared: Option<(Value, Value)>,
    /// Numbers that were added to margins, in the order in which that was done.
    pub(super) added: Vec<(usize, Added)>,
}

/// Store to a margin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Added {
    /// It became this, and the trees since the last store, if they are summed up.
    Start(i32),
    /// This, and the trees since the last store, were added.
    Trees(i32),
    /// This number was added.
    Number(i32),
}

/// Way to the next instruction.
pub(super) enum Flow {
    Next,
    Jump(usize),
    /// A branch on this condition.
    Branch(&'static str, usize),
    /// A call, or a far jump.
    Call(usize),
    Return,
}

/// Bytes of the stack at most: generated code has a byte for each column there, and registers.
const DEEPEST_STACK: i32 = 1 << 14;

pub(super) const SP: usize = 13;
pub(super) const LR: usize = 14;
pub(super) const PC: usize = 15;

impl State {
    pub(super) fn new() -> Self {
        let mut registers: [Value; 16] = std::array::from_fn(|number| Saved(number as u8));
        (registers[0], registers[1], registers[SP]) = (Row, Margins(0), Stack(0));
        Self { registers, stack: BTreeMap::new(), compared: None, added: Vec::new() }
    }

    fn pointer(&self, line: usize) -> Result<i32, ProofProblem> {
        match self.registers[SP] {
            Stack(at) if at < -DEEPEST_STACK => Err(problem(line, "the stack grows without end")),
            Stack(at) => Ok(at),
            _ => Err(problem(line, "the stack pointer is lost")),
        }
    }

    /// Executes an instruction that does not store the number of a column.
    pub(super) fn step(&mut self, text: &Text, at: usize) -> Result<Flow, ProofProblem> {
        let instruction = text.instructions.get(at).ok_or_else(|| problem(0, "it runs past its end"))?;
        let Instruction { name, operands, line } = instruction;
        let line = *line;
        let unknown = || problem(line, format!("{} is not known here", instruction.text()));
        let operands: Vec<&str> = operands.iter().map(String::as_str).collect();
        let value = |state: &Self, operand: &str| match immediate(operand) {
            Some(number) => Some(Number(number)),
            None => register(operand).map(|register| state.registers[register]),
        };
        match (name.as_str(), operands.as_slice()) {
            ("movs" | "mov", [to, from]) => {
                let from = value(self, from).ok_or_else(unknown)?;
                self.set(to, from).ok_or_else(unknown)?;
            }
            ("adds" | "subs" | "add" | "sub" | "addw" | "subw", [to, rest @ ..]) if (1..=2).contains(&rest.len()) => {
                let (a, b) = if let [a, b] = rest { (*a, *b) } else { (*to, rest[0]) };
                let (a, b) = value(self, a).zip(value(self, b)).ok_or_else(unknown)?;
                let sum = if name.starts_with("add") { add(a, b) } else { subtract(a, b) }.ok_or_else(unknown)?;
                self.set(to, sum).ok_or_else(unknown)?;
            }
            ("rsbs", [to, from, "#0"]) => {
                let Some(Number(number)) = value(self, from) else { return Err(unknown()) };
                self.set(to, Number(number.wrapping_neg())).ok_or_else(unknown)?;
            }
            ("lsls" | "lsrs", [to, from, by]) => {
                let (from, by) = value(self, from).zip(immediate(by)).ok_or_else(unknown)?;
                let shifted = match (from, name.as_str(), by) {
                    (Number(number), "lsls", 0..32) => Number(number << by),
                    (Number(number), "lsrs", 1..32) => Number((number as u32 >> by) as i32),
                    (Feature, "lsls", 1) => Twice,
                    (High(sum), "lsls", 8) => Shifted(sum << 8),
                    _ => return Err(unknown()),
                };
                self.set(to, shifted).ok_or_else(unknown)?;
                self.compared = Some((shifted, Number(0)));
                return Ok(Flow::Next);
            }
            ("cmp", [a, b]) => {
                self.compared = value(self, a).zip(value(self, b));
                return Ok(Flow::Next);
            }
            ("ldr", [to, label]) if label.starts_with(".L") => {
                let word = text.word(line, label)?;
                self.set(to, Number(word)).ok_or_else(unknown)?;
            }
            ("ldr" | "ldrb" | "ldrh", [to, address, after @ ..]) => {
                let length = [("ldrb", 1), ("ldrh", 2)].iter().find(|size| size.0 == name).map_or(4, |size| size.1);
                let (base, from) = self.address(address).ok_or_else(unknown)?;
                let loaded = self.load(text, line, from, length).ok_or_else(unknown)??;
                self.set(to, loaded).ok_or_else(unknown)?;
                if let [step] = after {
                    let step = immediate(step).ok_or_else(unknown)?;
                    self.registers[base] = add(self.registers[base], Number(step)).ok_or_else(unknown)?;
                }
                // Loads leave what was compared.
                return Ok(Flow::Next);
            }
            ("str", [from, address]) => {
                let from = value(self, from).ok_or_else(unknown)?;
                let (_, to) = self.address(address).ok_or_else(unknown)?;
                self.store(to, from).ok_or_else(unknown)?;
                return Ok(Flow::Next);
            }
            ("stmia", [base, list]) => {
                let base = base.strip_suffix('!').and_then(register).ok_or_else(unknown)?;
                let [from] = registers(list).ok_or_else(unknown)?[..] else { return Err(unknown()) };
                self.store(self.registers[base], self.registers[from]).ok_or_else(unknown)?;
                self.registers[base] = add(self.registers[base], Number(4)).ok_or_else(unknown)?;
                return Ok(Flow::Next);
            }
            ("push", [list]) => {
                let list = registers(list).ok_or_else(unknown)?;
                if list.contains(&LR) && !self.stack.is_empty() {
                    return Err(problem(line, "it begins again"));
                }
                let start = self.pointer(line)? - 4 * list.len() as i32;
                self.stack
                    .extend((0..).map(|index| start + 4 * index).zip(list.iter().map(|&own| self.registers[own])));
                self.registers[SP] = Stack(start);
                return Ok(Flow::Next);
            }
            ("pop", [list]) => {
                let list = registers(list).ok_or_else(unknown)?;
                let mut at = self.pointer(line)?;
                for &own in &list {
                    self.registers[own] = self.stack.remove(&at).ok_or_else(unknown)?;
                    at += 4;
                }
                self.registers[SP] = Stack(at);
                return Ok(if list.contains(&PC) { Flow::Return } else { Flow::Next });
            }
            ("b", [label]) => return Ok(Flow::Jump(text.target(line, label)?)),
            ("bl", [label]) => return Ok(Flow::Call(text.target(line, label)?)),
            ("bx", ["lr"]) => return Ok(Flow::Return),
            (name, [label]) => {
                let condition = CONDITIONS.into_iter().find(|own| name.strip_prefix('b') == Some(own));
                return Ok(Flow::Branch(condition.ok_or_else(unknown)?, text.target(line, label)?));
            }
            _ => return Err(unknown()),
        }
        self.compared = None;
        Ok(Flow::Next)
    }

    fn set(&mut self, to: &str, value: Value) -> Option<()> {
        self.registers[register(to)?] = value;
        Some(())
    }

    /// The register that an address begins with, and the address.
    fn address(&self, text: &str) -> Option<(usize, Value)> {
        let inner = text.strip_prefix('[')?.strip_suffix(']')?;
        let parts: Vec<&str> = inner.split(',').map(str::trim).collect();
        let base = register(parts[0])?;
        let offset = match parts[1..] {
            [] => Number(0),
            [part] => immediate(part).map(Number).or_else(|| Some(self.registers[register(part)?]))?,
            [part, "lsl #2"] => match self.registers[register(part)?] {
                Number(number) => Number(number << 2),
                _ => return None,
            },
            _ => return None,
        };
        // A feature's address is its number.
        let from = match (self.registers[base], offset) {
            (Row, Number(offset)) => return Some((base, if offset % 4 == 0 { Row } else { return None })),
            (from, offset) => add(from, offset)?,
        };
        Some((base, from))
    }

    fn load(&self, text: &Text, line: usize, from: Value, length: usize) -> Option<Result<Value, ProofProblem>> {
        match (from, length) {
            (Number(address), _) => Some(text.load(line, address, length).map(|number| Number(number as i32))),
            (Stack(at), 4) => self.stack.get(&at).copied().map(Ok),
            (Stack(at), 1) => self.stack.get(&at).copied().filter(|value| matches!(value, Column(_))).map(Ok),
            (Margins(at), 4) if at >= 0 && at % 4 == 0 => Some(Ok(Margin(at as usize / 4))),
            (Row, 4) => Some(Ok(Feature)),
            _ => None,
        }
    }

    fn store(&mut self, to: Value, value: Value) -> Option<()> {
        match (to, value) {
            (Stack(at), _) if self.stack.contains_key(&at) => _ = self.stack.insert(at, value),
            (Margins(at), _) if at >= 0 && at % 4 == 0 => {
                let object = at as usize / 4;
                let added = match value {
                    Number(start) | Sum(start) => Added::Start(start),
                    Added(own, number, false) if own == object => Added::Number(number),
                    Added(own, sum, true) if own == object => Added::Trees(sum),
                    _ => return None,
                };
                self.added.push((object, added));
            }
            _ => return None,
        }
        Some(())
    }
}

const CONDITIONS: [&str; 8] = ["hi", "ls", "eq", "ne", "gt", "lt", "ge", "le"];

/// The other condition.
pub(super) fn is_true(condition: &str, a: i32, b: i32) -> bool {
    match condition {
        "hi" => a as u32 > b as u32,
        "ls" => a as u32 <= b as u32,
        "eq" => a == b,
        "ne" => a != b,
        "gt" => a > b,
        "lt" => a < b,
        "ge" => a >= b,
        _ => a <= b,
    }
}

fn add(a: Value, b: Value) -> Option<Value> {
    Some(match (a, b) {
        (Number(a), Number(b)) => Number(a.wrapping_add(b)),
        (Stack(at), Number(number)) => Stack(at.wrapping_add(number)),
        (Margins(at), Number(number)) | (Number(number), Margins(at)) => Margins(at.wrapping_add(number)),
        (High(sum), Number(number)) => High(sum.wrapping_add(number)),
        (Low(sum), Number(number)) => Low(sum.wrapping_add(number)),
        (Shifted(high), Low(low)) => Sum(high.wrapping_add(low)),
        (Sum(sum), Margin(object)) => Added(object, sum, true),
        (Margin(object), Number(number)) => Added(object, number, false),
        _ => return None,
    })
}

fn subtract(a: Value, b: Value) -> Option<Value> {
    match (a, b) {
        (Number(i32::MIN), Feature) => Some(Key),
        (_, Number(number)) => add(a, Number(number.wrapping_neg())),
        _ => None,
    }
}

pub(super) fn immediate(text: &str) -> Option<i32> {
    text.strip_prefix('#')?.parse().ok()
}

pub(super) fn register(text: &str) -> Option<usize> {
    match text {
        "sp" => Some(SP),
        "lr" => Some(LR),
        "pc" => Some(PC),
        _ => text.strip_prefix('r')?.parse().ok().filter(|number| *number < 13),
    }
}

/// Registers of a list, in the order in which they are in memory.
fn registers(list: &str) -> Option<Vec<usize>> {
    let mut all = Vec::new();
    for part in list.strip_prefix('{')?.strip_suffix('}')?.split(',') {
        match part.trim().split_once('-') {
            Some((first, last)) => all.extend(register(first)?..=register(last)?),
            None => all.push(register(part.trim())?),
        }
    }
    all.windows(2).all(|pair| pair[0] < pair[1]).then_some(all)
}
