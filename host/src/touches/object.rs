//! The touches of one object, and what each of them is of.

use super::{Longest, Origin, Recorded};
use crate::error::Result;
use crate::probe::hand;
use crate::probe::noise::{Noise, Stream};
use palpate_shared::Touch;
use std::ops::Range;
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

    /// A placement of an object, or of one of its instances, with a weight from 0 to 1.
    pub(crate) fn placed(instance: Option<String>, placement: String, weight: f64) -> Self {
        Self::Placement { instance, placement, millionths: (weight * 1e6).round().clamp(0.0, 1e6) as u32 }
    }
}

impl From<String> for Source {
    /// An instance of this name.
    fn from(instance: String) -> Self {
        Self::Instance(instance)
    }
}

/// Touches of one object, in pools. There is no way to make such touches without stating their object.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectTouches {
    /// The object's name.
    pub name: String,
    touches: Vec<Touch>,
    /// One after the other. Each has a touch, and no two are of the same source and robot.
    pools: Vec<Pool>,
    /// The stroke of the probe that made them as a time in microseconds: also with noise that is added, a later contact is
    /// missing.
    window: Option<u32>,
}

/// Touches that may be mixed in a sequence: those of one source that one robot made.
#[derive(Clone, Debug, PartialEq)]
pub struct Pool {
    /// Source of the touches.
    pub source: Source,
    /// Number of the robot that made them; none if robots do not differ.
    pub robot: Option<u32>,
    /// Their positions among the object's touches, in the order of their file.
    pub range: Range<usize>,
}

/// Touches of a source and of a robot, where robots differ, that are not among those of an object yet.
pub type Part = (Source, Option<u32>, Vec<Touch>);

impl ObjectTouches {
    /// Touches that are all of one source.
    pub fn new(name: impl Into<String>, touches: Vec<Touch>, source: Source) -> Self {
        Self::of_parts(name, [(source, None, touches)])
    }

    /// Touches in parts; those of the same source and robot become one pool.
    pub fn of_parts(name: impl Into<String>, parts: impl IntoIterator<Item = Part>) -> Self {
        let mut joined: Vec<Part> = Vec::new();
        for (source, robot, touches) in parts {
            match joined.iter_mut().find(|other| (&other.0, other.1) == (&source, robot)) {
                Some((.., there)) => there.extend(touches),
                None if touches.is_empty() => {}
                None => joined.push((source, robot, touches)),
            }
        }
        let mut object = Self { name: name.into(), touches: Vec::new(), pools: Vec::new(), window: None };
        for (source, robot, touches) in joined {
            let begin = object.len();
            object.touches.extend(touches);
            object.pools.push(Pool { source, robot, range: begin..object.len() });
        }
        object
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
        let sources = match &sources[..] {
            [] | [Source::Instance(_)] => vec![Source::Object],
            _ => sources,
        };
        let mut parts: Vec<Part> = sources.into_iter().map(|source| (source, None, Vec::new())).collect();
        let count = parts.len();
        // Below the number of the sources.
        let first = (first % count as u64) as usize;
        for (number, touch) in touches.into_iter().enumerate() {
            parts[(first + number) % count].2.push(touch);
        }
        Self::of_parts(name, parts)
    }

    /// The touches of several objects, one after the other, as those of one whose sources are all of theirs.
    pub fn joined(name: impl Into<String>, objects: &[Self]) -> Self {
        let named = |object: &Self, source: &Source| match source {
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
        let parts = objects
            .iter()
            .flat_map(|object| object.parts().map(|(source, robot, touches)| (named(object, &source), robot, touches)));
        let window = objects.first().and_then(|object| object.window);
        Self::of_parts(name, parts).of_stroke(window)
    }

    /// Adds touches of the same object: those of equal sources and robots are of one pool.
    pub(crate) fn append(&mut self, more: &Self) {
        let window = if self.is_empty() { more.window } else { self.window };
        *self = Self::of_parts(&self.name, self.parts().chain(more.parts())).of_stroke(window);
    }

    /// The pools as parts of another object.
    fn parts(&self) -> impl Iterator<Item = Part> {
        self.pools.iter().map(|pool| (pool.source.clone(), pool.robot, self.of_pool(pool).to_vec()))
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

    /// The touches, pool after pool.
    pub fn touches(&self) -> &[Touch] {
        &self.touches
    }

    /// Pools of the touches. A sequence is of one pool.
    pub fn pools(&self) -> &[Pool] {
        &self.pools
    }

    /// The touches of a pool; none of a pool of another object.
    pub fn of_pool(&self, pool: &Pool) -> &[Touch] {
        self.touches.get(pool.range.clone()).unwrap_or_default()
    }

    /// The touches of the pools in turn: those that come first are of all pools.
    pub(crate) fn in_turns(&self) -> impl Iterator<Item = &Touch> {
        let longest = self.pools.iter().map(|pool| pool.range.len()).max().unwrap_or(0);
        (0..longest).flat_map(move |rank| self.pools.iter().filter_map(move |pool| self.of_pool(pool).get(rank)))
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

    /// Sources of the touches, each once; those of different robots are the same.
    pub fn sources(&self) -> Vec<&Source> {
        let mut sources = Vec::with_capacity(self.pools.len());
        for pool in &self.pools {
            if !sources.contains(&&pool.source) {
                sources.push(&pool.source);
            }
        }
        sources
    }

    /// The share that each of the [sources](Self::sources) has of the object: of placements their weights, each instance counting
    /// the same; equal shares of the placements that recordings state, and of other sources. They sum to 1.
    pub(crate) fn source_weights(&self) -> Vec<f64> {
        let sources = self.sources();
        let like = |source: &Source| sources.iter().filter(|own| own.placement() == source.placement()).count();
        let weight = |source: &&Source| match source {
            Source::Placement { millionths, .. } => f64::from(*millionths),
            // How often it was recorded says nothing of how often it lies like that.
            Source::Recording(Recorded { placement: Some(_), .. }) => 1e6 / like(source).max(1) as f64,
            _ => 1e6,
        };
        let weights: Vec<f64> = sources.iter().map(weight).collect();
        let whole: f64 = weights.iter().sum();
        // Every placement has a weight, unless a file was changed by hand.
        if whole > 0.0 {
            weights.into_iter().map(|weight| weight / whole).collect()
        } else {
            vec![1.0 / sources.len().max(1) as f64; sources.len()]
        }
    }

    /// The weights of the object's placements by name, over all of its instances; the greatest first, equal ones by name. They
    /// sum to 1. None if the object was not touched in placements, or a recording states none.
    pub(crate) fn placement_weights(&self) -> Option<Vec<(String, f64)>> {
        let mut sums = std::collections::BTreeMap::<&str, f64>::new();
        for (source, weight) in self.sources().into_iter().zip(self.source_weights()) {
            *sums.entry(source.placement()?).or_default() += weight;
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
        let without = |source: &Source| match source.clone() {
            Source::Placement { instance, .. } => instance.map_or(Source::Object, Source::Instance),
            Source::Recording(recorded) => Source::Recording(Recorded { placement: None, ..recorded }),
            other => other,
        };
        let of = |(placement, _): (String, f64)| {
            let own = self.parts().filter(|(source, ..)| source.placement() == Some(&placement));
            let own = own.map(|(source, robot, touches)| (without(&source), robot, touches));
            Self::of_parts(format!("{}/{placement}", self.name), own).of_stroke(self.window)
        };
        weights.into_iter().map(of).collect()
    }

    /// These touches, with a number of each placement in proportion to its weight: as an object that is put down at random is
    /// touched. All of them without placements, and for recordings, whose shares are those of the robot.
    #[must_use]
    #[cfg(any(feature = "train", test))]
    pub(crate) fn as_often_as_placed(&self) -> Self {
        let is_recorded = self.pools.iter().any(|pool| matches!(pool.source, Source::Recording(_)));
        if is_recorded || self.placement_weights().is_none() {
            return self.clone();
        }
        let sources = self.sources();
        let weights = self.source_weights();
        let weight = |pool: &Pool| {
            let place = sources.iter().position(|source| **source == pool.source).unwrap_or_default();
            let robots = self.pools.iter().filter(|other| other.source == pool.source).count();
            weights[place] / robots as f64
        };
        let least = self.pools.iter().map(|pool| pool.range.len() as f64 / weight(pool));
        let all = least.fold(f64::INFINITY, f64::min);
        self.each_pool(|pool, touches| {
            let count = (all * weight(pool)).round() as usize;
            touches.iter().copied().take(count.max(1)).collect()
        })
    }

    /// True if every sequence must be of one robot's touches, since robots differ.
    pub(crate) fn has_robots(&self) -> bool {
        self.pools.iter().any(|pool| pool.robot.is_some())
    }

    /// These touches under another name.
    #[must_use]
    #[cfg(feature = "train")]
    pub(crate) fn renamed(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// Other touches in each pool, in their order; a pool without any is left out.
    #[must_use]
    pub fn each_pool(&self, mut touches: impl FnMut(&Pool, &[Touch]) -> Vec<Touch>) -> Self {
        let parts = self.pools.iter().map(|pool| (pool.source.clone(), pool.robot, touches(pool, self.of_pool(pool))));
        Self::of_parts(&self.name, parts.collect::<Vec<_>>()).of_stroke(self.window)
    }

    /// Part of the touches of each pool: with `0..2` and `of` 5, the first two fifths.
    #[must_use]
    pub fn part(&self, part: Range<usize>, of: usize) -> Self {
        let of = of.max(1);
        self.each_pool(|_, touches| {
            let at = |end: usize| touches.len() * end.min(of) / of;
            touches[at(part.start.min(part.end))..at(part.end)].to_vec()
        })
    }

    /// The touches that `keep` says.
    #[must_use]
    #[cfg(test)]
    pub(crate) fn filtered(&self, keep: impl Fn(&Touch) -> bool) -> Self {
        self.each_pool(|_, touches| touches.iter().copied().filter(&keep).collect())
    }

    /// Up to `count` of the touches, spread over each pool, in their order.
    #[must_use]
    #[cfg(any(feature = "train", test))]
    pub(crate) fn thinned(&self, count: usize) -> Self {
        let step = self.len().div_ceil(count.max(1)).max(1);
        self.each_pool(|_, touches| touches.iter().copied().step_by(step).collect())
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
        let stream = self.stream(noise, seed);
        let divides = noise.has_bias() && robots > 1 && !self.has_robots();
        let (sources, parts) = (self.pools.len(), if divides { robots } else { 1 });
        let mut noisy = Vec::with_capacity(sources * parts);
        // One pool of each source in turn, so that those that come first are of all sources.
        for turn in 0..parts {
            for (source, pool) in self.pools.iter().enumerate() {
                // Below the number of robots.
                let robot = if divides { Some(((turn * sources + source) % robots) as u32) } else { pool.robot };
                let touches = pool.range.clone().skip(turn).step_by(parts);
                let touches = touches.map(|touch| stream.add(&self.touches[touch], touch, robot.unwrap_or(0).into()));
                noisy.push((pool.source.clone(), robot, self.within_stroke(touches.collect())));
            }
        }
        Self::of_parts(&self.name, noisy).of_stroke(self.window)
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

    fn touches(range: Range<u32>) -> Vec<Touch> {
        range.map(|touch| Touch::from_micros([0, touch, 9])).collect()
    }

    fn names(count: usize) -> Vec<String> {
        (0..count).map(|instance| format!("cup {instance}")).collect()
    }

    /// The times by which touches are known, for each pool.
    fn times(object: &ObjectTouches) -> Vec<(Source, Vec<u32>)> {
        let time = |touch: &Touch| touch.times()[1].micros().unwrap();
        object
            .pools()
            .iter()
            .map(|pool| (pool.source.clone(), object.of_pool(pool).iter().map(time).collect()))
            .collect()
    }

    fn lengths(object: &ObjectTouches) -> Vec<usize> {
        object.pools().iter().map(|pool| pool.range.len()).collect()
    }

    #[test]
    fn every_touch_keeps_its_source_whatever_is_done_with_it() {
        let object = ObjectTouches::in_turn("cup", touches(0..30), &names(3), 2);
        let is_of_its_source = |object: &ObjectTouches| {
            times(object).into_iter().all(|(source, times)| {
                times.iter().all(|time| source == Source::Instance(names(3)[((time + 2) % 3) as usize].clone()))
            })
        };
        let late = |touch: &Touch| touch.times()[1].micros().unwrap() >= 20;
        let doubled = {
            let mut twice = object.part(0..3, 10);
            twice.append(&object.part(7..10, 10));
            twice
        };
        for part in [object.part(1..2, 4), object.filtered(late), object.thinned(6), doubled] {
            assert!(!part.is_empty() && is_of_its_source(&part), "{part:?}");
        }
        assert_eq!(lengths(&object.thinned(6)), [2, 2, 2]);
        let reversed = object.changed(|touch| Touch::from_micros([0, 29 - touch.times()[1].micros().unwrap(), 9]));
        assert_eq!(reversed.sources(), object.sources());
        let of_last = object.filtered(|touch| touch.times()[1].micros().unwrap() % 3 == 0);
        assert_eq!(of_last.sources(), [&Source::Instance("cup 2".into())], "others have no touch");
        assert!(object.part(1..1, 2).pools().is_empty());
    }

    #[test]
    fn placements_that_recordings_state_count_the_same_however_often_they_were_recorded() {
        let of = |last: Option<&str>| {
            let parts = [("1", Some("+z")), ("2", Some("+z")), ("3", last)].map(|(began, placement)| {
                let placement = placement.map(str::to_owned);
                let recorded = Recorded { began: began.into(), placement, ..Recorded::default() };
                (Source::Recording(recorded), None, touches(0..10))
            });
            ObjectTouches::of_parts("cup", parts)
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
        let one = ObjectTouches::new("fork", touches(0..2), Source::Object);
        let two = ObjectTouches::in_turn("cup", touches(0..4), &names(2), 0);
        let joined = ObjectTouches::joined("background", &[one, two]);
        let expected = [("fork", vec![0, 1]), ("cup/cup 0", vec![0, 2]), ("cup/cup 1", vec![1, 3])];
        assert_eq!(times(&joined), expected.map(|(name, times)| (Source::Instance(name.into()), times)));
    }

    #[test]
    fn pools_are_of_one_source_and_one_robot() {
        let noise = with!(Noise::default(), speed_bias = 0.1);
        for (instances, robots, pools) in [(1, 3, 3), (4, 1, 4), (4, 2, 4), (4, 3, 12), (1, 1, 1)] {
            let object = ObjectTouches::in_turn("cup", touches(0..240), &names(instances), 0);
            let noisy = object.noisy(&noise, 1, robots);
            assert_eq!((lengths(&noisy), noisy.sources()), (vec![240 / pools; pools], object.sources()));
            let first: Vec<_> = noisy.pools().iter().take(instances).map(|pool| &pool.source).collect();
            assert_eq!(first, object.sources(), "in turn");
            let found: std::collections::BTreeSet<_> = noisy.pools().iter().map(|pool| pool.robot).collect();
            assert_eq!((found.len(), noisy.has_robots()), (robots, robots > 1));
            // A part of them is of the same robots, and these stay with what is added later.
            assert_eq!(noisy.part(1..3, 5).pools().len(), pools);
            let again = noisy.noisy(&noise, 2, if robots > 1 { 7 } else { 1 });
            assert!(again.pools().iter().map(|pool| pool.robot).eq(noisy.pools().iter().map(|pool| pool.robot)));
        }
    }

    #[test]
    fn recordings_of_different_lengths_are_pools_by_themselves() {
        let logs = [("a", 7), ("b", 2)].map(|(log, count)| (Source::Log(log.into()), None, touches(0..count)));
        let object = ObjectTouches::of_parts("cup", logs);
        assert_eq!(lengths(&object), [7, 2]);
        let bias = with!(Noise::default(), speed_bias = 0.1);
        assert_eq!(lengths(&object.noisy(&bias, 1, 4)), [4, 1, 3, 1]);
    }
}
