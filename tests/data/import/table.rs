//! The table beside a model of this directory: rows of features, and the library's margins, predictions and probabilities.

/// The cells of one kind of column in each row: `margin`, `prediction` or `probability`; of any other kind those of the features. None if there is no
/// such column.
pub(crate) fn cells<'t>(table: &'t str, kind: &str) -> Vec<Vec<&'t str>> {
    const KINDS: [&str; 3] = ["margin", "prediction", "probability"];
    let is_wanted = |column: &str| {
        let own = column.trim_end_matches(|character: char| character.is_ascii_digit());
        if KINDS.contains(&kind) { own == kind } else { !KINDS.contains(&own) }
    };
    let (header, rows) = table.split_once('\n').expect("a header");
    let wanted: Vec<bool> = header.split(',').map(is_wanted).collect();
    if !wanted.contains(&true) {
        return Vec::new();
    }
    let of = |row: &'t str| row.split(',').zip(&wanted).filter(|(_, wanted)| **wanted).map(|(cell, _)| cell).collect();
    rows.lines().map(of).collect()
}
