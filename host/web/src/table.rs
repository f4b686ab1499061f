//! State of the table: one game, one round, and the memory that the script shares.

use palpate::compile::open;
use palpate::glam::DVec3;
use palpate::locate::{Maps, Standing, World};
use palpate::mesh::Mesh;
use palpate::onboard::{Refused, Verdict};
use palpate::play::{Approached, Game, Hidden, Round, decompress, unpack};
use palpate::probe::hand::Unreached;
use palpate::probe::noise::{Deviation, Noise};
use palpate::probe::{Aim, Probe};
use palpate::shared::format::Length;
use palpate::shared::{ContactPattern, Pose, Q15_ONE, Touch};
use palpate::touches::Origin;
use palpate::with;
use std::cell::RefCell;

/// Objects that may lie on the table, and the one that does.
#[derive(Default)]
pub(crate) struct Press {
    pub(crate) standing: Vec<Standing>,
    pub(crate) probe: Probe,
    pub(crate) opened: Option<(World<'static>, Maps<'static>)>,
    pub(crate) hidden: Option<Hidden<'static>>,
}

/// State that the functions work on.
#[derive(Default)]
pub(crate) struct Table {
    pub(crate) input: Vec<u8>,
    /// Numbers for the script.
    pub(crate) output: Vec<f64>,
    evidence: Vec<i64>,
    /// Meshes of the game's objects, in their own units.
    pub(crate) meshes: Vec<Mesh>,
    /// Longest side of each.
    pub(crate) lengths: Vec<f64>,
    /// The game on a table.
    pub(crate) press: Press,
    game: Option<Game<'static>>,
    round: Option<Round<'static>>,
}

thread_local! {
    static TABLE: RefCell<Table> = RefCell::new(Table::default());
}

/// Does something with the table. No function calls another, so it is free.
pub(crate) fn with<T>(act: impl FnOnce(&mut Table) -> T) -> T {
    TABLE.with_borrow_mut(act)
}

pub(crate) fn index(number: u32) -> usize {
    usize::try_from(number).unwrap_or(usize::MAX)
}

impl Table {
    pub(crate) fn room(&mut self, length: u32) -> *mut u8 {
        self.input = vec![0; index(length)];
        self.input.as_mut_ptr()
    }

    pub(crate) fn start(&mut self, millimeters: bool, aim: u32, measures: [f64; 6]) -> Option<usize> {
        let unit = if millimeters { Length::Millimeter } else { Length::Tenth };
        let [radius, spacing, speed, tilt, ..] = measures;
        let [.., stroke, travel] = measures.map(|length| (length > 0.0).then_some(length));
        let aim = *Aim::ALL.get(index(aim))?;
        let probe = with!(Probe::default(), radius, spacing, speed, tilt, stroke, travel);
        let origin = Origin { unit, aim, probe, ..Origin::default() };
        let press = Press { probe, ..Press::default() };
        *self = Self { press, game: Some(Game::new(&origin)), ..Self::default() };
        Some(0)
    }

    pub(crate) fn add_object(&mut self, name: u32, length: f64) -> Option<usize> {
        let (name, mesh) = self.input.split_at_checked(index(name))?;
        let mesh = unpack(mesh)?;
        let name = std::str::from_utf8(name).ok()?;
        let object = self.game.as_mut()?.add_object(name, &mesh, length).ok()?;
        self.meshes.push(mesh);
        self.lengths.push(length);
        self.press.standing.push(Standing::of(name, Vec::new()));
        Some(object)
    }

    pub(crate) fn vertices(&mut self, object: u32) -> Option<usize> {
        let (mesh, scene) = (self.meshes.get(index(object))?, self.game.as_ref()?.scene(index(object))?);
        // Placed as the scene is.
        let [from, to] = mesh.bounds().map(|corner| corner.as_dvec3());
        let [low, high] = scene.bounds();
        let scale = (high - low).max_element() / (to - from).max_element();
        let place = |vertex: &[f32; 3]| (low + (DVec3::from(vertex.map(f64::from)) - from) * scale).to_array();
        self.output = mesh.vertices.iter().flat_map(place).collect();
        Some(self.output.len())
    }

    pub(crate) fn triangles(&mut self, object: u32) -> Option<usize> {
        self.output = self.meshes.get(index(object))?.triangles.iter().flatten().map(|&vertex| vertex.into()).collect();
        Some(self.output.len())
    }

    pub(crate) fn add_model(&mut self) -> Option<usize> {
        let bytes = decompress(&self.input)?;
        // Checked first: what stays for good is a model.
        open(&bytes).ok()?;
        // A page is one game, and its models are there as long as the page is.
        let bytes: &'static [u8] = Vec::leak(bytes);
        self.game.as_mut()?.add_model(open(bytes).ok()?).ok()
    }

    pub(crate) fn set_noise(&mut self) -> Option<usize> {
        let numbers: Vec<f64> = self.input.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        let &[least, largest, timer, debounce, missed, first, middle, last, ref rest @ ..] = &numbers[..] else {
            return None;
        };
        let &[speed, speed_error, speed_bias, pose, pose_bias] = rest else { return None };
        let noise = with!(
            Noise::default(),
            deviation = Deviation { least, largest },
            timer,
            debounce,
            missed = [missed; 3],
            bent = [first, middle, last],
            speed,
            speed_error,
            speed_bias,
            pose,
            pose_bias
        );
        self.game.as_mut()?.set_noise(noise).ok().map(|()| 0)
    }

    pub(crate) fn begin(&mut self, object: u32, seed: u32) -> Option<usize> {
        self.round = Some(self.game.as_ref()?.round(index(object), seed.into())?);
        Some(0)
    }

    /// Does an approach and puts it out: start, direction, alignment (3 numbers each); how far each finger moves to its
    /// contact; when each touched, exactly and as sensed, in microseconds; NaN for a finger that missed; the code of the
    /// contact pattern as sensed; and for each finger why the hand did not reach its contact: 1 the stroke, 2 the travel.
    pub(crate) fn touch(
        &mut self,
        approach: impl FnOnce(&Game<'static>, &mut Round<'static>) -> Option<Approached>,
    ) -> Option<usize> {
        let Approached { approach, distances, unreached, exact, touch } =
            approach(self.game.as_ref()?, self.round.as_mut()?)?;
        let vectors = [approach.start, approach.direction, approach.alignment];
        let times = |touch: Touch| touch.times().map(|time| time.micros().map_or(f64::NAN, f64::from));
        self.output = vectors.iter().flat_map(|vector| vector.to_array()).collect();
        self.output.extend(distances.map(|distance| distance.unwrap_or(f64::NAN)));
        self.output.extend(times(exact));
        self.output.extend(times(touch));
        self.output.push(touch.pattern().code().into());
        self.output.extend(unreached.map(|reason| match reason {
            None => 0.0,
            Some(Unreached::Stroke) => 1.0,
            Some(Unreached::Travel) => 2.0,
        }));
        Some(0)
    }

    pub(crate) fn player(&mut self, model: u32) -> Option<usize> {
        let player = self.round.as_ref()?.players.get(index(model))?;
        let recognizer = &player.recognizer;
        let (verdict, best) = match recognizer.verdict() {
            Verdict::Undecided => (0.0, recognizer.best()),
            Verdict::Recognized { object, .. } => (1.0, object.into()),
            Verdict::Unknown => (2.0, recognizer.best()),
            Verdict::GaveUp => (3.0, recognizer.best()),
        };
        let refused = match player.refused {
            None => 0.0,
            Some(Refused::Pattern(ContactPattern::None)) => 1.0,
            Some(Refused::Pattern(_)) => 2.0,
            Some(Refused::Spread) => 3.0,
            Some(_) => 4.0,
        };
        let (approaches, touches) = (player.approaches.into(), recognizer.touches().into());
        self.output = vec![verdict, best as f64, approaches, touches, refused];
        self.output.extend(player.posteriors());
        self.output.extend(player.thresholds());
        Some(recognizer.model().object_count())
    }

    pub(crate) fn evidence(&mut self, model: u32) -> *const i64 {
        let player = self.round.as_ref().and_then(|round| round.players.get(index(model)));
        self.evidence = player.map_or_else(Vec::new, |player| {
            let (evidence, model) = (player.recognizer.evidence(), player.recognizer.model());
            let prior = |object| i64::from(model.prior(object));
            (0..model.object_count())
                .map(|object| evidence.get(object).copied().unwrap_or_else(|| prior(object)))
                .collect()
        });
        self.evidence.as_ptr()
    }

    pub(crate) fn propose(&mut self, model: u32) -> Option<usize> {
        let player = self.round.as_ref()?.players.get(index(model))?;
        let proposal = player.proposal()?;
        let Pose { direction, alignment } = player.recognizer.model().plan()?.poses().pose(proposal.pose)?;
        let one = f64::from(Q15_ONE);
        self.output = vec![proposal.pose.into(), f64::from(proposal.score) / 32_768.0];
        self.output.extend([direction, alignment].into_iter().flatten().map(|cosine| f64::from(cosine) / one));
        Some(0)
    }
}
