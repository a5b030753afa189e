//! An error that comes back with a fixed period.
//!
//! Of the reading: the interpolation error of an incremental indicator, of one or of both, each with
//! its own amplitude and phase, up to two readings a period; the reading climbs unevenly, so that
//! periods stay apart up to there. Of the position: the part of a screw's or rack's period that the
//! slide's form cannot take up, different in the two spindle positions; what both have in common is form,
//! but for its line, a cone. Free: amplitude and phase of each indicator, the period, told by its cycles
//! over the span of the readings or the travel, the line.

use nalgebra::DMatrix;

use super::indicators::{ALL, Indicators};
use super::{Linearised, part_of_travel, rounded};
use crate::model::{About, Column, Effect, Estimate, FittedModel, Link, Parameter, Shape};
use crate::reversal::designs::angle_name;
use crate::reversal::diagnosable::Arrangement;

/// See the head of the file. Variants: the indicators, then a period of the position in one position of
/// the spindle; of two positions the fit spreads it over both, and the last is of another phase in each.
pub(super) struct CyclicError {
    indicators: Indicators,
    /// Positions of the spindle.
    positions: Vec<f64>,
}

/// The variant of another phase in each position of the spindle in words.
pub(super) const OWN_PHASES: &str = "of another phase in each spindle position";

/// Greatest line beside waves of phases of their own, in amplitudes of the wave that is seen, times the cycles. The
/// line of a wave of n cycles over the travel is 3/(πn) of its amplitude at most; that of one indicator in either
/// position is half of that in the mean of four channels. What is seen of the waves is their difference: less where
/// the phases are nearly alike, down to an eighth, at 7°, below which hardly a wave is left. A greater line is a cone.
const STRAIGHT: f64 = 8.0 * 0.5 * 3.0 / std::f64::consts::PI;

impl CyclicError {
    pub fn new(channels: &Arrangement) -> Self {
        Self {
            indicators: Indicators::new(channels),
            positions: channels.positions().to_vec(),
        }
    }

    /// The position of the spindle of a variant that is a period of the position.
    fn drive(&self, variant: usize) -> Option<usize> {
        variant.checked_sub(self.indicators.scope_count())
    }

    /// Whether a variant is of another phase in each position of the spindle.
    fn has_own_phases(&self, variant: usize) -> bool {
        self.drive(variant) == Some(self.positions.len())
    }

    /// The variants that are sought of a period of the position: of two positions of the spindle one
    /// shows the other.
    fn drives(&self) -> impl Iterator<Item = usize> + use<> {
        let first = self.indicators.scope_count();
        let sought = if self.positions.len() > 2 {
            self.positions.len()
        } else {
            1
        };
        first..first + sought
    }
}

/// Cycles between neighbouring starts of the search: the peak of a period is one cycle wide.
const STRIDE: f64 = 0.4;

/// Greatest slope of a period of the reading: its amplitude is half the period. Beyond, readings a
/// whole period apart show the same, and none tells what was seen.
const STEEPEST: f64 = std::f64::consts::PI;

/// Fewest cycles: less is a bend.
const FEWEST: f64 = 3.0;

impl Effect<Linearised> for CyclicError {
    fn name(&self) -> &str {
        "cyclic-error"
    }

    fn about(&self) -> About {
        About {
            physics: "an error comes back with a fixed period, of the indicator's scale or of the drive",
            confirm: "compare the period with the signal period of the indicator and the pitch of the screw",
            source: "first harmonic of the interpolation error of incremental scales; ISO 230-2 periodic error",
        }
    }

    /// What comes with the drive goes by its angle, whatever the slide has lost of that. An indicator with a scale has no
    /// pointer: its play and friction, and the growth of its mount, come before the scale.
    fn link(&self, shape: &Shape) -> Link {
        match self.drive(shape.variant) {
            Some(_) => Link::Reading,
            None => Link::Scale,
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        self.amplitudes_at(&Shape::variant(ALL))
    }

    fn amplitudes_at(&self, shape: &Shape) -> Vec<Parameter> {
        let mut all = self.indicators.rotations(self.waves(shape), 100.0);
        if self.has_own_phases(shape.variant) {
            all.push(Parameter::symmetric("line", "um", 100.0));
        }
        all
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("cycles", "1", 1.0, 1e6)]
    }

    /// All indicators are found from either.
    fn grid(&self, model: &Linearised) -> Vec<Shape> {
        let alone = self.indicators.scopes().filter(|s| *s != ALL);
        let mut shapes = Vec::new();
        for variant in alone.chain(self.drives()) {
            let mut cycles = FEWEST;
            while cycles <= highest(model) {
                shapes.push(Shape {
                    variant,
                    values: vec![cycles],
                    steps: vec![0.5 * STRIDE],
                });
                cycles += STRIDE;
            }
        }
        shapes
    }

    fn relatives(&self, _model: &Linearised, shape: &Shape) -> Vec<Shape> {
        let other = |variant: usize| Shape {
            variant,
            ..shape.clone()
        };
        if self.drive(shape.variant).is_some() {
            let first = self.indicators.scope_count();
            let all = match self.positions.len() {
                2 => first..first + 3,
                _ => 0..0,
            };
            let others = all.filter(|variant| *variant != shape.variant);
            return others.map(other).collect();
        }
        self.indicators.others(shape.variant).map(other).collect()
    }

    fn columns(&self, model: &Linearised, shape: &Shape) -> Vec<Column> {
        let Some(&cycles) = shape.values.first() else {
            return Vec::new();
        };
        let turn = std::f64::consts::TAU * cycles;
        if let Some(position) = self.drive(shape.variant) {
            let first = model.positions().first().copied().unwrap_or(0.0);
            let per_mm = turn / model.travel();
            let wave = |function: fn(f64) -> f64| {
                Column::from_places(model.places(), |_, place| {
                    let seen = model.seat(place).position == position % self.positions.len();
                    f64::from(seen) * function(per_mm * (place.x - first))
                })
            };
            let mut columns = vec![wave(f64::cos), wave(f64::sin)];
            if self.has_own_phases(shape.variant) {
                columns.push(Column::from_places(model.places(), |_, place| {
                    part_of_travel(model, place.x)
                }));
            }
            return columns;
        }
        let per_um = turn / model.reading_span();
        let wave = |function: fn(f64) -> f64| {
            let whole = model.of_reading(|reading| function(per_um * reading));
            self.indicators.apart(model, shape.variant, &whole)
        };
        // The cosine and the sine of each indicator stand together.
        let pairs = wave(f64::cos).into_iter().zip(wave(f64::sin));
        pairs.flat_map(|(cosine, sine)| [cosine, sine]).collect()
    }

    fn allowed(&self, model: &Linearised, shape: &Shape) -> bool {
        let reach = FEWEST - 0.5..highest(model) + 0.5;
        shape
            .values
            .first()
            .is_some_and(|cycles| reach.contains(cycles))
    }

    fn possible(&self, model: &Linearised, shape: &Shape, amplitudes: &[f64]) -> bool {
        let Some(&cycles) = shape.values.first() else {
            return true;
        };
        let steepest = std::f64::consts::TAU * cycles / model.reading_span();
        let holds = |wave: &[f64]| wave[0].hypot(wave[1]) * steepest < STEEPEST;
        match (self.drive(shape.variant), amplitudes) {
            (Some(_), [cosine, sine, line]) => {
                line.abs() <= STRAIGHT / cycles * cosine.hypot(*sine)
            }
            (Some(_), _) => true,
            (None, waves) => waves.chunks_exact(2).all(holds),
        }
    }

    /// A period of the reading is told by its cycles over the span of the readings.
    fn carried(
        &self,
        from: &Linearised,
        to: &Linearised,
        shape: &Shape,
        amplitudes: &[f64],
    ) -> (Shape, Vec<f64>) {
        let mut shape = shape.clone();
        if self.drive(shape.variant).is_none() {
            let grown = to.reading_span() / from.reading_span();
            shape.values.iter_mut().for_each(|cycles| *cycles *= grown);
        }
        (shape, amplitudes.to_vec())
    }

    fn variant_name(&self, model: &Linearised, shape: &Shape) -> Option<String> {
        let cycles = shape.values.first()?;
        if let Some(position) = self.drive(shape.variant) {
            let at = match self.positions.get(position) {
                None => format!(", {OWN_PHASES}"),
                Some(_) if self.positions.len() < 3 => String::new(),
                Some(angle) => format!(", spindle at {}°", angle_name(*angle)),
            };
            return Some(format!(
                "period {} mm of the travel{at}",
                rounded(model.travel() / cycles)
            ));
        }
        let of = match shape.variant {
            ALL => "reading".to_owned(),
            one => format!("{} indicator's reading", self.indicators.name(one - 1)),
        };
        Some(format!(
            "period {} µm of the {of}",
            rounded(model.reading_span() / cycles)
        ))
    }

    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        self.indicators.rotating(
            self.waves(shape),
            shape,
            amplitudes,
            covariance,
            &self.shape_parameters(),
        )
    }
}

impl CyclicError {
    /// The scope with as many waves as a shape has.
    fn waves(&self, shape: &Shape) -> usize {
        match self.drive(shape.variant) {
            Some(_) => 1,
            None => shape.variant,
        }
    }
}

/// Most cycles: two readings a period.
fn highest(model: &Linearised) -> f64 {
    0.5 * model.positions().len() as f64
}
