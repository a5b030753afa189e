//! The way of the pointers as the values of a shape, and back.

use std::ops::Range;

use super::followed::Path;
use crate::model::Shape;

/// The plunger of one indicator.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hold {
    pub indicator: usize,
    /// µm.
    pub size: f64,
    /// Its standard uncertainty, µm; nothing where no trace is followed.
    pub std: f64,
}

/// The way of one pointer in one trace.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Way {
    pub trace: usize,
    pub indicator: usize,
    pub path: Path,
}

impl Way {
    /// How far the pointer is ahead of the stylus, µm, in the order of time.
    pub fn lag(&self, seen: &[f64], hold: f64) -> Vec<f64> {
        let mut at = seen
            .first()
            .map_or(0.0, |first| first + self.path.begins * hold);
        let mut jumps = self.path.jumps.iter().peekable();
        let shown = seen.iter().enumerate().map(|(k, stylus)| {
            if jumps.next_if(|jump| **jump == k).is_some() {
                at = *stylus;
            }
            at - stylus
        });
        shown.collect()
    }
}

/// All of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Track {
    pub holds: Vec<Hold>,
    pub ways: Vec<Way>,
}

/// Numbers of a plunger, and of a way before its jumps.
const OF_HOLD: usize = 3;
const OF_WAY: usize = 5;

impl Track {
    /// Plungers of which no trace is followed yet.
    pub fn begun(plungers: impl Iterator<Item = (usize, f64)>) -> Self {
        let holds = plungers.map(|(indicator, size)| Hold {
            indicator,
            size,
            std: 0.0,
        });
        Self {
            holds: holds.collect(),
            ways: Vec::new(),
        }
    }

    /// What of it is of some indicators; those not known begin with a hold.
    pub fn of_indicators(&self, own: Range<usize>, usual: f64) -> Self {
        let known = |indicator: usize| self.holds.iter().find(|h| h.indicator == indicator);
        let hold = |indicator: usize| {
            known(indicator).cloned().unwrap_or(Hold {
                indicator,
                size: usual,
                std: 0.0,
            })
        };
        let ways = self.ways.iter().filter(|way| own.contains(&way.indicator));
        Self {
            ways: ways.cloned().collect(),
            holds: own.map(hold).collect(),
        }
    }

    /// As a shape of a variant.
    pub fn written(&self, variant: usize) -> Shape {
        let mut values = vec![self.holds.len() as f64];
        for hold in &self.holds {
            values.extend([hold.indicator as f64, hold.size, hold.std]);
        }
        for Way {
            trace,
            indicator,
            path,
        } in &self.ways
        {
            let counts = [path.choices, path.jumps.len()];
            values.extend([*trace as f64, *indicator as f64, path.begins]);
            values.extend(counts.iter().chain(&path.jumps).map(|count| *count as f64));
        }
        Shape {
            variant,
            steps: vec![0.0; values.len()],
            values,
        }
    }

    /// From a shape; nothing where its values are none of a track.
    pub fn read(shape: &Shape) -> Option<Self> {
        let (count, mut left) = shape.values.split_first()?;
        let mut track = Self::default();
        for _ in 0..*count as usize {
            let (own, rest) = left.split_at_checked(OF_HOLD)?;
            track.holds.push(Hold {
                indicator: own[0] as usize,
                size: own[1],
                std: own[2],
            });
            left = rest;
        }
        while !left.is_empty() {
            let (own, rest) = left.split_at_checked(OF_WAY)?;
            let (jumps, rest) = rest.split_at_checked(own[4] as usize)?;
            track.ways.push(Way {
                trace: own[0] as usize,
                indicator: own[1] as usize,
                path: Path {
                    begins: own[2],
                    choices: own[3] as usize,
                    jumps: jumps.iter().map(|jump| *jump as usize).collect(),
                    square: 0.0,
                },
            });
            left = rest;
        }
        Some(track)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// *Exact*: what is written is read, but for the square; numbers that are none are no track.
    #[test]
    fn a_track_is_read_as_it_was_written() {
        let hold = |indicator: usize| Hold {
            indicator,
            size: 0.5 + indicator as f64,
            std: 0.01,
        };
        let way = |trace: usize, jumps: Vec<usize>| Way {
            trace,
            indicator: trace % 2,
            path: Path {
                begins: -0.3,
                choices: trace + 4,
                jumps,
                square: 0.0,
            },
        };
        let track = Track {
            holds: vec![hold(0), hold(1)],
            ways: vec![way(0, vec![3, 9]), way(1, Vec::new()), way(2, vec![1])],
        };
        let shape = track.written(0);
        assert_eq!(Track::read(&shape), Some(track.clone()));
        assert_eq!(shape.free(), 0);
        let one = track.of_indicators(1..2, 9.0);
        assert_eq!(one.holds, vec![hold(1)]);
        assert_eq!(one.ways, vec![way(1, Vec::new())]);
        let mut cut = shape.clone();
        cut.values.truncate(shape.values.len() - 1);
        assert_eq!(Track::read(&cut), None);
        assert_eq!(Track::read(&Shape::only()), None);
        // The pointer stands where it let go.
        let lag = track.ways[2].lag(&[1.0, 2.0, 4.0], 0.5);
        assert!((lag[0] + 0.15).abs() < 1e-15, "{lag:?}");
        assert_eq!(lag[1..], [0.0, -2.0]);
    }
}
