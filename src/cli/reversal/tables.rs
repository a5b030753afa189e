//! The profiles and residuals as CSV.

use errsep_models::reversal::Channel;

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
        let rows = &o.residuals;
        let channels = rows.iter().map(|r| r.channel.index() as u8);
        let repeats = rows.iter().map(|r| f64::from(r.repeat));
        let directions = rows.iter().map(|r| u8::from(r.backward));
        tables.push(
            CsvTable::new("residuals.csv")
                .words(
                    "channel",
                    Channel::ALL.map(Channel::name),
                    channels.collect::<Vec<_>>(),
                )
                .numbers("repeat", repeats.collect::<Vec<_>>())
                .words(
                    "direction",
                    ["forward", "backward"],
                    directions.collect::<Vec<_>>(),
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
