//! What traces at pairs of opposite angles of the once-per-turn wave would scatter by, and what ovality makes of it.

use errsep_solvers::structured::StructuredProblem;
use nalgebra::{DVector, Matrix4, Vector4};

use super::answers::Told;
use super::fit::TurningFit;
use super::problem::HARMONICS;
use super::setting::{Along, Wave};
use super::spread::Spread;

/// Slopes of traces at pairs of opposite angles of the once-per-turn wave, as they follow twice the
/// angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pairs {
    /// Amplitude over twice the angle, rad, in the readings.
    pub amplitude_rad: Told,
    /// The same of a section that is oval and the same all along the bar, rad.
    pub of_oval_rad: f64,
    /// Amplitude of that section, µm.
    pub oval_um: f64,
}

impl TurningFit<'_> {
    /// What pairs of opposite angles would scatter by; `None` without harmonic 2.
    ///
    /// The wave is highest where ψ is the direction of e + γx. A trace at the angle w behind that sees
    /// cos 2ψ turn along the bar with twice that direction: a section that does not change brings a
    /// slope there that follows 2w.
    pub fn pairs(&self, spread: &Spread) -> Option<Pairs> {
        let setting = &self.problem.setting;
        if matches!(setting.wave, Wave::Bent { .. }) {
            return None;
        }
        let h = setting.harmonics.iter().position(|k| *k == 2)?;
        let per = setting.per_harmonic();
        let from = HARMONICS + per * h;
        let middle = self.problem.frame.xi(self.middle_mm());
        let value = |l: usize| self.at.border[from + l];
        let oval = match setting.along {
            Along::Constant => (value(0), value(1)),
            Along::Linear => (value(0) + middle * value(2), value(1) + middle * value(3)),
        };
        let (mut normal, mut seen, mut constant) =
            (Matrix4::zeros(), Vector4::zeros(), Vector4::zeros());
        for (i, psi) in self.psi.iter().enumerate() {
            let x = self.problem.run.x[i];
            let bar = self.axis_direction(x);
            let xi = self.problem.frame.xi(x) - middle;
            let (s, c) = (2.0 * (psi - bar)).sin_cos();
            let row = Vector4::new(c, s, xi * c, xi * s);
            let (s, c) = (2.0 * psi).sin_cos();
            let own = oval.0 * c + oval.1 * s;
            let change = match setting.along {
                Along::Constant => 0.0,
                Along::Linear => xi * (value(2) * c + value(3) * s),
            };
            normal += row * row.transpose();
            seen += row * (self.residuals[i] + own + change);
            constant += row * own;
        }
        let inverse = normal.try_inverse()?;
        let amplitude = |right: &Vector4<f64>| {
            let found = inverse * right;
            1e-3 * found[2].hypot(found[3]) / self.problem.frame.half_mm
        };
        // As sure as the change of the oval section along the bar.
        let mut row = DVector::zeros(self.count());
        if per > 2 {
            row[self.problem.band_count() + from + 2] = 1.0;
        } else {
            row[self.problem.band_count() + from] = 1.0;
        }
        Some(Pairs {
            amplitude_rad: Told {
                value: amplitude(&seen),
                std: 1e-3 * spread.variance(&row).sqrt() / self.problem.frame.half_mm,
            },
            of_oval_rad: amplitude(&constant),
            oval_um: oval.0.hypot(oval.1),
        })
    }
}
