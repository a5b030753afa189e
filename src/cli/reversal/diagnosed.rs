//! The diagnosis of the fit beside its answer: both in one run, by one fit.

use std::path::Path;

use errsep_models::model::AnyModel;
use errsep_models::reversal::designs::DesignFit;
use errsep_models::reversal::diagnosable::Linearised;
use errsep_models::reversal::simultaneous::Simultaneous;
use serde_json::Value;

use crate::cli::diagnose::{RIVALS, page, reversal, within_reach_of, words};
use crate::cli::{Answer, CommonArgs};
use crate::diagnosis::{Diagnosis, Options, diagnose};
use crate::io::Message;
use crate::io::reversal::{DesignData, ReversalData, ReversalSetup};
use crate::report::diagnosis as sheet;

/// Heading of what the diagnosis adds.
const HEADING: &str = "Where and why model and readings disagree";

/// A diagnosis with the model that it is of.
pub struct Diagnosed {
    model: AnyModel,
    diagnosis: Diagnosis,
    data: String,
}

impl Diagnosed {
    /// The diagnosis of a fit.
    pub fn of(
        file: &Path,
        data: &ReversalData,
        setup: &ReversalSetup,
        fit: &Simultaneous,
        seed: u64,
    ) -> Result<Self, Message> {
        let model = Linearised::of_fit(&data.observations, fit, reversal::assumptions(setup))
            .map_err(|why| reversal::refusal(&why).in_file(file))?;
        Self::made(file, model, seed)
    }

    /// The diagnosis of the fit of a design.
    pub fn of_design(
        file: &Path,
        data: &DesignData,
        setup: &ReversalSetup,
        fit: &DesignFit,
        seed: u64,
    ) -> Result<Self, Message> {
        let model = reversal::design_model(setup, data, Some(fit))
            .map_err(|why| reversal::refusal(&why).in_file(file))?;
        let mut made = Self::made(file, model, seed)?;
        made.diagnosis.notes = reversal::with_crest(setup, made.diagnosis.notes);
        Ok(made)
    }

    fn made(file: &Path, model: Linearised, seed: u64) -> Result<Self, Message> {
        let options = Options {
            seed,
            severity: RIVALS,
            ..Options::default()
        };
        let notes = reversal::notes(&model);
        let model = AnyModel::new(&model);
        within_reach_of(&model, reversal::ALONG, file)?;
        let mut diagnosis = diagnose(&model, &options);
        diagnosis.notes.extend(notes);
        Ok(Self {
            model,
            diagnosis,
            data: file.display().to_string(),
        })
    }

    /// The answer with the diagnosis behind it: in the text, as `diagnosis` in the JSON, as sections of
    /// the page.
    pub fn beside(self, mut answer: Answer, common: &CommonArgs) -> Result<Answer, Message> {
        answer.text +=
            &common.text(|| format!("\n{HEADING}\n\n{}", words::in_words(&self.diagnosis)));
        if let Value::Object(object) = &mut answer.json {
            let own = serde_json::to_value(&self.diagnosis).map_err(|e| {
                Message::bad_input(format!("the diagnosis cannot be written as JSON: {e}"))
            })?;
            object.insert("diagnosis".to_owned(), own);
        }
        let page = answer.page;
        answer.page = common.page(|| {
            let view = page::view(self.data, &self.model, reversal::ALONG, &self.diagnosis);
            page.followed_by(HEADING, sheet::page(&view))
        });
        answer.seed = Some(common.seed);
        Ok(answer)
    }
}
