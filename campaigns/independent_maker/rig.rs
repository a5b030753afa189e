//! The measuring rig: an artefact of two surfaces, turned with its spindle, past two indicators,
//! in exact plane geometry.
//!
//! The frame: x along the slide (mm), y towards the near indicator (mm). The artefact's own axis u
//! is turned by the angle φ against x, surface A or B lies at v = ±(h + S(u)). A point (u, v) of it
//! is at X = a + u cos φ − v sin φ, Y = u sin φ + v cos φ + M(X). An indicator reads how far the
//! surface at its place stands out towards it.

use crate::design::{Schedule, Trace};
use crate::forms::Form;

/// Circumstances of one reading.
#[derive(Debug, Clone, Copy)]
pub struct Moment {
    /// 0 the near indicator, 1 the far one.
    pub indicator: usize,
    /// 0 the spindle at 0°, 1 at 180°.
    pub position: usize,
    /// Repeat, from 1.
    pub repeat: u32,
    /// +1 forward, −1 backward.
    pub direction: f64,
    /// Commanded slide position, mm.
    pub x: f64,
    /// Seconds since the first reading; before it negative.
    pub time: f64,
}

impl Moment {
    /// Index of the channel in the order 1A, 1B, 2A, 2B.
    pub fn channel(&self) -> usize {
        match (self.position, self.indicator) {
            (0, near_or_far) => near_or_far,
            (_, 1) => 2,
            _ => 3,
        }
    }

    /// 0 where surface A is probed, 1 where B is.
    pub fn side(&self) -> usize {
        usize::from(self.indicator != self.position)
    }

    /// A number of the trace that both indicators share.
    pub fn pass(&self) -> u64 {
        self.position as u64 * 1000 + u64::from(self.repeat) * 2 + u64::from(self.direction < 0.0)
    }
}

type OfMoment = Box<dyn Fn(&Moment) -> f64 + Send + Sync>;
type OfPlace = Box<dyn Fn(&Moment, f64) -> f64 + Send + Sync>;
type OfPath = Box<dyn Fn(&[Moment], &mut [f64]) + Send + Sync>;

/// What one error source does, at the places of the rig where it does it.
#[derive(Default)]
pub struct Disturbance {
    /// Slide position beside the commanded one, mm.
    pub place: Option<OfMoment>,
    /// Slide's displacement towards the near indicator, µm, at a slide position.
    pub slide: Option<OfPlace>,
    /// Height of the probed surface, µm, at a place of the artefact.
    pub surface: Option<OfPlace>,
    /// Turn of the artefact, rad.
    pub turn: Option<OfMoment>,
    /// Shift of the artefact along x, mm.
    pub axial: Option<OfMoment>,
    /// How far the indicator's mount brings it towards the surface, µm.
    pub mount: Option<OfMoment>,
    /// What stylus and plunger make of the path that they follow, µm, unread stops included.
    pub stylus: Option<OfPath>,
    /// What the indicator makes of its stylus's displacement, µm.
    pub sensor: Option<OfPlace>,
    /// Thickness of the artefact beside that of the rig, mm.
    pub thickness: f64,
}

impl Disturbance {
    /// A slide that stands elsewhere than commanded.
    pub fn place(f: impl Fn(&Moment) -> f64 + Send + Sync + 'static) -> Self {
        Self {
            place: Some(Box::new(f)),
            ..Self::default()
        }
    }

    /// A slide that leaves its line.
    pub fn slide(f: impl Fn(&Moment, f64) -> f64 + Send + Sync + 'static) -> Self {
        Self {
            slide: Some(Box::new(f)),
            ..Self::default()
        }
    }

    /// A surface that is not what it was.
    pub fn surface(f: impl Fn(&Moment, f64) -> f64 + Send + Sync + 'static) -> Self {
        Self {
            surface: Some(Box::new(f)),
            ..Self::default()
        }
    }

    /// An artefact that is turned.
    pub fn turn(f: impl Fn(&Moment) -> f64 + Send + Sync + 'static) -> Self {
        Self {
            turn: Some(Box::new(f)),
            ..Self::default()
        }
    }

    /// An artefact that is shifted along the slide.
    pub fn axial(f: impl Fn(&Moment) -> f64 + Send + Sync + 'static) -> Self {
        Self {
            axial: Some(Box::new(f)),
            ..Self::default()
        }
    }

    /// A mount that moves.
    pub fn mount(f: impl Fn(&Moment) -> f64 + Send + Sync + 'static) -> Self {
        Self {
            mount: Some(Box::new(f)),
            ..Self::default()
        }
    }

    /// A stylus that does not follow at once.
    pub fn stylus(f: impl Fn(&[Moment], &mut [f64]) + Send + Sync + 'static) -> Self {
        Self {
            stylus: Some(Box::new(f)),
            ..Self::default()
        }
    }

    /// An indicator that does not say what it sees.
    pub fn sensor(f: impl Fn(&Moment, f64) -> f64 + Send + Sync + 'static) -> Self {
        Self {
            sensor: Some(Box::new(f)),
            ..Self::default()
        }
    }
}

/// The rig without any error source.
#[derive(Debug, Clone)]
pub struct Rig {
    /// Measured travel, mm.
    pub length: f64,
    /// Thickness of the artefact, mm.
    pub thickness: f64,
    /// Straightness of the slide, positive towards the near indicator.
    pub slide: Form,
    /// Forms of the surfaces A and B, positive outwards.
    pub surfaces: [Form; 2],
    /// Angle between slide and spindle axis, rad.
    pub alpha: f64,
    /// Angle between artefact and spindle axis, rad; it turns with the spindle.
    pub gamma: f64,
    /// Slide position at which the indicators are set to zero, mm.
    pub zero_at: f64,
    /// What is left of each channel's zero, µm.
    pub zero: [f64; 4],
}

impl Rig {
    /// The rig with forms that have no straight line as they are touched in the first spindle position:
    /// where the slide or the artefact is shifted, a line would come in that is a cone of no one's making.
    /// Where traces have positions of their own, of those that all have within their ends, and the forms begin and
    /// end on it: a line beneath them is then the same however the ends and what lies between count.
    pub fn levelled(&self, schedule: &Schedule, sources: &[Disturbance]) -> Self {
        let mut touched = Vec::new();
        let read = schedule.traces.iter().flat_map(Trace::moments);
        let all: Vec<Moment> = read.collect();
        let first = all.iter().any(|m| m.position == 0);
        for moment in all.iter().filter(|m| !first || m.position == 0) {
            let place: f64 = sources
                .iter()
                .filter_map(|s| s.place.as_ref())
                .map(|f| f(moment))
                .sum();
            let axial: f64 = sources
                .iter()
                .filter_map(|s| s.axial.as_ref())
                .map(|f| f(moment))
                .sum();
            touched.push([moment.x, moment.x + place - axial]);
        }
        let mut rig = self.clone();
        rig.surfaces = match schedule.common_ends() {
            None => rig.surfaces.map(|form| form.without_line(&touched)),
            Some(ends) => {
                touched.retain(|pair| (ends[0]..=ends[1]).contains(&pair[0]));
                rig.surfaces.map(|form| form.ended_on_line(&touched, ends))
            }
        };
        rig
    }

    /// All readings of a schedule without noise, one list a trace.
    pub fn readings(&self, schedule: &Schedule, sources: &[Disturbance]) -> Vec<Vec<f64>> {
        let mut all: Vec<Vec<f64>> = vec![Vec::new(); schedule.traces.len()];
        for position in 0..2 {
            for indicator in 0..2 {
                self.followed(schedule, sources, [position, indicator], &mut all);
            }
        }
        all
    }

    /// One indicator in one spindle position, from its setting to its last reading.
    fn followed(
        &self,
        schedule: &Schedule,
        sources: &[Disturbance],
        which: [usize; 2],
        all: &mut [Vec<f64>],
    ) {
        let mine = |trace: &Trace| trace.position == which[0] && trace.indicator == which[1];
        let traces: Vec<usize> = (0..schedule.traces.len())
            .filter(|k| mine(&schedule.traces[*k]))
            .collect();
        let mut path = Vec::new();
        let mut keep = Vec::new();
        for k in traces {
            let trace = &schedule.traces[k];
            for stop in &trace.stops {
                path.push(trace.moment(stop));
                keep.push(stop.read.then_some(k));
            }
        }
        let mut seen: Vec<f64> = path.iter().map(|m| self.seen(m, sources)).collect();
        for act in sources.iter().filter_map(|s| s.stylus.as_ref()) {
            act(&path, &mut seen);
        }
        for ((moment, value), trace) in path.iter().zip(seen).zip(keep) {
            let said = sources
                .iter()
                .filter_map(|s| s.sensor.as_ref())
                .fold(value, |value, sensor| sensor(moment, value));
            if let Some(k) = trace {
                all[k].push(said);
            }
        }
    }

    /// Displacement of a stylus from where its indicator was set to zero, µm.
    fn seen(&self, moment: &Moment, sources: &[Disturbance]) -> f64 {
        let setting = Moment {
            x: self.zero_at,
            ..*moment
        };
        self.stands_out(moment, sources) - self.stands_out(&setting, &[])
            + self.zero[moment.channel()]
    }

    /// How far the surface stands out towards the indicator, µm.
    fn stands_out(&self, moment: &Moment, sources: &[Disturbance]) -> f64 {
        let sum = |hook: fn(&Disturbance) -> &Option<OfMoment>| -> f64 {
            sources
                .iter()
                .filter_map(|s| hook(s).as_ref())
                .map(|f| f(moment))
                .sum()
        };
        let half = (self.thickness + sources.iter().map(|s| s.thickness).sum::<f64>()) / 2.0;
        let x = moment.x + sum(|s| &s.place);
        let turned = if moment.position == 0 {
            self.gamma
        } else {
            -self.gamma
        };
        let (sin, cos) = (self.alpha + turned + sum(|s| &s.turn)).sin_cos();
        let towards = if moment.indicator == 0 { 1.0 } else { -1.0 };
        let height = |u: f64| {
            let more = sources.iter().filter_map(|s| s.surface.as_ref());
            self.surfaces[moment.side()].at(u) + more.map(|f| f(moment, u)).sum::<f64>()
        };
        let across = |u: f64| towards * (half + 1e-3 * height(u));
        let along = x - sum(|s| &s.axial);
        let mut u = along / cos;
        for _ in 0..4 {
            u = (along + across(u) * sin) / cos;
        }
        let bent = sources.iter().filter_map(|s| s.slide.as_ref());
        let slide = self.slide.at(x) + bent.map(|f| f(moment, x)).sum::<f64>();
        let out = towards * (u * sin + across(u) * cos + 1e-3 * slide) - half;
        1e3 * out + sum(|s| &s.mount)
    }
}
