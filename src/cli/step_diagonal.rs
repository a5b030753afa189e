//! `errsep step-diagonal`: diagonal and step-diagonal displacement tests.

use std::fmt::Write;
use std::path::PathBuf;

use errsep_models::diagonal::{
    Assumptions, ClosedForm, ComponentEstimate, Determined, Diagonal, DiagonalError,
    DiagonalReading, DiagonalTotals, Location, Measured, SequenceChoice, StepDiagonalFit, Target,
    Total, WorkZone, choose_sequences, closed_forms, regress, totals,
};
use serde_json::{Value, json};

use super::quantity::{coverage_json, quantity_json, unexpandable};
use super::{Answer, CommonArgs};
use crate::io::diagonal::{DiagonalSetup, read_readings};
use crate::io::{CsvTable, Message, Status, units::urad_from_rad};
use crate::report::number;
use crate::report::step_diagonal::{StepDiagonalView, page};

/// Diagonal and step-diagonal displacement tests (ISO 230-6): what they determine and what not.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
One row a stop of the laser, zeroed at the start of each run:

    diagonal,sequence,x,y,z,reading
    AG,XYZ,0,0,0,0.00
    AG,XYZ,120,0,0,-1.31

| diagonal | AG, BH, CE, DF (body), AC, DB (face of the bottom plane), A at the least x, y, z |
| sequence | XYZ, XZY, YXZ, YZX, ZXY, ZYX, or together for the diagonal test              |
| x, y, z  | machine position, mm, the same number of even steps on each axis               |
| reading  | displacement read along the beam less the nominal one, um                      |
| target   | mirror or retro-reflector; optional, as is repeat                              |

The set-up, optional:

    [test]
    target = \"mirror\"
    noise = 0.2                   # um; absent: estimated
    [assume]
    zero = [\"ECX\"]                # errors taken as zero
    [[measured]]
    axis = \"X\"                    # positioning slope by a laser along the axis
    slope = 0.004                 # um/mm
    std = 0.0005

Example: errsep step-diagonal readings.csv --setup setup.toml --out diagonal")]
pub struct Args {
    /// The readings.
    #[arg(value_name = "DATA.csv")]
    data: PathBuf,
    /// The set-up.
    #[arg(long, value_name = "S.toml")]
    setup: Option<PathBuf>,
    /// Adds which sets of sequences would determine which angular errors.
    #[arg(long)]
    choose: bool,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Everything found.
struct Found {
    zone: WorkZone,
    readings: Vec<DiagonalReading>,
    fit: StepDiagonalFit,
    forms: Vec<ClosedForm>,
    totals: DiagonalTotals,
    choices: Vec<SequenceChoice>,
}

/// Analyses the readings.
///
/// # Errors
/// The files cannot be read, the readings make no grid, or the regression fails.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let (setup, zero) = match &args.setup {
        Some(path) => DiagonalSetup::read(path)?,
        None => (DiagonalSetup::default(), Vec::new()),
    };
    let (zone, readings) = read_readings(&args.data, setup.test.target)?;
    let assumptions = Assumptions {
        zero,
        slopes: setup
            .measured
            .iter()
            .map(|m| Measured {
                axis: m.axis,
                slope: m.slope,
                std: m.std,
            })
            .collect(),
        noise: setup.test.noise,
    };
    let refused = |e: DiagonalError| {
        let message = match e {
            DiagonalError::Numerical { .. } => Message::not_solved(e.to_string()),
            _ => Message::bad_input(e.to_string()).remedy("see `errsep step-diagonal --help`"),
        };
        message.in_file(&args.data)
    };
    let mut found = Found {
        fit: regress(&zone, &readings, &assumptions).map_err(refused)?,
        forms: closed_forms(&zone, &readings).map_err(refused)?,
        totals: totals(&zone, &readings).map_err(refused)?,
        choices: Vec::new(),
        zone,
        readings,
    };
    if args.choose {
        let (diagonals, targets) = used(&found.readings);
        found.choices = choose_sequences(&found.zone, &diagonals, &targets).map_err(refused)?;
    }
    let name = args.data.display().to_string();
    Ok(Answer {
        text: in_words(&name, &found),
        json: as_json(&found, &assumptions)?,
        page: page(&StepDiagonalView {
            data: &name,
            fit: &found.fit,
            forms: &found.forms,
            totals: &found.totals,
            choices: &found.choices,
        }),
        tables: vec![components_table(&found.fit), residuals_table(&found)],
        inputs: std::iter::once(&args.data)
            .chain(&args.setup)
            .cloned()
            .collect(),
        seed: None,
        status: Status::Done,
    })
}

fn used(readings: &[DiagonalReading]) -> (Vec<Diagonal>, Vec<Target>) {
    let mut diagonals: Vec<Diagonal> = readings.iter().map(|r| r.diagonal).collect();
    diagonals.sort_unstable();
    diagonals.dedup();
    let mut targets: Vec<Target> = readings.iter().map(|r| r.target).collect();
    targets.sort_unstable();
    targets.dedup();
    (diagonals, targets)
}

fn in_words(name: &str, found: &Found) -> String {
    let fit = &found.fit;
    let [x, y, z] = found.zone.travel;
    let mut text = format!(
        "Diagonal tests {name}\n  {} readings in a work zone of {x} × {y} × {z} mm, {} steps\n  {} of {} unknowns determined",
        found.readings.len(),
        found.zone.steps,
        fit.rank,
        fit.parameters
    );
    let _ = match fit.noise {
        Some(noise) => writeln!(
            text,
            ", noise of a reading {} µm ({} degrees of freedom)",
            number::plain(noise, 3),
            fit.degrees_of_freedom
        ),
        None => writeln!(text, ", noise of a reading not known"),
    };
    let _ = writeln!(text, "\nWhat the readings determine");
    for c in &fit.components {
        let _ = writeln!(
            text,
            "  {} {:28} {}",
            c.component.name(),
            c.component.words(),
            span(c)
        );
    }
    for l in &fit.squareness {
        let value = match l.value {
            Some(s) => format!(
                "{} µrad",
                number::measured(
                    urad_from_rad(l.location.iso_sign() * s),
                    l.std.map(urad_from_rad)
                )
            ),
            None => l.determined.words().to_owned(),
        };
        let _ = writeln!(
            text,
            "  {} {:28} {value}",
            l.location.name(),
            l.location.words()
        );
    }
    if !fit.ambiguities.is_empty() {
        let _ = writeln!(text, "\nWhat cannot be told apart");
        for a in &fit.ambiguities {
            let _ = writeln!(text, "  {}.", a.statement);
        }
    }
    if !fit.remedies.is_empty() {
        let _ = writeln!(text, "\nWhat one further measurement would settle");
        for r in &fit.remedies {
            let _ = writeln!(text, "  {}: {}", r.measure, r.settles.join(", "));
        }
    }
    for choice in &found.choices {
        let _ = writeln!(text, "\n{}", choice_words(choice));
    }
    text
}

fn choice_words(choice: &SequenceChoice) -> String {
    let sequences: Vec<&str> = choice.sequences.iter().map(|s| s.name()).collect();
    let angular: Vec<String> = choice.angular.iter().map(|c| c.name()).collect();
    format!(
        "Sequences {} determine the angular errors {}",
        sequences.join(", "),
        if angular.is_empty() {
            "none".to_owned()
        } else {
            angular.join(", ")
        }
    )
}

/// Peak to valley of what is determined, and its greatest uncertainty.
fn span(c: &ComponentEstimate) -> String {
    let (low, high) = c
        .values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| {
            (l.min(v), h.max(v))
        });
    if low > high {
        return c.determined.words().to_owned();
    }
    let (factor, unit) = if c.component.rotation {
        (urad_from_rad(1.0), "µrad")
    } else {
        (1.0, "µm")
    };
    let std = c.std.iter().copied().fold(0.0, f64::max);
    let note = match c.determined {
        Determined::Wholly => String::new(),
        other => format!(" ({})", other.words()),
    };
    if c.std.is_empty() {
        format!(
            "spans {} {unit}{note}",
            number::plain(factor * (high - low), 3)
        )
    } else {
        format!(
            "spans {} {unit}, uncertainty up to {} {unit}{note}",
            number::plain(factor * (high - low), 3),
            number::plain(factor * std, 2)
        )
    }
}

fn as_json(found: &Found, assumptions: &Assumptions) -> Result<Value, Message> {
    let fit = &found.fit;
    let unit = |rotation: bool| if rotation { "rad" } else { "um" };
    let angles = fit.angles().map_err(unexpandable)?;
    Ok(json!({
        "schema": "errsep.step-diagonal/1",
        "work_zone": {"travel": found.zone.travel, "steps": found.zone.steps, "unit": "mm"},
        "readings": found.readings.len(),
        "assumptions": {
            "zero": assumptions.zero.iter().map(|c| c.name()).collect::<Vec<_>>(),
            "slopes": assumptions.slopes,
        },
        "unknowns": fit.parameters,
        "rank": fit.rank,
        "noise": fit.noise.map(|v| json!({"value": v, "unit": "um"})),
        "degrees_of_freedom": fit.degrees_of_freedom,
        "uncertainty": coverage_json(fit.noise_degrees_of_freedom)?,
        "quantities": angles.iter().map(quantity_json).collect::<Result<Vec<_>, _>>()?,
        "components": fit.components.iter().map(|c| json!({
            "name": c.component.name(),
            "meaning": c.component.words(),
            "determined": c.determined,
            "position": c.positions,
            "value": c.values,
            "std": c.std,
            "unit": unit(c.component.rotation),
        })).collect::<Vec<_>>(),
        "squareness": fit.squareness.iter().map(|l| json!({
            "name": l.location.name(),
            "meaning": l.location.words(),
            "determined": l.determined,
            "value": l.value.map(|s| l.location.iso_sign() * s),
            "std": l.std,
            "unit": "rad",
        })).collect::<Vec<_>>(),
        "mirrors": fit.mirrors.iter().map(|m| json!({
            "diagonal": m.diagonal,
            "target": m.target,
            "direction": m.direction,
            "value": m.value,
            "std": m.std,
            "unit": "rad",
        })).collect::<Vec<_>>(),
        "ambiguities": fit.ambiguities,
        "remedies": fit.remedies,
        "closed_forms": found.forms.iter().map(|f| {
            let rotation = f.component.is_some_and(|c| c.rotation);
            json!({
                "equation": f.equation,
                "target": f.target,
                "stands_for": f.component.map(|c| c.name()),
                "steps": f.steps,
                "profile": f.profile,
                "profile_std": fit.noise.map(|sigma| {
                    f.profile_gains.iter().map(|g| g * sigma).collect::<Vec<_>>()
                }),
                "unit": unit(rotation),
            })
        }).collect::<Vec<_>>(),
        "diagonals": found.totals.errors.iter().map(|(d, (value, runs))| json!({
            "diagonal": d, "error": {"value": value, "unit": "um"}, "runs": runs,
        })).collect::<Vec<_>>(),
        "totals": found.totals.estimates.iter().map(|e| {
            let (name, value, unit) = match e.quantity {
                Total::PositioningSum => ("positioning-sum", e.value, "um"),
                Total::Squareness(l) => (Location::name(l), l.iso_sign() * e.value, "rad"),
            };
            json!({"equation": e.equation, "name": name, "value": value, "gain": e.gain, "unit": unit})
        }).collect::<Vec<_>>(),
        "sequence_choices": found.choices.iter().map(|c| json!({
            "sequences": c.sequences,
            "angular": c.angular.iter().map(|c| c.name()).collect::<Vec<_>>(),
            "translational": c.translational.iter().map(|c| c.name()).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "residuals": {"value": fit.residuals, "unit": "um"},
    }))
}

fn components_table(fit: &StepDiagonalFit) -> CsvTable {
    let (mut names, mut positions, mut values, mut stds, mut units) =
        (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for c in &fit.components {
        for (k, (position, value)) in c.positions.iter().zip(&c.values).enumerate() {
            names.push(c.component.name());
            positions.push(*position);
            values.push(*value);
            stds.push(c.std.get(k).copied().unwrap_or(f64::NAN));
            units.push(if c.component.rotation { "rad" } else { "um" }.to_owned());
        }
    }
    CsvTable::new("components.csv")
        .texts("component", names)
        .numbers("position_mm", positions)
        .numbers("value", values)
        .numbers("std", stds)
        .texts("unit", units)
}

fn residuals_table(found: &Found) -> CsvTable {
    let readings = &found.readings;
    let position = |a: usize| -> Vec<f64> {
        readings
            .iter()
            .map(|r| found.zone.position(r.at)[a])
            .collect()
    };
    CsvTable::new("residuals.csv")
        .texts(
            "diagonal",
            readings
                .iter()
                .map(|r| r.diagonal.name().to_owned())
                .collect::<Vec<_>>(),
        )
        .texts(
            "sequence",
            readings
                .iter()
                .map(|r| r.sequence.name().to_owned())
                .collect::<Vec<_>>(),
        )
        .numbers("x_mm", position(0))
        .numbers("y_mm", position(1))
        .numbers("z_mm", position(2))
        .numbers(
            "reading_um",
            readings.iter().map(|r| r.value).collect::<Vec<_>>(),
        )
        .numbers("residual_um", found.fit.residuals.clone())
}
