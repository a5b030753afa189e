//! Plates whose zero and turn belong to the model: the machine's scales, squareness and bends are named.

use errsep::diagnosis::{Kind, Options, diagnose};

use crate::plate::{EXPANSION, Wrong, line, plate, plate_turned, plates_read_to, warm_plates};

fn options() -> Options {
    Options {
        draws: 400,
        ..Options::default()
    }
}

const WRONG: Wrong = Wrong {
    scale_x: 8e-6,
    scale_y: -5e-6,
    squareness: 7e-6,
    sagitta: 2e-3,
};

#[test]
fn scales_squareness_and_a_bend_are_named_together() {
    let model = plate(WRONG, 0.3, 3);
    let found = diagnose(&model, &options());
    let mut names = found.verdict.effects.clone();
    names.sort();
    assert_eq!(
        names,
        ["scale-by-axis", "squareness-change", "straightness"]
    );
    assert!(found.verdict.indistinguishable.is_empty());
    for (effect, which, truth) in [
        ("scale-by-axis", 0, WRONG.scale_x),
        ("scale-by-axis", 1, WRONG.scale_y),
        ("squareness-change", 0, WRONG.squareness),
    ] {
        let of = found
            .candidates
            .iter()
            .find(|c| c.effect == effect)
            .unwrap();
        let size = &of.parameters[which];
        // k·u with k = 4: one in 16 000 by chance.
        assert!(
            (size.value - truth).abs() < 4.0 * size.std,
            "{effect}: {size:?}"
        );
    }
}

#[test]
fn a_pose_alone_is_no_gap() {
    let found = diagnose(&plate(Wrong::default(), 0.3, 5), &options());
    assert_eq!(found.verdict.kind, Kind::None);
}

/// *Exact limit*: of a turn of 8 mrad to first order 13 µm would be left, as a scale of 3·10⁻⁵; a scale beside it is named
/// alone.
#[test]
fn a_turned_plate_is_no_gap_and_hides_none() {
    for turn in [2e-3, -8e-3] {
        let bare = plate_turned(Wrong::default(), 0.3, 5, turn);
        let found = diagnose(&bare, &options());
        assert_eq!(found.verdict.kind, Kind::None, "{turn}");
        let (told, _) = bare.alignments();
        let told = told.iter().find(|a| a.name == "turn about z").unwrap();
        // k·u.
        assert!((told.value - turn).abs() < 4.0 * told.std, "{told:?}");
        let scaled = Wrong {
            scale_x: 8e-6,
            ..Wrong::default()
        };
        let found = diagnose(&plate_turned(scaled, 0.3, 5, turn), &options());
        assert_eq!(found.verdict.effects, ["scale-by-axis"], "{turn}");
    }
}

/// *Definition* (GUM F.2.2.1): plates of which every repeat agrees to the last digit are no surer than that, also where they
/// lie turned, which gives what is left of their readings other decimals; nothing is named. Tolerance: rounding.
#[test]
fn plates_that_repeat_to_the_last_digit_are_no_surer_than_it() {
    for turn in [0.0, 3e-3] {
        let found = diagnose(&plates_read_to(0.1, turn), &options());
        let least = 0.1 / 12f64.sqrt();
        let noise = found.noise.white;
        assert!(noise >= least * (1.0 - 1e-9), "{turn}: {noise}");
        let said = &found.verdict.statement;
        assert!(found.verdict.effects.is_empty(), "{turn}: {said}");
    }
}

#[test]
fn poses_are_told_and_what_points_on_a_line_do_not_tell() {
    let (found, open) = plate(Wrong::default(), 0.3, 7).alignments();
    let names: Vec<&str> = found.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["zero of x", "zero of y", "turn about z"]);
    assert!(open.is_empty());
    // The maker's shift and turn of this seed: 6 × 6 points about their middle, where a turn shifts too.
    let truth = crate::plate::pose(7);
    let turn = &found[2];
    assert!((turn.value - truth.turn).abs() < 4.0 * turn.std, "{turn:?}");
    assert!(turn.std > 0.0 && turn.std < 1e-6);
    for (zero, expected) in found.iter().zip(truth.middle_um) {
        // k·u with k = 4.
        assert!(
            (zero.value - expected).abs() < 4.0 * zero.std,
            "{zero:?}, not {expected}"
        );
    }
    let (found, open) = line().alignments();
    let names: Vec<&str> = found.iter().map(|a| a.name.as_str()).collect();
    assert_eq!(names, ["zero of y", "turn about z"]);
    assert_eq!(open, ["zero of z of part rod", "turn about y of part rod"]);
}

/// Plates that were each measured at a temperature of their own, by 0.3 to 1.5 K, and nobody said so.
const WARMER: [f64; 3] = [-0.4, 0.3, 1.5];

#[test]
fn temperatures_of_plates_are_named_and_told() {
    let found = diagnose(&warm_plates(Wrong::default(), &WARMER, 0.3, 2), &options());
    assert_eq!(
        found.verdict.effects,
        ["part-temperature"],
        "{:?}",
        found.verdict
    );
    assert!(found.verdict.indistinguishable.is_empty());
    let of = |c: &&errsep::diagnosis::Candidate| c.effect == "part-temperature";
    let told = &found.candidates.iter().find(of).unwrap().parameters;
    assert_eq!(told[0].name, "scale-of-parts");
    for (size, warmer) in told[1..].iter().zip(WARMER) {
        // k·u with k = 4.
        let off = (size.value - EXPANSION * warmer).abs();
        assert!(
            size.std < 1e-6 && off < 4.0 * size.std,
            "{size:?}, not {warmer} K"
        );
    }
    assert_eq!(told.len(), 1 + WARMER.len());
}

/// Plates alike are warm by one scale; a single plate has no other.
#[test]
fn plates_alike_are_warm_together() {
    for kelvins in [&[1.0, 1.0, 1.0][..], &[1.0]] {
        let found = diagnose(&warm_plates(Wrong::default(), kelvins, 0.3, 4), &options());
        assert_eq!(found.verdict.effects, ["thermal-expansion"], "{kelvins:?}");
    }
    let alone = diagnose(&warm_plates(Wrong::default(), &[1.0], 0.3, 4), &options());
    let mut candidates = alone.candidates.iter();
    let own = candidates.find(|c| c.effect == "part-temperature").unwrap();
    assert!(!own.in_set && own.visible == 0.0, "{own:?}");
}

/// What the machine does wrong is named beside what the plates do.
#[test]
fn temperatures_hide_no_squareness() {
    let wrong = Wrong {
        squareness: 7e-6,
        ..Wrong::default()
    };
    let found = diagnose(&warm_plates(wrong, &WARMER, 0.3, 6), &options());
    let mut names = found.verdict.effects.clone();
    names.sort();
    assert_eq!(names, ["part-temperature", "squareness-change"]);
}
