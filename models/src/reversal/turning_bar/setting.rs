//! What is fitted to a run, and what is known beforehand.

use super::error::TurningError;

/// How the harmonics of the bar change along it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Along {
    /// The same section everywhere.
    Constant,
    /// Evenly.
    #[default]
    Linear,
}

/// The once-per-turn wave and the turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wave {
    /// A straight bar that turns steadily, or as recorded.
    Steady,
    /// A straight bar, of which the angle strays from the steady or recorded one: a spline in time of
    /// so many cells.
    Unsteady {
        /// Cells of the spline.
        cells: usize,
    },
    /// A bar of any axis that turns steadily: amplitude and phase are splines along the bar.
    Bent {
        /// Cells of the splines.
        cells: usize,
    },
}

/// What is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Direction of the indicator about the spindle axis, rad (near 0, top π/2).
    pub indicator_rad: f64,
    /// +1 where the spindle turns side 0 from near towards the top, −1 the other way; of a recorded
    /// angle: whether it grows so.
    pub handed: f64,
    /// Harmonics of the section, 2 or more.
    pub harmonics: Vec<usize>,
    /// How they change along the bar.
    pub along: Along,
    /// Whether the eccentricity may change along the bar.
    pub growing: bool,
    /// Cells of the form along the slide.
    pub form_cells: usize,
    /// The wave.
    pub wave: Wave,
    /// Turns in a second from which the search for the turn begins; `None`: from the readings.
    pub about_hz: Option<f64>,
}

impl Default for Setting {
    fn default() -> Self {
        Self {
            indicator_rad: 0.0,
            handed: 1.0,
            harmonics: vec![2, 3, 4, 5],
            along: Along::default(),
            growing: true,
            form_cells: 12,
            wave: Wave::Steady,
            about_hz: None,
        }
    }
}

/// The highest harmonic that is fitted: twelve readings a turn tell no more.
pub const HIGHEST_HARMONIC: usize = 40;

impl Setting {
    /// Whether it can be fitted.
    ///
    /// # Errors
    /// [`TurningError::NotUsable`].
    pub fn check(&self) -> Result<(), TurningError> {
        let refuse = |what, value, must| Err(TurningError::NotUsable { what, value, must });
        for (i, k) in self.harmonics.iter().enumerate() {
            if !(2..=HIGHEST_HARMONIC).contains(k) {
                return refuse("a harmonic", *k as f64, "from 2 to 40");
            }
            if self.harmonics[..i].contains(k) {
                return refuse("a harmonic", *k as f64, "named once");
            }
        }
        if !self.indicator_rad.is_finite() {
            return refuse(
                "the direction of the indicator",
                self.indicator_rad,
                "finite",
            );
        }
        if let Some(hz) = self.about_hz
            && !(hz > 0.0 && hz.is_finite())
        {
            return refuse("the speed", hz, "above 0 turns a second");
        }
        Ok(())
    }

    /// Cells of the spline that has most.
    pub fn most_cells(&self) -> usize {
        match self.wave {
            Wave::Steady => self.form_cells,
            Wave::Unsteady { cells } | Wave::Bent { cells } => cells.max(self.form_cells),
        }
    }

    /// Unknowns of one harmonic.
    pub fn per_harmonic(&self) -> usize {
        match self.along {
            Along::Constant => 2,
            Along::Linear => 4,
        }
    }
}
