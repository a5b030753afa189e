//! Where the cells begin among sorted readings.

use super::readings::ChannelReadings;
use super::unknowns::{Form, Unknowns};
use crate::basis::bspline::CubicBSpline;

/// First reading at or beyond each break of the slide's form, by channel, where that is fitted.
pub fn slide_starts(
    unknowns: &Unknowns,
    bases: &[CubicBSpline],
    channels: &[ChannelReadings],
) -> Vec<Vec<usize>> {
    unknowns.place(Form::Slide).map_or_else(Vec::new, |form| {
        channels
            .iter()
            .map(|c| starts(&c.x, bases[form].breaks()))
            .collect()
    })
}

/// For each break the first of the sorted positions at or beyond it; the first and last breaks
/// take in everything outside.
pub fn starts(x: &[f64], breaks: &[f64]) -> Vec<usize> {
    let mut starts: Vec<usize> = breaks
        .iter()
        .map(|b| x.partition_point(|x| x < b))
        .collect();
    if let Some(first) = starts.first_mut() {
        *first = 0;
    }
    if let Some(last) = starts.last_mut() {
        *last = x.len();
    }
    starts
}
