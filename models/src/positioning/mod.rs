//! Positioning of one axis: accuracy and repeatability by ISO 230-2 and VDI/DGQ 3441, with their
//! uncertainties, and the drift of the deviations over time.
//!
//! Targets are in mm and deviations (actual less target position) in µm; of a rotary axis they are
//! in degrees and seconds of arc. Nothing here converts one into the other.

mod dependence;
mod drift;
mod figures;
mod readings;
mod simulate;
mod uncertainty;

use crate::missing::heights;
use dependence::Dependence;
pub use dependence::Scatter;
pub use drift::Drift;
pub use figures::{Figure, FigureValues, Profile};
pub use readings::{Deviations, Direction, Missing, PositioningError, Reading, Targets};
pub use simulate::{PositioningSimulation, Truth, simulate};
use uncertainty::Means;
pub use uncertainty::{COVERAGE, FigureUncertainty, Influences, NoUncertainty};

/// What one test of an axis tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Positioning {
    /// The deviations by target, direction and run.
    pub deviations: Deviations,
    /// Whether means are of readings less the heights of their runs: where readings are missing and the runs lie at
    /// heights of their own, a target would else be off by what the run that it lacks would have added.
    pub freed_of_heights: bool,
    /// Mean and standard deviation at each target and direction.
    pub profile: Profile,
    /// The figures of both standards.
    pub values: FigureValues,
    /// The uncertainty of each figure, or why there is none.
    pub uncertainties: Vec<(Figure, Result<FigureUncertainty, NoUncertainty>)>,
    /// Scatter of one reading, and whether readings are alike; absent with one run.
    pub scatter: Option<Scatter>,
    /// Drift common to all targets; absent without times, or where they do not tell it.
    pub drift: Option<Drift>,
}

impl Positioning {
    /// Value of a figure, where the data tell it.
    #[must_use]
    pub fn value(&self, figure: Figure) -> Option<f64> {
        self.values.get(figure)
    }

    /// Expanded uncertainty of a figure, or why there is none. Absent where the figure itself is.
    #[must_use]
    pub fn uncertainty(&self, figure: Figure) -> Option<Result<f64, NoUncertainty>> {
        let found = self.uncertainties.iter().find(|(f, _)| *f == figure)?;
        Some(found.1.map(|uncertainty| uncertainty.expanded))
    }

    /// Standard uncertainty of a figure: root mean square of the errors of simulated tests (GUM Supplement 1, 7.6).
    /// Absent where there is none.
    #[must_use]
    pub fn standard_uncertainty(&self, figure: Figure) -> Option<f64> {
        let found = self.uncertainties.iter().find(|(f, _)| *f == figure)?;
        found.1.ok().map(|uncertainty| uncertainty.standard)
    }
}

/// Works out the figures of a test with their uncertainties. The same `seed` gives the same
/// uncertainties.
///
/// # Errors
/// Readings that are not those of a whole test: see [`PositioningError`].
pub fn analyse(
    readings: &[Reading],
    influences: &Influences,
    seed: u64,
) -> Result<Positioning, PositioningError> {
    let deviations = Deviations::new(readings)?;
    let scatter = Scatter::of(&deviations);
    let drift = Drift::of(readings);
    let dependence = Dependence::of(scatter.as_ref(), drift.as_ref());
    let freed_of_heights = !deviations.missing.is_empty() && dependence.by_run();
    let heights = match freed_of_heights {
        true => heights(deviations.rows(), deviations.runs),
        false => Vec::new(),
    };
    let profile = Profile::above(&deviations, &heights);
    let values = FigureValues::of(&profile);
    if values.iter().any(|(_, v)| !v.is_finite()) {
        return Err(PositioningError::TooLarge);
    }
    let means = Means {
        profile: &profile,
        heights: &heights,
    };
    let uncertainties = uncertainty::expanded(&deviations, &means, &dependence, influences, seed);
    Ok(Positioning {
        drift,
        deviations,
        freed_of_heights,
        profile,
        values,
        uncertainties,
        scatter,
    })
}
