//! What readings scatter by.

use crate::chance::Chance;
use crate::design::Schedule;

/// How readings scatter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Law {
    /// Independent and normal.
    White,
    /// White, and a part that is correlated along each trace (Ornstein–Uhlenbeck).
    Correlated,
    /// Student's t of three degrees of freedom.
    HeavyTails,
    /// White, on forms rougher than the spacing resolves, or with an edge.
    RoughForms,
    /// White, read to 1 to 2 standard deviations.
    Coarse,
}

impl Law {
    /// All with their names.
    pub const ALL: [(&'static str, Self); 5] = [
        ("white", Self::White),
        ("correlated", Self::Correlated),
        ("heavy tails", Self::HeavyTails),
        ("rough forms", Self::RoughForms),
        ("coarse A/D", Self::Coarse),
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL
            .iter()
            .find(|(_, law)| *law == self)
            .map_or("", |(name, _)| name)
    }
}

/// A law with its sizes.
#[derive(Debug, Clone, Copy)]
pub struct Noise {
    /// Which.
    pub law: Law,
    /// Standard deviation of one reading, µm.
    pub sigma: f64,
    /// Share of the variance that is correlated.
    pub correlated: f64,
    /// Its correlation length, mm.
    pub length: f64,
    /// Resolution of the A/D, µm; 0 none.
    pub resolution: f64,
}

impl Noise {
    /// The law with drawn sizes.
    pub fn drawn(law: Law, sigma: f64, chance: &mut Chance) -> Self {
        let correlated = chance.between(0.25, 0.6);
        let length = chance.log_between(4.0, 40.0);
        let fine = chance.log_between(0.001, sigma.max(0.0011));
        let coarse = chance.between(1.0, 2.0) * sigma;
        let resolution = match law {
            Law::Coarse => coarse,
            _ if chance.happens(0.5) => fine,
            _ => 0.0,
        };
        Self {
            law,
            sigma,
            correlated: if law == Law::Correlated {
                correlated
            } else {
                0.0
            },
            length,
            resolution,
        }
    }

    /// Readings as they are written down.
    pub fn upon(
        &self,
        clean: &[Vec<f64>],
        schedule: &Schedule,
        chance: &mut Chance,
    ) -> Vec<Vec<f64>> {
        let white = self.sigma * (1.0 - self.correlated).sqrt();
        let slow = self.sigma * self.correlated.sqrt();
        let mut all = Vec::with_capacity(clean.len());
        for (trace, values) in schedule.traces.iter().zip(clean) {
            let mut level = chance.normal();
            let mut before: Option<f64> = None;
            let mut written = Vec::with_capacity(values.len());
            for (moment, value) in trace.moments().zip(values) {
                let kept = before.map_or(0.0, |x| (-(moment.x - x).abs() / self.length).exp());
                level = kept * level + (1.0 - kept * kept).sqrt() * chance.normal();
                before = Some(moment.x);
                let one = if self.law == Law::HeavyTails {
                    chance.heavy()
                } else {
                    chance.normal()
                };
                let reading = value + white * one + slow * level;
                written.push(if self.resolution > 0.0 {
                    (reading / self.resolution).round() * self.resolution
                } else {
                    reading
                });
            }
            all.push(written);
        }
        all
    }
}
