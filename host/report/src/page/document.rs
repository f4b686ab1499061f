//! A page of sections: one HTML file with its style, script, drawings and pictures inside.

use super::table::{Cell, Records};
use super::{chart::Svg, html};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, PreEscaped, html};
use palpate::error::Result;
use palpate::output;
use std::path::{Path, PathBuf};

/// The page's style.
pub(crate) const STYLE: &str = include_str!("page.css");

/// A figure: drawings side by side, with the numbers behind them. One without drawings shows its numbers: a table.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    /// Its anchor, and its files' stem.
    pub(crate) id: String,
    title: String,
    caption: String,
    panels: Vec<Svg>,
    data: Records,
}

impl Figure {
    /// A table without a caption.
    pub(crate) fn new(id: &str, title: impl Into<String>, data: Records) -> Self {
        Self { id: id.into(), title: title.into(), caption: String::new(), panels: Vec::new(), data }
    }

    /// Draws the numbers.
    pub(crate) fn panels(self, panels: impl IntoIterator<Item = Svg>) -> Self {
        Self { panels: panels.into_iter().collect(), ..self }
    }

    /// States how to read it, and how it was made.
    pub(crate) fn caption(self, caption: impl Into<String>) -> Self {
        Self { caption: caption.into(), ..self }
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
pub(crate) enum Block {
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
pub(crate) struct Section {
    /// Its anchor.
    pub(crate) id: String,
    /// Its heading.
    pub(crate) title: String,
    /// Contents of the section.
    pub(crate) blocks: Vec<Block>,
}

impl Section {
    /// An empty section.
    pub(crate) fn new(id: &str, title: &str) -> Self {
        Self { id: id.to_string(), title: title.to_string(), blocks: Vec::new() }
    }

    /// Adds a paragraph.
    pub(crate) fn text(&mut self, text: impl Into<String>) -> &mut Self {
        self.blocks.push(Block::Text(text.into()));
        self
    }

    /// Adds a paragraph about what may make the figures wrong.
    pub(crate) fn warning(&mut self, text: impl Into<String>) -> &mut Self {
        self.blocks.push(Block::Warning(text.into()));
        self
    }

    /// Adds a figure or a table.
    pub(crate) fn figure(&mut self, figure: Figure) -> &mut Self {
        self.blocks.push(Block::Figure(figure));
        self
    }
}

/// A whole page.
#[derive(Clone, Debug)]
pub struct Page {
    /// Its title.
    pub(crate) title: String,
    /// One or two sentences below the title.
    pub(crate) summary: String,
    /// The command that remakes its figures and tables.
    pub(crate) command: String,
    /// The sections, in order.
    pub(crate) sections: Vec<Section>,
    /// The footer: settings and version, as name and value.
    pub(crate) facts: Vec<(String, String)>,
    /// True if the files of figures and tables are written next to the page and linked.
    pub(crate) files: bool,
}

impl Page {
    /// All figures and tables, in order.
    pub(crate) fn figures(&self) -> impl Iterator<Item = &Figure> {
        let blocks = self.sections.iter().flat_map(|section| &section.blocks);
        blocks.filter_map(|block| if let Block::Figure(figure) = block { Some(figure) } else { None })
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
    /// The page comes last, each file whole or not at all. Returns what was written. Files that Palpate did not write are not
    /// replaced, and then none is: those of figures and tables are its own if the page that is there links them, or if their first
    /// line is the same.
    ///
    /// # Errors
    /// [`palpate::Error::Io`] naming the file, and [`Foreign`](palpate::error::Foreign).
    pub fn write(&self, path: &Path) -> Result<Vec<PathBuf>> {
        output::refuse_foreign(path)?;
        let mut files = Vec::new();
        if self.files {
            for figure in self.figures() {
                if !figure.panels.is_empty() {
                    files.push((format!("{}.svg", figure.id), figure.whole_svg().text.into_bytes()));
                }
                files.push((format!("{}.csv", figure.id), figure.data.csv()?));
            }
        }
        let before = if self.files { std::fs::read_to_string(path).unwrap_or_default() } else { String::new() };
        let is_linked = |name: &str| before.contains(&format!("href=\"{name}\""));
        for (name, bytes) in files.iter().filter(|(name, _)| !is_linked(name)) {
            output::refuse_unlike(&path.with_file_name(name), bytes)?;
        }
        let mut written = Vec::new();
        for (name, bytes) in files {
            let file = path.with_file_name(name);
            output::replace_whole(&file, |out| out.write_all(&bytes))?;
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
            Block::Figure(figure) => {
                let is_table = figure.panels.is_empty();
                html! {
                    figure.table[is_table] id=(figure.id) {
                        h3 { (figure.title) }
                        @if is_table { (rows(&figure.data, &figure.title)) } @else {
                            div.panels { @for panel in &figure.panels { (drawing(panel, &figure.title)) } }
                        }
                        figcaption { (marked(&figure.caption)) (self.origin(&figure.id, !is_table)) }
                    }
                }
            }
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
    fn origin(&self, id: &str, drawn: bool) -> Markup {
        html! {
            div.origin {
                @if !self.command.is_empty() { code { (self.command) } }
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
    // A column reads as numbers if none of its cells is words.
    let numeric: Vec<bool> = (0..data.columns.len())
        .map(|column| !data.rows.iter().any(|row| matches!(row[column], Cell::Text(_))))
        .collect();
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
                            td class=[numeric.then_some("number")] data-value=[cell.value()] { (cell.shown()) }
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

    #[test]
    fn a_page_escapes_what_it_is_given_and_holds_everything_itself() {
        let mut section = Section::new("one", "One & only");
        let mut data = Records::new(["name", "value"]);
        data.push(["<b>".into(), Cell::Number(2.0, 0)]);
        section.figure(Figure::new("t", "T", data).caption("See `palpate calibrate <model>`."));
        let page = Page {
            title: "A <page>".into(),
            summary: String::new(),
            command: "palpate report a b".into(),
            sections: vec![section],
            facts: vec![("seed".into(), "1".into())],
            files: true,
        };
        let html = page.html();
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
    fn tables_that_the_page_links_are_replaced_with_it_and_foreign_ones_keep_it_from_being_written() {
        let directory = tempfile::tempdir().unwrap();
        let (path, csv) = (directory.path().join("index.html"), directory.path().join("t.csv"));
        let page = |columns: [&str; 2]| {
            let mut section = Section::new("one", "One");
            let data = Records::new(columns);
            section.figure(Figure::new("t", "T", data));
            Page {
                title: "A".into(),
                summary: String::new(),
                command: String::new(),
                sections: vec![section],
                facts: Vec::new(),
                files: true,
            }
        };
        std::fs::write(&csv, "mine,yours\n").unwrap();
        let error = page(["name", "value"]).write(&path).unwrap_err();
        assert!(error.to_string().contains("t.csv: a file is there already that Palpate did not write"), "{error}");
        assert_eq!((path.exists(), std::fs::read_to_string(&csv).unwrap()), (false, "mine,yours\n".into()));
        std::fs::remove_file(&csv).unwrap();
        for columns in [["name", "value"], ["name", "other"]] {
            assert_eq!(page(columns).write(&path).unwrap().len(), 2);
            assert_eq!(std::fs::read_to_string(&csv).unwrap(), columns.join(",") + "\n");
        }
        // Left by a report that was interrupted before its page was written.
        std::fs::remove_file(&path).unwrap();
        page(["name", "other"]).write(&path).unwrap();
        std::fs::write(&path, "<html>mine</html>").unwrap();
        assert!(page(["name", "other"]).write(&path).unwrap_err().to_string().contains("index.html: a file is there"));
    }

    #[test]
    fn panels_are_tiled_into_one_drawing() {
        let text = "<svg width=\"500\" height=\"100\"></svg>\n".into();
        let panel = Svg { text, width: 500, height: 100, narrow: None };
        let figure = Figure::new("f", String::new(), Records::default()).panels(vec![panel; 3]);
        let whole = figure.whole_svg();
        assert_eq!((whole.width, whole.height), (1000, 200));
        assert!(whole.text.contains("<svg x=\"500\" y=\"0\"") && whole.text.contains("<svg x=\"0\" y=\"100\""));
    }
}
