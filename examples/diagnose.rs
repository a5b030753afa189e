//! A diagnosis as a library call: what a fitted reversal misses, which effect causes it, how far the
//! gap shrinks, and what could still hide.

use errsep::diagnosis::{Options, diagnose};
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::exact_readings::{Injection, Scene, SceneNoise};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Readings as one would have them from a file: here of a machine with a known lost motion.
    let noise = SceneNoise {
        white: 0.05,
        ..SceneNoise::default()
    };
    let mut machine = Scene::random(60, 4, 3e-5, 2.0, noise, &mut ChaCha8Rng::seed_from_u64(1));
    machine.effects.push(Injection::AxisBacklash(1.0));
    let observations = machine.measured(1);

    let model = Linearised::new(&observations, Assumptions::default())?;
    let diagnosis = diagnose(&model, &Options::default());
    println!("{}", diagnosis.verdict.statement);
    println!(
        "gap {:.3} µm before, {:.3} µm after",
        diagnosis.gap.before.rms, diagnosis.gap.after.rms
    );
    for hidden in diagnosis.hidden.iter().filter(|h| h.detectable.is_none()) {
        println!("{} would not show whatever its size", hidden.effect);
    }
    Ok(())
}
