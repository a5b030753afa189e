//! Squareness: the firmware's own shear, applied to a machine that errs, leaves a square one.

use errsep::export::{Content, MachineErrors, Request};
use errsep_models::machine::{
    Chain, ComponentError, ErrorFunction, Machine, Position, Sense, Spread,
};
use proptest::prelude::*;

use super::export;

/// x' = x − xy y − (xz − xy yz) z, y' = y − yz z (Klipper and Marlin).
fn sheared(factors: [f64; 3], p: Position) -> Position {
    let [xy, xz, yz] = factors;
    Position::new(p.x - xy * p.y - (xz - xy * yz) * p.z, p.y - yz * p.z, p.z)
}

/// The factor of three lengths: diagonals AC, BD and side AD of a rhomboid.
fn of_lengths(text: &str) -> f64 {
    let lengths: Vec<f64> = text.split(',').map(|l| l.parse().unwrap()).collect();
    let (ac, bd, ad) = (lengths[0], lengths[1], lengths[2]);
    let side = (2.0 * ac * ac + 2.0 * bd * bd - 4.0 * ad * ad).sqrt() / 2.0;
    let angle = ((ac * ac - side * side - ad * ad) / (2.0 * side * ad)).acos();
    (std::f64::consts::FRAC_PI_2 - angle).tan()
}

/// What stands behind a letter or a key.
fn number(text: &str, key: &str) -> f64 {
    let rest = &text[text.find(key).unwrap_or_else(|| panic!("{key}: {text}")) + key.len()..];
    let end = rest.find(|c: char| !(c.is_ascii_digit() || ".-".contains(c)));
    rest[..end.unwrap_or(rest.len())].parse().unwrap()
}

fn content(angles: [f64; 3]) -> Content {
    let names = ["C0Y", "B0Z", "A0Z"].into_iter().zip(angles);
    Content::Machine(MachineErrors {
        squareness: names
            .map(|(name, value)| (name.parse().unwrap(), value))
            .collect(),
        ..MachineErrors::default()
    })
}

/// A machine with these angles alone, in the coordinates of the tool against the workpiece.
fn machine(chain: &str, angles: [f64; 3]) -> Machine {
    let names = ["C0Y", "B0Z", "A0Z"].into_iter().zip(angles);
    let errors = names.map(|(name, value)| ComponentError {
        component: name.parse().unwrap(),
        function: ErrorFunction::constant(value),
        spread: Spread::none(),
    });
    let chain = Chain::parse(chain).unwrap().with_tool_coordinates();
    Machine::new(chain, Sense::Tool, errors.collect()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn firmwares_make_the_machine_square(
        angles in prop::array::uniform3(-3e-3..3e-3f64),
        at in prop::array::uniform3(-200.0..200.0f64),
        chain in 0usize..3,
    ) {
        let content = content(angles);
        let at = Position::new(at[0], at[1], at[2]);
        let machine = machine(["FXYZ", "XYFZ", "YFXZ"][chain], angles);
        let read = |format| export(format, &content, &Request::default()).unwrap().text;
        let klipper = read("klipper");
        let profile = ["xy_skew = ", "xz_skew = ", "yz_skew = "].map(|k| number(&klipper, k));
        let lengths = ["XY=", "XZ=", "YZ="].map(|key| {
            let rest = &klipper[klipper.find(key).unwrap() + key.len()..];
            of_lengths(rest.split_whitespace().next().unwrap())
        });
        let marlin = read("marlin");
        let marlin = ["I", "J", "K"].map(|k| number(&marlin, k));
        let rrf = read("reprapfirmware");
        let length = number(&rrf, "S");
        // M556 has XY, YZ, XZ as X, Y, Z, and the other sign: x' = x + tanXY y + tanXZ z, y' = y + tanYZ z.
        let [xy, yz, xz] = ["X", "Y", "Z"].map(|k| number(&rrf, k) / length);
        let by_rrf = Position::new(at.x + xy * at.y + xz * at.z, at.y + yz * at.z, at.z);
        for (commanded, rounding) in [
            (sheared(profile, at), 1e-9),
            // Nine decimals of lengths of 100 mm, through the square roots: 1e-10.
            (sheared(lengths, at), 1e-9),
            (sheared(marlin, at), 1e-9),
            (by_rrf, 1e-9),
        ] {
            let deviation = machine.deviation(&commanded).unwrap();
            let left = commanded + 1e-3 * deviation - at;
            // Second order: products of two angles times 400 mm; rounding of the factors times 400 mm.
            let second = 4.0 * 3e-3f64.powi(2) * 400.0;
            let size = angles.iter().fold(0.0f64, |a, b| a.max(b.abs()));
            let bound = second.min(4.0 * size * size * 400.0) + rounding * 400.0;
            prop_assert!(left.norm() <= bound, "{} > {}", left.norm(), bound);
        }
        for (a, b) in profile.iter().zip(&lengths) {
            prop_assert!((a - b).abs() < 1e-9, "{} {}", a, b);
        }
        for (factor, angle) in profile.iter().zip([-angles[0], angles[1], -angles[2]]) {
            // Half of the ninth decimal.
            prop_assert!((factor - angle).abs() <= 0.5e-9 + 1e-18);
        }
    }
}

#[test]
fn what_is_not_told_is_zero_and_said() {
    let mut machine = MachineErrors::default();
    machine.squareness.push(("C0Y".parse().unwrap(), 1e-4));
    machine.missing.push((
        "A0Z".to_owned(),
        "the readings do not determine it".to_owned(),
    ));
    let out = export(
        "marlin",
        &Content::Machine(machine.clone()),
        &Request::default(),
    )
    .unwrap();
    assert_eq!(
        out.text,
        "M852 I-0.000100000 J0.000000000 K0.000000000\nM500\n"
    );
    assert_eq!(out.exported, ["C0Y"]);
    let left: Vec<&str> = out
        .not_exported
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    assert_eq!(left, ["B0Z", "A0Z", "lost motion"]);
    assert!(
        out.not_exported[1]
            .1
            .contains("do not determine it; written as zero")
    );
    machine.squareness.clear();
    let message = export(
        "marlin",
        &Content::Machine(machine.clone()),
        &Request::default(),
    )
    .unwrap_err();
    assert!(message.contains("no squareness"), "{message}");
    machine.squareness.push(("C0Y".parse().unwrap(), 20.0));
    let message = export("klipper", &Content::Machine(machine), &Request::default()).unwrap_err();
    assert!(message.contains("no squareness error"), "{message}");
}
