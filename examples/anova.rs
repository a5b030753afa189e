//! How much do parts differ, and how much of what is seen is only the measurement?
//!
//!     cargo run --example anova

use errsep_models::anova::{Group, Groups, analyse};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let parts = [
        ("A", vec![8.4, 6.1, 6.0]),
        ("B", vec![-3.9, -3.6]),
        ("C", vec![21.6, 22.5]),
        ("D", vec![5.4, 4.2, 4.9]),
    ];
    let groups = parts
        .into_iter()
        .map(|(name, readings)| Group {
            name: name.into(),
            readings,
        })
        .collect();
    let found = analyse(&Groups::new(groups)?, "um", 0.95)?;

    println!(
        "mean  {:.2} ± {:.2} um",
        found.mean.value, found.mean.standard_uncertainty
    );
    if let (Some(parts), Some(measurement)) = (found.components.between, found.components.within) {
        println!("from part to part  {:.2} um", parts.standard_deviation);
        println!(
            "one measurement    {:.2} um",
            measurement.standard_deviation
        );
    }
    if let Some(budget) = found.future_reading {
        println!(
            "the next part reads within ± {:.1} um (k = 1):",
            budget.result.standard_uncertainty
        );
        for row in budget.contributions {
            println!("  {:15} {:5.1} %", row.input.label, 100.0 * row.share);
        }
    }
    Ok(())
}
