//! What stands beside the answer: other ways on the same scans, and what the reader has to weigh.

use errsep_models::fourier::{
    Combination, Compensation, NoiseSource, Scan, Section, Separation, separate,
};

use crate::cli::disagreement;
use crate::report::fourier::Method;
use crate::report::number;

/// The published ways and the joint fit on the same scans, all with the noise of the answer. Where the
/// step was to be fitted the published ways take it from the readings at the joint, if there are any.
pub(super) fn methods(
    scans: &[Scan],
    section: Section,
    asked: Compensation,
    answer: &Separation,
) -> Vec<Method> {
    let noise = Some(answer.noise.0);
    let solve = |scans: &[Scan], compensation, combination| {
        separate(scans, section, compensation, combination, noise).ok()
    };
    let published = match asked {
        Compensation::Fitted
            if solve(scans, Compensation::Chord, Combination::LeastSquares).is_some() =>
        {
            Compensation::Chord
        }
        other => other,
    };
    let mut spacings: Vec<f64> = scans.iter().map(|s| s.spacing).collect();
    spacings.sort_by(f64::total_cmp);
    spacings.dedup();
    let mut found = Vec::new();
    let mut add = |name: String, separation: Option<Separation>| {
        found.extend(separation.map(|s| Method::new(name, &s, answer)));
    };
    for &d in &spacings {
        let own: Vec<Scan> = scans.iter().filter(|s| s.spacing == d).cloned().collect();
        let alone = solve(&own, published, Combination::LeastSquares);
        add(format!("d = {d} mm alone"), alone);
    }
    if spacings.len() > 1 {
        add(
            "hybrid".to_owned(),
            solve(scans, published, Combination::Hybrid),
        );
        add(
            "least squares".to_owned(),
            solve(scans, published, Combination::LeastSquares),
        );
    }
    // Where form beyond the orders kept forbids it the step is not fitted.
    let fitted = solve(scans, Compensation::Fitted, Combination::LeastSquares)
        .filter(|s| s.compensation != published && !s.steps.is_empty());
    add("least squares, step fitted".to_owned(), fitted);
    found
}

/// What the person has to weigh beside the figures.
pub(super) fn remarks(s: &Separation, section: Section, asked: Compensation) -> Vec<String> {
    let mut remarks = Vec::new();
    if let Some(beyond) = s.beyond_orders {
        let joint = match (asked, s.compensation) {
            (Compensation::Fitted, Compensation::Chord) => {
                " The step at the joint is therefore taken from the readings there, not fitted."
            }
            (_, Compensation::Fitted) if !s.steps.is_empty() => {
                " The fitted step at the joint suffers from it: read P2 and P3 both at the joint."
            }
            _ => "",
        };
        remarks.push(format!(
            "Form beyond the orders: the workpiece has about {} µm rms that is finer than the {} \
             orders kept (probability under noise alone {}). The profile and its uncertainty leave it \
             out; keep more [section] orders to see it.{joint}",
            number::plain(beyond.rms, 2),
            section.orders,
            number::probability(beyond.p_value)
        ));
    }
    if let Some(found) = s.disagreement {
        let (seen, teller) = match s.noise.1 {
            NoiseSource::Given => ("The scans disagree", "the set-up states"),
            _ => ("The spacings disagree", "the repeats tell"),
        };
        remarks.push(disagreement::in_words(found, seen, teller, s.noise.0));
    }
    if asked == Compensation::None {
        for step in s.steps.iter().filter(|j| j.value.abs() > 4.0 * j.std) {
            remarks.push(format!(
                "A step of {} µm at the joint of d = {} mm stays in the profile as a line cut off at \
                 {} orders: choose [method] compensation = \"fitted\".",
                number::measured(step.value, Some(step.std)),
                step.spacing,
                section.orders
            ));
        }
    }
    let size = s
        .workpiece
        .iter()
        .fold(0.0, |most: f64, v| most.max(v.abs()));
    if s.noise.0 <= 1e-9 * size || s.noise.0 == 0.0 {
        remarks.push(
            "The readings agree to rounding, so that their noise is not seen: state it as [probe] \
             noise."
                .to_owned(),
        );
    }
    remarks
}
