//! Positions that one repeat lacks, taken from the others.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::scan::{Scan, ScanReading, Section};
use crate::missing::{filled, heights};

/// A reading of a scan that was taken from others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Filled {
    /// Place in the scan, from 0.
    pub index: usize,
    /// Whether P1 was not read there either, so that the slide was not.
    pub first: bool,
}

/// Share of the positions of a scan that may be filled in; one may in any case.
const MOST: f64 = 0.1;

/// Fills in positions that scans lack: no row, or no reading of the probe that the joint signal needs there. The
/// difference signal is that of the repeats of the same spacing, P1 that of all scans, which it passes at the same
/// places, both less the heights of the scans. What no other scan has, or more than a tenth of a scan, stays as
/// it is.
pub fn fill(scans: &mut [Scan], section: Section) {
    let grids: Vec<Option<Grid>> = scans.iter().map(|s| Grid::of(s, section)).collect();
    if grids.iter().flatten().all(|g| g.lacking.is_empty()) {
        return;
    }
    let mut groups: BTreeMap<(u64, usize), Vec<usize>> = BTreeMap::new();
    let mut alike: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (i, grid) in grids.iter().enumerate() {
        let Some(grid) = grid else { continue };
        let key = (scans[i].spacing.to_bits(), grid.samples);
        groups.entry(key).or_default().push(i);
        alike.entry(grid.samples).or_default().push(i);
    }
    let whole: Vec<Scan> = scans.to_vec();
    for ((_, samples), repeats) in groups {
        let passing = &alike[&samples];
        let first = Table::of(&whole, &grids, passing, samples, |_, r| Some(r.m1));
        let before = Table::of(&whole, &grids, repeats.as_slice(), samples, |g, r| {
            (!g.is_third(r.x)).then_some(r.m1 - r.m2?)
        });
        let behind = Table::of(&whole, &grids, repeats.as_slice(), samples, |g, r| {
            g.is_third(r.x).then_some(r.m1 - r.m3?)
        });
        for &i in &repeats {
            let Some(grid) = &grids[i] else { continue };
            let most = (MOST * samples as f64).max(1.0);
            if grid.lacking.len() as f64 > most {
                continue;
            }
            for &k in &grid.lacking {
                let x = k as f64 * grid.step;
                let third = grid.is_third(x);
                let difference = if third { &behind } else { &before }.get(k, i);
                let place = grid.place(&whole[i], k);
                let read = place.map(|at| whole[i].readings[at].m1);
                let (Some(difference), Some(m1)) = (difference, read.or(first.get(k, i))) else {
                    continue;
                };
                let second = Some(m1 - difference);
                let reading = ScanReading {
                    x,
                    m1,
                    m2: second.filter(|_| !third),
                    m3: second.filter(|_| third),
                };
                scans[i].insert(reading, place.is_none());
            }
        }
    }
}

impl Scan {
    /// Puts a reading that was filled in at its place.
    fn insert(&mut self, reading: ScanReading, first: bool) {
        let index = self.readings.partition_point(|r| r.x < reading.x - 1e-6);
        if first {
            self.readings.insert(index, reading);
            let behind = self.filled.iter_mut().filter(|f| f.index >= index);
            behind.for_each(|f| f.index += 1);
        } else if let Some(own) = self.readings.get_mut(index) {
            own.m2 = own.m2.or(reading.m2);
            own.m3 = own.m3.or(reading.m3);
        }
        self.filled.push(Filled { index, first });
    }
}

/// Where a scan was read.
struct Grid {
    samples: usize,
    step: f64,
    /// x from which P3 is needed; none in the two-sensor method.
    joint: Option<f64>,
    /// Place in the scan of each grid point.
    places: Vec<Option<usize>>,
    /// Grid points without the readings that the joint signal needs.
    lacking: Vec<usize>,
}

impl Grid {
    /// The grid of most steps; none where readings lie beside it.
    fn of(scan: &Scan, section: Section) -> Option<Self> {
        let usual = scan.usual_gap()?;
        let steps = (section.length / usual).round();
        let step = section.length / steps;
        let enough = scan.readings.len() as f64;
        if !(step > 0.0 && step.is_finite() && steps < 2.0 * enough) {
            return None;
        }
        let samples = steps as usize;
        let joint = scan
            .has_third_probe()
            .then_some(section.length - scan.spacing - 1e-6 * step);
        let mut places = vec![None; samples];
        for (at, r) in scan.readings.iter().enumerate() {
            let k = (r.x / step).round();
            // As a scan is checked by.
            if !((r.x - k * step).abs() <= 1e-3 * step && k >= 0.0) {
                return None;
            }
            if let Some(place) = places.get_mut(k as usize) {
                *place = Some(at);
            }
        }
        let mut grid = Self {
            samples,
            step,
            joint,
            places,
            lacking: Vec::new(),
        };
        let lacks = |k: &usize| {
            let read = grid.places[*k].and_then(|at| scan.readings.get(at));
            read.and_then(|r| if grid.is_third(r.x) { r.m3 } else { r.m2 })
                .is_none()
        };
        grid.lacking = (0..samples).filter(lacks).collect();
        Some(grid)
    }

    fn is_third(&self, x: f64) -> bool {
        self.joint.is_some_and(|joint| x >= joint)
    }

    fn place(&self, scan: &Scan, k: usize) -> Option<usize> {
        let place = self.places.get(k).copied().flatten();
        place.filter(|at| *at < scan.readings.len())
    }
}

/// What scans have at each grid point, and would have where they lack it.
struct Table {
    columns: BTreeMap<usize, usize>,
    /// By grid point and scan.
    rows: BTreeMap<usize, Vec<f64>>,
}

impl Table {
    fn of(
        scans: &[Scan],
        grids: &[Option<Grid>],
        which: &[usize],
        samples: usize,
        value: impl Fn(&Grid, &ScanReading) -> Option<f64>,
    ) -> Self {
        let own = |k: usize, i: usize| {
            let grid = grids[i].as_ref()?;
            value(grid, scans[i].readings.get(grid.place(&scans[i], k)?)?)
        };
        let rows = (0..samples).map(|k| (k, which.iter().map(|&i| own(k, i)).collect::<Vec<_>>()));
        let (places, rows): (Vec<usize>, Vec<Vec<Option<f64>>>) = rows
            .filter(|(_, row)| row.iter().any(Option::is_some))
            .unzip();
        let heights = heights(rows.iter().map(Vec::as_slice), which.len());
        let rows = filled(&rows, &heights).unwrap_or_default();
        Self {
            columns: which.iter().copied().zip(0..).collect(),
            rows: places.into_iter().zip(rows).collect(),
        }
    }

    fn get(&self, k: usize, scan: usize) -> Option<f64> {
        let row = self.rows.get(&k)?;
        row.get(*self.columns.get(&scan)?).copied()
    }
}
