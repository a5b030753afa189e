//! The 21 errors: ISG_CSV, the Etalon exchange format, and the neutral table.

use std::collections::BTreeMap;

use errsep::export::{Content, Grid, MachineErrors, Request};
use errsep_models::machine::{COMPONENTS, Component, ErrorFunction, Kind};
use proptest::prelude::*;

use super::export;

/// By error name: position (none for an error of location) and value, mm or rad.
type Table = BTreeMap<String, Vec<(Option<f64>, f64)>>;

/// ISG_CSV: blocks between lines of `#`, in each a header and rows, white space between, `//` comments.
fn isg_csv(text: &str) -> Table {
    let mut table = Table::new();
    for block in text.split('#') {
        let rows = block.lines().map(|l| l.split("//").next().unwrap().trim());
        let mut rows = rows.filter(|l| !l.is_empty());
        let header: Vec<&str> = rows.next().unwrap().split_whitespace().collect();
        for (i, name) in header.iter().enumerate() {
            assert!(!header[..i].contains(name), "{name} twice in a header");
            assert!(!table.contains_key(*name), "{name} in two blocks");
        }
        for row in rows {
            let values: Vec<f64> = row.split_whitespace().map(|v| v.parse().unwrap()).collect();
            assert_eq!(values.len(), header.len(), "{row}");
            let argument = header.iter().position(|h| h.len() == 1).map(|i| values[i]);
            for (name, value) in header.iter().zip(&values).filter(|(n, _)| n.len() == 3) {
                table
                    .entry((*name).to_owned())
                    .or_default()
                    .push((argument, *value));
            }
        }
    }
    table
}

/// Blocks `[NAME]` with `VALUE = v`, or `Gridpoints = {`, rows of position and value, `}`.
fn etalon(text: &str) -> Table {
    let mut table = Table::new();
    let (mut name, mut inside) = (String::new(), false);
    for line in text
        .lines()
        .map(str::trim)
        .filter(|l| !l.is_empty() && !l.starts_with("//"))
    {
        if let Some(own) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
            name = own.to_owned();
            assert!(
                table.insert(name.clone(), Vec::new()).is_none(),
                "{name} twice"
            );
        } else if let Some(value) = line.strip_prefix("VALUE = ") {
            table
                .get_mut(&name)
                .unwrap()
                .push((None, value.parse().unwrap()));
        } else if line == "Gridpoints = {" {
            inside = true;
        } else if line == "}" {
            inside = false;
        } else {
            assert!(inside, "{line}");
            let (x, v) = line.split_once(' ').unwrap();
            table
                .get_mut(&name)
                .unwrap()
                .push((Some(x.parse().unwrap()), v.parse().unwrap()));
        }
    }
    assert!(!inside);
    table
}

fn neutral(text: &str) -> Table {
    let mut table = Table::new();
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    assert_eq!(
        reader.headers().unwrap(),
        vec!["error", "axis", "position_mm", "value", "unit"]
    );
    for row in reader.records() {
        let row = row.unwrap();
        let unit =
            if row[0].starts_with("EX") || row[0].starts_with("EY") || row[0].starts_with("EZ") {
                "mm"
            } else {
                "rad"
            };
        assert_eq!(&row[4], unit, "{row:?}");
        let position = row[2].parse().ok();
        table
            .entry(row[0].to_owned())
            .or_default()
            .push((position, row[3].parse().unwrap()));
    }
    table
}

/// All 21 errors over 300 mm; translations in µm, rotations in rad.
fn machine(values: &[f64]) -> MachineErrors {
    let mut machine = MachineErrors {
        moves: Some("X table-carrying, Y table-carrying, Z tool-carrying".to_owned()),
        ..MachineErrors::default()
    };
    for component in COMPONENTS {
        let own = |k: usize| {
            let value = values[(7 * component.index() + k) % values.len()];
            if component.kind == Kind::Translation {
                10.0 * value
            } else {
                1e-5 * value
            }
        };
        if component.kind == Kind::Squareness {
            machine.squareness.push((component, own(0)));
        } else if component.index() % 5 == 4 {
            machine.functions.push((
                component,
                ErrorFunction::polynomial(vec![own(0), 1e-3 * own(1)]),
            ));
        } else {
            let positions = vec![0.0, 75.5, 150.0, 300.0];
            let values = (0..4).map(own).collect();
            machine
                .functions
                .push((component, ErrorFunction::Table { positions, values }));
        }
    }
    machine
}

fn expected(component: Component, function: &ErrorFunction, x: f64) -> f64 {
    let value = function.value(component, x).unwrap();
    if component.kind == Kind::Translation {
        1e-3 * value
    } else {
        value
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn the_21_errors_read_back(values in prop::collection::vec(-1.0..1.0f64, 40..60), points in prop::option::of(2usize..9)) {
        let machine = machine(&values);
        let request = Request { grid: points.map(Grid::Points), ..Request::default() };
        let content = Content::Machine(machine.clone());
        // Half of the last digit of mm and of rad; the neutral table is exact.
        for (format, reader, mm, rad) in [
            ("isg-volumetric", isg_csv as fn(&str) -> Table, 0.5e-7, 0.5e-10),
            ("etalon", etalon, 0.5e-7, 0.5e-10),
            ("csv", neutral, 0.0, 0.0),
        ] {
            let out = export(format, &content, &request).unwrap();
            prop_assert_eq!(out.exported.len(), 21);
            let table = reader(&out.text);
            prop_assert_eq!(table.len(), 21, "{}", format);
            for (component, function) in &machine.functions {
                let half = if component.kind == Kind::Translation { mm } else { rad };
                let rows = &table[&component.to_string()];
                prop_assert_eq!(rows.len(), points.unwrap_or(4));
                for (x, value) in rows {
                    // Positions have seven decimals; the errors change by 1e-3 of that at most.
                    let error = value - expected(*component, function, x.unwrap());
                    prop_assert!(error.abs() <= half + 1e-10 * (half > 0.0) as u8 as f64 + 1e-17, "{} {}", component, error);
                }
            }
            for (component, value) in &machine.squareness {
                let (none, read) = table[&component.to_string()][0];
                prop_assert!(none.is_none() && (read - value).abs() <= rad + 1e-20);
            }
        }
    }
}

#[test]
fn polynomials_need_a_travel() {
    let component: Component = "EXX".parse().unwrap();
    let of = |coefficients: Vec<f64>| {
        Content::Machine(MachineErrors {
            functions: vec![(component, ErrorFunction::polynomial(coefficients))],
            ..MachineErrors::default()
        })
    };
    let line = of(vec![1.0, 0.02]);
    let message = export("etalon", &line, &Request::default()).unwrap_err();
    assert!(message.contains("--travel X=FROM:TO"), "{message}");
    let travel = Request {
        travel: vec![('X', -100.0, 400.0)],
        ..Request::default()
    };
    let rows = etalon(&export("etalon", &line, &travel).unwrap().text)["EXX"].clone();
    assert_eq!(rows, vec![(Some(-100.0), -0.001), (Some(400.0), 0.009)]);
    let curved = of(vec![1.0, 0.02, 1e-4]);
    let message = export("etalon", &curved, &travel).unwrap_err();
    assert!(
        message.contains("curved") && message.contains("--step"),
        "{message}"
    );
    let step = Request {
        grid: Some(Grid::Step(100.0)),
        ..travel
    };
    assert_eq!(
        etalon(&export("etalon", &curved, &step).unwrap().text)["EXX"].len(),
        6
    );
    let axis = Request {
        axis: Some("X".to_owned()),
        ..Request::default()
    };
    assert!(
        export("csv", &curved, &axis)
            .unwrap_err()
            .contains("no use for --axis")
    );
}
