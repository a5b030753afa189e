//! Readings by position, sensor and repeat; what single repeats lack is filled in from the others.

use std::collections::{BTreeMap, BTreeSet};

use errsep_models::missing::{filled, heights};

use super::read::Reading;
use crate::io::{Message, TableReader};

/// The repeated readings of each sensor at one position.
pub(super) type Cell = [Vec<f64>; 4];

/// A reading that a repeat lacks and others have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::cli) struct Missing {
    /// Sensor, 1 to 4.
    pub sensor: usize,
    /// Slide position, mm.
    pub x: f64,
    /// Number of the repeat.
    pub repeat: u32,
}

/// Share of the readings of a repeat that may be missing.
const MOST_MISSING: f64 = 0.1;

/// Readings of each position and sensor, as many repeats everywhere.
pub(super) struct Gathered {
    pub cells: Vec<Cell>,
    pub repeats: usize,
    /// Of the averages, over that of an average of all repeats.
    pub variances: Vec<[f64; 4]>,
    pub missing: Vec<Missing>,
    /// Where what is missing would have to stand.
    pub lines: Vec<usize>,
}

pub(super) fn gather(
    table: &TableReader,
    readings: &[Reading],
    positions: &[f64],
    zeroed: bool,
) -> Result<Gathered, Message> {
    // Of each sensor a row a position, in it the readings by the number of their repeat.
    let mut sensors = [(); 4].map(|()| vec![BTreeMap::new(); positions.len()]);
    let mut lines = vec![0; positions.len()];
    let mut by_repeat: Vec<&Reading> = readings.iter().collect();
    by_repeat.sort_by_key(|r| r.repeat);
    for reading in by_repeat {
        let Ok(place) = positions.binary_search_by(|x| x.total_cmp(&reading.x)) else {
            continue;
        };
        lines[place] = reading.line;
        let own: &mut BTreeMap<u32, (f64, usize)> = &mut sensors[reading.sensor][place];
        let Some(value) = reading.value else { continue };
        if let Some((_, before)) = own.insert(reading.repeat, (value, reading.line)) {
            return Err(table
                .at_line(
                    reading.line,
                    format!(
                        "sensor {} at {} mm is given again, first on line {before}",
                        reading.sensor + 1,
                        reading.x
                    ),
                )
                .remedy("remove one of the two, or number repeats in a column `repeat`"));
        }
    }
    let counts = || sensors.iter().flatten().map(BTreeMap::len);
    let repeats = counts().max().unwrap_or_default();
    // Repeats are told apart by their numbers only where some lack readings.
    let numbers: Vec<u32> = match counts().all(|n| n == repeats) {
        true => Vec::new(),
        false => {
            let all = sensors.iter().flatten().flat_map(|own| own.keys().copied());
            all.collect::<BTreeSet<_>>().into_iter().collect()
        }
    };
    let mut gathered = Gathered {
        cells: vec![Default::default(); positions.len()],
        repeats: numbers.len().max(repeats),
        variances: vec![[1.0; 4]; positions.len()],
        missing: Vec::new(),
        lines: Vec::new(),
    };
    for (sensor, places) in sensors.iter().enumerate() {
        if numbers.is_empty() {
            for (cell, own) in gathered.cells.iter_mut().zip(places) {
                cell[sensor] = own.values().map(|(value, _)| *value).collect();
            }
            continue;
        }
        let mut rows = Vec::new();
        for (place, own) in places.iter().enumerate() {
            let row: Vec<Option<f64>> = numbers
                .iter()
                .map(|n| own.get(n).map(|(value, _)| *value))
                .collect();
            let lacking = numbers.iter().filter(|n| !own.contains_key(n));
            for repeat in lacking {
                gathered.lines.push(lines[place]);
                gathered.missing.push(Missing {
                    sensor: sensor + 1,
                    x: positions[place],
                    repeat: *repeat,
                });
            }
            if own.is_empty() {
                let what = format!(
                    "sensor {} has no reading at {} mm{}",
                    sensor + 1,
                    positions[place],
                    if repeats > 1 { " in any repeat" } else { "" }
                );
                return Err(table.at_line(lines[place], what).remedy(
                    "read the position again; repeats of the whole travel, numbered in a column `repeat`, stand in for \
                     single readings that one of them lacks, or cut the travel off before or behind this position",
                ));
            }
            gathered.variances[place][sensor] = numbers.len() as f64 / own.len() as f64;
            rows.push(row);
        }
        let heights = match zeroed {
            true => heights(rows.iter().map(Vec::as_slice), numbers.len()),
            false => vec![0.0; numbers.len()],
        };
        for (cell, row) in gathered
            .cells
            .iter_mut()
            .zip(filled(&rows, &heights).unwrap_or_default())
        {
            cell[sensor] = row;
        }
    }
    let most = MOST_MISSING * 4.0 * positions.len() as f64;
    for number in &numbers {
        let own = gathered
            .missing
            .iter()
            .zip(&gathered.lines)
            .filter(|(m, _)| m.repeat == *number);
        if let Some((_, line)) = own.clone().next()
            && own.count() as f64 > most
        {
            let what =
                format!("repeat {number} lacks more than a tenth of its readings, from here on");
            return Err(table.at_line(*line, what).remedy(
                "leave this repeat out, or number the repeats 1, 2, 3 … at every position",
            ));
        }
    }
    Ok(gathered)
}
