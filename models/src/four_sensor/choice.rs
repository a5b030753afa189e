//! Which λ, and by which rule.

use errsep_solvers::regularization::{
    CornerStatus, Discrepancy, Family, LCurve, Penalty, Point, discrepancy, gcv_among, l_curve,
    likelihood_among,
};
use serde::{Deserialize, Serialize};

use super::{FourSensorError, Line};
use crate::uncertainty::{DegreesOfFreedom, Disagreement};

/// What is kept small.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Penalised {
    /// The surface itself, ‖f‖².
    #[default]
    Profile,
    /// The surface counted from its end points, as Zhao et al. do: for surfaces whose ends are known to
    /// lie on their mean line.
    ProfileFromEnds,
    /// Its slope: differences of neighbours.
    Slope,
    /// Its curvature: second differences.
    Curvature,
}

impl Penalised {
    /// Those among which outputs can choose: the line through the ends has to be known.
    pub const CANDIDATES: [Self; 3] = [Self::Profile, Self::Slope, Self::Curvature];

    /// All, in the order of the list above.
    pub const ALL: [Self; 4] = [
        Self::Profile,
        Self::ProfileFromEnds,
        Self::Slope,
        Self::Curvature,
    ];

    /// The penalty over the surface's points.
    pub fn penalty(self) -> Penalty {
        match self {
            Self::Profile | Self::ProfileFromEnds => Penalty::Identity,
            Self::Slope => Penalty::FirstDifference,
            Self::Curvature => Penalty::SecondDifference,
        }
    }

    /// The line from which the penalised surface is counted, whatever line the answer is stated from:
    /// that which makes the penalty least, but for [`Self::ProfileFromEnds`].
    pub const fn line(self) -> Line {
        match self {
            Self::Profile => Line::LeastSquares,
            // The mean slope is that from end to end; second differences do not see a line.
            Self::ProfileFromEnds | Self::Slope | Self::Curvature => Line::EndPoints,
        }
    }

    /// Name in set-ups and JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Profile => "profile",
            Self::ProfileFromEnds => "profile-from-ends",
            Self::Slope => "slope",
            Self::Curvature => "curvature",
        }
    }
}

/// How λ is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Choice {
    /// The corner of the L-curve; generalized cross-validation where there is none.
    LCurve,
    /// Generalized cross-validation.
    Gcv,
    /// Restricted maximum likelihood: the noise over the scatter of what is penalised, both from the
    /// outputs. Of all rules the smallest errors in the simulation of the paper.
    Likelihood,
    /// The discrepancy principle with the standard deviation of one reading, µm.
    Discrepancy {
        /// Standard deviation of one reading, µm.
        noise: f64,
    },
    /// A given λ.
    Fixed(f64),
}

/// What each rule says of the same data, and which of them was followed.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// The point taken.
    pub point: Point,
    /// The rule that gave it: `l-curve`, `gcv`, `likelihood`, `discrepancy` or `fixed`.
    pub rule: &'static str,
    /// Why another rule than the one asked for was followed.
    pub instead: Option<&'static str>,
    /// The sampled L-curve with its corners.
    pub curve: LCurve,
    /// λ of generalized cross-validation.
    pub gcv: f64,
    /// The discrepancy principle's answer where the noise is known.
    pub discrepancy: Option<Discrepancy>,
}

impl Chosen {
    /// Where the residuals refute a noise that was found apart from them, known to `degrees`. Those of the
    /// least penalty are taken: a penalty that pulls adds to its residuals what is no noise.
    pub fn disagreement(
        &self,
        rows: usize,
        noise: f64,
        degrees: DegreesOfFreedom,
    ) -> Option<Disagreement> {
        let points = self.curve.points.iter();
        let least = points.min_by(|a, b| a.lambda.total_cmp(&b.lambda))?;
        let freedom = least.residual_degrees_of_freedom(rows);
        Disagreement::of(least.residual_norm.powi(2), freedom, noise, degrees)
    }
}

/// Follows a rule on a family, and asks the others for comparison.
///
/// # Errors
/// The family has no range of λ; a given λ or noise is not positive.
pub(super) fn choose<F: Family + ?Sized>(
    family: &F,
    choice: Choice,
    noise: Option<f64>,
) -> Result<Chosen, FourSensorError> {
    let curve = l_curve(family)?;
    let validated = gcv_among(family, &curve.points)?;
    let cross = validated.point;
    let stated = match choice {
        Choice::Discrepancy { noise } => Some(noise),
        _ => noise,
    };
    let discrepant = stated.map(|noise| discrepancy(family, noise)).transpose()?;
    let (point, rule, instead) = match choice {
        Choice::Fixed(lambda) => (family.point(lambda)?, "fixed", None),
        Choice::Gcv => (cross, "gcv", None),
        Choice::Likelihood => {
            let likeliest = likelihood_among(family, &curve.points)?;
            let (_, largest) = family.range();
            if likeliest.at_edge && likeliest.point.lambda > 0.5 * largest {
                return Err(FourSensorError::NoChoice);
            }
            (likeliest.point, "likelihood", None)
        }
        Choice::LCurve => match curve.lambda() {
            Some(lambda) => (family.point(lambda)?, "l-curve", None),
            None => (cross, "gcv", Some(no_corner(curve.status))),
        },
        Choice::Discrepancy { .. } => match discrepant {
            Some(Discrepancy::Found(point)) => (point, "discrepancy", None),
            Some(Discrepancy::NoiseTooLarge(_)) => (cross, "gcv", Some(NOISE_TOO_LARGE)),
            Some(Discrepancy::NoiseTooSmall(_)) | None => (
                cross,
                "gcv",
                Some(
                    "the stated noise is smaller than any fit leaves: it is too small, or the model misses something",
                ),
            ),
        },
    };
    // At the small end the data need no penalty. At the large end it has swallowed the surface, and
    // a flat answer with a small uncertainty would be plausible and wrong.
    let (_, largest) = family.range();
    if rule == "gcv" && validated.at_edge && cross.lambda > 0.5 * largest {
        return Err(FourSensorError::NoChoice);
    }
    Ok(Chosen {
        point,
        rule,
        instead,
        curve,
        gcv: cross.lambda,
        discrepancy: discrepant,
    })
}

const NOISE_TOO_LARGE: &str =
    "the stated noise is larger than the outputs: they hold no surface to find";

fn no_corner(status: CornerStatus) -> &'static str {
    match status {
        CornerStatus::AtEdge => "the L-curve bends most at the end of its range: no corner to take",
        _ => "the L-curve has no corner",
    }
}
