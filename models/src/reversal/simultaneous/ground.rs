//! What every stage of a fit stands on: readings, lines, axis, and how problems over them are made.

use errsep_solvers::structured::{Parameters, StructuredProblem};

use super::effects::JoinedEffect;
use super::error::{FEWEST_FREE, ReversalError};
use super::gauge::Axis;
use super::joined::Joined;
use super::knots::{
    self, Choice, Climbed, FEWEST_POSITIONS, Finest, KnotTrial, LinearStep, NoiseOfWaves,
};
use super::options::{Knots, Noise, Options, Thickness};
use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::rungs::Rungs;
use super::seed;
use super::unknowns::Unknowns;
use crate::basis::bspline::CubicBSpline;
use crate::reversal::Observations;

/// Up to this tilt (rad) a probe wanders by so little that the first step is nearly the last.
const SMALL_TILT: f64 = 0.1;

/// Readings and what is known of them before the fit.
pub struct Ground<'a> {
    pub observations: &'a Observations,
    pub options: &'a Options,
    pub channels: &'a [ChannelReadings],
    /// The same, as knots are chosen from them: traces of a channel shifted and tilted onto each other.
    pub alike: &'a [ChannelReadings],
    /// Tilt and offset of each channel's line.
    pub lines: Vec<(f64, f64)>,
    pub axis: Axis,
    pub thickness_mm: f64,
    pub thickness_free: bool,
    /// First weights, 1/σ by channel.
    pub weights: Vec<f64>,
    /// How fine knots that are chosen may be.
    pub finest: Finest,
}

/// Where the forms break.
pub struct Breaks {
    /// The break points, mm.
    pub points: Vec<f64>,
    /// The ladder, where they were chosen.
    pub climbed: Option<Climbed>,
}

impl Breaks {
    /// The rungs that were tried.
    pub fn table(&self) -> Vec<KnotTrial> {
        let table = self.climbed.as_ref().map(|c| c.table.clone());
        table.unwrap_or_default()
    }
}

/// Effects with the values from which the fit begins.
#[derive(Debug, Clone)]
pub struct Begun<'a> {
    pub joined: Joined<'a>,
    pub values: Vec<f64>,
}

/// Effects by name with their values.
pub type Found = (&'static str, std::sync::Arc<dyn JoinedEffect>, Vec<f64>);

impl<'a> Begun<'a> {
    /// These effects at their values.
    pub fn new(observations: &'a Observations, times: &'a [f64], found: &[Found]) -> Self {
        let effects: Vec<_> = found
            .iter()
            .map(|(name, effect, _)| (*name, std::sync::Arc::clone(effect)))
            .collect();
        Self {
            joined: Joined::new(observations, times, &effects),
            values: found.iter().flat_map(|f| f.2.clone()).collect(),
        }
    }
}

impl<'a> Ground<'a> {
    /// Lines and axis of the readings. `alike` is what knots are chosen from.
    ///
    /// # Errors
    /// [`ReversalError::OnePosition`] or [`ReversalError::TooSteep`].
    pub fn new(
        observations: &'a Observations,
        options: &'a Options,
        [channels, alike]: [&'a [ChannelReadings]; 2],
        weights: Vec<f64>,
    ) -> Result<Self, ReversalError> {
        let lines = seed::lines(channels)?;
        let axis = Axis::of(channels).ok_or(ReversalError::OnePosition {
            channel: channels[0].channel.name(),
            x: channels[0].x[0],
        })?;
        let (thickness_mm, thickness_free) = match options.thickness {
            Thickness::NotKnown => (0.0, false),
            Thickness::Known(mm) => (mm, false),
            Thickness::Fitted(mm) => (mm, true),
        };
        Ok(Self {
            observations,
            options,
            channels,
            alike,
            lines,
            axis,
            thickness_mm,
            thickness_free,
            weights,
            finest: Finest::Carried,
        })
    }

    /// The unknowns with so many coefficients a form.
    pub fn unknowns(&self, coefficients: usize, effects: Option<&Begun>) -> Unknowns {
        Unknowns::new(
            self.channels.iter().map(|c| c.channel).collect(),
            self.options.convention,
            self.thickness_free,
            coefficients,
        )
        .with_effects(effects.map_or_else(Vec::new, |e| e.joined.names()))
    }

    /// What the ladder of knots shares.
    pub(super) fn choice<'c>(&'c self, effects: Option<&'c Begun<'a>>) -> Choice<'c> {
        Choice {
            channels: self.alike,
            lines: &self.lines,
            axis: self.axis,
            thickness_mm: self.thickness_mm,
            weights: &self.weights,
            effects,
            finest: self.finest,
        }
    }

    /// Degrees of freedom that the readings must leave.
    pub fn fewest_free(&self) -> usize {
        match self.options.noise {
            Noise::Declared(_) => 0,
            _ => FEWEST_FREE,
        }
    }

    /// Most cells that the readings carry.
    pub fn most_cells(&self, effects: Option<&Begun>) -> usize {
        let unknowns = self.unknowns(FEWEST_POSITIONS, effects);
        knots::most_cells(self.channels, &unknowns, self.fewest_free())
    }

    /// The break points that the options ask for; where they are chosen, beside the effects, which fine knots would take up otherwise.
    ///
    /// # Errors
    /// [`ReversalError`] where the readings do not carry them.
    pub fn breaks(&self, effects: Option<&Begun<'a>>) -> Result<Breaks, ReversalError> {
        let choice = self.choice(effects);
        let most = self.most_cells(effects);
        let of = |coefficients: usize| self.unknowns(coefficients, effects);
        let points = match &self.options.knots {
            Knots::At(breaks) => breaks.clone(),
            Knots::Cells(asked) if *asked > most && most > 0 => {
                return Err(ReversalError::TooManyKnots {
                    asked: *asked,
                    most,
                });
            }
            // Not even one cell is carried: what is missing is told when the unknowns are counted.
            Knots::Cells(_) if most == 0 => choice.breaks(&of(4), 1),
            Knots::Cells(cells) => choice.breaks(&of(cells + 3), *cells),
            Knots::Chosen => {
                let climbed = choice.choose(of)?;
                return Ok(Breaks {
                    points: choice.breaks(&of(climbed.cells() + 3), climbed.cells()),
                    climbed: Some(climbed),
                });
            }
        };
        Ok(Breaks {
            points,
            climbed: None,
        })
    }

    /// Moves the breaks to where they are best under noise of this law, where they were chosen for white noise; says whether
    /// that is elsewhere.
    pub fn choose_under(
        &self,
        breaks: &mut Breaks,
        effects: Option<&Begun<'a>>,
        waves: &NoiseOfWaves,
    ) -> bool {
        let unknowns = |cells: usize| self.unknowns(cells + 3, effects);
        let forms = unknowns(1).forms.len();
        let Some(climbed) = &mut breaks.climbed else {
            return false;
        };
        let moved = climbed.choose_under(forms, waves);
        if moved {
            let cells = climbed.cells();
            breaks.points = self.choice(effects).breaks(&unknowns(cells), cells);
        }
        moved
    }

    /// So many cells.
    pub fn breaks_of(&self, cells: usize) -> Vec<f64> {
        self.choice(None)
            .breaks(&self.unknowns(cells + 3, None), cells)
    }

    /// The problem on these breaks, and where to start: at the lines, or the tilts that are given.
    ///
    /// # Errors
    /// [`ReversalError::Breaks`], [`ReversalError::StartLength`].
    pub fn problem(
        &self,
        breaks: &[f64],
        effects: Option<&Begun<'a>>,
    ) -> Result<(Reversal<'a>, Parameters), ReversalError> {
        let unknowns = self.unknowns(breaks.len() + 2, effects);
        let bases = match &self.options.knots {
            Knots::At(_) => {
                let basis = CubicBSpline::new(breaks.to_vec())?;
                vec![basis; unknowns.forms.len()]
            }
            _ => self.choice(effects).bases(&unknowns, breaks)?,
        };
        let tilts = match &self.options.start_tilts_rad {
            None => seed::tilts(&unknowns, &self.lines),
            Some(given) if given.len() == unknowns.tilt_count() => given.clone(),
            Some(given) => {
                return Err(ReversalError::StartLength {
                    given: given.len(),
                    needed: unknowns.tilt_count(),
                });
            }
        };
        let start = begin(&unknowns, &tilts, &self.lines, self.thickness_mm, effects);
        let problem = Reversal::new(
            self.channels,
            unknowns,
            bases,
            self.axis,
            self.thickness_mm,
            self.weights.clone(),
        );
        Ok((problem.joining(effects.map(|e| &e.joined)), start))
    }
}

impl Ground<'_> {
    /// Where the linear model at the start of a problem has its least squares, by normal equations: what a
    /// first pass over the readings would lead to, for a fraction of it. `None` with effects, at tilts that
    /// let the probes wander, or where the normal equations do not tell. `known` is that of the ladder.
    pub fn linear_start(
        &self,
        problem: &Reversal,
        start: &Parameters,
        known: Option<LinearStep>,
    ) -> Option<Parameters> {
        let unknowns = &problem.unknowns;
        if problem.joined.is_some() || unknowns.thickness {
            return None;
        }
        let begin: Vec<(f64, f64)> = (0..self.channels.len())
            .map(|c| {
                let offset = start.border[unknowns.offset(c)];
                (unknowns.slope(c, &start.border), offset)
            })
            .collect();
        if begin.iter().any(|(tilt, _)| tilt.abs() > SMALL_TILT) {
            return None;
        }
        // The ladder begins at the lines.
        let known = known
            .filter(|k| k.bases == problem.bases && self.options.start_tilts_rad.is_none())
            .map(|known| known.step);
        let (band, border) = match known {
            Some(step) => step,
            None => {
                let place = (self.axis, self.thickness_mm);
                Rungs::new(self.channels, begin.into_iter(), &problem.weights, place)?
                    .solve(unknowns, &problem.bases)?
                    .step()
            }
        };
        let there = start.stepped(&band, &border);
        let finite = there
            .band
            .iter()
            .chain(&there.border)
            .all(|v| v.is_finite());
        (finite && problem.prepare(&there).is_ok()).then_some(there)
    }
}

/// The start at the lines of the channels and the values of the effects.
pub fn begin(
    unknowns: &Unknowns,
    tilts: &[f64],
    lines: &[(f64, f64)],
    thickness_mm: f64,
    effects: Option<&Begun>,
) -> Parameters {
    let mut start = seed::start(unknowns, tilts, lines, thickness_mm);
    for (k, value) in effects.iter().flat_map(|e| &e.values).enumerate() {
        start.border[unknowns.effect(k)] = *value;
    }
    start
}
