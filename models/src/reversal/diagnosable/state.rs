//! Lines and forms of the fitted state, and what every channel reads of them.

use nalgebra::DVector;

use super::super::smooth_profile::{SmoothProfile, Spot};
use super::Linearised;

/// How the forms of a fitted state are smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Smoothing {
    /// By the weight that the readings choose.
    Chosen,
    /// By the weight of the state before.
    Kept,
    /// Not at all.
    None,
}

/// Mean profile of one channel with its line.
#[derive(Debug, Clone)]
pub(super) struct ChannelLine {
    pub(super) slope: f64,
    pub(super) offset: f64,
}

impl Linearised {
    /// Fits the readings.
    pub(super) fn fit(&mut self, smoothing: Smoothing) {
        let means = self.channel_means(&self.record.observed, None);
        let n = self.positions.len();
        let gauge = &self.gauge;
        let mut residual: Vec<Option<DVector<f64>>> = vec![None; means.len()];
        for (k, mean) in means.iter().enumerate() {
            let Some(mean) = mean else { continue };
            let slope = gauge.slope.dot(mean);
            let offset = gauge.height.dot(mean) - slope * gauge.center;
            self.lines[k] = ChannelLine { slope, offset };
            residual[k] = Some(DVector::from_iterator(
                n,
                mean.iter()
                    .zip(&self.positions)
                    .map(|(y, x)| y - offset - slope * x),
            ));
        }
        let nothing = || vec![DVector::zeros(n); self.forms.len()];
        let raw = (self.arrangement.forms(&residual, n)).unwrap_or_else(nothing);
        self.forms = match smoothing {
            Smoothing::Chosen => {
                let singles = self.forms_of_repeats();
                let smoothed = |(k, raw): (usize, &DVector<f64>)| {
                    let own: Vec<&DVector<f64>> = singles.iter().map(|forms| &forms[k]).collect();
                    self.smoother.smooth_repeated(raw, &own)
                };
                raw.iter().enumerate().map(smoothed).collect()
            }
            Smoothing::Kept => {
                let forms = self.forms.iter().zip(&raw);
                forms
                    .map(|(form, raw)| self.smoother.smooth_as(form, raw))
                    .collect()
            }
            Smoothing::None => {
                let through = raw.into_iter().map(|form| self.smoother.through(form));
                through.collect()
            }
        };
        self.beneath = None;
        self.settle();
    }

    /// What follows from lines and forms.
    pub(super) fn settle(&mut self) {
        let n = self.positions.len();
        self.smooth = (0..n * self.present().len())
            .map(|cell| self.smooth_at(cell / n, cell % n))
            .collect();
        let middle = Spot::new(&self.positions, n / 2, self.middle);
        self.mid_readings = (0..self.present().len())
            .map(|channel| {
                let line = &self.lines[channel];
                let at = |form: &SmoothProfile| form.at(&middle);
                line.offset
                    + line.slope * self.middle
                    + self.slide_sum(channel, at)
                    + at(self.side(channel))
            })
            .collect();
        self.span = self.find_span();
        self.reach = self
            .smooth
            .iter()
            .map(|reading| reading.abs())
            .fold(f64::MIN_POSITIVE, f64::max);
    }

    /// What a channel sees of the forms of the slide.
    pub(super) fn slide_sum(&self, channel: usize, of: impl Fn(&SmoothProfile) -> f64) -> f64 {
        let seen = self.arrangement.slides(channel).iter();
        seen.map(|(form, factor)| factor * of(&self.forms[*form]))
            .sum()
    }

    pub(super) fn smooth_at(&self, channel: usize, k: usize) -> f64 {
        let line = &self.lines[channel];
        line.offset
            + line.slope * self.positions[k]
            + self.slide_sum(channel, |form| form.values[k])
            + self.side(channel).values[k]
    }

    pub(super) fn side(&self, channel: usize) -> &SmoothProfile {
        &self.forms[self.arrangement.side_form(channel)]
    }

    /// The mean of repeated profiles over the positions, smoothed, with its slopes.
    pub(in crate::reversal) fn smoothed(&self, repeats: &[DVector<f64>]) -> SmoothProfile {
        let sum = repeats
            .iter()
            .fold(DVector::zeros(self.positions.len()), |sum, own| sum + own);
        let own: Vec<&DVector<f64>> = repeats.iter().collect();
        self.smoother
            .smooth_repeated(&(sum / repeats.len().max(1) as f64), &own)
    }

    fn find_span(&self) -> f64 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        // Every trace has a reading in each of its channel's cells.
        let n = self.positions.len();
        let cells = self.smooth.chunks(n).zip(&self.mid_readings).enumerate();
        let read = cells.filter(|(channel, _)| self.trace_channels.contains(channel));
        for value in read.flat_map(|(_, (own, middle))| own.iter().map(move |v| v - middle)) {
            low = low.min(value);
            high = high.max(value);
        }
        (high - low).max(f64::MIN_POSITIVE)
    }
}
