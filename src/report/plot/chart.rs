//! Lines, points and columns over one pair of axes.

/// One axis: what it shows, in which unit, on which scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub(super) quantity: String,
    pub(super) unit: String,
    pub(super) log: bool,
    pub(super) range: Option<(f64, f64)>,
    pub(super) whole: bool,
}

impl Axis {
    /// A linear axis that shows everything there is.
    pub fn new(quantity: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            quantity: quantity.into(),
            unit: unit.into(),
            log: false,
            range: None,
            whole: false,
        }
    }

    /// Makes the scale logarithmic; what is not positive is left out.
    #[must_use]
    pub const fn log(mut self) -> Self {
        self.log = true;
        self
    }

    /// Labels whole numbers only: iterations, counts.
    #[must_use]
    pub const fn whole(mut self) -> Self {
        self.whole = true;
        self
    }

    /// Shows at least this range. Bounds that are not finite are ignored.
    #[must_use]
    pub const fn including(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }
}

/// The sign that stands at each point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// None.
    None,
    /// A filled dot.
    Dot,
    /// An open circle.
    Ring,
    /// An open triangle, point up.
    Triangle,
    /// An open square.
    Square,
    /// A diagonal cross.
    Cross,
}

/// How the points of a series are joined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Join {
    Nothing,
    Line,
    /// Columns of this width from zero.
    Columns(f64),
}

/// One curve or cloud of points. Points without a finite place are left out and break the line.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    pub(super) name: String,
    pub(super) x: Vec<f64>,
    pub(super) y: Vec<f64>,
    pub(super) band: Option<Band>,
    pub(super) join: Join,
    pub(super) mark: Mark,
    pub(super) tone: Option<usize>,
    pub(super) extra: Option<Extra>,
}

/// Lower and upper bound of a series, in the unit of y.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Band {
    pub(super) name: String,
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
}

/// A further value of each point, shown under the pointer only.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Extra {
    pub(super) name: String,
    pub(super) values: Vec<f64>,
}

impl Series {
    /// A line through the points, in the order given.
    pub fn line(name: impl Into<String>, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            x,
            y,
            band: None,
            join: Join::Line,
            mark: Mark::None,
            tone: None,
            extra: None,
        }
    }

    /// Points that are not joined.
    pub fn points(name: impl Into<String>, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self {
            join: Join::Nothing,
            mark: Mark::Dot,
            ..Self::line(name, x, y)
        }
    }

    /// Columns of one width standing on zero, centred on x.
    pub fn columns(name: impl Into<String>, x: Vec<f64>, y: Vec<f64>, width: f64) -> Self {
        Self {
            join: Join::Columns(width),
            ..Self::line(name, x, y)
        }
    }

    /// Adds a band `y ± half` named "95 % band".
    #[must_use]
    pub fn half_band(self, half: Vec<f64>) -> Self {
        let lower = self.y.iter().zip(&half).map(|(y, h)| y - h).collect();
        let upper = self.y.iter().zip(&half).map(|(y, h)| y + h).collect();
        self.band("95 % band", lower, upper)
    }

    /// Adds a band with its bounds and its name.
    #[must_use]
    pub fn band(mut self, name: impl Into<String>, lower: Vec<f64>, upper: Vec<f64>) -> Self {
        self.band = Some(Band {
            name: name.into(),
            lower,
            upper,
        });
        self
    }

    /// Puts a mark at every point.
    #[must_use]
    pub const fn mark(mut self, mark: Mark) -> Self {
        self.mark = mark;
        self
    }

    /// Fixes the colour and dash, 0 to 5; otherwise they follow the order of the series.
    #[must_use]
    pub const fn tone(mut self, tone: usize) -> Self {
        self.tone = Some(tone);
        self
    }

    /// A further value of each point, shown under the pointer.
    #[must_use]
    pub fn extra(mut self, name: impl Into<String>, values: Vec<f64>) -> Self {
        self.extra = Some(Extra {
            name: name.into(),
            values,
        });
        self
    }

    /// Points that have both coordinates.
    pub(super) fn len(&self) -> usize {
        self.x.len().min(self.y.len())
    }
}

/// A straight mark across the picture.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rule {
    pub(super) horizontal: bool,
    pub(super) value: f64,
    pub(super) label: String,
}

/// Words at one point.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Annotation {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) label: String,
}

/// A shaded stretch of x.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stretch {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) label: String,
}

/// A chart with one pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    pub(super) title: String,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) series: Vec<Series>,
    pub(super) rules: Vec<Rule>,
    pub(super) annotations: Vec<Annotation>,
    pub(super) stretches: Vec<Stretch>,
}

impl Chart {
    /// An empty chart.
    pub const fn new(x: Axis, y: Axis) -> Self {
        Self {
            title: String::new(),
            x,
            y,
            series: Vec::new(),
            rules: Vec::new(),
            annotations: Vec::new(),
            stretches: Vec::new(),
        }
    }

    /// The distribution of values in equal classes (as many as Freedman and Diaconis advise, 5 to
    /// 80), counts upward.
    pub fn histogram(name: impl Into<String>, axis: Axis, values: &[f64]) -> Self {
        let (centres, counts, width) = classes(values);
        Self::new(axis, Axis::new("count", "").whole().including(0.0, 0.0))
            .series(Series::columns(name, centres, counts, width))
    }

    /// Names the chart among others (before, after, a channel).
    #[must_use]
    pub fn titled(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }

    /// Adds a curve.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Adds a horizontal line at a value of y.
    #[must_use]
    pub fn horizontal(mut self, y: f64, label: impl Into<String>) -> Self {
        self.rules.push(Rule {
            horizontal: true,
            value: y,
            label: label.into(),
        });
        self
    }

    /// Adds a vertical line at a value of x.
    #[must_use]
    pub fn vertical(mut self, x: f64, label: impl Into<String>) -> Self {
        self.rules.push(Rule {
            horizontal: false,
            value: x,
            label: label.into(),
        });
        self
    }

    /// Rings a point and names it.
    #[must_use]
    pub fn annotate(mut self, x: f64, y: f64, label: impl Into<String>) -> Self {
        self.annotations.push(Annotation {
            x,
            y,
            label: label.into(),
        });
        self
    }

    /// Shades a stretch of x.
    #[must_use]
    pub fn stretch(mut self, from: f64, to: f64, label: impl Into<String>) -> Self {
        self.stretches.push(Stretch {
            from,
            to,
            label: label.into(),
        });
        self
    }
}

/// Centres, counts and width of equal classes.
fn classes(values: &[f64]) -> (Vec<f64>, Vec<f64>, f64) {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let (Some(&low), Some(&high)) = (sorted.first(), sorted.last()) else {
        return (Vec::new(), Vec::new(), 1.0);
    };
    let quantile = |p: f64| sorted[(p * (sorted.len() - 1) as f64) as usize];
    let spread = 2.0 * (quantile(0.75) - quantile(0.25)) / (sorted.len() as f64).cbrt();
    let count = if high > low && spread > 0.0 {
        ((high - low) / spread).ceil().clamp(5.0, 80.0) as usize
    } else {
        5
    };
    let width = if high > low {
        (high - low) / count as f64
    } else {
        1.0
    };
    let mut counts = vec![0.0; count];
    for value in &sorted {
        let class = (((value - low) / width) as usize).min(count - 1);
        counts[class] += 1.0;
    }
    let centres = (0..count).map(|k| low + (k as f64 + 0.5) * width).collect();
    (centres, counts, width)
}

/// Several charts beside each other, by default on one scale so that they compare by eye.
#[derive(Debug, Clone, PartialEq)]
pub struct Panels {
    pub(super) charts: Vec<Chart>,
    pub(super) one_y_scale: bool,
    pub(super) one_x_scale: bool,
}

impl Panels {
    /// Charts on one pair of scales.
    pub fn new(charts: impl IntoIterator<Item = Chart>) -> Self {
        Self {
            charts: charts.into_iter().collect(),
            one_y_scale: true,
            one_x_scale: true,
        }
    }

    /// Lets each chart have scales of its own, where they show different things.
    #[must_use]
    pub const fn own_scales(mut self) -> Self {
        self.one_y_scale = false;
        self.one_x_scale = false;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_value_is_counted_once(values in prop::collection::vec(-5.0..5.0f64, 0..300)) {
            let (centres, counts, width) = classes(&values);
            prop_assert_eq!(counts.iter().sum::<f64>() as usize, values.len());
            prop_assert!(centres.len() <= 80 && width > 0.0);
        }
    }
}
