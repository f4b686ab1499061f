//! `shared/FORMAT.md` read by the letter: a recognizer that shares no line with the one that chips run. It trusts its
//! models, and is slow.

/// Decision after a touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Nothing yet.
    Undecided,
    /// An object, and the number of touches.
    Recognized(usize, u32),
    /// The limit was reached.
    GaveUp,
}

struct Axis {
    feature: usize,
    columns: u8,
    thresholds: Vec<i32>,
}

struct Group {
    depth: u32,
    shift: u32,
    object: Option<usize>,
    trees: usize,
}

/// A model, and the state of recognition under it.
pub struct Plain<'a> {
    layout: u8,
    leaf: u8,
    descriptor: u8,
    objects: usize,
    unit_bits: u64,
    unit_shift: u32,
    odds: u64,
    /// Each object's own, if the model has them.
    odds_by_object: Vec<u64>,
    /// One over the temperature in Q16.
    sharpness: u64,
    limit: u32,
    patterns: u8,
    needs_pose: bool,
    largest: u32,
    base: Vec<i32>,
    priors: Vec<i32>,
    axes: Vec<Axis>,
    groups: Vec<Group>,
    thresholds: &'a [u8],
    splits: &'a [u8],
    leaves: &'a [u8],
    /// Bytes of a leaf's number, and the values of all leaves, if the model shares them.
    sentinel: Option<(i32, i32)>,
    shared: Option<(usize, &'a [u8])>,
    /// Weights by the number of touches, and the evidence of a row's margins, if the model has them.
    weights: Vec<u64>,
    row: Option<&'a [u8]>,
    /// The feature that is a row's number, and its step, and the limits of each feature; of the rows of a sequence so far their
    /// number, and each feature's last value with the number of rows that it has been the same.
    position: Option<(usize, i32)>,
    guard: &'a [u8],
    is_real: bool,
    /// Background, hold-off and memory of a stream of events; the class that holds after the rows so far, and the rows until the
    /// next verdict.
    events: Option<(Option<usize>, u32, i64)>,
    ongoing: Option<usize>,
    silent: u32,
    rows: u32,
    same: Vec<(i32, u32)>,
    /// Places where a class may be known: the groups before, and the lead.
    exits: Vec<(usize, i64)>,
    /// For each output the number of its object, if several belong together.
    together: Vec<u8>,
    /// True if the last of several largest margins names the class.
    last_of_ties: bool,
    /// True if the last object is a background.
    background: bool,
    /// For each object.
    pub evidence: Vec<i64>,
    /// Number of touches counted.
    pub touches: u32,
    /// The decision.
    pub decision: Decision,
}

/// A missing feature.
pub const MISSING: i32 = i32::MIN;

/// An approach: contact times, and a pose as direction and alignment.
pub type Approach = ([Option<u32>; 3], Option<[i16; 6]>);

fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte))
}

fn signed(bytes: &[u8]) -> i32 {
    let shift = 32 - 8 * bytes.len() as u32;
    ((number(bytes) as u32) << shift) as i32 >> shift
}

impl<'a> Plain<'a> {
    /// Reads a model.
    ///
    /// # Panics
    /// Anywhere, if the bytes are not a model.
    pub fn new(bytes: &'a [u8]) -> Self {
        let field = |at: usize, length: usize| number(&bytes[at..at + length]);
        let (layout, leaf, descriptor, objects) = (bytes[6], bytes[7], bytes[12], usize::from(bytes[14]) + 1);
        let (axis_count, group_count) = (field(16, 2) as usize, field(18, 2) as usize);
        let mut rest = &bytes[96..];
        let mut part = |length: usize| {
            let (part, after) = rest.split_at(length);
            rest = after;
            part
        };
        part(field(68, 4) as usize);
        let mut optional = part(if field(4, 2) == 2 { field(92, 4) as usize } else { 0 });
        let numbers = |part: &[u8]| part.chunks(4).map(signed).collect::<Vec<i32>>();
        let (base, priors) = (numbers(part(4 * objects)), numbers(part(4 * objects)));
        let axis_bytes = part(4 * axis_count);
        let thresholds = part(field(80, 4) as usize);
        let group_bytes = part(8 * group_count);
        let splits = part(field(84, 4) as usize);
        let leaves = part(field(88, 4) as usize);
        let mut cuts = thresholds;
        let axes = axis_bytes.chunks(4).map(|axis| {
            let (width, count) = (usize::from(axis[2]), usize::from(axis[3]));
            let (own, after) = cuts.split_at(width * count);
            cuts = after;
            Axis { feature: axis[0].into(), columns: axis[1], thresholds: own.chunks(width).map(signed).collect() }
        });
        let axes = axes.collect();
        let groups = group_bytes.chunks(8).map(|group| Group {
            depth: group[0].into(),
            shift: group[1].into(),
            object: (group[2] == 1).then_some(group[3].into()),
            trees: number(&group[4..]) as usize,
        });
        let (mut odds_by_object, mut sharpness, mut shared, mut sentinel) = (Vec::new(), 1 << 16, None, None);
        let (mut weights, mut row) = (Vec::new(), None);
        let (mut exits, mut last_of_ties, mut background) = (Vec::new(), false, false);
        let (mut together, mut position, mut guard): (_, _, &[u8]) = (Vec::new(), None, &[]);
        let features = usize::from(bytes[15]) + 1;
        let mut events = None;
        // What a model without the section touches was trained on.
        let (mut patterns, mut needs_pose, mut largest) = (0b10_0000, matches!(descriptor, 2 | 3 | 5 | 6), u32::MAX);
        while !optional.is_empty() {
            let length = number(&optional[4..8]) as usize;
            let content = &optional[8..][..length];
            match number(&optional[..2]) & 0x7fff {
                2 => (patterns, needs_pose, largest) = (content[0], content[2] == 1, number(&content[4..8]) as u32),
                4 => weights = content[2..][..2 * usize::from(content[0])].chunks(2).map(|w| number(w) + 1).collect(),
                5 => odds_by_object = content[..4 * objects].chunks(4).map(|odds| number(odds) << 24).collect(),
                11 if (1 << 12..=1 << 20).contains(&number(&content[..4])) => sharpness = number(&content[..4]),
                12 => shared = Some((content[0].into(), &content[4..])),
                16 => row = Some(content),
                6 => background = content[0] == 1,
                13 => last_of_ties = content[1] == 1,
                17 => {
                    let exit = |exit: &[u8]| (number(&exit[..2]) as usize, number(&exit[4..]) as i64);
                    exits = content.chunks_exact(8).map(exit).collect();
                }
                18 => together = content[4..][..4 * objects].chunks(4).map(|output| output[0]).collect(),
                21 => position = Some((content[0].into(), signed(&content[4..8]))),
                22 => guard = &content[..12 * features],
                23 => {
                    let background = (content[1] == 1).then_some(content[0].into());
                    events = Some((background, number(&content[4..8]) as u32, signed(&content[8..12]).into()));
                }
                14 => sentinel = Some((signed(&content[..4]), signed(&content[4..8]))),
                _ => {}
            }
            optional = &optional[8 + length.next_multiple_of(4)..];
        }
        let mut plain = Self {
            layout,
            leaf,
            descriptor,
            objects,
            unit_bits: field(36, 4),
            unit_shift: bytes[40].into(),
            odds: field(48, 8),
            odds_by_object,
            sharpness,
            limit: field(56, 4) as u32,
            patterns,
            needs_pose,
            largest,
            base,
            priors,
            axes,
            groups: groups.collect(),
            thresholds,
            splits,
            leaves,
            sentinel,
            shared,
            weights,
            row,
            position,
            guard,
            is_real: bytes[13] == 1,
            events,
            ongoing: None,
            silent: 0,
            rows: 0,
            same: vec![(0, 0); features],
            exits,
            last_of_ties,
            background,
            together,
            evidence: Vec::new(),
            touches: 0,
            decision: Decision::Undecided,
        };
        plain.reset();
        plain
    }

    /// Forgets all touches.
    pub fn reset(&mut self) {
        self.evidence = self.priors.iter().map(|&prior| prior.into()).collect();
        (self.touches, self.decision, self.rows) = (0, Decision::Undecided, 0);
        (self.ongoing, self.silent) = (None, 0);
    }

    /// All features of the next row of a sequence, from those that are measured, or the first one that the guard refuses.
    pub fn next(&mut self, measured: &[i32]) -> Result<Vec<i32>, usize> {
        self.rows += 1;
        let mut features = measured.to_vec();
        if let Some((feature, step)) = self.position {
            features.resize(features.len().max(feature), MISSING);
            let counted = i32::try_from(i64::from(self.rows.min(1 << 24)) * i64::from(step)).unwrap_or(i32::MAX);
            features.insert(feature, if self.is_real { key(self.rows.min(1 << 24) as f32) } else { counted });
        }
        features.resize(self.same.len(), MISSING);
        let mut refused = None;
        for (feature, limits) in self.guard.chunks(12).enumerate() {
            let is_missing = self.sentinel.is_some_and(|(low, high)| (low..=high).contains(&features[feature]));
            let value = if is_missing { MISSING } else { features[feature] };
            let (last, equal) = self.same[feature];
            let equal = if self.rows > 1 && value == last { equal + 1 } else { 1 };
            self.same[feature] = (value, equal);
            let flags = number(&limits[8..]) as u32;
            let fits = match value {
                MISSING => flags >> 31 == 1,
                _ => signed(&limits[..4]) <= value && value <= signed(&limits[4..8]),
            };
            let most = flags & 0x7fff_ffff;
            if !fits || most > 0 && equal > most {
                refused = refused.or(Some(feature));
            }
        }
        refused.map_or(Ok(features), Err)
    }

    /// Another threshold and limit than the model's.
    pub fn stop(&mut self, odds: u64, limit: u32) {
        (self.odds, self.limit) = (odds, limit);
    }

    /// Reason why a touch is not counted.
    pub fn refused(&self, (times, pose): &Approach) -> Option<&'static str> {
        let last = times.iter().flatten().max().copied().unwrap_or(0);
        if self.descriptor == 255 {
            Some("features")
        } else if self.patterns >> pattern(times) & 1 == 0 {
            Some("pattern")
        } else if last > self.largest {
            Some("spread")
        } else if self.needs_pose && pose.is_none() {
            Some("pose")
        } else {
            None
        }
    }

    /// The features of a touch.
    pub fn features(&self, (times, pose): &Approach) -> Vec<i32> {
        let [t1, t2, t3] = times.map(|time| time.map(|time| i64::from(time.min(1 << 28))));
        let clamped = |value: Option<i64>| value.map_or(MISSING, |value| value.clamp(-16_777_215, 16_777_215) as i32);
        if self.descriptor == 0 {
            return [t1, t2, t3].map(clamped).to_vec();
        }
        let curvature = t1.zip(t2).zip(t3).map(|((t1, t2), t3)| t1 - 2 * t2 + t3);
        let slope = t1.zip(t3).map(|(t1, t3)| (t3 - t1).abs());
        let pair = match (t1, t2, t3) {
            (Some(outer), Some(middle), None) | (None, Some(middle), Some(outer)) => Some(middle - outer),
            _ => None,
        };
        let contacts = self.descriptor >= 4;
        let mut features = Vec::new();
        if contacts {
            features.push(i32::from(pattern(times)));
        }
        features.extend([clamped(curvature), clamped(slope)]);
        if contacts {
            features.push(clamped(pair));
        }
        let [x, y, z, u, v, w] = pose.map_or([None; 6], |pose| pose.map(Some));
        // A missing contact is later than any other.
        let late = |time: Option<i64>| time.unwrap_or(i64::MAX);
        let order = if contacts { [w, v, u] } else { [u, v, w] };
        let negative = order.into_iter().flatten().find(|&part| part != 0).is_some_and(|part| part < 0);
        let flip = late(t3) < late(t1) || late(t1) == late(t3) && negative;
        let part = |part: Option<i16>| part.map_or(MISSING, i32::from);
        let turned =
            |number: Option<i16>| part(number.map(|number| if flip { number.saturating_neg() } else { number }));
        match self.descriptor {
            2 | 5 => features.extend([part(z), turned(w)]),
            3 | 6 => features.extend([part(x), part(y), part(z), turned(u), turned(v), turned(w)]),
            _ => {}
        }
        features
    }

    /// The class of a row of features, where integers are added: known as early as the model says.
    pub fn class(&self, features: &[i32]) -> usize {
        let known = self.objects - usize::from(self.background);
        let mut exits = self.exits.iter().peekable();
        let sums = self.sums_until(features, &mut |groups, sums| {
            let Some(&(_, bound)) = exits.next_if(|exit| exit.0 == groups) else { return false };
            let mut sums: Vec<i64> = sums[..known].iter().map(|&sum| sum.into()).collect();
            sums.sort_unstable();
            known == 1 || sums[known - 1] - sums[known - 2] > bound
        });
        let most = sums[..known].iter().max().expect("an object");
        let mut best = (0..known).filter(|&class| sums[class] == *most);
        if self.last_of_ties { best.next_back() } else { best.next() }.expect("it is there")
    }

    /// The sums of a row of features: units, or the bits of f32 numbers.
    pub fn sums(&self, features: &[i32]) -> Vec<i32> {
        self.sums_until(features, &mut |_, _| false)
    }

    /// Sums until `is_known` of the number of groups so far and their sums.
    fn sums_until(&self, features: &[i32], is_known: &mut dyn FnMut(usize, &[i32]) -> bool) -> Vec<i32> {
        let is_missing = |value: i32| self.sentinel.is_some_and(|(low, high)| low <= value && value <= high);
        let feature =
            |index: usize| features.get(index).copied().filter(|value| !is_missing(*value)).unwrap_or(MISSING);
        let mut sums = self.base.clone();
        let mut leaves = self.leaves;
        let size = 1 << self.leaf;
        if matches!(self.layout, 2 | 4) {
            let cell = self.cell(&feature);
            let values = &leaves[cell * self.objects * size..][..self.objects * size];
            return values.chunks(size).map(|value| self.value(value)).collect();
        }
        let mut columns = Vec::new();
        for axis in &self.axes {
            let value = feature(axis.feature);
            let rank = axis.thresholds.iter().filter(|&&threshold| threshold <= value).count() as u8;
            let missing = value == MISSING;
            if axis.columns & 1 != 0 {
                columns.push(if missing { 0 } else { rank });
            }
            if axis.columns & 2 != 0 {
                columns.push(if missing { 255 } else { rank });
            }
        }
        let mut splits = self.splits;
        for (number_of_group, group) in self.groups.iter().enumerate() {
            let length = size * if group.object.is_some() { 1 } else { self.objects };
            for tree in 0..group.trees {
                let (leaf, count) = match self.layout {
                    1 => {
                        let slots = 1 << group.depth;
                        let mut slot = 1;
                        while slot < slots {
                            let at = tree * slots + slot;
                            let right = columns[usize::from(splits[at])] > splits[group.trees * slots + at];
                            slot = 2 * slot + usize::from(right);
                        }
                        (slot - slots, slots)
                    }
                    _ => {
                        let bytes = if self.layout == 0 { 3 } else { 6 };
                        let count = number(&splits[..2]) as usize;
                        let tree = &splits[2..][..count * bytes];
                        splits = &splits[2 + count * bytes..];
                        let (mut at, mut below, mut leaf) = (0, count, 0);
                        while below > 0 {
                            let (right, left) = self.split(&tree[at * bytes..][..bytes], &columns, &feature);
                            if right {
                                (at, leaf, below) = (at + 1 + left, leaf + left + 1, below - left - 1);
                            } else {
                                (at, below) = (at + 1, left);
                            }
                        }
                        (leaf, count + 1)
                    }
                };
                let stored = self.shared.map_or(length, |(width, _)| width);
                let own = &leaves[leaf * stored..][..stored];
                let own = self.shared.map_or(own, |(_, table)| &table[number(own) as usize * length..][..length]);
                let values = own.chunks(size).map(|value| self.value(value));
                for (index, value) in values.enumerate() {
                    let sum = &mut sums[group.object.unwrap_or(index)];
                    *sum = if self.leaf == 2 {
                        (f32::from_bits(*sum as u32) + f32::from_bits(value as u32)).to_bits() as i32
                    } else {
                        *sum + (value << group.shift)
                    };
                }
                leaves = &leaves[count * stored..];
            }
            if self.layout == 1 {
                splits = &splits[(2 * group.trees) << group.depth..];
            }
            if is_known(number_of_group + 1, &sums) {
                break;
            }
        }
        sums
    }

    fn split(&self, split: &[u8], columns: &[u8], feature: &dyn Fn(usize) -> i32) -> (bool, usize) {
        if self.layout == 0 {
            return (columns[usize::from(split[0])] > split[1], split[2].into());
        }
        let value = feature(split[0].into());
        let threshold = signed(&self.thresholds[4 * number(&split[2..4]) as usize..][..4]);
        (if value == MISSING { split[1] == 0 } else { value >= threshold }, number(&split[4..]) as usize)
    }

    /// A leaf's value, or the bits of an f32 number.
    fn value(&self, bytes: &[u8]) -> i32 {
        if self.leaf == 0 { i32::from(bytes[0]) - 128 } else { signed(bytes) }
    }

    fn cell(&self, feature: &dyn Fn(usize) -> i32) -> usize {
        let ranks = self.axes.iter().map(|axis| {
            let (value, count) = (feature(axis.feature), axis.thresholds.len());
            let rank = axis.thresholds.iter().filter(|&&threshold| threshold <= value).count();
            (if self.layout == 2 && value == MISSING { count + 1 } else { rank }, count)
        });
        let ranks: Vec<(usize, usize)> = ranks.collect();
        if self.layout == 2 {
            return ranks[0].0 * (ranks[1].1 + 2) + ranks[1].0;
        }
        let [(p, _), (q, m), (r, l)] = [ranks[0], ranks[1], ranks[2]];
        match feature(0) {
            1 => 1,
            2 => 2,
            3 => 3 + r,
            4 => 4 + l + q,
            5 => 5 + l + m + p * (m + 1) + q,
            _ => 0,
        }
    }

    /// The margins in units, as sums.
    pub fn margins(&self, sums: &[i32]) -> Vec<i32> {
        let q16 = |&bits: &i32| q16(f32::from_bits(bits as u32));
        if self.leaf == 2 { sums.iter().map(q16).collect() } else { sums.to_vec() }
    }

    /// Counts the margins of a touch.
    pub fn count(&mut self, margins: &[i32]) {
        if let Some((background, hold_off, memory)) = self.events {
            let most = *self.evidence.iter().max().expect("an object");
            self.evidence.iter_mut().for_each(|evidence| *evidence = (*evidence - most).max(-memory));
            self.add(margins);
            self.decision = Decision::Undecided;
            self.silent = self.silent.saturating_sub(1);
            let leader = self.leader();
            let is_sure = self.rivals(1 << 16) <= self.odds_of(leader).into();
            let (is_other, is_background) = (self.ongoing != Some(leader), background == Some(leader));
            if is_sure && is_other && (is_background || self.silent == 0) {
                self.ongoing = Some(leader);
                if !is_background {
                    (self.silent, self.decision) = (hold_off, Decision::Recognized(leader, self.touches));
                }
            }
            return;
        }
        if self.decision != Decision::Undecided {
            return;
        }
        self.add(margins);
        let (leader, rivals) =
            if self.together.is_empty() { (self.leader(), Some(self.rivals(1 << 16))) } else { self.leading() };
        if rivals.is_some_and(|rivals| rivals <= u128::from(self.odds_of(leader))) {
            self.decision = Decision::Recognized(leader, self.touches);
        } else if self.touches >= self.limit {
            self.decision = Decision::GaveUp;
        }
    }

    /// Adds the margins of a touch, or their evidence.
    fn add(&mut self, margins: &[i32]) {
        for (evidence, &margin) in self.evidence.iter_mut().zip(margins) {
            let margin = self.row.map_or(margin, |table| of_row(table, margin));
            *evidence = evidence.saturating_add(margin.into());
        }
        self.touches += 1;
    }

    fn odds_of(&self, object: usize) -> u64 {
        self.odds_by_object.get(object).copied().unwrap_or(self.odds)
    }

    /// The object with the most evidence.
    pub fn leader(&self) -> usize {
        let most = self.evidence.iter().max().expect("an object");
        self.evidence.iter().position(|evidence| evidence == most).expect("it is there")
    }

    fn weight(&self, object: usize, sharpness: u64) -> u64 {
        let behind = self.evidence[self.leader()].abs_diff(self.evidence[object]);
        if behind > u32::MAX.into() {
            return 0;
        }
        let bits = self.unit_bits;
        let bits = if self.weights.is_empty() { bits } else { (bits * self.factor()) >> 16 };
        let u = (u128::from(behind) * u128::from(bits)) >> self.unit_shift;
        exp2(if sharpness == 1 << 16 { u as u64 } else { ((u.min(1 << 42) * u128::from(sharpness)) >> 16) as u64 })
    }

    /// The weight of the evidence so far, in Q16.
    fn factor(&self) -> u64 {
        let doublings = self.touches.max(1).ilog2();
        let half = if doublings == 0 { 0 } else { self.touches >> (doublings - 1) & 1 };
        let at = (2 * doublings + half) as usize;
        self.weights[at.min(self.weights.len() - 1)]
    }

    /// Sum of the weights of all objects but the leader.
    fn rivals(&self, sharpness: u64) -> u128 {
        let leader = self.leader();
        let others = (0..self.objects).filter(|&object| object != leader);
        others.map(|object| u128::from(self.weight(object, sharpness))).sum()
    }

    /// The sums of the weights of objects with several outputs, held within 64 bits.
    fn sums_together(&self, sharpness: u64) -> Vec<u64> {
        let mut sums = vec![0_u64; 256];
        for (output, &object) in self.together.iter().enumerate() {
            let sum = &mut sums[usize::from(object)];
            *sum = sum.saturating_add(self.weight(output, sharpness));
        }
        sums
    }

    /// The output that stands for the leader where several belong together, and the weight of its rivals in Q56; none where
    /// nothing is recognized. Without backgrounds.
    fn leading(&self) -> (usize, Option<u128>) {
        let sums = self.sums_together(1 << 16);
        let own = *sums.iter().max().expect("an object");
        let object = sums.iter().position(|&sum| sum == own).expect("it is there");
        let outputs = || (0..self.objects).filter(|&output| usize::from(self.together[output]) == object);
        let most = outputs().map(|output| self.evidence[output]).max().expect("an output");
        let output = outputs().find(|&output| self.evidence[output] == most).expect("it is there");
        let others = sums.iter().enumerate().filter(|other| other.0 != object);
        let others = others.fold(0_u64, |all, other| all.saturating_add(*other.1));
        let rivals = |own: u64| {
            let whole = u128::from(others / own).min(255) << 56;
            let down = (u128::from(others % own) << 56) / u128::from(own);
            whole + down + u128::from(!others.is_multiple_of(own))
        };
        (output, (own > 0).then(|| rivals(own).min(u64::MAX.into())))
    }

    /// The posterior of an output's object, and the output's share of it, in Q56.
    pub fn posterior_together(&self, output: usize) -> (u64, u64) {
        let ratio =
            |part: u64, whole: u64| if whole == 0 { 0 } else { ((u128::from(part) << 56) / u128::from(whole)) as u64 };
        let sums = self.sums_together(self.sharpness);
        let object = sums[usize::from(self.together[output])];
        let all = sums.iter().fold(0_u64, |all, &sum| all.saturating_add(sum));
        let rest = all - object;
        let posterior = if rest < object { (1 << 56) - ratio(rest, all) } else { ratio(object, all) };
        (posterior, ratio(self.weight(output, self.sharpness), object))
    }

    /// An object's posterior in Q56.
    pub fn posterior(&self, object: usize) -> u64 {
        let (one, rivals) = (1_u128 << 56, self.rivals(self.sharpness));
        // Of 256 objects level with each other all but 2^-64 counts.
        let whole = (one + rivals).min(u64::MAX.into());
        let part = if object == self.leader() { rivals } else { u128::from(self.weight(object, self.sharpness)) };
        let ratio = ((part << 56) / whole) as u64;
        if object == self.leader() { (1 << 56) - ratio } else { ratio }
    }
}

/// Evidence of a margin of a row, by a table.
fn of_row(table: &[u8], margin: i32) -> i32 {
    let (start, [p, q, v, last]) = (signed(&table[..4]), [4, 5, 6, 7].map(|at| u64::from(table[at])));
    let value = |at: u64| u64::from(table[8 + at as usize]);
    let beyond = ((i64::from(margin) - i64::from(start)).max(0) as u64 >> p).min((last << q) - 1);
    let (at, rest) = (beyond >> q, beyond % (1 << q));
    let found = (value(at) << q) + (value(at + 1) - value(at)) * rest;
    (found << v) as i32
}

/// The pattern's code.
fn pattern(times: &[Option<u32>; 3]) -> u8 {
    match times.map(|time| time.is_some()) {
        [false, false, false] => 0,
        [true, false, false] | [false, false, true] => 1,
        [false, true, false] => 2,
        [true, true, false] | [false, true, true] => 3,
        [true, false, true] => 4,
        [true, true, true] => 5,
    }
}

/// An f32 number in units of 2^-16.
pub fn q16(value: f32) -> i32 {
    let limit = f64::from(1 << 30);
    if value.is_nan() { 0 } else { (f64::from(value) * 65_536.0).round().clamp(-limit, limit) as i32 }
}

/// The key of an f32 number.
pub fn key(value: f32) -> i32 {
    let magnitude = (value.to_bits() & 0x7fff_ffff) as i32;
    if value.is_nan() {
        MISSING
    } else if value.is_sign_negative() {
        -magnitude
    } else {
        magnitude
    }
}

/// 2^-u in Q56, u in Q32.
pub fn exp2(u: u64) -> u64 {
    const T: [u64; 16] = [
        2_147_483_648,
        2_056_437_387,
        1_969_251_188,
        1_885_761_398,
        1_805_811_301,
        1_729_250_827,
        1_655_936_265,
        1_585_730_000,
        1_518_500_250,
        1_454_120_821,
        1_392_470_869,
        1_333_434_672,
        1_276_901_417,
        1_222_764_986,
        1_170_923_762,
        1_121_280_436,
    ];
    if u >> 32 > 57 {
        return 0;
    }
    let times = |a: u64, b: u64| (a * b) >> 32;
    let f = u & 0xffff_ffff;
    let (x, i) = (f << 4 & 0xffff_ffff, f >> 28);
    let s = 186_065_157 - times(x, 4_029_616 - times(x, 56_985));
    let p = T[i as usize] - times(T[i as usize], times(x, s));
    (p << 25) >> (u >> 32)
}
