//! The grammar: functions of coordinates times patterns over channels and directions, one term or two.

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::{DMatrix, DVector};

use crate::catalogue::curve::Along;
use crate::symbolic::function::{Coordinate, Function};
use crate::symbolic::pattern::{Pattern, block_of};
use crate::symbolic::view::Fitted;

/// *Limit.* Part of the readings' range that a law along the reading may change them by.
const OFF: f64 = 0.3;

/// *Limit.* Correlation from which on two coordinates grow with each other.
const TOGETHER: f64 = 0.99;

/// Whether two coordinates grow, or one falls as the other grows, over all readings alike.
fn grow_together(a: &Coordinate, b: &Coordinate) -> bool {
    let n = a.values.len() as f64;
    let mean = |c: &Coordinate| c.values.iter().sum::<f64>() / n;
    let (of_a, of_b) = (mean(a), mean(b));
    let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
    for (u, v) in a.values.iter().zip(&b.values) {
        let (u, v) = (u - of_a, v - of_b);
        (aa, ab, bb) = (aa + u * u, ab + u * v, bb + v * v);
    }
    ab * ab > TOGETHER * TOGETHER * aa * bb
}

/// A function of a coordinate.
#[derive(Clone, Copy)]
pub(super) struct Kind {
    pub function: Function,
    pub coordinate: usize,
}

/// One term of a law, without its amplitudes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Term {
    pub kind: usize,
    pub pattern: usize,
    pub shape: f64,
}

impl Term {
    /// Function and pattern, whatever the shape.
    pub fn form(self) -> (usize, usize) {
        (self.kind, self.pattern)
    }
}

/// All that may be a term for the readings of a model.
pub(super) struct Grammar {
    pub coordinates: Vec<Coordinate>,
    /// The simplest first.
    pub kinds: Vec<Kind>,
    pub patterns: Vec<Pattern>,
    /// Channel and direction of every reading.
    pub blocks: Vec<usize>,
    /// By coordinate, the first that it grows with: on a calibration line the reading is the position.
    grows_with: Vec<usize>,
}

impl Grammar {
    /// Nothing where no coordinate has enough values.
    pub fn new(model: &AnyModel) -> Option<Self> {
        let along = [Along::Position, Along::Time, Along::Reading];
        let coordinates: Vec<Coordinate> = along
            .into_iter()
            .filter_map(|a| Coordinate::new(model, a))
            .collect();
        if coordinates.is_empty() {
            return None;
        }
        let mut kinds = vec![Kind {
            function: Function::One,
            coordinate: 0,
        }];
        for (coordinate, c) in coordinates.iter().enumerate() {
            let of = |function| Kind {
                function,
                coordinate,
            };
            kinds.extend(Function::all(c).into_iter().map(of));
        }
        kinds.sort_by_key(|k| k.function.parameters());
        let grows_with = (0..coordinates.len())
            .map(|k| {
                let before = (0..k).find(|j| grow_together(&coordinates[*j], &coordinates[k]));
                before.unwrap_or(k)
            })
            .collect();
        Some(Self {
            grows_with,
            coordinates,
            kinds,
            patterns: Pattern::all(model),
            blocks: model.places().iter().map(block_of).collect(),
        })
    }

    pub fn function(&self, term: Term) -> Function {
        self.kinds[term.kind].function
    }

    pub fn coordinate(&self, term: Term) -> &Coordinate {
        &self.coordinates[self.kinds[term.kind].coordinate]
    }

    /// Whether any term is a function of the reading.
    pub fn is_along_reading(&self, terms: &[Term]) -> bool {
        let along = |t: &Term| {
            self.coordinate(*t).along == Along::Reading && self.function(*t) != Function::One
        };
        terms.iter().any(along)
    }

    /// Number of amplitudes.
    pub fn order(&self, terms: &[Term]) -> usize {
        terms.iter().map(|t| self.function(*t).order()).sum()
    }

    /// Parameters, shapes, terms, and the place in the grammar: what is less is simpler.
    pub fn complexity(&self, terms: &[Term]) -> [usize; 5] {
        let sum = |value: &dyn Fn(Term) -> usize| terms.iter().map(|t| value(*t)).sum();
        [
            sum(&|t| self.function(t).parameters()),
            sum(&|t| usize::from(self.function(t).is_shaped())),
            terms.len(),
            sum(&|t| t.pattern),
            sum(&|t| t.kind),
        ]
    }

    /// Whether two terms may stand together: two steps or bends of one pattern and of one coordinate, or of two that
    /// grow with each other, are a bump.
    pub fn may_join(&self, a: Term, b: Term) -> bool {
        let broken = |t: Term| {
            matches!(
                self.function(t),
                Function::Step | Function::Absolute(_) | Function::Corner
            )
        };
        let along = |t: Term| self.grows_with[self.kinds[t.kind].coordinate];
        let same = along(a) == along(b);
        !(broken(a) && broken(b) && same && a.pattern == b.pattern)
    }

    /// Whether no term along the reading changes it by more than a sensor may be off: beyond that it would be a
    /// function of what it changes itself.
    pub fn is_possible(&self, law: &Fitted) -> bool {
        let mut at = 0;
        law.terms.iter().all(|term| {
            let (function, c) = (self.function(*term), self.coordinate(*term));
            let own = &law.amplitudes.as_slice()[at..at + function.order()];
            at += function.order();
            if c.along != Along::Reading || function == Function::One {
                return true;
            }
            let change = |u: &f64| -> f64 {
                let values = function.at(c, term.shape, *u);
                own.iter().zip(values).map(|(a, v)| a * v).sum()
            };
            let changes = c.values.iter().map(change);
            let (low, high) = changes.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                (l.min(v), h.max(v))
            });
            high - low <= OFF * c.range()
        })
    }

    /// The change of some readings by each amplitude, readings × amplitudes.
    pub fn columns(&self, terms: &[Term], rows: &[usize]) -> DMatrix<f64> {
        let mut columns = DMatrix::zeros(rows.len(), self.order(terms));
        let mut at = 0;
        for term in terms {
            let (function, c) = (self.function(*term), self.coordinate(*term));
            let pattern = &self.patterns[term.pattern];
            for (k, row) in rows.iter().enumerate() {
                let weight = pattern.weight(self.blocks[*row]);
                if weight != 0.0 {
                    let values = function.at(c, term.shape, c.values[*row]);
                    for (j, value) in values.iter().take(function.order()).enumerate() {
                        columns[(k, at + j)] = weight * value;
                    }
                }
            }
            at += function.order();
        }
        columns
    }

    /// The change of some readings by each shape but a step's, readings × shapes.
    pub fn slopes(
        &self,
        terms: &[Term],
        amplitudes: &DVector<f64>,
        rows: &[usize],
    ) -> DMatrix<f64> {
        let mut slopes = Vec::new();
        let mut at = 0;
        for term in terms {
            let (function, c) = (self.function(*term), self.coordinate(*term));
            let pattern = &self.patterns[term.pattern];
            let own = &amplitudes.as_slice()[at..at + function.order()];
            if function.is_shaped() && function != Function::Step {
                let of = |row: &usize| {
                    let slope = function.slope(c, term.shape, c.values[*row]);
                    let sum: f64 = own.iter().zip(slope).map(|(a, s)| a * s).sum();
                    pattern.weight(self.blocks[*row]) * sum
                };
                slopes.push(DVector::from_iterator(rows.len(), rows.iter().map(of)));
            }
            at += function.order();
        }
        if slopes.is_empty() {
            DMatrix::zeros(rows.len(), 0)
        } else {
            DMatrix::from_columns(&slopes)
        }
    }
}
