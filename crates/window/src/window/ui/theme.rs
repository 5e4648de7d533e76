//! Colours, letters and borders of everything that lies over the scene.

use egui::{
    Align2, Area, Color32, Context, CornerRadius, FontFamily, FontId, Frame, Id, Margin, Order,
    Pos2, RichText, ScrollArea, Shadow, Stroke, TextStyle, Ui, UiBuilder, Vec2, Visuals,
};

/// Colour of what is good or on time.
pub const GOOD: Color32 = Color32::from_rgb(0x1B, 0x87, 0x4B);
/// Colour of what is late, or to be looked at.
pub const CAUTION: Color32 = Color32::from_rgb(0xB8, 0x6E, 0x00);
/// Colour of what is wrong, or old.
pub const BAD: Color32 = Color32::from_rgb(0xC6, 0x28, 0x28);
/// Colour of what is chosen.
pub const ACCENT: Color32 = Color32::from_rgb(0x1F, 0x5F, 0xBF);
/// Colour of letters that are not read first.
pub const QUIET: Color32 = Color32::from_rgb(0x5B, 0x63, 0x6E);
/// Colour of a fingertip that touches nothing.
pub const IDLE: Color32 = Color32::from_rgb(0xC9, 0xCE, 0xD6);

/// Distance of the cards from the edge of the window, points.
pub const MARGIN: f32 = 12.0;

/// Sets the style of letters and colours once.
pub fn set_up(context: &Context) {
    // A field for letters is seen on a white card.
    let field = Some(Color32::from_gray(238));
    context.set_visuals(Visuals { text_edit_bg_color: field, ..Visuals::light() });
    context.all_styles_mut(|style| {
        let font = |size| FontId::new(size, FontFamily::Proportional);
        style.text_styles = [
            (TextStyle::Heading, font(18.0)),
            (TextStyle::Body, font(14.0)),
            (TextStyle::Button, font(14.0)),
            (TextStyle::Small, font(12.0)),
            (TextStyle::Monospace, FontId::new(13.0, FontFamily::Monospace)),
        ]
        .into();
        style.spacing.item_spacing = Vec2::new(8.0, 5.0);
        style.spacing.button_padding = Vec2::new(9.0, 4.0);
        style.interaction.selectable_labels = false;
        // A menu that comes up by and by is looked through for many pictures where few are drawn.
        style.animation_time = 0.0;
    });
}

/// Height of the bar of menus with its margins, points: what lies below it begins here.
pub const BELOW_BAR: f32 = 60.0;

/// Shows a card with content at an edge or corner of the window.
pub fn card<R>(
    context: &Context,
    name: &str,
    anchor: Align2,
    offset: [f32; 2],
    content: impl FnOnce(&mut Ui) -> R,
) -> R {
    Area::new(Id::new(name))
        .anchor(anchor, Vec2::from(offset))
        .order(Order::Middle)
        .show(context, |ui| card_frame().show(ui, content).inner)
        .inner
}

/// Shows a card in the lower left corner, so far above the edge of the window. It is measured before it
/// is put there, so that one that grows does not lie over what is below it for a picture.
pub fn low_card(context: &Context, name: &str, above: f32, content: impl Fn(&mut Ui)) {
    let screen = context.content_rect();
    let measuring = UiBuilder::new().max_rect(screen).invisible();
    let mut unseen = Ui::new(context.clone(), Id::new((name, "measured")), measuring);
    let height = card_frame().show(&mut unseen, &content).response.rect.height();
    Area::new(Id::new(name))
        .fixed_pos(Pos2::new(screen.left() + MARGIN, screen.bottom() - above - height))
        .order(Order::Middle)
        .show(context, |ui| card_frame().show(ui, content));
}

/// Shows a card that waits for an answer: it lies over all others.
pub fn dialog<R>(context: &Context, name: &str, content: impl FnOnce(&mut Ui) -> R) -> R {
    Area::new(Id::new(name))
        .anchor(Align2::CENTER_CENTER, Vec2::ZERO)
        .order(Order::Foreground)
        .show(context, |ui| card_frame().fill(Color32::WHITE).show(ui, content).inner)
        .inner
}

/// Shows cards one below the other at a corner of the window, not larger than `size_max`; those that find
/// no room are scrolled to.
pub fn column<R>(
    context: &Context,
    name: &str,
    anchor: Align2,
    offset: [f32; 2],
    size_max: [f32; 2],
    content: impl FnOnce(&mut Ui) -> R,
) -> R {
    Area::new(Id::new(name))
        .anchor(anchor, Vec2::from(offset))
        .order(Order::Middle)
        .show(context, |ui| {
            // An area offers no more room than its content took in the picture before.
            let [width, height] = size_max.map(|length| length.max(80.0));
            ui.set_max_size(Vec2::new(width, height));
            let scroll = ScrollArea::vertical().id_salt(name).max_height(height);
            scroll.show(ui, content).inner
        })
        .inner
}

/// Shows a card in a column.
pub fn sheet<R>(ui: &mut Ui, content: impl FnOnce(&mut Ui) -> R) -> R {
    card_frame().show(ui, content).inner
}

/// Size of the cards of a name in the last picture; zero where there were none.
pub fn size_of(context: &Context, name: &str) -> Vec2 {
    let area = context.memory(|memory| memory.area_rect(Id::new(name)));
    // An area that has been named but not measured yet is nowhere.
    let size = area.map_or(Vec2::ZERO, |rect| rect.size());
    if size.is_finite() { size.max(Vec2::ZERO) } else { Vec2::ZERO }
}

/// Border and background of a card.
pub fn card_frame() -> Frame {
    Frame::new()
        .fill(Color32::from_rgba_unmultiplied(255, 255, 255, 236))
        .stroke(Stroke::new(1.0, Color32::from_rgba_unmultiplied(0, 0, 0, 26)))
        .corner_radius(CornerRadius::same(8))
        .inner_margin(Margin::symmetric(12, 9))
        .shadow(Shadow {
            offset: [0, 2],
            blur: 10,
            spread: 0,
            color: Color32::from_rgba_unmultiplied(0, 0, 0, 40),
        })
}

/// A text in the colour of letters that are not read first.
pub fn quiet(text: impl Into<String>) -> RichText {
    RichText::new(text).color(QUIET)
}

/// Shows a word on a coloured ground.
pub fn chip(ui: &mut Ui, text: &str, ground: Color32) {
    Frame::new()
        .fill(ground)
        .corner_radius(CornerRadius::same(9))
        .inner_margin(Margin::symmetric(8, 2))
        .show(ui, |ui| ui.label(RichText::new(text).color(Color32::WHITE).strong()));
}
