//! Where each unknown of a design stands in the fit.
//!
//! Band: the coefficients of the fitted forms, interleaved by knot; the first and the last of each form
//! are zero, which takes every straight line out of the splines. Border: slopes, slopes common to a
//! position of the spindle (held at zero: closures), constants, and the line that is subtracted from
//! each form.

use super::channel::{Design, angle_name, is_same};
use super::determined::{Determined, SLIDE};

/// A form that is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FormOf {
    /// Of the slide: 0 horizontal, 1 vertical; on the slide position.
    Slide(usize),
    /// Of a side of the artefact, by its place in the design; on the artefact's own axis.
    Side(usize),
}

/// The unknowns of a fit.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Forms, those of the slide first.
    pub forms: Vec<FormOf>,
    /// By channel: the forms of the slide that it sees, and their factors.
    pub slides: Vec<Vec<(usize, f64)>>,
    /// By channel: the form of its side.
    pub side: Vec<usize>,
    /// By channel: what its slope is of the slopes, then of the closures.
    pub slopes: Vec<Vec<f64>>,
    /// By channel: what its constant is of the constants.
    pub constants: Vec<Vec<f64>>,
    /// Names of slopes, closures and constants.
    pub names: Vec<String>,
    /// How many slopes are fitted.
    pub slope_count: usize,
    /// How many closures are held at zero after them.
    pub closure_count: usize,
    /// Coefficients of a form, the two fixed ones included.
    pub coefficients: usize,
}

impl Layout {
    /// The unknowns of a design.
    pub fn new(design: &Design, determined: &Determined, coefficients: usize) -> Self {
        let channels = design.channels().len();
        let pivots = |a: &super::Analysis| -> Vec<Vec<f64>> {
            let row = |c: usize| a.pivots().iter().map(|j| a.matrix()[(c, *j)]).collect();
            (0..channels).map(row).collect()
        };
        let forms = &determined.forms;
        let column = |axis: usize| {
            let of = |j: &&usize| forms.unknowns()[**j] == SLIDE[axis];
            forms.pivots().iter().find(of).copied()
        };
        let fitted: Vec<(usize, usize)> = (0..2)
            .filter_map(|axis| Some((axis, column(axis)?)))
            .collect();
        let slides = (0..channels)
            .map(|c| {
                let factors = fitted.iter().enumerate();
                factors
                    .map(|(place, (_, j))| (place, forms.matrix()[(c, *j)]))
                    .filter(|(_, factor)| *factor != 0.0)
                    .collect()
            })
            .collect();
        let closures = positions(design);
        let mut slopes = pivots(&determined.slopes);
        for (c, row) in slopes.iter_mut().enumerate() {
            row.extend(closures.iter().map(|(_, signs)| signs[c]));
        }
        let names = Determined::names(&determined.slopes)
            .into_iter()
            .chain(closures.iter().map(|(name, _)| name.clone()))
            .chain(Determined::names(&determined.constants))
            .collect();
        Self {
            forms: fitted
                .iter()
                .map(|(axis, _)| FormOf::Slide(*axis))
                .chain((0..design.sides().len()).map(FormOf::Side))
                .collect(),
            slides,
            side: (0..channels)
                .map(|c| fitted.len() + design.side_of(c))
                .collect(),
            slopes,
            constants: pivots(&determined.constants),
            names,
            slope_count: determined.slopes.rank(),
            closure_count: closures.len(),
            coefficients,
        }
    }

    /// The same with another number of coefficients a form.
    #[must_use]
    pub fn with_coefficients(&self, coefficients: usize) -> Self {
        Self {
            coefficients,
            ..self.clone()
        }
    }

    /// Number of unknowns in the band.
    pub fn band_count(&self) -> usize {
        self.coefficients.saturating_sub(2) * self.forms.len()
    }

    /// The band unknown of a coefficient of a form; `None` for the first and last, which are zero.
    pub fn coefficient(&self, form: usize, index: usize) -> Option<usize> {
        (index > 0 && index + 1 < self.coefficients).then(|| (index - 1) * self.forms.len() + form)
    }

    /// The coefficients of a form, out of the band.
    pub fn coefficients_of(&self, form: usize, band: &[f64]) -> Vec<f64> {
        (0..self.coefficients)
            .map(|k| self.coefficient(form, k).map_or(0.0, |j| band[j]))
            .collect()
    }

    /// The border unknown of the first constant.
    pub fn constants_from(&self) -> usize {
        self.slope_count + self.closure_count
    }

    /// Number of constants.
    pub fn constant_count(&self) -> usize {
        self.constants.first().map_or(0, Vec::len)
    }

    /// The border unknowns of the line of a form: height at the centre, slope over half the range.
    pub fn line(&self, form: usize) -> [usize; 2] {
        let at = self.constants_from() + self.constant_count() + 2 * form;
        [at, at + 1]
    }

    /// Number of unknowns in the border.
    pub fn border_count(&self) -> usize {
        self.line(self.forms.len())[0]
    }

    /// The border unknowns of the closures.
    pub fn closures(&self) -> std::ops::Range<usize> {
        self.slope_count..self.constants_from()
    }

    /// Number of unknowns that the fit chooses: the lines are tied to the band, closures are held.
    pub fn free_count(&self) -> usize {
        self.band_count() + self.slope_count + self.constant_count()
    }

    /// The slope of a channel, rad.
    pub fn slope(&self, channel: usize, border: &[f64]) -> f64 {
        self.slopes[channel]
            .iter()
            .zip(border)
            .map(|(s, v)| s * v)
            .sum()
    }

    /// The constant of a channel, µm.
    pub fn constant(&self, channel: usize, border: &[f64]) -> f64 {
        let own = &border[self.constants_from()..];
        self.constants[channel]
            .iter()
            .zip(own)
            .map(|(s, v)| s * v)
            .sum()
    }

    /// The name of a form.
    pub fn form_name(&self, form: usize, design: &Design) -> String {
        match self.forms[form] {
            FormOf::Slide(axis) => SLIDE[axis].to_owned(),
            FormOf::Side(side) => super::determined::side_name(design.sides()[side]),
        }
    }
}

/// A slope common to the channels of a position of the spindle against that of all others: by name and
/// channel. One where there are two positions.
fn positions(design: &Design) -> Vec<(String, Vec<f64>)> {
    let positions = design.positions();
    let count = match positions.len() {
        0 | 1 => 0,
        2 => 1,
        n => n,
    };
    (0..count)
        .map(|p| {
            let others = -1.0 / (positions.len() - 1) as f64;
            let sign = |spindle: f64| {
                if is_same(spindle, positions[p]) {
                    1.0
                } else {
                    others
                }
            };
            let signs = design.channels().iter().map(|c| sign(c.spindle)).collect();
            (format!("beta_{}", angle_name(positions[p])), signs)
        })
        .collect()
}
