//! The replicates of NISTIR 6868 against its tables, misprints named.

use crate::fixtures::{Row, table};
use errsep_models::anova::recipe::{self, Recipe};
use errsep_models::anova::{Group, Groups, analyse};

/// Readings are printed to 0.001: the standard deviation of their rounding.
const ROUNDING: f64 = 0.001 * 0.288_675;

fn replicates(name: &str) -> Groups {
    let mut groups: Vec<Group> = Vec::new();
    for row in table("replicates.csv")
        .iter()
        .filter(|row| row.text("table") == name)
    {
        let part = row.text("part");
        match groups.iter_mut().find(|g| g.name == part) {
            Some(group) => group.readings.push(row.number("value")),
            None => groups.push(Group {
                name: part.to_string(),
                readings: vec![row.number("value")],
            }),
        }
    }
    Groups::new(groups).unwrap()
}

fn summaries() -> Vec<Row> {
    table("replicate_summaries.csv")
}

/// What three standard deviations of the rounded readings can do to a mean square (k·u): the
/// derivative of `Σ d² / ν` by each reading is `2 d / ν`.
fn rounding_of(mean_square: f64, degrees: f64) -> f64 {
    3.0 * ROUNDING * 2.0 * (mean_square / degrees).sqrt()
}

fn near(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found} is not {expected} within {tolerance}"
    );
}

fn printed(what: &str, found: f64, expected: f64, last_digit: f64) {
    near(what, found, expected, 0.5 * last_digit * (1.0 + 1e-9));
}

#[test]
fn rows_reproduce() {
    // Certified digits: means of rounded readings to one more rounding, standard deviations printed
    // to six decimals from unrounded readings.
    for row in table("replicate_rows_printed.csv") {
        let (name, part) = (row.text("table"), row.text("part"));
        let groups = replicates(name);
        let group = groups.groups().iter().find(|g| g.name == part).unwrap();
        near(
            &format!("{name}, part {part}"),
            group.mean(),
            row.number("mean"),
            0.0011,
        );
        assert_eq!(
            group.readings.len() as f64 - 1.0,
            row.number("degrees_of_freedom")
        );
        near(
            &format!("{name}, part {part}"),
            group.standard_deviation().unwrap(),
            row.number("standard_deviation"),
            4.0 * ROUNDING,
        );
    }
}

#[test]
fn x_tables_reproduce() {
    let mut seen = 0;
    for row in summaries().iter().filter(|r| r.text("axis") == "x") {
        let name = row.text("table");
        let found = recipe::summarise(&replicates(name), Recipe::Section51).unwrap();
        printed(
            name,
            found.mean,
            row.number("mean_printed"),
            0.001 + 2.0 * ROUNDING / 7.0,
        );
        let (b, w) = (
            rounding_of(found.variance_between, 20.0),
            rounding_of(found.variance_within, 33.0),
        );
        near(
            name,
            found.variance_between,
            row.number("variance_between_printed"),
            b,
        );
        near(
            name,
            found.variance_within,
            row.number("variance_within_printed"),
            w,
        );
        let f = found.f.unwrap();
        let relative = b / found.variance_between + w / found.variance_within;
        near(name, f, row.number("f_printed"), relative * f);
        seen += 1;
    }
    assert_eq!(seen, 6);
}

#[test]
fn y_tables_carry_the_mean_of_another_hole() {
    let mut seen = 0;
    for row in summaries().iter().filter(|r| r.text("axis") == "y") {
        let name = row.text("table");
        let found = recipe::summarise(&replicates(name), Recipe::Section51).unwrap();
        let wrong = if row.text("process") == "drilled" {
            2.696
        } else {
            12.838
        };
        assert_eq!(row.number("mean_printed"), wrong);
        assert!(
            (found.mean - wrong).abs() > 1.0,
            "{name}: the misprint is not one"
        );
        let printed_variance = row.number("variance_between_printed");
        let right = recipe::about_right_mean(printed_variance, 54.0, 21.0, found.mean, wrong);
        // Besides the readings the wrong mean is rounded, to half of 0.001.
        let of_mean = 2.7 * 2.0 * (found.mean - wrong).abs() * 0.0005;
        let tolerance = rounding_of(found.variance_between, 20.0) + of_mean;
        near(name, found.variance_between, right, tolerance);
        near(
            name,
            found.variance_within,
            row.number("variance_within_printed"),
            rounding_of(found.variance_within, 33.0),
        );
        seen += 1;
    }
    assert_eq!(seen, 6);
}

#[test]
fn every_table_agrees_with_numpy() {
    // Other tool (numpy 2), printed to four decimals, F to three.
    for row in summaries() {
        let name = row.text("table");
        let found = analyse(&replicates(name), row.text("unit"), 0.95).unwrap();
        printed(name, found.mean.value, row.number("mean"), 1e-4);
        printed(
            name,
            found.between.mean_square.unwrap(),
            row.number("variance_between"),
            1e-4,
        );
        printed(
            name,
            found.within.mean_square.unwrap(),
            row.number("variance_within"),
            1e-6,
        );
        printed(name, found.f.unwrap(), row.number("f"), 1e-3);
        assert_eq!((found.readings, found.groups), (54, 21));
        assert_eq!(found.within.degrees_of_freedom, 33, "the text says 34");
        // 54 readings, four parts of five and seventeen of two: n0 = (54 - 168/54) / 20.
        printed(name, found.effective_replicates.unwrap(), 2.5444, 1e-4);
    }
}

#[test]
fn g_and_h_tables_follow_another_recipe() {
    for (name, mean, variance, weighted_mean, weighted_variance, f) in [
        ("G1", -1.059, 80.284_741, -0.219, 233.2, 26.6),
        ("H1", 20.986, 7.378_079, 20.714, 23.16, 7.4),
        ("H2", 26.018, 35.835_99, 25.288, 101.5, 39.7),
    ] {
        let groups = replicates(name);
        let found = recipe::summarise(&groups, Recipe::PartMeans).unwrap();
        printed(name, found.mean, mean, 0.001 + 2.0 * ROUNDING);
        near(
            name,
            found.variance_between,
            variance,
            rounding_of(variance, 33.0),
        );
        let weighted = recipe::summarise(&groups, Recipe::Section51).unwrap();
        printed(name, weighted.mean, weighted_mean, 0.001);
        printed(name, weighted.variance_between, weighted_variance, 0.1);
        printed(name, weighted.f.unwrap(), f, 0.1);
    }
}

#[test]
fn tables_14_to_16_reproduce() {
    // Deviation, its part of the mean, future value, twice that; the count in the factor is 50.
    for (name, digit, figures) in [
        ("G1", 0.01, [8.96, 1.22, 9.05, 18.10]),
        ("H1", 0.001, [2.716, 0.370, 2.743, 5.486]),
        ("H2", 0.001, [5.986, 0.815, 6.046, 12.092]),
    ] {
        let found = recipe::summarise(&replicates(name), Recipe::PartMeans).unwrap();
        let deviation = found.variance_between.sqrt();
        let future = recipe::future(found.variance_between, 50.0);
        printed(name, deviation, figures[0], digit);
        printed(name, deviation / 54.0_f64.sqrt(), figures[1], digit);
        printed(name, future, figures[2], digit);
        // The report doubles the rounded figure.
        printed(name, 2.0 * future, figures[3], 2.0 * digit);
        let text = recipe::future(found.variance_between, 54.0);
        assert!(
            (text - figures[2]).abs() > 0.5 * digit,
            "{name}: 1 + 1/54 would do as well"
        );
    }
}

/// Number of the C table of a hole, and of its B tables for measurement and manufacture.
const HOLES: [(&str, &str, &str, &str); 12] = [
    ("C1", "3", "tableB1_drilled_x.csv", "tableB5_drilled_x.csv"),
    ("C2", "3", "tableB2_drilled_y.csv", "tableB6_drilled_y.csv"),
    ("C3", "3", "tableB3_milled_x.csv", "tableB7_milled_x.csv"),
    ("C4", "3", "tableB4_milled_y.csv", "tableB8_milled_y.csv"),
    ("C5", "9", "tableB1_drilled_x.csv", "tableB5_drilled_x.csv"),
    ("C6", "9", "tableB2_drilled_y.csv", "tableB6_drilled_y.csv"),
    ("C7", "9", "tableB3_milled_x.csv", "tableB7_milled_x.csv"),
    ("C8", "9", "tableB4_milled_y.csv", "tableB8_milled_y.csv"),
    ("C9", "15", "tableB1_drilled_x.csv", "tableB5_drilled_x.csv"),
    (
        "C10",
        "15",
        "tableB2_drilled_y.csv",
        "tableB6_drilled_y.csv",
    ),
    ("C11", "15", "tableB3_milled_x.csv", "tableB7_milled_x.csv"),
    ("C12", "15", "tableB4_milled_y.csv", "tableB8_milled_y.csv"),
];

fn row_of(file: &str, hole: &str) -> Row {
    table(file)
        .into_iter()
        .find(|row| row.text("hole") == hole)
        .unwrap()
}

#[test]
fn b1_to_b4_reproduce() {
    for (name, hole, file, _) in HOLES {
        let found = recipe::summarise(&replicates(name), Recipe::Section51).unwrap();
        let row = row_of(file, hole);
        printed(name, found.mean, row.number("mean_error_um"), 0.01);
        printed(
            name,
            found.standard_uncertainty,
            row.number("std_uncertainty_um"),
            0.01,
        );
        printed(name, found.future_measurement, row.number("u_new_um"), 0.01);
        printed(
            name,
            2.0 * found.future_measurement,
            row.number("U_new_um"),
            0.01,
        );
    }
}

#[test]
fn b5_to_b8_reproduce_or_are_corrected() {
    for (name, hole, _, file) in HOLES {
        let found = recipe::summarise(&replicates(name), Recipe::Section51).unwrap();
        let row = row_of(file, hole);
        near(
            name,
            found.variance_within,
            row.number("var_within_um2"),
            0.005 + rounding_of(found.variance_within, 33.0),
        );
        let x_table = ["C1", "C3", "C5", "C7", "C9", "C11"].contains(&name);
        if x_table {
            let digits = 0.005 + rounding_of(found.variance_between, 20.0);
            near(
                name,
                found.variance_between,
                row.number("var_between_um2"),
                digits,
            );
            near(
                name,
                found.future_manufacturing,
                row.number("u_future_um"),
                0.0051,
            );
        } else {
            let corrected = row_of(
                &file
                    .replace("_drilled_y", "_corrected")
                    .replace("_milled_y", "_corrected"),
                hole,
            );
            // The correction starts from means printed to 0.01, ten times the effect of 0.001.
            let wrong = if file.contains("drilled") {
                2.696
            } else {
                12.838
            };
            let digits = 2.7 * 2.0 * (found.mean - wrong).abs() * 0.0055 + 0.02;
            near(
                name,
                found.variance_between,
                corrected.number("var_between_corrected_um2"),
                digits,
            );
            let u = found.future_manufacturing;
            let of_u = 0.006 + digits / (2.0 * u);
            near(name, u, corrected.number("u_future_corrected_um"), of_u);
            assert!(
                (u - row.number("u_future_um")).abs() > 4.0 * of_u,
                "{name}: no misprint"
            );
        }
    }
}

#[test]
fn every_row_of_b5_to_b8_is_consistent() {
    for (file, means, wrong) in [
        ("tableB5_drilled_x.csv", "tableB1_drilled_x.csv", None),
        (
            "tableB6_drilled_y.csv",
            "tableB2_drilled_y.csv",
            Some(2.696),
        ),
        ("tableB7_milled_x.csv", "tableB3_milled_x.csv", None),
        ("tableB8_milled_y.csv", "tableB4_milled_y.csv", Some(12.838)),
    ] {
        for row in table(file) {
            let hole = row.text("hole");
            let variance = row.number("var_between_um2");
            printed(
                hole,
                recipe::future(variance, 21.0),
                row.number("u_future_um"),
                0.012,
            );
            if let Some(wrong) = wrong {
                let mean = row_of(means, hole).number("mean_error_um");
                let right = recipe::about_right_mean(variance, 54.0, 21.0, mean, wrong);
                let file = if wrong < 10.0 {
                    "tableB6_corrected.csv"
                } else {
                    "tableB8_corrected.csv"
                };
                // Both are formed from the same two-decimal means, and printed to 0.01.
                printed(
                    hole,
                    right,
                    row_of(file, hole).number("var_between_corrected_um2"),
                    0.02,
                );
            }
        }
    }
}
