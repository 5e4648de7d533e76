//! The arguments of `glove-client run` that say what is seen: in the window and in pictures.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;

#[cfg(feature = "window")]
use softgrasp_window::view::camera::ViewCamera;
use softgrasp_window::view::display::{Display, Level, Spheres};
use softgrasp_window::view::moment::Moment;
use softgrasp_window::view::shading::Shading;

/// What is seen of a run.
#[derive(Args, Clone, Default)]
pub struct DisplayArguments {
    /// File for a picture of the scene (PNG), drawn without a window.
    #[arg(long, value_name = "F.png")]
    pub(super) snapshot: Option<PathBuf>,
    /// When the snapshot is taken: a tick; or a state (free, avoiding, attached, deforming,
    /// detached), whose last tick is meant, `deforming:2` at its second visit [default: the last
    /// tick].
    #[arg(long, value_name = "STATE|TICK", requires = "snapshot")]
    pub(super) at: Option<Moment>,
    /// Folder for a picture of every tick (PNG), drawn without a window.
    #[arg(long, value_name = "D")]
    pub(super) frames_dir: Option<PathBuf>,
    /// File for the run as a moving picture (GIF), drawn without a window.
    #[arg(long, value_name = "F.gif")]
    pub(super) animation: Option<PathBuf>,
    /// Width and height of pictures [default: 1280x800].
    #[arg(long, value_name = "WxH")]
    pub(super) picture_size: Option<PictureSize>,
    /// Trace the light of the snapshot, so many paths a pixel: softer and slower.
    #[arg(long, value_name = "N", requires = "snapshot",
          value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub(super) paths: Option<u32>,
    /// How much is spent on the light: plain, fair or full [default: fair; plain where the
    /// processor draws the window].
    #[arg(long, value_name = "LEVEL")]
    pub(super) light: Option<Level>,
    /// What the colours show: plain, displacement, strain, von-mises or error [default: plain].
    #[arg(long, value_name = "WHAT")]
    pub(super) shading: Option<Shading>,
    /// What is shown besides, separated by commas: elements, rest, colliders, contacts, forces,
    /// hand, spheres:LEVEL, search [default: hand,contacts,forces].
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(super) show: Option<Vec<ShowItem>>,
    /// The eye: turn to the right and height above the horizon in degrees, distance in m
    /// [default: -43,18,0.46].
    #[arg(long, value_name = "TURN,HEIGHT,DISTANCE", allow_hyphen_values = true)]
    pub(super) eye: Option<Eye>,
}

/// Width and height of a picture, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureSize {
    /// Number of pixels in a row.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

/// Something that pictures and window can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShowItem {
    /// Edges of the elements.
    Elements,
    /// Rest shape, transparent.
    Rest,
    /// Colliders that the search takes the hand for.
    Colliders,
    /// Points that the fingertips hold.
    Contacts,
    /// Forces of the fingertips.
    Forces,
    /// Skin of the hand.
    Hand,
    /// Spheres of the sphere tree.
    Spheres(Spheres),
}

/// Direction and distance of the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    turn_deg: f64,
    height_deg: f64,
    distance_m: f64,
}

/// Largest width and height of a picture, pixels: what graphics cards draw.
const PIXELS_MAX: u32 = 8192;

impl DisplayArguments {
    /// Whether pictures are wanted, which are drawn without a window.
    pub(super) fn wants_pictures(&self) -> bool {
        self.snapshot.is_some() || self.frames_dir.is_some() || self.animation.is_some()
    }

    /// Whether the wanted display needs the nodes inside the object: an animation without a chosen
    /// quantity shows strain.
    pub(super) fn needs_inside(&self) -> bool {
        self.display().shading.needs_inside()
            || (self.animation.is_some() && self.shading.is_none())
    }

    /// Items that are shown at first.
    pub(super) fn display(&self) -> Display {
        let mut display = Display {
            level: self.light.unwrap_or_default(),
            shading: self.shading.unwrap_or_default(),
            ..Display::default()
        };
        if let Some(items) = &self.show {
            (display.skin, display.contacts, display.forces) = (false, false, false);
            for item in items {
                match item {
                    ShowItem::Elements => display.wireframe = true,
                    ShowItem::Rest => display.ghost = true,
                    ShowItem::Colliders => display.colliders = true,
                    ShowItem::Contacts => display.contacts = true,
                    ShowItem::Forces => display.forces = true,
                    ShowItem::Hand => display.skin = true,
                    ShowItem::Spheres(spheres) => display.spheres = *spheres,
                }
            }
        }
        display
    }

    /// View at first.
    #[cfg(feature = "window")]
    pub(super) fn camera(&self) -> ViewCamera {
        let start = ViewCamera::default();
        self.eye.map_or(start, |eye| ViewCamera {
            yaw: eye.turn_deg.to_radians(),
            pitch: eye.height_deg.to_radians(),
            distance: eye.distance_m,
            ..start
        })
    }

    /// Size of pictures.
    #[cfg(feature = "window")]
    pub(super) fn size(&self) -> PictureSize {
        self.picture_size.unwrap_or(PictureSize { width: 1280, height: 800 })
    }
}

impl FromStr for PictureSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("'{text}' is not WIDTHxHEIGHT in pixels, each 1 to {PIXELS_MAX}");
        let (width, height) = text.split_once('x').ok_or_else(wrong)?;
        let side = |text: &str| {
            text.parse().ok().filter(|n| (1..=PIXELS_MAX).contains(n)).ok_or_else(wrong)
        };
        Ok(Self { width: side(width)?, height: side(height)? })
    }
}

impl FromStr for ShowItem {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text {
            "elements" => Self::Elements,
            "rest" => Self::Rest,
            "colliders" => Self::Colliders,
            "contacts" => Self::Contacts,
            "forces" => Self::Forces,
            "hand" => Self::Hand,
            "search" => Self::Spheres(Spheres::Search),
            _ => {
                let level = text.strip_prefix("spheres:").and_then(|level| level.parse().ok());
                let level = level.ok_or_else(|| {
                    format!(
                        "'{text}' cannot be shown; there are elements, rest, colliders, contacts, \
                         forces, hand, spheres:LEVEL and search"
                    )
                })?;
                Self::Spheres(Spheres::Level(level))
            }
        })
    }
}

impl FromStr for Eye {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Vec<f64> = text.split(',').filter_map(|n| n.trim().parse().ok()).collect();
        match numbers[..] {
            [turn_deg, height_deg, distance_m]
                if turn_deg.is_finite()
                    && (-88.0..=88.0).contains(&height_deg)
                    && (0.03..=4.0).contains(&distance_m) =>
            {
                Ok(Self { turn_deg, height_deg, distance_m })
            }
            _ => Err(format!(
                "'{text}' is not TURN,HEIGHT,DISTANCE: degrees, degrees from -88 to 88, metres from \
                 0.03 to 4"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_that_show_nothing_are_refused_by_name() {
        for (text, part) in
            [("spheres", "spheres:LEVEL"), ("spheres:x", "spheres:LEVEL"), ("", "''")]
        {
            assert!(text.parse::<ShowItem>().unwrap_err().contains(part));
        }
        assert_eq!("spheres:3".parse(), Ok(ShowItem::Spheres(Spheres::Level(3))));
        for text in ["0x5", "10", "9000x10", "10x-1", "axb"] {
            assert!(text.parse::<PictureSize>().is_err(), "{text}");
        }
        for text in ["1,2", "1,89,1", "1,2,0", "nan,0,1", "1,2,3,4"] {
            assert!(text.parse::<Eye>().is_err(), "{text}");
        }
    }
}
