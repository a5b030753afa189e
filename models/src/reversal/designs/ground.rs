//! What every stage of a fit stands on, and how problems over it are made.

use errsep_solvers::structured::Parameters;

use super::channel::Design;
use super::determined::Determined;
use super::error::DesignFitError;
use super::fit::FEWEST_FREE;
use super::layout::{Beside, FormOf, Layout};
use super::options::DesignOptions;
use super::problem::crest::CrestTerm;
use super::problem::{Body, DesignProblem, Splines};
use super::readings::{Trace, range};
use super::staged;
use crate::basis::bspline::CubicBSpline;
use crate::reversal::forward::Attitude;
use crate::reversal::simultaneous::Axis;
use crate::reversal::simultaneous::knots::{FEWEST_POSITIONS, Finest};

/// What every stage of a fit stands on.
pub(super) struct Ground<'a> {
    pub design: &'a Design,
    pub determined: &'a Determined,
    pub traces: &'a [Trace],
    pub options: &'a DesignOptions,
    /// The unknowns without knots.
    pub layout: Layout,
    /// Tilt (rad) and height (µm) of each channel's line.
    lines: Vec<(f64, f64)>,
    axis: Axis,
    body: Body,
    /// First weights, 1/σ by channel.
    pub weights: Vec<f64>,
    /// How fine knots that are chosen may be.
    pub finest: Finest,
}

impl<'a> Ground<'a> {
    pub fn new(
        design: &'a Design,
        determined: &'a Determined,
        traces: &'a [Trace],
        weights: Vec<f64>,
        options: &'a DesignOptions,
    ) -> Result<Self, DesignFitError> {
        let lines = staged::lines(design, traces)?;
        let count: usize = traces.iter().map(Trace::len).sum();
        let center = traces.iter().map(|t| t.x.iter().sum::<f64>()).sum::<f64>() / count as f64;
        let (low, high) = range(traces);
        let scale = (high - low) / 2.0;
        let beside = Beside {
            crest: options.crest.is_some(),
            thickness: options.fit_thickness,
        };
        let layout = Layout::new(design, determined, beside);
        let turns = |a: &super::layout::Across| a.constants.iter().any(|share| *share != 0.0);
        let crest = options.crest.as_ref().map(|crest| CrestTerm {
            tip_mm: crest.tip_mm,
            offset_mm: crest.offset_mm.clone(),
            middle: 0.5 * (low + high),
            kept: layout.across.iter().any(turns),
        });
        Ok(Self {
            layout,
            design,
            determined,
            traces,
            options,
            lines,
            axis: Axis { center, scale },
            body: Body {
                half_mm: options.thickness_mm / 2.0,
                crest,
            },
            weights,
            finest: Finest::Carried,
        })
    }

    /// The same with other values of the readings.
    pub fn of<'b>(&'b self, traces: &'b [Trace]) -> Ground<'b> {
        Ground {
            traces,
            layout: self.layout.clone(),
            lines: self.lines.clone(),
            body: self.body.clone(),
            weights: self.weights.clone(),
            ..*self
        }
    }

    /// Number of readings.
    pub fn readings(&self) -> usize {
        self.traces.iter().map(Trace::len).sum()
    }

    /// Different positions of the channel that has most.
    pub fn positions(&self) -> usize {
        self.traces.iter().map(Trace::positions).max().unwrap_or(0)
    }

    /// The positions of the channel that has most different ones, in ascending order, mm.
    pub fn most_read(&self) -> &[f64] {
        let most = self.traces.iter().max_by_key(|t| t.positions());
        most.map_or(&[], |t| &t.x)
    }

    /// Most cells that the readings carry: a spline of K cells with its slope and constant has K + 3
    /// unknowns and needs as many positions, and all unknowns need as many readings.
    pub fn most_cells(&self) -> usize {
        let free = if self.options.is_declared() {
            0
        } else {
            FEWEST_FREE
        };
        let others = self.layout.free_count();
        let by_readings =
            self.readings().saturating_sub(others + free) / self.layout.forms.len().max(1);
        let by_positions = self.positions().saturating_sub(FEWEST_POSITIONS - 1);
        by_readings.saturating_sub(1).min(by_positions)
    }

    /// The problem on these breaks, one list a form, and where it begins: slopes and constants of the
    /// channels' lines, forms of zero (they enter linearly: the first step finds them).
    pub fn problem(
        &self,
        breaks: Vec<Vec<f64>>,
    ) -> Result<(DesignProblem<'a>, Parameters), DesignFitError> {
        let layout = self.layout.on(&breaks);
        let bases = self.bases(&breaks)?;
        let mut start = Parameters::zeros(layout.band_count(), layout.border_count());
        let (slopes, constants) = staged::start(self.determined, &self.lines);
        start.border[..slopes.len()].copy_from_slice(&slopes);
        start.border[layout.constants_from()..][..constants.len()].copy_from_slice(&constants);
        if let Some(index) = layout.thickness_index() {
            start.border[index] = self.options.thickness_mm;
        }
        let problem = DesignProblem::new(
            self.traces,
            layout,
            Splines { breaks, bases },
            self.axis,
            self.body.clone(),
            self.weights.clone(),
        );
        Ok((problem, start))
    }

    /// The bases of the forms: the slide's on the positions, a side's stretched to where the tilted
    /// probes touch it.
    fn bases(&self, breaks: &[Vec<f64>]) -> Result<Vec<CubicBSpline>, DesignFitError> {
        let (low, high) = range(self.traces);
        let half_mm = self.body.half_mm;
        let mut bases = Vec::with_capacity(breaks.len());
        for (form, breaks) in self.layout.forms.iter().zip(breaks) {
            let FormOf::Side(side) = form else {
                bases.push(CubicBSpline::new(breaks.clone())?);
                continue;
            };
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            for (c, (trace, line)) in self.traces.iter().zip(&self.lines).enumerate() {
                if self.design.side_of(c) == *side
                    && let (Some(first), Some(last)) = (trace.x.first(), trace.x.last())
                {
                    let attitude = Attitude::new(line.0, half_mm)?;
                    let touched = |x: f64| (x + half_mm * attitude.sin) / attitude.cos;
                    from = from.min(touched(*first));
                    to = to.max(touched(*last));
                }
            }
            let stretched = |b: &f64| from + (to - from) * ((b - low) / (high - low));
            bases.push(CubicBSpline::new(breaks.iter().map(stretched).collect())?);
        }
        Ok(bases)
    }
}
