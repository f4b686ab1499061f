//! A page on which a mesh can be turned and looked at, with some approaches of the probe.
//!
//! The page holds all that it needs ([three.js](https://threejs.org) included) and asks the network for nothing. It
//! shows what a user wants to know of a mesh before capturing millions of touches: is it right side out and closed, is
//! its scale sensible beside the fingers, where do the fingers meet it.

mod shown;

use crate::error::{Error, Result};
use crate::mesh::Object;
use crate::probe::approach::{Approach, FINGERS, Probe};
use crate::probe::scene::Scene;
use crate::random::{self, Purpose};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{DOCTYPE, PreEscaped, html};
use shown::{Facts, Shown};

/// What a page shows.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// How many full touches.
    pub touches: usize,
    /// How many approaches that not all fingers touched.
    pub misses: usize,
    /// The seed from which approaches are drawn.
    pub seed: u64,
    /// The longest side of the object's bounding box, in units.
    pub length: f64,
    /// The probe.
    pub probe: Probe,
}

/// Two dozen touches and a dozen misses of the published probe.
impl Default for Settings {
    fn default() -> Self {
        Self { touches: 24, misses: 12, seed: 1, length: 10.0, probe: Probe::default() }
    }
}

/// How many approaches are drawn at most to find the touches.
const MOST_APPROACHES: u64 = 200_000;

/// The page for an object, as HTML: at most 6 MB, whatever the mesh's size, since no more than 120,000 triangles are
/// shown (the touches are those of the whole mesh). The same settings give the same page.
///
/// # Errors
/// As [`Scene::new`] and [`Probe::check`].
pub fn page(object: &Object, settings: &Settings) -> Result<String> {
    settings.probe.check(settings.length)?;
    let scene = Scene::new(&object.mesh, settings.length)?;
    let facts = Facts::of(&object.mesh);
    let shown = Shown::of(&object.mesh, settings.length);
    let drawn = draw(&scene, settings);
    let data = serde_json::json!({
        "length": settings.length,
        "radius": settings.probe.radius,
        "low": scene.bounds()[0].to_array(),
        "high": scene.bounds()[1].to_array(),
        "step": shown.step,
        "origin": shown.origin.to_array(),
        "wide": shown.is_wide(),
        "positions": STANDARD.encode(shown.position_bytes()),
        "indices": STANDARD.encode(shown.index_bytes()),
        "approaches": drawn.approaches,
    });
    // In a script element only `<` could end the data early.
    let data = serde_json::to_string(&data)
        .map_err(|e| Error::data(format!("cannot write the page's data: {e}"), "Report this as a bug."))?
        .replace('<', "\\u003c");
    Ok(html(object, settings, &facts, &shown, &drawn, &data))
}

/// One approach, as the page's script reads it.
#[derive(serde::Serialize)]
struct Drawn {
    /// Where each finger starts.
    starts: [[f64; 3]; FINGERS],
    direction: [f64; 3],
    /// How far each finger goes to its contact, in units; null if it misses.
    distances: [Option<f64>; FINGERS],
    /// When each finger touches, in seconds after the first; null if it misses.
    times: [Option<f64>; FINGERS],
}

/// The approaches to show, and how many were drawn to find them.
struct Approaches {
    approaches: Vec<Drawn>,
    tried: u64,
    full: u64,
}

fn draw(scene: &Scene, settings: &Settings) -> Approaches {
    let mut rng = random::generator(settings.seed, Purpose::View, "", 0);
    let (mut touches, mut misses) = (Vec::new(), Vec::new());
    let (mut tried, mut full) = (0, 0);
    while tried < MOST_APPROACHES && (touches.len() < settings.touches || misses.len() < settings.misses) {
        let approach = Approach::draw(&mut rng, scene.bounds(), settings.probe.tilt);
        let distances = approach.distances(scene, &settings.probe);
        let times = approach.touch(distances, &settings.probe).times();
        let drawn = Drawn {
            starts: approach.fingers(settings.probe.spacing).map(|finger| finger.to_array()),
            direction: approach.direction.to_array(),
            distances,
            times: times.map(|time| time.micros().map(|micros| f64::from(micros) / 1e6)),
        };
        tried += 1;
        let is_full = distances.iter().all(Option::is_some);
        full += u64::from(is_full);
        let (kept, most) = if is_full { (&mut touches, settings.touches) } else { (&mut misses, settings.misses) };
        if kept.len() < most {
            kept.push(drawn);
        }
    }
    touches.extend(misses);
    Approaches { approaches: touches, tried, full }
}

fn html(object: &Object, settings: &Settings, facts: &Facts, shown: &Shown, drawn: &Approaches, data: &str) -> String {
    let side = facts.high - facts.low;
    let unit = f64::from(side.max_element()) / settings.length;
    let share = 100.0 * drawn.full as f64 / drawn.tried.max(1) as f64;
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta http-equiv="Content-Security-Policy"
                    content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'";
                link rel="icon" href="data:,";
                title { (object.name) " – Palpate" }
                style { (PreEscaped(include_str!("page.css"))) }
            }
            body {
                main {
                    figure id="scene" {
                        div id="stage" { div id="labels" aria-hidden="true" {} p id="message" role="status" {} }
                        figcaption {
                            "Drag to turn, scroll or pinch to come nearer, drag with two fingers or the right button to "
                            "move. Click a finger or a row to see one approach alone; Escape shows all."
                        }
                    }
                    aside {
                        h1 { (object.name) }
                        dl {
                            div { dt { "Triangles" } dd {
                                (grouped(facts.triangles))
                                @if shown.triangles.len() < facts.triangles {
                                    " (simplified to " (grouped(shown.triangles.len())) " here; the touches are those of all)"
                                }
                            } }
                            div { dt { "Closed" } dd.warning[!facts.is_closed()] { (facts.closed()) } }
                            div { dt { "Right side out" } dd.warning[!facts.is_right_side_out()] { (facts.side()) } }
                            div { dt { "Size in the file" } dd {
                                (short(side.x.into())) " × " (short(side.y.into())) " × " (short(side.z.into()))
                            } }
                            div { dt { "One unit here" } dd { (short(unit)) " in the file" } }
                            div { dt { "Finger radius" } dd {
                                (settings.probe.radius) " units, " (short(settings.probe.radius * unit)) " in the file"
                            } }
                            div { dt { "Full touches" } dd { (format!("{share:.1} % of {} approaches drawn", grouped(drawn.tried as usize))) } }
                        }
                        fieldset {
                            legend { "Show" }
                            @for (id, label, on) in [
                                ("touches", "touches", true), ("misses", "misses", false), ("box", "box", true),
                                ("edges", "triangles' edges", false), ("smooth", "smooth shading", facts.triangles > 5000),
                            ] {
                                label { input type="checkbox" id=(id) checked[on]; " " (label) }
                            }
                        }
                        p.key {
                            @for (class, label) in [
                                ("first", "finger 1"),
                                ("middle", "finger 2"),
                                ("last", "finger 3"),
                                ("missed", "misses"),
                                ("back", "inside of the surface"),
                            ] {
                                span { span class={ "finger " (class) } {} (label) }
                            }
                        }
                        div.scroll {
                            table {
                                thead { tr {
                                    th { "approach" } th { "t1 / s" } th { "t2 / s" } th { "t3 / s" } th { "κ / ms" }
                                } }
                                tbody {
                                    @for (i, approach) in drawn.approaches.iter().enumerate() {
                                        tr tabindex="0" data-approach=(i) {
                                            td { (i + 1) }
                                            @for time in approach.times { td { (seconds(time)) } }
                                            td { (curvature(approach.times)) }
                                        }
                                    }
                                }
                            }
                        }
                        p.note {
                            "Times count from the first contact; – is a finger that never touched. "
                            "κ = t1 − 2·t2 + t3, the curvature under the probe."
                        }
                    }
                }
                script id="data" type="application/json" { (PreEscaped(data)) }
                script { (PreEscaped(include_str!("../../../assets/three/three.min.js"))) }
                script { (PreEscaped(include_str!("page.js"))) }
            }
        }
    }
    .into_string()
}

fn seconds(time: Option<f64>) -> String {
    time.map_or("–".into(), |seconds| format!("{seconds:.4}"))
}

fn curvature(times: [Option<f64>; FINGERS]) -> String {
    match times {
        [Some(first), Some(middle), Some(last)] => format!("{:.1}", (first - 2.0 * middle + last) * 1e3),
        _ => "–".into(),
    }
}

/// A number with three significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || !(1e-3..1e6).contains(&value.abs()) {
        return format!("{value:.2e}");
    }
    let digits = (2.0 - value.abs().log10().floor()).max(0.0) as usize;
    format!("{value:.digits$}")
}

/// A count with its thousands apart.
fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let groups: Vec<&[u8]> = digits.as_bytes().rchunks(3).rev().collect();
    groups.iter().map(|group| String::from_utf8_lossy(group)).collect::<Vec<_>>().join(",")
}

#[cfg(test)]
mod tests;
