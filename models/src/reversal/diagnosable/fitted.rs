//! What the diagnosis asks of the fitted model.

use nalgebra::{DMatrix, DVector};

use super::{FirstOrder, Gauge, Smoothing, forms};
use crate::model::{Effect, FittedModel, Freedom, Pattern, Profile, Profiles, Quantity, Record};
use crate::reversal::smooth_profile::SmoothProfile;
use crate::reversal::{Channel, effects};

impl FittedModel for FirstOrder {
    fn name(&self) -> &'static str {
        "reversal"
    }

    fn reading_unit(&self) -> &'static str {
        "um"
    }

    fn record(&self) -> &Record {
        &self.record
    }

    fn smooth(&self) -> Option<DVector<f64>> {
        let readings = 0..self.record.places.len();
        Some(DVector::from_iterator(
            self.record.places.len(),
            readings.map(|k| self.smooth_reading(k)),
        ))
    }

    fn freedom(&self) -> Freedom {
        let traces = self.record.traces.len();
        let n = self.positions.len();
        let mean_x = self.positions.iter().sum::<f64>() / n as f64;
        let mut patterns = DMatrix::zeros(traces, 3);
        for (t, channel) in self.trace_channels.iter().enumerate() {
            patterns[(t, 0)] = channel.indicator_sign();
            patterns[(t, 1)] = channel.side_sign();
            patterns[(t, 2)] = 1.0;
        }
        let offsets = self.present.len();
        let mut columns = DMatrix::zeros(
            self.record.places.len(),
            offsets + usize::from(!self.rigid()),
        );
        for (k, place) in self.record.places.iter().enumerate() {
            columns[(k, place.channel)] = 1.0;
            if !self.rigid() {
                columns[(k, offsets)] = self.channel(place).spindle_sign() * (place.x - mean_x);
            }
        }
        // M's line is α and the line of S_A − S_B is γ, so those two functions may hold one; that
        // of S_A + S_B is the cone, which only the rigid convention has.
        let withheld = if self.rigid() {
            Vec::new()
        } else {
            vec![(2, Gauge::of(&self.positions).slope)]
        };
        Freedom {
            columns,
            profiles: Some(Profiles { patterns, withheld }),
        }
    }

    fn linearised(&self) -> DVector<f64> {
        let half = self.assumptions.thickness.map_or(0.0, |d| d / 2.0);
        DVector::from_iterator(
            self.record.places.len(),
            self.record
                .places
                .iter()
                .zip(self.record.observed.iter())
                .map(|(place, value)| {
                    let slope = self.tilt(self.channel(place));
                    // A channel tilted by ψ climbs tan ψ per length, and its probe point lies h·ψ
                    // further along the artefact.
                    let climb = (slope - slope.atan()) * 1e3 * place.x;
                    value - climb - self.side_slope(place) * half * slope
                }),
        )
    }

    fn channel_names(&self) -> Vec<String> {
        self.present.iter().map(|c| c.name().to_owned()).collect()
    }

    fn patterns(&self) -> Vec<Pattern> {
        let pattern = |name: &str, weight: fn(Channel) -> f64| Pattern {
            name: name.to_owned(),
            weights: self.present.iter().map(|c| weight(*c)).collect(),
        };
        vec![
            pattern("closure", Channel::spindle_sign),
            pattern("M", Channel::indicator_sign),
            pattern("S_A - S_B", Channel::side_sign),
            pattern("S_A + S_B", |_| 1.0),
        ]
    }

    fn quantities(&self) -> Vec<Quantity> {
        if self.present.len() < 4 {
            return Vec::new();
        }
        let n = self.positions.len();
        let mean_x = self.positions.iter().sum::<f64>() / n as f64;
        let sxx: f64 = self.positions.iter().map(|x| (x - mean_x).powi(2)).sum();
        // The closure holds no form: its line is that of least squares.
        let closing: Vec<f64> = (self.positions.iter())
            .map(|x| (x - mean_x) / sxx)
            .collect();
        let gauge = Gauge::of(&self.positions);
        let of_slope = |name: &str, sign: fn(Channel) -> f64, slope: &[f64]| Quantity {
            name: name.to_owned(),
            unit: "rad",
            weights: DVector::from_iterator(
                self.record.places.len(),
                self.record.places.iter().map(|place| {
                    let channel = self.channel(place);
                    let traces = self
                        .trace_channels
                        .iter()
                        .filter(|c| **c == channel)
                        .count() as f64;
                    // µm per mm is 10⁻³ rad.
                    1e-3 * sign(channel) * slope[self.at(place)] / (4.0 * traces)
                }),
            ),
        };
        let contrast =
            |name: &str, sign: fn(Channel) -> f64| of_slope(name, sign, gauge.slope.as_slice());
        if self.rigid() {
            vec![
                contrast("alpha", Channel::indicator_sign),
                contrast("setup", Channel::side_sign),
                contrast("cone", |_| 1.0),
            ]
        } else {
            vec![
                contrast("alpha", Channel::indicator_sign),
                of_slope("beta", Channel::spindle_sign, &closing),
                contrast("gamma", Channel::side_sign),
            ]
        }
    }

    fn profiles(&self) -> Vec<Profile> {
        let per_channel = self.record.traces.len() as f64 / self.present.len() as f64;
        let profile = |name: &str, form: &SmoothProfile, gain: f64| Profile {
            name: name.to_owned(),
            unit: "um",
            positions: self.positions.clone(),
            values: form.values.clone(),
            noise_gain: gain / per_channel.sqrt(),
        };
        vec![
            profile("M", &self.m, 0.5),
            profile("S_A", &self.s_a, 0.5f64.sqrt()),
            profile("S_B", &self.s_b, 0.5f64.sqrt()),
        ]
    }

    fn zero_may_jump(&self) -> bool {
        true
    }

    fn stated_noise(&self) -> Option<f64> {
        // That of one reading: what is gathered is a mean of so many.
        let readings = self.gathered.as_ref().map_or(1.0, |g| g.readings_per_cell);
        self.assumptions.noise.map(|noise| noise / readings.sqrt())
    }

    fn refit(&self, observed: DVector<f64>) -> Self {
        let mut fitted = self.clone();
        fitted.record.observed = observed;
        fitted.fit(Smoothing::Chosen);
        fitted
    }

    fn refit_as_smooth(&self, observed: DVector<f64>) -> Self {
        let mut fitted = self.clone();
        fitted.record.observed = observed;
        fitted.fit(Smoothing::Kept);
        fitted
    }

    fn as_read(&self) -> Self {
        let mut fitted = self.clone();
        fitted.fit(Smoothing::None);
        fitted
    }

    fn roughened(mut self, noise: &DVector<f64>) -> Self {
        let drawn = forms(&self.channel_means(noise, None), self.positions.len());
        for (form, noise) in [&mut self.m, &mut self.s_a, &mut self.s_b]
            .into_iter()
            .zip(&drawn)
        {
            *form = self.smoother.roughened(form, noise);
        }
        self.settle();
        self
    }

    fn further(&self) -> Vec<(String, Self)> {
        self.further_measurements()
    }

    fn beneath(mut self, change: &DVector<f64>) -> Self {
        self.beneath = Some(change.clone());
        self
    }

    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        effects::all()
    }
}
