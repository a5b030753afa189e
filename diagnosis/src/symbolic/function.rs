//! The functions of the grammar, each of one coordinate with at most one shape.

use std::f64::consts::TAU;

use errsep_models::model::AnyModel;

use crate::catalogue::curve::Along;

/// Different values below which nothing is a function of a coordinate.
const FEWEST_VALUES: usize = 5;
/// *Limit.* Cycles of a wave over the range.
const MOST_CYCLES: f64 = 40.0;
/// *Limit.* Longest period in ranges: beyond that a wave is a parabola.
const LONGEST: f64 = 1.5;
/// Frequencies of the grid apart, in waves over the range.
const APART: f64 = 1.0 / 3.0;
/// Places of the grid: of steps, and of what bends.
const PLACES: [usize; 2] = [40, 9];
/// *Limit.* Constants of exponentials in ranges: shortest of those that saturate and that grow, longest.
const CONSTANTS: [f64; 3] = [0.05, 1.0 / 6.0, 2.0];
/// Constants of the grid.
const RATES: usize = 10;

/// What a law may be a function of.
pub(super) struct Coordinate {
    pub along: Along,
    /// Its value for every reading.
    pub values: Vec<f64>,
    /// Its different values, growing.
    levels: Vec<f64>,
}

impl Coordinate {
    /// Nothing where it has too few different values.
    pub fn new(model: &AnyModel, along: Along) -> Option<Self> {
        let values = along.values(model);
        let mut levels = values.clone();
        levels.sort_by(f64::total_cmp);
        let range = levels.last()? - levels.first()?;
        levels.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * range);
        (levels.len() >= FEWEST_VALUES && range.is_finite()).then_some(Self {
            along,
            values,
            levels,
        })
    }

    pub fn low(&self) -> f64 {
        self.levels.first().copied().unwrap_or(0.0)
    }

    pub fn high(&self) -> f64 {
        self.levels.last().copied().unwrap_or(0.0)
    }

    pub fn range(&self) -> f64 {
        self.high() - self.low()
    }

    fn middle(&self) -> f64 {
        0.5 * (self.low() + self.high())
    }

    fn greatest(&self) -> f64 {
        self.low().abs().max(self.high().abs())
    }

    /// Where exponentials begin: at zero where that is among the values, else at the first.
    fn beginning(&self) -> f64 {
        if self.low() <= 0.05 * self.range() && self.high() >= 0.0 {
            0.0
        } else {
            self.low()
        }
    }

    /// Places half-way between neighbouring values, within some bounds.
    pub fn between(&self, low: f64, high: f64) -> Vec<f64> {
        let halves = self.levels.windows(2).map(|w| 0.5 * (w[0] + w[1]));
        halves.filter(|c| *c >= low && *c <= high).collect()
    }

    /// The way from a place to the values on either side of it.
    pub fn gap_at(&self, place: f64) -> f64 {
        let right = self.levels.partition_point(|v| *v <= place);
        let right = right.clamp(1, self.levels.len() - 1);
        self.levels[right] - self.levels[right - 1]
    }

    /// Number of places between values.
    pub fn gaps(&self) -> usize {
        self.levels.len() - 1
    }
}

/// From where a power or a distance counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    Zero,
    Middle,
}

/// A function of a coordinate u. Amplitudes are free, a wave has two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Function {
    /// 1
    One,
    /// u^k about a fixed origin.
    Power(u8, Origin),
    /// (u − c)^k
    Shifted(u8),
    /// 1 − exp(−u/τ)
    Saturating,
    /// exp(u/τ) − 1
    Growing,
    /// cos(2πfu), sin(2πfu)
    Wave,
    /// 1 from c on.
    Step,
    /// |u| about a fixed origin.
    Absolute(Origin),
    /// |u − c|
    Corner,
}

impl Function {
    /// All functions of a coordinate, the simplest first.
    pub fn all(coordinate: &Coordinate) -> Vec<Self> {
        let mut all: Vec<Self> = (1..=4).map(|k| Self::Power(k, Origin::Zero)).collect();
        if coordinate.along == Along::Position {
            all.extend((2..=4).map(|k| Self::Power(k, Origin::Middle)));
            all.push(Self::Absolute(Origin::Middle));
        }
        if coordinate.low() < 0.0 && coordinate.high() > 0.0 {
            all.push(Self::Absolute(Origin::Zero));
        }
        all.extend([Self::Step, Self::Saturating, Self::Growing, Self::Corner]);
        all.extend((2..=4).map(Self::Shifted));
        all.push(Self::Wave);
        all
    }

    /// Number of amplitudes.
    pub fn order(self) -> usize {
        if self == Self::Wave { 2 } else { 1 }
    }

    /// Whether it has a shape.
    pub fn is_shaped(self) -> bool {
        !matches!(self, Self::One | Self::Power(..) | Self::Absolute(_))
    }

    /// Number of parameters.
    pub fn parameters(self) -> usize {
        self.order() + usize::from(self.is_shaped())
    }

    /// The class of expression, whatever its origin.
    pub fn class(self) -> String {
        match self {
            Self::One => "constant".to_owned(),
            Self::Power(k, _) | Self::Shifted(k) => format!("power {k}"),
            Self::Saturating => "saturating exponential".to_owned(),
            Self::Growing => "growing exponential".to_owned(),
            Self::Wave => "cosine".to_owned(),
            Self::Step => "step".to_owned(),
            Self::Absolute(_) | Self::Corner => "absolute value".to_owned(),
        }
    }

    /// From where it counts, where that is fixed.
    pub fn origin(self, c: &Coordinate) -> f64 {
        match self {
            Self::Power(_, Origin::Middle) | Self::Absolute(Origin::Middle) => c.middle(),
            Self::Saturating | Self::Growing => c.beginning(),
            _ => 0.0,
        }
    }

    /// What its amplitude is divided by to be that of the formula.
    pub fn scale(self, c: &Coordinate) -> f64 {
        match self {
            Self::Power(k, Origin::Zero) => c.greatest().powi(i32::from(k)),
            Self::Power(k, Origin::Middle) | Self::Shifted(k) => c.range().powi(i32::from(k)),
            Self::Absolute(_) | Self::Corner => c.range(),
            _ => 1.0,
        }
    }

    /// Its values at u, the shape a place, a frequency or the logarithm of a constant.
    pub fn at(self, c: &Coordinate, shape: f64, u: f64) -> [f64; 2] {
        let v = u - self.origin(c);
        let one = match self {
            Self::One => 1.0,
            Self::Power(k, Origin::Zero) => (v / c.greatest()).powi(i32::from(k)),
            Self::Power(k, Origin::Middle) => (v / c.range()).powi(i32::from(k)),
            Self::Shifted(k) => ((u - shape) / c.range()).powi(i32::from(k)),
            Self::Saturating => -(-v / shape.exp()).exp_m1(),
            Self::Growing => (v / shape.exp()).exp_m1(),
            Self::Wave => return [(TAU * shape * u).cos(), (TAU * shape * u).sin()],
            Self::Step => f64::from(u8::from(u >= shape)),
            Self::Absolute(_) => v.abs() / c.range(),
            Self::Corner => (u - shape).abs() / c.range(),
        };
        [one, 0.0]
    }

    /// Their derivatives by the shape; nothing of a step.
    pub fn slope(self, c: &Coordinate, shape: f64, u: f64) -> [f64; 2] {
        let v = u - self.origin(c);
        let one = match self {
            Self::Shifted(k) => {
                let part = (u - shape) / c.range();
                -f64::from(k) * part.powi(i32::from(k) - 1) / c.range()
            }
            Self::Saturating => -(-v / shape.exp()).exp() * v / shape.exp(),
            Self::Growing => -(v / shape.exp()).exp() * v / shape.exp(),
            Self::Wave => {
                let (sin, cos) = (TAU * shape * u).sin_cos();
                return [-TAU * u * sin, TAU * u * cos];
            }
            Self::Corner => -(u - shape).signum() / c.range(),
            _ => 0.0,
        };
        [one, 0.0]
    }

    /// Bounds of the shape.
    pub fn bounds(self, c: &Coordinate) -> [f64; 2] {
        let range = c.range();
        match self {
            Self::Saturating => [(CONSTANTS[0] * range).ln(), (CONSTANTS[2] * range).ln()],
            Self::Growing => [(CONSTANTS[1] * range).ln(), (CONSTANTS[2] * range).ln()],
            Self::Wave => {
                let finest = 0.5 * c.gaps() as f64;
                let most = MOST_CYCLES.min(finest).max(1.0 / LONGEST);
                [1.0 / (LONGEST * range), most / range]
            }
            _ => [c.low(), c.high()],
        }
    }

    /// Shapes at which the search begins.
    pub fn grid(self, c: &Coordinate) -> Vec<f64> {
        let [low, high] = self.bounds(c);
        let even = |count: usize, ends: bool| -> Vec<f64> {
            let (from, parts) = if ends { (0, count - 1) } else { (1, count + 1) };
            let at = |k: usize| low + (high - low) * k as f64 / parts as f64;
            (from..from + count).map(at).collect()
        };
        match self {
            Self::One | Self::Power(..) | Self::Absolute(_) => vec![0.0],
            Self::Shifted(_) => even(PLACES[1], true),
            Self::Corner => even(PLACES[1], false),
            Self::Saturating | Self::Growing => even(RATES, true),
            Self::Wave => {
                let count = ((high - low) * c.range() / APART).floor() as usize + 1;
                let at = |k: usize| low + APART * k as f64 / c.range();
                (0..count).map(at).collect()
            }
            Self::Step => {
                let all = c.between(c.low(), c.high());
                let each = all.len().div_ceil(PLACES[0]).max(1);
                all.into_iter().skip(each / 2).step_by(each).collect()
            }
        }
    }

    /// How far shapes of the grid are apart.
    pub fn step(self, c: &Coordinate) -> f64 {
        let grid = self.grid(c);
        match (grid.first(), grid.last()) {
            (Some(first), Some(last)) if grid.len() > 1 => (last - first) / (grid.len() - 1) as f64,
            _ => c.range(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_values() {
        let values: Vec<f64> = (0..21).map(|k| f64::from(k) * 5.0 - 30.0).collect();
        let c = Coordinate {
            along: Along::Position,
            levels: values.clone(),
            values,
        };
        for function in Function::all(&c) {
            if !function.is_shaped() || function == Function::Step {
                continue;
            }
            let [low, high] = function.bounds(&c);
            let shape = low + 0.37 * (high - low);
            let h = 1e-6 * (high - low);
            for u in [-30.0, -4.0, 11.0, 69.0] {
                let there = function.at(&c, shape + h, u);
                let back = function.at(&c, shape - h, u);
                let slope = function.slope(&c, shape, u);
                for k in 0..function.order() {
                    let difference = (there[k] - back[k]) / (2.0 * h);
                    // Truncation: h² of the third derivative, and rounding over h.
                    let reach = 1e-6 * slope[k].abs().max(1.0 / (high - low));
                    assert!(
                        (difference - slope[k]).abs() < reach,
                        "{function:?} at {u}: {difference} against {}",
                        slope[k]
                    );
                }
            }
        }
    }
}
