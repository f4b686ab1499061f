use super::*;
use crate::tests::synthetic::{self, MODEL};
use crate::touches::{Dataset, ObjectTouches, Recorded, Source};

const OBJECTS: usize = 3;

fn simulated(count: usize, seed: u64) -> Dataset {
    synthetic::dataset(&[count; OBJECTS], seed)
}

fn settings(rate: f64) -> Settings {
    Settings { rate, sequences: 6_000, max_touches: Some(200), ..Settings::default() }
}

#[test]
fn recordings_with_too_many_wrong_names_are_refused_with_the_rate_that_they_support() {
    // One recording in five is of another object than its name says.
    let mut wrong = simulated(2_000, 3);
    let others = wrong.objects[1].touches().to_vec();
    let parts = [("first", &wrong.objects[0].touches()[..1_600]), ("second", &others[..400])];
    let parts = parts.map(|(began, touches)| (session(began), None, touches.to_vec()));
    wrong.objects[0] = ObjectTouches::of_parts("object0", parts);
    let error = calibrate_recorded(&MODEL.model(), simulated(30_000, 2), &wrong, &settings(0.02), &()).unwrap_err();
    assert!(error.what().starts_with("no threshold that was tested keeps 2 %: at the best "), "{error}");
    assert!(error.what().ends_with(" names given on the recordings are wrong"), "{error}");
    assert!(error.remedy().starts_with("2000 recorded approaches to each object support about "), "{error}");
}

fn session(began: &str) -> Source {
    Source::Recording(Recorded { began: began.into(), ..Recorded::default() })
}

#[test]
fn recordings_are_counted_where_a_data_set_lists_them() {
    let of_sessions = simulated(1_200, 3).each(|object| {
        let days = ["monday", "tuesday"].into_iter().zip(object.touches().chunks(600));
        ObjectTouches::of_parts(&object.name, days.map(|(day, touches)| (session(day), None, touches.to_vec())))
    });
    let calibrated =
        calibrate_recorded(&MODEL.model(), simulated(30_000, 2), &of_sessions, &settings(0.05), &()).unwrap();
    assert_eq!(calibrated.recorded.unwrap().recordings, Some(2 * OBJECTS));
}

#[test]
fn the_first_threshold_does_not_depend_on_the_recordings_but_on_their_number() {
    let right = simulated(1_200, 3);
    let fresh = simulated(30_000, 2);
    let first = |recorded: &Dataset| {
        super::recorded::first_of(&MODEL.model(), fresh.clone(), recorded, &settings(0.05)).unwrap()
    };
    let mut others = simulated(1_200, 4);
    others.objects.rotate_left(1);
    others
        .objects
        .iter_mut()
        .zip(["object0", "object1", "object2"])
        .for_each(|(object, name)| object.name = name.into());
    assert_eq!(first(&right), first(&others));
    assert!(first(&simulated(12_000, 3)) < first(&simulated(150, 3)), "many recordings begin stricter");
}
