//! What the forms may be between the positions at which they are known.
//!
//! An effect that moves the place where a form is touched shows the form between the positions, and a form
//! that is rough at their spacing is not known there. How rough it is, the readings say: each position is
//! predicted by the cubic through its four neighbours, and the error by that through every second of them.
//! Means of products of different repeats are free of noise. The ratio of the two errors, over spacings that
//! differ by two, tells how much smaller the error is between neighbours; a form that is rough at every
//! spacing has it as great there, which is the most it can be.
//!
//! Beyond the first and the last position a form goes on straight. How far it may be from there, the form itself
//! says: as far as it gets, within the travel, from its tangents over the same distance.

use nalgebra::DVector;

use super::super::smooth_profile::Spot;
use super::Linearised;
use crate::model::{Column, Place};

/// Positions over which errors are averaged, to either side.
const WINDOW: usize = 7;
/// Errors of neighbouring positions share readings: so many stand for one.
const SHARED: f64 = 3.0;
/// Standard deviations by which a mean over so few may fall short.
const SHORT: f64 = 2.0;
/// Standard deviations of chance beyond which a form is rough.
const ROUGH: f64 = 3.0;
/// Places of a form from which its tangents are followed.
const TANGENTS: usize = 200;
/// Squared departure from the tangent at an end to that from tangents within: an end has one side.
const ONE_SIDED: f64 = 2.0;
/// Changes by readings that are told, the greatest first: a diagnosis holds them in a table.
const MOST_VALUES: usize = 20_000_000;
/// Squared displacements, in the unit of the reading, below which a form between positions is known.
const PLACES_ALIKE: f64 = 1e-6;

impl Linearised {
    /// Changes of the readings, of one standard deviation each, by what the forms may be where an effect has them
    /// touched: `shifts` gives for a reading, by its number and place, how far from its position, mm, the forms of the slide and that of
    /// the artefact are seen. What all readings at a position have in common is form.
    pub(in crate::reversal) fn between_positions(
        &self,
        shifts: impl Fn(usize, &Place) -> [f64; 2],
    ) -> Vec<Column> {
        let rough = self.roughness();
        let slides = self.forms.len() - self.sides();
        let n = self.positions.len();
        let mut columns = Vec::new();
        for (form, variances) in rough.iter().enumerate() {
            // By position: the places where the form is seen, with readings and factors.
            let mut seen: Vec<Vec<Seen>> = (0..n).map(|_| Vec::new()).collect();
            for (k, place) in self.record.places.iter().enumerate() {
                let factor = self.factor(place.channel, form);
                if factor == 0.0 {
                    continue;
                }
                let shift = shifts(k, place)[usize::from(form >= slides)];
                let own = &mut seen[self.at(place)];
                let known = own
                    .iter_mut()
                    .find(|s| (s.shift - shift).abs() < PLACES_ALIKE * self.travel());
                match known {
                    Some(seen) => seen.add(k, factor),
                    None => own.push(Seen::new(shift, k, factor)),
                }
            }
            for (at, own) in seen.into_iter().enumerate() {
                columns.extend(self.open_at(at, own, (form, variances)));
            }
        }
        let most = (MOST_VALUES / self.record.places.len().max(1)).max(1);
        if columns.len() > most {
            let size = |c: &Column| c.values.iter().map(|v| v * v).sum::<f64>();
            columns.sort_by(|a, b| size(b).total_cmp(&size(a)));
            columns.truncate(most);
        }
        columns
    }

    /// The columns of one position: of two places the difference alone shows.
    fn open_at(&self, at: usize, own: Vec<Seen>, rough: (usize, &[f64])) -> Vec<Column> {
        if own.len() < 2 {
            return Vec::new();
        }
        let variance = |seen: &Seen| self.open_variance(self.positions[at] + seen.shift, rough);
        let all: f64 = own.iter().map(&variance).sum();
        let columns = own.iter().enumerate().filter_map(|(k, seen)| {
            let square = match own.len() {
                2 if k == 0 => all,
                2 => 0.0,
                _ => variance(seen),
            };
            (square > 0.0).then(|| seen.column(square.sqrt()))
        });
        columns.collect()
    }

    /// Variance of a form at a place, given what it is at the positions.
    fn open_variance(&self, x: f64, (form, variances): (usize, &[f64])) -> f64 {
        let positions = &self.positions;
        let (first, last) = (positions[0], positions[positions.len() - 1]);
        let after = positions.partition_point(|p| *p < x);
        let gap = after.clamp(1, positions.len() - 1) - 1;
        let beyond = (first - x).max(x - last);
        if beyond > PLACES_ALIKE * (last - first) {
            return variances[gap] + ONE_SIDED * self.departure(form, beyond);
        }
        let part = (x - positions[gap]) / (positions[gap + 1] - positions[gap]);
        if part.min(1.0 - part) < PLACES_ALIKE {
            return 0.0;
        }
        let swing = (std::f64::consts::PI * part).sin();
        variances[gap] * swing * swing
    }

    /// Mean square of a form's departure from its tangents over a distance, mm, to either side.
    fn departure(&self, form: usize, distance: f64) -> f64 {
        let (form, positions) = (&self.forms[form], &self.positions);
        let n = positions.len();
        let places = (0..n).step_by(n.div_ceil(TANGENTS));
        let (mut sum, mut count) = (0.0, 0);
        for k in places {
            for way in [-distance, distance] {
                let x = positions[k] + way;
                if x < positions[0] || x > positions[n - 1] {
                    continue;
                }
                let straight = form.values[k] + form.slopes[k] * way;
                sum += (form.at(&Spot::new(positions, k, x)) - straight).powi(2);
                count += 1;
            }
        }
        sum / f64::from(count.max(1))
    }

    /// Number of forms of the artefact.
    fn sides(&self) -> usize {
        let sides = (0..self.present().len()).map(|c| self.arrangement.side_form(c));
        let first = sides.min().unwrap_or(self.forms.len());
        self.forms.len() - first
    }

    /// How a channel sees a form.
    fn factor(&self, channel: usize, form: usize) -> f64 {
        let slide = self.arrangement.slides(channel).iter();
        let own = if self.arrangement.side_form(channel) == form {
            1.0
        } else {
            0.0
        };
        slide
            .filter(|(k, _)| *k == form)
            .map(|(_, f)| f)
            .sum::<f64>()
            + own
    }

    /// For each form and each gap between positions the variance of the form half-way, µm²; nothing where
    /// there are too few repeats to tell it from noise.
    fn roughness(&self) -> Vec<Vec<f64>> {
        let n = self.positions.len();
        let nothing = vec![vec![0.0; n - 1]; self.forms.len()];
        let repeats = self.forms_of_repeats();
        if repeats.len() < 2 || n < 2 * WINDOW {
            return nothing;
        }
        let form = |k: usize| {
            let near: Vec<Vec<f64>> = repeats.iter().map(|r| self.errors(&r[k], 1)).collect();
            let far: Vec<Vec<f64>> = repeats.iter().map(|r| self.errors(&r[k], 2)).collect();
            (0..n - 1)
                .map(|gap| {
                    let range = gap.saturating_sub(WINDOW)..(gap + WINDOW + 2).min(n);
                    let (common, chance) = in_common(&near, range.clone());
                    if common < ROUGH * chance {
                        return 0.0;
                    }
                    let (wider, _) = in_common(&far, range.clone());
                    let part = if wider > common { common / wider } else { 1.0 };
                    let short = SHORT * (2.0 * SHARED / range.len() as f64).sqrt();
                    common * part * (1.0 + short)
                })
                .collect()
        };
        (0..self.forms.len()).map(form).collect()
    }

    /// By how much each value of a profile differs from the cubic through the two neighbours of either side, or
    /// through every second of them (`stride` 2); zero where there are none.
    fn errors(&self, profile: &DVector<f64>, stride: usize) -> Vec<f64> {
        let n = self.positions.len();
        let error = |k: usize| {
            if k < 2 * stride || k + 2 * stride >= n {
                return 0.0;
            }
            let nodes = [k - 2 * stride, k - stride, k + stride, k + 2 * stride];
            let x = self.positions[k];
            let predicted: f64 = (nodes.iter())
                .map(|&j| {
                    let weight = |&i: &usize| {
                        (x - self.positions[i]) / (self.positions[j] - self.positions[i])
                    };
                    let others = nodes.iter().filter(|i| **i != j);
                    profile[j] * others.map(weight).product::<f64>()
                })
                .sum();
            profile[k] - predicted
        };
        (0..n).map(error).collect()
    }
}

/// The mean of the products of different repeats over a range, and the standard deviation that noise gives it.
fn in_common(repeats: &[Vec<f64>], range: std::ops::Range<usize>) -> (f64, f64) {
    let count = repeats.len() as f64;
    let length = range.len() as f64;
    let (mut squares, mut sums) = (0.0, 0.0);
    for k in range {
        squares += repeats.iter().map(|r| r[k] * r[k]).sum::<f64>();
        sums += repeats.iter().map(|r| r[k]).sum::<f64>().powi(2);
    }
    let pairs = count * (count - 1.0);
    let common = (sums - squares) / (pairs * length);
    let noise = (squares / (count * length) - common).max(0.0);
    (common, noise * (2.0 * SHARED / (length * pairs)).sqrt())
}

/// A place where a form is seen, with the readings that see it.
struct Seen {
    shift: f64,
    rows: Vec<usize>,
    factors: Vec<f64>,
}

impl Seen {
    fn new(shift: f64, row: usize, factor: f64) -> Self {
        Self {
            shift,
            rows: vec![row],
            factors: vec![factor],
        }
    }

    fn add(&mut self, row: usize, factor: f64) {
        self.rows.push(row);
        self.factors.push(factor);
    }

    fn column(&self, size: f64) -> Column {
        Column {
            rows: self.rows.clone(),
            values: self.factors.iter().map(|f| size * f).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::reversal::diagnosable::Assumptions;
    use crate::reversal::{Channel, Direction, Observations, Reading};

    const SPACING: f64 = 2.0;
    const COUNT: usize = 60;

    /// Two repeats of four channels: the slide straight, side A as given, side B straight.
    fn model(noise: f64, side: impl Fn(f64) -> f64) -> Linearised {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut readings = Vec::new();
        for channel in Channel::ALL {
            let sees = matches!(channel, Channel::C1A | Channel::C2A);
            for repeat in 1..=2 {
                readings.extend((0..COUNT).map(|k| {
                    let x = SPACING * k as f64;
                    let chance = noise * (random.random::<f64>() - 0.5);
                    Reading {
                        channel,
                        repeat,
                        direction: Direction::Forward,
                        time: None,
                        x,
                        value: if sees { side(x) } else { 0.0 } + chance,
                    }
                }));
            }
        }
        Linearised::new(&Observations { readings }, Assumptions::default()).unwrap()
    }

    /// The places of the columns' rows.
    fn places(model: &Linearised, columns: &[Column]) -> Vec<f64> {
        let rows = columns.iter().flat_map(|c| c.rows.iter());
        rows.map(|k| model.record.places[*k].x).collect()
    }

    fn moved(by: f64) -> impl Fn(usize, &Place) -> [f64; 2] {
        // The artefact is moved in the channels of the second position of the spindle.
        move |_, place| [0.0, if place.channel >= 2 { by } else { 0.0 }]
    }

    #[test]
    fn a_parabola_leaves_its_tangent_by_its_square() {
        // µm/mm².
        let bend = 2e-3;
        let model = model(1e-6, |x| bend * x * x);
        let form = (0..model.forms.len())
            .max_by(|a, b| {
                let span = |k: &usize| model.forms[*k].values.max() - model.forms[*k].values.min();
                span(a).total_cmp(&span(b))
            })
            .unwrap();
        // Half of the bend may be in each of two forms; whatever part it is, the departure goes with the fourth
        // power of the distance. A natural spline has no bend at its ends: a tenth.
        let [near, far] = [3.0, 6.0].map(|d| model.departure(form, d));
        assert!(
            near > 0.0 && (far / near / 16.0 - 1.0).abs() < 0.1,
            "{near} {far}"
        );
    }

    #[test]
    fn a_smooth_form_is_open_beyond_the_ends_alone() {
        let smooth = model(0.1, |x| 3.0 * (0.09 * x).sin());
        let columns = smooth.between_positions(moved(5.0));
        let open = places(&smooth, &columns);
        let last = SPACING * (COUNT - 1) as f64;
        assert!(
            !open.is_empty() && open.iter().all(|x| x + 5.0 > last),
            "{open:?}"
        );
        // By the size of what the wave leaves its tangent by: 3/2 · 0.09² · 5² is 0.3 µm.
        let greatest = columns
            .iter()
            .flat_map(|c| &c.values)
            .fold(0.0f64, |a, v| a.max(v.abs()));
        assert!((0.1..1.0).contains(&greatest), "{greatest}");
    }

    #[test]
    fn a_rough_form_is_open_between_the_positions() {
        // A wave of 2.4 positions.
        let rough = model(0.1, |x| (std::f64::consts::TAU * x / (2.4 * SPACING)).sin());
        let half = rough.between_positions(moved(0.5 * SPACING));
        assert!(places(&rough, &half).len() > COUNT);
        let greatest = half
            .iter()
            .flat_map(|c| &c.values)
            .fold(0.0f64, |a, v| a.max(v.abs()));
        assert!((0.3..6.0).contains(&greatest), "{greatest}");
        // Moved by whole spacings it is seen where it is known.
        let whole = rough.between_positions(moved(-3.0 * SPACING));
        assert!(places(&rough, &whole).iter().all(|x| *x < 3.0 * SPACING));
        assert!(rough.between_positions(moved(0.0)).is_empty());
    }
}
