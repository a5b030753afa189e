//! The rows of a run, as the structured solver asks for them.

use errsep_solvers::linear::banded::Tall;
use errsep_solvers::linear::bordered::{Constraints, Share};
use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::{Parameters, Sink, StructuredProblem};

use super::{ACROSS_E, ALONG_E, ECCENTRICITY, HARMONICS, SPEED, THETA, TurningProblem};

impl StructuredProblem for TurningProblem<'_> {
    type Prepared = Parameters;

    fn band_count(&self) -> usize {
        self.form_unknowns.len() + self.wave_unknowns.iter().map(Vec::len).sum::<usize>()
    }

    fn border_count(&self) -> usize {
        self.held.len()
    }

    fn constraints(&self) -> &Constraints {
        &self.constraints
    }

    fn held(&self) -> &[bool] {
        &self.held
    }

    fn prepare(&self, at: &Parameters) -> Result<Parameters, NoValue> {
        if at.band.iter().chain(&at.border).all(|v| v.is_finite()) {
            Ok(at.clone())
        } else {
            Err(NoValue::new("an unknown is not finite"))
        }
    }

    fn band_width(&self, _: &Parameters) -> usize {
        self.width
    }

    fn task_count(&self, _: &Parameters) -> usize {
        self.pieces.len()
    }

    fn task(&self, at: &Parameters, index: usize, sink: &mut Sink) -> Result<(), NoValue> {
        let piece = &self.pieces[index];
        let columns = self.columns();
        let band = piece.band.len();
        let mut row = vec![0.0; columns];
        sink.open(columns);
        let mut first = piece.readings.start;
        while first < piece.readings.end {
            let last = piece.readings.end.min(first + Tall::CAPACITY);
            let batch = sink.batch(last - first);
            for i in first..last {
                self.local(i, piece, at, &mut row);
                for (column, (_, l)) in piece.band.iter().enumerate() {
                    batch.column_mut(column)[i - first] = row[*l];
                }
                for column in band..columns {
                    batch.column_mut(column)[i - first] = row[column];
                }
            }
            sink.push();
            first = last;
        }
        let shares = self.free.iter().enumerate().map(|(l, j)| Share {
            column: (band + l) as u32,
            unknown: *j as u32,
            weight: 1.0,
        });
        sink.close(
            piece.band.iter().map(|(j, _)| Some(*j)).collect(),
            shares.collect(),
            0,
        );
        Ok(())
    }

    fn border_name(&self, index: usize) -> String {
        match index {
            THETA => "angle of the spindle".to_owned(),
            SPEED => "speed of the spindle".to_owned(),
            ECCENTRICITY => "eccentricity".to_owned(),
            ALONG_E => "gamma along the eccentricity".to_owned(),
            ACROSS_E => "gamma across the eccentricity".to_owned(),
            other => {
                let per = self.setting.per_harmonic();
                let h = (other - HARMONICS) / per;
                format!(
                    "harmonic {} of the section",
                    self.setting.harmonics.get(h).copied().unwrap_or(0)
                )
            }
        }
    }

    fn band_name(&self, index: usize) -> String {
        if self.form_unknowns.contains(&index) {
            "the form along the slide".to_owned()
        } else {
            "the turn of the spindle".to_owned()
        }
    }
}
