//! Errors of the simultaneous solution over many seeds against the Cramér–Rao bound, and how often
//! the stated 95 % intervals hold the truth.
//!
//! `cargo run --release -p errsep-campaigns --bin reversal_coverage [SEEDS]`
//!
//! The bound is the covariance at the truth with the true noise: that of a fit to noise-free
//! readings with the noise declared.

use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::reversal::simulate::{Plan, TrueForm, even_grid, simulate};
use errsep_models::reversal::simultaneous::{Knots, Noise, Options, Simultaneous, Thickness, fit};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const NOISE: f64 = 0.05;
const THICKNESS: f64 = 42.0;

#[derive(Default, Clone)]
struct Tally {
    against_bound: f64,
    inside: f64,
    count: f64,
}

impl Tally {
    fn add(&mut self, error: f64, bound: f64, stated: f64) {
        self.against_bound += (error / bound).powi(2);
        self.inside += f64::from(u8::from(error.abs() < 1.959_963_985 * stated));
        self.count += 1.0;
    }

    fn line(&self, name: &str) {
        println!(
            "| {name:<6} | {:>6} | {:>8.4} | {:>8.2} % |",
            self.count,
            (self.against_bound / self.count).sqrt(),
            100.0 * self.inside / self.count
        );
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(500), |s| s.parse())?;
    let basis = CubicBSpline::uniform(0.0, 300.0, 15)?;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut plan = Plan::even(0.0, 300.0, 200, 0.0);
    plan.m = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_a = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_b = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    (plan.alpha_rad, plan.beta_rad, plan.gamma_rad) = (120e-6, -80e-6, 900e-6);
    plan.thickness_mm = THICKNESS;
    let options = |noise| Options {
        thickness: Thickness::Known(THICKNESS),
        noise,
        knots: Knots::At(basis.breaks().to_vec()),
        ..Options::default()
    };
    let (exact, truth) = simulate(&plan, &[])?;
    let bound = fit(&exact, &options(Noise::Declared(NOISE)))?;
    let x = even_grid(0.0, 300.0, 61);
    let forms = |solution: &Simultaneous| solution.forms(&x);
    let (bound_tilts, bound_forms) = (bound.tilts(), forms(&bound));
    let true_tilts = [truth.alpha_rad, truth.beta_rad, truth.gamma_rad];
    let true_forms = [&truth.m, &truth.s_a, &truth.s_b];

    for trace in &mut plan.traces {
        trace.noise = NOISE;
    }
    let mut tallies = vec![Tally::default(); 6];
    for seed in 0..seeds {
        plan.seed = 10_000 + seed;
        let solution = fit(&simulate(&plan, &[])?.0, &options(Noise::Estimated))?;
        for (j, tilt) in solution.tilts().iter().enumerate() {
            let error = tilt.angle.value - true_tilts[j];
            tallies[j].add(error, bound_tilts[j].angle.std, tilt.angle.std);
        }
        for (f, profile) in forms(&solution).iter().enumerate() {
            for (k, x) in x.iter().enumerate() {
                let error = profile.values[k] - true_forms[f].at(*x);
                tallies[3 + f].add(error, bound_forms[f].std[k], profile.std[k]);
            }
        }
    }
    println!(
        "{seeds} seeds, 4 x 200 readings, 15 cells, noise {NOISE} um, thickness {THICKNESS} mm"
    );
    println!("| what   | values | rms/CRB  | in 95 %    |");
    println!("|--------|--------|----------|------------|");
    for (tally, name) in tallies
        .iter()
        .zip(["alpha", "beta", "gamma", "M", "S_A", "S_B"])
    {
        tally.line(name);
    }
    Ok(())
}
