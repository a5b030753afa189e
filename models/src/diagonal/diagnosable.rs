//! The regression of step-diagonal readings, laid open to the diagnosis.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use nalgebra::{DMatrix, DVector};

use super::answers::Answers;
use super::design::{Design, is_definition};
use super::effects;
use super::prediction::{Parameter, sensitivities};
use super::readings::{DiagonalError, DiagonalReading, check, check_noise};
use super::{Component, Diagonal, Sequence, Target, Travel, WorkZone};
use crate::model::{Covariate, Effect, FittedModel, Freedom, Place, Profile, Quantity, Record};

/// Readings whose laser was on one diagonal with one target, in one order of motions.
type Channel = (Diagonal, Target, Sequence);

/// Sensitivities of a reading to the parameters.
type Terms = Vec<(Parameter, f64)>;

/// Step-diagonal readings with the design of their regression.
#[derive(Debug, Clone)]
pub struct DiagonalRuns {
    zone: WorkZone,
    channels: Vec<Channel>,
    record: Record,
    columns: Arc<DMatrix<f64>>,
    design: Arc<Design>,
    /// Worked out when they are first asked for.
    answers: Arc<OnceLock<Answers>>,
    terms: Arc<Vec<Terms>>,
    duration: f64,
    noise: Option<f64>,
}

impl DiagonalRuns {
    /// Sets up the regression of all functions but those assumed `zero`. Readings follow each other
    /// evenly in time, in the order given. `noise` is the standard deviation of one reading, µm,
    /// where it is known.
    ///
    /// # Errors
    /// What [`DiagonalError`] lists.
    pub fn new(
        zone: &WorkZone,
        readings: &[DiagonalReading],
        zero: &[Component],
        noise: Option<f64>,
    ) -> Result<Self, DiagonalError> {
        check(zone, readings)?;
        check_noise(noise)?;
        let mut channels: Vec<Channel> = readings
            .iter()
            .map(|r| (r.diagonal, r.target, r.sequence))
            .collect();
        channels.sort_unstable();
        channels.dedup();
        let mut runs: BTreeMap<(usize, u32, Travel), Vec<(f64, usize)>> = BTreeMap::new();
        for (order, r) in readings.iter().enumerate() {
            let channel = channels.partition_point(|c| *c < (r.diagonal, r.target, r.sequence));
            let from_start = zone.position(r.at) - r.diagonal.start(zone);
            let along = r.diagonal.direction(zone).dot(&from_start);
            runs.entry((channel, r.repeat, r.travel))
                .or_default()
                .push((along, order));
        }
        let (mut places, mut traces, mut ordered) = (Vec::new(), Vec::new(), Vec::new());
        let mut cells = BTreeMap::new();
        for ((channel, repeat, travel), mut run) in runs {
            run.sort_by(|a, b| a.0.total_cmp(&b.0));
            let start = places.len();
            for (along, order) in run {
                let next = cells.len();
                let cell = *cells
                    .entry((channel, readings[order].at, travel))
                    .or_insert(next);
                places.push(Place {
                    channel,
                    x: along,
                    time: order as f64,
                    repeat,
                    direction: f64::from(travel.sign()),
                    cell,
                });
                ordered.push(readings[order]);
            }
            traces.push(start..places.len());
        }
        let design = Design::of(zone, &ordered, |p| {
            !is_definition(p, zone.steps)
                && !matches!(p, Parameter::Node(c, _) | Parameter::Reversal(c, _)
                    if zero.contains(&c))
        });
        let unknowns = design.scale.len();
        let mut columns = design
            .dense()
            .resize_horizontally(unknowns + traces.len(), 0.0);
        for (k, trace) in traces.iter().enumerate() {
            for row in trace.clone() {
                columns[(row, unknowns + k)] = 1.0;
            }
        }
        Ok(Self {
            zone: *zone,
            channels,
            columns: Arc::new(columns),
            design: Arc::new(design),
            answers: Arc::default(),
            terms: Arc::new(
                ordered
                    .iter()
                    .map(|r| sensitivities(zone, r.diagonal, r.target, r.at, r.travel))
                    .collect(),
            ),
            duration: (places.len().max(2) - 1) as f64,
            record: Record::new(
                places,
                traces,
                DVector::from_iterator(ordered.len(), ordered.iter().map(|r| r.value)),
            ),
            noise,
        })
    }

    /// Diagonal, target and sequence of each channel.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Part of the test at which a reading was taken, 0 to 1.
    pub(super) fn moment(&self, place: &Place) -> f64 {
        place.time / self.duration
    }

    /// Where the run of a reading is zeroed on an axis (X, Y, Z), as a part of its travel, by how the readings show that axis.
    pub(super) fn zeroed_at(&self, place: &Place, axis: usize) -> f64 {
        let diagonal = self.channels[place.channel].0;
        let start = diagonal.start(&self.zone)[axis] / self.zone.travel[axis];
        start * diagonal.direction(&self.zone)[axis]
    }

    /// Σ weight(parameter) · sensitivity of a reading, µm.
    pub(super) fn weighted(&self, row: usize, weight: impl Fn(&Parameter) -> f64) -> f64 {
        self.terms[row].iter().map(|(p, s)| weight(p) * s).sum()
    }

    /// What the readings determine; nothing where that cannot be worked out.
    fn answers(&self) -> &Answers {
        self.answers
            .get_or_init(|| Answers::of(&self.zone, &self.design).unwrap_or_default())
    }

    /// Steps on each axis.
    pub(super) fn steps(&self) -> usize {
        self.zone.steps
    }
}

impl FittedModel for DiagonalRuns {
    fn name(&self) -> &'static str {
        "step-diagonal"
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
        let both = self.channels.windows(2).any(|w| w[0].1 != w[1].1);
        self.channels
            .iter()
            .map(|(diagonal, target, sequence)| {
                let on = match (both, target) {
                    (false, _) => "",
                    (true, Target::Mirror) => " mirror",
                    (true, Target::RetroReflector) => " retro-reflector",
                };
                format!("{} {}{on}", diagonal.name(), sequence.name())
            })
            .collect()
    }

    fn quantities(&self) -> Vec<Quantity> {
        let locations = self.answers().locations.iter();
        locations
            .map(|(location, weights)| Quantity {
                name: location.name().to_owned(),
                unit: "rad",
                weights: weights.clone(),
            })
            .collect()
    }

    /// Where the beam meets the mirror: what turns or bends the mirror goes along with it.
    fn covariates(&self) -> Vec<Covariate> {
        let offset = |direction: usize, row: usize| {
            self.weighted(row, |parameter| match parameter {
                Parameter::Mirror(_, _, k) if *k == direction => 1.0,
                _ => 0.0,
            })
        };
        [(0, "first"), (1, "second")]
            .map(|(direction, which)| {
                let rows = 0..self.places().len();
                Covariate::smooth(
                    format!("the {which} offset on the mirror"),
                    rows.map(|row| offset(direction, row)).collect(),
                )
            })
            .into()
    }

    fn profiles(&self) -> Vec<Profile> {
        let functions = self.answers().functions.iter();
        functions
            .map(|f| Profile {
                name: f.component.name(),
                unit: if f.component.rotation { "rad" } else { "um" },
                positions: f.positions.clone(),
                values: &f.weights * self.observed(),
                noise_gain: f.weights.norm() / (f.positions.len() as f64).sqrt(),
            })
            .collect()
    }

    fn stated_noise(&self) -> Option<f64> {
        self.noise
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
