//! An indicator's reading is curved about its own zero: I → I + d (I/R)ᵖ, d the deviation at the greatest
//! reading R, of either indicator by itself. Second power: a lever at an angle; third: a transducer near the
//! end of its range.

use std::sync::Arc;

use super::{Circumstances, Entry, Indicator, JoinedEffect, Setting, Shows, Unknown, welcome};

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "indicator-nonlinearity",
    timed: false,
    variants: |setting| {
        let of = |power| -> Arc<dyn JoinedEffect> { Arc::new(Curved::of(setting, power)) };
        vec![of(2), of(3)]
    },
    refused: welcome,
};

#[derive(Debug)]
struct Curved {
    power: i32,
    reach: f64,
    indicators: Vec<Indicator>,
}

impl Curved {
    fn of(setting: &Setting, power: i32) -> Self {
        Self {
            power,
            reach: setting.reach,
            indicators: setting.indicators(),
        }
    }
}

impl JoinedEffect for Curved {
    fn unknowns(&self) -> Vec<Unknown> {
        let name = |i: &Indicator| match i {
            Indicator::Near => "near-deviation",
            Indicator::Far => "far-deviation",
        };
        let of = |i| Unknown::size(name(i), "um", 200.0);
        self.indicators.iter().map(of).collect()
    }

    fn variant(&self) -> Option<String> {
        Some(
            if self.power == 2 {
                "quadratic"
            } else {
                "cubic"
            }
            .to_owned(),
        )
    }

    fn shows(&self) -> Option<Shows> {
        Some(Shows::Characteristic)
    }

    fn shown(&self, at: &Circumstances, seen: f64, values: &[f64], by: &mut [f64]) -> (f64, f64) {
        let own = Indicator::of(at.channel);
        let Some(k) = self.indicators.iter().position(|i| *i == own) else {
            return (0.0, 0.0);
        };
        let part = seen / self.reach;
        by[k] = part.powi(self.power);
        let slope = f64::from(self.power) * part.powi(self.power - 1) / self.reach;
        (values[k] * by[k], values[k] * slope)
    }
}
