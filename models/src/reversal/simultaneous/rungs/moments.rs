//! The moments of the readings of a stretch.

use errsep_solvers::by_processor;

/// A stretch of a channel between two breaks: its readings in moments of t = (x − start)/width.
pub struct Stretch {
    pub start: f64,
    pub width: f64,
    /// The cells of the slide's form and of the artefact's.
    pub slide: usize,
    pub side: usize,
    /// Σ tᵖ.
    pub powers: [f64; 7],
    /// Σ tᵖ r₀.
    pub left: [f64; 4],
}

/// Readings taken together.
const LANES: usize = 4;

by_processor! {
    /// Puts the moments of the readings at x into their stretch.
    pub fn gather(stretch: &mut Stretch, x: &[f64], left: &[f64]) from gather_generic
}

#[inline(always)]
fn gather_generic<const FMA: bool>(stretch: &mut Stretch, x: &[f64], left: &[f64]) {
    let (start, per_width) = (stretch.start, 1.0 / stretch.width);
    let mut sums = [[0.0; LANES]; 11];
    let (whole, last) = x.as_chunks::<LANES>();
    let (whole_left, last_left) = left.as_chunks::<LANES>();
    for (x, left) in whole.iter().zip(whole_left) {
        add_powers(&mut sums, (x, left, &[1.0; LANES]), start, per_width);
    }
    if !last.is_empty() {
        let mut padded = [[0.0; LANES]; 3];
        padded[0][..last.len()].copy_from_slice(last);
        padded[1][..last.len()].copy_from_slice(last_left);
        padded[2][..last.len()].fill(1.0);
        let padded = (&padded[0], &padded[1], &padded[2]);
        add_powers(&mut sums, padded, start, per_width);
    }
    let sum = |lanes: [f64; LANES]| (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
    for p in 0..7 {
        stretch.powers[p] = sum(sums[p]);
    }
    for p in 0..4 {
        stretch.left[p] = sum(sums[7 + p]);
    }
}

/// Adds the powers of t of some readings and their products with what is left of these.
#[inline(always)]
fn add_powers(
    sums: &mut [[f64; LANES]; 11],
    (x, left, one): (&[f64; LANES], &[f64; LANES], &[f64; LANES]),
    start: f64,
    per_width: f64,
) {
    for l in 0..LANES {
        let t = one[l] * ((x[l] - start) * per_width);
        let t2 = t * t;
        let t3 = t2 * t;
        let powers = [one[l], t, t2, t3, t2 * t2, t2 * t3, t3 * t3];
        for p in 0..7 {
            sums[p][l] += powers[p];
        }
        for p in 0..4 {
            sums[7 + p][l] += powers[p] * left[l];
        }
    }
}
