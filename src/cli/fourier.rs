//! `errsep fourier`: straightness by the Fourier two-sensor and three-sensor methods.

use std::fmt::Write;
use std::path::PathBuf;

use errsep_models::fourier::{
    Combination, FourierError, Scan, Section, Separation, separate, straightness,
};
use errsep_models::uncertainty::coverage_factor;
use serde_json::{Value, json};

use super::quantity::{COVERAGE, coverage_json, coverage_words, unexpandable};
use super::{Answer, CommonArgs};
use crate::io::fourier::{FourierSetup, read_scans};
use crate::io::{CsvTable, Message, Status};
use crate::report::fourier::{FourierView, page, peak_to_valley};
use crate::report::number;

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
    compensation = \"chord\"         # or \"level\", \"none\"
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
    let length = args.length.or(setup.section.length).ok_or_else(|| {
        Message::bad_input("the length of the section is not known")
            .remedy("give [section] length in the set-up, or --length")
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
    let mut scans = Vec::new();
    for (index, path) in args.data.iter().enumerate() {
        scans.extend(read_scans(path, spacings.get(index).copied())?);
    }
    let solve = |scans: &[Scan], combination: Combination| {
        separate(
            scans,
            section,
            setup.method.compensation,
            combination,
            setup.probe.noise,
        )
        .map_err(|e| refused(&e, args))
    };
    let answer = solve(&scans, setup.method.combination)?;
    let methods = methods(&scans, answer.noise.0, |scans, combination| {
        separate(
            scans,
            section,
            setup.method.compensation,
            combination,
            Some(answer.noise.0),
        )
        .map_err(|e| refused(&e, args))
    })?;
    let name = args
        .data
        .iter()
        .map(|p| p.display().to_string())
        .collect::<Vec<_>>()
        .join(", ");
    let straight = straightness(&answer.x, &answer.workpiece);
    Ok(Answer {
        text: in_words(&name, &scans, &answer, &methods, &straight)?,
        json: as_json(&scans, section, &answer, &methods, &straight, &setup)?,
        page: page(&FourierView {
            data: &name,
            scans: &scans,
            length,
            separation: &answer,
            straightness: &straight,
            methods: &methods,
        }),
        tables: vec![profiles_table(&answer, &straight), orders_table(&answer)],
        inputs: args.data.iter().chain(&args.setup).cloned().collect(),
        seed: None,
        status: if answer.lost.len() == section.orders {
            Status::NotSolved
        } else {
            Status::Done
        },
    })
}

fn refused(error: &FourierError, args: &Args) -> Message {
    let message = Message::bad_input(error.to_string())
        .remedy("see `errsep fourier --help` for the grid and the readings that the method needs");
    match args.data.first() {
        Some(only) if args.data.len() == 1 => message.in_file(only),
        _ => message,
    }
}

/// Name and root-mean-square standard uncertainty of the profile of each way to combine the scans.
fn methods(
    scans: &[Scan],
    noise: f64,
    solve: impl Fn(&[Scan], Combination) -> Result<Separation, Message>,
) -> Result<Vec<(String, f64)>, Message> {
    let uncertainty = |s: &Separation| {
        let sum: f64 = s.workpiece_std.iter().map(|u| u * u).sum();
        (sum / s.workpiece_std.len().max(1) as f64).sqrt()
    };
    let mut spacings: Vec<f64> = scans.iter().map(|s| s.spacing).collect();
    spacings.sort_by(f64::total_cmp);
    spacings.dedup();
    let mut found = Vec::new();
    if noise <= 0.0 {
        return Ok(found);
    }
    for &d in &spacings {
        let own: Vec<Scan> = scans.iter().filter(|s| s.spacing == d).cloned().collect();
        let alone = solve(&own, Combination::LeastSquares)?;
        found.push((format!("d = {d} mm alone"), uncertainty(&alone)));
    }
    if spacings.len() > 1 {
        for (name, combination) in [
            ("hybrid", Combination::Hybrid),
            ("least squares", Combination::LeastSquares),
        ] {
            found.push((name.to_owned(), uncertainty(&solve(scans, combination)?)));
        }
    }
    Ok(found)
}

fn in_words(
    name: &str,
    scans: &[Scan],
    s: &Separation,
    methods: &[(String, f64)],
    straight: &[f64],
) -> Result<String, Message> {
    let mut text = format!("Fourier separation of {name} ({})\n", counted(scans.len()));
    let _ = writeln!(
        text,
        "  straightness of the workpiece  {} µm (peak to valley about the least-squares line)",
        number::plain(peak_to_valley(straight), 4)
    );
    let _ = writeln!(
        text,
        "  straightness of the slide      {} µm",
        number::plain(peak_to_valley(&straightness(&s.x, &s.slide)), 4)
    );
    let _ = writeln!(
        text,
        "  noise of a reading             {} µm ({})",
        number::plain(s.noise.0, 3),
        noise_words(s)
    );
    if let Some(degrees) = s.degrees_of_freedom {
        let greatest = s.workpiece_std.iter().copied().fold(0.0, f64::max);
        let k = coverage_factor(COVERAGE, degrees).map_err(unexpandable)?;
        let _ = writeln!(
            text,
            "  a point of the profile         u up to {} µm, U = {} µm: {}",
            number::plain(greatest, 3),
            number::plain(k * greatest, 2),
            coverage_words(degrees)?
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
            "\nStandard uncertainty of the profile (rms over positions)"
        );
        for (method, u) in methods {
            let _ = writeln!(text, "  {method:28} {} µm", number::plain(*u, 3));
        }
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

fn noise_words(s: &Separation) -> &'static str {
    use errsep_models::fourier::NoiseSource;
    match s.noise.1 {
        NoiseSource::Given => "given",
        NoiseSource::Repeats => "from the repeats",
        NoiseSource::Spacings => "from the disagreement of the spacings",
        NoiseSource::BeyondOrders => "beyond the orders kept: holds the finer form too",
    }
}

fn as_json(
    scans: &[Scan],
    section: Section,
    s: &Separation,
    methods: &[(String, f64)],
    straight: &[f64],
    setup: &FourierSetup,
) -> Result<Value, Message> {
    Ok(json!({
        "schema": "errsep.fourier/1",
        "section": {"length": section.length, "unit": "mm", "orders": section.orders},
        "combination": s.combination,
        "compensation": setup.method.compensation,
        "scans": scans.iter().map(|scan| json!({
            "spacing": scan.spacing,
            "repeat": scan.repeat,
            "readings": scan.readings.len(),
            "probes": if scan.has_third_probe() { 3 } else { 2 },
        })).collect::<Vec<_>>(),
        "noise": {"value": s.noise.0, "unit": "um", "source": s.noise.1},
        "uncertainty": coverage_json(s.degrees_of_freedom)?,
        "height_difference": s.height_difference.map(|v| json!({"value": v, "unit": "um"})),
        "rise": s.rise.map(|v| json!({"value": v, "unit": "um"})),
        "repeatability": s.repeatability.map(|v| json!({"value": v, "unit": "um"})),
        "straightness": {
            "workpiece": {"value": peak_to_valley(straight), "unit": "um"},
            "slide": {"value": peak_to_valley(&straightness(&s.x, &s.slide)), "unit": "um"},
        },
        "methods": methods.iter().map(|(method, u)| json!({
            "method": method,
            "profile_std": {"value": u, "unit": "um"},
        })).collect::<Vec<_>>(),
        "lost_orders": s.lost,
        "orders": s.orders.iter().map(|o| json!({
            "order": o.order,
            "determinants": o.determinants,
            "best_spacing": scans.get(o.best_scan).map(|scan| scan.spacing),
            "gain": if o.lost { Value::Null } else { json!(o.gain) },
            "re": o.coefficient.re,
            "im": o.coefficient.im,
            "std": o.std,
            "unit": "um",
        })).collect::<Vec<_>>(),
        "profiles": {
            "x": s.x,
            "workpiece": s.workpiece,
            "workpiece_std": s.workpiece_std,
            "straightness": straight,
            "slide": s.slide,
            "unit": "um",
        },
    }))
}

fn profiles_table(s: &Separation, straight: &[f64]) -> CsvTable {
    CsvTable::new("profiles.csv")
        .numbers("x_mm", s.x.clone())
        .numbers("workpiece_um", s.workpiece.clone())
        .numbers("workpiece_std_um", s.workpiece_std.clone())
        .numbers("straightness_um", straight.to_vec())
        .numbers("slide_um", s.slide.clone())
}

fn orders_table(s: &Separation) -> CsvTable {
    let column = |of: fn(&errsep_models::fourier::OrderResult) -> f64| {
        s.orders.iter().map(of).collect::<Vec<f64>>()
    };
    CsvTable::new("orders.csv")
        .numbers("order", column(|o| o.order as f64))
        .numbers("re_um", column(|o| o.coefficient.re))
        .numbers("im_um", column(|o| o.coefficient.im))
        .numbers("std_um", column(|o| o.std))
        .numbers("gain", column(|o| if o.lost { f64::NAN } else { o.gain }))
}
