//! Touches as features of trees.

use super::{Ensemble, Inputs, Occurring, Schema, origin};
use palpate_shared::format::TrainedTouches;
use palpate_shared::{Descriptor, MISSING_FEATURE, Touch};

/// Schemas of all descriptors, by which [`load`](super::load) knows features of touches.
pub(crate) const SCHEMAS: &[Schema] = &[
    schema(Descriptor::Times),
    schema(Descriptor::Curvature),
    schema(Descriptor::Gravity),
    schema(Descriptor::Oriented),
    schema(Descriptor::ContactsCurvature),
    schema(Descriptor::ContactsGravity),
    schema(Descriptor::ContactsOriented),
];

/// Schema of a descriptor's features.
pub(crate) const fn schema(descriptor: Descriptor) -> Schema {
    Schema {
        code: descriptor.code(),
        name: descriptor.name(),
        features: descriptor.feature_names(),
        of: "touches",
        whole: "the whole microseconds or Q15 units of touches",
        units: "times in microseconds, direction cosines times 32767",
        planes: match descriptor {
            Descriptor::Times => OF_TIMES,
            Descriptor::ContactsCurvature => OF_PATTERNS,
            _ => &[],
        },
        has_all_planes: matches!(descriptor, Descriptor::ContactsCurvature),
    }
}

/// Inputs of an ensemble over a descriptor's features.
pub const fn inputs(descriptor: Descriptor) -> Inputs {
    Inputs::Computed(schema(descriptor))
}

/// No contact, or one at 0 with any others.
const OF_TIMES: &[&[Occurring]] = {
    use Occurring::{Any, Missing, Only};
    &[&[Missing, Missing, Missing], &[Only(0), Any, Any], &[Any, Only(0), Any], &[Any, Any, Only(0)]]
};

/// Contact patterns in the order of their codes, each with the differences of times that it has.
const OF_PATTERNS: &[&[Occurring]] = {
    use Occurring::{Known, Missing, Only};
    &[
        &[Only(0), Missing, Missing, Missing],
        &[Only(1), Missing, Missing, Missing],
        &[Only(2), Missing, Missing, Missing],
        &[Only(3), Missing, Missing, Known],
        &[Only(4), Missing, Known, Missing],
        &[Only(5), Known, Known, Missing],
    ]
};

/// An [`Ensemble`] over features of touches.
pub trait OverTouches {
    /// The descriptor, if the ensemble is over features of touches.
    fn descriptor(&self) -> Option<Descriptor>;

    /// The touches that are evidence: those that the ensemble states; full touches, with a pose if the descriptor needs
    /// one, where it states none. Every model compiled from it takes the same.
    fn trained_touches(&self) -> TrainedTouches;

    /// The margins of a touch.
    ///
    /// # Panics
    /// If the ensemble is not over features of touches, or one that [`Ensemble::check`] refuses.
    fn margins(&self, touch: &Touch) -> Vec<f32>;
}

impl OverTouches for Ensemble {
    fn descriptor(&self) -> Option<Descriptor> {
        Descriptor::from_code(self.schema()?.code)
    }

    fn trained_touches(&self) -> TrainedTouches {
        let unstated = || TrainedTouches::full(self.descriptor().is_some_and(Descriptor::needs_pose));
        // What cannot be read was refused before.
        origin::trained(&self.origin).ok().flatten().map_or_else(unstated, |trained| trained.touches)
    }

    fn margins(&self, touch: &Touch) -> Vec<f32> {
        match self.descriptor() {
            Some(descriptor) => self.margins_of_features(&feature_row(descriptor, touch)),
            None => panic!("an ensemble over rows of features has no margins of a touch"),
        }
    }
}

/// The features of a touch as a trainer sees them: f32, NaN where missing. Exact, since features are whole numbers
/// below 2²⁴.
pub fn feature_row(descriptor: Descriptor, touch: &Touch) -> Vec<f32> {
    let to_f32 = |&feature: &i32| if feature == MISSING_FEATURE { f32::NAN } else { feature as f32 };
    descriptor.features(touch).as_slice().iter().map(to_f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_shared::{ContactPattern, ContactTime};

    #[test]
    fn every_descriptor_has_a_schema() {
        assert_eq!(SCHEMAS, Descriptor::ALL.map(schema));
    }

    #[test]
    fn features_of_every_touch_lie_in_a_plane_and_those_of_a_pattern_in_its_own() {
        let lies = |plane: &[Occurring], features: &[i32]| {
            plane.iter().zip(features).all(|(occurring, &feature)| match *occurring {
                Occurring::Any => true,
                Occurring::Known => feature != MISSING_FEATURE,
                Occurring::Only(value) => feature == value,
                Occurring::Missing => feature == MISSING_FEATURE,
            })
        };
        for fingers in 0..8 {
            for times in [[0, 0, 0], [0, 7, 9], [7, 0, 9], [9, 7, 0]] {
                let time = |finger: usize| match fingers >> finger & 1 {
                    1 => ContactTime::from_micros(times[finger]),
                    _ => ContactTime::MISSING,
                };
                let touch = Touch::new([0, 1, 2].map(time));
                for descriptor in Descriptor::ALL {
                    let features = descriptor.features(&touch);
                    let planes = schema(descriptor).planes;
                    let own: Vec<usize> =
                        (0..planes.len()).filter(|&plane| lies(planes[plane], features.as_slice())).collect();
                    assert!(planes.is_empty() || !own.is_empty(), "{descriptor:?} {touch:?}");
                    if schema(descriptor).has_all_planes {
                        assert_eq!(own, [usize::from(touch.pattern().code())]);
                    }
                }
            }
        }
        assert_eq!(OF_PATTERNS.len(), ContactPattern::ALL.len());
    }
}
