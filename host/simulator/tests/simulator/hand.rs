use crate::assert_says;
use palpate_shared::Touch;
use palpate_simulator::probe::Probe;
use palpate_simulator::probe::approach::FINGERS;
use palpate_simulator::probe::hand::{late, within};

#[test]
fn a_contact_later_than_the_stroke_is_missing_and_one_at_its_end_is_not() {
    let probe = with!(Probe::default(); stroke: Some(3.0));
    assert_eq!(probe.window(), Some(300_000));
    let touch = Touch::from_micros([300_001, 0, 300_000]);
    assert_eq!(late(&touch, probe.window()), [true, false, false]);
    assert_eq!(within(&touch, probe.window()).times().map(|time| time.micros()), [None, Some(0), Some(300_000)]);
    assert_eq!(within(&touch, Probe::default().window()), touch);
}

#[test]
fn a_hand_whose_stroke_is_known_to_an_interval_explains_contacts_up_to_its_end() {
    let stated = with!(Probe::default(); stroke: Some(5.0));
    assert_eq!(stated.latest(), Some(510_000.0));
    assert_eq!(with!(stated; stroke_tolerance: Some(0.4)).latest(), Some(540_000.0));
    assert_eq!(Probe::default().latest(), None);
}

#[test]
fn an_approach_whose_first_contact_is_behind_the_travel_is_a_miss() {
    let probe = with!(Probe::default(); travel: Some(12.0));
    let reached = [Some(12.0), None, Some(15.0)];
    assert_eq!(probe.within_travel(reached), (reached, false), "the hand goes on after a contact");
    assert_eq!(probe.within_travel([Some(12.1), None, Some(15.0)]), ([None; FINGERS], true));
    assert_eq!(probe.within_travel([None; FINGERS]), ([None; FINGERS], false));
    assert_eq!(Probe::default().within_travel([Some(1e6), None, None]).0, [Some(1e6), None, None]);
}

#[test]
fn strokes_that_cannot_be_are_refused() {
    for (stroke, travel) in [(0.0, 9.0), (-1.0, 9.0), (f64::NAN, 9.0), (1e-9, 9.0), (3.0, 0.0), (3.0, f64::INFINITY)] {
        let probe = with!(Probe::default(); stroke: Some(stroke), travel: Some(travel));
        assert!(probe.check(10.0).is_err(), "{stroke} {travel}");
    }
    let good = with!(Probe::default(); stroke: Some(0.5), travel: Some(30.0));
    assert!(good.check(10.0).is_ok() && with!(good; stroke_tolerance: Some(0.1)).check(10.0).is_ok());
    for (stroke, tolerance) in [(Some(3.0), 0.0), (Some(3.0), f64::NAN), (Some(3.0), -1.0), (None, 0.1)] {
        let probe = with!(Probe::default(); stroke: stroke, stroke_tolerance: Some(tolerance));
        assert_says(probe.check(10.0).unwrap_err(), &["stroke_tolerance"]);
    }
}
