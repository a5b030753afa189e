//! `errsep fourier`: straightness by the Fourier two-sensor and three-sensor methods.

mod missing;
mod weighing;

use std::fmt::Write;
use std::path::PathBuf;

use errsep_models::fourier::{
    Compensation, FourierError, NoiseSource, OrderResult, Scan, Section, Separation, separate,
};
use errsep_models::uncertainty::coverage_factor;
use errsep_models::zone::StraightnessError;
use serde_json::{Value, json};

use self::weighing::{methods, remarks};
use super::diagnose::joined::{self, Given};
use super::quantity::{COVERAGE, coverage_json, coverage_words, unexpandable};
use super::{Answer, ColumnArgs, CommonArgs, disagreement};
use crate::io::fourier::{FourierSetup, LocatedScan, read_scans, told};
use crate::io::{CsvTable, Message, Status};
use crate::report::fourier::{FourierView, Method, Width, page};
use crate::report::number;
use missing::lacking;

/// Orders kept where nothing is said.
pub(super) const ORDERS: usize = 30;

/// Straightness by the Fourier two-sensor, three-sensor and hybrid methods.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Each file has the columns x (position of P1, mm, from 0 in even steps over the section), m1, m2 and,
with a third probe, m3 (um; empty where a probe was not read). P2 stands at x + d, P3 at x + d - L. A
column spacing (d, mm) lets one file hold several scans, a column repeat several repeats:

    spacing,x,m1,m2,m3
    34.1,0,3.218,1.950,
    34.1,0.1,3.305,1.946,

The set-up names the section and, where there is no such column, the spacing of each file:

    [section]
    length = 100.0        # mm
    orders = 30
    [probe]
    spacing = [48.5, 34.1, 78.6]
    noise = 2.0           # um; absent: estimated
    [method]
    compensation = \"fitted\"        # or \"chord\", \"level\", \"none\"
    combination = \"least-squares\"  # or \"hybrid\"

Example: errsep fourier d48.csv d34.csv d79.csv --setup fourier.toml --out fourier")]
pub struct Args {
    /// The scans.
    #[arg(value_name = "DATA.csv", required = true)]
    data: Vec<PathBuf>,
    /// The set-up.
    #[arg(long, value_name = "S.toml")]
    setup: Option<PathBuf>,
    /// Length of the section, mm, instead of that of the set-up.
    #[arg(long, value_name = "MM")]
    length: Option<f64>,
    /// Fit these effects along with the model, by the names of `errsep diagnose`: the answer is given without
    /// and with them, with one covariance.
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',')]
    with: Vec<String>,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Separates the workpiece from the slide.
///
/// # Errors
/// The files cannot be read, the set-up lacks the length, or the scans cannot be joined.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let setup = match &args.setup {
        Some(path) => FourierSetup::read(path)?,
        None => FourierSetup::default(),
    };
    if let Some(length) = args.length.filter(|l| !(*l > 0.0 && l.is_finite())) {
        return Err(
            Message::bad_input(format!("--length {length} is not a positive number"))
                .remedy("give the length of the section in mm"),
        );
    }
    let length = args.length.or(setup.section.length).ok_or_else(|| {
        let message = Message::bad_input("the length of the section is not known")
            .remedy("give [section] length in the set-up, or --length");
        match args.setup.as_ref().or(args.data.first()) {
            Some(path) => message.in_file(path),
            None => message,
        }
    })?;
    let spacings = &setup.probe.spacing;
    if !spacings.is_empty() && spacings.len() != args.data.len() {
        return Err(Message::bad_input(format!(
            "the set-up gives {} probe spacings for {} files",
            spacings.len(),
            args.data.len()
        ))
        .remedy("give one spacing for each file, in the order of the files"));
    }
    let section = Section {
        length,
        orders: setup.section.orders.unwrap_or(ORDERS),
    };
    let asked = setup.method.compensation;
    let mut located = Vec::new();
    for (index, path) in args.data.iter().enumerate() {
        let spacing = spacings.get(index).copied();
        located.extend(read_scans(path, &args.columns.map(), spacing)?);
    }
    let missing = LocatedScan::fill(&mut located, section);
    for scan in &located {
        scan.check(section, asked)?;
    }
    let scans: Vec<Scan> = located.into_iter().map(|l| l.scan).collect();
    let combination = setup.method.combination;
    let answer = separate(&scans, section, asked, combination, setup.probe.noise)
        .map_err(|e| refused(&e, args))?;
    let widths = [
        Width::of(&answer.workpiece_error())?,
        Width::of(&answer.slide_error())?,
    ];
    let methods = methods(&scans, section, asked, &answer);
    let mut remarks = remarks(&answer, section, asked);
    remarks.extend(lacking(&missing));
    let name = args
        .data
        .iter()
        .map(|p| p.display().to_string())
        .collect::<Vec<_>>()
        .join(", ");
    let data = match (&args.data[..], args.with.is_empty()) {
        ([data], _) | ([data, ..], true) => data,
        _ => {
            return Err(
                Message::bad_input("--with takes the scans of one file").remedy(
                    "put all scans into one file, with the spacing of the probes in a column `spacing`",
                ),
            );
        }
    };
    let answer = Answer {
        text: in_words(&name, &scans, (&answer, &widths), &methods, &remarks)?,
        json: as_json(&scans, section, (&answer, &widths), &methods, &remarks)?,
        page: page(&FourierView {
            data: &name,
            scans: &scans,
            length,
            separation: &answer,
            widths: &widths,
            methods: &methods,
            remarks: &remarks,
        }),
        tables: vec![profiles_table(&answer), orders_table(&answer)],
        inputs: args.data.iter().chain(&args.setup).cloned().collect(),
        setup: None,
        seed: None,
        status: if answer.lost.len() == section.orders {
            Status::NotSolved
        } else {
            Status::Done
        },
    };
    joined::beside(
        answer,
        &Given {
            setup: args.setup.as_deref(),
            length: args.length,
            columns: args.columns.clone(),
            ..Given::to("fourier", data, &args.with, &args.common)
        },
    )
}

impl Width {
    fn of(found: &StraightnessError) -> Result<Self, Message> {
        Ok(Self {
            value: found.value,
            std: found.std,
            widening: found.widening,
            interval: found.interval(COVERAGE).map_err(unexpandable)?,
        })
    }

    fn as_json(&self) -> Value {
        json!({
            "value": self.value,
            "std": self.std,
            "widening": self.widening,
            "interval": [self.interval.0, self.interval.1],
            "coverage_probability": COVERAGE,
            "unit": "um",
        })
    }
}

fn refused(error: &FourierError, args: &Args) -> Message {
    match args.data.first() {
        Some(only) if args.data.len() == 1 => told(error).in_file(only),
        _ => told(error),
    }
}

fn in_words(
    name: &str,
    scans: &[Scan],
    (s, widths): (&Separation, &[Width; 2]),
    methods: &[Method],
    remarks: &[String],
) -> Result<String, Message> {
    let mut text = format!("Fourier separation of {name} ({})\n", counted(scans.len()));
    for (what, width) in [("workpiece", &widths[0]), ("slide", &widths[1])] {
        let _ = writeln!(
            text,
            "  {:30} {}",
            format!("straightness of the {what}"),
            width.in_words()
        );
    }
    let _ = writeln!(
        text,
        "  {:30} peak to valley about the least-squares line; its interval allows for what the noise has added",
        ""
    );
    let _ = writeln!(
        text,
        "  noise of a reading             {} µm ({})",
        number::plain(s.noise.0, 3),
        noise_words(s)
    );
    let greatest = s.straightness_std.iter().copied().fold(0.0, f64::max);
    let k = coverage_factor(COVERAGE, s.degrees_of_freedom).map_err(unexpandable)?;
    let _ = writeln!(
        text,
        "  a point of its profile         u up to {} µm, U = {} µm: {}",
        number::plain(greatest, 3),
        number::uncertainty(k * greatest),
        coverage_words(s.degrees_of_freedom)?
    );
    for step in &s.steps {
        let _ = writeln!(
            text,
            "  {:30} {} µm (height difference and rise{})",
            format!("step at the joint, d = {} mm", step.spacing),
            number::measured(step.value, Some(step.std)),
            match s.compensation {
                Compensation::Fitted => ", fitted",
                Compensation::Chord => ", two readings",
                Compensation::None | Compensation::Level => ", left in the profile",
            }
        );
    }
    for (what, value) in [
        ("height difference P2 - P3", s.height_difference),
        ("rise over the section", s.rise),
    ] {
        if let Some(value) = value {
            let _ = writeln!(
                text,
                "  {what:30} {} µm (if the slide ends level)",
                number::plain(value, 4)
            );
        }
    }
    if let Some(u) = s.repeatability {
        let _ = writeln!(
            text,
            "  repeatability U_sp             {} µm",
            number::plain(u, 3)
        );
    }
    if !methods.is_empty() {
        let _ = writeln!(
            text,
            "\nOther ways on the same scans: standard uncertainty of the profile, difference of its\n\
             straightness from the answer (both rms over positions)"
        );
        for method in methods {
            let _ = writeln!(
                text,
                "  {:28} {:>8} µm {:>8} µm",
                method.name,
                number::plain(method.profile_std, 3),
                number::plain(method.difference, 3)
            );
        }
    }
    for remark in remarks {
        let _ = writeln!(text, "\n{remark}");
    }
    if !s.lost.is_empty() {
        let _ = writeln!(
            text,
            "\nLost: no spacing passes the orders {}. They are zero in the profile.",
            list(&s.lost)
        );
    }
    Ok(text)
}

fn list(orders: &[usize]) -> String {
    orders
        .iter()
        .map(ToString::to_string)
        .collect::<Vec<_>>()
        .join(", ")
}

fn counted(scans: usize) -> String {
    format!("{scans} scan{}", if scans == 1 { "" } else { "s" })
}

fn noise_words(s: &Separation) -> String {
    if let Some((_, correlated, length)) = s.correlated_noise() {
        return format!(
            "from the repeats; {} µm of it goes on along a scan, over {} mm, which the uncertainties count",
            number::plain(correlated, 2),
            number::plain(length, 2)
        );
    }
    let source = match s.noise.1 {
        NoiseSource::Given => "given",
        NoiseSource::Repeats => "from the repeats",
        NoiseSource::Spacings => "from the disagreement of the spacings, whatever the form",
        NoiseSource::BeyondOrders => "from the finest orders: holds form of that fineness too",
    };
    source.to_owned()
}

fn as_json(
    scans: &[Scan],
    section: Section,
    (s, widths): (&Separation, &[Width; 2]),
    methods: &[Method],
    remarks: &[String],
) -> Result<Value, Message> {
    Ok(json!({
        "schema": "errsep.fourier/1",
        "section": {"length": section.length, "unit": "mm", "orders": section.orders},
        "combination": s.combination,
        "compensation": s.compensation,
        "scans": scans.iter().map(|scan| json!({
            "spacing": scan.spacing,
            "repeat": scan.repeat,
            "readings": scan.readings.len(),
            "filled": scan.filled.iter().filter_map(|f| Some(scan.readings.get(f.index)?.x)).collect::<Vec<_>>(),
            "probes": if scan.has_third_probe() { 3 } else { 2 },
        })).collect::<Vec<_>>(),
        "noise": {"value": s.noise.0, "unit": "um", "source": s.noise.1, "first_probe": s.first_scatter,
            "correlated": s.correlated_noise().map(|(white, correlated, length)| json!({
                "white": white, "correlated": correlated, "length": length}))},
        "uncertainty": coverage_json(Some(s.degrees_of_freedom))?,
        "steps": s.steps.iter().map(|j| json!({
            "spacing": j.spacing,
            "value": j.value,
            "std": j.std,
            "unit": "um",
        })).collect::<Vec<_>>(),
        "beyond_orders": s.beyond_orders.map(|b| json!({
            "rms": b.rms,
            "unit": "um",
            "p_value": b.p_value,
        })),
        "disagreement": disagreement::as_json(s.disagreement),
        "remarks": remarks,
        "height_difference": s.height_difference.map(|v| json!({"value": v, "unit": "um"})),
        "rise": s.rise.map(|v| json!({"value": v, "unit": "um"})),
        "repeatability": s.repeatability.map(|v| json!({"value": v, "unit": "um"})),
        "straightness": {
            "workpiece": widths[0].as_json(),
            "slide": widths[1].as_json(),
        },
        "methods": methods.iter().map(|m| json!({
            "method": m.name,
            "profile_std": {"value": m.profile_std, "unit": "um"},
            "difference": {"value": m.difference, "unit": "um"},
        })).collect::<Vec<_>>(),
        "lost_orders": s.lost,
        "orders": s.orders.iter().map(|o| json!({
            "order": o.order,
            "determinants": o.determinants,
            "best_spacing": scans.get(o.best_scan).map(|scan| scan.spacing),
            "gain": if o.lost { Value::Null } else { json!(o.gain) },
            "re": o.coefficient.re,
            "im": o.coefficient.im,
            "std": o.std(),
            "re_std": o.real_std,
            "im_std": o.imaginary_std,
            "covariance": {"value": o.covariance, "unit": "um2"},
            "unit": "um",
        })).collect::<Vec<_>>(),
        "profiles": {
            "x": s.x,
            "workpiece": s.workpiece,
            "workpiece_std": s.workpiece_std,
            "straightness": s.straightness,
            "straightness_std": s.straightness_std,
            "slide": s.slide,
            "slide_std": s.slide_std,
            "unit": "um",
        },
    }))
}

fn profiles_table(s: &Separation) -> CsvTable {
    CsvTable::new("profiles.csv")
        .numbers("x_mm", s.x.clone())
        .numbers("workpiece_um", s.workpiece.clone())
        .numbers("workpiece_std_um", s.workpiece_std.clone())
        .numbers("straightness_um", s.straightness.clone())
        .numbers("straightness_std_um", s.straightness_std.clone())
        .numbers("slide_um", s.slide.clone())
        .numbers("slide_std_um", s.slide_std.clone())
}

fn orders_table(s: &Separation) -> CsvTable {
    let column = |of: fn(&OrderResult) -> f64| s.orders.iter().map(of).collect::<Vec<f64>>();
    CsvTable::new("orders.csv")
        .numbers("order", column(|o| o.order as f64))
        .numbers("re_um", column(|o| o.coefficient.re))
        .numbers("im_um", column(|o| o.coefficient.im))
        .numbers("std_um", column(|o| o.std()))
        .numbers("re_std_um", column(|o| o.real_std))
        .numbers("im_std_um", column(|o| o.imaginary_std))
        .numbers("gain", column(|o| if o.lost { f64::NAN } else { o.gain }))
}
