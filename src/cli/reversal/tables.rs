//! The profiles and residuals as CSV.

use super::outcome::Outcome;
use crate::io::CsvTable;

pub fn tables(o: &Outcome) -> Vec<CsvTable> {
    let profiles = o.forms.iter().fold(
        CsvTable::new("profiles.csv").numbers("x_mm", o.x.clone()),
        |table, form| {
            table
                .numbers(format!("{}_um", form.name), form.values.clone())
                .numbers(format!("{}_std_um", form.name), form.std.clone())
        },
    );
    let mut tables = vec![profiles];
    if let Some(closure) = &o.closure {
        tables.push(
            CsvTable::new("closure.csv")
                .numbers("x_mm", closure.x.clone())
                .numbers("closure_um", closure.profile.clone()),
        );
    }
    if !o.residuals.is_empty() {
        let of = |f: fn(&super::outcome::Residual) -> String| {
            o.residuals.iter().map(f).collect::<Vec<_>>()
        };
        tables.push(
            CsvTable::new("residuals.csv")
                .texts("channel", of(|r| r.channel.name().to_owned()))
                .texts("repeat", of(|r| r.repeat.to_string()))
                .texts(
                    "direction",
                    of(|r| if r.backward { "backward" } else { "forward" }.to_owned()),
                )
                .numbers("x_mm", o.residuals.iter().map(|r| r.x).collect::<Vec<_>>())
                .numbers(
                    "residual_um",
                    o.residuals.iter().map(|r| r.residual).collect::<Vec<_>>(),
                ),
        );
    }
    tables
}
