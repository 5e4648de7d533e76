//! Everything that lies over the scene: menus, cards, dialogs.

pub mod dialogs;
pub mod hand_card;
pub mod help_card;
pub mod information_card;
pub mod legend_card;
pub mod loading_card;
pub mod menu;
pub mod notices;
pub mod places;
pub mod status_card;
pub mod theme;
pub mod timeline;
pub mod timings_card;
