//! How a reading changes when the slide or the probed point stands elsewhere: chords of the smooth forms, per mm,
//! and what the exact geometry adds to a reading by the point that is touched.

use super::super::smooth_profile::{SmoothProfile, Spot, first_not_before};
use super::Linearised;
use crate::model::Place;

impl Linearised {
    /// What the exact geometry makes of a channel's reading at its k-th position beyond its first order
    /// (ψ·x and the form at x), µm: a channel tilted by ψ climbs tan ψ per length, and the point that it
    /// touches lies elsewhere along the artefact, x = u·cos ψ − (h + S(u))·sin ψ, half a thickness h off
    /// the axis.
    pub(super) fn beyond_first_order(&self, channel: usize, k: usize) -> f64 {
        let tilt = (self.lines[channel].slope * 1e-3).atan();
        let (sin, cos) = tilt.sin_cos();
        let half = self.assumptions.thickness.map_or(0.0, |d| d / 2.0);
        let (side, x) = (self.side(channel), self.positions[k]);
        let touched = |height: f64| (x + (half + 1e-3 * height) * sin) / cos;
        let form = |u: f64| side.at(&Spot::new(&self.positions, k, u));
        // The form's slope times the tilt is what one step leaves of the point: 1e-8 of the way.
        let u = touched(form(touched(side.values[k])));
        let versed = 2.0 * (tilt / 2.0).sin().powi(2);
        1e3 * (u * sin - half * versed - tilt * x) + form(u) * cos - side.values[k]
    }

    /// Change of the artefact's form under a channel when the probed point moves along it by
    /// `shift` mm, per mm.
    pub fn side_chord(&self, place: &Place, shift: f64) -> f64 {
        self.chord_of(self.side(place.channel), place, shift)
    }

    /// The same of a form of its own.
    pub(in crate::reversal) fn chord_of(
        &self,
        form: &SmoothProfile,
        place: &Place,
        shift: f64,
    ) -> f64 {
        let k = self.at(place);
        if shift.abs() < 1e-9 * self.travel() {
            return form.slopes[k];
        }
        let spot = Spot::new(&self.positions, k, place.x + shift);
        (form.at(&spot) - form.values[k]) / shift
    }

    /// Change of the smooth value of a reading when the slide stands `shift` mm further, per mm.
    pub fn reading_chord(&self, reading: usize, shift: f64) -> f64 {
        let place = &self.record.places[reading];
        let shift = self.chord_length(shift);
        let (channel, k) = (place.channel, self.at(place));
        let spot = Spot::new(&self.positions, k, place.x + shift);
        let moved = |form: &SmoothProfile| (form.at(&spot) - form.values[k]) / shift;
        self.lines[channel].slope
            + self.slide_sum(channel, moved)
            + moved(self.side(channel))
            + self.beneath_chord(reading, shift)
    }

    /// Change of a reading when the probed point moves `shift` mm along the artefact, per mm.
    pub fn probed_chord(&self, reading: usize, shift: f64) -> f64 {
        let shift = self.chord_length(shift);
        self.side_chord(&self.record.places[reading], shift) + self.beneath_chord(reading, shift)
    }

    /// A slope is a chord too short to matter.
    fn chord_length(&self, shift: f64) -> f64 {
        let short = 1e-6 * self.travel();
        if shift.abs() < short { short } else { shift }
    }

    /// The same of what effects add beneath, by the parabola through three neighbours.
    fn beneath_chord(&self, reading: usize, shift: f64) -> f64 {
        let Some(beneath) = &self.beneath else {
            return 0.0;
        };
        let n = self.positions.len();
        let k = self.at(&self.record.places[reading]);
        let start = reading - k;
        let x = self.positions[k] + shift;
        let nearest = first_not_before(&self.positions, k, x);
        let from = nearest.saturating_sub(1).min(n - 3);
        let [a, b, c] = [from, from + 1, from + 2].map(|j| self.positions[j]);
        let [p, q, r] = [from, from + 1, from + 2].map(|j| beneath[start + j]);
        // Newton's divided differences.
        let first = (q - p) / (b - a);
        let second = ((r - q) / (c - b) - first) / (c - a);
        let there = p + (x - a) * (first + (x - b) * second);
        (there - beneath[reading]) / shift
    }
}
