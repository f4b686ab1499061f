//! Cuts between bins, at weighted quantiles of a column's values.
//!
//! The sketch is XGBoost's of version 3 (`WQuantileSketch`), in the same arithmetic, so that the same rows give the same cuts:
//! values are queued in row order, a full queue becomes a summary, and summaries of one level are merged and pruned into one
//! of the next (Greenwald and Khanna, 2001; Chen and Guestrin, 2016, appendix). Ranks are f32, as there.

/// A value of a summary, with bounds on its rank.
#[derive(Clone, Copy)]
struct Entry {
    /// The least weight of all smaller values.
    low: f32,
    /// The most weight of all values up to this one.
    high: f32,
    /// The weight of the value itself, at least.
    weight: f32,
    value: f32,
}

impl Entry {
    /// The least rank of a larger value.
    fn low_after(self) -> f32 {
        self.low + self.weight
    }

    /// The most rank of a smaller value.
    fn high_before(self) -> f32 {
        self.high - self.weight
    }
}

/// The upper ends of at most `bins` bins, ascending, of `values` in row order with their weights. A bin holds the values below
/// its end that are in no earlier one; the last end is above all values. There is at least one.
pub(super) fn of_column(values: impl Iterator<Item = (f32, f32)> + Clone, bins: usize) -> Vec<f32> {
    let count = values.clone().count();
    let mut sketch = Sketch { size: summary_size(count, bins), queue: Vec::new(), levels: Vec::new() };
    values.for_each(|(value, weight)| sketch.push(value, weight));
    let summary = sketch.summary();
    ends(&summary, summary.len().min(bins))
}

/// The entries of a summary that keep the error of a rank below half a bin over all levels of `count` values.
fn summary_size(count: usize, bins: usize) -> usize {
    if count == 0 {
        return 1;
    }
    let error = 1.0 / bins.min(count) as f64 / 2.0;
    let size = |level: u32| ((f64::from(level) / error).ceil() as usize + 1).min(count);
    let enough = |level: &u32| size(*level) << level >= count;
    // With 2^63 values on the last level there is room for any number.
    size((1..63).find(enough).unwrap_or(63))
}

struct Sketch {
    /// The most entries of a level.
    size: usize,
    /// Values in row order with their weights; equal ones that follow each other are one.
    queue: Vec<(f32, f32)>,
    /// Summaries, each of twice as many values as the one before; some are empty.
    levels: Vec<Vec<Entry>>,
}

impl Sketch {
    fn push(&mut self, value: f32, weight: f32) {
        if let Some(last) = self.queue.last_mut().filter(|last| last.0 == value) {
            last.1 += weight;
            return;
        }
        if self.queue.len() == 2 * self.size {
            self.flush();
        }
        self.queue.push((value, weight));
    }

    /// Makes the queue a summary, and merges it with those of its level.
    fn flush(&mut self) {
        let mut summary = Vec::with_capacity(self.queue.len());
        // The sum of equal values' weights depends on their order, which has to be the same each time, no more.
        self.queue.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut below = 0.0;
        for equal in self.queue.chunk_by(|a, b| a.0 == b.0) {
            let weight = equal[1..].iter().fold(equal[0].1, |sum, (_, weight)| sum + weight);
            summary.push(Entry { low: below, high: below + weight, weight, value: equal[0].0 });
            below += weight;
        }
        self.queue.clear();
        for level in &mut self.levels {
            prune(&mut summary, self.size);
            summary = merged(summary, std::mem::take(level));
            if summary.len() <= self.size {
                *level = summary;
                return;
            }
        }
        prune(&mut summary, self.size);
        self.levels.push(summary);
    }

    /// All values as one summary.
    fn summary(mut self) -> Vec<Entry> {
        self.flush();
        let mut all = Vec::new();
        for level in self.levels {
            all = merged(all, level);
            prune(&mut all, self.size);
        }
        all
    }
}

/// Keeps at most `size` entries, those nearest to evenly spaced ranks.
fn prune(summary: &mut Vec<Entry>, size: usize) {
    if summary.len() <= size {
        return;
    }
    let (Some(first), Some(last), true) = (summary.first().copied(), summary.last().copied(), size > 1) else {
        summary.truncate(size);
        return;
    };
    let (steps, end) = (size - 1, summary.len() - 1);
    let range = last.low - first.high;
    let mut kept = Vec::with_capacity(size);
    kept.push(first);
    let (mut newest, mut index) = (0, 1);
    for step in 1..steps {
        let twice = 2.0 * ((step as f32 * range) / steps as f32 + first.high);
        while index < end && twice >= summary[index + 1].high + summary[index + 1].low {
            index += 1;
        }
        if index == end {
            break;
        }
        let [here, after] = [summary[index], summary[index + 1]];
        let nearest = if twice < here.low_after() + after.high_before() { index } else { index + 1 };
        if nearest != newest {
            kept.push(summary[nearest]);
            newest = nearest;
        }
    }
    if newest != end {
        kept.push(last);
    }
    *summary = kept;
}

/// The summary of what two summaries are of.
fn merged(a: Vec<Entry>, b: Vec<Entry>) -> Vec<Entry> {
    let (Some(last_a), Some(last_b)) = (a.last(), b.last()) else {
        return if a.is_empty() { b } else { a };
    };
    let mut all = Vec::with_capacity(a.len() + b.len());
    let (mut rest_a, mut rest_b) = (a.as_slice(), b.as_slice());
    // The least rank after what was taken last from each.
    let (mut after_a, mut after_b) = (0.0, 0.0);
    while let ([x, next_a @ ..], [y, next_b @ ..]) = (rest_a, rest_b) {
        if x.value == y.value {
            all.push(Entry { low: x.low + y.low, high: x.high + y.high, weight: x.weight + y.weight, value: x.value });
            (after_a, after_b) = (x.low_after(), y.low_after());
            (rest_a, rest_b) = (next_a, next_b);
        } else if x.value < y.value {
            all.push(Entry { low: x.low + after_b, high: x.high + y.high_before(), ..*x });
            (after_a, rest_a) = (x.low_after(), next_a);
        } else {
            all.push(Entry { low: y.low + after_a, high: y.high + x.high_before(), ..*y });
            (after_b, rest_b) = (y.low_after(), next_b);
        }
    }
    all.extend(rest_a.iter().map(|x| Entry { low: x.low + after_b, high: x.high + last_b.high, ..*x }));
    all.extend(rest_b.iter().map(|y| Entry { low: y.low + after_a, high: y.high + last_a.high, ..*y }));
    ascending(&mut all);
    all
}

/// Ranks that rounding put out of order, put right.
fn ascending(summary: &mut [Entry]) {
    let (mut low, mut high) = (0.0, 0.0);
    for entry in summary {
        entry.low = if entry.low < low { low } else { entry.low };
        low = entry.low;
        entry.high = if entry.high < high { high } else { entry.high };
        entry.high = if entry.high < entry.low_after() { entry.low_after() } else { entry.high };
        high = entry.high;
    }
}

/// The ends of `bins` bins. The least value is not one of them.
fn ends(summary: &[Entry], bins: usize) -> Vec<f32> {
    let (Some(first), Some(last)) = (summary.first(), summary.last()) else {
        return vec![1e-5];
    };
    let count = summary.len();
    let mut ends = Vec::with_capacity(bins);
    if count <= bins {
        ends.extend(summary[1..].iter().map(|entry| entry.value));
    } else {
        let (mut newest, mut index, mut next) = (first.value, 0, 1);
        let above = |value: f32, from: usize| from + summary[from..].partition_point(|entry| entry.value <= value);
        for bin in 1..bins {
            let twice = 2.0 * (bin as f64 * f64::from(last.high) / bins as f64);
            while index < count - 2 && twice >= f64::from(summary[index + 1].low + summary[index + 1].high) {
                index += 1;
            }
            let [here, after] = [summary[index], summary[index + 1]];
            let mut end =
                if twice < f64::from(here.low_after() + after.high_before()) { here.value } else { after.value };
            if end <= newest {
                next = above(newest, next);
                let Some(entry) = summary.get(next) else { break };
                end = entry.value;
            } else if next < count {
                next = above(end, next);
            }
            ends.push(end);
            newest = end;
        }
    }
    ends.push(last.value + (last.value.abs() + 1e-5));
    ends
}
