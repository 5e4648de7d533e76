//! Writes every picture into a folder, beside the drawing.

use std::path::{Path, PathBuf};

use anyhow::Context;
use image::RgbImage;
use kiss3d::prelude::Window;
use softgrasp_os::Beside;

/// Pictures of the window that are written on request.
#[derive(Default)]
pub struct Recordings {
    recorder: Option<Recorder>,
}

impl Recordings {
    /// Whether every picture is being written.
    pub fn is_recording(&self) -> bool {
        self.recorder.is_some()
    }

    /// Writes the picture that is shown now; returns a sentence that names the file.
    ///
    /// # Errors
    /// The error, in one line.
    pub fn snapshot(&self, window: &Window) -> anyhow::Result<String> {
        let path = free_path("softgrasp", "png");
        let saved = window.snap_image().save(&path);
        saved.with_context(|| format!("cannot write {}", path.display()))?;
        Ok(format!("picture written: {}", path.display()))
    }

    /// Begins to write every picture, or ends it; returns a sentence that says so.
    ///
    /// # Errors
    /// The error, in one line.
    pub fn begin_or_end(&mut self) -> anyhow::Result<String> {
        if let Some(recorder) = self.recorder.take() {
            return recorder.end();
        }
        let folder = free_path("softgrasp-pictures", "");
        self.recorder = Some(Recorder::start(&folder)?);
        Ok(format!("every picture is written to {}", folder.display()))
    }

    /// Takes the picture that is shown now, if pictures are being written.
    pub fn add(&mut self, window: &Window) {
        if let Some(recorder) = &mut self.recorder {
            recorder.add(window.snap_image());
        }
    }
}

/// A folder into which every picture is written.
struct Recorder {
    folder: PathBuf,
    writer: Beside<(PathBuf, RgbImage), Result<(), String>>,
    count: u32,
    failed: Option<String>,
}

impl Recorder {
    /// Makes the folder and starts the thread that writes.
    ///
    /// # Errors
    /// The error of the operating system, in one line.
    fn start(folder: &Path) -> anyhow::Result<Self> {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        let write = |(path, picture): (PathBuf, RgbImage)| {
            let written = picture.save(&path);
            written.map_err(|error| format!("cannot write {}: {error}", path.display()))
        };
        let writer = Beside::start("pictures", write)
            .context("cannot start the thread that writes pictures")?;
        Ok(Self { folder: folder.to_owned(), writer, count: 0, failed: None })
    }

    /// Adds a picture to those that are to be written.
    fn add(&mut self, picture: RgbImage) {
        let path = self.folder.join(format!("{:05}.png", self.count));
        self.count += 1;
        self.writer.begin((path, picture));
        while let Some(written) = self.writer.take() {
            self.failed = self.failed.take().or(written.err());
        }
    }

    /// Waits until all pictures are written; returns how many, or what went wrong first.
    ///
    /// # Errors
    /// The first picture that could not be written.
    fn end(mut self) -> anyhow::Result<String> {
        while let Some(written) = self.writer.wait() {
            self.failed = self.failed.take().or(written.err());
        }
        match self.failed {
            Some(error) => anyhow::bail!(error),
            None => Ok(format!("{} pictures written to {}", self.count, self.folder.display())),
        }
    }
}

/// A name that is not taken, in this folder: `stem-1.extension`, `stem-2.extension` …
fn free_path(stem: &str, extension: &str) -> PathBuf {
    let path = |n: u32| PathBuf::from(format!("{stem}-{n}")).with_extension(extension);
    (1..100_000).map(path).find(|path| !path.exists()).unwrap_or_else(|| path(0))
}
