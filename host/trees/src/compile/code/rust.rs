//! The file that makes a safe function of a program in assembly.

use super::program::Program;
use super::symbol;
use palpate_shared::format::Key;

/// `model.rs`, to be a module of a crate that allows unsafe code.
pub(super) fn text(program: &Program, name: &str, file: &str, checksum: u32) -> String {
    let [linked, linked_early] = ["margins", "early"].map(|function| symbol(name, function, checksum));
    let (features, objects) = (program.features, program.objects());
    let real = program.key == Key::Real;
    let row = if real { "f32" } else { "i32" };
    let what =
        if real { "f32 values, NaN where one is missing" } else { "whole numbers, `i32::MIN` where one is missing" };
    let bits = if real {
        format!(
            "\n/// This function for the bits of f32 values.\n\
             #[allow(clashing_extern_declarations)]\n\
             mod bits {{\n    \
             // SAFETY: as above; an f32 and its bits are the same in memory.\n    \
             unsafe extern \"C\" {{\n        \
             #[link_name = \"{linked}\"]\n        \
             pub(super) safe fn margins(row: &[i32; {features}], margins: &mut [i32; {objects}]);\n    \
             }}\n}}\n"
        )
    } else {
        String::new()
    };
    let (early, class) = if program.exits.is_empty() {
        (String::new(), String::new())
    } else {
        let larger = if program.last_of_ties { ">=" } else { ">" };
        (
            format!(
                "\n    /// The same, until a class is known: no other margin is as large as that one then, and all may be others.\n    \
                 #[link_name = \"{linked_early}\"]\n    \
                 pub safe fn {name}_early(row: &[{row}; {features}], margins: &mut [i32; {objects}]);\n"
            ),
            format!(
                "\n/// The class of a row, from no more trees than it takes: that with the largest of its margins.\n\
                 pub fn class(row: &[{row}; {features}]) -> usize {{\n    \
                 let (mut margins, mut class, mut most) = ([0; {objects}], 0, i32::MIN);\n    \
                 {name}_early(row, &mut margins);\n    \
                 for (number, &margin) in margins.iter().take({known}).enumerate() {{\n        \
                 if margin {larger} most {{\n            (class, most) = (number, margin);\n        }}\n    }}\n    class\n}}\n",
                known = program.known,
            ),
        )
    };
    let function = if real { "bits::margins".to_owned() } else { format!("{name}_margins") };
    format!(
        "// {trees} trees as instructions, beside `{file}.s`. Written by `palpate export`; not to be edited. Features of palpate-onboard: code.\n\
         // A module of a crate that allows unsafe code, for a Cortex-M.\n\n\
         core::arch::global_asm!(include_str!(\"{file}.s\"), options(raw));\n\n\
         /// The checksum of the model that was written with it; the names of its functions carry it, so that assembly of another export\n\
         /// does not link.\n\
         #[allow(dead_code)]\n\
         pub const CHECKSUM: u32 = 0x{checksum:08x};\n\n\
         // SAFETY: the assembly reads {features} features, writes {objects} margins, and keeps to the calling convention.\n\
         unsafe extern \"C\" {{\n    \
         /// The margins of a row of {what}, in units.\n    \
         #[link_name = \"{linked}\"]\n    \
         pub safe fn {name}_margins(row: &[{row}; {features}], margins: &mut [i32; {objects}]);\n{early}\
         }}\n{bits}\n\
         /// The function that [`Model::with_code`](palpate_onboard::Model::with_code) takes.\n\
         pub fn margins(row: &[i32], margins: &mut [i32]) {{\n    \
         if let (Some(row), Some(margins)) = (row.first_chunk(), margins.first_chunk_mut()) {{\n        \
         {function}(row, margins);\n    }}\n}}\n{class}",
        trees = program.trees.len(),
    )
}
