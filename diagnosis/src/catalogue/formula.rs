//! Formulas of the user's own effects: a small language without state, checked as it is read.
//!
//! sum := term {(+|−) term};  term := power {(*|/) power};  power := sign [^ power];
//! sign := [−|+] sign | atom;  atom := number | name | name ( sum {, sum} ) | ( sum )

use serde::Deserialize;

use crate::catalogue::curve::Along;

/// What a formula may ask of a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circumstances {
    /// Position.
    pub x: f64,
    /// Seconds since the first reading.
    pub time: f64,
    /// +1 forward, −1 backward.
    pub direction: f64,
    /// Repeat number.
    pub repeat: f64,
    /// Number of the channel, from one, in the order of the report.
    pub channel: f64,
    /// The reading as the model has it, without its own noise.
    pub reading: f64,
}

/// A formula in x, time, direction, repeat, channel and reading.
#[derive(Debug, Clone, Deserialize)]
#[serde(try_from = "String")]
pub struct Formula {
    text: String,
    root: Node,
}

impl PartialEq for Formula {
    fn eq(&self, other: &Self) -> bool {
        self.text == other.text
    }
}

#[derive(Debug, Clone)]
enum Node {
    Number(f64),
    Variable(Variable),
    Call(Function, Vec<Node>),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Variable {
    X,
    Time,
    Direction,
    Repeat,
    Channel,
    Reading,
}

/// A function of one or two numbers.
#[derive(Debug, Clone, Copy)]
enum Function {
    One(fn(f64) -> f64),
    Two(fn(f64, f64) -> f64),
}

/// Names of variables, for messages.
const VARIABLES: [(&str, Variable); 6] = [
    ("x", Variable::X),
    ("time", Variable::Time),
    ("direction", Variable::Direction),
    ("repeat", Variable::Repeat),
    ("channel", Variable::Channel),
    ("reading", Variable::Reading),
];

/// Names of functions.
const FUNCTIONS: [(&str, Function); 12] = [
    ("sin", Function::One(f64::sin)),
    ("cos", Function::One(f64::cos)),
    ("tan", Function::One(f64::tan)),
    ("exp", Function::One(f64::exp)),
    ("ln", Function::One(f64::ln)),
    ("sqrt", Function::One(f64::sqrt)),
    ("abs", Function::One(f64::abs)),
    ("step", Function::One(step)),
    ("same", Function::Two(same)),
    ("min", Function::Two(f64::min)),
    ("max", Function::Two(f64::max)),
    ("atan2", Function::Two(f64::atan2)),
];

/// Deepest nesting, so that no text overflows the stack.
const DEEPEST: usize = 64;

/// 1 from zero on, else 0.
fn step(value: f64) -> f64 {
    f64::from(u8::from(value >= 0.0))
}

/// 1 where two numbers are equal, else 0.
fn same(a: f64, b: f64) -> f64 {
    f64::from(u8::from(a == b))
}

impl Formula {
    /// The value for one reading; not finite where a function is not defined.
    pub fn at(&self, reading: &Circumstances) -> f64 {
        self.root.value(reading)
    }

    /// As it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The first of position, time and reading that it names.
    pub fn along(&self) -> Option<Along> {
        self.root.along()
    }

    /// Whether it asks for the reading.
    pub fn has_reading(&self) -> bool {
        self.root.has(Variable::Reading)
    }
}

impl Node {
    fn value(&self, reading: &Circumstances) -> f64 {
        match self {
            Self::Number(value) => *value,
            Self::Variable(Variable::X) => reading.x,
            Self::Variable(Variable::Time) => reading.time,
            Self::Variable(Variable::Direction) => reading.direction,
            Self::Variable(Variable::Repeat) => reading.repeat,
            Self::Variable(Variable::Channel) => reading.channel,
            Self::Variable(Variable::Reading) => reading.reading,
            Self::Call(Function::One(function), inner) => function(inner[0].value(reading)),
            Self::Call(Function::Two(function), inner) => {
                function(inner[0].value(reading), inner[1].value(reading))
            }
        }
    }

    fn has(&self, variable: Variable) -> bool {
        match self {
            Self::Number(_) => false,
            Self::Variable(own) => *own == variable,
            Self::Call(_, inner) => inner.iter().any(|n| n.has(variable)),
        }
    }

    fn along(&self) -> Option<Along> {
        match self {
            Self::Variable(Variable::X) => Some(Along::Position),
            Self::Variable(Variable::Time) => Some(Along::Time),
            Self::Variable(Variable::Reading) => Some(Along::Reading),
            Self::Number(_) | Self::Variable(_) => None,
            Self::Call(_, inner) => inner.iter().find_map(Self::along),
        }
    }

    fn two(function: fn(f64, f64) -> f64, a: Self, b: Self) -> Self {
        Self::Call(Function::Two(function), vec![a, b])
    }
}

impl TryFrom<String> for Formula {
    type Error = String;

    /// Reads a formula.
    ///
    /// # Errors
    /// What is wrong, and at which character, counted from one.
    fn try_from(text: String) -> Result<Self, String> {
        let mut parser = Parser {
            text: text.chars().collect(),
            at: 0,
            depth: 0,
        };
        let root = parser.sum()?;
        parser.blanks();
        match parser.text.get(parser.at) {
            None => Ok(Self { text, root }),
            Some(found) => Err(parser.fault(&format!("`{found}` is not expected"))),
        }
    }
}

struct Parser {
    text: Vec<char>,
    at: usize,
    depth: usize,
}

impl Parser {
    fn fault(&self, what: &str) -> String {
        let text: String = self.text.iter().collect();
        format!(
            "{what} at character {} of the formula `{text}`",
            self.at + 1
        )
    }

    fn blanks(&mut self) {
        while self.text.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
    }

    /// Takes one of some characters.
    fn take(&mut self, wanted: &[char]) -> Option<char> {
        self.blanks();
        let found = *self.text.get(self.at).filter(|c| wanted.contains(c))?;
        self.at += 1;
        Some(found)
    }

    fn sum(&mut self) -> Result<Node, String> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.fault("nested too deeply"));
        }
        let mut left = self.term()?;
        while let Some(sign) = self.take(&['+', '-']) {
            let right = self.term()?;
            let function = if sign == '+' {
                |a, b| a + b
            } else {
                |a: f64, b: f64| a - b
            };
            left = Node::two(function, left, right);
        }
        self.depth -= 1;
        Ok(left)
    }

    fn term(&mut self) -> Result<Node, String> {
        let mut left = self.power()?;
        while let Some(sign) = self.take(&['*', '/']) {
            let right = self.power()?;
            let function = if sign == '*' {
                |a, b| a * b
            } else {
                |a: f64, b: f64| a / b
            };
            left = Node::two(function, left, right);
        }
        Ok(left)
    }

    /// A sign binds less than a power: −x^2 is −(x^2).
    fn power(&mut self) -> Result<Node, String> {
        let mut negative = false;
        while let Some(sign) = self.take(&['+', '-']) {
            negative ^= sign == '-';
        }
        let base = self.atom()?;
        let whole = if self.take(&['^']).is_some() {
            self.depth += 1;
            if self.depth > DEEPEST {
                return Err(self.fault("nested too deeply"));
            }
            let exponent = self.power()?;
            self.depth -= 1;
            Node::two(f64::powf, base, exponent)
        } else {
            base
        };
        Ok(if negative {
            Node::two(|a, b| a - b, Node::Number(0.0), whole)
        } else {
            whole
        })
    }

    fn atom(&mut self) -> Result<Node, String> {
        self.blanks();
        match self.text.get(self.at) {
            None => Err(self.fault("a number, a name or a bracket is missing")),
            Some('(') => {
                self.at += 1;
                let inner = self.sum()?;
                self.closed()?;
                Ok(inner)
            }
            Some(c) if c.is_ascii_digit() || *c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() => self.name(),
            Some(c) => Err(self.fault(&format!("`{c}` is not expected"))),
        }
    }

    fn closed(&mut self) -> Result<(), String> {
        self.take(&[')'])
            .map(|_| ())
            .ok_or_else(|| self.fault("a `)` is missing"))
    }

    fn number(&mut self) -> Result<Node, String> {
        let start = self.at;
        while let Some(c) = self.text.get(self.at) {
            let exponent_sign = matches!(c, '+' | '-')
                && self.at > start
                && matches!(self.text[self.at - 1], 'e' | 'E');
            if !(c.is_ascii_digit() || matches!(c, '.' | 'e' | 'E') || exponent_sign) {
                break;
            }
            self.at += 1;
        }
        let text: String = self.text[start..self.at].iter().collect();
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Node::Number(value)),
            _ => {
                self.at = start;
                Err(self.fault(&format!("`{text}` is no number")))
            }
        }
    }

    fn name(&mut self) -> Result<Node, String> {
        let start = self.at;
        while self
            .text
            .get(self.at)
            .is_some_and(|c| c.is_ascii_alphanumeric())
        {
            self.at += 1;
        }
        let name: String = self.text[start..self.at].iter().collect();
        if name == "pi" {
            return Ok(Node::Number(std::f64::consts::PI));
        }
        if let Some((_, variable)) = VARIABLES.iter().find(|(known, _)| *known == name) {
            return Ok(Node::Variable(*variable));
        }
        let Some((_, function)) = FUNCTIONS.iter().find(|(known, _)| *known == name) else {
            self.at = start;
            let known: Vec<&str> = VARIABLES
                .iter()
                .map(|(n, _)| *n)
                .chain(["pi"])
                .chain(FUNCTIONS.iter().map(|(n, _)| *n))
                .collect();
            return Err(self.fault(&format!(
                "`{name}` is not known (known: {})",
                known.join(", ")
            )));
        };
        if self.take(&['(']).is_none() {
            return Err(self.fault(&format!("a `(` is missing after `{name}`")));
        }
        let mut inner = vec![self.sum()?];
        if matches!(function, Function::Two(_)) {
            if self.take(&[',']).is_none() {
                return Err(self.fault(&format!("`{name}` needs two numbers with a comma")));
            }
            inner.push(self.sum()?);
        }
        self.closed()?;
        Ok(Node::Call(*function, inner))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HERE: Circumstances = Circumstances {
        x: 3.0,
        time: 10.0,
        direction: -1.0,
        repeat: 2.0,
        channel: 4.0,
        reading: 0.5,
    };

    fn value(text: &str) -> f64 {
        Formula::try_from(text.to_owned()).unwrap().at(&HERE)
    }

    #[test]
    fn formulas_are_read_as_they_are_written() {
        // Exact in binary arithmetic.
        assert_eq!(value("1 + 2*x - 8/4"), 5.0);
        assert_eq!(value("-x^2"), -9.0);
        assert_eq!(value("2^3^2"), 512.0);
        assert_eq!(value("2^-1"), 0.5);
        assert_eq!(value("(1 - 2) * direction"), 1.0);
        assert_eq!(value("1.5e1 - 10 - 2"), 3.0);
        assert_eq!(
            value("same(channel, 4) * step(time - 10) * max(repeat, 1)"),
            2.0
        );
        assert_eq!(value("cos(0 * pi)"), 1.0);
        assert_eq!(value("reading^2"), 0.25);
    }

    #[test]
    fn faults_are_told_with_their_place() {
        for (text, what) in [
            ("1 +", "missing at character 4"),
            ("speed * 2", "`speed` is not known"),
            ("sin x", "a `(` is missing after `sin`"),
            ("min(1)", "needs two numbers"),
            ("(1", "a `)` is missing"),
            ("1 2", "`2` is not expected at character 3"),
            ("1..2", "`1..2` is no number at character 1"),
            ("1e999", "is no number"),
        ] {
            let fault = Formula::try_from(text.to_owned()).unwrap_err();
            assert!(fault.contains(what), "{text}: {fault}");
        }
        let deep = "(".repeat(100_000);
        assert!(
            Formula::try_from(deep)
                .unwrap_err()
                .contains("nested too deeply")
        );
        assert!(
            Formula::try_from("2^".repeat(100_000))
                .unwrap_err()
                .contains("nested too deeply")
        );
    }

    proptest! {
        /// No text makes the parser panic.
        #[test]
        fn any_text_is_read_or_refused(text in "[-+*/^(),.0-9a-z ]{0,40}") {
            if let Ok(formula) = Formula::try_from(text) {
                let _ = formula.at(&HERE);
            }
        }
    }
}
