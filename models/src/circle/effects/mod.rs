//! What a circle leaves out of the points measured on it: one file an effect.

mod asynchronous_motion;
mod axis_backlash;
mod centre_drift;
mod lobes;
mod outlier;
mod ovality;
mod part_moved;
mod radius_growth;
mod scale;
mod scale_mismatch;
mod squareness;
mod zero_jump;

use nalgebra::DMatrix;

use super::diagnosable::CirclePoints;
use crate::model::{Column, Effect, Estimate, FittedModel, Parameter};

pub(super) use axis_backlash::lost_motion;

/// The catalogue.
pub(super) fn all() -> Vec<Box<dyn Effect<CirclePoints>>> {
    vec![
        Box::new(asynchronous_motion::AsynchronousMotion),
        Box::new(axis_backlash::AxisBacklash),
        Box::new(centre_drift::CentreDrift),
        Box::new(lobes::Lobes),
        Box::new(outlier::Outlier),
        Box::new(ovality::Ovality),
        Box::new(part_moved::PartMoved),
        Box::new(radius_growth::RadiusGrowth),
        Box::new(scale::Scale),
        Box::new(scale_mismatch::ScaleMismatch),
        Box::new(squareness::Squareness),
        Box::new(zero_jump::ZeroJump),
    ]
}

/// What the size of an effect on points of a circle is: its first amplitude. `None` where the catalogue has no such
/// effect.
pub fn amplitude(effect: &str) -> Option<Parameter> {
    crate::model::amplitude(&all(), effect)
}

/// Cosine and sine of a number of undulations per revolution.
fn undulations(model: &CirclePoints, count: f64) -> Vec<Column> {
    [f64::cos, f64::sin]
        .map(|wave| {
            Column::from_places(model.places(), |_, place| {
                wave(count * CirclePoints::angle(place))
            })
        })
        .into()
}

/// Amplitude and direction of a wave of `count` undulations from its cosine and sine.
fn amplitude_and_phase(count: f64, amplitudes: &[f64], covariance: &DMatrix<f64>) -> Vec<Estimate> {
    let &[cosine, sine] = amplitudes else {
        return Vec::new();
    };
    let size = cosine.hypot(sine).max(f64::MIN_POSITIVE);
    let at = |i: usize, j: usize| covariance.get((i, j)).map_or(f64::NAN, |v| *v);
    let along = |c: f64, s: f64| {
        let variance = c * c * at(0, 0) + 2.0 * c * s * at(0, 1) + s * s * at(1, 1);
        variance.max(0.0).sqrt()
    };
    vec![
        Estimate {
            name: "amplitude".to_owned(),
            value: size,
            std: along(cosine / size, sine / size),
            unit: "um".to_owned(),
        },
        Estimate {
            name: "first-maximum".to_owned(),
            value: (sine.atan2(cosine) / count).to_degrees(),
            std: (along(-sine / size, cosine / size) / (size * count)).to_degrees(),
            unit: "deg".to_owned(),
        },
    ]
}
