//! The paper's estimators applied to readings, and the totals over whole diagonals, equations (5) to
//! (11).

use super::components::{Component, Location};
use super::diagonals::{Diagonal, Sequence, Target, Travel, WorkZone};
use super::estimators::{ESTIMATORS, Estimator, Scale, cell};
use super::readings::{DiagonalError, DiagonalReading, Edges, Motion, check};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};

/// One estimator applied at every step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ClosedForm {
    /// Equation of the paper.
    pub equation: String,
    /// Target of the readings used.
    pub target: Target,
    /// Sense of the motions used. One sense alone gives the unidirectional error.
    pub motion: Motion,
    /// The error that it stands for if angular errors and mirror misalignment vanish.
    pub component: Option<Component>,
    /// Value at each step i, µm or rad.
    pub steps: Vec<f64>,
    /// Standard uncertainty of each for readings with unit (1 µm) standard deviation.
    pub step_gains: Vec<f64>,
    /// Their sum from the first step on, at the grid positions: zero first.
    pub profile: Vec<f64>,
    /// Standard uncertainty of the sums for unit readings.
    pub profile_gains: Vec<f64>,
}

/// Every estimator for which all edges were measured, in the order of [`ESTIMATORS`]. Where the
/// diagonals were also run backward, once more for each sense of the moving axis: AC forward and DB
/// backward, for instance, both move Y in its positive sense.
///
/// # Errors
/// What [`DiagonalError`] lists for readings that cannot be placed.
pub fn closed_forms(
    zone: &WorkZone,
    readings: &[DiagonalReading],
) -> Result<Vec<ClosedForm>, DiagonalError> {
    check(zone, readings)?;
    let edges = Edges::of(readings);
    let back = readings.iter().any(|r| r.travel == Travel::Backward);
    let motions = if back {
        &[Motion::Either, Motion::Positive, Motion::Negative][..]
    } else {
        &[Motion::Either]
    };
    Ok(motions
        .iter()
        .flat_map(|&motion| ESTIMATORS.iter().map(move |e| (e, motion)))
        .filter_map(|(e, motion)| apply(e, motion, zone, readings, &edges))
        .collect())
}

fn apply(
    estimator: &Estimator,
    motion: Motion,
    zone: &WorkZone,
    readings: &[DiagonalReading],
    edges: &Edges,
) -> Option<ClosedForm> {
    let divisor = (estimator.divisor)(&Scale::of(zone, estimator.is_body()));
    let mut form = ClosedForm {
        equation: estimator.equation.to_owned(),
        target: estimator.target,
        motion,
        component: estimator.component(),
        steps: Vec::new(),
        step_gains: Vec::new(),
        profile: vec![0.0],
        profile_gains: vec![0.0],
    };
    let mut total: HashMap<usize, f64> = HashMap::new();
    let (mut sum, mut square) = (0.0, 0.0);
    for i in 0..zone.steps {
        let mut weights: BTreeMap<usize, f64> = BTreeMap::new();
        for (corners, pattern, sign) in estimator.terms {
            let (diagonal, index) = cell(pattern, i, zone.steps)?;
            let mut letters = corners.chars();
            let ends = (letters.next()?, letters.next()?);
            for (reading, w) in edges.weights(diagonal, estimator.target, index, ends, motion)? {
                *weights.entry(reading).or_default() += sign * w / divisor;
            }
        }
        for (reading, w) in &weights {
            let whole = total.entry(*reading).or_default();
            square -= *whole * *whole;
            *whole += w;
            square += *whole * *whole;
        }
        let (value, gain) = evaluate(&weights, readings);
        form.steps.push(value);
        form.step_gains.push(gain);
        sum += value;
        form.profile.push(sum);
        form.profile_gains.push(f64::max(square, 0.0).sqrt());
    }
    Some(form)
}

fn evaluate(weights: &BTreeMap<usize, f64>, readings: &[DiagonalReading]) -> (f64, f64) {
    let value = weights.iter().map(|(&r, w)| w * readings[r].value).sum();
    let gain = weights.values().map(|w| w * w).sum::<f64>().sqrt();
    (value, gain)
}

/// What the total of the diagonals gives.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Total {
    /// Equation (7): n·(changes of positioning over the travels, at lines through the centre), µm.
    PositioningSum,
    /// Equations (8) to (10) or the two face diagonals: the average squareness, the paper's S, rad.
    Squareness(Location),
}

/// One estimate from whole diagonals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TotalsEstimate {
    /// Equation of the paper; "two face diagonals" where it has none.
    pub equation: String,
    /// What it is.
    pub quantity: Total,
    /// Value, µm or rad.
    pub value: f64,
    /// Its standard uncertainty for a standard deviation of 1 µm in each total dD, as (11).
    pub gain: f64,
}

/// The errors dD of whole diagonals, µm: reading at the last corner less that at the first, the mean
/// over the runs.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct DiagonalTotals {
    /// By diagonal: dD and the number of runs, each travel of a run for itself.
    pub errors: BTreeMap<Diagonal, (f64, usize)>,
    /// By diagonal that was also run backward: forward less backward, the mean over its stops, µm.
    pub reversals: BTreeMap<Diagonal, f64>,
    /// What they give.
    pub estimates: Vec<TotalsEstimate>,
}

/// Equations (7) to (10) from four body diagonals, and the squareness of Y to X from two face
/// diagonals, whichever were measured from end to end.
///
/// # Errors
/// What [`DiagonalError`] lists for readings that cannot be placed.
pub fn totals(
    zone: &WorkZone,
    readings: &[DiagonalReading],
) -> Result<DiagonalTotals, DiagonalError> {
    check(zone, readings)?;
    let mut runs: BTreeMap<_, (Option<f64>, Option<f64>)> = BTreeMap::new();
    for r in readings {
        let (first, last) = zone.ends(r.diagonal);
        let ends = runs.entry((r.run(), r.travel)).or_default();
        if r.at == first {
            ends.0 = Some(r.value);
        }
        if r.at == last {
            ends.1 = Some(r.value);
        }
    }
    let mut errors: BTreeMap<Diagonal, (f64, usize)> = BTreeMap::new();
    for (((diagonal, ..), _), ends) in runs {
        if let (Some(first), Some(last)) = ends {
            let entry = errors.entry(diagonal).or_default();
            entry.0 += last - first;
            entry.1 += 1;
        }
    }
    for (sum, count) in errors.values_mut() {
        *sum /= *count as f64;
    }
    let mut estimates = Vec::new();
    let of = |d: Diagonal| errors.get(&d).map(|e| e.0);
    if let [Some(ag), Some(bh), Some(ce), Some(df)] = Diagonal::BODY.map(of) {
        let n = Scale::of(zone, true);
        let length = n.d * zone.steps as f64;
        let mut offer = |equation: &str, quantity, sum: f64, divisor: f64| {
            estimates.push(TotalsEstimate {
                equation: equation.to_owned(),
                quantity,
                value: sum / divisor,
                gain: 2.0 / divisor.abs(),
            });
        };
        let [x, y, z] = n.n;
        offer("(7)", Total::PositioningSum, ag + bh + ce + df, 4.0);
        for (equation, location, sum, product) in [
            ("(8)", Location::YZ, -ag - bh + ce + df, y * z),
            ("(9)", Location::XZ, -ag + bh + ce - df, x * z),
            ("(10)", Location::XY, -ag + bh - ce + df, x * y),
        ] {
            let divisor = 4.0 * 1e3 * length * product;
            offer(equation, Total::Squareness(location), sum, divisor);
        }
    }
    if let [Some(ac), Some(db)] = Diagonal::FACE.map(of) {
        // dD_AC − dD_DB = −2 nx ΔY S over the plane, with nx ΔY = nx ny D.
        let n = Scale::of(zone, false);
        let divisor = 2.0 * 1e3 * n.d * zone.steps as f64 * n.n[0] * n.n[1];
        estimates.push(TotalsEstimate {
            equation: "two face diagonals".to_owned(),
            quantity: Total::Squareness(Location::XY),
            value: (db - ac) / divisor,
            gain: std::f64::consts::SQRT_2 / divisor.abs(),
        });
    }
    Ok(DiagonalTotals {
        errors,
        reversals: reversals(zone, readings),
        estimates,
    })
}

/// Forward less backward, the mean over the stops of each diagonal that were reached both ways.
fn reversals(zone: &WorkZone, readings: &[DiagonalReading]) -> BTreeMap<Diagonal, f64> {
    let mut pairs: BTreeMap<_, [Option<f64>; 2]> = BTreeMap::new();
    for r in readings {
        if zone.is_stop(r.diagonal, Sequence::Together, r.at) {
            let pair = pairs.entry((r.run(), r.at)).or_default();
            pair[usize::from(r.travel == Travel::Backward)] = Some(r.value);
        }
    }
    let mut means: BTreeMap<Diagonal, (f64, f64)> = BTreeMap::new();
    for (((diagonal, ..), _), pair) in pairs {
        if let [Some(forward), Some(backward)] = pair {
            let mean = means.entry(diagonal).or_default();
            mean.0 += forward - backward;
            mean.1 += 1.0;
        }
    }
    means
        .into_iter()
        .map(|(diagonal, (sum, count))| (diagonal, sum / count))
        .collect()
}
