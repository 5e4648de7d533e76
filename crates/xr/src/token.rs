//! Token in the page's address; requests without it are refused.

use std::fmt::Write;

/// A random token of 128 bits, as 32 hexadecimal digits.
#[derive(Clone)]
pub struct Token(String);

/// The operating system gives no random numbers.
#[derive(Debug, thiserror::Error)]
#[error("the system gives no random numbers for the page's token: {0}")]
pub struct NoRandomNumbers(getrandom::Error);

impl Token {
    /// New random token.
    ///
    /// # Errors
    /// [`NoRandomNumbers`] if the operating system gives none.
    pub fn random() -> Result<Self, NoRandomNumbers> {
        let mut bytes = [0_u8; 16];
        getrandom::fill(&mut bytes).map_err(NoRandomNumbers)?;
        let mut text = String::new();
        for byte in bytes {
            // Writing to a text cannot fail.
            let _ = write!(text, "{byte:02x}");
        }
        Ok(Self(text))
    }

    /// The token as it stands in the address.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether a text equals the token; compared in a time that does not depend on the content.
    pub fn is(&self, text: &str) -> bool {
        let (own, other) = (self.0.as_bytes(), text.as_bytes());
        let differ = own.iter().zip(other).fold(0, |all, (a, b)| all | (a ^ b));
        own.len() == other.len() && differ == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn token_is_itself_and_nothing_near_it() {
        let token = Token::random().unwrap();
        let text = token.as_str().to_owned();
        assert!(text.len() == 32 && token.is(&text));
        let other = format!("{}x", &text[..31]);
        for wrong in ["", &text[..31], &other, &format!("{text}0")] {
            assert!(!token.is(wrong), "{wrong}");
        }
        assert!(!Token::random().unwrap().is(&text));
    }
}
