//! Each indicator's zero drifts towards its equilibrium by an amount of its own: d (1 − e^(−κs))/(1 − e^(−κ))
//! with s the part of the whole time that has gone by and κ the whole time over the time constant (first-order
//! thermal response, ISO 230-3). κ → 0 is a straight line.

use super::{
    Circumstances, Entry, Indicator, JoinedEffect, Setting, Shows, Told, Unknown, only, welcome,
};

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "thermal-drift",
    timed: true,
    variants: |setting| only(ThermalDrift::of(setting)),
    refused: welcome,
};

#[derive(Debug)]
struct ThermalDrift {
    duration: f64,
    indicators: Vec<Indicator>,
}

impl ThermalDrift {
    fn of(setting: &Setting) -> Self {
        Self {
            duration: setting.duration,
            indicators: setting.indicators(),
        }
    }

    fn rate(&self) -> usize {
        self.indicators.len()
    }
}

/// Whole times over time constants from which the search begins.
const RATES: [f64; 7] = [0.1, 1.0, 2.0, 4.0, 8.0, 16.0, 33.0];

impl JoinedEffect for ThermalDrift {
    fn unknowns(&self) -> Vec<Unknown> {
        let name = |i: &Indicator| match i {
            Indicator::Near => "near-drift",
            Indicator::Far => "far-drift",
        };
        let drifts = self.indicators.iter();
        drifts
            .map(|i| Unknown::size(name(i), "um", 500.0))
            // A time constant of 20 times the whole is a straight line, one of 1/200 a jump.
            .chain([Unknown::shape("rate", "1", 0.05, 200.0)])
            .collect()
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let of = |rate: f64| {
            let mut values = vec![0.0; self.rate()];
            values.push(rate);
            values
        };
        RATES.map(of).to_vec()
    }

    fn shows(&self) -> Option<Shows> {
        Some(Shows::Added)
    }

    fn shown(&self, at: &Circumstances, _seen: f64, values: &[f64], by: &mut [f64]) -> (f64, f64) {
        let own = Indicator::of(at.channel);
        let Some(k) = self.indicators.iter().position(|i| *i == own) else {
            return (0.0, 0.0);
        };
        let part = at.time / self.duration.max(f64::MIN_POSITIVE);
        let (response, by_rate) = response(part, values[self.rate()]);
        by[k] = response;
        by[self.rate()] = values[k] * by_rate;
        (values[k] * response, 0.0)
    }

    fn told(&self, values: &[f64]) -> Vec<Told> {
        let mut told: Vec<Told> = self.unknowns()[..self.rate()]
            .iter()
            .enumerate()
            .map(|(k, unknown)| Told {
                name: unknown.name.clone().into_owned(),
                value: values[k],
                unit: unknown.unit,
                gradient: vec![(k, 1.0)],
            })
            .collect();
        let rate = values[self.rate()];
        told.push(Told {
            name: "time-constant".to_owned(),
            value: self.duration / rate,
            unit: "s",
            gradient: vec![(self.rate(), -self.duration / (rate * rate))],
        });
        told
    }
}

/// The share of the drift that a part of the time has brought, and its derivative by κ.
fn response(part: f64, rate: f64) -> (f64, f64) {
    if rate.abs() < 1e-4 {
        let bend = 0.5 * part * (1.0 - part);
        return (part + rate * bend, bend);
    }
    let (gone, whole) = (-(-rate * part).exp_m1(), -(-rate).exp_m1());
    let (gone_by, whole_by) = (part * (-rate * part).exp(), (-rate).exp());
    (
        gone / whole,
        (gone_by * whole - gone * whole_by) / (whole * whole),
    )
}
