//! A page on which objects can be touched, with the simulator and the recognizer inside.
//!
//! The page is self-contained and asks the network for nothing: the objects' surfaces, the compiled models, and the
//! lines of Rust that touch the one and read the other ([`palpate::play`], compiled to WebAssembly by `host/web`). What a
//! page says is what the program says.

mod surfaces;
mod table;

pub use surfaces::{Surface, surfaces};
pub use table::{MOST_OBJECTS, table};

use crate::page::html;
use crate::page::scene;
use crate::run_page::models;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use palpate::compile::CompiledModel;
use palpate::error::Result;
use palpate::evaluate::raw_features;
use palpate::mesh::Object;
use palpate::play::compress;
use palpate::probe::approach::Aim;
use palpate::probe::noise::Noise;
use palpate::touches::Origin;
use palpate::wording::{count, list};
use palpate_onboard::Model;
use palpate_shared::format::{Counted, Length};
use std::path::PathBuf;

/// The game, compiled to WebAssembly.
const WASM: &[u8] = include_bytes!("../../assets/play/palpate.wasm");

/// A copy of `models/household.palpate`, which knows the ten built-in objects.
const HOUSEHOLD: &[u8] = include_bytes!("../../assets/play/household.palpate");

/// Settings of a page.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Origin of the touches: unit, probe and aim count.
    pub origin: Origin,
    /// The noise that the page begins with.
    pub noise: Noise,
    /// The command that remakes the page.
    pub command: String,
}

/// A model that plays.
#[derive(Clone, Debug)]
pub struct Contender {
    /// Its name on the page.
    pub name: String,
    /// The model.
    pub model: CompiledModel,
}

impl Contender {
    /// A model by a name that says which touches are evidence to it, and what it makes of them.
    ///
    /// # Errors
    /// When the model is over rows of features.
    pub fn new(model: CompiledModel) -> Result<Self> {
        let name = about(&model.model())?;
        Ok(Self { name, model })
    }

    /// The model of the ten built-in objects, touched by the published probe.
    ///
    /// # Errors
    /// None: the model is part of this crate.
    pub fn household() -> Result<Self> {
        Self::new(CompiledModel::from_bytes(HOUSEHOLD.to_vec())?)
    }
}

/// Tells models of one name apart by the files that they came from: by the files' names, or, where those are the same too,
/// by their paths; the same file twice is numbered.
pub fn distinguish(contenders: &mut [Contender], files: &[PathBuf]) {
    let stem = |file: &PathBuf| file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let path = |file: &PathBuf| file.display().to_string();
    let names: Vec<String> = contenders.iter().map(|contender| contender.name.clone()).collect();
    for (index, (contender, file)) in contenders.iter_mut().zip(files).enumerate() {
        let same = || (0..names.len()).zip(files).filter(|(other, _)| names[*other] == names[index]);
        if same().count() < 2 {
            continue;
        }
        let is_alone = |of: &dyn Fn(&PathBuf) -> String| same().filter(|(_, other)| of(other) == of(file)).count() == 1;
        let before = same().filter(|(other, own)| *other < index && *own == file).count();
        contender.name += &match () {
            () if is_alone(&stem) => format!(" ({})", stem(file)),
            () if is_alone(&path) => format!(" ({})", path(file)),
            () => format!(" ({}, {})", path(file), before + 1),
        };
    }
}

/// A model's features and touches, in words.
fn about(model: &Model<'_>) -> Result<String> {
    let descriptor = model.descriptor().ok_or_else(raw_features)?;
    let touches = match model.trained_touches().counted {
        Counted::Full => "full touches",
        Counted::Contacts => "every contact",
        Counted::All => "every approach",
    };
    Ok(format!("{}, {touches}", descriptor.for_full_touches().name()))
}

/// The page for objects and models, as HTML. At most 3 MB with models of up to half a megabyte together: larger meshes are
/// simplified, which the page says. The same objects, models and settings give the same page.
///
/// # Errors
/// Errors of [`surfaces()`].
pub fn page(objects: &[Object], contenders: &[Contender], settings: &Settings) -> Result<String> {
    let surfaces = surfaces(objects, &settings.origin)?;
    let data = data(&surfaces, contenders, settings);
    let body = html! {
        (body(&surfaces, contenders, settings))
        (html::data(&data))
        (scene::stage())
        (html::script(include_str!("game.js")))
        (html::script(include_str!("picture.js")))
        (html::script(include_str!("page.js")))
        (html::script(html::HINT))
    };
    Ok(html::file_with_wasm("Touch it yourself – Palpate", &[scene::STYLE, include_str!("page.css")], &body))
}

/// Data for the page's script.
fn data(surfaces: &[Surface], contenders: &[Contender], settings: &Settings) -> serde_json::Value {
    let Settings { origin, noise, .. } = settings;
    serde_json::json!({
        "wasm": STANDARD.encode(WASM),
        "millimeters": origin.unit == Length::Millimeter,
        "aim": Aim::ALL.iter().position(|aim| *aim == origin.aim),
        "probe": origin.probe,
        "noise": noise,
        "objects": surfaces.iter().map(|surface| serde_json::json!({
            "name": surface.name,
            "length": surface.length,
            "mesh": STANDARD.encode(&surface.packed),
        })).collect::<Vec<_>>(),
        "models": contenders.iter().map(|contender| serde_json::json!({
            "name": contender.name,
            "bytes": STANDARD.encode(compress(contender.model.bytes())),
            "objects": contender.model.names(),
            "known": contender.model.model().known_count(),
            "plan": contender.model.model().plan().is_some(),
        })).collect::<Vec<_>>(),
    })
}

fn body(surfaces: &[Surface], contenders: &[Contender], settings: &Settings) -> Markup {
    let has_plan = contenders.iter().any(|contender| contender.model.model().plan().is_some());
    // The model to use, where there are several: every contact is evidence, and no pose is needed.
    let counts_contacts =
        |contender: &Contender| contender.model.model().trained_touches().counted == Counted::Contacts;
    let shown = contenders.iter().position(counts_contacts).unwrap_or(0);
    html! {
        header {
            h1 { "Touch it yourself" }
            p.lead {
                "Three fingers in a row approach an object; each reports when it makes contact. " (distinguishing(contenders, surfaces.len()))
                " The simulator and the recognizer in this page are the program's own, compiled to WebAssembly."
            }
            p id="failure" role="alert" {}
            noscript { p { "This page needs JavaScript, which this browser does not run." } }
        }
        main {
            section.table aria-label="The object" {
                div.row {
                    label for="object" { "Object" }
                    select id="object" {
                        @for (index, surface) in surfaces.iter().enumerate() { option value=(index) { (surface.name) } }
                        option value="secret" { "a secret one" }
                    }
                    button type="button" id="secret" { "Guess what I am touching" }
                }
                (scene::figure("Click the surface to touch it there. Drag to turn, scroll or pinch to zoom; or use the arrow \
                                keys, + and \u{2212}."))
                div.row {
                    button.main type="button" id="touch" { "Touch at random" }
                    button type="button" id="until" { "Touch until sure" }
                    @if has_plan { button type="button" id="planned" { "Touch where planned" } }
                    button type="button" id="again" { "Start again" }
                }
                p.note { "Hold the first button, or keep Enter pressed on it, for many." }
                div id="guesses" hidden {
                    p { "Your guess:" }
                    div.row {
                        @for (index, surface) in surfaces.iter().enumerate() {
                            button type="button" data-guess=(index) { (surface.name) }
                        }
                    }
                }
                p id="answer" role="status" {}
            }
            section.knowledge aria-label="What the model knows" {
                @if contenders.len() > 1 {
                    div.row {
                        label for="model" { "Model" }
                        select id="model" {
                            @for (index, contender) in contenders.iter().enumerate() {
                                option value=(index) selected[index == shown] { (contender.name) }
                            }
                        }
                    }
                }
                p id="verdict" role="status" {}
                (html::bars("Posterior of each object. The line marks the threshold of a verdict."))
                @if has_plan {
                    label { input type="checkbox" id="where"; " Where next? Show the approach that the plan proposes" }
                    p.note id="proposal" {}
                }
                (html::touches("approach", "fingers"))
            }
            (compare(contenders, settings))
            (notes(surfaces, contenders, settings))
        }
    }
}

/// The evidence that models distinguish so many objects by, and their sizes.
fn distinguishing(contenders: &[Contender], objects: usize) -> String {
    let bytes = contenders.iter().map(|contender| contender.model.bytes().len());
    let needs_pose = |contender: &&Contender| contender.model.model().trained_touches().needs_pose;
    let posed =
        contenders.iter().filter(needs_pose).map(|own| format!("\u{201c}{}\u{201d}", own.name)).collect::<Vec<_>>();
    let from = match posed.is_empty() {
        true => "From these times alone".to_owned(),
        false if posed.len() == contenders.len() => "From these times and the probe's pose".to_owned(),
        false => format!("From these times, and in the case of {} the probe's pose,", list(&posed)),
    };
    let verb = if contenders.len() == 1 { "distinguishes" } else { "distinguish" };
    format!("{from} {} {verb} {objects} objects.", models("a model", "models", bytes))
}

/// The aim of random approaches.
fn aimed_at(aim: Aim) -> &'static str {
    match aim {
        Aim::Box => "the bounding box",
        Aim::Middle => "a box of half the sides of the bounding box, about its center",
        Aim::Mass => "a box of a quarter of the sides of the bounding box, about the surface's center of mass",
    }
}

/// All models on the same touches, and what is added to these.
fn compare(contenders: &[Contender], settings: &Settings) -> Markup {
    let ms = |micros: f64| micros / 1e3;
    let bent = settings.noise.bent;
    html! {
        section.compare {
            h2 { "Side by side, on the same touches" }
            div.scroll role="region" aria-label="Models" tabindex="0" {
                table id="models" {
                    (html::head(&[
                        ("", "model"), ("", "says"), ("number", "posterior"), ("number", "approaches"),
                        ("number", "of them evidence"), ("number", "bytes"),
                    ]))
                    tbody {
                        @for contender in contenders {
                            tr {
                                th scope="row" { (contender.name) }
                                td {} td.number {} td.number {} td.number {}
                                td.number { (count(contender.model.bytes().len())) }
                            }
                        }
                    }
                }
            }
            fieldset {
                legend { "Noise of the sensor" }
                @for (id, label, least, largest, value) in [
                    ("noise", "Noise: up to", 0.0, 20.0, ms(settings.noise.deviation.largest)),
                    ("bent1", "Finger 1 bent", -20.0, 20.0, ms(bent[0])),
                    ("bent2", "Finger 2 bent", -20.0, 20.0, ms(bent[1])),
                    ("bent3", "Finger 3 bent", -20.0, 20.0, ms(bent[2])),
                ] {
                    div.slider {
                        label for=(id) { (label) }
                        input type="range" id=(id) min=(least) max=(largest) step="0.5" value=(value);
                        output for=(id) {}
                    }
                }
            }
        }
    }
}

fn notes(surfaces: &[Surface], contenders: &[Contender], settings: &Settings) -> Markup {
    let simplified: Vec<String> = surfaces
        .iter()
        .filter(|surface| surface.triangles < surface.of)
        .map(|surface| format!("{} ({} of {} triangles)", surface.name, count(surface.triangles), count(surface.of)))
        .collect();
    let instances: Vec<&str> =
        surfaces.iter().filter(|surface| surface.instances > 1).map(|surface| surface.name.as_str()).collect();
    let timer = settings.noise.timer;
    let has_plan = |contender: &&Contender| contender.model.model().plan().is_some();
    let planners: Vec<String> =
        contenders.iter().filter(has_plan).map(|contender| format!("\u{201c}{}\u{201d}", contender.name)).collect();
    html! {
        section.notes {
            h2 { "What is what" }
            p {
                "A random approach is drawn as " code { "palpate capture" } " draws it: from any direction, at any point of "
                (aimed_at(settings.origin.aim)) ". A click is an approach that you aimed, which the models were not trained for: \
                 their confidence may be too high or too low. "
                @if !planners.is_empty() {
                    "A planned approach is where the plan of " (list(&planners)) " says; all models take it as evidence, and those \
                     without a plan were trained for random ones. "
                }
                "An approach costs a robot the same whether or not it is evidence."
            }
            p {
                "The picture and the simulator use the same surface: the mesh with its corners rounded to a 65,536th \
                 of its longest side"
                @if simplified.is_empty() { "." } @else { ", and simplified where that is needed: " (simplified.join(", ")) "." }
                @if !instances.is_empty() { " Of objects with several meshes, the first is shown: " (instances.join(", ")) "." }
            }
            p {
                "The deviation of a touch's noise is drawn between " (settings.noise.deviation.least / 1e3) " ms and what the \
                 slider says"
                @if timer > 0.0 { "; the timer counts steps of " (timer / 1e3) " ms" }
                ". Times count from the first contact; – is a finger that missed."
            }
            @if let Some((stroke, window)) = settings.origin.probe.stroke.zip(settings.origin.probe.window()) {
                p {
                    "The hand goes on for its stroke of " (stroke) " after the first contact, which takes "
                    (f64::from(window) / 1e6) " s. What a finger would touch later, it does not touch: the contact is missing, \
                     and the table says of which finger."
                }
            }
            @if let Some(travel) = settings.origin.probe.travel {
                p { "An approach without a contact ends after " (travel) ", the hand's travel." }
            }
            p { "Made by " code { (settings.command) } }
        }
    }
}

/// The longest side of an object's first mesh, in units.
fn length(object: &Object, origin: &Origin) -> Result<f64> {
    object.instances().next().map_or(Ok(0.0), |first| origin.length_of(object, first))
}

#[cfg(test)]
mod tests;
