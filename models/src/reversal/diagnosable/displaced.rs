//! The forms of an artefact that lies farther along its axis in some positions of the spindle than in others.
//!
//! The forms of a fit that knows of no shift are the mean of S(x) and S(x − s); those of one that does follow by least
//! squares from the means of the channels, by conjugate gradients from the forms as they are.

use nalgebra::DVector;

use super::super::smooth_profile::SmoothProfile;
use super::Linearised;
use crate::model::Place;

/// Rounds of conjugate gradients: waves of twice the shift, which both positions hardly tell, stay as they were.
const ROUNDS: usize = 40;
/// Gradient, by that of the first round, at which they end.
const AT_REST: f64 = 1e-8;

impl Linearised {
    /// What readings say of forms and surface where the artefact lies `shift(position)` mm farther along its axis.
    pub(in crate::reversal) fn parted(
        &self,
        readings: &DVector<f64>,
        shift: impl Fn(usize) -> f64,
    ) -> Parted {
        let n = self.positions.len();
        let mut unknowns = DVector::zeros(self.forms.len() * n + 2 * self.present().len());
        for (f, form) in self.forms.iter().enumerate() {
            unknowns.rows_mut(f * n, n).copy_from(&form.values);
        }
        let seen = Seen::new(self, readings, &shift);
        let unknowns = seen.solved(unknowns);
        let mut forms: Vec<DVector<f64>> = (0..self.forms.len())
            .map(|f| unknowns.rows(f * n, n).clone_owned())
            .collect();
        let mut beyond: Vec<(usize, f64)> = (seen.beyond.iter())
            .map(|(cell, (read, terms))| (*cell, read - sum_of(terms, &unknowns)))
            .collect();
        for (f, form) in forms.iter_mut().enumerate() {
            let slope = self.gauge.slope.dot(form);
            let height = self.gauge.height.dot(form) - slope * self.gauge.center;
            let line = |x: f64| height + slope * x;
            for (value, x) in form.iter_mut().zip(&self.positions) {
                *value -= line(*x);
            }
            for (cell, value) in &mut beyond {
                let channel = *cell / n;
                if self.arrangement.side_form(channel) == f {
                    let shift = shift(self.present()[channel].position);
                    *value -= line(self.positions[*cell % n] - shift);
                }
            }
        }
        Parted { forms, beyond }
    }

    /// Forms that were parted, as smooth as the state's own.
    pub(in crate::reversal) fn as_smooth(&self, parted: &Parted) -> Vec<SmoothProfile> {
        let forms = self.forms.iter().zip(&parted.forms);
        forms
            .map(|(form, raw)| self.smoother.smooth_as(form, raw))
            .collect()
    }

    /// Readings as they would be without such shifts.
    pub(in crate::reversal) fn without_shifts(
        &self,
        readings: &DVector<f64>,
        shift: impl Fn(usize) -> f64,
    ) -> DVector<f64> {
        let Parted { forms, beyond } = self.parted(readings, &shift);
        let forms: Vec<SmoothProfile> = forms
            .into_iter()
            .map(|form| self.smoother.through(form))
            .collect();
        let mut clean = readings.clone();
        for (reading, place) in clean.iter_mut().zip(&*self.record.places) {
            let shift = shift(self.seat(place).position);
            if shift != 0.0 {
                let form = &forms[self.side_form(place)];
                *reading -= shift * self.displaced(form, &beyond, place, shift);
            }
        }
        clean
    }

    /// Change of a reading by a shift of the artefact, per mm of it, with the surface that is known beyond its form.
    pub(in crate::reversal) fn displaced(
        &self,
        form: &SmoothProfile,
        beyond: &[(usize, f64)],
        place: &Place,
        shift: f64,
    ) -> f64 {
        match beyond.iter().find(|(cell, _)| *cell == place.cell) {
            Some((_, there)) => (there - form.values[self.at(place)]) / shift,
            None => -self.chord_of(form, place, -shift),
        }
    }

    /// A form of the state, by its index.
    pub(in crate::reversal) fn form(&self, form: usize) -> &SmoothProfile {
        &self.forms[form]
    }

    /// Index of the form of the side that a place's channel sees.
    pub(in crate::reversal) fn side_form(&self, place: &Place) -> usize {
        self.arrangement.side_form(place.channel)
    }
}

/// Forms and surface of an artefact that lies elsewhere along its axis in some positions.
pub(in crate::reversal) struct Parted {
    /// In the order of the arrangement, without straight lines.
    forms: Vec<DVector<f64>>,
    /// By cell, the surface beyond the ends of the form that is read there.
    pub beyond: Vec<(usize, f64)>,
}

/// A value between places by the cubic through four of them.
struct Cubic {
    from: usize,
    of: [f64; 4],
}

impl Cubic {
    fn new(positions: &[f64], x: f64) -> Self {
        let right = positions.partition_point(|p| *p < x);
        let from = right.saturating_sub(2).min(positions.len() - 4);
        let own = &positions[from..from + 4];
        let weight = |j: usize| {
            let others = (0..4).filter(|i| *i != j);
            let parts = others.map(|i| (x - own[i]) / (own[j] - own[i]));
            parts.product::<f64>()
        };
        Self {
            from,
            of: [weight(0), weight(1), weight(2), weight(3)],
        }
    }
}

/// The mean of a channel at a place less the line of the channel, and the unknowns that it is the sum of, with their
/// factors.
type Row = (f64, Vec<(usize, f64)>);

fn sum_of(terms: &[(usize, f64)], unknowns: &DVector<f64>) -> f64 {
    terms.iter().map(|(at, of)| of * unknowns[*at]).sum()
}

/// How the means of the channels follow from forms and, behind them, a height and a slope a channel.
struct Seen {
    rows: Vec<Row>,
    /// By cell, rows without the form of the side: where that is read beyond its ends.
    beyond: Vec<(usize, Row)>,
}

impl Seen {
    /// With the artefact farther along by a shift in each position.
    fn new(model: &Linearised, readings: &DVector<f64>, shift: impl Fn(usize) -> f64) -> Self {
        let positions = &model.positions;
        let n = positions.len();
        let (first, last) = (positions[0], positions[n - 1]);
        let lines = model.forms.len() * n;
        let means = model.channel_means(readings, None);
        let (mut rows, mut beyond) = (Vec::new(), Vec::new());
        for (c, mean) in means.iter().enumerate() {
            let Some(mean) = mean else { continue };
            let (line, shift) = (&model.lines[c], shift(model.present()[c].position));
            let side = model.arrangement.side_form(c) * n;
            for (k, x) in positions.iter().enumerate() {
                let slides = model.arrangement.slides(c).iter();
                let mut terms: Vec<(usize, f64)> = slides
                    .map(|(form, factor)| (form * n + k, *factor))
                    .collect();
                terms.push((lines + 2 * c, 1.0));
                terms.push((lines + 2 * c + 1, (x - model.middle) / model.travel()));
                let (read, there) = (mean[k] - line.offset - line.slope * x, x - shift);
                if (first..=last).contains(&there) {
                    let cubic = Cubic::new(positions, there);
                    let of = cubic.of.iter().enumerate();
                    terms.extend(of.map(|(j, weight)| (side + cubic.from + j, *weight)));
                    rows.push((read, terms));
                } else {
                    beyond.push((c * n + k, (read, terms)));
                }
            }
        }
        Self { rows, beyond }
    }

    fn of(&self, unknowns: &DVector<f64>) -> DVector<f64> {
        let sums = self.rows.iter().map(|(_, terms)| sum_of(terms, unknowns));
        DVector::from_iterator(self.rows.len(), sums)
    }

    fn transposed(&self, left: &DVector<f64>, unknowns: usize) -> DVector<f64> {
        let mut sums = DVector::zeros(unknowns);
        for ((_, terms), left) in self.rows.iter().zip(left.iter()) {
            for (at, of) in terms {
                sums[*at] += of * left;
            }
        }
        sums
    }

    /// The least-squares solution, by conjugate gradients on the normal equations (Hestenes and Stiefel 1952).
    fn solved(&self, mut unknowns: DVector<f64>) -> DVector<f64> {
        let read = DVector::from_iterator(self.rows.len(), self.rows.iter().map(|row| row.0));
        let mut left = read - self.of(&unknowns);
        let mut gradient = self.transposed(&left, unknowns.len());
        let mut towards = gradient.clone();
        let first = gradient.norm_squared();
        let mut square = first;
        for _ in 0..ROUNDS {
            if square <= AT_REST * AT_REST * first {
                break;
            }
            let seen = self.of(&towards);
            let step = square / seen.norm_squared();
            unknowns.axpy(step, &towards, 1.0);
            left.axpy(-step, &seen, 1.0);
            gradient = self.transposed(&left, unknowns.len());
            let next = gradient.norm_squared();
            towards = &gradient + towards * (next / square);
            square = next;
        }
        unknowns
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::FittedModel;
    use crate::reversal::diagnosable::Assumptions;
    use crate::reversal::{Channel, Direction, Observations, Reading};

    const SPACING: f64 = 1.5;
    const COUNT: usize = 120;
    const SHIFT: f64 = 6.2;

    fn side_a(x: f64) -> f64 {
        (0.11 * x).sin() + 0.8 * (-0.5 * ((x - 70.0) / 4.0).powi(2)).exp()
    }

    fn side_b(x: f64) -> f64 {
        0.7 * (0.07 * x + 1.0).cos() - 0.6 * (-0.5 * ((x - 120.0) / 5.0).powi(2)).exp()
    }

    /// Two repeats without noise, the artefact farther along in the second position.
    fn model() -> Linearised {
        let mut readings = Vec::new();
        for channel in Channel::ALL {
            for repeat in 1..=2 {
                readings.extend((0..COUNT).map(|k| {
                    let x = SPACING * k as f64;
                    let slide = 0.5 * (0.05 * x).sin();
                    let value = match channel {
                        Channel::C1A => slide + side_a(x),
                        Channel::C1B => -slide + side_b(x),
                        Channel::C2A => -slide + side_a(x - SHIFT),
                        Channel::C2B => slide + side_b(x - SHIFT),
                    };
                    Reading {
                        channel,
                        repeat,
                        direction: Direction::Forward,
                        time: None,
                        x,
                        value,
                    }
                }));
            }
        }
        Linearised::new(&Observations { readings }, Assumptions::default()).unwrap()
    }

    #[test]
    fn the_shift_and_the_forms_follow_from_the_readings() {
        let model = model();
        let read = model.observed().clone();
        let laid = model.laid(&read, |p| p == 0, |p| p == 1).unwrap();
        let shift = laid.best(20.0);
        // Interpolated between places 1.5 mm apart, bumps of 4 mm.
        assert!((shift - SHIFT).abs() < 0.02, "{shift}");
        assert!(laid.misfit(shift) < 1e-3 * laid.misfit(0.0));

        // What the second position reads beyond the end of the forms is known too.
        let clean = model.without_shifts(&read, |p| f64::from(u8::from(p == 1)) * SHIFT);
        let still = model.laid(&clean, |p| p == 0, |p| p == 1).unwrap();
        assert!(still.misfit(0.0) < 1e-3 * laid.misfit(0.0));
        let fit = model.refit_as_smooth(clean);
        let left = (fit.observed() - fit.linearised()).amax();
        let off = |k: usize| fit.smooth_reading(k) - fit.observed()[k];
        let most = (0..read.len()).map(|k| off(k).abs()).fold(left, f64::max);
        assert!(most < 0.02, "{most}");
    }

    #[test]
    fn a_position_that_was_not_read_tells_no_shift() {
        let model = model();
        let read = model.observed();
        assert!(model.laid(read, |p| p == 0, |p| p == 5).is_none());
    }
}
