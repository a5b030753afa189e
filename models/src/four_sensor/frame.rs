//! From the unknowns of the direct system to surface, straightness and tilt in a chosen frame.

use nalgebra::{DMatrix, DVector, Matrix2x4, Vector2, Vector4};

use super::gauge::{ParabolaMode, remove_line};
use super::{Line, Outputs, Parabola, direct};

/// The frame in which a separation is stated: line, parabola, level of the tilt.
pub(super) struct Frame<'a> {
    outputs: &'a Outputs,
    line: Line,
    parabola: Parabola,
    mode: ParabolaMode,
    slide: Matrix2x4<f64>,
}

/// A solution in its frame.
pub(super) struct Settled {
    pub surface: DVector<f64>,
    pub straightness: DVector<f64>,
    pub tilt: DVector<f64>,
    pub zero_adjustment: Vector4<f64>,
    pub curvature: f64,
}

impl Settled {
    /// f, S, γ and e.
    pub(super) fn profiles(self) -> [DVector<f64>; 4] {
        let zero = DVector::from_column_slice(self.zero_adjustment.as_slice());
        [self.surface, self.straightness, self.tilt, zero]
    }
}

impl<'a> Frame<'a> {
    pub(super) fn new(outputs: &'a Outputs, line: Line, parabola: Parabola) -> Self {
        let geometry = outputs.geometry();
        Self {
            outputs,
            line,
            parabola,
            mode: ParabolaMode::new(geometry),
            slide: direct::slide_of(geometry),
        }
    }

    /// Puts a solution of the direct system, (f, two combinations of e), into the frame.
    pub(super) fn settle(&self, solution: &DVector<f64>) -> Settled {
        self.place(solution, self.outputs.readings(), Some(self.parabola))
    }

    /// What a change of the unknowns changes in the frame, with the same outputs.
    pub(super) fn change(&self, change: &DVector<f64>) -> Settled {
        let silent = vec![[0.0; 4]; self.outputs.readings().len()];
        self.error(change, &silent)
    }

    /// The error in the frame of unknowns and outputs that are both in error.
    pub(super) fn error(&self, of_unknowns: &DVector<f64>, of_readings: &[[f64; 4]]) -> Settled {
        self.place(of_unknowns, of_readings, None)
    }

    /// Derivatives of (f, S, γ, e) after settling with respect to the unknowns before,
    /// (N + 2K + 4) × (N + 2).
    pub(super) fn map(&self) -> DMatrix<f64> {
        let unknowns = self.mode.profile.len() + direct::ZERO_UNKNOWNS;
        let count = self.outputs.readings().len();
        let mut map = DMatrix::zeros(self.mode.profile.len() + 2 * count + 4, unknowns);
        let mut unit = DVector::zeros(unknowns);
        for column in 0..unknowns {
            unit[column] = 1.0;
            map.set_column(column, &stacked(&self.change(&unit)));
            unit[column] = 0.0;
        }
        map
    }

    /// Variances of (f, S, γ, e) from the part of the outputs' noise that the direct system does not
    /// see, for readings of unit variance. It is independent of the rest.
    pub(super) fn own_variances(&self) -> DVector<f64> {
        let points = self.mode.profile.len();
        let count = self.outputs.readings().len();
        let own = self.slide * self.slide.transpose();
        let mut variances = DVector::zeros(points + 2 * count + 4);
        variances.rows_mut(points, count).fill(own[(0, 0)]);
        variances.rows_mut(points + count, count).fill(own[(1, 1)]);
        for n in 0..count {
            let readings = self.outputs.variances(n);
            if readings != [1.0; 4] {
                let squares = self.slide.map(|w| w * w) * Vector4::from(readings);
                variances[points + n] = squares[0];
                variances[points + count + n] = squares[1];
            }
        }
        if let Parabola::TiltSlope(_) = self.parabola {
            // The slope of the tilt's own noise becomes a parabola of everything.
            let weights = self.slope_weights();
            let per_slope = ParabolaMode::CURVATURE_PER_TILT_SLOPE;
            let share = per_slope.powi(2) * own[(1, 1)] * weights.norm_squared();
            let mut unknowns = DVector::zeros(points + direct::ZERO_UNKNOWNS);
            unknowns.rows_mut(0, points).copy_from(&self.mode.profile);
            unknowns[points] = self.mode.zero;
            let silent = vec![[0.0; 4]; count];
            let moved = stacked(&self.shifted(unknowns, &silent));
            variances += moved.map(|value| share * value * value);
            for n in 0..count {
                for row in 0..2 {
                    let at = points + row * count + n;
                    variances[at] -= 2.0 * per_slope * weights[n] * own[(row, 1)] * moved[at];
                }
            }
        }
        variances
    }

    /// Output less model, one row a slide position.
    pub(super) fn residuals(&self, settled: &Settled) -> Vec<[f64; 4]> {
        let columns = self.outputs.geometry().slide_columns();
        let offsets = self.outputs.geometry().offsets();
        self.outputs
            .readings()
            .iter()
            .enumerate()
            .map(|(n, readings)| {
                let slide = columns * Vector2::new(settled.straightness[n], settled.tilt[n]);
                std::array::from_fn(|sensor| {
                    readings[sensor]
                        - settled.surface[n + offsets[sensor]]
                        - slide[sensor]
                        - settled.zero_adjustment[sensor]
                })
            })
            .collect()
    }

    /// Settles the parabola, then the rest; without a parabola to follow, its homogeneous part.
    fn place(
        &self,
        solution: &DVector<f64>,
        readings: &[[f64; 4]],
        stated: Option<Parabola>,
    ) -> Settled {
        let points = self.mode.profile.len();
        let mut unknowns = solution.clone();
        let found = self.mode.coefficient(unknowns.rows(0, points));
        let change = match stated.unwrap_or(self.homogeneous()) {
            Parabola::LeastNorm => -found,
            Parabola::SurfaceCurvature(curvature) => curvature - found,
            Parabola::ZeroAdjustment([e2, e3, e4]) => {
                let free = self.outputs.geometry().slide_free();
                let known = free.column(0).dot(&Vector4::new(0.0, e2, e3, e4));
                (known - unknowns[points]) / self.mode.zero
            }
            Parabola::TiltSlope(slope) => {
                let before = self.shifted(unknowns.clone(), readings);
                let found = self.slope_weights().dot(&before.tilt);
                (slope - found) * ParabolaMode::CURVATURE_PER_TILT_SLOPE
            }
        };
        unknowns
            .rows_mut(0, points)
            .axpy(change, &self.mode.profile, 1.0);
        unknowns[points] += change * self.mode.zero;
        let mut settled = self.shifted(unknowns, readings);
        if let Some(Parabola::ZeroAdjustment([_, _, e4])) = stated {
            // e₄ tells the constant of the tilt as well.
            let arms = self.outputs.geometry().positions();
            let columns = self.outputs.geometry().slide_columns();
            settled.zero_adjustment += arms * (e4 / arms[3]);
            settled.tilt.add_scalar_mut(-e4 / columns[(3, 1)]);
        }
        settled.curvature = found + change;
        settled
    }

    /// The frame with every stated value zero: what a change of the unknowns is subject to.
    fn homogeneous(&self) -> Parabola {
        match self.parabola {
            Parabola::LeastNorm | Parabola::SurfaceCurvature(_) => Parabola::LeastNorm,
            Parabola::ZeroAdjustment(_) => Parabola::ZeroAdjustment([0.0; 3]),
            Parabola::TiltSlope(_) => Parabola::TiltSlope(0.0),
        }
    }

    /// Line, zero-adjustments, S and γ of unknowns whose parabola is settled.
    fn shifted(&self, mut unknowns: DVector<f64>, readings: &[[f64; 4]]) -> Settled {
        let geometry = self.outputs.geometry();
        let points = self.mode.profile.len();
        remove_line(unknowns.rows_mut(0, points), self.line);
        let zero_adjustment = direct::zero_adjustments(
            geometry,
            Vector2::new(unknowns[points], unknowns[points + 1]),
        );
        let surface = unknowns.rows(0, points).into_owned();
        let offsets = geometry.offsets();
        let mut straightness = DVector::zeros(readings.len());
        let mut tilt = DVector::zeros(readings.len());
        for (n, row) in readings.iter().enumerate() {
            let left = Vector4::from_fn(|sensor, _| {
                row[sensor] - surface[n + offsets[sensor]] - zero_adjustment[sensor]
            });
            let slide = self.slide * left;
            straightness[n] = slide[0];
            tilt[n] = slide[1];
        }
        Settled {
            surface,
            straightness,
            tilt,
            zero_adjustment,
            curvature: 0.0,
        }
    }

    /// Weights of the least-squares slope over the slide positions, per mm.
    fn slope_weights(&self) -> DVector<f64> {
        let count = self.outputs.readings().len();
        let centre = 0.5 * (count as f64 - 1.0);
        let step = self.outputs.geometry().step();
        let arms = DVector::from_fn(count, |n, _| (n as f64 - centre) * step);
        let inertia = arms.norm_squared();
        arms / inertia
    }
}

/// (f, S, γ, e) one below the other.
fn stacked(settled: &Settled) -> DVector<f64> {
    let parts = [
        settled.surface.as_slice(),
        settled.straightness.as_slice(),
        settled.tilt.as_slice(),
        settled.zero_adjustment.as_slice(),
    ];
    DVector::from_vec(parts.concat())
}
