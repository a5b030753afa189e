//! Straightness from three probe spacings, combined by least squares.

use errsep_models::fourier::{
    Combination, Compensation, FourierSimulation, Section, separate, simulate, straightness,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (scans, truth) = simulate(&FourierSimulation::default(), 1)?;
    let section = Section {
        length: 100.0,
        orders: 30,
    };
    let found = separate(
        &scans,
        section,
        Compensation::Fitted,
        Combination::LeastSquares,
        None,
    )?;
    let actual = straightness(&truth.x, &truth.workpiece);
    let greatest = found
        .straightness
        .iter()
        .zip(&actual)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    println!(
        "noise {:.2} µm, greatest error {greatest:.2} µm",
        found.noise.0
    );
    Ok(())
}
