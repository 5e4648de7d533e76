//! Writes the files of a command: each is written completely, or an older one stays.

use std::path::Path;

use anyhow::Context;

/// Writes a file; a reader never sees half of it, and a failure leaves an older file as it was.
///
/// # Errors
/// The system's reason with the path.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let shown = path.display();
    if path.is_dir() {
        anyhow::bail!("cannot write {shown}: it is a directory");
    }
    // Devices and pipes (/dev/stdout) cannot be replaced by renaming.
    if path.exists() && !path.is_file() {
        return std::fs::write(path, bytes).with_context(|| format!("cannot write {shown}"));
    }
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = std::fs::write(&part, bytes).and_then(|()| std::fs::rename(&part, path));
    if written.is_err() {
        // Best effort: the error that matters is the one reported below.
        let _ = std::fs::remove_file(&part);
    }
    written.with_context(|| format!("cannot write {shown}"))
}

/// Writes a value as indented JSON with a final newline.
///
/// # Errors
/// As [`write_file`].
pub(crate) fn write_json(path: &Path, value: &impl serde::Serialize) -> anyhow::Result<()> {
    let mut text = serde_json::to_vec_pretty(value).context("cannot form the JSON report")?;
    text.push(b'\n');
    write_file(path, &text)
}

/// Prints to standard output; a closed pipe (`| head`) is not an error worth words.
///
/// # Errors
/// Any other failure to write.
pub(crate) fn print(text: &str) -> anyhow::Result<()> {
    use std::io::Write as _;
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to standard output")
        }
        _ => Ok(()),
    }
}
