//! The set-up of the four-sensor method.

use errsep_models::four_sensor::{Choice, Line, Parabola, Penalised, Settings};
use serde::Deserialize;
use toml::Spanned;

use crate::io::{Message, Numbers, SetupFile};

/// What the set-up file says.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    sensors: Sensors,
    #[serde(default)]
    separation: Separation,
    parabola: Option<Spanned<ParabolaTable>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Sensors {
    spacing: Spanned<Numbers<3>>,
    noise: Option<Spanned<f64>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Separation {
    penalty: Option<Penalised>,
    #[serde(default)]
    choice: Rule,
    lambda: Option<Spanned<f64>>,
    #[serde(default)]
    line: Line,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Rule {
    #[default]
    LCurve,
    Gcv,
    Likelihood,
    Discrepancy,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ParabolaTable {
    surface_curvature: Option<f64>,
    zero_adjustment: Option<Numbers<3>>,
    tilt_slope: Option<f64>,
}

/// The set-up, checked.
#[derive(Debug)]
pub(in crate::cli) struct Setup {
    pub file: SetupFile,
    /// D2, D3, D4, mm, and where they stand in the file.
    pub spacing: Spanned<Numbers<3>>,
    pub penalised: Penalised,
    /// Whether the set-up names the penalty.
    pub penalty_stated: bool,
    pub line: Line,
    pub settings: Settings,
}

impl Setup {
    pub(in crate::cli) fn read(file: SetupFile) -> Result<Self, Message> {
        let File {
            sensors,
            separation,
            parabola,
        } = file.parse()?;
        if sensors
            .spacing
            .get_ref()
            .0
            .iter()
            .any(|d| !(d.is_finite() && *d > 0.0))
        {
            return Err(file.bad(
                sensors.spacing.span(),
                "a spacing of the sensors is not positive",
                "give D2, D3, D4 in mm, each the distance to the sensor before",
            ));
        }
        let positive = |value: &Spanned<f64>, what: &str| {
            if value.get_ref().is_finite() && *value.get_ref() > 0.0 {
                Ok(*value.get_ref())
            } else {
                Err(file.bad(
                    value.span(),
                    format!("{what} is {}", value.get_ref()),
                    "give a positive number, or leave it out",
                ))
            }
        };
        let noise = sensors
            .noise
            .as_ref()
            .map(|noise| positive(noise, "the noise"))
            .transpose()?;
        let choice = match (&separation.lambda, separation.choice, noise) {
            (Some(lambda), _, _) => Choice::Fixed(positive(lambda, "lambda")?),
            (None, Rule::LCurve, _) => Choice::LCurve,
            (None, Rule::Gcv, _) => Choice::Gcv,
            (None, Rule::Likelihood, _) => Choice::Likelihood,
            (None, Rule::Discrepancy, Some(noise)) => Choice::Discrepancy { noise },
            (None, Rule::Discrepancy, None) => {
                return Err(file.bad(
                    sensors.spacing.span(),
                    "the discrepancy principle needs the noise of one reading",
                    "add noise = … (um) to [sensors], or choose l-curve, gcv or likelihood",
                ));
            }
        };
        let parabola = match &parabola {
            Some(table) => stated(&file, table)?,
            None => Parabola::LeastNorm,
        };
        Ok(Self {
            spacing: sensors.spacing,
            penalised: separation.penalty.unwrap_or_default(),
            penalty_stated: separation.penalty.is_some(),
            line: separation.line,
            settings: Settings {
                choice,
                noise,
                parabola,
            },
            file,
        })
    }
}

fn stated(file: &SetupFile, table: &Spanned<ParabolaTable>) -> Result<Parabola, Message> {
    let ways = table.get_ref();
    let found: Vec<Parabola> = [
        ways.surface_curvature.map(Parabola::SurfaceCurvature),
        ways.zero_adjustment.map(|z| Parabola::ZeroAdjustment(z.0)),
        ways.tilt_slope.map(Parabola::TiltSlope),
    ]
    .into_iter()
    .flatten()
    .collect();
    // Beyond these the tilts are no small angles and the adjustment no matter of a sensor's travel.
    let beyond = |value: f64, limit: f64| value.is_nan() || value.abs() > limit;
    let too_great = ways.surface_curvature.is_some_and(|c| beyond(c, 1e3))
        || ways.tilt_slope.is_some_and(|s| beyond(s, 1.0))
        || ways
            .zero_adjustment
            .is_some_and(|z| z.0.iter().any(|z| beyond(*z, 1e6)));
    match found.as_slice() {
        [one] if !too_great => Ok(*one),
        [_] => Err(file.bad(
            table.span(),
            "no slide has such a [parabola]",
            "surface_curvature is in um/mm2 (up to 1000), zero_adjustment in um (up to 1e6), tilt_slope in rad/mm (up to 1)",
        )),
        [] => Err(file.bad(
            table.span(),
            "[parabola] states nothing",
            "give surface_curvature (um/mm2), zero_adjustment (um) or tilt_slope (rad/mm), or leave the table out",
        )),
        _ => Err(file.bad(
            table.span(),
            "[parabola] states it more than once",
            "keep one of surface_curvature, zero_adjustment and tilt_slope",
        )),
    }
}
