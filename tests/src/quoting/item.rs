//! Paragraphs, bullets and table rows of a section, with links and sources taken out of the text.

/// Paragraph, bullet or table row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Item {
    /// Visible text, without `code` and targets of links.
    pub text: String,
    /// Targets of the links.
    pub links: Vec<String>,
    /// Texts of the comments.
    pub comments: Vec<String>,
}

/// All items of a section of a Markdown page, or of the whole page for an empty heading; blocks of code
/// are left out.
pub fn items(page: &str, heading: &str) -> Vec<Item> {
    let mut lines: Vec<String> = Vec::new();
    let (mut is_inside, mut is_code) = (heading.is_empty(), false);
    for line in page.lines() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
            lines.push(String::new());
            continue;
        }
        if is_code {
            continue;
        }
        if let Some(title) = line.strip_prefix("## ") {
            is_inside = heading.is_empty() || title == heading;
            continue;
        }
        if !is_inside {
            continue;
        }
        let begins = ["- ", "| ", "|"].iter().any(|mark| line.starts_with(mark));
        match lines.last_mut() {
            Some(last) if !begins && !last.is_empty() && !line.trim().is_empty() => {
                last.push('\n');
                last.push_str(line);
            }
            _ => lines.push(line.to_owned()),
        }
    }
    lines.iter().filter(|text| !text.trim().is_empty()).map(|text| item(text)).collect()
}

fn item(text: &str) -> Item {
    let mut item = Item::default();
    let mut rest = text;
    while let Some(at) = rest.find(['<', '`', '[', ']']) {
        item.text.push_str(&rest[..at]);
        let here = &rest[at..];
        let taken = between(here, "<!--", "-->")
            .inspect(|(comment, _)| item.comments.push(comment.trim().to_owned()))
            .or_else(|| between(here, "`", "`"))
            .or_else(|| {
                between(here, "](", ")").inspect(|(link, _)| item.links.push((*link).to_owned()))
            });
        // Code and comments leave a gap, so that no words grow together.
        item.text.push(' ');
        rest = match taken {
            Some((_, behind)) => behind,
            None => &here[1..],
        };
    }
    item.text.push_str(rest);
    item
}

/// Text between two marks at the beginning of a text, and the rest.
fn between<'a>(text: &'a str, open: &str, close: &str) -> Option<(&'a str, &'a str)> {
    text.strip_prefix(open)?.split_once(close)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_found_and_taken_apart() {
        let page = "# T\n\n## Numbers\n\nWords `code 7`.\n\n- One ([a](r/a.md))\n  and on <!-- a.csv | -> x -->\n\
                    - Two\n\n```\n- 9\n```\n## Other\n- 3\n";
        let all = items(page, "Numbers");
        let texts: Vec<&str> = all.iter().map(|i| i.text.trim()).collect();
        assert_eq!(texts.len(), 3, "{texts:?}");
        assert!(!texts[0].contains('7') && texts[2] == "- Two", "{texts:?}");
        assert_eq!(all[1].links, ["r/a.md"]);
        assert_eq!(all[1].comments, ["a.csv | -> x"]);
        assert!(texts[1].contains("and on") && !texts[1].contains("csv"), "{texts:?}");
        assert_eq!(items(page, "").len(), 5);
    }
}
