//! Videos, made by the program `ffmpeg`.

use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use pogema_core::files::temporary_beside;
use pogema_core::{Error, Trace, Words, shorten, words};

use crate::motion::Motion;
use crate::scene::Scene;
use crate::style::Style;

/// Frames of a second; more if a step is shorter than that.
const RATE: f64 = 30.0;
/// So much of what ffmpeg says at its end is passed on. Units: characters.
const LONGEST_REASON: usize = 200;

const MISSING: &str = "videos need the program `ffmpeg`, which is not on the PATH: install it, for example by \
                       `apt install ffmpeg` or `brew install ffmpeg`, or draw a GIF";

words! {
    /// What a video is packed in, by the ending of its file.
    pub enum VideoFormat {
        /// H.264 in MP4.
        Mp4 = "mp4",
        /// VP9 in `WebM`.
        Webm = "webm",
    }
}

impl VideoFormat {
    /// The format that a file's name ends in.
    ///
    /// # Errors
    /// [`Error::Io`] for any other ending than `.mp4` and `.webm`.
    pub fn of(path: &Path) -> Result<Self, Error> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let format = ending.and_then(|ending| Self::of_word(&ending));
        format.ok_or_else(|| Error::io(path, "the name of a video ends in `.mp4` or `.webm`"))
    }

    /// How ffmpeg encodes it.
    fn arguments(self) -> &'static str {
        match self {
            Self::Mp4 => "-c:v libx264 -crf 18 -pix_fmt yuv420p -movflags +faststart",
            Self::Webm => "-c:v libvpx-vp9 -crf 28 -b:v 0 -cpu-used 4 -row-mt 1 -pix_fmt yuv420p",
        }
    }
}

/// Draws an episode as a video; the file appears once it is whole.
///
/// `progress` is told after each frame how many are done, and how many there are.
///
/// Units: `width` in pixels, made even.
///
/// # Errors
/// As for [`crate::gif::encode`], and [`Error::Io`] if ffmpeg is missing or fails.
pub fn write(
    trace: &Trace,
    style: &Style,
    width: u32,
    path: &Path,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<(), Error> {
    let format = VideoFormat::of(path)?;
    let style = Style { static_frame: None, ..style.clone() };
    let scene = Scene::new(trace, &style)?;
    let motion = Motion::new(&scene, width, RATE, 2)?;
    let failed = |error: std::io::Error| Error::io(path, error);
    let unfinished = temporary_beside(path, &format!(".{format}"))?.into_temp_path();
    let mut said = tempfile::tempfile().map_err(failed)?;
    let mut ffmpeg = start(&motion, style.step_time, format, &unfinished, said.try_clone().map_err(failed)?)?;
    let fed = feed(&mut ffmpeg, &motion, progress);
    let status = ffmpeg.wait().map_err(failed)?;
    if !status.success() {
        return Err(Error::io(path, format!("ffmpeg failed ({status}): {}", last_words(&mut said))));
    }
    fed.map_err(failed)?;
    if std::fs::metadata(&unfinished).map_err(failed)?.len() == 0 {
        return Err(Error::io(path, "ffmpeg wrote nothing"));
    }
    unfinished.persist(path).map_err(|error| failed(error.error))
}

/// Passes if there is an ffmpeg to make videos.
///
/// # Errors
/// [`Error::Request`] if it is missing, [`Error::Io`] if it cannot be started.
pub fn check_ffmpeg() -> Result<(), Error> {
    let mut command = Command::new("ffmpeg");
    let started =
        command.arg("-version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status();
    started.map(|_| ()).map_err(not_started)
}

fn not_started(error: std::io::Error) -> Error {
    match error.kind() {
        ErrorKind::NotFound => Error::request(MISSING),
        _ => Error::io("ffmpeg", error),
    }
}

fn start(
    motion: &Motion<'_>,
    step_time: f64,
    format: VideoFormat,
    file: &Path,
    said: std::fs::File,
) -> Result<Child, Error> {
    let [width, height] = motion.size();
    let mut command = Command::new("ffmpeg");
    command.args(["-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgba"]);
    command.args(["-video_size", &format!("{width}x{height}")]);
    command.args(["-framerate", &format!("{:.4}", motion.rate(step_time)), "-i", "-", "-an"]);
    command.args(format.arguments().split(' ')).arg(file);
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(said);
    command.spawn().map_err(not_started)
}

/// Hands over all frames. If ffmpeg ends early, its exit status tells why.
fn feed(
    ffmpeg: &mut Child,
    motion: &Motion<'_>,
    progress: &mut dyn FnMut(usize, usize),
) -> std::io::Result<()> {
    let Some(mut input) = ffmpeg.stdin.take() else { return Ok(()) };
    for index in 0..motion.num_frames() {
        input.write_all(motion.frame(index).data())?;
        progress(index + 1, motion.num_frames());
    }
    Ok(())
}

/// The last line that is not empty.
fn last_words(said: &mut std::fs::File) -> String {
    let mut text = Vec::new();
    let read = said.seek(SeekFrom::Start(0)).and_then(|_| said.read_to_end(&mut text));
    let text = String::from_utf8_lossy(&text);
    let last = text.lines().rfind(|line| !line.trim().is_empty());
    match (read, last) {
        (Ok(_), Some(line)) => shorten(line.trim(), LONGEST_REASON),
        _ => "it did not say why".to_owned(),
    }
}
