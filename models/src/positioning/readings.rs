//! The readings of a test, brought into the order of the standard: targets, directions, runs.

use std::collections::{BTreeMap, BTreeSet};

/// The direction from which a target is approached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Direction {
    /// Towards greater positions (↑).
    Forward,
    /// Towards smaller positions (↓).
    Backward,
}

impl Direction {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Forward, Self::Backward];

    /// Its name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Backward => "backward",
        }
    }

    /// The direction of a name in a file.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|d| d.name() == name)
    }

    /// Its place in pairs.
    pub const fn index(self) -> usize {
        match self {
            Self::Forward => 0,
            Self::Backward => 1,
        }
    }
}

/// One reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Target position, mm or degrees.
    pub target: f64,
    /// Number of the run, from 1.
    pub run: u32,
    /// Direction of approach.
    pub direction: Direction,
    /// Actual less target position, µm or seconds of arc.
    pub deviation: f64,
    /// Seconds since the first reading, where they are known.
    pub time: Option<f64>,
}

/// Why readings are not those of a whole test.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PositioningError {
    /// No reading.
    #[error("there is no reading")]
    Empty,
    /// A number that is not finite.
    #[error("a reading is not finite")]
    NotFinite {
        /// Place of the reading.
        reading: usize,
    },
    /// Numbers whose differences or squares overflow.
    #[error("the numbers are too large to be calculated with")]
    TooLarge,
    /// The same target, direction and run twice.
    #[error(
        "target {target} {} has run {run} twice", direction.name()
    )]
    Duplicate {
        /// Place of the second reading.
        reading: usize,
        /// Place of the first.
        first: usize,
        /// The target.
        target: f64,
        /// The direction.
        direction: Direction,
        /// The run.
        run: u32,
    },
    /// One target alone.
    #[error("there is one target alone, {target}")]
    OneTarget {
        /// The target.
        target: f64,
    },
    /// A target approached from one side, where others are approached from both.
    #[error(
        "target {target} has no {} reading, others have", direction.name()
    )]
    MissingDirection {
        /// The target.
        target: f64,
        /// What it lacks.
        direction: Direction,
        /// Place of a reading of the target.
        reading: usize,
    },
    /// A target with one reading in a direction, where others have more.
    #[error(
        "target {target} has one {} reading, of run {run}, others have up to {runs}: one tells no standard deviation",
        direction.name()
    )]
    OneReading {
        /// The target.
        target: f64,
        /// The direction.
        direction: Direction,
        /// The run of its reading.
        run: u32,
        /// Readings that others have at most.
        runs: usize,
        /// Place of the reading.
        reading: usize,
    },
    /// Runs of which no target and direction leads to the others.
    #[error("run {run} has no target in common with run {other}, nor has any run between the two")]
    Apart {
        /// A run.
        run: u32,
        /// The first run.
        other: u32,
        /// Place of a reading of `run`.
        reading: usize,
    },
}

impl PositioningError {
    /// Place of the reading that the error is about.
    pub const fn reading(&self) -> Option<usize> {
        match self {
            Self::NotFinite { reading }
            | Self::Duplicate { reading, .. }
            | Self::MissingDirection { reading, .. }
            | Self::OneReading { reading, .. }
            | Self::Apart { reading, .. } => Some(*reading),
            Self::Empty | Self::TooLarge | Self::OneTarget { .. } => None,
        }
    }
}

/// Deviations x_ij of one direction: a row a target, in it a value a run, none where the reading is missing.
pub type Targets = Vec<Vec<Option<f64>>>;

/// A reading that is missing: others have that run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missing {
    /// Its target, mm or degrees.
    pub target: f64,
    /// Its direction.
    pub direction: Direction,
    /// Its run.
    pub run: u32,
}

/// The deviations of a whole test: every target approached in the same directions; at each two readings or
/// more, or one everywhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviations {
    /// Targets in ascending order, mm or degrees; two or more.
    pub targets: Vec<f64>,
    /// Runs of the test; of a target and direction as many, or less what is missing there.
    pub runs: usize,
    /// By direction; at least one is there.
    pub by_direction: [Option<Targets>; 2],
    /// Readings that are missing, by direction and target.
    pub missing: Vec<Missing>,
}

impl Deviations {
    /// Sorts readings by target, direction and run.
    ///
    /// # Errors
    /// [`PositioningError`]: readings that are not finite or given twice, a target that lacks a direction or has one
    /// reading in it where others have more, runs that cannot be compared.
    pub fn new(readings: &[Reading]) -> Result<Self, PositioningError> {
        let cells = sorted(readings)?;
        let mut targets: Vec<f64> = cells.keys().map(|k| k.target()).collect();
        targets.dedup();
        match targets[..] {
            [] => return Err(PositioningError::Empty),
            [target] => return Err(PositioningError::OneTarget { target }),
            _ => {}
        }
        let there =
            Direction::ALL.map(|direction| cells.keys().any(|key| key.direction == direction));
        let runs: BTreeSet<u32> = cells
            .values()
            .flat_map(|runs| runs.keys().copied())
            .collect();
        let mut by_direction = [None, None];
        let mut missing = Vec::new();
        for direction in Direction::ALL.into_iter().filter(|d| there[d.index()]) {
            let rows = targets
                .iter()
                .map(|&target| {
                    let own = cell(&cells, target, direction)?;
                    if let (Some((&run, &reading)), true) =
                        (own.iter().next(), own.len() < 2.min(runs.len()))
                    {
                        let runs = cells.values().map(BTreeMap::len).max().unwrap_or_default();
                        return Err(PositioningError::OneReading {
                            target,
                            direction,
                            run,
                            runs,
                            reading,
                        });
                    }
                    let row = runs.iter().map(|run| {
                        let reading = own.get(run).and_then(|place| readings.get(*place));
                        if reading.is_none() {
                            missing.push(Missing {
                                target,
                                direction,
                                run: *run,
                            });
                        }
                        reading.map(|r| r.deviation)
                    });
                    Ok(row.collect())
                })
                .collect::<Result<Targets, _>>()?;
            by_direction[direction.index()] = Some(rows);
        }
        if !missing.is_empty() {
            joined(&cells, &runs)?;
        }
        Ok(Self {
            targets,
            runs: runs.len(),
            by_direction,
            missing,
        })
    }

    /// Whether every target was approached from both sides.
    #[must_use]
    pub fn is_bidirectional(&self) -> bool {
        self.by_direction.iter().all(Option::is_some)
    }

    /// The rows of each direction that is there.
    pub fn directions(&self) -> impl Iterator<Item = (Direction, &Targets)> {
        Direction::ALL
            .into_iter()
            .filter_map(|d| Some((d, self.by_direction[d.index()].as_ref()?)))
    }

    /// The readings of each target and direction.
    pub(super) fn rows(&self) -> impl Iterator<Item = &[Option<f64>]> + Clone {
        let rows = self.by_direction.iter().flatten();
        rows.flatten().map(Vec::as_slice)
    }

    /// From the first to the last target.
    #[must_use]
    pub fn length(&self) -> f64 {
        match (self.targets.first(), self.targets.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }
}

/// A target and a direction, in the order of the targets. Adding zero makes one zero of both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Cell {
    order: i64,
    direction: Direction,
}

impl Cell {
    fn new(target: f64, direction: Direction) -> Self {
        let bits = (target + 0.0).to_bits() as i64;
        // The order of floating-point numbers in that of whole ones.
        let order = bits ^ (((bits >> 63) as u64) >> 1) as i64;
        Self { order, direction }
    }

    fn target(self) -> f64 {
        let bits = self.order ^ (((self.order >> 63) as u64) >> 1) as i64;
        f64::from_bits(bits as u64)
    }
}

type Cells = BTreeMap<Cell, BTreeMap<u32, usize>>;

fn sorted(readings: &[Reading]) -> Result<Cells, PositioningError> {
    let mut cells = Cells::new();
    for (place, reading) in readings.iter().enumerate() {
        let finite = [Some(reading.target), Some(reading.deviation), reading.time];
        if finite.into_iter().flatten().any(|v| !v.is_finite()) {
            return Err(PositioningError::NotFinite { reading: place });
        }
        let runs = cells
            .entry(Cell::new(reading.target, reading.direction))
            .or_default();
        if let Some(first) = runs.insert(reading.run, place) {
            return Err(PositioningError::Duplicate {
                reading: place,
                first,
                target: reading.target,
                direction: reading.direction,
                run: reading.run,
            });
        }
    }
    Ok(cells)
}

fn cell(
    cells: &Cells,
    target: f64,
    direction: Direction,
) -> Result<&BTreeMap<u32, usize>, PositioningError> {
    let of = |direction| cells.get(&Cell::new(target, direction));
    of(direction).ok_or_else(|| {
        let any = Direction::ALL.into_iter().find_map(of);
        let reading = any.and_then(|runs| runs.values().next()).copied();
        PositioningError::MissingDirection {
            target,
            direction,
            reading: reading.unwrap_or_default(),
        }
    })
}

/// Checks that runs can be compared: from each run targets that share two runs lead to every other.
fn joined(cells: &Cells, runs: &BTreeSet<u32>) -> Result<(), PositioningError> {
    let Some(other) = runs.first().copied() else {
        return Ok(());
    };
    let mut reached = BTreeSet::from([other]);
    loop {
        let before = reached.len();
        for own in cells.values() {
            if own.keys().any(|run| reached.contains(run)) {
                reached.extend(own.keys());
            }
        }
        if reached.len() == before {
            break;
        }
    }
    match runs.difference(&reached).next() {
        None => Ok(()),
        Some(run) => Err(PositioningError::Apart {
            run: *run,
            other,
            reading: cells
                .values()
                .find_map(|own| own.get(run))
                .copied()
                .unwrap_or_default(),
        }),
    }
}

/// Mean of the readings of one target and direction that are there.
pub(super) fn mean(row: &[Option<f64>]) -> f64 {
    let there = row.iter().flatten();
    there.clone().sum::<f64>() / there.count().max(1) as f64
}
