//! Repeats in which single readings are missing: heights of the repeats, and what would have been read.

/// Readings of one place, a value a repeat, none where it is missing.
pub type Row = [Option<f64>];

/// Heights z_j of the repeats, of which the sum is zero, in the unit of the readings: least squares of
/// x_ij = a_i + z_j over the readings that are there. The places a_i are eliminated,
///
/// Σ_i (z_j − z̄_i) = Σ_i (x_ij − x̄_i) over the rows i that have repeat j, means over the repeats of a row,
///
/// and conjugate gradients solve what is left: in one step where nothing is missing, in as many as there are repeats
/// at most. Each row is as long as there are repeats.
pub fn heights<'a>(rows: impl Iterator<Item = &'a Row> + Clone, repeats: usize) -> Vec<f64> {
    // What all repeats share is no height, and rounding must not bring it in.
    let mut left = centred(apart(rows.clone(), repeats, |_, value| value));
    let mut heights = vec![0.0; repeats];
    let mut along = left.clone();
    let mut squares = dot(&left, &left);
    let enough = f64::EPSILON.powi(2) * squares;
    for _ in 0..repeats {
        let pushed = apart(rows.clone(), repeats, |repeat, _| along[repeat]);
        let curvature = dot(&along, &pushed);
        if !(squares > enough) || !(curvature > 0.0) {
            break;
        }
        let step = squares / curvature;
        for repeat in 0..repeats {
            heights[repeat] += step * along[repeat];
            left[repeat] -= step * pushed[repeat];
        }
        left = centred(left);
        let next = dot(&left, &left);
        for (along, left) in along.iter_mut().zip(&left) {
            *along = left + next / squares * *along;
        }
        squares = next;
    }
    centred(heights)
}

fn centred(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.iter_mut().for_each(|v| *v -= mean);
    values
}

/// Sum over the rows, for each repeat, of its value less the mean of its row.
pub(crate) fn apart<'a>(
    rows: impl Iterator<Item = &'a Row>,
    repeats: usize,
    value: impl Fn(usize, f64) -> f64,
) -> Vec<f64> {
    let mut sums = vec![0.0; repeats];
    for row in rows {
        let there = || {
            let cells = row.iter().enumerate();
            cells.filter_map(|(repeat, x)| Some((repeat, value(repeat, (*x)?))))
        };
        let (count, sum) = there().fold((0.0, 0.0), |(n, sum), (_, v)| (n + 1.0, sum + v));
        for (repeat, v) in there() {
            sums[repeat] += v - sum / count;
        }
    }
    sums
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The readings with what is missing filled in as a_i + z_j, a_i the mean of a row less the heights z of the repeats:
/// with those of least squares ([`heights`]) means over the repeats are those of the fit (F. Yates, Empire J. Exp.
/// Agric. 1, 1933), of variance σ²/n_i for n_i readings of a row, but for the little that the heights add. None where a
/// row has no reading.
pub fn filled(rows: &[Vec<Option<f64>>], heights: &[f64]) -> Option<Vec<Vec<f64>>> {
    rows.iter()
        .map(|row| {
            let there = row.iter().zip(heights);
            let freed = there.filter_map(|(x, z)| Some((*x)? - z));
            let (count, sum) = freed.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v));
            let cells = row.iter().zip(heights);
            (count > 0.0).then(|| cells.map(|(x, z)| x.unwrap_or(sum / count + z)).collect())
        })
        .collect()
}
