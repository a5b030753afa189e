//! How many campaigns a second a batch works out, and how long it takes to find that all are done:
//! `cargo run --release -p errsep-campaigns --bin batch_speed [CAMPAIGNS [DONE]]`.
//!
//! The campaigns (1000 without a number) are simulated reversals of 4 × 500 readings, solved with
//! `--simultaneous` by one job; the `DONE` ones (100 000) profiles with a file each, worked out first and
//! then only looked at.

use std::error::Error;
use std::ffi::OsString;
use std::fmt::Write;
use std::fs::{self, File};
use std::path::Path;
use std::time::Instant;

use errsep::cli::{call::call, run};

fn main() -> Result<(), Box<dyn Error>> {
    let mut numbers = std::env::args().skip(1).map(|text| text.parse::<usize>());
    let campaigns = numbers.next().transpose()?.unwrap_or(1000);
    let done = numbers.next().transpose()?.unwrap_or(100_000);
    let folder = tempfile::tempdir()?;
    if campaigns > 0 {
        let list = reversals(&folder.path().join("reversals"), campaigns)?;
        let seconds = batch(&list)?;
        println!(
            "{campaigns} campaigns of 4 x 500 readings by one job: {seconds:.2} s, {:.0} a second",
            campaigns as f64 / seconds
        );
    }
    if done > 0 {
        let list = profiles(&folder.path().join("profiles"), done)?;
        println!("{done} profiles: {:.2} s", batch(&list)?);
        println!("{done} profiles that are done: {:.2} s", batch(&list)?);
    }
    Ok(())
}

/// Reversals, each with noise, forms and tilt of its own.
fn reversals(folder: &Path, count: usize) -> Result<OsString, Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    let mut list = "id,command,data,setup,options\n".to_owned();
    fs::write(folder.join("setup.toml"), "[artefact]\nthickness = 42\n")?;
    for k in 0..count {
        let (seed, alpha) = (k.to_string(), (k % 80).to_string());
        let simulated = call(
            &[
                "simulate",
                "reversal",
                "--positions",
                "500",
                "--thickness",
                "42",
                "--seed",
                &seed,
                "--alpha",
                &alpha,
            ],
            Vec::new(),
        )?;
        simulated.answer.tables[0].write(File::create(folder.join(format!("{k}.csv")))?)?;
        writeln!(list, "c{k},reversal,{k}.csv,setup.toml,--simultaneous")?;
    }
    named(folder, &list)
}

/// Profiles of three points.
fn profiles(folder: &Path, count: usize) -> Result<OsString, Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    let mut list = "id,command,data\n".to_owned();
    for k in 0..count {
        let profile = format!("x,deviation\n0,0\n100,{k}\n200,1\n");
        fs::write(folder.join(format!("{k}.csv")), profile)?;
        writeln!(list, "c{k},straightness,{k}.csv")?;
    }
    named(folder, &list)
}

fn named(folder: &Path, list: &str) -> Result<OsString, Box<dyn Error>> {
    let place = folder.join("campaigns.csv");
    fs::write(&place, list)?;
    Ok(place.into_os_string())
}

/// The seconds that a batch takes with one job.
fn batch(list: &OsString) -> Result<f64, Box<dyn Error>> {
    let out = Path::new(list).with_file_name("answers").into_os_string();
    let words = ["errsep", "batch", "--quiet", "--jobs", "1", "--out"];
    let words = words.into_iter().map(OsString::from);
    let begin = Instant::now();
    match run(words.chain([out, list.clone()]).collect()) {
        0 => Ok(begin.elapsed().as_secs_f64()),
        status => Err(format!("the batch ended with status {status}").into()),
    }
}
