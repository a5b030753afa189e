//! Good inputs of every command, spoilt: a run ends with an answer or a message, whatever it reads.
//!
//! The suite runs some hundred cases of a fixed seed. The long campaign is
//! `ERRSEP_FUZZ=SEED,CASES cargo test --release --test fuzzing -- --ignored --nocapture`; it prints
//! the smallest input of what fails.

mod good;
mod judge;
mod spoil;

use std::time::{Duration, Instant};

use good::{COMMANDS, Case, Good};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use spoil::Spoil;

/// Cases of the suite: some twenty seconds.
const CASES: u32 = 300;

fn case() -> impl Strategy<Value = (usize, Vec<Spoil>, bool)> {
    let spoils = proptest::collection::vec(spoil::any_spoil(), 1..4);
    (0..COMMANDS.len(), spoils, any::<bool>())
}

fn campaign(seed: u64, cases: u32) {
    let good = Good::made();
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let config = Config {
        cases,
        failure_persistence: None,
        max_shrink_iters: 300,
        ..Config::default()
    };
    let random = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let mut endings = [0_usize; 3];
    let mut slowest = Duration::ZERO;
    let count = std::cell::RefCell::new((&mut endings, &mut slowest));
    let outcome =
        TestRunner::new_with_rng(config, random).run(&case(), |(command, spoils, json)| {
            let case = Case::new(&good, command, &spoils, json);
            let began = Instant::now();
            let ending = judge::run(&case)
                .map_err(|fault| TestCaseError::fail(format!("{fault}\n{}", case.in_words())))?;
            let mut count = count.borrow_mut();
            if let Some(number) = count.0.get_mut(ending) {
                *number += 1;
            }
            *count.1 = began.elapsed().max(*count.1);
            Ok(())
        });
    println!("seed {seed}: exit 0, 1, 2: {endings:?}; slowest {slowest:.1?}");
    if let Err(error) = outcome {
        panic!("{error}");
    }
    assert!(endings[0] > 0 && endings[2] > 0, "{endings:?}");
}

#[test]
fn spoilt_inputs_end_in_an_answer_or_a_message() {
    campaign(1, CASES);
}

#[test]
#[ignore = "a campaign of its own, see the head of this file"]
fn a_long_campaign() {
    let plan = std::env::var("ERRSEP_FUZZ").unwrap_or_else(|_| "2,100000".to_owned());
    let (seed, cases) = plan.split_once(',').expect("ERRSEP_FUZZ=SEED,CASES");
    campaign(seed.parse().unwrap(), cases.parse().unwrap());
}
