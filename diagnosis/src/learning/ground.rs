//! What a smooth curve may be a function of, and its cubic B-splines over that.

use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::{DMatrix, DVector};

use crate::catalogue::curve::{Along, Way};

/// *Limit.* Cells of one curve: waves shorter than two of them are not resolved.
const MOST_CELLS: usize = 24;
/// *Limit.* Unknowns of all curves together.
const MOST_UNKNOWNS: usize = 260;
/// Different values below which there is no curve.
const FEWEST_VALUES: usize = 5;

/// One way to bind a gap: along what, and by how many curves.
pub(super) struct Ground {
    pub along: Along,
    /// Channel and direction of each curve, where it does not belong to all.
    pub curves: Vec<(Option<usize>, Option<Way>)>,
    /// The curve of every reading.
    curve_of: Vec<usize>,
    /// What it is a function of, for every reading.
    values: Vec<f64>,
    pub basis: CubicBSpline,
}

impl Ground {
    /// All ways of a model, those of few curves first, and of these what is the same in another campaign.
    pub fn all(model: &AnyModel) -> Vec<Self> {
        let backward = model.places().iter().any(|p| p.direction < 0.0);
        let forward = model.places().iter().any(|p| p.direction >= 0.0);
        let both = backward && forward;
        let channels = model.channel_names().len();
        let mut grounds = Vec::new();
        for by_channel in [false, true] {
            // A reading's zero and slope are other ones in another campaign.
            for along in [Along::Position, Along::Time, Along::Reading] {
                for by_direction in [false, true] {
                    // Within a channel the reading follows the position: the parts of a curve that
                    // the model absorbs there are other ones where tilts or forms are.
                    let told = (!by_direction || (both && along == Along::Position))
                        && !(by_channel && along == Along::Reading);
                    if told && (!by_channel || channels > 1) {
                        grounds.extend(Self::new(model, along, by_direction, by_channel));
                    }
                }
            }
        }
        grounds.sort_by_key(|g| g.curves.len());
        grounds
    }

    fn new(model: &AnyModel, along: Along, by_direction: bool, by_channel: bool) -> Option<Self> {
        let values = along.values(model);
        let mut curves = Vec::new();
        let mut curve_of = Vec::with_capacity(values.len());
        for place in model.places() {
            let channel = by_channel.then_some(place.channel);
            let own = (channel, by_direction.then(|| Way::of(place)));
            let at = curves.iter().position(|c| *c == own).unwrap_or_else(|| {
                curves.push(own);
                curves.len() - 1
            });
            curve_of.push(at);
        }
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let (low, high) = (*sorted.first()?, *sorted.last()?);
        sorted.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * (high - low));
        if sorted.len() < FEWEST_VALUES {
            return None;
        }
        let room = (MOST_UNKNOWNS / curves.len()).saturating_sub(3);
        let cells = (sorted.len() / 2).min(MOST_CELLS).min(room);
        if cells < 2 {
            return None;
        }
        Some(Self {
            along,
            curves,
            curve_of,
            values,
            basis: CubicBSpline::uniform(low, high, cells).ok()?,
        })
    }

    /// Whether every channel has curves of its own.
    pub fn by_channel(&self) -> bool {
        self.curves.iter().any(|c| c.0.is_some())
    }

    /// Whether each direction has curves of its own.
    pub fn by_direction(&self) -> bool {
        self.curves.iter().any(|c| c.1.is_some())
    }

    /// In words.
    pub fn name(&self) -> String {
        let along = if self.by_direction() {
            "position and direction"
        } else {
            self.along.name()
        };
        let own = if self.by_channel() {
            ", each channel by itself"
        } else {
            ""
        };
        format!("{along}{own}")
    }

    /// Coefficients of one curve.
    fn each(&self) -> usize {
        self.basis.coefficient_count()
    }

    /// The change of every reading per coefficient, readings × unknowns.
    pub fn columns(&self) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(self.values.len(), self.each() * self.curves.len());
        for (row, (value, curve)) in self.values.iter().zip(&self.curve_of).enumerate() {
            let (first, values) = self.basis.values(*value);
            for (k, v) in values.iter().enumerate() {
                columns[(row, curve * self.each() + first + k)] = *v;
            }
        }
        columns
    }

    /// The coefficients that a curve's prior gives one standard deviation each, unknowns × unknowns.
    ///
    /// Coefficients c of one curve have the precision D₂ᵀD₂ + (π/K)⁴ with D₂ their second differences and K
    /// their number (P-splines: Eilers and Marx, Statist. Sci. 11 (1996) 89): the spectrum of an integrated
    /// random walk that ends at the half wave over the whole range, so that level and slope are bounded too.
    pub fn prior(&self) -> Option<DMatrix<f64>> {
        let n = self.each();
        let mut precision = DMatrix::identity(n, n) * (std::f64::consts::PI / n as f64).powi(4);
        let differences = errsep_solvers::regularization::Penalty::SecondDifference.matrix(n);
        precision += differences.tr_mul(&differences);
        let root = precision.cholesky()?.l().transpose();
        let one = root.solve_upper_triangular(&DMatrix::identity(n, n))?;
        let mut all = DMatrix::zeros(n * self.curves.len(), n * self.curves.len());
        for curve in 0..self.curves.len() {
            all.view_mut((curve * n, curve * n), (n, n)).copy_from(&one);
        }
        Some(all)
    }

    /// Places along a curve at which it is told, four in each cell.
    pub fn points(&self) -> Vec<f64> {
        let breaks = self.basis.breaks();
        let mut points: Vec<f64> = breaks
            .windows(2)
            .flat_map(|w| (0..4).map(move |k| w[0] + (w[1] - w[0]) * f64::from(k) / 4.0))
            .collect();
        points.extend(breaks.last());
        points
    }

    /// One curve with some coefficients, at its points.
    pub fn curve(&self, which: usize, coefficients: &DVector<f64>) -> Vec<f64> {
        let n = self.each();
        let own = &coefficients.as_slice()[which * n..(which + 1) * n];
        let at = |value: &f64| self.basis.evaluate(own, *value).0;
        self.points().iter().map(at).collect()
    }
}
