//! The report of a four-sensor separation.

use std::path::Path;

use errsep_models::four_sensor::Profile;
use errsep_models::uncertainty::coverage_factor;
use errsep_solvers::regularization::Point;
use nalgebra::DVector;

use super::Found;
use super::json::residual_rms;
use super::words::{
    ENDS_OFF, ZONE_NOTE, counted_from_ends, ends, excess, noise_source, not_determined, refuted,
    span, status, straightness, uneven,
};
use crate::cli::quantity::COVERAGE;
use crate::io::Message;
use crate::io::units::URAD_PER_RAD;
use crate::report::plot::{Axis, Chart, Mark, Series};
use crate::report::{Cell, Figure, KeyFigure, Page, Section, Standing, Table};

pub(super) fn page(found: &Found, data: &Path) -> Result<Page, Message> {
    let s = &found.separation;
    let summary = format!(
        "The slide is straight to {}; it tilts by {:.1} µrad over its travel.",
        straightness(found)?,
        URAD_PER_RAD * span(&s.tilt.values)
    );
    let doubtful = s.chosen.instead.is_some()
        || s.scatter.is_uneven()
        || s.excess.is_some()
        || refuted(found).is_some()
        || (counted_from_ends(found).is_some()
            && found.ends.is_some_and(|e| e.contradict(ENDS_OFF)));
    let standing = if doubtful || found.parabola_is_open() {
        Standing::Caution
    } else {
        Standing::Good
    };
    Ok(Page::new(
        "Four-sensor straightness and tilt",
        data.display().to_string(),
    )
    .summary(standing, summary)
    .section(result(found))
    .section(Section::new("What these outputs do not determine").list(not_determined(found)))
    .section(regularization(found))
    .section(residuals(found)))
}

fn result(found: &Found) -> Section {
    let s = &found.separation;
    let slide = found.measured.outputs.slide_positions();
    let surface = found.measured.outputs.surface_positions();
    let mut straightness = Chart::new(axis_x(), Axis::new("straightness S", "µm")).series(curve(
        "direct fit",
        &s.straightness,
        &slide,
        1.0,
        found,
    ));
    let mut tilt = Chart::new(axis_x(), Axis::new("tilt γ less its mean", "µrad")).series(curve(
        "direct fit",
        &centred(&s.tilt),
        &slide,
        URAD_PER_RAD,
        found,
    ));
    if let Some(published) = &found.published {
        let name = "as published";
        straightness = straightness.series(Series::line(
            name,
            slide.clone(),
            published.straightness.as_slice().to_vec(),
        ));
        let mean = published.tilt.mean();
        let shown = published
            .tilt
            .iter()
            .map(|g| URAD_PER_RAD * (g - mean))
            .collect();
        tilt = tilt.series(Series::line(name, slide.clone(), shown));
    }
    refuted(found)
        .into_iter()
        .fold(Section::new("Result"), Section::warning)
        .key_figures([
            KeyFigure::new("Straightness", found.straightness_error.value, "µm")
                .meaning("minimum zone of S"),
            KeyFigure::new("Tilt", URAD_PER_RAD * span(&s.tilt.values), "µrad")
                .meaning("peak to valley"),
            KeyFigure::new("Noise", s.noise, "µm").meaning(noise_source(found)),
        ])
        .paragraph(format!("Of the straightness: {ZONE_NOTE}."))
        .figure(Figure::new(
            "Straightness of the slide",
            "With the expanded uncertainty (95 %) as a band: of the readings' noise and of the penalty's \
             pull. The direct fit and the published way may differ by a line and a parabola.",
            straightness,
        ))
        .figure(Figure::new(
            "Tilt of the slide",
            "Its slope over the travel goes with the parabola. Towards the end sensor 4 stands over \
             surface that no other sensor sees, and the band opens.",
            tilt,
        ))
        .figure(Figure::new(
            "Surface",
            "The reference surface as the sensors found it.",
            Chart::new(axis_x(), Axis::new("surface f", "µm"))
                .series(curve("f", &s.surface, &surface, 1.0, found)),
        ))
}

fn regularization(found: &Found) -> Section {
    let chosen = &found.separation.chosen;
    let points = &chosen.curve.points;
    let column = |value: fn(&Point) -> f64| -> Vec<f64> { points.iter().map(value).collect() };
    let chart = Chart::new(
        Axis::new("residual norm ‖Ax − b‖", "µm").log(),
        Axis::new("norm of the penalised ‖Lf‖", "µm").log(),
    )
    .series(
        Series::line(
            "L-curve",
            column(|p| p.residual_norm),
            column(|p| p.seminorm),
        )
        .extra("λ", column(|p| p.lambda)),
    )
    .series(
        Series::points(
            "taken",
            vec![chosen.point.residual_norm],
            vec![chosen.point.seminorm],
        )
        .mark(Mark::Ring),
    )
    .annotate(
        chosen.point.residual_norm,
        chosen.point.seminorm,
        format!("λ = {:.2e}", chosen.point.lambda),
    );
    let mut table = Table::new("λ by each rule", ["rule", "λ", "remark"]).row([
        "L-curve".into(),
        chosen.curve.lambda().map_or(Cell::Empty, Cell::number),
        status(chosen.curve.status).into(),
    ]);
    table = table.row([
        "generalized cross-validation".into(),
        chosen.gcv.into(),
        "".into(),
    ]);
    if let Some(discrepancy) = &chosen.discrepancy {
        table = table.row([
            "discrepancy principle".into(),
            discrepancy.lambda().map_or(Cell::Empty, Cell::number),
            super::words::discrepancy_key(discrepancy).into(),
        ]);
    }
    let s = &found.separation.straightness;
    let mut section = Section::new("Regularization")
        .figure(Figure::new(
            "L-curve",
            "From right to left the penalty weakens. At the corner the residuals no longer fall and \
             noise begins to enter the surface.",
            chart,
        ))
        .table(table)
        .paragraph(format!(
            "The penalty pulls S by up to {:.3} µm if the truth is the estimate, and by at most \
             {:.3} µm for any surface of the same size. In the uncertainty bands is the pull that is to \
             be expected of a surface that scatters by {:.3} µm, as these outputs show it.",
            s.bias.amax(),
            s.bias_bound.amax(),
            found.separation.scatter.held_back
        ));
    if let Some(ends) = ends(found) {
        section = section.paragraph(format!("Ends of the surface: {ends}."));
    }
    if let Some(note) = counted_from_ends(found) {
        section = section.warning(format!("About this penalty: {note}."));
    }
    if let Some(warning) = excess(found) {
        section = section.warning(format!("Noise: {warning}."));
    }
    if let Some(warning) = uneven(found) {
        section = section.warning(warning);
    }
    if let Some(reason) = chosen.instead {
        section = section.warning(format!(
            "{reason}; λ was taken from {} instead.",
            chosen.rule
        ));
    }
    section
}

fn residuals(found: &Found) -> Section {
    let rows = &found.separation.residuals;
    let slide = found.measured.outputs.slide_positions();
    let chart = (0..4).fold(
        Chart::new(axis_x(), Axis::new("output less model", "µm")),
        |chart, sensor| {
            chart.series(Series::points(
                format!("sensor {}", sensor + 1),
                slide.clone(),
                rows.iter().map(|row| row[sensor]).collect(),
            ))
        },
    );
    Section::new("Residuals")
        .paragraph(format!("Root mean square {:.4} µm.", residual_rms(rows)))
        .figure(Figure::new(
            "What the model leaves of the outputs",
            "Patterns here are errors that surface, straightness, tilt and zero cannot explain.",
            chart,
        ))
}

fn axis_x() -> Axis {
    Axis::new("position x", "mm")
}

fn curve(name: &str, profile: &Profile, x: &[f64], scale: f64, found: &Found) -> Series {
    // Degrees of freedom are positive, so that they have a coverage factor.
    let k = coverage_factor(COVERAGE, found.coverage_degrees()).unwrap_or(f64::NAN);
    let scaled = |values: &DVector<f64>, by: f64| values.iter().map(|v| by * v).collect::<Vec<_>>();
    Series::line(name, x.to_vec(), scaled(&profile.values, scale))
        .half_band(scaled(&profile.std, k * scale))
}

fn centred(profile: &Profile) -> Profile {
    let mut centred = profile.clone();
    centred.values.add_scalar_mut(-profile.values.mean());
    centred
}
