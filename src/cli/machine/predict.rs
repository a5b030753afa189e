//! The deviations of points.

use std::fmt::Write;
use std::path::PathBuf;

use errsep_models::machine::{Axis, MachineError, Position, features, propagate};
use errsep_models::uncertainty::{Budget, Expanded, UncertaintyError};
use nalgebra::Vector3;
use serde_json::json;

use super::{Context, PropagationArgs};
use crate::cli::{Answer, CommonArgs};
use crate::io::machine::read_points;
use crate::io::{CsvTable, Message, Status};
use crate::report::plot::{Axis as PlotAxis, Chart, Series};
use crate::report::{Cell, Figure, Page, Section, Standing, Table, budget as budget_block, number};

/// Deviations of points with their uncertainty.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: errsep machine machine.toml predict points.csv --out prediction")]
pub(super) struct Args {
    /// The points (columns point, x, y and z, mm).
    #[arg(value_name = "POINTS.csv")]
    points: PathBuf,
    #[command(flatten)]
    pub(super) propagation: PropagationArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// What is predicted at one point.
struct Predicted {
    name: String,
    position: Position,
    exact: Vector3<f64>,
    budgets: [Budget; 3],
    expanded: [Expanded; 3],
}

/// The largest deviation of so many points: where, and how well it is known.
fn told(point: &Predicted, count: usize) -> String {
    let p = point.position;
    let parts = ["X", "Y", "Z"]
        .iter()
        .zip(&point.budgets)
        .zip(&point.expanded);
    let parts: Vec<String> = parts
        .map(|((axis, budget), expanded)| {
            let u = Some(expanded.expanded_uncertainty);
            format!("{axis} {} µm", number::measured(budget.result.value, u))
        })
        .collect();
    format!(
        "The largest deviation of {count} points is {} µm at {} ({}, {}, {} mm): {} (expanded uncertainties).",
        number::plain(point.exact.norm(), 3),
        point.name,
        number::plain(p.x, 6),
        number::plain(p.y, 6),
        number::plain(p.z, 6),
        parts.join(", ")
    )
}

pub(super) fn run(context: &Context, args: &Args) -> Result<Answer, Message> {
    let points = read_points(&args.points)?
        .into_iter()
        .map(|(name, position)| predict(context, name, position))
        .collect::<Result<Vec<_>, MachineError>>()
        .map_err(|error| context.wrong(&error))?;
    let worst = points
        .iter()
        .flat_map(|p| p.budgets.iter().map(move |b| (p, b)))
        .max_by(|a, b| {
            let u = |x: &(&Predicted, &Budget)| x.1.result.standard_uncertainty;
            u(a).total_cmp(&u(b))
        });
    let machine = context.args.model.display().to_string();
    let by_size = |a: &&Predicted, b: &&Predicted| a.exact.norm().total_cmp(&b.exact.norm());
    let largest = points.iter().max_by(by_size);
    let mut text = format!("Deviations of {machine} ({})\n\n", context.machine.chain());
    let _ = writeln!(
        text,
        "point            X µm             Y µm             Z µm   (k = 1)"
    );
    for p in &points {
        let shown =
            |b: &Budget| number::measured(b.result.value, Some(b.result.standard_uncertainty));
        let [x, y, z] = &p.budgets;
        let _ = writeln!(
            text,
            "{:6} {:>16} {:>16} {:>16}",
            p.name,
            shown(x),
            shown(y),
            shown(z)
        );
    }
    let mut page = Page::new("Machine: predicted deviations", machine)
        .summary(
            Standing::Good,
            largest.map_or_else(String::new, |p| told(p, points.len())),
        )
        .section(
            Section::new("Deviations").figure(figure(&points)).table(table(&points)).note(
                "First-order kinematics; the file deviations.csv holds those by finite rotations beside.",
            ),
        );
    if let Some((point, budget)) = worst {
        let label = format!("point {}, {}", point.name, budget.result.label);
        let _ = writeln!(text, "\nLargest uncertainty: {label}");
        text.push_str(&budget_block::text(budget));
        page = page.section(
            Section::new("Budget of the most uncertain deviation")
                .paragraph(label.clone())
                .figure(budget_block::figure("What makes the uncertainty", budget))
                .table(budget_block::table(&label, budget)),
        );
    }
    let json_points: Vec<_> = points.iter().map(as_json).collect();
    Ok(Answer {
        text,
        json: json!({
            "schema": "errsep.machine/1",
            "action": "predict",
            "chain": context.machine.chain().to_string(),
            "independence": context.propagation.independence(),
            "prediction": context.propagation.prediction(),
            "confidence": context.propagation.confidence,
            "errors": context.errors(),
            "points": json_points,
        }),
        page,
        tables: vec![csv(&points)],
        inputs: context.inputs(Some(&args.points)),
        setup: None,
        seed: None,
        status: Status::Done,
    })
}

fn predict(context: &Context, name: String, position: Position) -> Result<Predicted, MachineError> {
    let p = context.propagation;
    let budget = |axis| {
        let functional = features::point(context.machine, &position, axis)?;
        propagate(
            context.machine,
            &functional,
            p.independence(),
            p.prediction(),
        )
    };
    let budgets = [budget(Axis::X)?, budget(Axis::Y)?, budget(Axis::Z)?];
    let expand =
        |b: &Budget| -> Result<Expanded, UncertaintyError> { b.result.expanded(p.confidence) };
    let expanded = [
        expand(&budgets[0])?,
        expand(&budgets[1])?,
        expand(&budgets[2])?,
    ];
    let exact = context.machine.exact_deviation(&position)?;
    Ok(Predicted {
        name,
        position,
        exact,
        budgets,
        expanded,
    })
}

fn as_json(p: &Predicted) -> serde_json::Value {
    let axis = |i: usize| {
        json!({
            "result": p.budgets[i].result,
            "expanded": p.expanded[i],
            "contributions": p.budgets[i].contributions,
            "by_finite_rotations": p.exact[i],
        })
    };
    json!({
        "point": p.name,
        "position": {"x": p.position.x, "y": p.position.y, "z": p.position.z, "unit": "mm"},
        "deviation": {"x": axis(0), "y": axis(1), "z": axis(2)},
    })
}

fn figure(points: &[Predicted]) -> Figure {
    let numbers: Vec<f64> = (1..=points.len()).map(|i| i as f64).collect();
    let series = |name: &str, i: usize| {
        let value = points.iter().map(|p| p.budgets[i].result.value).collect();
        let half = points
            .iter()
            .map(|p| p.expanded[i].expanded_uncertainty)
            .collect();
        Series::line(name, numbers.clone(), value).half_band(half)
    };
    let chart = Chart::new(
        PlotAxis::new("point, in the order of the file", "").whole(),
        PlotAxis::new("deviation", "µm"),
    );
    let moves = |i: usize| {
        points
            .iter()
            .any(|p| p.budgets[i].result.value != 0.0 || p.expanded[i].expanded_uncertainty > 0.0)
    };
    let chart = [("X", 0), ("Y", 1), ("Z", 2)]
        .into_iter()
        .filter(|(_, i)| moves(*i))
        .fold(chart, |chart, (name, i)| chart.series(series(name, i)));
    Figure::new(
        "Deviations by point",
        "With the expanded uncertainty as a band.",
        chart,
    )
}

fn table(points: &[Predicted]) -> Table {
    points.iter().fold(
        Table::new(
            "Deviations with standard uncertainty",
            [
                "point", "x (mm)", "y (mm)", "z (mm)", "X (µm)", "Y (µm)", "Z (µm)",
            ],
        ),
        |table, p| {
            let of = |b: &Budget| Cell::measured(b.result.value, b.result.standard_uncertainty);
            let at = |value| Cell::Number { value, digits: 6 };
            let [x, y, z] = &p.budgets;
            let q = &p.position;
            table.row([
                p.name.as_str().into(),
                at(q.x),
                at(q.y),
                at(q.z),
                of(x),
                of(y),
                of(z),
            ])
        },
    )
}

fn csv(points: &[Predicted]) -> CsvTable {
    let column = |f: &dyn Fn(&Predicted) -> f64| points.iter().map(f).collect::<Vec<_>>();
    let mut table = CsvTable::new("deviations.csv").texts(
        "point",
        points.iter().map(|p| p.name.clone()).collect::<Vec<_>>(),
    );
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        table = table.numbers(format!("{axis}_mm"), column(&|p| p.position[i]));
    }
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        table = table
            .numbers(
                format!("deviation_{axis}_um"),
                column(&|p| p.budgets[i].result.value),
            )
            .numbers(
                format!("std_{axis}_um"),
                column(&|p| p.budgets[i].result.standard_uncertainty),
            )
            .numbers(
                format!("expanded_{axis}_um"),
                column(&|p| p.expanded[i].expanded_uncertainty),
            )
            .numbers(
                format!("finite_rotations_{axis}_um"),
                column(&|p| p.exact[i]),
            );
    }
    table
}
