//! The separation with its uncertainties: by the decomposed system or, of long records, through the band.

use errsep_models::four_sensor::{
    Along, Choice, Ends, FourSensorError, LongSeparator, MinimumZone, Penalised,
    PublishedSeparation, PublishedSeparator, Separation, Separator, Settings,
};
use errsep_models::uncertainty::DegreesOfFreedom;

use super::how_well_known;
use super::read::Measured;
use super::setup::Setup;

/// What is separated.
pub(super) struct Task<'a> {
    pub(super) setup: &'a Setup,
    pub(super) measured: &'a Measured,
    pub(super) noise_stated: bool,
}

/// What comes of it; of long records neither the paper's own way nor what needs the decomposition.
pub(super) struct Separated {
    pub(super) separation: Separation,
    pub(super) straightness_error: MinimumZone,
    pub(super) published: Option<PublishedSeparation>,
    pub(super) condition_number: Option<f64>,
    pub(super) ends: Option<Ends>,
}

impl Task<'_> {
    /// By the decomposed system.
    pub(super) fn whole(&self) -> Result<Separated, FourSensorError> {
        let (setup, outputs) = (self.setup, &self.measured.outputs);
        let geometry = outputs.geometry();
        let separator = Separator::new(geometry, setup.penalised, setup.line)?;
        let published = PublishedSeparator::new(geometry)?.separate(outputs, Choice::LCurve)?;
        let of_profile = [Penalised::Profile, Penalised::ProfileFromEnds];
        // Where the general penalty finds no λ there is nothing to tell of the ends.
        let ends = (of_profile.contains(&setup.penalised))
            .then(|| Ends::of(outputs, &setup.settings).ok())
            .flatten();
        let mut found = separator.separate(outputs, &setup.settings)?;
        if self.measured.each.len() > 1 {
            let settings = self.fixed(&found);
            let each = self.measured.each.iter();
            let each = each.map(|one| Ok(separator.separate(one, &settings)?.found()));
            let each = each.collect::<Result<Vec<_>, FourSensorError>>()?;
            let draws = separator.noise_errors(outputs, &setup.settings, &found)?;
            let degrees = self.degrees(&found);
            found.count_repeats(&each, &draws, degrees, setup.settings.parabola);
        }
        let along = match self.is_read_once(&found) {
            true => separator.count_correlation(outputs, &setup.settings, &mut found)?,
            false => None,
        };
        let degrees = self.degrees(&found);
        let along: Option<&Along> = along.as_ref();
        let straightness_error =
            separator.straightness_error(outputs, &setup.settings, &found, degrees, along)?;
        Ok(Separated {
            separation: found,
            straightness_error,
            published: Some(published),
            condition_number: Some(separator.decomposition().condition_number()),
            ends,
        })
    }

    /// Through the band.
    pub(super) fn long(&self) -> Result<Separated, FourSensorError> {
        let (setup, outputs) = (self.setup, &self.measured.outputs);
        let separator = LongSeparator::new(outputs, setup.penalised, setup.line, &setup.settings)?;
        let mut found = separator.separate()?;
        if self.measured.each.len() > 1 {
            let settings = self.fixed(&found);
            let each = self.measured.each.iter().map(|one| {
                let one = LongSeparator::new(one, setup.penalised, setup.line, &settings)?;
                Ok(one.separate()?.found())
            });
            let each = each.collect::<Result<Vec<_>, FourSensorError>>()?;
            let draws = separator.noise_errors(&found)?;
            let degrees = self.degrees(&found);
            found.count_repeats(&each, &draws, degrees, setup.settings.parabola);
        }
        let along = match self.is_read_once(&found) {
            true => separator.count_correlation(&mut found)?,
            false => None,
        };
        let degrees = self.degrees(&found);
        let straightness_error = separator.straightness_error(&found, degrees, along.as_ref())?;
        Ok(Separated {
            separation: found,
            straightness_error,
            published: None,
            condition_number: None,
            ends: None,
        })
    }

    fn degrees(&self, found: &Separation) -> DegreesOfFreedom {
        how_well_known(found, self.noise_stated, self.measured)
            .unwrap_or(DegreesOfFreedom::Infinite)
    }

    /// A noise that is stated is stated of independent readings.
    fn is_read_once(&self, found: &Separation) -> bool {
        found.noise_estimated && self.measured.repeats == 1
    }

    /// The settings with the λ that was chosen, for one repeat.
    fn fixed(&self, found: &Separation) -> Settings {
        Settings {
            choice: Choice::Fixed(found.chosen.point.lambda),
            // Of one output of the average; a repeat by itself states nothing of its uncertainty.
            noise: Some(found.noise),
            ..self.setup.settings
        }
    }
}
