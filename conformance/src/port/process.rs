//! A port in a child process. Every answer has a timeout.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pogema_core::{Error, shorten};
use process_wrap::std::{ChildWrapper, CommandWrap};
use serde::de::DeserializeOwned;

use super::link::{FaultKind, Link, Misbehaviour};
use super::protocol::{Ask, Hello, PROTOCOL, Reply};

/// Maximum length of an answer. Units: bytes.
const MAX_LINE_LENGTH: usize = 1 << 26;
/// Maximum length of the reported end of stderr. Units: bytes.
const MAX_STDERR_LENGTH: usize = 2048;
/// Maximum length of the quoted start of a bad answer. Units: characters.
const MAX_QUOTE_LENGTH: usize = 120;
/// Factor by which the time limit of the first answer is longer, because imports alone can take seconds.
const START_FACTOR: u32 = 6;
/// Divisor of the time limit of a hurried port.
const HURRY_FACTOR: u32 = 10;
/// Time that a port may take to exit after `bye` or after it closed its output.
const EXIT_TIMEOUT: Duration = Duration::from_millis(500);
/// Interval between checks whether a silent port is still running.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// The command that starts a port, and the timeout of each of the port's answers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Command {
    /// The command line as given.
    pub text: String,
    words: Vec<String>,
    timeout: Duration,
}

impl Command {
    /// Splits a command line as a shell would. `timeout` applies to each answer.
    ///
    /// # Errors
    /// [`Error::Config`] for an empty line or an unclosed quote.
    pub fn new(text: &str, timeout: Duration) -> Result<Self, Error> {
        let expected = "a shell command line";
        let words = shell_words::split(text).map_err(|_| Error::config("port", text, expected))?;
        if words.is_empty() {
            return Err(Error::config("port", text, expected));
        }
        Ok(Self { text: text.into(), words, timeout })
    }
}

/// A port in a child process, with all processes that it starts.
#[derive(Debug)]
pub struct Process {
    child: Box<dyn ChildWrapper>,
    input: Option<Sender<Vec<u8>>>,
    output: Receiver<Output>,
    /// Whether further output followed the last answer.
    has_more: bool,
    stderr_end: Arc<Mutex<VecDeque<u8>>>,
    timeout: Duration,
    stop: Arc<AtomicBool>,
}

/// Output from the port's stdout.
#[derive(Debug)]
enum Output {
    /// A line, and whether further output followed it.
    Line(Vec<u8>, bool),
    TooLong,
    /// The end, and the text after the last line.
    End(Vec<u8>),
}

impl Process {
    /// Starts a port.
    ///
    /// # Errors
    /// If the program cannot be started.
    pub fn start(command: &Command) -> Result<Self, Misbehaviour> {
        let (program, arguments) = (&command.words[0], &command.words[1..]);
        let mut wrap = CommandWrap::with_new(program, |inner| {
            inner.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        });
        // The group is killed as one, so that no process started by a port outlives it.
        #[cfg(unix)]
        wrap.wrap(process_wrap::std::ProcessGroup::leader());
        #[cfg(windows)]
        wrap.wrap(process_wrap::std::JobObject);
        let not_started = |details: &str| {
            Misbehaviour::new(FaultKind::NotStarted { program: program.clone() }, &format!(": {details}"))
        };
        let mut child = wrap.spawn().map_err(|error| not_started(&error.to_string()))?;
        let pipes = (child.stdin().take(), child.stdout().take(), child.stderr().take());
        let (Some(stdin), Some(stdout), Some(stderr)) = pipes else {
            return Err(not_started("it has no pipes"));
        };
        let stderr_end = Arc::default();
        let shared = Arc::clone(&stderr_end);
        std::thread::spawn(move || keep_end(stderr, &shared));
        let (input, to_write) = channel::<Vec<u8>>();
        // Separate threads: a port that does not read or write blocks only them.
        std::thread::spawn(move || write_all(stdin, &to_write));
        let (sender, output) = channel();
        std::thread::spawn(move || read_lines(BufReader::new(stdout), &sender));
        let (input, timeout, stop) = (Some(input), command.timeout, Arc::default());
        Ok(Self { child, input, output, has_more: false, stderr_end, timeout, stop })
    }

    /// Stops waiting for an answer when another thread sets the flag.
    #[must_use]
    pub fn stopped_by(mut self, stop: Arc<AtomicBool>) -> Self {
        self.stop = stop;
        self
    }

    fn exchange<T: DeserializeOwned>(&mut self, ask: &Ask) -> Result<T, Misbehaviour> {
        let question = word_of(ask);
        let unrequested = if self.has_more {
            self.output.recv_timeout(self.timeout).ok()
        } else {
            self.output.try_recv().ok()
        };
        match unrequested {
            None | Some(Output::End(_)) => {}
            Some(Output::TooLong) => return Err(self.misbehaviour(FaultKind::Unrequested, "")),
            Some(Output::Line(line, _)) => {
                let details = format!(": `{}`", quote(&line));
                return Err(self.misbehaviour(FaultKind::Unrequested, &details));
            }
        }
        let mut line = serde_json::to_vec(ask)
            .map_err(|error| Misbehaviour::new(FaultKind::Other(error.to_string()), ""))?;
        line.push(b'\n');
        if let Some(input) = &self.input {
            // If the port has ended, the call of `wait` below reports this.
            let _ = input.send(line);
        }
        let line = self.wait(question)?;
        serde_json::from_slice(&line).map_err(|error| {
            let details = format!(" ({error}): `{}`", quote(&line));
            self.misbehaviour(FaultKind::Unreadable { question }, &details)
        })
    }

    fn wait(&mut self, question: &'static str) -> Result<Vec<u8>, Misbehaviour> {
        let timeout = if question == "hello" { self.timeout * START_FACTOR } else { self.timeout };
        let until = Instant::now() + timeout;
        let mut has_ended = false;
        loop {
            let wait = until.saturating_duration_since(Instant::now()).min(POLL_INTERVAL);
            match self.output.recv_timeout(wait) {
                Ok(Output::Line(line, has_more)) => {
                    self.has_more = has_more;
                    return Ok(line);
                }
                Ok(Output::TooLong) => {
                    let kind = FaultKind::TooLong { question, limit: MAX_LINE_LENGTH };
                    return Err(self.misbehaviour(kind, ""));
                }
                Ok(Output::End(rest)) => return Err(self.ended(question, &rest)),
                Err(RecvTimeoutError::Disconnected) => return Err(self.ended(question, b"")),
                // The port's children may keep its output open after it has ended.
                Err(RecvTimeoutError::Timeout) if has_ended => return Err(self.ended(question, b"")),
                Err(RecvTimeoutError::Timeout)
                    if Instant::now() >= until || self.stop.load(Ordering::Relaxed) =>
                {
                    let kind = FaultKind::NoAnswer { question, limit_ms: timeout.as_millis() };
                    return Err(self.misbehaviour(kind, ""));
                }
                Err(RecvTimeoutError::Timeout) => has_ended = matches!(self.child.try_wait(), Ok(Some(_))),
            }
        }
    }

    fn ended(&mut self, question: &'static str, rest: &[u8]) -> Misbehaviour {
        let rest =
            if rest.is_empty() { String::new() } else { format!(", after half a line: `{}`", quote(rest)) };
        let until = Instant::now() + EXIT_TIMEOUT;
        let kind = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break FaultKind::Ended { status: status.to_string(), question },
                Ok(None) if Instant::now() < until => std::thread::sleep(Duration::from_millis(5)),
                _ => break FaultKind::ClosedOutput { question },
            }
        };
        self.misbehaviour(kind, &rest)
    }

    /// Creates a misbehaviour with the end of stderr.
    fn misbehaviour(&self, kind: FaultKind, details: &str) -> Misbehaviour {
        // The last output on stderr often gives the reason; it may still be in transit.
        std::thread::sleep(Duration::from_millis(20));
        let stderr_end = self.stderr_end.lock().unwrap_or_else(PoisonError::into_inner);
        let bytes: Vec<u8> = stderr_end.iter().copied().collect();
        let stderr = String::from_utf8_lossy(&bytes).trim_end().to_owned();
        Misbehaviour { stderr, ..Misbehaviour::new(kind, details) }
    }
}

impl Link for Process {
    fn hello(&mut self) -> Result<Hello, Misbehaviour> {
        let hello: Hello = self.exchange(&Ask::Hello { protocol: PROTOCOL.into() })?;
        if hello.protocol == PROTOCOL {
            Ok(hello)
        } else {
            let protocol = shorten(&hello.protocol, 60);
            Err(self.misbehaviour(FaultKind::OtherProtocol { protocol, expected: PROTOCOL }, ""))
        }
    }

    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour> {
        self.exchange(ask)
    }

    fn hurry(&mut self) {
        self.timeout /= HURRY_FACTOR;
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if let Some(input) = self.input.take()
            && let Ok(bye) = serde_json::to_vec(&Ask::Bye)
        {
            let _ = input.send([bye, b"\n".to_vec()].concat());
        }
        let until = Instant::now() + EXIT_TIMEOUT;
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(1));
        }
        // Kill the whole group, even if its leader has already ended.
        let _ = self.child.start_kill();
        let _ = self.child.wait();
    }
}

fn word_of(ask: &Ask) -> &'static str {
    match ask {
        Ask::Hello { .. } => "hello",
        Ask::Reset(_) => "reset",
        Ask::Step { .. } => "step",
        Ask::Act { .. } => "act",
        Ask::Observe => "observe",
        Ask::Metrics => "metrics",
        Ask::Back => "back",
        Ask::History => "history",
        Ask::Bye => "bye",
    }
}

fn quote(line: &[u8]) -> String {
    let start = &line[..line.len().min(4 * MAX_QUOTE_LENGTH)];
    shorten(String::from_utf8_lossy(start).trim_end(), MAX_QUOTE_LENGTH)
}

fn write_all(mut stdin: impl Write, lines: &Receiver<Vec<u8>>) {
    for line in lines {
        if stdin.write_all(&line).and_then(|()| stdin.flush()).is_err() {
            return;
        }
    }
}

fn read_lines(mut stdout: BufReader<impl Read>, sender: &Sender<Output>) {
    loop {
        let mut line = Vec::new();
        let limit = MAX_LINE_LENGTH as u64 + 1;
        let end = stdout.by_ref().take(limit).read_until(b'\n', &mut line).is_err() || !line.ends_with(b"\n");
        let next = match end {
            true if line.len() > MAX_LINE_LENGTH => Output::TooLong,
            true => Output::End(line),
            false => Output::Line(line, !stdout.buffer().is_empty()),
        };
        if sender.send(next).is_err() || end {
            return;
        }
    }
}

fn keep_end(mut stderr: impl Read, stderr_end: &Mutex<VecDeque<u8>>) {
    let mut block = [0; 4096];
    while let Ok(count @ 1..) = stderr.read(&mut block) {
        let mut stderr_end = stderr_end.lock().unwrap_or_else(PoisonError::into_inner);
        stderr_end.extend(&block[..count]);
        let surplus = stderr_end.len().saturating_sub(MAX_STDERR_LENGTH);
        stderr_end.drain(..surplus);
    }
}
