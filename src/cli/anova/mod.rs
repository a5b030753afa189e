//! `errsep anova`: what parts differ by against what their measurement scatters by.

mod told;

use std::fmt::Write;
use std::path::PathBuf;

use clap::ValueEnum;
use errsep_models::anova::recipe::{self, Recipe, Summary};
use errsep_models::anova::{AnovaError, Group, Groups, OneWay, Repeats, analyse_repeats};
use serde_json::json;

use super::{Answer, ColumnArgs, CommonArgs};
use crate::io::replicates::{Replicates, read_replicates};
use crate::io::units::{per_cent, symbol};
use crate::io::{Message, Status};
use crate::report::anova::{FeatureView, page};
use crate::report::number;
use told::{as_json, components_table, describe, parts_table};

/// Analysis of variance of replicates: manufacturing against measurement.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The file has one reading a row, in the columns part and value, and where they apply replicate (1, 2,
…), unit (um if absent) and any of feature, table, quantity, process, hole, axis, which together name
a feature. Features are analysed one by one:

    feature,part,replicate,value
    hole 3 X,1,1,8.388
    hole 3 X,1,2,6.124
    hole 3 X,2,1,-3.861

Example: errsep anova replicates.csv --out anova")]
pub struct Args {
    /// The readings.
    #[arg(value_name = "REPLICATES.csv")]
    replicates: PathBuf,
    /// Coverage of the intervals.
    #[arg(long, value_name = "P", default_value_t = 0.95)]
    confidence: f64,
    /// Adds the figures as NISTIR 6868 forms them.
    #[arg(long, value_enum)]
    recipe: Option<RecipeName>,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// The report's two ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum RecipeName {
    /// Section 5.1: weighted by the number of readings (Tables B and C).
    #[value(name = "section-5.1")]
    Section51,
    /// Plain mean of the part means (Tables G and H).
    PartMeans,
}

impl From<RecipeName> for Recipe {
    fn from(name: RecipeName) -> Self {
        match name {
            RecipeName::Section51 => Self::Section51,
            RecipeName::PartMeans => Self::PartMeans,
        }
    }
}

/// A feature with everything found about it.
struct Analysed {
    feature: Replicates,
    groups: Groups,
    result: OneWay,
    repeats: Option<Repeats>,
    summary: Option<Summary>,
}

impl Analysed {
    /// Repeats that differ over all parts.
    fn of_repeats(&self) -> Option<String> {
        let found = self.repeats.as_ref().filter(|r| r.differ)?;
        let unit = symbol(&self.feature.unit);
        let percent = per_cent(self.result.components.confidence);
        Some(format!(
            "the repeats differ as a whole, as if the instrument had been zeroed anew for each (F({}, {}) {}, p {}): \
             standard deviation {} {unit}, {percent} % from {} to {}, which the mean and a future reading hold; \
             one measurement is the scatter beside parts and repeats",
            found.between.degrees_of_freedom,
            self.result.within.degrees_of_freedom,
            number::plain(found.f, 4),
            number::probability(found.p_value),
            number::plain(found.component.standard_deviation, 3),
            number::plain(found.component.lower.sqrt(), 3),
            number::plain(found.component.upper.sqrt(), 3),
        ))
    }

    /// What the reader has to weigh.
    fn remarks(&self) -> Vec<String> {
        let own = self.remark().map(str::to_owned);
        own.into_iter().chain(self.of_repeats()).collect()
    }

    /// Repeats that agree to the last digit, which hides their scatter.
    fn remark(&self) -> Option<&'static str> {
        let groups = self.groups.groups();
        let first = groups.first()?.readings.first()?;
        let equal = |of: &Group, value: &f64| of.readings.iter().all(|r| r == value);
        if groups.iter().all(|g| equal(g, first)) {
            return Some(
                "all readings are equal, which tells nothing of their scatter: the resolution is too coarse, or \
                 the column is not the reading",
            );
        }
        let repeated = self.result.readings > self.result.groups;
        let alike = |g: &Group| g.readings.first().is_some_and(|value| equal(g, value));
        (repeated && groups.iter().all(alike)).then_some(
            "the readings of each part are equal, which tells nothing of the scatter of a measurement: the \
             resolution is too coarse, or the repeats are copies",
        )
    }
}

/// Analyses every feature of the table.
///
/// # Errors
/// The table cannot be read, a feature cannot be analysed, a confidence outside 0 to 1.
pub fn run(args: &Args) -> Result<Answer, Message> {
    if !(args.confidence > 0.0 && args.confidence < 1.0) {
        return Err(Message::bad_input(format!(
            "--confidence {} is no probability",
            args.confidence
        ))
        .remedy("give a number between 0 and 1, such as 0.95"));
    }
    let analysed = read_replicates(&args.replicates, &args.columns.map())?
        .into_iter()
        .map(|feature| analyse_feature(feature, args))
        .collect::<Result<Vec<_>, _>>()?;
    let open: Vec<&str> = analysed
        .iter()
        .filter(|a| a.result.groups > 1 && a.result.components.within.is_none())
        .map(|a| a.feature.name.as_str())
        .collect();
    let mut text = format!("Analysis of variance of {}\n", args.replicates.display());
    for one in &analysed {
        describe(&mut text, one)?;
    }
    if !open.is_empty() {
        let _ = writeln!(
            text,
            "\nNot determined for {}: no part was measured twice, so the scatter of the parts cannot \
             be told from that of the measurement. Repeat the measurement of some parts.",
            open.join(", ")
        );
    }
    let views: Vec<FeatureView> = analysed
        .iter()
        .map(|a| FeatureView {
            name: &a.feature.name,
            unit: &a.feature.unit,
            groups: &a.groups,
            result: &a.result,
            summary: a.summary.as_ref(),
            remark: a.remarks().into_iter().reduce(|a, b| format!("{a}; {b}")),
        })
        .collect();
    Ok(Answer {
        page: page(&args.replicates.display().to_string(), &views, &open),
        json: json!({
            "schema": "errsep.anova/1",
            "confidence": args.confidence,
            "features": analysed.iter().map(as_json).collect::<Result<Vec<_>, _>>()?,
        }),
        tables: vec![components_table(&analysed), parts_table(&analysed)],
        inputs: vec![args.replicates.clone()],
        setup: None,
        seed: None,
        status: if open.is_empty() {
            Status::Done
        } else {
            Status::NotSolved
        },
        text,
    })
}

fn analyse_feature(feature: Replicates, args: &Args) -> Result<Analysed, Message> {
    let wrong = |error: AnovaError| {
        Message::bad_input(format!("{}: {error}", feature.name))
            .in_file(&args.replicates)
            .remedy(match error {
                AnovaError::Overflow => "write the readings in a larger unit",
                AnovaError::NothingToCompare => {
                    "leave --recipe out, or repeat the measurement of some parts"
                }
                _ => "give every feature two or more readings",
            })
    };
    let groups = feature
        .parts
        .iter()
        .map(|(name, readings)| Group {
            name: name.clone(),
            readings: readings.clone(),
        })
        .collect();
    let groups = Groups::new(groups).map_err(wrong)?;
    let (result, repeats) =
        analyse_repeats(&groups, &feature.repeats, &feature.unit, args.confidence)
            .map_err(wrong)?;
    let summary = match args.recipe {
        Some(name) => Some(recipe::summarise(&groups, name.into()).map_err(wrong)?),
        None => None,
    };
    Ok(Analysed {
        feature,
        groups,
        result,
        repeats,
        summary,
    })
}
