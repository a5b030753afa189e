//! Combinations of unknowns in words.

/// Fractions with these denominators are written as such.
const DENOMINATORS: [f64; 6] = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];

/// A sum such as `M_h + S_0/2 - S_180/2`.
pub fn sum(terms: &[(String, f64)]) -> String {
    let mut text = String::new();
    for (name, value) in terms.iter().filter(|t| t.1 != 0.0) {
        let sign = match (text.is_empty(), *value < 0.0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        };
        text += sign;
        text += &times(name, value.abs());
    }
    text
}

/// Two groups of unknowns that make up for each other: `M_h against S_0 + S_180`. `sides` are the names
/// of all sides' forms: `all S` where they stand together.
pub fn against(terms: &[(String, f64)], sides: &[String]) -> String {
    let is_side = |name: &String| sides.contains(name);
    let own: Vec<f64> = terms
        .iter()
        .filter(|t| is_side(&t.0) && t.1 != 0.0)
        .map(|t| t.1)
        .collect();
    let together = sides.len() > 2
        && own.len() == sides.len()
        && own.iter().all(|v| v.abs() == 1.0 && *v == own[0]);
    let mut group: Vec<(String, f64)> = terms
        .iter()
        .filter(|t| t.1 != 0.0 && !(together && is_side(&t.0)))
        .cloned()
        .collect();
    if together {
        group.push(("all S".to_owned(), own[0]));
    }
    let turn = group.first().map_or(1.0, |t| t.1.signum());
    let of = |sign: f64| -> Vec<(String, f64)> {
        group
            .iter()
            .filter(|t| t.1 * turn * sign > 0.0)
            .map(|(name, v)| (name.clone(), v.abs()))
            .collect()
    };
    let (up, down) = (of(1.0), of(-1.0));
    match (down.is_empty(), up.len()) {
        (false, _) => format!("{} against {}", sum(&up), sum(&down)),
        (true, 1) => sum(&up),
        (true, _) => format!("{} with {}", sum(&up[..1]), sum(&up[1..])),
    }
}

fn times(name: &str, value: f64) -> String {
    for denominator in DENOMINATORS {
        let numerator = value * denominator;
        if (numerator - numerator.round()).abs() < 1e-9 && numerator.round() > 0.0 {
            let front = match numerator.round() as u64 {
                1 => String::new(),
                n => format!("{n} "),
            };
            return match denominator as u64 {
                1 => format!("{front}{name}"),
                d => format!("{front}{name}/{d}"),
            };
        }
    }
    format!("{value:.3} {name}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn terms(list: &[(&str, f64)]) -> Vec<(String, f64)> {
        list.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect()
    }

    #[test]
    fn combinations_read_as_sums() {
        let text = sum(&terms(&[
            ("M_h", 1.0),
            ("S_0", 0.5),
            ("S_90", 0.0),
            ("S_180", -0.5),
        ]));
        assert_eq!(text, "M_h + S_0/2 - S_180/2");
        assert_eq!(
            sum(&terms(&[("a", -2.0), ("b", 0.866_025_4)])),
            "-2 a + 0.866 b"
        );
        assert_eq!(sum(&terms(&[("a", 1.5)])), "3 a/2");
    }

    #[test]
    fn what_makes_up_for_each_other() {
        let sides: Vec<String> = ["S_0", "S_120", "S_240"].map(str::to_owned).to_vec();
        let all = terms(&[("M_h", -1.0), ("S_0", 1.0), ("S_120", 1.0), ("S_240", 1.0)]);
        assert_eq!(against(&all, &sides), "M_h against all S");
        let two = terms(&[("M_h", 1.0), ("S_0", -1.0), ("S_120", -1.0)]);
        assert_eq!(against(&two, &sides), "M_h against S_0 + S_120");
        let far = terms(&[("M_h", 1.0), ("S_0", 1.0)]);
        assert_eq!(against(&far, &sides), "M_h with S_0");
    }
}
