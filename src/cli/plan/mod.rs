//! `errsep plan`: what a reversal could show of every effect, before any reading is taken; and designs
//! of it side by side.

mod compared;
mod designs;

use std::fmt::Write;
use std::path::PathBuf;

use errsep_models::model::FittedModel;
use errsep_models::reversal::Convention;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::simulate::{Plan, TrueForm, simulate};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Deserialize;
use serde_json::json;
use toml::Spanned;

use super::{Answer, CommonArgs};
use crate::diagnosis::{Diagnosability, NoiseLaw, NoiseSource, Options, certificate, for_people};
use crate::io::{Message, Numbers, SetupFile, Status};
use crate::report::number::plain;
use crate::report::plot::{Axis, Bar, Bars};
use crate::report::{Cell, Figure, Page, Section, Standing, Table};

/// What a planned reversal can show: visible part, smallest detectable and identifiable size,
/// confusions and harm of every effect, and which change of the plan helps most.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The set-up says what is planned and what is expected:

    noise = 0.02             # um, standard deviation of one reading
    travel = 300.0           # mm
    positions = 61
    repeats = 2
    both_directions = false
    tilts = [50.0, 0.0, 20.0]   # alpha, beta, gamma expected, urad
    forms = [1.0, 1.0]          # slide, artefact expected, um RMS

Designs of other angles are compared with each other, each as indicator/spindle in degrees:

    wanted = [\"alpha_h\", \"alpha_v\", \"M_h\", \"S\"]
    seconds_a_trace = 60.0      # one trace in one direction
    seconds_a_turn = 30.0       # turning the spindle
    seconds_an_indicator = 300.0
    indicators = 2              # that read at once
    [[design]]
    name = \"near and far\"
    channels = \"0/0,180/0,0/180,180/180\"
    [[design]]
    name = \"one indicator, every 90 degrees\"
    channels = \"0/0,0/90,0/180,0/270\"

Example: errsep plan plan.toml --out plan")]
pub struct Args {
    /// The plan.
    #[arg(value_name = "SETUP.toml")]
    plan: PathBuf,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    noise: Spanned<f64>,
    travel: Spanned<f64>,
    positions: Spanned<usize>,
    repeats: Option<Spanned<u32>>,
    #[serde(default)]
    both_directions: bool,
    tilts: Option<Spanned<Numbers<3>>>,
    forms: Option<Spanned<Numbers<2>>>,
    #[serde(default)]
    convention: Convention,
}

#[derive(Debug, Clone)]
struct Planned {
    noise: f64,
    travel: f64,
    positions: usize,
    repeats: u32,
    both_directions: bool,
    tilts: [f64; 3],
    forms: [f64; 2],
    convention: Convention,
}

/// What is expected where the set-up does not say it: tilts, urad, and forms, um.
const TILTS: [f64; 3] = [50.0, 0.0, 20.0];
const FORMS: [f64; 2] = [1.0, 1.0];

/// Greater expectations are slips of the unit: travel, mm, noise and forms, um, tilts, urad.
const LONGEST_TRAVEL: f64 = 1e6;
const LARGEST: f64 = 1e6;

impl Planned {
    fn read(setup: &SetupFile) -> Result<Self, Message> {
        let file: File = setup.parse()?;
        let within = |value: &Spanned<f64>, name: &str, most: f64, unit: &str| {
            if *value.get_ref() > 0.0 && *value.get_ref() <= most {
                return Ok(*value.get_ref());
            }
            let what = format!("{name} = {} {unit} cannot be planned", value.get_ref());
            let remedy = format!("give {name} in {unit}, greater than zero and at most {most}");
            Err(setup.bad(value.span(), what, remedy))
        };
        let noise = within(&file.noise, "noise", LARGEST, "um")?;
        let travel = within(&file.travel, "travel", LONGEST_TRAVEL, "mm")?;
        let (positions, at_positions) = (*file.positions.get_ref(), file.positions.span());
        let repeats = file.repeats.as_ref().map_or(1, |r| *r.get_ref());
        if let Some(given) = &file.repeats
            && repeats == 0
        {
            return Err(setup.bad(given.span(), "no repeat gives no reading", "give 1 or more"));
        }
        let directions = if file.both_directions { 2 } else { 1 };
        let readings = positions
            .saturating_mul(4 * directions)
            .saturating_mul(repeats as usize);
        if positions < 5 || readings > MOST_READINGS {
            return Err(setup.bad(
                at_positions,
                format!("{positions} positions make a plan of {readings} readings"),
                format!("give 5 or more positions, and {MOST_READINGS} readings at most"),
            ));
        }
        let limits = |least: f64| least..=LARGEST;
        let (tilts, forms) = (file.tilts, file.forms);
        if let Some(tilts) = &tilts
            && !tilts
                .get_ref()
                .0
                .iter()
                .all(|t| limits(-LARGEST).contains(t))
        {
            return Err(setup.bad(
                tilts.span(),
                "the expected tilts cannot be",
                "give alpha, beta, gamma in urad, finite and below 1e6",
            ));
        }
        if let Some(forms) = &forms
            && !forms.get_ref().0.iter().all(|f| limits(0.0).contains(f))
        {
            return Err(setup.bad(
                forms.span(),
                "the expected forms cannot be",
                "give root mean squares of slide and artefact in um, zero or greater and below 1e6",
            ));
        }
        Ok(Self {
            noise,
            travel,
            positions,
            repeats,
            both_directions: file.both_directions,
            tilts: tilts.map_or(TILTS, |t| t.into_inner().0),
            forms: forms.map_or(FORMS, |f| f.into_inner().0),
            convention: file.convention,
        })
    }
}

/// Most readings of a plan.
const MOST_READINGS: usize = 20_000;

/// Biases below this, rad, are rounding.
const NO_BIAS: f64 = 1e-12;

/// Draws behind the thresholds of a plan.
const DRAWS: usize = 400;

/// Works out the certificate and what extra measurements would add.
///
/// # Errors
/// The set-up is bad, or the plan leaves nothing over to diagnose.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let setup = SetupFile::read(&args.plan)?;
    if compared::is_asked(&setup)? {
        return compared::run(args, &setup);
    }
    let planned = Planned::read(&setup)?;
    let rows = certified(&planned, args.common.seed).map_err(|m| m.in_file(&args.plan))?;
    let extras = extras(&planned)
        .into_iter()
        .map(|(name, plan)| {
            let with = certified(&plan, args.common.seed).map_err(|m| m.in_file(&args.plan))?;
            Ok((name, gain(&rows, &with), newly(&rows, &with)))
        })
        .collect::<Result<Vec<_>, Message>>()?;
    Ok(answer(args, &rows, extras))
}

fn certified(planned: &Planned, seed: u64) -> Result<Vec<Diagnosability>, Message> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut form = |rms: f64| TrueForm::random_waves(&mut random, rms, 1.5 * planned.travel, 12);
    let mut plan = Plan::even(0.0, planned.travel, planned.positions, 0.0);
    plan.m = form(planned.forms[0]);
    plan.s_a = form(planned.forms[1]);
    plan.s_b = form(planned.forms[1]);
    plan.alpha_rad = planned.tilts[0] * 1e-6;
    plan.beta_rad = planned.tilts[1] * 1e-6;
    plan.gamma_rad = planned.tilts[2] * 1e-6;
    plan.repeats = planned.repeats;
    plan.both_directions = planned.both_directions;
    let (observations, _) = simulate(&plan, &[]).map_err(|e| {
        Message::bad_input(e.to_string()).remedy("correct the expected tilts and forms")
    })?;
    let assumptions = Assumptions {
        convention: planned.convention,
        thickness: None,
        noise: Some(planned.noise),
    };
    let model = Linearised::new(&observations, assumptions)
        .map_err(|e| Message::bad_input(e.to_string()).remedy("plan more positions or repeats"))?;
    // Of a reading of the model, which may stand for several.
    let noise = model.stated_noise().unwrap_or(planned.noise);
    let law = NoiseLaw::white(noise, f64::INFINITY, NoiseSource::Stated);
    let options = Options {
        draws: DRAWS,
        seed,
        ..Options::default()
    };
    Ok(certificate(&model, model.effects(), &law, &options))
}

/// Changes of a plan that a shop can make.
fn extras(planned: &Planned) -> Vec<(&'static str, Planned)> {
    let mut extras = Vec::new();
    if !planned.both_directions {
        extras.push((
            "run every trace backward too",
            Planned {
                both_directions: true,
                ..planned.clone()
            },
        ));
    }
    extras.push((
        "take twice the repeats",
        Planned {
            repeats: 2 * planned.repeats,
            ..planned.clone()
        },
    ));
    extras.push((
        "read twice the positions",
        Planned {
            positions: 2 * planned.positions - 1,
            ..planned.clone()
        },
    ));
    extras.push((
        "tilt the artefact by a further 1 mrad",
        Planned {
            tilts: [
                planned.tilts[0],
                planned.tilts[1],
                planned.tilts[2] + 1000.0,
            ],
            ..planned.clone()
        },
    ));
    extras
}

/// Geometric mean of how much smaller the detectable sizes become.
fn gain(before: &[Diagnosability], after: &[Diagnosability]) -> f64 {
    let ratios: Vec<f64> = before
        .iter()
        .zip(after)
        .filter_map(|(b, a)| Some((b.detectable? / a.detectable?).ln()))
        .collect();
    (ratios.iter().sum::<f64>() / ratios.len().max(1) as f64).exp()
}

/// Effects that become visible.
fn newly(before: &[Diagnosability], after: &[Diagnosability]) -> Vec<String> {
    before
        .iter()
        .zip(after)
        .filter(|(b, a)| b.detectable.is_none() && a.detectable.is_some())
        .map(|(b, _)| b.effect.clone())
        .collect()
}

/// What the sign before a size means.
const AT_LEAST: &str = "\u{2265}: what differs from repeat to repeat is taken for noise in part, and may have to be several times as great.";

const BY_SHAPE: &str = "The sizes above are of a typical shape:";

/// A size of an effect from which a plan shows it or tells it apart.
fn effect_size(row: &Diagnosability, value: Option<f64>) -> String {
    let least = if row.at_least && value.is_some() {
        "\u{2265} "
    } else {
        ""
    };
    format!("{least}{}", size(value, &row.unit))
}

/// Effects of which other shapes show from another size on than the typical one.
fn by_shape(rows: &[Diagnosability]) -> Vec<String> {
    let in_words = |row: &Diagnosability| {
        let shapes = row.by_shape.as_ref()?;
        let from = size(Some(shapes.from), &row.unit);
        let others = shapes.to.map_or("at no plausible size".to_owned(), |to| {
            format!("from {}", size(Some(to), &row.unit))
        });
        Some(format!(
            "{}: in some shapes from {from}, in others {others}",
            row.effect
        ))
    };
    rows.iter().filter_map(in_words).collect()
}

fn size(value: Option<f64>, unit: &str) -> String {
    value.map_or_else(
        || "never".to_owned(),
        |v| {
            let (value, unit) = if unit == "rad" {
                (v * 1e6, "µrad")
            } else {
                (v, for_people(unit))
            };
            format!("{} {unit}", plain(value, 3)).trim_end().to_owned()
        },
    )
}

/// The greatest bias per visible µm; of what is never seen, that it biases at all.
fn harm(row: &Diagnosability) -> String {
    let greatest = |list: &[(String, f64, String)]| {
        list.iter()
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            .cloned()
    };
    match (greatest(&row.harm_per_visible), greatest(&row.harm)) {
        (Some((name, bias, _)), _) if bias.abs() > NO_BIAS => {
            format!("{} µrad in {name}", plain(1e6 * bias, 3))
        }
        (None, Some((name, bias, _))) if bias.abs() > NO_BIAS => format!("unseen, in {name}"),
        _ => String::new(),
    }
}

fn answer(
    args: &Args,
    rows: &[Diagnosability],
    mut extras: Vec<(&'static str, f64, Vec<String>)>,
) -> Answer {
    extras.sort_by(|a, b| {
        (b.2.len(), b.1)
            .partial_cmp(&(a.2.len(), a.1))
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut text = String::from(
        "effect                   visible     seen from        told apart from   bias per visible µm      most like\n",
    );
    let mut table = Table::new(
        "What the plan shows",
        [
            "effect",
            "visible",
            "seen from",
            "told apart from",
            "bias per visible µm",
            "most like",
        ],
    );
    let shown = rows.iter().filter(|row| row.detectable.is_some()).count();
    let sentence = format!(
        "Of {} effects such a measurement would show {shown}, each from some size on; {} would not show whatever their size.",
        rows.len(),
        rows.len() - shown
    );
    // To a hundredth of a per cent: below, it is rounding.
    let percent = |row: &Diagnosability| (1e4 * row.visible).round() / 100.0;
    let bar = |row: &Diagnosability| Bar::new(row.effect.clone(), percent(row));
    let visible = Bars::new(Axis::new("visible part", "%")).bars(rows.iter().map(bar));
    for row in rows {
        let [seen, told] = [row.detectable, row.identifiable].map(|value| effect_size(row, value));
        let like = row
            .confused_with
            .as_ref()
            .map_or(String::new(), |n| format!("{n} (cosine {:.2})", row.cosine));
        let harm = harm(row);
        let _ = writeln!(
            text,
            "{:<24} {:>6.1} %  {seen:>15}  {told:>15}   {harm:<22}   {like}",
            row.effect,
            100.0 * row.visible
        );
        table = table.row([
            Cell::Text(row.effect.clone()),
            Cell::Share(row.visible),
            Cell::Text(seen),
            Cell::Text(told),
            Cell::Text(harm),
            Cell::Text(like),
        ]);
    }
    if rows.iter().any(|row| row.at_least) {
        let _ = writeln!(text, "{AT_LEAST}");
    }
    let shapes = by_shape(rows);
    if !shapes.is_empty() {
        let _ = writeln!(text, "\n{BY_SHAPE}");
        for line in &shapes {
            let _ = writeln!(text, "  {line}");
        }
    }
    text += "\nWhat would help most\n";
    let mut help = Vec::new();
    for (name, gain, new) in &extras {
        let shows = if new.is_empty() {
            String::new()
        } else {
            format!(", and shows {}", new.join(", "))
        };
        help.push(format!(
            "{name}: sizes seen shrink by a factor of {gain:.2}{shows}"
        ));
    }
    for line in &help {
        let _ = writeln!(text, "  {line}");
    }
    let extras: Vec<_> = extras
        .into_iter()
        .map(|(name, gain, shows)| json!({"measure": name, "gain": gain, "shows": shows}))
        .collect();
    let mut section = Section::new("What the plan can show")
        .figure(Figure::new(
            "Visible part of each effect",
            "What the fit of such a measurement cannot take up, so that it shows; below the rest it passes for form, tilt or offset.",
            visible,
        ))
        .table(table);
    if rows.iter().any(|row| row.at_least) {
        section = section.paragraph(AT_LEAST);
    }
    if !shapes.is_empty() {
        section = section.paragraph(BY_SHAPE).list(shapes);
    }
    Answer {
        text,
        json: json!({"schema": "errsep.plan/1", "effects": rows, "extra_measurements": extras}),
        page: Page::new("Plan", args.plan.display().to_string())
            .summary(Standing::Neutral, sentence)
            .section(section.paragraph("What would help most:").list(help)),
        tables: Vec::new(),
        inputs: vec![args.plan.clone()],
        setup: None,
        seed: Some(args.common.seed),
        status: Status::Done,
    }
}
