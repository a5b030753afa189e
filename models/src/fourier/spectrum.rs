//! Fourier coefficients as means over the section: F(ω) = mean of f e^{−jωθ}.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;

/// Coefficients of orders 0 to `orders` of an evenly sampled period. `orders` is less than half the
/// number of samples.
pub(super) fn coefficients(values: &[f64], orders: usize) -> Vec<Complex64> {
    let n = values.len();
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(n);
    let mut input = values.to_vec();
    let mut output = transform.make_output_vec();
    // The lengths come from the plan itself, the only thing that `process` can refuse.
    if transform.process(&mut input, &mut output).is_err() {
        return vec![Complex64::default(); orders + 1];
    }
    output.resize(orders + 1, Complex64::default());
    for c in &mut output {
        *c /= n as f64;
    }
    output
}

/// The period of `n` samples with these coefficients, orders 0, 1, …; the mean is their real part at
/// order 0.
pub(super) fn profile(coefficients: &[Complex64], n: usize) -> Vec<f64> {
    let transform = RealFftPlanner::<f64>::new().plan_fft_inverse(n);
    let mut input = transform.make_input_vec();
    for (slot, c) in input.iter_mut().zip(coefficients) {
        *slot = *c;
    }
    if let Some(mean) = input.first_mut() {
        mean.im = 0.0;
    }
    let mut output = transform.make_output_vec();
    if transform.process(&mut input, &mut output).is_err() {
        return vec![0.0; n];
    }
    output
}
