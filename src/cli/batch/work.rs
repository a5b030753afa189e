//! Campaigns on several cores.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use indicatif::ProgressBar;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::campaigns::Campaign;
use super::row::Row;
use crate::cli::call::call;
use crate::io::{Message, Status};

/// A campaign that was worked out.
pub(super) struct Worked {
    /// Its place in the part.
    pub at: usize,
    pub row: Row,
    pub seconds: f64,
}

/// Works out campaigns, given with their place and key; `done` is called as each ends, in any order.
///
/// Every worker has a thread of its own for what a command does in parallel: many campaigns keep all
/// cores busy, and none waits for another's pieces.
///
/// # Errors
/// No thread can be had, or `done` failed.
pub(super) fn all(
    waiting: &[(usize, &Campaign, String)],
    jobs: usize,
    bar: &ProgressBar,
    done: impl FnMut(Worked) -> Result<(), Message> + Send,
) -> Result<(), Message> {
    let next = AtomicUsize::new(0);
    let outcome = Mutex::new((done, Ok(())));
    let pools = (0..jobs.min(waiting.len()).max(1))
        .map(|_| ThreadPoolBuilder::new().num_threads(1).build())
        .collect::<Result<Vec<ThreadPool>, _>>()
        .map_err(|e| {
            Message::bad_input(format!("no thread can be started: {e}")).remedy("give fewer --jobs")
        })?;
    std::thread::scope(|scope| {
        for pool in &pools {
            scope.spawn(|| {
                while let Some((at, campaign, key)) =
                    waiting.get(next.fetch_add(1, Ordering::Relaxed))
                {
                    let begin = Instant::now();
                    let row = pool.install(|| one(campaign, key));
                    let seconds = begin.elapsed().as_secs_f64();
                    bar.inc(1);
                    let mut outcome = outcome.lock().unwrap_or_else(PoisonError::into_inner);
                    let (done, so_far) = &mut *outcome;
                    if so_far.is_err() {
                        return;
                    }
                    *so_far = done(Worked {
                        at: *at,
                        row,
                        seconds,
                    });
                }
            });
        }
    });
    let (_, ended) = outcome.into_inner().unwrap_or_else(PoisonError::into_inner);
    ended
}

/// One campaign: whatever happens to it, it is a row.
fn one(campaign: &Campaign, key: &str) -> Row {
    let known = (campaign.id.clone(), key.to_owned());
    let called = catch_unwind(AssertUnwindSafe(|| call(&campaign.arguments, Vec::new())));
    match called {
        Ok(Ok(traced)) => {
            let answer = traced.answer;
            let sentence = || answer.page.told().1.to_owned();
            let message = (answer.status != Status::Done).then(sentence);
            Row::new(known, answer.status.code(), message, Some(answer.json))
        }
        Ok(Err(message)) => Row::new(known, message.status().code(), Some(told(&message)), None),
        Err(_) => {
            let broken = "the program broke off: this is a fault of errsep";
            Row::new(known, 101, Some(broken.to_owned()), None)
        }
    }
}

/// What is wrong, where, and what to do, in one line.
fn told(message: &Message) -> String {
    let place = message.place().map(|place| format!("{place}: "));
    let remedy = message.remedy_words().map(|remedy| format!(" ({remedy})"));
    place.unwrap_or_default() + message.what() + &remedy.unwrap_or_default()
}
