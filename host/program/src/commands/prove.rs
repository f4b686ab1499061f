//! `palpate verify` with `--prove`.

use super::Global;
use super::chips::instructions;
use palpate::Result;
use palpate::compile::CompiledModel;
use palpate::ensemble::import::Options;
use palpate::ensemble::load_with;
use palpate::evaluate::verify::Verified;
use palpate::output;
use palpate::prove::{Proof, prove};
use palpate::wording::{decimal, scientific};
use std::fmt::Write as _;
use std::path::Path;

/// Proves the model; `verified` is what was found before on the rows, and its text.
pub(super) fn run(
    model: &Path,
    ensemble: &Path,
    verified: Option<(&Verified, String)>,
    options: &Options<'_>,
    global: &Global,
) -> Result<()> {
    let compiled = CompiledModel::read(model)?;
    let ensemble = load_with(ensemble, options)?;
    let proof = prove(compiled.bytes(), &ensemble).map_err(|error| error.in_file(model))?;
    match verified {
        None => global.print(&proof, || proof_text(&proof)),
        Some((verified, _)) if global.json => {
            output::print_json(&serde_json::json!({ "proof": proof, "verified": verified }))
        }
        Some((_, text)) => output::print(&(text + &proof_text(&proof))),
    }
}

fn proof_text(proof: &Proof) -> String {
    let Proof { trees, ensemble_trees, boxes, largest_difference, margin_error, stated, ranges, .. } = proof;
    let compared = match trees {
        0 => format!("the model's table equals the sum of the ensemble's {ensemble_trees} trees"),
        _ => format!("the model's {trees} trees equal the ensemble's {ensemble_trees}"),
    };
    let mut text = format!(
        "Proved: on every possible row {compared}, up to rounding ({boxes} boxes of rows).\n\
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
    text += "Bounds of each margin:\n";
    for (name, least, most) in ranges {
        _ = writeln!(text, "  {name}: at least {}, at most {}", decimal(*least, 4), decimal(*most, 4));
    }
    if proof.splits > 0 {
        text += &format!("A row passes at most {} splits.\n", proof.splits);
    }
    text += &format!("Instructions of the longest way, estimated: {}.\n", instructions(proof.estimated));
    text
}
