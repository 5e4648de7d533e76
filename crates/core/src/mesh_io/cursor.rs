//! A position in a file from which words, lines and bytes are read; errors name the place.

use nalgebra::Point3;

use super::error::{Fault, MeshFileError, Place};
use super::number::{parse_integer, parse_real};

/// Position in the bytes of one file.
///
/// Nothing is copied and no line is counted while reading: the line number of an error is counted
/// from the start of the file when the error is made.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    name: &'a str,
    bytes: &'a [u8],
    position: usize,
    /// From this byte to the end of its line is a comment.
    comment: Option<u8>,
    /// Whether errors name byte offsets instead of lines.
    binary: bool,
}

impl<'a> Cursor<'a> {
    /// Start of a file; `name` is for errors only.
    pub(super) fn new(name: &'a str, bytes: &'a [u8]) -> Self {
        Self { name, bytes, position: 0, comment: None, binary: false }
    }

    /// A cursor for a text in which `mark` starts a comment that ends with the line.
    pub(super) fn with_comments(name: &'a str, bytes: &'a [u8], mark: u8) -> Self {
        Self { comment: Some(mark), ..Self::new(name, bytes) }
    }

    /// Lets errors name byte offsets (`true`) or lines (`false`) from here on.
    pub(super) fn set_binary(&mut self, binary: bool) {
        self.binary = binary;
    }

    /// Bytes not read yet.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.position..).unwrap_or_default()
    }

    /// Where the cursor stands.
    pub(super) fn place(&self) -> Place {
        if self.binary { Place::Byte(self.position) } else { Place::Line(self.line_number()) }
    }

    fn line_number(&self) -> usize {
        let before = self.bytes.get(..self.position).unwrap_or_default();
        1 + before.iter().filter(|&&b| b == b'\n').count()
    }

    /// A cursor at this position whose file ends after `length` more bytes.
    pub(super) fn limited(&self, length: usize) -> Self {
        let end = self.position.saturating_add(length);
        Self { bytes: self.bytes.get(..end).unwrap_or(self.bytes), ..self.clone() }
    }

    /// Moves past white space and comments.
    pub(super) fn skip_space(&mut self) {
        while let Some(&byte) = self.bytes.get(self.position) {
            if is_space(byte) {
                self.position += 1;
            } else if self.comment == Some(byte) {
                self.position += length_of_line(self.rest());
            } else {
                break;
            }
        }
    }

    /// The next word, up to white space; `None` at the end of the file.
    pub(super) fn token(&mut self) -> Option<&'a [u8]> {
        self.skip_space();
        let rest = self.rest();
        let length = rest.iter().position(|&b| is_space(b)).unwrap_or(rest.len());
        self.position += length;
        rest.get(..length).filter(|token| !token.is_empty())
    }

    /// The next word, which stays unread.
    pub(super) fn peek(&self) -> Option<&'a [u8]> {
        self.clone().token()
    }

    /// The next word, which must be an integer.
    pub(super) fn integer(&mut self, what: &str) -> Result<i64, MeshFileError> {
        self.value(what, parse_integer)
    }

    /// The next word, which must be an integer from 0.
    pub(super) fn count(&mut self, what: &str) -> Result<usize, MeshFileError> {
        self.value(what, |token| parse_integer(token).and_then(|n| usize::try_from(n).ok()))
    }

    /// The next word, which must be a finite number.
    pub(super) fn real(&mut self, what: &str) -> Result<f64, MeshFileError> {
        self.value(what, parse_real)
    }

    /// The next three words, which must be the coordinates of a point.
    pub(super) fn point(&mut self) -> Result<Point3<f64>, MeshFileError> {
        let x = self.real("a coordinate")?;
        let y = self.real("a coordinate")?;
        let z = self.real("a coordinate")?;
        Ok(Point3::new(x, y, z))
    }

    /// All words of the next so many bytes, each read by `next`.
    pub(super) fn words<T>(
        &self,
        length: usize,
        next: impl Fn(&mut Self) -> Result<T, MeshFileError>,
    ) -> Result<Vec<T>, MeshFileError> {
        let mut cursor = self.limited(length);
        let mut values = Vec::new();
        cursor.skip_space();
        while !cursor.rest().is_empty() {
            values.push(next(&mut cursor)?);
            cursor.skip_space();
        }
        Ok(values)
    }

    fn value<T>(
        &mut self,
        what: &str,
        parse: impl Fn(&[u8]) -> Option<T>,
    ) -> Result<T, MeshFileError> {
        self.skip_space();
        let start = self.position;
        if let Some(value) = self.token().and_then(parse) {
            return Ok(value);
        }
        self.position = start;
        Err(self.expected(what))
    }

    /// Moves past `word`, which must come next.
    pub(super) fn word(&mut self, word: &str) -> Result<(), MeshFileError> {
        self.skip_space();
        if self.rest().starts_with(word.as_bytes()) {
            self.position += word.len();
            return Ok(());
        }
        Err(self.expected(word))
    }

    /// The next line that holds something, without comment and surrounding white space.
    ///
    /// A carriage return ends a line as well.
    pub(super) fn line(&mut self) -> Option<&'a [u8]> {
        self.skip_space();
        let line = self.rest_of_line();
        (!line.is_empty()).then_some(line)
    }

    /// The rest of the current line, without comment and surrounding white space.
    ///
    /// The cursor stays before the line's end, so that errors about the line name it.
    pub(super) fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = self.rest();
        let line = rest.get(..length_of_line(rest)).unwrap_or_default();
        self.position += line.len();
        let content = match self.comment.and_then(|mark| line.iter().position(|&b| b == mark)) {
            Some(end) => line.get(..end).unwrap_or_default(),
            None => line,
        };
        content.trim_ascii()
    }

    /// Moves past the end of the current line, of which nothing but white space may be left.
    ///
    /// Binary data starts right after the newline and may begin with any byte.
    pub(super) fn end_of_line(&mut self) -> Result<(), MeshFileError> {
        let rest = self.rest();
        let newline = rest.iter().position(|&b| b == b'\n' || !is_space(b));
        match newline.and_then(|at| rest.get(at).map(|&byte| (at, byte))) {
            Some((at, b'\n')) => {
                self.position += at + 1;
                Ok(())
            }
            _ => Err(self.expected("the end of the line")),
        }
    }

    /// The next `length` bytes.
    pub(super) fn take(&mut self, length: usize, what: &str) -> Result<&'a [u8], MeshFileError> {
        let rest = self.rest();
        match rest.get(..length) {
            Some(bytes) => {
                self.position += length;
                Ok(bytes)
            }
            None => Err(self.count_fault(
                what,
                &format!("{length} bytes"),
                &format!("{} bytes to the end of the file", rest.len()),
            )),
        }
    }

    /// The next `N` bytes.
    pub(super) fn take_array<const N: usize>(
        &mut self,
        what: &str,
    ) -> Result<[u8; N], MeshFileError> {
        match self.rest().first_chunk::<N>() {
            Some(&bytes) => {
                self.position += N;
                Ok(bytes)
            }
            None => Err(self.fault(Fault::Syntax {
                at: self.place(),
                expected: what.to_owned(),
                found: format!("{} bytes to the end of the file", self.rest().len()),
            })),
        }
    }

    /// Moves past the first occurrence of `needle`; false (and no move) when there is none.
    pub(super) fn skip_past(&mut self, needle: &[u8]) -> bool {
        match find(self.rest(), needle) {
            Some(at) => {
                self.position += at + needle.len();
                true
            }
            None => false,
        }
    }

    /// Checks an announced count against the bytes that are left, before anything is allocated.
    ///
    /// `least_bytes` is the smallest number of bytes one item can take.
    pub(super) fn check_count(
        &self,
        count: usize,
        least_bytes: usize,
        array: &str,
    ) -> Result<(), MeshFileError> {
        let left = self.rest().len();
        // The last value of a text needs no white space after it.
        if count.checked_mul(least_bytes).is_some_and(|bytes| bytes <= left.saturating_add(1)) {
            return Ok(());
        }
        Err(self.count_fault(
            array,
            &count.to_string(),
            &format!("{left} bytes to the end of the file"),
        ))
    }

    /// Error: `what` was expected where the cursor stands.
    pub(super) fn expected(&self, what: &str) -> MeshFileError {
        let mut here = self.clone();
        if !self.binary {
            here.skip_space();
        }
        let found = here.clone().token().map_or_else(|| "the end of the file".to_owned(), quote);
        here.fault(Fault::Syntax { at: here.place(), expected: what.to_owned(), found })
    }

    /// Error: `what` was expected, and the line or word just read is `found`.
    pub(super) fn expected_instead(&self, what: &str, found: &[u8]) -> MeshFileError {
        let found = quote(found);
        self.fault(Fault::Syntax { at: self.place(), expected: what.to_owned(), found })
    }

    /// Error: an array does not have the length it should have.
    pub(super) fn count_fault(&self, array: &str, expected: &str, found: &str) -> MeshFileError {
        self.fault(Fault::Count {
            at: self.place(),
            array: array.to_owned(),
            expected: expected.to_owned(),
            found: found.to_owned(),
        })
    }

    /// Error: a construct that is not read.
    pub(super) fn unsupported(&self, what: &str) -> MeshFileError {
        self.fault(Fault::Unsupported { at: self.place(), what: what.to_owned() })
    }

    /// Error about this file.
    pub(super) fn fault(&self, fault: Fault) -> MeshFileError {
        MeshFileError { file: self.name.to_owned(), fault }
    }
}

/// Whether a byte separates words.
pub(super) fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t'..=b'\r')
}

/// The words of one line, separated by white space or commas.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(|&b| is_space(b) || b == b',').filter(|word| !word.is_empty())
}

/// Offset of the first occurrence of `needle`.
pub(super) fn find(haystack: &[u8], needle: &[u8]) -> Option<usize> {
    let first = *needle.first()?;
    let mut from = 0;
    loop {
        from += haystack.get(from..)?.iter().position(|&b| b == first)?;
        if haystack.get(from..)?.starts_with(needle) {
            return Some(from);
        }
        from += 1;
    }
}

/// The first characters of something, in quotes, fit for one line.
pub(super) fn quote(bytes: &[u8]) -> String {
    let start = bytes.get(..40).unwrap_or(bytes);
    let dots = if start.len() < bytes.len() { "…" } else { "" };
    format!("\"{}{dots}\"", start.escape_ascii())
}

fn length_of_line(bytes: &[u8]) -> usize {
    bytes.iter().position(|&b| matches!(b, b'\n' | b'\r')).unwrap_or(bytes.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_comments_come_off_in_order() {
        let mut cursor = Cursor::with_comments("f", b" 1\t-2.5 # 3 4\r\n\n 5D1 #", b'#');
        assert_eq!(cursor.integer("n").unwrap(), 1);
        assert_eq!(cursor.real("x").unwrap(), -2.5);
        assert_eq!(cursor.real("x").unwrap(), 50.0);
        assert_eq!(cursor.token(), None);
    }

    #[test]
    fn errors_name_line_expectation_and_finding() {
        let mut cursor = Cursor::new("m.msh", b"1 2\n\n  x3 4");
        cursor.integer("n").unwrap();
        cursor.integer("n").unwrap();
        let error = cursor.count("a count").unwrap_err().to_string();
        assert_eq!(error, "m.msh: line 3: expected a count, found \"x3\"");
    }

    #[test]
    fn binary_data_starts_right_after_the_newline() {
        let mut cursor = Cursor::new("f", b"7 \r\n\n\x01");
        cursor.integer("n").unwrap();
        cursor.end_of_line().unwrap();
        assert_eq!(cursor.rest(), b"\n\x01");
        assert!(Cursor::new("f", b" x\n").end_of_line().is_err());
    }

    #[test]
    fn counts_beyond_the_file_are_refused_before_reading() {
        let cursor = Cursor::new("f", b"1 2 3");
        assert!(cursor.check_count(3, 2, "values").is_ok());
        let error = cursor.check_count(4_000_000_000, 2, "values").unwrap_err().to_string();
        assert!(error.contains("values: expected 4000000000, found 5 bytes"), "{error}");
        assert!(cursor.check_count(usize::MAX, 2, "values").is_err());
    }

    #[test]
    fn find_agrees_with_windows() {
        let text = b"aab$Enaab$EndX";
        for needle in [&b"$EndX"[..], b"aab", b"b$", b"zz"] {
            let known = text.windows(needle.len()).position(|w| w == needle);
            assert_eq!(find(text, needle), known);
        }
    }
}
