//! A page on which a mesh can be turned and looked at, with some approaches of the probe.
//!
//! The page is self-contained and asks the network for nothing. It answers what a user should know about a mesh
//! before capturing millions of touches: is it right side out and closed, does its scale suit the fingers, where do the
//! fingers touch it.

use crate::page::html;
use crate::page::render;
use crate::page::scene::{self, Line, SimplifiedMesh};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use maud::html;
use palpate::error::Result;
use palpate::mesh::Object;
use palpate::mesh::facts::Facts;
use palpate::mesh::placements::{self, Placement, Placements};
use palpate::probe::approach::{Approach, CLEARANCE, FINGERS, Probe};
use palpate::probe::scene::{Scene, Table};
use palpate::random::{self, Purpose};
use palpate::wording::{count, decimal, percent};

/// Approaches on a page that not all fingers touched.
const MISSES: usize = 12;

/// Settings of a page.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Number of full touches.
    pub touches: usize,
    /// The seed from which approaches are drawn.
    pub seed: u64,
    /// The longest side of the object's bounding box, in units.
    pub length: f64,
    /// Distance from the sphere about the bounding box at which approaches start, in units.
    pub clearance: f64,
    /// The probe.
    pub probe: Probe,
    /// Largest angle between approaches and straight down, in degrees, to an object on a table; none if it floats.
    pub cone: Option<f64>,
}

/// Two dozen touches of the published probe.
impl Default for Settings {
    fn default() -> Self {
        Self { touches: 24, seed: 1, length: 10.0, clearance: CLEARANCE, probe: Probe::default(), cone: None }
    }
}

/// Says in words if a mesh can be touched as it is, if its longest side has this length and the probe these
/// fingers.
pub fn verdict(facts: &Facts, length: f64, probe: &Probe) -> String {
    let unit = f64::from((facts.high - facts.low).max_element()) / length;
    facts.verdict(2.0 * probe.radius * unit)
}

/// Largest number of approaches drawn to find the touches.
const MOST_APPROACHES: u64 = 200_000;

/// The page for an object, as HTML: at most 6 MB, whatever the mesh's size, since no more than 120,000 triangles are
/// shown (the touches are those of the whole mesh). The same settings give the same page.
///
/// # Errors
/// Errors of [`Scene::new`], [`Probe::check`] and [`placements::of_object`].
pub fn page(object: &Object, settings: &Settings) -> Result<String> {
    settings.probe.check(settings.length)?;
    let facts = object.facts(object.first());
    let lying = settings.cone.map(|cone| Lying::new(object, cone)).transpose()?;
    let first = lying.as_ref().and_then(Lying::first);
    let (scene, mesh) = match first {
        None => (Scene::new(object.mesh(), settings.length)?, SimplifiedMesh::new(object.mesh(), settings.length)),
        Some((placement, table)) => {
            let scene = Scene::on_table(object.mesh(), settings.length, placement.rotation, table)?;
            let [low, high] = scene.bounds();
            let mesh = SimplifiedMesh::new(&placement.placed(object.mesh()), (high - low).max_element());
            (scene, mesh)
        }
    };
    let shown_triangles = mesh.triangles.len();
    let drawn = draw(&scene, settings);
    let own = serde_json::json!({
        "length": settings.length,
        "table": lying.is_some(),
        "full": drawn.approaches.iter().map(Drawn::is_full).collect::<Vec<_>>(),
        "approaches": drawn.approaches,
    });
    let lines = drawn.approaches.iter().enumerate().flat_map(|(group, approach)| approach.lines(group));
    let [low, high] = scene.bounds().map(|corner| corner.to_array());
    let scene = scene::Scene { mesh, low, high, radius: settings.probe.radius, lines: lines.collect() };
    let data = scene.data(own.as_object().cloned().unwrap_or_default());
    Ok(html(object, settings, &facts, lying.as_ref(), shown_triangles, &drawn, &data))
}

/// An object on a table: its placements.
struct Lying {
    placements: Placements,
    /// A picture of each, as PNG.
    pictures: Vec<Vec<u8>>,
    cone: f64,
}

impl Lying {
    fn new(object: &Object, cone: f64) -> Result<Self> {
        let mut all = placements::of_object(object)?;
        // Its first instance is shown.
        let placements = all.swap_remove(0);
        let picture = |placement: &Placement| render::on_table(&placement.placed(object.mesh()), 176);
        let pictures = placements.placements.iter().map(picture).collect();
        Ok(Self { placements, pictures, cone })
    }

    /// The most frequent one, in which the object is shown.
    fn first(&self) -> Option<(&Placement, Table)> {
        let first = self.placements.placements.first()?;
        let (placement, weight) = (first.name.clone(), first.weight);
        Some((first, Table { instance: 0, placement, weight, cone: self.cone }))
    }

    fn html(&self) -> maud::Markup {
        let left_out: Vec<String> = self.placements.left_out.iter().map(captioned).collect();
        html! {
            ul.placements aria-label="Placements" {
                @for (index, (placement, picture)) in self.placements.placements.iter().zip(&self.pictures).enumerate() {
                    li.shown[index == 0] {
                        img alt={ (placement.name) " points up" } width="88" height="88"
                            src={ "data:image/png;base64," (STANDARD.encode(picture)) };
                        span { (captioned(placement)) }
                    }
                }
            }
            p.note {
                "Placements on a table, named after the axis of the mesh that points up, with the share in which the object \
                 comes to rest in each if it is dropped; the first one is shown. The center of mass is "
                (self.placements.center) "."
                @if !left_out.is_empty() { " Left out: " (left_out.join(", ")) "." }
            }
        }
    }
}

fn captioned(placement: &Placement) -> String {
    format!("{} {}", placement.name, percent(placement.weight, 1))
}

/// One approach, for the page's script.
#[derive(serde::Serialize)]
struct Drawn {
    /// Start of each finger.
    starts: [[f64; 3]; FINGERS],
    direction: [f64; 3],
    /// Distance of each finger to its contact, in units; null if it misses.
    distances: [Option<f64>; FINGERS],
    /// When each finger touches, in seconds after the first; null if it misses.
    times: [Option<f64>; FINGERS],
    /// End of the approach at the table; infinite if it floats.
    #[serde(skip)]
    end: f64,
}

impl Drawn {
    fn is_full(&self) -> bool {
        self.distances.iter().all(Option::is_some)
    }

    /// A line for each finger's way, with a ball where it touches; a finger that misses goes as far beyond the object as
    /// it started before it.
    fn lines(&self, group: usize) -> impl Iterator<Item = Line> {
        const COLORS: [&str; FINGERS] = ["first", "middle", "last"];
        let direction = DVec3::from(self.direction);
        (0..FINGERS).map(move |finger| {
            let start = DVec3::from(self.starts[finger]);
            let distance = self.distances[finger].unwrap_or(self.end.min(-2.0 * start.dot(direction)));
            let ball = self.distances[finger].is_some();
            Line {
                group,
                start: start.to_array(),
                end: (start + distance * direction).to_array(),
                color: if ball { COLORS[finger] } else { "missed" },
                ball,
            }
        })
    }
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
    while tried < MOST_APPROACHES && (touches.len() < settings.touches || misses.len() < MISSES) {
        let approach = Approach::draw_to(&mut rng, scene, scene.bounds(), settings.probe.tilt, settings.clearance);
        let distances = approach.distances(scene, &settings.probe);
        let times = approach.touch(distances, &settings.probe).times();
        let drawn = Drawn {
            starts: approach.fingers(settings.probe.spacing).map(|finger| finger.to_array()),
            direction: approach.direction.to_array(),
            distances,
            times: times.map(|time| time.micros().map(|micros| f64::from(micros) / 1e6)),
            end: approach.end_at_table(scene, &settings.probe),
        };
        tried += 1;
        let is_full = drawn.is_full();
        full += u64::from(is_full);
        let (kept, most) = if is_full { (&mut touches, settings.touches) } else { (&mut misses, MISSES) };
        if kept.len() < most {
            kept.push(drawn);
        }
    }
    touches.extend(misses);
    Approaches { approaches: touches, tried, full }
}

fn html(
    object: &Object,
    settings: &Settings,
    facts: &Facts,
    lying: Option<&Lying>,
    shown_triangles: usize,
    drawn: &Approaches,
    data: &serde_json::Value,
) -> String {
    let side = facts.high - facts.low;
    let unit = f64::from(side.max_element()) / settings.length;
    let share = drawn.full as f64 / drawn.tried.max(1) as f64;
    let body = html! {
        main {
            (scene::figure("Drag to turn, scroll or pinch to zoom, drag with two fingers or the right mouse button to move; or \
                            use the arrow keys, + and \u{2212}. Click a contact or a row to see one approach alone; Escape \
                            shows all."))
            aside {
                h1 { (object.name) }
                dl {
                    div { dt { "Triangles" } dd {
                        (count(facts.triangles))
                        @if shown_triangles < facts.triangles {
                            " (simplified to " (count(shown_triangles)) " here; the touches are those of the whole mesh)"
                        }
                    } }
                    div { dt { "Closed" } dd.warning[!facts.is_closed()] { (facts.closed()) } }
                    div { dt { "Right side out" } dd.warning[!facts.is_right_side_out()] { (facts.side()) } }
                    @if facts.parts.len() > 1 { div { dt { "Parts" } dd { (count(facts.parts.len())) } } }
                    div { dt { "Size in the file" } dd {
                        (three_digits(side.x.into())) " × " (three_digits(side.y.into())) " × " (three_digits(side.z.into()))
                    } }
                    div { dt { "One unit here" } dd { (three_digits(unit)) " in the file" } }
                    div { dt { "Finger radius" } dd {
                        (settings.probe.radius) " units, " (three_digits(settings.probe.radius * unit)) " in the file"
                    } }
                    div { dt { "Full touches" } dd { (format!("{} of {} approaches", percent(share, 1), count(drawn.tried))) } }
                }
                @for complaint in facts.complaints(object.millimeters) { p.warning { (complaint) } }
                p { (object.name) ": " (verdict(facts, settings.length, &settings.probe)) "." }
                @if let Some(lying) = lying { (lying.html()) }
                fieldset {
                    legend { "Show" }
                    @for (id, label, on) in [
                        ("touches", "touches", true), ("misses", "misses", false), ("box", "bounding box", true),
                        ("edges", "edges of triangles", false), ("smooth", "smooth shading", facts.triangles > 5000),
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
                div.scroll role="region" aria-label="Approaches" tabindex="0" {
                    table {
                        (html::head(&["approach", "t1 / s", "t2 / s", "t3 / s", "κ / ms"].map(|name| ("", name))))
                        tbody {
                            @for (i, approach) in drawn.approaches.iter().enumerate() {
                                tr data-approach=(i) {
                                    td {
                                        button type="button" aria-pressed="false" aria-label={ "Show approach " (i + 1) } { (i + 1) }
                                    }
                                    @for time in approach.times { td { (seconds(time)) } }
                                    td { (curvature(approach.times)) }
                                }
                            }
                        }
                    }
                }
                p.note {
                    "Times are counted from the first contact; – is a finger that did not touch. "
                    "κ = t1 − 2·t2 + t3, the curvature under the probe."
                }
            }
        }
        (scene::scripts(data, include_str!("page.js")))
    };
    html::file(&format!("{} – Palpate", object.name), &[include_str!("page.css"), scene::STYLE], &body)
}

fn seconds(time: Option<f64>) -> String {
    time.map_or("–".into(), |seconds| format!("{seconds:.4}"))
}

fn curvature(times: [Option<f64>; FINGERS]) -> String {
    match times {
        [Some(first), Some(middle), Some(last)] => decimal((first - 2.0 * middle + last) * 1e3, 1),
        _ => "–".into(),
    }
}

/// A number with three significant digits.
fn three_digits(value: f64) -> String {
    if value == 0.0 || !(1e-3..1e6).contains(&value.abs()) {
        return format!("{value:.2e}");
    }
    let digits = (2.0 - value.abs().log10().floor()).max(0.0) as usize;
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests;
