//! `errsep machine`: what the 21 component errors do to points, lengths, squareness, circularity.

mod features;
mod parts;
mod predict;
mod result;

use std::path::PathBuf;

use clap::{Subcommand, ValueEnum};
use errsep_models::machine::{ErrorFunction, Independence, Machine, MachineError, Prediction};

use serde_json::{Value, json};

use super::{Answer, CommonArgs};
use crate::io::Message;
use crate::io::machine::{FiledMachine, read_filed};

/// Predicts errors of points and features from the component errors of a machine.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The machine is a TOML file with its chain, from the workpiece to the tool with F for the frame, and
its component errors under their ISO 230-1 names, in um and rad over mm:

    chain = \"XYFZ\"
    [errors.EXX]
    polynomial = [0.104, -0.0189]
    std = 1.4
    [errors.C0Y]
    readings = [-3.39e-5, -3.12e-5, -3.58e-5, -3.28e-5, -3.29e-5]

An axis that carries the workpiece, before F, has the errors of its slide: what a laser reads between tool
and workpiece changes its sign there.

Example: errsep machine machine.toml length holes.csv --between 3:9 --out length")]
pub struct Args {
    /// The machine.
    #[arg(value_name = "MODEL.toml")]
    model: PathBuf,
    /// Readings to which the entries with a `degree` are fitted (columns component, position,
    /// value).
    #[arg(long, value_name = "COMPONENTS.csv")]
    components: Option<PathBuf>,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    Predict(predict::Args),
    Length(features::LengthArgs),
    Squareness(features::SquarenessArgs),
    Circularity(features::CircularityArgs),
    Parts(parts::Args),
}

/// How uncertainty is propagated.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct PropagationArgs {
    /// What the errors at different points have in common.
    #[arg(long, value_enum, default_value_t)]
    independence: IndependenceName,
    /// Whether the next part or the mean of many is predicted.
    #[arg(long, value_enum, default_value_t)]
    prediction: PredictionName,
    /// Coverage of the expanded uncertainty.
    #[arg(long, value_name = "P", default_value_t = 0.95)]
    confidence: f64,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum IndependenceName {
    /// Fitted functions and angles between axes are common to all points, scatter is not.
    #[default]
    Scatter,
    /// Every point has errors of its own.
    Points,
    /// Every coordinate of every point has errors of its own (NISTIR 6868).
    Coordinates,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum PredictionName {
    /// The next part: fitted functions and scatter.
    #[default]
    Future,
    /// The mean of many parts: fitted functions alone.
    Mean,
}

impl PropagationArgs {
    fn independence(&self) -> Independence {
        match self.independence {
            IndependenceName::Scatter => Independence::Scatter,
            IndependenceName::Points => Independence::Points,
            IndependenceName::Coordinates => Independence::Coordinates,
        }
    }

    /// What is assumed of features of several points where it is not what a machine does.
    fn assumption(&self) -> Option<&'static str> {
        match self.independence {
            IndependenceName::Scatter => None,
            IndependenceName::Points => Some(
                "every point has errors of its own (--independence points). Points of one machine have the fitted \
                 functions in common: lengths and angles are then known better than said, and the form of \
                 the mean of many parts is less than said. Without the option this is counted",
            ),
            IndependenceName::Coordinates => Some(
                "every coordinate of every point has errors of its own (--independence coordinates, NISTIR \
                 6868), and simulations take standard deviations as known, so that their intervals are \
                 too short after few readings. Points of one machine have the fitted functions in common: lengths and angles are then \
                 known better than said, and the form of the mean of many parts is less than said. \
                 Without the option this is counted",
            ),
        }
    }

    fn prediction(&self) -> Prediction {
        match self.prediction {
            PredictionName::Future => Prediction::Future,
            PredictionName::Mean => Prediction::Mean,
        }
    }

    fn check(&self) -> Result<(), Message> {
        if self.confidence > 0.0 && self.confidence < 1.0 {
            return Ok(());
        }
        Err(Message::bad_input(format!(
            "--confidence {} is no probability",
            self.confidence
        ))
        .remedy("give a number between 0 and 1, such as 0.95"))
    }
}

/// A machine as a command works with it.
struct Context<'a> {
    machine: &'a Machine,
    filed: &'a FiledMachine,
    args: &'a Args,
    propagation: &'a PropagationArgs,
}

impl Context<'_> {
    /// The files read, with one more.
    fn inputs(&self, more: Option<&PathBuf>) -> Vec<PathBuf> {
        let own = [Some(&self.args.model), self.args.components.as_ref(), more];
        own.into_iter().flatten().cloned().collect()
    }

    /// The component errors, as a result names them.
    fn errors(&self) -> Vec<Value> {
        let told = self.machine.errors().iter().map(|error| {
            let function = match &error.function {
                ErrorFunction::Polynomial {
                    basis,
                    coefficients,
                } => json!({
                    "centre": basis.centre,
                    "scale": basis.scale,
                    "coefficients": coefficients,
                }),
                ErrorFunction::Table { positions, values } => {
                    json!({"positions": positions, "values": values})
                }
            };
            json!({
                "component": error.component.to_string(),
                "unit": error.component.unit(),
                "function": function,
            })
        });
        told.collect()
    }

    /// What the model could not answer, as a message about the machine's file.
    fn wrong(&self, error: &MachineError) -> Message {
        let remedy = "correct the machine, or ask for points within its tables";
        self.filed.wrong(error, remedy)
    }
}

impl Args {
    /// The options common to all commands.
    pub(super) fn common(&self) -> &CommonArgs {
        match &self.action {
            Action::Predict(args) => &args.common,
            Action::Length(args) => &args.common,
            Action::Squareness(args) => &args.common,
            Action::Circularity(args) => &args.common,
            Action::Parts(args) => &args.common,
        }
    }

    fn propagation(&self) -> &PropagationArgs {
        match &self.action {
            Action::Predict(args) => &args.propagation,
            Action::Length(args) => &args.propagation,
            Action::Squareness(args) => &args.propagation,
            Action::Circularity(args) => &args.propagation,
            Action::Parts(args) => &args.propagation,
        }
    }
}

/// Answers one question about the machine.
///
/// # Errors
/// The machine or the points cannot be read, or do not make the feature.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let propagation = args.propagation();
    propagation.check()?;
    let filed = read_filed(&args.model, args.components.as_deref())?;
    let context = Context {
        machine: &filed.machine,
        filed: &filed,
        args,
        propagation,
    };
    match &args.action {
        Action::Predict(action) => predict::run(&context, action),
        Action::Length(action) => features::length(&context, action),
        Action::Squareness(action) => features::squareness(&context, action),
        Action::Circularity(action) => features::circularity(&context, action),
        Action::Parts(action) => parts::run(&context, action),
    }
}
