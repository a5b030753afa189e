//! The answer in words.

use std::fmt::Write;
use std::path::Path;

use errsep_models::four_sensor::{Parabola, Penalised, ToldBy};
use errsep_models::uncertainty::coverage_factor;
use errsep_solvers::regularization::{CornerStatus, Discrepancy};
use nalgebra::DVector;

use super::Found;
use crate::cli::disagreement;
use crate::cli::quantity::{COVERAGE, coverage_words, unexpandable};
use crate::io::Message;
use crate::io::units::{arcsec_from_rad, urad_from_rad};
use crate::report::number;

pub(super) fn text(found: &Found, data: &Path) -> Result<String, Message> {
    let s = &found.separation;
    let mut text = format!(
        "Four-sensor separation of {} ({} slide positions, {} points of surface)\n",
        data.display(),
        found.measured.outputs.readings().len(),
        s.surface.values.len()
    );
    let _ = writeln!(text, "  straightness     {}", straightness(found)?);
    let _ = writeln!(text, "                   {ZONE_NOTE}");
    let _ = writeln!(
        text,
        "  profile S        {:.3} µm peak to valley from the line of the surface, u up to {:.3} µm",
        span(&s.straightness.values),
        s.straightness.std.max()
    );
    let _ = writeln!(
        text,
        "  tilt gamma       {:.2} µrad ({:.2}″) peak to valley, u up to {:.2} µrad",
        urad_from_rad(span(&s.tilt.values)),
        arcsec_from_rad(span(&s.tilt.values)),
        urad_from_rad(s.tilt.std.max())
    );
    let _ = writeln!(
        text,
        "  surface f        {:.3} µm peak to valley, u up to {:.3} µm",
        span(&s.surface.values),
        s.surface.std.max()
    );
    let _ = writeln!(
        text,
        "  noise            {:.4} µm ({})",
        s.noise,
        noise_source(found)
    );
    if let Some(averaged) = averaged(found) {
        let _ = writeln!(text, "  average          {averaged}");
    }
    if let Some(degrees) = found.degrees_of_freedom() {
        let k = coverage_factor(COVERAGE, degrees).map_err(unexpandable)?;
        let _ = writeln!(
            text,
            "  expanded         U = k u: S up to {:.3} µm, gamma up to {:.2} µrad, f up to {:.3} µm",
            k * s.straightness.std.max(),
            urad_from_rad(k * s.tilt.std.max()),
            k * s.surface.std.max()
        );
        let _ = writeln!(text, "                   {}", coverage_words(degrees)?);
    }
    let _ = writeln!(
        text,
        "  lambda           {:.3e} by {}; penalty on the {}{}; {}",
        s.chosen.point.lambda,
        s.chosen.rule,
        found.setup.penalised.name(),
        if found.likeliest.is_some() {
            ", the likeliest"
        } else {
            ""
        },
        status(s.chosen.curve.status)
    );
    if let Some(reason) = s.chosen.instead {
        let _ = writeln!(
            text,
            "  {reason}; lambda was taken from {} instead",
            s.chosen.rule
        );
    }
    let _ = writeln!(
        text,
        "  penalty's pull   up to {:.3} µm on S if the truth is the estimate, at most {:.3} µm; in u as\n                   that of a surface that scatters by {:.3} µm",
        s.straightness.bias.amax(),
        s.straightness.bias_bound.amax(),
        s.scatter.held_back
    );
    if let Some(ends) = ends(found) {
        let _ = writeln!(text, "  ends of f        {ends}");
    }
    if let Some(note) = counted_from_ends(found) {
        let _ = writeln!(text, "  note             {note}");
    }
    if let Some(warning) = uneven(found) {
        let _ = writeln!(text, "  warning          {warning}");
    }
    if let Some(warning) = excess(found) {
        let _ = writeln!(text, "  warning          {warning}");
    }
    if let Some(remark) = refuted(found) {
        let _ = writeln!(text, "  {remark}");
    }
    let _ = writeln!(text, "\nNot determined by these outputs:");
    for sentence in not_determined(found) {
        let _ = writeln!(text, "  - {sentence}");
    }
    Ok(text)
}

/// "40.3 µm (minimum zone), 95 % interval 39.7 to 40.9 µm, if the surface has no parabola".
pub(super) fn straightness(found: &Found) -> Result<String, Message> {
    let zone = &found.straightness_error;
    let (low, high) = zone.interval(COVERAGE).map_err(unexpandable)?;
    // Two digits of the uncertainty.
    let decimals = (1.0 - zone.std.log10().floor()).clamp(0.0, 6.0) as usize;
    let shown = |value: f64| number::fixed(value, decimals);
    let condition = if found.parabola_is_open() {
        ", if the surface has no parabola, which these outputs cannot show"
    } else {
        ""
    };
    Ok(format!(
        "{} µm (minimum zone), {} interval {} to {} µm{condition}",
        shown(zone.value),
        number::percent(COVERAGE),
        shown(low),
        shown(high)
    ))
}

/// How repeats were brought together; nothing without repeats.
pub(super) fn averaged(found: &Found) -> Option<String> {
    let repeats = found.measured.repeats;
    let missing = match found.measured.missing.len() {
        0 => String::new(),
        1 => "; one reading that a repeat lacks was filled in from the others".to_owned(),
        n => format!("; {n} readings that single repeats lack were filled in from the others"),
    };
    (repeats > 1).then(|| {
        format!(
            "the outputs of {repeats} repeats were averaged first and lambda chosen for the average{missing}"
        )
    })
}

/// What the interval of the minimum zone is worth.
pub(super) const ZONE_NOTE: &str = "the interval allows for any shape of the slide: near the noise it holds 96 to 99 % instead of 95";

/// Beyond so many standard uncertainties the ends of the surface are said to lie off its mean line.
pub(super) const ENDS_OFF: f64 = 2.0;

/// Where the ends of the surface lie, and which penalty on the profile that speaks for.
pub(super) fn ends(found: &Found) -> Option<String> {
    let ends = found.ends?;
    let [first, last] = [0, 1].map(|k| number::measured(ends.offset[k], Some(ends.std[k])));
    let counted_from_ends = found.setup.penalised == Penalised::ProfileFromEnds;
    let advice = match (ends.contradict(ENDS_OFF), counted_from_ends) {
        (false, false) => {
            "it may be that they lie on it: if that is known of this surface, penalty = \"profile-from-ends\" \
             errs less; these outputs alone cannot tell, so that it is not chosen here"
        }
        (true, false) => "they do not lie on it: penalty = \"profile\" is right",
        (false, true) => "which does not contradict the penalty; that they lie on it must be known",
        (true, true) => "which contradicts the penalty: choose penalty = \"profile\"",
    };
    Some(format!(
        "{first} and {last} µm from its mean line, {advice}"
    ))
}

/// What the uncertainties are under the penalty that counts the profile from its ends.
pub(super) fn counted_from_ends(found: &Found) -> Option<&'static str> {
    (found.setup.penalised == Penalised::ProfileFromEnds).then_some(
        "the penalty takes it for granted that both ends of the surface lie on its mean line. Where they do, the \
         uncertainties are too large (95 % intervals of S held the truth in 99 %); where they do not, S errs by \
         more than they say",
    )
}

/// A surface that the penalty does not fit.
pub(super) fn uneven(found: &Found) -> Option<String> {
    let scatter = &found.separation.scatter;
    let penalised = found.setup.penalised;
    let remedy = match penalised {
        _ if found.likeliest.is_some() => "space the sensors wider",
        Penalised::ProfileFromEnds => "choose penalty = \"profile\"",
        Penalised::Profile | Penalised::Slope => "choose penalty = \"curvature\"",
        Penalised::Curvature => "space the sensors wider",
    };
    scatter.is_uneven().then(|| {
        format!(
            "the penalty on the {} holds back waves larger than the rest of the surface ({:.2} µm against \
             {:.2} µm), and the uncertainties may be too small: {remedy}",
            penalised.name(),
            scatter.held_back,
            scatter.even
        )
    })
}

/// Repeats that scatter by more than the noise of their readings, once each is separated by itself, or noise that is
/// correlated along the slide.
pub(super) fn excess(found: &Found) -> Option<String> {
    let excess = found.separation.excess?;
    let factor = number::plain(excess.factors[1], 2);
    Some(match excess.told_by {
        ToldBy::Repeats { .. } => format!(
            "separated one by one, the repeats scatter {factor} times as much in S as the noise of their readings gives: a \
             sensor drifts within a repeat, is noisier than the others, or the positions do not repeat; the \
             uncertainties count it"
        ),
        ToldBy::Outputs { law } => format!(
            "the outputs disagree with each other as if their noise were correlated along the slide: {} µm of each reading \
             alone and {} µm over {} mm; the uncertainties count it, that of S {factor} times as large as independent \
             readings would have it; what the model misses would look the same, and repeats would tell",
            number::plain(law.white.sqrt(), 2),
            number::plain(law.correlated.sqrt(), 2),
            number::plain(law.length, 2)
        ),
    })
}

/// Outputs that the noise does not explain.
pub(super) fn refuted(found: &Found) -> Option<String> {
    let teller = match (found.noise_from_repeats(), found.measured.repeats) {
        (true, _) => "the repeats tell, of their average,",
        (false, 1) => "the set-up states",
        (false, _) => "the set-up states, of the average of the repeats,",
    };
    let noise = found.separation.noise;
    let words = |d| disagreement::in_words(d, "Outputs and model disagree", teller, noise);
    found.disagreement().map(words)
}

/// What spacings with a common multiple do not show.
fn invisible_waves(found: &Found) -> Option<String> {
    /// So many are named one by one.
    const NAMED: usize = 4;
    let periods = found.measured.outputs.geometry().invisible_periods();
    let longest = *periods.first()?;
    let named: Vec<String> = periods
        .iter()
        .take(NAMED)
        .map(|p| number::plain(*p, 4))
        .collect();
    let more = if periods.len() > NAMED { " …" } else { "" };
    Some(format!(
        "Waves of the surface that repeat every {} mm{more}: all spacings are multiples of {} mm, so all \
         sensors see the same of them and S takes them up. The uncertainties take them to be as large as \
         the waves that are seen. One spacing changed by a step would show them.",
        named.join(", "),
        number::plain(longest, 4)
    ))
}

pub(super) fn not_determined(found: &Found) -> Vec<String> {
    let mut sentences = vec![
        found.setup.settings.parabola.statement(),
        "A straight line of surface and straightness: it fixes the axes, and was chosen by `line`."
            .to_owned(),
    ];
    sentences.extend(invisible_waves(found));
    if !matches!(found.setup.settings.parabola, Parabola::ZeroAdjustment(_)) {
        sentences.push(
            "The level of the tilt: it goes with the zero-adjustment of sensor 4, taken as zero."
                .to_owned(),
        );
    }
    sentences
}

pub(super) fn noise_source(found: &Found) -> &'static str {
    if found.separation.noise_estimated {
        "estimated from the residuals"
    } else if found.noise_from_repeats() {
        "from the scatter of the repeats"
    } else if found.measured.repeats > 1 {
        "stated, of the average of the repeats"
    } else {
        "stated"
    }
}

pub(super) const fn status(status: CornerStatus) -> &'static str {
    match status {
        CornerStatus::Corner => "the L-curve has one corner",
        CornerStatus::NoCorner => "the L-curve has no corner",
        CornerStatus::AtEdge => "the L-curve bends most at the end of its range",
        CornerStatus::MultipleCorners => "the L-curve has several corners",
    }
}

pub(super) const fn status_key(status: CornerStatus) -> &'static str {
    match status {
        CornerStatus::Corner => "corner",
        CornerStatus::NoCorner => "no-corner",
        CornerStatus::AtEdge => "at-edge",
        CornerStatus::MultipleCorners => "multiple-corners",
    }
}

pub(super) const fn discrepancy_key(discrepancy: &Discrepancy) -> &'static str {
    match discrepancy {
        Discrepancy::Found(_) => "found",
        Discrepancy::NoiseTooSmall(_) => "noise-too-small",
        Discrepancy::NoiseTooLarge(_) => "noise-too-large",
    }
}

/// Peak to valley.
pub(super) fn span(values: &DVector<f64>) -> f64 {
    values.max() - values.min()
}
