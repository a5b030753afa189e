//! Where to look: contrasts of the readings' circumstances, each a place people can go to.

use std::collections::{BTreeMap, BTreeSet};

use errsep_models::model::{AnyModel, Column, FittedModel, Place};

/// A place along one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    /// `channel`, `pattern`, `x`, `time`, `direction`, `repeat` or `wavelength`.
    pub axis: &'static str,
    /// Which channel, pattern, direction …
    pub value: String,
    /// Where it begins, in the axis's unit.
    pub from: Option<f64>,
    /// Where it ends.
    pub to: Option<f64>,
}

type Items = Vec<(Item, Vec<Column>)>;

/// A tent of half width `half` round `centre`.
fn hat(at: f64, centre: f64, half: f64) -> f64 {
    (1.0 - (at - centre).abs() / half).max(0.0)
}

/// All places to look at, by axis.
pub(crate) fn scan_items(model: &AnyModel) -> Vec<(&'static str, Items)> {
    let scan = Scan::new(model);
    vec![
        ("pattern", scan.patterns()),
        ("direction", scan.directions()),
        ("wavelength", scan.wavelengths()),
        ("repeat", scan.repeats()),
        ("time", scan.times()),
        ("x", scan.positions()),
    ]
    .into_iter()
    .filter(|(_, items)| !items.is_empty())
    .collect()
}

struct Scan<'a, AnyModel> {
    model: &'a AnyModel,
    places: &'a [Place],
    first: f64,
    last: f64,
    positions: usize,
    both_directions: bool,
    repeats: bool,
    weights: Vec<(String, Vec<f64>)>,
}

impl<'a> Scan<'a, AnyModel> {
    fn new(model: &'a AnyModel) -> Self {
        let places = model.places();
        let first = places.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
        let last = places.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
        let cells: BTreeSet<usize> = places.iter().map(|p| p.cell).collect();
        let channels = model.channel_names();
        let mut weights: Vec<(String, Vec<f64>)> = model
            .patterns()
            .into_iter()
            .map(|p| (p.name, p.weights))
            .collect();
        if weights.is_empty() {
            weights = channels
                .iter()
                .enumerate()
                .map(|(k, name)| {
                    let mut weight = vec![0.0; channels.len()];
                    weight[k] = 1.0;
                    (name.clone(), weight)
                })
                .collect();
        }
        Self {
            model,
            places,
            first,
            last,
            positions: (cells.len() / channels.len().max(1)).max(1),
            repeats: places.windows(2).any(|w| w[0].repeat != w[1].repeat),
            both_directions: places.iter().any(|p| p.direction < 0.0)
                && places.iter().any(|p| p.direction > 0.0),
            weights,
        }
    }

    fn span(&self) -> f64 {
        (self.last - self.first).max(f64::MIN_POSITIVE)
    }

    fn middle(&self) -> f64 {
        0.5 * (self.first + self.last)
    }

    fn column(&self, value: impl Fn(&Place) -> f64) -> Vec<Column> {
        vec![Column::from_places(self.places, |_, place| value(place))]
    }

    /// Tents over the travel at widths from a third of it down to a few positions.
    fn tents(&self, finest: usize) -> Vec<(f64, f64)> {
        let mut tents = Vec::new();
        let mut count = 4usize;
        while count <= finest.min(self.positions / 2) {
            let half = self.span() / count as f64;
            tents.extend((0..=count).map(|k| (self.first + half * k as f64, half)));
            count = count * 5 / 2;
        }
        tents
    }

    fn patterns(&self) -> Items {
        let mut items = Items::new();
        for (name, weights) in &self.weights {
            let whole = |axis_value: String| Item {
                axis: "pattern",
                value: axis_value,
                from: Some(self.first),
                to: Some(self.last),
            };
            for power in 0..3 {
                items.push((
                    whole(name.clone()),
                    self.column(|p| {
                        weights[p.channel] * (2.0 * (p.x - self.middle()) / self.span()).powi(power)
                    }),
                ));
            }
            for (centre, half) in self.tents(65) {
                items.push((
                    Item {
                        axis: "pattern",
                        value: name.clone(),
                        from: Some((centre - half).max(self.first)),
                        to: Some((centre + half).min(self.last)),
                    },
                    self.column(|p| weights[p.channel] * hat(p.x, centre, half)),
                ));
            }
        }
        items
    }

    fn directions(&self) -> Items {
        let mut items = Items::new();
        if !self.both_directions {
            return items;
        }
        for (channel, name) in self.model.channel_names().iter().enumerate() {
            let mine = |p: &Place| f64::from(u8::from(p.channel == channel)) * p.direction;
            let item = |from: f64, to: f64| Item {
                axis: "direction",
                value: format!("forward against backward in {name}"),
                from: Some(from),
                to: Some(to),
            };
            for power in 0..2 {
                items.push((
                    item(self.first, self.last),
                    self.column(|p| {
                        mine(p) * (2.0 * (p.x - self.middle()) / self.span()).powi(power)
                    }),
                ));
            }
            for (centre, half) in self.tents(25) {
                items.push((
                    item(
                        (centre - half).max(self.first),
                        (centre + half).min(self.last),
                    ),
                    self.column(|p| mine(p) * hat(p.x, centre, half)),
                ));
            }
        }
        for (name, weights) in &self.weights {
            items.push((
                Item {
                    axis: "direction",
                    value: format!("forward against backward in {name}"),
                    from: Some(self.first),
                    to: Some(self.last),
                },
                self.column(|p| weights[p.channel] * p.direction),
            ));
        }
        items
    }

    fn wavelengths(&self) -> Items {
        let mut items = Items::new();
        let highest = (self.positions / 4).min(25);
        for (name, weights) in &self.weights {
            for odd in [false, true] {
                if odd && !self.both_directions {
                    continue;
                }
                for harmonic in 1..=highest {
                    let turn = std::f64::consts::TAU * harmonic as f64 / self.span();
                    let sign = |p: &Place| if odd { p.direction } else { 1.0 };
                    let wave = |f: fn(f64) -> f64| {
                        Column::from_places(self.places, |_, p| {
                            weights[p.channel] * sign(p) * f(turn * (p.x - self.first))
                        })
                    };
                    items.push((
                        Item {
                            axis: "wavelength",
                            value: if odd {
                                format!("{name}, forward against backward")
                            } else {
                                name.clone()
                            },
                            from: Some(self.span() / (harmonic as f64 + 0.5)),
                            to: Some(self.span() / (harmonic as f64 - 0.5)),
                        },
                        vec![wave(f64::cos), wave(f64::sin)],
                    ));
                }
            }
        }
        items
    }

    fn trace_name(&self, place: &Place) -> String {
        let channels = self.model.channel_names();
        if let Some(name) = self.model.trace_name(place) {
            let channel = channels.get(place.channel).map_or("", String::as_str);
            return format!("{channel}, {name}");
        }
        let direction = match (self.both_directions, place.direction < 0.0) {
            (false, _) => "",
            (true, true) => " backward",
            (true, false) => " forward",
        };
        let channel = channels.get(place.channel).map_or("", String::as_str);
        if self.repeats {
            format!("{channel}{direction}, repeat {}", place.repeat)
        } else {
            format!("{channel}{direction}")
        }
    }

    fn repeats(&self) -> Items {
        let mut items = Items::new();
        for trace in self.model.traces() {
            if trace.len() < 2 {
                continue;
            }
            let name = self.trace_name(&self.places[trace.start]);
            for power in 0..2 {
                items.push((
                    Item {
                        axis: "repeat",
                        value: name.clone(),
                        from: Some(self.first),
                        to: Some(self.last),
                    },
                    vec![trace_column(trace.clone(), |k| {
                        (2.0 * (self.places[k].x - self.middle()) / self.span()).powi(power)
                    })],
                ));
            }
        }
        items
    }

    fn times(&self) -> Items {
        let mut by_channel: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
        for place in self.places {
            let range = by_channel
                .entry(place.channel)
                .or_insert((f64::INFINITY, f64::NEG_INFINITY));
            range.0 = range.0.min(place.time);
            range.1 = range.1.max(place.time);
        }
        let mut items = Items::new();
        let channels = self.model.channel_names();
        for (channel, (from, to)) in by_channel {
            if to <= from || self.model.traces().len() <= channels.len() {
                continue;
            }
            for count in [3usize, 12] {
                let half = (to - from) / count as f64;
                for k in 0..=count {
                    let centre = from + half * k as f64;
                    items.push((
                        Item {
                            axis: "time",
                            value: channels.get(channel).cloned().unwrap_or_default(),
                            from: Some((centre - half).max(from)),
                            to: Some((centre + half).min(to)),
                        },
                        self.column(|p| {
                            f64::from(u8::from(p.channel == channel)) * hat(p.time, centre, half)
                        }),
                    ));
                }
            }
        }
        items
    }

    /// Tents in one trace.
    fn positions(&self) -> Items {
        let mut items = Items::new();
        let finest = if self.model.traces().len() > 8 {
            25
        } else {
            65
        };
        for trace in self.model.traces() {
            let name = self.trace_name(&self.places[trace.start]);
            for (centre, half) in self.tents(finest) {
                items.push((
                    Item {
                        axis: "x",
                        value: name.clone(),
                        from: Some((centre - half).max(self.first)),
                        to: Some((centre + half).min(self.last)),
                    },
                    vec![trace_column(trace.clone(), |k| {
                        hat(self.places[k].x, centre, half)
                    })],
                ));
            }
        }
        items
    }
}

fn trace_column(trace: std::ops::Range<usize>, value: impl Fn(usize) -> f64) -> Column {
    let (rows, values) = trace
        .map(|k| (k, value(k)))
        .filter(|(_, v)| *v != 0.0)
        .unzip();
    Column { rows, values }
}
