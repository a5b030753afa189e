//! A banded system factored at one λ: [A; λL] = Q [R_cc R_cy; 0 T], and what follows from it.

use nalgebra::{DMatrix, DVector};

use super::{BandedSystem, Point, RegularizationError};
use crate::linear::banded::{BandInverse, BandTriangle, RowStack, Tall, compress, stencil_trace};

/// The factors of a banded system at one λ.
#[derive(Debug, Clone)]
pub struct Factored<'a> {
    system: &'a BandedSystem,
    lambda: f64,
    /// R_cc with the columns R_cy and Qᵀb beside it.
    triangle: BandTriangle,
    /// T, q × q.
    corner: DMatrix<f64>,
    /// The solution: band unknowns, then the border's.
    solution: Vec<f64>,
    /// Q_w, an orthonormal basis of the range of R⁻ᵀW: the directions the conditions take away.
    taken: Vec<Vec<f64>>,
}

/// A combination of neighbouring band unknowns and border unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct Combination {
    /// First band unknown.
    pub first: usize,
    /// Weights of the band unknowns from there on, no more than the band is wide.
    pub band: Vec<f64>,
    /// Weights of the border unknowns.
    pub border: Vec<f64>,
}

impl Combination {
    /// Its value for a vector of all unknowns, the border's last.
    pub fn of(&self, unknowns: &[f64]) -> f64 {
        let border = unknowns.len() - self.border.len();
        dot(&self.band, &unknowns[self.first..]) + dot(&self.border, &unknowns[border..])
    }
}

impl<'a> Factored<'a> {
    pub(super) fn new(system: &'a BandedSystem, lambda: f64) -> Result<Self, RegularizationError> {
        let (triangle, corner) = fold(system, lambda);
        let border = system.border;
        let undetermined = triangle.undetermined(f64::EPSILON).len()
            + (0..border)
                .filter(|j| corner[(*j, *j)].abs() <= f64::MIN_POSITIVE)
                .count();
        if undetermined > 0 {
            return Err(RegularizationError::SharedNullSpace {
                dimension: undetermined,
            });
        }
        let mut right: Vec<f64> = (0..system.band)
            .map(|i| triangle.tail_row(i)[border])
            .collect();
        right.extend((0..border).map(|j| corner[(j, border)]));
        let corner = corner.view((0, 0), (border, border)).into_owned();
        let mut factored = Self {
            system,
            lambda,
            triangle,
            corner,
            solution: Vec::new(),
            taken: Vec::new(),
        };
        for condition in &system.conditions {
            let mut column = condition.clone();
            column.resize(system.band + border, 0.0);
            factored.forward(&mut column);
            factored.project(&mut column);
            factored.project(&mut column);
            let norm = column.iter().map(|v| v * v).sum::<f64>().sqrt();
            column.iter_mut().for_each(|v| *v /= norm);
            factored.taken.push(column);
        }
        factored.project(&mut right);
        factored.backward(&mut right);
        factored.solution = right;
        Ok(factored)
    }

    /// The solution: band unknowns, then the border's.
    pub fn solution(&self) -> &[f64] {
        &self.solution
    }

    /// The norms at this λ.
    pub(super) fn point(&self) -> Point {
        let system = self.system;
        let (x, y) = self.solution.split_at(system.band);
        let mut residual = 0.0;
        for index in 0..system.firsts.len() {
            let (first, band, border, data) = system.row(index);
            residual += (dot(band, &x[first..]) + dot(border, y) - data).powi(2);
        }
        let seminorm: f64 = system.penalised(x).map(|v| v * v).sum();
        let mut pulled = self.normal_of_penalty(x);
        self.forward(&mut pulled);
        self.project(&mut pulled);
        let slope = -4.0 * self.lambda * pulled.iter().map(|v| v * v).sum::<f64>();
        // tr L(RᵀR)⁻¹Lᵀ, part by part of the inverse as in `Inverse`, and nothing of it kept.
        let along = |mut v: Vec<f64>| -> f64 {
            self.backward(&mut v);
            system.penalised(&v[..system.band]).map(|x| x * x).sum()
        };
        let gained: f64 = (0..system.border).map(|j| along(self.unit(j))).sum();
        let lost: f64 = self.taken.iter().map(|d| along(d.clone())).sum();
        let stopped = stencil_trace(&self.triangle, system.stencil) + gained - lost;
        let unknowns = (system.band + system.border - system.conditions.len()) as f64;
        Point {
            lambda: self.lambda,
            residual_norm: residual.sqrt(),
            seminorm: seminorm.sqrt(),
            seminorm_sq_slope: slope,
            effective_parameters: unknowns - self.lambda.powi(2) * stopped,
        }
    }

    /// −λ²(AᵀA + λ²LᵀL)⁻¹LᵀLx of the solution: the bias if the truth were the estimate.
    pub fn bias_estimate(&self) -> Vec<f64> {
        let mut pulled = self.normal_of_penalty(&self.solution[..self.system.band]);
        self.invert(&mut pulled);
        let scale = -self.lambda.powi(2);
        pulled.iter_mut().for_each(|v| *v *= scale);
        pulled
    }

    /// wᵀ(AᵀA + λ²LᵀL)⁻¹w for each combination, under the conditions.
    pub fn forms(&self, combinations: &[Combination]) -> Vec<f64> {
        let inverse = self.inverse();
        combinations
            .iter()
            .map(|w| inverse.form(w.first, &w.band, &w.border))
            .collect()
    }

    /// (AᵀA + λ²LᵀL)⁻¹w for weights w of all band unknowns, under the conditions: band unknowns, then
    /// the border's.
    ///
    /// # Errors
    /// The wrong number of weights.
    pub fn column(&self, weights: &[f64]) -> Result<Vec<f64>, RegularizationError> {
        check(weights.len(), self.system.band, "weights")?;
        let mut column = weights.to_vec();
        column.resize(self.system.band + self.system.border, 0.0);
        self.invert(&mut column);
        Ok(column)
    }

    /// The change of the solution when `data` is added to the right-hand side of A, one value a row
    /// in the order they were pushed (rows that hold an unknown left out), and λ·`penalised` to that of
    /// λL.
    ///
    /// With noise as `data` and −Lx of a truth as `penalised` it is the error of the solution.
    ///
    /// # Errors
    /// The wrong number of values.
    pub fn change(&self, data: &[f64], penalised: &[f64]) -> Result<Vec<f64>, RegularizationError> {
        let system = self.system;
        check(data.len(), system.firsts.len() - system.held.len(), "data")?;
        check(penalised.len(), system.penalty_rows(), "penalised values")?;
        let mut right = vec![0.0; system.band + system.border];
        let pushed = (0..system.firsts.len()).filter(|row| !system.held.contains(row));
        for (index, value) in pushed.zip(data) {
            let (first, band, border, _) = system.row(index);
            let (c, y) = right.split_at_mut(system.band);
            for (out, a) in c[first..]
                .iter_mut()
                .zip(band)
                .chain(y.iter_mut().zip(border))
            {
                *out += a * value;
            }
        }
        for (row, value) in penalised.iter().enumerate() {
            for (out, s) in right[row..].iter_mut().zip(system.stencil) {
                *out += self.lambda.powi(2) * s * value;
            }
        }
        self.invert(&mut right);
        Ok(right)
    }

    /// v ← (AᵀA + λ²LᵀL)⁻¹v under the conditions.
    fn invert(&self, v: &mut [f64]) {
        self.forward(v);
        self.project(v);
        self.backward(v);
    }

    /// λ.
    pub fn lambda(&self) -> f64 {
        self.lambda
    }

    /// Variances of combinations under noise of unit variance, and the largest bias that a truth
    /// with ‖Lx‖ = 1 can give them.
    ///
    /// With v(μ) = wᵀ(AᵀA + μLᵀL)⁻¹w and μ = λ², the variance is v + dv/d ln μ and the square of
    /// the bias −μ dv/d ln μ. The derivative is a central difference over ±0.1 % of λ, good to six
    /// digits; its two factorisations spare the long columns of the inverse.
    ///
    /// # Errors
    /// The factorisation at a neighbouring λ broke down.
    pub fn variances(
        &self,
        combinations: &[Combination],
    ) -> Result<(DVector<f64>, DVector<f64>), RegularizationError> {
        self.variances_of(|factored| Ok(factored.forms(combinations)))
    }

    /// As [`variances`](Self::variances) for any v(μ) that `forms` finds of a factored system.
    ///
    /// # Errors
    /// As [`variances`](Self::variances), or those of `forms`.
    pub fn variances_of(
        &self,
        forms: impl Fn(&Factored<'_>) -> Result<Vec<f64>, RegularizationError>,
    ) -> Result<(DVector<f64>, DVector<f64>), RegularizationError> {
        const STEP: f64 = 1e-3;
        let at = |factor: f64| forms(&self.system.factor(self.lambda * factor)?);
        let (above, below) = (at(STEP.exp())?, at((-STEP).exp())?);
        let here = forms(self)?;
        let mu = self.lambda.powi(2);
        let slopes = above
            .iter()
            .zip(&below)
            .map(|(a, b)| (a - b) / (4.0 * STEP));
        let both: Vec<(f64, f64)> = here
            .iter()
            .zip(slopes)
            .map(|(v, slope)| ((v + slope).max(0.0), (-mu * slope).max(0.0).sqrt()))
            .collect();
        Ok((
            DVector::from_iterator(both.len(), both.iter().map(|b| b.0)),
            DVector::from_iterator(both.len(), both.iter().map(|b| b.1)),
        ))
    }

    /// LᵀLx, zero for the border.
    fn normal_of_penalty(&self, x: &[f64]) -> Vec<f64> {
        let system = self.system;
        let mut out = vec![0.0; system.band + system.border];
        for (row, value) in system.penalised(x).enumerate() {
            for (out, s) in out[row..].iter_mut().zip(system.stencil) {
                *out += s * value;
            }
        }
        out
    }

    /// v ← R⁻ᵀv over band and border.
    fn forward(&self, v: &mut [f64]) {
        let (c, y) = v.split_at_mut(self.system.band);
        self.triangle.solve_transposed(c);
        for (i, value) in c.iter().enumerate() {
            for (y, r) in y.iter_mut().zip(self.triangle.tail_row(i)) {
                *y -= r * value;
            }
        }
        for j in 0..y.len() {
            for k in 0..j {
                y[j] -= self.corner[(k, j)] * y[k];
            }
            y[j] /= self.corner[(j, j)];
        }
    }

    /// v ← R⁻¹v over band and border.
    fn backward(&self, v: &mut [f64]) {
        let (c, y) = v.split_at_mut(self.system.band);
        for j in (0..y.len()).rev() {
            for k in j + 1..y.len() {
                y[j] -= self.corner[(j, k)] * y[k];
            }
            y[j] /= self.corner[(j, j)];
        }
        for (i, value) in c.iter_mut().enumerate() {
            *value -= dot(&self.triangle.tail_row(i)[..y.len()], y);
        }
        self.triangle.solve(c);
    }

    /// Takes the conditions' directions out of v.
    fn project(&self, v: &mut [f64]) {
        for direction in &self.taken {
            let share = dot(direction, v);
            for (v, d) in v.iter_mut().zip(direction) {
                *v -= share * d;
            }
        }
    }

    /// The unit vector of a border unknown.
    fn unit(&self, j: usize) -> Vec<f64> {
        let mut v = vec![0.0; self.system.band + self.system.border];
        v[self.system.band + j] = 1.0;
        v
    }

    fn inverse(&self) -> Inverse {
        let columns = |start: &dyn Fn(usize) -> Vec<f64>, count: usize| -> Vec<Vec<f64>> {
            (0..count)
                .map(|k| {
                    let mut column = start(k);
                    self.backward(&mut column);
                    column
                })
                .collect()
        };
        Inverse {
            band: BandInverse::of(&self.triangle),
            border: columns(&|j| self.unit(j), self.system.border),
            taken: columns(&|k| self.taken[k].clone(), self.taken.len()),
            unknowns: self.system.band,
        }
    }
}

/// The inverse of RᵀR under the conditions, where it can be had for a band's worth of work:
/// Z + Σ_border v vᵀ − Σ_taken v vᵀ, with Z the selected inverse of R_cc.
struct Inverse {
    band: BandInverse,
    border: Vec<Vec<f64>>,
    taken: Vec<Vec<f64>>,
    unknowns: usize,
}

impl Inverse {
    fn form(&self, first: usize, weights: &[f64], border: &[f64]) -> f64 {
        let mut form = 0.0;
        for (i, a) in weights.iter().enumerate() {
            for (j, b) in weights.iter().enumerate() {
                form += a * b * self.band.get(first + i, first + j);
            }
        }
        let along = |v: &Vec<f64>| {
            let of_border = dot(border, &v[self.unknowns..]);
            (dot(weights, &v[first..]) + of_border).powi(2)
        };
        form + self.border.iter().map(along).sum::<f64>()
            - self.taken.iter().map(along).sum::<f64>()
    }
}

/// Folds rows and penalty in the order of their first unknown.
fn fold(system: &BandedSystem, lambda: f64) -> (BandTriangle, DMatrix<f64>) {
    let (width, border) = (system.width, system.border);
    let columns = border + 1;
    let mut triangle = BandTriangle::new(system.band, width, columns);
    let mut stack = RowStack::default();
    let mut pending = Tall::new(columns);
    let mut waiting = 0;
    pending.reset(0, columns);
    let mut corner = vec![0.0; columns * columns];
    let mut next = 0;
    let mut first = 0;
    while first < system.band {
        let end = next
            + system.firsts[next..]
                .iter()
                .take_while(|f| **f == first)
                .take(Tall::CAPACITY / 2)
                .count();
        // The penalty row goes with the last rows that begin here.
        let more = system.firsts.get(end) == Some(&first);
        let penalty = usize::from(first < system.penalty_rows() && !more);
        let rows = end - next + penalty;
        if rows > 0 {
            let reach = if end > next {
                width
            } else {
                system.stencil.len()
            };
            let span = triangle.span_from(first, first + reach - 1);
            stack.reset(first, span, columns, rows);
            for (place, index) in (next..end).enumerate() {
                let (_, band, beside, data) = system.row(index);
                let out = stack.row_mut(place);
                out[..width].copy_from_slice(band);
                out[span..span + border].copy_from_slice(beside);
                out[span + border] = data;
            }
            if penalty == 1 {
                let out = stack.row_mut(rows - 1);
                for (out, s) in out.iter_mut().zip(system.stencil) {
                    *out = lambda * s;
                }
            }
            triangle.fold(&mut stack);
            for tail in stack.tails() {
                if waiting == Tall::CAPACITY {
                    compress(&mut pending, &mut corner);
                    waiting = 0;
                }
                pending.reset(waiting + 1, columns);
                for (j, value) in tail.iter().enumerate() {
                    pending.column_mut(j)[waiting] = *value;
                }
                waiting += 1;
            }
        }
        next = end;
        if !more {
            first += 1;
        }
    }
    compress(&mut pending, &mut corner);
    let corner = DMatrix::from_row_slice(columns, columns, &corner).upper_triangle();
    (triangle, corner)
}

fn check(found: usize, expected: usize, what: &'static str) -> Result<(), RegularizationError> {
    if found == expected {
        Ok(())
    } else {
        Err(RegularizationError::Shape {
            what,
            expected,
            found,
        })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
