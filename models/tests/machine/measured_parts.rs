//! A fixed machine against measured parts: what the diagnosis gets to see.

use errsep_models::machine::{
    Chain, ComponentError, ErrorFunction, Machine, MeasuredParts, Position, Sense, Spread,
    simulate_parts,
};
use errsep_models::model::{FittedModel, Shape};

fn machine() -> Machine {
    let error = |name: &str, coefficients: Vec<f64>| ComponentError {
        component: name.parse().unwrap(),
        function: ErrorFunction::polynomial(coefficients),
        spread: Spread::none(),
    };
    let errors = vec![
        error("EXX", vec![0.5, -0.02]),
        error("EYY", vec![0.0, 0.01]),
    ];
    Machine::new(Chain::parse("FXYZ").unwrap(), Sense::Tool, errors).unwrap()
}

fn parts() -> MeasuredParts {
    let holes: Vec<(String, Position)> = [(10.0, 10.0), (140.0, 10.0), (140.0, 120.0)]
        .iter()
        .enumerate()
        .map(|(i, (x, y))| (format!("hole {i}"), Position::new(*x, *y, 0.0)))
        .collect();
    let readings = simulate_parts(&machine(), &holes, 4, 2, 0.0, 1).unwrap();
    MeasuredParts::new(&machine(), readings).unwrap()
}

#[test]
fn traces_are_directions_of_replicates_of_parts() {
    let model = parts();
    assert_eq!(model.observed().len(), 4 * 3 * 2 * 2);
    assert_eq!(model.traces().len(), 4 * 2 * 2);
    for trace in model.traces() {
        let readings = &model.readings()[trace.clone()];
        let first = &readings[0];
        assert!(
            readings
                .iter()
                .all(|r| (&r.part, r.replicate, r.axis)
                    == (&first.part, first.replicate, first.axis))
        );
    }
    let cells: std::collections::HashSet<usize> = model.places().iter().map(|p| p.cell).collect();
    // Four parts of three holes in two directions.
    assert_eq!(cells.len(), 4 * 3 * 2);
    assert_eq!(model.freedom().columns.ncols(), 0);
}

#[test]
fn parts_of_the_machine_leave_nothing() {
    // Exact limit: no scatter and no noise.
    assert_eq!(parts().linearised().amax(), 0.0);
}

#[test]
fn each_effect_moves_the_points_as_it_says() {
    let model = parts();
    let mut names = Vec::new();
    for effect in model.effects() {
        names.push(effect.name().to_owned());
        let shape = Shape::only();
        let columns = effect.columns(&model, &shape);
        assert_eq!(
            columns.len() % effect.amplitudes().len(),
            0,
            "{}",
            effect.name()
        );
        if effect.name() == "angular-error-times-height" {
            // The parts are flat: no height, no lever.
            assert_eq!(columns[0].rows.len(), 0);
            continue;
        }
        // What is added to the readings comes back from them; epsilons of readings of 1 um.
        let added = columns[0].dense(model.observed().len()) * 1e-6;
        let moved = model.refit(model.observed() + &added);
        assert!(
            (moved.linearised() - &added).amax() < 1e-14,
            "{}",
            effect.name()
        );
        assert!(added.amax() > 0.0);
    }
    assert_eq!(
        names,
        [
            "angular-error-times-height",
            "axis-scale",
            "bad-part",
            "datum-offset",
            "datum-rotation",
            "part-rotation",
            "part-temperature",
            "part-zero",
            "squareness-change",
            "thermal-expansion",
        ]
    );
}

#[test]
fn a_turned_frame_keeps_lengths_and_a_warm_part_does_not() {
    let model = parts();
    let effect = |name: &str| {
        let effects = model.effects();
        let found = effects.iter().find(|e| e.name() == name).unwrap();
        found.columns(&model, &Shape::only())[0].dense(model.observed().len())
    };
    // Signed displacement of a point along the line from the first hole to the third, um: the
    // direction of that line has the components 130 and 110 mm.
    let stretch = |column: &nalgebra::DVector<f64>| {
        let at = |hole: &str, axis| {
            let place = model
                .readings()
                .iter()
                .position(|r| r.feature == hole && r.axis == axis);
            column[place.unwrap()]
        };
        use errsep_models::machine::Axis::{X, Y};
        130.0 * (at("hole 2", X) - at("hole 0", X)) + 110.0 * (at("hole 2", Y) - at("hole 0", Y))
    };
    assert_eq!(stretch(&effect("datum-rotation")), 0.0);
    assert_eq!(stretch(&effect("datum-offset")), 0.0);
    let squared_um = (130.0_f64.powi(2) + 110.0_f64.powi(2)) * 1e3;
    assert!((stretch(&effect("thermal-expansion")) - squared_um).abs() < 1e-6);
}
