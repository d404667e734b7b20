//! POGEMA 1.4.0 itself, in a child process.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use pogema_core::Error;

use crate::request::{Request, Response};

/// The files of the server, the main file first.
const SERVER: [(&str, &str); 3] = [
    ("oracle.py", include_str!("../oracle/oracle.py")),
    ("episodes.py", include_str!("../oracle/episodes.py")),
    ("deadline.py", include_str!("../oracle/deadline.py")),
];
const INSTALLER: &str = include_str!("../oracle/install.py");
const REQUIREMENTS: &str = include_str!("../oracle/requirements.txt");

/// A running POGEMA 1.4.0 that answers requests.
#[derive(Debug)]
pub struct Oracle {
    process: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    /// Keeps the server's files until the server ends.
    _folder: tempfile::TempDir,
}

/// Returns the path of a Python interpreter with POGEMA 1.4.0. If necessary, creates a virtual environment with POGEMA
/// under `folder`.
///
/// If the environment variable `POGEMA_ORACLE_PYTHON` is set, returns its value.
///
/// # Errors
/// [`Error::Io`] if Python 3.11 is missing or POGEMA cannot be installed.
pub fn find_oracle_python(folder: &Path) -> Result<PathBuf, Error> {
    if let Some(python) = std::env::var_os("POGEMA_ORACLE_PYTHON") {
        return Ok(PathBuf::from(python));
    }
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, error))?;
    write(folder, "requirements.txt", REQUIREMENTS)?;
    let installer = write(folder, "install.py", INSTALLER)?;
    let output = Command::new("python3.11")
        .arg(&installer)
        .arg(folder.join("venv"))
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| Error::io("python3.11", format!("{error}; the oracle needs Python 3.11")))?;
    if !output.status.success() {
        return Err(Error::io(installer, "POGEMA 1.4.0 could not be installed, see above"));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let last = text.lines().last().unwrap_or_default();
    Ok(PathBuf::from(last.trim()))
}

fn write(folder: &Path, name: &str, text: &str) -> Result<PathBuf, Error> {
    let path = folder.join(name);
    // Another run may read the file at this moment.
    pogema_core::files::write_whole(&path, text.as_bytes())?;
    Ok(path)
}

impl Oracle {
    /// Starts POGEMA with the given Python.
    ///
    /// # Errors
    /// [`Error::Io`] if it does not start or is not version 1.4.0.
    pub fn start(python: &Path) -> Result<Self, Error> {
        let folder = tempfile::tempdir().map_err(|error| Error::io("temporary folder", error))?;
        for (name, text) in SERVER {
            write(folder.path(), name, text)?;
        }
        let mut process = Command::new(python)
            .arg(folder.path().join(SERVER[0].0))
            .env("OMP_NUM_THREADS", "1")
            .env("OPENBLAS_NUM_THREADS", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| Error::io(python, error))?;
        let pipes = process.stdin.take().zip(process.stdout.take());
        let Some((input, output)) = pipes else { return Err(Error::io(python, "no pipe to the oracle")) };
        let mut oracle = Self { process, input, output: BufReader::new(output), _folder: folder };
        let hello = oracle.read_line()?;
        if !hello.contains(r#""version":"1.4.0""#) {
            return Err(Error::io(python, format!("the oracle is not POGEMA 1.4.0: {}", hello.trim())));
        }
        Ok(oracle)
    }

    /// Sends a request without waiting. [`Oracle::receive`] returns the answer, so several requests can be pending.
    ///
    /// # Errors
    /// [`Error::Io`] if the oracle has ended.
    pub fn send(&mut self, request: &Request) -> Result<(), Error> {
        let text = serde_json::to_string(request).map_err(|error| Error::io("oracle", error))?;
        let sent = writeln!(self.input, "{text}").and_then(|()| self.input.flush());
        sent.map_err(|error| Error::io("oracle", error))
    }

    /// Receives the next answer.
    ///
    /// # Errors
    /// [`Error::Io`] if the oracle has ended or its answer is not a response.
    pub fn receive(&mut self) -> Result<Response, Error> {
        let line = self.read_line()?;
        serde_json::from_str(&line).map_err(|error| {
            let start: String = line.chars().take(200).collect();
            Error::io("oracle", format!("unreadable answer ({error}): {start}"))
        })
    }

    /// Sends a request and receives its answer.
    ///
    /// # Errors
    /// As [`Oracle::send`] and [`Oracle::receive`].
    pub fn ask(&mut self, request: &Request) -> Result<Response, Error> {
        self.send(request)?;
        self.receive()
    }

    fn read_line(&mut self) -> Result<String, Error> {
        let mut line = String::new();
        match self.output.read_line(&mut line) {
            Ok(0) => Err(Error::io("oracle", "ended without an answer")),
            Ok(_) => Ok(line),
            Err(error) => Err(Error::io("oracle", error)),
        }
    }
}

impl Drop for Oracle {
    fn drop(&mut self) {
        // A server that is blocked on writing its answer would not notice that its input is closed.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
