//! Plans with known truth, and what the tests ask of a solution.

use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::reversal::simulate::{GaugedForm, Plan, TrueForm, Truth};
use errsep_models::reversal::simultaneous::{Knots, Noise, Options, Simultaneous, Thickness};
use errsep_models::reversal::staged;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

pub const LENGTH: f64 = 300.0;

/// Spline forms of 1 µm on equal cells, four traces of n readings.
pub fn spline_plan(cells: usize, n: usize, noise: f64, seed: u64) -> (Plan, CubicBSpline) {
    let basis = CubicBSpline::uniform(0.0, LENGTH, cells).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(4 + cells as u64);
    let mut plan = Plan::even(0.0, LENGTH, n, noise);
    plan.m = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_a = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.s_b = TrueForm::random_spline(&mut rng, basis.clone(), 1.0);
    plan.alpha_rad = 120e-6;
    plan.beta_rad = -80e-6;
    plan.gamma_rad = 900e-6;
    plan.thickness_mm = 42.0;
    for (i, trace) in plan.traces.iter_mut().enumerate() {
        trace.offset = 3.0 - 2.0 * i as f64;
    }
    plan.seed = seed;
    (plan, basis)
}

pub fn options(basis: &CubicBSpline, thickness_mm: f64, noise: Noise) -> Options {
    Options {
        thickness: Thickness::Known(thickness_mm),
        noise,
        knots: Knots::At(basis.breaks().to_vec()),
        ..Options::default()
    }
}

pub fn tilt(solution: &Simultaneous, name: &str) -> staged::Value {
    solution
        .tilts()
        .iter()
        .find(|t| t.name == name)
        .unwrap_or_else(|| panic!("no {name} among {:?}", solution.tilts()))
        .angle
}

pub fn truths(truth: &Truth) -> [(&'static str, f64); 3] {
    [
        ("alpha", truth.alpha_rad),
        ("beta", truth.beta_rad),
        ("gamma", truth.gamma_rad),
    ]
}

pub fn true_forms(truth: &Truth) -> [&GaugedForm; 3] {
    [&truth.m, &truth.s_a, &truth.s_b]
}
