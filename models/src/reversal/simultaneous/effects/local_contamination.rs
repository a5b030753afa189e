//! Dirt under the stylus, or a scratch, at one place of the artefact in one channel, in all repeats or in one:
//! a bump of Gaussian section, H exp(−((u − p)/w)²/2), of either sign.

use std::sync::Arc;

use super::{Circumstances, Entry, JoinedEffect, Setting, Told, Unknown, welcome};
use crate::reversal::Channel;

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "local-contamination",
    timed: false,
    variants,
    refused: welcome,
};

/// Least width from which the search begins, as a share of the travel.
const LEAST: f64 = 1.0 / 400.0;

#[derive(Debug)]
struct Bump {
    channel: Channel,
    repeat: Option<u32>,
    travel: (f64, f64),
    spacing: f64,
}

fn variants(setting: &Setting) -> Vec<Arc<dyn JoinedEffect>> {
    let mut variants: Vec<Arc<dyn JoinedEffect>> = Vec::new();
    for channel in &setting.channels {
        let single = setting.repeats.iter().map(|r| Some(*r));
        // The only repeat is the channel.
        let single = single.filter(|_| setting.repeats.len() > 1);
        for repeat in std::iter::once(None).chain(single) {
            variants.push(Arc::new(Bump {
                channel: *channel,
                repeat,
                travel: setting.travel,
                spacing: setting.spacing(),
            }));
        }
    }
    variants
}

impl Bump {
    fn length(&self) -> f64 {
        self.travel.1 - self.travel.0
    }

    /// Least and greatest width, mm: anything wider is no chip but a form.
    fn widths(&self) -> (f64, f64) {
        let least = 0.4 * self.spacing;
        (least, (0.08 * self.length()).max(2.0 * least))
    }
}

impl JoinedEffect for Bump {
    fn unknowns(&self) -> Vec<Unknown> {
        let (least, greatest) = self.widths();
        vec![
            Unknown::size("height", "um", 500.0),
            Unknown::shape("position", "mm", self.travel.0, self.travel.1),
            Unknown::shape("log-width", "1", least.ln(), greatest.ln()),
        ]
    }

    fn variant(&self) -> Option<String> {
        let channel = self.channel.name();
        Some(match self.repeat {
            None => format!("channel {channel}"),
            Some(repeat) => format!("channel {channel}, repeat {repeat}"),
        })
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let mut starts = Vec::new();
        let mut width = (0.7 * self.spacing).max(LEAST * self.length());
        while width < self.widths().1 {
            let steps = (self.length() / (2.0 * width)).ceil().max(1.0);
            for k in 0..=steps as usize {
                let position = self.travel.0 + self.length() * k as f64 / steps;
                starts.push(vec![0.0, position, width.ln()]);
            }
            width *= 2.5;
        }
        starts
    }

    fn is_on_surface(&self) -> bool {
        true
    }

    fn bump(
        &self,
        at: &Circumstances,
        u: f64,
        values: &[f64],
        by: &mut [f64],
    ) -> Option<(f64, f64)> {
        if at.channel != self.channel || self.repeat.is_some_and(|r| r != at.repeat) {
            return None;
        }
        let width = values[2].exp();
        let away = (u - values[1]) / width;
        if !(away.abs() < 9.0) {
            return None;
        }
        let shape = (-0.5 * away * away).exp();
        let height = values[0] * shape;
        by[0] = shape;
        by[1] = height * away / width;
        by[2] = height * away * away;
        Some((height, -height * away / width))
    }

    fn told(&self, values: &[f64]) -> Vec<Told> {
        let of = |k: usize, name: &str, value, unit, slope| Told {
            name: name.to_owned(),
            value,
            unit,
            gradient: vec![(k, slope)],
        };
        let width = values[2].exp();
        vec![
            of(0, "height", values[0], "um", 1.0),
            of(1, "position", values[1], "mm", 1.0),
            of(2, "width", width, "mm", width),
        ]
    }
}
