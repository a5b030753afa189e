//! The spindle moves with a period that is no whole part of a turn.

use super::CirclePoints;
use super::amplitude_and_phase;
use crate::model::Estimate;
use crate::model::{About, Column, Effect, FittedModel, Parameter, Shape};
use nalgebra::DMatrix;

/// Most undulations looked for.
const MOST: f64 = 20.0;
/// Between neighbouring starts, times the turns: the peak of a period is one turn wide.
const STRIDE: f64 = 0.4;
/// Nearer to a whole number, times the turns, it is a form that all turns share.
const ASIDE: f64 = 0.5;

/// See the head of the file.
pub(super) struct AsynchronousMotion;

impl Effect<CirclePoints> for AsynchronousMotion {
    fn name(&self) -> &str {
        "asynchronous-motion"
    }

    fn about(&self) -> About {
        About {
            physics: "the spindle moves with a period that is no whole part of a turn, as the cage and the balls of a rolling bearing do",
            confirm: "turn on without stopping and take more turns: the period shows against that of the turn",
            source: "asynchronous error motion, ISO 230-7: a wave over all turns, taken without stopping",
        }
    }

    fn amplitudes(&self) -> Vec<Parameter> {
        vec![
            Parameter::symmetric("cosine", "um", 1e4),
            Parameter::symmetric("sine", "um", 1e4),
        ]
    }

    fn shape_parameters(&self) -> Vec<Parameter> {
        vec![Parameter::between("undulations", "1", 0.1, MOST)]
    }

    fn grid(&self, model: &CirclePoints) -> Vec<Shape> {
        let turns = model.traces().len() as f64;
        let most = MOST.min(model.points_of_a_pass() as f64 / 4.0);
        let at = |k: usize| Shape {
            variant: 0,
            values: vec![0.2 + STRIDE / turns * k as f64],
            steps: vec![0.5 * STRIDE / turns],
        };
        let shapes = (0..).map(at).take_while(|s| s.values[0] <= most);
        if turns < 2.0 {
            return Vec::new();
        }
        shapes.filter(|s| self.allowed(model, s)).collect()
    }

    fn allowed(&self, model: &CirclePoints, shape: &Shape) -> bool {
        let least = ASIDE / model.traces().len() as f64;
        let own = shape.values.first();
        own.is_some_and(|v| (0.1..=MOST).contains(v) && (v - v.round()).abs() >= least)
    }

    fn estimates(
        &self,
        shape: &Shape,
        amplitudes: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Vec<Estimate> {
        let count = shape.values.first().copied().unwrap_or(1.0);
        let size = amplitude_and_phase(count, amplitudes, covariance);
        let known = covariance
            .get((2, 2))
            .map_or(f64::NAN, |v| v.max(0.0).sqrt());
        let mut told: Vec<Estimate> = size.into_iter().take(1).collect();
        told.push(Estimate {
            name: "undulations".to_owned(),
            value: count,
            std: known,
            unit: "1".to_owned(),
        });
        told
    }

    fn columns(&self, model: &CirclePoints, shape: &Shape) -> Vec<Column> {
        let undulations = shape.values.first();
        undulations.map_or_else(Vec::new, |count| over_all_turns(model, *count))
    }

    /// Of a whole number of undulations it is a form that all turns share.
    fn limit(&self, model: &CirclePoints, shape: &Shape) -> Vec<Column> {
        let undulations = shape.values.first();
        undulations.map_or_else(Vec::new, |count| over_all_turns(model, count.round()))
    }
}

/// Cosine and sine of a number of undulations a turn over all turns.
fn over_all_turns(model: &CirclePoints, count: f64) -> Vec<Column> {
    [f64::cos, f64::sin]
        .map(|wave| {
            Column::from_places(model.places(), |_, place| wave(count * model.turned(place)))
        })
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::circle::Point;
    use nalgebra::DVector;

    /// Rounding: a wave that goes on from pass to pass is its two columns, wherever the widest gap between
    /// the points of a pass cuts it open, whichever way it is turned, and begun a little earlier or later.
    #[test]
    fn a_wave_goes_on_from_where_a_pass_was_begun() {
        for (sense, closing, begun) in [
            (1.0, 0, [0.0; 4]),
            (-1.0, 0, [0.0; 4]),
            (1.0, 1, [0.0; 4]),
            (1.0, 0, [0.0, 11.0, -7.0, 3.0]),
        ] {
            let mut points = Vec::new();
            let mut wave = Vec::new();
            for (pass, begun) in begun.into_iter().enumerate() {
                for k in 0..72 + closing {
                    let wider = if (40..72).contains(&k) { 0.5 } else { 0.0 };
                    let angle = (begun + f64::from(k) * 5.0 + wider).to_radians();
                    let (y, x) = (sense * angle).sin_cos();
                    points.push((Point::new(50.0 * x, 50.0 * y), pass as u32 + 1));
                    let turned = angle + std::f64::consts::TAU * pass as f64;
                    wave.push((2.4 * turned).cos());
                }
            }
            let model = CirclePoints::new(&points, None).expect("a circle");
            // In the order of the places.
            let order = model.places().iter().map(|p| wave[p.time as usize]);
            let wave = DVector::from_iterator(points.len(), order);
            let columns = over_all_turns(&model, 2.4);
            let dense: Vec<_> = columns.iter().map(|c| c.dense(points.len())).collect();
            let basis = DMatrix::from_columns(&dense);
            let gram = basis.tr_mul(&basis).cholesky().expect("two columns");
            let left = &wave - &basis * gram.solve(&basis.tr_mul(&wave));
            assert!(
                left.amax() < 1e-9,
                "{sense} {closing} {begun:?}: {} is left",
                left.amax()
            );
        }
    }
}
