//! How wide words are, without a font at hand: cut and broken to fit.

/// About how wide words are, in pixels: fonts differ, so this is on the safe side.
pub(super) fn width_of(words: &str, letter_px: f64) -> f64 {
    let in_letters: f64 = words
        .chars()
        .map(|letter| match letter {
            'i' | 'l' | 'j' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' => 0.29,
            ' ' | 't' | 'f' | 'r' | '(' | ')' | '-' | '/' => 0.36,
            'm' | 'w' | 'M' | 'W' | '%' | '@' => 0.88,
            '0'..='9' | 'a'..='z' => 0.57,
            'A'..='Z' => 0.7,
            letter if letter.is_ascii() => 0.62,
            'À'..='ʯ' | '°' | '·' | '–' | '…' => 0.62,
            _ => 1.0,
        })
        .sum();
    in_letters * letter_px
}

/// Words cut to a width, with an ellipsis where anything was cut.
pub(super) fn shortened(words: &str, letter_px: f64, room_px: f64) -> String {
    if width_of(words, letter_px) <= room_px {
        return words.to_owned();
    }
    let mut kept = String::new();
    for letter in words.chars() {
        kept.push(letter);
        if width_of(&kept, letter_px) + letter_px > room_px {
            break;
        }
    }
    kept.pop();
    kept.truncate(kept.trim_end().len());
    kept.push('…');
    kept
}

/// Words broken into lines of a width; nothing is left out.
pub(super) fn wrapped(words: &str, letter_px: f64, width_px: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words.split_whitespace() {
        match lines.last_mut() {
            Some(line)
                if width_of(line, letter_px) + width_of(word, letter_px) + letter_px
                    <= width_px =>
            {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
