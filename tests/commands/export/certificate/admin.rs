//! What a certificate says beside its numbers.

use roxmltree::{Document, Node};

use super::{DCC, SI, certified, child, fixture, name, printed, text};
use crate::command::{Folder, bad_input};

#[test]
fn administrative_data_are_those_of_the_file() {
    let folder = certified();
    let written = folder.read("circle.xml");
    let xml = Document::parse(&written).unwrap();
    let root = xml.root_element();
    assert!(root.has_tag_name((DCC, "digitalCalibrationCertificate")));
    assert_eq!(root.attribute("schemaVersion"), Some("3.2.1"));
    let names: Vec<&str> = root
        .children()
        .filter(Node::is_element)
        .map(|n| n.tag_name().name())
        .collect();
    assert_eq!(names, ["administrativeData", "measurementResults"]);
    for (element, expected) in [
        ("uniqueIdentifier", "example.org/calibration/2026-0042"),
        ("beginPerformanceDate", "2026-11-03"),
        ("performanceLocation", "customer"),
        ("calibrationLaboratoryCode", "D-K-00000-00"),
        ("role", "head of the laboratory"),
        ("model", "L 500"),
    ] {
        assert_eq!(text(root, element), expected);
    }
    let customer = root
        .descendants()
        .find(|n| n.has_tag_name((DCC, "customer")))
        .unwrap();
    assert_eq!(name(customer), "Example Machining <Turning & Milling> Ltd");
    let item = root
        .descendants()
        .find(|n| n.has_tag_name((DCC, "item")))
        .unwrap();
    let texts: Vec<(Option<&str>, Option<&str>)> = child(item, DCC, "name")
        .unwrap()
        .children()
        .filter(Node::is_element)
        .map(|n| (n.attribute("lang"), n.text()))
        .collect();
    assert_eq!(
        texts,
        [
            (Some("de"), Some("Drehmaschine")),
            (Some("en"), Some("lathe"))
        ]
    );
    let spaces: Vec<&str> = root.namespaces().map(|n| n.uri()).collect();
    assert!(spaces.contains(&SI), "{spaces:?}");
}

#[test]
fn what_is_missing_is_named_by_table_and_key() {
    let admin = fixture("dcc/admin.toml");
    let folder = Folder::with(&[("circle.csv", &fixture("circle/six_points.csv"))]);
    folder.write(
        "circle.json",
        &printed(&folder, "circle circle.csv --format json"),
    );
    let words = [
        "export",
        "dcc",
        "circle.json",
        "--admin",
        "admin.toml",
        "--out",
        "c.xml",
    ];
    for (from, to, expected) in [
        (
            "identifier = ",
            "# ",
            &["[certificate] has no `identifier`"][..],
        ),
        (
            "begin = ",
            "# ",
            &["[certificate] has no `begin`", "under [certificate]"],
        ),
        ("2026-11-04", "2026-11-01", &["`end` is before `begin`"]),
        (
            "2026-11-04",
            "2026-11-04T10:00:00",
            &["[certificate] `end` is no day"],
        ),
        ("2026-11-04", "\"soon\"", &["[certificate] `end` is no day"]),
        (
            "country = \"DE\"",
            "country = \"Germany\"",
            &["[certificate] `country`", "two letters"],
        ),
        ("[\"en\", \"de\"]", "[\"de\"]", &["lacks \"en\""]),
        (
            "[\"en\", \"de\"]",
            "[\"en\"]",
            &["`de`", "[certificate] `languages`"],
        ),
        (
            "\"customer\"",
            "\"home\"",
            &["[certificate] `place`", "laboratoryBranch"],
        ),
        (
            "city = \"Musterstadt\"",
            "",
            &["[laboratory] has no `city`"],
        ),
        (
            "name = \"Erika Mustermann\"",
            "",
            &["[[person]] has no `name`"],
        ),
        ("[[item]]", "[[equipment]]", &["[[item]] has no `name`"]),
        (
            "issuer = \"owner\"",
            "issuer = \"me\"",
            &["[[item]] `identification.issuer`", "owner"],
        ),
        (
            "model = \"L 500\"",
            "modell = \"L 500\"",
            &["unknown key `modell`", "did you mean `model`"],
        ),
        (
            "Musterdorf",
            "\\u0001",
            &["[customer] `city` has a control character"],
        ),
    ] {
        assert!(admin.contains(from), "{from}");
        folder.write("admin.toml", &admin.replacen(from, to, 1));
        bad_input(&folder, &words, expected);
        bad_input(&folder, &words, &["admin.toml"]);
        assert!(!folder.path().join("c.xml").exists());
    }
    folder.write("admin.toml", &admin);
    let over = [
        "export",
        "dcc",
        "circle.json",
        "--admin",
        "admin.toml",
        "--out",
        "admin.toml",
        "--force",
    ];
    bad_input(&folder, &over, &["is the file of --admin"]);
}
