//! The values of a chart as the script of the page reads them.

use super::canvas::pointed;
use super::chart::{Axis, Chart};
use super::draw_chart::{Layout, tone};
use super::scale::Scale;
use serde_json::json;

/// What the pointer shows: the kept points, with columns of x shared between series.
pub(super) fn values(chart: &Chart, layout: &Layout, kept: &[Vec<usize>]) -> serde_json::Value {
    let mut grids: Vec<Vec<serde_json::Value>> = Vec::new();
    let mut sorted = true;
    let series: Vec<serde_json::Value> = chart
        .series
        .iter()
        .zip(kept)
        .enumerate()
        .map(|(index, (series, kept))| {
            let pick = |values: &[f64]| -> Vec<serde_json::Value> {
                kept.iter()
                    .map(|k| {
                        values
                            .get(*k)
                            .copied()
                            .map_or(serde_json::Value::Null, pointed)
                    })
                    .collect()
            };
            sorted &= kept
                .windows(2)
                .all(|w| series.x.get(w[0]) <= series.x.get(w[1]));
            let x = pick(&series.x);
            let grid = grids.iter().position(|g| *g == x).unwrap_or_else(|| {
                grids.push(x);
                grids.len() - 1
            });
            let mut entry = json!({
                "name": series.name,
                "tone": tone(series, index),
                "grid": grid,
                "y": pick(&series.y),
            });
            if let Some(band) = &series.band {
                entry["band"] = json!(band.name);
                entry["lower"] = pick(&band.lower).into();
                entry["upper"] = pick(&band.upper).into();
            }
            if let Some(extra) = &series.extra {
                entry["extra"] = json!({ "name": extra.name, "values": pick(&extra.values) });
            }
            entry
        })
        .collect();
    let area = layout.area;
    let axis = |scale: &Scale, axis: &Axis| {
        let (low, high) = scale.bounds();
        json!({ "low": low, "high": high, "log": scale.is_log(),
            "name": axis.quantity, "unit": axis.unit })
    };
    json!({
        "kind": "xy",
        "area": [pointed(area.left), pointed(area.top), pointed(area.width), pointed(area.height)],
        "x": axis(&layout.x, &chart.x),
        "y": axis(&layout.y, &chart.y),
        "nearest": if sorted { "x" } else { "point" },
        "grids": grids,
        "series": series,
    })
}
