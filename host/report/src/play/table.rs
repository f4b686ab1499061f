//! A page on which a hand comes straight down on a table, and a locator recognizes what lies there, and where.

use super::{Settings, WASM, surfaces};
use crate::page::{html, scene};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use palpate::error::Result;
use palpate::locate::{self, Real, Standing};
use palpate::mesh::Object;
use palpate::play::compress;
use palpate::probe::noise::Noise;
use palpate::progress::Progress;
use palpate::touches::Origin;
use palpate::with;
use palpate::wording::{count, rate};
use palpate_shared::format::Length;

/// Most objects on a table: a locator in a page has room for no more.
pub const MOST_OBJECTS: usize = 16;

/// The page of a table for at most [`MOST_OBJECTS`] objects at their true size, as HTML. The same objects and settings give the same
/// page.
///
/// # Errors
/// Errors of [`surfaces()`], [`standing`](fn@locate::standing), [`cast`](fn@locate::cast) and [`write`](fn@locate::write); for noise that
/// a table does not have.
pub fn table(objects: &[Object], settings: &Settings, progress: &dyn Progress) -> Result<String> {
    let origin = Origin { unit: Length::Millimeter, ..settings.origin.clone() };
    let mut objects: Vec<&Object> = objects.iter().collect();
    // The order in which maps know them.
    objects.sort_by(|a, b| a.name.cmp(&b.name));
    let surfaces = surfaces(&objects.iter().copied().cloned().collect::<Vec<_>>(), &origin)?;
    // What is drawn is what is touched, by the maps' hand and by the page's.
    let own = |(surface, object): (&super::Surface, &&Object)| {
        let mesh = surface.mesh();
        let [low, high] = mesh.bounds();
        let mut own = Object::new(&*surface.name, mesh);
        own.millimeters = Some(surface.length / f64::from((high - low).max_element()));
        own.placement_weights.clone_from(&object.placement_weights);
        own
    };
    let shown: Vec<Object> = surfaces.iter().zip(&objects).map(own).collect();
    let real = Real::of(&settings.noise, origin.probe.speed)?;
    let maps = with!(locate::CastSettings::default(), fine = false).expecting(&real);
    let standing = locate::standing(&shown.iter().collect::<Vec<_>>(), &origin.probe, maps.noise, progress)?;
    let cast = locate::cast(&standing, &origin.probe, &maps)?;
    let names: Vec<String> = standing.iter().map(|object| object.name.clone()).collect();
    let bytes = locate::write(&cast, &names, &origin.probe, &maps)?;
    let on_table = |(surface, object): (&super::Surface, &Standing)| {
        serde_json::json!({
            "name": surface.name,
            "length": surface.length,
            "mesh": STANDARD.encode(&surface.packed),
            "placements": object.looks().map(|(lying, share)| serde_json::json!({
                "name": lying.name,
                "weight": share,
                "rotation": lying.rotation.to_cols_array(),
            })).collect::<Vec<_>>(),
        })
    };
    let data = serde_json::json!({
        "wasm": STANDARD.encode(WASM),
        "millimeters": true,
        "aim": 0,
        "probe": origin.probe,
        "noise": Noise::default(),
        "objects": surfaces.iter().zip(&standing).map(on_table).collect::<Vec<_>>(),
        "models": [],
        "maps": STANDARD.encode(compress(&bytes)),
        "real": [real.height, real.position, real.lost, real.drift, real.drift_yaw],
        "threshold": 1.0 - maps.error_rate,
        "reach": 2.0 * maps.range,
    });
    let body = html! {
        (body(&surfaces, &origin, &maps, bytes.len(), cast.len(), &settings.command))
        (html::data(&data))
        (scene::stage())
        (html::script(include_str!("game.js")))
        (html::script(include_str!("picture.js")))
        (html::script(include_str!("table.js")))
        (html::script(html::HINT))
    };
    Ok(html::file_with_wasm("Find it on the table – Palpate", &[scene::STYLE, include_str!("page.css")], &body))
}

fn body(
    surfaces: &[super::Surface],
    origin: &Origin,
    maps: &locate::CastSettings,
    bytes: usize,
    cast: usize,
    command: &str,
) -> Markup {
    let reach = 2.0 * maps.range;
    let headings = |id: &str, name: &str, columns: &[&str]| {
        let columns: Vec<_> = columns.iter().map(|column| ("number", *column)).collect();
        html::filled(id, name, &columns)
    };
    html! {
        header {
            h1 { "Find it on the table" }
            p.lead {
                "One of " (surfaces.len()) " objects lies on the table: somewhere within " (maps.range) " mm of its middle in x and y, on any side \
                 that it rests on, turned by any angle. A hand with three fingers in a row comes straight down and knows where it is; \
                 each finger stops at its own height. The simulator and the locator in this page are the program's own, compiled to \
                 WebAssembly."
            }
            p id="failure" role="alert" {}
            noscript { p { "This page needs JavaScript, which this browser does not run." } }
        }
        main {
            section.table aria-label="The table" {
                (scene::figure("Begin with the blue button, or click the table to press there; R turns the row of fingers. Drag to turn the view, scroll or pinch to zoom; \
                                or use the arrow keys, + and \u{2212}."))
                div.row {
                    button.main type="button" id="next" { "Press where it tells most" }
                    button type="button" id="until" { "Press until sure" }
                    button type="button" id="reveal" { "Reveal" }
                    button type="button" id="again" { "Another object" }
                }
                p id="answer" role="status" {}
                fieldset {
                    legend { "Where to press next" }
                    @for (id, label, least, most, step) in [
                        ("x", "x of the middle finger", -reach, reach, 1.0),
                        ("y", "y of the middle finger", -reach, reach, 1.0),
                        ("roll", "Turn of the row", 0.0, 180.0, 15.0),
                    ] {
                        div.slider {
                            label for=(id) { (label) }
                            input type="range" id=(id) min=(least) max=(most) step=(step) value="0";
                            output for=(id) {}
                        }
                    }
                    button type="button" id="there" { "Press there" }
                }
            }
            section.knowledge aria-label="What is believed" {
                p id="verdict" role="status" {}
                (html::bars("Posterior of each object. The line marks the threshold of a verdict."))
                (headings("ghosts", "Ghosts: where it may lie", &["object", "rests on", "x / mm", "y / mm", "yaw / °", "in %"]))
                (headings("touches", "Approaches: place and heights in mm", &["no.", "x", "y", "row / °", "h1", "h2", "h3"]))
            }
            section.notes {
                h2 { "What is what" }
                p {
                    "Each ghost is a pose that the object may have, as opaque as it is likely: blue for the leading object, purple for its \
                     rivals. The likeliest are shown."
                }
                p {
                    "The maps are of the meshes: " (cast) " ways to lie, in cells of " (if maps.fine { 1 } else { 2 }) " mm, " (count(bytes)) " bytes. They expect heights to scatter by "
                    (maps.noise) " mm and " (rate(maps.lost)) " of contacts to be lost, and so the page's hand does. An object is named at a \
                     posterior of " (rate(1.0 - maps.error_rate)) ", which is a belief and not a calibrated promise."
                }
                p {
                    "x and y are of the middle of the object's bounding box; the yaw is the turn about the vertical. Intervals hold 95 % of the \
                     belief about a pose. An object that looks the same from several sides has as many ghosts, and one of them is right."
                    @if let Some(stroke) = origin.probe.stroke {
                        " The hand goes on for " (stroke) " mm after the first contact; – is a finger that met nothing down to there."
                    }
                }
                p { "Made by " code { (command) } }
            }
        }
    }
}
