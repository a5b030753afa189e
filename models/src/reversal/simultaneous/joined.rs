//! Effects that are unknowns of the fit, and what they make of one reading.

use std::sync::Arc;

use super::effects::{Circumstances, JoinedEffect, Kind, Left, Move, Play, Shows, Unknown};
use super::readings::ChannelReadings;
use crate::reversal::channel_noise::traces::{self, Trace};
use crate::reversal::{Channel, Observations};

/// An effect in the fit.
#[derive(Debug, Clone)]
pub struct Member {
    /// Its name in the catalogue.
    pub name: &'static str,
    /// Its variant.
    pub effect: Arc<dyn JoinedEffect>,
    /// Its unknowns.
    pub unknowns: Vec<Unknown>,
    /// Where they begin among those of all effects.
    pub from: usize,
}

impl Member {
    fn own<'v>(&self, values: &'v [f64]) -> &'v [f64] {
        &values[self.from..self.from + self.unknowns.len()]
    }
}

/// The effects of a fit, in the order in which they were asked for.
#[derive(Debug, Clone)]
pub struct Joined<'a> {
    /// The readings.
    pub observations: &'a Observations,
    /// Seconds since the first reading.
    pub times: &'a [f64],
    members: Vec<Member>,
    /// Those that act on the indicator's reading before its play, in the order in which they do.
    on_reading: Vec<usize>,
    /// The same after its play.
    after_play: Vec<usize>,
    on_surface: Vec<usize>,
    moving: Vec<usize>,
    /// The one with a play.
    playing: Option<usize>,
    /// Turning points of the play that are held within a minimisation.
    turning: Option<Arc<Vec<Vec<Turn>>>>,
}

/// Where a reading's pointer was last pushed along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turn {
    /// The reading, among its channel's.
    pub at: u32,
    /// −1 below the stylus, +1 above it; 0 where the trace began.
    pub side: i8,
}

/// What comes before the surface: where slide and artefact stand for a reading.
#[derive(Debug, Clone, Copy, Default)]
pub struct Standing {
    /// The slide beyond its command, mm.
    pub slide: f64,
    /// The artefact's further tilt, rad.
    pub tilt: f64,
    /// Its shift along its axis, mm.
    pub axial: f64,
    /// The surface further off the axis, mm.
    pub half: f64,
    /// The slide towards the near indicator, µm.
    pub lateral: f64,
}

impl<'a> Joined<'a> {
    /// These effects over readings taken at these times.
    pub fn new(
        observations: &'a Observations,
        times: &'a [f64],
        effects: &[(&'static str, Arc<dyn JoinedEffect>)],
    ) -> Self {
        let mut joined = Self {
            observations,
            times,
            members: Vec::new(),
            on_reading: Vec::new(),
            after_play: Vec::new(),
            on_surface: Vec::new(),
            moving: Vec::new(),
            playing: None,
            turning: None,
        };
        let mut from = 0;
        for (name, effect) in effects {
            let unknowns = effect.unknowns();
            let count = unknowns.len();
            joined.members.push(Member {
                name,
                effect: Arc::clone(effect),
                unknowns,
                from,
            });
            from += count;
        }
        let which = |keep: &dyn Fn(&Member) -> bool| -> Vec<usize> {
            let all = 0..joined.members.len();
            all.filter(|k| keep(&joined.members[*k])).collect()
        };
        let channels = &Channel::ALL;
        let somewhere = |channel: &Channel, direction: f64| Circumstances {
            channel: *channel,
            x: 0.0,
            time: 0.0,
            direction,
            repeat: 1,
        };
        let moves = |m: &Member| {
            let mut channels = channels.iter();
            channels.any(|c| {
                [1.0, -1.0]
                    .iter()
                    .any(|d| m.effect.moves(&somewhere(c, *d)).is_some())
            })
        };
        let plays = |m: &Member| {
            let mut channels = channels.iter();
            channels.any(|c| m.effect.play(*c, false).is_some())
        };
        let mut on_reading = which(&|m| m.effect.shows().is_some());
        on_reading.sort_by_key(|k| joined.members[*k].effect.shows());
        let first = |k: &usize| joined.members[*k].effect.shows() < Some(Shows::Scale);
        let after_play = on_reading.split_off(on_reading.partition_point(first));
        let on_surface = which(&|m| m.effect.is_on_surface());
        let moving = which(&moves);
        let playing = which(&plays).first().copied();
        Self {
            on_reading,
            after_play,
            on_surface,
            moving,
            playing,
            ..joined
        }
    }

    /// The effects.
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// Number of unknowns of all effects.
    pub fn count(&self) -> usize {
        self.members.iter().map(|m| m.unknowns.len()).sum()
    }

    /// The names of all unknowns.
    pub fn names(&self) -> Vec<String> {
        let of = |m: &Member| {
            let name = m.name;
            let own = m.unknowns.iter();
            own.map(move |u| format!("{} of {name}", u.name))
                .collect::<Vec<_>>()
        };
        self.members.iter().flat_map(of).collect()
    }

    /// All unknowns.
    pub fn unknowns(&self) -> impl Iterator<Item = &Unknown> {
        self.members.iter().flat_map(|m| &m.unknowns)
    }

    /// Which unknowns are searched over rather than fitted.
    pub fn are_searched(&self) -> Vec<bool> {
        self.unknowns().map(|u| u.kind == Kind::Searched).collect()
    }

    /// Where and when a reading was taken.
    pub fn circumstances(&self, source: u32) -> Circumstances {
        let i = source as usize;
        Circumstances::of(&self.observations.readings[i], self.times[i])
    }

    /// Where slide and artefact stand for a reading.
    pub fn standing(&self, at: &Circumstances, values: &[f64]) -> Standing {
        let mut standing = Standing::default();
        for k in &self.moving {
            let member = &self.members[*k];
            let size = member.own(values)[0];
            match member.effect.moves(at) {
                Some(Move::Slide(unit)) => standing.slide += unit * size,
                Some(Move::Tilt(unit)) => standing.tilt += unit * size,
                Some(Move::Axial(unit)) => standing.axial += unit * size,
                Some(Move::HalfThickness(unit)) => standing.half += unit * size,
                Some(Move::Lateral(unit)) => standing.lateral += unit * size,
                None => {}
            }
        }
        standing
    }

    /// Puts the derivatives of the reading by what moves into `by`: µm per unit of each kind of move.
    pub fn moved(&self, at: &Circumstances, per: &PerMove, by: &mut [f64]) {
        for k in &self.moving {
            let member = &self.members[*k];
            by[member.from] = match member.effect.moves(at) {
                Some(Move::Slide(unit)) => unit * per.slide,
                Some(Move::Tilt(unit)) => unit * per.tilt,
                Some(Move::Axial(unit)) => unit * per.axial,
                Some(Move::HalfThickness(unit)) => unit * per.half,
                Some(Move::Lateral(unit)) => unit * per.lateral,
                None => 0.0,
            };
        }
    }

    /// Height (µm) and slope (µm/mm) that effects add to the surface at u; derivatives of the height go to
    /// `by`.
    pub fn bump(&self, at: &Circumstances, u: f64, values: &[f64], by: &mut [f64]) -> (f64, f64) {
        let mut sum = (0.0, 0.0);
        for k in &self.on_surface {
            let member = &self.members[*k];
            let own = &mut by[member.from..member.from + member.unknowns.len()];
            if let Some((height, slope)) = member.effect.bump(at, u, member.own(values), own) {
                sum = (sum.0 + height, sum.1 + slope);
            } else {
                own.fill(0.0);
            }
        }
        sum
    }

    /// What the indicator shows of what it sees before its play, µm, and the derivative of that by what it
    /// sees; the derivatives in `by` are carried along, and those of what acts here added.
    pub fn shown(
        &self,
        at: &Circumstances,
        seen: f64,
        values: &[f64],
        by: &mut [f64],
    ) -> (f64, f64) {
        self.applied(&self.on_reading, at, seen, values, by)
    }

    /// The same of where it stands after its play.
    pub fn read(
        &self,
        at: &Circumstances,
        stands: f64,
        values: &[f64],
        by: &mut [f64],
    ) -> (f64, f64) {
        self.applied(&self.after_play, at, stands, values, by)
    }

    fn applied(
        &self,
        members: &[usize],
        at: &Circumstances,
        seen: f64,
        values: &[f64],
        by: &mut [f64],
    ) -> (f64, f64) {
        let (mut shows, mut scale) = (seen, 1.0);
        for k in members {
            let member = &self.members[*k];
            let range = member.from..member.from + member.unknowns.len();
            by[range.clone()].fill(0.0);
            let own = &mut by[range.clone()];
            let (added, by_seen) = member.effect.shown(at, shows, member.own(values), own);
            if by_seen != 0.0 {
                let factor = 1.0 + by_seen;
                scale *= factor;
                for (j, b) in by.iter_mut().enumerate() {
                    if !range.contains(&j) {
                        *b *= factor;
                    }
                }
            }
            shows += added;
        }
        (shows, scale)
    }

    /// The play in a channel and direction: the places of its unknowns among those of all effects.
    pub fn play(&self, channel: Channel, backward: bool) -> Option<Play> {
        let member = &self.members[self.playing?];
        let own = member.effect.play(channel, backward)?;
        Some(Play {
            width: member.from + own.width,
            begins: member.from + own.begins,
        })
    }

    /// Whether any effect acts after the play.
    pub fn reads(&self) -> bool {
        !self.after_play.is_empty()
    }

    /// Whether any effect has a play.
    pub fn plays(&self) -> bool {
        self.playing.is_some()
    }

    /// The same effects without the play and what comes after it.
    #[must_use]
    pub fn before_play(&self) -> Self {
        Self {
            playing: None,
            turning: None,
            after_play: Vec::new(),
            ..self.clone()
        }
    }

    /// Turning points that are held.
    pub fn turning(&self) -> Option<&Arc<Vec<Vec<Turn>>>> {
        self.turning.as_ref()
    }

    /// Holds these turning points, or none.
    pub fn hold_turning(&mut self, turning: Option<Arc<Vec<Vec<Turn>>>>) {
        self.turning = turning;
    }

    /// The traces of channels, where a play goes through them.
    pub fn traces(&self, channels: &[ChannelReadings]) -> Vec<Vec<Trace>> {
        if self.plays() {
            traces::of(channels, |i| self.observations.taken(i))
        } else {
            Vec::new()
        }
    }

    /// The searched unknowns at their best, the others as they are: place, value and resolution.
    pub fn searched(&self, left: &[Left], values: &[f64]) -> Vec<(usize, f64, f64)> {
        let mut found = Vec::new();
        for member in &self.members {
            let place = member.unknowns.iter();
            if let Some(k) = place.clone().position(|u| u.kind == Kind::Searched)
                && let Some((value, std)) = member.effect.searched(left, member.own(values))
            {
                found.push((member.from + k, value, std));
            }
        }
        found
    }
}

/// Derivatives of what the indicator sees by each kind of [`Move`], µm per unit.
#[derive(Debug, Clone, Copy, Default)]
pub struct PerMove {
    /// Per mm.
    pub slide: f64,
    /// Per rad.
    pub tilt: f64,
    /// Per mm.
    pub axial: f64,
    /// Per mm.
    pub half: f64,
    /// Per µm.
    pub lateral: f64,
}
