//! A diagnosis never contradicts itself: verdict, interval of the gap, sentence, text, page and JSON
//! agree, over all models, with effects great and small, with none, with outliers and with the effect
//! withheld from the catalogue.

use crate::command::{Folder, run};
use errsep::report::number::{measured, plain};
use scraper::{Html, Selector};
use serde_json::Value;

/// Alarm of the command where none is asked for.
const FALSE_ALARM: f64 = 0.01;

/// One diagnosis as a person and a program receive it.
struct Told {
    case: String,
    text: String,
    page: String,
    json: Value,
}

/// A way to make data and to diagnose them.
struct Case {
    simulate: &'static str,
    setup: &'static str,
    /// An effect with a small and a great size.
    effects: &'static [(&'static str, [&'static str; 2])],
    /// What else the diagnosis needs.
    options: &'static str,
    /// The column that outliers go to, and their size.
    outlier: (usize, f64),
}

const CASES: &[Case] = &[
    Case {
        simulate: "reversal --positions 31 --repeats 2 --both-directions --noise 0.05",
        setup: "",
        effects: &[
            ("cyclic-error", ["0.02", "0.15"]),
            ("taper", ["3e-7", "5e-6"]),
            ("local-contamination", ["0.2", "2"]),
            ("thermal-drift", ["0.1", "1"]),
        ],
        options: "",
        outlier: (5, 1.0),
    },
    Case {
        simulate: "circle --points 48 --noise 1",
        setup: "[circle]\nnoise = 1.0\n",
        effects: &[("lobes", ["1", "6"]), ("scale-mismatch", ["3e-5", "2e-4"])],
        options: "",
        outlier: (0, 0.02),
    },
    Case {
        simulate: "four-sensor --points 19",
        setup: "[sensors]\nspacing = [5.0, 5.0, 25.0]\nnoise = 0.1\n",
        effects: &[("gain", ["0.01", "0.05"])],
        options: "",
        outlier: (1, 3.0),
    },
    Case {
        simulate: "fourier --samples 80 --noise 2",
        setup: "[section]\nlength = 100.0\n[probe]\nnoise = 2.0\n",
        effects: &[("height-difference", ["4", "30"])],
        options: "",
        outlier: (3, 20.0),
    },
    Case {
        simulate: "step-diagonal --noise 0.2",
        setup: "[test]\nnoise = 0.2\n",
        effects: &[("mirror-misalignment", ["4e-6", "1e-4"])],
        options: "",
        outlier: (7, 5.0),
    },
    Case {
        simulate: "calibration-line --sets 3 --noise 0.001",
        setup: "",
        effects: &[
            ("quadratic", ["0.008", "0.05"]),
            ("drift", ["0.003", "0.03"]),
        ],
        options: "",
        outlier: (1, 0.02),
    },
    Case {
        simulate: "machine setup.toml --points points.csv --parts 4 --noise 0.5",
        setup: "chain = \"XYFZ\"\n[errors.EXX]\npolynomial = [0.0, -0.02]\n",
        effects: &[("squareness-change", ["3e-6", "3e-5"])],
        options: "--points points.csv",
        outlier: (4, 5.0),
    },
];

const POINTS: &str = "point,x,y\n1,10,10\n2,140,10\n3,140,130\n4,20,120\n5,80,60\n";

fn words(text: &str) -> Vec<&str> {
    text.split_whitespace().collect()
}

/// The data of a seed, as the command prints or writes them.
fn made(folder: &Folder, case: &Case, seed: &str, effect: Option<(&str, &str)>) -> String {
    let mut arguments = vec!["simulate"];
    arguments.extend(words(case.simulate));
    arguments.extend(["--seed", seed]);
    let effect = effect.map(|(name, size)| format!("{name}={size}"));
    if let Some(effect) = &effect {
        arguments.extend(["--effect", effect]);
    }
    let parts = case.simulate.starts_with("machine");
    let place = format!("made{seed}{}", effect.as_deref().unwrap_or(""));
    if parts {
        arguments.extend(["--out", &place]);
    }
    let out = run(folder, &arguments);
    assert_eq!(out.status, 0, "{}", out.stderr);
    if parts {
        folder.read(&format!("{place}/parts.csv"))
    } else {
        out.stdout
    }
}

/// The same with one number raised.
fn with_outlier(data: &str, (column, by): (usize, f64)) -> String {
    let middle = data.lines().count() / 2;
    let rows = data.lines().enumerate().map(|(k, line)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        match fields.get(column).and_then(|f| f.parse::<f64>().ok()) {
            Some(value) if k == middle => {
                fields[column] = (value + by).to_string();
                fields.join(",")
            }
            _ => line.to_owned(),
        }
    });
    rows.collect::<Vec<_>>().join("\n") + "\n"
}

fn diagnosed(folder: &Folder, case: &Case, name: &str, data: &str, without: &str) -> Told {
    folder.write("d.csv", data);
    let place = format!("report {name} {without}").replace(' ', "-");
    let model = words(case.simulate)[0];
    let mut arguments = vec!["diagnose", "d.csv", "--model", model, "--out", &place];
    if !case.setup.is_empty() {
        arguments.extend(["--setup", "setup.toml"]);
    }
    arguments.extend(words(case.options));
    if !without.is_empty() {
        arguments.extend(["--without", without]);
    }
    let out = run(folder, &arguments);
    assert_eq!(out.status, 0, "{model} {name}: {}", out.stderr);
    let page = Html::parse_document(&folder.read(&format!("{place}/report.html")));
    let body = Selector::parse("body").unwrap();
    let words: Vec<&str> = page.select(&body).flat_map(|b| b.text()).collect();
    Told {
        case: format!("{model} {name} without {without:?}"),
        text: out.stdout,
        page: squeezed(&words.join(" ")),
        json: serde_json::from_str(&folder.read(&format!("{place}/result.json"))).unwrap(),
    }
}

fn squeezed(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn names(list: &Value) -> Vec<&str> {
    list.as_array()
        .unwrap()
        .iter()
        .map(|e| e.as_str().unwrap())
        .collect()
}

impl Told {
    fn says(&self, statement: &str, what: &str) {
        assert!(
            statement.contains(what),
            "{}: \"{what}\" is not in: {statement}",
            self.case
        );
    }

    fn number(&self, path: &str) -> f64 {
        let value = self.json.pointer(path).and_then(Value::as_f64);
        value.unwrap_or_else(|| panic!("{}: {path}", self.case))
    }

    /// What must hold of every diagnosis.
    fn agrees(&self) -> &str {
        let verdict = &self.json["verdict"];
        let kind = verdict["kind"].as_str().unwrap();
        let said = verdict["statement"].as_str().unwrap();
        let case = &self.case;
        let (p, low) = (self.number("/verdict/p_value"), "/gap/before/ci95/0");
        // One test decides; the interval of the gap follows it.
        assert_eq!(kind == "none", p > FALSE_ALARM, "{case}: {said}");
        assert!(kind != "none" || self.number(low) == 0.0, "{case}: {said}");
        let shrink = 1.0 - self.number("/gap/after/rms") / self.number("/gap/before/rms");
        let told = self.number("/gap/shrink");
        // Epsilons: the same quotient.
        assert!(
            self.number("/gap/before/rms") == 0.0 || (told - shrink).abs() < 1e-12,
            "{case}"
        );
        let named = names(&verdict["effects"]);
        let partial = names(&verdict["partial"]);
        assert_eq!(kind == "effect", !named.is_empty(), "{case}: {said}");
        assert!(kind == "unknown" || partial.is_empty(), "{case}: {said}");
        assert_eq!(kind == "none", said.starts_with("No significant misfit"));
        assert_eq!(
            kind == "unknown",
            said.contains("no effect of the catalogue explains it"),
            "{case}: {said}"
        );
        for contradiction in ["misses 0 ", "leave 0 ", " 0 µm", "log-", "ln s", " um"] {
            assert!(!said.contains(contradiction), "{case}: {said}");
            for shown in [&self.text, &self.page] {
                let unit = shown.lines().find(|line| line.contains(" um"));
                assert_eq!(unit, None, "{case}");
            }
        }
        self.sizes(kind, said);
        self.groups(&named, said);
        self.moves(!named.is_empty() || !partial.is_empty());
        assert!(self.text.contains(said), "{case}: {}", self.text);
        self.says(&self.page, &squeezed(said));
        kind
    }

    /// The gap is the same in sentence, text and page.
    fn sizes(&self, kind: &str, said: &str) {
        let unit = self.json["gap"]["unit"].as_str().unwrap();
        let unit = unit.replace("um", "µm");
        let figures = |which: &str| {
            let of = |part: &str| plain(self.number(&format!("/gap/{which}/{part}")), 3);
            (of("rms"), of("ci95/0"), of("ci95/1"))
        };
        let (rms, low, high) = figures("before");
        self.says(&self.text, &format!("{rms} [{low}, {high}]"));
        self.says(&self.page, &format!("95 % interval {low} to {high}"));
        if kind != "none" {
            let size = if rms == "0" {
                format!("less than {high} {unit} RMS")
            } else {
                format!("misses {rms} {unit} RMS")
            };
            self.says(said, &size);
        }
        if kind == "effect" {
            let (rms, _, high) = figures("after");
            let size = if rms == "0" {
                format!("less than {high} {unit} RMS remain")
            } else {
                format!(" {rms} {unit} RMS remain")
            };
            self.says(said, &size);
            let clear = self.number("/gap/after/ci95/0") > 0.0;
            assert_eq!(clear, said.contains("more than the noise explains"));
        }
    }

    /// A group is told whole, the greatest evidence first, and none of it asserted.
    fn groups(&self, named: &[&str], said: &str) {
        let candidates = self.json["candidates"].as_array().unwrap();
        let evidence = |effect: &str| {
            let own = candidates.iter().find(|c| c["effect"] == effect).unwrap();
            (own["evidence"].as_f64().unwrap(), &own["in_set"])
        };
        let groups = self.json["verdict"]["indistinguishable"]
            .as_array()
            .unwrap();
        let in_groups: Vec<&str> = groups.iter().flat_map(names).collect();
        for candidate in candidates {
            let effect = candidate["effect"].as_str().unwrap();
            let in_set = named.contains(&effect) || in_groups.contains(&effect);
            assert_eq!(candidate["in_set"], in_set, "{}: {effect}", self.case);
        }
        for effect in named {
            self.says(said, effect);
        }
        assert_eq!(groups.is_empty(), !said.contains("one of: "), "{said}");
        for group in groups.iter().map(names) {
            assert!(named.contains(&group[0]), "{}: {group:?}", self.case);
            for pair in group.windows(2) {
                // Evidence closer than a thousandth counts as equal.
                let (first, next) = (evidence(pair[0]).0, evidence(pair[1]).0);
                let ordered = first > next - 2e-3;
                // Of several causes those of greatest evidence must also pass together.
                assert!(ordered || named.len() > 1, "{}: {pair:?}", self.case);
            }
            let beginning = said.find("one of: ").unwrap();
            let mut from = beginning;
            for effect in &group {
                let at = said[from..].find(effect);
                from += at.unwrap_or_else(|| panic!("{}: {effect}: {said}", self.case));
            }
            self.says(&self.page, &format!("One of: {}.", group.join(", ")));
            assert!(
                !said.contains(&format!("because of {}", group[0])),
                "{said}"
            );
        }
    }

    /// What the answer moves by is the same number in JSON, text and page.
    fn moves(&self, taken_out: bool) {
        for bias in self.json["bias"].as_array().unwrap() {
            let number = |key: &str| bias[key].as_f64().unwrap();
            if !taken_out {
                assert_eq!(number("moved"), 0.0, "{}", self.case);
                continue;
            }
            let scale = if bias["unit"] == "rad" { 1e6 } else { 1.0 };
            // Less than a millionth of what the quantity is known to is rounding.
            let shown = |key: &str| match number(key) {
                value if value.abs() > 1e-6 * number("std") => scale * value,
                _ => 0.0,
            };
            let moved = measured(shown("moved"), Some(shown("moved_std")));
            self.says(&self.page, &moved);
            self.says(&self.text, &format!("moved {moved}"));
        }
        assert_eq!(self.text.contains("Bias of the answer"), taken_out);
    }
}

/// All models; every effect small and great, with the catalogue and withheld; none; an outlier.
#[test]
fn every_part_of_a_diagnosis_says_the_same() {
    let mut kinds: Vec<String> = Vec::new();
    for case in CASES {
        let folder = Folder::with(&[("setup.toml", case.setup), ("points.csv", POINTS)]);
        let mut diagnose = |name: &str, data: &str, without: &str| {
            let told = diagnosed(&folder, case, name, data, without);
            kinds.push(told.agrees().to_owned());
        };
        let none = made(&folder, case, "1", None);
        diagnose("nothing", &none, "");
        diagnose("outlier", &with_outlier(&none, case.outlier), "");
        for (effect, sizes) in case.effects {
            for size in sizes {
                let data = made(&folder, case, "2", Some((effect, size)));
                diagnose(&format!("{effect} {size}"), &data, "");
                if *size == sizes[1] {
                    diagnose(&format!("{effect} {size}"), &data, effect);
                }
            }
        }
    }
    for kind in ["none", "effect", "unknown"] {
        let count = kinds.iter().filter(|k| *k == kind).count();
        assert!(count >= 5, "{kind} in {count} of {}", kinds.len());
    }
}

/// A period too short for any place to show it, withheld or not, leaves a clear gap: that is unknown
/// and not nothing.
#[test]
fn a_clear_gap_that_no_place_shows_is_not_nothing() {
    let case = Case {
        simulate: "reversal --thickness 42 --repeats 2 --both-directions --noise 0.05 --positions 61",
        ..CASES[0]
    };
    let folder = Folder::with(&[]);
    let data = made(&folder, &case, "14", Some(("cyclic-error", "0.15")));
    let told = diagnosed(&folder, &case, "short period", &data, "");
    assert_ne!(told.agrees(), "none");
    assert!(told.number("/gap/before/ci95/0") > 0.0);
}

/// One reading in error by 3 µm among the four sensors, anywhere: always an answer that agrees with
/// itself.
#[test]
fn one_bad_reading_of_four_sensors_is_survived() {
    let case = &CASES[2];
    let folder = Folder::with(&[("setup.toml", case.setup)]);
    let data = made(&folder, case, "1", None);
    let lines: Vec<&str> = data.lines().collect();
    let first = lines.iter().position(|l| l.starts_with("x,")).unwrap() + 1;
    for (row, column) in [(0, 3), (1, 2), (2, 1), (2, 2), (5, 1), (6, 1)] {
        let mut changed: Vec<String> = lines.iter().map(|l| (*l).to_owned()).collect();
        let mut fields: Vec<String> = changed[first + row].split(',').map(str::to_owned).collect();
        let value: f64 = fields[column].parse().unwrap();
        fields[column] = (value + 3.0).to_string();
        changed[first + row] = fields.join(",");
        let name = format!("sensor {column} at {row}");
        diagnosed(&folder, case, &name, &(changed.join("\n") + "\n"), "").agrees();
    }
}

/// A bent calibration line is told by all that bend it, not by the first of them.
#[test]
fn a_group_is_named_as_a_group_by_its_evidence() {
    let case = Case {
        simulate: "calibration-line --noise 0.001",
        ..CASES[5]
    };
    let folder = Folder::with(&[]);
    let mut groups = 0;
    for seed in ["1", "2", "3", "4", "5", "6"] {
        let data = made(&folder, &case, seed, Some(("quadratic", "0.05")));
        let told = diagnosed(&folder, &case, seed, &data, "");
        told.agrees();
        groups += told.json["verdict"]["indistinguishable"]
            .as_array()
            .unwrap()
            .len();
    }
    assert!(groups >= 2, "{groups}");
}
