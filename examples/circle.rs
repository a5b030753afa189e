//! The circle through points: radius with uncertainty and the minimum zone.

use errsep_models::circle::{CircleSimulation, circularity, orthogonal_fit, simulate};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let points = simulate(
        &CircleSimulation {
            lobes: vec![(3, 2.0, 0.0)],
            ..CircleSimulation::default()
        },
        1,
    )?;
    let fit = orthogonal_fit(&points, None)?;
    let [_, _, std] = fit.standard_uncertainties();
    println!(
        "radius {:.5} mm, standard uncertainty {std:.5} mm",
        fit.circle.radius
    );
    for zone in circularity(&points, fit.circle)?.zones() {
        println!("{} {:.3} µm", zone.reference.name(), zone.width_um);
    }
    Ok(())
}
