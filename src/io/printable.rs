//! Text from outside made fit for a terminal.
//!
//! A name in a file may hold escape sequences that clear the screen or set its title, and marks that
//! turn the direction of writing, so that what is read is not what is there. They are shown as signs.

use std::borrow::Cow;

/// Whether a character commands a terminal, or cannot be seen and changes how others are shown.
fn is_hidden(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{61C}' | '\u{180E}' | '\u{200B}'..='\u{200F}' | '\u{2028}'..='\u{202E}'
            | '\u{2060}'..='\u{206F}' | '\u{FEFF}' | '\u{FFF9}'..='\u{FFFB}'
            | '\u{E0000}'..='\u{E007F}')
}

/// The sign that stands for a hidden character: `␛` for ESC, `�` where Unicode has none.
fn sign(c: char) -> char {
    match u32::from(c) {
        code @ 0..=0x1F => char::from_u32(0x2400 + code).unwrap_or('\u{FFFD}'),
        0x7F => '\u{2421}',
        _ => '\u{FFFD}',
    }
}

fn shown(text: &str, hidden: impl Fn(char) -> bool) -> Cow<'_, str> {
    if text.chars().any(&hidden) {
        let signs = text.chars().map(|c| if hidden(c) { sign(c) } else { c });
        Cow::Owned(signs.collect())
    } else {
        Cow::Borrowed(text)
    }
}

/// A single line: every hidden character is one sign.
pub fn line(text: &str) -> Cow<'_, str> {
    shown(text, is_hidden)
}

/// One line of a file: as [`line()`], tabs kept.
pub fn source_line(text: &str) -> Cow<'_, str> {
    shown(text, |c| c != '\t' && is_hidden(c))
}

/// Several lines: as [`line()`], line ends and tabs kept.
pub fn lines(text: &str) -> Cow<'_, str> {
    shown(text, |c| !matches!(c, '\n' | '\t') && is_hidden(c))
}

/// JSON: hidden characters, which can stand in its strings alone, as their escapes.
pub fn json(text: &str) -> Cow<'_, str> {
    let hidden = |c: char| c != '\n' && is_hidden(c);
    if !text.chars().any(hidden) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if hidden(c) {
            for unit in c.encode_utf16(&mut [0; 2]) {
                out += &format!("\\u{unit:04x}");
            }
        } else {
            out.push(c);
        }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_hidden_is_left_and_nothing_seen_is_lost() {
        let hostile = "a\u{1b}[31m\u{9b}2J\u{202e}b\u{7f}\u{0}µ …\n\tc";
        assert_eq!(line(hostile), "a␛[31m\u{fffd}2J\u{fffd}b␡␀µ …␊␉c");
        assert_eq!(source_line(hostile), "a␛[31m\u{fffd}2J\u{fffd}b␡␀µ …␊\tc");
        assert_eq!(lines(hostile), "a␛[31m\u{fffd}2J\u{fffd}b␡␀µ …\n\tc");
        assert!(matches!(lines("α ± 1 µm\n"), Cow::Borrowed(_)));
    }

    #[test]
    fn json_says_the_same_without_hidden_characters() {
        let hostile = "\u{9b}2J\u{202e}\u{e0041}\u{7f}é";
        let text = serde_json::to_string_pretty(&[hostile]).unwrap();
        let safe = json(&text);
        assert!(safe.chars().all(|c| c == '\n' || !is_hidden(c)), "{safe}");
        let back: Vec<String> = serde_json::from_str(&safe).unwrap();
        assert_eq!(back, [hostile]);
    }
}
