//! A plan of approaches for a model: how well each pose of the probe distinguishes each pair of objects.

mod active;
mod figures;
mod poses;

pub(super) use active::Active;
pub use active::ActiveFacts;
pub(super) use figures::evaluate_active;
use poses::ByPose;
pub(crate) use poses::by_pose;

use super::margins::{Margins, row};
use crate::compile::{self, Restated, restate};
use crate::error::{Error, Result, problem};
use crate::touches::Dataset;
use palpate_onboard::Model;
use palpate_shared::format::{Plan, Tag};
use palpate_shared::{ContactPattern, Poses};
use rayon::prelude::*;
use serde::Serialize;

/// Approaches of an object in a pose that a mean is taken of at least.
const LEAST_IN_POSE: usize = 20;

/// A model with a plan.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Planned {
    /// The model's bytes.
    #[serde(skip)]
    pub bytes: Vec<u8>,
    /// Bytes of the plan's section.
    pub plan_bytes: usize,
    /// Poses: 26 directions times the rolls.
    pub poses: usize,
    /// Rolls of the row of fingers for each direction.
    pub rolls: u8,
    /// Poses in which no approach touched anything, which are never proposed.
    pub left_out: usize,
    /// The fewest approaches of an object in a pose that is not left out.
    pub fewest: usize,
    /// The separation of the two objects that are hardest to tell apart, in the pose that does it best, and their names.
    pub hardest: Hardest,
}

/// Two objects, and how well the best pose distinguishes them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Hardest {
    /// The objects.
    pub objects: [String; 2],
    /// 1 − the Bhattacharyya coefficient of an approach.
    pub separation: f64,
}

/// Adds a plan to a compiled model, from a data set of approaches with pose to all objects that it knows, misses included. A
/// plan that is there is replaced. Of a background, which is never named, no approach says anything.
///
/// For each pose and each two objects the separation is 1 − the mean of e^(−evidence/2) over the approaches to one object,
/// evidence being for it against the other; the smaller of both orders. Unlike the mean evidence it counts what an
/// approach can add to uncertain evidence: evidence beyond that does not raise it. An approach that is not evidence to
/// the model counts as evidence of 0.
///
/// # Errors
/// [`Kind::Setting`](crate::error::Kind::Setting) `rolls`; as [`Margins::new`]; if the model has fewer
/// than two objects, if the data set has no approaches, none of one of the objects, none with a pose, or too few in
/// a pose.
pub fn plan(model: &Model<'_>, dataset: &Dataset, rolls: u8) -> Result<Planned> {
    let poses = Poses::with_rolls(rolls).ok_or_else(|| Error::setting("rolls", rolls, "1, 2 or 4"))?;
    if model.outputs().is_some() {
        let allowed = "none with a model whose objects have several outputs: on a table the yaw is not known";
        return Err(Error::setting("plan", "given", allowed));
    }
    if model.known_count() < 2 {
        return Err(problem!("the model has one object: there is nothing to distinguish it from")
            .fix("Train a model of two objects or more."));
    }
    check_approaches(dataset)?;
    let margins = Margins::new(model, dataset)?;
    let tested: Vec<usize> = (0..model.known_count())
        .map(|object| {
            let missing = || {
                problem!("the data set has no approaches to {}", model.object_name(object))
                    .fix("Capture all of the model's objects.")
            };
            margins.tested.iter().position(|tested| tested.object == object).ok_or_else(missing)
        })
        .collect::<Result<_>>()?;
    let by_pose = tested.iter().map(|&position| {
        let object = &dataset.objects[position];
        // A separation is of single approaches: those of all instances count.
        let all: Vec<u32> = (0_u32..).take(object.len()).collect();
        ByPose::new(object, poses, &all)
    });
    let by_pose: Vec<ByPose> = by_pose.collect::<Result<_>>()?;
    let may_touch = may_touch(dataset, poses);
    let fewest = fewest(&by_pose, &may_touch)?;
    let overlaps: Vec<Vec<f64>> =
        tested.par_iter().zip(&by_pose).map(|(&position, by_pose)| overlaps(&margins, position, by_pose)).collect();
    let objects = model.object_count();
    let mut content = Plan::header(poses).to_vec();
    let mut hardest: Option<(f64, [usize; 2])> = None;
    for high in 0..objects {
        for low in 0..high {
            if high >= tested.len() {
                let none =
                    may_touch.iter().map(|&may_touch| if may_touch { 0 } else { Plan::UNTOUCHED.cast_unsigned() });
                content.extend(none);
                continue;
            }
            let separation = |pose: usize| {
                // In either order; what is compared is of the touched object against the other.
                1.0 - overlaps[low][pose * objects + high].max(overlaps[high][pose * objects + low])
            };
            let used = || may_touch.iter().enumerate().filter(|(_, may_touch)| **may_touch);
            let best = used().map(|(pose, _)| separation(pose)).fold(f64::NEG_INFINITY, f64::max);
            if hardest.is_none_or(|(least, _)| best < least) {
                hardest = Some((best, [low, high]));
            }
            content.extend(may_touch.iter().enumerate().map(|(pose, &may_touch)| {
                let stored = if may_touch { stored(separation(pose)) } else { Plan::UNTOUCHED };
                stored.cast_unsigned()
            }));
        }
    }
    let (separation, pair) = hardest.unwrap_or((0.0, [0, 0]));
    let plan_bytes = content.len();
    let restated = Restated { sections: vec![(Tag::Plan, Some((false, content)))], ..Restated::default() };
    let name = |object: usize| compile::names(model).swap_remove(object);
    Ok(Planned {
        bytes: restate(model, &restated)?,
        plan_bytes,
        poses: may_touch.len(),
        rolls,
        left_out: may_touch.iter().filter(|may_touch| !**may_touch).count(),
        fewest,
        hardest: Hardest { objects: pair.map(name), separation },
    })
}

/// The problem of a model without a plan.
pub fn no_plan() -> Error {
    problem!("the model has no plan of approaches").fix(
        "Add one: `palpate plan MODEL DIR -o OUT`, from approaches with pose. An ensemble (JSON) has to be exported first.",
    )
}

/// Refuses a data set without approaches, such as one of full touches only.
pub(crate) fn check_approaches(dataset: &Dataset) -> Result<()> {
    match dataset.holds_approaches() {
        true => Ok(()),
        false => Err(problem!("the data set holds full touches only, without the approaches in between")
            .fix("Capture every approach: --approaches N --pose.")),
    }
}

/// A separation in 128ths.
fn stored(separation: f64) -> i8 {
    (separation * 128.0).round().clamp(-127.0, 127.0) as i8
}

/// For each pose whether any approach to any object touched anything.
fn may_touch(dataset: &Dataset, poses: Poses) -> Vec<bool> {
    let mut may_touch = vec![false; poses.count().into()];
    for touch in dataset.touches() {
        if let (Some(pose), true) = (touch.pose(), touch.pattern() != ContactPattern::None) {
            may_touch[usize::from(poses.number_of(&pose))] = true;
        }
    }
    may_touch
}

/// The fewest approaches of an object in a pose that may touch.
fn fewest(by_pose: &[ByPose], may_touch: &[bool]) -> Result<usize> {
    let numbers = (0_u16..).zip(may_touch).filter(|(_, may_touch)| **may_touch);
    let counts =
        numbers.flat_map(|(pose, _)| by_pose.iter().map(move |by_pose| (by_pose.count(pose), by_pose.name.as_str())));
    match counts.min_by_key(|(count, _)| *count) {
        None => Err(problem!("no approach touched anything").fix("Check that the probe reaches the objects.")),
        Some((found, name)) if found < LEAST_IN_POSE => {
            let times = LEAST_IN_POSE.div_ceil(found.max(1)).max(2);
            Err(problem!("only {found} approaches to {name} are in one of the poses, and a plan needs {LEAST_IN_POSE}")
                .fix(format!("Capture {times} times as many approaches, or plan fewer rolls.")))
        }
        Some((found, _)) => Ok(found),
    }
}

/// For each pose and each other object the mean of e^(−evidence/2) of an approach to a tested object.
fn overlaps(margins: &Margins<'_>, position: usize, by_pose: &ByPose) -> Vec<f64> {
    let (tested, objects) = (&margins.tested[position], margins.objects.len());
    let unit = f64::from(margins.model.unit());
    let mut overlaps = Vec::new();
    for approaches in &by_pose.approaches {
        let mut sums = vec![0.0; objects];
        for &approach in approaches {
            let Some(touch) = tested.approaches[approach as usize] else {
                sums.iter_mut().for_each(|sum| *sum += 1.0);
                continue;
            };
            let values = &tested.values[row(touch as usize, objects)];
            let own = values[tested.object];
            for (sum, &margin) in sums.iter_mut().zip(values) {
                *sum += (f64::from(margin - own) * unit / 2.0).exp();
            }
        }
        overlaps.extend(sums.into_iter().map(|sum| sum / approaches.len().max(1) as f64));
    }
    overlaps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compile::compile;
    use crate::ensemble::{Ensemble, Node, Output, Provenance, Tree};

    use crate::touches::{self, ObjectTouches};
    use palpate_onboard::{Recognizer, Stopping};
    use palpate_shared::{ContactTime, Descriptor, Touch};

    /// One nat for the first object below a curvature of 50 ms, one for the second above. Misses are no evidence.
    fn model() -> Vec<u8> {
        compile(&ensemble(), &compile::Settings::default()).unwrap().bytes
    }

    fn ensemble() -> Ensemble {
        let nodes = vec![
            Node::Split { feature: 0, threshold: 50_000.0, missing_left: true, left: 1, right: 2 },
            Node::Leaf(vec![0.5, -0.5]),
            Node::Leaf(vec![-0.5, 0.5]),
        ];
        Ensemble {
            inputs: crate::ensemble::inputs(Descriptor::Curvature),
            objects: vec!["bowl".into(), "fork".into()],
            base_margins: vec![0.0; 2],
            trees: vec![Tree { nodes, output: Output::Each }],
            origin: Provenance::default(),
        }
    }

    /// Data set of the touches that `touch` returns for each direction, 20 times each.
    fn dataset(touch: impl Fn(usize, u16, usize) -> Touch) -> Dataset {
        let poses = Poses::with_rolls(1).unwrap();
        let all = |object| {
            let of = |pose| (0..20).map(move |index| (pose, index));
            let each = |(pose, index)| touch(object, pose, index).with_pose(poses.pose(pose).unwrap());
            (0..26).flat_map(of).map(each).collect()
        };
        let object = |(index, name): (usize, &str)| ObjectTouches::new(name, all(index), touches::Source::Object);
        let objects = ["bowl", "fork"].into_iter().enumerate().map(object).collect();
        let origin = touches::Origin { approaches: true, pose: true, ..touches::Origin::default() };
        Dataset { origin: Some(origin), ..Dataset::new(objects) }
    }

    fn flat() -> Touch {
        Touch::from_micros([0, 0, 10_000])
    }

    fn bent() -> Touch {
        Touch::from_micros([0, 0, 80_000])
    }

    fn missed() -> Touch {
        Touch::new([ContactTime::MISSING; 3])
    }

    #[test]
    fn separations_are_those_worked_out_by_hand_and_the_best_pose_is_proposed() {
        let bytes = model();
        let model = Model::new(&bytes).unwrap();
        let dataset = dataset(|object, pose, index| match (pose, object) {
            // Nothing is touched; one nat for either; misses and the other's touches for the first, one nat for the second.
            (3, _) => missed(),
            (5, 0) => flat(),
            (7, 0) => {
                if index % 2 == 0 {
                    missed()
                } else {
                    bent()
                }
            }
            (5 | 7, _) => bent(),
            // Half of the approaches miss; the others say one nat.
            _ => match (index % 2, object) {
                (0, _) => missed(),
                (_, 0) => flat(),
                _ => bent(),
            },
        });
        let planned = plan(&model, &dataset, 1).unwrap();
        assert_eq!((planned.poses, planned.left_out, planned.fewest, planned.plan_bytes), (26, 1, 20, 30));
        let with_plan = Model::new(&planned.bytes).unwrap();
        let separations = with_plan.plan().unwrap().separations(0, 1);
        let one = (-0.5_f64).exp();
        let stored = |overlap: f64| (128.0 * (1.0 - overlap)).round() as i8;
        for (pose, &separation) in separations.iter().enumerate() {
            let expected = match pose {
                3 => Plan::UNTOUCHED,
                5 => stored(one),
                7 => stored((1.0 + 1.0 / one) / 2.0),
                _ => stored((1.0 + one) / 2.0),
            };
            assert_eq!(separation.cast_signed(), expected, "{pose}");
        }
        assert!((planned.hardest.separation - (1.0 - one)).abs() < 1e-4);
        let recognizer = Recognizer::<2>::new(&with_plan, Stopping::from_model(&with_plan)).unwrap();
        assert_eq!(recognizer.next_approach(0..26).map(|best| best.pose), Some(5));
        assert_eq!(recognizer.next_approach(6..8).map(|best| best.pose), Some(6));
        // Planned again, the plan is replaced; margins are the same.
        let again = plan(&with_plan, &dataset, 1).unwrap();
        assert_eq!(again.bytes, planned.bytes);
        let mut margins = [[0; 2]; 2];
        assert!(model.margins(&bent(), &mut margins[0]) && with_plan.margins(&bent(), &mut margins[1]));
        assert_eq!(margins[0], margins[1]);
    }

    #[test]
    fn a_model_with_a_background_gets_a_plan_of_the_objects_that_it_knows() {
        let touched = |object, pose, _: usize| if pose == 5 && object == 1 { bent() } else { flat() };
        let (bytes, dataset) = (model(), dataset(touched));
        let alone = plan(&Model::new(&bytes).unwrap(), &dataset, 1).unwrap();
        let mut with_background = ensemble();
        with_background.objects.push(crate::mesh::BACKGROUND.into());
        with_background.base_margins.push(0.0);
        with_background.origin.background = true;
        for node in with_background.trees.iter_mut().flat_map(|tree| &mut tree.nodes) {
            if let Node::Leaf(values) = node {
                // Ahead of both objects.
                values.push(2.0);
            }
        }
        let bytes = compile(&with_background, &compile::Settings::default()).unwrap().bytes;
        let planned = plan(&Model::new(&bytes).unwrap(), &dataset, 1).unwrap();
        assert_eq!((&planned.hardest.objects, planned.fewest), (&alone.hardest.objects, alone.fewest));
        // Leaves are rounded in other units.
        assert!((planned.hardest.separation - alone.hardest.separation).abs() < 1e-3);
        let models = [&alone.bytes, &planned.bytes].map(|bytes| Model::new(bytes).unwrap());
        let [own, other] = models.each_ref().map(|model| model.plan().unwrap().separations(0, 1));
        assert!(own.iter().zip(other).all(|(own, other)| own.cast_signed().abs_diff(other.cast_signed()) <= 1));
        let proposed = models.each_ref().map(|model| {
            let mut recognizer = Recognizer::<3>::new(model, Stopping::from_model(model)).unwrap();
            recognizer.push(&flat()).unwrap();
            recognizer.next_approach(0..26).map(|best| best.pose)
        });
        assert_eq!(proposed, [Some(5); 2], "also where the background has the most evidence");
    }

    #[test]
    fn what_no_plan_can_be_made_of_is_refused_by_name() {
        let bytes = model();
        let model = Model::new(&bytes).unwrap();
        let good = dataset(|_, _, _| flat());
        let refused = |change: &dyn Fn(&mut Dataset), rolls| {
            let mut dataset = good.clone();
            change(&mut dataset);
            plan(&model, &dataset, rolls).map(|_| ()).unwrap_err()
        };
        assert!(plan(&model, &good, 1).is_ok());
        assert_eq!(refused(&|_| {}, 3).exit_code(), 2);
        let few = refused(&|dataset| dataset.objects[1].edit(|touches| _ = touches.pop()), 1);
        assert_eq!(few.what(), "only 19 approaches to fork are in one of the poses, and a plan needs 20");
        let full = refused(&|dataset| dataset.origin.as_mut().unwrap().approaches = false, 1);
        assert_eq!(full.what(), "the data set holds full touches only, without the approaches in between");
        let one = refused(&|dataset| dataset.objects.truncate(1), 1);
        assert_eq!(one.what(), "the data set has no approaches to fork");
        let no_pose = refused(&|dataset| dataset.objects[1].edit(|touches| touches[9] = flat()), 1);
        assert_eq!(no_pose.what(), "there are approaches to fork without the probe's pose");
        let missed = refused(
            &|dataset| {
                let missed = |touch: &Touch| super::tests::missed().with_pose(touch.pose().unwrap());
                *dataset = dataset.each(|object| object.changed(missed));
            },
            1,
        );
        assert_eq!(missed.what(), "no approach touched anything");
    }
}
