//! The objects and their curvature (the paper's figures 5 and 6).

use super::context::Context;
use super::statistics::{density, quantile};
use super::view;
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Stroke};
use crate::page::color;
use crate::page::document::{Block, Figure, Picture, Section};
use crate::page::render;
use palpate::error::Result;
use palpate::mesh::{Instance, Object};
use palpate::probe::approach::Probe;
use palpate::results::{Results, Value};
use palpate::row;
use palpate::touches::Origin;
use palpate::wording::{decimal, percent};
use palpate_shared::Touch;
use palpate_shared::format::Length;

/// The curvature up to which densities are drawn at most, in milliseconds.
const FARTHEST: f64 = 400.0;

/// The figure of the objects, that of their curvature, and a table of what capturing took.
pub(super) fn section(context: &Context) -> Result<Section> {
    let captured = context.captured()?;
    let mut section = Section::new("objects", "The objects and their curvature");
    section.text("The objects (the paper's figure 5).");
    let touches = context.settings.touches;
    let pictures = context.objects.iter().zip(&captured.approaches).map(|(object, &approaches)| {
        let line = format!("{} of approaches are full touches", percent(touches as f64 / approaches.max(1) as f64, 1));
        Picture { name: object.name.clone(), png: render::thumbnail(object.mesh(), 240), line }
    });
    section.blocks.push(Block::Pictures(pictures.collect()));
    for object in context.objects {
        for instance in object.instances() {
            let facts = object.facts(instance);
            let complaints = facts.complaints(object.millimeters);
            if complaints.is_empty() {
                continue;
            }
            let length =
                context.settings.capture.length_of(object, instance).unwrap_or(context.settings.capture.length);
            let verdict = view::verdict(&facts, length, &context.settings.capture.probe);
            section.warning(format!("{}: {} As it is: {verdict}.", instance.name, complaints.join(" ")));
        }
    }
    section.figure(densities(context)?);
    let mut data = Results::new(["object", "triangles", "full touches", "approaches", "share of full touches"]);
    for (object, &approaches) in context.objects.iter().zip(&captured.approaches) {
        let share = Value::Percent(touches as f64 / approaches.max(1) as f64, 1);
        data.push(row![&object.name, object.mesh().triangles.len(), touches, approaches, share]);
    }
    let caption = format!(
        "An approach is a full touch when all fingers touch. {} This capture took {} s.",
        touched_by(&context.settings.capture),
        decimal(captured.seconds, 1)
    );
    section.figure(Figure::new("objects-table", "What was captured", caption, data));
    Ok(section)
}

/// The size of the objects and the probe that touches them, in sentences.
pub(super) fn touched_by(capture: &Origin) -> String {
    let size = match capture.unit {
        Length::Tenth => format!("Each object's longest side is {} units", capture.length),
        Length::Millimeter => "The objects have their true sizes".to_owned(),
    };
    format!("{size}; {}.", described(&capture.probe, capture.unit))
}

/// A probe in words.
pub(super) fn described(probe: &Probe, unit: Length) -> String {
    let Probe { radius, spacing, speed, tilt, stroke, travel, .. } = *probe;
    let length = |length: f64| match unit {
        Length::Tenth if length == 1.0 => "1 unit".to_owned(),
        Length::Tenth => format!("{length} units"),
        Length::Millimeter => format!("{length} mm"),
    };
    let way = [("a stroke", stroke), ("a travel", travel)];
    let way = way.into_iter().filter_map(|(name, own)| Some(format!(", with {name} of {}", length(own?))));
    format!(
        "fingers of radius {} are {} apart and move at {} per second, tilted by up to {tilt}°{}",
        length(radius),
        length(spacing),
        length(speed),
        way.collect::<String>()
    )
}

/// The names of the objects with a mesh that should be repaired before it is touched.
pub(super) fn to_repair(context: &Context) -> Vec<String> {
    let capture = &context.settings.capture;
    let is_broken = |object: &Object, instance: &Instance| {
        let facts = object.facts(instance);
        let length = capture.length_of(object, instance).unwrap_or(capture.length);
        view::verdict(&facts, length, &capture.probe).starts_with("repair")
    };
    let objects = context.objects.iter();
    objects
        .filter(|object| object.instances().any(|instance| is_broken(object, instance)))
        .map(|object| object.name.clone())
        .collect()
}

/// κ = t1 − 2·t2 + t3 in milliseconds.
fn curvature(touch: &Touch) -> Option<f64> {
    let [a, b, c] = touch.times().map(|time| time.micros().map(f64::from));
    Some((a? - 2.0 * b? + c?) / 1e3)
}

fn densities(context: &Context) -> Result<Figure> {
    let captured = context.captured()?;
    let values: Vec<Vec<f64>> =
        captured.data.objects.iter().map(|object| object.touches().iter().filter_map(curvature).collect()).collect();
    // The middle nine tenths of every object fit.
    let ends = values.iter().flat_map(|values| [quantile(values, 0.05).abs(), quantile(values, 0.95).abs()]);
    let reach = ends.fold(1.0, f64::max).min(FARTHEST);
    let mut data = Results::new(["object", "curvature (ms)", "density (1/ms)"]);
    let mut panels = Vec::new();
    for (object, values) in captured.data.objects.iter().zip(&values) {
        let curve = density(values, -reach, reach, 241);
        let top = curve.iter().map(|point| point.1).fold(0.0, f64::max).max(1e-12);
        for (value, density) in &curve {
            data.push(row![&object.name, Value::Number(*value, 2), Value::Number(*density, 6)]);
        }
        let y = Axis::linear(0.0, top * 1.05, 3).without_grid().with_ticks(Vec::new());
        let mut chart = Chart::new("curvature κ (ms)", Axis::linear(-reach, reach, 4), "", y)
            .sized(270, 180)
            .titled(object.name.as_str());
        chart.marks.push(Mark::Area { points: curve.clone(), base: 0.0, color: color::OURS, opacity: 0.25 });
        chart.marks.push(Mark::Line { points: curve, color: color::OURS, stroke: Stroke::Solid });
        chart.marks.push(Mark::Vertical(0.0));
        panels.push(chart.svg()?);
    }
    let caption = format!(
        "κ = t₁ − 2·t₂ + t₃, the contact times of the three fingers; Gaussian kernel density with Silverman's bandwidth, each scaled \
         to its own peak. The vertical line marks zero, a flat surface. Positive: convex (the middle finger touches early); negative: \
         concave. The paper's caption has these two the other way around, and its formula, (t₁ − t₂) − (t₂ − t₃), has them as here.{}",
        beyond(captured.data.names().iter().map(String::as_str).zip(&values), reach)
    );
    let title = "Curvature of each object under the probe: densities of the descriptor (figure 6)";
    Ok(Figure::new("curvature", title, caption, data).drawn(panels))
}

/// The share of touches beyond the ends of the axes, of the object that has most of them there; nothing where that is
/// hardly any.
fn beyond<'a>(values: impl Iterator<Item = (&'a str, &'a Vec<f64>)>, reach: f64) -> String {
    let share = |(name, values): (&'a str, &Vec<f64>)| {
        let outside = values.iter().filter(|value| value.abs() > reach).count();
        (name, outside as f64 / values.len().max(1) as f64)
    };
    match values.map(share).max_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((name, most)) if most >= 0.005 => format!(
            " The axes end at ±{} ms, beyond which lie up to {} of an object's touches ({name}).",
            decimal(reach, 0),
            percent(most, 0)
        ),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::small::assert_says;
    use palpate::with;

    #[test]
    fn the_caption_of_a_capture_states_the_probe_and_the_sizes_of_the_settings() {
        assert_says(touched_by(&Origin::default()), &["longest side is 10 units", "radius 0.15 units"]);
        let probe =
            with!(Probe::default(), radius = 2.0, spacing = 20.0, speed = 130.0, tilt = 5.0, stroke = Some(7.0));
        let own = touched_by(&Origin { unit: Length::Millimeter, probe, ..Origin::default() });
        assert_eq!(
            own,
            "The objects have their true sizes; fingers of radius 2 mm are 20 mm apart and move at 130 mm per second, \
             tilted by up to 5°, with a stroke of 7 mm."
        );
    }

    #[test]
    fn touches_beyond_the_axes_of_curvature_are_stated_where_there_are_any() {
        let (inside, outside) = (vec![0.0; 4], vec![-500.0, 0.0, 0.0, 500.0]);
        let of = |reach: f64| beyond([("cup", &inside), ("watch", &outside)].into_iter(), reach);
        assert!(
            of(400.0).contains("±400 ms") && of(400.0).contains("50 %") && of(400.0).contains("(watch)"),
            "{}",
            of(400.0)
        );
        assert_eq!(of(600.0), "");
    }

    #[test]
    fn curvature_is_in_milliseconds_and_needs_all_three_times() {
        assert_eq!(curvature(&Touch::from_micros([2_000, 0, 5_000])), Some(7.0));
        let missing = palpate_shared::ContactTime::MISSING;
        let zero = palpate_shared::ContactTime::from_micros(0);
        assert_eq!(curvature(&Touch::new([zero, missing, zero])), None);
    }
}
