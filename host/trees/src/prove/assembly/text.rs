//! Assembly as instructions, labels and data.

use super::super::ProofProblem;
use std::collections::HashMap;

/// An instruction: its name without `.n` or `.w`, and its operands.
#[derive(Debug)]
pub(super) struct Instruction {
    pub(super) name: String,
    pub(super) operands: Vec<String>,
    pub(super) line: usize,
}

/// A file of assembly.
pub(super) struct Text {
    pub(super) instructions: Vec<Instruction>,
    /// Positions of labels: the index of the next instruction, and the address of the data there.
    labels: HashMap<String, (usize, u32)>,
    /// Data in their order; an instruction takes no room.
    data: Vec<u8>,
}

/// Address of the first byte of data: no number that a program computes otherwise.
const FIRST: u32 = 0x2000_0000;

pub(super) fn problem(line: usize, what: impl Into<String>) -> ProofProblem {
    ProofProblem::Assembly { line, what: what.into() }
}

impl Text {
    pub(super) fn read(text: &str) -> Result<Self, ProofProblem> {
        let mut read = Self { instructions: Vec::new(), labels: HashMap::new(), data: Vec::new() };
        // Words that are addresses of labels: which may come later.
        let mut addresses: Vec<(usize, usize, String)> = Vec::new();
        for (line, text) in (1..).zip(text.lines()) {
            let text = text.split('@').next().unwrap_or_default().trim();
            if let Some(label) = text.strip_suffix(':') {
                let place = (read.instructions.len(), FIRST + read.data.len() as u32);
                if read.labels.insert(label.to_owned(), place).is_some() {
                    return Err(problem(line, format!("the label {label} is there twice")));
                }
                continue;
            }
            let (name, rest) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
            let operands = operands(rest);
            match name {
                "" | ".syntax" | ".thumb" | ".section" | ".global" | ".type" | ".thumb_func" | ".size" => {}
                ".balign" => read.data.resize(read.data.len().next_multiple_of(4), 0),
                ".byte" | ".hword" | ".word" => {
                    let length = [(".byte", 1), (".hword", 2), (".word", 4)].iter().find(|size| size.0 == name);
                    let length = length.map_or(4, |size| size.1);
                    for operand in operands {
                        match operand.parse::<i64>() {
                            Ok(number) => read.data.extend(&number.to_le_bytes()[..length]),
                            Err(_) => {
                                addresses.push((line, read.data.len(), operand));
                                read.data.extend([0; 4]);
                            }
                        }
                    }
                }
                _ if name.starts_with('.') => return Err(problem(line, format!("{name} is not known"))),
                _ => {
                    let name = name.strip_suffix(".n").or(name.strip_suffix(".w")).unwrap_or(name).to_owned();
                    read.instructions.push(Instruction { name, operands, line });
                }
            }
        }
        for (line, at, label) in addresses {
            let address = read.address(line, &label)?;
            read.data[at..at + 4].copy_from_slice(&address.to_le_bytes());
        }
        Ok(read)
    }

    /// The labels.
    pub(super) fn labels(&self) -> impl Iterator<Item = &str> {
        self.labels.keys().map(String::as_str)
    }

    /// The instruction after a label.
    pub(super) fn target(&self, line: usize, label: &str) -> Result<usize, ProofProblem> {
        self.labels.get(label).map(|place| place.0).ok_or_else(|| problem(line, format!("there is no label {label}")))
    }

    fn address(&self, line: usize, label: &str) -> Result<u32, ProofProblem> {
        self.labels.get(label).map(|place| place.1).ok_or_else(|| problem(line, format!("there is no label {label}")))
    }

    /// The word after a label.
    pub(super) fn word(&self, line: usize, label: &str) -> Result<i32, ProofProblem> {
        let address = self.address(line, label)?;
        Ok(self.load(line, address as i32, 4)?.cast_signed())
    }

    /// A number of this many bytes in the data.
    pub(super) fn load(&self, line: usize, address: i32, length: usize) -> Result<u32, ProofProblem> {
        let at = (address as u32).checked_sub(FIRST).map_or(usize::MAX, |at| at as usize);
        let bytes = at.checked_add(length).and_then(|end| self.data.get(at..end));
        let bytes = bytes.ok_or_else(|| problem(line, "it loads from where there are no data"))?;
        Ok(bytes.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte)))
    }

    /// True if the instructions from a place on are these.
    pub(super) fn is(&self, at: usize, expected: &[&str]) -> bool {
        let own = self.instructions.get(at..at + expected.len()).unwrap_or_default();
        own.len() == expected.len() && own.iter().zip(expected).all(|(own, expected)| own.text() == *expected)
    }
}

impl Instruction {
    pub(super) fn text(&self) -> String {
        let operands = self.operands.join(", ");
        if operands.is_empty() { self.name.clone() } else { format!("{} {operands}", self.name) }
    }
}

/// Parts that commas outside of brackets and braces separate.
fn operands(text: &str) -> Vec<String> {
    let (mut all, mut own, mut depth) = (Vec::new(), String::new(), 0);
    for character in text.chars() {
        depth += match character {
            '[' | '{' => 1,
            ']' | '}' => -1,
            _ => 0,
        };
        if character == ',' && depth == 0 {
            all.push(own.trim().to_owned());
            own.clear();
        } else {
            own.push(character);
        }
    }
    if !own.trim().is_empty() {
        all.push(own.trim().to_owned());
    }
    all
}
