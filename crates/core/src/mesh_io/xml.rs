//! Reads the part of XML that VTU, FEBio and XDMF use: tags with attributes, and the text between them.

use super::cursor::{Cursor, find, is_space};
use super::error::MeshFileError;

/// One piece of an XML document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event<'a> {
    /// `<name attributes>`; `empty` for `<name attributes/>`.
    Open { name: &'a [u8], attributes: &'a [u8], empty: bool },
    /// `</name>`.
    Close { name: &'a [u8] },
    /// Bytes between tags that are not white space only.
    Text(&'a [u8]),
}

/// The next piece; comments, declarations and white space between tags are passed over.
///
/// # Errors
/// [`MeshFileError`] when a tag or comment does not end.
pub(super) fn next_event<'a>(cursor: &mut Cursor<'a>) -> Result<Option<Event<'a>>, MeshFileError> {
    loop {
        cursor.skip_space();
        let rest = cursor.rest();
        let Some(&first) = rest.first() else { return Ok(None) };
        if first != b'<' {
            let length = find(rest, b"<").unwrap_or(rest.len());
            return Ok(Some(Event::Text(cursor.take(length, "text")?)));
        }
        let passed = if rest.starts_with(b"<!--") {
            Some(cursor.skip_past(b"-->"))
        } else if rest.starts_with(b"<?") || rest.starts_with(b"<!") {
            Some(cursor.skip_past(b">"))
        } else {
            None
        };
        match passed {
            Some(true) => {}
            Some(false) => return Err(cursor.expected("the end of a comment or declaration")),
            None => return read_tag(cursor).map(Some),
        }
    }
}

fn read_tag<'a>(cursor: &mut Cursor<'a>) -> Result<Event<'a>, MeshFileError> {
    let rest = cursor.rest();
    let Some(end) = end_of_tag(rest) else {
        return Err(cursor.expected("the end of a tag"));
    };
    let tag = cursor.take(end + 1, "a tag")?.get(1..end).unwrap_or_default();
    if let Some(name) = tag.strip_prefix(b"/") {
        return Ok(Event::Close { name: name.trim_ascii() });
    }
    let (tag, empty) = match tag.strip_suffix(b"/") {
        Some(tag) => (tag, true),
        None => (tag, false),
    };
    let name_end = tag.iter().position(|&b| is_space(b)).unwrap_or(tag.len());
    let (name, attributes) = tag.split_at(name_end);
    Ok(Event::Open { name, attributes, empty })
}

/// Offset of the `>` that is not inside quotes.
fn end_of_tag(bytes: &[u8]) -> Option<usize> {
    let mut quote = None;
    bytes.iter().position(|&byte| {
        match quote {
            Some(open) if open == byte => quote = None,
            Some(_) => {}
            None if matches!(byte, b'"' | b'\'') => quote = Some(byte),
            None => return byte == b'>',
        }
        false
    })
}

/// Value of an attribute without the white space that some writers pad it with.
pub(super) fn attribute<'a>(attributes: &'a [u8], name: &str) -> Option<&'a [u8]> {
    let mut rest = attributes;
    loop {
        rest = rest.trim_ascii_start();
        let equals = rest.iter().position(|&b| b == b'=')?;
        let (key, after) = rest.split_at(equals);
        let after = after.get(1..)?.trim_ascii_start();
        let (&quote, after) = after.split_first().filter(|(q, _)| matches!(q, b'"' | b'\''))?;
        let end = after.iter().position(|&b| b == quote)?;
        if key.trim_ascii() == name.as_bytes() {
            return after.get(..end).map(<[u8]>::trim_ascii);
        }
        rest = after.get(end + 1..)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn events(text: &str) -> Vec<Event<'_>> {
        let mut cursor = Cursor::new("f", text.as_bytes());
        std::iter::from_fn(|| next_event(&mut cursor).unwrap()).collect()
    }

    #[test]
    fn tags_texts_and_attributes_come_in_order() {
        let found =
            events("<?xml version='1.0'?><!-- <a> --><A b=\"1 > 0\" c = ' 7  '>\n t <B/></A >");
        let [Event::Open { name: b"A", attributes, empty: false }, rest @ ..] = found.as_slice()
        else {
            panic!("{found:?}");
        };
        assert_eq!(attribute(attributes, "b"), Some(&b"1 > 0"[..]));
        assert_eq!(attribute(attributes, "c"), Some(&b"7"[..]));
        assert_eq!(attribute(attributes, "d"), None);
        let known = [
            Event::Text(b"t "),
            Event::Open { name: b"B", attributes: b"", empty: true },
            Event::Close { name: b"A" },
        ];
        assert_eq!(rest, known);
    }

    #[test]
    fn an_open_end_is_an_error() {
        for text in ["<A b=\"", "<!-- ", "<A", "<?xml"] {
            assert!(next_event(&mut Cursor::new("f", text.as_bytes())).is_err(), "{text}");
        }
    }
}
