//! `errsep straightness`: a profile against the three reference lines.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use errsep_models::straightness::{NoStraightness, ReferenceLine, Straightness, straightness};
use serde_json::json;

use super::{Answer, ColumnArgs, CommonArgs};
use crate::io::{ColumnMap, CsvTable, Message, Status, TableReader};
use crate::report::{self, number};

/// Straightness of a profile: least-squares, end-point and minimum-zone reference lines.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The file has the columns x (position, mm) and deviation (um):

    x,deviation
    0,-0.3
    100,0.9

Other units stand beside the names: `x (inch)`, `deviation_mm`.

Example: errsep straightness profile.csv --out straightness
         errsep straightness report/profiles.csv --of M")]
pub struct Args {
    /// The profile.
    #[arg(value_name = "PROFILE.csv")]
    profile: PathBuf,
    /// The column with the deviations, where other columns stand beside it: a form of `profiles.csv`.
    #[arg(long, value_name = "COLUMN", conflicts_with = "columns")]
    of: Option<String>,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Works out the three straightness errors.
///
/// # Errors
/// The file is no table of positions and deviations.
pub fn run(args: &Args) -> Result<Answer, Message> {
    let (x, y) = read(&args.profile, &args.columns.map(), args.of.as_deref())?;
    let results = ReferenceLine::ALL
        .into_iter()
        .map(|reference| straightness(&x, &y, reference))
        .collect::<Result<Vec<_>, _>>()
        .map_err(|e| {
            let remedy = match e {
                NoStraightness::TooLarge { .. } => "check the unit of the deviations, um",
                _ => "give readings at two or more positions",
            };
            Message::bad_input(e.to_string())
                .in_file(&args.profile)
                .remedy(remedy)
        })?;
    if results
        .iter()
        .any(|s| !(s.error().is_finite() && s.slope.is_finite()))
    {
        return Err(Message::bad_input(
            "the numbers are so large that the deviations are not finite",
        )
        .in_file(&args.profile)
        .remedy("give positions in mm and deviations in um"));
    }
    let mut text = format!(
        "Straightness of {} ({} points)\n",
        args.profile.display(),
        x.len()
    );
    for s in &results {
        let _ = writeln!(text, "  {}", in_words(s));
    }
    let remark = nothing_shown(&x, &y);
    if let Some(remark) = remark {
        let _ = writeln!(text, "  {remark}");
    }
    let table = results.iter().fold(
        CsvTable::new("deviations.csv").numbers("x_mm", x.clone()),
        |table, s| {
            let deviations = x.iter().zip(&y).map(|(&x, &y)| s.deviation(x, y));
            table.numbers(
                format!("{}_um", s.reference.key()),
                deviations.collect::<Vec<_>>(),
            )
        },
    );
    Ok(Answer {
        text,
        json: json!({
            "schema": "errsep.straightness/1",
            "points": x.len(),
            "reference_lines": results.iter().map(as_json).collect::<Vec<_>>(),
            "remarks": remark.into_iter().collect::<Vec<_>>(),
            "profile": profile(&x, &y, &results),
        }),
        page: args.common.page(|| {
            let name = args.profile.display().to_string();
            report::straightness::page(&name, &x, &y, &results, remark)
        }),
        tables: vec![table],
        inputs: vec![args.profile.clone()],
        setup: None,
        seed: None,
        status: Status::Done,
    })
}

/// A profile that is straight whatever was measured.
fn nothing_shown(x: &[f64], y: &[f64]) -> Option<&'static str> {
    let others = |values: &[f64], known: &[f64]| values.iter().any(|v| !known.contains(v));
    let ends = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |e, v| {
        (e.0.min(*v), e.1.max(*v))
    });
    if !others(x, &[ends.0, ends.1]) {
        return Some(
            "Two positions always lie on a line: this says nothing of the straightness. Read more positions.",
        );
    }
    (!others(y, &y[..1])).then_some(
        "All deviations are equal, which says nothing of the straightness: the resolution is too coarse, or \
         the column is not the reading.",
    )
}

fn read(path: &Path, map: &ColumnMap, of: Option<&str>) -> Result<(Vec<f64>, Vec<f64>), Message> {
    let mut table = TableReader::open_as(path, map)?;
    if of.is_none() {
        table.only(&["x", "deviation"]).map_err(|message| {
            message.remedy("name the column of the deviations with --of, such as --of M")
        })?;
    }
    let at = table.column("x")?.in_mm();
    let deviation = table.column(of.unwrap_or("deviation"))?.in_um();
    let (mut x, mut y) = (Vec::new(), Vec::new());
    while let Some(row) = table.next_row()? {
        x.push(row.number(&at)?);
        y.push(row.number(&deviation)?);
    }
    if x.is_empty() {
        return Err(table.no_rows());
    }
    Ok((x, y))
}

/// Deviations from each reference line, in the order of the positions.
fn profile(x: &[f64], y: &[f64], results: &[Straightness]) -> serde_json::Value {
    let mut points: Vec<(f64, f64)> = x.iter().copied().zip(y.iter().copied()).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut profile = serde_json::Map::new();
    profile.insert(
        "x".to_owned(),
        json!(points.iter().map(|p| p.0).collect::<Vec<_>>()),
    );
    for s in results {
        let deviations: Vec<f64> = points.iter().map(|p| s.deviation(p.0, p.1)).collect();
        profile.insert(s.reference.key().to_owned(), json!(deviations));
    }
    profile.insert("unit".to_owned(), json!("um"));
    profile.into()
}

fn in_words(s: &Straightness) -> String {
    format!(
        "{:13} {} µm (from {} to +{}), slope of the line {} µrad",
        s.reference.name(),
        number::fixed(s.error(), 3),
        number::fixed(s.lowest, 3),
        number::fixed(s.highest, 3),
        // µm/mm = mrad.
        number::fixed(s.slope * 1e3, 3)
    )
}

fn as_json(s: &Straightness) -> serde_json::Value {
    json!({
        "reference": s.reference.key(),
        "error": {"value": s.error(), "unit": "um"},
        "highest": s.highest,
        "lowest": s.lowest,
        "slope": {"value": s.slope * 1e-3, "unit": "rad"},
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use clap::Parser;

    use super::*;
    use crate::cli::common::{Called, Wanted};
    use crate::io::source::{InMemory, begin_record_with};

    #[derive(Parser)]
    struct Alone {
        #[command(flatten)]
        args: Args,
    }

    #[test]
    fn where_the_json_is_wanted_nothing_else_is_made() {
        let Alone { args } = Alone::try_parse_from(["errsep", "<data>"]).unwrap();
        begin_record_with(
            true,
            vec![InMemory {
                name: "<data>".to_owned(),
                bytes: Arc::from(&b"x,deviation\n0,0\n1,2\n2,0\n"[..]),
            }],
        );
        let answer = |wanted| {
            let _called = Called::begin(wanted);
            run(&args).unwrap()
        };
        let (lean, whole) = (answer(Wanted::Json), answer(Wanted::Everything));
        assert_eq!(lean.json, whole.json);
        assert_eq!(lean.page.figures().count(), 0);
        assert!(whole.page.figures().count() > 0);
        // What a thread is called for does not outlive the call.
        assert!(!args.common.wants_folder());
    }
}
