//! Counts of truths inside intervals, and the table that is made of them.

use errsep_solvers::uncertainty::student_quantile;

/// The share of a normal distribution within one standard deviation.
pub const ONE_SIGMA: f64 = 0.682_689_492_137_085_9;

/// What is counted of one quantity.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tally {
    values: u64,
    squares: f64,
    inside_68: u64,
    inside_95: u64,
    wide_alone: bool,
}

impl Tally {
    /// One value: its error, its standard uncertainty and the degrees of freedom of that (infinite for
    /// a normal distribution), intervals ± t·u.
    pub fn add(&mut self, error: f64, std: f64, freedom: f64) {
        let factor = |share: f64| {
            if freedom.is_finite() {
                student_quantile(0.5 + share / 2.0, freedom)
            } else if share > 0.9 {
                1.959_963_984_540_054
            } else {
                1.0
            }
        };
        self.add_intervals(error, std, factor(ONE_SIGMA) * std, factor(0.95) * std);
    }

    /// One value with the half widths of its intervals as the command gives them.
    pub fn add_intervals(&mut self, error: f64, std: f64, half_68: f64, half_95: f64) {
        self.values += 1;
        self.squares += (error / std).powi(2);
        self.inside_68 += u64::from(error.abs() <= half_68);
        self.inside_95 += u64::from(error.abs() <= half_95);
    }

    /// One value of which only the intervals are given, as of a variance: whether the narrow and the wide
    /// one hold the truth.
    pub fn add_inside(&mut self, inside_68: bool, inside_95: bool) {
        self.values += 1;
        self.squares = f64::NAN;
        self.inside_68 += u64::from(inside_68);
        self.inside_95 += u64::from(inside_95);
    }

    /// One value of which only the interval of 95 % is given, and whether it holds the truth.
    pub fn add_wide(&mut self, inside: bool) {
        self.add_inside(false, inside);
        self.wide_alone = true;
    }

    /// Whether anything was counted.
    pub fn any(&self) -> bool {
        self.values > 0
    }

    /// Both counts together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            values: self.values + other.values,
            squares: self.squares + other.squares,
            inside_68: self.inside_68 + other.inside_68,
            inside_95: self.inside_95 + other.inside_95,
            wide_alone: self.wide_alone || other.wide_alone,
        }
    }
}

/// One line of the table.
#[derive(Debug, Clone)]
pub struct Row {
    /// What was measured, and on what data.
    pub case: String,
    /// Whose uncertainty it is.
    pub quantity: String,
    /// Data sets; several values of one set, as of a profile, are not independent.
    pub seeds: u64,
    /// The counts.
    pub tally: Tally,
}

/// The mark of a row: a 95 % interval that holds less than 93 % or more than 97 %, one of 68.27 % that
/// holds less than 65 % or more than 71 %.
fn mark(of_68: Option<f64>, of_95: f64) -> &'static str {
    let (narrow, wide) = (65.0..=71.0, 93.0..=97.0);
    let narrow = of_68.is_none_or(|share| narrow.contains(&share));
    match (narrow, wide.contains(&of_95)) {
        (true, true) => "",
        (true, false) => "outside",
        (false, true) => "68 % outside",
        (false, false) => "both outside",
    }
}

/// Prints the rows as a table with their marks.
pub fn print(rows: &[Row]) {
    println!("| case | quantity | data sets | values | rms of error/u | in 68.27 % | in 95 % | |");
    println!("|---|---|---|---|---|---|---|---|");
    for row in rows {
        let t = row.tally;
        let count = t.values.max(1) as f64;
        let share = |inside: u64| 100.0 * inside as f64 / count;
        let rms = (t.squares / count).sqrt();
        let rms = if rms.is_finite() {
            format!("{rms:.3}")
        } else {
            String::new()
        };
        let of_68 = (!t.wide_alone).then(|| share(t.inside_68));
        let narrow = of_68.map(|s| format!("{s:.1} %")).unwrap_or_default();
        println!(
            "| {} | {} | {} | {} | {rms} | {narrow} | {:.1} % | {} |",
            row.case,
            row.quantity,
            row.seeds,
            t.values,
            share(t.inside_95),
            mark(of_68, share(t.inside_95))
        );
    }
}
