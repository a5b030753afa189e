//! An error comes back periodically: in the reading of one indicator or of both (interpolation error of an
//! incremental scale, first harmonic), or along the travel in the first spindle position, where the slide's
//! form cannot take it up (ISO 230-2, periodic error).

use std::f64::consts::TAU;
use std::sync::Arc;

use super::{
    Circumstances, Entry, Indicator, JoinedEffect, Setting, Shows, Told, Unknown, welcome,
};

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "cyclic-error",
    timed: false,
    variants,
    refused: welcome,
};

#[derive(Debug)]
struct Cyclic {
    of: Of,
    /// Where the phase is counted from, and the span over which cycles are counted: µm or mm.
    middle: f64,
    span: f64,
    most: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Of {
    Indicator(Indicator),
    Both,
    Travel,
}

/// Cycles over the span between neighbouring starts of the search.
const STEP: f64 = 0.4;
/// Fewest cycles over the span: less is a form.
const FEWEST: f64 = 2.5;
/// Most cycles a position: beyond, evenly spaced readings no longer tell them apart.
const MOST: f64 = 0.45;

/// A channel whose readings hardly move tells of no fast cycles: so many times the positions at most.
const CLOSEST: f64 = 4.0;
/// Most starts of the search.
const MOST_STARTS: f64 = 2000.0;

fn variants(setting: &Setting) -> Vec<Arc<dyn JoinedEffect>> {
    let along = (MOST * setting.positions as f64).max(FEWEST + STEP);
    let (low, high) = setting.range;
    let span = (high - low).max(f64::MIN_POSITIVE);
    // The channel with the narrowest span has its readings closest to each other.
    let closer = (span / setting.spans.0.max(f64::MIN_POSITIVE)).clamp(1.0, CLOSEST);
    let reading = (0.5 * (low + high), span, along * closer);
    let mut variants: Vec<Arc<dyn JoinedEffect>> = Vec::new();
    let mut add = |of, (middle, span, most): (f64, f64, f64)| {
        variants.push(Arc::new(Cyclic {
            of,
            middle,
            span,
            most: most.min(STEP * MOST_STARTS),
        }));
    };
    let indicators = setting.indicators();
    for indicator in &indicators {
        add(Of::Indicator(*indicator), reading);
    }
    if indicators.len() == 2 {
        add(Of::Both, reading);
    }
    let turned = |sign: f64| setting.channels.iter().any(|c| c.spindle_sign() == sign);
    if turned(1.0) && turned(-1.0) {
        let middle = 0.5 * (setting.travel.0 + setting.travel.1);
        add(Of::Travel, (middle, setting.length(), along));
    }
    variants
}

impl JoinedEffect for Cyclic {
    fn unknowns(&self) -> Vec<Unknown> {
        vec![
            Unknown::size("cosine", "um", 100.0),
            Unknown::size("sine", "um", 100.0),
            Unknown::shape("cycles", "1", FEWEST, 1.1 * self.most),
        ]
    }

    fn variant(&self) -> Option<String> {
        Some(match self.of {
            Of::Indicator(i) => format!("of the reading, {} indicator", i.name()),
            Of::Both => "of the reading, both indicators alike".to_owned(),
            Of::Travel => "of the travel, first spindle position".to_owned(),
        })
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let steps = ((self.most - 3.0) / STEP).max(0.0) as usize;
        let at = |k: usize| vec![0.0, 0.0, 3.0 + STEP * k as f64];
        (0..=steps).map(at).collect()
    }

    fn shows(&self) -> Option<Shows> {
        Some(match self.of {
            Of::Travel => Shows::Added,
            _ => Shows::Scale,
        })
    }

    fn shown(&self, at: &Circumstances, seen: f64, values: &[f64], by: &mut [f64]) -> (f64, f64) {
        let sees = match self.of {
            Of::Indicator(own) => own == Indicator::of(at.channel),
            Of::Both => true,
            Of::Travel => at.channel.spindle_sign() > 0.0,
        };
        if !sees {
            return (0.0, 0.0);
        }
        let argument = if self.of == Of::Travel { at.x } else { seen };
        let part = (argument - self.middle) / self.span;
        let (sin, cos) = (TAU * values[2] * part).sin_cos();
        let turned = values[1] * cos - values[0] * sin;
        by[0] = cos;
        by[1] = sin;
        by[2] = TAU * part * turned;
        let by_seen = if self.of == Of::Travel {
            0.0
        } else {
            TAU * values[2] / self.span * turned
        };
        (values[0] * cos + values[1] * sin, by_seen)
    }

    fn told(&self, values: &[f64]) -> Vec<Told> {
        let size = values[0].hypot(values[1]);
        let unit = size.max(f64::MIN_POSITIVE);
        let cycles = values[2];
        vec![
            Told {
                name: "amplitude".to_owned(),
                value: size,
                unit: "um",
                gradient: vec![(0, values[0] / unit), (1, values[1] / unit)],
            },
            Told {
                name: "period".to_owned(),
                value: self.span / cycles,
                unit: if self.of == Of::Travel { "mm" } else { "um" },
                gradient: vec![(2, -self.span / (cycles * cycles))],
            },
        ]
    }
}
