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

/// The head of a table: each column's class, if any, and its name.
pub(crate) fn head(columns: &[(&str, &str)]) -> Markup {
    html! {
        thead { tr { @for (class, name) in columns {
            th class=[Some(class).filter(|class| !class.is_empty())] scope="col" { (name) }
        } } }
    }
}

/// The table of posteriors, which a script fills.
pub(crate) fn bars(caption: &str) -> Markup {
    html! {
        table id="bars" {
            caption { (caption) }
            (head(&[("", "object"), ("", "posterior"), ("number", "in %")]))
            tbody {}
        }
    }
}

/// A heading and a table below it, which a script fills.
pub(crate) fn filled(id: &str, name: &str, columns: &[(&str, &str)]) -> Markup {
    html! {
        h2 { (name) }
        div.scroll role="region" aria-label=(name) tabindex="0" { table id=(id) { (head(columns)) tbody {} } }
    }
}

/// The table of touches: contact times between a first and a last column.
pub(crate) fn touches(first: &str, last: &str) -> Markup {
    let [one, two, three] = [("number first", "t1 / ms"), ("number middle", "t2 / ms"), ("number last", "t3 / ms")];
    filled("touches", "Touches", &[("number", first), one, two, three, ("", last)])
}

/// Makes tables that are wider than their place say so: for elements of the class `scroll`, and the style of `more`.
pub(crate) const HINT: &str = include_str!("hint.js");

/// A script, inside the file.
pub(crate) fn script(text: &str) -> Markup {
    html! { script { (PreEscaped(text)) } }
}
