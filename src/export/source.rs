//! What a result holds for a controller or a certificate.

use std::io::Read;
use std::path::Path;

use errsep_models::machine::{COMPONENTS, Component, ErrorFunction, Kind as ComponentKind, Side};
use serde_json::Value;

use super::certificate::Numbers;
use super::loaded::Loaded;
use crate::io::machine::read_filed;
use crate::io::units::{ARCSEC_PER_DEG, UM_PER_MM, mm_from_um};
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
}

/// Component errors under their ISO 230-1 names: mm and rad over mm.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MachineErrors {
    /// Functions of the coordinate of their axis, in µm and rad as the model has them.
    pub functions: Vec<(Component, ErrorFunction)>,
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
        "errsep.straightness/1" => {
            straightness("straightness", &result["profile"], "x", "least_squares")
        }
        "errsep.reversal/1" => straightness("form M of the slide", &result["forms"], "x", "M"),
        "errsep.four-sensor/1" => straightness(
            "straightness S of the slide",
            &result["straightness"],
            "x",
            "S",
        ),
        "errsep.fourier/1" => straightness(
            "straightness of the slide",
            &result["profiles"],
            "x",
            "slide",
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
    let one = forward.clone().or_else(|| backward.clone())?;
    Some(AxisErrors {
        name: result["axis"]["name"].as_str().map(str::to_owned),
        rotary: scale == ARCSEC_PER_DEG,
        positions: positions.filter(|x| ascending(x))?,
        forward: forward.unwrap_or_else(|| one.clone()),
        backward: backward.unwrap_or(one),
        both,
    })
}

fn straightness(name: &str, profile: &Value, x: &str, y: &str) -> Option<Content> {
    let (x, y) = (numbers(&profile[x])?, numbers(&profile[y])?);
    if x.len() != y.len() {
        return None;
    }
    let mut points: Vec<(f64, f64)> = x.into_iter().zip(y).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (positions, deviations): (Vec<f64>, Vec<f64>) = points.into_iter().unzip();
    ascending(&positions).then(|| {
        Content::Straightness(StraightnessProfile {
            name: name.to_owned(),
            positions,
            deviations: deviations.into_iter().map(mm_from_um).collect(),
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
