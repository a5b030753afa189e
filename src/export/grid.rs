//! The errors of one axis at the positions that a file gets.

use super::source::AxisErrors;
use super::{Known, Missed};
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
    /// How far the grid misses the means measured forward and backward at most, and where; mm or degrees.
    pub missed: Option<[(f64, f64); 2]>,
    /// Standard uncertainty of the forward and backward values, mm or degrees, where it is known.
    pub std: Option<[Vec<f64>; 2]>,
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
        let missed = grid.map(|_| {
            [(&forward, &errors.forward), (&backward, &errors.backward)].map(|(table, y)| {
                let all = x.iter().zip(y).map(|(x, y)| {
                    let missed = interpolate(&positions, table, *x) + zero - y;
                    (*x, missed.abs())
                });
                all.fold(
                    (first, 0.0),
                    |worst, one| if one.1 > worst.1 { one } else { worst },
                )
            })
        });
        let known = errors.known.as_ref();
        let std = known.map(|known| {
            [0, 1].map(|d| {
                let of =
                    |at: &f64| known.std(x, [f64::from(d == 0), f64::from(d == 1)], *at, reference);
                positions.iter().map(of).collect()
            })
        });
        Ok(Self {
            positions,
            forward,
            backward,
            missed,
            std,
        })
    }

    /// What is told of the table: what it misses and how well it is known, in `unit`, `per` of which are one mm or degree.
    pub fn cost(
        &self,
        errors: &AxisErrors,
        unit: &'static str,
        per: f64,
    ) -> (Vec<Missed>, Vec<Known>) {
        let names: &[&str] = match errors.both {
            true => &["mean forward", "mean backward"],
            false => &["mean"],
        };
        let missed = self.missed.iter().flat_map(|both| names.iter().zip(both));
        let missed = missed.map(|(of, (at, value))| Missed {
            of: (*of).to_owned(),
            value: value * per,
            unit,
            at: *at,
        });
        let known = self.std.iter().flat_map(|both| names.iter().zip(both));
        let known = known.map(|(of, std)| Known {
            of: (*of).to_owned(),
            unit,
            at: self.positions.clone(),
            std: std.iter().map(|u| u * per).collect(),
            degrees_of_freedom: errors.known.as_ref().map(|known| known.degrees_of_freedom),
        });
        (missed.collect(), known.collect())
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
    shares(x, at)
        .into_iter()
        .map(|(i, share)| share * y.get(i).copied().unwrap_or_default())
        .sum()
}

/// Which values a straight line between takes, and the share of each.
pub(super) fn shares(x: &[f64], at: f64) -> [(usize, f64); 2] {
    let next = x.partition_point(|x| *x <= at);
    match (next.checked_sub(1), x.get(next)) {
        (None, _) => [(0, 1.0), (0, 0.0)],
        (Some(last), None) => [(last, 1.0), (last, 0.0)],
        (Some(before), Some(x1)) => {
            let x0 = x[before];
            let share = (at - x0) / (x1 - x0);
            [(before, 1.0 - share), (next, share)]
        }
    }
}
