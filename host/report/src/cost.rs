//! Speed against error: a family of compiled models, what each costs, and how good it is.

use super::context::Context;
use super::instructions::Instructions;
use super::limit::Large;
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Shape, Stroke};
use crate::page::color;
use crate::page::document::{Figure, Section};
use palpate::compile::{self, Leaf};
use palpate::ensemble::{Ensemble, OverTouches};
use palpate::error::Result;
use palpate::evaluate::{Margins, parity};
use palpate::results::{Results, Value};
use palpate::wording::count;
use palpate::{row, with};
use palpate_onboard::Model;
use palpate_shared::Touch;
use std::time::Instant;

/// One compiled model.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Member {
    /// Name of the trained model.
    pub(super) name: String,
    /// True if it is the paper's method.
    pub(super) paper: bool,
    /// Type that leaves are stored as.
    pub(super) leaf: String,
    /// Size.
    pub(super) bytes: usize,
    /// Trees as C code, if their leaves are integers.
    pub(super) code: Option<Code>,
    /// Nanoseconds per touch on this machine.
    pub(super) nanoseconds: f64,
    /// Instructions per touch on the chips.
    pub(super) instructions: Instructions,
    /// The largest difference to the ensemble's margins over the test touches, in nats.
    pub(super) margin_error: f64,
    /// Error that the model states.
    pub(super) stated_error: f64,
    /// Accuracy after ten touches.
    pub(super) at_10: f64,
    /// Accuracy after thirty.
    pub(super) at_30: f64,
    /// Touches of a fixed number from which on errors stay at or below 1 %.
    pub(super) to_1_percent: Option<usize>,
}

/// Estimates of trees as C code on a Cortex-M4F.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Code {
    /// Bytes of flash.
    pub(super) bytes: usize,
    /// Instructions per touch.
    pub(super) instructions: u64,
}

/// Trees, depth and bins of the family.
const FAMILY: [(usize, usize, usize); 8] =
    [(120, 6, 256), (60, 6, 256), (40, 5, 256), (30, 5, 64), (30, 4, 64), (20, 4, 32), (12, 4, 32), (8, 3, 16)];

/// Trains, compiles and measures the family.
pub(super) fn measure(context: &Context, large: &Large) -> Result<Vec<Member>> {
    let first = context.first()?;
    let touches: Vec<Touch> =
        first.test.objects.iter().flat_map(|object| object.touches().iter().take(1_000)).copied().collect();
    let mut members = Vec::new();
    let mut add = |name: &str, ensemble: &Ensemble, leaves: &[Leaf]| -> Result<()> {
        for &leaf in leaves {
            context.check()?;
            let compiled = compile::compile(ensemble, &with!(compile::Settings::default(), leaf))?;
            members.push(member(context, large, &touches, name, ensemble, leaf, &compiled)?);
        }
        Ok(())
    };
    let models = context.models()?;
    let name = format!("paper's method, {} trees", models.paper.trees.len());
    add(&name, &models.paper, &[Leaf::I16, Leaf::F32])?;
    for (rounds, depth, bins) in FAMILY {
        let mut family = with!(context.ours(), rounds, depth, bins);
        if rounds < 30 {
            // Few trees have to learn faster.
            family.eta = 0.6;
        }
        let ensemble = context.train(&first.train, &family)?;
        let name = format!("{rounds} trees, depth {depth}, {bins} bins");
        add(&name, &ensemble, &[Leaf::I8, Leaf::I16, Leaf::F32])?;
    }
    Ok(members)
}

fn member(
    context: &Context,
    large: &Large,
    touches: &[Touch],
    name: &str,
    ensemble: &Ensemble,
    leaf: Leaf,
    compiled: &compile::Compiled,
) -> Result<Member> {
    let settings = context.settings;
    let code = match leaf {
        Leaf::F32 => None,
        _ => {
            let written = compile::compile(ensemble, &with!(compile::Settings::default(), leaf, code = true))?;
            let instructions = written.instructions.m4f;
            written.code.map(|program| Code { bytes: program.flash(), instructions })
        }
    };
    let model = compile::open(&compiled.bytes)?;
    let margins = Margins::new(&model, &large.test)?;
    let groups = settings.cost_groups;
    let all: Vec<&Touch> = touches.iter().collect();
    let curve = margins.curve(100.min(margins.fewest_touches()), groups, settings.seed)?;
    Ok(Member {
        name: name.into(),
        paper: ensemble.descriptor() == Some(palpate_shared::Descriptor::Times),
        leaf: leaf.name().into(),
        bytes: compiled.bytes.len(),
        code,
        nanoseconds: nanoseconds(&model, touches),
        instructions: Instructions::new(compiled, touches)?,
        margin_error: parity::difference(ensemble, &model, &all, &())?.max_margin_error,
        stated_error: f64::from(compiled.margin_error),
        at_10: curve.accuracy(10).value,
        at_30: curve.accuracy(30).value,
        to_1_percent: curve.touches_to_error(0.01),
    })
}

/// The least of five means over all touches, on one thread.
fn nanoseconds(model: &Model<'_>, touches: &[Touch]) -> f64 {
    let mut margins = vec![0; model.object_count()];
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let began = Instant::now();
        for touch in touches {
            std::hint::black_box(model.margins(std::hint::black_box(touch), &mut margins));
        }
        best = best.min(began.elapsed().as_secs_f64() * 1e9 / touches.len().max(1) as f64);
    }
    best
}

/// The members that no other beats in both bytes and accuracy, by rising size.
fn frontier(members: &[Member]) -> Vec<&Member> {
    let mut by_size: Vec<&Member> = members.iter().collect();
    by_size.sort_by_key(|member| member.bytes);
    let mut best = f64::NEG_INFINITY;
    by_size.retain(|member| {
        let better = member.at_10 > best;
        best = best.max(member.at_10);
        better
    });
    by_size
}

/// The figure and the table.
pub(super) fn section(members: &[Member]) -> Result<Section> {
    let mut section = Section::new("cost", "Speed against error");
    section.text(format!(
        "A family of models, trained on the first fold and tested on the large capture. Nanoseconds are of this machine, \
         one thread. {}",
        members.first().map_or_else(String::new, |member| member.instructions.explanation())
    ));
    section.figure(figure(members, "cost-bytes", "bytes", |member| member.bytes as f64)?);
    section.figure(figure(members, "cost-time", "nanoseconds per touch, this machine", |member| member.nanoseconds)?);
    let unit = format!("instructions per touch, Cortex-M4F ({})", sources(members)[0]);
    section.figure(figure(members, "cost-work", &unit, |member| member.instructions.m4f.number as f64)?);
    section.figure(table(members));
    Ok(section)
}

fn figure(members: &[Member], id: &str, unit: &str, cost: impl Fn(&Member) -> f64) -> Result<Figure> {
    let all = || members.iter().map(&cost);
    let low = members.iter().map(|member| member.at_10).fold(1.0, f64::min);
    let high = members.iter().map(|member| member.at_10).fold(0.0, f64::max);
    let x = Axis::logarithmic(all().fold(f64::INFINITY, f64::min) * 0.7, all().fold(0.0, f64::max) * 1.6);
    let y = Axis::percent((low * 20.0).floor() / 20.0, (((high + 0.02) * 20.0).ceil() / 20.0).min(1.0));
    let mut chart = Chart::new(unit, x, "accuracy after 10 touches", y).sized(660, 400);
    let mut data = Results::new(["model", "leaf", unit, "accuracy after 10 touches"]);
    let mut by_cost: Vec<&Member> = members.iter().collect();
    by_cost.sort_by(|a, b| cost(a).total_cmp(&cost(b)));
    let mut best = f64::NEG_INFINITY;
    let mut steps = Vec::new();
    for member in &by_cost {
        if member.at_10 > best {
            if let Some(&(_, y)) = steps.last() {
                steps.push((cost(member), y));
            }
            steps.push((cost(member), member.at_10));
            best = member.at_10;
        }
    }
    steps.push((all().fold(0.0, f64::max), best));
    chart.marks.push(Mark::Line { points: steps.clone(), color: color::GRAY, stroke: Stroke::Dashed });
    let (paper, ours) = ((color::PAPER, Shape::Ring), (color::OURS, Shape::Disc));
    for (name, (color, shape)) in [("the paper's method", paper), ("ours", ours)] {
        chart.legend(name, color, None, Some(shape));
    }
    chart.legend("the frontier", color::GRAY, Some(Stroke::Dashed), None);
    let mut named: Vec<String> = Vec::new();
    for member in &by_cost {
        let at = (cost(member), member.at_10);
        let (color, shape) = if member.paper { paper } else { ours };
        chart.marks.push(Mark::Dots { points: vec![at], color, shape });
        let text = if member.paper {
            member.leaf.clone()
        } else {
            // Types of leaves hardly differ, so they share the note.
            member.name.split(',').next().unwrap_or_default().to_owned()
        };
        if !named.contains(&text) {
            chart.marks.push(Mark::Note { at, text: text.clone(), color });
            named.push(text);
        }
        data.push(row![&member.name, &member.leaf, Value::Number(at.0, 1), Value::Percent(at.1, 2)]);
    }
    let caption = "Dashed: the frontier, the best accuracy up to each cost. Points are named where there is room; the table below \
                   has all of them.";
    Ok(Figure::new(id, format!("Accuracy against {unit}"), caption, data).drawn(vec![chart.svg()?]))
}

/// Sources of the instructions on a Cortex-M4F and on a Cortex-M0+.
fn sources(members: &[Member]) -> [&'static str; 2] {
    members.first().map_or(["estimated"; 2], |member| {
        [member.instructions.m4f, member.instructions.m0_plus].map(|count| count.source())
    })
}

fn table(members: &[Member]) -> Figure {
    let [m4f, m0_plus] = sources(members);
    let chips = [("M4F", m4f), ("M0+", m0_plus)].map(|(chip, source)| format!("instructions, {chip} ({source})"));
    let mut data = Results::new([
        "model",
        "frontier",
        "leaf",
        "bytes",
        "ns per touch",
        &chips[0],
        &chips[1],
        "bytes as C code, M4F (estimated)",
        "instructions as C code, M4F (estimated)",
        "largest margin error (nats)",
        "stated bound (nats)",
        "accuracy at 10",
        "accuracy at 30",
        "touches to 1 %",
    ]);
    let best = frontier(members);
    for member in members {
        let on = best.iter().any(|other| std::ptr::eq(*other, member));
        data.push(row![
            &member.name,
            if on { "yes" } else { "" },
            &member.leaf,
            member.bytes,
            Value::Number(member.nanoseconds, 0),
            member.instructions.m4f.number,
            member.instructions.m0_plus.number,
            member.code.map(|code| code.bytes),
            member.code.map(|code| code.instructions),
            Value::Number(member.margin_error, 5),
            Value::Number(member.stated_error, 5),
            Value::Percent(member.at_10, 1),
            Value::Percent(member.at_30, 1),
            member.to_1_percent,
        ]);
    }
    let smallest = best.first().map(|member| format!("; the smallest model on it has {} bytes", count(member.bytes)));
    let caption = format!("The frontier is of bytes and accuracy after ten touches{}.", smallest.unwrap_or_default());
    Figure::new("cost", "The family", caption, data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instructions::Count;

    #[test]
    fn the_frontier_holds_what_nothing_smaller_beats() {
        let member = |bytes: usize, at_10: f64| Member {
            name: String::new(),
            paper: false,
            leaf: String::new(),
            bytes,
            code: None,
            nanoseconds: 1.0,
            instructions: Instructions {
                m4f: Count { number: 1, measured: true },
                m0_plus: Count { number: 1, measured: true },
            },
            margin_error: 0.0,
            stated_error: 0.0,
            at_10,
            at_30: 1.0,
            to_1_percent: None,
        };
        let members = [member(300, 0.7), member(100, 0.5), member(200, 0.4), member(400, 0.6)];
        assert_eq!(frontier(&members).iter().map(|member| member.bytes).collect::<Vec<_>>(), [100, 300]);
    }
}
