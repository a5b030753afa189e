//! What each design determines, beside the singular values of matrices written out here.

use errsep_models::reversal::designs::{
    Analysis, Design, DesignChannel, Determined, Zero, form_analysis, slope_analysis,
};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// One row of the table: indicators, positions, and what is found.
struct Row {
    name: &'static str,
    channels: Vec<(f64, f64)>,
    /// Found, of unknown, to spare, not found.
    forms: (usize, usize, usize, &'static [&'static str]),
    slopes: (usize, usize, usize, &'static [&'static str]),
}

fn every(indicators: &[f64], positions: &[f64]) -> Vec<(f64, f64)> {
    let pairs = indicators
        .iter()
        .flat_map(|i| positions.iter().map(move |p| (*i, *p)));
    pairs.collect()
}

const HALF: [f64; 2] = [0.0, 180.0];
const QUARTER: [f64; 4] = [0.0, 90.0, 180.0, 270.0];
const THIRD: [f64; 3] = [0.0, 120.0, 240.0];
const BOTH_UP: &str = "alpha_h + alpha_v against cone";

fn table() -> Vec<Row> {
    let row = |name, indicators: &[f64], positions: &[f64], forms, slopes| Row {
        name,
        channels: every(indicators, positions),
        forms,
        slopes,
    };
    vec![
        row("seed", &[0.0, 180.0], &HALF, (3, 3, 1, &[]), (3, 3, 1, &[])),
        row(
            "one indicator, 0/180",
            &[0.0],
            &HALF,
            (2, 3, 0, &["M_h against S_0 + S_180"]),
            (2, 3, 0, &["alpha_h against cone"]),
        ),
        row(
            "one indicator, every 90",
            &[0.0],
            &QUARTER,
            (4, 5, 0, &["M_h against all S"]),
            (3, 4, 1, &["alpha_h against cone"]),
        ),
        row(
            "near and top, 0/180",
            &[0.0, 90.0],
            &HALF,
            (
                4,
                6,
                0,
                &["M_h against S_0 + S_180", "M_v against S_90 + S_270"],
            ),
            (4, 5, 0, &[BOTH_UP]),
        ),
        row(
            "near and top, every 90",
            &[0.0, 90.0],
            &QUARTER,
            (5, 6, 3, &["M_h + M_v against all S"]),
            (4, 5, 4, &[BOTH_UP]),
        ),
        row(
            "near, far, top, 0/180",
            &[0.0, 180.0, 90.0],
            &HALF,
            (5, 6, 1, &["M_v against S_90 + S_270"]),
            (5, 5, 1, &[]),
        ),
        row(
            "the seed's 8",
            &[0.0, 180.0, 90.0, 270.0],
            &HALF,
            (6, 6, 2, &[]),
            (5, 5, 3, &[]),
        ),
        row(
            "near, far, top, every 90",
            &[0.0, 180.0, 90.0],
            &QUARTER,
            (6, 6, 6, &[]),
            (5, 5, 7, &[]),
        ),
        row(
            "near and far, every 90",
            &[0.0, 180.0],
            &QUARTER,
            (5, 5, 3, &[]),
            (4, 4, 4, &[]),
        ),
        row(
            "three at 120",
            &THIRD,
            &THIRD,
            (5, 5, 4, &[]),
            (5, 5, 4, &[]),
        ),
        row(
            "four, every 90",
            &QUARTER,
            &QUARTER,
            (6, 6, 10, &[]),
            (5, 5, 11, &[]),
        ),
    ]
}

fn design(channels: &[(f64, f64)]) -> Design {
    let made = channels
        .iter()
        .map(|(i, s)| DesignChannel::at(*i, *s).unwrap());
    Design::new(made.collect()).unwrap()
}

/// The equation of the page, written out: one row a channel, by name of the unknown.
fn written_out(channels: &[(f64, f64)], is_form: bool, oval: bool) -> Vec<(String, Vec<f64>)> {
    let side = |(i, s): (f64, f64)| (i - s).rem_euclid(360.0).round();
    let column = |f: &dyn Fn((f64, f64)) -> f64| channels.iter().map(|c| f(*c)).collect::<Vec<_>>();
    let cos = |degrees: f64| degrees.to_radians().cos();
    let sin = |degrees: f64| degrees.to_radians().sin();
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    let direction = |h: &str, v: &str, columns: &mut Vec<(String, Vec<f64>)>| {
        columns.push((h.into(), column(&|c| cos(c.0))));
        columns.push((v.into(), column(&|c| sin(c.0))));
    };
    if is_form {
        direction("M_h", "M_v", &mut columns);
        let mut sides: Vec<f64> = channels.iter().map(|c| side(*c)).collect();
        sides.sort_by(f64::total_cmp);
        sides.dedup();
        for s in sides {
            let seen = column(&|c| if side(c) == s { 1.0 } else { 0.0 });
            columns.push((format!("S_{s}"), seen));
        }
    } else {
        direction("alpha_h", "alpha_v", &mut columns);
        columns.push(("gamma_1".into(), column(&|c| cos(c.0 - c.1))));
        columns.push(("gamma_2".into(), column(&|c| sin(c.0 - c.1))));
        columns.push(("cone".into(), column(&|_| 1.0)));
        if oval {
            columns.push(("kappa_c".into(), column(&|c| cos(2.0 * (c.0 - c.1)))));
        }
    }
    // An unknown that no channel sees is none: the sine of 180° in floating point is not quite zero.
    columns.retain(|(_, c)| c.iter().any(|v| v.abs() > 1e-12));
    columns
}

/// Rank and null space (orthonormal) by direct singular values.
fn by_singular_values(columns: &[(String, Vec<f64>)]) -> (usize, Vec<DVector<f64>>) {
    let rows = columns[0].1.len();
    // Square, with rows of zeros, so that every right singular vector is there.
    let size = rows.max(columns.len());
    let matrix = DMatrix::from_fn(size, columns.len(), |r, c| {
        columns[c].1.get(r).copied().unwrap_or(0.0)
    });
    let svd = matrix.svd(false, true);
    let right = svd.v_t.unwrap();
    let mut null = Vec::new();
    for (k, s) in svd.singular_values.iter().enumerate() {
        // Singular values of these matrices are zero or at least a third.
        if *s < 1e-9 {
            null.push(right.row(k).transpose());
        } else {
            assert!(*s > 0.3, "a singular value of {s} is neither");
        }
    }
    (columns.len() - null.len(), null)
}

/// The analysis finds what the singular values find: rank, unknowns, and the same null space.
fn agrees(name: &str, analysis: &Analysis, columns: &[(String, Vec<f64>)]) {
    let (rank, null) = by_singular_values(columns);
    assert_eq!(analysis.rank(), rank, "{name}");
    assert_eq!(analysis.unknowns().len(), columns.len(), "{name}");
    let own = analysis.null_space();
    assert_eq!(own.len(), null.len(), "{name}");
    for vector in own {
        let by_name = DVector::from_iterator(
            columns.len(),
            columns.iter().map(|(n, _)| {
                let j = analysis.unknowns().iter().position(|u| u == n).unwrap();
                vector[j]
            }),
        );
        let mut rest = by_name.clone();
        for v in &null {
            rest -= v * by_name.dot(v);
        }
        // Epsilons: coefficients up to two, through a pseudo-inverse of condition below ten.
        assert!(rest.norm() < 1e-13, "{name}: {by_name} leaves {rest}");
    }
    // The weights give each fitted unknown back: W times its own columns is one.
    let own = analysis.matrix().select_columns(analysis.pivots());
    let given = analysis.weights() * own;
    let apart = (given - DMatrix::identity(rank, rank)).amax();
    // Epsilons: sums of at most 16 terms of at most one.
    assert!(apart < 1e-13, "{name}: weights are off by {apart}");
    // Closures take every unknown out of the readings, and there are as many as can be.
    let closures = analysis.closures();
    assert_eq!(closures.len(), analysis.to_spare(), "{name}");
    let mut independent = DMatrix::zeros(closures.len().max(1), analysis.matrix().nrows());
    for (k, weights) in closures.iter().enumerate() {
        for (_, column) in columns {
            let sum: f64 = column.iter().zip(weights).map(|(v, w)| v * w).sum();
            // Epsilons: sums of at most 16 terms of at most one.
            assert!(
                sum.abs() < 1e-13,
                "{name}: closure {weights:?} leaves {sum}"
            );
        }
        independent.row_mut(k).copy_from_slice(weights);
    }
    assert_eq!(independent.rank(1e-9), closures.len(), "{name}");
}

#[test]
fn every_row_of_the_table() {
    for row in table() {
        let design = design(&row.channels);
        let found = Determined::of(&design, Zero::Reset);
        let name = row.name;
        agrees(
            name,
            &form_analysis(&design),
            &written_out(&row.channels, true, false),
        );
        agrees(
            name,
            &slope_analysis(&design, 0),
            &written_out(&row.channels, false, false),
        );
        let (rank, unknowns, spare, open) = row.forms;
        let forms = &found.forms;
        assert_eq!(
            (forms.rank(), forms.unknowns().len(), forms.to_spare()),
            (rank, unknowns, spare),
            "{name}"
        );
        let (rank, unknowns, spare, open_slopes) = row.slopes;
        let slopes = slope_analysis(&design, 0);
        assert_eq!(
            (slopes.rank(), slopes.unknowns().len(), slopes.to_spare()),
            (rank, unknowns, spare),
            "{name}"
        );
        let told: Vec<&str> = found
            .not_determined
            .iter()
            .filter(|n| !n.held.starts_with("kappa"))
            .map(|n| &n.combination[..])
            .collect();
        assert_eq!(told, [open, open_slopes].concat(), "{name}");
    }
}

#[test]
fn the_lines_with_an_oval_cone() {
    // Design, found of unknown, and what changes together (up to a factor).
    type Line<'a> = (&'a [f64], &'a [f64], usize, usize, &'a [(&'a str, f64)]);
    let lines: [Line; 5] = [
        (&[0.0, 90.0], &HALF, 4, 6, &[]),
        (
            &[0.0, 180.0, 90.0],
            &HALF,
            5,
            6,
            &[("alpha_v", 1.0), ("cone", -0.5), ("kappa_c", 0.5)],
        ),
        (
            &[0.0, 180.0],
            &HALF,
            3,
            4,
            &[("cone", 1.0), ("kappa_c", -1.0)],
        ),
        (&THIRD, &THIRD, 5, 6, &[("gamma_1", 1.0), ("kappa_c", -1.0)]),
        (&QUARTER, &HALF, 6, 6, &[]),
    ];
    for (indicators, positions, rank, unknowns, together) in lines {
        let channels = every(indicators, positions);
        let design = design(&channels);
        let slopes = slope_analysis(&design, 1);
        let name = format!("{indicators:?} {positions:?}");
        agrees(&name, &slopes, &written_out(&channels, false, true));
        assert_eq!(
            (slopes.rank(), slopes.unknowns().len()),
            (rank, unknowns),
            "{name}"
        );
        let found = Determined::of(&design, Zero::Reset);
        let fitted = found.slopes.alone("kappa_c").is_some();
        assert_eq!(fitted, slopes.alone("kappa_c").is_some(), "{name}");
        if !together.is_empty() {
            let vector = &slopes.null_space()[0];
            let of = |n: &str| vector[slopes.unknowns().iter().position(|u| u == n).unwrap()];
            let factor = of(together[0].0) / together[0].1;
            for (n, value) in together {
                // Epsilons: cleaned fractions.
                assert!((of(n) - factor * value).abs() < 1e-13, "{name}: {n}");
            }
            let others = vector.iter().filter(|v| **v != 0.0).count();
            assert_eq!(others, together.len(), "{name}");
        }
    }
    // Two to spare beside six slopes of the seed's eight channels.
    let eight = slope_analysis(&design(&every(&QUARTER, &HALF)), 1);
    assert_eq!(eight.to_spare(), 2);
    // α_h of the seed's 8 is as sure as that of its 4: half a slope's σ; every 90° gains √2.
    let std_of = |indicators: &[f64], positions: &[f64]| {
        let slopes = slope_analysis(&design(&every(indicators, positions)), 0);
        let p = slopes.alone("alpha_h").unwrap();
        slopes.weights().row(p).norm()
    };
    let near_far = [0.0, 180.0];
    // Epsilons: weights of a quarter and an eighth.
    assert!((std_of(&near_far, &HALF) - 0.5).abs() < 1e-14);
    assert!((std_of(&QUARTER, &HALF) - 0.5).abs() < 1e-14);
    assert!((std_of(&near_far, &QUARTER) - 0.5 / 2_f64.sqrt()).abs() < 1e-14);
}

#[test]
fn the_cheapest_remedy_determines_it() {
    // What is added first: a trace where an indicator and a position are there already, then the
    // spindle turned once more, then an indicator more.
    let remedies = [
        ("two", every(&[0.0], &HALF), "M_h", "180/0"),
        ("two", every(&[0.0], &HALF), "alpha_h", "180/0"),
        ("near, top", every(&[0.0, 90.0], &HALF), "M_h", "180/0"),
        (
            "a trace missing where all is set up",
            vec![
                (0.0, 0.0),
                (180.0, 0.0),
                (0.0, 180.0),
                (90.0, 0.0),
                (270.0, 180.0),
            ],
            "kappa_c",
            "90/180",
        ),
    ];
    for (name, channels, held, at) in remedies {
        let before = design(&channels);
        let found = Determined::of(&before, Zero::Reset);
        let Some(open) = found.not_determined.iter().find(|n| n.held == held) else {
            panic!("{name}: {held} is determined: {:?}", found.not_determined);
        };
        let remedy = open.remedy.as_ref().unwrap();
        let channel = &remedy.channel;
        assert_eq!(
            format!("{}/{}", channel.indicator, channel.spindle),
            at,
            "{name} {held}"
        );
        let after = Determined::of(&before.with(channel.clone()).unwrap(), Zero::Reset);
        let alone = after.forms.alone(held).or(after.slopes.alone(held));
        assert!(alone.is_some(), "{name}: {held} with {}", remedy.words);
    }
    // A trace at 90° brings γ_2 with it: no single one tells the oval cone of the seed from its cone.
    let seed = Determined::of(&design(&every(&[0.0, 180.0], &HALF)), Zero::Reset);
    assert_eq!(seed.not_determined.len(), 1);
    assert_eq!(seed.not_determined[0].combination, "cone against kappa_c");
    assert_eq!(seed.not_determined[0].remedy, None);
}

#[test]
fn kept_zeros_add_eccentricity_and_closures() {
    let of = |indicators: &[f64], positions: &[f64]| {
        Determined::of(&design(&every(indicators, positions)), Zero::Kept)
    };
    // Every 90°: zero, e and the oval part; at 0°/180° the oval part is in the zeros.
    let quarter = of(&[0.0], &QUARTER);
    assert_eq!(
        (quarter.constants.rank(), quarter.constants.to_spare()),
        (4, 0)
    );
    assert!(quarter.constants.alone("o").is_some());
    let seed = of(&[0.0, 180.0], &HALF);
    assert_eq!((seed.constants.rank(), seed.constants.to_spare()), (3, 1));
    let open = seed.not_determined.iter().find(|n| n.held == "o").unwrap();
    assert_eq!(open.combination, "zero of 0 + zero of 180 against o");
    assert_eq!(of(&QUARTER, &QUARTER).constants.to_spare(), 16 - 7);
}

/// Lists of channels at any angles: what is told of them is true of their matrices.
#[test]
fn designs_of_any_angles() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut remedies = 0;
    for round in 0..60 {
        let step = [90.0, 45.0, 30.0, 7.0][round % 4];
        let count = rng.random_range(1..=10);
        let mut made: Option<Design> = None;
        for _ in 0..count {
            let mut angle = || step * f64::from(rng.random_range(0..(360.0 / step) as u32));
            let channel = DesignChannel::at(angle(), angle()).unwrap();
            made = match made {
                None => Some(Design::new(vec![channel]).unwrap()),
                // Angles that are there already are left out.
                Some(design) => Some(design.with(channel).unwrap_or(design)),
            };
        }
        let design = made.unwrap();
        let found = Determined::of(&design, Zero::Kept);
        for analysis in [&found.forms, &found.slopes, &found.constants] {
            let matrix = analysis.matrix();
            for vector in analysis.null_space() {
                let left = (matrix * DVector::from_vec(vector)).amax();
                // Epsilons: ten unknowns, coefficients below a hundred (one per cent of a column is left).
                assert!(left < 1e-11, "{design:?}: {left}");
            }
            let closures = analysis.closures();
            assert_eq!(closures.len(), analysis.to_spare(), "{design:?}");
            for weights in closures {
                let left = (matrix.transpose() * DVector::from_vec(weights)).amax();
                assert!(left < 1e-11, "{design:?}: closure leaves {left}");
            }
        }
        for open in &found.not_determined {
            let Some(remedy) = &open.remedy else { continue };
            let after = design.with(remedy.channel.clone()).unwrap();
            let alone = [
                form_analysis(&after).alone(&open.held),
                slope_analysis(&after, 2).alone(&open.held),
                Determined::of(&after, Zero::Kept)
                    .constants
                    .alone(&open.held),
            ];
            assert!(alone.iter().any(Option::is_some), "{design:?}: {open:?}");
            remedies += 1;
        }
    }
    assert!(remedies > 30, "{remedies}");
}
