use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::reversal::Convention;
use crate::reversal::simulate::{Plan, TrueForm, simulate};
use crate::reversal::simultaneous::ground::Ground;
use crate::reversal::simultaneous::options::{Options, Thickness};

/// A campaign of its own: grids, tilts, forms, noise and channels drawn.
fn campaign(seed: u64) -> (Plan, Options) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let noise = 10.0_f64.powf(rng.random_range(-2.5..0.0));
    let range = 10.0_f64.powf(rng.random_range(1.5..3.3));
    let from = rng.random_range(-500.0..500.0);
    let mut plan = Plan::even(from, from + range, rng.random_range(12..120), noise);
    let mut tilt = || 10.0_f64.powf(rng.random_range(-5.0..-1.0));
    (plan.alpha_rad, plan.beta_rad, plan.gamma_rad) = (tilt(), -tilt(), tilt());
    plan.thickness_mm = if seed.is_multiple_of(3) { 0.0 } else { 42.0 };
    let mut form = |longest: f64| {
        let (rms, count) = (rng.random_range(0.0..8.0), rng.random_range(1..9));
        TrueForm::random_waves(&mut rng, rms, longest, count)
    };
    (plan.m, plan.s_a, plan.s_b) = (form(2.0 * range), form(range), form(range));
    if seed.is_multiple_of(4) {
        plan.repeats = 2;
    }
    if seed.is_multiple_of(5) {
        for trace in &mut plan.traces {
            let step = range / trace.positions.len() as f64;
            for x in &mut trace.positions {
                *x += rng.random_range(-0.3..0.3) * step;
            }
        }
    }
    // Without one channel, or without both of one spindle position.
    match seed % 7 {
        1 => drop(plan.traces.remove(rng.random_range(0..4))),
        2 => plan.traces.truncate(2),
        _ => {}
    }
    let options = Options {
        convention: if seed.is_multiple_of(2) {
            Convention::Seed
        } else {
            Convention::Rigid
        },
        thickness: match plan.thickness_mm {
            0.0 => Thickness::NotKnown,
            mm => Thickness::Known(mm),
        },
        ..Options::default()
    };
    (plan, options)
}

/// *Definition*: the ladder goes as far as the positions carry that all channels share, and to a third of those of a channel;
/// farther only as long as the variances of the tilts stay.
#[test]
fn rungs_end_where_positions_carry_no_finer_one() {
    let grid: Vec<f64> = (0..60).map(f64::from).collect();
    let beside: Vec<f64> = grid.iter().map(|x| x + 0.3).collect();
    let twice: Vec<f64> = grid.iter().flat_map(|x| [*x; 2]).collect();
    let most = |channels: &[&Vec<f64>], variances: &dyn Fn(usize) -> Option<Vec<f64>>| {
        let carried = Carried::by(
            channels.iter().map(|x| x.as_slice()).collect(),
            Finest::Carried,
        );
        let equal = |cells: usize| {
            let range = [grid[0], grid[grid.len() - 1]];
            breaks::breaks(&[&grid], range, cells, |_| true)
        };
        (1..200)
            .take_while(|cells| carried.carries(*cells, equal, variances))
            .count()
    };
    let none = |_: usize| None;
    assert_eq!(most(&[&grid, &twice, &grid], &none), 57);
    assert_eq!(most(&[&grid, &beside], &none), 20);
    assert_eq!(most(&[&grid[..40].to_vec(), &grid], &none), 37);
    let rising = |cells: usize| Some(vec![1.0, if cells > 45 { 2.3 } else { 2.2 }]);
    assert_eq!(
        most(&[&grid, &beside], &|cells| {
            let coarse = (cells == 5).then(|| vec![1.0, 1.0]);
            coarse.or_else(|| rising(cells))
        }),
        45
    );
    // As many as places of all channels together, less three.
    assert_eq!(most(&[&grid, &beside], &|_| Some(vec![1.0, 1.0])), 117);
}

#[test]
fn normal_equations_choose_the_knots_that_orthogonal_factors_choose() {
    let (mut by_moments, mut compared) = (0, 0);
    let campaigns = 300;
    for seed in 0..campaigns {
        let (plan, options) = campaign(seed);
        let (data, _) = simulate(&plan, &[]).unwrap();
        let channels = ChannelReadings::sort(&data);
        let weights = vec![1.0 / plan.traces[0].noise; channels.len()];
        let ground = Ground::new(&data, &options, [&channels; 2], weights).unwrap();
        let choice = ground.choice(None);
        let of = |coefficients: usize| ground.unknowns(coefficients, None);
        let rungs = choice.rungs(&of).unwrap();
        let exact = |unknowns: Unknowns, bases: Vec<CubicBSpline>| {
            let own = rungs.solve(&unknowns, &bases);
            let own = own.and_then(|linear| rungs.squares(&linear));
            let left = choice.by_factors(unknowns, bases)?;
            if let (Some(own), Some((left, _))) = (own, &left) {
                compared += 1;
                // Epsilons: the rounding of the sum itself, and that of the factorisation beside it.
                let off = (own.left - left).abs();
                assert!(
                    off <= own.rounding + 1e-12 * left,
                    "campaign {seed}: {off:e}, told {:e} of {left:e}",
                    own.rounding
                );
            }
            Ok(left.map(|(left, curves)| {
                let (rounding, linear) = (0.0, None);
                (Squares { left, rounding }, RungFit { curves, linear })
            }))
        };
        let exact = choice.climb(&of, exact).unwrap();
        if let Some(own) = choice.by_moments(&of).unwrap() {
            by_moments += 1;
            assert_eq!(own.cells(), exact.cells(), "campaign {seed}");
            let counts = |table: &[KnotTrial]| -> Vec<_> {
                table.iter().map(|t| (t.cells, t.unknowns)).collect()
            };
            assert_eq!(counts(&own.table), counts(&exact.table), "campaign {seed}");
        }
    }
    // Truncation: one of twenty may be left to the orthogonal factors.
    assert!(
        20 * by_moments >= 19 * campaigns,
        "{by_moments} of {campaigns}"
    );
    assert!(compared > 6 * campaigns, "{compared} rungs");
}
