//! From touches to verdicts, without DDS: messages in, messages out.

use crate::follow::{Following, Step};
use crate::place::Placing;
use crate::served::Served;
use crate::thresholds::Thresholds;
use crate::wire::{Approach, Evidence, Expected, Touch, Verdict, unit_vectors};
use palpate::compile::CompiledModel;
use palpate::onboard::shared::Touch as Felt;
use palpate::onboard::{Recognizer, Verdict as Decision};
use std::sync::Arc;

/// Room for the objects of any model.
type Recognizing<'m> = Recognizer<'m, 256>;

self_cell::self_cell!(
    /// A recognizer and its model: a follower of touches in any pose.
    struct Opened {
        owner: Arc<CompiledModel>,
        #[covariant]
        dependent: Recognizing,
    }
);

/// Recognizes objects, one after another.
///
/// Another object begins after a verdict, when the name in the messages changes, and when [`Decider::reset`] is called.
pub(crate) struct Decider {
    model: Served,
    following: Box<dyn Following>,
    /// Weights of the last reset, for all objects until the next.
    expected: Option<Vec<u32>>,
    /// Object named by the last message.
    object: String,
}

impl Decider {
    /// A recognizer that has touched nothing yet.
    ///
    /// # Errors
    /// Why the model or the thresholds cannot be used.
    pub(crate) fn new(model: Served, thresholds: Thresholds) -> Result<Self, String> {
        let stopping = model.stopping(thresholds)?;
        let following: Box<dyn Following> = match model.clone() {
            Served::Trees(model) => Box::new(Opened::try_new(model, |file| {
                Recognizer::new(&file.model(), stopping).map_err(|error| error.to_string())
            })?),
            Served::Maps(maps) => Box::new(Placing::new(maps, stopping)?),
        };
        Ok(Self { model, following, expected: None, object: String::new() })
    }

    /// This model under other thresholds, without touches; priors of the last reset stay.
    ///
    /// # Errors
    /// The threshold that cannot be used.
    pub(crate) fn under(&self, thresholds: Thresholds) -> Result<Self, String> {
        let mut decider = Self::new(self.model.clone(), thresholds)?;
        decider.expected.clone_from(&self.expected);
        decider.begin();
        Ok(decider)
    }

    /// The model's objects.
    pub(crate) fn names(&self) -> Vec<String> {
        self.following.names()
    }

    /// Takes in a touch. One that cannot be counted changes nothing, and the verdict says why.
    pub(crate) fn touch(&mut self, message: &Touch) -> Step {
        let felt = match message.felt() {
            Ok(felt) => felt,
            Err(error) => return self.refused(error.what().to_owned()),
        };
        if message.object != self.object || self.following.verdict() != Decision::Undecided {
            self.object.clone_from(&message.object);
            self.begin();
        }
        match self.following.push(&felt) {
            Ok(()) => self.step(),
            Err(refused) => self.refused(refused),
        }
    }

    /// Forgets all touches, for another object, which is one of `expected`.
    ///
    /// # Errors
    /// Why not; nothing changes then.
    pub(crate) fn reset(&mut self, expected: &Expected) -> Result<Step, String> {
        self.expected = weights(expected, &self.following.known())?;
        self.begin();
        Ok(self.step())
    }

    /// Begins another object.
    fn begin(&mut self) {
        self.following.begin(self.expected.as_deref());
    }

    fn refused(&self, reason: String) -> Step {
        let mut step = self.step();
        step.verdict.refused = reason;
        step
    }

    /// Messages about the touches so far.
    pub(crate) fn step(&self) -> Step {
        let following = &self.following;
        let (touch, objects, posteriors) = (following.touches(), following.names(), following.posteriors());
        let evidence = Some(Evidence { touch, objects: objects.clone(), nats: behind(&posteriors) });
        let verdict = following.verdict();
        let best = match verdict {
            Decision::Recognized { object, .. } => object.into(),
            _ => following.best(),
        };
        let verdict = Verdict { touch, verdict: verdict.name().into(), objects, ..Verdict::default() };
        let mut step = Step { verdict: with_best(verdict, best, posteriors), evidence, ..Step::default() };
        following.complete(&mut step);
        step
    }
}

impl Opened {
    fn recognizer(&self) -> &Recognizing<'_> {
        self.borrow_dependent()
    }

    fn approach(&self) -> Option<Approach> {
        let recognizer = self.recognizer();
        let poses = recognizer.model().plan()?.poses();
        let proposal = recognizer.next_approach(0..poses.count())?;
        let (direction, alignment) = unit_vectors(&poses.pose(proposal.pose)?);
        let score = f64::from(proposal.score) / f64::from(1 << 15);
        Some(Approach { touch: recognizer.touches(), pose: proposal.pose, direction, alignment, score })
    }
}

impl Following for Opened {
    fn names(&self) -> Vec<String> {
        self.borrow_owner().names()
    }

    fn known(&self) -> Vec<String> {
        let mut names = self.names();
        names.truncate(self.recognizer().model().known_count());
        names.dedup();
        names
    }

    fn begin(&mut self, weights: Option<&[u32]>) {
        self.with_dependent_mut(|_, recognizer| match weights {
            // There is a weight above 0: `weights` refuses others.
            Some(weights) if recognizer.reset_to(weights).is_ok() => {}
            _ => recognizer.reset(),
        });
    }

    fn push(&mut self, felt: &Felt) -> Result<(), String> {
        // A little later than the stroke is missing, as on the chip.
        let felt = palpate::evaluate::delivered(self.recognizer().model(), felt);
        let pushed = self.with_dependent_mut(|_, recognizer| recognizer.push(&felt));
        pushed.map(|_| ()).map_err(|refused| refused.to_string())
    }

    fn verdict(&self) -> Decision {
        self.recognizer().verdict()
    }

    fn touches(&self) -> u32 {
        self.recognizer().touches()
    }

    fn best(&self) -> usize {
        self.recognizer().best()
    }

    fn posteriors(&self) -> Vec<f64> {
        let recognizer = self.recognizer();
        (0..self.names().len()).map(|object| recognizer.posterior(object).to_f64()).collect()
    }

    fn complete(&self, step: &mut Step) {
        step.approach = if step.is_decided() { None } else { self.approach() };
    }
}

/// A verdict with its likeliest object; without touches there is none.
pub(crate) fn with_best(mut verdict: Verdict, best: usize, posteriors: Vec<f64>) -> Verdict {
    if verdict.touch > 0 {
        verdict.object = verdict.objects.get(best).cloned().unwrap_or_default();
        verdict.posterior = posteriors.get(best).copied().unwrap_or_default();
    }
    verdict.posteriors = posteriors;
    verdict
}

/// Distance of each object behind the likeliest, in nats.
pub(crate) fn behind(posteriors: &[f64]) -> Vec<f64> {
    let most = posteriors.iter().copied().fold(0.0, f64::max);
    posteriors.iter().map(|posterior| (posterior / most).ln()).collect()
}

/// A weight for each of `names`; none if nothing is expected.
///
/// # Errors
/// The name or the weights at fault, and the remedy.
pub(crate) fn weights(expected: &Expected, names: &[String]) -> Result<Option<Vec<u32>>, String> {
    let Expected { objects, weights } = expected;
    if objects.is_empty() && weights.is_empty() {
        return Ok(None);
    }
    if !weights.is_empty() && weights.len() != objects.len() {
        return Err(format!("{} weights for {} objects: give one for each, or none", weights.len(), objects.len()));
    }
    if let Some(name) = objects.iter().find(|name| !names.contains(name)) {
        return Err(format!("the model has no object {name:?}; it has {}", names.join(", ")));
    }
    if let Some((_, name)) = objects.iter().enumerate().find(|(index, name)| objects[..*index].contains(name)) {
        return Err(format!("the object {name:?} is there twice: give each name once"));
    }
    if !weights.is_empty() && weights.iter().all(|&weight| weight == 0) {
        return Err("all weights are 0: give a weight above 0 to the objects that may come".into());
    }
    let weight = |name: &String| match objects.iter().position(|object| object == name) {
        Some(index) => weights.get(index).copied().unwrap_or(1),
        None => 0,
    };
    Ok(Some(names.iter().map(weight).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::compile::{Restated, restate};
    use palpate::onboard::Rivals;
    use palpate::onboard::Stopping;
    use palpate::onboard::shared::Poses;
    use palpate::onboard::shared::format::{Plan, Tag};

    const NAN: f64 = f64::NAN;

    fn household() -> Arc<CompiledModel> {
        Arc::new(CompiledModel::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/household.palpate")).unwrap())
    }

    fn decider() -> Decider {
        Decider::new(Served::Trees(household()), Thresholds::default()).unwrap()
    }

    fn touch(times: [f64; 3]) -> Touch {
        Touch { times, ..Touch::default() }
    }

    fn expected(objects: &[&str], weights: &[u32]) -> Expected {
        Expected { objects: objects.iter().map(|&name| name.into()).collect(), weights: weights.into() }
    }

    /// Touches of one kind until something is decided.
    fn until_decided(decider: &mut Decider, times: [f64; 3]) -> Step {
        (0..1_000).map(|_| decider.touch(&touch(times))).find(Step::is_decided).unwrap()
    }

    #[test]
    fn a_touch_changes_posteriors_and_evidence_as_the_recognizer_says() {
        let file = household();
        let model = file.model();
        let mut recognizer = Recognizing::new(&model, Stopping::from_model(&model)).unwrap();
        let mut decider = decider();
        for times in [[0.03, 0.0, 0.05], [5.0, 5.1, NAN], [NAN, 0.2, 0.0]] {
            let step = decider.touch(&touch(times));
            recognizer.push(&touch(times).felt().unwrap()).unwrap();
            let posteriors: Vec<f64> = (0..10).map(|object| recognizer.posterior(object).to_f64()).collect();
            assert_eq!((step.verdict.touch, &step.verdict.posteriors), (recognizer.touches(), &posteriors));
            assert_eq!(step.verdict.object, model.object_name(recognizer.best()));
            let evidence = step.evidence.unwrap();
            assert_eq!(evidence.nats[recognizer.best()], 0.0);
            assert!(evidence.nats.iter().all(|&nats| nats <= 0.0));
        }
    }

    #[test]
    fn a_touch_that_cannot_be_counted_says_why_and_changes_nothing() {
        let mut decider = decider();
        let before = decider.touch(&touch([0.0, 0.1, NAN]));
        for (times, why) in [
            ([NAN; 3], "no finger touched"),
            ([-1.0, 0.0, 0.0], "the time -1 is negative"),
            ([f64::INFINITY, 0.0, 0.0], "inf is not finite"),
            ([0.0, 0.0, 5_000.0], "a touch can hold 4294 s"),
        ] {
            let mut step = decider.touch(&touch(times));
            let refused = std::mem::take(&mut step.verdict.refused);
            assert!(refused.contains(why), "{times:?}: {refused}");
            assert_eq!(step, before);
        }
        let half = Touch { has_pose: true, direction: [1.0, 0.0, 0.0], ..touch([0.0; 3]) };
        assert!(decider.touch(&half).verdict.refused.contains("the alignment has length 0"));
    }

    #[test]
    fn another_object_begins_after_a_verdict_and_with_another_name() {
        let mut decider = decider();
        let decided = until_decided(&mut decider, [0.0, 0.0, 0.0]);
        assert_eq!(decided.verdict.verdict, "recognized");
        let least = Rivals::from_q56(household().model().header().odds()).posterior().to_f64();
        assert!(decided.verdict.posterior >= least && decided.approach.is_none());
        assert_eq!(decider.touch(&touch([0.0, 0.0, 0.0])).verdict.touch, 1);
        assert_eq!(decider.touch(&touch([0.0, 0.0, 0.0])).verdict.touch, 2);
        let named = Touch { object: "bowl".into(), ..touch([0.0, 0.0, 0.0]) };
        assert_eq!(decider.touch(&named).verdict.touch, 1);
        assert_eq!(decider.touch(&named).verdict.touch, 2);
    }

    #[test]
    fn priors_of_a_reset_hold_for_all_objects_until_the_next() {
        let mut decider = decider();
        let step = decider.reset(&expected(&["bowl", "fork"], &[3, 1])).unwrap();
        let of = |step: &Step, name: &str| {
            let index = step.verdict.objects.iter().position(|object| object == name).unwrap();
            step.verdict.posteriors[index]
        };
        // Not 3 to 1: the model's temperature is above 1.
        assert!(of(&step, "bowl") > of(&step, "fork") && of(&step, "fork") > 0.0);
        assert_eq!((step.verdict.touch, step.verdict.object.as_str()), (0, ""));
        assert_eq!(of(&step, "mouse"), 0.0);
        until_decided(&mut decider, [0.0, 0.0, 0.0]);
        assert_eq!(of(&decider.touch(&touch([0.0, 0.0, 0.0])), "mouse"), 0.0);
        let step = decider.reset(&Expected::default()).unwrap();
        assert!(step.verdict.posteriors.iter().all(|posterior| (posterior - 0.1).abs() < 1e-3));
        let even = decider.reset(&expected(&["bowl", "fork"], &[])).unwrap();
        assert!((of(&even, "bowl") - 0.5).abs() < 1e-3);
    }

    #[test]
    fn priors_that_make_no_sense_are_refused_and_change_nothing() {
        let mut decider = decider();
        let before = decider.touch(&touch([0.0, 0.1, 0.1]));
        for (priors, why) in [
            (expected(&["bowl"], &[1, 2]), "2 weights for 1 objects"),
            (expected(&[], &[1]), "1 weights for 0 objects"),
            (expected(&["cup"], &[]), "no object \"cup\"; it has bowl, camera"),
            (expected(&["bowl", "bowl"], &[]), "\"bowl\" is there twice"),
            (expected(&["bowl", "fork"], &[0, 0]), "all weights are 0"),
        ] {
            let error = decider.reset(&priors).unwrap_err();
            assert!(error.contains(why), "{error}");
        }
        assert_eq!(decider.step(), before);
    }

    #[test]
    fn thresholds_decide_when_to_stop_and_wrong_ones_are_refused() {
        let decider = decider();
        let touches = |thresholds| until_decided(&mut decider.under(thresholds).unwrap(), [0.0, 0.0, 0.0]).verdict;
        let of = |error_rate, max_touches| Thresholds { error_rate, max_touches };
        let [own, strict, loose] = [of(0.0, 0), of(1e-12, 0), of(0.3, 0)].map(touches).map(|verdict| verdict.touch);
        assert!(loose < own && own < strict, "{loose} {own} {strict}");
        assert_eq!((touches(of(1e-12, 2)).touch, touches(of(1e-12, 2)).verdict.as_str()), (2, "gave-up"));
        for (wrong, why) in [(of(0.5, 0), "error_rate"), (of(NAN, 0), "error_rate"), (of(0.1, -1), "max_touches")] {
            assert!(decider.under(wrong).err().unwrap().contains(why));
        }
    }

    #[test]
    fn a_model_with_a_plan_proposes_the_pose_that_tells_most_until_it_has_decided() {
        let poses = Poses::with_rolls(1).unwrap();
        let (best, count) = (7, usize::from(poses.count()));
        let separations = |_| (0..count).map(|pose| if pose == best { 100 } else { 10 });
        let plan = Plan::header(poses).into_iter().chain((0..Plan::pairs(10)).flat_map(separations)).collect();
        let sections = vec![(Tag::Plan, Some((false, plan)))];
        let planned = restate(&household().model(), &Restated { sections, ..Restated::default() }).unwrap();
        let planned = Arc::new(CompiledModel::from_bytes(planned).unwrap());
        let mut decider = Decider::new(Served::Trees(planned), Thresholds::default()).unwrap();
        let (direction, alignment) = unit_vectors(&poses.pose(7).unwrap());
        let expected = |touch| Approach { touch, pose: 7, direction, alignment, score: 100.0 / 128.0 };
        assert_eq!(decider.step().approach, Some(expected(0)));
        assert_eq!(decider.touch(&touch([0.0, 0.0, 0.0])).approach, Some(expected(1)));
        assert_eq!(until_decided(&mut decider, [0.0, 0.0, 0.0]).approach, None);
    }

    #[test]
    fn a_touch_survives_its_message() {
        let message = Touch {
            has_pose: true,
            direction: [0.0, 0.0, -1.0],
            alignment: [1.0, 0.0, 0.0],
            ..touch([0.25, 0.0, NAN])
        };
        let felt = message.felt().unwrap();
        assert_eq!(Touch::from(&felt).felt().unwrap(), felt);
    }
}
