//! The touches of one object, and what each of them is of.

use super::{Longest, Origin, Recorded};
use crate::error::Result;
use crate::probe::hand;
use crate::probe::noise::{Noise, Stream};
use palpate_shared::Touch;
use std::path::PathBuf;

/// Origin that touches of an object share if they may follow each other in a sequence. Touches of two sources never do:
/// a robot touches one cup until it knows it, not several cups in turn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// The object, not known to have several instances or recordings.
    Object,
    /// One of its instances, by name.
    Instance(String),
    /// One of its placements on a table, or of those of one of its instances.
    Placement {
        /// The instance, if the object has several.
        instance: Option<String>,
        /// The placement's name.
        placement: String,
        /// Its weight among the placements of the object, or of the instance, in millionths.
        millionths: u32,
    },
    /// One of its recordings, as its data set lists it.
    Recording(Recorded),
    /// A robot's log.
    Log(PathBuf),
}

impl Source {
    /// The placement on a table, where it is of one.
    pub(crate) fn placement(&self) -> Option<&str> {
        match self {
            Self::Placement { placement, .. } => Some(placement),
            Self::Recording(recorded) => recorded.placement.as_deref(),
            Self::Object | Self::Instance(_) | Self::Log(_) => None,
        }
    }
}

impl From<String> for Source {
    /// An instance of this name.
    fn from(instance: String) -> Self {
        Self::Instance(instance)
    }
}

/// The touches of one object. Each keeps the source that it is of, and the robot that made it, through everything that is
/// done with them: there is no way to make such touches without stating their object.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectTouches {
    /// The object's name.
    pub name: String,
    touches: Vec<Touch>,
    /// Each has a touch.
    sources: Vec<Source>,
    /// For each touch the position of its source; empty if there is one source.
    source_of: Vec<u32>,
    /// For each touch the number of the robot that made it; empty if robots do not differ.
    robot_of: Vec<u32>,
    /// The stroke of the probe that made them as a time in microseconds: also with noise that is added, a later contact is
    /// missing.
    window: Option<u32>,
}

/// Touches of an object that may be mixed in a sequence: those of one source that one robot made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pool {
    /// The position of the source among [`ObjectTouches::sources`].
    pub source: usize,
    /// The positions of the touches, ascending.
    pub touches: Vec<u32>,
}

impl ObjectTouches {
    /// Touches that are all of one source.
    pub fn new(name: impl Into<String>, touches: Vec<Touch>, source: Source) -> Self {
        let sources = if touches.is_empty() { Vec::new() } else { vec![source] };
        Self { name: name.into(), touches, sources, source_of: Vec::new(), robot_of: Vec::new(), window: None }
    }

    /// Touches of instances or placements in turn: touch i is of number `first` + i modulo their number. Without any, and of one
    /// instance alone, all touches are of [`Source::Object`].
    pub fn in_turn(
        name: impl Into<String>,
        touches: Vec<Touch>,
        sources: &[impl Clone + Into<Source>],
        first: u64,
    ) -> Self {
        let sources: Vec<Source> = sources.iter().cloned().map(Into::into).collect();
        let count = sources.len() as u64;
        match &sources[..] {
            [] | [Source::Instance(_)] => return Self::new(name, touches, Source::Object),
            [one] => return Self::new(name, touches, one.clone()),
            _ => {}
        }
        // Below the number of the instances.
        let source_of = (0..touches.len() as u64).map(|touch| ((first % count + touch) % count) as u32).collect();
        Self { name: name.into(), touches, sources, source_of, robot_of: Vec::new(), window: None }.tidied()
    }

    /// Touches in any order, each with the number of its instance.
    pub fn numbered(name: impl Into<String>, touches: &[(Touch, i64)]) -> Self {
        let mut numbers: Vec<i64> = touches.iter().map(|(_, number)| *number).collect();
        numbers.sort_unstable();
        numbers.dedup();
        let all = touches.iter().map(|(touch, _)| *touch).collect();
        if numbers.len() <= 1 {
            return Self::new(name, all, Source::Object);
        }
        // Below the number of touches, which are counted in 32 bits.
        let place = |(_, number): &(Touch, i64)| numbers.partition_point(|other| other < number) as u32;
        let source_of = touches.iter().map(place).collect();
        let sources = numbers.iter().map(|number| Source::Instance(number.to_string())).collect();
        Self { name: name.into(), touches: all, sources, source_of, robot_of: Vec::new(), window: None }
    }

    /// Touches of one source after the other: of each as many as are stated, of the last one all the rest.
    pub(crate) fn in_runs(name: impl Into<String>, touches: Vec<Touch>, runs: Vec<(Source, u64)>) -> Self {
        let last = runs.len().saturating_sub(1);
        let mut source_of = Vec::new();
        for (position, (_, count)) in (0_u32..).zip(&runs) {
            let left = touches.len() - source_of.len();
            let count =
                if position as usize == last { left } else { usize::try_from(*count).unwrap_or(left).min(left) };
            source_of.extend(std::iter::repeat_n(position, count));
        }
        let mut sources: Vec<Source> = runs.into_iter().map(|(source, _)| source).collect();
        if sources.is_empty() {
            sources.push(Source::Object);
            source_of = vec![0; touches.len()];
        }
        Self { name: name.into(), touches, sources, source_of, robot_of: Vec::new(), window: None }.tidied()
    }

    /// The touches of several objects, one after the other, as those of one whose sources are all of theirs.
    pub fn joined(name: impl Into<String>, objects: &[Self]) -> Self {
        let mut joined = Self::new(name, Vec::new(), Source::Object);
        for object in objects {
            let named = |source: &Source| match source {
                Source::Object => Source::Instance(object.name.clone()),
                Source::Instance(instance) => Source::Instance(format!("{}/{instance}", object.name)),
                Source::Placement { instance, placement, millionths } => Source::Placement {
                    instance: Some(match instance {
                        Some(instance) => format!("{}/{instance}", object.name),
                        None => object.name.clone(),
                    }),
                    placement: placement.clone(),
                    millionths: *millionths,
                },
                other => other.clone(),
            };
            let sources = object.sources.iter().map(named).collect();
            joined.extend(&Self { sources, ..object.clone() }, false);
        }
        joined
    }

    /// Adds more touches of the same object: those of equal sources are of one.
    pub(crate) fn append(&mut self, more: &Self) {
        self.extend(more, true);
    }

    fn extend(&mut self, more: &Self, may_share: bool) {
        if self.is_empty() {
            self.window = more.window;
        }
        let (before, robots) = (self.touches.len(), self.robot_of.len() + more.robot_of.len());
        if self.source_of.is_empty() {
            self.source_of = vec![0; before];
        }
        if robots > 0 {
            self.robot_of.resize(before, 0);
            self.robot_of.extend((0..more.touches.len()).map(|touch| more.robot_of.get(touch).copied().unwrap_or(0)));
        }
        let place = |source: &Source| {
            let there = self.sources.iter().position(|own| own == source).filter(|_| may_share);
            there.unwrap_or_else(|| {
                self.sources.push(source.clone());
                self.sources.len() - 1
            })
        };
        // Sources are counted in 32 bits, as touches are.
        let places: Vec<u32> = more.sources.iter().map(place).map(|place| place as u32).collect();
        self.source_of.extend((0..more.touches.len()).map(|touch| places[more.source_of(touch)]));
        self.touches.extend_from_slice(&more.touches);
        *self = std::mem::replace(self, Self::new("", Vec::new(), Source::Object)).tidied();
    }

    /// Without sources that have no touch; what says nothing is left out.
    fn tidied(mut self) -> Self {
        let mut has_touch = vec![false; self.sources.len()];
        if self.source_of.is_empty() {
            has_touch.iter_mut().take(usize::from(!self.touches.is_empty())).for_each(|has| *has = true);
        }
        self.source_of.iter().for_each(|&source| has_touch[source as usize] = true);
        let mut place = Vec::with_capacity(has_touch.len());
        let mut next = 0_u32;
        for &has in &has_touch {
            place.push(next);
            next += u32::from(has);
        }
        let mut has = has_touch.iter();
        self.sources.retain(|_| has.next().is_some_and(|has| *has));
        self.source_of.iter_mut().for_each(|source| *source = place[*source as usize]);
        if self.sources.len() <= 1 {
            self.source_of.clear();
        }
        self
    }

    /// These touches as of a probe with this stroke, a time in microseconds ([`Probe::window`](crate::probe::Probe::window)).
    #[must_use]
    pub(crate) fn of_stroke(self, window: Option<u32>) -> Self {
        Self { window, ..self }
    }

    /// These touches as made by the probe of this origin.
    #[must_use]
    pub(crate) fn of_origin(self, origin: &Origin) -> Self {
        self.of_stroke(origin.probe.window())
    }

    /// The noise of these touches, in any order.
    pub(crate) fn stream(&self, noise: &Noise, seed: u64) -> Stream {
        noise.stream(&self.name, self.len(), seed)
    }

    /// Touches made of these, such as by noise, without contacts later than the stroke.
    pub(crate) fn within_stroke(&self, mut touches: Vec<Touch>) -> Vec<Touch> {
        if self.window.is_some() {
            touches.iter_mut().for_each(|touch| *touch = hand::within(touch, self.window));
        }
        touches
    }

    /// The touches, in the order of the file.
    pub fn touches(&self) -> &[Touch] {
        &self.touches
    }

    /// Refuses the touches if many of them take longer than `longest`, as files of touches are refused.
    ///
    /// # Errors
    /// The object and the number of the first such touch, its time, and the longest one.
    pub fn check_times(&self, longest: &Longest) -> Result<()> {
        longest
            .check_all((1_u64..).zip(&self.touches))
            .map_err(|(number, error)| error.within(format_args!("touch {number} of {}: ", self.name)))
    }

    /// Number of touches.
    pub fn len(&self) -> usize {
        self.touches.len()
    }

    /// True if there is no touch.
    pub fn is_empty(&self) -> bool {
        self.touches.is_empty()
    }

    /// Sources of the touches; each has at least one.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// The position of a touch's source among [`sources`](Self::sources).
    pub fn source_of(&self, touch: usize) -> usize {
        self.source_of.get(touch).map_or(0, |source| *source as usize)
    }

    /// The placement of a source among [`sources`](Self::sources), by name; none if it is of none, or a recording that states
    /// none.
    pub(crate) fn placement_of_source(&self, source: usize) -> Option<&str> {
        self.sources.get(source)?.placement()
    }

    /// The share that each source has of the object: of placements their weights, each instance counting the same; equal shares
    /// of the placements that recordings state, and of other sources. They sum to 1.
    pub(crate) fn source_weights(&self) -> Vec<f64> {
        let like = |source: &Source| self.sources.iter().filter(|own| own.placement() == source.placement()).count();
        let weight = |source: &Source| match source {
            Source::Placement { millionths, .. } => f64::from(*millionths),
            // How often it was recorded says nothing of how often it lies like that.
            Source::Recording(Recorded { placement: Some(_), .. }) => 1e6 / like(source).max(1) as f64,
            _ => 1e6,
        };
        let weights: Vec<f64> = self.sources.iter().map(weight).collect();
        let whole: f64 = weights.iter().sum();
        // Every placement has a weight, unless a file was changed by hand.
        if whole > 0.0 {
            weights.into_iter().map(|weight| weight / whole).collect()
        } else {
            vec![1.0 / self.sources.len().max(1) as f64; self.sources.len()]
        }
    }

    /// The weights of the object's placements by name, over all of its instances; the greatest first, equal ones by name. They
    /// sum to 1. None if the object was not touched in placements, or a recording states none.
    pub(crate) fn placement_weights(&self) -> Option<Vec<(String, f64)>> {
        let mut sums = std::collections::BTreeMap::<&str, f64>::new();
        for (source, weight) in self.source_weights().into_iter().enumerate() {
            *sums.entry(self.placement_of_source(source)?).or_default() += weight;
        }
        let mut weights: Vec<_> = sums.into_iter().map(|(name, weight)| (name.to_owned(), weight)).collect();
        weights.sort_by(|a, b| b.1.total_cmp(&a.1));
        (!weights.is_empty()).then_some(weights)
    }

    /// The touches of each placement as an object of its own, called `object/placement`, in the order of these names; the object
    /// itself without placements.
    pub(crate) fn by_placement(&self) -> Vec<Self> {
        let Some(mut weights) = self.placement_weights() else { return vec![self.clone()] };
        weights.sort_by(|a, b| a.0.cmp(&b.0));
        let of = |(placement, _): (String, f64)| {
            let is_own = |touch: &usize| self.placement_of_source(self.source_of(*touch)) == Some(&placement);
            let mut own = self.select((0..self.len()).filter(is_own));
            own.name = format!("{}/{placement}", self.name);
            for source in &mut own.sources {
                match source {
                    Source::Placement { instance, .. } => {
                        *source = instance.take().map_or(Source::Object, Source::Instance);
                    }
                    Source::Recording(recorded) => recorded.placement = None,
                    _ => {}
                }
            }
            own
        };
        weights.into_iter().map(of).collect()
    }

    /// These touches, with a number of each placement in proportion to its weight: as an object that is put down at random is
    /// touched. All of them without placements, and for recordings, whose shares are those of the robot.
    #[must_use]
    #[cfg(any(feature = "train", test))]
    pub(crate) fn as_often_as_placed(&self) -> Self {
        let is_recorded = self.sources.iter().any(|source| matches!(source, Source::Recording(_)));
        if is_recorded || self.placement_weights().is_none() {
            return self.clone();
        }
        let (by_source, weights) = (self.by_source(), self.source_weights());
        let most = by_source.iter().zip(&weights).map(|(touches, weight)| touches.len() as f64 / weight);
        let all = most.fold(f64::INFINITY, f64::min);
        let kept = by_source.iter().zip(&weights).flat_map(|(touches, weight)| {
            let count = (all * weight).round() as usize;
            touches.iter().copied().take(count.max(1))
        });
        let mut kept: Vec<usize> = kept.collect();
        kept.sort_unstable();
        self.select(kept)
    }

    /// For each source its touches' positions, ascending.
    pub(crate) fn by_source(&self) -> Vec<Vec<usize>> {
        let mut by_source = vec![Vec::new(); self.sources.len()];
        (0..self.len()).for_each(|touch| by_source[self.source_of(touch)].push(touch));
        by_source
    }

    /// Pools of touches that may be mixed in a sequence: one pool for each source and robot, those of different sources
    /// in turn. An object without touches has one empty pool.
    pub fn pools(&self) -> Vec<Pool> {
        let mut by_source: Vec<Vec<(u32, Pool)>> = vec![Vec::new(); self.sources.len().max(1)];
        let mut places = std::collections::HashMap::new();
        for touch in 0..self.len() {
            let (source, robot) = (self.source_of(touch), self.robot_of.get(touch).copied().unwrap_or(0));
            let pools = &mut by_source[source];
            let place = *places.entry((source, robot)).or_insert_with(|| {
                pools.push((robot, Pool { source, touches: Vec::new() }));
                pools.len() - 1
            });
            // A position is below the number of a file's lines.
            pools[place].1.touches.extend(u32::try_from(touch));
        }
        let most = by_source.iter().map(Vec::len).max().unwrap_or(0);
        let mut by_source: Vec<_> = by_source.into_iter().map(Vec::into_iter).collect();
        let mut pools = Vec::new();
        for _ in 0..most {
            pools.extend(by_source.iter_mut().filter_map(Iterator::next).map(|(_, pool)| pool));
        }
        if pools.is_empty() { vec![Pool { source: 0, touches: Vec::new() }] } else { pools }
    }

    /// These touches, each made by the robot with this number.
    #[must_use]
    pub fn of_robots(self, mut robots: Vec<u32>) -> Self {
        robots.resize(self.len(), 0);
        Self { robot_of: robots, ..self }
    }

    /// The number of the robot that made a touch; none if robots do not differ.
    pub fn robot_of(&self, touch: usize) -> Option<u32> {
        self.robot_of.get(touch).copied()
    }

    /// True if every sequence must be of one robot's touches, since robots differ.
    pub(crate) fn has_robots(&self) -> bool {
        !self.robot_of.is_empty()
    }

    /// These touches under another name.
    #[must_use]
    #[cfg(feature = "train")]
    pub(crate) fn renamed(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// The touches at these positions, in this order. Positions out of range give none.
    #[must_use]
    pub fn select(&self, positions: impl IntoIterator<Item = usize>) -> Self {
        let positions: Vec<usize> = positions.into_iter().filter(|position| *position < self.len()).collect();
        let of = |all: &[u32]| positions.iter().filter_map(|&position| all.get(position).copied()).collect();
        let some = Self {
            name: self.name.clone(),
            touches: positions.iter().map(|&position| self.touches[position]).collect(),
            sources: self.sources.clone(),
            source_of: of(&self.source_of),
            robot_of: of(&self.robot_of),
            window: self.window,
        };
        some.tidied()
    }

    /// The touches that `keep` says.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn filtered(&self, keep: impl Fn(&Touch) -> bool) -> Self {
        self.select((0..self.len()).filter(|&touch| keep(&self.touches[touch])))
    }

    /// Up to `count` of the touches, spread over all of them within each source, in their order.
    #[must_use]
    #[cfg(any(feature = "train", test))]
    pub(crate) fn thinned(&self, count: usize) -> Self {
        let step = self.len().div_ceil(count.max(1)).max(1);
        let mut chosen: Vec<usize> =
            self.by_source().into_iter().flat_map(|touches| touches.into_iter().step_by(step)).collect();
        chosen.sort_unstable();
        self.select(chosen)
    }

    /// These touches, each changed.
    #[must_use]
    pub(crate) fn changed(&self, change: impl FnMut(&Touch) -> Touch) -> Self {
        Self { touches: self.touches.iter().map(change).collect(), ..self.clone() }
    }

    /// The touches with noise, made by `robots` robots in turn within each source. Without a bias robots do not differ, and
    /// their number does not matter; touches that robots made stay those robots'.
    #[must_use]
    pub(crate) fn noisy(&self, noise: &Noise, seed: u64, robots: usize) -> Self {
        let mut robot_of = self.robot_of.clone();
        if robot_of.is_empty() && noise.has_bias() && robots > 1 {
            let sources = self.sources.len();
            let mut ranks = vec![0; sources];
            // Below the number of robots.
            robot_of.extend((0..self.len()).map(|touch| {
                let source = self.source_of(touch);
                let robot = (ranks[source] * sources + source) % robots;
                ranks[source] += 1;
                robot as u32
            }));
        }
        let stream = self.stream(noise, seed);
        let robot = |touch: usize| robot_of.get(touch).copied().unwrap_or(0).into();
        let noisy = self.touches.iter().enumerate().map(|(index, touch)| stream.add(touch, index, robot(index)));
        Self { touches: self.within_stroke(noisy.collect()), robot_of, ..self.clone() }
    }
}

#[cfg(test)]
impl ObjectTouches {
    /// Other touches in place of these, all of one source.
    pub(crate) fn edit(&mut self, edit: impl FnOnce(&mut Vec<Touch>)) {
        let mut touches = self.touches.clone();
        edit(&mut touches);
        *self = Self::new(self.name.clone(), touches, Source::Object);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::with;

    fn touches(count: u32) -> Vec<Touch> {
        (0..count).map(|touch| Touch::from_micros([0, touch, 9])).collect()
    }

    fn names(count: usize) -> Vec<String> {
        (0..count).map(|instance| format!("cup {instance}")).collect()
    }

    /// The times by which touches are known, for each source.
    fn times(object: &ObjectTouches) -> Vec<(Source, Vec<u32>)> {
        let time = |touch: usize| object.touches()[touch].times()[1].micros().unwrap();
        let of = |(source, touches): (&Source, Vec<usize>)| (source.clone(), touches.into_iter().map(time).collect());
        object.sources().iter().zip(object.by_source()).map(of).collect()
    }

    #[test]
    fn every_touch_keeps_its_source_whatever_is_done_with_it() {
        let object = ObjectTouches::in_turn("cup", touches(30), &names(3), 2);
        assert_eq!((0..4).map(|touch| object.source_of(touch)).collect::<Vec<_>>(), [2, 0, 1, 2]);
        let is_of_its_source = |object: &ObjectTouches| {
            times(object).into_iter().all(|(source, times)| {
                times.iter().all(|time| source == Source::Instance(names(3)[((time + 2) % 3) as usize].clone()))
            })
        };
        let late = |touch: &Touch| touch.times()[1].micros().unwrap() >= 20;
        let doubled = {
            let mut twice = object.select([4, 1]);
            twice.append(&object.select([29, 0, 5]));
            twice
        };
        for part in [object.select([7, 3, 3, 29, 1000]), object.filtered(late), object.thinned(6), doubled] {
            assert!(is_of_its_source(&part), "{part:?}");
        }
        assert_eq!(object.thinned(6).by_source().iter().map(Vec::len).collect::<Vec<_>>(), [2, 2, 2]);
        let reversed = object.changed(|touch| Touch::from_micros([0, 29 - touch.times()[1].micros().unwrap(), 9]));
        assert_eq!(reversed.sources(), object.sources());
        assert_eq!(object.select([0, 3]).sources(), [Source::Instance("cup 2".into())], "others have no touch");
        assert_eq!(object.select([]).pools(), [Pool { source: 0, touches: Vec::new() }]);
    }

    #[test]
    fn placements_that_recordings_state_count_the_same_however_often_they_were_recorded() {
        let recorded = |began: &str, placement: Option<&str>| {
            let (object, began, placement) = ("cup".into(), began.into(), placement.map(str::to_owned));
            Source::Recording(Recorded { object, began, placement, touches: 10, ..Recorded::default() })
        };
        let of = |last: Option<&str>| {
            let runs = [("1", Some("+z")), ("2", Some("+z")), ("3", last)];
            let runs = runs.map(|(began, placement)| (recorded(began, placement), 10));
            ObjectTouches::in_runs("cup", touches(30), runs.into())
        };
        let stated = of(Some("-z"));
        assert_eq!(stated.placement_weights(), Some(vec![("+z".into(), 0.5), ("-z".into(), 0.5)]));
        assert_eq!(stated.as_often_as_placed(), stated);
        let placed = stated.by_placement();
        let found: Vec<_> = placed.iter().map(|own| (own.name.as_str(), own.len(), own.sources().len())).collect();
        assert_eq!(found, [("cup/+z", 20, 2), ("cup/-z", 10, 1)]);
        assert!(placed.iter().all(|own| own.by_placement() == [own.clone()]), "divided once");
        // One that states none may be of any.
        let unstated = of(None);
        assert_eq!((unstated.placement_weights(), unstated.by_placement()), (None, vec![unstated.clone()]));
    }

    #[test]
    fn touches_of_several_objects_stay_apart_when_they_are_joined() {
        let one = ObjectTouches::new("fork", touches(2), Source::Object);
        let two = ObjectTouches::in_turn("cup", touches(4), &names(2), 0);
        let joined = ObjectTouches::joined("background", &[one, two]);
        let expected = [("fork", vec![0, 1]), ("cup/cup 0", vec![0, 2]), ("cup/cup 1", vec![1, 3])];
        assert_eq!(times(&joined), expected.map(|(name, times)| (Source::Instance(name.into()), times)));
    }

    #[test]
    fn runs_are_as_long_as_they_say_and_the_last_one_takes_the_rest() {
        let runs = |counts: &[u64]| names(9).into_iter().map(Source::Instance).zip(counts.iter().copied()).collect();
        let lengths = |counts: &[u64]| {
            let object = ObjectTouches::in_runs("cup", touches(10), runs(counts));
            object.by_source().iter().map(Vec::len).collect::<Vec<_>>()
        };
        assert_eq!(lengths(&[3, 0, 4]), [3, 7]);
        assert_eq!(lengths(&[8, 8, 8]), [8, 2]);
        assert_eq!(lengths(&[]), [10]);
    }

    #[test]
    fn numbers_of_instances_may_be_any_and_in_any_order() {
        let numbers = [7, -1, 7, 3, -1];
        let numbered: Vec<(Touch, i64)> = touches(5).into_iter().zip(numbers).collect();
        let expected = [("-1", vec![1, 4]), ("3", vec![3]), ("7", vec![0, 2])];
        let expected = expected.map(|(name, times)| (Source::Instance(name.into()), times));
        assert_eq!(times(&ObjectTouches::numbered("cup", &numbered)), expected);
        assert_eq!(ObjectTouches::numbered("cup", &numbered[..1]).sources(), [Source::Object]);
    }

    #[test]
    fn pools_are_of_one_source_and_one_robot() {
        let noise = with!(Noise::default(), speed_bias = 0.1);
        for (instances, robots, pools) in [(1, 3, 3), (4, 1, 4), (4, 2, 4), (4, 3, 12), (1, 1, 1)] {
            let object = ObjectTouches::in_turn("cup", touches(240), &names(instances), 0).noisy(&noise, 1, robots);
            let found = object.pools();
            assert_eq!(found.len(), pools);
            for (turn, pool) in found.iter().enumerate() {
                let expected: Vec<u32> = (turn as u32..240).step_by(pools).collect();
                assert_eq!((&pool.touches, pool.source), (&expected, turn % instances), "{instances}, {robots}");
            }
            // A part of them is of the same robots.
            let part = object.select(100..200);
            assert_eq!(part.pools().len(), pools);
            assert!(part.pools().iter().all(|pool| pool.touches.windows(2).all(|two| two[1] - two[0] == pools as u32)));
        }
    }

    #[test]
    fn recordings_of_different_lengths_are_pools_by_themselves() {
        let runs = vec![(Source::Log("a".into()), 7), (Source::Log("b".into()), 2)];
        let object = ObjectTouches::in_runs("cup", touches(9), runs);
        let pools = object.pools();
        assert_eq!((pools[0].touches.len(), pools[1].touches.as_slice()), (7, &[7, 8][..]));
        let bias = with!(Noise::default(), speed_bias = 0.1);
        assert_eq!(object.noisy(&bias, 1, 4).pools().iter().map(|pool| pool.source).collect::<Vec<_>>(), [0, 1, 0, 1]);
    }
}
