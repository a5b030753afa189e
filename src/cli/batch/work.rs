//! Campaigns on several cores.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use indicatif::ProgressBar;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use super::campaigns::Campaign;
use super::key::Inputs;
use super::row::Row;
use super::selection::{Held, Selection};
use crate::cli::call::answer;
use crate::cli::common::Wanted;
use crate::io::source::InMemory;
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
    (inputs, held): (&Inputs, &Held),
    jobs: usize,
    bar: &ProgressBar,
    done: impl FnMut(Worked) -> Result<(), Message> + Send,
) -> Result<(), Message> {
    keep_memory();
    let next = AtomicUsize::new(0);
    let outcome = Mutex::new((done, Ok(())));
    let pools = (0..jobs.min(waiting.len()).max(1))
        .map(|_| ThreadPoolBuilder::new().num_threads(1).build())
        .collect::<Result<Vec<ThreadPool>, _>>()
        .map_err(|e| no_thread(&e))?;
    std::thread::scope(|scope| {
        for pool in &pools {
            let work = || {
                while let Some((at, campaign, key)) =
                    waiting.get(next.fetch_add(1, Ordering::Relaxed))
                {
                    let begin = Instant::now();
                    let row = one(campaign, key, inputs, held);
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
            };
            scope.spawn(move || pool.install(work));
        }
    });
    let (_, ended) = outcome.into_inner().unwrap_or_else(PoisonError::into_inner);
    ended
}

/// The most that a campaign of usual size leaves free when it ends, in bytes.
const KEPT: usize = 1 << 22;

/// Has memory kept from campaign to campaign. The allocator of glibc takes the largest block that was mapped
/// and let go for the size from which memory goes back to the system; below it, every campaign would give
/// back what the next gets again page by page. Other allocators do with this what they do.
fn keep_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(KEPT)));
}

/// The keys of campaigns.
///
/// # Errors
/// No thread can be had.
pub(super) fn keys(
    campaigns: &[Campaign],
    (inputs, held): (&Inputs, &Held),
    jobs: usize,
) -> Result<Vec<String>, Message> {
    let pool = ThreadPoolBuilder::new().num_threads(jobs).build();
    let pool = pool.map_err(|e| no_thread(&e))?;
    Ok(pool.install(|| campaigns.par_iter().map(|c| inputs.key(c, held)).collect()))
}

fn no_thread(error: &ThreadPoolBuildError) -> Message {
    Message::bad_input(format!("no thread can be started: {error}")).remedy("give fewer --jobs")
}

/// One campaign: whatever happens to it, it is a row.
fn one(campaign: &Campaign, key: &str, inputs: &Inputs, held: &Held) -> Row {
    let known = (campaign.id.clone(), key.to_owned());
    let name = campaign.selection.as_ref().map(Selection::name);
    let selected = name.and_then(|name| Some((held.get(&name)?, name)));
    let in_memory = match selected {
        None => Vec::new(),
        Some((Ok(rows), name)) => vec![InMemory {
            name: name.to_string_lossy().into_owned(),
            bytes: Arc::clone(rows),
        }],
        Some((Err(why), _)) => {
            return Row::new(known, why.status().code(), Some(told(why)), None);
        }
    };
    let called = catch_unwind(AssertUnwindSafe(|| {
        answer(&campaign.arguments, in_memory, Wanted::Json)
    }));
    if let Some(file) = inputs.changed_since(campaign) {
        let why = Message::bad_input("the file changed while the campaign was worked out")
            .in_file(file)
            .remedy("run the batch again when nothing writes to it");
        return Row::new(known, why.status().code(), Some(told(&why)), None);
    }
    match called {
        Ok(Ok(answer)) => {
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
