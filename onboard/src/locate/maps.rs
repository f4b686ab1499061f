//! Height maps of placements, read in place.

use crate::bytes::{ModelError, at};
use crate::decide::Stopping;
use palpate_shared::format::{
    CHECKSUM_LENGTH, HEADER_LENGTH, Header, MAPS_LAYOUT, Promise, Section, Tag, TrainedProbe, take_section,
};

/// Levels of a pyramid: finest cells, windows of two of them, and of 4, 8, 16 and 32 mm.
pub(super) const LEVELS: usize = 6;
/// Bytes of the fixed part of a section of maps.
pub const MAPS_LENGTH: usize = 20;
/// Bytes of a placement's record.
pub const PLACEMENT_LENGTH: usize = 24;
/// Bytes of the likelihoods that follow the records: of contacts, of missing contacts below and above a limit, of a table that
/// is not felt.
pub const LIKELIHOODS_LENGTH: usize = 2 * (CONTACTS + WITHIN + BEYOND + 1);
pub(super) const CONTACTS: usize = 2 * WIDTHS * DISTANCES;
/// Bins of the width of an interval of heights.
pub const WIDTHS: usize = 16;
/// Bins of the distance of a height from an interval, of 1/8 mm.
pub const DISTANCES: usize = 32;
/// Shares of an interval below a limit, in 64ths.
pub const WITHIN: usize = 65;
/// Bins of the distance of an interval above a limit, of 1/8 mm.
pub const BEYOND: usize = 64;

/// Maps of the heights that a fingertip meets on objects that lie on a table, read in place from a model's bytes.
///
/// `FORMAT.md` of `palpate-shared` describes the bytes.
#[derive(Clone, Copy, Debug)]
pub struct Maps<'a> {
    model: &'a [u8],
    records: &'a [u8],
    likelihoods: &'a [u8],
    heights: &'a [u8],
    pub(super) is_fine: bool,
    /// Half of the square in which an object's origin is, in 1/16 mm.
    pub(super) range: i32,
    /// Root cells along each side of it.
    pub(super) roots: u8,
    /// Standard deviation of an object's move in an approach, in 1/16 mm, and of its turn, in radians in Q14.
    pub(super) drift: [i32; 2],
    /// Factor of the half of a pose's intervals, in Q8; 0: 1.
    stretch: u16,
}

/// A way in which an object lies on the table, and its map.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Placement {
    pub(super) object: u8,
    pub(super) is_round: bool,
    /// Logarithm of its share of its object.
    pub(super) prior: i32,
    /// Least fit of its object, in 1/64 nat; 0: no test for unknown ones.
    least_fit: i32,
    /// 1/16 mm in a count of its heights, in Q6.
    scale: u32,
    /// Farthest point that is higher than the table, from the origin, in 1/16 mm.
    pub(super) radius: i32,
    /// Cells on each side of the middle one, for each level.
    half: [[i32; 2]; LEVELS],
    /// Place of its heights, for each level.
    offset: [usize; LEVELS],
}

impl<'a> Maps<'a> {
    /// Opens a model of maps, checking everything that reading it later relies on: after this nothing can fail.
    ///
    /// Cost: in proportion to the bytes, nearly all of it for the checksum; call it once and keep the result.
    ///
    /// # Errors
    /// [`ModelError`] for bytes that are truncated, too many, of another version, changed, meaningless, or a model of trees.
    pub fn new(model: &'a [u8]) -> Result<Self, ModelError> {
        crate::model::whole(model)?;
        Self::read(model)
    }

    /// No maps: those of a locator whose maps are elsewhere.
    pub(crate) const NONE: Self = Self {
        model: &[],
        records: &[],
        likelihoods: &[],
        heights: &[],
        is_fine: false,
        range: 0,
        roots: 0,
        drift: [0; 2],
        stretch: 0,
    };

    /// Opens a model without computing its checksum. Cost: some instructions for each placement.
    ///
    /// # Errors
    /// Errors of [`new`](Self::new).
    pub(crate) fn read(model: &'a [u8]) -> Result<Self, ModelError> {
        let header = Header::of(model);
        // The layout, the threshold, the limit of touches.
        let fields =
            [(6, header.layout() == MAPS_LAYOUT), (48, header.odds() < 1 << 56), (56, header.max_touches() > 0)];
        if let Some((offset, _)) = fields.into_iter().find(|(_, is_right)| !is_right) {
            return Err(ModelError::Field { offset });
        }
        let text = usize::try_from(header.text_length()).unwrap_or(usize::MAX);
        let start = HEADER_LENGTH.saturating_add(text);
        let length = usize::try_from(header.optional_length()).unwrap_or(usize::MAX);
        let sections = model.get(start..start.saturating_add(length));
        let mut rest = sections.ok_or(ModelError::Section { offset: start })?;
        let end = start + rest.len();
        if model.len() != end.saturating_add(CHECKSUM_LENGTH) {
            return Err(ModelError::Section { offset: end });
        }
        let (mut found, mut previous) = (None, 0);
        while !rest.is_empty() {
            let offset = end - rest.len();
            let wrong = ModelError::Section { offset };
            let Some(Section { tag, must_understand, content }) = take_section(&mut rest) else { return Err(wrong) };
            if tag <= previous {
                return Err(wrong);
            }
            previous = tag;
            if tag == Tag::Maps.code() {
                found = Some(Self::of(model, content, header.last_object()).ok_or(wrong)?);
            } else if must_understand {
                return Err(ModelError::NotUnderstood { tag, offset });
            }
        }
        found.ok_or(ModelError::Section { offset: start })
    }

    /// The maps in a section's content.
    fn of(model: &'a [u8], content: &'a [u8], last_object: u8) -> Option<Self> {
        let (fixed, rest) = content.split_first_chunk::<MAPS_LENGTH>()?;
        let &[shift, roots, placements, _, ref range @ ..] = fixed;
        let (numbers, _) = range.as_chunks::<2>();
        let &[range, drift, turn, _, stretch, ..] = numbers else { return None };
        let (records, rest) = rest.split_at_checked(usize::from(placements) * PLACEMENT_LENGTH)?;
        let (likelihoods, heights) = rest.split_at_checked(LIKELIHOODS_LENGTH)?;
        let range = i32::from(u16::from_le_bytes(range));
        let maps = Self {
            model,
            records,
            likelihoods,
            heights,
            is_fine: shift == 4,
            range,
            roots,
            stretch: u16::from_le_bytes(stretch),
            drift: [drift, turn].map(|bytes| i32::from(u16::from_le_bytes(bytes))),
        };
        let is_plausible = matches!(shift, 4 | 5)
            && matches!(roots, 1..=15)
            && placements > 0
            && (16..=4_096).contains(&range)
            && maps.drift.iter().all(|&drift| drift < 1_024);
        let mut has_object = [false; 256];
        for index in 0..placements {
            let placement = maps.placement(index);
            let last = LEVELS - 1;
            let end = at(&placement.offset, last).checked_add(2 * cells(at(&placement.half, last)))?;
            if placement.object > last_object || placement.scale == 0 || placement.radius < 16 || end > heights.len() {
                return None;
            }
            *has_object.get_mut(usize::from(placement.object))? = true;
        }
        let all = has_object.get(..=usize::from(last_object))?.iter().all(|&has| has);
        (is_plausible && all).then_some(maps)
    }

    /// Number of objects: 1 to 256. Cost of this and of all other numbers here: a few instructions. Cannot fail.
    pub fn objects(&self) -> usize {
        usize::from(Header::of(self.model).last_object()) + 1
    }

    /// Number of placements of all objects.
    pub fn placements(&self) -> usize {
        self.records.len() / PLACEMENT_LENGTH
    }

    /// The object of a placement; 0 for one that is not there.
    pub fn object_of(&self, placement: u8) -> u8 {
        at(self.records, usize::from(placement) * PLACEMENT_LENGTH)
    }

    /// The name of an object; empty if it has none, or is not there. Cost: a few instructions for each name before it.
    pub fn object_name(&self, object: usize) -> &'a str {
        if object < self.objects() { self.text(object + 1) } else { "" }
    }

    /// The name of a placement; empty if it has none, or is not there. Cost: as [`object_name`](Self::object_name).
    pub fn placement_name(&self, placement: u8) -> &'a str {
        let placement = usize::from(placement);
        if placement < self.placements() { self.text(self.objects() + 1 + placement) } else { "" }
    }

    fn text(&self, index: usize) -> &'a str {
        let mut text = self.model.get(HEADER_LENGTH..).unwrap_or_default();
        for _ in 0..index {
            let (&length, rest) = text.split_first().unwrap_or((&0, &[]));
            text = rest.get(usize::from(length)..).unwrap_or_default();
        }
        let (&length, rest) = text.split_first().unwrap_or((&0, &[]));
        core::str::from_utf8(rest.get(..usize::from(length)).unwrap_or_default()).unwrap_or_default()
    }

    /// Logarithm of a placement's share of its object, in 1/64 nat.
    pub fn prior_of(&self, placement: u8) -> i32 {
        self.placement(placement).prior
    }

    /// True if a placement looks the same from all sides.
    pub fn is_round(&self, placement: u8) -> bool {
        self.placement(placement).is_round
    }

    /// Noise that the likelihoods are for: the standard deviation of heights and of the hand's position, each in 20 micrometers,
    /// and lost contacts in 1/10,000. For people: nothing here uses it.
    pub fn noise(&self) -> [u16; 3] {
        let section = self.section(Tag::Maps).and_then(|content| content.get(MAPS_LENGTH - 4..)?.first_chunk());
        let &[height, position, low, high] = section.unwrap_or(&[0; 4]);
        [height.into(), position.into(), u16::from_le_bytes([low, high])]
    }

    /// Standard deviations of an object's move in an approach, in 1/16 mm, and of its turn, in radians in Q14.
    pub const fn drift(&self) -> [i32; 2] {
        self.drift
    }

    /// Version of the tool that wrote the model.
    pub fn tool_version(&self) -> &'a str {
        self.text(0)
    }

    /// Bytes of a placement's map.
    pub fn bytes_of(&self, placement: u8) -> usize {
        let Placement { half, .. } = self.placement(placement);
        half.iter().enumerate().map(|(level, &half)| if level < 2 { 0 } else { 2 * cells(half) }).sum::<usize>()
            + cells(at(&half, 0))
    }

    /// Farthest point of a placement that is higher than the table, from its origin, in micrometers.
    pub fn radius(&self, placement: u8) -> i32 {
        self.placement(placement).radius * 125 / 2
    }

    /// The height that a fingertip meets at a point in a placement's frame, all in micrometers. Cost: one lookup of a cell.
    pub fn height(&self, placement: u8, at: [i32; 2]) -> i32 {
        let [x, y] = at.map(|micrometers| micrometers.clamp(-2_000_000, 2_000_000) * 2 / 125);
        self.height_at(&self.placement(placement), x, y) * 125 / 2
    }

    /// Factor of the half of a pose's intervals, in Q8.
    pub(super) const fn stretch(&self) -> u32 {
        if self.stretch == 0 { 256 } else { self.stretch as u32 }
    }

    /// The bytes of the whole model.
    pub const fn model(&self) -> &'a [u8] {
        self.model
    }

    /// Half of the side of the square in which objects are looked for, in micrometers.
    pub const fn range(&self) -> i32 {
        self.range * 125 / 2
    }

    /// Side of a cell of the maps, in millimeters.
    pub const fn cell(&self) -> u8 {
        if self.is_fine { 1 } else { 2 }
    }

    /// Least [fit](super::Locator::fit) of a placement's object, in 1/64 nat; none without a test for unknown objects.
    pub fn least_fit(&self, placement: u8) -> Option<i32> {
        Some(self.placement(placement).least_fit).filter(|&least| least != 0)
    }

    /// Thresholds that the model states.
    pub fn stopping(&self) -> Stopping {
        let header = Header::of(self.model);
        Stopping::from_odds(header.odds(), header.max_touches())
    }

    /// The content of an optional section; none if the model does not have it. Cost: a few instructions for each section.
    pub fn section(&self, tag: Tag) -> Option<&'a [u8]> {
        let header = Header::of(self.model);
        let start = HEADER_LENGTH.saturating_add(usize::try_from(header.text_length()).ok()?);
        let length = usize::try_from(header.optional_length()).ok()?;
        let mut rest = self.model.get(start..start.checked_add(length)?)?;
        while let Some(section) = take_section(&mut rest) {
            if section.tag == tag.code() {
                return Some(section.content);
            }
        }
        None
    }

    /// The probe that they were learned with; none if it is not stated.
    pub fn probe(&self) -> Option<TrainedProbe> {
        TrainedProbe::from_bytes(self.section(Tag::Probe)?)
    }

    /// The promise about wrong names; none if there is none.
    pub fn promise(&self) -> Option<Promise> {
        Promise::from_bytes(self.section(Tag::Promise)?)
    }

    #[inline(always)]
    pub(super) fn placement(&self, index: u8) -> Placement {
        let start = usize::from(index) * PLACEMENT_LENGTH;
        let record = self.records.get(start..).and_then(<[u8]>::first_chunk::<PLACEMENT_LENGTH>);
        let Some(&[object, flags, p0, p1, s0, s1, r0, r1, o0, o1, o2, o3, ref halves @ .., f0, f1]) = record else {
            return Placement::default();
        };
        let mut placement = Placement {
            object,
            is_round: flags & 1 != 0,
            prior: i32::from(i16::from_le_bytes([p0, p1])),
            least_fit: i32::from(i16::from_le_bytes([f0, f1])),
            scale: u32::from(u16::from_le_bytes([s0, s1])),
            radius: i32::from(u16::from_le_bytes([r0, r1])),
            half: [[0; 2]; LEVELS],
            offset: [0; LEVELS],
        };
        let mut offset = usize::try_from(u32::from_le_bytes([o0, o1, o2, o3])).unwrap_or(usize::MAX);
        let mut levels = placement.half.iter_mut().zip(&mut placement.offset);
        // The second level is read from the cells of the first.
        for (level, half) in halves.chunks_exact(2).take(LEVELS - 1).enumerate() {
            let half = [i32::from(at(half, 0)), i32::from(at(half, 1))];
            if level == 1 {
                let _ = levels.next();
            }
            if let Some(slot) = levels.next() {
                *slot.0 = half;
                *slot.1 = offset;
            }
            offset = offset.saturating_add(if level == 0 { cells(half) } else { 2 * cells(half) });
        }
        placement
    }

    fn likelihood(&self, index: usize) -> i32 {
        let bytes = self.likelihoods.get(2 * index..).and_then(<[u8]>::first_chunk);
        bytes.map_or(0, |&bytes| i32::from(i16::from_le_bytes(bytes)))
    }

    /// Logarithm of the likelihood of a contact at this distance from an interval of this width.
    #[inline(always)]
    pub(super) fn of_contact(&self, near_table: bool, width: usize, distance: i32) -> i32 {
        let distance = usize::try_from(distance >> 1).unwrap_or(0).min(DISTANCES - 1);
        self.likelihood((usize::from(near_table) * WIDTHS + width) * DISTANCES + distance)
    }

    /// Logarithm of the likelihood of no contact above a limit that lies so many 64ths into an interval.
    #[inline(always)]
    pub(super) fn of_missing_within(&self, share: i32) -> i32 {
        self.likelihood(CONTACTS + usize::try_from(share).unwrap_or(0).min(WITHIN - 1))
    }

    /// Logarithm of the likelihood of no contact above a limit that lies so far below an interval.
    #[inline(always)]
    pub(super) fn of_missing_beyond(&self, distance: i32) -> i32 {
        self.likelihood(CONTACTS + WITHIN + usize::try_from(distance >> 1).unwrap_or(0).min(BEYOND - 1))
    }

    /// Logarithm of the likelihood that a table within the stroke is not felt.
    #[inline(always)]
    pub(super) fn of_table_missed(&self) -> i32 {
        self.likelihood(CONTACTS + WITHIN + BEYOND)
    }

    #[inline(always)]
    fn count(&self, offset: usize) -> u32 {
        u32::from(at(self.heights, offset))
    }

    /// The cell of the finest level that a point is in.
    #[inline(always)]
    fn cell_of(&self, [half_x, half_y]: [i32; 2], x: i32, y: i32) -> (i32, i32) {
        let shift = self.shift();
        let middle = 1 << (shift - 1);
        ((x + middle + (half_x << shift)) >> shift, (y + middle + (half_y << shift)) >> shift)
    }

    /// The height at a point in the placement's frame, in 1/16 mm.
    #[inline(always)]
    pub(super) fn height_at(&self, placement: &Placement, x: i32, y: i32) -> i32 {
        let [half, ..] = placement.half;
        let (i, j) = self.cell_of(half, x, y);
        if i < 0 || j < 0 || i > 2 * half[0] || j > 2 * half[1] {
            return 0;
        }
        placement.scaled(self.count(at(&placement.offset, 0).wrapping_add(row(half, i, j))))
    }

    /// Least and greatest height within a radius of a point in the placement's frame, all in 1/16 mm.
    #[inline(always)]
    pub(super) fn heights(&self, placement: &Placement, x: i32, y: i32, radius: i32) -> [i32; 2] {
        if radius > WIDEST {
            return [0, placement.scaled(255)];
        }
        // The window of a level holds a circle of 2 times 1.02 its size.
        let mut level = 0_usize;
        while level < LEVELS - 1 && radius * 64 > REACH * (16 << level) {
            level += 1;
        }
        let [lowest, highest] = match level {
            0 | 1 => self.nearby(placement, x, y, level),
            _ => {
                let [half_x, half_y] = at(&placement.half, level);
                let shift = level + 4;
                let middle = 8 << level;
                let (i, j) = ((x + middle + (half_x << shift)) >> shift, (y + middle + (half_y << shift)) >> shift);
                if i < 0 || j < 0 || i > 2 * half_x || j > 2 * half_y {
                    return [0; 2];
                }
                let offset = at(&placement.offset, level).wrapping_add(2 * row([half_x, half_y], i, j));
                [self.count(offset), self.count(offset.wrapping_add(1))]
            }
        };
        [placement.scaled(lowest), placement.scaled(highest)]
    }

    /// Least and greatest height about a point in a finest cell, in 1/16 mm: half of what the four closest cells span, about the
    /// height between them, or all of it at a wall.
    #[inline(always)]
    pub(super) fn close(&self, placement: &Placement, x: i32, y: i32) -> [i32; 2] {
        let shift = self.shift();
        let [half_x, half_y] = at(&placement.half, 0);
        let (x, y) = (x + (half_x << shift), y + (half_y << shift));
        let Some(heights) = self.square(placement, x >> shift, y >> shift) else { return [0; 2] };
        let part = |place: i32| (place & ((1 << shift) - 1)).unsigned_abs();
        let whole = 1_u32 << shift;
        let [a, b, c, d] = heights;
        let full = span(heights).map(|height| placement.scaled(height));
        // At a wall a contact is at its top or at its foot.
        if full[1] - full[0] > WALL << shift {
            return full;
        }
        let between = |from: u32, to: u32, part: u32| from * (whole - part) + to * part;
        let middle = between(between(a, b, part(x)), between(c, d, part(x)), part(y)) >> (2 * shift);
        full.map(|height| (height + placement.scaled(middle)) / 2)
    }

    /// Least and greatest of the cells about a point, for the two finest levels.
    #[inline(always)]
    fn nearby(&self, placement: &Placement, x: i32, y: i32, level: usize) -> [u32; 2] {
        let [half, ..] = placement.half;
        let mut range = [u32::MAX, 0];
        if self.is_fine || level == 1 {
            let (i, j) = self.cell_of(half, x, y);
            // Two cells away where cells are fine, one where they are coarse.
            let step = if self.is_fine { 1 << level } else { 1 };
            let holds = |i: i32, j: i32, by: i32| i >= by && j >= by && i <= 2 * half[0] - by && j <= 2 * half[1] - by;
            if !holds(i, j, -step) {
                return [0; 2];
            }
            let (is_inside, offset) = (holds(i, j, step), at(&placement.offset, 0));
            let mut take = |(u, v): (i32, i32)| {
                // Beside the grid there is the table.
                let is_met = is_inside || holds(i + u, j + v, 0);
                let height = if is_met { self.count(offset.wrapping_add(row(half, i + u, j + v))) } else { 0 };
                range = [range[0].min(height), range[1].max(height)];
            };
            [(0, 0), (0, -step), (-step, 0), (step, 0), (0, step)].into_iter().for_each(&mut take);
            if step == 2 {
                [(-1, -1), (1, -1), (-1, 1), (1, 1)].into_iter().for_each(take);
            }
        } else {
            let shift = self.shift();
            let heights = self.square(placement, (x + (half[0] << shift)) >> shift, (y + (half[1] << shift)) >> shift);
            return heights.map_or([0; 2], span);
        }
        range
    }

    /// Heights of a cell of the finest level and its three neighbors toward larger x and y; none at the edge.
    #[inline(always)]
    fn square(&self, placement: &Placement, i: i32, j: i32) -> Option<[u32; 4]> {
        let [half, ..] = placement.half;
        if i < 0 || j < 0 || i >= 2 * half[0] || j >= 2 * half[1] {
            return None;
        }
        let start = at(&placement.offset, 0).wrapping_add(row(half, i, j));
        let next = start.wrapping_add(row(half, 0, 1));
        Some([start, start.wrapping_add(1), next, next.wrapping_add(1)].map(|place| self.count(place)))
    }

    /// Logarithm to base two of a cell's side, in 1/16 mm.
    #[inline(always)]
    fn shift(&self) -> u32 {
        if self.is_fine { 4 } else { 5 }
    }
}

/// The least and greatest.
#[inline(always)]
fn span(heights: [u32; 4]) -> [u32; 2] {
    heights.into_iter().fold([u32::MAX, 0], |[low, high], height| [low.min(height), high.max(height)])
}

/// Radius beyond which a window is the whole placement, in 1/16 mm.
const WIDEST: i32 = 36 * 16;
/// Sides of a cell that four cells span at a wall.
const WALL: i32 = 4;
/// Radius of a level's window, in 64ths of its size.
const REACH: i32 = 130;

impl Placement {
    /// A height in 1/16 mm.
    #[inline(always)]
    fn scaled(&self, height: u32) -> i32 {
        ((height * self.scale) >> 6).cast_signed()
    }
}

/// Number of cells of a grid.
fn cells([x, y]: [i32; 2]) -> usize {
    usize::try_from((2 * x + 1) * (2 * y + 1)).unwrap_or(0)
}

/// Place of a cell in a grid.
#[inline(always)]
fn row([half_x, _]: [i32; 2], i: i32, j: i32) -> usize {
    usize::try_from(j * (2 * half_x + 1) + i).unwrap_or(usize::MAX)
}
