//! Scans of the Fourier three-sensor method and their set-up.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use errsep_models::fourier::{
    Combination, Compensation, FourierError, Scan, ScanReading, Section, fill, join, step_terms,
};
use serde::Deserialize;
use toml::Spanned;

use super::message::Place;
use super::{Column, ColumnMap, Message, SetupFile, TableReader};

/// The set-up of a Fourier separation.
#[derive(Debug, Clone, Default)]
pub struct FourierSetup {
    /// The section.
    pub section: SectionSetup,
    /// The probes.
    pub probe: ProbeSetup,
    /// The method.
    pub method: MethodSetup,
}

/// `[section]`.
#[derive(Debug, Clone, Default)]
pub struct SectionSetup {
    /// Length L, mm.
    pub length: Option<f64>,
    /// Highest order kept.
    pub orders: Option<usize>,
}

/// `[probe]`.
#[derive(Debug, Clone, Default)]
pub struct ProbeSetup {
    /// Spacing d of each data file, mm, in the order of the files.
    pub spacing: Vec<f64>,
    /// Standard deviation of one reading, µm.
    pub noise: Option<f64>,
}

/// `[method]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MethodSetup {
    /// `fitted`, `chord`, `level` or `none`.
    #[serde(default)]
    pub compensation: Compensation,
    /// `least-squares` or `hybrid`.
    #[serde(default)]
    pub combination: Combination,
}

/// The set-up as it stands in the file.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    section: SectionTable,
    #[serde(default)]
    probe: ProbeTable,
    #[serde(default)]
    method: MethodSetup,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct SectionTable {
    length: Option<Spanned<f64>>,
    orders: Option<Spanned<usize>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ProbeTable {
    #[serde(default)]
    spacing: Vec<Spanned<f64>>,
    noise: Option<Spanned<f64>>,
}

impl FourierSetup {
    /// Reads the set-up.
    ///
    /// # Errors
    /// Those of [`SetupFile`]; a length, a spacing or a noise that is not a positive number, no order.
    pub fn read(path: &Path) -> Result<Self, Message> {
        let file = SetupFile::read(path)?;
        let File {
            section,
            probe,
            method,
        } = file.parse()?;
        let positive = |value: Spanned<f64>, name: &str, remedy: &str| {
            let found = *value.get_ref();
            if found > 0.0 && found.is_finite() {
                Ok(found)
            } else {
                Err(file.bad(
                    value.span(),
                    format!("{name} = {found} is not a positive number"),
                    remedy,
                ))
            }
        };
        let length = section
            .length
            .map(|v| positive(v, "length", "give the length of the section in mm"))
            .transpose()?;
        if let Some(orders) = section.orders.as_ref().filter(|o| *o.get_ref() == 0) {
            return Err(file.bad(
                orders.span(),
                "no order is kept",
                "give the highest order to keep, 1 or more",
            ));
        }
        let noise = "give the standard deviation of one reading in um, or leave it out to have it estimated";
        Ok(Self {
            section: SectionSetup {
                length,
                orders: section.orders.map(Spanned::into_inner),
            },
            probe: ProbeSetup {
                spacing: probe
                    .spacing
                    .into_iter()
                    .map(|v| positive(v, "spacing", "give the distance from P1 to P2 in mm"))
                    .collect::<Result<_, _>>()?,
                noise: probe
                    .noise
                    .map(|v| positive(v, "noise", noise))
                    .transpose()?,
            },
            method,
        })
    }
}

/// A scan, and the line of the file where each of its readings stands.
#[derive(Debug, Clone)]
pub struct LocatedScan {
    /// The scan.
    pub scan: Scan,
    file: PathBuf,
    lines: Vec<usize>,
}

impl LocatedScan {
    /// Fills in what repeats lack from the others, and tells it: spacing, repeat and x of each position.
    pub fn fill(located: &mut [Self], section: Section) -> Vec<(f64, u32, f64)> {
        let mut scans: Vec<Scan> = located.iter().map(|l| l.scan.clone()).collect();
        fill(&mut scans, section);
        let mut told = Vec::new();
        for (own, scan) in located.iter_mut().zip(scans) {
            let mut filled = scan.filled.clone();
            filled.sort_by_key(|f| f.index);
            for f in &filled {
                let x = scan.readings.get(f.index).map_or(0.0, |r| r.x);
                told.push((scan.spacing, scan.repeat, x));
                if f.first {
                    let before = f.index.checked_sub(1).and_then(|at| own.lines.get(at));
                    own.lines
                        .insert(f.index, before.copied().unwrap_or_default());
                }
            }
            own.scan = scan;
        }
        told
    }

    /// Checks that the scan can be joined.
    ///
    /// # Errors
    /// What the method cannot use, with its line.
    pub fn check(&self, section: Section, compensation: Compensation) -> Result<(), Message> {
        join(&self.scan, section)
            .and_then(|_| step_terms(&self.scan, section, compensation))
            .map(|_| ())
            .map_err(|e| {
                let place = e.reading().unwrap_or(0);
                told(&e).at(Place {
                    file: self.file.clone(),
                    line: self.lines.get(place).copied().unwrap_or(0),
                    column: 1,
                    text: String::new(),
                    length: 0,
                })
            })
    }
}

/// An error of the method for the person who can mend it.
pub fn told(error: &FourierError) -> Message {
    let message = match error {
        FourierError::NoiseUnknown { .. } | FourierError::StepNotSeen { .. } => {
            Message::not_determined(error.to_string())
        }
        _ => Message::bad_input(error.to_string()),
    };
    message.remedy(match error {
        FourierError::NoScan => "give at least one scan",
        FourierError::Spacing { .. } => {
            "correct the spacing, or the length of the section ([section] length or --length)"
        }
        FourierError::NotFinite { .. } => "correct the reading, in um",
        FourierError::Duplicate { .. } => {
            "remove one of the two rows, or number repeats in a column `repeat`"
        }
        FourierError::UnevenGrid { .. } => {
            "give one row for each step of the grid, from x = 0; resample a scan that is uneven"
        }
        FourierError::RowMissing { .. } => {
            "read the position again: a Fourier transform needs every step of the grid; repeats of this spacing, \
             numbered in a column `repeat`, stand in for what one of them lacks, up to a tenth"
        }
        FourierError::SectionNotFilled { .. } => {
            "read P1 from 0 to the end of the section, or correct its length"
        }
        FourierError::ProbeMissing { .. } => {
            "read P2 before the joint x = L - d and P3 from there on; repeats of this spacing, numbered in a column \
             `repeat`, stand in for what one of them lacks, up to a tenth"
        }
        FourierError::NoOverlap { .. } => {
            "read both probes at the joint, or choose [method] compensation = \"fitted\""
        }
        FourierError::NoClosingReading { .. } => {
            "read P1 there, or choose [method] compensation = \"fitted\""
        }
        FourierError::TooManyOrders { .. } => "keep fewer [section] orders, or read more finely",
        FourierError::Noise { .. } => "give a number greater than zero, or leave it out",
        FourierError::NoiseUnknown { .. } => {
            "state it as [probe] noise (um), keep fewer [section] orders, or measure repeats"
        }
        FourierError::StepNotSeen { .. } => {
            "keep fewer [section] orders, or choose [method] compensation = \"chord\""
        }
        FourierError::Simulation { .. } => "correct what is simulated",
    })
}

/// Reads the scans of one file: columns `x`, `m1`, `m2`, and where they apply `m3`, `spacing` and
/// `repeat`. Without the column `spacing` the spacing must be given.
///
/// # Errors
/// The table cannot be read, or the spacing is nowhere.
pub fn read_scans(
    path: &Path,
    map: &ColumnMap,
    given: Option<f64>,
) -> Result<Vec<LocatedScan>, Message> {
    let mut table = TableReader::open_as(path, map)?;
    table.only(&["x", "m1", "m2", "m3", "spacing", "repeat"])?;
    let x = table.column("x")?.in_mm();
    let (m1, m2) = (table.column("m1")?.in_um(), table.column("m2")?.in_um());
    let (m3, repeat) = (
        table.optional("m3").map(Column::in_um),
        table.optional("repeat"),
    );
    let spacing = table.optional("spacing").map(Column::in_mm);
    if spacing.is_none() && given.is_none() {
        return Err(table.in_header(0, "the probe spacing is not known").remedy(
            "add a column `spacing` (mm), or give [probe] spacing in the set-up, one number a file",
        ));
    }
    let mut scans: Vec<LocatedScan> = Vec::new();
    let mut places: HashMap<(u64, u32), usize> = HashMap::new();
    while let Some(row) = table.next_row()? {
        let number = match &repeat {
            Some(column) => row.count(column)?,
            None => 1,
        };
        let own = match (&spacing, given) {
            // To the picometre: a spacing in inch is the same number in mm in every row and every message.
            (Some(column), _) => (row.number(column)? * 1e9).round() / 1e9,
            (None, Some(given)) => given,
            (None, None) => continue,
        };
        let optional = |column| match row.text(column) {
            "" => Ok(None),
            _ => row.number(column).map(Some),
        };
        // Without P1 the others tell nothing of the workpiece.
        if row.is_empty(&m1) {
            continue;
        }
        let reading = ScanReading {
            x: row.number(&x)?,
            m1: row.number(&m1)?,
            m2: optional(&m2)?,
            m3: m3.as_ref().map(optional).transpose()?.flatten(),
        };
        let place = *places.entry((own.to_bits(), number)).or_insert_with(|| {
            scans.push(LocatedScan {
                scan: Scan {
                    spacing: own,
                    repeat: number,
                    readings: Vec::new(),
                    filled: Vec::new(),
                },
                file: path.to_owned(),
                lines: Vec::new(),
            });
            scans.len() - 1
        });
        if let Some(scan) = scans.get_mut(place) {
            scan.scan.readings.push(reading);
            scan.lines.push(row.line());
        }
    }
    if scans.is_empty() {
        return Err(table.no_rows());
    }
    for located in &mut scans {
        let mut rows: Vec<(ScanReading, usize)> = std::mem::take(&mut located.scan.readings)
            .into_iter()
            .zip(std::mem::take(&mut located.lines))
            .collect();
        rows.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
        (located.scan.readings, located.lines) = rows.into_iter().unzip();
    }
    Ok(scans)
}
