//! Which unknowns a set of channels has, and where each stands.
//!
//! Band: the coefficients of the forms, interleaved by knot; the first and last of each form are
//! fixed at zero, which takes every straight line out of the splines. Border: tilts, offsets, the
//! straight line that is subtracted from each form (the gauge ties it to the band), the thickness
//! where it is asked for, and the unknowns of effects.

use errsep_solvers::structured::Parameters;

use super::Axis;
use crate::basis::bspline::{Cubic, CubicBSpline};
use crate::reversal::finer_forms::{Curves, less_line};
use crate::reversal::{Channel, Contrast, Convention};

/// A form that is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Of the slide, on the slide position.
    Slide,
    /// Of side A of the artefact, on the artefact's own axis.
    SideA,
    /// Of side B.
    SideB,
}

/// The unknowns of a fit.
#[derive(Debug, Clone)]
pub struct Unknowns {
    /// Which contrast is which tilt.
    pub convention: Convention,
    /// Channels with readings.
    pub channels: Vec<Channel>,
    /// Forms that the channels tell apart.
    pub forms: Vec<Form>,
    /// Contrasts whose tilts are unknown, or none: then every channel has its own slope.
    pub contrasts: Vec<Contrast>,
    /// The contrast that is held at zero.
    pub closure: Option<Contrast>,
    /// Whether the thickness is unknown.
    pub thickness: bool,
    /// Coefficients of one form, the two fixed ones included.
    pub coefficients: usize,
    /// The names of the effects' unknowns.
    pub effects: Vec<String>,
}

impl Unknowns {
    /// The unknowns of these channels under a convention.
    pub fn new(
        channels: Vec<Channel>,
        convention: Convention,
        thickness: bool,
        coefficients: usize,
    ) -> Self {
        let has = |side_a: bool| channels.iter().any(|c| c.is_side_a() == side_a);
        // The slide is told from the artefact where one side is seen by both indicators.
        let both = |side_a: bool| channels.iter().filter(|c| c.is_side_a() == side_a).count() == 2;
        let mut forms = Vec::new();
        if both(true) || both(false) {
            forms.push(Form::Slide);
        }
        if has(true) {
            forms.push(Form::SideA);
        }
        if has(false) {
            forms.push(Form::SideB);
        }
        let contrasts = if channels.len() >= 3 {
            convention.tilts().to_vec()
        } else {
            Vec::new()
        };
        let closure = (channels.len() == 4).then(|| convention.closure());
        Self {
            convention,
            channels,
            forms,
            contrasts,
            closure,
            thickness,
            coefficients,
            effects: Vec::new(),
        }
    }

    /// The same with the unknowns of effects, by name.
    #[must_use]
    pub fn with_effects(mut self, names: Vec<String>) -> Self {
        self.effects = names;
        self
    }

    /// Number of unknowns in the band.
    pub fn band_count(&self) -> usize {
        self.coefficients.saturating_sub(2) * self.forms.len()
    }

    /// The band unknown of a coefficient of a form (by place in [`Self::forms`]); `None` for the
    /// first and last, which are zero.
    pub fn coefficient(&self, form: usize, index: usize) -> Option<usize> {
        (index > 0 && index + 1 < self.coefficients).then(|| (index - 1) * self.forms.len() + form)
    }

    /// The coefficients of a form, out of the band.
    pub fn coefficients_of(&self, form: usize, band: &[f64]) -> Vec<f64> {
        (0..self.coefficients)
            .map(|k| self.coefficient(form, k).map_or(0.0, |j| band[j]))
            .collect()
    }

    /// The place of a form.
    pub fn place(&self, form: Form) -> Option<usize> {
        self.forms.iter().position(|f| *f == form)
    }

    /// The form of the artefact that a channel touches, by place.
    pub fn side_of(&self, channel: Channel) -> usize {
        let form = if channel.is_side_a() {
            Form::SideA
        } else {
            Form::SideB
        };
        self.place(form).unwrap_or(0)
    }

    /// Number of tilts, the closure not counted.
    pub fn tilt_count(&self) -> usize {
        if self.contrasts.is_empty() {
            self.channels.len()
        } else {
            self.contrasts.len()
        }
    }

    /// The border unknown of the closure.
    pub fn closure_index(&self) -> Option<usize> {
        self.closure.map(|_| self.tilt_count())
    }

    fn offsets_from(&self) -> usize {
        self.tilt_count() + usize::from(self.closure.is_some())
    }

    /// The border unknown of a channel's offset.
    pub fn offset(&self, channel: usize) -> usize {
        self.offsets_from() + channel
    }

    /// The border unknowns of the line of a form: height at the centre, and slope over half the
    /// range.
    pub fn line(&self, form: usize) -> [usize; 2] {
        let at = self.offsets_from() + self.channels.len() + 2 * form;
        [at, at + 1]
    }

    /// The fitted forms, less their lines, as polynomials of the cells of these bases, µm.
    pub fn cubics(&self, bases: &[CubicBSpline], axis: Axis, at: &Parameters) -> Vec<Vec<Cubic>> {
        let of = |(form, basis): (usize, &CubicBSpline)| {
            let line = self.line(form).map(|j| at.border[j]);
            less_line(basis, &self.coefficients_of(form, &at.band), line, axis)
        };
        bases.iter().enumerate().map(of).collect()
    }

    /// The same forms with their bases.
    pub(super) fn curves(&self, bases: &[CubicBSpline], axis: Axis, at: &Parameters) -> Curves {
        Curves {
            cubics: self.cubics(bases, axis, at),
            bases: bases.to_vec(),
        }
    }

    /// The border unknowns that the gauge ties to the band: the lines of all forms.
    pub fn lines(&self) -> Vec<usize> {
        (0..self.forms.len()).flat_map(|f| self.line(f)).collect()
    }

    /// The border unknowns that are free: neither lines nor closure.
    pub fn kept(&self) -> Vec<usize> {
        let lines = self.lines();
        (0..self.border_count())
            .filter(|j| !lines.contains(j) && Some(*j) != self.closure_index())
            .collect()
    }

    /// The border unknown of the thickness.
    pub fn thickness_index(&self) -> Option<usize> {
        self.thickness.then(|| self.effect(0) - 1)
    }

    /// The border unknown of an unknown of the effects.
    pub fn effect(&self, index: usize) -> usize {
        self.offsets_from()
            + self.channels.len()
            + 2 * self.forms.len()
            + usize::from(self.thickness)
            + index
    }

    /// The values of the effects' unknowns, out of the border.
    pub fn effect_values<'v>(&self, border: &'v [f64]) -> &'v [f64] {
        &border[self.effect(0)..]
    }

    /// Number of unknowns in the border.
    pub fn border_count(&self) -> usize {
        self.effect(self.effects.len())
    }

    /// Which border unknowns are held: the closure.
    pub fn held(&self) -> Vec<bool> {
        (0..self.border_count())
            .map(|j| Some(j) == self.closure_index())
            .collect()
    }

    /// The signs with which a channel's slope is made of the tilts and the closure.
    pub fn slope_signs(&self, channel: usize) -> impl Iterator<Item = f64> + '_ {
        let own = if self.contrasts.is_empty() {
            self.channels.len()
        } else {
            0
        };
        let contrasts = self.contrasts.iter();
        let closure = self.closure.iter().filter(move |_| own == 0);
        (0..own)
            .map(move |c| if c == channel { 1.0 } else { 0.0 })
            .chain(
                contrasts
                    .chain(closure)
                    .map(move |contrast| contrast.sign(self.channels[channel])),
            )
    }

    /// The slope of a channel, rad.
    pub fn slope(&self, channel: usize, border: &[f64]) -> f64 {
        self.slope_signs(channel)
            .zip(border)
            .map(|(sign, tilt)| sign * tilt)
            .sum()
    }

    /// Number of unknowns that the fit is free to choose: band and border less the closure and the
    /// lines, which the gauge ties to the band.
    pub fn free_count(&self) -> usize {
        self.band_count()
            + self.tilt_count()
            + self.channels.len()
            + usize::from(self.thickness)
            + self.effects.len()
    }

    /// Whether channels with a reading somewhere (one flag each) tell all fitted forms apart there.
    pub fn told_apart_by(&self, seen: &[bool]) -> bool {
        let of = |side_a: bool| {
            self.channels
                .iter()
                .zip(seen)
                .filter(|(c, seen)| **seen && c.is_side_a() == side_a)
                .count()
        };
        let (a, b) = (of(true), of(false));
        (a > 0 || self.place(Form::SideA).is_none())
            && (b > 0 || self.place(Form::SideB).is_none())
            && (self.place(Form::Slide).is_none() || a == 2 || b == 2)
    }

    /// The name of a border unknown.
    pub fn border_name(&self, index: usize) -> String {
        if let Some(contrast) = self.contrasts.get(index) {
            return contrast.name(self.convention).to_owned();
        }
        if self.closure_index() == Some(index) {
            return "closure".to_owned();
        }
        if index < self.tilt_count() {
            return format!("slope of {}", self.channels[index].name());
        }
        if let Some(name) = index
            .checked_sub(self.effect(0))
            .and_then(|k| self.effects.get(k))
        {
            return name.clone();
        }
        let after_tilts = index - self.offsets_from();
        if let Some(channel) = self.channels.get(after_tilts) {
            return format!("offset of {}", channel.name());
        }
        let line = after_tilts - self.channels.len();
        match self.forms.get(line / 2) {
            Some(form) => format!("line of {}", form.name()),
            None => "thickness".to_owned(),
        }
    }

    /// The name of an unknown of the band.
    pub fn band_name(&self, index: usize, breaks: &[f64]) -> String {
        let form = self.forms[index % self.forms.len()];
        let knot = index / self.forms.len() + 1;
        let position = breaks[knot.saturating_sub(1).min(breaks.len() - 1)];
        format!("{} near {position:.4} mm", form.name())
    }
}

impl Form {
    /// Whether it is the side of the artefact that a channel touches.
    pub const fn is_side_of(self, channel: Channel) -> bool {
        match self {
            Self::Slide => false,
            Self::SideA => channel.is_side_a(),
            Self::SideB => !channel.is_side_a(),
        }
    }

    /// Its symbol.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Slide => "M",
            Self::SideA => "S_A",
            Self::SideB => "S_B",
        }
    }
}
