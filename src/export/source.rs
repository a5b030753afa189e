//! What a result holds for a controller or a certificate.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use errsep_models::machine::{COMPONENTS, Component, ErrorFunction, Kind as ComponentKind, Side};
use serde_json::Value;

use super::Known;
use super::certificate::Numbers;
use super::grid;
use super::loaded::Loaded;
use crate::io::machine::read_filed;
use crate::io::units::{ARCSEC_PER_DEG, UM_PER_MM, mm_from_um, um_from_mm};
use crate::io::{Message, source::Source};

/// A longer file is no result, bytes.
const LONGEST: u64 = 1 << 28;

/// A result, as far as a format can use it.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Of one axis along itself.
    Positioning(AxisErrors),
    /// Of one axis across itself.
    Straightness(StraightnessProfile),
    /// The component errors of a machine.
    Machine(MachineErrors),
    /// Numbers with their uncertainties.
    Numbers(Numbers),
}

/// Deviations of one axis by direction of approach: mm, of a rotary axis degrees.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisErrors {
    /// Name of the axis.
    pub name: Option<String>,
    /// Whether positions and errors are in degrees.
    pub rotary: bool,
    /// Ascending targets.
    pub positions: Vec<f64>,
    /// Mean deviations forward; those of the other direction where only one was measured.
    pub forward: Vec<f64>,
    /// Mean deviations backward, likewise.
    pub backward: Vec<f64>,
    /// Whether both directions were measured.
    pub both: bool,
    /// How well the deviations are known, where the result tells it.
    pub known: Option<Scatter>,
}

/// How well the means of a positioning test are known: mm, of a rotary axis degrees.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    /// Standard uncertainty of the mean at each target, forward and backward, from the scatter of the readings;
    /// independent of each other.
    pub means: [Vec<f64>; 2],
    /// Degrees of freedom of the least known of them.
    pub degrees_of_freedom: f64,
    /// Whether both are the same mean.
    pub one_direction: bool,
    /// Standard uncertainty of the last deviation against the first, in proportion between.
    pub of_length: f64,
    /// Standard uncertainty of each mean beside its scatter.
    pub of_mean: f64,
}

impl Scatter {
    /// Standard uncertainty of `weights` of the forward and the backward mean at a place, straight lines between the
    /// targets `x`, less the mean of both directions at the reference (else nothing).
    pub(super) fn std(&self, x: &[f64], weights: [f64; 2], at: f64, reference: Option<f64>) -> f64 {
        let mut shares: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        let mut add = |place: f64, weights: [f64; 2]| {
            for (i, share) in grid::shares(x, place) {
                for (d, weight) in weights.into_iter().enumerate() {
                    let d = if self.one_direction { 0 } else { d };
                    *shares.entry((d, i)).or_default() += weight * share;
                }
            }
        };
        add(at, weights);
        if let Some(zero) = reference {
            add(zero, [-0.5, -0.5]);
        }
        let (first, last) = (x.first().copied(), x.last().copied());
        let length = last.zip(first).map_or(1.0, |(last, first)| last - first);
        let from = reference.or(first).unwrap_or_default();
        let of = |((d, i), share): (&(usize, usize), &f64)| {
            let mean = self.means[*d].get(*i).copied().unwrap_or_default();
            share * share * (mean * mean + self.of_mean * self.of_mean)
        };
        let squares: f64 = shares.iter().map(of).sum();
        (squares + (self.of_length * (at - from) / length).powi(2)).sqrt()
    }
}

impl AxisErrors {
    /// Unit of its positions: mm or deg.
    pub(super) const fn position_unit(&self) -> &'static str {
        if self.rotary { "deg" } else { "mm" }
    }
}

/// A straightness profile, mm over mm.
#[derive(Debug, Clone, PartialEq)]
pub struct StraightnessProfile {
    /// What the result calls it.
    pub name: String,
    /// Ascending positions.
    pub positions: Vec<f64>,
    /// Deviations.
    pub deviations: Vec<f64>,
    /// Their standard uncertainties, where the result tells them.
    pub std: Option<Vec<f64>>,
}

impl StraightnessProfile {
    /// How well straight lines between its points are known: as well as these are at most, as what their errors have
    /// in common is not told.
    pub(super) fn known(&self, at: &[f64]) -> Option<Known> {
        let std = self.std.as_ref()?;
        let of = |x: &f64| um_from_mm(grid::interpolate(&self.positions, std, *x));
        Some(Known {
            of: self.name.clone(),
            unit: "um",
            at: at.to_vec(),
            std: at.iter().map(of).collect(),
            degrees_of_freedom: None,
        })
    }
}

/// Component errors under their ISO 230-1 names: mm and rad over mm.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MachineErrors {
    /// Functions of the coordinate of their axis, in µm and rad as the model has them.
    pub functions: Vec<(Component, ErrorFunction)>,
    /// Standard uncertainties of the values of tables, in µm and rad, where the result tells them.
    pub stds: Vec<(Component, Vec<f64>)>,
    /// A0Z, B0Z and C0Y, rad, where they are told.
    pub squareness: Vec<(Component, f64)>,
    /// What is not told, and why.
    pub missing: Vec<(String, String)>,
    /// Which side each axis carries, where that is known.
    pub moves: Option<String>,
    /// The axes in the order from the workpiece to the tool with F for the frame, where that is known.
    pub chain: Option<String>,
}

/// Reads a result (JSON), or a machine (TOML).
///
/// # Errors
/// The file cannot be read, is neither, or is a result that holds nothing for any format; such a message
/// names what does.
pub fn read(path: &Path) -> Result<Loaded, Message> {
    let unreadable = |e: std::io::Error| {
        Message::bad_input(format!("the result cannot be read: {e}"))
            .in_file(path)
            .remedy("give result.json of a report, or what --format json printed")
    };
    let mut bytes = Vec::new();
    Source::open(path)
        .and_then(|source| source.take(LONGEST + 1).read_to_end(&mut bytes))
        .map_err(unreadable)?;
    if bytes.len() as u64 > LONGEST {
        return Err(
            Message::bad_input("the file is longer than 256 MiB, no result is")
                .in_file(path)
                .remedy("give result.json of a report"),
        );
    }
    if path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    {
        let filed = read_filed(path, None)?;
        return Ok(Loaded::machine(machine(&filed.machine)));
    }
    let start = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes);
    let text = std::str::from_utf8(start).map_err(|e| e.to_string());
    let result = text.and_then(|text| super::exact::json(text).map_err(|e| e.to_string()));
    let result = result.map_err(|e| {
        Message::bad_input(format!("this is no JSON: {e}"))
            .in_file(path)
            .remedy(
                "give result.json of a report, what --format json printed, or a machine as .toml",
            )
    })?;
    Loaded::of(&result).map_err(|message| message.in_file(path))
}

/// What a controller can use of a result; nothing for a schema that no controller takes, or where the result
/// lacks what its schema says.
pub(super) fn for_controller(schema: &str, result: &Value) -> Option<Option<Content>> {
    Some(match schema {
        "errsep.positioning/1" => positioning(result).map(Content::Positioning),
        "errsep.straightness/1" => straightness(
            "straightness",
            &result["profile"],
            "x",
            "least_squares",
            None,
        ),
        "errsep.reversal/1" => straightness(
            "form M of the slide",
            &result["forms"],
            "x",
            "M",
            Some("M_std"),
        ),
        "errsep.four-sensor/1" => straightness(
            "straightness S of the slide",
            &result["straightness"],
            "x",
            "S",
            Some("S_std"),
        ),
        "errsep.fourier/1" => straightness(
            "straightness of the slide",
            &result["profiles"],
            "x",
            "slide",
            Some("slide_std"),
        ),
        "errsep.step-diagonal/1" => step_diagonal(result).map(Content::Machine),
        "errsep.machine/1" => machine_result(result).map(Content::Machine),
        _ => return None,
    })
}

/// Every format with what it takes.
pub(super) fn all_formats() -> String {
    let told: Vec<String> = super::FORMATS
        .iter()
        .map(|f| format!("{} takes {}", f.name, f.takes.results()))
        .collect();
    told.join("; ")
}

/// Finite numbers of an array.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(Value::as_f64).collect()
}

fn ascending(x: &[f64]) -> bool {
    x.len() > 1 && x.windows(2).all(|pair| pair[0] < pair[1])
}

fn positioning(result: &Value) -> Option<AxisErrors> {
    let scale = match result["unit"].as_str()? {
        "um" => UM_PER_MM,
        "arcsec" => ARCSEC_PER_DEG,
        _ => return None,
    };
    let points = result["points"].as_array()?;
    let of = |key: &str| -> Option<Vec<f64>> {
        points
            .iter()
            .map(|p| Some(p[key].as_f64()? / scale))
            .collect()
    };
    let positions: Option<Vec<f64>> = points.iter().map(|p| p["target"].as_f64()).collect();
    let (forward, backward) = (of("mean_forward"), of("mean_backward"));
    let both = forward.is_some() && backward.is_some();
    let known = scatter(result, points, scale, both);
    let one = forward.clone().or_else(|| backward.clone())?;
    Some(AxisErrors {
        name: result["axis"]["name"].as_str().map(str::to_owned),
        rotary: scale == ARCSEC_PER_DEG,
        positions: positions.filter(|x| ascending(x))?,
        forward: forward.unwrap_or_else(|| one.clone()),
        backward: backward.unwrap_or(one),
        both,
        known,
    })
}

/// From the scatter of one reading where that is alike everywhere and readings are independent, else from that at each
/// target; nothing with one run.
fn scatter(result: &Value, points: &[Value], scale: f64, both: bool) -> Option<Scatter> {
    let told = &result["scatter"];
    let not_alike = [
        ("equal", "differs"),
        ("independent", "depends"),
        ("runs", "differ"),
    ];
    let pooled = told["std"].as_f64();
    let pooled = pooled.filter(|_| not_alike.iter().all(|(key, is)| told[key][is] != true));
    let count = |p: &Value, direction: &str| -> Option<f64> {
        let own = p[format!("readings_{direction}")].as_f64();
        own.or_else(|| result["runs"].as_f64()).filter(|n| *n > 1.0)
    };
    let of = |direction: &str| -> Option<Vec<f64>> {
        points
            .iter()
            .map(|p| {
                let own = p[format!("s_{direction}")].as_f64()?;
                Some(pooled.unwrap_or(own) / count(p, direction)?.sqrt() / scale)
            })
            .collect()
    };
    // Of the target that was read least, where each has its own.
    let counts = points
        .iter()
        .flat_map(|p| ["forward", "backward"].map(|d| count(p, d)));
    let own_freedom = counts.flatten().fold(f64::INFINITY, f64::min) - 1.0;
    let pooled_freedom = told["degrees_of_freedom"]
        .as_f64()
        .filter(|_| pooled.is_some());
    let (forward, backward) = (of("forward"), of("backward"));
    let one = forward.clone().or_else(|| backward.clone())?;
    // As stated, k = 2.
    let stated = |key: &str| 0.5 * result["uncertainty"][key].as_f64().unwrap_or_default() / scale;
    let lengths = ["device", "misalignment", "expansion"].map(stated);
    Some(Scatter {
        means: [
            forward.unwrap_or_else(|| one.clone()),
            backward.unwrap_or(one),
        ],
        degrees_of_freedom: pooled_freedom.unwrap_or(own_freedom),
        one_direction: !both,
        of_length: lengths.iter().fold(0.0_f64, |sum, u| sum.hypot(*u)),
        // It is of the difference of two means.
        of_mean: stated("drift") / std::f64::consts::SQRT_2,
    })
}

fn straightness(name: &str, profile: &Value, x: &str, y: &str, u: Option<&str>) -> Option<Content> {
    let (x, y) = (numbers(&profile[x])?, numbers(&profile[y])?);
    if x.len() != y.len() {
        return None;
    }
    let u = u
        .and_then(|u| numbers(&profile[u]))
        .filter(|u| u.len() == x.len());
    let mut order: Vec<usize> = (0..x.len()).collect();
    order.sort_by(|a, b| x[*a].total_cmp(&x[*b]));
    let positions: Vec<f64> = order.iter().map(|i| x[*i]).collect();
    let in_mm = |values: Vec<f64>| order.iter().map(|i| mm_from_um(values[*i])).collect();
    ascending(&positions).then(|| {
        Content::Straightness(StraightnessProfile {
            name: name.to_owned(),
            deviations: in_mm(y),
            std: u.map(in_mm),
            positions,
        })
    })
}

fn component(name: &str) -> Option<Component> {
    name.parse().ok()
}

fn step_diagonal(result: &Value) -> Option<MachineErrors> {
    let mut found = MachineErrors::default();
    for entry in result["components"].as_array()? {
        let name = entry["name"].as_str()?;
        let determined = entry["determined"].as_str()?;
        match (component(name), determined) {
            (Some(component), "wholly" | "shape-only") => {
                let function = ErrorFunction::Table {
                    positions: numbers(&entry["position"])?,
                    values: numbers(&entry["value"])?,
                };
                function.check(component).ok()?;
                found.functions.push((component, function));
                found
                    .stds
                    .extend(numbers(&entry["std"]).map(|std| (component, std)));
                if determined == "shape-only" {
                    let why = "the readings do not determine it".to_owned();
                    found.missing.push((format!("slope of {name}"), why));
                }
            }
            _ => {
                let why = format!("the readings determine it {determined}");
                found.missing.push((name.to_owned(), why.replace('-', " ")));
            }
        }
    }
    for entry in result["squareness"].as_array()? {
        let name = entry["name"].as_str()?;
        match (component(name), entry["value"].as_f64()) {
            (Some(component), Some(value)) if entry["determined"] == "wholly" => {
                found.squareness.push((component, value));
            }
            _ => {
                let why = "the readings do not determine it".to_owned();
                found.missing.push((name.to_owned(), why));
            }
        }
    }
    Some(found)
}

/// What `errors` of a result of `errsep machine` says.
fn machine_result(result: &Value) -> Option<MachineErrors> {
    let mut found = MachineErrors {
        moves: result["chain"].as_str().and_then(moves_of),
        chain: result["chain"].as_str().and_then(chain_of),
        ..MachineErrors::default()
    };
    for error in result["errors"].as_array()? {
        let component = component(error["component"].as_str()?)?;
        let entry = &error["function"];
        let function = match (&entry["positions"], &entry["coefficients"]) {
            (Value::Null, coefficients) => ErrorFunction::Polynomial {
                basis: errsep_models::machine::PolynomialBasis {
                    centre: entry["centre"].as_f64()?,
                    scale: entry["scale"].as_f64()?,
                    terms: coefficients.as_array()?.len(),
                },
                coefficients: numbers(coefficients)?,
            },
            (positions, _) => ErrorFunction::Table {
                positions: numbers(positions)?,
                values: numbers(&entry["values"])?,
            },
        };
        function.check(component).ok()?;
        found.add(component, function)?;
    }
    found.complete();
    Some(found)
}

fn machine(machine: &errsep_models::machine::Machine) -> MachineErrors {
    let mut found = MachineErrors {
        moves: moves_of(&machine.chain().to_string()),
        chain: Some(machine.chain().to_string()),
        ..MachineErrors::default()
    };
    for error in machine.errors() {
        // A machine that was read has no function of a squareness.
        let _ = found.add(error.component, error.function.clone());
    }
    found.complete();
    found
}

impl MachineErrors {
    fn add(&mut self, component: Component, function: ErrorFunction) -> Option<()> {
        if component.kind == ComponentKind::Squareness {
            let value = function.value(component, 0.0).ok()?;
            self.squareness.push((component, value));
        } else {
            self.functions.push((component, function));
        }
        Some(())
    }

    /// Those that the machine does not name are zero there.
    fn complete(&mut self) {
        for component in COMPONENTS {
            let there = self.functions.iter().any(|(c, _)| *c == component)
                || self.squareness.iter().any(|(c, _)| *c == component);
            if !there {
                let why = "the machine does not name it: it is taken as zero".to_owned();
                self.missing.push((component.to_string(), why));
            }
        }
    }
}

/// A chain as it is written, where it is one.
fn chain_of(text: &str) -> Option<String> {
    let chain = errsep_models::machine::Chain::parse(text).ok()?;
    Some(chain.to_string())
}

/// "X table-carrying, Y table-carrying, Z tool-carrying" of a chain.
fn moves_of(chain: &str) -> Option<String> {
    use errsep_models::machine::{Axis, Chain};
    let chain = Chain::parse(chain).ok()?;
    let told = Axis::ALL.map(|axis| {
        let carries = match chain.slide(axis).side {
            Side::Work => "table-carrying",
            Side::Tool => "tool-carrying",
        };
        format!("{} {carries}", axis.letter())
    });
    Some(told.join(", "))
}

/// The message where a format is given what it does not take.
pub(super) fn wrong(format: &super::Format) -> Message {
    Message::bad_input(format!("{} takes {}", format.name, format.takes.results())).remedy(format!(
        "{}: choose the format for the result",
        all_formats()
    ))
}
