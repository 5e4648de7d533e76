//! Finds the figures in a text: numbers with their precision and unit as written.

use super::unit::Unit;

/// Number as it is written in a text.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Characters of the number, without the unit.
    pub written: String,
    /// Position in the text, bytes.
    pub at: usize,
    /// Value of the number.
    pub value: f64,
    /// Value of one unit of its last digit.
    pub step: f64,
    /// Unit behind the number.
    pub unit: Unit,
    /// Whether it is an upper limit: "below 3e-13", "at most 5 ms".
    pub is_limit: bool,
}

impl Figure {
    /// Whether a number of the figure's unit is rounded to the figure; for a limit, rounded up.
    pub fn quotes(&self, number: f64) -> bool {
        let slack = 1e-6 * self.step;
        match self.is_limit {
            true => number <= self.value + slack && number > self.value - self.step - slack,
            false => (number - self.value).abs() <= 0.5 * self.step + slack,
        }
    }
}

/// Words before a figure that make it an upper limit.
const LIMITS: [&str; 5] = ["below", "at most", "under", "less than", "no more than"];

/// All figures in a text, in order. Digits that are part of a word (`p99`, `t4`, `parry3d`) and dates are
/// left out. A thin or plain space may separate groups of three digits.
pub fn figures(text: &str) -> Vec<Figure> {
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(digit) = text[at..].find(|c: char| c.is_ascii_digit()).map(|i| at + i) {
        let token = &text[digit..digit + length(&text[digit..])];
        at = digit + token.len();
        let before = text[..digit].chars().next_back();
        let after = text[at..].chars().next();
        let in_word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
        let is_in_word = in_word(before) || in_word(after);
        let is_date = after == Some('-') && token.len() == 4;
        if is_in_word || is_date {
            let rest = text[at..].find(|c: char| !(c.is_alphanumeric() || "-_.".contains(c)));
            at = rest.map_or(text.len(), |rest| at + rest);
            continue;
        }
        if let Some(figure) = figure(token, digit, text) {
            found.push(figure);
        }
    }
    found
}

fn figure(token: &str, at: usize, text: &str) -> Option<Figure> {
    let written = token.replace([' ', '\u{202f}', '\u{a0}'], "");
    let value: f64 = written.parse().ok()?;
    let (mantissa, exponent) = written.split_once('e').unwrap_or((&written, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, digits)| digits.len());
    let step = 10f64.powi(exponent.parse::<i32>().ok()? - decimals as i32);
    let behind = text[at + token.len()..].trim_start();
    let word: String = behind.chars().take_while(|c| !" ,.;:)\n".contains(*c)).collect();
    // Figures of a range share the unit behind the last: "0.76 to 1.15 ms".
    let unit = Unit::of(&word).unwrap_or_else(|| shared_unit(behind));
    let before = text[..at].trim_end();
    let is_limit = LIMITS.iter().any(|limit| before.ends_with(limit));
    Some(Figure { written: token.to_owned(), at, value, step, unit, is_limit })
}

/// Unit of the next figure if only "to", "and" or a comma stands before it.
fn shared_unit(behind: &str) -> Unit {
    let next = ["to ", "and ", ", "].iter().find_map(|joint| behind.strip_prefix(joint));
    let Some(next) = next.filter(|next| next.starts_with(|c: char| c.is_ascii_digit())) else {
        return Unit::Plain;
    };
    let behind = next[length(next)..].trim_start();
    let word: String = behind.chars().take_while(|c| !" ,.;:)\n".contains(*c)).collect();
    Unit::of(&word).unwrap_or_else(|| shared_unit(behind))
}

/// Length of the number at the beginning of a text, bytes.
fn length(text: &str) -> usize {
    let digits = |from: usize| -> usize {
        text[from..].find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len() - from)
    };
    let mut end = digits(0);
    // Groups of three behind at most three digits.
    while end <= 3 || text[..end].contains([' ', '\u{202f}', '\u{a0}']) {
        let Some(space) = text[end..].chars().next().filter(|c| " \u{202f}\u{a0}".contains(*c))
        else {
            break;
        };
        let group = end + space.len_utf8();
        if digits(group) != 3 {
            break;
        }
        end = group + 3;
    }
    if text[end..].starts_with('.') && digits(end + 1) > 0 {
        end += 1 + digits(end + 1);
    }
    let exponent = text[end..].strip_prefix('e').map(|rest| usize::from(rest.starts_with('-')));
    if let Some(sign) = exponent
        && digits(end + 1 + sign) > 0
    {
        end += 1 + sign + digits(end + 1 + sign);
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(text: &str) -> Vec<(f64, f64, Unit)> {
        figures(text).into_iter().map(|f| (f.value, f.step, f.unit)).collect()
    }

    #[test]
    fn numbers_are_read_with_their_precision_and_unit() {
        let (plain, ms, percent) = (Unit::Plain, Unit::Time(1e-3), Unit::Percent);
        assert_eq!(seen("10 648 nodes, 0.11 ms."), [(10_648.0, 1.0, plain), (0.11, 0.01, ms)]);
        assert_eq!(seen("0.07 % late"), [(0.07, 0.01, percent)]);
        assert_eq!(seen("error 3e-13, 2.5e3"), [(3e-13, 1e-13, plain), (2500.0, 100.0, plain)]);
        assert_eq!(seen("0.76 to 1.15 ms"), [(0.76, 0.01, ms), (1.15, 0.01, ms)]);
        assert_eq!(
            seen("4.7 GiB, 51 s"),
            [(4.7, 0.1, Unit::Bytes(1_073_741_824.0)), (51.0, 1.0, Unit::Time(1.0))]
        );
        assert_eq!(seen("5 100 rows"), [(5100.0, 1.0, plain)]);
        assert_eq!(seen("1000 200"), [(1000.0, 1.0, plain), (200.0, 1.0, plain)]);
    }

    #[test]
    fn words_with_digits_and_dates_are_no_figures() {
        assert_eq!(seen("p99, t4-anp, parry3d, 3d, x86_64 on 2026-11-21"), []);
    }

    #[test]
    fn a_limit_is_a_number_rounded_up() {
        let [limit, figure] = &figures("errors below 3e-13, 0.11 ms")[..] else { panic!() };
        assert!(limit.is_limit && !figure.is_limit);
        assert!(limit.quotes(2.1e-13) && limit.quotes(3e-13));
        assert!(!limit.quotes(3.1e-13) && !limit.quotes(1.9e-13));
        assert!(figure.quotes(0.1051) && figure.quotes(0.1149));
        assert!(!figure.quotes(0.1049) && !figure.quotes(0.1151));
    }
}
