//! Which hand acts, as it is chosen on the command line and in a menu.

use std::str::FromStr;

use crate::scripted::ScriptName;

/// Where the hand comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandChoice {
    /// Played by the program, as device bytes.
    Scripted(ScriptName),
    /// Driven by mouse and keyboard, in a window.
    Mouse,
}

impl FromStr for HandChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':').unwrap_or((text, "")) {
            ("scripted", "") => Ok(Self::Scripted(ScriptName::default())),
            ("scripted", name) => Ok(Self::Scripted(name.parse().map_err(|e| format!("{e}"))?)),
            ("mouse", "") => Ok(Self::Mouse),
            _ => {
                Err("there is scripted, scripted:NAME and mouse; gloves and recordings come later"
                    .into())
            }
        }
    }
}
