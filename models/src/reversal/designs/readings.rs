//! Readings of a design, and the traces of its channels in the order of position.

use super::channel::Design;
use crate::reversal::Direction;
use crate::reversal::channel_noise::{Seat, SortedReadings};

/// One indicator reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DesignReading {
    /// The channel's place in the design.
    pub channel: usize,
    /// Repeat number, from 1.
    pub repeat: u32,
    /// Direction of travel.
    pub direction: Direction,
    /// Seconds since the first reading.
    pub time: Option<f64>,
    /// Commanded slide position, mm.
    pub x: f64,
    /// Reading, µm, positive towards the indicator.
    pub value: f64,
}

/// All readings of a design, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct DesignObservations {
    /// Its channels; each has a reading.
    pub design: Design,
    /// The readings.
    pub readings: Vec<DesignReading>,
}

impl DesignObservations {
    /// Direction and repeat of a reading, by its place.
    pub(crate) fn taken(&self, reading: usize) -> (Direction, u32) {
        let reading = &self.readings[reading];
        (reading.direction, reading.repeat)
    }
}

/// The readings of one channel in growing order of position.
#[derive(Debug, Clone)]
pub struct Trace {
    /// Positions, mm, not falling.
    pub x: Vec<f64>,
    /// Readings, µm.
    pub value: Vec<f64>,
    /// Where each reading stands among the observations.
    pub source: Vec<usize>,
    /// How indicator and spindle stand.
    pub seat: Seat,
    /// Numbers that were fitted to the readings and taken out of them before.
    pub taken_out: usize,
}

impl SortedReadings for Trace {
    fn x(&self) -> &[f64] {
        &self.x
    }

    fn value(&self) -> &[f64] {
        &self.value
    }

    fn source(&self, row: usize) -> usize {
        self.source[row]
    }

    fn seat(&self) -> Seat {
        self.seat
    }
}

impl Trace {
    /// The traces of all channels, in their order.
    pub fn sort(observations: &DesignObservations) -> Vec<Self> {
        let readings = &observations.readings;
        let channels = observations.design.channels();
        (0..channels.len())
            .map(|c| {
                let mut source: Vec<usize> = (0..readings.len())
                    .filter(|i| readings[*i].channel == c)
                    .collect();
                source.sort_by(|a, b| readings[*a].x.total_cmp(&readings[*b].x));
                Self {
                    x: source.iter().map(|i| readings[*i].x).collect(),
                    value: source.iter().map(|i| readings[*i].value).collect(),
                    source,
                    seat: Seat::from(&channels[c]),
                    taken_out: 0,
                }
            })
            .collect()
    }

    /// Number of readings.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Number of different positions.
    pub fn positions(&self) -> usize {
        self.x.chunk_by(|a, b| a == b).count()
    }

    /// Slope (µm/mm) of the least-squares line and its height (µm) at x = 0; `None` where all positions
    /// are equal.
    pub fn line(&self) -> Option<(f64, f64)> {
        let n = self.len() as f64;
        let center = self.x.iter().sum::<f64>() / n;
        let mean = self.value.iter().sum::<f64>() / n;
        let (mut product, mut spread) = (0.0, 0.0);
        for (x, y) in self.x.iter().zip(&self.value) {
            product += (x - center) * (y - mean);
            spread += (x - center) * (x - center);
        }
        (spread > 0.0).then(|| (product / spread, mean - product / spread * center))
    }
}

/// First and last position of all traces, mm.
pub fn range(traces: &[Trace]) -> (f64, f64) {
    let ends = traces
        .iter()
        .filter_map(|t| Some((*t.x.first()?, *t.x.last()?)));
    ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (a, b)| {
        (l.min(a), h.max(b))
    })
}
