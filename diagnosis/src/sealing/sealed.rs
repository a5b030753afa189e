//! What is sealed, as plain values.

use errsep_models::model::{AnyModel, FittedModel};
use errsep_models::noise::Law;
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

/// Standard deviations to either end of a 95 % interval.
pub(super) const REACH: f64 = 1.959_964;

/// What a further measurement is expected to show.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sealed {
    /// Unit of the readings.
    pub unit: String,
    /// The noise of a reading; variances in the square of the unit.
    pub noise: Law,
    /// What the model misses there, without and with the causes.
    pub gap: SealedGap,
    /// The named causes.
    #[serde(default)]
    pub effect: Vec<SealedEffect>,
    /// The numbers of the answer that a new set-up does not change.
    #[serde(default)]
    pub quantity: Vec<SealedNumber>,
    /// Every planned reading.
    pub trace: Vec<SealedTrace>,
}

/// A number with what is known of it, and what a further measurement finds for it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SealedNumber {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value.
    pub value: f64,
    /// Standard uncertainty of the value.
    pub std: f64,
    /// 95 % interval of the true value.
    pub ci95: [f64; 2],
    /// Standard uncertainty that the further measurement alone gives it; zero where it is not told apart.
    pub next_std: f64,
    /// Standard deviation of what the further measurement finds, about the value.
    pub found_std: f64,
    /// 95 % interval of what it finds.
    pub found95: [f64; 2],
}

impl SealedNumber {
    /// `stds`: of the value, of what the further measurement alone gives it, of what it finds.
    pub(super) fn new(name: String, unit: String, value: f64, stds: [f64; 3]) -> Self {
        let [std, next_std, found_std] = stds;
        let interval = |std: f64| [value - REACH * std, value + REACH * std];
        Self {
            name,
            unit,
            value,
            std,
            ci95: interval(std),
            next_std,
            found_std,
            found95: interval(found_std),
        }
    }
}

/// A cause at the place in its family at which it is carried over.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SealedEffect {
    /// Name in the catalogue.
    pub name: String,
    /// Variant in words, where it has several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Which of its variants.
    pub variant_number: usize,
    /// What enters nonlinearly: carried over as it is.
    #[serde(default)]
    pub shape: Vec<f64>,
    /// What enters linearly, as the catalogue scales it.
    pub amplitudes: Vec<f64>,
    /// Its sizes.
    #[serde(default)]
    pub parameter: Vec<SealedNumber>,
}

/// A root mean square that is expected; `square` may be negative, where chance takes away more than the
/// noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interval {
    /// Mean square less that of the noise, in the square of the unit of the readings.
    pub square: f64,
    /// Its standard deviation.
    pub square_std: f64,
    /// √max(0, square).
    pub rms: f64,
    /// 95 % interval of the root mean square.
    pub ci95: [f64; 2],
}

impl Interval {
    /// By many draws of the mean square.
    pub(super) fn of(squares: &[f64]) -> Self {
        let count = squares.len().max(2) as f64;
        let square = squares.iter().sum::<f64>() / count;
        let variance = squares.iter().map(|s| (s - square).powi(2)).sum::<f64>() / (count - 1.0);
        Self::about(square, variance.sqrt())
    }

    /// By the mean square and its standard deviation.
    pub(super) fn about(square: f64, square_std: f64) -> Self {
        let root = |v: f64| v.max(0.0).sqrt();
        Self {
            square,
            square_std,
            rms: root(square),
            ci95: [-1.0, 1.0].map(|sign| root(square + sign * REACH * square_std)),
        }
    }
}

/// What the model is expected to miss of the further measurement, its noise taken out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SealedGap {
    /// Without the causes.
    pub without: Interval,
    /// With the causes taken out as they are sealed.
    pub with: Interval,
}

/// The planned readings of one trace, in the order of the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SealedTrace {
    /// The channel.
    pub channel: String,
    /// Repeat number.
    pub repeat: u32,
    /// +1 forward, −1 backward.
    pub direction: f64,
    /// Positions, in the unit of the model's positions.
    pub x: Vec<f64>,
    /// Times as they are planned or taken from the order of the traces.
    pub time: Vec<f64>,
    /// The expected readings, to first order, the causes included; up to what a new set-up changes.
    pub expected: Vec<f64>,
    /// The part of the causes in them.
    pub causes: Vec<f64>,
    /// Half the width of the pointwise 95 % band: a reading, what a new set-up changes fitted anew, lies in
    /// `expected ± band`.
    pub band: Vec<f64>,
}

impl SealedTrace {
    /// Those of a plan: the expected readings without the causes, what the causes change, standard deviations.
    pub(super) fn all(
        plan: &AnyModel,
        clean: &DVector<f64>,
        causes: &DVector<f64>,
        stds: &DVector<f64>,
    ) -> Vec<Self> {
        let names = plan.channel_names();
        let of = |trace: &std::ops::Range<usize>| {
            let places = &plan.places()[trace.clone()];
            let part = |values: &DVector<f64>| values.as_slice()[trace.clone()].to_vec();
            Some(Self {
                channel: names.get(places.first()?.channel)?.clone(),
                repeat: places[0].repeat,
                direction: places[0].direction,
                x: places.iter().map(|p| p.x).collect(),
                time: places.iter().map(|p| p.time).collect(),
                expected: part(&(clean + causes)),
                causes: part(causes),
                band: part(&(stds * REACH)),
            })
        };
        plan.traces().iter().filter_map(of).collect()
    }
}
