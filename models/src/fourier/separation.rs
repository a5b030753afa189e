//! The profile from the difference signals: one spacing, the best spacing of each order, or all
//! spacings by least squares.

use super::along::Along;
use super::beyond::beyond_orders;
use super::estimate::{Joined, Taken};
use super::joint::{Compensation, Joint, ShiftTerm, step_terms};
use super::noise::{Estimates, NoiseSource};
use super::repeatability::repeatability;
use super::result::{Combination, JointStep, OrderResidual, OrderResult, Separation};
use super::scan::{FourierError, Scan, Section};
use super::width::Errors;
use crate::uncertainty::{DegreesOfFreedom, Disagreement};

/// A form beyond the orders below this share of the difference signal is rounding.
const EXACT: f64 = 1e-9;

/// Separates the workpiece from the slide.
///
/// `noise` is the standard deviation of one reading in µm where it is known.
///
/// # Errors
/// Those of [`step_terms`], [`FourierError::NoScan`], [`FourierError::Noise`],
/// [`FourierError::NoiseUnknown`] and [`FourierError::StepNotSeen`].
pub fn separate(
    scans: &[Scan],
    section: Section,
    compensation: Compensation,
    combination: Combination,
    noise: Option<f64>,
) -> Result<Separation, FourierError> {
    if let Some(value) = noise.filter(|v| !(*v > 0.0 && v.is_finite())) {
        return Err(FourierError::Noise { value });
    }
    let joined = Joined::new(scans, section)?;
    let found = Estimates::new(&joined.groups, &joined.spectra, section.orders);
    let (sigma, source, degrees_of_freedom) = match noise {
        Some(sigma) => (sigma, NoiseSource::Given, DegreesOfFreedom::Infinite),
        None => found.best().ok_or(FourierError::NoiseUnknown {
            orders: section.orders,
        })?,
    };
    let fitted = joined.fitted(section, combination);
    let beyond_orders = fitted
        .as_ref()
        .and_then(|steps| {
            beyond_orders(
                &joined.groups,
                &steps.values,
                section.orders,
                sigma,
                source,
                degrees_of_freedom,
            )
        })
        .filter(|found| found.rms > EXACT * joined.size());
    // A fitted step presumes that there is no finer form; the readings at the joint do not.
    let chord = terms(scans, section, Compensation::Chord);
    let used = match (compensation, &chord) {
        (Compensation::Fitted, Ok(_)) if beyond_orders.is_some() => Compensation::Chord,
        _ => compensation,
    };
    let taken = match used {
        Compensation::Fitted => Taken::Fitted(fitted.clone().ok_or(FourierError::StepNotSeen {
            orders: section.orders,
        })?),
        _ => Taken::Readings(terms(scans, section, used)?),
    };
    let mut profiled = joined.profile(section, combination, &taken);
    let along = Along::of(&joined.groups, &joined.joints, section.length)
        .filter(|_| source == NoiseSource::Repeats);
    let of_step = joined.steps_under(along.as_ref(), &taken);
    if let Some(along) = &along {
        profiled.spread.under(along, of_step);
    }
    let degrees_of_freedom = match &along {
        Some(along) if along.freedom < degrees_of_freedom.as_f64() => {
            DegreesOfFreedom::Finite(along.freedom)
        }
        _ => degrees_of_freedom,
    };
    let mut orders = profiled.orders;
    for (place, order) in orders.iter_mut().enumerate() {
        let parts = profiled.spread.order(place);
        order.real_std = sigma * parts.real.sqrt();
        order.imaginary_std = sigma * parts.imaginary.sqrt();
        order.covariance = sigma * sigma * parts.covariance;
    }
    let steps = match (used, &fitted) {
        (Compensation::Chord, _) | (_, None) => joined.steps_of_readings(chord.as_deref()),
        (_, Some(fitted)) => joined.steps_of_fit(fitted),
    };
    let samples = joined.samples;
    let scaled = |unit: Vec<f64>| -> Vec<f64> { unit.into_iter().map(|u| sigma * u).collect() };
    let (workpiece_std, straightness_std) = profiled.spread.profiles(samples);
    let workpiece = profiled.workpiece;
    let x: Vec<f64> = (0..samples)
        .map(|i| section.length * i as f64 / samples as f64)
        .collect();
    let errors = Errors {
        spread: profiled.spread,
        through_first: profiled.through_first,
        scans: same_length(&joined.joints, samples).count(),
        weights: weights(&joined.joints, samples),
        first: first_scatter(&joined.joints, samples).map_or(1.0, |s| s / sigma),
        along,
    };
    let straightness_std = scaled(straightness_std);
    let rise = mean(joined.joints.iter().filter_map(|j| j.rise));
    Ok(Separation {
        combination,
        compensation: used,
        straightness: straightness(&x, &workpiece),
        x,
        slide: slide_of(&joined.joints, &workpiece),
        slide_std: errors.slide_std(sigma, &straightness_std),
        workpiece,
        workpiece_std: scaled(workpiece_std),
        straightness_std,
        lost: orders.iter().filter(|o| o.lost).map(|o| o.order).collect(),
        residuals: residuals_of(scans, &joined, &profiled.taken, &orders, sigma),
        height_difference: mean(steps.iter().map(|s| s.value))
            .zip(rise)
            .map(|(s, r)| s - r),
        rise,
        steps: steps
            .into_iter()
            .map(|step| JointStep {
                std: sigma * of_step.sqrt() * step.std,
                ..step
            })
            .collect(),
        repeatability: repeats(scans, section, used, combination)?,
        orders,
        errors,
        noise: (sigma, source),
        first_scatter: first_scatter(&joined.joints, samples),
        degrees_of_freedom,
        beyond_orders,
        disagreement: found.apart_from(source).and_then(|scatter| {
            Disagreement::of(scatter.squares, scatter.freedom, sigma, degrees_of_freedom)
        }),
    })
}

/// The readings whose weighted sum is the step of each scan.
fn terms(
    scans: &[Scan],
    section: Section,
    compensation: Compensation,
) -> Result<Vec<Vec<ShiftTerm>>, FourierError> {
    scans
        .iter()
        .map(|scan| step_terms(scan, section, compensation))
        .collect()
}

/// The scans that have as many readings on the section as the profile.
fn same_length(joints: &[Joint], samples: usize) -> impl Iterator<Item = &Joint> {
    joints.iter().filter(move |j| j.first.len() == samples)
}

/// By how much a reading of P1 differs from scan to scan, µm, each scan about its height: P1 passes the same
/// places of workpiece and slide whatever the spacing. None with one scan.
fn first_scatter(joints: &[Joint], samples: usize) -> Option<f64> {
    let scans: Vec<&[f64]> = same_length(joints, samples).map(|j| &j.first[..]).collect();
    let n = samples as f64;
    let filled = same_length(joints, samples).map(|j| j.first_filled.len());
    let freedom = scans.len().checked_sub(1)? * samples.checked_sub(1)?;
    let freedom = freedom.saturating_sub(filled.sum()) as f64;
    let heights: Vec<f64> = scans.iter().map(|s| s.iter().sum::<f64>() / n).collect();
    let squares: f64 = (0..samples)
        .map(|k| {
            let left = || {
                scans
                    .iter()
                    .zip(&heights)
                    .map(|(scan, height)| scan[k] - height)
            };
            let mean = left().sum::<f64>() / scans.len() as f64;
            left().map(|v| (v - mean).powi(2)).sum::<f64>()
        })
        .sum();
    (freedom > 0.0 && squares > 0.0).then(|| (squares / freedom).sqrt())
}

/// Variance of the mean of P1 at each position over that where all scans have it.
fn weights(joints: &[Joint], samples: usize) -> Vec<f64> {
    let scans = same_length(joints, samples).count() as f64;
    let mut read = vec![scans; samples];
    for k in same_length(joints, samples).flat_map(|j| &j.first_filled) {
        if let Some(read) = read.get_mut(*k) {
            *read -= 1.0;
        }
    }
    read.into_iter().map(|n| scans / n.max(1.0)).collect()
}

fn slide_of(joints: &[Joint], workpiece: &[f64]) -> Vec<f64> {
    let same: Vec<&Joint> = same_length(joints, workpiece.len()).collect();
    let mut slide: Vec<f64> = workpiece
        .iter()
        .enumerate()
        .map(|(k, w)| same.iter().map(|j| j.first[k]).sum::<f64>() / same.len() as f64 - w)
        .collect();
    let level = slide.iter().sum::<f64>() / slide.len().max(1) as f64;
    for s in &mut slide {
        *s -= level;
    }
    slide
}

fn residuals_of(
    scans: &[Scan],
    joined: &Joined,
    taken: &[f64],
    orders: &[OrderResult],
    sigma: f64,
) -> Vec<OrderResidual> {
    if scans.len() < 2 || sigma <= 0.0 {
        return Vec::new();
    }
    let mut residuals = Vec::new();
    for (g, &step) in joined.groups.iter().zip(taken) {
        let std = sigma / (g.samples as f64).sqrt();
        for &i in &g.scans {
            let (Some(scan), Some(spectrum)) = (scans.get(i), joined.spectra.get(i)) else {
                continue;
            };
            for o in orders.iter().filter(|o| !o.lost) {
                let (Some(m), Some(h), Some(t)) = (
                    spectrum.get(o.order),
                    g.step.get(o.order),
                    g.transfer.get(o.order),
                ) else {
                    continue;
                };
                residuals.push(OrderResidual {
                    scan: i,
                    spacing: scan.spacing,
                    repeat: scan.repeat,
                    order: o.order,
                    value: (m - step * h - t * o.coefficient) / std,
                    sensitivity: -t / std,
                });
            }
        }
    }
    residuals
}

pub(super) fn spacings(scans: &[Scan]) -> Vec<f64> {
    let mut found: Vec<f64> = Vec::new();
    for scan in scans {
        if !found.contains(&scan.spacing) {
            found.push(scan.spacing);
        }
    }
    found
}

/// U_sp over repeats that each have every spacing.
fn repeats(
    scans: &[Scan],
    section: Section,
    compensation: Compensation,
    combination: Combination,
) -> Result<Option<f64>, FourierError> {
    let mut numbers: Vec<u32> = scans.iter().map(|s| s.repeat).collect();
    numbers.sort_unstable();
    numbers.dedup();
    if numbers.len() < 2 {
        return Ok(None);
    }
    let all = spacings(scans).len();
    let mut profiles = Vec::new();
    for number in numbers {
        let own: Vec<Scan> = scans
            .iter()
            .filter(|s| s.repeat == number)
            .cloned()
            .collect();
        if spacings(&own).len() == all {
            let joined = Joined::new(&own, section)?;
            let taken = match compensation {
                Compensation::Fitted => Taken::Fitted(joined.fitted(section, combination).ok_or(
                    FourierError::StepNotSeen {
                        orders: section.orders,
                    },
                )?),
                _ => Taken::Readings(terms(&own, section, compensation)?),
            };
            profiles.push(joined.profile(section, combination, &taken).workpiece);
        }
    }
    Ok(repeatability(&profiles))
}

/// The profile without its least-squares line: what is called straightness.
pub fn straightness(x: &[f64], profile: &[f64]) -> Vec<f64> {
    let n = x.len().min(profile.len()).max(1) as f64;
    let centre = x.iter().sum::<f64>() / n;
    let level = profile.iter().sum::<f64>() / n;
    let (mut sxx, mut sxy) = (0.0, 0.0);
    for (a, b) in x.iter().zip(profile) {
        sxx += (a - centre).powi(2);
        sxy += (a - centre) * (b - level);
    }
    let slope = if sxx > 0.0 { sxy / sxx } else { 0.0 };
    x.iter()
        .zip(profile)
        .map(|(a, b)| b - level - slope * (a - centre))
        .collect()
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(s, n), v| (s + v, n + 1));
    (count > 0).then(|| sum / f64::from(count))
}
