//! Models of maps in a station: touches with a position, and the place of an object.

use palpate_shared::Touch;
use palpate_shared::link::{ModelInfo, Refusal, VerdictMessage};
#[cfg(feature = "locate")]
use {
    super::message::decision,
    crate::locate::{Cell, Effort, Hand, Locator, Maps, POSE},
    palpate_shared::link::{Detail, PlaceMessage},
    palpate_shared::{Approach, Position, TablePose},
};

/// Room for models of maps in a [`Station`](super::Station): `()` has none, a `&mut` [`Table`] has. Every call after
/// [`open`](Self::open) gets the same bytes.
pub trait Locates {
    /// Puts maps into use, with nothing touched. What was in use stays if they are refused.
    ///
    /// # Errors
    /// [`Refusal::Invalid`] for other bytes, [`Refusal::TooLong`] for more objects than there is room for.
    fn open(&mut self, _: &[u8]) -> Result<(), Refusal> {
        Err(Refusal::Invalid)
    }

    /// Puts the maps out of use.
    fn close(&mut self) {}

    /// Description of the maps in use; none if there are none, and then nothing of the following does anything.
    fn info(&self, _: &[u8]) -> Option<ModelInfo> {
        None
    }

    /// Takes a touch with a position into account, in micrometers.
    ///
    /// # Errors
    /// [`Refusal::NoPose`] and [`Refusal::NotDown`] for one that is not counted, [`Refusal::NoModel`] without maps.
    fn press(&mut self, _: &[u8], _: &Touch, _: [i32; 3], _: bool) -> Result<VerdictMessage, Refusal> {
        Err(Refusal::NoModel)
    }

    /// Forgets all touches.
    ///
    /// # Errors
    /// [`Refusal::NoModel`] without maps.
    fn reset(&mut self, _: &[u8]) -> Result<(), Refusal> {
        Err(Refusal::NoModel)
    }

    /// The name of an object.
    fn name<'n>(&self, _: &'n [u8], _: u8) -> Option<&'n str> {
        None
    }

    /// The name of a placement.
    fn placement<'n>(&self, _: &'n [u8], _: u8) -> Option<&'n str> {
        None
    }

    /// The posterior of an object in Q56.
    fn posterior(&self, _: &[u8], _: u8) -> Option<u64> {
        None
    }

    /// The place of this rank of the recognized object, or else of the most likely one.
    ///
    /// # Errors
    /// [`Refusal::NoModel`] without maps.
    #[cfg(feature = "locate")]
    fn place(&mut self, _: &[u8], _: u8) -> Result<PlaceMessage, Refusal> {
        Err(Refusal::NoModel)
    }

    /// The next approach, with the middle finger within this many micrometers of the origin in x and y; none: twice the maps' range.
    /// It stays until the next touch.
    ///
    /// # Errors
    /// [`Refusal::NoModel`] without maps.
    #[cfg(feature = "locate")]
    fn next_press(&mut self, _: &[u8], _: Option<u32>) -> Result<Approach, Refusal> {
        Err(Refusal::NoModel)
    }
}

impl Locates for () {}

/// Places of an object that can be asked for.
#[cfg(feature = "locate")]
const PLACES: usize = 4;

/// Seed of the choice of approaches.
#[cfg(feature = "locate")]
const SEED: u32 = 1;

/// A [`Locator`] for the maps of a [`Station`](super::Station), with the default [`Effort`].
///
/// RAM: in proportion to `CELLS`, nearly all of it, `TOUCHES` and `OBJECTS`; `size_of` tells how much.
#[cfg(feature = "locate")]
#[derive(Debug)]
pub struct Table<const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize> {
    cells: [Cell; CELLS],
    /// The locator without maps and cells, and the hand; none while no maps are in use.
    opened: Option<(Locator<'static, CELLS, TOUCHES, OBJECTS, ()>, Hand)>,
    /// The approach that was proposed after the last touch, and its workspace.
    proposed: Option<(Option<u32>, Approach)>,
}

#[cfg(feature = "locate")]
impl<const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize> Default for Table<CELLS, TOUCHES, OBJECTS> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(feature = "locate")]
impl<const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize> Table<CELLS, TOUCHES, OBJECTS> {
    /// A table without maps.
    pub const fn new() -> Self {
        Self { cells: [Cell::NONE; CELLS], opened: None, proposed: None }
    }

    /// Lets the locator do something.
    fn with<T>(
        &mut self,
        model: &[u8],
        act: impl FnOnce(&mut Locator<'_, CELLS, TOUCHES, OBJECTS, &mut [Cell; CELLS]>, Hand) -> T,
    ) -> Result<T, Refusal> {
        let maps = Maps::read(model).map_err(|_| Refusal::NoModel)?;
        let (locator, hand) = self.opened.take().ok_or(Refusal::NoModel)?;
        let mut locator = locator.over(maps, &mut self.cells);
        let done = act(&mut locator, hand);
        self.opened = Some((locator.over(Maps::NONE, ()), hand));
        Ok(done)
    }

    fn maps<'n>(&self, model: &'n [u8]) -> Option<Maps<'n>> {
        self.opened.as_ref().and_then(|_| Maps::read(model).ok())
    }
}

#[cfg(feature = "locate")]
impl<const CELLS: usize, const TOUCHES: usize, const OBJECTS: usize> Locates for &mut Table<CELLS, TOUCHES, OBJECTS> {
    fn open(&mut self, model: &[u8]) -> Result<(), Refusal> {
        let maps = Maps::new(model).map_err(|_| Refusal::Invalid)?;
        let hand = Hand::of(&maps).ok_or(Refusal::Invalid)?;
        let fitting = maps.try_into().map_err(|_| Refusal::TooLong)?;
        let locator = Locator::without_pool(fitting, maps.stopping(), Effort::default(), SEED);
        (self.opened, self.proposed) = (Some((locator.over(Maps::NONE, ()), hand)), None);
        self.reset(model)
    }

    fn close(&mut self) {
        self.opened = None;
    }

    fn info(&self, model: &[u8]) -> Option<ModelInfo> {
        let maps = self.maps(model)?;
        Some(ModelInfo {
            checksum: model.last_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes)),
            length: u32::try_from(model.len()).unwrap_or(u32::MAX),
            last_object: u8::try_from(maps.objects().saturating_sub(1)).unwrap_or(u8::MAX),
            descriptor: ModelInfo::MAPS,
        })
    }

    // On its own in the stack, like the others: other commands need little of it.
    #[inline(never)]
    fn press(
        &mut self,
        model: &[u8],
        touch: &Touch,
        position: [i32; 3],
        detail: bool,
    ) -> Result<VerdictMessage, Refusal> {
        self.opened.as_ref().ok_or(Refusal::NoModel)?;
        touch.pose().ok_or(Refusal::NoPose)?;
        let touch = touch.with_position(Position { micrometers: position });
        let pressed = self.with(model, |locator, hand| {
            let decision = decision(locator.push(&touch, hand)?);
            let (best, evidence) = (locator.best(), locator.evidence());
            let evidence = evidence.get(..locator.maps().objects()).unwrap_or_default();
            let detail = detail.then(|| Detail::new(u64::from(locator.posterior(best)) << 40, evidence));
            let touches = u32::try_from(locator.touches()).unwrap_or(u32::MAX);
            Some(VerdictMessage { decision, best: u8::try_from(best).unwrap_or(u8::MAX), touches, detail })
        })?;
        let verdict = pressed.ok_or(Refusal::NotDown)?;
        self.proposed = None;
        Ok(verdict)
    }

    fn reset(&mut self, model: &[u8]) -> Result<(), Refusal> {
        self.proposed = None;
        self.with(model, |locator, _| locator.reset())
    }

    fn name<'n>(&self, model: &'n [u8], object: u8) -> Option<&'n str> {
        let (maps, object) = (self.maps(model)?, usize::from(object));
        (object < maps.objects()).then(|| maps.object_name(object))
    }

    fn placement<'n>(&self, model: &'n [u8], placement: u8) -> Option<&'n str> {
        let maps = self.maps(model)?;
        (usize::from(placement) < maps.placements()).then(|| maps.placement_name(placement))
    }

    fn posterior(&self, model: &[u8], object: u8) -> Option<u64> {
        let (maps, object) = (self.maps(model)?, usize::from(object));
        let (locator, _) = self.opened.as_ref()?;
        (object < maps.objects()).then(|| u64::from(locator.posterior(object)) << 40)
    }

    #[inline(never)]
    fn place(&mut self, model: &[u8], rank: u8) -> Result<PlaceMessage, Refusal> {
        self.with(model, |locator, _| {
            let (mut poses, rank) = ([TablePose::default(); PLACES], usize::from(rank));
            let poses = if locator.touches() == 0 { None } else { poses.get_mut(..=rank) }.unwrap_or_default();
            let found = locator.poses(locator.best(), poses);
            PlaceMessage {
                table_alone: locator.met_table_alone(),
                exhausted: locator.touches() > 0 && locator.exhausted().is_some(),
                place: poses.get(..found).and_then(|found| found.get(rank)).copied(),
            }
        })
    }

    #[inline(never)]
    fn next_press(&mut self, model: &[u8], within: Option<u32>) -> Result<Approach, Refusal> {
        if let Some((_, press)) = self.proposed.filter(|(asked, _)| *asked == within) {
            return Ok(press);
        }
        let press = self.with(model, |locator, hand| {
            let within = within.unwrap_or(2 * locator.maps().range().unsigned_abs());
            let stroke = hand.stroke.unwrap_or(u32::MAX);
            locator.choose(hand.spacing, stroke, within, POSE)
        })?;
        self.proposed = Some((within, press));
        Ok(press)
    }
}
