//! Colours and strokes of the plots, once for pages that follow the reader's theme and once for
//! files that cannot.

use super::canvas::TONES;

/// Name, light and dark value of each colour. The tones differ in lightness as well as in hue
/// (after Okabe and Ito's palette for colour-blind readers), and each has a dash of its own.
const COLOURS: [(&str, &str, &str); 20] = [
    ("tone0", "#0b5394", "#6fb3f2"),
    ("tone1", "#c4500a", "#f2975c"),
    ("tone2", "#0a7a5c", "#4fcfa6"),
    ("tone3", "#86398f", "#d79be0"),
    ("tone4", "#8a6d00", "#dcc04c"),
    ("tone5", "#4d5560", "#aab4c0"),
    ("ink", "#1b2026", "#e6e9ed"),
    ("soft", "#59626d", "#a3adb8"),
    ("hair", "#dfe3e8", "#333b44"),
    ("shade", "#eceff3", "#2a3139"),
    ("paper", "#ffffff", "#171b20"),
    ("heat-none", "#f1f1ee", "#3a4048"),
    ("heat-p1", "#fbd9b5", "#6e5038"),
    ("heat-p2", "#f0a35e", "#a5683a"),
    ("heat-p3", "#c9601b", "#dd8b47"),
    ("heat-p4", "#7f3404", "#ffbe85"),
    ("heat-n1", "#cfe0f1", "#38506b"),
    ("heat-n2", "#8db7de", "#4078ad"),
    ("heat-n3", "#3b7fbd", "#66a9e6"),
    ("heat-n4", "#0d4374", "#b4d8fa"),
];

/// Dash of each tone; the first is a solid line.
const DASHES: [&str; TONES] = ["none", "9 3", "3 2.5", "11 3 2 3", "6 2 2 2 2 2", "1.5 3"];

/// Rules of every plot, colours by name.
const RULES: &str = include_str!("plot.css");

fn tone_rules() -> String {
    DASHES
        .iter()
        .enumerate()
        .map(|(k, dash)| {
            format!(
                ".t{k} .line{{stroke:var(--tone{k});stroke-dasharray:{dash}}}\
                 .t{k} .marks,.t{k} .dots{{stroke:var(--tone{k})}}\
                 .t{k} .band,.t{k} .columns{{fill:var(--tone{k})}}\n"
            )
        })
        .collect()
}

/// The style sheet of a page: colours as variables, dark where the reader's screen is dark.
pub(crate) fn page_style() -> String {
    let variables = |pick: fn(&(&str, &str, &str)) -> String| -> String {
        COLOURS.iter().map(pick).collect::<Vec<_>>().join(";")
    };
    let light = variables(|(name, light, _)| format!("--{name}:{light}"));
    let dark = variables(|(name, _, dark)| format!("--{name}:{dark}"));
    format!(
        ":root{{{light}}}\n@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n{RULES}{}",
        tone_rules()
    )
}

/// The style sheet of a file of its own: light colours put in place of the variables, because
/// not every program that shows SVG knows variables.
pub(super) fn fixed_style() -> String {
    let rules = format!("{RULES}{}", tone_rules());
    COLOURS.iter().fold(rules, |text, (name, light, _)| {
        text.replace(&format!("var(--{name})"), light)
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_colour_used_is_defined() {
        assert!(!super::fixed_style().contains("var("));
    }
}
