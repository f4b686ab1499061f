//! Approaches by the pose that they were made in, so that a robot can be sent where a plan says.

use crate::error::{Error, Result, problem};
use crate::evidence::{Drawer, Draws};
use crate::random::Purpose;
use crate::touches::ObjectTouches;
use palpate_shared::{Poses, Touch};
use std::collections::HashMap;

/// The approaches of one object, or some of them, by the number of their pose.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ByPose {
    /// The object's name.
    pub(super) name: String,
    /// For each pose the numbers of its approaches.
    pub(super) approaches: Vec<Vec<u32>>,
}

impl ByPose {
    /// Some approaches to an object, by their positions, such as those of one robot to one of its instances.
    ///
    /// # Errors
    /// When a touch has no pose.
    pub(super) fn new(touched: &ObjectTouches, poses: Poses, approaches_of: &[u32]) -> Result<Self> {
        let touches =
            approaches_of.iter().filter_map(|&number| Some((number, touched.touches().get(number as usize)?)));
        Ok(Self { name: touched.name.clone(), approaches: by_pose(&touched.name, touches, poses)? })
    }

    /// Number of approaches made in a pose; 0 for one that does not exist.
    pub(super) fn count(&self, pose: u16) -> usize {
        self.approaches.get(usize::from(pose)).map_or(0, Vec::len)
    }

    /// Draws approaches in poses that are asked for, each once, in an order that depends on the seed, on `group` and on
    /// nothing else.
    pub(super) fn stock(&self, group: usize, seed: u64) -> Stock<'_> {
        Stock { of: self, group: u64::try_from(group).unwrap_or(u64::MAX), seed, draws: HashMap::new() }
    }
}

/// The numbers of touches of an object, by the numbers of their poses.
///
/// # Errors
/// When a touch has no pose.
pub(crate) fn by_pose<'t>(
    name: &str,
    touches: impl Iterator<Item = (u32, &'t Touch)>,
    poses: Poses,
) -> Result<Vec<Vec<u32>>> {
    let mut by_pose = vec![Vec::new(); poses.count().into()];
    for (number, touch) in touches {
        let pose = touch.pose().ok_or_else(|| no_pose_of(name))?;
        by_pose[usize::from(poses.number_of(&pose))].push(number);
    }
    Ok(by_pose)
}

/// The problem of approaches to an object without the probe's pose, which a plan needs.
fn no_pose_of(object: &str) -> Error {
    problem!("there are approaches to {object} without the probe's pose")
        .fix("Capture the approaches with their pose: --approaches N --pose.")
}

/// Approaches of one object that were not drawn yet. One stock for each sequence draws no approach twice in a sequence;
/// one for several sequences draws none twice in all of them.
pub(super) struct Stock<'b> {
    of: &'b ByPose,
    group: u64,
    seed: u64,
    /// For poses that were asked for.
    draws: HashMap<u16, Draws>,
}

impl Stock<'_> {
    /// Number of approaches left in a pose.
    pub(super) fn left(&self, pose: u16) -> usize {
        self.draws.get(&pose).map_or_else(|| self.of.count(pose), Draws::left)
    }

    /// The number of an approach in this pose, drawn at random; `None` if none is left.
    pub(super) fn draw(&mut self, pose: u16) -> Option<u32> {
        let approaches = self.of.approaches.get(usize::from(pose))?;
        // Each pose has its own stream, so that the order in which poses are asked for makes no difference.
        let stream = self.group.wrapping_mul(256).wrapping_add(pose.into());
        let drawer = Drawer { purpose: Purpose::Active, name: &self.of.name, seed: self.seed };
        let draws = || drawer.each(stream, approaches.len());
        let position = self.draws.entry(pose).or_insert_with(draws).next()?;
        approaches.get(position).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touches::Source;
    use std::collections::BTreeSet;

    /// 520 approaches, one of two robots in each of 26 directions in turn.
    fn touched() -> ObjectTouches {
        let poses = Poses::with_rolls(1).unwrap();
        let touch = |number: u16| Touch::from_micros([0, 1, 2]).with_pose(poses.pose(number / 2 % 26).unwrap());
        ObjectTouches::new("cup", (0..520).map(touch).collect(), Source::Object)
    }

    #[test]
    fn every_approach_of_a_pose_is_drawn_once_whatever_else_is_drawn() {
        let poses = Poses::with_rolls(1).unwrap();
        let odd: Vec<u32> = (1..520).step_by(2).collect();
        let by_pose = ByPose::new(&touched(), poses, &odd).unwrap();
        assert!((0..26).all(|pose| by_pose.count(pose) == 10));
        let mut stock = by_pose.stock(3, 1);
        let drawn: Vec<u32> = std::iter::from_fn(|| stock.draw(7)).collect();
        assert!(drawn.iter().all(|number| number % 2 == 1 && number / 2 % 26 == 7));
        assert_eq!(drawn.iter().collect::<BTreeSet<_>>().len(), 10);
        assert_eq!((stock.left(7), stock.left(8), stock.draw(26), stock.left(26)), (0, 10, None, 0));
        let mut other = by_pose.stock(3, 1);
        let mixed: Vec<u32> = (0..10).map(|_| (other.draw(8), other.draw(7)).1.unwrap()).collect();
        assert_eq!(mixed, drawn);
        let mut next = by_pose.stock(4, 1);
        assert_ne!((0..10).map(|_| next.draw(7).unwrap()).collect::<Vec<_>>(), drawn);
    }

    #[test]
    fn touches_without_a_pose_are_refused() {
        let fifth = touched().touches()[5];
        let touched = touched().changed(|touch| if *touch == fifth { Touch::from_micros([0, 1, 2]) } else { *touch });
        let error = ByPose::new(&touched, Poses::with_rolls(1).unwrap(), &[3, 4, 5]).unwrap_err().to_string();
        assert!(error.contains("cup"), "{error}");
        assert!(ByPose::new(&touched, Poses::with_rolls(1).unwrap(), &[0, 2, 6]).is_ok());
    }
}
