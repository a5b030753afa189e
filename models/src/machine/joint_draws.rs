//! Many draws of the deviations of the same points.
//!
//! Once the widenings w_c of the components are drawn, what they add to a point of their own is a sum of
//! independent normal deviates u_c w_c z_c along the motions m_c: normal, with covariance
//!
//! ```text
//!     Σ w_c² u_c² m_c m_c'.
//! ```
//!
//! Three normal deviates through the triangular factor of this 3 × 3 matrix have the same distribution as one
//! for every component. The products m_c m_c' u_c² are tabled once, and so are the powers times the motions,
//! with which coefficients add to all points: a draw is two products of a table with a vector.

use errsep_solvers::by_processor;
use nalgebra::Vector3;
use rand::Rng;

use super::monte_carlo::{Influence, normal};

/// Entries of a table's row are as many times so many.
const LANES: usize = 8;

/// A pivot of a covariance below this share of its diagonal is its rounding.
const PIVOT: f64 = 1e-13;

/// How coefficients and points of a component are drawn together.
pub(super) struct Part<'a> {
    pub influence: &'a Influence,
    /// Variance at each point of what is drawn for it alone; empty where nothing is.
    pub own: Vec<f64>,
    /// Deviation of every point by each deviate that all points share, before the widening.
    pub shared: Vec<Vec<Vector3<f64>>>,
}

/// A row of numbers that is added with a factor of each draw; the first row with one.
struct Table {
    width: usize,
    rows: Vec<f64>,
}

impl Table {
    fn new(width: usize) -> Self {
        Self {
            width,
            rows: vec![0.0; width],
        }
    }

    fn first(&mut self) -> &mut [f64] {
        &mut self.rows[..self.width]
    }

    fn row(&mut self) -> &mut [f64] {
        let from = self.rows.len();
        self.rows.resize(from + self.width, 0.0);
        &mut self.rows[from..]
    }
}

/// What is the same in all draws.
pub(super) struct Joint<'a> {
    parts: Vec<Part<'a>>,
    points: usize,
    /// Points, rounded up to whole lanes.
    room: usize,
    /// x of all points, y, z: the means, then a row for each deviate that points share.
    shared: Table,
    /// xx of all points, yx, yy, zx, zy, zz: what is widened by nothing, then a row for each that is.
    own: Table,
    /// Whether any point moves on its own.
    moves: bool,
}

/// What a draw writes into.
pub(super) struct Room {
    factors: Vec<f64>,
    squares: Vec<f64>,
    deviations: Vec<f64>,
    covariance: Vec<f64>,
    normals: Vec<f64>,
}

impl<'a> Joint<'a> {
    pub fn new(means: &[Vector3<f64>], parts: Vec<Part<'a>>) -> Self {
        let points = means.len();
        let room = points.next_multiple_of(LANES);
        let (mut shared, mut own) = (Table::new(3 * room), Table::new(6 * room));
        put(shared.first(), room, means);
        for part in &parts {
            for column in &part.shared {
                put(shared.row(), room, column);
            }
            if part.own.is_empty() {
                continue;
            }
            let row = match part.influence.degrees {
                Some(_) => own.row(),
                None => own.first(),
            };
            let motions = part.influence.motions.iter();
            for (i, (m, variance)) in motions.zip(&part.own).enumerate() {
                let products = [
                    m.x * m.x,
                    m.y * m.x,
                    m.y * m.y,
                    m.z * m.x,
                    m.z * m.y,
                    m.z * m.z,
                ];
                for (k, product) in products.into_iter().enumerate() {
                    row[k * room + i] += variance * product;
                }
            }
        }
        Self {
            parts,
            points,
            room,
            shared,
            moves: own.rows.iter().any(|v| *v != 0.0),
            own,
        }
    }

    pub fn room(&self) -> Room {
        Room {
            factors: Vec::new(),
            squares: Vec::new(),
            deviations: vec![0.0; self.shared.width],
            covariance: vec![0.0; self.own.width],
            normals: vec![0.0; self.shared.width],
        }
    }

    /// Draws the deviation of every point, µm.
    pub fn draw(&self, rng: &mut impl Rng, into: &mut Room, deviations: &mut [Vector3<f64>]) {
        into.factors.clear();
        into.factors.push(1.0);
        into.squares.clear();
        into.squares.push(1.0);
        for part in &self.parts {
            // The coefficients of a component and its points rest on the same readings.
            let widening = part.influence.widening(rng);
            let shared = part.shared.iter().map(|_| widening * normal(rng));
            into.factors.extend(shared);
            if !part.own.is_empty() && part.influence.degrees.is_some() {
                into.squares.push(widening * widening);
            }
        }
        combine(&mut into.deviations, &self.shared.rows, &into.factors);
        if self.moves {
            combine(&mut into.covariance, &self.own.rows, &into.squares);
            for axis in into.normals.chunks_exact_mut(self.room) {
                for z in &mut axis[..self.points] {
                    *z = normal(rng);
                }
            }
            through_factor(&mut into.deviations, &into.covariance, &into.normals);
        }
        let (x, rest) = into.deviations.split_at(self.room);
        let (y, z) = rest.split_at(self.room);
        for (i, deviation) in deviations.iter_mut().enumerate().take(self.points) {
            *deviation = Vector3::new(x[i], y[i], z[i]);
        }
    }
}

fn put(row: &mut [f64], room: usize, vectors: &[Vector3<f64>]) {
    for (i, v) in vectors.iter().enumerate() {
        for k in 0..3 {
            row[k * room + i] = v[k];
        }
    }
}

by_processor! {
    /// The sum of the rows of a table times their factors.
    fn combine(sum: &mut [f64], rows: &[f64], factors: &[f64]) from combine_any
}

#[inline(always)]
fn combine_any<const FMA: bool>(sum: &mut [f64], rows: &[f64], factors: &[f64]) {
    let width = sum.len();
    for (k, lanes) in sum.chunks_exact_mut(LANES).enumerate() {
        let mut total = [0.0; LANES];
        for (row, factor) in rows.chunks_exact(width).zip(factors) {
            let own = &row[k * LANES..(k + 1) * LANES];
            for (t, v) in total.iter_mut().zip(own) {
                *t = fused::<FMA>(*factor, *v, *t);
            }
        }
        lanes.copy_from_slice(&total);
    }
}

by_processor! {
    /// Adds normal deviates of all points through the lower factors of their covariances.
    fn through_factor(deviations: &mut [f64], covariance: &[f64], normals: &[f64]) from through_factor_any
}

#[inline(always)]
fn through_factor_any<const FMA: bool>(
    deviations: &mut [f64],
    covariance: &[f64],
    normals: &[f64],
) {
    let room = deviations.len() / 3;
    let [xx, yx, yy, zx, zy, zz] = [0, 1, 2, 3, 4, 5].map(|k| &covariance[k * room..][..room]);
    let [p, q, r] = [0, 1, 2].map(|k| &normals[k * room..][..room]);
    let (x, rest) = deviations.split_at_mut(room);
    let (y, z) = rest.split_at_mut(room);
    // A direction in which nothing moves is left out of the factor.
    let root = |pivot: f64, diagonal: f64| {
        let root = if pivot > PIVOT * diagonal { pivot } else { 0.0 }.sqrt();
        (root, if root > 0.0 { 1.0 / root } else { 0.0 })
    };
    for i in 0..room {
        let (l, inverse) = root(xx[i], xx[i]);
        let (m, n) = (yx[i] * inverse, zx[i] * inverse);
        let (o, inverse) = root(yy[i] - m * m, yy[i]);
        let s = (zy[i] - n * m) * inverse;
        let (t, _) = root(zz[i] - n * n - s * s, zz[i]);
        x[i] = fused::<FMA>(l, p[i], x[i]);
        y[i] = fused::<FMA>(m, p[i], fused::<FMA>(o, q[i], y[i]));
        z[i] = fused::<FMA>(n, p[i], fused::<FMA>(s, q[i], fused::<FMA>(t, r[i], z[i])));
    }
}

#[inline(always)]
fn fused<const FMA: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}
