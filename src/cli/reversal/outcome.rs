//! The answer of either solution, in one form for terminal, JSON, tables and report.

use errsep_models::noise::Law;
use errsep_models::reversal::simultaneous::{Covariances, FittedEffect};
use errsep_models::reversal::staged::Value;
use errsep_models::reversal::{Channel, Contrast, Convention};
use errsep_models::straightness::{ReferenceLine, straightness};
use errsep_models::uncertainty::{DegreesOfFreedom, Quantity, UncertaintyError};

use crate::report;

/// A tilt, or a combination of tilts.
pub struct Angle {
    pub name: String,
    /// Which tilt it is, if one by itself.
    pub contrast: Option<Contrast>,
    /// rad.
    pub angle: Value,
}

/// A form, or a combination of forms, at [`Outcome::x`].
pub struct Form {
    pub name: String,
    /// Whether it is M, S_A or S_B by itself.
    pub is_single: bool,
    /// µm.
    pub values: Vec<f64>,
    /// µm.
    pub std: Vec<f64>,
}

pub struct Closure {
    /// rad; absent where an effect in the fit takes it up.
    pub slope: Option<Value>,
    /// How well its standard uncertainty is known.
    pub freedom: DegreesOfFreedom,
    pub x: Vec<f64>,
    /// µm.
    pub profile: Vec<f64>,
    /// µm.
    pub rms: f64,
    /// What the noise alone would give, µm.
    pub expected_rms: f64,
}

pub struct Convergence {
    pub reason: String,
    pub iterations: usize,
    pub seconds: f64,
    pub costs: Vec<f64>,
}

/// One residual of the model, µm.
pub struct Residual {
    pub channel: Channel,
    pub repeat: u32,
    pub backward: bool,
    pub x: f64,
    pub residual: f64,
}

/// What the channels leave open.
pub struct Open {
    pub combination: &'static str,
    pub remedy: &'static str,
}

pub struct Outcome {
    /// Those that were read.
    pub channels: Vec<Channel>,
    /// Whether all readings of every channel are equal, and no noise is known otherwise.
    pub still: bool,
    pub method: &'static str,
    pub convention: Convention,
    pub tilts: Vec<Angle>,
    pub contrasts: Option<[(Contrast, Value); 4]>,
    pub x: Vec<f64>,
    pub forms: Vec<Form>,
    pub closure: Option<Closure>,
    pub residuals: Vec<Residual>,
    pub residual_rms: f64,
    /// Standard deviation of one reading, µm.
    pub noise: f64,
    pub noise_words: String,
    pub channel_noise: Vec<(Channel, f64)>,
    pub degrees_of_freedom: f64,
    /// Variances of the parts of the noise of one reading, µm², where repeats tell them, and the correlation of opposite
    /// indicators where they share it.
    pub noise_law: Option<(Law, Option<f64>)>,
    /// How well the standard uncertainties of the angles are known: infinite where the noise was
    /// declared.
    pub noise_freedom: DegreesOfFreedom,
    /// The same of the forms.
    pub form_freedom: DegreesOfFreedom,
    /// Whether model and readings disagree beyond the noise; absent where nothing tells.
    pub disagree: Option<bool>,
    /// What the model misses where they do, µm root mean square.
    pub missed: f64,
    /// Name, root mean square in µm, where it comes from.
    pub method_errors: Vec<(String, f64, String)>,
    pub convergence: Convergence,
    pub knots: Option<report::reversal::Knots>,
    /// What the reader has to weigh.
    pub warnings: Vec<String>,
    /// Effects in the fit.
    pub effects: Vec<FittedEffect>,
    /// What they change in each reading, µm, in the order of the data.
    pub effect_changes: Vec<f64>,
    /// Thickness of the artefact, mm, where it was fitted.
    pub thickness: Option<Value>,
    /// Of tilts and effects, where they come from one fit.
    pub covariances: Option<Covariances>,
}

impl Outcome {
    /// The length over which was measured, mm.
    pub fn length(&self) -> f64 {
        match (self.x.first(), self.x.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// An angle in the vocabulary of the GUM.
    ///
    /// # Errors
    /// A value or an uncertainty that is not finite.
    pub fn quantity(&self, label: &str, angle: Value) -> Result<Quantity, UncertaintyError> {
        // What is shown of the closure is its slope, whether as such or as a contrast.
        let freedom = match &self.closure {
            Some(closure) if closure.slope == Some(angle) => closure.freedom,
            _ => self.noise_freedom,
        };
        Ok(Quantity::new(label, angle.value, angle.std, "rad")?.with_degrees_of_freedom(freedom))
    }

    /// What an angle means.
    pub fn meaning(&self, angle: &Angle) -> String {
        match angle.contrast {
            Some(contrast) => contrast.meaning(self.convention).to_owned(),
            None => "these channels determine the tilts together only".to_owned(),
        }
    }

    /// What these channels leave open, with what to do. With fewer than four channels the untapered
    /// convention reads a cone as alpha, and with two nothing tells them apart.
    pub fn open(&self) -> Option<Open> {
        let combination =
            "alpha apart from the cone of the artefact (half the angle between its sides)";
        let together = |t: &Angle| t.name.contains("alpha") && t.name.contains("cone");
        let remedy = match (self.convention, self.channels.len()) {
            (Convention::Seed, 3) if self.alpha().is_some() => {
                "set [model] convention = \"rigid\" in the set-up, with which these channels tell them apart"
            }
            (Convention::Seed, 2) if self.alpha().is_some() => {
                "read 1A, 1B, 2A and 2B with [model] convention = \"rigid\" in the set-up, or measure the \
                 diameter of the artefact at both ends"
            }
            (Convention::Rigid, _) if self.tilts.iter().any(together) => {
                "read 1A, 1B, 2A and 2B, or measure the diameter of the artefact at both ends"
            }
            _ => return None,
        };
        Some(Open {
            combination,
            remedy,
        })
    }

    /// The tilt between slide and spindle, where it is determined by itself.
    pub fn alpha(&self) -> Option<Value> {
        let is_alpha = |t: &&Angle| t.contrast == Some(Contrast::Alpha);
        self.tilts.iter().find(is_alpha).map(|t| t.angle)
    }

    /// Root mean square of the standard uncertainties of a form's points, µm; zero without the form.
    pub fn rms_std(&self, name: &str) -> f64 {
        let Some(form) = self.forms.iter().find(|form| form.name == name) else {
            return 0.0;
        };
        let squares: f64 = form.std.iter().map(|s| s * s).sum();
        (squares / form.std.len().max(1) as f64).sqrt()
    }

    /// Straightness of each form against the three reference lines, µm.
    pub fn straightness(&self) -> Vec<(&str, [(ReferenceLine, f64); 3])> {
        self.forms
            .iter()
            .filter_map(|form| {
                let of = |reference| {
                    let s = straightness(&self.x, &form.values, reference).ok()?;
                    Some((reference, s.error()))
                };
                let [a, b, c] = ReferenceLine::ALL.map(of);
                Some((form.name.as_str(), [a?, b?, c?]))
            })
            .collect()
    }
}
