//! Instructions with labels, and branches of the length that they need.

use super::{Chip, symbol};
use std::collections::HashMap;
use std::fmt::Write as _;

/// A place in the code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in super::super) struct Label(usize);

/// A condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) enum Condition {
    Higher,
    LowerOrSame,
    Equal,
    NotEqual,
    Greater,
    Less,
    GreaterOrEqual,
    LessOrEqual,
}

impl Condition {
    const fn name(self) -> &'static str {
        match self {
            Self::Higher => "hi",
            Self::LowerOrSame => "ls",
            Self::Equal => "eq",
            Self::NotEqual => "ne",
            Self::Greater => "gt",
            Self::Less => "lt",
            Self::GreaterOrEqual => "ge",
            Self::LessOrEqual => "le",
        }
    }

    const fn inverse(self) -> Self {
        match self {
            Self::Higher => Self::LowerOrSame,
            Self::LowerOrSame => Self::Higher,
            Self::Equal => Self::NotEqual,
            Self::NotEqual => Self::Equal,
            Self::Greater => Self::LessOrEqual,
            Self::LessOrEqual => Self::Greater,
            Self::Less => Self::GreaterOrEqual,
            Self::GreaterOrEqual => Self::Less,
        }
    }
}

#[derive(Clone, Debug)]
enum Item {
    Instruction(String, usize),
    Label(Label),
    Global(&'static str),
    /// Up to the next multiple of four.
    Align,
    Word(i32),
    /// The address of a label.
    Address(Label),
    Bytes(Vec<u8>),
    Halves(Vec<u16>),
    /// Loads a word or an address from a place further on.
    Load(String, Label),
    Call(Label),
    Branch {
        condition: Option<Condition>,
        target: Label,
        /// 0 short; 1 longer; 2 anywhere.
        reach: u8,
    },
}

/// Code that is being written.
#[derive(Clone, Debug)]
pub(in super::super) struct Assembler {
    pub(in super::super) chip: Chip,
    items: Vec<Item>,
    labels: usize,
    /// About how many instructions a row takes, as far as the writers have counted.
    pub(in super::super) instructions: f64,
    /// Values loaded from behind the code that is being written.
    pool: Vec<(Label, Item)>,
    /// Tables that come after all code.
    tables: Vec<Item>,
    position: usize,
}

impl Assembler {
    pub(super) fn new(chip: Chip) -> Self {
        Self {
            chip,
            items: Vec::new(),
            labels: 0,
            instructions: 0.0,
            pool: Vec::new(),
            tables: Vec::new(),
            position: 0,
        }
    }

    pub(in super::super) fn label(&mut self) -> Label {
        self.labels += 1;
        Label(self.labels - 1)
    }

    /// A label here.
    pub(in super::super) fn here(&mut self) -> Label {
        let label = self.label();
        self.place(label);
        label
    }

    pub(in super::super) fn place(&mut self, label: Label) {
        self.items.push(Item::Label(label));
    }

    pub(in super::super) fn global(&mut self, name: &'static str) {
        self.items.push(Item::Global(name));
    }

    /// An instruction of this many bytes.
    pub(in super::super) fn ins(&mut self, text: &str, bytes: usize) {
        self.items.push(Item::Instruction(text.to_owned(), bytes));
        self.position += bytes;
    }

    pub(in super::super) fn branch(&mut self, condition: Option<Condition>, target: Label) {
        self.items.push(Item::Branch { condition, target, reach: 0 });
        self.position += 2;
    }

    pub(in super::super) fn call(&mut self, target: Label) {
        self.items.push(Item::Call(target));
    }

    /// Loads a word that stands in the next pool.
    pub(in super::super) fn load_word(&mut self, register: &str, word: i32) {
        self.load(register, Item::Word(word));
    }

    /// Loads the address of a label.
    pub(in super::super) fn load_address(&mut self, register: &str, label: Label) {
        self.load(register, Item::Address(label));
    }

    fn load(&mut self, register: &str, item: Item) {
        let label = self.label();
        self.items.push(Item::Load(register.to_owned(), label));
        self.pool.push((label, item));
    }

    /// Writes the words that were to be loaded; after an unconditional branch.
    pub(in super::super) fn pool(&mut self) {
        if self.pool.is_empty() {
            return;
        }
        self.items.push(Item::Align);
        for (label, item) in std::mem::take(&mut self.pool) {
            self.items.push(Item::Label(label));
            self.items.push(item);
        }
    }

    pub(in super::super) fn align(&mut self) {
        self.items.push(Item::Align);
    }

    pub(in super::super) fn words(&mut self, words: impl IntoIterator<Item = i32>) {
        self.items.extend(words.into_iter().map(Item::Word));
    }

    pub(in super::super) fn data(&mut self, bytes: Vec<u8>) {
        self.items.push(Item::Bytes(bytes));
    }

    /// A table of numbers of two bytes, after all code.
    pub(in super::super) fn table(&mut self, label: Label, halves: Vec<u16>) {
        self.tables.extend([Item::Align, Item::Label(label)]);
        self.tables.extend(halves.chunks(32).map(|halves| Item::Halves(halves.to_vec())));
    }

    /// A table of words, after all code.
    pub(in super::super) fn word_table(&mut self, label: Label, words: impl IntoIterator<Item = i32>) {
        self.tables.extend([Item::Align, Item::Label(label)]);
        self.tables.extend(words.into_iter().map(Item::Word));
    }

    /// Puts a small whole number into a low register: two instructions and more only beyond 255.
    pub(in super::super) fn number(&mut self, register: &str, number: u32) {
        let bytes: Vec<u32> = (0..4).rev().map(|place| number >> (8 * place) & 255).collect();
        let first = bytes.iter().position(|byte| *byte != 0).unwrap_or(3);
        self.ins(&format!("movs {register}, #{}", bytes[first]), 2);
        let mut shift = 0;
        for byte in &bytes[first + 1..] {
            shift += 8;
            if *byte != 0 {
                self.ins(&format!("lsls {register}, {register}, #{shift}"), 2);
                self.ins(&format!("adds {register}, #{byte}"), 2);
                shift = 0;
            }
        }
        if shift != 0 {
            self.ins(&format!("lsls {register}, {register}, #{shift}"), 2);
        }
    }

    /// Bytes of everything.
    pub(super) fn bytes(&self) -> usize {
        self.items.iter().fold(0, |at, item| at + self.size(item, at))
    }

    /// Bytes so far, if every branch is short.
    pub(in super::super) fn position(&self) -> usize {
        self.position
    }

    /// Instructions from an item on, for counting straight code.
    pub(in super::super) fn count(&self) -> usize {
        self.items.len()
    }

    fn size(&self, item: &Item, at: usize) -> usize {
        match item {
            Item::Label(_) | Item::Global(_) => 0,
            Item::Instruction(_, bytes) => *bytes,
            Item::Align => at.next_multiple_of(4) - at,
            Item::Word(_) | Item::Address(_) | Item::Call(_) => 4,
            Item::Bytes(bytes) => bytes.len(),
            Item::Halves(halves) => 2 * halves.len(),
            Item::Load(..) => 2,
            Item::Branch { condition, reach, .. } => match (condition, reach, self.chip) {
                (_, 0, _) => 2,
                (None, _, _) | (Some(_), 1, _) | (Some(_), _, Chip::M4F) => 4,
                (Some(_), _, Chip::M0Plus) => 6,
            },
        }
    }

    /// Finds how long each branch has to be.
    pub(super) fn finish(&mut self) {
        self.pool();
        self.items.append(&mut self.tables);
        loop {
            let mut at = 0;
            let mut places: HashMap<Label, usize> = HashMap::new();
            for item in &self.items {
                if let Item::Label(label) = item {
                    places.insert(*label, at);
                }
                at += self.size(item, at);
            }
            let (mut at, mut changed) = (0_usize, false);
            for index in 0..self.items.len() {
                let item = &self.items[index];
                let size = self.size(item, at);
                if let Item::Branch { condition, target, reach } = item {
                    // Aligning may move what is between by two.
                    let distance = places[target].abs_diff(at + 4) + 4;
                    let needed = match (condition, self.chip) {
                        (Some(_), _) if distance <= 252 => 0,
                        (None, _) if distance <= 2044 => 0,
                        (Some(_), Chip::M0Plus) if distance > 2040 => 2,
                        _ => 1,
                    };
                    if needed > *reach {
                        changed = true;
                        let (condition, target) = (*condition, *target);
                        self.items[index] = Item::Branch { condition, target, reach: needed };
                    }
                }
                at += size;
            }
            if !changed {
                return;
            }
        }
    }

    /// The text; `name` is what functions are called after, and the model's checksum.
    pub(super) fn print(&self, name: &str, checksum: u32, text: &mut String) {
        // Writing to a string cannot fail.
        for (index, item) in self.items.iter().enumerate() {
            _ = match item {
                Item::Global(function) => {
                    let full = symbol(name, function, checksum);
                    writeln!(text, "\t.global {full}\n\t.type {full}, %function\n\t.thumb_func\n{full}:")
                }
                Item::Label(label) => writeln!(text, "{}:", local(name, *label)),
                Item::Instruction(instruction, _) => writeln!(text, "\t{instruction}"),
                Item::Align => writeln!(text, "\t.balign 4"),
                Item::Word(word) => writeln!(text, "\t.word {word}"),
                Item::Address(label) => writeln!(text, "\t.word {}", local(name, *label)),
                Item::Bytes(bytes) => writeln!(text, "\t.byte {}", list(bytes)),
                Item::Halves(halves) => writeln!(text, "\t.hword {}", list(halves)),
                Item::Load(register, label) => writeln!(text, "\tldr.n {register}, {}", local(name, *label)),
                Item::Call(label) => writeln!(text, "\tbl {}", local(name, *label)),
                Item::Branch { condition, target, reach } => {
                    let over = format!(".L{name}_past{index}");
                    self.print_branch(text, *condition, &local(name, *target), *reach, &over)
                }
            };
        }
        for item in &self.items {
            if let Item::Global(function) = item {
                let full = symbol(name, function, checksum);
                _ = writeln!(text, "\t.size {full}, .-{full}");
            }
        }
    }

    fn print_branch(
        &self,
        text: &mut String,
        condition: Option<Condition>,
        target: &str,
        reach: u8,
        over: &str,
    ) -> std::fmt::Result {
        match (condition, reach, self.chip) {
            (None, 0, _) => writeln!(text, "\tb.n {target}"),
            (None, _, Chip::M4F) => writeln!(text, "\tb.w {target}"),
            // A far jump: what it changes, lr, was saved.
            (None, _, Chip::M0Plus) => writeln!(text, "\tbl {target}"),
            (Some(condition), 0, _) => writeln!(text, "\tb{}.n {target}", condition.name()),
            (Some(condition), _, Chip::M4F) => writeln!(text, "\tb{}.w {target}", condition.name()),
            (Some(condition), reach, Chip::M0Plus) => {
                let far = if reach == 1 { "b.n" } else { "bl" };
                writeln!(text, "\tb{}.n {over}\n\t{far} {target}\n{over}:", condition.inverse().name())
            }
        }
    }
}

fn local(name: &str, label: Label) -> String {
    format!(".L{name}_{}", label.0)
}

fn list<T: ToString>(numbers: &[T]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}
