//! What the page shows of a run.

use std::f64::consts::TAU;

use super::told::Told;
use crate::diagnosis::Kind;
use crate::report::turning_bar as sheet;

/// µrad in a rad.
const URAD: f64 = 1e6;
/// Points of a section.
const AROUND: usize = 181;
pub(super) fn view(data: String, all: &Told) -> sheet::View {
    let weighed = all.weighed;
    let wide = all.half_interval();
    let named = !std::ptr::eq(all.chosen, &all.analysis.steady);
    let mut answers = vec![(
        all.combination.clone(),
        URAD * all.slope.1.value,
        URAD * all.slope.1.std,
        "µrad".to_owned(),
        "slide against spindle axis and half cone of the bar, together".to_owned(),
    )];
    if let Some(speed) = &all.speed {
        let speed = all.per_minute(&[speed.value, speed.std]);
        answers.push((
            "mean speed".to_owned(),
            speed[0],
            speed[1],
            all.speed_unit().to_owned(),
            format!("{:.1} turns in all", all.survey.turns),
        ));
    }
    if let Some(bar) = &all.bar {
        answers.push((
            "e".to_owned(),
            bar.eccentricity_um.value,
            bar.eccentricity_um.std,
            "µm".to_owned(),
            "eccentricity of the bar at mid travel".to_owned(),
        ));
        answers.push((
            "|γ|".to_owned(),
            URAD * bar.inclination_rad.value,
            URAD * bar.inclination_rad.std,
            "µrad".to_owned(),
            "bar against spindle axis".to_owned(),
        ));
    }
    sheet::View {
        data,
        good: weighed.kind != Kind::Unknown,
        statement: all.statement(),
        answers,
        rms: (all.analysis.steady.fit.rms(), all.chosen.fit.rms()),
        residuals: (
            all.run.x.clone(),
            all.analysis.steady.fit.residuals.clone(),
            if named {
                all.chosen.fit.residuals.clone()
            } else {
                Vec::new()
            },
        ),
        turn: turn(all),
        axis: (
            match all.axis.is_empty() {
                true => Vec::new(),
                false => all.places.clone(),
            },
            all.axis.iter().map(|a| a.0).collect(),
            all.axis.iter().map(|a| a.1).collect(),
        ),
        sections: sections(all),
        form: (
            all.places.clone(),
            all.form.iter().map(|f| f.value).collect(),
            all.form.iter().map(|f| wide * f.std).collect(),
        ),
        rivals: weighed
            .weights
            .iter()
            .map(|w| {
                let name = w.effect.to_owned();
                (
                    name,
                    w.evidence,
                    w.explained,
                    w.p_value,
                    w.left.rms,
                    w.held_out,
                )
            })
            .collect(),
        not_told: all.not_told(),
        remains: all.remains(),
    }
}

fn turn(all: &Told) -> Option<sheet::Turn> {
    let curve = all.curve.as_ref()?;
    let (quantity, unit) = all.clock();
    let degrees = |all: &[f64], factor: f64| -> Vec<f64> {
        all.iter().map(|v| factor * v.to_degrees()).collect()
    };
    Some(sheet::Turn {
        clock: (quantity.to_owned(), unit.to_owned()),
        time: curve.time.clone(),
        lag: degrees(&curve.lag_rad, 1.0),
        half: degrees(&curve.lag_std, all.half_interval()),
        speed: all.per_minute(&curve.speed),
        speed_unit: all.speed_unit().to_owned(),
        mean: all.per_minute(&[all.speed?.value])[0],
        greatest: curve.greatest,
    })
}

/// The section at both ends and in the middle.
fn sections(all: &Told) -> Vec<(String, Vec<f64>, Vec<f64>)> {
    if all.harmonics.is_empty() {
        return Vec::new();
    }
    let (low, high) = all.run.range();
    let places = [(low, -1.0), (f64::midpoint(low, high), 0.0), (high, 1.0)];
    places
        .into_iter()
        .map(|(x, xi)| {
            let angle: Vec<f64> = (0..AROUND)
                .map(|k| TAU * k as f64 / (AROUND - 1) as f64)
                .collect();
            let value = angle
                .iter()
                .map(|a| {
                    let of = all.harmonics.iter().map(|h| {
                        let here = h.middle + h.change * xi;
                        let (s, c) = (h.k as f64 * a).sin_cos();
                        here.re * c + here.im * s
                    });
                    of.sum()
                })
                .collect();
            (format!("x = {x:.0} mm"), angle, value)
        })
        .collect()
}
