//! The component errors of a machine at the positions that a file gets.

use errsep_models::machine::{Axis, Component, ErrorFunction, Kind as ComponentKind};

use super::{Content, Format, Known, MachineErrors, Missed, Request};
use crate::io::Message;
use crate::io::units::mm_from_um;

/// Values of one component: mm or rad.
pub(super) struct Column {
    pub component: Component,
    pub values: Vec<f64>,
}

/// The errors of one axis at its positions, mm.
pub(super) struct Block {
    pub axis: Axis,
    pub positions: Vec<f64>,
    pub columns: Vec<Column>,
}

/// The errors of a machine as they go into a file.
pub(super) struct Tables<'a> {
    pub errors: &'a MachineErrors,
    pub blocks: Vec<Block>,
}

/// The unit of a component in a file.
pub(super) fn unit_of(component: Component) -> &'static str {
    match component.kind {
        ComponentKind::Translation => "mm",
        _ => "rad",
    }
}

/// The unit in which it was found.
fn found_unit(component: Component) -> &'static str {
    match component.kind {
        ComponentKind::Translation => "um",
        _ => "rad",
    }
}

/// One of that unit in the unit of a file.
fn own_unit(component: Component) -> f64 {
    match component.kind {
        ComponentKind::Translation => mm_from_um(1.0),
        _ => 1.0,
    }
}

/// The errors at their own positions, or on an even grid.
///
/// # Errors
/// Content of another kind, an axis whose travel is not known, a grid outside a table.
pub(super) fn tables<'a>(
    format: &Format,
    content: &'a Content,
    request: &Request,
) -> Result<Tables<'a>, Message> {
    request.without(format.name, &["--axis", "--unit", "--reference"])?;
    let Content::Machine(errors) = content else {
        return Err(super::source::wrong(format));
    };
    let mut blocks = Vec::new();
    for axis in Axis::ALL {
        let own: Vec<&(Component, ErrorFunction)> = errors
            .functions
            .iter()
            .filter(|(c, _)| c.axis == axis)
            .collect();
        if own.is_empty() {
            continue;
        }
        let positions = positions(axis, &own, request)?;
        let columns = own
            .iter()
            .map(|(component, function)| column(*component, function, &positions))
            .collect::<Result<Vec<_>, _>>()?;
        blocks.push(Block {
            axis,
            positions,
            columns,
        });
    }
    if blocks.is_empty() && errors.squareness.is_empty() {
        return Err(
            Message::bad_input("the result has no component error that is determined")
                .remedy("measure more, or give a machine (TOML)"),
        );
    }
    Ok(Tables { errors, blocks })
}

fn column(
    component: Component,
    function: &ErrorFunction,
    positions: &[f64],
) -> Result<Column, Message> {
    let values = positions.iter().map(|x| {
        let value = function.value(component, *x).map_err(|e| {
            Message::bad_input(e.to_string()).remedy("give a --travel within its table")
        })?;
        Ok(match component.kind {
            ComponentKind::Translation => mm_from_um(value),
            _ => value,
        })
    });
    Ok(Column {
        component,
        values: values.collect::<Result<_, Message>>()?,
    })
}

/// The tabulated positions of an axis within what all its tables cover, or a grid.
fn positions(
    axis: Axis,
    own: &[&(Component, ErrorFunction)],
    request: &Request,
) -> Result<Vec<f64>, Message> {
    let tables = || {
        own.iter().filter_map(|(_, function)| match function {
            ErrorFunction::Table { positions, .. } => Some(positions),
            ErrorFunction::Polynomial { .. } => None,
        })
    };
    let ends = |of: fn(&Vec<f64>) -> Option<&f64>| tables().filter_map(of).copied();
    let given = request
        .travel
        .iter()
        .find(|(letter, ..)| *letter == axis.letter());
    let (from, to) = match given {
        Some((_, from, to)) => (*from, *to),
        None => (
            ends(|t| t.first()).fold(f64::NEG_INFINITY, f64::max),
            ends(|t| t.last()).fold(f64::INFINITY, f64::min),
        ),
    };
    let letter = axis.letter();
    if !(from.is_finite() && to.is_finite()) {
        return Err(Message::bad_input(format!(
            "the errors of {letter} are polynomials: their travel is not known"
        ))
        .remedy(format!(
            "give --travel {letter}=FROM:TO in mm, and --points or --step"
        )));
    }
    if from >= to {
        return Err(
            Message::bad_input(format!("the tables of {letter} have no travel in common"))
                .remedy("tabulate the errors of an axis over one travel"),
        );
    }
    if let Some(grid) = request.grid {
        return grid.positions(from, to);
    }
    let mut all: Vec<f64> = tables()
        .flatten()
        .copied()
        .filter(|x| (from..=to).contains(x))
        .collect();
    let curved = own.iter().any(|(_, function)| {
        matches!(function, ErrorFunction::Polynomial { coefficients, .. } if coefficients.len() > 2)
    });
    if curved && tables().next().is_none() {
        return Err(
            Message::bad_input(format!("the errors of {letter} are curved polynomials"))
                .remedy("give --points or --step: the controller draws straight lines between"),
        );
    }
    all.extend([from, to]);
    all.sort_by(f64::total_cmp);
    all.dedup();
    Ok(all)
}

/// Places between two points at which a curve is compared with the straight line.
const BETWEEN: usize = 32;

impl Tables<'_> {
    /// How far straight lines between the points miss each error; nothing where every table stands as it is.
    pub fn missed(&self) -> Vec<Missed> {
        let of = |block: &Block, column: &Column| {
            let function = self.function(column.component)?;
            let (x, last) = (&block.positions, block.positions.last()?);
            let within = |at: &f64| x.first().is_some_and(|first| first <= at) && at <= last;
            let places: Vec<f64> = match function {
                ErrorFunction::Table { positions, .. } => {
                    positions.iter().copied().filter(within).collect()
                }
                ErrorFunction::Polynomial { .. } => {
                    let between = |pair: &[f64]| {
                        let (from, length) = (pair[0], pair[1] - pair[0]);
                        (1..BETWEEN).map(move |k| from + length * k as f64 / BETWEEN as f64)
                    };
                    x.windows(2).flat_map(between).collect()
                }
            };
            let missed = places.into_iter().filter_map(|at| {
                let found = function.value(column.component, at).ok()?;
                let line = super::grid::interpolate(x, &column.values, at);
                Some((at, (line / own_unit(column.component) - found).abs()))
            });
            let name = column.component.to_string();
            Missed::greatest(&name, found_unit(column.component), missed)
        };
        let blocks = self.blocks.iter();
        let all: Vec<Missed> = blocks
            .flat_map(|block| block.columns.iter().filter_map(move |c| of(block, c)))
            .collect();
        // Of a millionth of a micrometre and less nothing is told: that is rounding.
        let told = all
            .iter()
            .any(|m| m.value > if m.unit == "um" { 1e-6 } else { 1e-12 });
        if told { all } else { Vec::new() }
    }

    /// How well the values are known, where the result tells it.
    pub fn known(&self) -> Vec<Known> {
        let of = |block: &Block, column: &Column| {
            let own = self
                .errors
                .stds
                .iter()
                .find(|(c, _)| *c == column.component)?;
            let Some(ErrorFunction::Table { positions, .. }) = self.function(column.component)
            else {
                return None;
            };
            let std = |x: &f64| super::grid::interpolate(positions, &own.1, *x);
            Some(Known {
                of: column.component.to_string(),
                unit: found_unit(column.component),
                at: block.positions.clone(),
                std: block.positions.iter().map(std).collect(),
                degrees_of_freedom: None,
            })
        };
        let blocks = self.blocks.iter();
        blocks
            .flat_map(|block| block.columns.iter().filter_map(move |c| of(block, c)))
            .collect()
    }

    /// What this costs as comments of a file, each line after `mark`.
    pub fn comments(&self, mark: &str) -> String {
        super::cost::comments(mark, &self.missed(), &self.known())
    }

    fn function(&self, component: Component) -> Option<&ErrorFunction> {
        let mut all = self.errors.functions.iter();
        all.find(|(c, _)| *c == component)
            .map(|(_, function)| function)
    }

    /// The names of what stands in the file.
    pub fn names(&self) -> Vec<String> {
        let functions = self.blocks.iter().flat_map(|b| &b.columns);
        functions
            .map(|c| c.component.to_string())
            .chain(self.errors.squareness.iter().map(|(c, _)| c.to_string()))
            .collect()
    }
}
