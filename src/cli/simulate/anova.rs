//! `errsep simulate anova`: replicates of parts with known components of variance.

use errsep_models::anova::{Truth, simulate};
use serde_json::json;

use crate::cli::{Answer, CommonArgs};
use crate::io::{CsvTable, Message};

/// Replicates of parts with known components of variance.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: errsep simulate anova --parts 21 --replicates 2 --between 2 --within 0.5"
)]
pub struct Args {
    /// Number of parts.
    #[arg(long, value_name = "N", default_value_t = 21)]
    parts: usize,
    /// Readings of each part.
    #[arg(long, value_name = "N", default_value_t = 2)]
    replicates: usize,
    /// Readings of the first four parts, where they differ.
    #[arg(long, value_name = "N")]
    replicates_of_first_four: Option<usize>,
    /// Mean of all parts, um.
    #[arg(
        long,
        value_name = "UM",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    mean: f64,
    /// Standard deviation from part to part, um.
    #[arg(long, value_name = "UM", default_value_t = 1.0)]
    between: f64,
    /// Standard deviation of one reading, um.
    #[arg(long, value_name = "UM", default_value_t = 0.2)]
    within: f64,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

pub(super) fn run(args: &Args) -> Result<Answer, Message> {
    let most = args
        .replicates
        .max(args.replicates_of_first_four.unwrap_or(0));
    super::few_enough(&[args.parts, most], "--parts or --replicates")?;
    super::standard_deviations(&[("--between", args.between), ("--within", args.within)])?;
    let mut replicates = vec![args.replicates; args.parts];
    if let Some(first) = args.replicates_of_first_four {
        replicates.iter_mut().take(4).for_each(|n| *n = first);
    }
    let truth = Truth {
        mean: args.mean,
        between: args.between,
        within: args.within,
        replicates,
    };
    let groups = simulate(&truth, args.common.seed).map_err(|error| {
        Message::bad_input(error.to_string()).remedy("correct the options of the simulation")
    })?;
    let (mut part, mut number, mut value) = (Vec::new(), Vec::new(), Vec::new());
    for group in groups.groups() {
        for (i, reading) in group.readings.iter().enumerate() {
            part.push(group.name.clone());
            number.push((i + 1) as f64);
            value.push(*reading);
        }
    }
    let table = CsvTable::new("replicates.csv")
        .texts("part", part)
        .numbers("replicate", number)
        .numbers("value", value);
    let known = json!({
        "mean": {"value": args.mean, "unit": "um"},
        "between": {"std": args.between, "unit": "um"},
        "within": {"std": args.within, "unit": "um"},
    });
    super::answer("anova", table, known, args.common.seed)
}
