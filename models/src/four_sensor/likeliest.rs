//! Which penalty fits the surface.
//!
//! Each penalty is a law of the surface: points that scatter by themselves, slopes that do, or curvatures. All
//! leave the same parameters free, so that their restricted likelihoods compare them on the same outputs. A law
//! that does not fit gives wrong uncertainties whatever its λ: on surfaces whose long waves are the largest the
//! penalty on the profile holds back what is largest.

use errsep_solvers::regularization::{Family, likelihood};

use super::{FourSensorError, Line, Outputs, Penalised, Separator, banded_system, direct};

/// The penalties by their likelihoods.
#[derive(Debug, Clone, PartialEq)]
pub struct Likeliest {
    /// The likeliest.
    pub penalised: Penalised,
    /// −2 ln of the likelihood of each candidate less that of the likeliest; those that see nothing but noise
    /// are left out.
    pub against: Vec<(Penalised, f64)>,
}

impl Likeliest {
    /// Compares the [`CANDIDATES`](Penalised::CANDIDATES) on outputs; `dense` decomposes the systems whole. None
    /// where all see nothing but noise.
    ///
    /// # Errors
    /// As [`Separator::new`] and [`banded_system`].
    pub fn of(outputs: &Outputs, dense: bool) -> Result<Option<Self>, FourSensorError> {
        let mut found = Vec::new();
        for penalised in Penalised::CANDIDATES {
            let criterion = if dense {
                let separator = Separator::new(outputs.geometry(), penalised, Line::EndPoints)?;
                criterion(
                    &separator
                        .decomposition()
                        .with_data(&direct::data(outputs))?,
                )?
            } else {
                criterion(&banded_system(outputs, penalised)?)?
            };
            if let Some(criterion) = criterion {
                found.push((penalised, criterion));
            }
        }
        let least = found.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(least.map(|(penalised, least)| Self {
            penalised,
            against: found.iter().map(|(p, c)| (*p, c - least)).collect(),
        }))
    }
}

/// −2 ln of the likelihood, where the outputs show more than noise.
fn criterion<F: Family + ?Sized>(family: &F) -> Result<Option<f64>, FourSensorError> {
    let found = likelihood(family)?;
    let (_, largest) = family.range();
    let flat = found.at_edge && found.point.lambda > 0.5 * largest;
    Ok((!flat && found.criterion.is_finite()).then_some(found.criterion))
}
