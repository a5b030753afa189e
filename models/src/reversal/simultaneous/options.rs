//! What a user may choose.

use errsep_solvers::loss::Loss;
use errsep_solvers::options::Options as Minimisation;

use crate::reversal::Convention;

/// How to fit.
#[derive(Debug, Clone)]
pub struct Options {
    /// Which contrasts of the slopes are tilts and which is held at zero.
    pub convention: Convention,
    /// Thickness (diameter) of the artefact.
    pub thickness: Thickness,
    /// Noise of a reading.
    pub noise: Noise,
    /// Break points of the forms.
    pub knots: Knots,
    /// Loss of a residual in units of its standard deviation; quadratic: least squares.
    pub loss: Loss,
    /// Tilts to begin with instead of those of the staged solution, rad, in the order of the fit.
    pub start_tilts_rad: Option<Vec<f64>>,
    /// Settings of each minimisation: tolerances, limits of passes and of time, a flag that stops it.
    pub minimisation: Minimisation,
    /// Effects that are unknowns of the fit too.
    pub effects: Vec<With>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            convention: Convention::default(),
            thickness: Thickness::default(),
            noise: Noise::default(),
            knots: Knots::default(),
            loss: Loss::default(),
            start_tilts_rad: None,
            minimisation: Minimisation::structured(),
            effects: Vec::new(),
        }
    }
}

/// An effect that joins the fit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct With {
    /// Its name in the catalogue.
    pub effect: String,
    /// Its variant in words, as [`FittedEffect`](super::FittedEffect) tells it; the best where `None`.
    pub variant: Option<String>,
    /// The values of its unknowns to begin with, in the units in which it has them; searched where
    /// `None`.
    pub start: Option<Vec<f64>>,
}

impl With {
    /// An effect by its name, all else searched.
    pub fn named(effect: impl Into<String>) -> Self {
        Self {
            effect: effect.into(),
            ..Self::default()
        }
    }
}

/// What is known of the artefact's thickness.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Thickness {
    /// Nothing: no shift between near and far probe points.
    #[default]
    NotKnown,
    /// Known, mm.
    Known(f64),
    /// To be fitted, from a first guess, mm. Determined only where tilts and forms are large.
    Fitted(f64),
}

/// What is known of the noise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Noise {
    /// Nothing: one standard deviation for all channels, unless neighbouring readings or repeats tell
    /// the channels apart.
    #[default]
    Estimated,
    /// The same in every channel, to be estimated.
    Equal,
    /// The standard deviation of one reading, µm.
    Declared(f64),
}

/// Where the forms' break points lie.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Knots {
    /// As many equal cells as the data support, by the corrected information criterion.
    #[default]
    Chosen,
    /// So many equal cells (fewer where cells would be without readings).
    Cells(usize),
    /// These break points, mm, for all forms.
    At(Vec<f64>),
}
