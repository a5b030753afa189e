//! `errsep circle`: the circle through points, with uncertainty and circularity.

use std::fmt::Write;
use std::path::PathBuf;

use errsep_models::circle::{
    AlgebraicFit, Circle, CircleError, CircleFit, Circularity, PassScatter, Point, algebraic,
    circularity, nistir_fit, orthogonal_fit,
};
use serde_json::{Value, json};

use super::diagnose::joined::{self, Given};
use super::quantity::{measured_words, quantity_json, unexpandable};
use super::{Answer, ColumnArgs, CommonArgs, disagreement};
use crate::io::circle::{MeasuredCircle, not_converged, read_points};
use crate::io::{CsvTable, Message, Status};
use crate::report::circle::{CircleView, page, zones};
use crate::report::number;

/// Circle through points: centre and radius with uncertainty, circularity by four references.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The file has the columns x and y, mm:

    x,y
    50.0012,0.0003
    49.2391,8.6829

Where the circle was passed over several times, a column repeat tells the passes: what these differ by is
in the uncertainties.

Example: errsep circle points.csv --out circle")]
pub struct Args {
    /// The points.
    #[arg(value_name = "POINTS.csv")]
    points: PathBuf,
    /// Standard deviation of a point's radial deviation, um; estimated from the residuals if absent.
    #[arg(long, value_name = "UM")]
    noise: Option<f64>,
    /// Adds the fit as NISTIR 6868, appendix F, makes it.
    #[arg(long)]
    nistir: bool,
    /// Fit these effects along with the model, by the names of `errsep diagnose`: the answer is given without
    /// and with them, with one covariance.
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',')]
    with: Vec<String>,
    #[command(flatten)]
    columns: ColumnArgs,
    #[command(flatten)]
    pub(super) common: CommonArgs,
}

/// Fits the circle.
///
/// # Errors
/// The file is no table of points, no circle passes through them, or the fit did not converge.
pub fn run(args: &Args) -> Result<Answer, Message> {
    if let Some(noise) = args.noise.filter(|n| !(*n > 0.0 && n.is_finite())) {
        return Err(
            Message::bad_input(format!("--noise {noise} is no standard deviation"))
                .remedy("give a number greater than zero, in µm"),
        );
    }
    let MeasuredCircle { points, passes } = read_points(&args.points, &args.columns.map())?;
    let refused = |e: CircleError| refused(&e, args);
    let mut fit = orthogonal_fit(&points, args.noise).map_err(refused)?;
    fit.count_passes(&passes);
    let zones_found = circularity(&points, fit.circle).map_err(refused)?;
    let alike = fit.neighbours_alike(&points, &passes);
    let arc = fit.covered_arc(&points);
    let form = form_in_words(alike, arc, points.len(), fit.scatter.is_some());
    let refuted = fit
        .disagreement()
        .map(|d| disagreement::in_words(d, "The points deviate", "--noise states", fit.noise_um));
    let on_any = (fit.degrees_of_freedom == 0)
        .then(|| "Three points always lie on a circle: this says nothing of the form.".to_owned());
    let by_passes = fit.scatter.map(|s| passes_in_words(&s));
    let remarks = refuted.into_iter().chain(on_any).chain(by_passes);
    let remarks: Vec<String> = remarks.collect();
    let mut others: Vec<(String, Circle)> = AlgebraicFit::ALL
        .into_iter()
        .filter_map(|kind| Some((kind.name().to_owned(), algebraic(&points, kind).ok()?)))
        .collect();
    let nistir = if args.nistir {
        let start = centroid_start(&points);
        let own = nistir_fit(&points, start).map_err(refused)?;
        others.push(("nistir 6868 F".to_owned(), own.circle));
        Some(own)
    } else {
        None
    };
    let mut json = as_json(&points, &fit, (alike, arc), &zones_found, &others)?;
    json["remarks"] = json!(remarks);
    if let (Some(own), Value::Object(object)) = (nistir, &mut json) {
        object.insert(
            "nistir".to_owned(),
            json!({
                "centre": [own.circle.centre.x, own.circle.centre.y],
                "radius": own.circle.radius,
                "signed_radius": own.signed_radius,
                "iterations": own.iterations,
                "ending": own.ending,
            }),
        );
    }
    let answer = Answer {
        text: in_words(
            args,
            &points,
            &fit,
            (form.as_deref(), &remarks),
            &zones_found,
            &others,
        )?,
        json,
        page: args.common.page(|| {
            page(&CircleView {
                data: &args.points.display().to_string(),
                points: &points,
                circle: fit.circle,
                std: fit.standard_uncertainties(),
                residuals_um: &fit.residuals_um,
                noise: (fit.noise_um, fit.noise_given),
                form: form.as_deref(),
                remarks: &remarks,
                circularity: &zones_found,
                others: &others,
            })
        }),
        tables: vec![
            CsvTable::new("deviations.csv")
                .numbers("x_mm", points.iter().map(|p| p.x).collect::<Vec<_>>())
                .numbers("y_mm", points.iter().map(|p| p.y).collect::<Vec<_>>())
                .numbers("deviation_um", fit.residuals_um.clone()),
        ],
        inputs: vec![args.points.clone()],
        setup: None,
        seed: None,
        status: Status::Done,
    };
    joined::beside(
        answer,
        &Given {
            noise: args.noise,
            columns: args.columns.clone(),
            ..Given::to("circle", &args.points, &args.with, &args.common)
        },
    )
}

fn refused(error: &CircleError, args: &Args) -> Message {
    let message = match error {
        CircleError::StraighterThanAnyCircle => {
            Message::not_determined(error.to_string()).remedy("measure a longer arc")
        }
        CircleError::NotConverged { reason, reached } => {
            not_converged(error, reason, reached.as_ref()).remedy("measure a longer arc")
        }
        CircleError::NoRedundancy => {
            Message::bad_input(error.to_string()).remedy("add points, or give --noise")
        }
        CircleError::TooLarge { .. } | CircleError::TooClose { .. } => {
            Message::bad_input(error.to_string()).remedy("give the columns x and y in mm")
        }
        _ => Message::bad_input(error.to_string())
            .remedy("give three or more different points that are not on one line"),
    };
    message.in_file(&args.points)
}

/// Centroid and mean distance: a start that needs no fit.
fn centroid_start(points: &[Point]) -> Circle {
    let n = points.len().max(1) as f64;
    let centre = Point::new(
        points.iter().map(|p| p.x).sum::<f64>() / n,
        points.iter().map(|p| p.y).sum::<f64>() / n,
    );
    Circle {
        centre,
        radius: points.iter().map(|p| p.distance(centre)).sum::<f64>() / n,
    }
}

/// Below this probability of independent deviations the answer tells of form.
const ALIKE: f64 = 0.01;

/// The gap in the points beyond which they count as part of a circle, rad, where even spacing would leave
/// a gap clearly smaller.
const GAP: f64 = std::f64::consts::FRAC_PI_3;

/// What the answer says of form: that neighbours are alike, and that on part of a circle a form of few
/// undulations passes for centre and radius.
fn form_in_words(alike: Option<f64>, arc: f64, points: usize, by_passes: bool) -> Option<String> {
    let seen = alike.filter(|p| *p < ALIKE).map(|p| {
        let taken = if by_passes {
            ", or noise that the passes tell"
        } else {
            ", which the uncertainties take for independent noise"
        };
        format!(
            "Neighbouring deviations are alike (probability by chance {}): they hold form{taken}. `errsep diagnose --model circle` looks for what makes it: lobes of \
             the part, errors of the axes, a radius or a centre that drifts from point to point.",
            chance_in_words(p)
        )
    });
    let even = std::f64::consts::TAU / points.max(1) as f64;
    let gap = std::f64::consts::TAU - arc;
    let part = (gap > GAP.max(1.5 * even)).then(|| {
        format!(
            "The points cover {:.0}°: a form that varies slowly along this arc passes for centre and radius, \
             and no uncertainty here counts it.",
            arc.to_degrees()
        )
    });
    match (seen, part) {
        (Some(seen), Some(part)) => Some(format!("{seen} {part}")),
        (seen, part) => seen.or(part),
    }
}

fn chance_in_words(p: f64) -> String {
    if p < 1e-4 {
        "less than 0.0001".to_owned()
    } else {
        number::plain(p, 1)
    }
}

/// What passes add to the uncertainties.
fn passes_in_words(scatter: &PassScatter) -> String {
    format!(
        "The circles of the {} passes differ by {} times what the scatter of their points allows (probability by chance {}): the \
         uncertainties count it.",
        scatter.passes,
        number::plain(scatter.factor, 2),
        chance_in_words(scatter.p_value)
    )
}

fn in_words(
    args: &Args,
    points: &[Point],
    fit: &CircleFit,
    (form, remarks): (Option<&str>, &[String]),
    circularity: &Circularity,
    others: &[(String, Circle)],
) -> Result<String, Message> {
    let mut text = format!(
        "Circle through {} ({} points)\n",
        args.points.display(),
        points.len()
    );
    let c = fit.circle;
    let quantities = fit.quantities().map_err(unexpandable)?;
    for (name, quantity) in ["radius", "centre x", "centre y"].iter().zip(&quantities) {
        let _ = writeln!(text, "  {name:10} {}", measured_words(quantity)?);
    }
    let _ = writeln!(
        text,
        "  deviation  {} µm (standard deviation of a point, {}, {} degrees of freedom)",
        number::plain(fit.noise_um, 3),
        if fit.noise_given {
            "given"
        } else {
            "estimated"
        },
        fit.degrees_of_freedom
    );
    for sentence in form.into_iter().chain(remarks.iter().map(String::as_str)) {
        let _ = writeln!(text, "  {sentence}");
    }
    let _ = writeln!(text, "\nCircularity");
    for (reference, zone) in zones(circularity) {
        let _ = match zone {
            Ok(z) => writeln!(
                text,
                "  {}       {} µm",
                reference.name(),
                number::plain(z.width_um, 4)
            ),
            Err(reason) => writeln!(text, "  {}       {reason}", reference.name()),
        };
    }
    let _ = writeln!(text, "\nRadius of other fits less this one");
    for (name, other) in others {
        let _ = writeln!(
            text,
            "  {name:14} {} µm",
            number::plain(1e3 * (other.radius - c.radius), 3)
        );
    }
    Ok(text)
}

fn as_json(
    points: &[Point],
    fit: &CircleFit,
    (alike, arc): (Option<f64>, f64),
    circularity: &Circularity,
    others: &[(String, Circle)],
) -> Result<Value, Message> {
    let [radius, centre_x, centre_y] = fit.quantities().map_err(unexpandable)?;
    let covariance: Vec<Vec<f64>> = (0..3)
        .map(|i| (0..3).map(|j| fit.covariance[(i, j)]).collect())
        .collect();
    Ok(json!({
        "schema": "errsep.circle/1",
        "points": points.len(),
        "fit": {
            "method": "orthogonal",
            "radius": quantity_json(&radius)?,
            "centre_x": quantity_json(&centre_x)?,
            "centre_y": quantity_json(&centre_y)?,
            "covariance": {"order": ["centre_x", "centre_y", "radius"], "value": covariance, "unit": "mm2"},
            "noise": {"value": fit.noise_um, "unit": "um", "given": fit.noise_given},
            "degrees_of_freedom": fit.degrees_of_freedom,
            "neighbours_alike": {"p_value": alike, "form": alike.is_some_and(|p| p < ALIKE)},
            "passes": fit.scatter.map(|s| json!({
                "count": s.passes,
                "factor": s.factor,
                "degrees_of_freedom": s.degrees.as_f64(),
                "p_value": s.p_value,
            })),
            "arc": {"value": arc, "unit": "rad"},
        },
        "algebraic": others.iter().filter(|o| !o.0.starts_with("nistir")).map(|(name, o)| json!({
            "method": name,
            "centre": [o.centre.x, o.centre.y],
            "radius": o.radius,
        })).collect::<Vec<_>>(),
        "circularity": zones(circularity).into_iter().map(|(reference, zone)| match zone {
            Ok(z) => json!({
                "reference": reference.name(),
                "deviation": {"value": z.width_um, "unit": "um"},
                "centre": [z.centre.x, z.centre.y],
                "radius": z.radius,
                "inner_contacts": z.inner_contacts,
                "outer_contacts": z.outer_contacts,
            }),
            Err(reason) => json!({"reference": reference.name(), "reason": reason}),
        }).collect::<Vec<_>>(),
        "disagreement": disagreement::as_json(fit.disagreement()),
        "residuals": {"value": fit.residuals_um, "unit": "um"},
        "convergence": {"converged": true, "reason": fit.ending, "iterations": fit.iterations},
    }))
}
