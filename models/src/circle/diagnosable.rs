//! The fitted circle, laid open to the diagnosis.
//!
//! A reading is the radial distance of a point from a circle that stays fixed, at the angle where it
//! was taken. Taking an effect out of the readings moves the points along their radii and the circle
//! is fitted again, exactly; the fixed circle only keeps the books.

use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3};

use super::effects;
use super::orthogonal::{CircleFit, orthogonal_fit};
use super::points::{Circle, CircleError, Point};
use crate::model::{
    Course, Covariate, Effect, FittedModel, Freedom, Place, Quantity, ROUNDING, Record,
};
use crate::units::UM_PER_MM;

/// Points of one or several passes round a circle with the fitted circle.
#[derive(Debug, Clone)]
pub struct CirclePoints {
    record: Record,
    /// The circle from which readings are counted.
    fixed: Circle,
    directions: Vec<Point>,
    fitted: Circle,
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
    noise: Option<f64>,
    /// Of each trace.
    passes: Vec<Pass>,
}

/// Where and when a pass was begun, and when it ended.
#[derive(Debug, Clone, Copy)]
struct Pass {
    repeat: u32,
    /// Degrees.
    from: f64,
    begun: f64,
    ended: f64,
}

impl Pass {
    fn of(places: &[Place]) -> Option<Self> {
        let first = places.iter().min_by(|a, b| a.time.total_cmp(&b.time))?;
        let last = places.iter().max_by(|a, b| a.time.total_cmp(&b.time))?;
        Some(Self {
            repeat: first.repeat,
            from: first.x,
            begun: first.time,
            ended: last.time,
        })
    }

    /// Degrees turned since the pass was begun. Noise may put a point behind the first one by less than `slack`; in the
    /// second half of the pass it closes the turn.
    fn turned(&self, place: &Place, slack: f64) -> f64 {
        let on = (place.direction * (place.x - self.from) + slack).rem_euclid(360.0) - slack;
        let late = 2.0 * place.time > self.begun + self.ended;
        if on < slack && late { on + 360.0 } else { on }
    }
}

impl CirclePoints {
    /// Fits the circle to points (mm) with their repeat numbers from 1, in the order in which they were
    /// taken; the k-th point by angle of each repeat stands at the same place. `noise` is the standard deviation of a radial
    /// deviation, µm, where it is known.
    ///
    /// # Errors
    /// No circle passes through the points, or repeats differ in their number of points.
    pub fn new(points: &[(Point, u32)], noise: Option<f64>) -> Result<Self, CircleError> {
        let all: Vec<Point> = points.iter().map(|p| p.0).collect();
        let first = orthogonal_fit(&all, noise)?;
        let fixed = first.circle;
        let raw = |p: Point| {
            (p.y - fixed.centre.y)
                .atan2(p.x - fixed.centre.x)
                .to_degrees()
        };
        let directions = directions(points, raw);
        let first = points.iter().filter(|p| p.1 == points[0].1);
        let sense = directions.get(&points[0].1).copied().unwrap_or(1.0);
        let seam = seam(first.map(|p| raw(p.0)).collect(), sense);
        let degrees = |p: Point| seam + (raw(p) - seam).rem_euclid(360.0);
        let mut sorted: Vec<(u32, f64, Point, usize)> = points
            .iter()
            .enumerate()
            .map(|(order, &(p, repeat))| (repeat, degrees(p), p, order))
            .collect();
        sorted.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let mut traces: Vec<Range<usize>> = Vec::new();
        for k in 0..sorted.len() {
            match traces.last_mut() {
                Some(trace) if sorted[k].0 == sorted[trace.start].0 => trace.end = k + 1,
                _ => traces.push(k..k + 1),
            }
        }
        let size = traces.first().map_or(0, Range::len);
        if let Some(other) = traces.iter().find(|t| t.len() != size) {
            return Err(CircleError::RepeatsDiffer {
                first: size,
                other: other.len(),
            });
        }
        let places = sorted
            .iter()
            .enumerate()
            .map(|(k, (repeat, angle, _, order))| Place {
                channel: 0,
                x: *angle,
                time: *order as f64,
                repeat: *repeat,
                direction: directions.get(repeat).copied().unwrap_or(1.0),
                cell: k % size,
            })
            .collect();
        let ordered: Vec<Point> = sorted.iter().map(|s| s.2).collect();
        let distances = ordered.iter().map(|p| p.distance(fixed.centre));
        let observed = DVector::from_iterator(
            ordered.len(),
            distances.map(|r| (r - fixed.radius) * UM_PER_MM),
        );
        let directions = ordered
            .iter()
            .map(|p| {
                let r = p.distance(fixed.centre);
                Point::new((p.x - fixed.centre.x) / r, (p.y - fixed.centre.y) / r)
            })
            .collect();
        let own = orthogonal_fit(&ordered, noise)?;
        let record = Record::new(places, traces, observed);
        let passes = record.traces.iter();
        let passes = passes.filter_map(|t| Pass::of(&record.places[t.clone()]));
        Ok(Self {
            passes: passes.collect(),
            record,
            fixed,
            directions,
            fitted: own.circle,
            residuals: DVector::zeros(0),
            jacobian: DMatrix::zeros(0, 0),
            noise,
        }
        .with(own))
    }

    fn with(mut self, fit: CircleFit) -> Self {
        self.fitted = fit.circle;
        self.residuals = DVector::from_vec(fit.residuals_um);
        // ∂(reading)/∂(centre, radius) is the negative of ∂(deviation)/∂(…).
        self.jacobian = -fit.jacobian;
        self
    }

    /// The fitted circle.
    pub fn circle(&self) -> Circle {
        self.fitted
    }

    /// Number of points of one pass.
    pub fn points_of_a_pass(&self) -> usize {
        self.record.traces.first().map_or(0, Range::len)
    }

    /// Angle from point to point of a pass, on average, degrees.
    pub(super) fn spacing_of_a_pass(&self) -> f64 {
        let places = self
            .record
            .traces
            .first()
            .map(|t| &self.record.places[t.clone()]);
        match places {
            Some([first, .., last]) => (last.x - first.x) / (self.points_of_a_pass() - 1) as f64,
            _ => 360.0,
        }
    }

    /// Part of the test at which a point was taken, 0 to 1.
    pub(super) fn moment(&self, place: &Place) -> f64 {
        place.time / (self.record.places.len().max(2) - 1) as f64
    }

    /// Angle turned since the first pass was begun, rad: the passes follow each other without stopping. Counted from
    /// the point at which each was begun, wherever it is cut open.
    pub(super) fn turned(&self, place: &Place) -> f64 {
        let own = self.passes.iter().find(|p| p.repeat == place.repeat);
        let (Some(first), Some(own)) = (self.passes.first(), own) else {
            return 0.0;
        };
        let before = self.passes.iter().filter(|p| p.repeat < own.repeat).count();
        // A pass may be begun a little before or after the angle of the first one.
        let later = place.direction * (own.from - first.from);
        let later = (later + 180.0).rem_euclid(360.0) - 180.0;
        let on = own.turned(place, 0.5 * self.spacing_of_a_pass());
        place.direction * (360.0 * before as f64 + later + on).to_radians()
    }

    /// Angle of a place, rad.
    pub(super) fn angle(place: &Place) -> f64 {
        place.x.to_radians()
    }
}

/// The sense of each repeat, by the sum of its steps of less than half a turn: 1 with growing angles.
fn directions(points: &[(Point, u32)], degrees: impl Fn(Point) -> f64) -> BTreeMap<u32, f64> {
    let mut sums: BTreeMap<u32, f64> = BTreeMap::new();
    for pair in points.windows(2).filter(|pair| pair[0].1 == pair[1].1) {
        let step = degrees(pair[1].0) - degrees(pair[0].0);
        *sums.entry(pair[0].1).or_default() += (step + 180.0).rem_euclid(360.0) - 180.0;
    }
    let sense = |sum: f64| if sum < 0.0 { -1.0 } else { 1.0 };
    sums.into_iter()
        .map(|(repeat, sum)| (repeat, sense(sum)))
        .collect()
}

/// A gap between points is so much wider than the one where the pass began, at least, if it is to be cut there.
const WIDER: f64 = 1.1;

/// Where a pass is cut open, degrees: in the middle of the widest gap between its points, so that noise moves none of
/// them to the other end; of gaps that are nearly even in that where it began. `angles` in the order of time, `sense` of
/// travel. Between −180° and 180°, so that a pass from just below 0° on does not count its angles from 360°.
fn seam(angles: Vec<f64>, sense: f64) -> f64 {
    let Some(first) = angles.first().map(|a| a.rem_euclid(360.0)) else {
        return 0.0;
    };
    let mut sorted: Vec<f64> = angles.iter().map(|a| a.rem_euclid(360.0)).collect();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len();
    // The gap below each point.
    let gap = |k: usize| {
        let below = if k == 0 {
            sorted[count - 1] - 360.0
        } else {
            sorted[k - 1]
        };
        (sorted[k] - below, 0.5 * (sorted[k] + below))
    };
    let own = sorted.partition_point(|a| *a < first);
    let began = gap(if sense < 0.0 { (own + 1) % count } else { own });
    let widest = (0..count).map(gap).max_by(|a, b| a.0.total_cmp(&b.0));
    let (_, middle) = widest
        .filter(|(width, _)| *width > WIDER * began.0)
        .unwrap_or(began);
    (middle + 180.0).rem_euclid(360.0) - 180.0
}

impl FittedModel for CirclePoints {
    fn name(&self) -> &'static str {
        "circle"
    }

    fn reading_unit(&self) -> &'static str {
        "um"
    }

    fn position_unit(&self) -> &'static str {
        "deg"
    }

    fn time_unit(&self) -> &'static str {
        "readings"
    }

    fn record(&self) -> &Record {
        &self.record
    }

    fn rounding(&self) -> f64 {
        let Point { x, y } = self.fixed.centre;
        ROUNDING * UM_PER_MM * (x.hypot(y) + self.fixed.radius)
    }

    fn freedom(&self) -> Freedom {
        Freedom {
            columns: self.jacobian.clone(),
            profiles: None,
        }
    }

    fn linearised(&self) -> DVector<f64> {
        // The exact deviations and, linearly, how far the circle lies from the fixed one.
        let moved = DVector::from_vec(vec![
            self.fitted.centre.x - self.fixed.centre.x,
            self.fitted.centre.y - self.fixed.centre.y,
            self.fitted.radius - self.fixed.radius,
        ]) * UM_PER_MM;
        &self.residuals + &self.jacobian * moved
    }

    fn channel_names(&self) -> Vec<String> {
        vec!["radius".to_owned()]
    }

    fn quantities(&self) -> Vec<Quantity> {
        let gram = self.jacobian.tr_mul(&self.jacobian);
        let Some(inverse) = Matrix3::from_fn(|i, j| gram[(i, j)]).try_inverse() else {
            return Vec::new();
        };
        ["centre x, moved", "centre y, moved", "radius, moved"]
            .into_iter()
            .enumerate()
            .map(|(k, name)| Quantity {
                name: name.to_owned(),
                unit: "um",
                weights: &self.jacobian * inverse.row(k).transpose(),
            })
            .collect()
    }

    fn names_single_readings(&self) -> bool {
        true
    }

    fn stated_noise(&self) -> Option<f64> {
        self.noise
    }

    /// Errors of the axes, as the radius shows them: along either, functions of the place along one of them, or another in each
    /// sense of travel; a centre that wanders or is another from some moment on.
    fn covariates(&self) -> Vec<Covariate> {
        let places = self.places();
        let part = |of: fn(f64) -> f64| places.iter().map(|p| of(Self::angle(p))).collect();
        let along: [Vec<f64>; 2] = [part(f64::cos), part(f64::sin)];
        let smooth = |name: &str, values: Vec<f64>| Covariate {
            factors: along.to_vec(),
            ..Covariate::smooth(name, values)
        };
        let wandering = smooth(
            "time, of the centre",
            places.iter().map(|p| p.time).collect(),
        );
        let jumping = Covariate {
            course: Course::Step,
            ..wandering.clone()
        };
        let lost_motion = |axis: usize, letter: &str| Covariate {
            name: format!("the sense of travel of {letter}"),
            course: Course::Proportional,
            factors: vec![
                effects::lost_motion(self, axis)
                    .dense(places.len())
                    .as_slice()
                    .to_vec(),
            ],
            ..wandering.clone()
        };
        let [x, y] = along.clone();
        vec![
            smooth("X, along either axis", x),
            smooth("Y, along either axis", y),
            lost_motion(0, "X"),
            lost_motion(1, "Y"),
            wandering,
            jumping,
        ]
    }

    fn refit(&self, observed: DVector<f64>) -> Self {
        let points: Vec<Point> = self
            .directions
            .iter()
            .zip(observed.iter())
            .map(|(u, r)| {
                let r = self.fixed.radius + r / UM_PER_MM;
                Point::new(self.fixed.centre.x + r * u.x, self.fixed.centre.y + r * u.y)
            })
            .collect();
        let mut fitted = self.clone();
        fitted.record.observed = observed;
        match orthogonal_fit(&points, self.noise) {
            Ok(fit) => fitted.with(fit),
            // Readings that are no circle any more: counted from the circle as it was.
            Err(_) => {
                let before = self.linearised() - &self.residuals;
                fitted.residuals = &fitted.record.observed - before;
                fitted
            }
        }
    }

    fn effects(&self) -> Vec<Box<dyn Effect<Self>>> {
        effects::all()
    }

    fn jumps(&self) -> Vec<DMatrix<f64>> {
        let angles: Vec<f64> = self.places().iter().map(Self::angle).collect();
        let rows = angles.len();
        let centre = DMatrix::from_fn(rows, 2, |row, axis| match axis {
            0 => angles[row].cos(),
            _ => angles[row].sin(),
        });
        vec![DMatrix::from_element(rows, 1, 1.0), centre]
    }
}

#[cfg(test)]
mod tests {
    use super::seam;

    /// *Limit*: a pass that begins a hair below 0° is told by the angles of one that begins a hair above.
    #[test]
    fn a_pass_from_just_below_zero_is_told_by_the_same_angles() {
        let from = |begin: f64| (0..72).map(|k| begin + 5.0 * f64::from(k)).collect();
        for begin in [-0.01, 0.0, 0.01] {
            // Rounding.
            let expected = begin - 2.5;
            assert!((seam(from(begin), 1.0) - expected).abs() < 1e-9, "{begin}");
        }
    }
}
