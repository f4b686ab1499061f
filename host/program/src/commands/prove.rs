//! The proof of `palpate verify --prove` as text.

use super::chips::instructions;
use palpate::prove::Proof;
use palpate::results::{Results, Value};
use palpate::row;
use palpate::wording::scientific;

/// The proof as text.
pub(super) fn text(proof: &Proof) -> String {
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
    let mut bounds = Results::new(["margin", "at least", "at most"]);
    for (name, least, most) in ranges {
        bounds.push(row![name, Value::Number(*least, 4), Value::Number(*most, 4)]);
    }
    text += &bounds.text();
    if proof.splits > 0 {
        text += &format!("A row passes at most {} splits.\n", proof.splits);
    }
    text += &format!("Instructions of the longest way, estimated: {}.\n", instructions(proof.estimated));
    text
}
