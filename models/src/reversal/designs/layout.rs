//! Where each unknown of a design stands in the fit.
//!
//! Band: the coefficients of the fitted forms in the order of the middles of their basis functions, so that
//! forms of different knots lie side by side; the first and the last of each form are zero, which takes every
//! straight line out of the splines. Border: slopes, slopes common to a position of the spindle (held at
//! zero: closures), constants, the line that is subtracted from each form, and the thickness where it is
//! asked for.

use super::channel::{Design, DesignChannel, angle_name, direction, is_same};
use super::determined::{Determined, SLIDE};

/// A form that is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FormOf {
    /// Of the slide: 0 horizontal, 1 vertical; on the slide position.
    Slide(usize),
    /// Of a side of the artefact, by its place in the design; on the artefact's own axis.
    Side(usize),
}

/// A form of the slide as a channel sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlideSeen {
    /// Its place among the forms.
    pub form: usize,
    /// Its part along the indicator, n(φ).
    pub along: f64,
    /// Its part across, t(φ), where the crest of the bar is a term of the fit; otherwise 0.
    pub across: f64,
}

/// What moves the artefact across the line of an indicator, of the fitted unknowns: t(φ) and t(ψ) with
/// t(a) = (−sin a, cos a).
#[derive(Debug, Clone, PartialEq)]
pub struct Across {
    /// Shares of the slopes.
    pub slopes: Vec<f64>,
    /// Shares of the slopes of the artefact alone, which turns with the spindle.
    pub artefact: Vec<f64>,
    /// Shares of the constants: of the eccentricity.
    pub constants: Vec<f64>,
}

/// The unknowns of a fit.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Forms, those of the slide first.
    pub forms: Vec<FormOf>,
    /// By channel: the forms of the slide that it sees.
    pub slides: Vec<Vec<SlideSeen>>,
    /// By channel, where the crest of the bar is a term of the fit: what moves the artefact across.
    pub across: Vec<Across>,
    /// By channel: the form of its side.
    pub side: Vec<usize>,
    /// By channel: what its slope is of the slopes, then of the closures.
    pub slopes: Vec<Vec<f64>>,
    /// By channel: what its constant is of the constants.
    pub constants: Vec<Vec<f64>>,
    /// Names of slopes, closures and constants.
    pub names: Vec<String>,
    /// How many slopes are fitted.
    pub slope_count: usize,
    /// How many closures are held at zero after them.
    pub closure_count: usize,
    /// Whether the thickness is unknown.
    pub thickness: bool,
    /// By form: the band unknown of each coefficient; none for the first and the last.
    places: Vec<Vec<Option<usize>>>,
    /// By band unknown: the form and its coefficient.
    members: Vec<(usize, usize)>,
}

/// What a fit has beside slopes, constants and forms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Beside {
    /// The crest of a bar as a term.
    pub crest: bool,
    /// The thickness as an unknown.
    pub thickness: bool,
}

impl Layout {
    /// The unknowns of a design, without knots yet.
    pub fn new(design: &Design, determined: &Determined, beside: Beside) -> Self {
        let channels = design.channels().len();
        let pivots = |a: &super::Analysis| -> Vec<Vec<f64>> {
            let row = |c: usize| a.pivots().iter().map(|j| a.matrix()[(c, *j)]).collect();
            (0..channels).map(row).collect()
        };
        let forms = &determined.forms;
        let column = |axis: usize| {
            let of = |j: &&usize| forms.unknowns()[**j] == SLIDE[axis];
            forms.pivots().iter().find(of).copied()
        };
        let fitted: Vec<(usize, usize)> = (0..2)
            .filter_map(|axis| Some((axis, column(axis)?)))
            .collect();
        let slides = (0..channels)
            .map(|c| {
                let factors = fitted.iter().enumerate();
                let [cos, sin] = direction(design.channels()[c].indicator);
                factors
                    .map(|(form, (axis, j))| SlideSeen {
                        form,
                        along: forms.matrix()[(c, *j)],
                        across: if beside.crest {
                            [-sin, cos][*axis]
                        } else {
                            0.0
                        },
                    })
                    .filter(|seen| seen.along != 0.0 || seen.across != 0.0)
                    .collect()
            })
            .collect();
        let closures = positions(design);
        let mut slopes = pivots(&determined.slopes);
        for (c, row) in slopes.iter_mut().enumerate() {
            row.extend(closures.iter().map(|(_, signs)| signs[c]));
        }
        let names = Determined::names(&determined.slopes)
            .into_iter()
            .chain(closures.iter().map(|(name, _)| name.clone()))
            .chain(Determined::names(&determined.constants))
            .collect();
        Self {
            forms: fitted
                .iter()
                .map(|(axis, _)| FormOf::Slide(*axis))
                .chain((0..design.sides().len()).map(FormOf::Side))
                .collect(),
            slides,
            side: (0..channels)
                .map(|c| fitted.len() + design.side_of(c))
                .collect(),
            slopes,
            constants: pivots(&determined.constants),
            names,
            slope_count: determined.slopes.rank(),
            closure_count: closures.len(),
            across: match beside.crest {
                true => across(design, determined),
                false => Vec::new(),
            },
            thickness: beside.thickness,
            places: Vec::new(),
            members: Vec::new(),
        }
    }

    /// The same with forms on these break points, mm, one list a form.
    #[must_use]
    pub fn on(&self, breaks: &[Vec<f64>]) -> Self {
        // The function of coefficient k has its middle at break k − 1.
        let mut members: Vec<(usize, usize)> = breaks
            .iter()
            .enumerate()
            .flat_map(|(form, own)| (1..=own.len()).map(move |k| (form, k)))
            .collect();
        members.sort_by(|(f, k), (g, l)| {
            let middles = breaks[*f][k - 1].total_cmp(&breaks[*g][l - 1]);
            middles.then(f.cmp(g))
        });
        let mut places: Vec<Vec<Option<usize>>> =
            breaks.iter().map(|own| vec![None; own.len() + 2]).collect();
        for (j, (form, k)) in members.iter().enumerate() {
            places[*form][*k] = Some(j);
        }
        Self {
            places,
            members,
            ..self.clone()
        }
    }

    /// Number of unknowns in the band.
    pub fn band_count(&self) -> usize {
        self.members.len()
    }

    /// The band unknown of a coefficient of a form; `None` for the first and last, which are zero.
    pub fn coefficient(&self, form: usize, index: usize) -> Option<usize> {
        self.places[form][index]
    }

    /// The form and the coefficient of a band unknown.
    pub fn member(&self, index: usize) -> (usize, usize) {
        self.members[index]
    }

    /// The coefficients of a form, out of the band.
    pub fn coefficients_of(&self, form: usize, band: &[f64]) -> Vec<f64> {
        let own = self.places[form].iter();
        own.map(|place| place.map_or(0.0, |j| band[j])).collect()
    }

    /// The border unknown of the first constant.
    pub fn constants_from(&self) -> usize {
        self.slope_count + self.closure_count
    }

    /// Number of constants.
    pub fn constant_count(&self) -> usize {
        self.constants.first().map_or(0, Vec::len)
    }

    /// The border unknowns of the line of a form: height at the centre, slope over half the range.
    pub fn line(&self, form: usize) -> [usize; 2] {
        let at = self.constants_from() + self.constant_count() + 2 * form;
        [at, at + 1]
    }

    /// The border unknown of the thickness.
    pub fn thickness_index(&self) -> Option<usize> {
        self.thickness.then(|| self.line(self.forms.len())[0])
    }

    /// Number of unknowns in the border.
    pub fn border_count(&self) -> usize {
        self.line(self.forms.len())[0] + usize::from(self.thickness)
    }

    /// The border unknowns of the closures.
    pub fn closures(&self) -> std::ops::Range<usize> {
        self.slope_count..self.constants_from()
    }

    /// Number of unknowns that the fit chooses: the lines are tied to the band, closures are held.
    pub fn free_count(&self) -> usize {
        self.band_count() + self.slope_count + self.constant_count() + usize::from(self.thickness)
    }

    /// The slope of a channel, rad.
    pub fn slope(&self, channel: usize, border: &[f64]) -> f64 {
        self.slopes[channel]
            .iter()
            .zip(border)
            .map(|(s, v)| s * v)
            .sum()
    }

    /// The constant of a channel, µm.
    pub fn constant(&self, channel: usize, border: &[f64]) -> f64 {
        let own = &border[self.constants_from()..];
        self.constants[channel]
            .iter()
            .zip(own)
            .map(|(s, v)| s * v)
            .sum()
    }

    /// The name of a form.
    pub fn form_name(&self, form: usize, design: &Design) -> String {
        match self.forms[form] {
            FormOf::Slide(axis) => SLIDE[axis].to_owned(),
            FormOf::Side(side) => super::determined::side_name(design.sides()[side]),
        }
    }
}

/// What moves the artefact across the line of each indicator.
fn across(design: &Design, determined: &Determined) -> Vec<Across> {
    let names = |a: &super::Analysis| -> Vec<String> {
        let own = a.pivots().iter();
        own.map(|j| a.unknowns()[*j].clone()).collect()
    };
    let (slopes, constants) = (names(&determined.slopes), names(&determined.constants));
    let one = |channel: &DesignChannel| {
        let t = |angle: f64| {
            let [cos, sin] = direction(angle);
            [-sin, cos]
        };
        let (of_slide, of_artefact) = (t(channel.indicator), t(channel.side()));
        let turns = |name: &str| match name {
            "gamma_1" | "e_1" => of_artefact[0],
            "gamma_2" | "e_2" => of_artefact[1],
            _ => 0.0,
        };
        let moves = |name: &str| match name {
            "alpha_h" => of_slide[0],
            "alpha_v" => of_slide[1],
            other => turns(other),
        };
        Across {
            slopes: slopes.iter().map(|n| moves(n)).collect(),
            artefact: slopes.iter().map(|n| turns(n)).collect(),
            constants: constants.iter().map(|n| turns(n)).collect(),
        }
    };
    design.channels().iter().map(one).collect()
}

/// A slope common to the channels of a position of the spindle against that of all others: by name and
/// channel. One where there are two positions.
fn positions(design: &Design) -> Vec<(String, Vec<f64>)> {
    let positions = design.positions();
    let count = match positions.len() {
        0 | 1 => 0,
        2 => 1,
        n => n,
    };
    (0..count)
        .map(|p| {
            let others = -1.0 / (positions.len() - 1) as f64;
            let sign = |spindle: f64| {
                if is_same(spindle, positions[p]) {
                    1.0
                } else {
                    others
                }
            };
            let signs = design.channels().iter().map(|c| sign(c.spindle)).collect();
            (format!("beta_{}", angle_name(positions[p])), signs)
        })
        .collect()
}
