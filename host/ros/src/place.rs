//! Objects on a table, by a model of maps: what lies there, where, and where to touch next.

use crate::follow::{Following, Placed, Step};
use crate::wire::{self, PoseWithCovariance};
use palpate::error::Kind;
use palpate::locate::{self, Approach, Hand, Locating, MapsFile, POSE, Pose};
use palpate::onboard::shared::Touch as Felt;
use palpate::onboard::{Stopping, Verdict as Decision};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// A locator of any maps.
type Located<'m> = Box<dyn Locating + 'm>;

self_cell::self_cell!(
    /// A locator and its maps.
    struct Opened {
        owner: Arc<MapsFile>,
        #[covariant]
        dependent: Located,
    }
);

/// A follower of touches with a position.
pub(crate) struct Placing {
    opened: Opened,
    hand: Hand,
    /// Seed of the choice of approaches, another for each object.
    seed: u32,
    next: Approach,
}

impl Placing {
    /// A follower that has touched nothing yet.
    ///
    /// # Errors
    /// The maps do not state their hand.
    pub(crate) fn new(maps: Arc<MapsFile>, stopping: Stopping) -> Result<Self, String> {
        let hand = Hand::of(&maps.maps()).ok_or_else(|| locate::no_hand().what().to_owned())?;
        let opened = Opened::new(maps, |file| locate::locating(file.maps(), stopping, None));
        let mut placing = Self { opened, hand, seed: 0, next: Approach::default() };
        placing.begin(None);
        Ok(placing)
    }

    fn locating(&self) -> &Located<'_> {
        self.opened.borrow_dependent()
    }
}

impl Following for Placing {
    fn names(&self) -> Vec<String> {
        locate::names(&self.opened.borrow_owner().maps())
    }

    fn known(&self) -> Vec<String> {
        self.names()
    }

    fn begin(&mut self, weights: Option<&[u32]>) {
        self.seed = self.seed.wrapping_add(1);
        self.opened.with_dependent_mut(|_, locating| {
            locating.begin(self.seed);
            if let Some(weights) = weights {
                locating.begin_of(weights);
            }
        });
        // In the middle, as in a calibration, with the row in any direction.
        self.next = Approach { roll: self.seed.to_le_bytes()[0].wrapping_mul(101), ..Approach::default() };
    }

    fn push(&mut self, felt: &Felt) -> Result<(), String> {
        let seen = locate::seen(&self.hand, felt).map_err(|problem| {
            // The library's remedies are in millimeters.
            let remedy = match problem.kind() {
                Kind::NotDown => "a model of maps needs a direction whose z is at most -0.95",
                _ if felt.position().is_none() => {
                    "a model of maps needs has_pose and has_position, with direction, alignment, and position in meters"
                }
                _ => "give times in seconds, and position in meters above the table, in a frame whose origin is on it",
            };
            format!("{}: {remedy}", problem.what())
        })?;
        self.next = self.opened.with_dependent_mut(|file, locating| {
            locating.push(seen);
            locating.choose(&self.hand, file.maps().range().unsigned_abs() * 2, POSE)
        });
        Ok(())
    }

    fn verdict(&self) -> Decision {
        self.locating().verdict()
    }

    fn touches(&self) -> u32 {
        u32::try_from(self.locating().touches()).unwrap_or(u32::MAX)
    }

    fn best(&self) -> usize {
        self.locating().best()
    }

    fn posteriors(&self) -> Vec<f64> {
        self.locating().posteriors()
    }

    fn complete(&self, step: &mut Step) {
        if !step.is_decided() {
            let Approach { x, y, roll } = self.next;
            step.next_pose = Some(wire::Pose::flat([x, y], f64::from(roll) / 256.0));
        }
        let place = (self.touches() > 0).then(|| self.locating().poses(self.best()));
        step.placed = place.and_then(|poses| poses.into_iter().next()).map(|pose| {
            let placement = self.opened.borrow_owner().maps().placement_name(pose.placement).to_owned();
            Placed { placement, pose: (&pose).into() }
        });
    }
}

/// Standard deviations in half of a 95 % interval.
const DEVIATIONS: f64 = 1.96;

impl From<&Pose> for PoseWithCovariance {
    fn from(pose: &Pose) -> Self {
        let variance = |half: f64| (half / DEVIATIONS).powi(2);
        let mut covariance = [[0.0; 6]; 6];
        let [x, y] = pose.within.map(|micrometers| variance(f64::from(micrometers) / 1e6));
        // That of any angle: uniform over a whole turn.
        let yaw = pose.yaw_within.map_or(PI * PI / 3.0, |within| variance(f64::from(within) / 65_536.0 * TAU));
        (covariance[0][0], covariance[1][1], covariance[5][5]) = (x, y, yaw);
        Self { pose: wire::Pose::flat(pose.position, f64::from(pose.yaw) / 65_536.0), covariance }
    }
}

#[cfg(test)]
#[allow(dead_code)]
#[path = "../examples/maps.rs"]
mod example;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decide::Decider;
    use crate::served::Served;
    use crate::thresholds::Thresholds;
    use crate::wire::{Expected, Touch};

    /// The object's place in millimeters, and its yaw.
    const PLACE: [f64; 2] = [12.0, -7.0];
    const YAW: f64 = PI / 6.0;

    /// A model of maps of a bar and a puck; `name` is that of a file of this test's own.
    fn served(name: &str) -> Served {
        let path = std::env::temp_dir().join(format!("palpate-ros-{}-{name}.palpate", std::process::id()));
        std::fs::write(&path, example::maps().unwrap()).unwrap();
        let served = Served::read(&path);
        std::fs::remove_file(&path).unwrap();
        served.unwrap()
    }

    fn decider(name: &str) -> Decider {
        Decider::new(served(name), Thresholds::default()).unwrap()
    }

    /// The touch of a hand that comes down at a pose.
    fn press(object: &str, at: &wire::Pose) -> Touch {
        let ([x, y, _], [.., z, w]) = (at.position, at.orientation);
        let ((sin, cos), (yaw_sin, yaw_cos)) = ((2.0 * z.atan2(w)).sin_cos(), YAW.sin_cos());
        let heights = [-15.0, 0.0, 15.0].map(|along| {
            let (x, y) = (1e3 * x + along * cos - PLACE[0], 1e3 * y + along * sin - PLACE[1]);
            example::height(object, [yaw_cos * x + yaw_sin * y, yaw_cos * y - yaw_sin * x])
        });
        let first = heights.into_iter().fold(0.0, f64::max);
        Touch {
            times: heights.map(|height| if first - height > 20.0 { f64::NAN } else { (first - height) / 100.0 }),
            has_pose: true,
            direction: [0.0, 0.0, -1.0],
            alignment: [cos, sin, 0.0],
            has_position: true,
            position: [x, y, first / 1e3],
            ..Touch::default()
        }
    }

    #[test]
    fn a_hand_that_goes_where_it_is_told_learns_what_lies_where() {
        let mut decider = decider("told");
        for object in ["bar", "puck"] {
            let mut step = decider.reset(&Expected::default()).unwrap();
            assert_eq!((step.verdict.objects.as_slice(), &step.placed), (&["bar".into(), "puck".into()][..], &None));
            assert_eq!(step.next_pose.as_ref().unwrap().position, [0.0; 3]);
            for touch in 1..=25 {
                step = decider.touch(&press(object, step.next_pose.as_ref().unwrap()));
                assert_eq!((step.verdict.touch, step.verdict.refused.as_str()), (touch, ""));
                if step.is_decided() {
                    break;
                }
            }
            assert_eq!(
                (step.verdict.verdict.as_str(), step.verdict.object.as_str()),
                ("recognized", object),
                "{step:?}"
            );
            assert_eq!((step.next_pose, step.evidence.unwrap().nats.len()), (None, 2));
            let Placed { placement, pose: PoseWithCovariance { pose, covariance } } = step.placed.unwrap();
            assert_eq!((placement.as_str(), pose.position[2]), ("flat", 0.0));
            for axis in [0, 1] {
                let (off, deviation) = (pose.position[axis] - PLACE[axis] / 1e3, covariance[axis][axis].sqrt());
                assert!(off.abs() < 3.0 * deviation && deviation < 5e-3, "{object}: {off} {deviation}");
            }
            let [.., z, w] = pose.orientation;
            if object == "puck" {
                assert_eq!((z, w, covariance[5][5]), (0.0, 1.0, PI * PI / 3.0));
            } else {
                // The same when it is turned by half a turn.
                let off = (2.0 * z.atan2(w) - YAW + PI / 2.0).rem_euclid(PI) - PI / 2.0;
                assert!(off.abs() < 3.0 * covariance[5][5].sqrt() && covariance[5][5] < 0.1, "{off} {covariance:?}");
            }
        }
    }

    #[test]
    fn a_touch_that_cannot_be_of_a_hand_above_the_table_says_why_and_changes_nothing() {
        let mut decider = decider("refused");
        // All fingers meet the table.
        let good = press("bar", &wire::Pose::flat([60_000, 60_000], 0.0));
        let before = decider.touch(&good);
        assert_eq!((before.verdict.touch, before.is_decided()), (1, false));
        for (wrong, why) in [
            (
                Touch { has_position: false, ..good.clone() },
                "the touch has no position: a model of maps needs has_pose",
            ),
            (Touch { has_pose: false, ..good.clone() }, "pose"),
            (Touch { direction: [1.0, 0.0, 0.0], ..good.clone() }, "does not come straight down"),
            (Touch { times: [0.0, 0.5, 0.0], ..good.clone() }, "mm below the table: give times in seconds"),
        ] {
            let mut step = decider.touch(&wrong);
            let refused = std::mem::take(&mut step.verdict.refused);
            assert!(refused.contains(why), "{wrong:?}: {refused}");
            assert_eq!(step, before);
        }
    }

    #[test]
    fn priors_and_thresholds_hold_for_maps_too() {
        let mut decider = decider("priors");
        let expected = Expected { objects: vec!["puck".into()], weights: Vec::new() };
        let step = decider.reset(&expected).unwrap();
        assert!(step.verdict.posteriors[0] == 0.0 && step.verdict.posteriors[1] > 0.999, "{step:?}");
        let step = decider.touch(&press("puck", &step.next_pose.unwrap()));
        assert_eq!(step.verdict.object, "puck");
        let of = |max_touches| Thresholds { max_touches, ..Thresholds::default() };
        assert!(decider.under(of(33)).err().unwrap().contains("at most 32 for a model of maps"));
        let mut once = decider.under(of(1)).unwrap();
        once.reset(&Expected::default()).unwrap();
        let middle = once.step().next_pose.unwrap();
        assert_ne!(once.touch(&press("bar", &middle)).verdict.verdict, "undecided");
        assert!(served("chip").for_chip().is_err());
    }

    #[test]
    fn intervals_of_95_percent_become_variances() {
        let pose = Pose {
            placement: 0,
            position: [1_000, 0],
            yaw: 0,
            within: [1_960, 3_920],
            yaw_within: Some(642),
            share: 0,
        };
        let PoseWithCovariance { pose: at, covariance } = (&pose).into();
        assert_eq!((at.position, at.orientation), ([1e-3, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]));
        let degree = 1.0_f64.to_radians();
        for (row, expected) in [1e-6, 4e-6, 0.0, 0.0, 0.0, (degree * 3.5266 / 1.96).powi(2)].into_iter().enumerate() {
            assert!((covariance[row][row] - expected).abs() < 1e-4 * expected + 1e-18, "{covariance:?}");
        }
        assert_eq!(covariance.iter().flatten().filter(|&&number| number != 0.0).count(), 3);
        let round = PoseWithCovariance::from(&Pose { yaw_within: None, ..pose });
        assert_eq!(round.covariance[5][5], PI * PI / 3.0);
    }
}
