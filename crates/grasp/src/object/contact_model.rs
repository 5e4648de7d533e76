//! What a fingertip does to the surface: it holds the node it touched, all that it covers or the average
//! of those, or it presses with friction.

use std::fmt;
use std::str::FromStr;

/// Contact model: which part of the surface a fingertip holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactModel {
    /// The single node that the fingertip touched, as in the thesis. Its force goes to zero as the mesh
    /// is refined.
    Vertex,
    /// Every surface node within the fingertip's radius of the node that it touched.
    Patch,
    /// The mean of the surface under the fingertip, weighted by its pressure, with one force. Its
    /// force converges as the mesh is refined, and its ticks cost the server what those of a vertex do
    /// (`reports/contact.md`).
    #[default]
    Mask,
    /// Nothing is held: every segment of the hand presses on the surface with friction, and the object
    /// has weight (`docs/contact.md`).
    Friction,
}

/// The text is not the name of a contact model.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no contact model is called '{0}'; there are vertex, patch, mask and friction")]
pub struct UnknownContact(String);

impl FromStr for ContactModel {
    type Err = UnknownContact;

    fn from_str(name: &str) -> Result<Self, UnknownContact> {
        match name {
            "vertex" => Ok(Self::Vertex),
            "patch" => Ok(Self::Patch),
            "mask" => Ok(Self::Mask),
            "friction" => Ok(Self::Friction),
            _ => Err(UnknownContact(name.to_owned())),
        }
    }
}

impl fmt::Display for ContactModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Vertex => "vertex",
            Self::Patch => "patch",
            Self::Mask => "mask",
            Self::Friction => "friction",
        })
    }
}
