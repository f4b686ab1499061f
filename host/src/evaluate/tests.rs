use super::*;
use crate::tests::synthetic::{self, MODEL};
use palpate_onboard::{Recognizer, Stopping, Verdict};

#[test]
fn a_compiled_model_stops_as_the_recognizer_that_sees_the_touches() {
    let model = MODEL.model();
    // Positions count touches that are evidence: here all, since this model takes every touch with a contact.
    let touches = synthetic::dataset(&[400, 300, 500], 2);
    let margins = Margins::new(&model, &touches).unwrap();
    let settings = SequentialSettings { error_rate: Some(0.01), max_touches: Some(40), sequences: 50, seed: 1 };
    let sequential = margins.sequential(&settings).unwrap();
    for (position, outcomes) in sequential.outcomes.iter().enumerate() {
        for (sequence, outcome) in outcomes.iter().enumerate() {
            let mut recognizer = Recognizer::<3>::new(&model, Stopping::new(0.01, 40).unwrap()).unwrap();
            let mut verdict = Verdict::Undecided;
            for touch in margins.draw(position, sequence, 40, 1) {
                verdict = recognizer.push(&touches.objects[position].touches()[touch as usize]).unwrap();
                if verdict != Verdict::Undecided {
                    break;
                }
            }
            let recognized = match verdict {
                Verdict::Recognized { object, .. } => Some(usize::from(object)),
                _ => None,
            };
            let touches = usize::try_from(recognizer.touches()).unwrap();
            assert_eq!(
                *outcome,
                Outcome { touches, approaches: touches, recognized, output: recognized, unknown: false }
            );
        }
    }
}
