//! The figures of ISO 230-2:2014 and of VDI/DGQ 3441, from means and standard deviations.

use super::readings::{Deviations, Direction, mean};

/// Mean and standard deviation at every target, by direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Means x̄_i of each direction that is there.
    pub mean: [Option<Vec<f64>>; 2],
    /// Standard deviations s_i (n − 1) of each direction; none with one run.
    pub std: [Option<Vec<f64>>; 2],
}

impl Profile {
    /// Mean and standard deviation of every target and direction, of the readings that are there.
    #[must_use]
    pub fn of(deviations: &Deviations) -> Self {
        Self::above(deviations, &[])
    }

    /// The same, means of readings less the height of their run (0 where none is given).
    pub(super) fn above(deviations: &Deviations, heights: &[f64]) -> Self {
        let mut profile = Self {
            mean: [None, None],
            std: [None, None],
        };
        let freed = |row: &Vec<Option<f64>>| {
            let own: Vec<Option<f64>> = row
                .iter()
                .enumerate()
                .map(|(run, x)| Some((*x)? - heights.get(run).copied().unwrap_or_default()))
                .collect();
            mean(&own)
        };
        for (direction, rows) in deviations.directions() {
            if deviations.runs > 1 {
                let std = rows.iter().map(|row| standard_deviation(row));
                profile.std[direction.index()] = Some(std.collect());
            }
            profile.mean[direction.index()] = Some(rows.iter().map(freed).collect());
        }
        profile
    }

    /// Means of a direction.
    #[must_use]
    pub fn means(&self, direction: Direction) -> Option<&[f64]> {
        self.mean[direction.index()].as_deref()
    }

    /// Standard deviations of a direction.
    #[must_use]
    pub fn stds(&self, direction: Direction) -> Option<&[f64]> {
        self.std[direction.index()].as_deref()
    }

    /// B_i, forward less backward mean, at every target.
    #[must_use]
    pub fn reversals(&self) -> Option<Vec<f64>> {
        let [Some(forward), Some(backward)] = &self.mean else {
            return None;
        };
        Some(forward.iter().zip(backward).map(|(f, b)| f - b).collect())
    }

    /// x̄_i, the mean of both directions, at every target.
    #[must_use]
    pub fn bidirectional_means(&self) -> Option<Vec<f64>> {
        let [Some(forward), Some(backward)] = &self.mean else {
            return None;
        };
        Some(
            forward
                .iter()
                .zip(backward)
                .map(|(f, b)| 0.5 * (f + b))
                .collect(),
        )
    }

    /// R_i, the bidirectional repeatability at every target:
    /// the greatest of 2 s_i↑ + 2 s_i↓ + |B_i|, 4 s_i↑ and 4 s_i↓.
    #[must_use]
    pub fn repeatabilities(&self) -> Option<Vec<f64>> {
        let [Some(forward), Some(backward)] = &self.std else {
            return None;
        };
        let reversals = self.reversals()?;
        let at = |((f, b), reversal): ((&f64, &f64), &f64)| {
            (2.0 * (f + b) + reversal.abs()).max(4.0 * f.max(*b))
        };
        Some(
            forward
                .iter()
                .zip(backward)
                .zip(&reversals)
                .map(at)
                .collect(),
        )
    }
}

fn standard_deviation(row: &[Option<f64>]) -> f64 {
    let mean = mean(row);
    let squares: f64 = row.iter().flatten().map(|v| (v - mean).powi(2)).sum();
    (squares / (row.iter().flatten().count().max(2) - 1) as f64).sqrt()
}

/// A figure of one of the standards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Figure {
    /// A, bidirectional accuracy of positioning.
    A,
    /// A↑, unidirectional.
    AForward,
    /// A↓, unidirectional.
    ABackward,
    /// E, bidirectional systematic error of positioning.
    E,
    /// E↑, unidirectional.
    EForward,
    /// E↓, unidirectional.
    EBackward,
    /// M, mean bidirectional error of positioning.
    M,
    /// R, bidirectional repeatability of positioning.
    R,
    /// R↑, unidirectional.
    RForward,
    /// R↓, unidirectional.
    RBackward,
    /// B, reversal error: the greatest |B_i|.
    B,
    /// B̄, mean reversal error, with its sign.
    BMean,
    /// P, positioning uncertainty of VDI 3441.
    P,
    /// Ps, positional scatter: the greatest 6 s̄_i.
    Ps,
    /// Pa, positional deviation: the range of the means x̄_i.
    Pa,
    /// U, reversal range: the greatest |B_i|.
    U,
    /// Mean of 6 s̄_i over the targets.
    PsMean,
    /// Mean of |B_i| over the targets.
    UMean,
}

impl Figure {
    /// Those of ISO 230-2.
    pub const ISO: [Self; 12] = [
        Self::A,
        Self::AForward,
        Self::ABackward,
        Self::E,
        Self::EForward,
        Self::EBackward,
        Self::M,
        Self::R,
        Self::RForward,
        Self::RBackward,
        Self::B,
        Self::BMean,
    ];
    /// Those of VDI 3441.
    pub const VDI: [Self; 6] = [
        Self::P,
        Self::Ps,
        Self::PsMean,
        Self::Pa,
        Self::U,
        Self::UMean,
    ];
    /// How many there are.
    pub const COUNT: usize = Self::ISO.len() + Self::VDI.len();

    /// All, those of ISO 230-2 first.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::ISO.into_iter().chain(Self::VDI)
    }

    /// Its name in files.
    pub const fn key(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::AForward => "A_forward",
            Self::ABackward => "A_backward",
            Self::E => "E",
            Self::EForward => "E_forward",
            Self::EBackward => "E_backward",
            Self::M => "M",
            Self::R => "R",
            Self::RForward => "R_forward",
            Self::RBackward => "R_backward",
            Self::B => "B",
            Self::BMean => "B_mean",
            Self::P => "P",
            Self::Ps => "Ps",
            Self::Pa => "Pa",
            Self::U => "U",
            Self::PsMean => "Ps_mean",
            Self::UMean => "U_mean",
        }
    }

    /// Its sign and what it is, for people.
    pub const fn in_words(self) -> (&'static str, &'static str) {
        match self {
            Self::A => ("A", "bidirectional accuracy"),
            Self::AForward => ("A↑", "unidirectional accuracy, forward"),
            Self::ABackward => ("A↓", "unidirectional accuracy, backward"),
            Self::E => ("E", "bidirectional systematic error"),
            Self::EForward => ("E↑", "unidirectional systematic error, forward"),
            Self::EBackward => ("E↓", "unidirectional systematic error, backward"),
            Self::M => ("M", "mean bidirectional error"),
            Self::R => ("R", "bidirectional repeatability"),
            Self::RForward => ("R↑", "unidirectional repeatability, forward"),
            Self::RBackward => ("R↓", "unidirectional repeatability, backward"),
            Self::B => ("B", "reversal error"),
            Self::BMean => ("B̄", "mean reversal error"),
            Self::P => ("P", "positioning uncertainty"),
            Self::Ps => ("Ps", "positional scatter, greatest"),
            Self::Pa => ("Pa", "positional deviation"),
            Self::U => ("U", "reversal range, greatest"),
            Self::PsMean => ("P̄s", "positional scatter, mean"),
            Self::UMean => ("Ū", "reversal range, mean"),
        }
    }

    /// Whether it rests on the standard deviations.
    pub const fn rests_on_scatter(self) -> bool {
        matches!(
            self,
            Self::A
                | Self::AForward
                | Self::ABackward
                | Self::R
                | Self::RForward
                | Self::RBackward
                | Self::P
                | Self::Ps
                | Self::PsMean
        )
    }

    const fn index(self) -> usize {
        self as usize
    }
}

/// The figures that a profile tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FigureValues([Option<f64>; Figure::COUNT]);

impl FigureValues {
    /// Every figure that the profile tells: those of one direction need that one, those with
    /// scatter need two runs or more.
    #[must_use]
    pub fn of(profile: &Profile) -> Self {
        let targets = profile.mean.iter().flatten().map(Vec::len).max();
        let there = |list: &[Option<Vec<f64>>; 2], figure: Figure| {
            figure
                .directions()
                .iter()
                .all(|d| list[d.index()].is_some())
        };
        let at = |list: &[Option<Vec<f64>>; 2], d: Direction, i: usize| {
            let row = list[d.index()].as_ref();
            row.and_then(|row| row.get(i)).copied().unwrap_or_default()
        };
        let mut values = Self([None; Figure::COUNT]);
        for figure in Figure::all() {
            let told = there(&profile.mean, figure)
                && (!figure.rests_on_scatter() || there(&profile.std, figure));
            if let Some(targets) = targets.filter(|_| told) {
                values.0[figure.index()] = Some(figure.value(
                    targets,
                    |d, i| at(&profile.mean, d, i),
                    |d, i| at(&profile.std, d, i),
                ));
            }
        }
        values
    }

    /// A figure, where it was told.
    #[must_use]
    pub fn get(&self, figure: Figure) -> Option<f64> {
        self.0[figure.index()]
    }

    /// The figures that were told.
    pub fn iter(&self) -> impl Iterator<Item = (Figure, f64)> + '_ {
        Figure::all().filter_map(|f| Some((f, self.get(f)?)))
    }
}

impl Figure {
    /// The directions it needs.
    pub const fn directions(self) -> &'static [Direction] {
        match self {
            Self::AForward | Self::EForward | Self::RForward => &[Direction::Forward],
            Self::ABackward | Self::EBackward | Self::RBackward => &[Direction::Backward],
            _ => &Direction::ALL,
        }
    }

    /// Its value from the mean and the standard deviation of each direction and target.
    pub(super) fn value(
        self,
        targets: usize,
        mean: impl Fn(Direction, usize) -> f64,
        std: impl Fn(Direction, usize) -> f64,
    ) -> f64 {
        use Direction::{Backward, Forward};
        let reversal = |i| mean(Forward, i) - mean(Backward, i);
        let middle = |i| 0.5 * (mean(Forward, i) + mean(Backward, i));
        let scatter = |i| 0.5 * (std(Forward, i) + std(Backward, i));
        let greatest =
            |of: &dyn Fn(usize) -> f64| (0..targets).map(of).fold(f64::NEG_INFINITY, f64::max);
        let average =
            |of: &dyn Fn(usize) -> f64| (0..targets).map(of).sum::<f64>() / targets as f64;
        // From the lowest to the highest end of the means with so many standard deviations.
        let range = |factor: f64| {
            let ends = self
                .directions()
                .iter()
                .flat_map(|d| (0..targets).map(|i| (*d, i)));
            let (low, high) =
                ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (d, i)| {
                    let (m, half) = (
                        mean(d, i),
                        if factor > 0.0 {
                            factor * std(d, i)
                        } else {
                            0.0
                        },
                    );
                    (low.min(m - half), high.max(m + half))
                });
            high - low
        };
        match self {
            Self::A | Self::AForward | Self::ABackward => range(2.0),
            Self::E | Self::EForward | Self::EBackward => range(0.0),
            Self::M | Self::Pa => greatest(&middle) + greatest(&|i| -middle(i)),
            Self::RForward => 4.0 * greatest(&|i| std(Forward, i)),
            Self::RBackward => 4.0 * greatest(&|i| std(Backward, i)),
            Self::R => greatest(&|i| {
                let (f, b) = (std(Forward, i), std(Backward, i));
                (2.0 * (f + b) + reversal(i).abs()).max(4.0 * f.max(b))
            }),
            Self::B | Self::U => greatest(&|i| reversal(i).abs()),
            Self::BMean => average(&reversal),
            Self::UMean => average(&|i| reversal(i).abs()),
            Self::Ps => 6.0 * greatest(&scatter),
            Self::PsMean => 6.0 * average(&scatter),
            Self::P => {
                let half = |i| 0.5 * reversal(i).abs() + 3.0 * scatter(i);
                greatest(&|i| middle(i) + half(i)) + greatest(&|i| half(i) - middle(i))
            }
        }
    }
}
