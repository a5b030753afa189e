//! Traces that two opposite indicators read in the same pass of the slide.
//!
//! A slide that runs on another line in each pass moves both by as much, one towards its reading and the other away; an
//! artefact that grows lifts both. What two such traces say together and against each other then has noise of its own: with the
//! readings a and b of both, (a + b)/√2 and (a − b)/√2 are independent whatever the correlation of a and b, and where the
//! indicators are independent both have the law of one trace.

use super::gathered::Gathered;
use super::laws::Whole;
use super::survey::Survey;
use super::traces::Group;
use crate::noise::{Contrasts, about_middle};

/// Positions of both that differ by no more than this share of the mean spacing are one place.
const SAME_PLACE: f64 = 0.1;
/// Least share of its places that a trace has in common with its partner.
const SHARED: f64 = 0.8;
/// Weights of two channels that count as alike.
const ALIKE: f64 = 1.1;

/// What both indicators read in one pass; a trace without a partner is a pair by itself.
#[derive(Debug, Clone)]
pub struct Pair {
    /// Places of both traces among those that were gathered.
    traces: [Option<usize>; 2],
    /// Positions, mm.
    pub positions: Vec<f64>,
    /// The same from the middle of the pass.
    pub about_middle: Vec<f64>,
    /// What a shift of one is in weighted units.
    pub one: f64,
    /// By position, the cell of each trace.
    cells: Vec<[Option<usize>; 2]>,
}

/// The two combinations of a pair: both together, and one against the other.
pub const SIGNS: [f64; 2] = [1.0, -1.0];

impl Pair {
    /// A trace and its partner, on the places of either.
    fn new(gathered: &Gathered, first: usize, second: Option<usize>) -> Self {
        let traces = [Some(first), second];
        let [a, b] = traces.map(|t| t.map_or(&[][..], |t| &gathered.traces[t].positions));
        let mut all: Vec<(f64, [Option<usize>; 2])> = Vec::with_capacity(a.len().max(b.len()));
        let (mut i, mut j) = (0, 0);
        for [m, n] in matched(a, b).into_iter().chain([[a.len(), b.len()]]) {
            all.extend((i..m).map(|k| (a[k], [Some(k), None])));
            all.extend((j..n).map(|k| (b[k], [None, Some(k)])));
            if m < a.len() {
                all.push((a[m], [Some(m), Some(n)]));
            }
            (i, j) = (m + 1, n + 1);
        }
        all.sort_by(|p, q| p.0.total_cmp(&q.0));
        let positions: Vec<f64> = all.iter().map(|p| p.0).collect();
        let ones = || traces.iter().flatten().map(|t| gathered.traces[*t].one);
        Self {
            traces,
            about_middle: about_middle(&positions),
            positions,
            one: ones().sum::<f64>() / ones().count() as f64,
            cells: all.into_iter().map(|p| p.1).collect(),
        }
    }

    /// As laws see it.
    pub fn whole(&self) -> Whole<'_> {
        Whole {
            about_middle: &self.about_middle,
            one: self.one,
        }
    }

    /// A combination of values that belong to the cells of all traces.
    fn combined(&self, of_traces: &[Vec<f64>], sign: f64) -> Vec<f64> {
        let value = |which: usize, cell: Option<usize>| {
            let own = self.traces[which].map(|t| &of_traces[t]);
            own.zip(cell).map_or(0.0, |(own, cell)| own[cell])
        };
        let both = |cells: &[Option<usize>; 2]| {
            (value(0, cells[0]) + sign * value(1, cells[1])) * std::f64::consts::FRAC_1_SQRT_2
        };
        self.cells.iter().map(both).collect()
    }
}

/// All pairs of a measurement.
#[derive(Debug, Clone)]
pub struct Pairs {
    pub pairs: Vec<Pair>,
    /// By group of repeats, its partner.
    pub partner: Vec<Option<usize>>,
}

impl Pairs {
    /// The pairs among the repeats; `None` where no two channels are read together.
    pub fn of(survey: &Survey, gathered: &Gathered, weights: &[f64]) -> Option<Self> {
        let groups = &survey.repeats;
        let mut partner: Vec<Option<usize>> = vec![None; groups.len()];
        for a in 0..groups.len() {
            for b in a + 1..groups.len() {
                let alone = partner[a].is_none() && partner[b].is_none();
                if alone && are_read_together(survey, &groups[a], &groups[b], weights) {
                    partner[a] = Some(b);
                    partner[b] = Some(a);
                }
            }
        }
        partner.iter().flatten().next()?;
        let mut first = vec![0; groups.len()];
        for g in 1..groups.len() {
            first[g] = first[g - 1] + groups[g - 1].traces.len();
        }
        let mut taken = vec![false; gathered.traces.len()];
        let mut pairs = Vec::new();
        for (a, group) in groups.iter().enumerate() {
            for t in 0..group.traces.len() {
                let own = first[a] + t;
                if taken[own] {
                    continue;
                }
                let of = |b: usize| of_repeat(survey, &groups[b], repeat(survey, group, t));
                let other = partner[a].and_then(|b| Some(first[b] + of(b)?));
                for t in [Some(own), other].into_iter().flatten() {
                    taken[t] = true;
                }
                pairs.push(Pair::new(gathered, own, other));
            }
        }
        Some(Self { pairs, partner })
    }

    /// Values that belong to the cells of all traces, both together and one against the other, pair by pair.
    pub fn combined(&self, of_traces: &[Vec<f64>]) -> [Vec<Vec<f64>>; 2] {
        SIGNS.map(|sign| {
            let of = |pair: &Pair| pair.combined(of_traces, sign);
            self.pairs.iter().map(of).collect()
        })
    }

    /// Contrasts between the repeats of weighted residuals, both together and one against the other.
    pub fn contrasts(
        &self,
        survey: &Survey,
        weighted: &[Vec<f64>],
        ones: &[f64],
    ) -> [Contrasts; 2] {
        let mut contrasts = [Contrasts::default(), Contrasts::default()];
        for (a, partner) in self.partner.iter().enumerate() {
            let Some(b) = partner.filter(|b| *b > a) else {
                continue;
            };
            let groups = [&survey.repeats[a], &survey.repeats[b]];
            let cells = matched(&groups[0].positions, &groups[1].positions);
            let both: Vec<[Vec<f64>; 2]> = (0..groups[0].traces.len())
                .filter_map(|t| {
                    let other = of_repeat(survey, groups[1], repeat(survey, groups[0], t))?;
                    Some([
                        survey.cell_means(groups[0], t, weighted),
                        survey.cell_means(groups[1], other, weighted),
                    ])
                })
                .collect();
            let is_read =
                |c: &&[usize; 2]| both.iter().all(|m| (m[0][c[0]] + m[1][c[1]]).is_finite());
            let cells: Vec<[usize; 2]> = cells.iter().filter(is_read).copied().collect();
            let positions: Vec<f64> = cells.iter().map(|c| groups[0].positions[c[0]]).collect();
            let one = 0.5 * (ones[groups[0].channel] + ones[groups[1].channel]);
            for (own, sign) in contrasts.iter_mut().zip(SIGNS) {
                let row = |m: &[Vec<f64>; 2]| {
                    let both = |c: &[usize; 2]| {
                        (m[0][c[0]] + sign * m[1][c[1]]) * std::f64::consts::FRAC_1_SQRT_2
                    };
                    cells.iter().map(both).collect::<Vec<f64>>()
                };
                own.add(&positions, &both.iter().map(row).collect::<Vec<_>>(), one);
            }
        }
        contrasts
    }
}

/// The number of a group's trace.
fn repeat(survey: &Survey, group: &Group, trace: usize) -> u32 {
    survey.traces[group.channel][group.traces[trace]].repeat
}

/// Which of a group's traces has this number.
fn of_repeat(survey: &Survey, group: &Group, number: u32) -> Option<usize> {
    (0..group.traces.len()).find(|t| repeat(survey, group, *t) == number)
}

/// Whether two opposite indicators read both groups in the same passes: at one position of the spindle, in one direction, at the
/// same places, with noise that counts alike.
fn are_read_together(survey: &Survey, a: &Group, b: &Group, weights: &[f64]) -> bool {
    let is_back = |g: &Group| {
        g.traces
            .first()
            .map(|t| survey.traces[g.channel][*t].backward)
    };
    let common = matched(&a.positions, &b.positions).len() as f64;
    let least = a.positions.len().max(b.positions.len()) as f64;
    let ratio = weights[a.channel] / weights[b.channel];
    survey.seats[a.channel].is_opposite(&survey.seats[b.channel])
        && is_back(a) == is_back(b)
        && common >= SHARED * least
        && ratio.max(1.0 / ratio) < ALIKE
}

/// Which of growing positions are the same places.
pub fn matched(a: &[f64], b: &[f64]) -> Vec<[usize; 2]> {
    let travel = |x: &[f64]| x.last().unwrap_or(&0.0) - x.first().unwrap_or(&0.0);
    let spacing = travel(a) / (a.len().max(2) - 1) as f64;
    let (mut i, mut j, mut pairs) = (0, 0, Vec::new());
    while i < a.len() && j < b.len() {
        if (a[i] - b[j]).abs() <= SAME_PLACE * spacing {
            pairs.push([i, j]);
            (i, j) = (i + 1, j + 1);
        } else if a[i] < b[j] {
            i += 1;
        } else {
            j += 1;
        }
    }
    pairs
}
