//! Rust: nested ifs over keys, in plain safe functions without a crate.

use super::program::{CodeNode, Program};
use palpate_shared::format::Key;
use std::collections::HashMap;
use std::fmt::Write as _;

/// The module of a program.
pub(super) fn text(program: &Program, about: &str, checksum: u32) -> String {
    let (features, objects, count) = (program.features, program.objects(), program.columns.len());
    let is_real = program.key == Key::Real;
    let (kind, what) = match program.key {
        Key::Real => ("f32", "f32 values, NaN where one is missing"),
        Key::Whole => ("i32", "whole numbers, `i32::MIN` where one is missing"),
    };
    let splits: usize = program.trees.iter().map(|tree| tree.root.count()).sum();
    let base = list(&program.base);
    let (calls, trees) = trees(program);
    let x = if count == 0 { "_row" } else { "row" };
    let is_changed = if calls.is_empty() { "" } else { "mut " };
    let keys = if count == 0 { String::new() } else { columns(program) };
    let bits = if is_real { "row.map(|bits| f32::from_bits(bits.cast_unsigned()))" } else { "*row" };
    format!(
        "// {about}\n\
         // {trees_count} trees of {splits} splits. Written by `palpate export`; not to be edited. Features of palpate-onboard: code.\n\
         // rustc -O compiles about {IN_TWO_MINUTES} splits in two minutes.\n\n\
         #![allow(dead_code, clippy::all)]\n\n\
         /// The checksum of the model that was written with it.\n\
         pub const CHECKSUM: u32 = 0x{checksum:08x};\n\n\
         /// The margins of a row of {what}, in units.\n\
         pub fn margins_of({x}: &[{kind}; {features}]) -> [i32; {objects}] {{\n    \
         let {is_changed}margins = [{base}];\n{keys}{calls}    margins\n}}\n\n\
         /// The function that [`Model::with_code`](palpate_onboard::Model::with_code) takes.\n\
         pub fn margins(row: &[i32], margins: &mut [i32]) {{\n    \
         if let (Some(row), Some(margins)) = (row.first_chunk::<{features}>(), margins.first_chunk_mut()) {{\n        \
         *margins = margins_of(&{bits});\n    }}\n}}\n{trees}",
        trees_count = program.trees.len(),
    )
}

/// Splits that `rustc -O` takes in two minutes of processor time: 300,000 took 108 seconds.
const IN_TWO_MINUTES: &str = "300,000";

/// Numbers with commas between them.
fn list(numbers: &[i32]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// Lines that make the numbers that splits compare: keys, the least or the largest number where a feature is missing.
fn columns(program: &Program) -> String {
    let key = match program.key {
        Key::Real => {
            "        let bits = row[feature].to_bits().cast_signed();\n        \
             let key = if row[feature].is_nan() { i32::MIN } else if bits < 0 { -(bits & i32::MAX) } else { bits };\n"
        }
        Key::Whole => "        let key = row[feature];\n",
    };
    let missing = match program.sentinel {
        None => "key == i32::MIN".to_owned(),
        Some(sentinel) => format!("key == i32::MIN || ({}..={}).contains(&key)", sentinel.low, sentinel.high),
    };
    let mut columns = String::new();
    for column in &program.columns {
        let missing = if column.missing_left { "i32::MIN" } else { "i32::MAX" };
        _ = write!(columns, "({}, {missing}), ", column.feature);
    }
    let columns = columns.trim_end_matches(", ");
    format!(
        "    let x = &[{columns}].map(|(feature, missing): (usize, i32)| {{\n{key}        \
         if {missing} {{ missing }} else {{ key }}\n    }});\n"
    )
}

/// Statements that add up trees, and the trees' functions.
fn trees(program: &Program) -> (String, String) {
    let (mut calls, mut text, mut leaves) = (String::new(), String::new(), Vec::new());
    let mut numbers: HashMap<&[i32], usize> = HashMap::new();
    let (count, objects) = (program.columns.len(), program.objects());
    for (number, tree) in program.trees.iter().enumerate() {
        if tree.object.is_none() {
            tree.root.leaves(&mut |values| {
                numbers.entry(values).or_insert_with(|| {
                    leaves.push(values);
                    leaves.len() - 1
                });
            });
        }
        let kind = match tree.object {
            Some(object) => {
                _ = writeln!(calls, "    margins[{object}] += tree{number}(x);");
                "i32".to_owned()
            }
            None => {
                _ = writeln!(
                    calls,
                    "    margins.iter_mut().zip(tree{number}(x)).for_each(|(margin, leaf)| *margin += i32::from(*leaf));"
                );
                format!("&'static [i16; {objects}]")
            }
        };
        let leaf = |values: &[i32]| match tree.object {
            Some(_) => values[0].to_string(),
            None => format!("&LEAVES[{}]", numbers.get(values).copied().unwrap_or_default()),
        };
        // Each apart: a compiler takes far longer for all of them in one function.
        _ = write!(text, "\n#[inline(never)]\nfn tree{number}(x: &[i32; {count}]) -> {kind} {{\n");
        node(&tree.root, 1, &leaf, &mut text);
        text += "}\n";
    }
    if !leaves.is_empty() {
        _ = write!(text, "\nstatic LEAVES: [[i16; {objects}]; {}] = [\n", leaves.len());
        leaves.iter().for_each(|values| _ = writeln!(text, "    [{}],", list(values)));
        text += "];\n";
    }
    (calls, text)
}

fn node(own: &CodeNode, depth: usize, leaf: &dyn Fn(&[i32]) -> String, text: &mut String) {
    let indent = "    ".repeat(depth.min(12));
    match own {
        CodeNode::Leaf(values) => _ = writeln!(text, "{indent}{}", leaf(values)),
        CodeNode::Split(split) => {
            _ = writeln!(text, "{indent}if x[{}] < {} {{", split.column, split.cut);
            node(&split.left, depth + 1, leaf, text);
            _ = writeln!(text, "{indent}}} else {{");
            node(&split.right, depth + 1, leaf, text);
            _ = writeln!(text, "{indent}}}");
        }
    }
}
