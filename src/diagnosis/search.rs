//! A derivative-free search for functions with kinks and steps.

/// Compass search: the smallest value found from a start, with a first step for each coordinate
/// (zero keeps it); steps are halved down to `precision` of their first length.
pub(super) fn compass(
    start: &[f64],
    steps: &[f64],
    precision: f64,
    mut value: impl FnMut(&[f64]) -> f64,
) -> (Vec<f64>, f64) {
    let mut at = start.to_vec();
    let mut best = value(&at);
    let mut scale = 1.0;
    let mut left = 400;
    while scale > precision && left > 0 {
        let mut improved = false;
        for (k, step) in steps.iter().enumerate().filter(|(_, s)| **s != 0.0) {
            for sign in [1.0, -1.0] {
                let mut trial = at.clone();
                trial[k] += sign * scale * step;
                left -= 1;
                let found = value(&trial);
                if found < best {
                    // Keep going while it pays.
                    (at, best) = (trial, found);
                    improved = true;
                    break;
                }
            }
        }
        if !improved {
            scale *= 0.5;
        }
    }
    (at, best)
}
