//! Orthogonal fits of many circles.
//!
//! With the radius the mean distance from the centre (a, b), the sum of squares is a function of the centre
//! alone: with dᵢ the distances, (uᵢ, vᵢ) the directions and eᵢ = dᵢ − d̄,
//!
//! ```text
//!     gradient  −Σ e (u, v)
//!     Hessian    Σ (u, v)(u, v)' − (1/n) Σ(u, v) Σ(u, v)' + Σ (e/d) (v, −u)(v, −u)'.
//! ```
//!
//! Newton's steps from the fit of Kåsa end after two or three passes over the points where the points surround
//! the centre and the noise is small against the radius. Everything else, and whatever is refused, goes the way
//! of [`orthogonal_fit`], so that both give the same answers.

use errsep_solvers::by_processor;
use nalgebra::{Matrix3, Vector2};
use rayon::prelude::*;

use super::orthogonal::{CircleFit, orthogonal_fit};
use super::points::{Circle, CircleError, Frame, LARGEST, Point, SMALLEST};

/// A fitted circle without its residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedCircle {
    /// The circle, mm.
    pub circle: Circle,
    /// Covariance of (centre x, centre y, radius), mm².
    pub covariance: Matrix3<f64>,
    /// Standard deviation of the radial deviations, µm: given, or estimated from the residuals.
    pub noise_um: f64,
    /// Whether that was given.
    pub noise_given: bool,
    /// Points less three.
    pub degrees_of_freedom: usize,
}

impl From<&CircleFit> for FittedCircle {
    fn from(fit: &CircleFit) -> Self {
        Self {
            circle: fit.circle,
            covariance: fit.covariance,
            noise_um: fit.noise_um,
            noise_given: fit.noise_given,
            degrees_of_freedom: fit.degrees_of_freedom,
        }
    }
}

/// Sets that one thread takes at once.
const TOGETHER: usize = 64;

/// Fits the circle of least squared orthogonal distances to each of many sets of points (mm), on all
/// processors. The answers are those of [`orthogonal_fit`].
pub fn orthogonal_fits<S: AsRef<[Point]> + Sync>(
    sets: &[S],
    noise_um: Option<f64>,
) -> Vec<Result<FittedCircle, CircleError>> {
    let fitted = sets.par_chunks(TOGETHER).flat_map_iter(|sets| {
        let mut room = Room::default();
        sets.iter().map(move |set| {
            let points = set.as_ref();
            match room.fit(points, noise_um) {
                Some(fit) => Ok(fit),
                None => orthogonal_fit(points, noise_um).map(|fit| FittedCircle::from(&fit)),
            }
        })
    });
    fitted.collect()
}

/// Newton's steps after which another way is taken.
const MOST_STEPS: usize = 6;

/// A step, in root-mean-square distances from the centroid, after which the next one is rounding.
const LAST_STEP: f64 = 1e-9;

/// Steps that are left to rounding, in the same unit.
const ROUNDING: f64 = 1e-13;

/// Root mean square of the deviations over the radius up to which the minimum near the seed is taken.
const MOST_NOISE: f64 = 0.05;

/// Determinant of the normal equations over the product of their diagonal: 1 where the points surround the
/// centre evenly.
const LEAST_DETERMINED: f64 = 1e-3;

/// Coordinates about the centroid in root-mean-square distances from it.
#[derive(Default)]
struct Room {
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Room {
    /// The fit where a few steps find it beyond doubt.
    fn fit(&mut self, points: &[Point], noise_um: Option<f64>) -> Option<FittedCircle> {
        let degrees_of_freedom = points.len().checked_sub(3)?;
        if degrees_of_freedom == 0 {
            return None;
        }
        let frame = self.place(points)?;
        let mut at = self.seed()?;
        let n = points.len() as f64;
        let (mut sums, mut step) = (Sums::default(), f64::INFINITY);
        for _ in 0..MOST_STEPS {
            gather(&self.x, &self.y, &at, &mut sums);
            let by = sums.step(n)?;
            at[0] += by.x;
            at[1] += by.y;
            at[2] += sums.e / n - (sums.u * by.x + sums.v * by.y) / n;
            let length = by.norm();
            // Sums of before a step of rounding are those of the minimum.
            if step <= LAST_STEP && length <= ROUNDING {
                return self.told(frame, at, &sums, noise_um, degrees_of_freedom);
            }
            step = length;
        }
        None
    }

    fn place(&mut self, points: &[Point]) -> Option<Frame> {
        let first = points.first()?;
        let n = points.len() as f64;
        let (mut x, mut y, mut greatest) = (0.0, 0.0, 0.0_f64);
        for p in points {
            x += p.x - first.x;
            y += p.y - first.y;
            greatest = greatest.max(p.x.abs()).max(p.y.abs());
        }
        let centroid = first.plus(Point::new(x / n, y / n));
        self.x.clear();
        self.y.clear();
        let mut squares = 0.0;
        for p in points {
            let q = p.minus(centroid);
            self.x.push(q.x);
            self.y.push(q.y);
            squares += q.dot(q);
        }
        let scale = (squares / n).sqrt();
        // Comparisons with what is no number are false.
        let usable = greatest <= LARGEST && scale >= SMALLEST && greatest <= 1e9 * scale;
        if !usable {
            return None;
        }
        for value in self.x.iter_mut().chain(&mut self.y) {
            *value /= scale;
        }
        Some(Frame { centroid, scale })
    }

    /// The circle of Kåsa: centre and radius.
    fn seed(&self) -> Option<[f64; 3]> {
        let [mut xx, mut xy, mut yy, mut zx, mut zy, mut z1] = [0.0; 6];
        for (x, y) in self.x.iter().zip(&self.y) {
            let z = x * x + y * y;
            xx += x * x;
            xy += x * y;
            yy += y * y;
            zx += z * x;
            zy += z * y;
            z1 += z;
        }
        let determinant = xx * yy - xy * xy;
        if !(determinant > LEAST_DETERMINED * xx * yy) {
            return None;
        }
        let a = 0.5 * (yy * zx - xy * zy) / determinant;
        let b = 0.5 * (xx * zy - xy * zx) / determinant;
        let radius = (z1 / self.x.len() as f64 + a * a + b * b).sqrt();
        Some([a, b, radius])
    }

    fn told(
        &self,
        frame: Frame,
        at: [f64; 3],
        sums: &Sums,
        noise_um: Option<f64>,
        degrees_of_freedom: usize,
    ) -> Option<FittedCircle> {
        let n = self.x.len() as f64;
        let squares = (sums.ee - sums.e * sums.e / n).max(0.0);
        if (squares / n).sqrt() > MOST_NOISE * at[2] {
            return None;
        }
        let unit = sums.inverse_normal(n)?;
        let estimated = 1e3 * frame.scale * (squares / degrees_of_freedom as f64).sqrt();
        let sigma = noise_um.unwrap_or(estimated);
        Some(FittedCircle {
            circle: frame.to_world(Circle {
                centre: Point::new(at[0], at[1]),
                radius: at[2],
            }),
            covariance: unit * (1e-3 * sigma).powi(2),
            noise_um: sigma,
            noise_given: noise_um.is_some(),
            degrees_of_freedom,
        })
    }
}

/// Sums over the points: of directions u, v, distances less a radius e, their products, and those of e/d with
/// products of directions.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    u: f64,
    v: f64,
    e: f64,
    uu: f64,
    uv: f64,
    vv: f64,
    eu: f64,
    ev: f64,
    ee: f64,
    curved_uu: f64,
    curved_uv: f64,
    curved_vv: f64,
}

impl Sums {
    /// Newton's step of the centre; `None` where the sum of squares does not bend upwards.
    fn step(&self, n: f64) -> Option<Vector2<f64>> {
        let gradient = [self.eu - self.e * self.u / n, self.ev - self.e * self.v / n];
        let xx = self.uu - self.u * self.u / n + self.curved_vv;
        let xy = self.uv - self.u * self.v / n - self.curved_uv;
        let yy = self.vv - self.v * self.v / n + self.curved_uu;
        let determinant = xx * yy - xy * xy;
        if !(xx > 0.0 && determinant > LEAST_DETERMINED * xx * yy) {
            return None;
        }
        let [p, q] = gradient;
        Some(Vector2::new(
            (yy * p - xy * q) / determinant,
            (xx * q - xy * p) / determinant,
        ))
    }

    /// Inverse of the normal equations in (centre x, centre y, radius).
    fn inverse_normal(&self, n: f64) -> Option<Matrix3<f64>> {
        let (a, b, c) = (self.uu, self.uv, self.u);
        let (d, e) = (self.vv, self.v);
        let [aa, ab, ac] = [d * n - e * e, c * e - b * n, b * e - c * d];
        let [bb, bc, cc] = [a * n - c * c, b * c - a * e, a * d - b * b];
        let determinant = a * aa + b * ab + c * ac;
        (determinant > LEAST_DETERMINED * a * d * n)
            .then(|| Matrix3::new(aa, ab, ac, ab, bb, bc, ac, bc, cc) / determinant)
    }
}

by_processor! {
    fn gather(x: &[f64], y: &[f64], at: &[f64; 3], sums: &mut Sums) from gather_any
}

/// Points that go together.
const LANES: usize = 4;

#[inline(always)]
fn gather_any<const FMA: bool>(x: &[f64], y: &[f64], at: &[f64; 3], sums: &mut Sums) {
    let mut lanes = [[0.0; LANES]; 12];
    let whole = x.len() - x.len() % LANES;
    for (x, y) in x[..whole]
        .chunks_exact(LANES)
        .zip(y[..whole].chunks_exact(LANES))
    {
        let p: [f64; LANES] = std::array::from_fn(|l| x[l] - at[0]);
        let q: [f64; LANES] = std::array::from_fn(|l| y[l] - at[1]);
        let d: [f64; LANES] = std::array::from_fn(|l| fused::<FMA>(p[l], p[l], q[l] * q[l]).sqrt());
        let i: [f64; LANES] = std::array::from_fn(|l| 1.0 / d[l]);
        let u: [f64; LANES] = std::array::from_fn(|l| p[l] * i[l]);
        let v: [f64; LANES] = std::array::from_fn(|l| q[l] * i[l]);
        let e: [f64; LANES] = std::array::from_fn(|l| d[l] - at[2]);
        let c: [f64; LANES] = std::array::from_fn(|l| e[l] * i[l]);
        let uu: [f64; LANES] = std::array::from_fn(|l| u[l] * u[l]);
        let uv: [f64; LANES] = std::array::from_fn(|l| u[l] * v[l]);
        let vv: [f64; LANES] = std::array::from_fn(|l| v[l] * v[l]);
        let mut add = |k: usize, a: &[f64; LANES], b: &[f64; LANES]| {
            for l in 0..LANES {
                lanes[k][l] = fused::<FMA>(a[l], b[l], lanes[k][l]);
            }
        };
        let one = [1.0; LANES];
        add(0, &u, &one);
        add(1, &v, &one);
        add(2, &e, &one);
        add(3, &uu, &one);
        add(4, &uv, &one);
        add(5, &vv, &one);
        add(6, &e, &u);
        add(7, &e, &v);
        add(8, &e, &e);
        add(9, &c, &uu);
        add(10, &c, &uv);
        add(11, &c, &vv);
    }
    let mut total = lanes.map(|own| own.iter().sum::<f64>());
    for (x, y) in x[whole..].iter().zip(&y[whole..]) {
        let (p, q) = (x - at[0], y - at[1]);
        let d = fused::<FMA>(p, p, q * q).sqrt();
        let (u, v, e) = (p / d, q / d, d - at[2]);
        let c = e / d;
        let own = [
            u,
            v,
            e,
            u * u,
            u * v,
            v * v,
            e * u,
            e * v,
            e * e,
            c * u * u,
            c * u * v,
            c * v * v,
        ];
        for (sum, value) in total.iter_mut().zip(own) {
            *sum += value;
        }
    }
    let [
        u,
        v,
        e,
        uu,
        uv,
        vv,
        eu,
        ev,
        ee,
        curved_uu,
        curved_uv,
        curved_vv,
    ] = total;
    *sums = Sums {
        u,
        v,
        e,
        uu,
        uv,
        vv,
        eu,
        ev,
        ee,
        curved_uu,
        curved_uv,
        curved_vv,
    };
}

#[inline(always)]
fn fused<const FMA: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FMA { a.mul_add(b, c) } else { a * b + c }
}
