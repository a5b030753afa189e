//! Coefficients of the splines and the order in which the run comes to them.

use super::super::run::Run;
use super::super::setting::{Setting, Wave};
use crate::basis::bspline::{CubicBSpline, horner};

/// The four values of a basis in a cell.
pub(super) fn values_in(basis: &CubicBSpline, cell: usize, at: f64) -> [f64; 4] {
    let (left, width) = basis.cell(cell);
    let t = (at - left) / width;
    basis.polynomials(cell).map(|p| horner(&p, t))
}

/// Numbers the coefficients in the order in which the run comes to them.
pub(super) fn in_order(
    run: &Run,
    setting: &Setting,
    form: &CubicBSpline,
    wave: Option<&CubicBSpline>,
    splines: usize,
) -> (Vec<usize>, Vec<Vec<usize>>) {
    // The values of the line t → t at the coefficients are their places.
    let reached = |place: f64, over_x: bool| {
        if over_x {
            let towards = run.direction * place;
            run.x.partition_point(|x| run.direction * x < towards)
        } else {
            run.time.partition_point(|t| *t < place)
        }
    };
    let over_x = matches!(setting.wave, Wave::Bent { .. });
    let mut all: Vec<(usize, usize, usize)> = Vec::new();
    for (k, place) in form.line(0.0, 1.0).into_iter().enumerate() {
        all.push((reached(place, true), 0, k));
    }
    for which in 0..splines {
        let places = wave.map(|basis| basis.line(0.0, 1.0)).unwrap_or_default();
        for (k, place) in places.into_iter().enumerate() {
            all.push((reached(place, over_x), 1 + which, k));
        }
    }
    // Of coefficients at one reading those of a spline stay in the order of the run.
    all.sort_by_key(|(at, spline, k)| {
        let falls = run.direction < 0.0 && (*spline == 0 || over_x);
        (*at, if falls { usize::MAX - *k } else { *k }, *spline)
    });
    let mut form_unknowns = vec![0; form.coefficient_count()];
    let mut wave_unknowns = vec![vec![0; wave.map_or(0, CubicBSpline::coefficient_count)]; splines];
    for (unknown, (_, spline, k)) in all.into_iter().enumerate() {
        match spline {
            0 => form_unknowns[k] = unknown,
            s => wave_unknowns[s - 1][k] = unknown,
        }
    }
    (form_unknowns, wave_unknowns)
}
