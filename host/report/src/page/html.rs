//! Common parts of all HTML files: the head, and a policy under which the browser refuses to ask the network for
//! anything.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// Scripts that stand in the file.
const SCRIPTS: &str = "script-src 'unsafe-inline'";
/// Scripts and WebAssembly that stand in the file.
const SCRIPTS_AND_WASM: &str = "script-src 'unsafe-inline' 'wasm-unsafe-eval'";

/// A whole HTML file. It holds everything itself: the `styles` are put into its head one after the other.
pub(crate) fn file(title: &str, styles: &[&str], body: &Markup) -> String {
    whole(title, styles, SCRIPTS, body)
}

/// A whole HTML file that computes in WebAssembly.
pub(crate) fn file_with_wasm(title: &str, styles: &[&str], body: &Markup) -> String {
    whole(title, styles, SCRIPTS_AND_WASM, body)
}

fn whole(title: &str, styles: &[&str], scripts: &str, body: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                // By this, a page is recognized as one that may be replaced.
                meta name="generator" content={ "Palpate " (env!("CARGO_PKG_VERSION")) };
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                meta http-equiv="Content-Security-Policy"
                    content={ "default-src 'none'; img-src data:; style-src 'unsafe-inline'; " (scripts) };
                // No icon, so that a browser does not ask for one.
                link rel="icon" href="data:,";
                title { (title) }
                @for style in styles { style { (PreEscaped(style)) } }
            }
            body { (body) }
        }
    }
    .into_string()
}

/// Data for the page's scripts, as the element `data`.
pub(crate) fn data(value: &serde_json::Value) -> Markup {
    // In a script element only `<` could end the data early.
    let text = value.to_string().replace('<', "\\u003c");
    html! { script id="data" type="application/json" { (PreEscaped(text)) } }
}

/// Makes tables that are wider than their place say so: for elements of the class `scroll`, and the style of `more`.
pub(crate) const HINT: &str = include_str!("hint.js");

/// A script, inside the file.
pub(crate) fn script(text: &str) -> Markup {
    html! { script { (PreEscaped(text)) } }
}
