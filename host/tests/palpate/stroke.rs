//! A stroke from the probe through the model to recorded touches: equal strokes pass, and different ones are refused
//! with both values.

use crate::fixtures::*;
use palpate::calibrate;
use palpate::capture::in_memory;
use palpate::compile::{self};
use palpate::ensemble::train::{self, train};
use palpate::evaluate::delivered;
use palpate::probe::hand;
use palpate::strangers;

/// Two objects whose contacts come up to a second apart.
fn captured(stroke: Option<f64>, seed: u64) -> Dataset {
    let objects = [("rod", [1.0, 0.15, 0.15]), ("slab", [1.0, 0.6, 0.2])]
        .map(|(name, shape)| Object::new(name, Mesh::globe(12).stretched(shape)));
    let probe = with!(Probe::default(), stroke);
    let origin = Origin { touches: 3_000, approaches: true, seed, probe, ..Origin::default() };
    in_memory(&objects, &origin.into(), &()).unwrap().0
}

/// Touches as from lines that state nothing.
fn lines(dataset: &Dataset) -> Dataset {
    let bare = |own: &ObjectTouches| ObjectTouches::new(&own.name, own.touches().to_vec(), Source::Object);
    Dataset::new(dataset.objects.iter().map(bare).collect())
}

/// Touches as a recording, whose probe states its stroke or none.
fn recorded(dataset: &Dataset, stroke: Option<f64>) -> Dataset {
    let one = |own: &ObjectTouches| {
        let source = Source::Recording(Recorded::default());
        ObjectTouches::new(&own.name, own.touches().to_vec(), source)
    };
    let probe = with!(Probe::default(), stroke);
    let origin = Origin::recorded(probe, palpate::shared::format::Length::Tenth, false);
    Dataset { origin: Some(origin), ..Dataset::new(dataset.objects.iter().map(one).collect()) }
}

/// A model of touches with this stroke.
fn model(stroke: Option<f64>) -> Ensemble {
    let dataset = captured(stroke, 1);
    let recipe = with!(train::Settings::compact(), rounds = 3, probe = StatedProbe::of(&dataset));
    train(&dataset, &recipe, &()).unwrap()
}

fn verdict(model: &Ensemble, dataset: &Dataset) -> palpate::Result<()> {
    let compiled = compile::exact(model)?;
    Margins::new(&compiled.model(), dataset).map(|_| ())
}

#[test]
fn touches_of_the_models_stroke_are_taken_and_of_another_refused_with_both_values() {
    let (long, short) = (captured(None, 2), captured(Some(2.0), 2));
    let [unlimited, limited] = [None, Some(2.0)].map(model);
    for (model, dataset) in [(&unlimited, &long), (&limited, &short)] {
        for same in [dataset.clone(), lines(dataset), recorded(dataset, None)] {
            assert_eq!(verdict(model, &same), Ok(()));
        }
    }
    assert_eq!(verdict(&limited, &recorded(&short, Some(2.0))), Ok(()));
    // Stated.
    for (model, dataset, said) in [
        (&unlimited, &short, "stroke none and 2"),
        (&limited, &long, "stroke 2 and none"),
        (&limited, &recorded(&short, Some(3.0)), "stroke 2 and 3"),
        (&unlimited, &recorded(&short, Some(2.0)), "stroke none and 2"),
    ] {
        let error = verdict(model, dataset).unwrap_err().to_string();
        assert!(error.contains("state different probes") && error.contains(said), "{error}");
    }
    // Estimated.
    for (model, dataset, parts) in [
        (&unlimited, lines(&short), ["the model has no stroke", "no contact is later than 0.2"]),
        (&unlimited, recorded(&short, None), ["the model has no stroke", "no contact is later than 0.2"]),
        (
            &limited,
            lines(&long),
            ["a stroke of 2 (0.200 s), which explains contacts up to 0.204 s", "contacts come up to "],
        ),
        (&limited, recorded(&long, None), ["a stroke of 2 (0.200 s)", "contacts come up to "]),
        (&limited, lines(&captured(Some(1.0), 2)), ["a stroke of 2 (0.200 s)", "no contact is later than 0.1"]),
    ] {
        let error = verdict(model, &dataset).unwrap_err().to_string();
        assert!(parts.iter().all(|part| error.contains(part)), "{error}");
    }
}

#[test]
fn a_recorded_contact_a_little_after_the_stroke_is_missing_as_on_the_chip() {
    let limited = compile::exact(&model(Some(2.0))).unwrap();
    let limited = limited.model();
    let late = lines(&captured(Some(2.0), 2))
        .each(|own| changed(own, |touch| if touch.spread() > 190_000 { stretched(touch) } else { *touch }));
    assert!(late.touches().any(|touch| touch.spread() > 200_000));
    let cut = late.each(|own| changed(own, |touch| hand::within(touch, Some(200_000))));
    let accuracy = |dataset: &Dataset| {
        let margins = Margins::new(&limited, dataset).unwrap();
        margins.confusion(5, 500, 1).unwrap()
    };
    assert_eq!(accuracy(&late), accuracy(&cut));
}

/// A touch on a clock that is 1.5 % slow.
fn stretched(touch: &Touch) -> Touch {
    let slow = |micros: u32| ContactTime::from_micros(micros + micros * 3 / 200);
    Touch::new(touch.times().map(|time| time.micros().map_or(time, slow)))
}

/// A model of touches with a stroke of 2 that is known to an interval: contacts up to 2.3 are of the same hand.
fn estimated() -> Ensemble {
    let dataset = captured(Some(2.0), 1);
    let probe = StatedProbe::of(&dataset).map(|stated| {
        let probe = with!(stated.probe, stroke_tolerance = Some(0.3));
        StatedProbe { probe, ..stated }
    });
    let recipe = with!(train::Settings::compact(), rounds = 3, probe);
    train(&dataset, &recipe, &()).unwrap()
}

#[test]
fn a_contact_later_than_an_estimated_stroke_by_less_than_it_is_known_to_is_late_and_no_reason_to_refuse() {
    let ensemble = estimated();
    let bytes = compile::compile(&ensemble, &compile::Settings::default()).unwrap().bytes;
    let compiled = CompiledModel::from_bytes(bytes).unwrap();
    let model = compiled.model();
    assert_eq!(model.probe().unwrap().stroke_tolerance, Some(0.3), "the model states it");
    let of_hand = |stroke: f64| lines(&captured(Some(stroke), 2));
    let (same, other) = (of_hand(2.25), of_hand(2.35));
    assert!(same.touches().any(|touch| touch.spread() > 220_000));
    assert!(Margins::new(&model, &same).is_ok());
    let refused = Margins::new(&model, &other).err().unwrap().to_string();
    assert!(refused.contains("a stroke of 2 (0.200 s), which explains contacts up to 0.230 s"), "{refused}");
    // Whoever looks at them, late contacts are missing: margins, sequences, a test for strangers, and a line at a time.
    let cut = same.each(|own| changed(own, |touch| hand::within(touch, Some(200_000))));
    let accuracy = |dataset: &Dataset| {
        let margins = Margins::new(&model, dataset).unwrap();
        margins.confusion(5, 500, 1).unwrap()
    };
    assert_eq!(accuracy(&same), accuracy(&cut));
    let settings = with!(calibrate::Settings::default(), rate = 0.3, sequences = 400, max_touches = Some(60));
    let calibrated = |dataset: &Dataset| calibrate::calibrate(&model, dataset.clone(), &settings, &()).unwrap().model;
    assert_eq!(calibrated(&same), calibrated(&cut));
    let tested = |dataset: &Dataset| {
        let settings = with!(strangers::Settings::default(), alarms = 0.2, sequences = 2_000);
        strangers::calibrate(&model, dataset, &[], &settings).unwrap().bytes
    };
    assert_eq!(tested(&same), tested(&cut));
    for (late, missing) in same.touches().zip(cut.touches()) {
        assert_eq!(delivered(&model, late), *missing);
    }
    let beyond = Touch::from_micros([0, 1_000, 240_000]);
    assert_eq!(delivered(&model, &beyond), beyond, "of another hand: refused as it is");
}
