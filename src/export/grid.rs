//! The errors of one axis at the positions that a file gets.

use super::source::AxisErrors;
use crate::io::Message;

/// An even grid from the first to the last position measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grid {
    /// So many points.
    Points(usize),
    /// So far apart, mm or degrees.
    Step(f64),
}

/// More points are in no controller's table.
const MOST: usize = 100_000;

impl Grid {
    /// The positions from `from` to `to`.
    ///
    /// # Errors
    /// Fewer than two points, too many, or a step that does not fit.
    pub fn positions(self, from: f64, to: f64) -> Result<Vec<f64>, Message> {
        let length = to - from;
        let bad = |what: String, remedy: &str| Err(Message::bad_input(what).remedy(remedy));
        let count = match self {
            Self::Points(n) if (2..=MOST).contains(&n) => n,
            Self::Points(n) => {
                return bad(
                    format!("{n} points make no table"),
                    "give --points from 2 to 100000",
                );
            }
            Self::Step(step) if step > 0.0 && step <= length => {
                let count = (length / step).round();
                if count >= MOST as f64 {
                    return bad(
                        "so short a step makes too many points".to_owned(),
                        "give a longer --step",
                    );
                }
                // A millionth of a step is what travels and steps in decimals leave.
                if (count * step - length).abs() > 1e-6 * step {
                    return bad(
                        format!(
                            "steps of {step} do not end at {to}, the last position, from {from}"
                        ),
                        "give a step that divides the travel, or --points",
                    );
                }
                count as usize + 1
            }
            Self::Step(step) => {
                return bad(
                    format!("a step of {step} does not fit between {from} and {to}"),
                    "give --step greater than zero and no longer than the travel",
                );
            }
        };
        Ok((0..count)
            .map(|i| from + length * i as f64 / (count - 1) as f64)
            .collect())
    }
}

/// Positions with the error of each direction there, all in mm or degrees, zero at the reference.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisTable {
    /// Ascending positions.
    pub positions: Vec<f64>,
    /// Actual less target position, approached forward.
    pub forward: Vec<f64>,
    /// The same backward.
    pub backward: Vec<f64>,
    /// How far the grid misses a measured value at most.
    pub resampling: Option<f64>,
}

impl AxisTable {
    /// The errors at the positions measured or on a grid, less the mean of both directions at the
    /// reference.
    ///
    /// # Errors
    /// A grid that cannot be, a reference outside the positions measured.
    pub fn of(
        errors: &AxisErrors,
        grid: Option<Grid>,
        reference: Option<f64>,
    ) -> Result<Self, Message> {
        let x = &errors.positions;
        let (Some(&first), Some(&last)) = (x.first(), x.last()) else {
            return Err(Message::bad_input("the result has no points"));
        };
        let positions = match grid {
            Some(grid) => grid.positions(first, last)?,
            None => x.clone(),
        };
        let zero = match reference {
            None => 0.0,
            Some(at) if (first..=last).contains(&at) => {
                let [f, b] = [&errors.forward, &errors.backward].map(|y| interpolate(x, y, at));
                0.5 * (f + b)
            }
            Some(at) => {
                return Err(Message::bad_input(format!(
                    "the reference {at} lies outside the positions measured, {first} to {last}"
                ))
                .remedy("give --reference within them"));
            }
        };
        let on = |y: &[f64]| -> Vec<f64> {
            positions
                .iter()
                .map(|p| interpolate(x, y, *p) - zero)
                .collect()
        };
        let (forward, backward) = (on(&errors.forward), on(&errors.backward));
        let resampling = grid.map(|_| {
            let missed = |table: &[f64], y: &[f64]| {
                x.iter()
                    .zip(y)
                    .map(|(x, y)| (interpolate(&positions, table, *x) + zero - y).abs())
                    .fold(0.0, f64::max)
            };
            missed(&forward, &errors.forward).max(missed(&backward, &errors.backward))
        });
        Ok(Self {
            positions,
            forward,
            backward,
            resampling,
        })
    }

    /// The mean of both directions.
    pub fn mean(&self) -> Vec<f64> {
        let both = self.forward.iter().zip(&self.backward);
        both.map(|(f, b)| 0.5 * (f + b)).collect()
    }

    /// The distance from position to position.
    ///
    /// # Errors
    /// Positions that are not evenly spaced.
    pub fn step(&self, format: &str) -> Result<f64, Message> {
        let x = &self.positions;
        let (Some(first), Some(last)) = (x.first(), x.last()) else {
            return Err(Message::bad_input("the result has no points"));
        };
        let step = (last - first) / (x.len().max(2) - 1) as f64;
        let even = x
            .iter()
            .enumerate()
            .all(|(i, x)| (first + step * i as f64 - x).abs() <= 1e-6 * step);
        if even {
            return Ok(step);
        }
        Err(Message::bad_input(format!(
            "{format} has evenly spaced points, the result has not"
        ))
        .remedy("give --points N or --step MM: the values between are interpolated"))
    }
}

/// Straight lines between the values, constant outside.
pub(super) fn interpolate(x: &[f64], y: &[f64], at: f64) -> f64 {
    let next = x.partition_point(|x| *x <= at);
    let of = |i: usize| (x.get(i).copied(), y.get(i).copied());
    match (next.checked_sub(1).map(of), of(next)) {
        (None, (_, Some(first))) => first,
        (Some((_, Some(last))), (None, _)) => last,
        (Some((Some(x0), Some(y0))), (Some(x1), Some(y1))) => {
            y0 + (y1 - y0) * (at - x0) / (x1 - x0)
        }
        _ => 0.0,
    }
}
