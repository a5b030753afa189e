//! Measurements that could be made beside the present one.

use super::{Gathered, Linearised};
use crate::reversal::Direction;
use crate::reversal::designs::{DesignObservations, DesignReading};

/// Further tilt of the artefact, µm/mm.
const TILT: f64 = 1.0;

impl Linearised {
    /// The fitted model of a measurement like this one with something changed, as the smooth state
    /// predicts it; nothing where that cannot be fitted.
    fn predicted(&self, change: impl Fn(usize, &mut Vec<DesignReading>)) -> Option<Self> {
        let mut readings = Vec::new();
        for k in 0..self.record.places.len() {
            let place = &self.record.places[k];
            readings.push(DesignReading {
                channel: place.channel,
                repeat: place.repeat,
                direction: if place.direction < 0.0 {
                    Direction::Backward
                } else {
                    Direction::Forward
                },
                time: self.timed.then_some(place.time),
                x: place.x,
                value: self.smooth_reading(k),
            });
            change(k, &mut readings);
        }
        let observations = DesignObservations {
            design: self.arrangement.design().clone(),
            readings,
        };
        let arrangement = self.arrangement.clone();
        let mut model = Self::beside(&observations, arrangement, self.assumptions, None).ok()?;
        // Each of its readings is the mean of as many; the moments of these are not planned.
        model.gathered = self.gathered.clone().map(Gathered::planned);
        Some(model.with_heights_as(self))
    }

    /// Further measurements that a shop can make, in words and as the model fitted to each.
    pub(super) fn further_measurements(&self) -> Vec<(String, Self)> {
        let turned = self.record.places.iter().any(|p| p.direction < 0.0);
        let backward = |_: usize, readings: &mut Vec<DesignReading>| {
            if let Some(last) = readings.last().copied() {
                readings.push(DesignReading {
                    direction: Direction::Backward,
                    time: last.time.map(|t| 2.0 * self.duration - t),
                    ..last
                });
            }
        };
        let tilted = |k: usize, readings: &mut Vec<DesignReading>| {
            if let Some(last) = readings.last_mut() {
                let [first, second] = self.seat(&self.record.places[k]).psi;
                let side = first + second;
                last.value += side * TILT * (last.x - self.middle);
            }
        };
        let mut further = vec![
            (
                "measure once more in the same way".to_owned(),
                Some(self.clone()),
            ),
            (
                "measure again with the artefact tilted by a further 1 mrad".to_owned(),
                self.predicted(tilted),
            ),
        ];
        if !turned {
            further.push((
                "measure again in both directions".to_owned(),
                self.predicted(backward),
            ));
        }
        further
            .into_iter()
            .filter_map(|(name, model)| Some((name, model?)))
            .collect()
    }
}
