//! The calibration certificate, read back with an XML reader: structure, numbers, units, and the schema where
//! it is at hand.

mod admin;
mod numbers;
#[cfg(unix)]
mod schema;

use roxmltree::{Document, Node};

use crate::command::{Folder, run};

const DCC: &str = "https://ptb.de/dcc";
const SI: &str = "https://ptb.de/si";

/// Every kind of result with the arguments that make it.
const RESULTS: [(&str, &str); 10] = [
    ("reversal", "reversal traces.csv"),
    ("fitted", "reversal traces.csv --simultaneous"),
    ("designs", "reversal designs.csv"),
    ("circle", "circle circle.csv"),
    ("positioning", "positioning positions.csv"),
    ("straightness", "straightness profile.csv"),
    ("four", "four-sensor data.csv --setup setup.toml"),
    ("steps", "step-diagonal steps.csv"),
    ("predict", "machine machine.toml predict points.csv"),
    (
        "round",
        "machine machine.toml circularity --centre 50,50 --radius 20 --trials 400",
    ),
];

fn fixture(name: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures")
        .join(name);
    std::fs::read_to_string(path).unwrap()
}

fn printed(folder: &Folder, arguments: &str) -> String {
    let out = run(folder, &arguments.split(' ').collect::<Vec<_>>());
    assert_eq!(out.status, 0, "{arguments}: {}", out.stderr);
    out.stdout
}

/// Results and their certificates, `NAME.json` and `NAME.xml`.
fn certified() -> Folder {
    let folder = Folder::with(&[
        ("admin.toml", &fixture("dcc/admin.toml")),
        ("points.csv", "point,x,y\n<a> & \"b\",10,10\nb,90,15\n"),
        (
            "profile.csv",
            "x,deviation\n0,-0.31\n50,0.2\n100,0.93\n150,0.4\n200,0.11\n",
        ),
        ("circle.csv", &fixture("circle/six_points.csv")),
        ("data.csv", &fixture("four_sensor/data.csv")),
        ("setup.toml", &fixture("four_sensor/setup.toml")),
        ("machine.toml", &fixture("nistir6868/machine.toml")),
    ]);
    for (name, arguments) in [
        ("traces.csv", "simulate reversal --positions 11"),
        (
            "designs.csv",
            "simulate reversal --positions 11 --design 0/0,180/0,90/0,0/180,180/180,90/180",
        ),
        ("positions.csv", "simulate positioning --targets 6"),
        (
            "steps.csv",
            "simulate step-diagonal --steps 2 --target retro-reflector",
        ),
    ] {
        let text = printed(&folder, arguments);
        folder.write(name, &text);
    }
    for (name, arguments) in RESULTS {
        let json = printed(&folder, &format!("{arguments} --format json"));
        folder.write(&format!("{name}.json"), &json);
        let export = format!("export dcc {name}.json --admin admin.toml --out {name}.xml");
        printed(&folder, &export);
    }
    folder
}

fn child<'a>(node: Node<'a, 'a>, space: &'static str, name: &'static str) -> Option<Node<'a, 'a>> {
    node.children().find(|n| n.has_tag_name((space, name)))
}

/// What `dcc:name` says.
fn name<'a>(node: Node<'a, 'a>) -> &'a str {
    let content = child(node, DCC, "name").and_then(|n| child(n, DCC, "content"));
    content.and_then(|n| n.text()).unwrap_or_default()
}

/// The quantity of a name in the result of a name.
fn quantity<'a>(document: &'a Document<'a>, result: &str, of: &str) -> Node<'a, 'a> {
    let mut results = document
        .descendants()
        .filter(|n| n.has_tag_name((DCC, "result")));
    let result = results
        .find(|n| name(*n) == result)
        .unwrap_or_else(|| panic!("{result}"));
    let mut all = result
        .descendants()
        .filter(|n| n.has_tag_name((DCC, "quantity")));
    all.find(|n| name(*n) == of)
        .unwrap_or_else(|| panic!("{of}"))
}

/// The numbers of the element of a name.
fn numbers(quantity: Node, element: &str) -> Vec<f64> {
    let found = quantity
        .descendants()
        .find(|n| n.tag_name().name() == element);
    let text = found.and_then(|n| n.text()).unwrap_or_default();
    text.split(' ')
        .filter(|t| !t.is_empty())
        .map(|t| t.parse().unwrap())
        .collect()
}

fn text<'a>(quantity: Node<'a, 'a>, element: &str) -> &'a str {
    let found = quantity
        .descendants()
        .find(|n| n.tag_name().name() == element);
    found.and_then(|n| n.text()).unwrap_or_default()
}
