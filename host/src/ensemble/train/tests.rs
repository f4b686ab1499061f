use super::*;
use crate::ensemble::OverTouches;
use crate::tests::synthetic;
use crate::touches::{ObjectTouches, Origin, Source};
use crate::with;
use crate::{compile, probe::Probe};

fn quick() -> Settings {
    Settings { rounds: 8, depth: 3, counted: Some(Counted::Full), ..Settings::compact() }
}

#[test]
fn an_ensemble_states_the_probe_and_knows_its_touches_again_after_saving() {
    let dataset = synthetic::dataset(&[60, 60], 8);
    let probe = with!(Probe::default(), spacing = 2.0);
    let probe = Some(StatedProbe { probe, length: 12.5, ..StatedProbe::default() });
    let stated = train(&dataset, &Settings { probe, ..quick() }, &()).unwrap();
    let silent = train(&dataset, &quick(), &()).unwrap();
    assert_eq!(stated.trees, silent.trees);
    let file = tempfile::NamedTempFile::new().unwrap();
    for ensemble in [stated, silent] {
        ensemble.save(file.path()).unwrap();
        let loaded = crate::ensemble::load(file.path()).unwrap();
        assert_eq!(loaded, ensemble);
        assert_eq!(TouchOrigin::of(&loaded.origin).unwrap().touches, TouchOrigin::new(&dataset, None).touches);
    }
}

#[test]
fn a_stroke_is_the_largest_spread_of_the_ensemble_and_of_every_compiled_model() {
    let probe = with!(Probe::default(), stroke = Some(0.05), travel = Some(20.0));
    let object = |name: &str, bend| {
        let touch = |index: u32| Touch::from_micros([0, 1_000 + index % 7 * bend, 3_000 + index % 5 * 100]);
        ObjectTouches::new(name, (0..800).map(touch).collect(), Source::Object).of_stroke(probe.window())
    };
    let origin = Some(Origin { probe, approaches: true, ..Origin::default() });
    let dataset = Dataset { origin, ..Dataset::new(vec![object("cup", 100), object("fork", 400)]) };
    let noise = Noise::gaussian(2_000.0);
    let settings = Settings { probe: StatedProbe::of(&dataset), noise, ..quick() };
    let ensemble = train(&dataset, &settings, &()).unwrap();
    assert_eq!(ensemble.trained_touches().largest_spread, 5_000);
    let file = tempfile::NamedTempFile::new().unwrap();
    ensemble.save(file.path()).unwrap();
    assert_eq!(crate::ensemble::load(file.path()).unwrap(), ensemble);
    let compiled = compile::compile(&ensemble, &compile::Settings::default()).unwrap();
    let model = compile::open(&compiled.bytes).unwrap();
    assert_eq!(model.trained_touches().largest_spread, 5_000);
    let stated = model.probe().unwrap();
    assert_eq!((stated.stroke, stated.travel), (Some(0.05), Some(20.0)));
}
