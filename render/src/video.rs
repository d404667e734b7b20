//! Videos, encoded by the program `ffmpeg`.

use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use pogema_core::files::Unfinished;
use pogema_core::{Error, Trace, Words, shorten, words};

use crate::motion::Motion;
use crate::scene::Scene;
use crate::style::Style;

/// Default length of the longer side of a video. Units: pixels.
pub const LONGER_SIDE: u32 = 720;
/// Target frame rate. The actual rate of a video gives each step a whole number of frames. Units: frames per second.
const RATE: f64 = 30.0;
/// Maximum length of a quoted error message of ffmpeg. Units: characters.
const LONGEST_REASON: usize = 200;

const MISSING: &str = "videos need the program `ffmpeg`, which is not on the PATH: install it, for example with \
                       `apt install ffmpeg` or `brew install ffmpeg`, or draw a GIF";

words! {
    /// The container format of a video, named after its file extension.
    pub enum VideoFormat {
        /// H.264 in MP4.
        Mp4 = "mp4",
        /// VP9 in `WebM`.
        Webm = "webm",
    }
}

impl VideoFormat {
    /// Returns the format for a file's extension.
    ///
    /// # Errors
    /// [`Error::Io`] for any extension other than `.mp4` and `.webm`.
    pub fn of(path: &Path) -> Result<Self, Error> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        let format = extension.and_then(|extension| Self::of_word(&extension));
        format.ok_or_else(|| {
            Error::io(path, "unknown video format, expected a name ending in `.mp4` or `.webm`")
        })
    }

    /// Returns the encoding arguments of ffmpeg.
    fn arguments(self) -> &'static str {
        match self {
            Self::Mp4 => "-c:v libx264 -crf 18 -pix_fmt yuv420p -movflags +faststart",
            Self::Webm => "-c:v libvpx-vp9 -crf 28 -b:v 0 -cpu-used 4 -row-mt 1 -pix_fmt yuv420p",
        }
    }
}

/// Draws an episode as a video; the file appears when it is complete.
///
/// `progress` is called after each frame with the number of frames done and the number of all frames.
///
/// Units: `width` in pixels, rounded up to an even number.
///
/// # Errors
/// Those of [`crate::svg::draw`] and [`VideoFormat::of`]; if the video would have more than [`crate::MAX_FRAMES`]
/// frames; if a frame would have no pixels or more than [`crate::MAX_FRAME_PIXELS`]; [`Error::Request`] if ffmpeg is
/// missing; [`Error::Io`] if ffmpeg fails or the file cannot be written.
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
    let (unfinished, _) = Unfinished::new(path, &format!(".{format}"))?;
    let mut log = tempfile::tempfile().map_err(failed)?;
    let mut ffmpeg =
        start(&motion, style.step_time, format, unfinished.temporary(), log.try_clone().map_err(failed)?)?;
    let fed = feed(&mut ffmpeg, &motion, progress);
    let status = ffmpeg.wait().map_err(failed)?;
    if !status.success() {
        return Err(Error::io(path, format!("ffmpeg failed ({status}): {}", last_line(&mut log))));
    }
    fed.map_err(failed)?;
    if std::fs::metadata(unfinished.temporary()).map_err(failed)?.len() == 0 {
        return Err(Error::io(path, "ffmpeg wrote nothing"));
    }
    unfinished.finish()
}

/// Checks that ffmpeg is installed and starts.
///
/// # Errors
/// [`Error::Request`] if it is missing, [`Error::Io`] if it cannot be started or fails.
pub fn check_ffmpeg() -> Result<(), Error> {
    let mut command = Command::new("ffmpeg");
    command.arg("-version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let status = command.status().map_err(not_started)?;
    if status.success() { Ok(()) } else { Err(Error::io("ffmpeg", format!("`-version` failed ({status})"))) }
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
    log: std::fs::File,
) -> Result<Child, Error> {
    let [width, height] = motion.size();
    let mut command = Command::new("ffmpeg");
    command.args(["-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgba"]);
    command.args(["-video_size", &format!("{width}x{height}")]);
    command.args(["-framerate", &format!("{:.4}", motion.rate(step_time)), "-i", "-", "-an"]);
    command.args(format.arguments().split(' ')).arg(file);
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(log);
    // Ctrl-C in a terminal must not end ffmpeg before its caller has decided what to do. ffmpeg ends when its input
    // ends.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn().map_err(not_started)
}

/// Writes all frames to ffmpeg. If ffmpeg ends early, its exit status and log hold the reason.
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

/// Returns the last non-empty line of ffmpeg's log.
fn last_line(log: &mut std::fs::File) -> String {
    let mut text = Vec::new();
    let read = log.seek(SeekFrom::Start(0)).and_then(|_| log.read_to_end(&mut text));
    let text = String::from_utf8_lossy(&text);
    let last = text.lines().rfind(|line| !line.trim().is_empty());
    match (read, last) {
        (Ok(_), Some(line)) => shorten(line.trim(), LONGEST_REASON),
        _ => "no error message".to_owned(),
    }
}
