//! Tables of typed cells: numbers line up on the right, and a sorted column says that it is.

use super::number;
use std::cmp::Ordering;

/// Digits of a count, which is shown whole.
const WHOLE: usize = 17;

/// What one cell holds. Numbers stay numbers until the page is written, so that a column can be
/// sorted and aligned by value.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A number shown to so many significant digits.
    Number {
        /// The value, in the unit of the column's header.
        value: f64,
        /// Significant digits shown.
        digits: usize,
    },
    /// A number with its standard uncertainty.
    Measured {
        /// The value, in the unit of the column's header.
        value: f64,
        /// Its standard uncertainty, in the same unit.
        std: f64,
    },
    /// A share of one, shown as a percentage.
    Share(f64),
    /// A significance probability.
    Probability(f64),
    /// Nothing to say here.
    Empty,
}

impl Cell {
    /// A number with four significant digits.
    pub const fn number(value: f64) -> Self {
        Self::Number { value, digits: 4 }
    }

    /// A number with its standard uncertainty.
    pub const fn measured(value: f64, std: f64) -> Self {
        Self::Measured { value, std }
    }

    /// The number by which the cell sorts; none for words.
    pub fn value(&self) -> Option<f64> {
        match self {
            Self::Number { value, .. } | Self::Measured { value, .. } => Some(*value),
            Self::Share(value) | Self::Probability(value) => Some(*value),
            Self::Text(_) | Self::Empty => None,
        }
    }

    /// The cell as people read it.
    pub fn text(&self) -> String {
        self.text_with(None)
    }

    /// The same with the decimals that its column agreed on.
    pub(super) fn text_with(&self, decimals: Option<usize>) -> String {
        match self {
            Self::Number { value, digits } if *digits == WHOLE => number::fixed(*value, 0),
            Self::Number { value, .. } if decimals.is_some() => {
                number::fixed(*value, decimals.unwrap_or_default())
            }
            Self::Text(text) => text.clone(),
            Self::Number { value, digits } => number::plain(*value, *digits),
            Self::Measured { value, std } => number::measured(*value, Some(*std)),
            Self::Share(value) => number::percent(*value),
            Self::Probability(value) => number::probability(*value),
            Self::Empty => String::new(),
        }
    }

    /// Words before numbers, numbers by value, what is not a number last.
    fn order(&self, other: &Self) -> Ordering {
        match (self.value(), other.value()) {
            (Some(a), Some(b)) => a
                .is_nan()
                .cmp(&b.is_nan())
                .then_with(|| a.partial_cmp(&b).unwrap_or(Ordering::Equal)),
            (Some(_), None) => Ordering::Greater,
            (None, Some(_)) => Ordering::Less,
            (None, None) => self.text().cmp(&other.text()),
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::number(value)
    }
}

impl From<usize> for Cell {
    fn from(value: usize) -> Self {
        Self::Number {
            value: value as f64,
            digits: WHOLE,
        }
    }
}

/// Direction of a sorted column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// Smallest first.
    Ascending,
    /// Largest first.
    Descending,
}

/// A table with one header row; the first column names the row.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub(super) caption: String,
    pub(super) columns: Vec<String>,
    pub(super) rows: Vec<Vec<Cell>>,
    pub(super) sorted: Option<(usize, Order)>,
}

impl Table {
    /// An empty table; the unit of a column belongs in its header, as in `"α (µrad)"`.
    pub fn new<H: Into<String>>(
        caption: impl Into<String>,
        columns: impl IntoIterator<Item = H>,
    ) -> Self {
        Self {
            caption: caption.into(),
            columns: columns.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
            sorted: None,
        }
    }

    /// Adds a row. A short row is filled with empty cells, a long one is cut at the last header.
    #[must_use]
    pub fn row(mut self, cells: impl IntoIterator<Item = Cell>) -> Self {
        let mut row: Vec<Cell> = cells.into_iter().take(self.columns.len()).collect();
        row.resize(self.columns.len(), Cell::Empty);
        self.rows.push(row);
        self
    }

    /// Adds many rows.
    #[must_use]
    pub fn rows<R: IntoIterator<Item = Cell>>(self, rows: impl IntoIterator<Item = R>) -> Self {
        rows.into_iter().fold(self, Self::row)
    }

    /// Sorts the rows by a column and marks the column as sorted. A column that does not exist
    /// leaves the table as it is.
    #[must_use]
    pub fn sorted_by(mut self, column: usize, order: Order) -> Self {
        if column < self.columns.len() {
            self.rows.sort_by(|a, b| {
                let by_value = a[column].order(&b[column]);
                match order {
                    Order::Ascending => by_value,
                    Order::Descending => by_value.reverse(),
                }
            });
            self.sorted = Some((column, order));
        }
        self
    }

    /// Decimals with which all plain numbers of a column line up: those that its largest number
    /// needs. None where the sizes differ by more than the digits shown, and of counts.
    pub(super) fn common_decimals(&self, column: usize) -> Option<usize> {
        let mut largest = f64::NEG_INFINITY;
        let mut smallest = f64::INFINITY;
        let mut shown = 0;
        for cell in self.rows.iter().filter_map(|row| row.get(column)) {
            if let Cell::Number { value, digits } = cell
                && value.is_finite()
                && *value != 0.0
            {
                let exponent = value.abs().log10().floor();
                largest = largest.max(exponent);
                smallest = smallest.min(exponent);
                if *digits == WHOLE {
                    return None;
                }
                shown = shown.max((*digits).min(6) as i32);
            }
        }
        let fits = largest - smallest < f64::from(shown) && (-4.0..7.0).contains(&largest);
        fits.then(|| (shown - 1 - largest as i32).max(0) as usize)
    }

    /// Whether every filled cell of a column is a number: it then lines up on the right.
    pub(super) fn is_numeric(&self, column: usize) -> bool {
        let mut cells = self
            .rows
            .iter()
            .filter_map(|row| row.get(column))
            .filter(|cell| **cell != Cell::Empty)
            .peekable();
        cells.peek().is_some() && cells.all(|cell| cell.value().is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_follow_the_header_and_sort_by_value() {
        let table = Table::new("", ["name", "size (µm)"])
            .row(["short".into()])
            .row(["b".into(), Cell::number(10.0), "cut".into()])
            .row(["a".into(), Cell::measured(9.0, 1.0)])
            .sorted_by(1, Order::Descending);
        let names: Vec<String> = table.rows.iter().map(|row| row[0].text()).collect();
        assert_eq!(names, ["b", "a", "short"]);
        assert!(table.rows.iter().all(|row| row.len() == 2));
        assert!(table.is_numeric(1) && !table.is_numeric(0));
    }

    #[test]
    fn numbers_of_a_column_share_their_decimals() {
        let column =
            |values: &[f64]| Table::new("", ["v"]).rows(values.iter().map(|v| [Cell::number(*v)]));
        assert_eq!(column(&[1200.0, 899.0, -4.0]).common_decimals(0), Some(0));
        assert_eq!(column(&[6.61, 0.21]).common_decimals(0), Some(3));
        assert_eq!(column(&[1e6, 1e-6]).common_decimals(0), None);
        assert_eq!(column(&[f64::NAN]).common_decimals(0), None);
        let counts = Table::new("", ["n"]).rows([[Cell::from(246usize)], [Cell::from(8usize)]]);
        assert_eq!(counts.common_decimals(0), None);
        assert_eq!(counts.rows[0][0].text_with(None), "246");
    }
}
