//! The tables beside the report.

use errsep_models::diagonal::StepDiagonalFit;

use super::Found;
use crate::io::CsvTable;

pub(super) fn components(fit: &StepDiagonalFit) -> CsvTable {
    let (mut names, mut positions, mut values, mut stds, mut units) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let reversals = fit.reversals.iter().map(|c| (c, " reversal"));
    for (c, note) in fit.components.iter().map(|c| (c, "")).chain(reversals) {
        for (k, (position, value)) in c.positions.iter().zip(&c.values).enumerate() {
            names.push(format!("{}{note}", c.component.name()));
            positions.push(*position);
            values.push(*value);
            stds.push(c.std.get(k).copied().unwrap_or(f64::NAN));
            units.push(if c.component.rotation { "rad" } else { "um" }.to_owned());
        }
    }
    CsvTable::new("components.csv")
        .texts("component", names)
        .numbers("position_mm", positions)
        .numbers("value", values)
        .numbers("std", stds)
        .texts("unit", units)
}

pub(super) fn residuals(found: &Found) -> CsvTable {
    let readings = &found.readings;
    let position = |a: usize| -> Vec<f64> {
        readings
            .iter()
            .map(|r| found.zone.position(r.at)[a])
            .collect()
    };
    CsvTable::new("residuals.csv")
        .texts(
            "diagonal",
            readings
                .iter()
                .map(|r| r.diagonal.name().to_owned())
                .collect::<Vec<_>>(),
        )
        .texts(
            "sequence",
            readings
                .iter()
                .map(|r| r.sequence.name().to_owned())
                .collect::<Vec<_>>(),
        )
        .texts(
            "direction",
            readings
                .iter()
                .map(|r| r.travel.name().to_owned())
                .collect::<Vec<_>>(),
        )
        .numbers("x_mm", position(0))
        .numbers("y_mm", position(1))
        .numbers("z_mm", position(2))
        .numbers(
            "reading_um",
            readings.iter().map(|r| r.value).collect::<Vec<_>>(),
        )
        .numbers("residual_um", found.fit.residuals.clone())
}
