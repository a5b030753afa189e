//! One number about a part, in words, in JSON and on the page.

use std::fmt::Write;

use errsep_models::uncertainty::{Budget, Expanded, Sample, UncertaintyError};
use serde_json::{Value, json};

use super::Context;
use crate::cli::Answer;
use crate::io::units::{arcsec_from_rad, per_cent};
use crate::io::{Message, Status};
use crate::report::plot::{Axis, Chart};
use crate::report::{Figure, KeyFigure, Page, Section, Standing, budget as budget_block, number};

/// A predicted number with its budget, its simulation, or both.
pub(super) struct Outcome {
    /// What it is, such as "length 3 to 9".
    pub(super) label: String,
    /// What it would be without errors, in words; empty when there is nothing to say.
    pub(super) nominal: String,
    /// By the law of propagation; a circularity has none.
    pub(super) budget: Option<Budget>,
    /// By simulation.
    pub(super) sample: Option<Sample>,
    /// Value without any scatter, where only a simulation gives the uncertainty.
    pub(super) certain: Option<f64>,
    /// Unit of all of these in JSON.
    pub(super) unit: &'static str,
}

impl Outcome {
    /// Factor to and name of the unit that people read.
    fn shown(&self) -> (f64, &'static str) {
        if self.unit == "rad" {
            (arcsec_from_rad(1.0), "″")
        } else {
            (1.0, "µm")
        }
    }

    fn expanded(&self, confidence: f64) -> Result<Option<Expanded>, UncertaintyError> {
        self.budget
            .as_ref()
            .map(|b| b.result.expanded(confidence))
            .transpose()
    }

    fn in_words(&self, confidence: f64) -> Result<String, UncertaintyError> {
        let (factor, unit) = self.shown();
        let mut text = format!("{}{}\n", self.label, self.nominal);
        if let (Some(budget), Some(expanded)) = (&self.budget, self.expanded(confidence)?) {
            let r = &budget.result;
            let value = number::measured(r.value * factor, Some(r.standard_uncertainty * factor));
            let _ = writeln!(
                text,
                "  propagated {value} {unit} (k = 1), U = {} {unit} (k = {}, {} %)",
                number::plain(expanded.expanded_uncertainty * factor, 3),
                number::plain(expanded.coverage_factor, 3),
                per_cent(confidence)
            );
        }
        if let Some(sample) = &self.sample {
            let value = number::measured(
                sample.mean() * factor,
                Some(sample.standard_deviation() * factor),
            );
            let shortest = sample.shortest_interval(confidence)?;
            let _ = writeln!(
                text,
                "  simulated  {value} {unit} (k = 1), {} % from {} to {} {unit} ({} trials)",
                per_cent(confidence),
                number::plain(shortest.lower * factor, 4),
                number::plain(shortest.upper * factor, 4),
                sample.sorted().len()
            );
        }
        if let Some(certain) = self.certain {
            let _ = writeln!(
                text,
                "  without scatter {} {unit}",
                number::plain(certain * factor, 4)
            );
        }
        if let Some(budget) = &self.budget {
            text.push_str(&budget_block::text(&scaled(budget, factor, unit)));
        }
        Ok(text)
    }

    fn as_json(&self, confidence: f64) -> Result<Value, UncertaintyError> {
        let mut value = json!({"label": self.label, "unit": self.unit});
        let Value::Object(object) = &mut value else {
            return Ok(value);
        };
        if let (Some(budget), Some(expanded)) = (&self.budget, self.expanded(confidence)?) {
            object.insert("result".into(), json!(budget.result));
            object.insert("expanded".into(), json!(expanded));
            object.insert("contributions".into(), json!(budget.contributions));
        }
        if let Some(sample) = &self.sample {
            object.insert(
                "monte_carlo".into(),
                json!({
                    "trials": sample.sorted().len(),
                    "mean": sample.mean(),
                    "std": sample.standard_deviation(),
                    "shortest_interval": sample.shortest_interval(confidence)?,
                    "symmetric_interval": sample.symmetric_interval(confidence)?,
                }),
            );
        }
        if let Some(certain) = self.certain {
            object.insert("without_scatter".into(), json!(certain));
        }
        Ok(value)
    }

    fn section(&self, confidence: f64) -> Result<Section, UncertaintyError> {
        let (factor, unit) = self.shown();
        let (value, std) = match (&self.budget, &self.sample) {
            (Some(b), _) => (b.result.value, b.result.standard_uncertainty),
            (None, Some(s)) => (s.mean(), s.standard_deviation()),
            (None, None) => (f64::NAN, f64::NAN),
        };
        let mut section = Section::new(self.label.as_str()).key_figures([KeyFigure::new(
            self.label.as_str(),
            value * factor,
            unit,
        )
        .std(std * factor)
        .meaning(self.nominal.trim_start_matches([',', ' ']))]);
        if let (Some(budget), Some(expanded)) = (&self.budget, self.expanded(confidence)?) {
            let shown = scaled(budget, factor, unit);
            let caption = format!(
                "Budget of {}: U = {} {unit} (k = {})",
                self.label,
                number::plain(expanded.expanded_uncertainty * factor, 3),
                number::plain(expanded.coverage_factor, 3)
            );
            section = section
                .figure(budget_block::figure("What makes the uncertainty", &shown))
                .table(budget_block::table(&caption, &shown));
        }
        if let Some(sample) = &self.sample {
            let values: Vec<f64> = sample.sorted().iter().map(|v| v * factor).collect();
            let interval = sample.shortest_interval(confidence)?;
            section = section.figure(Figure::new(
                "Simulated distribution",
                format!("{} trials with the shortest interval.", values.len()),
                Chart::histogram("trials", Axis::new(self.label.as_str(), unit), &values)
                    .vertical(interval.lower * factor, "lower end")
                    .vertical(interval.upper * factor, "upper end"),
            ));
        }
        Ok(section)
    }
}

/// The budget in the unit that people read.
fn scaled(budget: &Budget, factor: f64, unit: &str) -> Budget {
    let mut shown = budget.clone();
    shown.result.value *= factor;
    shown.result.standard_uncertainty *= factor;
    shown.result.unit = unit.to_owned();
    for c in &mut shown.contributions {
        c.sensitivity *= factor;
        c.contribution *= factor;
    }
    shown
}

/// The answer made of some outcomes.
pub(super) fn answer(
    context: &Context,
    action: &'static str,
    outcomes: &[Outcome],
    points_file: Option<&std::path::PathBuf>,
    seed: Option<u64>,
) -> Result<Answer, Message> {
    let confidence = context.propagation.confidence;
    let machine = context.args.model.display().to_string();
    let wrong = |error: UncertaintyError| context.wrong(&error.into());
    let mut text = format!("{action} on {machine} ({})\n", context.machine.chain());
    let mut page = Page::new(format!("Machine: {action}"), machine);
    let assumption = context.propagation.assumption();
    if let Some(assumption) = assumption {
        let _ = writeln!(text, "  assumed          {assumption}");
        page = page.section(Section::new("What is assumed").warning(format!("{assumption}.")));
    }
    let mut results = Vec::new();
    let mut first = String::new();
    for outcome in outcomes {
        let words = outcome.in_words(confidence).map_err(wrong)?;
        if first.is_empty() {
            first = words
                .lines()
                .take(2)
                .map(str::trim)
                .collect::<Vec<_>>()
                .join(": ");
        }
        text.push('\n');
        text.push_str(&words);
        page = page.section(outcome.section(confidence).map_err(wrong)?);
        results.push(outcome.as_json(confidence).map_err(wrong)?);
    }
    Ok(Answer {
        text,
        json: json!({
            "schema": "errsep.machine/1",
            "action": action,
            "chain": context.machine.chain().to_string(),
            "independence": context.propagation.independence(),
            "assumption": assumption,
            "prediction": context.propagation.prediction(),
            "confidence": confidence,
            "errors": context.errors(),
            "results": results,
        }),
        page: page.summary(Standing::Good, first),
        tables: Vec::new(),
        inputs: context.inputs(points_file),
        setup: None,
        seed,
        status: Status::Done,
    })
}
