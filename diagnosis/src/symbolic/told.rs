//! A law as a formula with its parameters.

use std::collections::BTreeMap;

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::DMatrix;
use serde::Serialize;

use crate::catalogue::formula::Formula;
use crate::catalogue::tabulated::Tabulated;
use crate::catalogue::written::rounded;
use crate::symbolic::bench::Bench;
use crate::symbolic::function::{Coordinate, Function};
use crate::symbolic::grammar::{Grammar, Term};
use crate::symbolic::pattern::{Pattern, Turn};
use crate::symbolic::view::Fitted;

/// Digits of a number in a formula: what they leave out is far below what any reading shows.
const DIGITS: usize = 9;

/// A parameter of a law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawParameter {
    /// Name.
    pub name: &'static str,
    /// Value.
    pub value: f64,
    /// Standard uncertainty.
    pub std: f64,
    /// Unit.
    pub unit: String,
}

/// One term of a law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawTerm {
    /// Class of its function, such as `power 2`, `cosine`, `step`.
    pub function: String,
    /// What it is a function of; nothing of a constant.
    pub along: Option<&'static str>,
    /// The readings that it changes, in words.
    pub pattern: String,
    /// As it stands in the formula, without its channels.
    pub formula: String,
    /// Amplitude and shape.
    pub parameters: Vec<LawParameter>,
}

/// The name of a coordinate in formulas.
fn variable(c: &Coordinate) -> &'static str {
    use crate::catalogue::curve::Along;
    match c.along {
        Along::Position => "x",
        Along::Time => "time",
        Along::Reading => "reading",
    }
}

fn number(value: f64) -> String {
    rounded(value, DIGITS)
}

/// A coordinate less a number.
fn less(name: &str, from: f64) -> String {
    if from == 0.0 {
        name.to_owned()
    } else if from < 0.0 {
        format!("({name} + {})", number(-from))
    } else {
        format!("({name} - {})", number(from))
    }
}

/// A function with its amplitudes, as a factor of a formula.
fn factor(function: Function, c: &Coordinate, shape: f64, amplitudes: &[f64]) -> String {
    let u = variable(c);
    let size = number(amplitudes.first().copied().unwrap_or(0.0) / function.scale(c));
    let origin = function.origin(c);
    let power = |base: String, k: u8| match k {
        1 => format!("{size} * {base}"),
        k => format!("{size} * {base}^{k}"),
    };
    let within = |text: String| {
        text.trim_start_matches('(')
            .trim_end_matches(')')
            .to_owned()
    };
    match function {
        Function::One => size,
        Function::Power(k, _) => power(less(u, origin), k),
        Function::Shifted(k) => power(less(u, shape), k),
        Function::Saturating => {
            format!(
                "{size} * (1 - exp(-{} / {}))",
                less(u, origin),
                number(shape.exp())
            )
        }
        Function::Growing => {
            format!(
                "{size} * (exp({} / {}) - 1)",
                less(u, origin),
                number(shape.exp())
            )
        }
        Function::Wave => {
            let (size, phase) = polar(amplitudes);
            let sign = if phase < 0.0 { '-' } else { '+' };
            format!(
                "{} * cos(2 * pi * {u} / {} {sign} {})",
                number(size),
                number(1.0 / shape),
                number(phase.abs())
            )
        }
        Function::Step => format!("{size} * step({})", within(less(u, shape))),
        Function::Absolute(_) => format!("{size} * abs({})", within(less(u, origin))),
        Function::Corner => format!("{size} * abs({})", within(less(u, shape))),
    }
}

/// a cos + b sin as A cos(… + φ).
fn polar(amplitudes: &[f64]) -> (f64, f64) {
    match amplitudes {
        [a, b] => (a.hypot(*b), (-b).atan2(*a)),
        _ => (0.0, 0.0),
    }
}

fn turn_factor(turn: Turn) -> &'static str {
    match turn {
        Turn::Alike => "",
        Turn::Turning => " * direction",
        Turn::Forward => " * step(direction)",
        Turn::Backward => " * step(-direction)",
    }
}

/// The weights of channels as a factor, by their numbers.
fn channel_factor(pattern: &Pattern) -> String {
    let mut sum = String::new();
    for (k, weight) in pattern.channels.iter().enumerate() {
        let sign = match weight {
            0 => continue,
            w if *w < 0 => {
                if sum.is_empty() {
                    "-"
                } else {
                    " - "
                }
            }
            _ => {
                if sum.is_empty() {
                    ""
                } else {
                    " + "
                }
            }
        };
        sum += &format!("{sign}same(channel, {})", k + 1);
    }
    format!(" * ({sum})")
}

/// Every term with its own amplitudes.
fn each<'f>(grammar: &Grammar, fitted: &'f Fitted) -> Vec<(Term, usize, &'f [f64])> {
    let mut at = 0;
    let of = |term: &Term| {
        let order = grammar.function(*term).order();
        at += order;
        (
            *term,
            at - order,
            &fitted.amplitudes.as_slice()[at - order..at],
        )
    };
    fitted.terms.iter().map(of).collect()
}

fn term_text(grammar: &Grammar, term: Term, amplitudes: &[f64]) -> String {
    let (function, c) = (grammar.function(term), grammar.coordinate(term));
    let turn = turn_factor(grammar.patterns[term.pattern].turn);
    factor(function, c, term.shape, amplitudes) + turn
}

/// A law as an effect of its own, without its name.
pub(super) fn effect(grammar: &Grammar, fitted: &Fitted, model: &AnyModel) -> Option<Tabulated> {
    let shared = &grammar.patterns[fitted.terms.first()?.pattern].channels;
    let of = |t: &Term| &grammar.patterns[t.pattern];
    let alike = fitted.terms.iter().all(|t| of(t).channels == *shared);
    let mut text = String::new();
    for (term, _, amplitudes) in each(grammar, fitted) {
        let mut own = term_text(grammar, term, amplitudes);
        if !alike && of(&term).is_of_channels() {
            own += &channel_factor(of(&term));
        }
        text += &match own.strip_prefix('-') {
            Some(rest) if !text.is_empty() => format!(" - {rest}"),
            _ if !text.is_empty() => format!(" + {own}"),
            _ => own,
        };
    }
    let names = model.channel_names();
    let weights = names.into_iter().zip(shared).filter(|(_, w)| **w != 0);
    let weights: BTreeMap<String, f64> = weights.map(|(name, w)| (name, f64::from(*w))).collect();
    let plain = !alike || shared.iter().all(|w| *w == 1);
    Some(Tabulated {
        formula: Some(Formula::try_from(text).ok()?),
        channels: if plain { BTreeMap::new() } else { weights },
        ..Tabulated::default()
    })
}

/// The terms with their parameters, from what is seen of them in units of the noise.
pub(super) fn terms(bench: &Bench<'_>, fitted: &Fitted) -> Vec<LawTerm> {
    let seen = bench.tangents(fitted);
    let lengths: Vec<f64> = seen.column_iter().map(|c| c.norm()).collect();
    let unit = DMatrix::from_fn(seen.nrows(), seen.ncols(), |i, j| seen[(i, j)] / lengths[j]);
    let inverse = unit.tr_mul(&unit).cholesky().map(|c| c.inverse());
    let covariance = |i: usize, j: usize| {
        inverse
            .as_ref()
            .map_or(f64::NAN, |c| c[(i, j)] / lengths[i] / lengths[j])
    };
    let (model, grammar) = (bench.model, &bench.grammar);
    let names = model.channel_names();
    let mut shape_at = fitted.amplitudes.len();
    let of = |(term, at, amplitudes): (Term, usize, &[f64])| {
        let (function, c) = (grammar.function(term), grammar.coordinate(term));
        let units = [model.reading_unit(), c.along.unit(model)];
        let mut shape_std = 0.0;
        if function.is_shaped() && function != Function::Step {
            shape_std = covariance(shape_at, shape_at).sqrt();
            shape_at += 1;
        }
        let own = DMatrix::from_fn(amplitudes.len(), amplitudes.len(), |i, j| {
            covariance(at + i, at + j)
        });
        let mut parameters = sizes(function, c, amplitudes, &own, units);
        parameters.extend(shape(function, c, term.shape, shape_std, units[1]));
        LawTerm {
            function: function.class(),
            along: (function != Function::One).then(|| c.along.name()),
            pattern: grammar.patterns[term.pattern].name(&names),
            formula: term_text(grammar, term, amplitudes),
            parameters,
        }
    };
    each(grammar, fitted).into_iter().map(of).collect()
}

fn sizes(
    function: Function,
    c: &Coordinate,
    amplitudes: &[f64],
    covariance: &DMatrix<f64>,
    [reading, coordinate]: [&str; 2],
) -> Vec<LawParameter> {
    let named = |name, value, variance: f64, unit: String| LawParameter {
        name,
        value,
        std: variance.max(0.0).sqrt(),
        unit,
    };
    if let [a, b] = amplitudes {
        let (size, phase) = polar(amplitudes);
        let along = |u: f64, v: f64| {
            u * u * covariance[(0, 0)]
                + 2.0 * u * v * covariance[(0, 1)]
                + v * v * covariance[(1, 1)]
        };
        let square = (size * size).max(f64::MIN_POSITIVE);
        return vec![
            named(
                "amplitude",
                size,
                along(a / size, b / size),
                reading.to_owned(),
            ),
            named(
                "phase",
                phase,
                along(b / square, -a / square),
                "rad".to_owned(),
            ),
        ];
    }
    let scale = function.scale(c);
    let unit = match function {
        Function::Power(1, _) | Function::Absolute(_) | Function::Corner => {
            format!("{reading}/{coordinate}")
        }
        Function::Power(k, _) | Function::Shifted(k) => format!("{reading}/{coordinate}^{k}"),
        _ => reading.to_owned(),
    };
    let value = amplitudes.first().copied().unwrap_or(0.0);
    vec![named(
        "amplitude",
        value / scale,
        covariance[(0, 0)] / (scale * scale),
        unit,
    )]
}

fn shape(
    function: Function,
    c: &Coordinate,
    shape: f64,
    std: f64,
    unit: &str,
) -> Option<LawParameter> {
    let (name, value, std) = match function {
        Function::Saturating | Function::Growing => ("constant", shape.exp(), shape.exp() * std),
        Function::Wave => ("period", 1.0 / shape, std / (shape * shape)),
        Function::Shifted(_) | Function::Corner => ("origin", shape, std),
        // Anywhere between two readings.
        Function::Step => ("place", shape, c.gap_at(shape) / 12f64.sqrt()),
        Function::One | Function::Power(..) | Function::Absolute(_) => return None,
    };
    Some(LawParameter {
        name,
        value,
        std,
        unit: unit.to_owned(),
    })
}

/// A law in one line: its formula, and its channels where they are not all.
pub(super) fn in_one_line(grammar: &Grammar, fitted: &Fitted, model: &AnyModel) -> String {
    let names = model.channel_names();
    let lines = each(grammar, fitted)
        .into_iter()
        .map(|(term, _, amplitudes)| {
            let pattern = &grammar.patterns[term.pattern];
            let text = term_text(grammar, term, amplitudes);
            let alone = Pattern {
                turn: Turn::Alike,
                ..pattern.clone()
            };
            if alone.is_plain() {
                text
            } else {
                format!("{text} in {}", alone.name(&names))
            }
        });
    lines.collect::<Vec<_>>().join("; ")
}
