//! The load cell of NIST StRD Pontius: figures known of it, and the diagnosis of its quadratic.

use errsep::diagnosis::{Kind, diagnose};
use errsep_models::calibration_line::{CalibrationLine, CalibrationReading};
use errsep_models::model::FittedModel;

use crate::models::options;

fn pontius() -> Option<Vec<CalibrationReading>> {
    let folder = std::env::var("ERRSEP_DATA").map_or_else(
        |_| std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        std::path::PathBuf::from,
    );
    let Ok(text) = std::fs::read_to_string(folder.join("nist_strd_linear/pontius.csv")) else {
        println!("skipped: nist_strd_linear/pontius.csv is not there (set ERRSEP_DATA)");
        return None;
    };
    let rows = text
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()));
    let readings = rows.map(|line| {
        let fields: Vec<f64> = line.split(',').map(|f| f.trim().parse().unwrap()).collect();
        CalibrationReading {
            x: fields[1],
            y: fields[2],
            set: fields[0] as u32,
            time: None,
        }
    });
    Some(readings.collect())
}

fn close(found: f64, known: f64, digits: i32) -> bool {
    (found / known - 1.0).abs() < 0.5 * 10f64.powi(1 - digits)
}

/// NIST StRD Pontius, a load cell: the figures known of it, to the digits known (other tool: NumPy).
#[test]
fn the_load_cell_of_pontius_is_bent_and_nothing_else_fits() {
    let Some(readings) = pontius() else { return };
    let model = CalibrationLine::new(&readings, None).unwrap();
    let column = |name: &str, shape: Option<f64>| {
        let effects = model.effects();
        let effect = effects.iter().find(|e| e.name() == name).unwrap();
        let mut at = effect.grid(&model).remove(0);
        if let Some(value) = shape {
            at.values = vec![value];
        }
        effect.columns(&model, &at)[0].dense(readings.len())
    };
    let line = model.lack_of_fit(&[]).unwrap();
    assert_eq!(line.freedom, [18.0, 20.0]);
    assert!(close(line.f, 214.75, 5), "{line:?}");
    assert!(close(line.pure_error, 2.147e-4, 4));
    let bent = model.lack_of_fit(&[column("quadratic", None)]).unwrap();
    assert!(close(bent.f, 0.8107, 4), "{bent:?}");
    assert!(close(bent.p_value, 0.6662, 4));
    assert!(close(line.residual / bent.residual, 10.58, 4));
    // The certified residual standard deviation of the quadratic.
    assert!(close(bent.residual, 0.205_177_424_076_185e-3, 10));
    for (name, shape, p) in [
        ("saturation", Some(0.5), 2.294e-4),
        ("cubic", None, 2.119e-5),
        ("square-root", None, 1.100e-9),
        ("logarithmic", None, 2.041e-12),
    ] {
        let other = model.lack_of_fit(&[column(name, shape)]).unwrap();
        assert!(close(other.p_value, p, 4), "{name}: {}", other.p_value);
        // All of them are significant beyond doubt against pure error: F of one column.
        let drop = (38.0 * line.residual.powi(2) - 37.0 * other.residual.powi(2))
            / line.pure_error.powi(2);
        assert!(drop > 3000.0, "{name}: {drop}");
    }
    // Fitted on the first set, squared errors on the second.
    let held_out = |bend: bool| {
        let half: Vec<_> = readings.iter().filter(|r| r.set == 1).copied().collect();
        let rest: Vec<_> = readings.iter().filter(|r| r.set == 2).copied().collect();
        let terms = |x: f64| {
            let t = x / model.reach();
            [1.0, t, if bend { t * t } else { 0.0 }]
        };
        let design = nalgebra::DMatrix::from_fn(half.len(), 3, |i, j| terms(half[i].x)[j]);
        let right = nalgebra::DVector::from_iterator(half.len(), half.iter().map(|r| r.y));
        let fit = design.svd(true, true).solve(&right, 1e-12).unwrap();
        let sum: f64 = rest
            .iter()
            .map(|r| (r.y - (0..3).map(|j| fit[j] * terms(r.x)[j]).sum::<f64>()).powi(2))
            .sum();
        (sum / rest.len() as f64).sqrt()
    };
    assert!(close(held_out(false), 2.075e-3, 4));
    assert!(close(held_out(true), 2.363e-4, 4));
}

/// The quadratic of the same data, blind: named alone; withheld, no single effect explains them.
#[test]
fn the_quadratic_of_pontius_is_named_and_withheld_no_other_alone_is_blamed() {
    let Some(readings) = pontius() else { return };
    let model = CalibrationLine::new(&readings, None).unwrap();
    let found = diagnose(&model, &options(&[]));
    assert_eq!(
        found.verdict.effects,
        ["quadratic"],
        "{}",
        found.verdict.statement
    );
    assert!(found.verdict.indistinguishable.is_empty());
    let slope = found.bias.iter().find(|b| b.quantity == "slope").unwrap();
    assert!(close(slope.moved / slope.before, 0.01379, 4), "{slope:?}");
    assert!(found.gap.shrink > 0.9, "{:?}", found.gap);
    let withheld = diagnose(&model, &options(&["quadratic"]));
    // One alone does not do; a root and a cube together bend as a square does.
    let kind = withheld.verdict.kind;
    assert!(
        kind == Kind::Unknown || withheld.verdict.effects.len() > 1,
        "{}",
        withheld.verdict.statement
    );
}
