use super::*;
use crate::ensemble::OverTouches;
use crate::error::Setting;
use crate::tests::synthetic;
use crate::with;

fn quick() -> Settings {
    Settings { groups: 60, max_bytes: Some(6_000), ..Settings::default() }
}

/// Full touches, waited for.
fn full(mut dataset: Dataset) -> Dataset {
    dataset.objects.iter_mut().for_each(|object| *object = object.filtered(palpate_shared::Touch::is_full));
    dataset
}

#[test]
fn approaches_are_what_is_saved_where_the_data_set_holds_them() {
    let tuned = tune(&synthetic::dataset(&[800, 800], 2), &Settings { max_bytes: None, ..quick() }, &()).unwrap();
    let figures = |row: &Row| (row.bytes.unwrap(), row.instructions.unwrap(), row.mean_approaches.unwrap());
    for row in &tuned.rows {
        let (bytes, instructions, approaches) = figures(row);
        let beaten = tuned.rows.iter().map(figures).any(|(b, i, a)| {
            b <= bytes && i <= instructions && a <= approaches && (b < bytes || i < instructions || a < approaches)
        });
        assert_eq!(row.frontier, !beaten, "{row:?}");
    }
    assert_eq!(tuned.ensemble.descriptor(), Some(palpate_shared::Descriptor::ContactsCurvature));
    assert!(tuned.test.approaches.is_some());
    assert!(tuned.rows.iter().any(|row| row.layout == Some("patterns")));
}

#[test]
fn the_choice_fits_and_nothing_that_fits_stops_sooner() {
    let dataset = full(synthetic::dataset(&[1_500, 1_500, 1_500], 1));
    let tuned = tune(&dataset, &Settings { max_instructions: Some(1_700), ..quick() }, &()).unwrap();
    let chosen = &tuned.rows[tuned.chosen];
    assert!(chosen.bytes <= Some(6_000) && chosen.instructions <= Some(1_700));
    // The calibration's bytes count, whether or not there were sequences enough for it.
    let added = tuned.calibration.as_ref().map_or(calibrate::added_bytes(&Noise::default()), |_| 0);
    assert_eq!(chosen.bytes, Some(tuned.model.len() + added));
    let better = |row: &&Row| {
        row.bytes <= Some(6_000)
            && row.instructions <= Some(1_700)
            && row.error <= 0.01
            && row.mean_touches < chosen.mean_touches
    };
    assert!(chosen.error <= 0.01, "no model is sound, so this test holds nothing: {chosen:?}");
    assert!(!tuned.rows.iter().any(|row| better(&row)));
    // Some that fit are sound and slower, and some that are quicker do not fit: there was something to choose.
    let fits = |row: &Row| row.bytes <= Some(6_000) && row.instructions <= Some(1_700);
    assert!(tuned.rows.iter().any(|row| fits(row) && row.mean_touches > chosen.mean_touches));
    assert!(tuned.rows.iter().any(|row| !fits(row)));
    assert_eq!(tuned.ensemble.trees.len(), chosen.recipe.trees);
    assert!(tuned.rows.iter().any(|row| row.layout == Some("grid")));
    assert!(tuned.test.accuracy[&30] > 0.8);
}

#[test]
fn the_frontier_holds_what_nothing_beats() {
    let dataset = full(synthetic::dataset(&[800, 800], 2));
    let tuned = tune(&dataset, &Settings { max_bytes: None, ..quick() }, &()).unwrap();
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
    let family = tune(&synthetic::dataset(&[300, 300], 3), &Settings { max_bytes: None, ..settings }, &()).unwrap();
    let bytes = family.rows.iter().map(|row| row.bytes.unwrap()).min().unwrap();
    let instructions = family.rows.iter().map(|row| row.instructions.unwrap()).min().unwrap();
    assert_eq!(error.problem(), Some(&TuneProblem::NothingFits { bytes, instructions }));
}

#[test]
fn compile_errors_other_than_a_layout_that_does_not_fit_are_not_swallowed() {
    let unfit = CompileProblem::DoesNotFit { layout: Layout::Grid };
    assert!(unless_unfit(Err(unfit.into())).unwrap().is_none());
    for problem in [CompileProblem::TooLarge, CompileProblem::FitsNoLayout] {
        let error = unless_unfit(Err(problem.clone().into())).unwrap_err();
        assert_eq!(error.problem(), Some(&problem));
    }
    let wrong = crate::Error::setting("error_rate", 0.7, "less");
    assert!(unless_unfit(Err(wrong)).is_err());
    // Through the whole call: an error rate that no model can be compiled for.
    let settings = Settings { error_rate: 0.7, ..quick() };
    let error = tune(&synthetic::dataset(&[300, 300], 3), &settings, &()).unwrap_err();
    assert!(matches!(error.problem::<Setting>(), Some(Setting { name: "error_rate", .. })), "{error}");
}

#[test]
fn a_limit_of_instructions_holds_on_the_processor_that_it_is_for() {
    let dataset = synthetic::dataset(&[400, 400], 4);
    let settings = |core, max_instructions| Settings { max_bytes: None, max_instructions, core, ..quick() };
    let free = tune(&dataset, &settings(Core::M4F, None), &()).unwrap();
    // A model that fits an M4F exactly, and is too slow on an M0+.
    let tight = free.rows.iter().find(|row| row.instructions_m0_plus > row.instructions).unwrap();
    let limit = tight.instructions.unwrap();
    let tuned = tune(&dataset, &settings(Core::M0Plus, Some(limit)), &()).unwrap();
    let chosen = &tuned.rows[tuned.chosen];
    assert!(chosen.instructions_m0_plus <= Some(limit), "{chosen:?}");
    assert!(tuned.rows.iter().any(|row| row.instructions <= Some(limit) && row.instructions_m0_plus > Some(limit)));
}

#[test]
fn the_model_states_the_probe_of_the_touches() {
    let probe = with!(crate::probe::approach::Probe::default(), spacing = 2.0);
    let settings = Settings { probe: Some(StatedProbe { probe, ..StatedProbe::default() }), ..quick() };
    let tuned = tune(&synthetic::dataset(&[300, 300], 3), &settings, &()).unwrap();
    assert_eq!(compile::open(&tuned.model).unwrap().header().spacing(), 2.0);
}

#[test]
fn what_is_too_little_for_a_promise_is_said_with_what_would_do() {
    // 1.1 · 1,500 · 149 / 54 is 4,552.
    let problem = CalibrateProblem::TooFew { object: None, rate: 0.02, found: 54, needed: 149, supplied: None };
    let said = why(&problem, 1_500);
    assert!(said.starts_with(&problem.to_string()), "{said}");
    assert!(said.ends_with("; about 4600 touches of each object would do, where there are 1500 now"), "{said}");
    let problem = CalibrateProblem::OneObject;
    assert_eq!(why(&problem, 1_500), problem.to_string());
}
