//! Reading a machine: its chain and component errors (TOML), readings of components and points (CSV).

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use errsep_models::machine::{
    COMPONENTS, Chain, Component, ComponentError, ErrorFunction, Kind, LineSummary, Machine,
    MachineError, Observation, Position, Sense, Spread, fit_component,
};
use errsep_models::uncertainty::DegreesOfFreedom;
use nalgebra::Vector3;
use serde::Deserialize;
use toml::Spanned;

use super::message::{Message, nearest};
use super::setup::{Numbers, SetupFile};
use super::table::{Column, TableReader};

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MachineFile {
    chain: Spanned<String>,
    #[serde(default)]
    sense: SenseName,
    #[serde(default)]
    coordinates: Coordinates,
    #[serde(default)]
    tool_offset: Option<Spanned<Numbers<3>>>,
    #[serde(default)]
    part: PartTable,
    #[serde(default)]
    errors: BTreeMap<String, Spanned<Entry>>,
}

/// What is known of the parts.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct PartTable {
    align: Align,
}

/// To what the zero and the turn of a part belong.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Align {
    /// To the causes: parts are measured in the frame that the machine is to keep.
    #[default]
    Fixed,
    /// To the model: each part is aligned anew.
    Free,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum SenseName {
    #[default]
    Tool,
    Work,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Coordinates {
    #[default]
    Tool,
    Slide,
}

/// One component: exactly one of value, polynomial, table, readings, degree.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    value: Option<f64>,
    polynomial: Option<Vec<f64>>,
    table: Option<TableEntry>,
    readings: Option<Vec<f64>>,
    degree: Option<usize>,
    std: Option<f64>,
    degrees_of_freedom: Option<f64>,
    regression: Option<RegressionEntry>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TableEntry {
    positions: Vec<f64>,
    values: Vec<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RegressionEntry {
    residual_std: f64,
    observations: usize,
    mean_position: f64,
    sum_of_squares: f64,
}

/// Highest degree of a fitted polynomial.
const HIGHEST_DEGREE: usize = 30;

/// A machine and the file that it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct FiledMachine {
    /// The machine.
    pub machine: Machine,
    /// To what zero and turn of measured parts belong.
    pub align: Align,
    file: SetupFile,
    /// Where the entry of each component stands, by its index.
    entries: BTreeMap<usize, Range<usize>>,
}

impl FiledMachine {
    /// What the machine cannot answer, at the entry that is the reason.
    pub fn wrong(&self, error: &MachineError, remedy: &str) -> Message {
        refused(&self.file, &self.entries, error, remedy)
    }
}

fn refused(
    file: &SetupFile,
    entries: &BTreeMap<usize, Range<usize>>,
    error: &MachineError,
    remedy: &str,
) -> Message {
    let of = match error {
        MachineError::OutsideTable { component, .. }
        | MachineError::BadComponent { component, .. }
        | MachineError::NotAFunction { component }
        | MachineError::RepeatedComponent { component }
        | MachineError::Regression { component, .. } => entries.get(&component.index()),
        _ => None,
    };
    match of {
        Some(span) => file.bad(span.clone(), error.to_string(), remedy),
        None => Message::bad_input(error.to_string())
            .in_file(file.path())
            .remedy(remedy),
    }
}

/// Reads a machine; `components` are the readings to which its entries with a `degree` are fitted.
///
/// # Errors
/// A file that cannot be read, and whatever is wrong with an entry, at its line.
pub fn read_machine(path: &Path, components: Option<&Path>) -> Result<Machine, Message> {
    Ok(read_filed(path, components)?.machine)
}

/// As [`read_machine`], for messages that point into the file later.
///
/// # Errors
/// Those of [`read_machine`].
pub fn read_filed(path: &Path, components: Option<&Path>) -> Result<FiledMachine, Message> {
    let file = SetupFile::read(path)?;
    let content: MachineFile = file.parse()?;
    let mut readings = match components {
        Some(path) => read_components(path)?,
        None => BTreeMap::new(),
    };
    let chain = chain(&file, &content)?;
    let mut errors = Vec::new();
    let mut entries = BTreeMap::new();
    for (name, entry) in &content.errors {
        let component = component(&file, name, entry.span())?;
        entries.insert(component.index(), entry.span());
        let given = readings.remove(&component.index());
        let error = component_error(&file, component, entry, given.as_deref(), components)?;
        errors.push(error);
    }
    if let (Some(index), Some(path)) = (readings.keys().next(), components) {
        let name = COMPONENTS
            .get(*index)
            .map(Component::to_string)
            .unwrap_or_default();
        return Err(Message::bad_input(format!(
            "{name} has readings, but the machine has no entry for it"
        ))
        .in_file(path)
        .remedy(format!(
            "add [errors.{name}] with `degree = 1` to the machine, or remove the rows"
        )));
    }
    let sense = match content.sense {
        SenseName::Tool => Sense::Tool,
        SenseName::Work => Sense::Work,
    };
    match Machine::new(chain, sense, errors) {
        Ok(machine) => Ok(FiledMachine {
            machine,
            align: content.part.align,
            file,
            entries,
        }),
        Err(error) => Err(refused(
            &file,
            &entries,
            &error,
            "correct the entry of this component",
        )),
    }
}

fn chain(file: &SetupFile, content: &MachineFile) -> Result<Chain, Message> {
    let mut chain = Chain::parse(content.chain.get_ref()).map_err(|error| {
        file.bad(
            content.chain.span(),
            error.to_string(),
            "name the axes from the workpiece to the tool, with F for the frame",
        )
    })?;
    if content.coordinates == Coordinates::Tool {
        chain = chain.with_tool_coordinates();
    }
    if let Some(offset) = &content.tool_offset {
        chain = chain
            .with_tool_offset(Vector3::from(offset.get_ref().0))
            .map_err(|error| {
                file.bad(
                    offset.span(),
                    error.to_string(),
                    "give three finite numbers, mm",
                )
            })?;
    }
    Ok(chain)
}

fn component(file: &SetupFile, name: &str, span: Range<usize>) -> Result<Component, Message> {
    name.parse().map_err(|_| {
        let known: Vec<String> = COMPONENTS.iter().map(Component::to_string).collect();
        let near = nearest(name, known.iter().map(String::as_str));
        let remedy = match near {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("known are {}", known.join(", ")),
        };
        file.bad(
            span,
            format!("`{name}` is none of the 21 component errors"),
            remedy,
        )
    })
}

fn component_error(
    file: &SetupFile,
    component: Component,
    entry: &Spanned<Entry>,
    readings: Option<&[Observation]>,
    readings_path: Option<&Path>,
) -> Result<ComponentError, Message> {
    let bad = |what: String, remedy: &str| file.bad(entry.span(), what, remedy);
    let e = entry.get_ref();
    let forms = [
        e.value.is_some(),
        e.polynomial.is_some(),
        e.table.is_some(),
        e.readings.is_some(),
        e.degree.is_some(),
    ];
    if forms.iter().filter(|given| **given).count() != 1 {
        return Err(bad(
            format!("{component} needs exactly one of value, polynomial, table, readings, degree"),
            "keep the one that is meant",
        ));
    }
    let fitted = |data: &[Observation], degree| {
        if e.std.is_some() || e.regression.is_some() || e.degrees_of_freedom.is_some() {
            return Err(bad(
                format!("the spread of {component} comes from its readings"),
                "remove std, regression and degrees_of_freedom here",
            ));
        }
        fit_component(component, data, degree)
            .map_err(|error| bad(error.to_string(), "give more readings, or lower the degree"))
    };
    if let Some(values) = &e.readings {
        if component.kind != Kind::Squareness {
            return Err(bad(
                format!("{component} changes along its axis: bare readings do not say where"),
                "give `degree` here and the readings with their positions by --components",
            ));
        }
        let data: Vec<Observation> = values
            .iter()
            .map(|&value| Observation {
                position: 0.0,
                value,
                repeat: 0,
            })
            .collect();
        return fitted(&data, 0);
    }
    if let Some(degree) = e.degree {
        if degree > HIGHEST_DEGREE {
            return Err(bad(
                format!("a polynomial of degree {degree} is not fitted"),
                "stay at or below 30; a table follows a curve better",
            ));
        }
        let data = readings.ok_or_else(|| match readings_path {
            None => bad(
                format!("{component} is to be fitted, but no readings are given"),
                "give the readings by --components COMPONENTS.csv",
            ),
            Some(path) => Message::bad_input(format!("{component} has no readings"))
                .in_file(path)
                .remedy(format!(
                    "add rows of {component}, or give its polynomial in the machine"
                )),
        })?;
        return fitted(data, degree);
    }
    if readings.is_some() {
        return Err(bad(
            format!("{component} is given here and has readings as well"),
            "write `degree = 1` here to fit the readings, or remove them",
        ));
    }
    let function = match (&e.value, &e.polynomial, &e.table) {
        (Some(value), ..) => ErrorFunction::constant(*value),
        (_, Some(coefficients), _) => ErrorFunction::polynomial(coefficients.clone()),
        (_, _, Some(table)) => ErrorFunction::Table {
            positions: table.positions.clone(),
            values: table.values.clone(),
        },
        _ => ErrorFunction::constant(0.0),
    };
    let wrong = |error: MachineError| bad(error.to_string(), "correct the numbers of this entry");
    function.check(component).map_err(wrong)?;
    let spread = spread(component, e).map_err(wrong)?;
    Ok(ComponentError {
        component,
        function,
        spread,
    })
}

fn spread(component: Component, e: &Entry) -> Result<Spread, MachineError> {
    use MachineError::BadComponent;
    let bad = |why: &str| BadComponent {
        component,
        why: why.to_owned(),
    };
    if let Some(r) = &e.regression {
        if e.std.is_some() || e.degrees_of_freedom.is_some() {
            return Err(bad("give either `regression` or `std`"));
        }
        let line = LineSummary {
            residual_std: r.residual_std,
            observations: r.observations,
            mean_position: r.mean_position,
            sum_of_squares: r.sum_of_squares,
        };
        return line.spread(component);
    }
    let degrees = match e.degrees_of_freedom {
        None => DegreesOfFreedom::Infinite,
        Some(number) => DegreesOfFreedom::new(number)?,
    };
    match e.std {
        None => Ok(Spread::none()),
        Some(std) if std.is_finite() && std >= 0.0 => Ok(Spread::scatter(std, degrees)),
        Some(_) => Err(bad(
            "its standard uncertainty must be finite and not negative",
        )),
    }
}

/// Readings by component, in the order of [`COMPONENTS`]: columns `component`, `position` (mm),
/// `value` (um or rad), and where wanted `repeat`.
fn read_components(path: &Path) -> Result<BTreeMap<usize, Vec<Observation>>, Message> {
    let mut table = TableReader::open(path)?;
    table.only(&["component", "position", "value", "repeat"])?;
    let (name, value) = (table.column("component")?, table.column("value")?);
    let position = table.column("position")?;
    let repeat = table.optional("repeat");
    let mut readings: BTreeMap<usize, Vec<Observation>> = BTreeMap::new();
    while let Some(row) = table.next_row()? {
        let component: Component = row.text(&name).parse().map_err(|error: MachineError| {
            row.error(&name, error.to_string())
                .remedy("use the names of ISO 230-1")
        })?;
        let observation = Observation {
            position: row.number(&position)?,
            value: row.number(&value)?,
            repeat: repeat.as_ref().map_or(Ok(0), |column| row.count(column))?,
        };
        readings
            .entry(component.index())
            .or_default()
            .push(observation);
    }
    if readings.is_empty() {
        return Err(table.no_rows());
    }
    Ok(readings)
}

/// Reads named points: columns `point`, `x`, `y` and where it applies `z`, mm.
///
/// # Errors
/// A file that cannot be read, a point named twice or without a name.
pub fn read_points(path: &Path) -> Result<Vec<(String, Position)>, Message> {
    let mut table = TableReader::open(path)?;
    table.only(&["point", "x", "y", "z"])?;
    let (point, x, y) = (
        table.column("point")?,
        table.column("x")?.in_mm(),
        table.column("y")?.in_mm(),
    );
    let z = table.optional("z").map(Column::in_mm);
    let mut points: Vec<(String, Position)> = Vec::new();
    let mut names = std::collections::HashSet::new();
    while let Some(row) = table.next_row()? {
        let name = row.text(&point);
        if name.is_empty() {
            return Err(row
                .error(&point, "the point has no name")
                .remedy("number the points"));
        }
        if !names.insert(name.to_owned()) {
            return Err(row
                .error(&point, format!("point {name} is given twice"))
                .remedy("give every point a name of its own"));
        }
        let height = z.as_ref().map_or(Ok(0.0), |z| row.number(z))?;
        points.push((
            name.to_owned(),
            Position::new(row.number(&x)?, row.number(&y)?, height),
        ));
    }
    if points.is_empty() {
        return Err(table.no_rows());
    }
    Ok(points)
}
