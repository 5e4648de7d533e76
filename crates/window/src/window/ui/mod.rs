//! Everything that lies over the scene: menus, cards, dialogs.

pub mod dialogs;
pub mod file_list;
pub mod hand_card;
pub mod help_card;
pub mod information_card;
pub mod legend_card;
pub mod menu;
pub mod notices;
pub mod places;
pub mod softness_card;
pub mod status_card;
pub mod theme;
pub mod timeline;
pub mod timings_card;
pub mod waiting_cards;
