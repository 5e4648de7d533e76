//! The file that a token is kept in: its first line.

use std::path::{Path, PathBuf};

/// Why a file gives no token.
#[derive(Debug, thiserror::Error)]
pub enum TokenFileError {
    /// It cannot be read.
    #[error("cannot read the token file {path}")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Its first line is empty.
    #[error("the token file {path} is empty")]
    Empty {
        /// The file.
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
