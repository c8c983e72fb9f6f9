//! As much of Rust as the rules need: code without comments and literals, its tokens, the paths it
//! names and the extent of its functions.
//!
//! It reads what rustfmt and the compiler accept; on anything else it may be wrong, but does not stop.

/// A word or a single sign of the code, and its line.
#[derive(Clone)]
pub(crate) struct Token {
    pub(crate) text: String,
    pub(crate) line: usize,
}

impl Token {
    pub(crate) fn is(&self, text: &str) -> bool {
        self.text == text
    }

    fn is_word(&self) -> bool {
        self.text.starts_with(is_word_character)
    }
}

fn is_word_character(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The source with comments, strings and characters blanked, line by line as long as before.
pub(crate) fn code_of(source: &str) -> String {
    let mut code = String::with_capacity(source.len());
    let mut rest = source;
    let mut previous = ' ';
    while let Some(first) = rest.chars().next() {
        let blanked = match is_word_character(previous) {
            // The end of a word such as `for` is no prefix of a literal.
            true if !rest.starts_with(['"', '/']) => 0,
            _ => comment_or_literal(rest),
        };
        let taken = if blanked == 0 {
            first.len_utf8()
        } else {
            blanked
        };
        if blanked == 0 {
            code.push(first);
        } else {
            code.extend(
                rest[..blanked]
                    .chars()
                    .map(|c| if c == '\n' { c } else { ' ' }),
            );
        }
        previous = if blanked == 0 { first } else { ' ' };
        rest = &rest[taken..];
    }
    code
}

/// The length in bytes of the comment or literal that the text begins with, else 0.
fn comment_or_literal(text: &str) -> usize {
    if text.starts_with("//") {
        return text.find('\n').unwrap_or(text.len());
    }
    if text.starts_with("/*") {
        return block_comment(text);
    }
    let prefix = text.len() - text.trim_start_matches(['b', 'c', 'r']).len();
    let hashes = text[prefix..].len() - text[prefix..].trim_start_matches('#').len();
    let quote = prefix + hashes;
    if prefix <= 2 && text[quote..].starts_with('"') && text[..prefix].contains('r') {
        let end = format!("\"{}", "#".repeat(hashes));
        let body = &text[quote + 1..];
        return body
            .find(&end)
            .map_or(text.len(), |at| quote + 1 + at + end.len());
    }
    if prefix <= 1 && hashes == 0 && text[prefix..].starts_with(['"', '\'']) {
        return prefix + quoted(&text[prefix..]);
    }
    0
}

/// Block comments nest.
fn block_comment(text: &str) -> usize {
    let mut open = 0;
    let mut at = 0;
    while at < text.len() {
        if text[at..].starts_with("/*") {
            open += 1;
            at += 2;
        } else if text[at..].starts_with("*/") {
            open -= 1;
            at += 2;
        } else {
            at += text[at..].chars().next().map_or(1, char::len_utf8);
        }
        if open == 0 {
            return at;
        }
    }
    text.len()
}

/// The length of a string or character in quotes; 0 for a lifetime.
fn quoted(text: &str) -> usize {
    let mut characters = text.char_indices();
    let quote = characters.next().map_or('"', |(_, quote)| quote);
    let is_lifetime = quote == '\''
        && !text[1..].starts_with('\\')
        && text.chars().nth(2).is_none_or(|third| third != '\'');
    if is_lifetime {
        return 0;
    }
    while let Some((at, c)) = characters.next() {
        if c == '\\' {
            characters.next();
        } else if c == quote {
            return at + 1;
        }
    }
    text.len()
}

/// Words, `::`, and every other sign by itself.
pub(crate) fn tokens(code: &str) -> Vec<Token> {
    let mut tokens = Vec::new();
    for (line, mut rest) in (1..).zip(code.lines()) {
        while let Some(first) = rest.chars().next() {
            let length = if is_word_character(first) {
                rest.find(|c| !is_word_character(c)).unwrap_or(rest.len())
            } else if rest.starts_with("::") {
                2
            } else {
                first.len_utf8()
            };
            if !first.is_whitespace() {
                tokens.push(Token {
                    text: rest[..length].to_owned(),
                    line,
                });
            }
            rest = &rest[length..];
        }
    }
    tokens
}

/// Every function with a body: name, first line, last line.
pub(crate) fn functions(tokens: &[Token]) -> Vec<(String, usize, usize)> {
    let mut functions = Vec::new();
    for (at, pair) in tokens.windows(2).enumerate() {
        if !pair[0].is("fn") || !pair[1].is_word() {
            continue;
        }
        let mut braces = 0;
        let mut brackets = 0;
        for token in &tokens[at..] {
            match token.text.as_str() {
                "(" | "[" => brackets += 1,
                ")" | "]" => brackets -= 1,
                "{" => braces += 1,
                "}" => braces -= 1,
                _ => {}
            }
            if token.is(";") && braces == 0 && brackets == 0 {
                break;
            }
            if token.is("}") && braces == 0 {
                functions.push((pair[1].text.clone(), pair[0].line, token.line));
                break;
            }
        }
    }
    functions
}

/// Every path the code names, in `use` or elsewhere, with its line; trees of `use` are spelt out.
pub(crate) fn paths(tokens: &[Token]) -> Vec<(usize, Vec<String>)> {
    let mut paths = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        at = if tokens[at].is_word() {
            path(tokens, at, &[], &mut paths)
        } else {
            at + 1
        };
    }
    paths
}

/// Reads the path that begins at a word; returns where it ends.
fn path(
    tokens: &[Token],
    start: usize,
    parents: &[String],
    paths: &mut Vec<(usize, Vec<String>)>,
) -> usize {
    let mut segments = parents.to_vec();
    let mut at = start;
    segments.push(tokens[at].text.clone());
    while tokens.get(at + 1).is_some_and(|token| token.is("::")) {
        let Some(next) = tokens.get(at + 2) else {
            break;
        };
        if next.is("{") {
            return tree(tokens, at + 3, &segments, paths);
        }
        if !next.is_word() {
            break;
        }
        segments.push(next.text.clone());
        at += 2;
    }
    paths.push((tokens[start].line, segments));
    at + 1
}

/// Reads the branches of a tree of `use` after its brace; returns where it ends.
fn tree(
    tokens: &[Token],
    start: usize,
    parents: &[String],
    paths: &mut Vec<(usize, Vec<String>)>,
) -> usize {
    let mut at = start;
    while at < tokens.len() && !tokens[at].is("}") {
        at = if tokens[at].is_word() {
            path(tokens, at, parents, paths)
        } else {
            at + 1
        };
    }
    at + 1
}

/// The calls of the named macros: line and name.
pub(crate) fn macros_called(
    tokens: &[Token],
    names: &[&'static str],
) -> Vec<(usize, &'static str)> {
    let calls = tokens.windows(2).filter(|pair| pair[1].is("!"));
    let named = |pair: &[Token]| {
        let name = names.iter().find(|name| pair[0].is(name))?;
        Some((pair[0].line, *name))
    };
    calls.filter_map(named).collect()
}
