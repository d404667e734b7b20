//! A port in a process of its own, which may do anything but keep us waiting.

use std::collections::VecDeque;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::Stdio;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pogema_core::{Error, shorten};
use process_wrap::std::{ChildWrapper, CommandWrap};
use serde::de::DeserializeOwned;

use super::link::{Link, Misbehaviour};
use super::protocol::{Ask, Hello, PROTOCOL, Reply};

/// A longer line is no answer. Units: bytes.
const LONGEST_LINE: usize = 1 << 26;
/// So much of stderr is told. Units: bytes.
const LONGEST_TAIL: usize = 2048;
/// So much of a bad answer is quoted. Units: characters.
const LONGEST_QUOTE: usize = 120;
/// So long a port may take to start, if answers are to come sooner: imports alone can take seconds.
const START_UP: Duration = Duration::from_secs(60);
/// How long a port may take to end by itself when it is told goodbye.
const GRACE: Duration = Duration::from_millis(500);
/// How often it is looked whether a silent port is still there.
const GLANCE: Duration = Duration::from_millis(50);

/// How a port is started.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Command {
    /// The command line as it was given.
    pub text: String,
    words: Vec<String>,
    timeout: Duration,
}

impl Command {
    /// A command line, split as a shell would, and the time that each answer may take.
    ///
    /// # Errors
    /// [`Error::Config`] for an empty line or an open quote.
    pub fn new(text: &str, timeout: Duration) -> Result<Self, Error> {
        let expected = "a command line, as for a shell";
        let words = shell_words::split(text).map_err(|_| Error::config("port", text, expected))?;
        if words.is_empty() {
            return Err(Error::config("port", text, expected));
        }
        Ok(Self { text: text.into(), words, timeout })
    }
}

/// A port in a child process, with all that the process starts in turn.
#[derive(Debug)]
pub struct Process {
    child: Box<dyn ChildWrapper>,
    input: Option<Sender<Vec<u8>>>,
    output: Receiver<Said>,
    /// Whether more had come behind the last answer.
    is_followed: bool,
    tail: Arc<Mutex<VecDeque<u8>>>,
    timeout: Duration,
}

/// What came from the port's stdout.
#[derive(Debug)]
enum Said {
    /// A line, and whether more had come behind it.
    Line(Vec<u8>, bool),
    TooLong,
    /// The end, and what stood behind the last line.
    End(Vec<u8>),
}

impl Process {
    /// Starts a port.
    ///
    /// # Errors
    /// If there is no such program.
    pub fn start(command: &Command) -> Result<Self, Misbehaviour> {
        let (program, arguments) = (&command.words[0], &command.words[1..]);
        let mut wrap = CommandWrap::with_new(program, |inner| {
            inner.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        });
        // Killed as one, so that nothing a port has started outlives it.
        #[cfg(unix)]
        wrap.wrap(process_wrap::std::ProcessGroup::leader());
        #[cfg(windows)]
        wrap.wrap(process_wrap::std::JobObject);
        let cannot =
            |error: &std::io::Error| Misbehaviour::new(format!("`{program}` cannot be started: {error}"));
        let mut child = wrap.spawn().map_err(|error| cannot(&error))?;
        let pipes = (child.stdin().take(), child.stdout().take(), child.stderr().take());
        let (Some(stdin), Some(stdout), Some(stderr)) = pipes else {
            return Err(Misbehaviour::new(format!("`{program}` has no pipes")));
        };
        let tail = Arc::default();
        let shared = Arc::clone(&tail);
        std::thread::spawn(move || keep_tail(stderr, &shared));
        let (input, to_write) = channel::<Vec<u8>>();
        // On threads of their own: a port that does not read, or does not write, blocks only them.
        std::thread::spawn(move || write_all(stdin, &to_write));
        let (said, output) = channel();
        std::thread::spawn(move || read_lines(BufReader::new(stdout), &said));
        Ok(Self { child, input: Some(input), output, is_followed: false, tail, timeout: command.timeout })
    }

    fn exchange<T: DeserializeOwned>(&mut self, ask: &Ask) -> Result<T, Misbehaviour> {
        let kind = kind_of(ask);
        let unasked = if self.is_followed {
            self.output.recv_timeout(self.timeout).ok()
        } else {
            self.output.try_recv().ok()
        };
        match unasked {
            None | Some(Said::End(_)) => {}
            Some(Said::TooLong) => return Err(self.saw("wrote a line that nobody asked for".into())),
            Some(Said::Line(line, _)) => {
                return Err(self.saw(format!("wrote a line that nobody asked for: `{}`", quote(&line))));
            }
        }
        let mut line = serde_json::to_vec(ask).map_err(|error| Misbehaviour::new(error.to_string()))?;
        line.push(b'\n');
        if let Some(input) = &self.input {
            // A port that is gone is noticed when its answer stays out.
            let _ = input.send(line);
        }
        let line = self.wait(kind)?;
        serde_json::from_slice(&line).map_err(|error| {
            self.saw(format!("gave no readable answer to `{kind}` ({error}): `{}`", quote(&line)))
        })
    }

    fn wait(&mut self, kind: &str) -> Result<Vec<u8>, Misbehaviour> {
        let timeout = if kind == "hello" { self.timeout.max(START_UP) } else { self.timeout };
        let until = Instant::now() + timeout;
        let mut has_ended = false;
        loop {
            let patience = until.saturating_duration_since(Instant::now()).min(GLANCE);
            match self.output.recv_timeout(patience) {
                Ok(Said::Line(line, is_followed)) => {
                    self.is_followed = is_followed;
                    return Ok(line);
                }
                Ok(Said::TooLong) => {
                    return Err(
                        self.saw(format!("answered `{kind}` with a line of more than {LONGEST_LINE} bytes"))
                    );
                }
                Ok(Said::End(rest)) => return Err(self.ended(kind, &rest)),
                Err(RecvTimeoutError::Disconnected) => return Err(self.ended(kind, b"")),
                // Its children may keep its output open after its own end.
                Err(RecvTimeoutError::Timeout) if has_ended => return Err(self.ended(kind, b"")),
                Err(RecvTimeoutError::Timeout) if Instant::now() >= until => {
                    let seconds = timeout.as_secs_f64();
                    return Err(self.saw(format!("gave no answer to `{kind}` within {seconds} s")));
                }
                Err(RecvTimeoutError::Timeout) => has_ended = matches!(self.child.try_wait(), Ok(Some(_))),
            }
        }
    }

    fn ended(&mut self, kind: &str, rest: &[u8]) -> Misbehaviour {
        let rest =
            if rest.is_empty() { String::new() } else { format!(", after half a line: `{}`", quote(rest)) };
        let until = Instant::now() + GRACE;
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break format!("ended ({status})"),
                Ok(None) if Instant::now() < until => std::thread::sleep(Duration::from_millis(5)),
                _ => break "closed its output".into(),
            }
        };
        self.saw(format!("{status} instead of answering `{kind}`{rest}"))
    }

    /// What was seen, with the end of stderr.
    fn saw(&self, what: String) -> Misbehaviour {
        // What a port writes last is often why; it may still be on its way.
        std::thread::sleep(Duration::from_millis(20));
        let tail = self.tail.lock().unwrap_or_else(PoisonError::into_inner);
        let bytes: Vec<u8> = tail.iter().copied().collect();
        Misbehaviour { what, stderr: String::from_utf8_lossy(&bytes).trim_end().to_owned() }
    }
}

impl Link for Process {
    fn hello(&mut self) -> Result<Hello, Misbehaviour> {
        let hello: Hello = self.exchange(&Ask::Hello { protocol: PROTOCOL.into() })?;
        if hello.protocol == PROTOCOL {
            Ok(hello)
        } else {
            Err(self.saw(format!("speaks `{}`, expected `{PROTOCOL}`", shorten(&hello.protocol, 60))))
        }
    }

    fn ask(&mut self, ask: &Ask) -> Result<Reply, Misbehaviour> {
        self.exchange(ask)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if let Some(input) = self.input.take()
            && let Ok(bye) = serde_json::to_vec(&Ask::Bye)
        {
            let _ = input.send([bye, b"\n".to_vec()].concat());
        }
        let until = Instant::now() + GRACE;
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(1));
        }
        // The whole group, even if its leader is gone already.
        let _ = self.child.start_kill();
        let _ = self.child.wait();
    }
}

fn kind_of(ask: &Ask) -> &'static str {
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
    let start = &line[..line.len().min(4 * LONGEST_QUOTE)];
    shorten(&String::from_utf8_lossy(start), LONGEST_QUOTE)
}

fn write_all(mut stdin: impl Write, lines: &Receiver<Vec<u8>>) {
    for line in lines {
        if stdin.write_all(&line).and_then(|()| stdin.flush()).is_err() {
            return;
        }
    }
}

fn read_lines(mut stdout: BufReader<impl Read>, said: &Sender<Said>) {
    loop {
        let mut line = Vec::new();
        let longest = LONGEST_LINE as u64 + 1;
        let end =
            stdout.by_ref().take(longest).read_until(b'\n', &mut line).is_err() || !line.ends_with(b"\n");
        let next = match end {
            true if line.len() > LONGEST_LINE => Said::TooLong,
            true => Said::End(line),
            false => Said::Line(line, !stdout.buffer().is_empty()),
        };
        if said.send(next).is_err() || end {
            return;
        }
    }
}

fn keep_tail(mut stderr: impl Read, tail: &Mutex<VecDeque<u8>>) {
    let mut block = [0; 4096];
    while let Ok(count @ 1..) = stderr.read(&mut block) {
        let mut tail = tail.lock().unwrap_or_else(PoisonError::into_inner);
        tail.extend(&block[..count]);
        let surplus = tail.len().saturating_sub(LONGEST_TAIL);
        tail.drain(..surplus);
    }
}
