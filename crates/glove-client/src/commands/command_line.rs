//! Command line before it is parsed: options and a file without a command mean `run`.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use softgrasp_grasp::object::ObjectChoice;

/// Words of a command line, the program's name first. `run` is inserted if no command is named and the
/// first word is an option of `run`, a built-in object or a file.
///
/// `is_command` tells whether a word is a command.
pub fn with_command(
    words: impl IntoIterator<Item = OsString>,
    is_command: impl Fn(&str) -> bool,
) -> Vec<OsString> {
    let mut words: Vec<OsString> = words.into_iter().collect();
    let Some(first) = words.get(1) else { return words };
    if means_run(first, is_command) {
        words.insert(1, OsString::from("run"));
    }
    words
}

fn means_run(first: &OsStr, is_command: impl Fn(&str) -> bool) -> bool {
    let Some(text) = first.to_str() else { return true };
    if is_command(text) || OF_PROGRAM.contains(&text) {
        return false;
    }
    let is_option = text.starts_with('-');
    let is_built_in = matches!(text.parse(), Ok(ObjectChoice::BuiltIn(_)));
    // A word that is neither is a command that was mistyped.
    is_option || is_built_in || Path::new(text).extension().is_some() || Path::new(text).exists()
}

/// Options of the program itself.
const OF_PROGRAM: [&str; 5] = ["-h", "--help", "-V", "--version", "help"];

#[cfg(test)]
mod tests {
    use super::*;

    fn typed(words: &[&str]) -> Vec<String> {
        let words = ["glove-client"].iter().chain(words).map(OsString::from);
        let all = with_command(words, |word| ["run", "solve", "mesh"].contains(&word));
        all.iter().skip(1).map(|word| word.to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn options_and_a_file_without_the_word_run_are_those_of_run() {
        assert_eq!(typed(&["--rate", "8"]), ["run", "--rate", "8"]);
        assert_eq!(typed(&["strawberry.msh"]), ["run", "strawberry.msh"]);
        assert_eq!(typed(&["strawberry", "--headless"]), ["run", "strawberry", "--headless"]);
        assert_eq!(typed(&["run", "cube"]), ["run", "cube"]);
        assert_eq!(typed(&["solve", "--mesh", "m.msh"]), ["solve", "--mesh", "m.msh"]);
        assert_eq!(typed(&[]), [""; 0]);
    }

    #[test]
    fn mistyped_command_and_options_of_the_program_stay_as_they_are() {
        for word in ["sovle", "--help", "-V", "help"] {
            assert_eq!(typed(&[word]), [word]);
        }
    }
}
