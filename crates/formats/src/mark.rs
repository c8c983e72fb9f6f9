//! The byte order mark that some editors put before UTF-8 text: it says nothing that a reader does not know (RFC 8259,
//! section 8.1, lets a reader pass over it).

/// The mark.
pub(crate) const BYTE_ORDER_MARK: char = '\u{feff}';

/// The text without the mark that it may begin with.
pub fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(text)
}
