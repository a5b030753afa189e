//! The laws that repeats allow, with what they make of the traces of a measurement.

use super::sum_of_squares;
use crate::noise::{Law, Moments, Posterior, decays, drift_form, markov_form};

/// Laws, and for each of their correlation lengths the decays along every trace.
#[derive(Debug, Clone)]
pub struct Laws {
    posterior: Posterior,
    lengths: Vec<(f64, Vec<Vec<f64>>)>,
    /// Which of the lengths each law has.
    length_of: Vec<usize>,
}

/// A trace on cells, as laws see it.
#[derive(Debug, Clone, Copy)]
pub struct Whole<'a> {
    /// Positions from the middle, mm.
    pub about_middle: &'a [f64],
    /// What a shift of one is in weighted units.
    pub one: f64,
}

impl Laws {
    /// For traces with cells at these positions.
    pub fn new<'a>(posterior: Posterior, traces: impl Iterator<Item = &'a [f64]> + Clone) -> Self {
        let mut lengths: Vec<(f64, Vec<Vec<f64>>)> = Vec::new();
        let length_of = (posterior.possible().iter())
            .map(|p| {
                let length = p.law.length;
                let known = lengths.iter().position(|l| l.0 == length);
                known.unwrap_or_else(|| {
                    let of = |positions| decays(positions, length);
                    lengths.push((length, traces.clone().map(of).collect()));
                    lengths.len() - 1
                })
            })
            .collect();
        Self {
            posterior,
            lengths,
            length_of,
        }
    }

    /// The mean of the laws.
    pub fn mean(&self) -> Law {
        self.posterior.mean()
    }

    /// Degrees of freedom of the scale of the noise.
    pub fn freedom(&self) -> f64 {
        let ones = vec![1.0; self.posterior.possible().len()];
        self.posterior.moments(&ones).student().1
    }

    /// The variance of Σ w r over the readings r of all traces, w what their cells count for.
    pub fn moments<'a>(
        &self,
        traces: impl Iterator<Item = Whole<'a>> + Clone,
        counting: &[Vec<f64>],
    ) -> Moments {
        let white: f64 = counting.iter().map(|own| sum_of_squares(own)).sum();
        let traces = || traces.clone().zip(counting);
        let shift: f64 = traces()
            .map(|(trace, own)| (trace.one * own.iter().sum::<f64>()).powi(2))
            .sum();
        let drift: f64 = traces()
            .map(|(trace, own)| trace.one.powi(2) * drift_form(trace.about_middle, own, own))
            .sum();
        let along = |(_, decays): &(f64, Vec<Vec<f64>>)| -> f64 {
            let traces = decays.iter().zip(counting);
            traces.map(|(d, own)| markov_form(d, own, own)).sum()
        };
        let correlated: Vec<f64> = self.lengths.iter().map(along).collect();
        let laws = self.posterior.possible().iter().zip(&self.length_of);
        let of = laws.map(|(p, l)| {
            p.law.white * white
                + p.law.correlated * correlated[*l]
                + p.law.shift * shift
                + p.law.drift * drift
        });
        self.posterior.moments(&of.collect::<Vec<f64>>())
    }
}

/// One law with its decays along every trace.
pub struct Products {
    law: Law,
    decays: Vec<Vec<f64>>,
}

impl Products {
    /// For traces with cells at these positions.
    pub fn new(law: Law, traces: &[&[f64]]) -> Self {
        let of = |positions: &&[f64]| decays(positions, law.length);
        Self {
            law,
            decays: traces.iter().map(of).collect(),
        }
    }

    /// aᵀVb over all traces.
    pub fn form<'a>(
        &self,
        traces: impl Iterator<Item = Whole<'a>>,
        a: &[Vec<f64>],
        b: &[Vec<f64>],
    ) -> f64 {
        let all = a.iter().zip(b).zip(&self.decays).zip(traces);
        all.map(|(((a, b), decays), trace)| {
            let law = self.law.where_whole_is(trace.one);
            law.form(decays, a, b) + law.drift * drift_form(trace.about_middle, a, b)
        })
        .sum()
    }
}
