//! Names of solution methods and elements on the wire.

use std::fmt;
use std::str::FromStr;

use serde::{Serialize, Serializer};
use wincode::{SchemaRead, SchemaWrite};

/// Name of a solution method: 1 to 32 characters of `a-z 0-9 - _`.
///
/// A text and not a number, so that a server may learn methods without a new protocol version; a
/// name it does not know is answered with `RejectCode::UnknownMethod`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MethodName(String);

/// A text that cannot be a method's name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name:?} cannot be a method's name (1 to 32 of a-z, 0-9, - and _)")]
pub struct MethodNameError {
    /// The text that is no name of a method.
    pub name: String,
}

impl MethodName {
    /// Name of a method, if the text may be one.
    ///
    /// # Errors
    /// [`MethodNameError`] for an empty or long text or one with other characters.
    pub fn try_new(name: impl Into<String>) -> Result<Self, MethodNameError> {
        let name = name.into();
        let known =
            |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit() || matches!(c, b'-' | b'_');
        if (1..=NAME_LEN_MAX).contains(&name.len()) && name.bytes().all(known) {
            Ok(Self(name))
        } else {
            Err(MethodNameError { name })
        }
    }

    /// The method `auto`, which leaves the choice to the server.
    pub fn auto() -> Self {
        Self("auto".to_owned())
    }

    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Default for MethodName {
    fn default() -> Self {
        Self::auto()
    }
}

impl fmt::Display for MethodName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&self.0)
    }
}

impl FromStr for MethodName {
    type Err = MethodNameError;

    fn from_str(name: &str) -> Result<Self, MethodNameError> {
        Self::try_new(name)
    }
}

/// Kind of finite element.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum ElementName {
    /// Linear tetrahedron, four nodes (thesis Table 3.1, list 2).
    #[default]
    T4,
    /// Quadratic tetrahedron, ten nodes; its mid-edge nodes are made by the server.
    T10,
    /// Linear tetrahedron whose pressure is averaged around each node.
    T4Anp,
}

impl ElementName {
    /// Name of the element in commands and reports.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::T4 => "t4",
            Self::T10 => "t10",
            Self::T4Anp => "t4-anp",
        }
    }
}

/// Element that a report names by its number: a server may use one that this version does not know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub struct ElementUsed(u32);

/// Element wanted for one request with its own mesh; the answer tells which one was used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, SchemaRead, SchemaWrite)]
pub enum ElementChoice {
    /// Linear tetrahedron, [`ElementName::T4`].
    #[default]
    T4,
    /// Quadratic tetrahedron, [`ElementName::T10`].
    T10,
    /// Linear tetrahedron with averaged pressure, [`ElementName::T4Anp`].
    T4Anp,
    /// The server chooses by material, deadline and memory.
    Auto,
}

impl ElementUsed {
    /// The element, if this version knows it.
    pub fn name(self) -> Option<ElementName> {
        [ElementName::T4, ElementName::T10, ElementName::T4Anp]
            .into_iter()
            .find(|name| Self::from(*name) == self)
    }
}

impl From<ElementName> for ElementUsed {
    fn from(name: ElementName) -> Self {
        Self(name as u32)
    }
}

impl PartialEq<ElementName> for ElementUsed {
    fn eq(&self, name: &ElementName) -> bool {
        *self == Self::from(*name)
    }
}

impl fmt::Display for ElementUsed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => name.fmt(f),
            None => write!(f, "element {}", self.0),
        }
    }
}

impl Serialize for ElementUsed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl From<ElementName> for ElementChoice {
    fn from(name: ElementName) -> Self {
        match name {
            ElementName::T4 => Self::T4,
            ElementName::T10 => Self::T10,
            ElementName::T4Anp => Self::T4Anp,
        }
    }
}

/// A text that names no element.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no element is called {name:?}; there are t4, t4-anp, t10 and auto")]
pub struct ElementChoiceError {
    /// The text that is no name of an element.
    pub name: String,
}

impl FromStr for ElementChoice {
    type Err = ElementChoiceError;

    fn from_str(name: &str) -> Result<Self, ElementChoiceError> {
        match name {
            "t4" => Ok(Self::T4),
            "t10" => Ok(Self::T10),
            "t4-anp" => Ok(Self::T4Anp),
            "auto" => Ok(Self::Auto),
            _ => Err(ElementChoiceError { name: name.to_owned() }),
        }
    }
}

impl fmt::Display for ElementName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

const NAME_LEN_MAX: usize = 32;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chosen_elements_travel_like_the_elements_they_name() {
        for name in [ElementName::T4, ElementName::T10, ElementName::T4Anp] {
            let choice: ElementChoice = name.as_str().parse().unwrap();
            assert_eq!(choice, name.into());
            assert_eq!(wincode::serialize(&choice).unwrap(), wincode::serialize(&name).unwrap());
            let used = ElementUsed::from(name);
            assert_eq!(wincode::serialize(&used).unwrap(), wincode::serialize(&name).unwrap());
            assert_eq!((used.name(), used.to_string()), (Some(name), name.to_string()));
        }
        assert_eq!((ElementUsed(7).name(), ElementUsed(7).to_string()), (None, "element 7".into()));
        assert_eq!("auto".parse(), Ok(ElementChoice::Auto));
        assert!("T4".parse::<ElementChoice>().unwrap_err().to_string().contains("t10 and auto"));
    }

    #[test]
    fn method_names_are_short_lower_case_words() {
        for good in ["auto", "gauss-jordan", "pcg_2", &"x".repeat(32)] {
            assert_eq!(good.parse::<MethodName>().unwrap().as_str(), good);
        }
        for bad in ["", "Sparse", "a b", "ä", "a\0", &"x".repeat(33)] {
            assert_eq!(MethodName::try_new(bad).unwrap_err().name, bad);
        }
    }
}
