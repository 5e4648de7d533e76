//! The file that a token is kept in: its first line.

use std::path::{Path, PathBuf};

/// Why a file gives no token.
#[derive(Debug, thiserror::Error)]
pub enum TokenFileError {
    /// The file cannot be read.
    #[error("cannot read the token file {path}")]
    Read {
        /// Path of the token file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The first line of the file is empty.
    #[error("the token file {path} is empty")]
    Empty {
        /// Path of the token file.
        path: PathBuf,
    },
}

/// The first line of a file, without blanks around it.
///
/// # Errors
/// [`TokenFileError`].
pub fn read_token(path: &Path) -> Result<String, TokenFileError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| TokenFileError::Read { path: path.to_owned(), source })?;
    let token = text.lines().next().unwrap_or("").trim();
    match token.is_empty() {
        true => Err(TokenFileError::Empty { path: path.to_owned() }),
        false => Ok(token.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn token_is_the_first_line_and_must_not_be_empty() {
        let path = std::env::temp_dir().join(format!("softgrasp-token-{}", std::process::id()));
        std::fs::write(&path, " open sesame \nsecond line\n").unwrap();
        assert_eq!(read_token(&path).unwrap(), "open sesame");
        std::fs::write(&path, "\nsecond line\n").unwrap();
        assert!(matches!(read_token(&path), Err(TokenFileError::Empty { .. })));
        std::fs::remove_file(&path).unwrap();
        assert!(matches!(read_token(&path), Err(TokenFileError::Read { .. })));
    }
}
