//! What cannot be solved, and what a fit that is broken off says.

use super::*;

/// What cannot be solved is told.
#[test]
fn endings_are_told() {
    let (good, _) = simulate(&plan(EIGHT)).unwrap();
    let spoiled = |spoil: &dyn Fn(&mut DesignReading)| {
        let mut bad = good.clone();
        bad.readings.iter_mut().for_each(spoil);
        fit(&bad, &options(8)).unwrap_err()
    };
    let one = spoiled(&|r| {
        if r.channel == 3 {
            r.x = 7.0;
        }
    });
    assert!(
        matches!(&one, DesignFitError::OnePosition { channel, .. } if channel == "270/0"),
        "{one}"
    );
    let steep = spoiled(&|r| {
        if r.channel == 2 {
            r.value = 2e3 * r.x;
        }
    });
    assert!(
        matches!(&steep, DesignFitError::TooSteep { channel, .. } if channel == "90/0"),
        "{steep}"
    );
    let nan = spoiled(&|r| r.value = f64::NAN);
    assert!(matches!(nan, DesignFitError::NotUsable { .. }), "{nan}");
    let mut few = good.clone();
    few.readings.retain(|r| r.channel != 5);
    let none = fit(&few, &options(8)).unwrap_err();
    assert!(matches!(none, DesignFitError::NoReading { .. }), "{none}");
    let many = fit(&good, &options(400)).unwrap_err();
    assert!(
        matches!(many, DesignFitError::TooManyKnots { most: 58, .. }),
        "{many}"
    );
}

#[test]
fn a_prediction_and_its_residual_make_the_reading() {
    let (made, _) = simulate(&DesignPlan {
        slopes_rad: [2e-3, -1e-3, 3e-3, 1e-3, 5e-4, 0.0, 0.0],
        length_mm: 200.0,
        positions: 31,
        noise_um: 0.1,
        seed: 5,
        ..plan("0/0,90/0,120/0,0/180,90/180,120/180")
    })
    .unwrap();
    let options = DesignOptions {
        thickness_mm: 40.0,
        ..DesignOptions::default()
    };
    let found = fit(&made, &options).unwrap();
    for (reading, residual) in made.readings.iter().zip(&found.residuals) {
        let predicted = found.predict(reading.channel, reading.x).unwrap();
        // ε·κ: readings of 1e3 µm, the point of contact by two ways of finding it.
        assert!(
            (predicted + residual - reading.value).abs() < 1e-8,
            "{reading:?}: {predicted} {residual}"
        );
    }
    assert!(found.predict(6, 0.0).is_err());
}

/// A fit that is broken off says where it stood: no value of it is an answer.
#[test]
fn a_fit_that_is_broken_off_says_where_it_stood() {
    let (observations, _) = simulate(&plan(EIGHT)).unwrap();
    let mut options = options(8);
    options.minimisation.max_iterations = 1;
    let Err(DesignFitError::NotConverged { ending, reached }) = fit(&observations, &options) else {
        panic!("one step of a search that begins far away is no minimum");
    };
    assert!(!ending.is_empty());
    let names: Vec<&str> = reached.tilts.iter().map(|(name, _)| &name[..]).collect();
    assert!(
        names.starts_with(&["gamma_1", "gamma_2", "cone"]),
        "{names:?}"
    );
    assert!(reached.tilts.iter().all(|(_, rad)| rad.abs() < 1.0));
    assert!(reached.residual_rms_um.is_some_and(f64::is_finite));
    assert_eq!((reached.thickness_mm, reached.iterations), (None, 1));
}
