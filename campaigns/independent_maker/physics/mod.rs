//! Error sources as machines have them, each in realisations that differ in what a machine leaves free.
//!
//! A realisation is made from a size; the campaign chooses the size by what of it shows.

mod absorbed;
mod dirt;
mod geometry;
mod sensor;
mod setting;
mod slide;
mod stylus;
mod thermal;
mod zero;

use crate::chance::Chance;
use crate::forms::Form;
use crate::rig::Disturbance;

/// What a realisation may know of the measurement that it disturbs.
#[derive(Debug, Clone)]
pub struct Facts {
    /// Travel, mm.
    pub length: f64,
    /// Distance of positions, mm.
    pub spacing: f64,
    /// Last reading before and first reading after the spindle's turn, s.
    pub turn: [f64; 2],
    /// Last reading, s.
    pub end: f64,
    /// Greatest less smallest reading of the near and the far indicator, µm.
    pub span: [f64; 2],
    /// Greatest magnitude of a reading of the near and the far indicator, µm.
    pub reach: [f64; 2],
    /// Forms of the surfaces.
    pub surfaces: [Form; 2],
}

/// What a catalogue would state of a source, by the size of the source.
type SizeOf = Box<dyn Fn(f64) -> f64 + Send + Sync>;

/// One realisation, ready for any size.
pub struct Recipe {
    /// What it is, in a few words.
    pub what: &'static str,
    /// The source at a size.
    pub make: Box<dyn Fn(f64) -> Vec<Disturbance> + Send + Sync>,
    /// Where the search for a size begins, and the greatest that is possible.
    pub start: f64,
    pub most: f64,
    /// The size, and its unit, that a catalogue may state in the same sense.
    pub size: Option<(SizeOf, &'static str)>,
}

impl Recipe {
    fn new(
        what: &'static str,
        [start, most]: [f64; 2],
        make: impl Fn(f64) -> Vec<Disturbance> + Send + Sync + 'static,
    ) -> Self {
        Self {
            what,
            make: Box::new(make),
            start,
            most,
            size: None,
        }
    }

    fn sized(self, factor: f64, unit: &'static str) -> Self {
        self.sized_by(move |size| factor * size, unit)
    }

    fn sized_by(
        mut self,
        of: impl Fn(f64) -> f64 + Send + Sync + 'static,
        unit: &'static str,
    ) -> Self {
        self.size = Some((Box::new(of), unit));
        self
    }
}

/// One error source.
pub struct Source {
    /// Its name, that of the catalogue where it has one.
    pub name: &'static str,
    /// What kind of thing causes it; two effects at once come from two kinds.
    pub family: &'static str,
    /// How many realisations it has.
    pub realisations: usize,
    /// Whether four channels cannot show it, whatever its size.
    pub absorbed: bool,
    /// Whether the artefact stands at a great tilt and its thickness is not known.
    pub tilted: bool,
    /// Draws a realisation.
    pub recipe: fn(usize, &mut Chance, &Facts) -> Recipe,
}

const fn source(
    name: &'static str,
    family: &'static str,
    realisations: usize,
    recipe: fn(usize, &mut Chance, &Facts) -> Recipe,
) -> Source {
    Source {
        name,
        family,
        realisations,
        absorbed: false,
        tilted: false,
        recipe,
    }
}

const fn unseen(name: &'static str, recipe: fn(usize, &mut Chance, &Facts) -> Recipe) -> Source {
    Source {
        absorbed: true,
        ..source(name, "absorbed", 4, recipe)
    }
}

/// All error sources.
pub const SOURCES: [Source; 20] = [
    source("taper", "geometry", 4, geometry::taper),
    Source {
        tilted: true,
        ..source("thickness-shift", "geometry", 4, geometry::thickness)
    },
    source("off-crest", "geometry", 4, geometry::off_crest),
    source("reversal-shift", "setting", 4, setting::reversal_shift),
    source("gain-mismatch", "sensor", 4, sensor::gain),
    source("indicator-nonlinearity", "sensor", 5, sensor::curved),
    source("cyclic-error", "sensor", 6, sensor::cyclic),
    source("hysteresis", "stylus", 4, stylus::play),
    source("sticking-plunger", "stylus", 4, stylus::sticking_plunger),
    source("stick-slip", "stylus", 2, stylus::stick_slip),
    source("thermal-drift", "thermal", 6, thermal::drift),
    source("ambient-cycle", "thermal", 5, thermal::cycle),
    source("zero-jump", "zero", 4, zero::jump),
    source("local-contamination", "dirt", 5, dirt::bump),
    source("axis-backlash", "slide", 4, slide::backlash),
    source("lateral-backlash", "slide", 4, slide::lateral),
    unseen("gravity-sag", absorbed::sag),
    unseen("tip-radius", absorbed::tip),
    unseen("common-gain", absorbed::gain),
    unseen("indexing-error", setting::indexing),
];
