//! What a design determines: forms at every position, slopes, constants.

use super::analysis::Analysis;
use super::channel::{Design, DesignChannel, angle_name, direction};
use super::words;

/// What becomes of the indicators' zeros between the traces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Zero {
    /// Set anew for each trace: a constant a channel.
    #[default]
    Reset,
    /// Kept: a constant an indicator, the eccentricity e·n(ψ) and o cos 2ψ.
    Kept,
}

/// A channel that, added to a design, determines an unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct Remedy {
    /// The channel.
    pub channel: DesignChannel,
    /// What to do, in words.
    pub words: String,
}

/// An unknown that a design does not determine by itself.
#[derive(Debug, Clone, PartialEq)]
pub struct NotDetermined {
    /// The unknown that is held at zero.
    pub held: String,
    /// The unknowns that change together without any reading changing, by how much.
    pub terms: Vec<(String, f64)>,
    /// The same in words, such as `M_h against S_0 + S_180`.
    pub combination: String,
    /// The cheapest channel that would determine it; `None` where no single one does.
    pub remedy: Option<Remedy>,
}

/// What a design determines.
#[derive(Debug, Clone, PartialEq)]
pub struct Determined {
    /// Forms at a position: sides by growing angle, then M_h and M_v.
    pub forms: Analysis,
    /// Slopes: γ_1, γ_2, τ, α_h, α_v, and κ_c and κ_s where they are determined.
    pub slopes: Analysis,
    /// Constants of the readings.
    pub constants: Analysis,
    /// What is not determined, forms first.
    pub not_determined: Vec<NotDetermined>,
    /// Unknowns that no indicator sees, such as `M_v` and `alpha_v` of a horizontal reversal.
    pub not_seen: Vec<String>,
}

/// Names of the forms of the slide.
pub const SLIDE: [&str; 2] = ["M_h", "M_v"];

/// Names of the slopes, in the order in which they are shown.
pub const SLOPES: [&str; 7] = [
    "alpha_h", "alpha_v", "gamma_1", "gamma_2", "cone", "kappa_c", "kappa_s",
];

/// The name of the form of a side.
pub fn side_name(side_deg: f64) -> String {
    format!("S_{}", angle_name(side_deg))
}

/// Forms at a position.
pub fn forms(design: &Design) -> Analysis {
    let mut columns: Vec<(String, Vec<f64>)> = design
        .sides()
        .iter()
        .enumerate()
        .map(|(s, angle)| {
            let seen = (0..design.channels().len())
                .map(|c| f64::from(u8::from(design.side_of(c) == s)))
                .collect();
            (side_name(*angle), seen)
        })
        .collect();
    for (axis, name) in SLIDE.into_iter().enumerate() {
        columns.push((
            name.to_owned(),
            of(design, |c| direction(c.indicator)[axis]),
        ));
    }
    Analysis::new(columns)
}

/// Slopes of the channels, with the first `ovals` of κ_c and κ_s.
pub fn slopes(design: &Design, ovals: usize) -> Analysis {
    let twice = |c: &DesignChannel, axis: usize| direction(2.0 * c.side())[axis];
    let columns = [
        ("gamma_1", of(design, |c| direction(c.side())[0])),
        ("gamma_2", of(design, |c| direction(c.side())[1])),
        ("cone", of(design, |_| 1.0)),
        ("alpha_h", of(design, |c| direction(c.indicator)[0])),
        ("alpha_v", of(design, |c| direction(c.indicator)[1])),
        ("kappa_c", of(design, |c| twice(c, 0))),
        ("kappa_s", of(design, |c| twice(c, 1))),
    ];
    let named = columns.into_iter().take(5 + ovals);
    Analysis::new(named.map(|(name, c)| (name.to_owned(), c)).collect())
}

/// Constants of the readings.
pub fn constants(design: &Design, zero: Zero) -> Analysis {
    let channels = design.channels();
    let columns = match zero {
        Zero::Reset => (0..channels.len())
            .map(|k| {
                let own = (0..channels.len()).map(|c| f64::from(u8::from(c == k)));
                (format!("constant of {}", channels[k].name), own.collect())
            })
            .collect(),
        Zero::Kept => {
            let mut columns: Vec<(String, Vec<f64>)> = design
                .indicators()
                .into_iter()
                .map(|angle| {
                    let own = |c: &DesignChannel| {
                        f64::from(u8::from(super::channel::is_same(c.indicator, angle)))
                    };
                    (format!("zero of {}", angle_name(angle)), of(design, own))
                })
                .collect();
            columns.push(("e_1".into(), of(design, |c| direction(c.side())[0])));
            columns.push(("e_2".into(), of(design, |c| direction(c.side())[1])));
            columns.push(("o".into(), of(design, |c| direction(2.0 * c.side())[0])));
            columns
        }
    };
    Analysis::new(columns)
}

fn of(design: &Design, value: impl Fn(&DesignChannel) -> f64) -> Vec<f64> {
    design.channels().iter().map(value).collect()
}

impl Determined {
    /// What a design determines, the oval cone among the slopes where it is.
    pub fn of(design: &Design, zero: Zero) -> Self {
        let forms = forms(design);
        let with_ovals = slopes(design, 2);
        // A column that is no sum of those before it takes nothing from what they determine.
        let undetermined: Vec<&str> = with_ovals
            .free()
            .iter()
            .map(|j| &with_ovals.unknowns()[*j][..])
            .filter(|name| name.starts_with("kappa"))
            .collect();
        let slopes = without(&with_ovals, &undetermined);
        let constants = constants(design, zero);
        let missing = Missing { design, zero };
        let mut not_determined = missing.of(&forms, &self::forms);
        not_determined.extend(missing.of(&with_ovals, &|d| self::slopes(d, 2)));
        not_determined.extend(missing.of(&constants, &|d| self::constants(d, zero)));
        let seen = |name: &&str| {
            let by = |a: &Analysis| a.unknowns().iter().any(|u| u == name);
            by(&forms) || by(&with_ovals)
        };
        let not_seen = SLIDE.iter().chain(&SLOPES).filter(|n| !seen(n));
        Self {
            not_seen: not_seen.map(|n| (*n).to_owned()).collect(),
            forms,
            slopes,
            constants,
            not_determined,
        }
    }

    /// What each fitted form, slope or constant stands for, in words: by itself or with others.
    pub fn names(analysis: &Analysis) -> Vec<String> {
        analysis
            .combinations()
            .iter()
            .map(|combination| words::sum(&shown(analysis, combination)))
            .collect()
    }
}

/// The same without columns that bring nothing.
fn without(analysis: &Analysis, names: &[&str]) -> Analysis {
    let matrix = analysis.matrix();
    let columns = analysis.unknowns().iter().enumerate();
    Analysis::new(
        columns
            .filter(|(_, name)| !names.contains(&&name[..]))
            .map(|(j, name)| (name.clone(), matrix.column(j).iter().copied().collect()))
            .collect(),
    )
}

/// Terms in the order in which they are shown: of the slide first, then of the artefact.
fn shown(analysis: &Analysis, vector: &[f64]) -> Vec<(String, f64)> {
    let mut terms: Vec<(usize, String, f64)> = analysis
        .unknowns()
        .iter()
        .zip(vector)
        .filter(|(_, v)| **v != 0.0)
        .map(|(name, v)| {
            let order = SLIDE.iter().chain(&SLOPES).position(|n| n == name);
            (order.unwrap_or(usize::MAX), name.clone(), *v)
        })
        .collect();
    terms.sort_by_key(|t| t.0);
    terms.into_iter().map(|(_, name, v)| (name, v)).collect()
}

/// Right angles, where indicators and spindles are set.
const USUAL: [f64; 4] = [0.0, 90.0, 180.0, 270.0];

/// Angles of the design's own beyond this many are not tried.
const MOST_TRIED: usize = 12;

struct Missing<'a> {
    design: &'a Design,
    zero: Zero,
}

impl Missing<'_> {
    /// What one of the analyses leaves open, with remedies.
    fn of(&self, analysis: &Analysis, again: &dyn Fn(&Design) -> Analysis) -> Vec<NotDetermined> {
        let sides: Vec<String> = self.design.sides().iter().map(|s| side_name(*s)).collect();
        let open = analysis.null_space();
        analysis
            .free()
            .iter()
            .zip(&open)
            .map(|(j, vector)| {
                let held = analysis.unknowns()[*j].clone();
                let terms = shown(analysis, vector);
                NotDetermined {
                    combination: words::against(&terms, &sides),
                    remedy: self.remedy(&held, again),
                    held,
                    terms,
                }
            })
            .collect()
    }

    /// The cheapest channel with which an unknown is determined by itself: a trace more without setting
    /// anything up; the spindle turned once more; an indicator more. Among those as cheap the one that
    /// leaves least open.
    fn remedy(&self, held: &str, again: &dyn Fn(&Design) -> Analysis) -> Option<Remedy> {
        let (indicators, positions) = (self.design.indicators(), self.design.positions());
        let has =
            |list: &[f64], angle: f64| list.iter().any(|a| super::channel::is_same(*a, angle));
        let mut best: Option<((u8, usize), DesignChannel)> = None;
        let tried = |own: &[f64]| -> Vec<f64> {
            let usual = USUAL.iter().filter(|a| !has(own, **a));
            let own = own.iter().take(MOST_TRIED);
            own.chain(usual).copied().collect()
        };
        let turned = tried(&positions);
        for phi in &tried(&indicators) {
            for theta in &turned {
                let Ok(channel) = DesignChannel::at(*phi, *theta) else {
                    continue;
                };
                let cost =
                    u8::from(!has(&positions, *theta)) + 2 * u8::from(!has(&indicators, *phi));
                if best.as_ref().is_some_and(|(b, _)| b.0 < cost) {
                    continue;
                }
                let Some(more) = self.design.with(channel.clone()) else {
                    continue;
                };
                if again(&more).alone(held).is_none() {
                    continue;
                }
                let open = forms(&more).free().len()
                    + slopes(&more, 0).free().len()
                    + match self.zero {
                        // Each channel has its own.
                        Zero::Reset => 0,
                        Zero::Kept => constants(&more, Zero::Kept).free().len(),
                    };
                if best.as_ref().is_none_or(|(b, _)| (cost, open) < *b) {
                    best = Some(((cost, open), channel));
                }
            }
        }
        best.map(|((cost, _), channel)| Remedy {
            words: format!(
                "add a trace with {} indicator at {}° and the spindle {} {}°",
                if cost >= 2 { "an" } else { "the" },
                angle_name(channel.indicator),
                if cost % 2 == 1 { "turned to" } else { "at" },
                angle_name(channel.spindle),
            ),
            channel,
        })
    }
}
