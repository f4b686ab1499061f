use super::*;
use crate::touches::synthetic;

fn quick() -> Settings {
    Settings { groups: 60, max_bytes: Some(6_000), ..Settings::default() }
}

#[test]
fn the_choice_fits_and_nothing_that_fits_stops_sooner() {
    let dataset = synthetic::dataset(&[1_500, 1_500, 1_500], 1);
    let tuned = tune(&dataset, &Settings { max_instructions: Some(1_500), ..quick() }, &()).unwrap();
    let chosen = &tuned.rows[tuned.chosen];
    assert!(chosen.bytes <= Some(6_000) && chosen.instructions <= Some(1_500));
    assert_eq!(chosen.bytes, Some(tuned.model.len()));
    let better = |row: &&Row| {
        row.bytes <= Some(6_000)
            && row.instructions <= Some(1_500)
            && row.error <= 0.01
            && row.mean_touches < chosen.mean_touches
    };
    assert!(chosen.error > 0.01 || !tuned.rows.iter().any(|row| better(&row)));
    assert_eq!(tuned.ensemble.trees.len(), chosen.recipe.trees);
    assert!(tuned.rows.iter().any(|row| row.layout == Some("grid")));
    assert!(tuned.test.accuracy[&30] > 0.8);
}

#[test]
fn the_frontier_holds_what_nothing_beats() {
    let tuned = tune(&synthetic::dataset(&[800, 800], 2), &Settings { max_bytes: None, ..quick() }, &()).unwrap();
    let figures = |row: &Row| (row.bytes.unwrap(), row.instructions.unwrap(), row.mean_touches);
    for row in &tuned.rows {
        let (bytes, instructions, touches) = figures(row);
        let beaten = tuned.rows.iter().map(figures).any(|(b, i, t)| {
            b <= bytes && i <= instructions && t <= touches && (b < bytes || i < instructions || t < touches)
        });
        assert_eq!(row.frontier, !beaten, "{row:?}");
    }
    assert!(tuned.rows.iter().any(|row| row.frontier));
}

#[test]
fn limits_that_nothing_fits_name_the_smallest_model() {
    let settings = Settings { max_bytes: Some(10), ..quick() };
    let error = tune(&synthetic::dataset(&[300, 300], 3), &settings, &()).unwrap_err();
    assert!(error.to_string().contains("the smallest has") && error.exit_code() == 1, "{error}");
}
