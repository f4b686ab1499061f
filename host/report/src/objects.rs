//! The objects and their curvature (the paper's figures 5 and 6).

use super::context::Context;
use super::statistics::{density, quantile};
use super::view;
use crate::page::axis::Axis;
use crate::page::chart::{Chart, Mark, Stroke};
use crate::page::color;
use crate::page::document::{Block, Figure, Picture, Section};
use crate::page::render;
use crate::page::table::{Cell, Records, Table};
use palpate::error::Result;
use palpate::mesh::facts::Facts;
use palpate::mesh::{Instance, Object};
use palpate_shared::Touch;

/// The figure of the objects, that of their curvature, and a table of what capturing took.
pub(super) fn section(context: &Context) -> Result<Section> {
    let captured = context.captured()?;
    let mut section = Section::new("objects", "The objects and their curvature");
    let touches = context.settings.touches;
    let pictures = context.objects.iter().zip(&captured.approaches).map(|(object, &approaches)| {
        let line = format!("{:.1} % of approaches are full touches", 100.0 * touches as f64 / approaches.max(1) as f64);
        Picture { name: object.name.clone(), png: render::thumbnail(object.mesh(), 240), line }
    });
    section.blocks.push(Block::Pictures(pictures.collect()));
    for object in context.objects {
        for instance in object.instances() {
            let facts = Facts::of(&instance.mesh);
            let complaints = object.complaints(&facts);
            if complaints.is_empty() {
                continue;
            }
            let length =
                context.settings.capture.length_of(object, instance).unwrap_or(context.settings.capture.length);
            let verdict = view::verdict(object, &facts, length, &context.settings.capture.probe);
            section.warning(format!("{}: {} As it is: {verdict}.", instance.name, complaints.join(" ")));
        }
    }
    section.figure(densities(context)?);
    let mut data = Records::new(["object", "triangles", "full touches", "approaches", "share of full touches"]);
    for (object, &approaches) in context.objects.iter().zip(&captured.approaches) {
        data.push([
            object.name.as_str().into(),
            Cell::count(object.mesh().triangles.len()),
            Cell::count(touches),
            Cell::count(approaches),
            Cell::Percent(touches as f64 / approaches.max(1) as f64, 1),
        ]);
    }
    section.table(Table {
        id: "objects-table".into(),
        title: "What was captured".into(),
        caption: format!(
            "An approach is a full touch when all three fingers touch. Each object's longest side is 10 units; fingers \
                  of radius 0.15 are 1.5 apart and move at 10 units per second. This capture took {:.1} s.",
            captured.seconds
        ),
        command: context.settings.command.clone(),
        data,
    });
    Ok(section)
}

/// The names of the objects with a mesh that should be repaired before it is touched.
pub(super) fn to_repair(context: &Context) -> Vec<String> {
    let capture = &context.settings.capture;
    let is_broken = |object: &Object, instance: &Instance| {
        let facts = Facts::of(&instance.mesh);
        let length = capture.length_of(object, instance).unwrap_or(capture.length);
        view::verdict(object, &facts, length, &capture.probe).starts_with("repair")
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
    let reach = ends.fold(1.0, f64::max).min(400.0);
    let mut data = Records::new(["object", "curvature (ms)", "density (1/ms)"]);
    let mut panels = Vec::new();
    for (object, values) in captured.data.objects.iter().zip(&values) {
        let curve = density(values, -reach, reach, 241);
        let top = curve.iter().map(|point| point.1).fold(0.0, f64::max).max(1e-12);
        for (value, density) in &curve {
            data.push([object.name.as_str().into(), Cell::Number(*value, 2), Cell::Number(*density, 6)]);
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
    Ok(Figure {
        id: "curvature".into(),
        title: "Curvature of each object under the probe: densities of the descriptor (figures 5 and 6)".into(),
        caption: "κ = t₁ − 2·t₂ + t₃, the contact times of the three fingers; Gaussian kernel density with Silverman's \
                  bandwidth, each scaled to its own peak. The vertical line marks zero, a flat surface; to its right the \
                  surface is bent toward the probe, to its left away from it."
            .into(),
        command: context.settings.command.clone(),
        panels,
        data,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curvature_is_in_milliseconds_and_needs_all_three_times() {
        assert_eq!(curvature(&Touch::from_micros([2_000, 0, 5_000])), Some(7.0));
        let missing = palpate_shared::ContactTime::MISSING;
        let zero = palpate_shared::ContactTime::from_micros(0);
        assert_eq!(curvature(&Touch::new([zero, missing, zero])), None);
    }
}
