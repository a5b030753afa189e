//! Where readings are seen: in the middle of their cells, or where they were taken.

use super::super::smooth_profile::{SmoothProfile, Spot};
use super::Linearised;
use crate::model::{Column, Place};

impl Linearised {
    /// Readings were taken so far, mm, from the middle of their cells; nothing: all were taken there.
    pub(super) fn take_where_read(&mut self, away: &[f64]) {
        if away.is_empty() {
            return;
        }
        let places = self.record.places.iter().zip(away);
        let spots =
            places.map(|(place, away)| Spot::new(&self.positions, self.at(place), place.x + away));
        self.spots = Some(spots.collect());
        self.see();
    }

    /// The smooth value where each reading was taken.
    pub(super) fn see(&mut self) {
        let Some(spots) = &self.spots else { return };
        let places = self.record.places.iter().zip(spots.iter());
        self.seen = places
            .map(|(place, spot)| {
                let line = &self.lines[place.channel];
                line.offset
                    + line.slope * spot.position(&self.positions)
                    + self.slide_sum(place.channel, |form| form.at(spot))
                    + self.side(place.channel).at(spot)
            })
            .collect();
    }

    /// The smooth value of a reading, µm, in the middle of its cell.
    pub fn smooth_reading(&self, reading: usize) -> f64 {
        self.smooth[self.record.places[reading].cell] + self.added(reading)
    }

    /// The smooth value of a reading, µm, where it was taken.
    pub fn seen_reading(&self, reading: usize) -> f64 {
        match self.seen.get(reading) {
            Some(seen) => seen + self.added(reading),
            None => self.smooth_reading(reading),
        }
    }

    fn added(&self, reading: usize) -> f64 {
        self.beneath.as_ref().map_or(0.0, |b| b[reading])
    }

    /// The value of a form where a reading was taken.
    pub(super) fn form_at(&self, form: &SmoothProfile, reading: usize) -> f64 {
        match &self.spots {
            Some(spots) => form.at(&spots[reading]),
            None => form.values[self.at(&self.record.places[reading])],
        }
    }

    /// Where a reading was taken, mm: what was gathered, in the mean.
    pub fn taken_at(&self, reading: usize) -> f64 {
        match &self.spots {
            Some(spots) => spots[reading].position(&self.positions),
            None => self.record.places[reading].x,
        }
    }

    /// A function of the smooth reading, for every reading.
    pub(in crate::reversal) fn of_reading(&self, value: impl Fn(f64) -> f64) -> Column {
        if self.beneath.is_some() || self.spots.is_some() {
            return Column::from_places(&self.record.places, |k, _| value(self.seen_reading(k)));
        }
        let values: Vec<f64> = self.smooth.iter().map(|reading| value(*reading)).collect();
        Column::from_places(&self.record.places, |_, place| values[place.cell])
    }

    /// A function that is the same for all readings of a cell in one direction, for every reading.
    pub(in crate::reversal) fn of_cell(&self, value: impl Fn(usize, &Place) -> f64) -> Column {
        if self.spots.is_some() {
            return Column::from_places(&self.record.places, value);
        }
        let slot = |place: &Place| 2 * place.cell + usize::from(place.direction < 0.0);
        let mut values = vec![None; 2 * self.smooth.len()];
        for (k, place) in self.record.places.iter().enumerate() {
            values[slot(place)].get_or_insert_with(|| value(k, place));
        }
        Column::from_places(&self.record.places, |_, place| {
            values[slot(place)].unwrap_or(0.0)
        })
    }
}
