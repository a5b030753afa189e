//! The channels as the diagnosis sees them: their angles, what they have in common, the forms they see.

use nalgebra::{DMatrix, DVector};

use crate::model::Pattern;
use crate::reversal::designs::{
    Analysis, Design, DesignChannel, Determined, SAME_ANGLE_DEG, Zero, angle_name, direction,
};
use crate::reversal::{Channel, Convention};

/// One channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Seat {
    /// Its name.
    pub name: String,
    /// Which of the indicators.
    pub indicator: usize,
    /// Which of the positions of the spindle.
    pub position: usize,
    /// Which of the sides of the artefact.
    pub side: usize,
    /// Cosine and sine of the indicator's angle: how M_h, M_v, α_h and α_v enter.
    pub phi: [f64; 2],
    /// Of the spindle's angle.
    pub theta: [f64; 2],
    /// Of the side's: how γ enters.
    pub psi: [f64; 2],
    /// Of twice the side's: how κ enters.
    pub oval: [f64; 2],
}

/// All channels with readings.
#[derive(Debug, Clone)]
pub struct Arrangement {
    design: Design,
    zero: Zero,
    /// How slopes are read, where the channels are told as 1A, 1B, 2A, 2B.
    four: Option<Convention>,
    seats: Vec<Seat>,
    indicators: Vec<f64>,
    positions: Vec<f64>,
    determined: Determined,
    /// Names of the forms: those of the slide first, then a form a side.
    forms: Vec<String>,
    /// By channel: the forms of the slide that it sees, with their factors.
    slides: Vec<Vec<(usize, f64)>>,
    /// By channel: the form of its side.
    side_form: Vec<usize>,
    /// Forms × channels: the least-squares solution at a position.
    weights: DMatrix<f64>,
}

/// Names of the forms of the four channels.
const FORMS_OF_FOUR: [&str; 3] = ["M", "S_A", "S_B"];

impl Arrangement {
    /// The channels of a design; `four`: how the slopes of 1A, 1B, 2A, 2B are read, where all are such.
    pub(in crate::reversal) fn new(design: Design, zero: Zero, four: Option<Convention>) -> Self {
        let (indicators, positions) = (design.indicators(), design.positions());
        let determined = Determined::of(&design, zero);
        let seats: Vec<Seat> = (design.channels().iter().enumerate())
            .map(|(c, channel)| Seat {
                name: channel.name.clone(),
                indicator: nearest(&indicators, channel.indicator),
                position: nearest(&positions, channel.spindle),
                side: design.side_of(c),
                phi: direction(channel.indicator),
                theta: direction(channel.spindle),
                psi: direction(channel.side()),
                oval: direction(2.0 * channel.side()),
            })
            .collect();
        let own = match four {
            Some(_) => Seen::of_four(&seats),
            None => Seen::new(&design, &determined.forms),
        };
        Self {
            design,
            zero,
            four,
            seats,
            indicators,
            positions,
            determined,
            forms: own.forms,
            slides: own.slides,
            side_form: own.side_form,
            weights: own.weights,
        }
    }

    /// The channels.
    pub fn seats(&self) -> &[Seat] {
        &self.seats
    }

    /// The design.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// What becomes of the indicators' zeros.
    pub fn zero(&self) -> Zero {
        self.zero
    }

    /// What the channels determine.
    pub fn determined(&self) -> &Determined {
        &self.determined
    }

    /// Whether the channels are told as 1A, 1B, 2A, 2B.
    pub fn is_four(&self) -> bool {
        self.four.is_some()
    }

    /// Whether β is a slope that is fitted, in place of the cone.
    pub(super) fn has_beta(&self) -> bool {
        self.four == Some(Convention::Seed)
    }

    /// Directions of the indicators, growing, degrees.
    pub fn indicators(&self) -> &[f64] {
        &self.indicators
    }

    /// Positions of the spindle, growing, degrees.
    pub fn positions(&self) -> &[f64] {
        &self.positions
    }

    /// An indicator in words.
    pub fn indicator_name(&self, indicator: usize) -> String {
        indicator_name(self.indicators[indicator])
    }

    /// Names of the forms.
    pub(super) fn form_names(&self) -> &[String] {
        &self.forms
    }

    /// The forms of the slide that a channel sees, with their factors.
    pub(super) fn slides(&self, channel: usize) -> &[(usize, f64)] {
        &self.slides[channel]
    }

    /// The form of the side that a channel sees.
    pub(super) fn side_form(&self, channel: usize) -> usize {
        self.side_form[channel]
    }

    /// Standard deviation of a form per unit of that of the mean of a channel's readings.
    pub(super) fn noise_gain(&self, form: usize) -> f64 {
        if self.is_four() {
            return if form == 0 { 0.5 } else { 0.5f64.sqrt() };
        }
        self.weights.row(form).norm()
    }

    /// The forms from what the lines of the channels leave of their profiles; `None` for a channel
    /// without any. Of four channels with fewer the part that they show; of other designs nothing.
    pub(super) fn forms(
        &self,
        residual: &[Option<DVector<f64>>],
        n: usize,
    ) -> Option<Vec<DVector<f64>>> {
        if self.is_four() {
            let mut by_channel = [const { None }; 4];
            for (seat, own) in self.seats.iter().zip(residual) {
                if let Some(channel) = Channel::from_name(&seat.name) {
                    by_channel[channel.index()] = own.clone();
                }
            }
            return Some(forms_of_four(&by_channel, n).to_vec());
        }
        let all: Option<Vec<&DVector<f64>>> = residual.iter().map(Option::as_ref).collect();
        let all = all?;
        let form = |row: usize| {
            let parts = all.iter().enumerate();
            parts.fold(DVector::zeros(n), |mut sum, (c, own)| {
                sum.axpy(self.weights[(row, c)], own, 1.0);
                sum
            })
        };
        Some((0..self.forms.len()).map(form).collect())
    }

    /// Patterns over the channels of the profiles that are free at every position, and which of them
    /// may hold no straight line: the slopes of a rigid artefact have the pattern of α, γ and cones
    /// alone, forms have one a side.
    pub(super) fn patterns(&self) -> (DMatrix<f64>, Vec<usize>) {
        let of = |value: &dyn Fn(&Seat) -> f64| {
            DVector::from_iterator(self.seats.len(), self.seats.iter().map(value))
        };
        if self.is_four() {
            let columns = [of(&|s| s.phi[0]), of(&|s| s.psi[0]), of(&|_| 1.0)];
            // M's line is α and the line of S_A − S_B is γ, so those two functions may hold one; that
            // of S_A + S_B is the cone, which only the rigid convention has.
            let withheld = if self.has_beta() { vec![2] } else { Vec::new() };
            return (DMatrix::from_columns(&columns), withheld);
        }
        let slopes = self.determined.slopes.matrix();
        let forms = self.determined.forms.matrix();
        let mut basis: Vec<DVector<f64>> = Vec::new();
        let mut withheld = Vec::new();
        let lines = slopes.column_iter().map(|c| (c, false));
        for (column, bent) in lines.chain(forms.column_iter().map(|c| (c, true))) {
            let mut rest = column.clone_owned();
            for _ in 0..2 {
                for known in &basis {
                    let along = known.dot(&rest);
                    rest.axpy(-along, known, 1.0);
                }
            }
            let left = rest.norm();
            if left > LEAST_LEFT * column.norm() {
                if bent {
                    withheld.push(basis.len());
                }
                basis.push(rest / left);
            }
        }
        (DMatrix::from_columns(&basis), withheld)
    }

    /// Combinations of the channels that are zero whatever the forms are.
    pub(super) fn closures(&self) -> impl Iterator<Item = Pattern> {
        let closures = self.determined.forms.closures().into_iter();
        closures.enumerate().map(|(k, weights)| Pattern {
            name: format!("closure {}", k + 1),
            weights,
        })
    }

    /// What the constants of the channels are sums of, one column each.
    pub(super) fn constants(&self) -> DMatrix<f64> {
        self.determined.constants.matrix().clone()
    }
}

/// A pattern counts as a sum of others where less than this share of it is left, as in
/// [`Determined`](crate::reversal::designs::Determined).
const LEAST_LEFT: f64 = 0.01;

/// The forms, who sees them, and how they follow from the channels.
struct Seen {
    forms: Vec<String>,
    slides: Vec<Vec<(usize, f64)>>,
    side_form: Vec<usize>,
    weights: DMatrix<f64>,
}

impl Seen {
    fn of_four(seats: &[Seat]) -> Self {
        Self {
            forms: FORMS_OF_FOUR.map(str::to_owned).to_vec(),
            slides: seats.iter().map(|s| vec![(0, s.phi[0])]).collect(),
            side_form: seats
                .iter()
                .map(|s| if s.psi[0] > 0.0 { 1 } else { 2 })
                .collect(),
            weights: DMatrix::zeros(0, 0),
        }
    }

    /// Sides come first among the unknowns of a design, so all their forms are fitted; those of the
    /// slide where they are no sum of them.
    fn new(design: &Design, analysis: &Analysis) -> Self {
        let sides = design.sides().len();
        let names = Determined::names(analysis);
        let slides: Vec<usize> = (sides..analysis.rank()).collect();
        let by_pivot = analysis.weights();
        let order: Vec<usize> = slides.iter().copied().chain(0..sides).collect();
        Self {
            forms: order.iter().map(|p| names[*p].clone()).collect(),
            slides: (0..design.channels().len())
                .map(|c| {
                    let factor = |p: usize| analysis.matrix()[(c, analysis.pivots()[p])];
                    let seen = slides.iter().enumerate().map(|(k, p)| (k, factor(*p)));
                    seen.filter(|(_, factor)| *factor != 0.0).collect()
                })
                .collect(),
            side_form: (0..design.channels().len())
                .map(|c| slides.len() + design.side_of(c))
                .collect(),
            weights: by_pivot.select_rows(&order),
        }
    }
}

/// M, `S_A` and `S_B` from the channels' residuals; with fewer channels the part that they show.
fn forms_of_four(residual: &[Option<DVector<f64>>; 4], n: usize) -> [DVector<f64>; 3] {
    let [a1, b1, a2, b2] = residual;
    let m = match (a1, b1, a2, b2) {
        (Some(a1), Some(b1), Some(a2), Some(b2)) => (a1 - b1 - a2 + b2) / 4.0,
        (Some(a1), _, Some(a2), _) => (a1 - a2) / 2.0,
        (_, Some(b1), _, Some(b2)) => (b2 - b1) / 2.0,
        _ => DVector::zeros(n),
    };
    // Two channels of a side see M with opposite signs, one alone has it still.
    let side = |plus: &Option<DVector<f64>>, minus: &Option<DVector<f64>>| match (plus, minus) {
        (Some(p), Some(q)) => (p + q) / 2.0,
        (Some(p), None) => p - &m,
        (None, Some(q)) => q + &m,
        (None, None) => DVector::zeros(n),
    };
    let (s_a, s_b) = (side(a1, a2), side(b2, b1));
    [m, s_a, s_b]
}

/// The design of some of the four channels; nothing without any.
pub(super) fn of_four(channels: &[Channel]) -> Option<Design> {
    Design::new(channels.iter().map(|c| DesignChannel::from(*c)).collect()).ok()
}

fn nearest(angles: &[f64], angle: f64) -> usize {
    let apart = |a: &f64| ((a - angle + 180.0).rem_euclid(360.0) - 180.0).abs();
    (0..angles.len())
        .min_by(|a, b| apart(&angles[*a]).total_cmp(&apart(&angles[*b])))
        .unwrap_or(0)
}

/// A direction of an indicator in words: near, top, far, bottom, or its angle.
pub fn indicator_name(angle: f64) -> String {
    const NAMED: [(f64, &str); 4] = [
        (0.0, "near"),
        (90.0, "top"),
        (180.0, "far"),
        (270.0, "bottom"),
    ];
    let is = |at: f64| ((angle - at + 180.0).rem_euclid(360.0) - 180.0).abs() <= SAME_ANGLE_DEG;
    let named = NAMED.iter().find(|(at, _)| is(*at));
    named.map_or_else(
        || format!("{}°", angle_name(angle)),
        |(_, name)| (*name).to_owned(),
    )
}

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::forms_of_four;

    /// Any three of the channels show all forms, as the four do.
    #[test]
    fn three_channels_show_the_forms() {
        let of = |values: [f64; 3]| DVector::from_row_slice(&values);
        let (m, s_a, s_b) = (
            of([1.0, -2.0, 1.0]),
            of([0.3, 0.0, -0.3]),
            of([-0.5, 1.0, -0.5]),
        );
        let all = [&s_a + &m, &s_b - &m, &s_a - &m, &s_b + &m];
        for missing in 0..4 {
            let read = [0, 1, 2, 3].map(|c| (c != missing).then(|| all[c].clone()));
            let found = forms_of_four(&read, 3);
            for (form, truth) in found.iter().zip([&m, &s_a, &s_b]) {
                // Rounding.
                assert!((form - truth).amax() < 1e-15, "{missing}: {form}");
            }
        }
    }
}
