//! `errsep anova`: what parts differ by against what their measurement scatters by.

use std::fmt::Write;
use std::path::PathBuf;

use clap::ValueEnum;
use errsep_models::anova::recipe::{self, Recipe, Summary};
use errsep_models::anova::{AnovaError, Group, Groups, OneWay, Repeats, analyse_repeats};
use serde_json::{Value, json};

use super::quantity::{expanded_words, with_expanded};
use super::{Answer, ColumnArgs, CommonArgs};
use crate::io::replicates::{Replicates, read_replicates};
use crate::io::units::{per_cent, symbol};
use crate::io::{CsvTable, Message, Status};
use crate::report::anova::{FeatureView, page};
use crate::report::{budget as budget_block, number};

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

fn describe(text: &mut String, one: &Analysed) -> Result<(), Message> {
    let (r, unit) = (&one.result, symbol(&one.feature.unit));
    let _ = writeln!(
        text,
        "\n{} ({} parts, {} readings)",
        one.feature.name, r.groups, r.readings
    );
    if let Some(remark) = one.remark() {
        let _ = writeln!(text, "  warning           {remark}");
        if r.mean.standard_uncertainty == 0.0 {
            let mean = number::measured(r.mean.value, None);
            let _ = writeln!(
                text,
                "  mean              {mean} {unit}, uncertainty not known"
            );
            return Ok(());
        }
    }
    if let Some(of_repeats) = one.of_repeats() {
        let _ = writeln!(text, "  repeats           {of_repeats}");
    }
    let mean = number::measured(r.mean.value, Some(r.mean.standard_uncertainty));
    let _ = writeln!(
        text,
        "  mean              {mean} {unit}, {}",
        expanded_words(&r.mean, r.components.confidence)?
    );
    for (name, component) in [
        ("between parts", &r.components.between),
        ("one measurement", &r.components.within),
    ] {
        if let Some(c) = component {
            let note = if c.variance < 0.0 {
                ", no difference shows"
            } else {
                ""
            };
            let _ = writeln!(
                text,
                "  {name:17} {} {unit} (standard deviation, {} % from {} to {}{note})",
                number::plain(c.standard_deviation, 4),
                per_cent(r.components.confidence),
                number::plain(c.lower.sqrt(), 4),
                number::plain(c.upper.sqrt(), 4),
            );
        }
    }
    if let (Some(f), Some(p)) = (r.f, r.p_value) {
        let _ = writeln!(
            text,
            "  F({}, {})         {}, p {}",
            r.between.degrees_of_freedom,
            r.within.degrees_of_freedom,
            number::plain(f, 5),
            number::probability(p)
        );
    }
    if let Some(budget) = &r.future_reading {
        let u = budget.result.standard_uncertainty;
        let _ = writeln!(
            text,
            "  a future reading  ± {} {unit}, {}",
            number::plain(u, 3),
            expanded_words(&budget.result, r.components.confidence)?
        );
        for line in budget_block::text(budget).lines() {
            let _ = writeln!(text, "  {line}");
        }
    }
    if let Some(s) = &one.summary {
        let _ = writeln!(
            text,
            "  NISTIR 6868       mean {}, between {}, within {} {unit}², future {} and {} {unit}",
            number::plain(s.mean, 4),
            number::plain(s.variance_between, 6),
            number::plain(s.variance_within, 6),
            number::plain(s.future_measurement, 4),
            number::plain(s.future_manufacturing, 4),
        );
    }
    Ok(())
}

fn as_json(one: &Analysed) -> Result<Value, Message> {
    let keys: serde_json::Map<String, Value> = one
        .feature
        .keys
        .iter()
        .map(|(k, v)| (k.clone(), json!(v)))
        .collect();
    let parts: Vec<Value> = one
        .groups
        .groups()
        .iter()
        .map(|g| {
            json!({"part": g.name, "readings": g.readings.len(), "mean": g.mean(),
                   "std": g.standard_deviation()})
        })
        .collect();
    let confidence = one.result.components.confidence;
    let mut analysis = json!(one.result);
    analysis["mean"] = with_expanded(&one.result.mean, confidence)?;
    if let Some(budget) = &one.result.future_reading {
        analysis["future_reading"]["result"] = with_expanded(&budget.result, confidence)?;
    }
    let mut value = json!({
        "name": one.feature.name,
        "keys": keys,
        "unit": one.feature.unit,
        "analysis": analysis,
        "repeats": one.repeats,
        "remarks": one.remarks(),
        "parts": parts,
    });
    if let (Value::Object(object), Some(summary)) = (&mut value, &one.summary) {
        object.insert("nistir6868".to_owned(), json!(summary));
    }
    Ok(value)
}

fn components_table(analysed: &[Analysed]) -> CsvTable {
    let texts = |f: fn(&Analysed) -> String| analysed.iter().map(f).collect::<Vec<_>>();
    let numbers = |f: fn(&OneWay) -> Option<f64>| {
        analysed
            .iter()
            .map(|a| f(&a.result).unwrap_or(f64::NAN))
            .collect::<Vec<_>>()
    };
    CsvTable::new("components.csv")
        .texts("feature", texts(|a| a.feature.name.clone()))
        .texts("unit", texts(|a| a.feature.unit.clone()))
        .numbers("mean", numbers(|r| Some(r.mean.value)))
        .numbers("mean_std", numbers(|r| Some(r.mean.standard_uncertainty)))
        .numbers("mean_square_between", numbers(|r| r.between.mean_square))
        .numbers("mean_square_within", numbers(|r| r.within.mean_square))
        .numbers("f", numbers(|r| r.f))
        .numbers("p_value", numbers(|r| r.p_value))
        .numbers(
            "variance_between",
            numbers(|r| r.components.between.map(|c| c.variance)),
        )
        .numbers(
            "variance_between_lower",
            numbers(|r| r.components.between.map(|c| c.lower)),
        )
        .numbers(
            "variance_between_upper",
            numbers(|r| r.components.between.map(|c| c.upper)),
        )
        .numbers(
            "variance_within",
            numbers(|r| r.components.within.map(|c| c.variance)),
        )
        .numbers(
            "variance_within_lower",
            numbers(|r| r.components.within.map(|c| c.lower)),
        )
        .numbers(
            "variance_within_upper",
            numbers(|r| r.components.within.map(|c| c.upper)),
        )
}

fn parts_table(analysed: &[Analysed]) -> CsvTable {
    let rows = || {
        analysed
            .iter()
            .flat_map(|a| a.groups.groups().iter().map(move |g| (&a.feature, g)))
    };
    CsvTable::new("parts.csv")
        .texts(
            "feature",
            rows().map(|(f, _)| f.name.clone()).collect::<Vec<_>>(),
        )
        .texts(
            "part",
            rows().map(|(_, g)| g.name.clone()).collect::<Vec<_>>(),
        )
        .numbers(
            "readings",
            rows()
                .map(|(_, g)| g.readings.len() as f64)
                .collect::<Vec<_>>(),
        )
        .numbers("mean", rows().map(|(_, g)| g.mean()).collect::<Vec<_>>())
        .numbers(
            "std",
            rows()
                .map(|(_, g)| g.standard_deviation().unwrap_or(f64::NAN))
                .collect::<Vec<_>>(),
        )
}
