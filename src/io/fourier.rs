//! Scans of the Fourier three-sensor method and their set-up.

use std::path::Path;

use errsep_models::fourier::{Combination, Compensation, Scan, ScanReading};
use serde::Deserialize;

use super::{Message, SetupFile, TableReader};

/// The set-up of a Fourier separation.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FourierSetup {
    /// The section.
    #[serde(default)]
    pub section: SectionSetup,
    /// The probes.
    #[serde(default)]
    pub probe: ProbeSetup,
    /// The method.
    #[serde(default)]
    pub method: MethodSetup,
}

/// `[section]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SectionSetup {
    /// Length L, mm.
    pub length: Option<f64>,
    /// Highest order kept.
    pub orders: Option<usize>,
}

/// `[probe]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeSetup {
    /// Spacing d of each data file, mm, in the order of the files.
    #[serde(default)]
    pub spacing: Vec<f64>,
    /// Standard deviation of one reading, µm.
    pub noise: Option<f64>,
}

/// `[method]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MethodSetup {
    /// `chord`, `level` or `none`.
    #[serde(default)]
    pub compensation: Compensation,
    /// `least-squares` or `hybrid`.
    #[serde(default)]
    pub combination: Combination,
}

impl FourierSetup {
    /// Reads the set-up.
    ///
    /// # Errors
    /// Those of [`SetupFile`].
    pub fn read(path: &Path) -> Result<Self, Message> {
        SetupFile::read(path)?.parse()
    }
}

/// Reads the scans of one file: columns `x`, `m1`, `m2`, and where they apply `m3`, `spacing` and
/// `repeat`. Without the column `spacing` the spacing must be given.
///
/// # Errors
/// The table cannot be read, or the spacing is nowhere.
pub fn read_scans(path: &Path, given: Option<f64>) -> Result<Vec<Scan>, Message> {
    let mut table = TableReader::open(path)?;
    table.only(&["x", "m1", "m2", "m3", "spacing", "repeat"])?;
    let (x, m1, m2) = (table.column("x")?, table.column("m1")?, table.column("m2")?);
    let (m3, repeat) = (table.optional("m3"), table.optional("repeat"));
    let spacing = table.optional("spacing");
    if spacing.is_none() && given.is_none() {
        return Err(table.in_header(0, "the probe spacing is not known").remedy(
            "add a column `spacing` (mm), or give [probe] spacing in the set-up, one number a file",
        ));
    }
    let mut scans: Vec<Scan> = Vec::new();
    while let Some(row) = table.next_row()? {
        let number = match &repeat {
            Some(column) => row.count(column)?,
            None => 1,
        };
        let own = match (&spacing, given) {
            (Some(column), _) => row.number(column)?,
            (None, Some(given)) => given,
            (None, None) => continue,
        };
        let optional = |column| match row.text(column) {
            "" => Ok(None),
            _ => row.number(column).map(Some),
        };
        let reading = ScanReading {
            x: row.number(&x)?,
            m1: row.number(&m1)?,
            m2: optional(&m2)?,
            m3: m3.as_ref().map(optional).transpose()?.flatten(),
        };
        let place = scans
            .iter()
            .position(|s| s.spacing == own && s.repeat == number);
        match place.and_then(|i| scans.get_mut(i)) {
            Some(scan) => scan.readings.push(reading),
            None => scans.push(Scan {
                spacing: own,
                repeat: number,
                readings: vec![reading],
            }),
        }
    }
    if scans.is_empty() {
        return Err(table.no_rows());
    }
    for scan in &mut scans {
        scan.readings.sort_by(|a, b| a.x.total_cmp(&b.x));
    }
    Ok(scans)
}
