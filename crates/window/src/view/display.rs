//! What of the scene is shown, and how richly.

use std::fmt;
use std::str::FromStr;

use super::shading::Shading;
use super::toggle::Toggle;

/// Level of the light: how much is computed for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Level {
    /// No shadows, no smoothed edges: for machines that draw with the processor.
    Plain,
    /// Shadows and smoothed edges.
    #[default]
    Fair,
    /// Softer and finer shadows, and shade in corners.
    Full,
}

/// The text is not the name of a level.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{got}' is not {what}; there are {known}")]
pub struct UnknownDisplay {
    got: String,
    what: &'static str,
    known: &'static str,
}

impl Level {
    /// All levels, the plainest first.
    pub const ALL: [Self; 3] = [Self::Plain, Self::Fair, Self::Full];
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Plain => "plain",
            Self::Fair => "fair",
            Self::Full => "full",
        })
    }
}

impl FromStr for Level {
    type Err = UnknownDisplay;

    fn from_str(text: &str) -> Result<Self, UnknownDisplay> {
        let found = Self::ALL.into_iter().find(|level| level.to_string() == text);
        found.ok_or_else(|| UnknownDisplay {
            got: text.to_owned(),
            what: "a level of drawing",
            known: "plain, fair and full",
        })
    }
}

/// Spheres of the sphere tree that are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spheres {
    /// No spheres are shown.
    #[default]
    Hidden,
    /// The spheres of a level (thesis Figure 4.13); level 0 is the one around everything.
    Level(usize),
    /// The spheres that the search for the index finger looks at (thesis Figure 4.21).
    Search,
}

/// What of the scene is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Level of the light.
    pub level: Level,
    /// Quantity that the colour of the object shows.
    pub shading: Shading,
    /// Whether the edges of the elements on the surface are shown.
    pub wireframe: bool,
    /// Whether the rest shape is shown as a ghost.
    pub ghost: bool,
    /// Whether the hand's skin is shown.
    pub skin: bool,
    /// Whether the colliders that the search uses are shown: cylinders, spheres and contact points.
    pub colliders: bool,
    /// Whether the node is marked that each fingertip holds.
    pub contacts: bool,
    /// Whether the force of each fingertip is shown as an arrow.
    pub forces: bool,
    /// Spheres of the sphere tree that are shown.
    pub spheres: Spheres,
}

impl Default for Display {
    fn default() -> Self {
        Self {
            level: Level::default(),
            shading: Shading::Plain,
            wireframe: false,
            ghost: false,
            skin: true,
            colliders: false,
            contacts: true,
            forces: true,
            spheres: Spheres::Hidden,
        }
    }
}

impl Display {
    /// Whether a part of the scene is shown.
    pub fn shows(&self, toggle: Toggle) -> bool {
        match toggle {
            Toggle::Wireframe => self.wireframe,
            Toggle::Ghost => self.ghost,
            Toggle::Skin => self.skin,
            Toggle::Colliders => self.colliders,
            Toggle::Contacts => self.contacts,
            Toggle::Forces => self.forces,
        }
    }

    /// Shows a part of the scene, or hides it where it is shown.
    pub fn toggle(&mut self, toggle: Toggle) {
        let shown = match toggle {
            Toggle::Wireframe => &mut self.wireframe,
            Toggle::Ghost => &mut self.ghost,
            Toggle::Skin => &mut self.skin,
            Toggle::Colliders => &mut self.colliders,
            Toggle::Contacts => &mut self.contacts,
            Toggle::Forces => &mut self.forces,
        };
        *shown = !*shown;
    }

    /// Shows the next level of a tree that has so many; after the last one the search, then no spheres.
    pub fn next_spheres(&mut self, levels: usize) {
        self.spheres = match self.spheres {
            Spheres::Hidden => Spheres::Level(0),
            Spheres::Level(level) if level + 1 < levels => Spheres::Level(level + 1),
            Spheres::Level(_) => Spheres::Search,
            Spheres::Search => Spheres::Hidden,
        };
    }

    /// Shows the level of a tree that has so many before the one that is shown, the other way round
    /// than [`Display::next_spheres`].
    pub fn last_spheres(&mut self, levels: usize) {
        self.spheres = match self.spheres {
            Spheres::Hidden => Spheres::Search,
            Spheres::Search => Spheres::Level(levels.saturating_sub(1)),
            Spheres::Level(0) => Spheres::Hidden,
            Spheres::Level(level) => Spheres::Level(level - 1),
        };
    }

    /// Shows the next quantity in colours.
    pub fn next_shading(&mut self) {
        let all = Shading::ALL;
        let now = all.iter().position(|shading| *shading == self.shading).unwrap_or(0);
        self.shading = all[(now + 1) % all.len()];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_of_the_tree_are_shown_one_after_the_other_then_the_search_then_none() {
        let mut display = Display::default();
        let mut shown = Vec::new();
        for _ in 0..4 {
            display.next_spheres(2);
            shown.push(display.spheres);
        }
        use Spheres::{Hidden, Level, Search};
        assert_eq!(shown, [Level(0), Level(1), Search, Hidden]);
        for before in [Search, Level(1), Level(0), Hidden] {
            display.last_spheres(2);
            assert_eq!(display.spheres, before, "there is a way back");
        }
    }

    #[test]
    fn every_part_of_the_scene_is_toggled_and_nothing_else() {
        for toggle in Toggle::ALL {
            let mut display = Display::default();
            display.toggle(toggle);
            assert_ne!(display.shows(toggle), Display::default().shows(toggle));
            display.toggle(toggle);
            assert_eq!(display, Display::default());
        }
        let mut display = Display::default();
        (0..Shading::ALL.len()).for_each(|_| display.next_shading());
        assert_eq!(display, Display::default());
    }

    #[test]
    fn levels_are_read_as_they_are_written() {
        for level in Level::ALL {
            assert_eq!(level.to_string().parse(), Ok(level));
        }
        assert!("ultra".parse::<Level>().unwrap_err().to_string().contains("plain, fair and full"));
    }
}
