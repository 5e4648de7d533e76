//! An error and its causes on one line, as the programs print it.

use std::error::Error;

/// The error and its causes, separated by colons; a cause that the line already holds is left out.
pub fn one_line(error: &(dyn Error + 'static)) -> String {
    let mut line = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        let text = error.to_string();
        if !line.contains(&text) {
            line = format!("{line}: {text}");
        }
        cause = error.source();
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("{text}")]
    struct Fault {
        text: &'static str,
        source: Option<Box<Fault>>,
    }

    fn fault(text: &'static str, source: Option<Fault>) -> Fault {
        Fault { text, source: source.map(Box::new) }
    }

    #[test]
    fn causes_follow_and_repeated_ones_are_left_out() {
        let lowest = fault("no such file", None);
        let middle = fault("cannot read a.msh: no such file", Some(lowest));
        let top = fault("the scene", Some(middle));
        assert_eq!(one_line(&top), "the scene: cannot read a.msh: no such file");
    }
}
