//! What the diagnosis asks of the fitted model.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::Linearised;
use super::arrangement::Seat;
use super::heights;
use super::state::Smoothing;
use crate::model::{
    Column, Effect, FittedModel, Freedom, Pattern, Profile, Profiles, Quantity, Record, rounding_of,
};
use crate::reversal::designs::{Determined, SLOPES, Zero};
use crate::reversal::effects;

impl FittedModel for Linearised {
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
        let n = self.positions.len();
        let mean_x = self.positions.iter().sum::<f64>() / n as f64;
        let (by_channel, withheld) = self.arrangement.patterns();
        let patterns = DMatrix::from_fn(self.trace_channels.len(), by_channel.ncols(), |t, k| {
            by_channel[(self.trace_channels[t], k)]
        });
        let mut columns = self.zeros();
        if self.arrangement.has_beta() {
            let at = columns.ncols();
            columns = columns.insert_column(at, 0.0);
            for (to, place) in columns.column_mut(at).iter_mut().zip(&*self.record.places) {
                *to = self.seat(place).theta[0] * (place.x - mean_x);
            }
        }
        let line = &self.gauge.slope;
        let withheld = withheld.into_iter().map(|k| (k, line.clone())).collect();
        Freedom {
            columns,
            profiles: Some(Profiles { patterns, withheld }),
        }
    }

    fn linearised(&self) -> DVector<f64> {
        let n = self.positions.len();
        let cells = 0..n * self.present().len();
        let beyond: Vec<f64> = cells
            .map(|cell| self.beyond_first_order(cell / n, cell % n))
            .collect();
        let places = self.record.places.iter().zip(self.record.observed.iter());
        let linear = places.map(|(place, value)| value - beyond[place.cell]);
        DVector::from_iterator(self.record.places.len(), linear)
    }

    fn channel_names(&self) -> Vec<String> {
        self.present().iter().map(|s| s.name.clone()).collect()
    }

    fn patterns(&self) -> Vec<Pattern> {
        let pattern = |name: &str, weight: fn(&Seat) -> f64| Pattern {
            name: name.to_owned(),
            weights: self.present().iter().map(weight).collect(),
        };
        if self.arrangement.is_four() {
            return vec![
                pattern("closure", |s| s.theta[0]),
                pattern("M", |s| s.phi[0]),
                pattern("S_A - S_B", |s| s.psi[0]),
                pattern("S_A + S_B", |_| 1.0),
            ];
        }
        let all = [
            pattern("M_h", |s| s.phi[0]),
            pattern("M_v", |s| s.phi[1]),
            pattern("gamma_1", |s| s.psi[0]),
            pattern("gamma_2", |s| s.psi[1]),
            pattern("cone", |_| 1.0),
        ];
        let closures = self.arrangement.closures();
        let seen = all
            .into_iter()
            .filter(|p| p.weights.iter().any(|w| *w != 0.0));
        seen.chain(closures).collect()
    }

    fn quantities(&self) -> Vec<Quantity> {
        if !self.arrangement.is_four() {
            return self.slopes_of_design();
        }
        if self.present().len() < 4 {
            return Vec::new();
        }
        let n = self.positions.len();
        let mean_x = self.positions.iter().sum::<f64>() / n as f64;
        let sxx: f64 = self.positions.iter().map(|x| (x - mean_x).powi(2)).sum();
        // The closure holds no form: its line is that of least squares.
        let closing: Vec<f64> = (self.positions.iter())
            .map(|x| (x - mean_x) / sxx)
            .collect();
        let of_slope = |name: &str, sign: fn(&Seat) -> f64, slope: &[f64]| {
            self.slope_quantity(name, slope, |c| sign(&self.present()[c]) / 4.0)
        };
        let contrast =
            |name: &str, sign: fn(&Seat) -> f64| of_slope(name, sign, self.gauge.slope.as_slice());
        if self.arrangement.has_beta() {
            vec![
                contrast("alpha", |s| s.phi[0]),
                of_slope("beta", |s| s.theta[0], &closing),
                contrast("gamma", |s| s.psi[0]),
            ]
        } else {
            vec![
                contrast("alpha", |s| s.phi[0]),
                contrast("setup", |s| s.psi[0]),
                contrast("cone", |_| 1.0),
            ]
        }
    }

    fn profiles(&self) -> Vec<Profile> {
        let per_channel = self.record.traces.len() as f64 / self.present().len() as f64;
        let forms = self.forms.iter().zip(self.arrangement.form_names());
        forms
            .enumerate()
            .map(|(k, (form, name))| Profile {
                name: name.clone(),
                unit: "um",
                positions: self.positions.clone(),
                values: form.values.clone(),
                noise_gain: self.arrangement.noise_gain(k) / per_channel.sqrt(),
            })
            .collect()
    }

    fn jumps(&self) -> Vec<DMatrix<f64>> {
        vec![DMatrix::from_element(self.places().len(), 1, 1.0)]
    }

    fn stated_noise(&self) -> Option<f64> {
        let of_one = self.assumptions.noise;
        of_one.map(|noise| noise / self.readings_in_each().sqrt())
    }

    fn readings_in_each(&self) -> f64 {
        self.gathered.as_ref().map_or(1.0, |g| g.readings_per_cell)
    }

    /// Of n readings of a mean a part f was put in: (1 − f)n tell it, and those put in add a remainder each,
    /// σ²(1/((1 − f)n) + f/n) in place of σ²/n.
    ///
    /// Of n positions the height of a trace has taken one.
    fn noise_allowance(&self) -> f64 {
        let filled = self.gathered.as_ref().map_or(1.0, |gathered| {
            let share = gathered.filled() as f64 / self.record.places.len() as f64;
            1.0 / (1.0 - share) + share
        });
        let n = self.positions.len() as f64;
        match self.heights {
            Some(_) => filled * n / (n - 1.0),
            None => filled,
        }
    }

    fn levelled<'v>(&self, readings: &'v DVector<f64>) -> Cow<'v, DVector<f64>> {
        let Some(heights) = &self.heights else {
            return Cow::Borrowed(readings);
        };
        let traces = &self.record.traces;
        let above = heights.above(readings, traces, &self.trace_channels);
        Cow::Owned(heights::levelled(readings, traces, &above))
    }

    fn repeats_are_alike(&self) -> bool {
        (self.gathered.as_ref()).is_none_or(|gathered| gathered.repeated)
    }

    fn expected_scatter(&self) -> &[Column] {
        &self.scatter
    }

    fn rounding(&self) -> f64 {
        let steps = self.rounding.iter().map(|(_, own)| own.step);
        let coarse = (steps.fold(0.0, f64::max).powi(2) / (12.0 * self.readings_in_each())).sqrt();
        coarse.max(rounding_of(&self.record.observed))
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

    fn smoothed_away(&self, noise: &DVector<f64>) -> Option<DMatrix<f64>> {
        let means = self.channel_means(noise, None);
        let drawn = self.arrangement.forms(&means, self.positions.len())?;
        let away = self.forms.iter().zip(&drawn);
        let away = away.map(|(form, noise)| self.smoother.smoothed_away(form, noise));
        Some(DMatrix::from_columns(&away.collect::<Vec<_>>()))
    }

    fn roughened(mut self, away: &DMatrix<f64>) -> Self {
        for (form, away) in self.forms.iter_mut().zip(away.column_iter()) {
            *form = self.smoother.roughened(form, &away.clone_owned());
        }
        self.settle();
        self
    }

    fn further(&self) -> Vec<(String, Self)> {
        self.further_measurements()
    }

    /// The indicators' zeros, and how the artefact lies: γ, and β where it is fitted.
    fn set_anew(&self) -> Option<DMatrix<f64>> {
        let slopes: [fn(&Seat) -> f64; 3] = [|s| s.psi[0], |s| s.psi[1], |s| s.theta[0]];
        let fitted = if self.arrangement.has_beta() { 3 } else { 2 };
        let mut anew = self.zeros();
        for slope in &slopes[..fitted] {
            let at = anew.ncols();
            anew = anew.insert_column(at, 0.0);
            for (to, place) in anew.column_mut(at).iter_mut().zip(&*self.record.places) {
                *to = slope(self.seat(place)) * (place.x - self.middle);
            }
        }
        Some(anew)
    }

    fn beneath(mut self, change: &DVector<f64>) -> Self {
        self.beneath = Some(change.clone());
        self
    }

    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        effects::all(&self.arrangement)
    }
}

impl Linearised {
    /// How the indicators' zeros enter, readings × zeros: one for every channel, or for every repeat whose height is an
    /// unknown, or what the channels have in common where zeros are kept.
    fn zeros(&self) -> DMatrix<f64> {
        if let Some(heights) = &self.heights {
            return heights.columns(&self.record.traces);
        }
        let constants = match self.arrangement.zero() {
            Zero::Reset => DMatrix::identity(self.present().len(), self.present().len()),
            Zero::Kept => self.arrangement.constants(),
        };
        DMatrix::from_fn(self.record.places.len(), constants.ncols(), |k, j| {
            constants[(self.record.places[k].channel, j)]
        })
    }

    /// A slope as a linear function of the readings, by the weights of the channels on it.
    fn slope_quantity(&self, name: &str, slope: &[f64], weight: impl Fn(usize) -> f64) -> Quantity {
        let traces = |channel: usize| {
            let own = self.trace_channels.iter().filter(|c| **c == channel);
            own.count() as f64
        };
        let by_channel: Vec<f64> = (0..self.present().len())
            .map(|c| weight(c) / traces(c))
            .collect();
        Quantity {
            name: name.to_owned(),
            unit: "rad",
            weights: DVector::from_iterator(
                self.record.places.len(),
                // µm per mm is 10⁻³ rad.
                (self.record.places.iter())
                    .map(|p| 1e-3 * by_channel[p.channel] * slope[self.at(p)]),
            ),
        }
    }

    /// What a design determines of α, γ, τ and κ.
    fn slopes_of_design(&self) -> Vec<Quantity> {
        let slopes = &self.arrangement.determined().slopes;
        let weights = slopes.weights();
        let mut names: Vec<(usize, String)> =
            Determined::names(slopes).into_iter().enumerate().collect();
        // Those of the slide first.
        names.sort_by_key(|(_, name)| {
            SLOPES
                .iter()
                .position(|s| name.split(' ').next() == Some(s))
        });
        names
            .into_iter()
            .map(|(p, name)| {
                self.slope_quantity(&name, self.gauge.slope.as_slice(), |c| weights[(p, c)])
            })
            .collect()
    }
}
