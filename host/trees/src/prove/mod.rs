//! Proofs that a compiled model means what its ensemble means, for every row: any key of every feature, missing,
//! infinite, negative zero and subnormal values among them.
//!
//! Each tree of the model is walked together with the trees of the ensemble that it stands for, over boxes of rows, until
//! each box reaches one leaf of each: the leaves must be equal, or one apart by the rounding of the leaf. That takes time
//! in proportion to the leaves. What the trees' worst leaves add up to bounds the error and the range of each margin.
//!
//! [`prove`] goes from the ensemble's leaves to the model's, which it reads as the chip does. [`check`] goes from the
//! model's leaves to the ensemble's, with a reader of its own that is written from the format's description, and compares
//! the result with a [`Certificate`].
//!
//! Not proved: anything outside the ensemble, such as priors and thresholds for stopping; and that the chip executes its code.

mod assembly;
mod boxes;
mod certificate;
mod chip;
mod error;
mod format;
mod moves;
mod near;
mod span;
mod tables;
mod trees;

pub use certificate::{Certificate, CertifiedTree};
pub use error::ProofProblem;
pub use moves::{Moves, moves};

use crate::compile::code::Form;
use crate::compile::{self, Compiled, Instructions, Language, Source, code};
use crate::ensemble::{Ensemble, Inputs};
use crate::error::Result;
use crate::rows::{Encoder, missing_text};
use boxes::{Keys, Rows, Tree, Values, of_ensemble};
use chip::Chip;
use format::Plain;
use palpate_base::wording::count;
use palpate_onboard::Model;
use palpate_shared::MISSING_FEATURE;
use palpate_shared::format::{LeafType, Link, f32_key};

/// Result of a proof.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Proof {
    /// The model's trees; 0 for a table.
    pub trees: usize,
    /// The ensemble's trees.
    pub ensemble_trees: usize,
    /// Boxes of rows that were compared.
    pub boxes: u64,
    /// The largest difference of a leaf, or of a table's cell, in the library's margins.
    pub largest_difference: f64,
    /// The largest difference of a margin: in any cell between thresholds, of a table or where [`prove`] can go through
    /// them; otherwise a bound, the sum of the trees' largest differences, without what the library loses by adding in f32.
    pub margin_error: f64,
    /// The difference that the model states, including the library's loss by adding in f32.
    pub stated: f64,
    /// For each output its name, and bounds of its margin.
    pub ranges: Vec<(String, f64, f64)>,
    /// For each output the least and the largest margin of a row that a search found, to judge a bound.
    pub found: Vec<(f64, f64)>,
    /// The most splits that a row passes: the sum of each tree's longest way; 0 for a table.
    pub splits: usize,
    /// The most instructions that a row takes from its features to its margins, each tree's longest way counted; only of
    /// assembly.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instructions: Option<usize>,
    /// The most instructions for a layout of data, estimated: see [`Instructions`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimated: Option<Instructions>,
    /// The links of the model and of the ensemble, if `export --link` set another one: the proof is about margins.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_link: Option<[&'static str; 2]>,
}

/// CRC-64 (XZ) of a file.
fn checksum(bytes: &[u8]) -> u64 {
    crc::Crc::<u64>::new(&crc::CRC_64_XZ).checksum(bytes)
}

/// Findings about a model.
struct Found {
    trees: Vec<CertifiedTree>,
    table: Option<f64>,
    boxes: u64,
    outputs: Vec<[f64; 3]>,
}

/// Proves that a model, given by its bytes, adds for every row what `ensemble` adds, which was read from `file`.
///
/// # Errors
/// [`CompileProblem::Model`](crate::error::CompileProblem::Model) if the bytes are no model; [`ProofProblem`] that says for
/// which rows it does not.
pub fn prove(bytes: &[u8], ensemble: &Ensemble, file: &[u8]) -> Result<(Proof, Certificate)> {
    let model = compile::open(bytes)?;
    let plain = format::read(bytes)?;
    statements(&plain, ensemble)?;
    // Size of one unit of a margin in the library, in nats.
    let unit = f64::from(model.unit()) * f64::from(model.prediction().scale);
    let chip = Chip::new(model, unit)?;
    let sources = of_ensemble(ensemble, &plain.keys)?;
    let subject = Subject { plain: &plain, sources: &sources, ensemble };
    let found = if chip.is_table() {
        tables::of_chip(&chip, subject)?
    } else {
        trees::of_chip(&chip, subject, &plain.order(ensemble, model.leaf_type(), None)?)?
    };
    let mut proof = subject.proof(&found);
    if proof.margin_error > proof.stated
        && let Some(exact) = tables::error_in_cells(&chip, subject)?
    {
        // Features that a model computes have fewer values than rows of them.
        if exact > proof.stated * (1.0 + 1e-6) && ensemble.schema().is_none() {
            return Err(ProofProblem::Beyond { stated: proof.stated, found: exact }.into());
        }
        proof.margin_error = exact;
    }
    proof.estimated = Some(Instructions::of_longest_ways(&model));
    let Found { trees, table, outputs, .. } = found;
    Ok((proof, Certificate { model: checksum(bytes), ensemble: checksum(file), code: None, trees, table, outputs }))
}

/// Proves a model of the layout code, whose trees are assembly that [`Compiled::sources`](compile::Compiled::sources) wrote.
///
/// # Errors
/// Errors of [`prove`]; [`ProofProblem::Assembly`] for assembly that is not understood.
pub fn prove_code(bytes: &[u8], code: &str, ensemble: &Ensemble, file: &[u8]) -> Result<(Proof, Certificate)> {
    let model = compile::open_with_code(bytes)?;
    let (plain, read) = with_code(bytes, code)?;
    statements(&plain, ensemble)?;
    let sources = of_ensemble(ensemble, &plain.keys)?;
    let subject = Subject { plain: &plain, sources: &sources, ensemble };
    let order = plain.order(ensemble, model.leaf_type(), Some(read.chip))?;
    let found = trees::of_code(subject, &order, true)?;
    let proof = Proof { instructions: Some(read.instructions), ..subject.proof(&found) };
    let Found { trees, table, outputs, .. } = found;
    let code = Some(checksum(code.as_bytes()));
    Ok((proof, Certificate { model: checksum(bytes), ensemble: checksum(file), code, trees, table, outputs }))
}

/// Checks a certificate of a model of the layout code, from the leaves of its assembly on.
///
/// # Errors
/// Errors of [`check`] and [`prove_code`].
pub fn check_code(
    certificate: &Certificate,
    bytes: &[u8],
    code: &str,
    ensemble: &Ensemble,
    file: &[u8],
) -> Result<Proof> {
    let found = checksum(code.as_bytes());
    let stated = certificate.code.unwrap_or_default();
    if certificate.code != Some(found) {
        return Err(ProofProblem::OtherFile { what: "a file of assembly", stated, found }.into());
    }
    compile::open_with_code(bytes)?;
    let (plain, read) = with_code(bytes, code)?;
    is_about(certificate, bytes, file, ensemble)?;
    statements(&plain, ensemble)?;
    let sources = of_ensemble(ensemble, &plain.keys)?;
    let subject = Subject { plain: &plain, sources: &sources, ensemble };
    let order: Vec<Source> =
        certificate.trees.iter().map(|tree| Source { trees: tree.sources.clone(), offset: tree.offset }).collect();
    let found = trees::of_code(subject, &order, false)?;
    holds(certificate, &found, ensemble)?;
    Ok(Proof { instructions: Some(read.instructions), ..subject.proof(&found) })
}

/// Files of source code as [`Compiled::sources`] has them, a header for C with the most instructions of a row: of assembly
/// counted along its longest way, as a proof counts them, otherwise estimated.
///
/// # Errors
/// None for what [`compile`](compile::compile) returned.
pub fn sources(compiled: &Compiled, name: &str, languages: &[Language]) -> Result<Vec<(&'static str, String)>> {
    let mut files = compiled.sources(name, languages)?;
    let Some((_, header)) = files.iter_mut().find(|(extension, _)| *extension == "h") else { return Ok(files) };
    // Leaves with a value for each class, unless they are votes, are not read back from assembly.
    let assembly = |chip| -> Option<u64> {
        let code = compiled.code.as_ref().map(|(program, _)| (program.clone(), Form::Thumb(chip)));
        let files = Compiled { code, ..compiled.clone() }.sources(name, &[]).ok()?;
        let (_, text) = files.first()?;
        Some(with_code(&compiled.bytes, text).ok()?.1.instructions as u64)
    };
    let bytes = &compiled.bytes;
    let model = if compiled.code.is_some() { compile::open_with_code(bytes)? } else { compile::open(bytes)? };
    let (how, m4f, m0_plus) = match &compiled.code {
        None => {
            let Instructions { m4f, m0_plus } = Instructions::of_longest_ways(&model);
            ("estimated", Some(m4f), m0_plus)
        }
        Some((_, Form::Thumb(chip))) => {
            let most = assembly(*chip);
            ("counted along the longest way", most, most.filter(|_| *chip == code::Chip::M0Plus))
        }
        // An early exit is not in assembly of such leaves. A compiler's code takes about a tenth more.
        Some((_, Form::C)) if compiled.early_exit.is_some() => ("", None, None),
        Some((_, Form::C)) => {
            let more = |chip| assembly(chip).map(|most| most + most / 10);
            ("estimated", more(code::Chip::M4F), more(code::Chip::M0Plus))
        }
    };
    let mut text = String::from("/* ");
    if let Some(m4f) = m4f {
        let m0_plus = m0_plus.map_or_else(String::new, |most| format!(", {} on a Cortex-M0+", count(most)));
        text += &format!(
            "From features to margins: at most {} instructions on a Cortex-M4F{m0_plus}, {how}.\n * ",
            count(m4f)
        );
    }
    text += &format!(
        "Flash: {} bytes for the model's array, and the functions that are called. RAM: the stack, and a palpate_recognizer for\n \
         * each stream; nothing is static. */\n#ifndef ",
        count(compiled.bytes.len()),
    );
    *header = header.replacen("#ifndef ", &text, 1);
    Ok(files)
}

/// The checksum at the end of a model.
fn checksum_of(bytes: &[u8]) -> u32 {
    bytes.last_chunk().map_or(0, |sum| u32::from_le_bytes(*sum))
}

/// A model of the layout code with the trees of its assembly.
fn with_code(bytes: &[u8], code: &str) -> Result<(Plain, assembly::Code), ProofProblem> {
    let mut plain = format::read(bytes)?;
    let stated = assembly::Stated {
        objects: plain.names.len(),
        known: plain.names.len(),
        features: plain.features,
        keys: &plain.keys,
        checksum: checksum_of(bytes),
        sentinel: plain.sentinel,
    };
    let mut read = assembly::read(code, &stated)?;
    let unit = plain.unit;
    plain.base = read.base.iter().map(|&base| base as f64 * unit).collect();
    let exit = |(trees, bound, base): &(usize, u32, Vec<i64>)| format::Exit {
        trees: *trees,
        bound: f64::from(*bound) * unit,
        // What trees after it have in common is added with them.
        later: read.base.iter().zip(base).map(|(all, so_far)| (all - so_far) as f64 * unit).collect(),
    };
    plain.exits = read.exits.iter().map(exit).collect();
    for tree in &mut read.trees {
        for step in &mut tree.nodes {
            if let boxes::Step::Leaf(values) = step {
                values.iter_mut().for_each(|value| *value *= unit);
            }
        }
    }
    plain.trees = std::mem::take(&mut read.trees).into_iter().map(|tree| (tree, 0.0)).collect();
    Ok((plain, read))
}

/// Returns an error unless a certificate is about these files.
fn is_about(certificate: &Certificate, bytes: &[u8], file: &[u8], ensemble: &Ensemble) -> Result<(), ProofProblem> {
    for (what, stated, bytes) in [("a model", certificate.model, bytes), ("an ensemble", certificate.ensemble, file)] {
        let found = checksum(bytes);
        if found != stated {
            return Err(ProofProblem::OtherFile { what, stated, found });
        }
    }
    // Outputs come last.
    let (stated, outputs) = (certificate.outputs.len(), ensemble.objects.len());
    if stated < outputs { Err(ProofProblem::Cut { stated, outputs }) } else { Ok(()) }
}

/// Checks a certificate of a model, given by its bytes, and of `ensemble`, which was read from `file`, in another way than
/// [`prove`] made it.
///
/// # Errors
/// [`CompileProblem::Model`](crate::error::CompileProblem::Model) if the bytes are no model; [`ProofProblem`] that says what
/// is not as the certificate states.
pub fn check(certificate: &Certificate, bytes: &[u8], ensemble: &Ensemble, file: &[u8]) -> Result<Proof> {
    is_about(certificate, bytes, file, ensemble)?;
    // Only what may run on a chip is certified.
    let model = compile::open(bytes)?;
    let plain = format::read(bytes)?;
    statements(&plain, ensemble)?;
    let sources = of_ensemble(ensemble, &plain.keys)?;
    let subject = Subject { plain: &plain, sources: &sources, ensemble };
    let found = match &plain.cells {
        Some(cells) => tables::of_format(subject, cells)?,
        None => trees::of_format(subject, &certificate.trees)?,
    };
    holds(certificate, &found, ensemble)?;
    Ok(Proof { estimated: Some(Instructions::of_longest_ways(&model)), ..subject.proof(&found) })
}

/// Returns an error if a certificate states less than was found.
fn holds(certificate: &Certificate, found: &Found, ensemble: &Ensemble) -> Result<(), ProofProblem> {
    let understated = |what: String, stated: f64, found: f64| {
        let is_within = found <= stated + 1e-9 * stated.abs() + 1e-12;
        if is_within { Ok(()) } else { Err(ProofProblem::Understated { what, stated, found }) }
    };
    for (number, (tree, stated)) in found.trees.iter().zip(&certificate.trees).enumerate() {
        understated(format!("the largest difference of tree {number}"), stated.error, tree.error)?;
    }
    if let Some(error) = found.table {
        let stated = certificate.table.unwrap_or(-1.0);
        understated("the largest difference in a cell".into(), stated, error)?;
    }
    for (object, &[error, least, most]) in found.outputs.iter().enumerate() {
        let name = &ensemble.objects[object];
        let stated = certificate.outputs.get(object).copied().unwrap_or([-1.0, 0.0, 0.0]);
        understated(format!("the largest difference of {name}"), stated[0], error)?;
        understated(format!("the largest margin of {name}"), stated[2], most)?;
        understated(format!("the smallest margin of {name}, negated,"), -stated[1], -least)?;
    }
    Ok(())
}

/// For each tree of a model the trees of the ensemble that it should stand for, the size of a step of its leaves, and the
/// values of the leaf that a row of keys reaches.
///
/// # Errors
/// [`ProofProblem`] if the bytes cannot be read, or the model has another number of trees than it should.
pub(crate) fn leaves_at(
    model: &Model<'_>,
    ensemble: &Ensemble,
    row: &[i32],
) -> Result<Vec<(Source, f64, Vec<f64>)>, ProofProblem> {
    let plain = format::read(model.bytes())?;
    let order = plain.order(ensemble, model.leaf_type(), None)?;
    if order.len() != plain.trees.len() {
        return Err(ProofProblem::Trees { what: format!("{} and not {}", plain.trees.len(), order.len()) });
    }
    let key = |key: &i32| match Values::of((*key).into(), (*key).into(), false) {
        values if *key == MISSING_FEATURE || plain.is_sentinel(&values) => Values::MISSING,
        values => values,
    };
    let mut row: Vec<Values> = row.iter().map(key).collect();
    let mut leaf = |(source, (tree, step)): (Source, &(Tree, f64))| {
        let mut values = Vec::new();
        tree.leaves(&mut row, &mut |leaf, _| {
            values = leaf.to_vec();
            Ok::<(), ProofProblem>(())
        })?;
        Ok((source, *step, values))
    };
    order.into_iter().zip(&plain.trees).map(&mut leaf).collect()
}

impl Plain {
    /// Trees of the ensemble that each tree of the model should stand for, or each tree of assembly for a chip.
    fn order(
        &self,
        ensemble: &Ensemble,
        leaf: LeafType,
        chip: Option<code::Chip>,
    ) -> Result<Vec<Source>, ProofProblem> {
        let scales = if let Keys::Scaled(scales) = &self.keys { Some(scales.as_slice()) } else { None };
        let ends: Vec<usize> = self.exits.iter().map(|exit| exit.trees).collect();
        let order = compile::order(ensemble, leaf, scales, &ends, chip);
        order.map_err(|error| ProofProblem::Trees { what: error.to_string() })
    }
}

/// A model's meaning, and the ensemble that it is compared with.
#[derive(Clone, Copy)]
struct Subject<'s> {
    plain: &'s Plain,
    /// The ensemble's trees, over the model's keys.
    sources: &'s [Tree],
    ensemble: &'s Ensemble,
}

impl Subject<'_> {
    fn proof(self, found: &Found) -> Proof {
        let Self { plain, ensemble, .. } = self;
        let largest = found.trees.iter().map(|tree| tree.error).fold(found.table.unwrap_or(0.0), f64::max);
        Proof {
            trees: found.trees.len(),
            ensemble_trees: ensemble.trees.len(),
            boxes: found.boxes,
            largest_difference: largest,
            margin_error: found.outputs.iter().map(|[error, ..]| *error).fold(0.0, f64::max),
            stated: plain.stated,
            ranges: plain
                .names
                .iter()
                .zip(&found.outputs)
                .map(|(name, &[_, least, most])| (name.clone(), least, most))
                .collect(),
            found: near::found(plain),
            splits: plain.trees.iter().map(|(tree, _)| tree.depth()).sum(),
            instructions: None,
            estimated: None,
            other_link: self.other_link(),
        }
    }

    /// The links of the model and of the ensemble, if they differ.
    fn other_link(self) -> Option<[&'static str; 2]> {
        let own = self.ensemble.prediction().link;
        let link = Link::from_code(self.plain.link.0).filter(|link| *link != own)?;
        Some([link.name(), own.name()])
    }

    /// Rows in words: the features that are bound.
    fn example(self, rows: &Rows) -> String {
        let keys = &self.plain.keys;
        let names = self.ensemble.inputs.names();
        let all = keys.all(rows.len());
        let bound = |rows: &(usize, (&Values, &Values))| rows.1.0 != rows.1.1;
        let text = |(feature, (values, _)): (usize, (&Values, &Values))| {
            let name = names.get(feature).copied().unwrap_or("?");
            if values.low > values.high {
                format!("{name} missing")
            } else {
                format!("{name} from {} to {}", keys.value(feature, values.low), keys.value(feature, values.high))
            }
        };
        let texts: Vec<String> = rows.iter().zip(&all).enumerate().filter(bound).map(text).collect();
        if texts.is_empty() { "all rows".into() } else { texts.join(", ") }
    }
}

/// The output that a value of a leaf is for, of a tree of one output or of all.
fn output_of(object: Option<usize>, value: usize) -> usize {
    object.unwrap_or(value)
}

/// Returns an error unless names, features and predictions are the ensemble's.
fn statements(plain: &Plain, ensemble: &Ensemble) -> Result<(), ProofProblem> {
    let same = |what, model: String, ensemble: String| {
        if model == ensemble { Ok(()) } else { Err(ProofProblem::Statement { what, model, ensemble }) }
    };
    // They are matched by position, since `export --names` names them otherwise; the same names in another order are others.
    let sorted = |names: &[String]| {
        let mut sorted = names.to_vec();
        sorted.sort_unstable();
        sorted
    };
    let [own, theirs] = [&plain.names, &ensemble.objects];
    if own.len() != theirs.len() || (own != theirs && sorted(own) == sorted(theirs)) {
        same("outputs", own.join(", "), theirs.join(", "))?;
    }
    same("features", plain.features.to_string(), ensemble.inputs.count().to_string())?;
    let descriptor = ensemble.schema().map_or(255, |schema| schema.code);
    same("descriptor codes", plain.descriptor.to_string(), descriptor.to_string())?;
    if let Inputs::Rows(names) = &ensemble.inputs
        && !plain.feature_names.is_empty()
    {
        same("names of features", plain.feature_names.join(", "), names.join(", "))?;
    }
    let own = ensemble.prediction();
    let rule = |last: bool, average: u32| {
        format!("the {} of equal classes, values of a margin over {average}", if last { "last" } else { "first" })
    };
    let (_, last, average) = plain.link;
    same("predictions", rule(last, average), rule(own.last_of_ties, own.average))?;
    let kind = |targets| if targets { "targets" } else { "classes, or one value" };
    same("kinds of outputs", kind(plain.targets).into(), kind(own.targets).into())?;
    let missing = ensemble.origin.imported.as_ref().and_then(|imported| imported.sentinel);
    let number = |end: f32| match &plain.keys {
        Keys::Scaled(scales) => (f64::from(end) * f64::from(scales[0])).round() as i32,
        Keys::Real | Keys::Whole => f32_key(end),
    };
    let missing = missing.map(|ends| ends.map(|end| i64::from(number(end))));
    let value = |number: i64| match &plain.keys {
        Keys::Scaled(scales) => number as f64 / f64::from(scales[0]),
        Keys::Real | Keys::Whole => Encoder::Real.value(0, number as i32),
    };
    let text = |ends: Option<[i64; 2]>| missing_text(ends.map(|ends| ends.map(value)));
    same("missing values", text(plain.sentinel), text(missing))
}
