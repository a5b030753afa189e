//! Each indicator's zero goes up and down with the temperature of the shop, by an amount and at a phase of its
//! own: c cos(2πt/P) + s sin(2πt/P), the period P at most the duration of the test.

use std::f64::consts::TAU;

use super::{
    Circumstances, Entry, Indicator, JoinedEffect, Setting, Shows, Told, Unknown, only, welcome,
};

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "ambient-cycle",
    timed: true,
    variants: |setting| only(AmbientCycle::of(setting)),
    refused: welcome,
};

#[derive(Debug)]
struct AmbientCycle {
    duration: f64,
    indicators: Vec<Indicator>,
}

/// Cycles over the test between neighbouring starts, and most of them.
const STEP: f64 = 0.4;
const MOST: f64 = 40.0;
/// Fewest cycles over the test: less is a drift.
const FEWEST: f64 = 0.9;

impl AmbientCycle {
    fn of(setting: &Setting) -> Self {
        Self {
            duration: setting.duration,
            indicators: setting.indicators(),
        }
    }

    fn cycles(&self) -> usize {
        2 * self.indicators.len()
    }
}

impl JoinedEffect for AmbientCycle {
    fn unknowns(&self) -> Vec<Unknown> {
        let names = |i: &Indicator| match i {
            Indicator::Near => ["near-cosine", "near-sine"],
            Indicator::Far => ["far-cosine", "far-sine"],
        };
        let sizes = self.indicators.iter().flat_map(names);
        sizes
            .map(|name| Unknown::size(name, "um", 100.0))
            .chain([Unknown::shape("cycles", "1", FEWEST, 1.1 * MOST)])
            .collect()
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let steps = ((MOST - 1.0) / STEP) as usize;
        let at = |k: usize| {
            let mut values = vec![0.0; self.cycles()];
            values.push(1.0 + STEP * k as f64);
            values
        };
        (0..=steps).map(at).collect()
    }

    fn shows(&self) -> Option<Shows> {
        Some(Shows::Added)
    }

    fn shown(&self, at: &Circumstances, _seen: f64, values: &[f64], by: &mut [f64]) -> (f64, f64) {
        let own = Indicator::of(at.channel);
        let Some(k) = self.indicators.iter().position(|i| *i == own) else {
            return (0.0, 0.0);
        };
        // Counted from the middle of the test, so that phase and period hardly disturb each other.
        let part = at.time / self.duration.max(f64::MIN_POSITIVE) - 0.5;
        let (sin, cos) = (TAU * values[self.cycles()] * part).sin_cos();
        let (cosine, sine) = (values[2 * k], values[2 * k + 1]);
        by[2 * k] = cos;
        by[2 * k + 1] = sin;
        by[self.cycles()] = TAU * part * (sine * cos - cosine * sin);
        (cosine * cos + sine * sin, 0.0)
    }

    fn told(&self, values: &[f64]) -> Vec<Told> {
        let mut told = Vec::new();
        for (k, indicator) in self.indicators.iter().enumerate() {
            let (cosine, sine) = (values[2 * k], values[2 * k + 1]);
            let size = cosine.hypot(sine);
            let unit = size.max(f64::MIN_POSITIVE);
            told.push(Told {
                name: format!("{}-amplitude", indicator.name()),
                value: size,
                unit: "um",
                gradient: vec![(2 * k, cosine / unit), (2 * k + 1, sine / unit)],
            });
        }
        let cycles = values[self.cycles()];
        told.push(Told {
            name: "period".to_owned(),
            value: self.duration / cycles,
            unit: "s",
            gradient: vec![(self.cycles(), -self.duration / (cycles * cycles))],
        });
        told
    }
}
