//! One diagnosis of any model, from the fitted model to the answer.

use std::path::PathBuf;

use errsep_models::model::{AnyModel, Effect, FittedModel, Place};

use serde_json::{Value, json};

use super::law::{Sought, sought};
use super::learnt::{all_tested, learnt, tested_in_words};
use super::sealed::Seal;
use super::{Args, page, within_reach_of, words};
use crate::cli::{Answer, progress};
use crate::diagnosis::{
    Diagnosis, Options, Tabulated, TabulatedEffects, Tested, Trials, diagnose_with, prove,
};
use crate::io::{CsvTable, Message, OutFile, SetupFile, Status};
use crate::report::diagnosis as sheet;

/// A fitted model and what people should know of it.
pub(super) struct Case {
    pub model: AnyModel,
    /// What the readings are, in words.
    pub readings: String,
    /// Name of the positions, for axes of plots.
    pub along: &'static str,
    pub notes: Vec<String>,
    /// Files that were read beside data, set-up and effects.
    pub inputs: Vec<PathBuf>,
}

impl Case {
    /// Diagnoses the case.
    pub(super) fn answer(self, args: &Args) -> Result<Answer, Message> {
        self.answer_with(args, |_| None)
    }

    /// The same where a model can be made of a plan: `plan` reads the one that the arguments name.
    pub(super) fn answer_with(
        self,
        args: &Args,
        plan: impl Fn(&Args) -> Option<Result<AnyModel, Message>>,
    ) -> Result<Answer, Message> {
        within_reach_of(&self.model, self.along, &args.data)?;
        if let Some(seal) = &args.check {
            return self.checked(args, seal);
        }
        if !args.with.is_empty() {
            return Ok(self.with_effects(args)?.0);
        }
        let place = args.learn.as_deref();
        let file = place.map(|p| OutFile::reserve(p).map(|file| (p, file)));
        let file = file.transpose()?;
        let law_place = args.law.as_ref().and_then(|p| p.as_deref());
        let law_file = law_place.map(|p| OutFile::reserve(p).map(|file| (p, file)));
        let law_file = law_file.transpose()?;
        let seal = Seal::begun(args, plan)?;
        let catalogue = catalogue(args, &self.model)?;
        let known: Vec<String> = catalogue.iter().map(|e| e.name().to_owned()).collect();
        if let Some(name) = args.without.iter().find(|n| !known.contains(n)) {
            return Err(Message::bad_input(format!("there is no effect `{name}`"))
                .remedy(format!("the catalogue has {}", known.join(", "))));
        }
        let options = Options {
            false_alarm: args.false_alarm,
            seed: args.common.seed,
            without: args.without.clone(),
            severity: args.severity,
            ..Options::default()
        };
        let bar = progress("diagnosing", None);
        let diagnosis = diagnose_with(&self.model, catalogue, &options);
        bar.finish_and_clear();
        let learnt = file.map(|file| learnt(&self.model, args, file, &diagnosis, &options));
        let learnt = learnt.transpose()?;
        let law = args
            .law
            .as_ref()
            .map(|_| sought(&self.model, args, law_file, &diagnosis, &options));
        let law = law.transpose()?;
        let sealed = seal.map(|seal| seal.written(&self.model, args, &diagnosis, &options));
        let sealed = sealed.transpose()?;
        let trials = args.prove.map(|count| -> Result<_, Message> {
            let bar = progress("proving", None);
            // The trials are made on readings without what was found in them.
            let clean = self
                .model
                .refit(self.model.observed() - diagnosis.detail.change());
            // A trial counts names, whatever they are worth.
            let options = Options {
                severity: 0,
                ..options.clone()
            };
            let mut catalogue = self::catalogue(args, &self.model)?;
            catalogue.retain(|effect| !args.without.iter().any(|name| name == effect.name()));
            let trials = prove(&clean, catalogue, &options, count);
            bar.finish_and_clear();
            Ok(trials)
        });
        let trials = trials.transpose()?;
        let tests = all_tested(
            &self.model,
            args,
            &own_effects(args, &self.model)?,
            &options,
        );
        let is_missing = law.as_ref().is_some_and(|l: &Sought| l.is_missing);
        let law = law.map(|l| l.said);
        let said = [("learnt", learnt), ("law", law), ("sealed", sealed)];
        let mut answer = self.delivered(args, diagnosis, trials.as_ref(), said, tests)?;
        if is_missing {
            // The file that was asked for is not there.
            answer.status = Status::NotSolved;
        }
        Ok(answer)
    }

    fn delivered(
        self,
        args: &Args,
        mut diagnosis: Diagnosis,
        trials: Option<&Trials>,
        said: [(&str, Option<Said>); 3],
        (tests, remarks): (Vec<Tested>, Vec<String>),
    ) -> Result<Answer, Message> {
        diagnosis.notes.extend(self.notes);
        diagnosis.notes.extend(remarks);
        let mut json = serde_json::to_value(&diagnosis).map_err(|e| {
            Message::bad_input(format!("the diagnosis cannot be written as JSON: {e}"))
        })?;
        let mut text = format!(
            "{}: {}\n\n{}",
            args.data.display(),
            self.readings,
            words::in_words(&diagnosis)
        );
        let mut view = page::view(
            args.data.display().to_string(),
            &self.model,
            self.along,
            &diagnosis,
        );
        if let Some(trials) = trials {
            text += &words::proof_in_words(trials);
            view.trials = Some(sheet::Trials {
                truths: trials.truths.clone(),
                answers: trials.answers.clone(),
                counts: trials.counts.clone(),
            });
            if let Value::Object(object) = &mut json {
                object.insert("proof".to_owned(), json!(trials));
            }
        }
        let told = (&mut text, &mut json, &mut view.notes);
        tell_learnt(told, self.model.reading_unit(), &tests, said);
        let mut inputs = vec![args.data.clone()];
        inputs.extend(args.setup.clone());
        inputs.extend(args.effects.clone());
        inputs.extend(self.inputs);
        Ok(Answer {
            text,
            json,
            page: args.common.page(|| sheet::page(&view)),
            tables: args.common.tables(|| {
                vec![residuals(
                    &self.model,
                    &diagnosis.detail.before,
                    &diagnosis.detail.after,
                )]
            }),
            inputs,
            setup: None,
            seed: Some(args.common.seed),
            status: Status::Done,
        })
    }
}

/// What is said of an effect that was learnt, or of a seal, in words and as JSON.
pub(super) type Said = (String, Value);

/// Adds to text, JSON and notes of the page how learnt effects fare here, and what was learnt or sealed here.
fn tell_learnt(
    (text, json, notes): (&mut String, &mut Value, &mut Vec<String>),
    unit: &str,
    tests: &[Tested],
    said: [(&str, Option<Said>); 3],
) {
    for test in tests {
        let said = tested_in_words(test, unit);
        *text += &format!("\n{said}\n");
        notes.push(said);
    }
    let Value::Object(object) = json else { return };
    if !tests.is_empty() {
        object.insert("tested".to_owned(), json!(tests));
    }
    for (key, said) in said {
        if let Some((words, value)) = said {
            *text += &words;
            notes.push(words.trim().to_owned());
            object.insert(key.to_owned(), value);
        }
    }
}

/// The model's effects and the user's own.
pub(super) fn catalogue(
    args: &Args,
    model: &AnyModel,
) -> Result<Vec<Box<dyn Effect<AnyModel>>>, Message> {
    let mut catalogue = model.effects();
    for effect in own_effects(args, model)? {
        catalogue.push(Box::new(effect));
    }
    Ok(catalogue)
}

/// The user's own effects.
fn own_effects(args: &Args, model: &AnyModel) -> Result<Vec<Tabulated>, Message> {
    let Some(path) = &args.effects else {
        return Ok(Vec::new());
    };
    let file = SetupFile::read(path)?;
    let read: TabulatedEffects = file.parse()?;
    let mut names: Vec<String> = model
        .effects()
        .iter()
        .map(|e| e.name().to_owned())
        .collect();
    let mut own = Vec::new();
    for effect in read.effect {
        let place = effect.span();
        let effect = effect.into_inner();
        let known = names.contains(&effect.name);
        let fault = if known {
            Some(format!("`{}` is in the catalogue already", effect.name))
        } else {
            effect.fault(model)
        };
        if let Some(what) = fault {
            return Err(file.bad(
                place,
                what,
                "give every effect a new name, growing positions or a formula, and known channels with finite weights",
            ));
        }
        names.push(effect.name.clone());
        own.push(effect);
    }
    Ok(own)
}

/// What the fit leaves of every reading, without and with the effects.
pub(super) fn residuals(model: &AnyModel, before: &[f64], after: &[f64]) -> CsvTable {
    let places = model.places();
    let numbers = |value: fn(&Place) -> f64| -> Vec<f64> { places.iter().map(value).collect() };
    let suffix = |unit: &str| match unit {
        "" | "1" => String::new(),
        unit => format!("_{}", unit.replace('/', "_per_").replace(' ', "_")),
    };
    let channels = model.channel_names();
    let (x, reading) = (suffix(model.position_unit()), suffix(model.reading_unit()));
    CsvTable::new("residuals.csv")
        .texts(
            "channel",
            places
                .iter()
                .map(|p| channels.get(p.channel).cloned().unwrap_or_default())
                .collect::<Vec<_>>(),
        )
        .numbers("repeat", numbers(|p| f64::from(p.repeat)))
        .numbers("direction", numbers(|p| p.direction))
        .numbers(format!("x{x}"), numbers(|p| p.x))
        .numbers(format!("before{reading}"), before.to_vec())
        .numbers(format!("after{reading}"), after.to_vec())
}
