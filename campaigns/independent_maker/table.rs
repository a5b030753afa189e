//! Tables of rates with their limits.

use statrs::distribution::{Beta, ContinuousCDF};

/// Clopper and Pearson's 95 % limits of a rate.
pub fn limits(right: usize, of: usize) -> [f64; 2] {
    let (k, n) = (right as f64, of as f64);
    let quantile =
        |a: f64, b: f64, p: f64| Beta::new(a, b).map_or(f64::NAN, |law| law.inverse_cdf(p));
    [
        if right == 0 {
            0.0
        } else {
            quantile(k, n - k + 1.0, 0.025)
        },
        if right == of {
            1.0
        } else {
            quantile(k + 1.0, n - k, 0.975)
        },
    ]
}

/// A rate in words.
pub fn rate(right: usize, of: usize) -> String {
    if of == 0 {
        return "–".to_owned();
    }
    let [low, high] = limits(right, of).map(|p| 100.0 * p);
    let percent = 100.0 * right as f64 / of as f64;
    format!("{right} of {of}: {percent:.1} % ({low:.1} to {high:.1})")
}

/// Prints a table in Markdown.
pub fn print(head: &[&str], rows: &[Vec<String>]) {
    println!("\n| {} |", head.join(" | "));
    println!("|{}", "---|".repeat(head.len()));
    for row in rows {
        println!("| {} |", row.join(" | "));
    }
}
