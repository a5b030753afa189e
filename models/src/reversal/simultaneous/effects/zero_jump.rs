//! An indicator's zero jumps once and stays: in all it reads from then on, or in one channel where it is set
//! to zero again before the next.

use std::sync::Arc;

use super::{
    Circumstances, Entry, Indicator, JoinedEffect, Kind, Left, Setting, Shows, Told, Unknown,
    welcome,
};
use crate::reversal::Channel;

/// See the head of the file.
pub const ENTRY: Entry = Entry {
    name: "zero-jump",
    timed: true,
    variants,
    refused: welcome,
};

#[derive(Debug)]
struct ZeroJump {
    scope: Scope,
    duration: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Scope {
    Channel(Channel),
    Indicator(Indicator),
}

/// Moments from which the search begins.
const STARTS: usize = 96;

fn variants(setting: &Setting) -> Vec<Arc<dyn JoinedEffect>> {
    let channels = setting.channels.iter().map(|c| Scope::Channel(*c));
    // An indicator with one channel is that channel.
    let indicators = setting.indicators().into_iter().filter(|i| {
        let own = setting.channels.iter();
        own.filter(|c| Indicator::of(**c) == *i).count() > 1
    });
    channels
        .chain(indicators.map(Scope::Indicator))
        .map(|scope| -> Arc<dyn JoinedEffect> {
            Arc::new(ZeroJump {
                scope,
                duration: setting.duration,
            })
        })
        .collect()
}

impl ZeroJump {
    fn sees(&self, channel: Channel) -> bool {
        match self.scope {
            Scope::Channel(own) => own == channel,
            Scope::Indicator(own) => own == Indicator::of(channel),
        }
    }
}

impl JoinedEffect for ZeroJump {
    fn unknowns(&self) -> Vec<Unknown> {
        let mut time = Unknown::shape("time", "s", 0.0, self.duration);
        time.kind = Kind::Searched;
        vec![Unknown::size("jump", "um", 1000.0), time]
    }

    fn variant(&self) -> Option<String> {
        Some(match self.scope {
            Scope::Channel(channel) => format!("channel {}", channel.name()),
            Scope::Indicator(indicator) => format!("{} indicator, from then on", indicator.name()),
        })
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let at = |k: usize| self.duration * (k as f64 + 0.5) / STARTS as f64;
        (0..STARTS).map(|k| vec![0.0, at(k)]).collect()
    }

    fn shows(&self) -> Option<Shows> {
        Some(Shows::Added)
    }

    fn shown(&self, at: &Circumstances, _seen: f64, values: &[f64], by: &mut [f64]) -> (f64, f64) {
        let after = self.sees(at.channel) && at.time > values[1];
        by[0] = f64::from(u8::from(after));
        (values[0] * by[0], 0.0)
    }

    /// Where the sum of squares is least if the jump, its size kept, lies between two readings; the
    /// standard uncertainty is that of all moments, each with the likelihood that normal noise gives it.
    fn searched(&self, left: &[Left], values: &[f64]) -> Option<(f64, f64)> {
        let (jump, before) = (values[0], values[1]);
        let weighted = left.iter().map(|l| (l.weight * l.residual).powi(2));
        let unit = (weighted.sum::<f64>() / left.len().max(1) as f64).max(f64::MIN_POSITIVE);
        let mut rows: Vec<&Left> = left.iter().filter(|l| self.sees(l.at.channel)).collect();
        rows.sort_by(|a, b| a.at.time.total_cmp(&b.at.time));
        let mut cost: f64 = rows.iter().map(|l| change(l, jump, before)).sum();
        // Cost, middle and width of every gap between readings.
        let mut gaps = Vec::with_capacity(rows.len());
        for pair in rows.windows(2) {
            cost -= change(pair[0], jump, before);
            let gap = pair[1].at.time - pair[0].at.time;
            if gap > 0.0 {
                gaps.push((cost / unit, pair[0].at.time + 0.5 * gap, gap));
            }
        }
        let best = gaps.iter().copied().min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (mut sum, mut spread) = (0.0, 0.0);
        for (cost, middle, gap) in gaps {
            let likely = gap * (-0.5 * (cost - best.0)).exp();
            sum += likely;
            spread += likely * ((middle - best.1).powi(2) + gap * gap / 12.0);
        }
        Some((best.1, (spread / sum).sqrt()))
    }

    fn told(&self, values: &[f64]) -> Vec<Told> {
        let of = |k: usize, name: &str, unit| Told {
            name: name.to_owned(),
            value: values[k],
            unit,
            gradient: vec![(k, 1.0)],
        };
        vec![of(0, "jump", "um"), of(1, "time", "s")]
    }
}

/// By how much the weighted square of a reading's residual is greater with the jump than without.
fn change(l: &Left, jump: f64, before: f64) -> f64 {
    let without = if l.at.time > before {
        l.residual + jump
    } else {
        l.residual
    };
    l.weight * l.weight * ((without - jump).powi(2) - without * without)
}
