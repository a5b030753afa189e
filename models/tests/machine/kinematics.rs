//! The chain of slides against the equations of both sources, and finite against infinitesimal
//! rotations.

use std::collections::HashMap;

use errsep_models::machine::names::{NAMES, names_of};
use errsep_models::machine::{
    COMPONENTS, Chain, Component, ComponentError, ErrorFunction, Kind, Machine, Position, Sense,
    Spread, exact_deviation, sensitivity,
};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Values of the symbols of a source from those of the ISO components.
fn symbols(
    errors: &[f64; 21],
    name: impl Fn(&Component) -> (&'static str, f64),
) -> HashMap<&'static str, f64> {
    COMPONENTS
        .iter()
        .map(|c| {
            let (symbol, sign) = name(c);
            // Rotations act on mm and give mm; the deviations are um.
            let scale = if c.kind == Kind::Translation {
                1.0
            } else {
                1e3
            };
            (symbol, errors[c.index()] * sign * scale)
        })
        .collect()
}

/// NISTIR 6868, equation (9): the workpiece seen from the tool of the machine XYFZ.
fn nistir_equation_9(errors: &[f64; 21], p: &Position) -> Vector3<f64> {
    let s = symbols(errors, |c| (names_of(*c).nistir, names_of(*c).nistir_sign));
    let (x, y, z) = (p.x, p.y, p.z);
    Vector3::new(
        y * s["epsilon_z(y)"]
            + z * s["epsilon_y(y)"]
            + s["delta_x(y)"]
            + y * s["epsilon_z(x)"]
            + s["delta_x(x)"]
            - s["delta_x(z)"]
            - y * s["alpha_x(y)"]
            + z * s["alpha_x(z)"]
            + z * s["epsilon_y(x)"],
        s["delta_y(y)"] - x * s["epsilon_z(x)"] + s["delta_y(x)"]
            - z * s["epsilon_x(y)"]
            - s["delta_y(z)"]
            + z * s["alpha_y(z)"]
            - z * s["epsilon_x(x)"],
        -y * s["epsilon_x(y)"] + s["delta_z(y)"] + x * s["epsilon_y(x)"] - y * s["epsilon_x(x)"]
            + s["delta_z(x)"]
            - s["delta_z(z)"],
    )
}

/// Soons, equation (1): the tool of the machine FXYZ.
fn soons_equation_1(errors: &[f64; 21], p: &Position) -> Vector3<f64> {
    let s = symbols(errors, |c| (names_of(*c).soons, names_of(*c).soons_sign));
    let (y, z) = (p.y, p.z);
    Vector3::new(
        s["e_x(x)"] + s["e_x(y)"] + s["e_x(z)"] + (s["E_y(x)"] + s["E_y(y)"] - s["S_xz"]) * z
            - (s["E_z(x)"] + s["S_xy"]) * y,
        s["e_y(x)"] + s["e_y(y)"] + s["e_y(z)"] - (s["E_x(x)"] + s["E_x(y)"] + s["S_yz"]) * z,
        s["e_z(x)"] + s["e_z(y)"] + s["e_z(z)"] + s["E_x(x)"] * y,
    )
}

fn first_order(chain: &Chain, errors: &[f64; 21], p: &Position, sense: Sense) -> Vector3<f64> {
    COMPONENTS.iter().fold(Vector3::zeros(), |sum, c| {
        sum + sensitivity(chain, *c, p, sense) * errors[c.index()]
    })
}

fn close(a: &Vector3<f64>, b: &Vector3<f64>, tolerance: f64) -> bool {
    (a - b).amax() <= tolerance
}

fn xyfz() -> Chain {
    Chain::parse("XYFZ").unwrap()
}

fn fxyz() -> Chain {
    Chain::parse("FXYZ").unwrap()
}

#[test]
fn every_sign_of_the_table_of_names() {
    // Each error alone, at a point whose coordinates differ. Epsilons: products of two numbers.
    let p = Position::new(310.0, -170.0, 90.0);
    for component in COMPONENTS {
        let mut errors = [0.0; 21];
        errors[component.index()] = if component.kind == Kind::Translation {
            2.0
        } else {
            3e-5
        };
        let report = first_order(&xyfz(), &errors, &p, Sense::Work);
        let printed = nistir_equation_9(&errors, &p);
        assert!(
            close(&report, &printed, 1e-12),
            "{component}: {report} is not {printed}"
        );
        let tool = first_order(&fxyz(), &errors, &p, Sense::Tool);
        let printed = soons_equation_1(&errors, &p);
        assert!(
            close(&tool, &printed, 1e-12),
            "{component}: {tool} is not {printed}"
        );
    }
}

#[test]
fn names_stand_in_the_order_of_the_components() {
    for (component, names) in COMPONENTS.iter().zip(&NAMES) {
        assert_eq!(component.to_string(), names.iso);
        assert_eq!(names.iso.parse::<Component>().unwrap(), *component);
        assert_eq!(COMPONENTS[component.index()], *component);
    }
    let unique: std::collections::HashSet<&str> = NAMES
        .iter()
        .flat_map(|n| [n.iso, n.soons, n.nistir])
        .collect();
    assert_eq!(unique.len(), 63);
    assert!("EXW".parse::<Component>().is_err() && "".parse::<Component>().is_err());
}

fn any_errors() -> impl Strategy<Value = [f64; 21]> {
    prop::array::uniform21(-1.0..1.0_f64).prop_map(|mut e| {
        for c in COMPONENTS {
            e[c.index()] *= if c.kind == Kind::Translation {
                20.0
            } else {
                1e-4
            };
        }
        e
    })
}

fn any_position() -> impl Strategy<Value = Position> {
    prop::array::uniform3(-500.0..500.0_f64).prop_map(|[x, y, z]| Position::new(x, y, z))
}

proptest! {
    #[test]
    fn general_chain_reduces_to_the_printed_equations(e in any_errors(), p in any_position()) {
        let report = first_order(&xyfz(), &e, &p, Sense::Work);
        prop_assert!(close(&report, &nistir_equation_9(&e, &p), 1e-10));
        let tool = first_order(&fxyz(), &e, &p, Sense::Tool);
        prop_assert!(close(&tool, &soons_equation_1(&e, &p), 1e-10));
    }

    #[test]
    fn planar_machine_is_equation_10(e in any_errors(), x in -500.0..500.0, y in -500.0..500.0) {
        // Equation (10) keeps no term with z and no function of z.
        let mut planar = e;
        for c in COMPONENTS {
            if c.axis == errsep_models::machine::Axis::Z {
                planar[c.index()] = 0.0;
            }
        }
        let p = Position::new(x, y, 0.0);
        let found = first_order(&xyfz(), &planar, &p, Sense::Work);
        let value = |name: &str| planar[name.parse::<Component>().unwrap().index()];
        let (ecx, ecy, square) = (value("ECX") * 1e3, value("ECY") * 1e3, value("C0Y") * 1e3);
        let ex = y * ecy + value("EXY") + y * ecx + value("EXX") - y * square;
        let ey = value("EYY") - x * ecx + value("EYX");
        prop_assert!((found.x - ex).abs() < 1e-10 && (found.y - ey).abs() < 1e-10);
    }

    #[test]
    fn finite_rotations_differ_by_the_second_order(
        e in any_errors(),
        p in any_position(),
        order in prop::sample::select(vec!["FXYZ", "XYFZ", "XFYZ", "YXZF", "ZFXY"]),
        work in any::<bool>(),
    ) {
        // Truncation: halving every error quarters what first order leaves out, up to the third
        // order, which is at most (sum of angles)³/6 of the arm (and (sum)²/2 of the errors).
        let chain = Chain::parse(order).unwrap().with_tool_offset(Vector3::new(5.0, -7.0, -120.0));
        let chain = chain.unwrap();
        let sense = if work { Sense::Work } else { Sense::Tool };
        let rest = |scale: f64| {
            let e = e.map(|v| v * scale);
            exact_deviation(&chain, &e, &p, sense) - first_order(&chain, &e, &p, sense)
        };
        let (whole, half) = (rest(1.0), rest(0.5));
        prop_assert!(whole.amax() < 1.0, "{whole}");
        let sum = |kind: fn(&Component) -> bool| -> f64 {
            COMPONENTS.iter().filter(|c| kind(c)).map(|c| e[c.index()].abs()).sum()
        };
        let angles = sum(|c| c.kind != Kind::Translation);
        let arm = 1e3 * (p.x.abs() + p.y.abs() + p.z.abs() + 132.0);
        let third = arm * angles.powi(3) / 6.0
            + sum(|c| c.kind == Kind::Translation) * angles.powi(2) / 2.0;
        prop_assert!((half * 4.0 - whole).amax() < third + 1e-9, "{half} {whole} {third}");
    }
}

#[test]
fn a_large_yaw_turns_the_arm_exactly() {
    // Epsilons: yaw of X by 0.3 rad turns the arm (0, 200, 0) mm of the tool about Z.
    let mut errors = [0.0; 21];
    errors["ECX".parse::<Component>().unwrap().index()] = 0.3;
    let p = Position::new(50.0, 200.0, 0.0);
    let found = exact_deviation(&fxyz(), &errors, &p, Sense::Tool);
    let expected = Vector3::new(-200e3 * 0.3_f64.sin(), 200e3 * (0.3_f64.cos() - 1.0), 0.0);
    assert!(close(&found, &expected, 1e-9), "{found}");
}

#[test]
fn coordinates_of_the_tool_turn_the_table_round() {
    // A table that is 0.1 % long carries the workpiece too far; the tool, seen from the workpiece,
    // is then too far on by the same amount in the coordinate of ISO 841.
    let scale = ErrorFunction::polynomial(vec![0.0, 1.0]);
    let table = |chain: Chain| {
        let error = ComponentError {
            component: "EXX".parse().unwrap(),
            function: scale.clone(),
            spread: Spread::none(),
        };
        Machine::new(chain, Sense::Tool, vec![error]).unwrap()
    };
    let at = Position::new(100.0, 0.0, 0.0);
    let slide = table(Chain::parse("XFYZ").unwrap());
    assert_eq!(slide.deviation(&at).unwrap().x, -100.0);
    // Reversed coordinate, the function still of the coordinate: the slide at -100 mm that errs by
    // +100 um falls short, and so does the tool.
    let tool = table(Chain::parse("XFYZ").unwrap().with_tool_coordinates());
    assert_eq!(tool.deviation(&at).unwrap().x, -100.0);
    let square = |chain: Chain| {
        let error = ComponentError {
            component: "C0Y".parse().unwrap(),
            function: ErrorFunction::constant(1e-5),
            spread: Spread::none(),
        };
        Machine::new(chain, Sense::Tool, vec![error]).unwrap()
    };
    // The path of Y turned by 10 urad: as a carrier of the tool and as a table in the coordinate of
    // the tool it moves the tool by the same amount.
    let at = Position::new(0.0, 100.0, 0.0);
    let carried = square(fxyz()).deviation(&at).unwrap();
    let table = square(Chain::parse("YFXZ").unwrap().with_tool_coordinates());
    assert_eq!(carried, table.deviation(&at).unwrap());
    assert!((carried.x + 1.0).abs() < 1e-12);
}

#[test]
fn chains_survive_writing_and_reading() {
    for text in ["FXYZ", "XYFZ", "XFYZ", "YXZF", "ZYFX"] {
        assert_eq!(Chain::parse(text).unwrap().to_string(), text);
    }
    for text in ["", "XYZ", "FXY", "FXYZX", "XYFFZ", "FXYA", "fxyz", "FXYYZ"] {
        assert!(Chain::parse(text).is_err(), "{text}");
    }
}
