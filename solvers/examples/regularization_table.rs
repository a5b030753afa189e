//! Every rule that chooses λ on six classical ill-posed problems at six levels of noise.
//!
//! Prints the table of docs/validation/regularization.md:
//! `cargo run --release -p errsep-solvers --example regularization_table`.

use errsep_solvers::regularization::{
    CornerStatus, Decomposition, Family, RegularizationError, Spectrum, discrepancy, gcv, l_curve,
    likelihood, periodogram,
};
use errsep_standard_problems::ill_posed as problems;
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const UNKNOWNS: usize = 64;
const DRAWS: u64 = 20;
const RULES: [&str; 6] = [
    "L-curve",
    "GCV",
    "likelihood",
    "discrepancy",
    "periodogram",
    "best truncation",
];

fn main() -> Result<(), RegularizationError> {
    println!(
        "| problem | noise | error at the best λ | {} | corners |",
        RULES.join(" | ")
    );
    println!("|---|---|---|{}---|", "---|".repeat(RULES.len()));
    for problem in problems::all(UNKNOWNS) {
        let decomposition = Decomposition::standard(&problem.matrix)?;
        let size = problem.solution.norm();
        for level in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
            let noise = level * problem.data.norm() / (UNKNOWNS as f64).sqrt();
            let mut ratios: [Vec<f64>; RULES.len()] = Default::default();
            let mut least = Vec::new();
            let mut statuses = Vec::new();
            for seed in 0..DRAWS {
                let mut generator = ChaCha8Rng::seed_from_u64(seed);
                let draw = DVector::from_fn(UNKNOWNS, |_, _| -> f64 {
                    StandardNormal.sample(&mut generator)
                });
                let spectrum = decomposition.with_data(&(&problem.data + noise * draw))?;
                let error = |x: &DVector<f64>| (x - &problem.solution).norm();
                let best = best_error(&spectrum, error)?;
                least.push(best / size);
                let curve = l_curve(&spectrum)?;
                statuses.push(curve.status);
                let lambdas = [
                    curve.lambda(),
                    Some(gcv(&spectrum)?.point.lambda),
                    Some(likelihood(&spectrum)?.point.lambda),
                    discrepancy(&spectrum, noise)?.lambda(),
                    Some(periodogram(&spectrum)?.lambda),
                ];
                for (ratio, lambda) in ratios.iter_mut().zip(lambdas) {
                    if let Some(lambda) = lambda {
                        ratio.push(error(&spectrum.solution(lambda)?) / best);
                    }
                }
                let truncated = (0..=UNKNOWNS)
                    .map(|kept| error(&spectrum.truncated(kept)))
                    .fold(f64::INFINITY, f64::min);
                ratios[RULES.len() - 1].push(truncated / best);
            }
            least.sort_by(f64::total_cmp);
            println!(
                "| {} | {level:.0e} | {:.1e} | {} | {} |",
                problem.name,
                least[least.len() / 2],
                ratios.map(summary).join(" | "),
                tally(&statuses),
            );
        }
    }
    Ok(())
}

/// The least error over a fine grid of λ, reaching beyond the range on the smooth side.
fn best_error(
    spectrum: &Spectrum<'_>,
    error: impl Fn(&DVector<f64>) -> f64,
) -> Result<f64, RegularizationError> {
    let (smallest, largest) = spectrum.range();
    (0..400)
        .map(|k| smallest * (10.0 * largest / smallest).powf(f64::from(k) / 399.0))
        .map(|lambda| spectrum.solution(lambda).map(|x| error(&x)))
        .try_fold(f64::INFINITY, |least, next| Ok(least.min(next?)))
}

/// Median and worst, and how many draws had an answer when not all.
fn summary(mut ratios: Vec<f64>) -> String {
    ratios.sort_by(f64::total_cmp);
    match (ratios.get(ratios.len() / 2), ratios.last()) {
        (Some(median), Some(worst)) => {
            let worst = if *worst < 1e3 {
                format!("{worst:.1}")
            } else {
                format!("{worst:.0e}")
            };
            let answered = if ratios.len() as u64 == DRAWS {
                String::new()
            } else {
                format!(" ({} of {DRAWS})", ratios.len())
            };
            format!("{median:.2}, {worst}{answered}")
        }
        _ => "none".to_owned(),
    }
}

fn tally(statuses: &[CornerStatus]) -> String {
    [
        (CornerStatus::Corner, "one"),
        (CornerStatus::MultipleCorners, "several"),
        (CornerStatus::AtEdge, "at the edge"),
        (CornerStatus::NoCorner, "none"),
    ]
    .into_iter()
    .filter_map(|(status, word)| {
        let count = statuses.iter().filter(|s| **s == status).count();
        (count > 0).then(|| format!("{count} {word}"))
    })
    .collect::<Vec<_>>()
    .join(", ")
}
