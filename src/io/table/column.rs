//! The columns of a table: their names, and the units that stand beside these.

use crate::io::units::LengthUnit;

/// A unit that may stand beside the name of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::io) enum Unit {
    /// A length.
    Length(LengthUnit),
    /// A time, in seconds.
    Time(f64),
}

impl Unit {
    /// The names that files and options may use.
    pub const NAMES: [&'static str; 10] = [
        "nm", "um", "mm", "m", "inch", "uinch", "ms", "s", "min", "h",
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        let same = |name: &&&str| Self::from_name(name) == Some(self);
        Self::NAMES.iter().find(same).copied().unwrap_or("s")
    }

    /// The unit of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        let time = match name {
            "ms" => Some(1e-3),
            "s" => Some(1.0),
            "min" => Some(60.0),
            "h" => Some(3600.0),
            _ => None,
        };
        let length = LengthUnit::from_name(name).map(Self::Length);
        length.or(time.map(Self::Time))
    }
}

/// A name as it stands in the first line, taken apart.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Heading {
    pub name: String,
    pub unit: Option<Unit>,
}

impl Heading {
    /// `x (mm)`, `x [mm]` and `x_mm` are the column `x` in mm; anything else is a name.
    pub fn of(text: &str) -> Self {
        let bracketed = |open: char, close: char| {
            let (name, unit) = text.strip_suffix(close)?.split_once(open)?;
            Some((name, unit))
        };
        let apart = bracketed('(', ')')
            .or_else(|| bracketed('[', ']'))
            .or_else(|| text.rsplit_once('_'));
        let found = apart.and_then(|(name, unit)| {
            let (name, unit) = (name.trim(), unit.trim());
            let unit = Unit::from_name(unit).filter(|_| !name.is_empty())?;
            Some(Self {
                name: name.to_owned(),
                unit: Some(unit),
            })
        });
        found.unwrap_or_else(|| Self {
            name: text.to_owned(),
            unit: None,
        })
    }
}

/// A column of a table, found by its name.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    index: usize,
    name: String,
    unit: Option<Unit>,
    /// By what its numbers are multiplied; none where a unit stands beside the name that nobody takes.
    scale: Option<f64>,
}

impl Column {
    pub(super) fn new(index: usize, name: &str, unit: Option<Unit>) -> Self {
        Self {
            index,
            name: name.to_owned(),
            scale: unit.is_none().then_some(1.0),
            unit,
        }
    }

    /// Its name, without a unit.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its place among the fields of a row.
    pub fn index(&self) -> usize {
        self.index
    }

    pub(super) fn scale(&self) -> Option<f64> {
        self.scale
    }

    /// The unit of length beside its name.
    pub fn length_unit(&self) -> Option<LengthUnit> {
        match self.unit {
            Some(Unit::Length(unit)) => Some(unit),
            _ => None,
        }
    }

    /// Its numbers in a unit of length, which is the file's own where no other stands beside the name.
    #[must_use]
    pub fn in_unit(mut self, wanted: LengthUnit) -> Self {
        if let Some(own) = self.length_unit() {
            self.scale = Some(if own == wanted {
                1.0
            } else {
                own.in_um() / wanted.in_um()
            });
        }
        self
    }

    /// Its numbers in mm.
    #[must_use]
    pub fn in_mm(self) -> Self {
        self.in_unit(LengthUnit::Mm)
    }

    /// Its numbers in µm.
    #[must_use]
    pub fn in_um(self) -> Self {
        self.in_unit(LengthUnit::Um)
    }

    /// Its numbers in s.
    #[must_use]
    pub fn in_s(mut self) -> Self {
        if let Some(Unit::Time(seconds)) = self.unit {
            self.scale = Some(seconds);
        }
        self
    }

    /// Its numbers as they stand, whatever unit is beside the name: who asks takes care of it.
    #[must_use]
    pub fn as_written(mut self) -> Self {
        self.scale = Some(1.0);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_units_are_taken_apart() {
        let length = |unit| Some(Unit::Length(unit));
        for (text, name, unit) in [
            ("x", "x", None),
            ("x (mm)", "x", length(LengthUnit::Mm)),
            ("x[inch]", "x", length(LengthUnit::Inch)),
            ("reading (µm)", "reading", length(LengthUnit::Um)),
            ("M_std_um", "M_std", length(LengthUnit::Um)),
            ("deviation_uin", "deviation", length(LengthUnit::Microinch)),
            ("t_s", "t", Some(Unit::Time(1.0))),
            ("temperature (C)", "temperature (C)", None),
            ("I_0_0", "I_0_0", None),
            ("_mm", "_mm", None),
            ("(mm)", "(mm)", None),
        ] {
            let heading = Heading::of(text);
            assert_eq!(
                (heading.name.as_str(), heading.unit),
                (name, unit),
                "{text}"
            );
        }
    }
}
