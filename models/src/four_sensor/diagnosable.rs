//! The four-sensor model, laid open to the diagnosis.
//!
//! mᵢ(x) = f(x + pᵢ) + S(x) + 1000 pᵢ γ(x) + eᵢ with f, S, γ free at every position and e free for
//! every sensor: what the fit leaves is what no surface and no slide can explain, without any
//! penalty. The penalised separation only supplies the state at which effects are taken.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::curves::Curves;
use super::effects;
use super::{
    Choice, FourSensorError, Geometry, Line, Outputs, Penalised, Separation, Separator, Settings,
};
use crate::model::{Effect, FittedModel, Freedom, Pattern, Place, Profile, Record};
use crate::units::UM_PER_MM;

/// Outputs of four sensors, in one or several repeats, with the fitted state.
#[derive(Debug, Clone)]
pub struct FourSensors {
    geometry: Geometry,
    start: f64,
    separator: Arc<Separator>,
    settings: Settings,
    record: Record,
    state: Separation,
    curves: Curves,
    noise: Option<f64>,
}

impl FourSensors {
    /// Fits the state to the mean of the repeats, which share one geometry and start. `noise` is
    /// the standard deviation of one reading, µm, where it is stated.
    ///
    /// # Errors
    /// No repeat, repeats of different geometry, or a separation that fails.
    pub fn new(repeats: &[Outputs], noise: Option<f64>) -> Result<Self, FourSensorError> {
        let Some(first) = repeats.first() else {
            return Err(FourSensorError::NoNoise);
        };
        let geometry = *first.geometry();
        let start = first.slide_positions().first().copied().unwrap_or(0.0);
        let positions = first.slide_positions();
        let count = positions.len();
        if let Some(other) = repeats.iter().find(|r| r.geometry() != &geometry) {
            return Err(FourSensorError::OutputCount {
                found: other.readings().len(),
                expected: count,
            });
        }
        let (mut places, mut traces, mut values) = (Vec::new(), Vec::new(), Vec::new());
        for sensor in 0..4 {
            for (repeat, outputs) in repeats.iter().enumerate() {
                let from = places.len();
                for (n, (x, row)) in positions.iter().zip(outputs.readings()).enumerate() {
                    values.push(row[sensor]);
                    places.push(Place {
                        channel: sensor,
                        x: *x,
                        time: (repeat * count + n) as f64,
                        repeat: repeat as u32 + 1,
                        direction: 1.0,
                        cell: sensor * count + n,
                    });
                }
                traces.push(from..places.len());
            }
        }
        let separator = Separator::new(&geometry, Penalised::default(), Line::LeastSquares)?;
        let settings = Settings {
            choice: Choice::LCurve,
            ..Settings::default()
        };
        let observed = DVector::from_vec(values);
        let state = state_of(&separator, &settings, &geometry, start, &traces, &observed)?;
        Ok(Self {
            geometry,
            start,
            separator: Arc::new(separator),
            settings,
            record: Record::new(places, traces, observed),
            curves: Curves::of(&state, &geometry),
            state,
            noise,
        })
    }

    /// The sensors' places.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// Index of a place along the travel.
    pub(super) fn at(&self, place: &Place) -> usize {
        place.cell % self.geometry.output_count()
    }

    /// Index of the point of the surface under a sensor.
    pub(super) fn under(&self, place: &Place) -> usize {
        self.at(place) + self.geometry.offsets()[place.channel]
    }

    /// Part of the travel at a place, 0 to 1.
    pub(super) fn share(&self, place: &Place) -> f64 {
        self.at(place) as f64 / (self.geometry.output_count() - 1) as f64
    }

    /// Part of all travels at which a reading was taken, 0 to 1.
    pub(super) fn moment(&self, place: &Place) -> f64 {
        let readings = self.record.places.len() / 4;
        place.time / (readings.max(2) - 1) as f64
    }

    /// Place of a sensor from sensor 1, mm.
    pub(super) fn arm(&self, sensor: usize) -> f64 {
        self.geometry.positions()[sensor]
    }

    /// The fitted surface, straightness and tilt between the positions too.
    pub(super) fn curves(&self) -> &Curves {
        &self.curves
    }

    /// Fitted tilt at a place, rad.
    pub(super) fn tilt(&self, place: &Place) -> f64 {
        self.state.tilt.values[self.at(place)]
    }

    /// What the fitted state says a sensor reads, µm.
    pub(super) fn fitted(&self, place: &Place) -> f64 {
        let n = self.at(place);
        self.state.surface.values[self.under(place)]
            + self.state.straightness.values[n]
            + UM_PER_MM * self.arm(place.channel) * self.state.tilt.values[n]
            + self.state.zero_adjustment[place.channel]
    }
}

fn state_of(
    separator: &Separator,
    settings: &Settings,
    geometry: &Geometry,
    start: f64,
    traces: &[Range<usize>],
    observed: &DVector<f64>,
) -> Result<Separation, FourSensorError> {
    let repeats = traces.len() / 4;
    let rows = (0..geometry.output_count())
        .map(|n| {
            std::array::from_fn(|sensor| {
                let own = &traces[sensor * repeats..(sensor + 1) * repeats];
                own.iter().map(|t| observed[t.start + n]).sum::<f64>() / repeats as f64
            })
        })
        .collect();
    separator.separate(&Outputs::new(*geometry, start, rows)?, settings)
}

impl FittedModel for FourSensors {
    fn name(&self) -> &'static str {
        "four-sensor"
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
        let (points, count) = (self.geometry.point_count(), self.geometry.output_count());
        let longest = self.arm(3);
        let mut columns = DMatrix::zeros(self.record.places.len(), points + 2 * count + 4);
        for (row, place) in self.record.places.iter().enumerate() {
            let n = self.at(place);
            columns[(row, self.under(place))] = 1.0;
            columns[(row, points + n)] = 1.0;
            columns[(row, points + count + n)] = self.arm(place.channel) / longest;
            columns[(row, points + 2 * count + place.channel)] = 1.0;
        }
        Freedom {
            columns,
            profiles: None,
        }
    }

    fn channel_names(&self) -> Vec<String> {
        (1..=4).map(|k| format!("sensor {k}")).collect()
    }

    fn patterns(&self) -> Vec<Pattern> {
        let free = self.geometry.slide_free();
        ["curvature", "third difference"]
            .into_iter()
            .enumerate()
            .map(|(k, name)| Pattern {
                name: name.to_owned(),
                weights: free.column(k).iter().copied().collect(),
            })
            .collect()
    }

    fn profiles(&self) -> Vec<Profile> {
        let step = self.geometry.step();
        let profile = |name: &str, profile: &super::Profile| {
            let spread = profile.std.norm() / (profile.std.len() as f64).sqrt();
            Profile {
                name: name.to_owned(),
                unit: "um",
                positions: (0..profile.values.len())
                    .map(|n| self.start + n as f64 * step)
                    .collect(),
                values: profile.values.clone(),
                noise_gain: spread / self.state.noise.max(f64::MIN_POSITIVE),
            }
        };
        vec![
            profile("surface", &self.state.surface),
            profile("straightness", &self.state.straightness),
        ]
    }

    fn stated_noise(&self) -> Option<f64> {
        self.noise
    }

    fn refit(&self, observed: DVector<f64>) -> Self {
        let mut fitted = self.clone();
        let state = state_of(
            &self.separator,
            &self.settings,
            &self.geometry,
            self.start,
            &self.record.traces,
            &observed,
        );
        // Where the penalty finds no corner the state before is the better one to take slopes from.
        if let Ok(state) = state {
            fitted.curves = Curves::of(&state, &self.geometry);
            fitted.state = state;
        }
        fitted.record.observed = observed;
        fitted
    }

    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        effects::all()
    }

    fn jumps(&self) -> Vec<DMatrix<f64>> {
        vec![DMatrix::from_element(self.places().len(), 1, 1.0)]
    }
}
