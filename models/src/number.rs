//! Numbers as people read them: rounded to what their uncertainty supports, with a true minus sign.

/// Decimal exponents outside this range are written as a power of ten.
const PLAIN_EXPONENTS: std::ops::RangeInclusive<i32> = -4..=6;

/// From here on a double has no decimals, and digits of it that are none of the number's.
const FIXED: f64 = 1e15;

/// What stands in a report where there is no number.
pub const NOT_DETERMINED: &str = "not determined";

/// `value` to `digits` significant digits; outside 1e-4 to 1e7 as a power of ten.
///
/// ```
/// use errsep_models::number::plain;
/// assert_eq!(plain(-0.012_345, 3), "−0.0123");
/// assert_eq!(plain(1.5e-9, 2), "1.5 × 10⁻⁹");
/// ```
pub fn plain(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return NOT_DETERMINED.to_owned();
    }
    let digits = digits.clamp(1, 17);
    if value == 0.0 {
        return "0".to_owned();
    }
    let (mantissa, exponent) = scientific(value, digits);
    if PLAIN_EXPONENTS.contains(&exponent) {
        // A mantissa longer than the digits asked for would pretend to know the integer part.
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        minus(format!("{value:.decimals$}"))
    } else {
        format!("{} × 10{}", minus(mantissa), superscript(exponent))
    }
}

/// `value` with exactly `decimals` places; from 1e15 on as a power of ten.
pub fn fixed(value: f64, decimals: usize) -> String {
    if value.abs() >= FIXED {
        plain(value, 6)
    } else if value.is_finite() {
        minus(unsigned_zero(format!("{value:.decimals$}")))
    } else {
        NOT_DETERMINED.to_owned()
    }
}

/// `value ± std`: the uncertainty to two significant digits, the value to the same place
/// (GUM 7.2.6). Without a usable uncertainty the value alone, to four digits.
///
/// ```
/// use errsep_models::number::measured;
/// assert_eq!(measured(12.3456, Some(0.0789)), "12.346 ± 0.079");
/// assert_eq!(measured(-3.2e-9, Some(4.1e-11)), "(−3.200 ± 0.041) × 10⁻⁹");
/// ```
pub fn measured(value: f64, std: Option<f64>) -> String {
    let Some(std) = std.filter(|s| s.is_finite() && *s >= 0.0) else {
        return plain(value, 4);
    };
    if !value.is_finite() {
        return NOT_DETERMINED.to_owned();
    }
    if std == 0.0 {
        return format!("{} ± 0", plain(value, 6));
    }
    let largest = scientific(value.abs().max(std), 2).1;
    let place = scientific(std, 2).1 - 1;
    let factor = if PLAIN_EXPONENTS.contains(&largest) && place >= -9 {
        0
    } else {
        largest
    };
    // More than fifteen decimals say nothing: a double does not carry them.
    let decimals = (factor - place).clamp(0, 15) as usize;
    let scaled = |v: f64| {
        // Digits of the integer part below the place of the uncertainty are zeros.
        let rounded = if factor == 0 && place > 0 {
            shift(shift(v, -place).round(), place)
        } else {
            v
        };
        shift(rounded, -factor)
    };
    let text = format!(
        "{} ± {}",
        fixed(scaled(value), decimals),
        fixed(scaled(std), decimals)
    );
    if factor == 0 {
        text
    } else {
        format!("({text}) × 10{}", superscript(factor))
    }
}

/// An uncertainty that stands by itself: two significant digits, zeros behind them (GUM 7.2.6).
///
/// ```
/// use errsep_models::number::uncertainty;
/// assert_eq!(uncertainty(0.012_34), "0.012");
/// assert_eq!(uncertainty(33_088.0), "33000");
/// ```
pub fn uncertainty(value: f64) -> String {
    if !value.is_finite() || value == 0.0 {
        return plain(value, 2);
    }
    let place = scientific(value, 2).1 - 1;
    if place > 0 {
        plain(shift(shift(value, -place).round(), place), 2)
    } else {
        plain(value, 2)
    }
}

/// "1 reading", "2 readings".
pub fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// A probability: two digits, `< 0.0001` below that.
pub fn probability(p: f64) -> String {
    if !p.is_finite() {
        NOT_DETERMINED.to_owned()
    } else if p < 1e-4 {
        "< 0.0001".to_owned()
    } else {
        plain(p, 2)
    }
}

/// A share as a percentage with at most one decimal.
pub fn percent(share: f64) -> String {
    let value = 100.0 * share;
    let decimals = usize::from(value != 0.0 && value.abs() < 9.95);
    format!("{} %", fixed(value, decimals))
}

/// `10ⁿ` exponents in Unicode superscripts.
pub fn superscript(exponent: i32) -> String {
    exponent
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            '0' => '⁰',
            digit => char::from_u32(digit as u32 + ('⁴' as u32 - '4' as u32)).unwrap_or(digit),
        })
        .collect()
}

/// A typographic minus, so that −1 lines up with +1 and does not break.
pub fn minus(text: String) -> String {
    text.replace('-', "−")
}

/// Rounding −0.001 to two places must not leave a sign behind.
fn unsigned_zero(text: String) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|b| b == b'0' || b == b'.') => rest.to_owned(),
        _ => text,
    }
}

/// Mantissa as text and decimal exponent after rounding to `digits` digits.
fn scientific(value: f64, digits: usize) -> (String, i32) {
    let text = format!("{value:.*e}", digits - 1);
    match text.split_once('e') {
        Some((mantissa, exponent)) => (mantissa.to_owned(), exponent.parse().unwrap_or(0)),
        None => (text, 0),
    }
}

/// `value · 10^exponent` without the rounding of a stored power of ten.
fn shift(value: f64, exponent: i32) -> f64 {
    match format!("{value:e}").split_once('e') {
        Some((mantissa, own)) => {
            let total = own.parse::<i32>().unwrap_or(0) + exponent;
            format!("{mantissa}e{total}").parse().unwrap_or(value)
        }
        None => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn uncertainty_sets_the_last_place() {
        assert_eq!(measured(1234.6, Some(12.0)), "1235 ± 12");
        assert_eq!(measured(-0.000_4, Some(0.002)), "−0.0004 ± 0.0020");
        assert_eq!(measured(92_367.0, Some(33_088.0)), "92000 ± 33000");
        assert_eq!(measured(-12_367.0, Some(995.0)), "−12400 ± 1000");
        assert_eq!(measured(0.0, Some(0.099_6)), "0.00 ± 0.10");
        assert_eq!(measured(5.0, Some(f64::NAN)), "5.000");
        assert_eq!(measured(f64::NAN, Some(1.0)), NOT_DETERMINED);
    }

    #[test]
    fn no_negative_zero() {
        assert_eq!(fixed(1e200, 2), "1.00000 × 10²⁰⁰");
        assert_eq!(fixed(-0.001, 2), "0.00");
        assert_eq!(fixed(-0.006, 2), "−0.01");
    }

    #[test]
    fn shares_and_probabilities() {
        assert_eq!(percent(0.934), "93 %");
        assert_eq!(percent(0.0123), "1.2 %");
        assert_eq!(percent(0.0), "0 %");
        assert_eq!(probability(3e-7), "< 0.0001");
        assert_eq!(probability(0.031_4), "0.031");
    }

    proptest! {
        // Truncation: the text carries two digits of the uncertainty, so reading it back must
        // come within half a unit of the second one.
        #[test]
        fn what_is_printed_is_within_a_rounding_of_the_value(
            value in -1e9..1e9f64, exponent in -12..9i32, head in 1.0..9.99f64
        ) {
            let std = head * 10f64.powi(exponent);
            let text = measured(value, Some(std)).replace('−', "-");
            let factor = text.split_once(" × 10").map_or(0, |(_, e)| {
                e.chars().map(|c| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|d| d == c)
                    .map_or('-', |p| char::from(b'0' + p as u8))).collect::<String>()
                    .parse::<i32>().unwrap()
            });
            let number = text.trim_start_matches('(').split(" ±").next().unwrap().trim();
            let back = number.parse::<f64>().unwrap() * 10f64.powi(factor);
            let place = 10f64.powi(scientific(std, 2).1 - 1);
            prop_assert!((back - value).abs() <= 0.501 * place + 4.0 * f64::EPSILON * value.abs(),
                "{value} ± {std} printed as {text}");
        }
    }
}
