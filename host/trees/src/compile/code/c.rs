//! C99: nested ifs over keys or ranks, without a library.

use super::columns::{Column, Kind};
use super::program::{CodeNode, CodeTree, Program};
use palpate_shared::format::Key;
use std::collections::HashMap;
use std::fmt::Write as _;

/// With more columns than this, few comparisons come again, and compilers do not write out paths for each result.
const FEW_COLUMNS: usize = 16;

/// Code that is being written.
pub(super) struct Writer<'p> {
    pub(super) program: &'p Program,
    pub(super) name: &'p str,
    pub(super) text: String,
    /// Compares keys, not ranks.
    keys: bool,
    barrier: bool,
}

/// The functions of a program, for a file that includes `palpate.h`.
pub(super) fn text(program: &Program, name: &str) -> String {
    let mut writer = Writer::new(program, name);
    writer.head();
    writer.ranks();
    let calls = writer.functions();
    writer.line(&format!("{}\n{{", signature(program, name)));
    writer.start();
    writer.line(&calls);
    writer.line("}");
    writer.best();
    writer.text
}

/// Base margins, for an array.
pub(super) fn base(program: &Program) -> String {
    program.base.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
}

/// The function that opens the model and gives it the function that adds up its trees.
pub(super) fn opening(program: &Program, name: &str) -> String {
    let features = program.features;
    let call = if program.key == Key::Real {
        format!(
            "    float row[{features}];\n    int i;\n    for (i = 0; i < {features}; i++) {{\n        \
             union {{\n            uint32_t bits;\n            float value;\n        }} both;\n        \
             /* A key of an f32 value, back to its bits. */\n        \
             both.bits = features[i] == INT32_MIN ? 0x7fc00000u : features[i] < 0 ? 0x80000000u - (uint32_t)features[i] : \
             (uint32_t)features[i];\n        row[i] = both.value;\n    }}\n    {name}_margins(row, margins);\n"
        )
    } else {
        format!("    {name}_margins(features, margins);\n")
    };
    format!(
        "static inline void {name}_code_(const int32_t *features, int32_t *margins)\n{{\n{call}}}\n\n\
         /* Opens the model with its trees. */\n\
         static inline palpate_error {name}_open(palpate_model *model)\n{{\n    \
         return palpate_open_code(model, {name}_model, sizeof {name}_model, {name}_code_);\n}}\n\n"
    )
}

fn row(program: &Program) -> &'static str {
    if program.key == Key::Real { "float" } else { "int32_t" }
}

fn signature(program: &Program, name: &str) -> String {
    format!(
        "/* The margins of a row of {} features{}. */\nstatic inline void {name}_margins(const {} *row, int32_t *margins)",
        program.features,
        if program.key == Key::Real { ", NaN where one is missing" } else { ", INT32_MIN where one is missing" },
        row(program),
    )
}

impl<'p> Writer<'p> {
    fn new(program: &'p Program, name: &'p str) -> Self {
        let keys = program.has_keys();
        let barrier = !keys && program.columns.len() <= FEW_COLUMNS;
        Self { program, name, text: String::new(), keys, barrier }
    }

    pub(super) fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    /// The type of a column's number.
    fn number(&self) -> &'static str {
        if self.keys { "int32_t" } else { "uint8_t" }
    }

    fn head(&mut self) {
        self.line(
            "#include <stdint.h>\n\
             #if defined(__GNUC__)\n\
             #define PALPATE_APART_CODE_ static __attribute__((noinline))\n\
             #else\n\
             #define PALPATE_APART_CODE_ static\n\
             #endif",
        );
        if self.barrier {
            self.line(
                "/* Between two trees: otherwise a compiler writes paths out for what is known of one in the next. */\n\
                 #if defined(__GNUC__)\n\
                 #define PALPATE_BARRIER_CODE_ __asm__ volatile(\"\" : : : \"memory\");\n\
                 #else\n\
                 #define PALPATE_BARRIER_CODE_\n\
                 #endif",
            );
        }
    }

    /// The function that makes the columns' numbers.
    fn ranks(&mut self) {
        let (program, name) = (self.program, self.name);
        if program.columns.is_empty() {
            return;
        }
        let mut body = String::new();
        let mut first = 0;
        for (number, columns) in program.runs().enumerate() {
            let features = columns.iter().map(|column| column.feature.to_string()).collect::<Vec<_>>().join(", ");
            self.line(&format!("static const uint8_t {name}_which{number}[{}] = {{{features}}};", columns.len()));
            let last = first + columns.len();
            let lines = self.run(number, columns);
            _ = writeln!(
                body,
                "    which = {name}_which{number};\n    for (; x != end + {last}; x++) {{\n        {}\n{lines}    }}",
                self.load(),
            );
            first = last;
        }
        let head = format!(
            "PALPATE_APART_CODE_ void {name}_ranks(const {} *row, {} *x)\n{{\n    {} *const end = x;\n    \
             const uint8_t *which;\n    int32_t key;",
            row(program),
            self.number(),
            self.number(),
        );
        self.line(&head);
        let searches = program.columns.iter().any(|column| matches!(column.kind, Kind::Search { .. }));
        if !self.keys && searches {
            self.line("    const int32_t *cuts, *cut;");
        }
        self.line(&format!("{body}}}"));
    }

    /// Loads a feature as a whole number, or the bits of an f32.
    fn load(&self) -> &'static str {
        if self.program.key == Key::Whole {
            return "key = row[*which++];";
        }
        "union {\n            float value;\n            int32_t bits;\n        } both;\n        both.value = row[*which++];\n        \
         key = both.bits;"
    }

    /// Operations on the features of one run of columns.
    fn run(&mut self, number: usize, columns: &[Column]) -> String {
        let (program, name) = (self.program, self.name);
        let first = &columns[0];
        let missing = match (self.keys, first.missing_left) {
            (false, true) => "0",
            (false, false) => "255",
            (true, true) => "INT32_MIN",
            (true, false) => "INT32_MAX",
        };
        let positive =
            program.sentinel.is_none() && columns.iter().all(|column| column.cuts.iter().all(|cut| *cut > 0));
        let mut lines = String::new();
        if let (false, Kind::Grid { bits, before }) = (self.keys, first.kind) {
            return grid(bits, before, missing);
        }
        let is_missing = if program.key == Key::Real { "(key & 0x7fffffff) > 0x7f800000" } else { "key == INT32_MIN" };
        if program.key == Key::Real && !positive {
            // After the check for NaN, which sets what is missing apart.
            _ = writeln!(lines, "        key = {is_missing} ? INT32_MIN : key < 0 ? -(key & 0x7fffffff) : key;");
        }
        let is_missing = if program.key == Key::Real && positive { is_missing } else { "key == INT32_MIN" };
        let is_missing = match program.sentinel {
            None => is_missing.to_owned(),
            Some(sentinel) => {
                // The least number is written as a difference, since a compiler takes its digits as a larger type's.
                let low = i64::from(sentinel.low) + 1;
                format!("{is_missing} || (key >= {low} - 1 && key <= {})", sentinel.high)
            }
        };
        if self.keys {
            _ = writeln!(lines, "        *x = {is_missing} ? {missing} : key;");
            return lines;
        }
        let Kind::Search { steps } = first.kind else { return lines };
        let length = (1_usize << steps) - 1;
        let cuts = columns.iter().flat_map(|column| {
            column.cuts.iter().copied().chain(std::iter::repeat_n(i32::MAX, length - column.cuts.len()))
        });
        let cuts = cuts.map(|cut| cut.to_string()).collect::<Vec<_>>();
        let all = cuts.chunks(16).map(|cuts| cuts.join(",")).collect::<Vec<_>>().join(",\n    ");
        self.line(&format!("static const int32_t {name}_cuts{number}[{}] = {{\n    {all}}};", cuts.len()));
        _ = writeln!(
            lines,
            "        cuts = {name}_cuts{number} + {length} * (x - end - {});\n        cut = cuts;",
            first_of(program, columns),
        );
        for step in (0..steps).rev() {
            _ = writeln!(
                lines,
                "        if (cut[{}] <= key) {{\n            cut += {};\n        }}",
                (1 << step) - 1,
                1 << step
            );
        }
        _ = writeln!(lines, "        *x = {is_missing} ? {missing} : (uint8_t)(cut - cuts);");
        lines
    }

    /// Makes the columns' numbers, and begins the margins, in a function that has the row.
    fn start(&mut self) {
        let (count, name) = (self.program.columns.len(), self.name);
        if count > 0 {
            let number = self.number();
            self.line(&format!("    {number} x[{count}];"));
            // Declarations come first.
            self.line(&format!("    const int made = ({name}_ranks(row, x), 0);"));
        } else {
            self.line("    const int made = ((void)row, 0);");
        }
        let (base, objects) = (base(self.program), self.program.objects());
        self.line(&format!("    static const int32_t base[{objects}] = {{{base}}};\n    int i;"));
        self.line(&format!("    for (i = 0; i < {objects}; i++) {{\n        margins[i] = base[i];\n    }}"));
    }

    /// The function that finds the largest margin.
    fn best(&mut self) {
        let (name, known) = (self.name, self.program.known);
        let larger = if self.program.last_of_ties { ">=" } else { ">" };
        self.line(&format!(
            "static inline int {name}_best_(const int32_t *margins)\n{{\n    int best = 0, i;\n    \
             for (i = 1; i < {known}; i++) {{\n        if (margins[i] {larger} margins[best]) {{\n            \
             best = i;\n        }}\n    }}\n    return best;\n}}"
        ));
    }

    /// Writes functions for all trees, and gives the statements that call them, for margins that are there.
    fn functions(&mut self) -> String {
        let mut calls = String::from("    (void)made;\n");
        if self.program.columns.is_empty() {
            return calls;
        }
        calls += &self.ones();
        let vectors: Vec<&CodeTree> = self.program.trees.iter().filter(|tree| tree.object.is_none()).collect();
        if !vectors.is_empty() {
            let numbers = self.leaves(&vectors);
            calls += &self.vectors(&vectors, &numbers);
        }
        calls
    }

    /// Functions for trees of one object each.
    fn ones(&mut self) -> String {
        let program = self.program;
        let mut calls = String::new();
        for object in 0..program.objects() {
            for (index, chunk) in program.chunks(object).into_iter().enumerate() {
                let function = format!("{}_object{object}_{index}", self.name);
                self.line(&format!(
                    "PALPATE_APART_CODE_ int32_t {function}(const {} *x)\n{{\n    int32_t high = 0, low = 0;",
                    self.number()
                ));
                for tree in chunk {
                    self.ifs(&tree.root, 1, &|leaf| halves(leaf[0]));
                    if self.barrier {
                        self.line("    PALPATE_BARRIER_CODE_");
                    }
                }
                self.line("    return high * 256 + low;\n}");
                _ = writeln!(calls, "    margins[{object}] += {function}(x);");
            }
        }
        calls
    }

    /// A table of leaves with a value for each object, and the number of each.
    fn leaves(&mut self, trees: &[&CodeTree]) -> HashMap<Vec<i32>, usize> {
        let objects = self.program.objects();
        let mut numbers: HashMap<Vec<i32>, usize> = HashMap::new();
        let mut rows: Vec<Vec<i32>> = Vec::new();
        let vote = self.program.vote();
        if let Some(vote) = vote {
            // The number of a vote is its object.
            for object in 0..objects {
                let mut row = vec![0; objects];
                row[object] = vote;
                numbers.insert(row.clone(), object);
                rows.push(row);
            }
        }
        for tree in trees {
            tree.root.leaves(&mut |values| {
                numbers.entry(values.to_vec()).or_insert_with(|| {
                    rows.push(values.to_vec());
                    rows.len() - 1
                });
            });
        }
        self.table(&rows, vote);
        numbers
    }

    /// Functions that give the number of a leaf, and the calls.
    fn vectors(&mut self, trees: &[&CodeTree], numbers: &HashMap<Vec<i32>, usize>) -> String {
        let name = self.name;
        let mut calls = String::new();
        for (index, tree) in trees.iter().enumerate() {
            let function = format!("{name}_tree{index}");
            self.line(&format!("PALPATE_APART_CODE_ uint16_t {function}(const {} *x)\n{{", self.number()));
            self.ifs(&tree.root, 1, &|leaf| format!("return {};", numbers[leaf]));
            self.line("}");
            _ = writeln!(calls, "    {name}_add(margins, {function}(x));");
        }
        calls
    }

    /// The function that adds a leaf by its number.
    fn table(&mut self, rows: &[Vec<i32>], vote: Option<i32>) {
        let (name, objects) = (self.name, self.program.objects());
        let Some(vote) = vote else {
            let fits = rows.iter().flatten().all(|value| i8::try_from(*value).is_ok());
            let kind = if fits { "int8_t" } else { "int16_t" };
            let all = rows
                .iter()
                .map(|row| format!("    {{{}}}", row.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")));
            let all = all.collect::<Vec<_>>().join(",\n");
            self.line(&format!(
                "static const {kind} {name}_leaves[{}][{objects}] = {{\n{all}}};\n\
                 PALPATE_APART_CODE_ void {name}_add(int32_t *margins, uint16_t leaf)\n{{\n    int i;\n    \
                 for (i = 0; i < {objects}; i++) {{\n        margins[i] += {name}_leaves[leaf][i];\n    }}\n}}",
                rows.len(),
            ));
            return;
        };
        let (mut starts, mut entries) = (Vec::new(), Vec::new());
        for row in rows.iter().skip(objects) {
            starts.push((entries.len() / 2).to_string());
            let mut given: Vec<(usize, i32)> =
                row.iter().copied().enumerate().filter(|(_, value)| *value != 0).collect();
            if given.is_empty() {
                given.push((0, 0));
            }
            let last = given.len() - 1;
            for (index, (object, value)) in given.into_iter().enumerate() {
                let end = if index == last { 0x8000 } else { 0 };
                entries.extend([(object | end).to_string(), value.to_string()]);
            }
        }
        if starts.is_empty() {
            starts.push("0".into());
            entries.extend(["32768".to_owned(), "0".to_owned()]);
        }
        let lines = |all: &[String]| all.chunks(20).map(|part| part.join(",")).collect::<Vec<_>>().join(",\n    ");
        self.line(&format!(
            "static const uint16_t {name}_starts[] = {{\n    {}}};\n\
             static const uint16_t {name}_lists[] = {{\n    {}}};\n\
             PALPATE_APART_CODE_ void {name}_add(int32_t *margins, uint16_t leaf)\n{{\n    const uint16_t *list;\n    \
             if (leaf < {objects}) {{\n        margins[leaf] += {vote};\n        return;\n    }}\n    \
             list = {name}_lists + 2 * {name}_starts[leaf - {objects}];\n    do {{\n        \
             margins[list[0] & 0x7fff] += list[1];\n        list += 2;\n    }} while (list[-2] < 0x8000);\n}}",
            lines(&starts),
            lines(&entries),
        ));
    }

    fn ifs(&mut self, node: &CodeNode, depth: usize, leaf: &dyn Fn(&[i32]) -> String) {
        let indent = "    ".repeat(depth.min(12));
        match node {
            CodeNode::Leaf(values) => self.line(&format!("{indent}{}", leaf(values))),
            CodeNode::Split(split) => {
                let condition = if self.keys {
                    // The least key is no threshold.
                    format!("x[{}] < {}", split.column, split.cut)
                } else {
                    format!("x[{}] <= {}", split.column, split.at)
                };
                self.line(&format!("{indent}if ({condition}) {{"));
                self.ifs(&split.left, depth + 1, leaf);
                self.line(&format!("{indent}}} else {{"));
                self.ifs(&split.right, depth + 1, leaf);
                self.line(&format!("{indent}}}"));
            }
        }
    }
}

/// The place of the first of some columns.
fn first_of(program: &Program, columns: &[Column]) -> usize {
    program.columns.iter().position(|column| std::ptr::eq(column, &raw const columns[0])).unwrap_or(0)
}

/// Text that adds a value to 256 · high + low.
fn halves(value: i32) -> String {
    let (high, low) = (value >> 8, value & 255);
    let mut text = match high {
        0 => String::new(),
        1.. => format!("high += {high};"),
        _ => format!("high -= {};", -i64::from(high)),
    };
    if low != 0 {
        text += &format!(" low += {low};");
    }
    if text.is_empty() { ";".into() } else { text.trim().into() }
}

/// The number of an f32 value on a grid, from its bits.
fn grid(bits: i8, before: bool, missing: &str) -> String {
    let first = 158 - i32::from(bits);
    let step = if before { "            key--;\n" } else { "" };
    format!(
        "        if ((key & 0x7fffffff) > 0x7f800000) {{\n            *x = {missing};\n            continue;\n        }}\n        \
         *x = 0;\n        if (key > 0) {{\n            int32_t shift;\n{step}            shift = {first} - (key >> 23);\n            \
         if (shift < 24) {{\n                *x = 255;\n            }} else if (shift < 32) {{\n                \
         *x = (uint8_t)(((uint32_t)key << 8 | 0x80000000u) >> shift);\n            }}\n        }}\n"
    )
}
