//! Tables of one axis: LinuxCNC, ISG leadscrew, Sinumerik EEC and CEC.

use errsep::export::{AxisErrors, Content, Grid, Request, StraightnessProfile, Unit};
use proptest::prelude::*;

use super::{export, lines};

/// An axis whose positions and errors are of any sign, evenly or unevenly spaced.
fn axes() -> impl Strategy<Value = AxisErrors> {
    let cells = prop::collection::vec((1.0..80.0f64, -0.05..0.05f64, -0.05..0.05f64), 2..40);
    (cells, -900.0..100.0f64).prop_map(|(cells, start)| {
        let mut position = start;
        let positions = cells.iter().map(|(step, ..)| {
            position += step;
            position
        });
        AxisErrors {
            name: Some("X".to_owned()),
            rotary: false,
            positions: positions.collect(),
            forward: cells.iter().map(|c| c.1).collect(),
            backward: cells.iter().map(|c| c.2).collect(),
            both: true,
            known: None,
        }
    })
}

/// Nominal position and what is added to it.
type Trims = Vec<(f64, f64)>;

/// `usrmotLoadComp` of type 0: line by line until one is not three numbers; 256 points, strictly
/// ascending. Gives trims: the motor stands at command + nominal − actual.
fn linuxcnc(text: &str) -> (Trims, Trims) {
    let (mut forward, mut reverse) = (Trims::new(), Trims::new());
    for line in text.lines() {
        let numbers: Vec<Result<f64, _>> =
            line.split_whitespace().take(3).map(str::parse).collect();
        let [Ok(nominal), Ok(f), Ok(r)] = numbers[..] else {
            break;
        };
        assert!(forward.len() < 256, "too many points");
        assert!(
            forward.last().is_none_or(|last| last.0 < nominal),
            "not ascending"
        );
        forward.push((nominal, nominal - f));
        reverse.push((nominal, nominal - r));
    }
    (forward, reverse)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn linuxcnc_compensates(axis in axes(), inch in any::<bool>()) {
        let unit = if inch { Unit::Inch } else { Unit::Mm };
        let request = Request { unit: Some(unit), ..Request::default() };
        let out = export("linuxcnc", &Content::Positioning(axis.clone()), &request).unwrap();
        let (scale, digit) = if inch { (25.4, 1e-8) } else { (1.0, 1e-6) };
        let (forward, reverse) = linuxcnc(&out.text);
        prop_assert_eq!(forward.len(), axis.positions.len());
        for (trims, errors) in [(&forward, &axis.forward), (&reverse, &axis.backward)] {
            for ((x, error), trim) in axis.positions.iter().zip(errors).zip(trims.iter()) {
                // Half the last digit of nominal and of actual, and epsilons of positions of 4000.
                let half = 0.5 * digit + 1e-12;
                prop_assert!((trim.0 - x / scale).abs() <= half);
                prop_assert!(((trim.0 - trim.1) - (x + error) / scale).abs() <= half);
                // Motor and screw together stand where they were told to: trims change by a tenth of a
                // millimetre a millimetre at most, so half a digit beside a nominal is a tenth of that.
                let motor = x / scale + lines(trims, x / scale);
                let slide = motor + error / scale;
                prop_assert!((slide - x / scale).abs() <= 2.1 * half);
            }
        }
        prop_assert!(out.rounding.0 <= 0.5 * digit + 1e-12);
    }

    #[test]
    fn isg_leadscrew_reads_back(axis in axes()) {
        let out = export("isg-leadscrew", &Content::Positioning(axis.clone()), &Request::default()).unwrap();
        let value = |key: &str| -> f64 {
            let mut found = out.text.lines().filter_map(|line| {
                let (name, value) = line.split_once(' ').unwrap();
                (name == key).then(|| value.parse().unwrap())
            });
            let one = found.next().unwrap_or_else(|| panic!("no {key}"));
            assert!(found.next().is_none(), "{key} twice");
            one
        };
        prop_assert_eq!(value("kw.ssfk.unit"), 1.0);
        prop_assert_eq!(value("kw.ssfk.interval"), 0.0);
        prop_assert_eq!(value("kw.ssfk.bilateral"), 1.0);
        prop_assert_eq!(value("kopf.log_achs_nr"), 1.0);
        prop_assert_eq!(value("kw.ssfk.kw_nr_max") as usize, axis.positions.len());
        prop_assert_eq!(value("kw.ssfk.kw_startpos"), value("kw.ssfk.table[0].setpoint"));
        for (i, x) in axis.positions.iter().enumerate() {
            for (name, expected) in [("setpoint", x), ("pos", &axis.forward[i]), ("neg", &axis.backward[i])] {
                let steps = value(&format!("kw.ssfk.table[{i}].{name}"));
                // Half of 0.1 µm, and epsilons.
                prop_assert!((steps * 1e-4 - expected).abs() <= 0.5e-4 + 1e-10, "{} {}", name, i);
            }
        }
    }

    #[test]
    fn siemens_eec_compensates(axis in axes(), points in 2usize..60, at in 0.0..1.0f64) {
        let (first, last) = (axis.positions[0], axis.positions[axis.positions.len() - 1]);
        let reference = first + at * (last - first);
        let request = Request {
            reference: Some(reference),
            grid: Some(Grid::Points(points)),
            ..Request::default()
        };
        let out = export("siemens-eec", &Content::Positioning(axis.clone()), &request).unwrap();
        let (table, step, ends) = eec(&out.text, "X1");
        prop_assert_eq!(table.len(), points);
        // MIN + (points − 1) STEP is MAX but for what rounding of the step sums up to.
        prop_assert!((ends.0 + step * (points - 1) as f64 - ends.1).abs() <= 0.5e-7 * points as f64 + 1e-7);
        let zip = |errors: &[f64]| -> Vec<(f64, f64)> {
            axis.positions.iter().copied().zip(errors.iter().copied()).collect()
        };
        let mean = |x: f64| 0.5 * (lines(&zip(&axis.forward), x) + lines(&zip(&axis.backward), x));
        for (i, value) in table.iter().enumerate() {
            let x = first + (last - first) * i as f64 / (points - 1) as f64;
            // A positive value moves the axis the negative way: what is left is what it was at the reference.
            let left = mean(x) - value;
            prop_assert!((left - mean(reference)).abs() <= 0.5e-7 + 1e-12, "{} {}", x, left);
        }
    }

    #[test]
    fn siemens_cec_reads_back(axis in axes(), points in 2usize..60) {
        let profile = StraightnessProfile {
            name: "straightness".to_owned(),
            positions: axis.positions.clone(),
            deviations: axis.forward.clone(),
            std: None,
        };
        let request = Request {
            axis: Some("X:Z".to_owned()),
            grid: Some(Grid::Points(points)),
            ..Request::default()
        };
        let out = export("siemens-cec", &Content::Straightness(profile), &request).unwrap();
        prop_assert!(out.text.starts_with("%_N_NC_CEC_INI\nCHANDATA(1)\n"));
        prop_assert!(out.text.contains("$AN_CEC_INPUT_AXIS[0]=(X1)\n$AN_CEC_OUTPUT_AXIS[0]=(Z1)\n"));
        prop_assert!(out.text.ends_with("M17\n"));
        let measured: Vec<(f64, f64)> = axis.positions.iter().copied().zip(axis.forward.iter().copied()).collect();
        let (first, last) = (axis.positions[0], axis.positions[axis.positions.len() - 1]);
        for i in 0..points {
            let key = format!("$AN_CEC[0,{i}]=");
            let line = out.text.lines().find_map(|l| l.strip_prefix(key.as_str())).unwrap();
            let x = first + (last - first) * i as f64 / (points - 1) as f64;
            let value: f64 = line.parse().unwrap();
            prop_assert!((value - lines(&measured, x)).abs() <= 0.5e-7 + 1e-12);
        }
        // The worst of the knots of what was measured, at one of them; epsilons.
        let table: Vec<(f64, f64)> = (0..points)
            .map(|i| first + (last - first) * i as f64 / (points - 1) as f64)
            .map(|x| (x, lines(&measured, x)))
            .collect();
        let worst = measured.iter().map(|(x, y)| (lines(&table, *x) - y).abs()).fold(0.0, f64::max);
        prop_assert_eq!(out.missed.len(), 1);
        prop_assert!((out.missed[0].value - 1e3 * worst).abs() < 1e-9);
        let there = measured.iter().find(|(x, _)| *x == out.missed[0].at).unwrap();
        prop_assert!(((lines(&table, there.0) - there.1).abs() - worst).abs() < 1e-12);
    }
}

/// The initialisation file of a Sinumerik: values in their order, step, and ends.
fn eec(text: &str, axis: &str) -> (Vec<f64>, f64, (f64, f64)) {
    let mut rows = text.lines();
    assert_eq!(rows.next(), Some("%_N_AX_EEC_INI"));
    assert_eq!(rows.next(), Some("CHANDATA(1)"));
    assert_eq!(text.lines().last(), Some("M17"));
    let of = |key: String| -> Option<f64> {
        let prefix = format!("{key}=");
        let mut found = text.lines().filter_map(|l| l.strip_prefix(prefix.as_str()));
        let value = found.next()?;
        assert!(found.next().is_none(), "{key} twice");
        Some(value.parse().unwrap())
    };
    let values = (0..)
        .map_while(|i| of(format!("$AA_ENC_COMP[0,{i},{axis}]")))
        .collect();
    let single = |name: &str| of(format!("$AA_ENC_COMP_{name}[0,{axis}]")).unwrap();
    assert_eq!(single("IS_MODULO"), 0.0);
    (values, single("STEP"), (single("MIN"), single("MAX")))
}

fn straight(count: usize) -> AxisErrors {
    let positions: Vec<f64> = (0..count).map(|i| i as f64).collect();
    AxisErrors {
        name: None,
        rotary: false,
        forward: positions.iter().map(|x| 1e-5 * x).collect(),
        backward: positions.iter().map(|x| 1e-5 * x + 0.004).collect(),
        positions,
        both: true,
        known: None,
    }
}

#[test]
fn a_reference_moves_both_directions_alike() {
    let request = Request {
        reference: Some(2.5),
        ..Request::default()
    };
    let out = export("linuxcnc", &Content::Positioning(straight(6)), &request).unwrap();
    let (forward, reverse) = linuxcnc(&out.text);
    // The mean of both directions is zero there, and half the reversal stays on either side.
    assert!((lines(&forward, 2.5) - 0.002).abs() < 1e-6);
    assert!((lines(&reverse, 2.5) + 0.002).abs() < 1e-6);
    let outside = Request {
        reference: Some(7.0),
        ..Request::default()
    };
    let message = export("linuxcnc", &Content::Positioning(straight(6)), &outside).unwrap_err();
    assert!(
        message.contains("outside the positions measured"),
        "{message}"
    );
}

#[test]
fn a_controller_keeps_so_many_points() {
    let content = Content::Positioning(straight(257));
    let message = export("linuxcnc", &content, &Request::default()).unwrap_err();
    assert!(
        message.contains("keeps 256 points") && message.contains("--points 256"),
        "{message}"
    );
    let fewer = Request {
        grid: Some(Grid::Points(256)),
        ..Request::default()
    };
    let out = export("linuxcnc", &content, &fewer).unwrap();
    assert_eq!(linuxcnc(&out.text).0.len(), 256);
    // A straight line loses nothing on another grid; tolerance: epsilons, in µm.
    assert!(out.missed.iter().all(|m| m.value < 1e-9));
    assert_eq!(out.missed.len(), 2);
    let step = Request {
        grid: Some(Grid::Step(2.0)),
        ..Request::default()
    };
    assert_eq!(
        linuxcnc(&export("linuxcnc", &content, &step).unwrap().text)
            .0
            .len(),
        129
    );
    for (grid, expected) in [
        (Grid::Step(2.5), "do not end at 256"),
        (Grid::Step(0.0), "does not fit"),
        (Grid::Step(f64::MIN_POSITIVE), "too many points"),
        (Grid::Points(1), "make no table"),
    ] {
        let request = Request {
            grid: Some(grid),
            ..Request::default()
        };
        let message = export("linuxcnc", &content, &request).unwrap_err();
        assert!(message.contains(expected), "{grid:?}: {message}");
    }
}

#[test]
fn what_a_format_cannot_hold_is_refused() {
    let mut rotary = straight(6);
    rotary.rotary = true;
    let rotary = Content::Positioning(rotary);
    let refused = |format: &str, content: &Content, request: Request| {
        export(format, content, &request).unwrap_err()
    };
    let axis = Request {
        axis: Some("4".to_owned()),
        ..Request::default()
    };
    assert!(refused("isg-leadscrew", &rotary, axis).contains("linear axis"));
    let inch = Request {
        unit: Some(Unit::Inch),
        ..Request::default()
    };
    assert!(refused("linuxcnc", &rotary, inch).contains("is of a linear axis"));
    let out = export("linuxcnc", &rotary, &Request::default()).unwrap();
    assert_eq!(out.unit, "deg");
    // Degrees have nine decimals.
    assert!(
        out.text.lines().next().unwrap().ends_with("0.004000000"),
        "{}",
        out.text
    );

    let linear = Content::Positioning(straight(6));
    assert!(refused("isg-leadscrew", &linear, Request::default()).contains("--axis N"));
    assert!(refused("siemens-eec", &linear, Request::default()).contains("--axis X1"));
    let hostile = Request {
        axis: Some("X1]=0\nM17".to_owned()),
        ..Request::default()
    };
    assert!(refused("siemens-eec", &linear, hostile).contains("--axis X1"));

    let mut uneven = straight(6);
    uneven.positions[2] = 2.4;
    let request = Request {
        axis: Some("X".to_owned()),
        ..Request::default()
    };
    let message = refused(
        "siemens-eec",
        &Content::Positioning(uneven.clone()),
        request.clone(),
    );
    assert!(
        message.contains("evenly spaced") && message.contains("--points"),
        "{message}"
    );
    uneven.positions[2] = 1.00001;
    assert!(
        refused("isg-leadscrew", &Content::Positioning(uneven), request).contains("within 0.1 um")
    );
    let travel = Request {
        travel: vec![('X', 0.0, 1.0)],
        ..Request::default()
    };
    assert!(refused("linuxcnc", &linear, travel).contains("no use for --travel"));
}
