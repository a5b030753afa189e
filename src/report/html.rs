//! Writing a page as HTML. Every text goes through the template and is escaped there.

use super::page::{Block, Figure, KeyFigure, Page, Provenance, Section, Standing};
use super::plot::{Drawing, Thinned, page_style};
use super::table::{Cell, Order, Table};
use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::json;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
/// Nothing may be fetched, whatever stands in the page.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

impl Page {
    /// The page as one HTML file. The same page always gives the same bytes.
    pub fn render(&self) -> String {
        let mut values = Values::default();
        let sections: Vec<Markup> = self
            .sections
            .iter()
            .enumerate()
            .map(|(index, part)| section(part, index, &mut values))
            .collect();
        html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    meta http-equiv="Content-Security-Policy" content=(POLICY);
                    title { (self.title) " · " (self.subtitle) }
                    style { (PreEscaped(page_style())) (PreEscaped(STYLE)) }
                }
                body {
                    header {
                        h1 { (self.title) }
                        p class="subtitle" { (self.subtitle) }
                        @if !self.summary.is_empty() { (summary(self.standing, &self.summary)) }
                    }
                    @if self.sections.len() > 2 {
                        nav aria-label="Contents" {
                            ul {
                                @for (index, part) in self.sections.iter().enumerate() {
                                    li { a href={ "#section-" (index + 1) } { (part.heading) } }
                                }
                            }
                        }
                    }
                    main { @for part in &sections { (part) } }
                    (provenance(&self.provenance))
                    script type="application/json" id="plot-values" { (PreEscaped(values.into_json())) }
                    script { (PreEscaped(SCRIPT)) }
                }
            }
        }
        .into_string()
    }
}

/// What the pointer reads in each drawing, by the number of the drawing.
#[derive(Default)]
struct Values(Vec<serde_json::Value>);

impl Values {
    fn add(&mut self, values: serde_json::Value) -> usize {
        self.0.push(values);
        self.0.len() - 1
    }

    /// JSON in which no character can end the script element.
    fn into_json(self) -> String {
        json!(self.0)
            .to_string()
            .replace('<', "\\u003c")
            .replace('>', "\\u003e")
            .replace('&', "\\u0026")
    }
}

fn summary(standing: Standing, sentence: &str) -> Markup {
    let class = match standing {
        Standing::Good => "good",
        Standing::Caution => "caution",
        Standing::Bad => "bad",
        Standing::Neutral => "neutral",
    };
    // No line begins with the sign of a percentage.
    let whole = sentence.replace(" %", "\u{a0}%");
    html! {
        div class={ "summary " (class) } {
            strong { (standing.word()) }
            p { (whole) }
        }
    }
}

fn section(section: &Section, index: usize, values: &mut Values) -> Markup {
    html! {
        section id={ "section-" (index + 1) } {
            h2 { (section.heading) }
            @for part in &section.blocks { (block(part, values)) }
        }
    }
}

fn block(block: &Block, values: &mut Values) -> Markup {
    match block {
        Block::Paragraph(text) => html! { p { (text) } },
        Block::List(items) => html! { ul { @for item in items { li { (item) } } } },
        Block::KeyFigures(figures) => key_figures(figures),
        Block::Table(content) => table(content),
        Block::Figure(content) => figure(content, values),
        Block::Note(text) => html! { p class="note" { strong { "Note. " } (text) } },
        Block::Warning(text) => {
            html! { p class="note warning" { strong { "Take care. " } (text) } }
        }
        Block::Verbatim(text) => html! { pre tabindex="0" { (text) } },
    }
}

fn key_figures(figures: &[KeyFigure]) -> Markup {
    html! {
        dl class="key" {
            @for figure in figures {
                div {
                    dt { (figure.name) }
                    dd {
                        span class="value" { (figure.text()) }
                        @if figure.value.is_finite() && !figure.unit.is_empty() {
                            " " span class="unit" { (figure.unit) }
                        }
                        @if !figure.meaning.is_empty() {
                            span class="meaning" { (figure.meaning) }
                        }
                    }
                }
            }
        }
    }
}

fn table(table: &Table) -> Markup {
    let class = |k: usize| table.is_numeric(k).then_some("number");
    let decimals: Vec<Option<usize>> = (0..table.columns.len())
        .map(|k| table.common_decimals(k))
        .collect();
    let text = |k: usize, cell: &Cell| cell.text_with(decimals.get(k).copied().flatten());
    let sort = |k: usize| match table.sorted {
        Some((column, Order::Ascending)) if column == k => Some("ascending"),
        Some((column, Order::Descending)) if column == k => Some("descending"),
        _ => None,
    };
    html! {
        div class="scroll" {
            table {
                @if !table.caption.is_empty() { caption { (table.caption) } }
                thead {
                    tr {
                        @for (k, column) in table.columns.iter().enumerate() {
                            th scope="col" class=[class(k)] aria-sort=[sort(k)] { (column) }
                        }
                    }
                }
                tbody {
                    @for row in &table.rows {
                        tr {
                            @for (k, entry) in row.iter().enumerate() {
                                @if k == 0 {
                                    th scope="row" class=[class(k)] data-value=[sort_key(entry)] { (text(k, entry)) }
                                } @else {
                                    td class=[class(k)] data-value=[sort_key(entry)] { (text(k, entry)) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The number by which the script sorts a cell.
fn sort_key(cell: &Cell) -> Option<f64> {
    cell.value().filter(|v| v.is_finite())
}

fn figure(figure: &Figure, values: &mut Values) -> Markup {
    let drawings = figure.plot.drawings();
    let thinned = drawings
        .iter()
        .filter_map(|d| d.thinned)
        .reduce(Thinned::and);
    let class = match &drawings[..] {
        [only] if only.is_small() => "plots small",
        [_] | [] => "plots",
        _ => "plots panels",
    };
    html! {
        figure {
            h3 { (figure.title) }
            div class=(class) {
                @for drawing in drawings { (svg(drawing, values)) }
            }
            figcaption {
                (figure.caption)
                @if let Some(thinned) = thinned { " " (thinned.words()) }
            }
        }
    }
}

fn svg(drawing: Drawing, values: &mut Values) -> Markup {
    let (width, height) = drawing.size;
    let id = drawing.values.map(|v| values.add(v));
    // Enlarged beyond this the text would outgrow that of the page.
    let limited = format!("max-width:{:.0}px", 1.15 * width);
    html! {
        div class=(if drawing.spans { "drawing legend-row" } else { "drawing" }) {
            svg class="plot" role="img" aria-label=(drawing.alt) viewBox={ "0 0 " (width) " " (height) }
                style=(limited)
                data-values=[id] tabindex=[id.map(|_| 0)] { (drawing.body) }
        }
    }
}

fn provenance(provenance: &Provenance) -> Markup {
    html! {
        footer {
            h2 { "Where this came from" }
            dl {
                @if !provenance.version.is_empty() {
                    dt { "Program" } dd { "errsep " (provenance.version) }
                }
                @if !provenance.command.is_empty() {
                    dt { "Command" } dd { code { (provenance.command) } }
                }
                @for (name, hash) in &provenance.inputs {
                    dt { "Input" } dd { (name) br; span class="hash" { "SHA-256 " (hash) } }
                }
                @if let Some(seed) = provenance.seed {
                    dt { "Seed" } dd { (seed) }
                }
                @if let Some(date) = &provenance.date {
                    dt { "Date" } dd { (date) }
                }
            }
        }
    }
}
