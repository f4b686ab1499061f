//! A reader of compiled models written from `shared/FORMAT.md` alone: it shares nothing with the compiler, nor with what
//! the chip runs, so that a mistake of either shows.

use super::boxes::{Keys, Rule, Step, Tree, Values, no_model};
use crate::error::{Error, Result};

/// A model's meaning.
#[derive(Debug)]
pub(super) struct Plain {
    pub(super) names: Vec<String>,
    pub(super) features: usize,
    /// Code of the descriptor; 255 for rows of features.
    pub(super) descriptor: u8,
    pub(super) keys: Keys,
    /// Names of features, where the model has them.
    pub(super) feature_names: Vec<String>,
    /// Keys that count as missing.
    pub(super) sentinel: Option<[i64; 2]>,
    /// Size of a unit in the library's margins, and of a margin of the trees: of outputs with a scale of their own in those of
    /// the output with the largest.
    pub(super) unit: f64,
    pub(super) scale: f64,
    /// The scale and the offset of each output, where they are stated.
    pub(super) scales: Vec<[f64; 2]>,
    /// Code of the link, true if the last of several equal classes is predicted, and the divisor of a margin before the link.
    pub(super) link: (u8, bool, u32),
    /// True if outputs are targets, and none is a class.
    pub(super) targets: bool,
    /// The largest whole number of a leaf; 0 for f32 leaves.
    pub(super) most: f64,
    /// The farthest that a margin can be from the library's, as the model states.
    pub(super) stated: f64,
    /// Base margins.
    pub(super) base: Vec<f64>,
    /// Trees, and the size of a step of their leaves.
    pub(super) trees: Vec<(Tree, f64)>,
}

struct Axis {
    feature: usize,
    columns: u8,
    cuts: Vec<i64>,
}

fn too_short() -> Error {
    no_model("it ends too early")
}

/// Bytes that are read from the front.
struct Bytes<'b>(&'b [u8]);

impl<'b> Bytes<'b> {
    fn take(&mut self, length: usize) -> Result<&'b [u8]> {
        let (part, rest) = self.0.split_at_checked(length).ok_or_else(too_short)?;
        self.0 = rest;
        Ok(part)
    }

    fn byte(&mut self) -> Result<u8> {
        Ok(self.take(1)?[0])
    }

    fn number(&mut self, length: usize) -> Result<usize> {
        Ok(self.take(length)?.iter().rev().fold(0, |number, &byte| number << 8 | usize::from(byte)))
    }

    fn signed(&mut self, length: usize) -> Result<i64> {
        let number = self.number(length)? as i64;
        let half = 1_i64 << (8 * length - 1);
        Ok(if number >= half { number - 2 * half } else { number })
    }

    fn float(&mut self) -> Result<f32> {
        Ok(f32::from_bits(self.number(4)? as u32))
    }

    fn text(&mut self) -> Result<String> {
        let length = usize::from(self.byte()?);
        Ok(String::from_utf8_lossy(self.take(length)?).into_owned())
    }
}

/// Leaves: their type, unit and table.
struct Leaves<'b> {
    kind: u8,
    unit: f64,
    /// Bytes of a leaf's number, and the values of all leaves.
    shared: Option<(usize, &'b [u8])>,
}

impl Leaves<'_> {
    /// Values of the next leaf, of `count` values.
    fn next(&self, bytes: &mut Bytes<'_>, count: usize, shift: u32) -> Result<Vec<f64>> {
        let size = 1 << self.kind;
        let values = match self.shared {
            None => bytes.take(count * size)?,
            Some((width, table)) => {
                let start = bytes.number(width)? * count * size;
                table.get(start..start + count * size).ok_or_else(too_short)?
            }
        };
        let mut values = Bytes(values);
        let value = |_| -> Result<f64> {
            Ok(match self.kind {
                0 => (f64::from(values.byte()?) - 128.0) * f64::from(shift).exp2() * self.unit,
                1 => values.signed(2)? as f64 * f64::from(shift).exp2() * self.unit,
                _ => f64::from(values.float()?) * self.unit,
            })
        };
        (0..count).map(value).collect()
    }
}

impl Plain {
    /// The values without those at their ends that stand for a missing one, unless that is all of them.
    pub(super) fn known(&self, values: Values) -> Values {
        let Some([low, high]) = self.sentinel.filter(|_| !self.is_sentinel(&values)) else { return values };
        let is_within = |key: i64| (low..=high).contains(&key);
        Values {
            low: if is_within(values.low) { high + 1 } else { values.low },
            high: if is_within(values.high) { low - 1 } else { values.high },
            ..values
        }
    }

    /// True if all of these values stand for a missing one, so that no tree gets them.
    pub(super) fn is_sentinel(&self, values: &Values) -> bool {
        let within = |[low, high]: [i64; 2]| low <= values.low && values.low <= values.high && values.high <= high;
        !values.missing && self.sentinel.is_some_and(within)
    }

    /// Size of a unit that leaves were rounded to; 0 for f32 leaves.
    pub(super) fn rounded_to(&self) -> f64 {
        if self.most > 0.0 { self.unit } else { 0.0 }
    }

    /// Size of a step of a tree whose largest value is this: units doubled until it fits a leaf; 0 for f32 leaves.
    pub(super) fn step_for(&self, largest: f64) -> f64 {
        let mut step = self.rounded_to();
        while step > 0.0 && largest > self.most * step * (1.0 + 1e-12) {
            step *= 2.0;
        }
        step
    }

    /// The whole numbers of steps that a value may be rounded to.
    pub(super) fn steps(&self, value: f64, step: f64) -> [f64; 2] {
        if step > 0.0 { steps(value, step) } else { [0.0; 2] }
    }
}

/// The whole numbers of steps that a value may be rounded to: two for halves.
pub(super) fn steps(value: f64, step: f64) -> [f64; 2] {
    [-1e-6, 1e-6].map(|slack| (value / step + slack).round())
}

/// Optional sections that change what margins are.
struct Stated<'b> {
    shared: Option<(usize, &'b [u8])>,
    sentinel: Option<[i64; 2]>,
    scale: f64,
    outputs: Vec<[f64; 2]>,
    link: (u8, bool, u32),
    targets: bool,
    scales: Vec<f32>,
    feature_names: Vec<String>,
}

impl<'b> Stated<'b> {
    fn read(mut sections: Bytes<'b>, features: usize, outputs: usize) -> Result<Self> {
        let mut stated = Self {
            shared: None,
            sentinel: None,
            scale: 1.0,
            outputs: Vec::new(),
            link: (0, false, 1),
            targets: false,
            scales: vec![1.0; features],
            feature_names: Vec::new(),
        };
        while !sections.0.is_empty() {
            let tag = sections.number(2)? & 0x7fff;
            sections.take(2)?;
            let length = sections.number(4)?;
            let mut content = Bytes(sections.take(length)?);
            sections.take(length.next_multiple_of(4) - length)?;
            match tag {
                8 => {
                    for own in &mut stated.scales {
                        *own = content.float()?;
                        stated.feature_names.push(content.text()?);
                    }
                }
                12 => {
                    let width = usize::from(content.byte()?);
                    content.take(3)?;
                    stated.shared = Some((width, content.0));
                }
                13 => {
                    let (link, is_last) = (content.byte()?, content.byte()? == 1);
                    stated.targets = content.byte()? == 1;
                    content.take(1)?;
                    stated.scale = f64::from(content.float()?);
                    let average = if link >= 128 { content.number(4)? as u32 } else { 1 };
                    stated.link = (link & 63, is_last, average);
                    for _ in 0..if link & 64 == 0 { 0 } else { outputs } {
                        stated.outputs.push([content.float()?.into(), content.float()?.into()]);
                    }
                }
                14 => stated.sentinel = Some([content.signed(4)?, content.signed(4)?]),
                _ => {}
            }
        }
        Ok(stated)
    }
}

/// Reads a model.
///
/// # Errors
/// If a section ends too early, or points out of the model.
pub(super) fn read(bytes: &[u8]) -> Result<Plain> {
    let mut header = Bytes(bytes);
    header.take(4)?;
    if header.number(2)? != 3 {
        return Err(no_model("another version"));
    }
    let (layout, kind) = (header.byte()?, header.byte()?);
    header.take(4)?;
    let (descriptor, key) = (header.byte()?, header.byte()?);
    let (objects, features) = (header.number(1)? + 1, header.number(1)? + 1);
    let (axis_count, group_count) = (header.number(2)?, header.number(2)?);
    header.take(12)?;
    let unit = f64::from(header.float()?);
    let (unit_bits, unit_shift) = (header.number(4)? as f64, f64::from(header.byte()?));
    header.take(3)?;
    if (unit * std::f64::consts::LOG2_E * (32.0 + unit_shift).exp2() - unit_bits).abs() > 1.0 {
        return Err(no_model("its unit in nats is not its unit in bits"));
    }
    let error = f64::from(header.float()?);
    header.take(20)?;
    let text_length = header.number(4)?;
    header.take(8)?;
    let (cuts_length, splits_length, leaves_length) = (header.number(4)?, header.number(4)?, header.number(4)?);
    let sections_length = header.number(4)?;
    let mut rest = header;
    let mut text = Bytes(rest.take(text_length)?);
    text.text()?;
    // A name is empty where the text ends too early.
    let names = (0..objects).map(|_| text.text().unwrap_or_default()).collect();
    let Stated { shared, sentinel, scale, outputs, link, targets, scales, feature_names } =
        Stated::read(Bytes(rest.take(sections_length)?), features, objects)?;
    let is_f32 = kind == 2;
    let leaves_of = Leaves { kind, unit: if is_f32 { scale } else { unit * scale }, shared };
    let base: Result<Vec<f64>> = (0..objects)
        .map(|_| match is_f32 {
            true => Ok(f64::from(rest.float()?) * scale),
            false => Ok(rest.signed(4)? as f64 * unit * scale),
        })
        .collect();
    let base = base?;
    rest.take(4 * objects)?;
    let mut axis_bytes = Bytes(rest.take(4 * axis_count)?);
    let cuts_bytes = rest.take(cuts_length)?;
    let group_bytes = Bytes(rest.take(8 * group_count)?);
    let splits = Bytes(rest.take(splits_length)?);
    let leaves = Bytes(rest.take(leaves_length)?);
    if rest.0.len() != 4 {
        return Err(no_model("sections of other lengths than it states"));
    }
    let mut cuts = Bytes(cuts_bytes);
    let axis = |_| -> Result<Axis> {
        let (feature, columns) = (axis_bytes.number(1)?, axis_bytes.byte()?);
        let (width, count) = (axis_bytes.number(1)?, axis_bytes.number(1)?);
        if !(1..=4).contains(&width) {
            return Err(no_model("thresholds of no width"));
        }
        let cuts: Result<Vec<i64>> = (0..count).map(|_| cuts.signed(width)).collect();
        Ok(Axis { feature, columns, cuts: cuts? })
    };
    let axes: Result<Vec<Axis>> = (0..axis_count).map(axis).collect();
    let axes = axes?;
    let keys = match key {
        1 => Keys::Real,
        _ if descriptor == 255 => Keys::Scaled(scales),
        _ => Keys::Whole,
    };
    let parts = Parts { is_wide: layout == 1, objects, groups: group_count, cuts: cuts_bytes, leaves_of };
    let trees = parts.trees(&axes, group_bytes, splits, leaves)?;
    Ok(Plain {
        names,
        features,
        descriptor,
        keys,
        feature_names,
        sentinel,
        unit: unit * scale,
        scale,
        scales: outputs,
        link,
        targets,
        most: [127.0, 32767.0, 0.0].get(usize::from(kind)).copied().unwrap_or(0.0),
        stated: error * scale,
        base,
        trees,
    })
}

/// Facts that trees are read with.
struct Parts<'b> {
    is_wide: bool,
    objects: usize,
    groups: usize,
    cuts: &'b [u8],
    leaves_of: Leaves<'b>,
}

impl Parts<'_> {
    /// The trees, each with the size of a step of its leaves.
    fn trees(
        &self,
        axes: &[Axis],
        mut group_bytes: Bytes<'_>,
        mut splits: Bytes<'_>,
        mut leaves: Bytes<'_>,
    ) -> Result<Vec<(Tree, f64)>> {
        let mut trees = Vec::new();
        let columns: Vec<(&Axis, bool)> = axes
            .iter()
            .flat_map(|axis| [(1, true), (2, false)].map(|(bit, left)| (axis, bit, left)))
            .filter(|(axis, bit, _)| axis.columns & bit != 0)
            .map(|(axis, _, left)| (axis, left))
            .collect();
        let ranked = |column: usize, at: usize| match columns.get(column) {
            None => Rule::EITHER,
            Some((axis, missing_left)) => {
                let cut = axis.cuts.get(at).copied().unwrap_or(i64::MAX);
                Rule { feature: axis.feature, cut, missing_left: *missing_left || at >= 255 }
            }
        };
        for _ in 0..self.groups {
            group_bytes.byte()?;
            let shift = u32::from(group_bytes.byte()?);
            let (is_one, object) = (group_bytes.byte()? == 1, group_bytes.number(1)?);
            let (object, values) = if is_one { (Some(object), 1) } else { (None, self.objects) };
            let count = group_bytes.number(4)?;
            let step = if self.leaves_of.kind == 2 { 0.0 } else { self.leaves_of.unit * f64::from(shift).exp2() };
            for _ in 0..count {
                let nodes = preorder(&mut splits, self.is_wide, self.cuts, &ranked)?;
                let mut nodes: Vec<Step> = nodes.into_iter().map(|(rule, to)| Step::Split(rule, to)).collect();
                for _ in 0..=nodes.len() {
                    nodes.push(Step::Leaf(self.leaves_of.next(&mut leaves, values, shift)?));
                }
                trees.push((Tree::new(nodes, object)?, step));
            }
        }
        Ok(trees)
    }
}

type Split = (Rule, [usize; 2]);

/// Splits of the next tree in preorder; children that are leaves have numbers from the number of splits on.
fn preorder(
    splits: &mut Bytes<'_>,
    is_wide: bool,
    cuts: &[u8],
    ranked: &dyn Fn(usize, usize) -> Rule,
) -> Result<Vec<Split>> {
    let count = splits.number(2)?;
    let mut read = Vec::with_capacity(count);
    for _ in 0..count {
        read.push(if is_wide {
            let (feature, missing) = (splits.number(1)?, splits.byte()?);
            let number = splits.number(2)?;
            let cut = Bytes(cuts.get(4 * number..).ok_or_else(too_short)?).signed(4)?;
            (Rule { feature, cut, missing_left: missing != 0 }, splits.number(2)?)
        } else {
            let (column, at) = (splits.number(1)?, splits.number(1)?);
            (ranked(column, at), splits.number(1)?)
        });
    }
    // Each subtree: its first split, its number of splits, its first leaf.
    let mut nodes: Vec<Option<Split>> = vec![None; count];
    let mut open = vec![[0, count, 0]];
    while let Some([at, below, leaf]) = open.pop() {
        if below == 0 {
            continue;
        }
        let &(rule, left) = read.get(at).ok_or_else(too_short)?;
        let right = below.checked_sub(left + 1).ok_or_else(|| no_model("a subtree beyond its tree"))?;
        let number = |at, below, leaf| if below == 0 { count + leaf } else { at };
        let parts = [[at + 1, left, leaf], [at + 1 + left, right, leaf + left + 1]];
        nodes[at] = Some((rule, parts.map(|[at, below, leaf]| number(at, below, leaf))));
        open.extend(parts);
    }
    nodes.into_iter().collect::<Option<Vec<_>>>().ok_or_else(too_short)
}
