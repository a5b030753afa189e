//! What is sealed before a measurement, against that measurement, on a few machines; many are in
//! `campaigns/seal.rs`.

use errsep::diagnosis::{Options, Standing, checked, sealed};
use errsep_models::model::FittedModel;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::sealed_machine::{FAULTS, Fault, Layout, Machine};

const FIRST: Layout = Layout {
    positions: 41,
    repeats: 4,
    both: true,
};
/// At other positions, and shorter: what is told over the whole test is another part of it.
const SECOND: Layout = Layout {
    positions: 31,
    repeats: 2,
    both: true,
};

fn options() -> Options {
    Options {
        draws: 100,
        ..Options::default()
    }
}

#[test]
fn what_is_sealed_is_found_on_a_machine_that_is_set_up_anew() {
    let (mut inside, mut readings) = (0.0, 0.0);
    for (k, fault) in FAULTS.into_iter().enumerate() {
        let mut random = ChaCha8Rng::seed_from_u64(70 + k as u64);
        let machine = Machine::drawn(fault, &mut random);
        let now = machine.model(FIRST, Some(&mut random));
        let plan = machine.model(SECOND, None);
        let names: Vec<String> = fault.name().into_iter().map(str::to_owned).collect();
        let seal = sealed(&now, &plan, now.effects(), &names, &options()).unwrap();
        let next = machine.model(SECOND, Some(&mut random));
        let score = checked(&next, next.effects(), &seal, &options()).unwrap();
        inside += score.trace.coverage * score.trace.readings as f64;
        readings += score.trace.readings as f64;
        assert_eq!(score.trace.missing + score.trace.not_planned, 0);
        // k·u: 4 of each of the numbers, of some twenty.
        let sizes = score.effects.iter().flat_map(|e| &e.numbers);
        for number in sizes.chain(&score.quantities) {
            assert!(number.z.abs() < 4.0, "{fault:?}: {number:?}");
        }
        for gap in [&score.without, &score.with] {
            assert!(gap.z.abs() < 4.0, "{fault:?}: {gap:?}");
        }
        assert!(score.effects.iter().all(|e| e.standing == Standing::Stands));
    }
    // Monte Carlo: 3.3 standard deviations of a part of 2480 independent readings are 1.4 %; they share the
    // errors of what was carried over.
    let coverage = inside / readings;
    assert!((0.93..0.97).contains(&coverage), "{coverage} of {readings}");
}

#[test]
fn a_cause_that_went_is_gone_and_one_that_grew_has_changed() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let machine = Machine::drawn(Fault::Drift, &mut random);
    let now = machine.model(FIRST, Some(&mut random));
    let names = ["thermal-drift".to_owned()];
    let plan = machine.model(SECOND, None);
    let seal = sealed(&now, &plan, now.effects(), &names, &options()).unwrap();
    let repaired = Machine {
        fault: Fault::Nothing,
        ..machine.clone()
    };
    let worse = Machine {
        size: 2.5 * machine.size,
        ..machine
    };
    for (other, standing) in [(repaired, Standing::Gone), (worse, Standing::Changed)] {
        let next = other.model(SECOND, Some(&mut random));
        let score = checked(&next, next.effects(), &seal, &options()).unwrap();
        assert_eq!(score.effects[0].standing, standing, "{:?}", score.effects);
        assert!(!score.without.inside && !score.with.inside);
        assert!(score.trace.coverage < 0.9, "{}", score.trace.coverage);
    }
}
