//! Tags of a text of XML before it is read.
//!
//! The library compares each attribute with all others of its element, and each namespace with all
//! that hold there; a small file could keep it busy for hours. So elements have few of either.

use crate::zones::{ZoneCode, ZoneProblem};

/// The most attributes of an element.
const MAX_ATTRIBUTES: usize = 50;
/// The most namespaces that an element and those around it declare.
const MAX_NAMESPACES: usize = 30;
/// What is no tag: how it begins, and how it ends.
const NO_TAGS: [(&str, &str); 3] = [("<![CDATA[", "]]>"), ("<!--", "-->"), ("<?", "?>")];

/// Refuses a text with an element of many attributes, or within many namespaces.
pub(super) fn check_tags(text: &str) -> Result<(), ZoneProblem> {
    // How many namespaces hold within each element that is open.
    let mut around = vec![0];
    let mut rest = text;
    while let Some(begin) = rest.find('<') {
        rest = &rest[begin..];
        let no_tag = NO_TAGS.iter().find(|(begins, _)| rest.starts_with(begins));
        if let Some((begins, ends)) = no_tag {
            rest = &rest[begins.len()..];
            rest = rest.find(ends).map_or("", |end| &rest[end..]);
            continue;
        }
        let tag = Tag::of(rest);
        let outer = around.last().copied().unwrap_or_default();
        let namespaces = outer + tag.namespaces;
        if tag.attributes > MAX_ATTRIBUTES || namespaces > MAX_NAMESPACES {
            let line = 1 + text[..text.len() - rest.len()].matches('\n').count();
            let message = format!(
                "the element in line {line} has more than {MAX_ATTRIBUTES} attributes, or {MAX_NAMESPACES} namespaces"
            );
            let problem = ZoneProblem::new(ZoneCode::TextTooLong, String::new(), message);
            return Err(problem.hint("leave out those that KML does not have"));
        }
        let written = &rest[..tag.length];
        if written.starts_with("</") {
            around.pop();
        } else if !written.ends_with("/>") {
            around.push(namespaces);
        }
        rest = &rest[tag.length..];
    }
    Ok(())
}

/// A tag: how long it is in bytes, and what is in it.
struct Tag {
    length: usize,
    attributes: usize,
    namespaces: usize,
}

impl Tag {
    /// The tag that a text begins with.
    fn of(text: &str) -> Self {
        let mut tag = Self {
            length: text.len(),
            attributes: 0,
            namespaces: 0,
        };
        let mut quote = None;
        let mut unquoted_from = 0;
        for (place, byte) in text.bytes().enumerate() {
            match (quote, byte) {
                (None, b'>') => {
                    tag.length = place + 1;
                    break;
                }
                (None, b'"' | b'\'') => {
                    quote = Some(byte);
                    tag.attributes += 1;
                    let name = &text[unquoted_from..place];
                    tag.namespaces += usize::from(name.contains("xmlns"));
                }
                (Some(opened), _) if opened == byte => {
                    quote = None;
                    unquoted_from = place + 1;
                }
                _ => {}
            }
        }
        tag
    }
}
