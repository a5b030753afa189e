//! The fitted line, laid open to the diagnosis.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use thiserror::Error;

use super::effects;
use super::lack_of_fit::{LackOfFit, lack_of_fit};
use crate::model::{Course, Covariate, Effect, FittedModel, Freedom, Place, Quantity, Record};

/// One reading of a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationReading {
    /// What was applied.
    pub x: f64,
    /// What was read.
    pub y: f64,
    /// Number of the set, from 1: readings of one set are taken in one go.
    pub set: u32,
    /// Seconds since the first reading, where they are known.
    pub time: Option<f64>,
}

/// Why readings make no calibration line.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum NotALine {
    /// A number that is NaN or infinite.
    #[error("reading {} is not finite", index + 1)]
    NotFinite {
        /// Place in the list, from 0.
        index: usize,
    },
    /// Too few values of x.
    #[error(
        "{values} different values of x leave nothing over from a straight line: calibrate at four or more"
    )]
    TooFewValues {
        /// Different values of x.
        values: usize,
    },
}

/// For each load of a set in the order taken whether it was reached by rising (1) or falling (−1).
fn directions(loads: impl Iterator<Item = f64>) -> Vec<f64> {
    let loads: Vec<f64> = loads.collect();
    let mut direction = match loads.iter().find(|x| **x != loads[0]) {
        Some(next) if *next < loads[0] => -1.0,
        _ => 1.0,
    };
    let mut last = loads.first().copied().unwrap_or(0.0);
    let reached = |x: &f64| {
        if *x != last {
            direction = (x - last).signum();
        }
        last = *x;
        direction
    };
    loads.iter().map(reached).collect()
}

/// The line of least squares through the readings.
#[derive(Debug, Clone)]
pub struct CalibrationLine {
    record: Record,
    noise: Option<f64>,
    reach: f64,
    duration: f64,
    /// Whether the readings came with times.
    pub timed: bool,
}

impl CalibrationLine {
    /// Sorts the readings into sets, in the order in which they were taken. `noise` is the standard
    /// deviation of one reading where it is known.
    ///
    /// # Errors
    /// [`NotALine`].
    pub fn new(readings: &[CalibrationReading], noise: Option<f64>) -> Result<Self, NotALine> {
        let finite = |r: &CalibrationReading| {
            r.x.is_finite() && r.y.is_finite() && r.time.is_none_or(f64::is_finite)
        };
        if let Some(index) = readings.iter().position(|r| !finite(r)) {
            return Err(NotALine::NotFinite { index });
        }
        let mut values: Vec<f64> = readings.iter().map(|r| r.x).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        if values.len() < 4 {
            return Err(NotALine::TooFewValues {
                values: values.len(),
            });
        }
        let timed = readings.iter().all(|r| r.time.is_some());
        let mut sets: BTreeMap<u32, Vec<(usize, &CalibrationReading)>> = BTreeMap::new();
        for (order, reading) in readings.iter().enumerate() {
            sets.entry(reading.set).or_default().push((order, reading));
        }
        let first = readings
            .iter()
            .filter_map(|r| r.time)
            .fold(f64::INFINITY, f64::min);
        let (mut observed, mut places, mut traces) = (Vec::new(), Vec::new(), Vec::new());
        for (set, mut members) in sets {
            let directions = directions(members.iter().map(|m| m.1.x));
            let mut members: Vec<_> = members.drain(..).zip(directions).collect();
            members.sort_by(|a, b| a.0.1.x.total_cmp(&b.0.1.x));
            let start = places.len();
            for ((order, reading), direction) in members {
                observed.push(reading.y);
                places.push(Place {
                    channel: 0,
                    x: reading.x,
                    time: match reading.time {
                        Some(time) if timed => time - first,
                        _ => order as f64,
                    },
                    repeat: set,
                    direction,
                    cell: values.partition_point(|v| *v < reading.x),
                });
            }
            traces.push(start..places.len());
        }
        let duration = places.iter().map(|p| p.time).fold(0.0, f64::max);
        Ok(Self {
            record: Record::new(places, traces, DVector::from_vec(observed)),
            noise,
            reach: values.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs())),
            duration: duration.max(f64::MIN_POSITIVE),
            timed,
        })
    }

    /// Greatest |x|: full scale.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Time of the last reading, s; readings are numbered where no times are given.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Whether all x are greater than zero.
    pub fn positive(&self) -> bool {
        self.record.places.iter().all(|p| p.x > 0.0)
    }

    /// The classical test of the line, with further columns fitted beside it, against the scatter
    /// of readings of the same x; none where no x is read twice or nothing is left over.
    pub fn lack_of_fit(&self, beside: &[DVector<f64>]) -> Option<LackOfFit> {
        let mut columns = self.line();
        for column in beside {
            let at = columns.ncols();
            columns = columns.insert_column(at, 0.0);
            columns.set_column(at, column);
        }
        let cells: Vec<usize> = self.record.places.iter().map(|p| p.cell).collect();
        lack_of_fit(&self.record.observed, &columns, &cells)
    }

    /// 1 and x of every reading, x in units of full scale.
    fn line(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.record.places.len(), 2, |row, column| {
            [1.0, self.record.places[row].x / self.reach][column]
        })
    }
}

impl FittedModel for CalibrationLine {
    fn name(&self) -> &'static str {
        "calibration line"
    }

    fn reading_unit(&self) -> &'static str {
        "y"
    }

    fn position_unit(&self) -> &'static str {
        "x"
    }

    fn time_unit(&self) -> &'static str {
        if self.timed { "s" } else { "readings" }
    }

    fn record(&self) -> &Record {
        &self.record
    }

    fn freedom(&self) -> Freedom {
        Freedom {
            columns: self.line(),
            profiles: None,
        }
    }

    fn channel_names(&self) -> Vec<String> {
        vec!["y".to_owned()]
    }

    /// The instrument and its line are the same.
    fn set_anew(&self) -> Option<DMatrix<f64>> {
        Some(DMatrix::zeros(self.record.places.len(), 0))
    }

    fn quantities(&self) -> Vec<Quantity> {
        let count = self.record.places.len() as f64;
        let mean = self.record.places.iter().map(|p| p.x).sum::<f64>() / count;
        let sxx: f64 = self
            .record
            .places
            .iter()
            .map(|p| (p.x - mean).powi(2))
            .sum();
        let weights = |of: &dyn Fn(f64) -> f64| {
            DVector::from_iterator(
                self.record.places.len(),
                self.record.places.iter().map(|p| of(p.x)),
            )
        };
        vec![
            Quantity {
                name: "slope".to_owned(),
                unit: "y/x",
                weights: weights(&|x| (x - mean) / sxx),
            },
            Quantity {
                name: "intercept".to_owned(),
                unit: "y",
                weights: weights(&|x| 1.0 / count - mean * (x - mean) / sxx),
            },
        ]
    }

    fn correlated_noise(&self) -> bool {
        // Every load is set anew, and an offset of a set is an effect of the catalogue.
        false
    }

    fn stated_noise(&self) -> Option<f64> {
        self.noise
    }

    /// A sensitivity that drifts, a line of its own in every set, and, where all loads are greater than zero, their
    /// logarithm: what differs at small loads from decade to decade, such as powers of the load.
    fn covariates(&self) -> Vec<Covariate> {
        let places = self.record.places.iter();
        let loads: Vec<f64> = places.clone().map(|p| p.x).collect();
        let ones = vec![1.0; loads.len()];
        let times = places.map(|p| p.time).collect();
        let sensitivity = Covariate {
            factors: vec![loads.clone()],
            ..Covariate::smooth("time, in proportion to the load", times)
        };
        let traces = self.record.traces.iter().enumerate();
        let sets = traces.flat_map(|(set, trace)| trace.clone().map(move |_| set));
        let by_set = Covariate {
            name: "the load with an offset, another in every set".to_owned(),
            course: Course::Proportional,
            factors: vec![ones, loads],
            groups: Some(sets.collect()),
            ..sensitivity.clone()
        };
        let by_set = (self.record.traces.len() > 1).then_some(by_set);
        let logarithms = || self.record.places.iter().map(|p| p.x.ln()).collect();
        let decades = self
            .positive()
            .then(|| Covariate::smooth("the logarithm of the load", logarithms()));
        std::iter::once(sensitivity)
            .chain(by_set)
            .chain(decades)
            .collect()
    }

    fn refit(&self, observed: DVector<f64>) -> Self {
        Self {
            record: self.record.with(observed),
            ..self.clone()
        }
    }

    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        effects::all()
    }
}
