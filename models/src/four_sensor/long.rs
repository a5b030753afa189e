//! The direct fit of long records, through the band: the same unknowns, penalty and frame as
//! [`Separator`](super::Separator), at a cost linear in the number of points.

use errsep_solvers::regularization::{BandedSystem, Combination};
use nalgebra::{DMatrix, DVector, Vector2, Vector4};

use super::frame::Frame;
use super::gauge::conditions;
use super::separation::degrees_of_freedom;
use super::{
    FourSensorError, Geometry, Line, Outputs, Parabola, Penalised, Profile, Separation, Settings,
    choice, direct,
};

/// The banded system of outputs: two rows a slide position over s2 + s3 + s4 + 1 neighbours and the
/// two slide-free combinations of e, with the three conditions that settle line and parabola.
///
/// # Errors
/// The penalty is wider than the sensors reach, or acts on differences of a surface counted from its
/// least-squares line.
pub fn banded_system(
    outputs: &Outputs,
    penalised: Penalised,
    line: Line,
) -> Result<BandedSystem, FourSensorError> {
    let geometry = outputs.geometry();
    let [.., reach] = geometry.offsets();
    let mut system = BandedSystem::new(
        geometry.point_count(),
        reach + 1,
        direct::ZERO_UNKNOWNS,
        &penalised.penalty(),
    )?;
    let rows = row_patterns(geometry);
    // Differences do not see a constant or a line, and neither do the outputs: the ends are held.
    let ends_held = penalised != Penalised::Profile;
    if ends_held {
        if line != Line::EndPoints {
            return Err(FourSensorError::LineOfLongRecord);
        }
        system.hold(0)?;
    }
    for (n, readings) in outputs.readings().iter().enumerate() {
        let combined = geometry.slide_free().transpose() * Vector4::from(*readings);
        for (combination, (band, border)) in rows.iter().enumerate() {
            system.push(n, band, border, combined[combination])?;
        }
    }
    if ends_held {
        system.hold(geometry.point_count() - 1)?;
    }
    let settled = if ends_held { 2 } else { 0 };
    for condition in conditions(geometry, line).column_iter().skip(settled) {
        system.require(condition.iter().copied().collect())?;
    }
    Ok(system)
}

/// Band and border values of the two rows of any slide position.
fn row_patterns(geometry: &Geometry) -> [(Vec<f64>, [f64; 2]); 2] {
    let free = geometry.slide_free();
    let offsets = geometry.offsets();
    std::array::from_fn(|combination| {
        let mut band = vec![0.0; offsets[3] + 1];
        for (sensor, offset) in offsets.into_iter().enumerate() {
            band[offset] = free[(sensor, combination)];
        }
        let mut border = [0.0; 2];
        border[combination] = 1.0;
        (band, border)
    })
}

/// Separates long records.
///
/// # Errors
/// The parabola comes from the zero-adjustments or the slope of the tilt, whose uncertainty is not
/// local; otherwise as [`Separator::separate`](super::Separator::separate).
pub fn separate_long(
    outputs: &Outputs,
    penalised: Penalised,
    line: Line,
    settings: &Settings,
) -> Result<Separation, FourSensorError> {
    if matches!(
        settings.parabola,
        Parabola::ZeroAdjustment(_) | Parabola::TiltSlope(_)
    ) {
        return Err(FourSensorError::ParabolaOfLongRecord);
    }
    let system = banded_system(outputs, penalised, line)?;
    let chosen = choice::choose(&system, settings.choice, settings.noise)?;
    let factored = system.factor(chosen.point.lambda)?;
    let rows = 2 * outputs.readings().len();
    let noise = match (settings.noise, chosen.point.noise_estimate(rows)) {
        (Some(noise), _) | (None, Some(noise)) => noise,
        (None, None) => return Err(FourSensorError::NoNoise),
    };
    let frame = Frame::new(outputs, line, settings.parabola);
    let settled = frame.settle(&DVector::from_column_slice(factored.solution()));
    let bias = frame.change(&DVector::from_vec(factored.bias_estimate()));

    let combinations = combinations(outputs.geometry());
    let (variances, pulls) = factored.variances(&combinations)?;
    let own = frame.own_variances();
    let std = (variances + own).map(|variance| noise * variance.max(0.0).sqrt());
    let bound = pulls * chosen.point.seminorm;
    let points = settled.surface.len();
    let count = settled.tilt.len();
    let profile = |values: DVector<f64>, bias: DVector<f64>, from: usize| Profile {
        std: std.rows(from, values.len()).into_owned(),
        bias_bound: bound.rows(from, values.len()).into_owned(),
        bias,
        values,
    };
    Ok(Separation {
        residuals: frame.residuals(&settled),
        zero_adjustment: settled.zero_adjustment.into(),
        curvature: settled.curvature,
        surface: profile(settled.surface, bias.surface, 0),
        straightness: profile(settled.straightness, bias.straightness, points),
        tilt: profile(settled.tilt, bias.tilt, points + count),
        noise,
        noise_estimated: settings.noise.is_none(),
        degrees_of_freedom: degrees_of_freedom(settings, &chosen, rows),
        chosen,
    })
}

/// f at each point, then S and γ at each slide position, as combinations of the unknowns. Under the
/// conditions line and parabola are settled already, so each is local.
fn combinations(geometry: &Geometry) -> Vec<Combination> {
    let offsets = geometry.offsets();
    let width = offsets[3] + 1;
    let slide = direct::slide_of(geometry);
    let zeros = DMatrix::from_fn(4, 2, |sensor, combination| {
        let mut unit = Vector2::zeros();
        unit[combination] = 1.0;
        direct::zero_adjustments(geometry, unit)[sensor]
    });
    let of_surface = (0..geometry.point_count()).map(|n| Combination {
        first: n,
        band: vec![1.0],
        border: vec![0.0; 2],
    });
    let of_slide = (0..2).flat_map(|row| {
        let mut band = vec![0.0; width];
        let mut border = vec![0.0; 2];
        for (sensor, offset) in offsets.into_iter().enumerate() {
            band[offset] -= slide[(row, sensor)];
            for (combination, border) in border.iter_mut().enumerate() {
                *border -= slide[(row, sensor)] * zeros[(sensor, combination)];
            }
        }
        (0..geometry.output_count()).map(move |n| Combination {
            first: n,
            band: band.clone(),
            border: border.clone(),
        })
    });
    of_surface.chain(of_slide).collect()
}
