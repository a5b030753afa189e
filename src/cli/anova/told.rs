//! What was found of each feature: in words, for programs, and as tables.

use std::fmt::Write;

use errsep_models::anova::OneWay;
use serde_json::{Value, json};

use super::Analysed;
use crate::cli::quantity::{expanded_words, with_expanded};
use crate::io::units::{per_cent, symbol};
use crate::io::{CsvTable, Message};
use crate::report::{budget as budget_block, number};

pub(super) fn describe(text: &mut String, one: &Analysed) -> Result<(), Message> {
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

pub(super) fn as_json(one: &Analysed) -> Result<Value, Message> {
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

pub(super) fn components_table(analysed: &[Analysed]) -> CsvTable {
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

pub(super) fn parts_table(analysed: &[Analysed]) -> CsvTable {
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
