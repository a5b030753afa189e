//! The Fourier separation, laid open to the diagnosis.
//!
//! A reading is the difference m = m₁ − m₂ before the joint x = L − d and m₁ − m₃ beyond it, free of
//! the slide: f(x) − f(x + d), f periodic up to the orders kept, plus a zero for each scan and one
//! step at the joint for the slope of the workpiece, common to all scans.

use std::f64::consts::TAU;
use std::sync::Arc;

use errsep_solvers::linear::limited;
use nalgebra::{DMatrix, DVector};

use super::effects;
use super::separation::spacings;
use super::{FourierError, Scan, Section, join};
use crate::model::{Effect, FittedModel, Freedom, Place, Profile, Record};

/// Scans of one or several probe spacings with the fitted workpiece.
#[derive(Debug, Clone)]
pub struct FourierScans {
    section: Section,
    spacings: Vec<f64>,
    record: Record,
    columns: Arc<DMatrix<f64>>,
    /// Maps readings to the coefficients of the columns.
    solver: Arc<DMatrix<f64>>,
    coefficients: DVector<f64>,
    /// The mean of what both probes read, µm: the noise of it is independent of that of their difference.
    means: Arc<Vec<f64>>,
    /// By trace: whether a third probe takes over at the joint.
    third: Arc<Vec<bool>>,
    noise: Option<f64>,
}

impl FourierScans {
    /// Joins the scans and fits the workpiece. `noise` is the standard deviation of one reading of
    /// one probe, µm, where it is known.
    ///
    /// # Errors
    /// Those of [`join`], and [`FourierError::NoScan`].
    pub fn new(scans: &[Scan], section: Section, noise: Option<f64>) -> Result<Self, FourierError> {
        if scans.is_empty() {
            return Err(FourierError::NoScan);
        }
        let spacings = spacings(scans);
        let (mut places, mut traces, mut values) = (Vec::new(), Vec::new(), Vec::new());
        let (mut means, mut third) = (Vec::new(), Vec::new());
        for (channel, spacing) in spacings.iter().enumerate() {
            let first_cell = channel << 32;
            for scan in scans.iter().filter(|s| s.spacing == *spacing) {
                let joined = join(scan, section)?;
                let start = places.len();
                for (k, value) in joined.difference.iter().enumerate() {
                    values.push(*value);
                    places.push(Place {
                        channel,
                        x: section.length * k as f64 / joined.difference.len() as f64,
                        time: (start + k) as f64,
                        repeat: scan.repeat,
                        direction: 1.0,
                        cell: first_cell + k,
                    });
                }
                let both = joined.first.iter().zip(&joined.difference);
                means.extend(both.map(|(first, difference)| first - 0.5 * difference));
                third.push(joined.third_from.is_some());
                traces.push(start..places.len());
            }
        }
        let mut model = Self {
            section,
            spacings,
            record: Record::new(places, traces, DVector::zeros(0)),
            columns: Arc::new(DMatrix::zeros(0, 0)),
            solver: Arc::new(DMatrix::zeros(0, 0)),
            coefficients: DVector::zeros(0),
            means: Arc::new(means),
            third: Arc::new(third),
            // A difference of two readings.
            noise: noise.map(|sigma| sigma * 2f64.sqrt()),
        };
        let columns = model.design();
        let gram = columns.tr_mul(&columns);
        let cut = 1e-12 * gram.diagonal().amax();
        let inverse = limited::svd(gram, true, true)
            .and_then(|factors| factors.pseudo_inverse(cut).ok())
            .ok_or_else(|| FourierError::Simulation {
                what: "the singular values of the design did not converge".to_owned(),
            })?;
        model.solver = Arc::new(inverse * columns.transpose());
        model.columns = Arc::new(columns);
        Ok(model.refit(DVector::from_vec(values)))
    }

    fn design(&self) -> DMatrix<f64> {
        let orders = self.section.orders;
        let mut columns = DMatrix::zeros(
            self.record.places.len(),
            2 * orders + self.record.traces.len() + 1,
        );
        for (row, place) in self.record.places.iter().enumerate() {
            let (here, there) = (self.angle(place.x), self.angle(self.second(place)));
            for order in 1..=orders {
                let w = order as f64;
                columns[(row, 2 * order - 2)] = (w * here).cos() - (w * there).cos();
                columns[(row, 2 * order - 1)] = (w * here).sin() - (w * there).sin();
            }
            columns[(row, 2 * orders)] = f64::from(u8::from(self.beyond(place)));
        }
        for (k, trace) in self.record.traces.iter().enumerate() {
            for row in trace.clone() {
                columns[(row, 2 * orders + 1 + k)] = 1.0;
            }
        }
        columns
    }

    fn angle(&self, x: f64) -> f64 {
        TAU * x / self.section.length
    }

    /// Probe spacings, mm, one a channel.
    pub fn spacings(&self) -> &[f64] {
        &self.spacings
    }

    /// Part of the section at a place, 0 to 1.
    pub(super) fn share(&self, place: &Place) -> f64 {
        place.x / self.section.length
    }

    /// Whether the third probe has taken over.
    pub(super) fn beyond(&self, place: &Place) -> bool {
        let slack = 1e-9 * self.section.length;
        place.x >= self.section.length - self.spacings[place.channel] - slack
    }

    /// Distance from the first probe to the second, or to the third where that has taken over, mm.
    pub(super) fn arm(&self, place: &Place) -> f64 {
        let spacing = self.spacings[place.channel];
        if self.beyond(place) {
            spacing - self.section.length
        } else {
            spacing
        }
    }

    /// Place under the second or third probe, mm.
    fn second(&self, place: &Place) -> f64 {
        place.x + self.arm(place)
    }

    /// Part of the section from the first probe to the other one.
    pub(super) fn share_of_arm(&self, place: &Place) -> f64 {
        self.arm(place) / self.section.length
    }

    /// Whether a third probe takes over at the joint of any scan.
    pub(super) fn has_third_probe(&self) -> bool {
        self.third.contains(&true)
    }

    /// How far beyond the end of the section the second probe stands, mm, in a scan without a third one.
    pub(super) fn past_the_end(&self, row: usize) -> Option<f64> {
        let trace = self.record.traces.partition_point(|t| t.end <= row);
        let place = self.record.places.get(row)?;
        let second = self.third.get(trace) == Some(&false);
        (second && self.beyond(place))
            .then(|| place.x + self.spacings[place.channel] - self.section.length)
    }

    /// The probe that is read against the first, 2 or 3.
    pub(super) fn other_probe(&self, row: usize) -> usize {
        let beyond = self.record.places.get(row).is_some_and(|p| self.beyond(p));
        if beyond && self.past_the_end(row).is_none() {
            3
        } else {
            2
        }
    }

    /// What the probes of a reading read, the first and the other, µm: the mean of both as it was read, their difference as
    /// it is fitted. A signature of the readings themselves would find their noise in what is judged.
    pub(super) fn read(&self, row: usize) -> [f64; 2] {
        let fitted = self.columns.row(row).transpose().dot(&self.coefficients);
        let mean = self.means.get(row).copied().unwrap_or(0.0);
        [mean + 0.5 * fitted, mean - 0.5 * fitted]
    }

    /// Part of the test at which a reading was taken, 0 to 1.
    pub(super) fn moment(&self, place: &Place) -> f64 {
        place.time / (self.record.places.len().max(2) - 1) as f64
    }

    /// Slope of the fitted workpiece under the first probe, µm/mm.
    pub(super) fn slope_here(&self, place: &Place) -> f64 {
        self.slope_at(place.x)
    }

    /// Slope of the fitted workpiece under the second or third probe, µm/mm.
    pub(super) fn slope_there(&self, place: &Place) -> f64 {
        self.slope_at(self.second(place))
    }

    fn slope_at(&self, x: f64) -> f64 {
        let theta = self.angle(x);
        let per_mm = TAU / self.section.length;
        (1..=self.section.orders)
            .map(|order| {
                let w = order as f64;
                let (c, s) = (
                    self.coefficients[2 * order - 2],
                    self.coefficients[2 * order - 1],
                );
                w * per_mm * (s * (w * theta).cos() - c * (w * theta).sin())
            })
            .sum()
    }
}

impl FittedModel for FourierScans {
    fn name(&self) -> &'static str {
        "fourier"
    }

    fn reading_unit(&self) -> &'static str {
        "um"
    }

    fn time_unit(&self) -> &'static str {
        "readings"
    }

    fn record(&self) -> &Record {
        &self.record
    }

    fn freedom(&self) -> Freedom {
        Freedom {
            columns: self.columns.as_ref().clone(),
            profiles: None,
        }
    }

    fn channel_names(&self) -> Vec<String> {
        self.spacings
            .iter()
            .map(|d| format!("spacing {d} mm"))
            .collect()
    }

    fn profiles(&self) -> Vec<Profile> {
        let count = 200;
        let positions: Vec<f64> = (0..count)
            .map(|k| self.section.length * f64::from(k) / f64::from(count))
            .collect();
        let waves = DMatrix::from_fn(positions.len(), 2 * self.section.orders, |row, column| {
            let turn = (column / 2 + 1) as f64 * self.angle(positions[row]);
            if column % 2 == 0 {
                turn.cos()
            } else {
                turn.sin()
            }
        });
        let used = self.coefficients.rows(0, waves.ncols());
        let gain = &waves * self.solver.rows(0, waves.ncols());
        vec![Profile {
            name: "workpiece".to_owned(),
            unit: "um",
            values: &waves * used,
            noise_gain: gain.norm() / (positions.len() as f64).sqrt(),
            positions,
        }]
    }

    fn stated_noise(&self) -> Option<f64> {
        self.noise
    }

    fn refit(&self, observed: DVector<f64>) -> Self {
        let mut fitted = self.clone();
        fitted.coefficients = self.solver.as_ref() * &observed;
        fitted.record.observed = observed;
        fitted
    }

    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        effects::all()
    }
}
