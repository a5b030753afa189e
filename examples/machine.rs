//! What do positioning, straightness and squareness errors do to the distance of two holes?
//!
//!     cargo run --example machine

use errsep_models::machine::features::length;
use errsep_models::machine::{
    Chain, ComponentError, ErrorFunction, Independence, Machine, Observation, Position, Prediction,
    Sense, Spread, fit_component, propagate,
};
use errsep_models::uncertainty::DegreesOfFreedom;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Positioning of X, read at six stations: a line is fitted, its scatter becomes uncertainty.
    let positioning: Vec<Observation> = [0.1, -1.2, -1.8, -3.1, -3.6, -4.9]
        .into_iter()
        .enumerate()
        .map(|(i, value)| Observation {
            position: 50.0 * i as f64,
            value,
            repeat: 0,
        })
        .collect();
    // Squareness of Y to X from its certificate, 15 ± 3 urad.
    let squareness = ComponentError {
        component: "C0Y".parse()?,
        function: ErrorFunction::constant(15e-6),
        spread: Spread::scatter(3e-6, DegreesOfFreedom::Infinite),
    };
    // X and Y carry the workpiece, Z the tool; coordinates are those of the tool.
    let machine = Machine::new(
        Chain::parse("XYFZ")?.with_tool_coordinates(),
        Sense::Tool,
        vec![fit_component("EXX".parse()?, &positioning, 1)?, squareness],
    )?;

    let (a, b) = (
        Position::new(20.0, 20.0, 0.0),
        Position::new(220.0, 140.0, 0.0),
    );
    let functional = length(&machine, &a, &b)?;
    let budget = propagate(
        &machine,
        &functional,
        Independence::Scatter,
        Prediction::Future,
    )?;
    let expanded = budget.result.expanded(0.95)?;
    println!(
        "length error {:.2} um, U = {:.2} um (k = {:.2})",
        budget.result.value, expanded.expanded_uncertainty, expanded.coverage_factor
    );
    for row in &budget.contributions {
        println!(
            "  {}  {:5.2} um  {:5.1} %",
            row.input.label,
            row.contribution,
            100.0 * row.share
        );
    }
    Ok(())
}
