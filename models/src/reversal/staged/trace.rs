//! One trace a channel: the mean reading at each position over repeats and directions.

use crate::reversal::channel_noise::survey::Survey;
use crate::reversal::simultaneous::ChannelReadings;
use crate::reversal::{Channel, Direction, Observations, Rounding};

/// The mean readings of a channel at its positions, in growing order of position.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Which channel.
    pub channel: Channel,
    /// Positions, mm, growing.
    pub x: Vec<f64>,
    /// Mean reading at each position, µm.
    pub mean: Vec<f64>,
    /// Readings behind each mean.
    pub count: Vec<f64>,
    /// Sum of squares of the readings about the mean of their position and direction, µm².
    pub scatter: f64,
    /// Degrees of freedom of `scatter`.
    pub scatter_freedom: usize,
    /// Mean of backward minus forward where both were read, µm: the reversal error of the slide and
    /// the indicator together.
    pub direction_difference: Option<f64>,
}

/// Two positions closer than this share of the range are the same place.
const SAME_PLACE: f64 = 1e-9;

impl Trace {
    /// The traces of all channels that were read, repeats of one direction brought to their common height before; and the
    /// greatest height, µm, where that changes forms.
    pub fn all(observations: &Observations) -> (Vec<Self>, Option<f64>) {
        let channels = ChannelReadings::sort(observations);
        let survey = Survey::new(&channels, |i| observations.taken(i));
        let Some(level) = survey.levelled() else {
            let of = channels
                .iter()
                .filter_map(|c| Self::of(observations, c.channel));
            return (of.collect(), None);
        };
        let mut brought = observations.clone();
        for (channel, values) in channels.iter().zip(level.values) {
            for (i, value) in channel.source.iter().zip(values) {
                brought.readings[*i as usize].value = value;
            }
        }
        let of = |(channel, heights): (&ChannelReadings, usize)| {
            let mut trace = Self::of(&brought, channel.channel)?;
            trace.scatter_freedom = trace.scatter_freedom.saturating_sub(heights);
            if level.by_pass {
                let read = Self::of(observations, channel.channel)?;
                trace.direction_difference = read.direction_difference;
            }
            Some(trace)
        };
        let greatest = level.matters.then_some(level.greatest);
        let traces = channels.iter().zip(level.heights).filter_map(of);
        (traces.collect(), greatest)
    }

    /// The trace of one channel, or `None` where it has no reading.
    pub fn of(observations: &Observations, channel: Channel) -> Option<Self> {
        let mut readings = observations
            .of(channel)
            .map(|r| (r.x, r.direction, r.value))
            .collect::<Vec<_>>();
        readings.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let range = readings.last()?.0 - readings.first()?.0;
        let mut trace = Self {
            channel,
            x: Vec::new(),
            mean: Vec::new(),
            count: Vec::new(),
            scatter: 0.0,
            scatter_freedom: 0,
            direction_difference: None,
        };
        let (mut differences, mut both) = (0.0, 0.0);
        for place in readings.chunk_by(|a, b| b.0 - a.0 <= SAME_PLACE * range) {
            let of = |direction| {
                let mut cell = Cell::default();
                place
                    .iter()
                    .filter(|r| r.1 == direction)
                    .for_each(|r| cell.add(r.2));
                cell
            };
            let (forward, backward) = (of(Direction::Forward), of(Direction::Backward));
            let n = place.len() as f64;
            trace.x.push(place.iter().map(|r| r.0).sum::<f64>() / n);
            trace
                .mean
                .push((forward.n * forward.mean + backward.n * backward.mean) / n);
            trace.count.push(n);
            for cell in [&forward, &backward].into_iter().filter(|c| c.n > 0.0) {
                trace.scatter += cell.squares;
                trace.scatter_freedom += cell.n as usize - 1;
            }
            if forward.n > 0.0 && backward.n > 0.0 {
                differences += backward.mean - forward.mean;
                both += 1.0;
            }
        }
        if both > 0.0 {
            trace.direction_difference = Some(differences / both);
        }
        Some(trace)
    }

    /// First and last position, mm.
    pub fn range(&self) -> (f64, f64) {
        match (self.x.first(), self.x.last()) {
            (Some(&first), Some(&last)) => (first, last),
            _ => (0.0, 0.0),
        }
    }
}

/// How readings were rounded where that is more coarsely than they scatter: of the channel of which repeats have most of it in
/// common.
pub(super) fn rounding(observations: &Observations) -> Option<Rounding> {
    let channels = ChannelReadings::sort(observations);
    let survey = Survey::new(&channels, |i| observations.taken(i));
    let all = survey.rounding().into_iter().flatten();
    all.max_by(|a, b| a.std().total_cmp(&b.std()))
}

/// Running mean and sum of squares about it (Welford).
#[derive(Default)]
struct Cell {
    n: f64,
    mean: f64,
    squares: f64,
}

impl Cell {
    fn add(&mut self, value: f64) {
        self.n += 1.0;
        let before = value - self.mean;
        self.mean += before / self.n;
        self.squares += before * (value - self.mean);
    }
}
