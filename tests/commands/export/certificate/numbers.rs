//! The numbers of certificates are those of their results.

use errsep::export::exact::json;
use roxmltree::{Document, Node};
use serde_json::Value;

use super::{DCC, RESULTS, SI, certified, child, numbers, printed, quantity, text};

fn list(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect()
}

/// A list with its standard uncertainties: values exactly, U = k u to rounding.
fn is_list(found: Node, values: &Value, std: &Value, unit: &str, factor: f64) {
    assert_eq!(numbers(found, "valueXMLList"), list(values));
    assert_eq!(text(found, "unitXMLList"), unit);
    assert_eq!(numbers(found, "coverageFactorXMLList"), [factor]);
    assert_eq!(numbers(found, "coverageProbabilityXMLList"), [0.95]);
    let (expanded, std) = (numbers(found, "uncertaintyXMLList"), list(std));
    assert_eq!(expanded.len(), std.len());
    for (u, std) in expanded.iter().zip(std) {
        // Epsilons: one product.
        assert!(
            (u - factor * std).abs() <= 2.0 * f64::EPSILON * u,
            "{u} {std}"
        );
    }
}

/// A quantity of the GUM: every number exactly as the result has it.
fn is_quantity(found: Node, told: &Value, expanded: &Value, unit: &str) {
    assert_eq!(numbers(found, "value"), [told["value"].as_f64().unwrap()]);
    assert_eq!(text(found, "unit"), unit);
    for (element, key) in [
        ("uncertainty", "expanded_uncertainty"),
        ("coverageFactor", "coverage_factor"),
        ("coverageProbability", "coverage_probability"),
    ] {
        assert_eq!(
            numbers(found, element),
            [expanded[key].as_f64().unwrap()],
            "{key}"
        );
    }
    let finite = told["degrees_of_freedom"].is_number();
    assert_eq!(
        text(found, "distribution"),
        if finite { "t" } else { "normal" }
    );
}

#[test]
fn certificates_hold_the_numbers_of_their_results() {
    let folder = certified();
    let texts: Vec<String> = RESULTS
        .iter()
        .map(|(n, _)| folder.read(&format!("{n}.xml")))
        .collect();
    let of = |wanted: &str| {
        let place = RESULTS.iter().position(|(n, _)| *n == wanted).unwrap();
        let json: Value = json(&folder.read(&format!("{wanted}.json"))).unwrap();
        (Document::parse(&texts[place]).unwrap(), json)
    };
    for wanted in ["reversal", "fitted"] {
        let (xml, json) = of(wanted);
        let alpha = &json["tilts"]["alpha"];
        is_quantity(
            quantity(&xml, "Tilts", "alpha"),
            alpha,
            &alpha["expanded"],
            r"\radian",
        );
        let factor = alpha["expanded"]["coverage_factor"].as_f64().unwrap();
        let forms = &json["forms"];
        let form = quantity(&xml, "Forms", "form S_A");
        is_list(
            form,
            &forms["S_A"],
            &forms["S_A_std"],
            r"\micro\metre",
            factor,
        );
        let x = quantity(&xml, "Forms", "position");
        assert_eq!(numbers(x, "valueXMLList"), list(&forms["x"]));
        assert_eq!(text(x, "unitXMLList"), r"\milli\metre");
        // No uncertainty is made up, and that is said.
        let width = quantity(
            &xml,
            "Straightness deviation",
            "straightness of M, minimum zone",
        );
        assert_eq!(
            numbers(width, "value"),
            [json["straightness"]["M"]["minimum_zone"].as_f64().unwrap()]
        );
        assert!(numbers(width, "uncertainty").is_empty());
        assert!(
            text(child(width, DCC, "description").unwrap(), "content").contains("no uncertainty")
        );
    }
    let (xml, json) = of("designs");
    let tilt = &json["tilts"]["alpha_h"];
    is_quantity(
        quantity(&xml, "Tilts", "alpha_h"),
        tilt,
        &tilt["expanded"],
        r"\radian",
    );
    let (xml, json) = of("circle");
    let radius = &json["fit"]["radius"];
    let found = quantity(&xml, "Circle of least squares", "radius");
    is_quantity(found, radius, &radius["expanded"], r"\milli\metre");
    let (xml, json) = of("four");
    let factor = json["uncertainty"]["coverage_factor"].as_f64().unwrap();
    let found = quantity(&xml, "tilt of the slide", "tilt of the slide");
    is_list(
        found,
        &json["tilt"]["gamma"],
        &json["tilt"]["gamma_std"],
        r"\radian",
        factor,
    );
    let found = quantity(&xml, "Straightness deviation", "straightness, minimum zone");
    assert_eq!(
        numbers(found, "intervalMax"),
        [json["straightness_error"]["interval"][1].as_f64().unwrap()]
    );
    let (xml, json) = of("steps");
    let factor = json["uncertainty"]["coverage_factor"].as_f64().unwrap();
    let error = &json["components"][1];
    assert_eq!(error["name"], "EYX");
    let found = quantity(&xml, "EYX, straightness of X in Y", "EYX");
    is_list(
        found,
        &error["value"],
        &error["std"],
        r"\micro\metre",
        factor,
    );
    let (xml, json) = of("predict");
    let told = &json["points"][0]["deviation"]["y"];
    let found = quantity(&xml, "Point <a> & \"b\"", "deviation along Y");
    is_quantity(found, &told["result"], &told["expanded"], r"\micro\metre");
    let (xml, json) = of("round");
    let trials = &json["results"][0]["monte_carlo"];
    let found = quantity(&xml, "circularity", "circularity, mean of 400 trials");
    assert_eq!(
        numbers(found, "standardUnc"),
        [trials["std"].as_f64().unwrap()]
    );
    assert_eq!(
        numbers(found, "intervalMin"),
        [trials["shortest_interval"]["lower"].as_f64().unwrap()]
    );
    let (xml, json) = of("straightness");
    let found = quantity(&xml, "Profile", "deviation from the line through the ends");
    assert_eq!(
        numbers(found, "valueXMLList"),
        list(&json["profile"]["end_point"])
    );
}

#[test]
fn a_certificate_of_positioning_has_every_figure() {
    let folder = certified();
    let json: Value = json(&folder.read("positioning.json")).unwrap();
    let written = folder.read("positioning.xml");
    let xml = Document::parse(&written).unwrap();
    for (key, group) in [
        ("iso230_2", "Figures of ISO 230-2"),
        ("vdi3441", "Figures of VDI/DGQ 3441"),
    ] {
        for (figure, told) in json[key].as_object().unwrap() {
            let found = quantity(&xml, group, &figure.replace('_', " "));
            assert_eq!(numbers(found, "value"), [told["value"].as_f64().unwrap()]);
            let (u, std) = (told["U"].as_f64().unwrap(), told["std"].as_f64().unwrap());
            assert_eq!(numbers(found, "uncertainty"), [u]);
            // Epsilons: a quotient and a product.
            let factor = numbers(found, "coverageFactor")[0];
            assert!(
                (factor * std - u).abs() <= 4.0 * f64::EPSILON * u,
                "{figure}"
            );
            assert_eq!(text(found, "unit"), r"\micro\metre");
        }
    }
    let mean: Vec<f64> = json["points"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["mean_forward"].as_f64().unwrap())
        .collect();
    let found = quantity(&xml, "Values by target", "mean deviation forward");
    assert_eq!(numbers(found, "valueXMLList"), mean);
    // What is left out is told beside it.
    let about: Value = serde_json::from_str(&folder.read("positioning.xml.about.json")).unwrap();
    crate::command::documented(&about, "docs/json/export.md");
    let left = about["not_exported"].as_array().unwrap();
    assert!(
        left.iter().any(|l| l["name"]
            .as_str()
            .unwrap()
            .starts_with("uncertainty of Values by target")),
        "{left:?}"
    );
    // A result of an earlier version has no standard uncertainties: no factor is made up.
    folder.write(
        "old.json",
        &folder
            .read("positioning.json")
            .replace("\"std\"", "\"was\""),
    );
    printed(
        &folder,
        "export dcc old.json --admin admin.toml --out old.xml",
    );
    let written = folder.read("old.xml");
    let xml = Document::parse(&written).unwrap();
    let found = quantity(&xml, "Figures of ISO 230-2", "A");
    assert!(numbers(found, "coverageFactor").is_empty());
    assert!(
        text(child(found, DCC, "description").unwrap(), "content").contains("no coverage factor")
    );
}

#[test]
fn digits_are_those_of_the_result() {
    let folder = certified();
    for (result, _) in RESULTS {
        let json = folder.read(&format!("{result}.json"));
        let written = folder.read(&format!("{result}.xml"));
        let xml = Document::parse(&written).unwrap();
        let values = ["value", "valueXMLList", "intervalMin", "standardUnc"];
        let all = xml
            .descendants()
            .filter(|n| n.tag_name().namespace() == Some(SI));
        let texts = all
            .filter(|n| values.contains(&n.tag_name().name()))
            .filter_map(|n| n.text());
        let mut count = 0;
        for number in texts.flat_map(|t| t.split(' ')) {
            // Whole positions such as 10.0 may be 10 there.
            let whole = number.trim_end_matches(".0");
            assert!(
                json.contains(number) || json.contains(whole),
                "{result}: {number}"
            );
            count += 1;
        }
        assert!(count > 2 || result == "round", "{result}: {count}");
    }
}
