//! Tables of plates and plug gauges as measuring machines print them: text before the table, columns apart by
//! white space or a delimiter, nominal beside measured or beside the deviation, rows left out.
//!
//! A row has all coordinates of a point (`point, nominal x, nominal y, measured x, measured y`), or one of
//! them that the column `axis` names (`point axis nominal actual`). What is read is measured less nominal.

mod fields;
mod header;
mod named;

use std::collections::{BTreeMap, HashSet};
use std::io::Read;
use std::path::Path;

use errsep_models::machine::{Axis, PartReading, Position};

use super::columns::ColumnMap;
use super::message::{Message, Place};
use super::parts::SAME_PLACE;
use super::source::Source;
use super::units::LengthUnit;
use fields::{Field, Split};
use header::{Column, Header, Kind, Role};

/// What is read to tell whether a file is such a table, and most of one that is, bytes.
const HEAD: u64 = 1 << 16;
const LONGEST: u64 = 1 << 26;

/// Whether a file is such a table: by the names of its columns, or by those that `map` gives them.
pub fn is_plate(path: &Path, map: &ColumnMap) -> bool {
    if !map.is_empty() {
        return named::is_of_plate(map);
    }
    read_text(path, HEAD).is_some_and(|text| {
        let lines: Vec<&str> = text.lines().collect();
        Header::find(&lines).is_some()
    })
}

fn read_text(path: &Path, most: u64) -> Option<String> {
    let mut bytes = Vec::new();
    let read = Source::open(path).and_then(|file| file.take(most).read_to_end(&mut bytes));
    let read = read.ok()?;
    // A head may end within a character.
    let whole = match std::str::from_utf8(&bytes) {
        Ok(_) => bytes.len(),
        Err(e) if read as u64 == most && e.error_len().is_none() => e.valid_up_to(),
        Err(_) => return None,
    };
    bytes.truncate(whole);
    let text = String::from_utf8(bytes).ok()?;
    Some(
        text.strip_prefix('\u{feff}')
            .map(str::to_owned)
            .unwrap_or(text),
    )
}

/// Reads such a table, with the columns that `map` names where it names any. Readings without a column for the part are those of a part that is called as the
/// file is, without its extension.
///
/// # Errors
/// A row that is none of the table, a coordinate measured twice, a point without a nominal coordinate.
pub fn read(path: &Path, map: &ColumnMap) -> Result<Vec<PartReading>, Message> {
    let whole = |what: &str, remedy: &str| Message::bad_input(what).in_file(path).remedy(remedy);
    let text = read_text(path, LONGEST).ok_or_else(|| {
        whole(
            "the file cannot be read as text",
            "save it as plain text, UTF-8",
        )
    })?;
    if text.len() as u64 >= LONGEST {
        return Err(whole(
            "the table is longer than 64 MiB",
            "write the parts into files of their own",
        ));
    }
    let lines: Vec<&str> = text.lines().collect();
    let header = named::header(path, &lines, map)?;
    let mut table = Plate::new(path, header);
    let first = table.header.line + 1;
    for (k, line) in lines.iter().enumerate().skip(first) {
        let fields = table.header.split.fields(line);
        let names = lines[table.header.line];
        let digits = fields
            .iter()
            .any(|f| f.text.bytes().any(|b| b.is_ascii_digit()));
        let whole = fields.len() == table.header.columns.len();
        let is_text = !digits && (!whole || fields.iter().all(|f| is_left_out(f.text)));
        if line.trim_start().starts_with('#') || line.trim() == names.trim() {
            continue;
        }
        if k == first && table.header.take_units(&fields) || is_text {
            continue;
        }
        table.take(&Line {
            number: k + 1,
            text: line,
            fields,
        })?;
    }
    table.readings()
}

/// A line below the names of the columns.
struct Line<'a> {
    number: usize,
    text: &'a str,
    fields: Vec<Field<'a>>,
}

/// Part, point, replicate.
type Key = (String, String, u32);

/// Nominal coordinates, mm, and the line of the first.
type Nominal = ([Option<f64>; 3], usize);

/// A table being read.
struct Plate<'p> {
    path: &'p Path,
    header: Header,
    /// The part where no column names it.
    part: String,
    comma: Option<bool>,
    /// More fields than columns, words of the points' names, as the first row has them.
    spare: Option<usize>,
    /// By part and point.
    nominal: BTreeMap<(String, String), Nominal>,
    seen: HashSet<(Key, usize)>,
    /// Measured less nominal, µm, in the order of the file.
    values: Vec<(Key, Axis, f64)>,
}

impl<'p> Plate<'p> {
    fn new(path: &'p Path, header: Header) -> Self {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        Self {
            path,
            header,
            part: stem.into_owned(),
            comma: None,
            spare: None,
            nominal: BTreeMap::new(),
            seen: HashSet::new(),
            values: Vec::new(),
        }
    }

    fn at(&self, line: &Line, field: Option<&Field>, what: impl Into<String>) -> Message {
        let (at, length) = field.map_or((0, line.text.len()), |f| (f.at, f.text.len()));
        Message::bad_input(what).at(Place {
            file: self.path.to_owned(),
            line: line.number,
            column: line.text[..at].chars().count() + 1,
            text: line.text.to_owned(),
            length,
        })
    }

    /// Takes in a row.
    fn take(&mut self, line: &Line) -> Result<(), Message> {
        let spare = self.spare(line)?;
        let field = |place: usize| -> Option<&Field> {
            match spare {
                0 => line.fields.get(place),
                more => line.fields.get(if place == 0 { 0 } else { place + more }),
            }
        };
        let text = |role: Role| {
            let place = self.header.place(role)?;
            let found = field(place)?;
            // A name of several words between blanks.
            let end = if place == 0 {
                line.fields.get(spare)?
            } else {
                found
            };
            Some(line.text[found.at..end.at + end.text.len()].to_owned())
        };
        let point = text(Role::Point).filter(|t| !t.is_empty());
        let point = point.unwrap_or_else(|| line.number.to_string());
        let part = text(Role::Part).filter(|t| !t.is_empty());
        let part = part.unwrap_or_else(|| self.part.clone());
        let replicate = match self.header.place(Role::Replicate).and_then(field) {
            None => 1,
            Some(f) => f.text.parse().ok().filter(|n| *n > 0).ok_or_else(|| {
                self.at(line, Some(f), format!("\"{}\" counts no replicate", f.text))
                    .remedy("write 1, 2, 3, …")
            })?,
        };
        let coordinates = match self.header.place(Role::AxisName) {
            None => Axis::ALL.map(|axis| (axis, Some(axis))).to_vec(),
            Some(place) => vec![(self.axis(line, field(place))?, None)],
        };
        self.is_long_enough(line, spare)?;
        let key = (part, point, replicate);
        let mut taken = Vec::new();
        for (axis, of) in coordinates {
            let number = |plate: &mut Self, kind: Kind, in_unit: fn(LengthUnit) -> f64| {
                let Some(place) = plate.header.place(Role::Of(kind, of)) else {
                    return Ok(None);
                };
                let column = plate.header.columns[place];
                let value = plate.number(line, field(place), kind)?;
                Ok(value.map(|v| v * in_unit(plate.unit(column))))
            };
            let nominal = number(self, Kind::Nominal, LengthUnit::in_mm)?;
            let measured = number(self, Kind::Measured, LengthUnit::in_mm)?;
            let deviation = number(self, Kind::Deviation, LengthUnit::in_um)?;
            let of_both = nominal
                .zip(measured)
                .map(|(n, m)| (m - n) * LengthUnit::Mm.in_um());
            taken.push((axis, nominal, of_both.or(deviation)));
        }
        for (axis, nominal, value) in taken {
            self.keep(line, &key, axis, (nominal, value))?;
        }
        Ok(())
    }

    /// How many more fields the rows have than there are columns, all of them words of the point's name.
    fn spare(&mut self, line: &Line) -> Result<usize, Message> {
        let names = self.header.columns.len();
        let last = line.fields.iter().rposition(|f| !f.text.is_empty());
        let own = last.map_or(0, |last| last + 1).saturating_sub(names);
        let named = self.header.split == Split::Blank && self.header.columns[0].role == Role::Point;
        let words = || {
            line.fields[1..=own]
                .iter()
                .all(|f| !f.text.contains(['.', ',']))
        };
        let most = match self.spare {
            Some(spare) => spare,
            None if named && own > 0 && words() => own,
            None => 0,
        };
        if own > most {
            let what = format!(
                "the row has {} fields, the line of the names has {names}",
                line.fields.len()
            );
            let remedy =
                "give every row one field a column; put quotes around names of several words";
            return Err(self
                .at(line, line.fields.get(names + most), what)
                .remedy(remedy));
        }
        self.spare = Some(most);
        Ok(most)
    }

    /// A row may end before what was measured, not within it: nobody could tell which is missing.
    fn is_long_enough(&self, line: &Line, spare: usize) -> Result<(), Message> {
        let columns = &self.header.columns;
        let is = |c: &Column, kinds: &[Kind]| matches!(c.role, Role::Of(kind, _) if kinds.contains(&kind));
        let found = [Kind::Measured, Kind::Deviation];
        let nominal = columns.iter().rposition(|c| is(c, &[Kind::Nominal]));
        let (first, last) = (
            columns.iter().position(|c| is(c, &found)),
            columns.iter().rposition(|c| is(c, &found)),
        );
        let count = line.fields.len().saturating_sub(spare);
        let whole = last.is_some_and(|last| count > last);
        let before =
            first.is_some_and(|first| count <= first) && nominal.is_some_and(|n| count > n);
        if whole || before {
            return Ok(());
        }
        let what = format!(
            "the row has {} fields, the line of the names has {}",
            line.fields.len(),
            columns.len()
        );
        Err(self.at(line, line.fields.last(), what).remedy(
            "give every row one field a column, with - for what was not measured; put # before what is no row",
        ))
    }

    fn axis(&self, line: &Line, field: Option<&Field>) -> Result<Axis, Message> {
        let text = field.map_or("", |f| f.text);
        let upper = text.to_uppercase();
        let known = Axis::ALL
            .into_iter()
            .find(|a| a.letter().to_string() == upper);
        known.ok_or_else(|| {
            self.at(line, field, format!("axis \"{text}\" is none of x, y, z"))
                .remedy("write x, y or z, or put # before rows of diameters and the like")
        })
    }

    /// The number in a field; `None` where a measured one was left out.
    fn number(
        &mut self,
        line: &Line,
        field: Option<&Field>,
        kind: Kind,
    ) -> Result<Option<f64>, Message> {
        let text = field.map_or("", |f| f.text);
        if kind != Kind::Nominal && is_left_out(text) {
            return Ok(None);
        }
        let comma = text
            .contains(',')
            .then_some(true)
            .or(text.contains('.').then_some(false));
        if comma.is_some() && self.comma.is_some() && comma != self.comma {
            return Err(self
                .at(line, field, format!("\"{text}\" mixes decimal marks"))
                .remedy("the rows before use the other one: use one mark throughout"));
        }
        self.comma = self.comma.or(comma);
        let value = text.replace(',', ".").parse::<f64>();
        match value.ok().filter(|v| v.is_finite()) {
            Some(value) => Ok(Some(value)),
            None => Err(self
                .at(line, field, format!("\"{text}\" is not a number"))
                .remedy("write a plain number such as 25.0013, or - for what was not measured")),
        }
    }

    fn unit(&self, column: Column) -> LengthUnit {
        column.unit.or(self.header.unit).unwrap_or(LengthUnit::Mm)
    }

    /// Keeps what a row says of one coordinate.
    fn keep(
        &mut self,
        line: &Line,
        key: &Key,
        axis: Axis,
        (nominal, value): (Option<f64>, Option<f64>),
    ) -> Result<(), Message> {
        let index = axis.index();
        let (part, point, _) = key;
        let known = self.nominal.entry((part.clone(), point.clone()));
        let (known, first) = known.or_insert(([None; 3], line.number));
        let first = *first;
        match (known[index], nominal) {
            (Some(before), Some(now)) if (before - now).abs() > SAME_PLACE => {
                let letter = axis.letter();
                return Err(self
                    .at(line, None, format!("point {point} has nominal {letter} = {now} mm here and {before} mm in line {first}"))
                    .remedy("give points that differ names of their own"));
            }
            (None, Some(now)) => known[index] = Some(now),
            _ => {}
        }
        let Some(value) = value else { return Ok(()) };
        if !self.seen.insert((key.clone(), index)) {
            return Err(self
                .at(
                    line,
                    None,
                    format!("{} of point {point} is measured twice", axis.letter()),
                )
                .remedy("count measurements of one point in a column `replicate`"));
        }
        self.values.push((key.clone(), axis, value));
        Ok(())
    }

    /// What was measured. An axis for which no point has a nominal coordinate is that of a plane.
    fn readings(self) -> Result<Vec<PartReading>, Message> {
        if self.values.is_empty() {
            return Err(Message::bad_input("nothing in the table was measured")
                .in_file(self.path)
                .remedy("add rows with measured coordinates below the names of the columns"));
        }
        let used = |k: usize| self.nominal.values().any(|(place, _)| place[k].is_some());
        let used = [used(0), used(1), used(2)];
        let mut readings = Vec::with_capacity(self.values.len());
        for ((part, feature, replicate), direction, value) in self.values {
            let known = self.nominal.get(&(part.clone(), feature.clone()));
            let (place, line) = known.copied().unwrap_or_default();
            if let Some(open) = Axis::ALL
                .into_iter()
                .find(|a| used[a.index()] && place[a.index()].is_none())
            {
                let what = format!("point {feature} has no nominal {}", open.letter());
                return Err(Message::bad_input(what)
                    .at(Place {
                        file: self.path.to_owned(),
                        line,
                        column: 1,
                        text: String::new(),
                        length: 0,
                    })
                    .remedy("add its row, with - for what was not measured"));
            }
            let [x, y, z] = place.map(|mm| mm.unwrap_or(0.0));
            readings.push(PartReading {
                part,
                feature,
                axis: direction,
                replicate,
                position: Position::new(x, y, z),
                value,
            });
        }
        Ok(readings)
    }
}

/// What is printed in place of a number that was not measured.
fn is_left_out(text: &str) -> bool {
    text.chars()
        .all(|c| matches!(c, '-' | '*' | '.' | '?' | '\u{2013}'))
        || ["n/a", "na", "none", "nan"].contains(&text.to_lowercase().as_str())
}
