//! A page of sections: one HTML file with its style, script, drawings and pictures inside.

use super::{chart::Svg, html};
use crate::bug;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use palpate::error::Result;
use palpate::output;
use palpate::results::{Results, Value};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The page's style.
pub(crate) const STYLE: &str = include_str!("page.css");

/// Results in the page: one or more drawings of them side by side, or a table with columns that sort.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Its anchor, and its files' stem.
    id: String,
    title: String,
    /// Caption: how to read it, and how it was made.
    caption: String,
    /// The drawings; none of a table.
    panels: Vec<Svg>,
    data: Results,
}

impl Figure {
    /// A table of `data`.
    pub fn new(id: &str, title: impl Into<String>, caption: impl Into<String>, data: Results) -> Self {
        Self { id: id.into(), title: title.into(), caption: caption.into(), panels: Vec::new(), data }
    }

    /// The figure with drawings instead of a table.
    pub(crate) fn drawn(self, panels: Vec<Svg>) -> Self {
        Self { panels, ..self }
    }

    /// All panels in one drawing on white, in rows of at most 1,160 pixels.
    pub(crate) fn whole_svg(&self) -> Svg {
        let cell = |size: fn(&Svg) -> u32| self.panels.iter().map(size).max().unwrap_or(1);
        let (width, height) = (cell(|panel| panel.width), cell(|panel| panel.height));
        let columns = (1160 / width.max(1)).clamp(1, self.panels.len().max(1) as u32);
        let rows = (self.panels.len() as u32).div_ceil(columns);
        let (whole_width, whole_height) = (width * columns, height * rows);
        let mut text = format!(
            "<svg width=\"{whole_width}\" height=\"{whole_height}\" viewBox=\"0 0 {whole_width} {whole_height}\" \
             xmlns=\"http://www.w3.org/2000/svg\">\n<rect width=\"100%\" height=\"100%\" fill=\"#FFFFFF\"/>\n"
        );
        for (index, panel) in (0..).zip(&self.panels) {
            let (x, y) = (width * (index % columns), height * (index / columns));
            text += &panel.text.replacen("<svg ", &format!("<svg x=\"{x}\" y=\"{y}\" "), 1);
        }
        Svg { text: text + "</svg>\n", width: whole_width, height: whole_height, narrow: None }
    }
}

/// Part of a section.
#[derive(Clone, Debug)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// A paragraph about what may make the figures wrong.
    Warning(String),
    /// A figure or a table.
    Figure(Figure),
    /// A paragraph that is a link to a file beside the page: the file's name, and what the link says.
    Link(String, String),
    /// Small pictures, each with a name and a line below it.
    Pictures(Vec<Picture>),
}

/// A small picture in the page.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Heading of the section.
    pub name: String,
    /// The bytes of a PNG file.
    pub png: Vec<u8>,
    /// A few words below it.
    pub line: String,
}

/// A heading with what belongs below it.
#[derive(Clone, Debug)]
pub struct Section {
    /// Its anchor.
    pub id: String,
    /// Its heading.
    pub title: String,
    /// Contents of the section.
    pub blocks: Vec<Block>,
}

impl Section {
    /// An empty section.
    pub fn new(id: &str, title: &str) -> Self {
        Self { id: id.to_string(), title: title.to_string(), blocks: Vec::new() }
    }

    /// Adds a paragraph.
    pub fn text(&mut self, text: impl Into<String>) -> &mut Self {
        self.blocks.push(Block::Text(text.into()));
        self
    }

    /// Adds a paragraph about what may make the figures wrong.
    pub fn warning(&mut self, text: impl Into<String>) -> &mut Self {
        self.blocks.push(Block::Warning(text.into()));
        self
    }

    /// Adds a figure or a table.
    pub fn figure(&mut self, figure: Figure) -> &mut Self {
        self.blocks.push(Block::Figure(figure));
        self
    }
}

/// A whole page.
#[derive(Clone, Debug)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// One or two sentences below the title.
    pub summary: String,
    /// The command that remakes its figures; may be empty.
    pub command: String,
    /// The sections, in order.
    pub sections: Vec<Section>,
    /// The footer: settings and version, as name and value.
    pub facts: Vec<(String, String)>,
    /// True if the files of figures and tables are written next to the page and linked.
    pub files: bool,
}

impl Page {
    /// All figures and tables, in order.
    pub(crate) fn figures(&self) -> impl Iterator<Item = &Figure> {
        let blocks = self.sections.iter().flat_map(|section| &section.blocks);
        blocks.filter_map(|block| if let Block::Figure(figure) = block { Some(figure) } else { None })
    }

    /// The results of all tables, by their names.
    pub(crate) fn tables(&self) -> BTreeMap<&str, &Results> {
        let tables = self.figures().filter(|figure| figure.panels.is_empty());
        tables.map(|table| (table.id.as_str(), &table.data)).collect()
    }

    /// The page as HTML.
    pub(crate) fn html(&self) -> String {
        let body = html! {
            header {
                h1 { (self.title) }
                p.lead { (self.summary) }
                @if self.sections.len() > 2 {
                    nav aria-label="Sections" {
                        @for section in &self.sections { a href={ "#section-" (section.id) } { (section.title) } " " }
                    }
                }
            }
            main {
                @for section in &self.sections {
                    // Figures and tables have anchors of their own, and some the same name.
                    section id={ "section-" (section.id) } {
                        h2 { (section.title) }
                        @for block in &section.blocks { (self.block(block)) }
                    }
                }
            }
            footer {
                dl { @for (name, value) in &self.facts { div { dt { (name) } dd { (value) } } } }
            }
            (html::script(include_str!("page.js")))
            (html::script(html::HINT))
        };
        html::file(&self.title, &[STYLE], &body)
    }

    /// Writes the page to `path`, and with [`Page::files`] every figure's SVG and CSV and every table's CSV beside it.
    /// The page comes last, each file whole or not at all. Returns what was written.
    ///
    /// # Errors
    /// [`Kind::Io`](palpate::error::Kind::Io) naming the file.
    pub fn write(&self, path: &Path) -> Result<Vec<PathBuf>> {
        let mut files = Vec::new();
        for figure in self.figures().filter(|_| self.files) {
            if !figure.panels.is_empty() {
                files.push((format!("{}.svg", figure.id), figure.whole_svg().text.into_bytes()));
            }
            files.push((format!("{}.csv", figure.id), csv(&figure.data)?));
        }
        let mut written = Vec::new();
        for (name, bytes) in files {
            let file = path.with_file_name(name);
            output::write_bytes(&file, &bytes)?;
            written.push(file);
        }
        output::write_bytes(path, self.html().as_bytes())?;
        written.push(path.to_path_buf());
        Ok(written)
    }

    fn block(&self, block: &Block) -> Markup {
        match block {
            Block::Text(text) => html! { p { (marked(text)) } },
            Block::Warning(text) => html! { p.warning { strong { "Warning: " } (marked(text)) } },
            Block::Link(file, text) => html! { p { a href=(file) { (text) } } },
            Block::Figure(figure) => html! {
                figure class=[figure.panels.is_empty().then_some("table")] id=(figure.id) {
                    h3 { (figure.title) }
                    @if figure.panels.is_empty() { (rows(&figure.data, &figure.title)) } @else {
                        div.panels {
                            @for panel in &figure.panels { (drawing(panel, &figure.title)) }
                        }
                    }
                    figcaption { (marked(&figure.caption)) (self.origin(figure)) }
                }
            },
            Block::Pictures(pictures) => html! {
                div.pictures {
                    @for Picture { name, png, line } in pictures {
                        div {
                            img src={ "data:image/png;base64," (STANDARD.encode(png)) } alt=(name);
                            strong { (name) } span { (line) }
                        }
                    }
                }
            },
        }
    }

    /// The command that remakes a figure or table, and links to its numbers.
    fn origin(&self, Figure { id, panels, .. }: &Figure) -> Markup {
        html! {
            div.origin {
                @if !self.command.is_empty() { code { (self.command) } }
                @if self.files {
                    " " a href={ (id) ".csv" } { (id) ".csv" }
                    @if !panels.is_empty() { " " a href={ (id) ".svg" } { (id) ".svg" } }
                }
            }
        }
    }
}

/// A drawing, and another one for a phone; the style shows one of them.
fn drawing(panel: &Svg, title: &str) -> Markup {
    html! {
        div.panel.wide[panel.width > 400] style={ "--width:" (panel.width) "px" } role="img" aria-label=(title) {
            @match &panel.narrow {
                None => (PreEscaped(&panel.text)),
                Some(narrow) => {
                    div.natural { (PreEscaped(&panel.text)) }
                    div.narrow { (PreEscaped(narrow)) }
                }
            }
        }
    }
}

/// Text of which what stands between backticks is code.
fn marked(text: &str) -> Markup {
    html! {
        @for (index, part) in text.split('`').enumerate() {
            @if index % 2 == 1 { code { (part) } } @else { (part) }
        }
    }
}

fn rows(data: &Results, title: &str) -> Markup {
    let numeric: Vec<bool> = (0..data.columns.len()).map(|column| data.is_numeric(column)).collect();
    html! {
        div.scroll tabindex="0" role="region" aria-label=(title) {
            table {
                thead {
                    tr { @for (name, numeric) in data.columns.iter().zip(&numeric) {
                        // A column of row headings may have no name of its own, and then nothing to click.
                        @if name.is_empty() { td {} } @else {
                            th scope="col" class=[numeric.then_some("number")] { button type="button" { (name) } }
                        }
                    } }
                }
                tbody {
                    @for row in &data.rows {
                        tr { @for (cell, numeric) in row.iter().zip(&numeric) {
                            @let within = cell.shown().starts_with("  ").then_some("within");
                            td class=[numeric.then_some("number").or(within)] data-value=[cell.numbers().0] { (cell.shown()) }
                        } }
                    }
                }
            }
        }
    }
}

/// Results as CSV, a header line first. A column with an uncertainty becomes two.
///
/// # Errors
/// If the CSV library refuses, which it has no reason to.
fn csv(data: &Results) -> Result<Vec<u8>> {
    let has_spread = |value: &Value| matches!(value, Value::Spread(..) | Value::PercentSpread(..));
    let has_spread = |column: usize| data.rows.iter().any(|row| has_spread(&row[column]));
    let spread: Vec<bool> = (0..data.columns.len()).map(has_spread).collect();
    let number = |number: Option<f64>| number.map_or_else(String::new, |number| number.to_string());
    let fields = |value: &Value| match (value, value.numbers()) {
        (Value::Text(text), _) => [text.clone(), String::new()],
        (_, (value, spread)) => [number(value), number(spread)],
    };
    let names = data.columns.iter().map(|name| [name.clone(), format!("{name} ±")]).collect();
    let rows = data.rows.iter().map(|row| row.iter().map(fields).collect());
    let refused = |error: &dyn std::error::Error| bug(format!("cannot write CSV: {error}"));
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in std::iter::once(names).chain(rows) {
        let row: Vec<[String; 2]> = row;
        let columns = row.into_iter().zip(&spread);
        let fields = columns.flat_map(|(fields, &spread)| fields.into_iter().take(1 + usize::from(spread)));
        writer.write_record(fields).map_err(|error| refused(&error))?;
    }
    writer.into_inner().map_err(|error| refused(&error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::row;

    #[test]
    fn csv_quotes_and_gives_uncertainties_their_own_column() {
        let mut data = Results::new(["object", "accuracy"]);
        data.push(row!["a, b", Value::PercentSpread(0.75, 0.01, 1)]);
        data.push(["c"]);
        assert_eq!(
            String::from_utf8(csv(&data).unwrap()).unwrap(),
            "object,accuracy,accuracy ±\n\"a, b\",0.75,0.01\nc,,\n"
        );
    }

    /// A page of one table.
    fn page(title: &str, caption: &str, data: Results) -> Page {
        let mut section = Section::new("one", "One & only");
        section.figure(Figure::new("t", "T", caption, data));
        let (title, command) = (title.into(), "palpate report a b".into());
        let facts = vec![("seed".into(), "1".into())];
        Page { title, summary: String::new(), command, sections: vec![section], facts, files: true }
    }

    #[test]
    fn a_page_escapes_what_it_is_given_and_holds_everything_itself() {
        let mut data = Results::new(["name", "value"]);
        data.push(row!["<b>", 2_usize]);
        let html = page("A <page>", "See `palpate calibrate <model>`.", data).html();
        for part in [
            "A &lt;page&gt;",
            "&lt;b&gt;",
            "One &amp; only",
            "data-value=\"2\"",
            "href=\"t.csv\"",
            "palpate report a b",
            "See <code>palpate calibrate &lt;model&gt;</code>.",
        ] {
            assert!(html.contains(part), "{part}");
        }
        for part in ["http:", "https:", "url(", "@import", "<link rel=\"stylesheet\"", "src=\"/"] {
            assert!(!html.contains(part), "{part}");
        }
    }

    #[test]
    fn panels_are_tiled_into_one_drawing() {
        let text = "<svg width=\"500\" height=\"100\"></svg>\n".into();
        let panel = Svg { text, width: 500, height: 100, narrow: None };
        let figure = Figure::new("f", "", "", Results::default()).drawn(vec![panel; 3]);
        let whole = figure.whole_svg();
        assert_eq!((whole.width, whole.height), (1000, 200));
        assert!(whole.text.contains("<svg x=\"500\" y=\"0\"") && whole.text.contains("<svg x=\"0\" y=\"100\""));
    }
}
