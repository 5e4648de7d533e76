//! The page that a browser or a headset opens to see a run, and to take part in it.
//!
//! [`Page::open`] serves files and a WebSocket at an address with a token ([`token`], `routes`,
//! `listening`). The ticks offer frames; a thread of its own (`painter`) makes numbers of them that
//! browsers draw (`picture`, [`quantised`]), with the skins and colours of the window
//! (`softgrasp_window::view`). Each page (`viewer`) gets what it has not drawn yet of the newest
//! picture (`to_page`) and no other; what it sends is checked ([`from_page`]) and goes to the ticks
//! as wishes (`wishes`) or as the joints of a hand (`headset`). The bytes are in `docs/xr.md`.
//!
//! ```
//! use softgrasp_xr::{Page, PageOptions};
//!
//! let address = "127.0.0.1:0".parse()?;
//! let page = Page::open(PageOptions { address, encryption: None, takes_hands: false })?;
//! // Only who knows the token sees the page.
//! assert!(page.address().starts_with("http://127.0.0.1:"));
//! assert!(page.hand_to_picture().is_none());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod from_page;
mod headset;
mod listening;
mod page;
mod painter;
mod picture;
pub mod quantised;
mod routes;
mod shown_hand;
mod shown_object;
mod site;
mod status;
mod textures;
mod to_page;
pub mod token;
mod viewer;
mod wishes;

pub use headset::HandToPicture;
pub use page::{Page, PageError, PageOptions};
pub use painter::ShownRun;
