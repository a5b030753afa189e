//! Draws the forms of a reversal, with their bands, as an SVG file from the `result.json` that
//! `errsep reversal --out DIR` writes:
//!
//! ```text
//! errsep reversal data.csv --simultaneous --out result
//! cargo run --example forms_picture -- result/result.json forms.svg
//! ```

use std::error::Error;

use errsep::report::plot::{Axis, Chart, Plot, Series};
use serde_json::Value;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(result), Some(picture)) = (arguments.next(), arguments.next()) else {
        return Err("give the result.json to read and the SVG to write".into());
    };
    let result: Value = serde_json::from_str(&std::fs::read_to_string(result)?)?;
    let numbers = |name: &str| -> Vec<f64> {
        let values = result["forms"][name].as_array().into_iter().flatten();
        values.filter_map(Value::as_f64).collect()
    };
    let x = numbers("x");
    let chart = [
        ("M", "M, the slide"),
        ("S_A", "S_A, artefact"),
        ("S_B", "S_B, artefact"),
    ]
    .into_iter()
    .filter(|(name, _)| !numbers(name).is_empty())
    .fold(
        Chart::new(
            Axis::new("slide position x", "mm"),
            Axis::new("deviation from straight", "µm"),
        ),
        |chart, (name, shown)| {
            let half = numbers(&format!("{name}_std"))
                .iter()
                .map(|std| 1.96 * std)
                .collect();
            chart.series(Series::line(shown, x.clone(), numbers(name)).half_band(half))
        },
    );
    std::fs::write(picture, Plot::from(chart).to_svg())?;
    Ok(())
}
