//! Readings whose single outlying values are pulled in, and what tells how far.

use errsep_models::model::{AnyModel, FittedModel};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::detection::estimate::estimate;
use crate::detection::space::Space;
use crate::noise::law::{NoiseLaw, NoiseSource, SEED};
use crate::noise::spikes::{Calmed, Residual, Spikes, Tails};

/// Sets of noise with heavy tails of which neighbours are asked.
const SETS: usize = 8;

/// Where spikes of a model's readings are looked for.
pub(crate) fn spikes(model: &AnyModel) -> Spikes {
    Spikes::new(model, || {
        let white = NoiseLaw::white(1.0, f64::INFINITY, NoiseSource::Stated);
        let space = Space::beside_free_profiles(model, &white);
        Residual {
            freedom: space.degrees_of_freedom(),
            of: Box::new(move |readings| space.forward_vector(readings)),
        }
    })
}

/// The same for draws of a law with heavy tails; nothing where it has none.
pub(crate) fn spikes_of_draws(model: &AnyModel, law: &NoiseLaw) -> Option<Spikes> {
    law.has_tails().then(|| spikes(model))
}

/// Readings with their spikes pulled in, and the law of heavy tails where they have them.
pub(crate) fn calm(model: &AnyModel, spikes: &Spikes, readings: &DVector<f64>) -> Calmed {
    let calmed = spikes.calmed(model, readings);
    Calmed {
        tails: calmed
            .tails
            .map(|tails| beside_neighbours(model, spikes, tails)),
        ..calmed
    }
}

/// The same law with what neighbours tell of its noise, where it is they that tell.
fn beside_neighbours(model: &AnyModel, spikes: &Spikes, tails: Tails) -> Tails {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let mut told = 0.0;
    for _ in 0..SETS {
        let Some(mut noise) = tails.draw(model, &mut random) else {
            return tails;
        };
        spikes.pull_in(&mut noise);
        let law = estimate(model, &noise);
        if law.source != NoiseSource::Neighbours {
            return tails;
        }
        told += law.parts.white / SETS as f64;
    }
    Tails {
        by_neighbours: tails.variance / told,
        ..tails
    }
}

/// A model fitted to readings whose spikes are pulled in, where there are any, and what was done.
pub(crate) fn calmed(model: &AnyModel) -> (Option<AnyModel>, Calmed) {
    let readings = model.linearised();
    let spikes = spikes(model);
    let calm = calm(model, &spikes, &readings);
    let changed =
        (calm.count > 0).then(|| model.refit(model.observed() + (&calm.readings - &readings)));
    (changed, calm)
}

#[cfg(test)]
mod tests {
    use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
    use errsep_models::reversal::exact_readings::{Scene, SceneNoise};
    use rand_distr::{Distribution, StandardNormal, StudentT};

    use super::*;

    fn model(repeats: u32, both_directions: bool) -> AnyModel {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let scene = Scene {
            both_directions,
            ..Scene::random(100, repeats, 1e-5, 2.0, SceneNoise::default(), &mut random)
        };
        AnyModel::new(&Linearised::new(&scene.exact(), Assumptions::default()).unwrap())
    }

    /// *Simulated truth*: Student's noise with three degrees of freedom is told from normal noise with two repeats and with
    /// one, there and back; and its scale within 30 %: what is pulled in of noise of unit scale differs by a fifth
    /// between the 2.5 and 4 degrees of freedom that are told of it.
    #[test]
    fn heavy_tails_are_told_without_three_repeats() {
        for (repeats, both) in [(2, true), (2, false), (1, true)] {
            let model = model(repeats, both);
            let sought = spikes(&model);
            let n = model.observed().len();
            let mut random = ChaCha8Rng::seed_from_u64(8);
            let student = StudentT::new(3.0).unwrap();
            for round in 0..4 {
                let heavy = DVector::from_fn(n, |_, _| student.sample(&mut random));
                let calm = calm(&model, &sought, &heavy);
                let tails = calm.tails.expect("heavy tails");
                assert!((2.0..=6.0).contains(&tails.freedom), "{tails:?}");
                let law = estimate(&model, &calm.readings).with_tails(calm.tails);
                let ratio = (law.parts.white / tails.variance).sqrt();
                assert!(
                    (ratio - 1.0).abs() < 0.3,
                    "{repeats} {both} {round}: {ratio}"
                );
                let normal = DVector::from_fn(n, |_, _| StandardNormal.sample(&mut random));
                let calm = self::calm(&model, &sought, &normal);
                assert_eq!(calm.tails, None, "{repeats} {both} {round}");
                assert!(calm.count < 5, "{}", calm.count);
            }
        }
    }

    /// *k·u*: of few readings one or two are beyond three standard deviations often enough by chance. Normal noise of a pass
    /// is told to have heavy tails in one of 40 measurements; more than four have a probability of 0.3 %.
    #[test]
    fn normal_noise_of_one_pass_has_no_heavy_tails() {
        for positions in [61, 121] {
            let mut random = ChaCha8Rng::seed_from_u64(3);
            let noise = SceneNoise::default();
            let scene = Scene {
                both_directions: false,
                ..Scene::random(positions, 1, 1e-5, 2.0, noise, &mut random)
            };
            let model = Linearised::new(&scene.exact(), Assumptions::default()).unwrap();
            let model = AnyModel::new(&model);
            let sought = spikes(&model);
            let n = model.observed().len();
            let told = (0..40).filter(|seed| {
                let mut random = ChaCha8Rng::seed_from_u64(*seed);
                let normal = DVector::from_fn(n, |_, _| StandardNormal.sample(&mut random));
                sought.calmed(&model, &normal).tails.is_some()
            });
            let told = told.count();
            assert!(told <= 4, "{told} of 40, {positions} positions");
        }
    }

    /// *Simulated truth*: of readings taken once, a single one that is off is pulled in to the noise; what both directions
    /// show is left.
    #[test]
    fn a_spike_is_told_by_what_the_fit_leaves() {
        let model = model(1, true);
        let sought = spikes(&model);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let n = model.observed().len();
        let noise = DVector::from_fn(n, |_, _| StandardNormal.sample(&mut random));
        let mut off = noise.clone();
        off[340] += 30.0;
        assert_eq!(sought.pull_in(&mut off), 1);
        // Four standard deviations of what the fit leaves, over the 5/8 of it that is left, and its own.
        assert!((off[340] - noise[340]).abs() < 10.0, "{}", off[340]);
        let mut grain = noise.clone();
        let cell = model.places()[340].cell;
        for row in (0..n).filter(|row| model.places()[*row].cell == cell) {
            grain[row] += 30.0;
        }
        let before = grain.clone();
        sought.pull_in(&mut grain);
        assert!((grain - before).amax() < 1e-12);
    }
}
