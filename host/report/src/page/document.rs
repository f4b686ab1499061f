//! A page of sections: one HTML file with its style, script, drawings and pictures inside.

use super::table::{Cell, Records, Table};
use super::{chart::Svg, html};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use palpate::error::Result;
use palpate::output;
use std::path::{Path, PathBuf};

/// The page's style.
pub(crate) const STYLE: &str = include_str!("page.css");

/// A figure: one or more drawings side by side, with the numbers behind them.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Its anchor, and its files' stem.
    pub id: String,
    /// Title of the figure.
    pub title: String,
    /// Caption: how to read it, and how it was made.
    pub caption: String,
    /// The command that remakes it.
    pub command: String,
    /// Its drawings, at least one.
    pub panels: Vec<Svg>,
    /// The numbers drawn.
    pub data: Records,
}

impl Figure {
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
    /// A figure.
    Figure(Figure),
    /// A table.
    Table(Table),
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

    /// Adds a figure.
    pub fn figure(&mut self, figure: Figure) -> &mut Self {
        self.blocks.push(Block::Figure(figure));
        self
    }

    /// Adds a table.
    pub fn table(&mut self, table: Table) -> &mut Self {
        self.blocks.push(Block::Table(table));
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
    /// The sections, in order.
    pub sections: Vec<Section>,
    /// The footer: settings and version, as name and value.
    pub facts: Vec<(String, String)>,
    /// True if the files of figures and tables are written next to the page and linked.
    pub files: bool,
}

impl Page {
    /// All figures, in order.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        self.blocks().filter_map(|block| if let Block::Figure(figure) = block { Some(figure) } else { None })
    }

    /// All tables, in order.
    pub fn tables(&self) -> impl Iterator<Item = &Table> {
        self.blocks().filter_map(|block| if let Block::Table(table) = block { Some(table) } else { None })
    }

    fn blocks(&self) -> impl Iterator<Item = &Block> {
        self.sections.iter().flat_map(|section| &section.blocks)
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
        if self.files {
            for figure in self.figures() {
                files.push((format!("{}.svg", figure.id), figure.whole_svg().text.into_bytes()));
                files.push((format!("{}.csv", figure.id), figure.data.csv()?));
            }
            for table in self.tables() {
                files.push((format!("{}.csv", table.id), table.data.csv()?));
            }
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
                figure id=(figure.id) {
                    h3 { (figure.title) }
                    div.panels {
                        @for panel in &figure.panels { (drawing(panel, &figure.title)) }
                    }
                    figcaption { (marked(&figure.caption)) (self.origin(&figure.id, &figure.command, true)) }
                }
            },
            Block::Table(table) => html! {
                figure.table id=(table.id) {
                    h3 { (table.title) }
                    (rows(&table.data, &table.title))
                    figcaption { (marked(&table.caption)) (self.origin(&table.id, &table.command, false)) }
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
    fn origin(&self, id: &str, command: &str, drawn: bool) -> Markup {
        html! {
            div.origin {
                @if !command.is_empty() { code { (command) } }
                @if self.files {
                    " " a href={ (id) ".csv" } { (id) ".csv" }
                    @if drawn { " " a href={ (id) ".svg" } { (id) ".svg" } }
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

fn rows(data: &Records, title: &str) -> Markup {
    // A column reads as numbers unless most of its cells are words, such as "over 200".
    let words = |column: usize| data.rows.iter().filter(|row| matches!(row[column], Cell::Text(_))).count();
    let numeric: Vec<bool> = (0..data.columns.len()).map(|column| 2 * words(column) <= data.rows.len()).collect();
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
                            td class=[numeric.then_some("number").or(within)] data-value=[cell.value()] { (cell.shown()) }
                        } }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page of one table.
    fn page(title: &str, caption: &str, data: Records) -> Page {
        let mut section = Section::new("one", "One & only");
        let command = "palpate report a b".into();
        section.table(Table { id: "t".into(), title: "T".into(), caption: caption.into(), command, data });
        let facts = vec![("seed".into(), "1".into())];
        Page { title: title.into(), summary: String::new(), sections: vec![section], facts, files: true }
    }

    #[test]
    fn a_page_escapes_what_it_is_given_and_holds_everything_itself() {
        let mut data = Records::new(["name", "value"]);
        data.push(["<b>".into(), Cell::Number(2.0, 0)]);
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
        let figure = Figure {
            id: "f".into(),
            title: String::new(),
            caption: String::new(),
            command: String::new(),
            panels: vec![panel; 3],
            data: Records::default(),
        };
        let whole = figure.whole_svg();
        assert_eq!((whole.width, whole.height), (1000, 200));
        assert!(whole.text.contains("<svg x=\"500\" y=\"0\"") && whole.text.contains("<svg x=\"0\" y=\"100\""));
    }
}
