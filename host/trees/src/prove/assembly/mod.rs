//! Trees of generated assembly, read back: its instructions are executed on what is known of a row, which at first is nothing.
//!
//! A column's number is found by following every way from its feature to where it is stored; a tree by following every way from
//! its first branch to where all ways meet. All else is one way, in which numbers are numbers. Whatever is not understood is
//! refused.

mod columns;
mod machine;
#[cfg(test)]
mod tests;
mod text;

use super::ProofProblem;
use super::boxes::{Keys, Rule, Step, Tree};
use crate::compile::code::Chip;
use columns::{Column, Walk};
use machine::{Added, Flow, LR, PC, SP, State, Value, is_true};
use text::{Text, problem};

/// Meaning of a file of assembly.
#[derive(Debug)]
pub(super) struct Code {
    /// Margins before any tree, in units, with what trees have in common.
    pub(super) base: Vec<i64>,
    /// Trees, in the order of the file, with leaves in units.
    pub(super) trees: Vec<Tree>,
    /// Places where the walk may end: the trees before, the bound, and the margins' base so far.
    pub(super) exits: Vec<(usize, u32, Vec<i64>)>,
    /// A Cortex-M4F if its instructions are in it.
    pub(super) chip: Chip,
    /// The most instructions that a row takes, from its features to its margins.
    pub(super) instructions: usize,
}

/// Statements of the model that its code depends on.
pub(super) struct Stated<'s> {
    pub(super) objects: usize,
    pub(super) known: usize,
    pub(super) features: usize,
    pub(super) keys: &'s Keys,
    /// The checksum, which names of functions carry.
    pub(super) checksum: u32,
    pub(super) sentinel: Option<[i64; 2]>,
}

/// Instructions of one way, at most: for programs that do not end.
const MOST: usize = 1 << 22;
/// Splits above a leaf, at most.
const DEEPEST: usize = 300;

/// Reads assembly.
///
/// # Errors
/// [`ProofProblem::Assembly`] with the line that is not understood.
pub(super) fn read(text: &str, stated: &Stated<'_>) -> Result<Code, ProofProblem> {
    let text = Text::read(text)?;
    let start = start(&text, stated.checksum)?;
    let reader = Reader {
        text: &text,
        stated,
        columns: Vec::new(),
        sizes: Vec::new(),
        trees: Vec::new(),
        pending: Vec::new(),
        exits: Vec::new(),
        ends: Vec::new(),
        base: vec![None; stated.objects],
        instructions: 0,
    };
    reader.run(start)
}

/// The checksum at the end of a function's name, after the function's kind; `Some(None)` if the name has none,
/// and `None` for the name of another function.
fn stated_checksum(label: &str, function: &str) -> Option<Option<u32>> {
    if label.starts_with('.') {
        return None;
    }
    let (_, end) = label.rsplit_once(function)?;
    let digits = end.strip_prefix('_').filter(|digits| digits.len() == 8);
    match digits {
        None => end.is_empty().then_some(None),
        Some(digits) => u32::from_str_radix(digits, 16).ok().map(Some),
    }
}

/// Start of the code for a row's margins, and the number that says whether the walk may end early, if it may.
fn start(text: &Text, checksum: u32) -> Result<(usize, Option<i32>), ProofProblem> {
    let find = |function: &str| {
        let mut labels = text.labels();
        labels.find_map(|label| stated_checksum(label, function).map(|stated| (label, stated)))
    };
    let (margins, stated) = find("_margins").ok_or_else(|| problem(1, "it has no function for margins"))?;
    if let Some(stated) = stated.filter(|&stated| stated != checksum) {
        return Err(problem(
            1,
            format!(
                "it was exported with the model {stated:08x}, and this model is {checksum:08x}: take both of one export"
            ),
        ));
    }
    let at = text.target(1, margins)?;
    let Some((early, _)) = find("_early") else { return Ok((at, None)) };
    let early = text.target(1, early)?;
    let line = text.instructions.get(early).map_or(0, |own| own.line);
    let body = text.instructions.get(early + 1).filter(|own| own.name == "b").and_then(|own| own.operands.first());
    let to = body.map(|label| text.target(line, label)).transpose()?;
    let is_usual = text.is(early, &["movs r2, #1"]) && text.is(at, &["movs r2, #0"]) && to == Some(at + 1);
    if is_usual { Ok((at, Some(0))) } else { Err(problem(line, "the two functions do not have one body")) }
}

struct Reader<'r> {
    text: &'r Text,
    stated: &'r Stated<'r>,
    columns: Vec<Column>,
    /// Bytes of the stack where columns are.
    sizes: Vec<i32>,
    trees: Vec<Tree>,
    /// Trees of the object whose margin comes next.
    pending: Vec<Vec<Step>>,
    exits: Vec<(usize, u32, Vec<i64>)>,
    /// Targets of walks that end early.
    ends: Vec<usize>,
    base: Vec<Option<i64>>,
    /// Instructions so far, along the longest ways.
    instructions: usize,
}

impl Reader<'_> {
    fn run(mut self, (start, early): (usize, Option<i32>)) -> Result<Code, ProofProblem> {
        let mut state = State::new();
        let mut at = start;
        for _ in 0..MOST {
            let instruction = self.text.instructions.get(at).ok_or_else(|| problem(0, "it runs past its end"))?;
            let line = instruction.line;
            if let Some(feature) = self.feature(&state, at) {
                at = self.column(feature, &mut state, at)?;
                continue;
            }
            self.instructions += 1;
            let count = state.added.len();
            // Where it leaves the stack, whether all trees were walked or not.
            if instruction.name == "add" && instruction.operands.first().is_some_and(|own| own == "sp") {
                self.ends.push(at);
            }
            match state.step(self.text, at)? {
                Flow::Next => at += 1,
                Flow::Jump(to) => at = to,
                Flow::Branch(condition, to) => match state.compared {
                    Some((Value::Column(_), Value::Number(_))) => {
                        self.instructions -= 1;
                        at = self.tree(&mut state, at)?;
                    }
                    Some((Value::Number(a), Value::Number(b))) => {
                        at = if is_true(condition, a, b) { to } else { at + 1 }
                    }
                    Some((Value::Stack(a), Value::Stack(b))) => at = if is_true(condition, a, b) { to } else { at + 1 },
                    _ => return Err(problem(line, "a branch on an unknown value")),
                },
                Flow::Call(to) if early.is_some() && self.is_compare(&state, to) => {
                    let Value::Number(bound) = state.registers[3] else {
                        return Err(problem(line, "an unknown bound"));
                    };
                    if !self.pending.is_empty() {
                        return Err(problem(line, "the walk may end in the middle of an object's trees"));
                    }
                    let base: Option<Vec<i64>> = self.base.iter().copied().collect();
                    let base = base.ok_or_else(|| problem(line, "margins that are compared before they are stored"))?;
                    self.exits.push((self.trees.len(), bound.cast_unsigned(), base));
                    // Of a routine that is left at once: the function for margins walks all trees.
                    self.instructions += 7;
                    self.ends.push(self.end_of(to).ok_or_else(|| problem(line, "a walk that does not end"))?);
                    state.registers[1..=3].fill(Value::Unknown);
                    state.registers[0] = state.registers[SP];
                    at += 1;
                }
                // A far jump.
                Flow::Call(to) if !self.is_list(to) => {
                    state.registers[LR] = Value::Unknown;
                    at = to;
                }
                Flow::Call(_) => return Err(problem(line, "a call that no tree makes")),
                Flow::Return => return self.finish(&state, line),
            }
            for added in state.added.split_off(count) {
                self.store(added, line)?;
            }
        }
        Err(problem(0, "it takes no end"))
    }

    /// A margin that is stored, of the trees since the last one.
    fn store(&mut self, (object, added): (usize, Added), line: usize) -> Result<(), ProofProblem> {
        let base = self.base.get_mut(object).ok_or_else(|| problem(line, "a margin of no object"))?;
        match (added, *base) {
            (Added::Start(start), None) => *base = Some(start.into()),
            (Added::Trees(sum), Some(before)) => *base = Some(before + i64::from(sum)),
            _ => return Err(problem(line, "a margin that is stored again")),
        }
        for nodes in self.pending.drain(..) {
            self.trees.push(Tree::new(nodes, Some(object))?);
        }
        Ok(())
    }

    fn finish(self, state: &State, line: usize) -> Result<Code, ProofProblem> {
        let kept = (4..12).all(|register| state.registers[register] == Value::Saved(register as u8));
        let is_back = state.registers[PC] == Value::Saved(LR as u8) && state.registers[SP] == Value::Stack(0);
        let is_one_end = self.ends.windows(2).all(|pair| pair[0] == pair[1]);
        if !kept || !is_back || !is_one_end || !self.pending.is_empty() {
            return Err(problem(line, "it does not return as it was called"));
        }
        let base: Option<Vec<i64>> = self.base.into_iter().collect();
        let base = base.ok_or_else(|| problem(line, "a margin is not stored"))?;
        let is_m4f = self.text.instructions.iter().any(|own| own.operands.iter().any(|own| own.contains("r4-r11")));
        let chip = if is_m4f { Chip::M4F } else { Chip::M0Plus };
        Ok(Code { base, trees: self.trees, exits: self.exits, chip, instructions: self.instructions })
    }

    /// The feature that an instruction loads.
    fn feature(&self, state: &State, at: usize) -> Option<usize> {
        let instruction = &self.text.instructions[at];
        let shift = match instruction.operands.get(1)?.as_str() {
            "[r0, r3]" => 0,
            "[r0, r3, lsl #2]" => 2,
            _ => return None,
        };
        match (instruction.name.as_str(), state.registers[0], state.registers[3]) {
            ("ldr", Value::Row, Value::Number(number)) if number >= 0 && (number << shift) % 4 == 0 => {
                Some((number << shift) as usize / 4)
            }
            _ => None,
        }
    }

    fn column(&mut self, feature: usize, state: &mut State, at: usize) -> Result<usize, ProofProblem> {
        let line = self.text.instructions[at].line;
        if feature >= self.stated.features {
            return Err(problem(line, "there is no such feature"));
        }
        let mut loaded = state.clone();
        if !matches!(loaded.step(self.text, at)?, Flow::Next) || loaded.registers[4] != Value::Feature {
            return Err(problem(line, "a feature goes elsewhere"));
        }
        let walk = Walk::new(self.text, self.stated.keys, self.stated.sentinel);
        let (column, after, address, [next, longest]) = walk.column(feature, loaded, at + 1)?;
        self.instructions += 1 + longest;
        *state = after;
        let Value::Stack(bottom) = state.registers[SP] else { return Err(problem(line, "the stack pointer is lost")) };
        // Above are the registers that were saved.
        let top = state.stack.keys().find(|key| !self.sizes.contains(key)).copied().unwrap_or(0);
        if address < bottom || address >= top || self.sizes.contains(&address) {
            return Err(problem(line, "a column's number is stored elsewhere"));
        }
        self.sizes.push(address);
        state.stack.insert(address, Value::Column(self.columns.len()));
        self.columns.push(column);
        Ok(next)
    }

    /// True if a routine compares margins with the bound in r3.
    fn is_compare(&self, state: &State, at: usize) -> bool {
        let Value::Stack(bottom) = state.registers[SP] else { return false };
        let mut places = state.stack.iter().filter(|place| matches!(place.1, Value::Margins(0))).map(|place| *place.0);
        let (Some(margins), None) = (places.next(), places.next()) else { return false };
        let flag = state.stack.get(&(margins + 4)) == Some(&Value::Number(0));
        let margins = margins - bottom + 12;
        let texts = [format!("ldr r0, [sp, #{}]", margins + 4), format!("ldr r0, [sp, #{margins}]")];
        let mut length = Vec::new();
        // A number of up to ten bits in r5.
        let bytes = 4 * self.stated.known;
        length.push(format!("movs r5, #{}", if bytes > 255 { bytes >> 8 } else { bytes }));
        if bytes > 255 {
            if bytes & 255 == 0 {
                length.push("lsls r5, r5, #8".into());
            } else {
                length.extend(["lsls r5, r5, #8".into(), format!("adds r5, #{}", bytes & 255)]);
            }
        }
        let start = at + 5 + length.len();
        let label = |at: usize| self.text.instructions.get(at).and_then(|own| own.operands.first().cloned());
        // Branches, and where they lead.
        let branches = [
            (at + 3, "beq", start + 17),
            (start + 6, "ble", start + 12),
            (start + 9, "ble", start + 12),
            (start + 13, "bne", start + 4),
            (start + 16, "bhi", start + 20),
        ];
        let is_branch = |&(at, name, to): &(usize, &str, usize)| {
            let Some(label) = label(at) else { return false };
            self.text.is(at, &[&format!("{name} {label}")]) && self.text.target(0, &label).ok() == Some(to)
        };
        let head = ["push {r4, r5, r6}", &texts[0], "cmp r0, #0"];
        let length: Vec<&str> = length.iter().map(String::as_str).collect();
        let largest =
            ["adds r5, r5, r0", "movs r1, #128", "lsls r1, r1, #24", "mov r2, r1", "ldmia r0!, {r4}", "cmp r4, r2"];
        flag && self.text.is(at, &head)
            && self.text.is(at + 4, &[&texts[1]])
            && self.text.is(at + 5, &length)
            && self.text.is(start, &largest)
            && self.text.is(start + 7, &["mov r2, r4", "cmp r4, r1"])
            && self.text.is(start + 10, &["mov r2, r1", "mov r1, r4", "cmp r0, r5"])
            && self.text.is(start + 14, &["subs r1, r1, r2", "cmp r1, r3"])
            && self.text.is(start + 17, &["pop {r4, r5, r6}", "mov r0, sp", "bx lr", "pop {r4, r5, r6}"])
            && branches.iter().all(is_branch)
    }

    /// Target of a routine that compares, if the walk ends.
    fn end_of(&self, at: usize) -> Option<usize> {
        let last = self.text.instructions[at..].iter().filter(|own| own.text() == "pop {r4, r5, r6}").nth(1)?;
        let after = self.text.instructions.iter().position(|own| own.line == last.line)? + 1;
        let jump = self.text.instructions.get(after).filter(|own| matches!(own.name.as_str(), "b" | "bl"))?;
        self.text.target(jump.line, jump.operands.first()?).ok()
    }

    /// True if a routine adds a list of numbers to margins.
    fn is_list(&self, at: usize) -> bool {
        self.text.is(at, &["lsls r2, r2, #8", "adds r1, r1, r2"])
    }

    /// The tree whose first branch is at this place; where it ends.
    fn tree(&mut self, state: &mut State, at: usize) -> Result<usize, ProofProblem> {
        let line = self.text.instructions[at].line;
        // Votes are added to margins in memory, whose address is in r7; other leaves to two sums.
        let votes = state.registers[7] == Value::Margins(0) && self.base.iter().all(Option::is_some);
        let mut end = self.meeting(at)?;
        if votes && self.text.is(end, &["ldr r2, [r7, r1]"]) {
            end += 3;
        }
        if !votes {
            for (register, sum) in [(1, Value::High as fn(i32) -> Value), (2, Value::Low)] {
                if let Value::Number(number) = state.registers[register] {
                    state.registers[register] = sum(number);
                }
            }
        }
        let mut ways = Ways {
            reader: self,
            start: state.clone(),
            end,
            votes,
            loses_lr: false,
            longest: 0,
            nodes: Vec::new(),
            after: None,
        };
        ways.walk(state.clone(), at, [0, 0])?;
        let Ways { nodes, loses_lr, longest, .. } = ways;
        self.instructions += longest;
        if loses_lr {
            state.registers[LR] = Value::Unknown;
        }
        state.registers[3] = Value::Unknown;
        state.compared = None;
        if votes {
            state.registers[1..=3].fill(Value::Unknown);
            self.trees.push(Tree::new(nodes, None)?);
        } else {
            self.pending.push(nodes);
        }
        if self.text.instructions.get(end).is_none() {
            return Err(problem(line, "a tree has no end"));
        }
        Ok(end)
    }

    /// The first place after a branch that no branch before it passes.
    fn meeting(&self, at: usize) -> Result<usize, ProofProblem> {
        let mut far = at + 1;
        let mut here = at;
        while here < far {
            let instruction = self.text.instructions.get(here).ok_or_else(|| problem(0, "it runs past its end"))?;
            let is_branch = instruction.name.starts_with('b') && instruction.name != "bx";
            if let (true, [label]) = (is_branch, instruction.operands.as_slice()) {
                let to = self.text.target(instruction.line, label)?;
                if !(instruction.name == "bl" && self.is_list(to)) {
                    far = far.max(to);
                }
            }
            here += 1;
        }
        Ok(far)
    }
}

/// The ways through a tree.
struct Ways<'w, 'r> {
    reader: &'w Reader<'r>,
    start: State,
    end: usize,
    votes: bool,
    /// True if a way changes lr.
    loses_lr: bool,
    /// Instructions of the longest way.
    longest: usize,
    nodes: Vec<Step>,
    /// The state after each way, which must be the same.
    after: Option<State>,
}

impl Ways<'_, '_> {
    /// The subtree from an instruction on, and its number.
    fn walk(&mut self, mut state: State, mut at: usize, [depth, mut count]: [usize; 2]) -> Result<usize, ProofProblem> {
        let text = self.reader.text;
        while count < MOST {
            if at == self.end {
                self.longest = self.longest.max(count);
                return self.leaf(state, at);
            }
            count += 1;
            let line = text.instructions.get(at).map_or(0, |own| own.line);
            if self.reader.feature(&state, at).is_some() || depth > DEEPEST {
                return Err(problem(line, "it is not part of a tree"));
            }
            match state.step(text, at)? {
                Flow::Next => at += 1,
                Flow::Jump(to) => at = to,
                Flow::Branch(condition, to) => match state.compared {
                    Some((Value::Column(column), Value::Number(number))) => {
                        let number =
                            u8::try_from(number).map_err(|_| problem(line, "a number of more than eight bits"))?;
                        let column = &self.reader.columns[column];
                        let (cut, missing_left) = column.cut(number);
                        let rule = Rule { feature: column.feature, cut, missing_left };
                        let [left, right] = match condition {
                            "hi" => [at + 1, to],
                            "ls" => [to, at + 1],
                            _ => return Err(problem(line, "a branch that no tree has")),
                        };
                        let own = self.nodes.len();
                        // Each split has a branch of its own; where ways met again, there would be a node for every way.
                        if own > 2 * text.instructions.len() {
                            return Err(problem(line, "ways through a tree meet again before its end"));
                        }
                        self.nodes.push(Step::Leaf(Vec::new()));
                        let left = self.walk(state.clone(), left, [depth + 1, count])?;
                        let right = self.walk(state, right, [depth + 1, count])?;
                        self.nodes[own] = Step::Split(rule, [left, right]);
                        return Ok(own);
                    }
                    Some((Value::Number(a), Value::Number(b))) => {
                        at = if is_true(condition, a, b) { to } else { at + 1 }
                    }
                    _ => return Err(problem(line, "a branch on an unknown value")),
                },
                Flow::Call(to) if self.votes && self.reader.is_list(to) => {
                    let taken;
                    (state, taken) = self.list(state, to, line)?;
                    count += taken;
                    at += 1;
                }
                Flow::Call(to) => {
                    state.registers[LR] = Value::Unknown;
                    at = to;
                }
                Flow::Return => return Err(problem(line, "it returns in the middle of a tree")),
            }
        }
        Err(problem(0, "it takes no end"))
    }

    /// The state after the routine that adds a list, and its instructions.
    fn list(&self, mut state: State, mut at: usize, line: usize) -> Result<(State, usize), ProofProblem> {
        let text = self.reader.text;
        for count in 1..4096 {
            match state.step(text, at)? {
                Flow::Next => at += 1,
                Flow::Branch(condition, to) => match state.compared {
                    Some((Value::Number(a), Value::Number(b))) => {
                        at = if is_true(condition, a, b) { to } else { at + 1 }
                    }
                    _ => return Err(problem(line, "a branch on an unknown value")),
                },
                Flow::Return => return Ok((state, count)),
                Flow::Jump(_) | Flow::Call(_) => return Err(problem(line, "it leaves a list")),
            }
        }
        Err(problem(line, "a list takes no end"))
    }

    fn leaf(&mut self, mut state: State, at: usize) -> Result<usize, ProofProblem> {
        let line = self.reader.text.instructions.get(at).map_or(0, |own| own.line);
        let own = self.nodes.len();
        let values = if self.votes {
            let mut values = vec![0.0; self.reader.stated.objects];
            for (object, added) in std::mem::take(&mut state.added) {
                match (values.get_mut(object), added) {
                    (Some(value), Added::Number(number)) => *value += f64::from(number),
                    _ => return Err(problem(line, "a margin that no leaf adds to")),
                }
            }
            values
        } else {
            let difference = |register: usize| match (state.registers[register], self.start.registers[register]) {
                (Value::High(a), Value::High(b)) | (Value::Low(a), Value::Low(b)) => Ok(i64::from(a) - i64::from(b)),
                _ => Err(problem(line, "a sum that is lost")),
            };
            let value = 256 * difference(1)? + difference(2)?;
            (state.registers[1], state.registers[2]) = (self.start.registers[1], self.start.registers[2]);
            vec![value as f64]
        };
        self.nodes.push(Step::Leaf(values));
        self.loses_lr |= state.registers[LR] != self.start.registers[LR];
        // What may differ is not looked at any more.
        state.registers[3] = Value::Unknown;
        state.registers[LR] = Value::Unknown;
        if self.votes {
            state.registers[1..=3].fill(Value::Unknown);
        }
        state.compared = None;
        let is_same =
            |after: &State| after.registers == state.registers && after.stack == state.stack && state.added.is_empty();
        match &self.after {
            Some(after) if !is_same(after) => return Err(problem(line, "ways through a tree end differently")),
            Some(_) => {}
            None => {
                // The tree as a whole changes only what was allowed.
                let mut before = self.start.clone();
                before.registers[3] = Value::Unknown;
                before.registers[LR] = Value::Unknown;
                if self.votes {
                    before.registers[1..=3].fill(Value::Unknown);
                }
                if before.registers != state.registers || before.stack != state.stack {
                    return Err(problem(line, "a tree changes more than sums"));
                }
                self.after = Some(state);
            }
        }
        Ok(own)
    }
}
