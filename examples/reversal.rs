//! A reversal as a library call: the tilts with uncertainty and the form of the slide with its band.

use errsep_models::basis::bspline::CubicBSpline;
use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use errsep_models::reversal::simultaneous::{Options, Thickness, fit};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Readings as one would have them from a file: here of a machine with known truth.
    let mut plan = Plan::even(0.0, 300.0, 151, 0.05);
    let form = CubicBSpline::uniform(0.0, 300.0, 12)?;
    plan.m = TrueForm::random_spline(&mut ChaCha8Rng::seed_from_u64(1), form, 1.0);
    (plan.alpha_rad, plan.thickness_mm) = (40e-6, 42.0);
    let (observations, _) = simulate(&plan, &[])?;

    let solution = fit(
        &observations,
        &Options {
            thickness: Thickness::Known(42.0),
            ..Options::default()
        },
    )?;
    for tilt in solution.tilts() {
        println!(
            "{:<6} {:>8.4} ± {:.4} µrad",
            tilt.name,
            1e6 * tilt.angle.value,
            1e6 * tilt.angle.std
        );
    }
    for profile in solution.forms(&[0.0, 150.0, 300.0]) {
        for ((x, value), std) in profile.x.iter().zip(&profile.values).zip(&profile.std) {
            println!(
                "{:<4} at {x:>5} mm: {value:>7.4} ± {std:.4} µm",
                profile.name
            );
        }
    }
    Ok(())
}
