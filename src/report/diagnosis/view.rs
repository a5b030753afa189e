//! What the page of a diagnosis is made from.

/// What was found, which sets how the summary is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Finding {
    /// No gap is detected.
    #[default]
    None,
    /// One or several effects explain the gap.
    Effect,
    /// A gap that no effect of the catalogue explains.
    Unknown,
}

/// What the page of a diagnosis shows. Values are in the units they are shown in; what there is
/// none of is left empty, and its section is left out.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// Name of the data.
    pub data: String,
    /// What was found.
    pub finding: Finding,
    /// The sentence a person acts on.
    pub statement: String,
    /// The effects whose change is taken out for all that is called `after`.
    pub taken_out: Vec<String>,
    /// How large the gap is and how far it shrinks.
    pub gap: Gap,
    /// Where it lies.
    pub places: Vec<Place>,
    /// The candidates, in any order.
    pub candidates: Vec<Candidate>,
    /// Groups that these data cannot tell apart, the greatest evidence first, and the measurement
    /// that would.
    pub groups: Vec<Group>,
    /// For each named effect how severe its test was.
    pub severities: Vec<Severity>,
    /// Residuals before and after.
    pub residuals: Vec<Residual>,
    /// Axis of `Residual::x` and its unit.
    pub x: (String, String),
    /// How the model's quantities move.
    pub shifts: Vec<Shift>,
    /// Profiles before and after, such as the forms.
    pub profiles: Vec<Profile>,
    /// Effects that these data show badly or not at all.
    pub hidden: Vec<Hidden>,
    /// What the reader should know.
    pub notes: Vec<String>,
    /// Outcome of blind trials with effects put into these data, where they were asked for.
    pub trials: Option<Trials>,
}

/// What else would have been given the name of an effect.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Severity {
    /// The effect.
    pub effect: String,
    /// The severity in a line.
    pub line: String,
    /// Whether something else may well have been given the name.
    pub weak: bool,
    /// Rivals and the probability of each, the greatest first.
    pub rivals: Vec<(String, f64)>,
}

/// A root mean square with its 95 % interval.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Size {
    /// The value.
    pub rms: f64,
    /// Its 95 % interval.
    pub ci95: [f64; 2],
}

/// The size of the gap.
#[derive(Debug, Clone, Default)]
pub struct Gap {
    /// Unit of the readings, as people write it.
    pub unit: String,
    /// The noise.
    pub noise: f64,
    /// Of what: `one reading`, or a mean of several.
    pub of_what: String,
    /// Without the effects.
    pub before: Size,
    /// With them.
    pub after: Size,
    /// Part of the gap that is gone.
    pub shrink: f64,
    /// The same on repeats that were held out: before, after.
    pub held_out: Option<(f64, f64)>,
}

/// A place where the gap lies.
#[derive(Debug, Clone, Default)]
pub struct Place {
    /// `channel`, `pattern`, `x`, …
    pub axis: String,
    /// Which of them, with its range if it has one.
    pub value: String,
    /// Part of the gap that lies there.
    pub share: f64,
    /// Corrected for every place looked at.
    pub p_value: f64,
}

/// One effect against these data.
#[derive(Debug, Clone, Default)]
pub struct Candidate {
    /// Its name.
    pub effect: String,
    /// Its variant in words, with those that fit as well.
    pub variant: Option<String>,
    /// Part of the gap that it alone explains.
    pub explained: f64,
    /// Corrected for every effect tried.
    pub p_value: f64,
    /// Logarithm of the evidence against no effect.
    pub evidence: f64,
    /// Part of the effect that the fitted model cannot absorb.
    pub visible: f64,
    /// Whether it is named, alone or with others of its group.
    pub named: bool,
    /// Name, value, standard uncertainty and unit of its parameters.
    pub parameters: Vec<(String, f64, f64, String)>,
    /// What happens physically.
    pub physics: String,
    /// What would confirm it.
    pub confirm: String,
}

/// Effects that these data cannot tell apart.
#[derive(Debug, Clone, Default)]
pub struct Group {
    /// Their names.
    pub effects: Vec<String>,
    /// The additional measurement that would separate them.
    pub separate: String,
}

/// What is left of one reading, without and with the effects.
#[derive(Debug, Clone, Default)]
pub struct Residual {
    /// The map it belongs to, such as the channel.
    pub panel: String,
    /// The row in the map, such as repeat and direction.
    pub row: String,
    /// Position along the axis of the view.
    pub x: f64,
    /// Time of the reading, in any unit: traces stand in its order.
    pub time: f64,
    /// Without the effects.
    pub before: f64,
    /// With them.
    pub after: f64,
}

/// How far a quantity moves when the effects are added.
#[derive(Debug, Clone, Default)]
pub struct Shift {
    /// The quantity.
    pub quantity: String,
    /// Without the effects, with its standard uncertainty.
    pub before: (f64, f64),
    /// With them.
    pub after: (f64, f64),
    /// The difference, or the root mean square of the difference of profiles.
    pub moved: (f64, f64),
    /// Unit, as people write it.
    pub unit: String,
}

/// A profile without and with the effects.
#[derive(Debug, Clone, Default)]
pub struct Profile {
    /// Its name.
    pub name: String,
    /// Positions along the axis of the view.
    pub x: Vec<f64>,
    /// Without the effects.
    pub before: Vec<f64>,
    /// With them.
    pub after: Vec<f64>,
}

/// An effect that hides.
#[derive(Debug, Clone, Default)]
pub struct Hidden {
    /// Its name.
    pub effect: String,
    /// Part of it that the fitted model cannot absorb.
    pub visible: f64,
    /// Smallest size that would be seen, with its unit, if any would.
    pub detectable: Option<(f64, String)>,
    /// Whether it may have to be greater than that, being taken for noise in part.
    pub at_least: bool,
    /// How far that size is another for other shapes, in words.
    pub by_shape: Option<String>,
    /// What it does to the answer unseen.
    pub harm: String,
}

/// A confusion matrix: rows are what was put in, columns what was said.
#[derive(Debug, Clone, Default)]
pub struct Trials {
    /// What was put in.
    pub truths: Vec<String>,
    /// What was said.
    pub answers: Vec<String>,
    /// How often, by truth and answer.
    pub counts: Vec<Vec<usize>>,
}
