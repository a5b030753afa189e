//! Bands of forms on knots that the data choose, beside much noise and at few positions.

use errsep_models::reversal::designs::simulate::{DesignPlan, simulate};
use errsep_models::reversal::designs::{Design, DesignOptions, fit};

const EIGHT: &str = "0/0,180/0,90/0,270/0,0/180,180/180,90/180,270/180";
const NEAR_AND_FAR: &str = "0/0,0/90,0/180,0/270,180/0,180/90,180/180,180/270";

/// What is measured: channels, positions and noise of a reading, µm.
struct Case {
    design: &'static str,
    positions: usize,
    noise_um: f64,
}

/// Part of the places in which forms that are told by themselves lie within 1.97 standard uncertainties, the number of
/// places, and the noise that is told over that of the readings, root mean square.
fn within(case: &Case, seeds: u64) -> [f64; 3] {
    let (mut inside, mut count, mut noise) = (0.0, 0.0, 0.0);
    for seed in 0..seeds {
        let plan = DesignPlan {
            forms_um: [1.5, 1.5],
            noise_um: case.noise_um,
            positions: case.positions,
            seed,
            ..DesignPlan::of(Design::parse(case.design).unwrap())
        };
        let (readings, truth) = simulate(&plan).unwrap();
        let found = fit(&readings, &DesignOptions::default()).unwrap();
        noise += (found.noise_um / case.noise_um).powi(2) / seeds as f64;
        let x = plan.x();
        let x: Vec<f64> = (0..9).map(|k| x[k * (x.len() - 1) / 8]).collect();
        for form in found.forms(&x).iter().filter(|form| form.alone) {
            let own = match form.side {
                None => &truth.slide[usize::from(form.name == "M_v")],
                Some(side) => {
                    let at = readings.design.sides().iter().position(|s| *s == side);
                    &truth.sides[at.unwrap()]
                }
            };
            for ((x, value), std) in x.iter().zip(&form.values).zip(&form.std) {
                inside += f64::from(u8::from((value - own.at(*x)).abs() < 1.97 * std));
                count += 1.0;
            }
        }
    }
    [inside / count, count, noise.sqrt()]
}

/// *Simulated truth*: where the noise is as great as the forms, few knots are taken, and what they cut off is as much in the
/// bands as where it is small.
#[test]
fn what_few_knots_cut_off_is_in_the_bands() {
    for noise_um in [1.0, 0.3] {
        let case = Case {
            design: EIGHT,
            positions: 61,
            noise_um,
        };
        let [share, count, _] = within(&case, 60);
        // k·u: neighbouring places share cells, so that a third of them count; one standard deviation, as bands without what
        // finer cells may hide hold 93 %.
        let off = f64::sqrt(0.95 * 0.05 / (count / 3.0));
        assert!(share > 0.95 - off, "{noise_um} µm: {share}");
    }
}

/// *Simulated truth*: at few positions the channels still tell the noise where they close whatever the forms are, and forms
/// that are smoothed away are not told as noise.
#[test]
fn forms_at_few_positions_are_no_noise() {
    for (design, positions) in [(EIGHT, 7), (EIGHT, 11), (NEAR_AND_FAR, 11)] {
        let case = Case {
            design,
            positions,
            noise_um: 0.05,
        };
        let [share, count, noise] = within(&case, 40);
        // Forms that are smoothed away make it five times as great; 40 fits with ten degrees of freedom tell it to 4 %.
        assert!((noise - 1.0).abs() < 0.16, "{positions} positions: {noise}");
        let off = 4.0 * f64::sqrt(0.95 * 0.05 / (count / 3.0));
        assert!(share > 0.95 - off, "{positions} positions: {share}");
    }
}
