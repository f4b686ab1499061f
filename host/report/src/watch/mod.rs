//! A page that watches a chip at a serial port of the visitor's computer: verdict, posteriors and touches, as `palpate link`
//! prints them, without a program.
//!
//! The page is self-contained and asks the network for nothing. It reaches the chip by Web Serial and speaks the link with the
//! lines of Rust that the program does ([`palpate_shared::link`], compiled to WebAssembly by `host/web/link`). Names and
//! posteriors come from the chip. With a model the page also draws that model's thresholds, and says if the chip has another.

use crate::page::html;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};
use palpate::compile::CompiledModel;
use palpate::error::Result;
use palpate::evaluate::raw_features;
use palpate_onboard::Stopping;

/// The host's end of the link, compiled to WebAssembly.
pub(crate) const WASM: &[u8] = include_bytes!("../../assets/play/link.wasm");

/// The page, as HTML; about 110 KB. `model` is the one that the chip should have; `command` remakes the page. The same
/// arguments give the same page.
///
/// # Errors
/// When the model is over rows of features.
pub fn page(model: Option<&CompiledModel>, command: &str) -> Result<String> {
    if model.is_some_and(|model| model.model().descriptor().is_none()) {
        return Err(raw_features());
    }
    let data = serde_json::json!({ "wasm": STANDARD.encode(WASM), "model": model.map(stated) });
    let body = html! {
        (body(model.is_some(), command))
        (html::data(&data))
        (html::script(include_str!("link.js")))
        (html::script(include_str!("port.js")))
        (html::script(include_str!("page.js")))
        (html::script(html::HINT))
    };
    let styles = [include_str!("../play/page.css"), include_str!("page.css")];
    Ok(html::file_with_wasm("A chip at the cable – Palpate", &styles, &body))
}

/// Facts of a model for the page: enough to recognize it on a chip, and the posterior that each object has to reach. Where
/// several outputs belong to one object, their sum has to reach it, so none is stated; nor for a background, which is no object.
fn stated(model: &CompiledModel) -> serde_json::Value {
    let (length, names, model) = (model.bytes().len(), model.names(), model.model());
    let stopping = Stopping::from_model(&model);
    let threshold = |object| 1.0 / (1.0 + stopping.odds_of(object, &model) as f64 / 2.0_f64.powi(56));
    let thresholds = 0..if model.outputs().is_some() { 0 } else { model.known_count() };
    serde_json::json!({
        "checksum": model.checksum(),
        "length": length,
        "objects": names,
        "thresholds": thresholds.map(threshold).collect::<Vec<f64>>(),
    })
}

fn body(has_model: bool, command: &str) -> Markup {
    html! {
        header {
            h1 { "A chip at the cable" }
            p.lead {
                "A probe with a microcontroller at a serial port of this computer: what it touches, and what it makes of it. \
                 The chip recognizes; this page shows. Nothing is installed, and nothing leaves this computer."
            }
            p id="failure" role="alert" {}
            noscript { p { "This page needs JavaScript, which this browser does not run." } }
            div.row {
                button.main type="button" id="connect" { "Connect" }
                button type="button" id="reset" disabled { "Another object" }
                label for="baud" { "Baud" }
                input type="number" id="baud" value="115200" min="300" max="4000000" step="1";
            }
            p id="state" role="status" { "Not connected." }
            p.note id="chip" {}
            p id="warning" role="alert" {}
        }
        main {
            section.knowledge aria-label="What the chip knows" {
                p id="verdict" role="status" {}
                (html::bars(match has_model {
                    true => "Posterior of each object. The line marks the threshold of a verdict.",
                    false => "Posterior of each object, from the chip.",
                }))
            }
            section.felt aria-label="What the fingers felt" {
                figure id="last" {
                    table id="fingers" {
                        (html::head(&[("", "finger"), ("", "contact"), ("number", "ms")]))
                        tbody {
                            @for (class, name) in [("first", "first"), ("middle", "middle"), ("last", "last")] {
                                tr.(class) {
                                    th scope="row" { (name) }
                                    td { div.track aria-hidden="true" { div.contact hidden {} } }
                                    td.number { "–" }
                                }
                            }
                        }
                    }
                    figcaption id="scale" { "The last touch: when each finger made contact." }
                }
                (html::touches("no.", "the chip says"))
                p.note id="line" {}
            }
            section.notes {
                h2 { "What is what" }
                p {
                    "Times count from the first contact; – is a finger that missed. Posteriors are the chip's own, asked for after \
                     each touch. A verdict ends an object, and the next touch begins another; so does the button, before there \
                     is a verdict."
                }
                p {
                    "One program at a time has the port: " code { "palpate link" } " cannot reach the chip while this page is \
                     connected, nor this page while the other is. A model is loaded by "
                    code { "palpate link PORT --load model.palpate" } "."
                }
                p { "Made by " code { (command) } }
            }
        }
    }
}

#[cfg(test)]
mod tests;
