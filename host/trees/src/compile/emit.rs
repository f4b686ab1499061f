//! A compiled model as source code, for programs that have no files.

use super::Compiled;
use super::calls::Calls;
use super::code::Program;
use super::cost::{Instructions, has_sequences};
use super::legend::{Legend, plain};
use super::model::open_any;
use crate::ensemble::Probability;
use crate::error::{Error, Result};
use palpate_base::output;
use palpate_base::wording::count;
use palpate_onboard::Model;
use palpate_shared::format::Tag;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A language that a model is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// C99 or C++11, for `palpate.h`.
    C,
    /// Rust, for `palpate-onboard`.
    Rust,
}

impl Language {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::C, Self::Rust];

    /// The name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::C => "c",
            Self::Rust => "rust",
        }
    }

    /// Extension of its files.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::C => "h",
            Self::Rust => "rs",
        }
    }
}

impl Compiled {
    /// The model's files of source code: their extensions and texts. `name`, the files' own without an extension, is what the
    /// array and the functions are called after; characters that an identifier cannot have become `_`.
    ///
    /// In Rust, code stands for itself, beside a model; in C the model's array is with it.
    ///
    /// # Errors
    /// None for what [`compile`](super::compile) returned.
    pub fn sources(&self, name: &str, languages: &[Language]) -> Result<Vec<(&'static str, String)>> {
        let model = open_any(&self.bytes)?;
        let name = identifier(name);
        let legend = Legend::new(&model, &self.categories);
        let source = |language: &Language| {
            let text = match (language, &self.code) {
                // With the model's array.
                (Language::C, code) => c(&legend, &name, self.probability, code.as_ref()),
                (Language::Rust, None) => rust(&legend, &name),
                (Language::Rust, Some(program)) => {
                    program.rust(&about(&model), model.checksum()) + "\n" + &legend.rust("")
                }
            };
            (language.extension(), text)
        };
        Ok(languages.iter().map(source).collect())
    }
}

/// Allowed forms of a model whose bytes alone are known, for an error: no code can be written of it.
pub const NO_CODE: &str = "c or rust for a model that was loaded or calibrated: it is bytes, and code is written from an ensemble. \
                           Code stops at the error rate that the ensemble is compiled with, not at calibrated thresholds";

/// Name of the header that reads models in C.
pub const HEADER: &str = "palpate.h";

/// Writes files of source code under the name of `path`, each with its extension, and beside a header the one that reads models.
/// Returns their paths.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) `output` for a name that a file may not have here; [`Kind::Io`](crate::error::Kind::Io).
pub fn write_sources(path: &Path, files: &[(&'static str, String)]) -> Result<Vec<PathBuf>> {
    let places: Vec<PathBuf> = files.iter().map(|(extension, _)| path.with_extension(extension)).collect();
    for place in &places {
        check_place(path, place)?;
    }
    for (place, (_, text)) in places.iter().zip(files) {
        output::write_bytes(place, text.as_bytes())?;
        if place.extension().is_some_and(|extension| extension == "h") {
            output::write_bytes(&place.with_file_name(HEADER), palpate_onboard::C_HEADER.as_bytes())?;
        }
    }
    Ok(places)
}

/// Refuses a place beside `path` that source code may not have.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) `output`, like [`write_sources`].
pub fn check_place(path: &Path, place: &Path) -> Result<()> {
    // A name such as .palpate has no stem, and what is beside it would be hidden.
    let is_hidden = path.file_name().is_none_or(|name| name.as_encoded_bytes().starts_with(b"."));
    let extension = place.extension().unwrap_or_default().display();
    if is_hidden || place.file_name().is_some_and(|name| name == HEADER) {
        let allowed = format!(
            "a file beside which another one can have the extension .{extension} (but not {HEADER}), for --emit"
        );
        return Err(Error::setting("output", path.display(), allowed));
    }
    Ok(())
}

/// Source file of a model whose bytes alone are known. It is the one that [`Compiled::sources`] writes, without probabilities and
/// categories: the bytes do not say how the library turns margins into the former, and numbers into the latter.
pub fn emit(model: &Model<'_>, name: &str, language: Language) -> String {
    let (name, categories) = (identifier(name), BTreeMap::new());
    let legend = Legend::new(model, &categories);
    match language {
        Language::C => c(&legend, &name, Probability::Unknown, None),
        Language::Rust => rust(&legend, &name),
    }
}

/// Bytes in a line.
const LINE: usize = 20;

/// The most bytes of an array on an AVR, whose pointers have 16 bits.
const LONGEST_ON_AVR: usize = 32_767;

/// A compile-time error on an AVR, for which a model is too long.
fn avr_error(name: &str, length: usize) -> String {
    format!(
        "#if defined(__AVR__)\n\
         #error \"model {name} has {length} bytes, and an array on an AVR at most {LONGEST_ON_AVR}: export it with \
         --leaf i8, or from fewer trees, or take a chip with pointers of 32 bits\"\n#endif\n",
        name = name.to_uppercase(),
    )
}

fn c(legend: &Legend<'_>, name: &str, probability: Probability, code: Option<&Program>) -> String {
    let model = legend.model;
    let functions = code.map_or_else(String::new, |program| program.c_functions(name) + &program.c_opening(name));
    let calls = Calls { model, legend, name, probability, is_code: code.is_some() }.text();
    let guard = format!("{}_MODEL_H", name.to_uppercase());
    let layout = model.layout().name().to_uppercase();
    let leaf = model.leaf_type().name().to_uppercase();
    let strangers = u8::from(model.strangers().is_some());
    let shared = u8::from(model.shared_leaves().is_some());
    let sentinel = u8::from(model.sentinel().is_some());
    let row_evidence = u8::from(has_row_evidence(model));
    let has_outputs = model.outputs().is_some();
    let outputs = if has_outputs { "#ifndef PALPATE_OUTPUTS\n#define PALPATE_OUTPUTS 1\n#endif\n" } else { "" };
    let has_sequences = has_sequences(model);
    let sequences = if has_sequences { "#ifndef PALPATE_SEQUENCES\n#define PALPATE_SEQUENCES 1\n#endif\n" } else { "" };
    let needed = [
        ("PALPATE_STRANGERS", strangers),
        ("PALPATE_SHARED", shared),
        ("PALPATE_SENTINEL", sentinel),
        ("PALPATE_ROW_EVIDENCE", row_evidence),
        ("PALPATE_SEQUENCES", u8::from(has_sequences)),
        ("PALPATE_OUTPUTS", u8::from(has_outputs)),
    ];
    let (objects, length) = (model.object_count(), model.bytes().len());
    let too_long = if length > LONGEST_ON_AVR { avr_error(name, length) } else { String::new() };
    format!(
        "/* {about}\n * Written by `palpate export`; not to be edited. */\n\
         {cost}#ifndef {guard}\n#define {guard}\n\n\
         /* Parts of palpate.h that this model needs. For several models in one file: define these before including the first. */\n\
         #ifndef PALPATE_LAYOUTS\n#define PALPATE_LAYOUTS PALPATE_{layout}\n#endif\n\
         #ifndef PALPATE_LEAVES\n#define PALPATE_LEAVES PALPATE_{leaf}\n#endif\n\
         #ifndef PALPATE_STRANGERS\n#define PALPATE_STRANGERS {strangers}\n#endif\n\
         #ifndef PALPATE_SHARED\n#define PALPATE_SHARED {shared}\n#endif\n\
         #ifndef PALPATE_SENTINEL\n#define PALPATE_SENTINEL {sentinel}\n#endif\n\
         #ifndef PALPATE_ROW_EVIDENCE\n#define PALPATE_ROW_EVIDENCE {row_evidence}\n#endif\n\
         {sequences}{outputs}{too_long}\
         #ifndef PALPATE_MAX_OBJECTS\n#define PALPATE_MAX_OBJECTS {objects}\n#endif\n\
         #if defined(__AVR__) && !defined(PALPATE_BYTE)\n#include <avr/pgmspace.h>\n#define PALPATE_BYTE(p) pgm_read_byte(p)\n#endif\n\
         #include \"palpate.h\"\n\n\
         {checks}\n\
         /* {open} */\n\
         static const uint8_t {name}_model[{length}]\n\
         #if defined(__AVR__)\n    PROGMEM\n#elif defined(__GNUC__)\n    __attribute__((aligned(4)))\n#endif\n    = {{\n\
         {array}}};\n\n{functions}{calls}#endif\n",
        cost = cost(model, code),
        about = about(model),
        checks = checks(&name.to_uppercase(), &layout, &leaf, &needed, objects),
        array = array(model.bytes()),
        open = match functions.as_str() {
            "" => format!("palpate_open(&model, {name}_model, sizeof {name}_model)"),
            _ => format!("{name}_open(&model)"),
        },
    )
}

/// A comment on what a row costs at most.
fn cost(model: &Model<'_>, code: Option<&Program>) -> String {
    let Instructions { m4f, m0_plus } =
        code.map_or_else(|| Instructions::of_longest_ways(model), Program::instructions_of_longest_ways);
    let m0_plus = m0_plus.map_or_else(String::new, |most| format!(", {} on a Cortex-M0+", count(most)));
    format!(
        "/* From features to margins: at most {} instructions on a Cortex-M4F{m0_plus}, estimated.\n * \
         Flash: {} bytes for the model's array, and the functions that are called. RAM: the stack, and a palpate_recognizer for\n \
         * each stream; nothing is static. */\n",
        count(m4f),
        count(model.bytes().len()),
    )
}

/// Compile-time check that names the line that makes room for all models, where another model or the program itself has
/// left out what this one needs.
fn checks(name: &str, layout: &str, leaf: &str, needed: &[(&str, u8)], objects: usize) -> String {
    let several =
        |all: &str, own: &str| (format!("({all} & {own}) == 0"), format!("{all} ({own} | those of the others)"));
    let number = |all: &str, own: usize| (format!("{all} < {own}"), format!("{all} {own}"));
    let mut checks = vec![
        several("PALPATE_LAYOUTS", &format!("PALPATE_{layout}")),
        several("PALPATE_LEAVES", &format!("PALPATE_{leaf}")),
        number("PALPATE_MAX_OBJECTS", objects),
    ];
    checks.extend(needed.iter().filter(|(_, needed)| *needed == 1).map(|(name, _)| number(name, 1)));
    let check = |(fails, line): (String, String)| {
        format!("#if {fails}\n#error \"model {name}: before the first model is included, #define {line}\"\n#endif\n")
    };
    checks.into_iter().map(check).collect()
}

fn rust(legend: &Legend<'_>, name: &str) -> String {
    let model = legend.model;
    format!(
        "// {about}\n// Written by `palpate export`; not to be edited. Features of palpate-onboard: {layout}, {leaf}-leaves{shared}{sentinel}{row}{sequences}.\n\n\
         /// The model: `Model::new(&{constant}.0)`.\n\
         #[rustfmt::skip]\n\
         pub static {constant}: palpate_onboard::Aligned<[u8; {length}]> = palpate_onboard::Aligned([\n\
         {array}]);\n\n{constants}",
        constants = legend.rust(&format!("{}_", name.to_uppercase())),
        about = about(model),
        layout = model.layout().name(),
        leaf = model.leaf_type().name(),
        shared = if model.shared_leaves().is_some() { ", shared-leaves" } else { "" },
        sentinel = if model.sentinel().is_some() { ", sentinel" } else { "" },
        row = if has_row_evidence(model) { ", row-evidence" } else { "" },
        sequences = if has_sequences(model) { ", sequences" } else { "" },
        constant = name.to_uppercase(),
        length = model.bytes().len(),
        array = array(model.bytes()),
    )
}

/// True if the model states what a row adds to the evidence, or how much rows count together.
fn has_row_evidence(model: &Model<'_>) -> bool {
    let tags = [Tag::Weights, Tag::RowEvidence].map(Tag::code);
    model.optional_sections().any(|section| tags.contains(&section.tag))
}

/// Description of the model, in one line.
fn about(model: &Model<'_>) -> String {
    let names: Vec<&str> = (0..model.object_count()).map(|object| model.object_name(object)).collect();
    plain(&format!("{} objects: {}; checksum {:08x}.", names.len(), names.join(", "), model.checksum()))
}

fn array(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(5 * bytes.len());
    for line in bytes.chunks(LINE) {
        text += "    ";
        for byte in line {
            // Writing to a string cannot fail.
            _ = write!(text, "{byte},");
        }
        text.push('\n');
    }
    text
}

/// Turns a name into an identifier of C and Rust: lowercase letters, digits and `_`.
pub fn identifier(name: &str) -> String {
    let part = |character: char| if character.is_ascii_alphanumeric() { character.to_ascii_lowercase() } else { '_' };
    let name: String = name.chars().map(part).collect();
    if name.starts_with(|first: char| first.is_ascii_digit()) || name.is_empty() { format!("_{name}") } else { name }
}

#[cfg(test)]
mod tests {
    use super::super::{Settings, compile};
    use super::*;
    use crate::ensemble::{Ensemble, Inputs, Node, Output, Provenance, Tree};

    const HOUSEHOLD: &[u8] = include_bytes!("../../../../models/household.palpate");

    /// The numbers of the array after the first `open`.
    fn numbers(source: &str, open: &str) -> Vec<u8> {
        let start = source.find(open).expect("an array") + open.len();
        let array = source[start..].split(['}', ']']).next().unwrap();
        array.split([',', '\n', ' ']).filter_map(|number| number.parse().ok()).collect()
    }

    #[test]
    fn the_array_is_the_model() {
        let model = Model::new(HOUSEHOLD).unwrap();
        assert_eq!(numbers(&emit(&model, "household", Language::C), "= {"), HOUSEHOLD);
        assert_eq!(numbers(&emit(&model, "household", Language::Rust), "Aligned(["), HOUSEHOLD);
    }

    #[test]
    fn an_array_that_is_too_long_for_an_avr_is_an_error_there_that_says_what_to_do() {
        let trees = (0..4_000_u16).map(|tree| Tree {
            nodes: vec![
                Node::Split { feature: 0, threshold: f32::from(tree % 90), missing_left: true, left: 1, right: 2 },
                Node::Leaf(vec![f32::from(tree) / 1e3, 0.0]),
                Node::Leaf(vec![0.0, f32::from(tree) / 1e3]),
            ],
            output: Output::Each,
        });
        let ensemble = Ensemble {
            inputs: Inputs::unnamed(1),
            objects: ["a", "b"].map(String::from).into(),
            base_margins: vec![0.0; 2],
            trees: trees.collect(),
            origin: Provenance::default(),
        };
        let long = compile(&ensemble, &Settings::default()).unwrap().bytes;
        let model = Model::new(&long).unwrap();
        let source = emit(&model, "long", Language::C);
        let error = source.lines().find(|line| line.starts_with("#error \"model LONG has")).unwrap();
        assert!(long.len() > LONGEST_ON_AVR && error.contains("32767") && error.contains("--leaf i8"), "{error}");
        // Before anything that an AVR's compiler would stop at first.
        assert!(source.find(error) < source.find("#include"));
        // Shorter ones are none.
        let short = include_bytes!("../../../../onboard/c/examples/Lines/model.palpate");
        assert!(!emit(&Model::new(short).unwrap(), "short", Language::C).contains("on an AVR at most"));
    }

    #[test]
    fn any_file_name_becomes_an_identifier() {
        for (name, expected) in [("model", "model"), ("My model-2", "my_model_2"), ("30trees", "_30trees"), ("", "_")] {
            assert_eq!(identifier(name), expected);
        }
    }

    #[test]
    fn names_of_objects_neither_end_the_comment_nor_begin_one() {
        let mut bytes = HOUSEHOLD.to_vec();
        // The first object's name is "bowl", after the exporter's version.
        for (name, other) in [(b"bowl", b"*/\n\x1b"), (b"fork", b"a/*b")] {
            let at = bytes.windows(4).position(|window| window == name).unwrap();
            bytes[at..at + 4].copy_from_slice(other);
        }
        let body = bytes.len() - 4;
        let sum = palpate_shared::format::checksum(&bytes[..body]);
        bytes[body..].copy_from_slice(&sum.to_le_bytes());
        let source = emit(&Model::new(&bytes).unwrap(), "model", Language::C);
        let first = source.split("*/").next().unwrap();
        assert!(first.contains("wristwatch") && first.ends_with("not to be edited. "), "{first}");
        assert_eq!(first.matches("/*").count(), 1, "{first}");
        assert!(!emit(&Model::new(&bytes).unwrap(), "model", Language::Rust).lines().next().unwrap().contains('\x1b'));
    }
}
