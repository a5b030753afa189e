//! Channels that are read at positions of their own, and positions that are unevenly apart.

use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use errsep_models::reversal::simultaneous::{Options, fit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::plan::{LENGTH, true_forms};

const NOISE: f64 = 0.05;
const SEEDS: u64 = 8;

/// Waves of 1 µm in slide and sides, of up to twelve half periods, at 31 positions.
fn plan(seed: u64, of_their_own: bool) -> Plan {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut form = || TrueForm::random_waves(&mut random, 1.0, 1.5 * LENGTH, 16);
    let mut plan = Plan {
        m: form(),
        s_a: form(),
        s_b: form(),
        seed,
        repeats: 3,
        ..Plan::even(0.0, LENGTH, 31, NOISE)
    };
    let mut shared: Vec<f64> = (0..31).map(|_| random.random_range(0.0..LENGTH)).collect();
    shared.sort_by(f64::total_cmp);
    for trace in &mut plan.traces {
        if of_their_own {
            let apart = LENGTH / 30.0;
            for x in &mut trace.positions[1..30] {
                *x += random.random_range(-0.4..0.4) * apart;
            }
        } else {
            trace.positions.clone_from(&shared);
        }
    }
    plan
}

/// *Simulated truth*, eight seeds: nothing is put in, and the fit does not say that model and readings disagree but in one of
/// eight (at 0.01 two of eight are had in 0.3 % of suites); forms that end at three positions a cell are denied in most. Errors of
/// the slide over their uncertainties, in the root mean square of all positions and seeds, are at most 1.3: 248 values of
/// which some thirty are independent tell it to 13 %.
fn is_told(of_their_own: bool) {
    let (mut denied, mut squares, mut count) = (0, 0.0, 0.0);
    for seed in 1..=SEEDS {
        let plan = plan(seed, of_their_own);
        let (readings, truth) = simulate(&plan, &[]).unwrap();
        let found = fit(&readings, &Options::default()).unwrap();
        denied += usize::from(found.agreement.disagree == Some(true));
        let x = &plan.traces[0].positions;
        let slide = &found.forms(x)[0];
        for (k, x) in x.iter().enumerate() {
            let off = slide.values[k] - true_forms(&truth)[0].at(*x);
            squares += (off / slide.std[k]).powi(2);
            count += 1.0;
        }
    }
    assert!(denied <= 1, "{denied} of {SEEDS}");
    let ratio = f64::sqrt(squares / count);
    assert!(ratio < 1.3, "{ratio}");
}

#[test]
fn channels_at_positions_of_their_own_tell_forms_between_them() {
    is_told(true);
}

#[test]
fn uneven_positions_tell_forms_where_they_are_close() {
    is_told(false);
}

/// *Property* of 24 sets: forms rougher than the positions tell, a sixth of the travel without readings. The criterion may choose knots
/// which leave a tilt open; the fit is then made on fewer, and says that forms have more detail. One of these sets had no answer.
#[test]
fn knots_that_leave_a_tilt_open_give_way_to_fewer() {
    let positions = 120;
    for seed in 0..24 {
        let mut random = ChaCha8Rng::seed_from_u64(40 + seed);
        let mut form = || TrueForm::random_waves(&mut random, 1.0, 0.2 * LENGTH, 8);
        let mut plan = Plan {
            m: form(),
            s_a: form(),
            s_b: form(),
            seed,
            repeats: 2,
            ..Plan::even(0.0, LENGTH, positions, 0.02)
        };
        for trace in &mut plan.traces {
            for x in &mut trace.positions {
                *x += random.random_range(-0.49..0.49) * LENGTH / (positions - 1) as f64;
            }
            trace
                .positions
                .retain(|x| !(LENGTH / 3.0..LENGTH / 2.0).contains(x));
        }
        let (readings, _) = simulate(&plan, &[]).unwrap();
        let found =
            fit(&readings, &Options::default()).unwrap_or_else(|why| panic!("{seed}: {why}"));
        assert!(
            found.tilts().iter().all(|tilt| tilt.angle.std < 1e-5),
            "{seed}"
        );
    }
}
