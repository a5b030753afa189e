//! The passes of the slide: traces that were read at the same time.

use std::ops::Range;

use super::Linearised;
use crate::model::{Column, FittedModel, Place};

/// Traces of one spindle position, repeat and direction that are read at the same time: each pass of the
/// slide, in the order of its first trace.
pub(super) fn passes(model: &Linearised) -> Vec<Vec<Range<usize>>> {
    let mut passes: Vec<(Pass, Vec<Range<usize>>)> = Vec::new();
    for trace in model.traces() {
        let here = Pass::of(model, trace);
        match passes.iter_mut().find(|(pass, _)| pass.holds(&here)) {
            Some((_, traces)) => traces.push(trace.clone()),
            None => passes.push((here, vec![trace.clone()])),
        }
    }
    passes.into_iter().map(|(_, traces)| traces).collect()
}

/// What a pass is known by.
struct Pass {
    position: usize,
    repeat: u32,
    forward: bool,
    begins: f64,
    ends: f64,
}

impl Pass {
    fn of(model: &Linearised, trace: &Range<usize>) -> Self {
        let place = &model.places()[trace.start];
        // Read in one go along the travel: its ends are first and last.
        let last = &model.places()[trace.end - 1];
        Self {
            position: model.seat(place).position,
            repeat: place.repeat,
            forward: place.direction > 0.0,
            begins: place.time.min(last.time),
            ends: place.time.max(last.time),
        }
    }

    fn holds(&self, other: &Self) -> bool {
        let known = |pass: &Self| (pass.position, pass.repeat, pass.forward);
        known(self) == known(other) && self.begins <= other.ends && other.begins <= self.ends
    }
}

/// A change of the readings of one pass.
pub(super) fn in_pass(
    model: &Linearised,
    pass: &[Range<usize>],
    change: impl Fn(usize, &Place) -> f64,
) -> Column {
    let rows: Vec<usize> = pass.iter().flat_map(Clone::clone).collect();
    let values = rows
        .iter()
        .map(|k| change(*k, &model.places()[*k]))
        .collect();
    Column { rows, values }
}
