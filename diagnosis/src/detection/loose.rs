//! Directions beside what the fit absorbs in which there is scatter that joins all readings.
//!
//! With e the projected residual and λ its scatter's variance in such a direction q,
//! e − q (1 − (1 + λ)^−½) qᵀe has the covariance I there.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Scatter of less than this part of the noise's variance is none.
const SLIGHT: f64 = 1e-9;

/// Orthonormal directions with scatter.
#[derive(Debug, Clone)]
pub(crate) struct Loose {
    directions: DMatrix<f64>,
    parts: DVector<f64>,
    /// The product of a signature with each of these, squared, is what is taken of its square.
    pub in_squares: DMatrix<f64>,
}

impl Loose {
    /// No such directions.
    pub fn none(readings: usize) -> Self {
        Self {
            directions: DMatrix::zeros(readings, 0),
            parts: DVector::zeros(0),
            in_squares: DMatrix::zeros(readings, 0),
        }
    }

    /// From projected columns, one standard deviation each.
    pub fn new(columns: &DMatrix<f64>) -> Self {
        let eigen = SymmetricEigen::new(columns.tr_mul(columns));
        let pairs = eigen
            .eigenvalues
            .iter()
            .zip(eigen.eigenvectors.column_iter());
        let (directions, parts): (Vec<DVector<f64>>, Vec<f64>) = pairs
            .filter(|(variance, _)| **variance > SLIGHT)
            .map(|(variance, combination)| {
                let direction = columns * combination / variance.sqrt();
                (direction, 1.0 - 1.0 / (1.0 + variance).sqrt())
            })
            .unzip();
        if directions.is_empty() {
            return Self::none(columns.nrows());
        }
        let directions = DMatrix::from_columns(&directions);
        let mut in_squares = directions.clone();
        for (mut column, part) in in_squares.column_iter_mut().zip(&parts) {
            column *= (part * (2.0 - part)).sqrt();
        }
        Self {
            directions,
            parts: DVector::from_vec(parts),
            in_squares,
        }
    }

    /// ln of the determinant of the covariance in these directions.
    pub fn log_determinant(&self) -> f64 {
        self.parts.iter().map(|part| -2.0 * (1.0 - part).ln()).sum()
    }

    /// The inverse root times each column, in place.
    pub fn take(&self, columns: &mut DMatrix<f64>) {
        if self.directions.ncols() > 0 {
            let mut along = self.directions.tr_mul(columns);
            for mut column in along.column_iter_mut() {
                column.component_mul_assign(&self.parts);
            }
            columns.gemm(-1.0, &self.directions, &along, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use errsep_models::model::{AnyModel, Column, FittedModel};
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::{Channel, Direction, Observations, Reading};
    use nalgebra::DVector;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, Normal, StandardNormal};

    use crate::detection::space::Space;
    use crate::noise::law::{NoiseLaw, NoiseSource, draw_scatter};

    /// Four channels on grids of their own, two repeats, heights of the surfaces independent from millimetre to
    /// millimetre and high at the ends.
    fn model() -> AnyModel {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let normal = Normal::new(0.0, 0.3).unwrap();
        let mut heights = || -> Vec<f64> { (0..60).map(|_| normal.sample(&mut random)).collect() };
        let forms = [heights(), heights(), heights()];
        let at = |form: usize, x: f64| forms[form][(x + 2.0) as usize];
        let mut readings = Vec::new();
        for (c, channel) in Channel::ALL.into_iter().enumerate() {
            for repeat in 1..=2 {
                for k in 0..25 {
                    let x = 0.3 * c as f64 + (1.9 + 0.03 * c as f64) * f64::from(k);
                    let side = if channel.is_side_a() { 1 } else { 2 };
                    let value = channel.indicator_sign() * at(0, x)
                        + at(side, x)
                        + 0.01 * (x - 24.0).powi(2)
                        + 0.1 * normal.sample(&mut random);
                    readings.push(Reading {
                        channel,
                        repeat,
                        direction: Direction::Forward,
                        time: None,
                        x,
                        value,
                    });
                }
            }
        }
        let model = Linearised::new(&Observations { readings }, Assumptions::default()).unwrap();
        AnyModel::new(&model)
    }

    /// The scatter of forms between grids and of their line is one with the noise: what the fit leaves of draws of
    /// both has the mean square one, and signatures have the squares of their whitened, projected columns.
    #[test]
    fn noise_and_scatter_together_are_one() {
        let model = model();
        let expected = model.expected_scatter();
        // Of positions, and of the line.
        let traces = model.traces().len();
        assert!(expected.iter().any(|c| c.rows.len() < traces));
        assert!(expected.iter().any(|c| c.rows.len() > traces));
        let law = NoiseLaw::white(0.03, 1e9, NoiseSource::Stated);
        let space = Space::expecting(&model, &law);
        let mut random = ChaCha8Rng::seed_from_u64(6);
        let draws = 400;
        let squares: Vec<f64> = (0..draws)
            .map(|_| {
                let noise = DVector::from_fn(space.readings(), |_, _| {
                    let value: f64 = StandardNormal.sample(&mut random);
                    0.03 * value
                });
                let readings = noise + draw_scatter(&model, &mut random);
                space.forward_vector(&readings).norm_squared()
            })
            .collect();
        let freedom = space.degrees_of_freedom() as f64;
        let mean = squares.iter().sum::<f64>() / draws as f64;
        // Statistical: four standard errors of the mean of 400 χ² of so many degrees of freedom.
        let error = (2.0 * freedom / draws as f64).sqrt();
        assert!((mean - freedom).abs() < 4.0 * error, "{mean} of {freedom}");

        let columns: Vec<Column> = (0..3)
            .map(|k| {
                Column::from_places(model.places(), |_, place| {
                    f64::from(u8::from(place.channel != k)) * (0.1 * place.x + place.time)
                })
            })
            .collect();
        let (seen, _) = space.forward_columns(&columns);
        let gram = space.gram(&columns).matrix;
        // Rounding of products of 200 readings in units of a small noise.
        assert!((gram.clone() - seen.tr_mul(&seen)).amax() < 1e-9 * gram.amax());
    }
}
