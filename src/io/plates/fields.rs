//! Lines of a printed table, taken apart.

/// What stands between the fields of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Split {
    At(char),
    /// Any white space.
    Blank,
}

/// A field of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Field<'a> {
    pub text: &'a str,
    /// Where it begins in the line, bytes.
    pub at: usize,
}

impl Split {
    /// What a line that names columns is split at.
    pub fn of(line: &str) -> Self {
        let found = ['\t', ';', ','].into_iter().find(|c| line.contains(*c));
        found.map_or(Self::Blank, Self::At)
    }

    /// The fields without the blanks and quotes around them.
    pub fn fields(self, line: &str) -> Vec<Field<'_>> {
        let mut fields = Vec::new();
        let mut add = |from: usize, to: usize| {
            let whole = &line[from..to];
            let text = whole.trim();
            let at = from + (whole.len() - whole.trim_start().len());
            let bare = text.strip_prefix('"').and_then(|t| t.strip_suffix('"'));
            match bare {
                Some(bare) => fields.push(Field {
                    text: bare.trim(),
                    at: at + 1,
                }),
                None => fields.push(Field { text, at }),
            }
        };
        let (mut from, mut quoted) = (0, false);
        for (at, c) in line.char_indices() {
            quoted ^= c == '"';
            let between = match self {
                Self::At(mark) => c == mark,
                Self::Blank => c.is_whitespace(),
            };
            if between && !quoted {
                if self != Self::Blank || at > from {
                    add(from, at);
                }
                from = at + c.len_utf8();
            }
        }
        if self != Self::Blank || from < line.len() {
            add(from, line.len());
        }
        fields
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_stand_where_they_are() {
        let texts = |split: Split, line: &'static str| -> Vec<(&str, usize)> {
            split.fields(line).iter().map(|f| (f.text, f.at)).collect()
        };
        assert_eq!(
            texts(Split::Blank, "  A1  2.5\t-3 "),
            [("A1", 2), ("2.5", 6), ("-3", 10)]
        );
        assert_eq!(
            texts(Split::Blank, "\"Hole 1\" 4"),
            [("Hole 1", 1), ("4", 9)]
        );
        assert_eq!(
            texts(Split::At(';'), "a; 1,5;;"),
            [("a", 0), ("1,5", 3), ("", 7), ("", 8)]
        );
        assert_eq!(texts(Split::Blank, ""), []);
    }
}
