//! Straightness and tilt of a slide from four sensors, from the library.
//!
//! `cargo run --example four_sensor`

use std::error::Error;

use errsep_models::four_sensor::simulate::{Disturbances, Example, simulate};
use errsep_models::four_sensor::{Geometry, Line, Parabola, Penalised, Separator, Settings};

fn main() -> Result<(), Box<dyn Error>> {
    // Sensors 5, 5 and 25 mm apart, read every 5 mm at 62 slide positions.
    let geometry = Geometry::new(5.0, [1, 1, 5], 62)?;
    let truth = Example::of(&geometry);
    let outputs = simulate(&geometry, &truth, &Disturbances::noise(0.1), 1)?;

    let separator = Separator::new(&geometry, Penalised::Profile, Line::EndPoints)?;
    let found = separator.separate(&outputs, &Settings::default())?;
    println!(
        "lambda {:.2e} by {}",
        found.chosen.point.lambda, found.chosen.rule
    );
    for n in [0, 20, 40, 61] {
        println!(
            "x {:5.0} mm  S {:7.3} um (u {:.3})  gamma {:8.2} urad (u {:.2})",
            outputs.slide_positions()[n],
            found.straightness.values[n],
            found.straightness.std[n],
            1e6 * found.tilt.values[n],
            1e6 * found.tilt.std[n],
        );
    }
    println!("{}", Parabola::LeastNorm.statement());
    Ok(())
}
