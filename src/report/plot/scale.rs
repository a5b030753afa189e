//! From data to picture: domains, linear and logarithmic scales, ticks with readable labels.

use crate::report::number::{fixed, minus, superscript};

/// Values beyond this are left out of a picture: their differences overflow.
const LARGEST: f64 = 1e300;
/// A linear range narrower than this part of its magnitude is shown as one value.
const NARROWEST: f64 = 1e-13;
/// More digits than this in a tick label are split off as a common offset.
const LABEL_DIGITS: i32 = 6;

/// Smallest and largest of the values seen so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Domain {
    low: f64,
    high: f64,
}

impl Domain {
    pub(crate) const EMPTY: Self = Self {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };

    /// The domain of what can be drawn of some values.
    pub(crate) fn of<'a>(values: impl IntoIterator<Item = &'a f64>, log: bool) -> Self {
        values
            .into_iter()
            .filter(|v| drawable(**v, log))
            .fold(Self::EMPTY, |domain, v| domain.with(*v))
    }

    pub(crate) fn with(self, value: f64) -> Self {
        Self {
            low: self.low.min(value),
            high: self.high.max(value),
        }
    }

    pub(crate) fn union(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }
}

/// Whether a value has a place on a scale.
pub(crate) fn drawable(value: f64, log: bool) -> bool {
    value.abs() <= LARGEST && (!log || value > 1.0 / LARGEST)
}

/// A monotone map from an interval of values to an interval of pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    low: f64,
    high: f64,
    log: bool,
    start: f64,
    end: f64,
}

impl Scale {
    /// The scale of a domain with a margin of `pad` (part of the range) on either side. An empty
    /// domain becomes 0 to 1 (1 to 10), a single value gets room around it.
    pub(crate) fn new(domain: Domain, log: bool, pad: f64, start: f64, end: f64) -> Self {
        let (low, high) = if domain.low > domain.high {
            if log { (1.0, 10.0) } else { (0.0, 1.0) }
        } else if log {
            let (low, high) = (domain.low.log10(), domain.high.log10());
            let margin = if high - low < 0.1 {
                0.5
            } else {
                pad * (high - low)
            };
            // Beyond these exponents a power of ten is zero or infinite.
            (
                10f64.powf((low - margin).max(-305.0)),
                10f64.powf((high + margin).min(305.0)),
            )
        } else {
            let magnitude = domain.low.abs().max(domain.high.abs());
            let range = domain.high - domain.low;
            let margin = if range > NARROWEST * magnitude && range > 1.0 / LARGEST {
                pad * range
            } else if magnitude > 1e-290 {
                0.1 * magnitude
            } else {
                1.0
            };
            (domain.low - margin, domain.high + margin)
        };
        Self {
            low,
            high,
            log,
            start,
            end,
        }
    }

    /// A linear scale over exactly these bounds.
    #[cfg(test)]
    fn exact(low: f64, high: f64, start: f64, end: f64) -> Self {
        Self::new(Domain { low, high }, false, 0.0, start, end)
    }

    /// Where a value lies, in pixels. Call it with [`drawable`] values only.
    pub(crate) fn at(&self, value: f64) -> f64 {
        let part = if self.log {
            (value.log10() - self.low.log10()) / (self.high.log10() - self.low.log10())
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.start + part * (self.end - self.start)
    }

    pub(crate) const fn bounds(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    pub(crate) const fn is_log(&self) -> bool {
        self.log
    }

    pub(crate) fn contains(&self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// About `target` ticks at round values, at whole numbers only if asked.
    pub(crate) fn ticks(&self, target: usize, whole: bool) -> Ticks {
        if self.log {
            self.log_ticks(target)
        } else {
            self.linear_ticks(target, if whole { 1.0 } else { 0.0 })
        }
    }

    fn linear_ticks(&self, target: usize, least_step: f64) -> Ticks {
        let raw = ((self.high - self.low) / target.max(1) as f64).max(least_step);
        let power = raw.log10().floor() as i32;
        // The first round step that gives no more ticks than asked for, and the one below it for
        // a range that lies between two multiples of that step.
        let (wide, narrow) = match raw / 10f64.powi(power) {
            h if h <= 1.0 => ((1.0, power), (5.0, power - 1)),
            h if h <= 2.0 => ((2.0, power), (1.0, power)),
            h if h <= 5.0 => ((5.0, power), (2.0, power)),
            _ => ((1.0, power + 1), (5.0, power)),
        };
        let ticks = self.ticks_every(wide, target);
        if ticks.marks.is_empty() && least_step == 0.0 {
            self.ticks_every(narrow, target)
        } else {
            ticks
        }
    }

    /// Ticks at the multiples of `head` times ten to the `power`.
    fn ticks_every(&self, (head, power): (f64, i32), target: usize) -> Ticks {
        let step = head * 10f64.powi(power);
        let first = (self.low / step).ceil();
        let last = (self.high / step).floor();
        let largest = first.abs().max(last.abs());
        let offset = if largest * head >= 10f64.powi(LABEL_DIGITS) {
            first
        } else {
            0.0
        };
        let label_size = (largest.min((last - first).max(1.0)).max(1.0) * step)
            .max(if offset == 0.0 { largest * step } else { 0.0 });
        let size = label_size.log10().floor() as i32;
        let exponent = if (-3..=5).contains(&size) {
            0
        } else {
            size.div_euclid(3) * 3
        };
        let decimals = (exponent - power).max(0) as usize;
        let count = ((last - first).max(0.0) as usize).min(4 * target.max(1));
        let marks = (0..=count)
            .map(|k| {
                let place = first + k as f64;
                let label = (place - offset) * head * 10f64.powi(power - exponent);
                (place * step, fixed(label, decimals))
            })
            .filter(|(value, _)| self.contains(*value))
            .collect();
        Ticks {
            marks,
            exponent,
            offset: (offset != 0.0).then_some(offset * step),
        }
    }

    fn log_ticks(&self, target: usize) -> Ticks {
        let (low, high) = (self.low.log10(), self.high.log10());
        let decades = high - low;
        let heads: &[f64] = match decades {
            d if d < 1.2 => &[1.0, 2.0, 3.0, 5.0, 7.0],
            d if d < 3.0 => &[1.0, 2.0, 5.0],
            _ => &[1.0],
        };
        let stride = (decades / target.max(1) as f64).ceil().max(1.0) as i32;
        let marks = (low.floor() as i32..=high.ceil() as i32)
            .filter(|power| power.rem_euclid(stride) == 0)
            .flat_map(|power| heads.iter().map(move |head| (*head, power)))
            .map(|(head, power)| (head * 10f64.powi(power), log_label(head, power)))
            .filter(|(value, _)| self.contains(*value))
            .collect();
        Ticks {
            marks,
            exponent: 0,
            offset: None,
        }
    }
}

fn log_label(head: f64, power: i32) -> String {
    if (-3..=4).contains(&power) {
        fixed(head * 10f64.powi(power), (-power).max(0) as usize)
    } else if head == 1.0 {
        format!("10{}", superscript(power))
    } else {
        format!("{head}·10{}", superscript(power))
    }
}

/// Ticks of one axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ticks {
    /// Value and label.
    pub(crate) marks: Vec<(f64, String)>,
    /// The labels are in units of ten to this power.
    pub(crate) exponent: i32,
    /// This much is to be added to every label.
    pub(crate) offset: Option<f64>,
}

impl Ticks {
    /// Name of the axis with its unit, and with the factor and offset of the labels.
    pub(crate) fn title(&self, quantity: &str, unit: &str) -> String {
        let factor = match self.exponent {
            0 => String::new(),
            e => format!("10{}", superscript(e)),
        };
        let unit = match (factor.is_empty(), unit.is_empty()) {
            (true, true) => String::new(),
            (true, false) => format!(" ({unit})"),
            (false, true) => format!(" (× {factor})"),
            (false, false) => format!(" ({factor} {unit})"),
        };
        match self.offset {
            None => format!("{quantity}{unit}"),
            Some(offset) => format!("{quantity}{unit}, from {}", minus(offset.to_string())),
        }
    }

    /// Characters of the longest label.
    pub(crate) fn widest(&self) -> usize {
        self.marks
            .iter()
            .map(|(_, label)| label.chars().count())
            .max()
            .unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn labels(low: f64, high: f64) -> Vec<String> {
        let scale = Scale::exact(low, high, 0.0, 100.0);
        scale
            .ticks(5, false)
            .marks
            .into_iter()
            .map(|m| m.1)
            .collect()
    }

    #[test]
    fn labels_have_the_digits_of_their_step() {
        assert_eq!(labels(0.0, 1.0), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(-0.25, 0.25), ["−0.2", "−0.1", "0.0", "0.1", "0.2"]);
        assert_eq!(labels(0.0, 250.0), ["0", "50", "100", "150", "200", "250"]);
    }

    #[test]
    fn far_from_one_the_axis_carries_the_factor() {
        let ticks = Scale::exact(0.0, 5e-7, 0.0, 1.0).ticks(5, false);
        assert_eq!(ticks.title("closure", "µm"), "closure (10⁻⁹ µm)");
        assert_eq!(ticks.marks.last().unwrap().1, "500");
        let ticks = Scale::exact(1e6, 1e6 + 1e-3, 0.0, 1.0).ticks(5, false);
        assert_eq!(ticks.offset, Some(1e6));
        assert!(ticks.widest() <= 8, "{ticks:?}");
    }

    /// 0.2003 to 0.2448 lies between two multiples of 0.05, the step for two ticks.
    #[test]
    fn a_range_between_two_round_values_has_a_tick() {
        let marks = Scale::exact(0.2003, 0.2448, 0.0, 1.0).ticks(2, false).marks;
        let labels: Vec<_> = marks.into_iter().map(|m| m.1).collect();
        assert_eq!(labels, ["0.22", "0.24"]);
    }

    #[test]
    fn decades_are_labelled_by_decades() {
        let domain = Domain::of(&[1e-9, 1.0], true);
        let scale = Scale::new(domain, true, 0.0, 0.0, 100.0);
        let marks = scale.ticks(5, false).marks;
        assert!((3..=6).contains(&marks.len()), "{marks:?}");
        // Exact limit up to the rounding of two logarithms.
        assert!((scale.at(1e-9)).abs() < 1e-10 && (scale.at(1.0) - 100.0).abs() < 1e-10);
    }

    #[test]
    fn one_value_or_none_still_has_a_scale() {
        for values in [&[][..], &[0.0], &[3.0, 3.0], &[f64::NAN, f64::INFINITY]] {
            let scale = Scale::new(Domain::of(values, false), false, 0.05, 0.0, 100.0);
            let (low, high) = scale.bounds();
            assert!(low < high);
            assert!(scale.ticks(5, false).marks.len() >= 2, "{values:?}");
        }
    }

    proptest! {
        #[test]
        fn ticks_are_few_distinct_short_and_inside(
            centre in -1.0..1.0f64, centre_power in -290..290i32,
            width in 0.1..1.0f64, width_power in -290..290i32, target in 2usize..9
        ) {
            let centre = centre * 10f64.powi(centre_power);
            let width = width * 10f64.powi(width_power);
            let domain = Domain::of(&[centre, centre + width], false);
            let scale = Scale::new(domain, false, 0.04, 0.0, 500.0);
            let ticks = scale.ticks(target, false);
            prop_assert!(!ticks.marks.is_empty() && ticks.marks.len() <= target + 1, "{:?}", ticks);
            for pair in ticks.marks.windows(2) {
                prop_assert!(pair[0].0 < pair[1].0 && pair[0].1 != pair[1].1, "{:?}", ticks);
            }
            for (value, label) in &ticks.marks {
                let place = scale.at(*value);
                prop_assert!((-0.5..=500.5).contains(&place));
                prop_assert!(label.chars().count() <= 10, "{label} of {:?}", ticks);
                prop_assert!(!label.contains("NaN") && !label.contains("inf"));
            }
        }

        #[test]
        fn logarithmic_ticks_too(low in -290.0..290.0f64, decades in 0.0..200.0f64) {
            let domain = Domain::of(&[10f64.powf(low), 10f64.powf((low + decades).min(299.0))], true);
            let scale = Scale::new(domain, true, 0.04, 0.0, 500.0);
            let ticks = scale.ticks(6, false);
            prop_assert!(ticks.marks.len() <= 12, "{:?}", ticks);
            for pair in ticks.marks.windows(2) {
                prop_assert!(pair[0].0 < pair[1].0 && pair[0].1 != pair[1].1, "{:?}", ticks);
            }
        }
    }
}
