//! How the forms follow from the channels, for every set of channels that may be read at a position.

use nalgebra::DMatrix;

use crate::reversal::combinations::determined;
use crate::reversal::{Channel, Combination};

/// The forms' combinations and their weights on the channels.
#[derive(Debug)]
pub struct Designs {
    combinations: Vec<Combination>,
    /// By subset of the channels (bit c for channel c), combination and channel; none where the subset
    /// does not determine all combinations.
    weights: Vec<Option<Vec<Vec<f64>>>>,
    /// By channel: its weight in the closure, where all four were read.
    closing: Option<[f64; 4]>,
}

impl Designs {
    /// The combinations that these channels determine where all are read.
    ///
    /// Where one of four was not read, the other three still give every form.
    pub fn of(channels: &[Channel]) -> Self {
        let combinations = determined(&signs(channels), &[1, 2]);
        let weights = (0..1_usize << channels.len())
            .map(|subset| {
                let members: Vec<usize> = (0..channels.len())
                    .filter(|c| subset & (1 << c) != 0)
                    .collect();
                if members.len() < combinations.len() {
                    return None;
                }
                let read: Vec<Channel> = members.iter().map(|c| channels[*c]).collect();
                let own = determined(&signs(&read), &[1, 2]);
                let same = own.len() == combinations.len()
                    && own
                        .iter()
                        .zip(&combinations)
                        .all(|(a, b)| a.coefficients == b.coefficients);
                same.then(|| {
                    own.iter()
                        .map(|combination| {
                            let mut weights = vec![0.0; channels.len()];
                            for (c, w) in members.iter().zip(&combination.weights) {
                                weights[*c] = *w;
                            }
                            weights
                        })
                        .collect()
                })
            })
            .collect();
        Self {
            combinations,
            weights,
            closing: (channels.len() == 4).then(|| Channel::ALL.map(|c| c.spindle_sign() / 4.0)),
        }
    }

    /// The combinations.
    pub fn combinations(&self) -> &[Combination] {
        &self.combinations
    }

    /// How many positions carry the solution, from the subset that was read at each: those of the
    /// closure, where there is one.
    pub fn fewest(&self, subsets: &[usize]) -> usize {
        let all = self.weights.len() - 1;
        match self.closing {
            Some(_) => subsets.iter().filter(|s| **s == all).count(),
            None => subsets.len(),
        }
    }

    /// The weights of each combination on the channels where a subset of them was read.
    pub fn weights(&self, subset: usize) -> Option<&[Vec<f64>]> {
        self.weights.get(subset)?.as_deref()
    }

    /// The weights of the closure on the channels where a subset of them was read.
    pub fn closing(&self, subset: usize) -> Option<&[f64; 4]> {
        self.closing
            .as_ref()
            .filter(|_| subset + 1 == self.weights.len())
    }
}

fn signs(channels: &[Channel]) -> DMatrix<f64> {
    DMatrix::from_fn(channels.len(), 3, |r, c| match c {
        0 => channels[r].indicator_sign(),
        1 => f64::from(u8::from(channels[r].is_side_a())),
        _ => f64::from(u8::from(!channels[r].is_side_a())),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_of_four_channels_give_every_form_and_two_do_not() {
        let designs = Designs::of(&Channel::ALL);
        for subset in 0..16_usize {
            let weights = designs.weights(subset);
            assert_eq!(weights.is_some(), subset.count_ones() >= 3, "{subset}");
            for (form, own) in weights.unwrap_or_default().iter().enumerate() {
                // Whatever the forms are, a combination gives its own: multiples of ¼, exact.
                for (other, design) in signs(&Channel::ALL).column_iter().enumerate() {
                    let seen: f64 = own.iter().zip(design.iter()).map(|(w, s)| w * s).sum();
                    assert_eq!(seen, f64::from(u8::from(form == other)));
                }
            }
        }
        let two = Designs::of(&[Channel::C1A, Channel::C2B]);
        let solvable: Vec<bool> = (0..4).map(|s| two.weights(s).is_some()).collect();
        assert_eq!(solvable, [false, false, false, true]);
    }
}
