//! Rows of a fit with effects: every reading has its own place under slide and artefact.
//!
//! Without effects the readings of a channel run through the cells of the forms in the order of their
//! positions, and the rows of a run share all but their place in the cell. An effect moves single readings
//! into other cells and scales their rows; so each reading is placed once a point, and readings are sorted
//! into cells from there. The cost stays linear in readings.

use errsep_solvers::problem::NoValue;
use errsep_solvers::structured::Parameters;
use rayon::prelude::*;

use super::effects::Circumstances;
use super::joined::{Joined, PerMove};
use super::pointer::pushed;
use super::problem::Reversal;
use super::readings::ChannelReadings;
use super::unknowns::Form;
use crate::basis::bspline::{Cubic, CubicBSpline, horner, horner_slope};
use crate::reversal::forward::Attitude;
use crate::units::{UM_PER_MM, mm_from_um};

/// One reading at a point: where its probe touches, and what its row is made of.
#[derive(Debug, Clone, Copy, Default)]
pub struct Spot {
    /// Cell of the artefact's form, and place in it, 0 to 1.
    pub side: u32,
    pub(super) t_side: f64,
    /// The same of the slide's.
    pub slide: u32,
    pub(super) t_slide: f64,
    /// Where on the artefact's own axis, mm.
    u: f64,
    /// What the indicator sees, µm, before anything acts on its reading.
    pub seen: f64,
    /// What it shows, µm.
    pub shows: f64,
    /// ∂shows/∂seen.
    pub(super) scale: f64,
    /// ∂seen/∂S(u).
    pub(super) q: f64,
    /// ∂seen/∂ψ, µm/rad.
    pub(super) turn: f64,
    per: Per,
}

/// Derivatives of what is seen by what moves.
#[derive(Debug, Clone, Copy, Default)]
struct Per {
    slide: f64,
    axial: f64,
}

/// The spots of a channel.
#[derive(Debug, Clone)]
pub struct PlacedChannel {
    pub spots: Vec<Spot>,
    /// Derivatives by the effects' unknowns, reading by reading.
    pub(super) by: Vec<f64>,
    /// The readings sorted into cells.
    pub order: Vec<u32>,
    /// Where each cell begins among them.
    pub starts: Vec<usize>,
}

/// The spots of all readings at a point.
#[derive(Debug, Clone)]
pub struct Placed {
    pub channels: Vec<PlacedChannel>,
    pub(super) effects: usize,
    /// Values kept a reading: at least one, so that rows without effects are rows too.
    pub(super) stride: usize,
}

/// Readings that one core places at a time.
const AT_ONCE: usize = 2048;

/// A form as it is at a point.
struct Shape<'a> {
    basis: &'a CubicBSpline,
    cubics: &'a [Cubic],
}

impl Shape<'_> {
    /// Cell, place in it, height (µm) and slope (µm/mm).
    fn at(&self, x: f64) -> (usize, f64, f64, f64) {
        let k = self.basis.cell_of(x);
        let (left, width) = self.basis.cell(k);
        let (cubic, t) = (&self.cubics[k], (x - left) / width);
        (k, t, horner(cubic, t), horner_slope(cubic, t) / width)
    }
}

/// What the readings of a channel share at a point.
struct Channel<'a> {
    joined: &'a Joined<'a>,
    values: &'a [f64],
    side: Shape<'a>,
    slide: Option<(Shape<'a>, f64)>,
    tilt: f64,
    half_mm: f64,
    offset: f64,
}

impl Placed {
    /// Places all readings of a problem with effects.
    ///
    /// # Errors
    /// [`NoValue`] where the model is not defined.
    pub fn new(
        problem: &Reversal,
        joined: &Joined,
        at: &Parameters,
        cubics: &[Vec<Cubic>],
    ) -> Result<Self, NoValue> {
        let unknowns = &problem.unknowns;
        let values = unknowns.effect_values(&at.border);
        let traces = joined.traces(problem.channels);
        let shape = |form: usize| Shape {
            basis: &problem.bases[form],
            cubics: &cubics[form],
        };
        let channels: Result<Vec<PlacedChannel>, NoValue> = problem
            .channels
            .par_iter()
            .enumerate()
            .map(|(c, readings)| {
                let name = readings.channel;
                let shared = Channel {
                    joined,
                    values,
                    side: shape(unknowns.side_of(name)),
                    slide: unknowns
                        .place(Form::Slide)
                        .map(|form| (shape(form), name.indicator_sign())),
                    tilt: unknowns.slope(c, &at.border),
                    half_mm: problem.thickness(at) / 2.0,
                    offset: at.border[unknowns.offset(c)],
                };
                let mut placed = shared.place(readings, joined.count())?;
                if joined.plays() {
                    let turned = match joined.turning() {
                        Some(held) => held[c].iter().copied().enumerate().collect(),
                        None => pushed(joined, readings, &traces[c], &placed, values),
                    };
                    placed.play(joined, readings, &turned, values);
                }
                if joined.reads() {
                    shared.read(readings, &mut placed, joined.count())?;
                }
                placed.sort(problem.cell_count());
                Ok(placed)
            })
            .collect();
        Ok(Self {
            channels: channels?,
            effects: joined.count(),
            stride: joined.count().max(1),
        })
    }

    /// The most that the two cells of a reading lie apart.
    pub fn apart(&self) -> usize {
        let spots = self.channels.iter().flat_map(|c| &c.spots);
        spots
            .map(|s| s.side.abs_diff(s.slide) as usize)
            .max()
            .unwrap_or(0)
    }

    /// The derivatives of a reading by the effects' unknowns.
    pub fn by(&self, channel: usize, row: usize) -> &[f64] {
        &self.channels[channel].by[row * self.stride..row * self.stride + self.effects]
    }

    /// Goes through the readings of a channel that belong to a cell, in stretches that share both cells.
    pub fn stretches(
        &self,
        channel: usize,
        cell: usize,
        mut take: impl FnMut(&[u32], usize, usize),
    ) {
        let own = &self.channels[channel];
        let cells = |row: &u32| {
            let spot = &own.spots[*row as usize];
            (spot.side, spot.slide)
        };
        let rows = &own.order[own.starts[cell]..own.starts[cell + 1]];
        for stretch in rows.chunk_by(|a, b| cells(a) == cells(b)) {
            let (side, slide) = cells(&stretch[0]);
            take(stretch, side as usize, slide as usize);
        }
    }

    /// Derivatives of a reading (channel, place among its sorted readings) by an effect that is not in the
    /// fit, at values where it changes little: the reading stays where it is.
    pub fn signature(
        &self,
        single: &Joined,
        (channel, row): (usize, usize),
        at: &Circumstances,
        values: &[f64],
        by: &mut [f64],
    ) {
        let spot = &self.channels[channel].spots[row];
        by.fill(0.0);
        single.bump(at, spot.u, values, by);
        by.iter_mut().for_each(|b| *b *= spot.q);
        single.moved(at, &spot.per_move(at.channel.indicator_sign()), by);
        by.iter_mut().for_each(|b| *b *= spot.scale);
        let (shows, _) = single.shown(at, spot.shows, values, by);
        single.read(at, shows, values, by);
    }
}

impl Spot {
    fn per_move(&self, sign: f64) -> PerMove {
        PerMove {
            slide: self.per.slide,
            tilt: self.turn,
            axial: self.per.axial,
            half: UM_PER_MM * (self.q - 1.0),
            lateral: sign,
        }
    }
}

impl Channel<'_> {
    fn place(&self, readings: &ChannelReadings, effects: usize) -> Result<PlacedChannel, NoValue> {
        let (n, stride) = (readings.len(), effects.max(1));
        let mut spots = vec![Spot::default(); n];
        let mut by = vec![0.0; n * stride];
        spots
            .par_chunks_mut(AT_ONCE)
            .zip(by.par_chunks_mut(AT_ONCE * stride))
            .enumerate()
            .try_for_each(|(chunk, (spots, by))| {
                let first = chunk * AT_ONCE;
                let rows = spots.iter_mut().zip(by.chunks_exact_mut(stride));
                for (k, (spot, by)) in rows.enumerate() {
                    *spot = self.spot(readings.source[first + k], &mut by[..effects])?;
                }
                Ok(())
            })?;
        Ok(PlacedChannel {
            spots,
            by,
            order: Vec::new(),
            starts: Vec::new(),
        })
    }

    /// One reading: the exact geometry of `reversal::forward` with what effects move, then what the
    /// indicator makes of it.
    fn spot(&self, source: u32, by: &mut [f64]) -> Result<Spot, NoValue> {
        let (joined, values) = (self.joined, self.values);
        let at = joined.circumstances(source);
        let standing = joined.standing(&at, values);
        let attitude = Attitude::new(self.tilt + standing.tilt, self.half_mm + standing.half)?;
        let (sin, cos) = (attitude.sin, attitude.cos);
        let commanded = at.x + standing.slide;
        // The artefact's own axis, shifted along itself.
        let x = commanded - standing.axial * cos;
        let u = attitude.contact(x, |u| {
            let (_, _, height, slope) = self.side.at(u);
            let (more, steeper) = joined.bump(&at, u, values, by);
            (mm_from_um(height + more), mm_from_um(slope + steeper))
        })?;
        let (side, t_side, height, slope) = self.side.at(u);
        let (more, steeper) = joined.bump(&at, u, values, by);
        let (height, slope) = (mm_from_um(height + more), mm_from_um(slope + steeper));
        let q = 1.0 / (cos - slope * sin);
        let along = sin + slope * cos;
        let across = u * sin + (attitude.half_mm + height) * cos;
        let sign = at.channel.indicator_sign();
        let mut spot = Spot {
            side: side as u32,
            t_side,
            slide: side as u32,
            t_slide: 0.0,
            u,
            seen: UM_PER_MM * (attitude.reading_mm(u, height) + standing.axial * sin)
                + sign * standing.lateral
                + self.offset,
            shows: 0.0,
            scale: 1.0,
            q,
            turn: UM_PER_MM
                * (x + along * (across + standing.axial * sin) * q + standing.axial * cos),
            per: Per {
                slide: UM_PER_MM * q * along,
                axial: UM_PER_MM * (sin - cos * q * along),
            },
        };
        if let Some((slide, sign)) = &self.slide {
            let (cell, t, height, slope) = slide.at(commanded);
            (spot.slide, spot.t_slide) = (cell as u32, t);
            spot.seen += sign * height;
            spot.per.slide += sign * slope;
        }
        by.iter_mut().for_each(|b| *b *= q);
        joined.moved(&at, &spot.per_move(sign), by);
        (spot.shows, spot.scale) = joined.shown(&at, spot.seen, values, by);
        rises(&spot, &at)?;
        Ok(spot)
    }

    /// What the indicator makes of where it stands after its play.
    fn read(
        &self,
        readings: &ChannelReadings,
        placed: &mut PlacedChannel,
        effects: usize,
    ) -> Result<(), NoValue> {
        let stride = effects.max(1);
        let spots = placed.spots.par_iter_mut().with_min_len(AT_ONCE);
        spots
            .zip(placed.by.par_chunks_exact_mut(stride))
            .zip(&readings.source)
            .try_for_each(|((spot, by), source)| {
                let at = self.joined.circumstances(*source);
                let by = &mut by[..effects];
                let (shows, factor) = self.joined.read(&at, spot.shows, self.values, by);
                spot.shows = shows;
                spot.scale *= factor;
                rises(spot, &at)
            })
    }
}

/// Fails where the reading falls while what is seen rises.
fn rises(spot: &Spot, at: &Circumstances) -> Result<(), NoValue> {
    if spot.scale > 0.0 {
        return Ok(());
    }
    Err(NoValue::new(format!(
        "an indicator whose reading falls while what it sees rises, at {} mm in channel {}",
        at.x,
        at.channel.name()
    )))
}

impl PlacedChannel {
    /// Sorts the readings into the lower of their two cells, and there by both.
    fn sort(&mut self, cells: usize) {
        let key = |row: &u32| {
            let spot = &self.spots[*row as usize];
            (spot.side.min(spot.slide), spot.side, spot.slide)
        };
        let count = u32::try_from(self.spots.len()).unwrap_or(u32::MAX);
        let mut order: Vec<u32> = (0..count).collect();
        // Nearly in order already: a merge of long runs.
        order.sort_by_key(key);
        self.starts = (0..=cells)
            .map(|cell| order.partition_point(|row| (key(row).0 as usize) < cell))
            .collect();
        self.order = order;
    }
}

#[cfg(test)]
mod tests;
