//! What a report page is made of. A command fills these types; [`Page::render`] writes the HTML.

use super::number;
use super::plot::Plot;
use super::table::Table;

/// How the outcome stands, shown beside the summary in a word and a colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// Solved, and nothing speaks against the model.
    Good,
    /// Solved, with something the reader has to weigh.
    Caution,
    /// Not solved, or not to be relied on.
    Bad,
    /// No judgement attached.
    Neutral,
}

impl Standing {
    /// The word shown with it, so that the colour is never the only sign.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Good => "Result",
            Self::Caution => "Result, with reservations",
            Self::Bad => "Not to be relied on",
            Self::Neutral => "Summary",
        }
    }
}

/// A report: a heading, one sentence that answers the question, sections, and where it came from.
#[derive(Debug, Clone)]
pub struct Page {
    pub(super) title: String,
    pub(super) subtitle: String,
    pub(super) standing: Standing,
    pub(super) summary: String,
    pub(super) sections: Vec<Section>,
    pub(super) provenance: Provenance,
}

impl Page {
    /// An empty page; `subtitle` names the data it is about.
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            subtitle: subtitle.into(),
            standing: Standing::Neutral,
            summary: String::new(),
            sections: Vec::new(),
            provenance: Provenance::default(),
        }
    }

    /// The sentence a person acts on, and how the outcome stands.
    #[must_use]
    pub fn summary(mut self, standing: Standing, sentence: impl Into<String>) -> Self {
        self.standing = standing;
        self.summary = sentence.into();
        self
    }

    /// Adds a section; one without blocks is left out.
    #[must_use]
    pub fn section(mut self, section: Section) -> Self {
        if !section.blocks.is_empty() {
            self.sections.push(section);
        }
        self
    }

    /// The sections of another page behind those of this one, under a heading with its sentence.
    #[must_use]
    pub fn followed_by(mut self, heading: impl Into<String>, other: Self) -> Self {
        self.sections
            .push(Section::new(heading).paragraph(other.summary));
        self.sections.extend(other.sections);
        self
    }

    /// How the outcome stands, and the sentence a person acts on.
    pub fn told(&self) -> (Standing, &str) {
        (self.standing, &self.summary)
    }

    /// The title of the page.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The figures, in the order of the page.
    pub fn figures(&self) -> impl Iterator<Item = &Figure> {
        let blocks = self.sections.iter().flat_map(|section| &section.blocks);
        blocks.filter_map(|block| match block {
            Block::Figure(figure) => Some(&**figure),
            _ => None,
        })
    }

    /// Sets what the page was made from.
    #[must_use]
    pub fn provenance(mut self, provenance: Provenance) -> Self {
        self.provenance = provenance;
        self
    }
}

/// A heading and what stands under it.
#[derive(Debug, Clone)]
pub struct Section {
    pub(super) heading: String,
    pub(super) blocks: Vec<Block>,
}

impl Section {
    /// An empty section.
    pub fn new(heading: impl Into<String>) -> Self {
        Self {
            heading: heading.into(),
            blocks: Vec::new(),
        }
    }

    /// Adds any block.
    #[must_use]
    pub fn block(mut self, block: Block) -> Self {
        self.blocks.push(block);
        self
    }

    /// Adds a paragraph.
    #[must_use]
    pub fn paragraph(self, text: impl Into<String>) -> Self {
        self.block(Block::Paragraph(text.into()))
    }

    /// Adds a list of points.
    #[must_use]
    pub fn list<T: Into<String>>(self, items: impl IntoIterator<Item = T>) -> Self {
        self.block(Block::List(items.into_iter().map(Into::into).collect()))
    }

    /// Adds the figures a reader looks for first.
    #[must_use]
    pub fn key_figures(self, figures: impl IntoIterator<Item = KeyFigure>) -> Self {
        self.block(Block::KeyFigures(figures.into_iter().collect()))
    }

    /// Adds a table.
    #[must_use]
    pub fn table(self, table: Table) -> Self {
        self.block(Block::Table(table))
    }

    /// Adds a plot with its caption.
    #[must_use]
    pub fn figure(self, figure: Figure) -> Self {
        self.block(Block::Figure(Box::new(figure)))
    }

    /// Adds something worth knowing.
    #[must_use]
    pub fn note(self, text: impl Into<String>) -> Self {
        self.block(Block::Note(text.into()))
    }

    /// Adds something to be careful about.
    #[must_use]
    pub fn warning(self, text: impl Into<String>) -> Self {
        self.block(Block::Warning(text.into()))
    }

    /// Adds text kept as it is, such as a set-up file.
    #[must_use]
    pub fn verbatim(self, text: impl Into<String>) -> Self {
        self.block(Block::Verbatim(text.into()))
    }
}

/// One thing in a section. All text is plain: it is escaped when the page is written.
#[derive(Debug, Clone)]
pub enum Block {
    /// Running text.
    Paragraph(String),
    /// Points.
    List(Vec<String>),
    /// Large numbers with unit, uncertainty and meaning.
    KeyFigures(Vec<KeyFigure>),
    /// A table.
    Table(Table),
    /// A plot with its caption.
    Figure(Box<Figure>),
    /// Worth knowing.
    Note(String),
    /// To be careful about.
    Warning(String),
    /// Text kept as it is.
    Verbatim(String),
}

/// A quantity with its uncertainty, shown large.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyFigure {
    pub(super) name: String,
    pub(super) value: f64,
    pub(super) std: Option<f64>,
    pub(super) digits: usize,
    pub(super) unit: String,
    pub(super) meaning: String,
}

impl KeyFigure {
    /// A value in the unit in which it is shown (convert before).
    pub fn new(name: impl Into<String>, value: f64, unit: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            value,
            std: None,
            digits: 3,
            unit: unit.into(),
            meaning: String::new(),
        }
    }

    /// Its standard uncertainty (k = 1), in the same unit.
    #[must_use]
    pub const fn std(mut self, std: f64) -> Self {
        self.std = Some(std);
        self
    }

    /// Significant digits of a value without an uncertainty; three otherwise.
    #[must_use]
    pub const fn digits(mut self, digits: usize) -> Self {
        self.digits = digits;
        self
    }

    /// The value as people read it, without its unit.
    pub(super) fn text(&self) -> String {
        match self.std {
            Some(std) => number::measured(self.value, Some(std)),
            None => number::plain(self.value, self.digits),
        }
    }

    /// What the value means, in a few words.
    #[must_use]
    pub fn meaning(mut self, meaning: impl Into<String>) -> Self {
        self.meaning = meaning.into();
        self
    }
}

/// A plot with a heading and a caption that says what there is to see.
#[derive(Debug, Clone)]
pub struct Figure {
    pub(super) title: String,
    pub(super) caption: String,
    pub(super) plot: Plot,
}

impl Figure {
    /// Its heading.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// What there is to see.
    pub fn caption(&self) -> &str {
        &self.caption
    }

    /// What is drawn.
    pub const fn plot(&self) -> &Plot {
        &self.plot
    }

    /// A figure; the caption is a sentence or two of plain text.
    pub fn new(
        title: impl Into<String>,
        caption: impl Into<String>,
        plot: impl Into<Plot>,
    ) -> Self {
        Self {
            title: title.into(),
            caption: caption.into(),
            plot: plot.into(),
        }
    }
}

/// Where a page came from: enough to make it again. Nothing here is looked up while the page is
/// written, so the same answer always gives the same bytes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// The command line as it was given.
    pub command: String,
    /// Name and SHA-256 (hexadecimal) of each input file.
    pub inputs: Vec<(String, String)>,
    /// Seed of the random numbers, where any were drawn.
    pub seed: Option<u64>,
    /// Date and time in words, if the caller wants them on the page.
    pub date: Option<String>,
}
