//! The line of a plate's table that names its columns, below whatever a measuring machine prints before it.

use errsep_models::machine::Axis;

use super::fields::{Field, Split};
use crate::io::units::LengthUnit;

/// What a column holds. Without an axis it is the coordinate that the row's `axis` names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Part,
    Point,
    Replicate,
    AxisName,
    Of(Kind, Option<Axis>),
    /// A bare `x`, `y` or `z`: what it is of the line above or the other columns say.
    Bare(Axis),
    /// Tolerances, verdicts and whatever else is printed.
    Other,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Nominal,
    Measured,
    Deviation,
}

/// A column and the unit beside its name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Column {
    pub role: Role,
    pub unit: Option<LengthUnit>,
}

/// The columns of a table and where their names stand.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    /// Line of the names, from 0.
    pub line: usize,
    pub split: Split,
    pub columns: Vec<Column>,
    /// What the lines before say of the unit.
    pub unit: Option<LengthUnit>,
}

/// Lines among which the names are sought.
pub(super) const MOST_LINES: usize = 500;

const NOMINAL: &[&str] = &[
    "nominal",
    "nominals",
    "nom",
    "calibrated",
    "cal",
    "reference",
    "ref",
    "target",
    "theoretical",
    "theo",
    "soll",
];
const MEASURED: &[&str] = &[
    "measured", "meas", "actual", "actuals", "act", "observed", "obs", "ist",
];
const DEVIATION: &[&str] = &[
    "deviation",
    "dev",
    "delta",
    "error",
    "diff",
    "difference",
    "d",
];
const POINT: &[&str] = &[
    "point", "pt", "feature", "element", "id", "name", "label", "hole", "bore", "ball", "sphere",
    "circle", "no", "nr", "number", "#",
];
const PART: &[&str] = &["part", "plate", "workpiece", "serial"];
const REPLICATE: &[&str] = &["replicate", "repeat", "run", "cycle"];
const AXIS: &[&str] = &["axis", "ax", "coordinate", "coord"];
const NUMBERING: &[&str] = &["no", "nr", "number", "id", "name", "#"];
/// Words that say nothing more.
const FILLING: &[&str] = &[
    "value",
    "position",
    "pos",
    "coordinate",
    "coord",
    "center",
    "centre",
    "of",
];

impl Header {
    /// The names of the columns of a plate's table, if these lines begin one.
    pub fn find(lines: &[&str]) -> Option<Self> {
        let mut unit = None;
        for (at, line) in lines.iter().enumerate().take(MOST_LINES) {
            let split = Split::of(line);
            let above = at.checked_sub(1).map_or("", |before| lines[before]);
            if let Some(columns) = columns(line, split, above) {
                return Some(Self {
                    line: at,
                    split,
                    columns,
                    unit,
                });
            }
            unit = unit_told(line).or(unit);
        }
        None
    }

    /// The place of the only column of a role.
    pub fn place(&self, role: Role) -> Option<usize> {
        self.columns.iter().position(|c| c.role == role)
    }

    /// Takes in a line of units below the names, such as `mm mm um`: whether it was one.
    pub fn take_units(&mut self, fields: &[Field]) -> bool {
        let unit =
            |field: &Field| LengthUnit::from_name(field.text.trim_matches(['(', ')', '[', ']']));
        let told: Vec<Option<LengthUnit>> = fields.iter().map(unit).collect();
        let known: Vec<LengthUnit> = told.iter().copied().flatten().collect();
        let empty = |field: &Field| field.text.is_empty() || field.text.chars().all(|c| c == '-');
        if known.is_empty()
            || fields
                .iter()
                .zip(&told)
                .any(|(f, u)| u.is_none() && !empty(f))
        {
            return false;
        }
        if known.iter().all(|u| *u == known[0]) {
            self.unit = Some(known[0]);
            return true;
        }
        if fields.len() != self.columns.len() {
            return false;
        }
        for (column, unit) in self.columns.iter_mut().zip(told) {
            column.unit = column.unit.or(unit);
        }
        true
    }
}

/// A line such as `Units: mm`.
pub(super) fn unit_told(line: &str) -> Option<LengthUnit> {
    let words = words(line);
    let told = words.iter().any(|w| matches!(w.as_str(), "unit" | "units"));
    let unit = words.iter().find_map(|w| length_unit(w));
    unit.filter(|_| told)
}

fn length_unit(word: &str) -> Option<LengthUnit> {
    match word {
        "inches" => Some(LengthUnit::Inch),
        "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some(LengthUnit::Mm),
        _ => LengthUnit::from_name(word),
    }
}

/// Lower-case words, whatever stands between them.
fn words(text: &str) -> Vec<String> {
    text.split(|c: char| !(c.is_alphanumeric() || c == '#'))
        .filter(|w| !w.is_empty())
        .map(str::to_lowercase)
        .collect()
}

/// The columns that a line names, if it names those of a plate's table.
fn columns(line: &str, split: Split, above: &str) -> Option<Vec<Column>> {
    let fields = split.fields(line);
    let mut columns = if split == Split::Blank {
        by_words(&fields, 3, column)
    } else {
        fields
            .iter()
            .map(|f| column(f.text).unwrap_or(OTHER))
            .collect()
    };
    settle_bare(&mut columns, above)?;
    if columns.iter().all(|c| c.role != Role::AxisName) {
        // A deviation of no axis, such as that along the radius.
        for column in &mut columns {
            if matches!(column.role, Role::Of(_, None)) {
                *column = OTHER;
            }
        }
    }
    is_table(&columns).then_some(columns)
}

/// A column that is not read.
pub(super) const OTHER: Column = Column {
    role: Role::Other,
    unit: None,
};

/// Names of one to so many words between blanks: the most words that `known` makes a column of.
pub(super) fn by_words(
    fields: &[Field],
    most: usize,
    known: impl Fn(&str) -> Option<Column>,
) -> Vec<Column> {
    let (mut columns, mut at) = (Vec::new(), 0);
    while at < fields.len() {
        let longest = (1..=most.min(fields.len() - at)).rev().find_map(|count| {
            let texts: Vec<&str> = fields[at..at + count].iter().map(|f| f.text).collect();
            Some((count, known(&texts.join(" "))?))
        });
        let (count, found) = longest.unwrap_or((1, OTHER));
        columns.push(found);
        at += count;
    }
    columns
}

/// A name taken apart; `None` where it is none of those that are known.
pub(super) fn column(name: &str) -> Option<Column> {
    let mut words = words(name);
    if name.trim() == "#" {
        words = vec!["#".to_owned()];
    }
    let units: Vec<LengthUnit> = words.iter().filter_map(|w| length_unit(w)).collect();
    words.retain(|w| length_unit(w).is_none());
    let unit = match units[..] {
        [] => None,
        [unit] => Some(unit),
        _ => return None,
    };
    let is = |known: &[&str], word: &String| known.contains(&word.as_str());
    for (known, role) in [
        (AXIS, Role::AxisName),
        (PART, Role::Part),
        (REPLICATE, Role::Replicate),
        (POINT, Role::Point),
    ] {
        // `Part no` is the part's.
        let any = words.iter().any(|w| is(known, w));
        if any && unit.is_none() && words.iter().all(|w| is(known, w) || is(NUMBERING, w)) {
            return Some(Column { role, unit });
        }
    }
    let (mut kind, mut axis) = (None, None);
    for word in words.iter().filter(|w| !FILLING.contains(&w.as_str())) {
        let (own_kind, own_axis) = kind_and_axis(word)?;
        if (own_kind.is_some() && kind.is_some()) || (own_axis.is_some() && axis.is_some()) {
            return None;
        }
        (kind, axis) = (kind.or(own_kind), axis.or(own_axis));
    }
    let role = match (kind, axis) {
        (Some(kind), axis) => Role::Of(kind, axis),
        (None, Some(axis)) => Role::Bare(axis),
        (None, None) => return None,
    };
    Some(Column { role, unit })
}

/// What a word says: `nominal`, `x`, or both at once as in `xnom` and `dx`.
fn kind_and_axis(word: &str) -> Option<(Option<Kind>, Option<Axis>)> {
    let axis_of = |letter: &str| {
        let upper = letter.to_uppercase();
        Axis::ALL
            .into_iter()
            .find(|a| a.letter().to_string() == upper)
    };
    if let Some(axis) = axis_of(word) {
        return Some((None, Some(axis)));
    }
    if word != "d"
        && let Some(kind) = kind(word)
    {
        return Some((Some(kind), None));
    }
    let first = word.char_indices().nth(1).map(|(at, _)| word.split_at(at));
    let last = word
        .char_indices()
        .next_back()
        .map(|(at, _)| word.split_at(at));
    let first = first.and_then(|(axis, rest)| Some((kind(rest)?, axis_of(axis)?)));
    let last = last.and_then(|(rest, axis)| Some((kind(rest)?, axis_of(axis)?)));
    first.or(last).map(|(kind, axis)| (Some(kind), Some(axis)))
}

fn kind(word: &str) -> Option<Kind> {
    let sorts = [
        (NOMINAL, Kind::Nominal),
        (MEASURED, Kind::Measured),
        (DEVIATION, Kind::Deviation),
    ];
    let of = sorts.into_iter().find(|(known, _)| known.contains(&word));
    of.map(|(_, kind)| kind)
}

/// Says what bare `x`, `y`, `z` are: nominal beside measured ones; where they come several times, what the
/// line above calls each time.
fn settle_bare(columns: &mut [Column], above: &str) -> Option<()> {
    let times = |axis: Axis| {
        columns
            .iter()
            .filter(|c| c.role == Role::Bare(axis))
            .count()
    };
    let most = Axis::ALL.into_iter().map(times).max().unwrap_or(0);
    let groups: Vec<Kind> = words(above).iter().filter_map(|w| kind(w)).collect();
    let of_groups = most > 1 && groups.len() == most;
    if most > 1 && !of_groups {
        return None;
    }
    let mut seen = [0; 3];
    for column in columns {
        let Role::Bare(axis) = column.role else {
            continue;
        };
        let place = Axis::ALL.iter().position(|a| *a == axis)?;
        let kind = if of_groups {
            groups[seen[place]]
        } else {
            Kind::Nominal
        };
        column.role = Role::Of(kind, Some(axis));
        seen[place] += 1;
    }
    Some(())
}

/// Whether there are nominal places and what was measured there, each role once.
pub(super) fn is_table(columns: &[Column]) -> bool {
    let has = |role: Role| columns.iter().any(|c| c.role == role);
    let once = columns.iter().enumerate().all(|(k, c)| {
        c.role == Role::Other || columns[..k].iter().all(|before| before.role != c.role)
    });
    let found = |axis: Option<Axis>| {
        has(Role::Of(Kind::Measured, axis)) || has(Role::Of(Kind::Deviation, axis))
    };
    let nominal = |axis: Option<Axis>| has(Role::Of(Kind::Nominal, axis));
    let by_row = has(Role::AxisName) && nominal(None) && found(None);
    let any = Axis::ALL.into_iter().any(|a| found(Some(a)));
    let all = Axis::ALL
        .into_iter()
        .all(|a| nominal(Some(a)) || !found(Some(a)));
    once && (by_row || (any && all))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roles(lines: &[&str]) -> Option<Vec<Role>> {
        let header = Header::find(lines)?;
        Some(header.columns.iter().map(|c| c.role).collect())
    }

    #[test]
    fn names_are_known_however_they_are_written() {
        use Kind::{Deviation, Measured, Nominal};
        let [x, y, _] = Axis::ALL.map(Some);
        let plain = vec![
            Role::Point,
            Role::Of(Nominal, x),
            Role::Of(Nominal, y),
            Role::Of(Measured, x),
            Role::Of(Measured, y),
        ];
        for line in [
            "point,nominal x,nominal y,measured x,measured y",
            "Hole\tX_nom\tY_nom\tX_meas\tY_meas",
            "No.;Xnom (mm);Ynom (mm);Xact (mm);Yact (mm)",
            "Point  Nominal X  Nominal Y  Measured X  Measured Y",
            "ID x y x_measured y_measured",
            "Punkt-Nr,Soll X,Soll Y,Ist X,Ist Y",
        ] {
            let found = roles(&[line]).unwrap_or_default();
            // A word that is not known makes no point of a column.
            let own = if line.starts_with("Punkt") {
                &plain[1..]
            } else {
                &plain[..]
            };
            assert!(
                found.ends_with(own) && found.len() == plain.len(),
                "{line}: {found:?}"
            );
        }
        let with_deviation = roles(&["X nom  Y nom  dX  dY  Tol"]).unwrap();
        assert_eq!(
            with_deviation[2..4],
            [Role::Of(Deviation, x), Role::Of(Deviation, y)]
        );
        assert_eq!(with_deviation[4], Role::Other);
        let grouped = [
            "CMM report",
            "      Nominal      Measured",
            "Pt  X  Y  X  Y",
        ];
        assert_eq!(roles(&grouped).unwrap(), plain);
        let radial = roles(&["Part no Hole Xnom Ynom Xact Yact Deviation"]).unwrap();
        assert_eq!((radial[0], radial[6]), (Role::Part, Role::Other));
        let by_row = roles(&["Feature Axis Nominal Actual Dev"]).unwrap();
        assert_eq!(by_row[1..3], [Role::AxisName, Role::Of(Nominal, None)]);
    }

    #[test]
    fn other_tables_are_none_of_a_plate() {
        for line in [
            "part,point,axis,value",
            "x,y",
            "Pt X Y X Y",
            "point,x,y,z",
            "nominal x,measured y",
            "nominal x,nominal x,measured x",
            "Nominal values are those of the certificate",
        ] {
            assert_eq!(roles(&[line]), None, "{line}");
        }
    }
}
