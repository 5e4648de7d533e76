//! Writes the man pages of both programs, and their completions for shells, from their options.
//!
//! `cargo run --example pages FOLDER` makes `FOLDER/man` and `FOLDER/completions`; a release has them
//! (`packaging/release.sh`). The programs themselves are not made larger by it.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use clap::{Command, CommandFactory};
use clap_complete::Shell;

fn main() -> ExitCode {
    let Some(folder) = std::env::args_os().nth(1) else {
        eprintln!("pages: name the folder to write into");
        return ExitCode::from(2);
    };
    match write(Path::new(&folder)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("pages: {}: {error}", Path::new(&folder).display());
            ExitCode::FAILURE
        }
    }
}

fn write(folder: &Path) -> std::io::Result<()> {
    let (man, completions) = (folder.join("man"), folder.join("completions"));
    fs::create_dir_all(&man)?;
    fs::create_dir_all(&completions)?;
    for (name, command) in programs() {
        clap_mangen::generate_to(command.clone(), &man)?;
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish, Shell::PowerShell] {
            clap_complete::generate_to(shell, &mut command.clone(), name, &completions)?;
        }
    }
    Ok(())
}

/// Both programs, each with its name and its options.
fn programs() -> [(&'static str, Command); 2] {
    let client = glove_client::commands::arguments::Arguments::command();
    let server = fea_server::arguments::Arguments::command();
    [("glove-client", client), ("fea-server", server)]
}
