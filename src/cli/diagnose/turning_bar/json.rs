//! The answer for programs: `errsep.diagnosis/1` with the table `turning`.

use errsep_models::reversal::turning_bar::Told as Value;
use serde_json::{Value as Json, json};

use super::told::Told;
use crate::diagnosis::{Kind, Size};

fn told(value: &Value, unit: &str) -> Json {
    json!({"value": value.value, "std": value.std, "unit": unit})
}

fn size(size: &Size) -> Json {
    json!({"rms": size.rms, "ci95": size.ci95})
}

pub(super) fn json(all: &Told) -> Json {
    let weighed = all.weighed;
    let shrink = |before: f64, after: f64| {
        if before > 0.0 {
            1.0 - after / before
        } else {
            0.0
        }
    };
    let held = all
        .analysis
        .steady
        .held_out
        .zip(all.chosen.held_out)
        .map(|(before, after)| {
            json!({"before": before, "after": after, "shrink": shrink(before, after), "floor": weighed.noise})
        });
    let candidates: Vec<Json> = weighed
        .weights
        .iter()
        .map(|w| {
            json!({
                "effect": w.effect, "explained": w.explained, "p_value": w.p_value, "evidence": w.evidence,
                "adequacy": w.adequacy, "left": size(&w.left), "held_out": w.held_out,
                "in_set": weighed.effects.contains(&w.effect)
                    || weighed.indistinguishable.iter().flatten().any(|e| *e == w.effect),
            })
        })
        .collect();
    let law = &all.analysis.law;
    let (before, after) = (&all.slope.0, &all.slope.1);
    json!({
        "schema": "errsep.diagnosis/1",
        "model": "turning-bar",
        "verdict": {
            "kind": weighed.kind, "effects": weighed.effects,
            "indistinguishable": weighed.indistinguishable, "partial": weighed.partial,
            "statement": all.statement(), "p_value": weighed.p_value, "adequacy": weighed.adequacy,
        },
        "gap": {
            "unit": "um", "noise": weighed.noise, "before": size(&weighed.before),
            "after": size(&weighed.after), "shrink": shrink(weighed.before.rms, weighed.after.rms),
            "held_out": held,
        },
        "noise": {
            "white": law.white.sqrt(), "correlated": law.correlated.sqrt(), "length": law.length,
            "source": "neighbours", "factor": all.analysis.factor,
            "degrees_of_freedom": all.degrees_of_freedom(),
        },
        "where": places(all),
        "candidates": candidates,
        "bias": [{
            "quantity": all.combination, "before": before.value, "std": before.std, "after": after.value,
            "after_std": after.std, "moved": after.value - before.value, "unit": "rad",
        }],
        "notes": all.not_told().into_iter().chain(all.remains()).collect::<Vec<_>>(),
        "turning": turning(all),
    })
}

/// The turns in which most of the steady turn's gap lies.
fn places(all: &Told) -> Vec<Json> {
    if all.weighed.kind == Kind::None {
        return Vec::new();
    }
    let residuals = &all.analysis.steady.fit.residuals;
    let whole: f64 = residuals.iter().map(|r| r * r).sum();
    let tenth = residuals.len().div_ceil(10);
    residuals
        .chunks(tenth)
        .enumerate()
        .map(|(k, part)| {
            let (from, to) = (k * tenth, k * tenth + part.len() - 1);
            let share = part.iter().map(|r| r * r).sum::<f64>() / whole;
            json!({"axis": "x", "value": "", "from": all.run.x[from], "to": all.run.x[to], "unit": "mm", "share": share})
        })
        .collect()
}

fn turning(all: &Told) -> Json {
    let speed_unit = if all.run.timed { "Hz" } else { "1/reading" };
    let bar = all.bar.as_ref().map(|bar| {
        json!({
            "x": all.run.range().0.midpoint(all.run.range().1),
            "eccentricity": told(&bar.eccentricity_um, "um"),
            "gamma_along": told(&bar.along_rad, "rad"),
            "gamma_across": told(&bar.across_rad, "rad"),
            "across_sign_known": all.weighed.across_told, "across_seen": !all.chosen.fit.across_held,
            "inclination": told(&bar.inclination_rad, "rad"),
            "turned": told(&bar.turned_rad, "rad"),
        })
    });
    let curve = all.curve.as_ref().map(|curve| {
        let k = curve.greatest;
        json!({
            "time": curve.time, "x": curve.x, "lag": curve.lag_rad, "lag_std": curve.lag_std,
            "speed": curve.speed,
            "greatest": {"time": curve.time[k], "x": curve.x[k], "value": curve.lag_rad[k], "std": curve.lag_std[k], "unit": "rad"},
        })
    });
    let pairs = all.pairs.as_ref().map(|p| {
        json!({"amplitude": told(&p.amplitude_rad, "rad"), "of_oval": p.of_oval_rad, "oval": p.oval_um})
    });
    let harmonics: Vec<Json> = all
        .harmonics
        .iter()
        .map(|h| {
            json!({"k": h.k, "a": h.middle.re, "b": h.middle.im, "a_change": h.change.re, "b_change": h.change.im,
                "amplitude": h.middle.norm(), "std": h.std, "unit": "um"})
        })
        .collect();
    let setting = all.chosen.fit.setting();
    json!({
        "readings": all.run.len(), "turns": all.survey.turns,
        "angle": if all.run.angle.is_some() { "recorded" } else { "found" },
        "handed": if setting.handed > 0.0 { "ccw" } else { "cw" },
        "rms": {"before": all.analysis.steady.fit.rms(), "after": all.chosen.fit.rms(), "unit": "um"},
        "slope": {
            "combination": all.combination, "value": all.slope.1.value, "std": all.slope.1.std,
            "std_white": all.slope_std_white(), "unit": "rad",
        },
        "speed": all.speed.as_ref().map(|speed| told(speed, speed_unit)),
        "bar": bar,
        "axis": {"x": all.places, "e_1": all.axis.iter().map(|a| a.0).collect::<Vec<_>>(),
            "e_2": all.axis.iter().map(|a| a.1).collect::<Vec<_>>()},
        "form": {"x": all.places, "form": all.form.iter().map(|f| f.value).collect::<Vec<_>>(),
            "form_std": all.form.iter().map(|f| f.std).collect::<Vec<_>>()},
        "curve": curve,
        "harmonics": harmonics,
        "pairs": pairs,
        "cells": {"form": setting.form_cells, "turn": match setting.wave {
            errsep_models::reversal::turning_bar::Wave::Steady => None,
            errsep_models::reversal::turning_bar::Wave::Unsteady { cells }
            | errsep_models::reversal::turning_bar::Wave::Bent { cells } => Some(cells),
        }},
    })
}
