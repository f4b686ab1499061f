//! `palpate verify` with `--prove` or `--certificate`.

use super::Global;
use super::chips::instructions;
use super::rows::read_rows;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::ensemble::import::Options;
use palpate::ensemble::{OverTouches, read};
use palpate::error::{CompileProblem, Error, EvaluateProblem, Place};
use palpate::evaluate::verify::Verified;
use palpate::output;
use palpate::prove::{Certificate, Moves, Proof, check, check_code, moves, prove, prove_code};
use palpate::rows::Rows;
use palpate::wording::{decimal, scientific};
use palpate_onboard::ModelError;
use std::fmt::Write as _;
use std::path::Path;

/// A model and its ensemble, and the files of a proof of it.
pub(super) struct Asked<'a> {
    pub(super) model: &'a Path,
    pub(super) ensemble: &'a Path,
    /// Rows of which it is said how far one feature can move.
    pub(super) rows: Option<&'a Path>,
    /// Path of the certificate; standard output without it.
    pub(super) written: Option<&'a Path>,
    /// A certificate to check instead.
    pub(super) certificate: Option<&'a Path>,
}

/// Proves the model, or checks a certificate; `verified` is what was found before on the rows, and its text.
pub(super) fn run(
    asked: &Asked<'_>,
    verified: Option<(&Verified, String)>,
    options: &Options<'_>,
    global: &Global,
) -> Result<()> {
    let path = asked.ensemble;
    let model = Proved::read(asked.model)?;
    // The very bytes whose checksum is stated.
    let file = std::fs::read(path).map_err(|source| Error::io(path, "read the ensemble", source))?;
    let ensemble = read(path, &file, options)?;
    let in_model = |error: Error| error.in_file(asked.model);
    if let Some(certificate) = asked.certificate {
        let certificate_read = Certificate::read(certificate)?;
        let proof = match &model {
            Proved::Data(compiled) => check(&certificate_read, compiled.bytes(), &ensemble, &file),
            Proved::Code(bytes, code) => check_code(&certificate_read, bytes, code, &ensemble, &file),
        }
        .map_err(in_model)?;
        let what = format!("The certificate {} holds", certificate.display());
        return global.print(&proof, || proof_text(&proof, &what));
    }
    let written = asked.written.unwrap_or_else(|| Path::new("-"));
    output::admit(written, [asked.model, path].into_iter().chain(asked.rows))?;
    let names = ensemble.inputs.names();
    let has_classes = ensemble.objects.len() > 1 && !ensemble.prediction().targets;
    let rows = match asked.rows {
        Some(_) if ensemble.descriptor().is_some() => {
            return Err(Error::at(Place::file(asked.model), EvaluateProblem::OverTouches));
        }
        // They were read, and said how, before; a regression has no class that could change.
        Some(data) if verified.is_some() && has_classes => Some(Rows::read(data, &ensemble, None)?),
        Some(_) if verified.is_some() => None,
        Some(data) => Some(read_rows(data, &ensemble, None)?),
        None => None,
    };
    let ((proof, certificate), moved) = match &model {
        Proved::Data(compiled) => {
            let proved = prove(compiled.bytes(), &ensemble, &file).map_err(in_model)?;
            (proved, rows.map(|rows| moves(compiled.bytes(), rows.iter())).transpose().map_err(in_model)?)
        }
        Proved::Code(..) if rows.is_some() => {
            let allowed = "no rows with a model whose trees are code; a layout of data has the same margins";
            return Err(Error::setting("data", "given", allowed));
        }
        Proved::Code(bytes, code) => (prove_code(bytes, code, &ensemble, &file).map_err(in_model)?, None),
    };
    output::write_bytes(written, certificate.to_string().as_bytes())?;
    if !global.json {
        let classes: Vec<String> = proof.ranges.iter().map(|(name, ..)| name.clone()).collect();
        let moved = moved.map_or_else(String::new, |rows| moves_text(&rows, &names, &classes));
        let before = verified.map_or_else(String::new, |(_, text)| text);
        return output::print_about(written, &(before + &proof_text(&proof, "Proved") + &moved));
    }
    match (verified, moved) {
        (None, None) => output::print_json_about(written, &proof),
        (None, Some(rows)) => output::print_json_about(written, &serde_json::json!({ "proof": proof, "rows": rows })),
        (Some((verified, _)), moved) => {
            let all = serde_json::json!({ "proof": proof, "rows": moved, "verified": verified });
            output::print_json_about(written, &all)
        }
    }
}

/// A model, with the assembly beside it if its trees are there.
enum Proved {
    Data(CompiledModel),
    Code(Vec<u8>, String),
}

impl Proved {
    fn read(path: &Path) -> Result<Self> {
        let needs_code = |error: &Error| matches!(error.problem(), Some(CompileProblem::Model(ModelError::NeedsCode)));
        match CompiledModel::read(path) {
            Err(error) if needs_code(&error) => {
                let io = |path: &Path, source| Error::io(path, "read", source);
                let assembly = path.with_extension("s");
                if !assembly.exists() {
                    return Err(error);
                }
                let bytes = std::fs::read(path).map_err(|source| io(path, source))?;
                let text = std::fs::read_to_string(&assembly);
                text.map(|text| Self::Code(bytes, text))
                    .map_err(|source| Error::io(&assembly, "read the trees", source))
            }
            other => other.map(Self::Data),
        }
    }
}

/// For each row the nearest change of one feature, relative to its value, that changes the class.
fn moves_text(rows: &[Vec<Moves>], names: &[&str], classes: &[String]) -> String {
    let mut text =
        "The smallest change of one feature, relative to its value, that changes a row's class:\n".to_owned();
    for (number, row) in rows.iter().enumerate() {
        let ways = row.iter().flat_map(|moves| {
            let own = moves.value.unwrap_or_default();
            let to = [moves.below, moves.above].into_iter().flatten();
            to.map(move |(value, class)| (moves.feature, own, value, class))
        });
        let change = |&(_, own, value, _): &(usize, f64, f64, usize)| (value - own).abs() / own.abs().max(1e-30);
        text += &match ways.min_by(|a, b| change(a).total_cmp(&change(b))) {
            Some((feature, own, value, class)) => {
                format!("  row {}: {} from {own} to {value} makes it {}\n", number + 1, names[feature], classes[class])
            }
            None => format!("  row {}: none\n", number + 1),
        };
    }
    text
}

fn proof_text(proof: &Proof, what: &str) -> String {
    let Proof { trees, ensemble_trees, boxes, largest_difference, margin_error, stated, ranges, .. } = proof;
    let compared = match trees {
        0 => format!("the model's table equals the sum of the ensemble's {ensemble_trees} trees"),
        _ => format!("the model's {trees} trees equal the ensemble's {ensemble_trees}"),
    };
    let mut text = format!(
        "{what}: on every possible row {compared}, up to rounding ({boxes} boxes of rows).\n\
         A leaf differs by at most {}, a margin by at most {}; the model states {}.\n",
        scientific(*largest_difference),
        scientific(*margin_error),
        scientific(*stated)
    );
    if margin_error > stated {
        text += "That bound is proved: it is the sum of the trees' largest differences, which no single row need reach. The smaller \
                 one that the model states is not proved here: `export` went through all cells between thresholds for it.\n";
    }
    if let Some([own, of_ensemble]) = proof.other_link {
        text += &format!(
            "Margins are proved, and not what the model makes of them: its link is {own}, the file's {of_ensemble} (`export --link`).\n"
        );
    }
    text += "Bounds of each margin, and how near to them a search for rows came:\n";
    for ((name, least, most), (from, to)) in ranges.iter().zip(&proof.found) {
        let near = |bound: f64, found: f64, extreme: &str| match (bound - found).abs() <= 1e-9 * bound.abs().max(1.0) {
            true => "attained".to_owned(),
            false => format!("{extreme} row found: {}", decimal(found, 4)),
        };
        _ = writeln!(
            text,
            "  {name}: at least {} ({}), at most {} ({})",
            decimal(*least, 4),
            near(*least, *from, "lowest"),
            decimal(*most, 4),
            near(*most, *to, "highest")
        );
    }
    if proof.splits > 0 {
        text += &format!("A row passes at most {} splits.\n", proof.splits);
    }
    if let Some(exact) = proof.instructions {
        text += &format!("A row takes at most {exact} instructions from its features to its margins.\n");
    }
    if let Some(estimated) = proof.estimated {
        text += &format!("Instructions of the longest way, estimated: {}.\n", instructions(estimated));
    }
    text
}
