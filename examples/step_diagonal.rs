//! What a step-diagonal test determines, and what it cannot tell apart.

use errsep_models::diagonal::{Assumptions, DiagonalSimulation, regress, simulate};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let what = DiagonalSimulation::default();
    let (readings, _, _) = simulate(&what, 1);
    let fit = regress(&what.zone, &readings, &Assumptions::default())?;
    for c in &fit.components {
        println!("{} {}", c.component.name(), c.determined.words());
    }
    for ambiguity in &fit.ambiguities {
        println!("{}", ambiguity.statement);
    }
    Ok(())
}
