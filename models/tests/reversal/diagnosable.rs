//! The linearised reversal that the diagnosis judges, against readings in exact geometry.

use errsep_models::model::FittedModel;
use errsep_models::reversal::diagnosable::{Assumptions, Linearised};
use errsep_models::reversal::simulate::{Plan, TrueForm, Wave, simulate};

/// A wave of a form.
fn wave(amplitude: f64, wavelength: f64, phase_rad: f64) -> TrueForm {
    TrueForm::Waves(vec![Wave {
        amplitude,
        wavelength,
        phase_rad,
    }])
}

/// An artefact of 60 mm that stands 8 mrad oblique, without noise.
fn oblique() -> Plan {
    Plan {
        alpha_rad: 5e-4,
        beta_rad: 2e-4,
        gamma_rad: 8e-3,
        thickness_mm: 60.0,
        m: wave(0.5, 70.0, 0.3),
        s_a: wave(0.4, 50.0, 1.1),
        s_b: wave(0.6, 40.0, 2.0),
        ..Plan::even(0.0, 300.0, 301, 0.0)
    }
}

fn linearised(plan: &Plan) -> Linearised {
    let (readings, _) = simulate(plan, &[]).unwrap();
    let assumptions = Assumptions {
        thickness: Some(plan.thickness_mm),
        noise: Some(0.001),
        ..Assumptions::default()
    };
    Linearised::new(&readings, assumptions).unwrap()
}

/// What the exact geometry does is no gap. Tolerance: the points touched lie 0.24 mm apart in the two
/// spindle positions, and the forms are those of their mean: a second difference of it, S″·0.24²/8 of a
/// wave of 0.6 µm over 40 mm, 1.1e-4 µm.
#[test]
fn the_exact_geometry_leaves_no_closure() {
    let plan = oblique();
    let model = linearised(&plan);
    let readings = model.linearised();
    let n = model.positions().len();
    let mut closure = vec![0.0; n];
    for (k, place) in model.places().iter().enumerate() {
        closure[place.cell % n] += model.seat(place).theta[0] * readings[k] / 4.0;
    }
    let middle = 0.5 * (n as f64 - 1.0);
    let mean = closure.iter().sum::<f64>() / n as f64;
    let (product, spread) = (0..n).fold((0.0, 0.0), |(p, s), k| {
        let d = k as f64 - middle;
        (p + d * (closure[k] - mean), s + d * d)
    });
    let left = (0..n)
        .map(|k| (closure[k] - mean - product / spread * (k as f64 - middle)).abs())
        .fold(0.0, f64::max);
    assert!(left < 1.1e-4, "{left} µm");
}

/// The tilts are those of the readings' truth. Tolerance: as above, over the travel.
#[test]
fn the_exact_geometry_leaves_the_tilts() {
    let plan = oblique();
    let model = linearised(&plan);
    let readings = model.linearised();
    let truths = [plan.alpha_rad, plan.beta_rad, plan.gamma_rad];
    for (quantity, truth) in model.quantities().iter().zip(truths) {
        let value = quantity.weights.dot(&readings);
        assert!(
            (value - truth).abs() < 1e-9,
            "{}: {value} for {truth} rad",
            quantity.name
        );
    }
}
