//! A port that is checked, and the processes that answer for it.

use super::claims::Mode;
use super::judge::{Judged, judge};
use super::link::{Link, Misbehaviour};
use super::plan::Plan;
use super::protocol::{Hello, Profile};
use crate::request::{Request, Response};

/// A port, and a function that starts it.
pub struct Subject<'a> {
    /// The command line; names the port until it answers `hello`.
    pub command: String,
    /// The words of a command that checks this port; a replay adds `--case` and a file.
    pub replay: Vec<String>,
    /// Starts the port for each worker. Starts it again after each misbehaviour except a missing answer to `hello`, and
    /// before counterexamples are shrunk or replayed.
    pub start: Box<dyn Fn() -> Result<Box<dyn Link>, Misbehaviour> + Sync + 'a>,
}

/// The process of a port, started when it is needed and again after each misbehaviour.
pub struct Worker<'a> {
    subject: &'a Subject<'a>,
    profiles: &'a [Profile],
    hurries: bool,
    running: Option<Running>,
    /// The missing answer to `hello`, after which the port is not started again.
    mute: Option<Misbehaviour>,
}

struct Running {
    link: Box<dyn Link>,
    /// The name and claims of the port, limited to the profiles of the plan.
    hello: Hello,
    /// The answer of the port.
    full_hello: Hello,
}

impl<'a> Worker<'a> {
    pub fn new(subject: &'a Subject<'a>, plan: &'a Plan) -> Self {
        Self { subject, profiles: &plan.profiles, hurries: false, running: None, mute: None }
    }

    /// Ends the process, so that the next question goes to a new one, and sets whether the new one is hurried.
    pub fn restart(&mut self, hurries: bool) {
        self.running = None;
        self.hurries = hurries;
    }

    /// Returns the name and claims of the port: limited to the profiles of the plan, and in full.
    pub fn hello(&mut self) -> Result<(&Hello, &Hello), Misbehaviour> {
        self.running().map(|running| (&running.hello, &running.full_hello))
    }

    /// Checks the port with one request. A misbehaviour ends the process.
    pub fn judge(&mut self, mode: Mode, request: &Request, expected: &Response) -> Judged {
        let judged = match self.running() {
            Ok(running) => judge(running.link.as_mut(), &running.hello, mode, request, expected),
            Err(fault) => Judged { fault: Some(fault), request: request.clone(), ..Judged::default() },
        };
        if judged.fault.is_some() {
            self.running = None;
        }
        judged
    }

    fn running(&mut self) -> Result<&mut Running, Misbehaviour> {
        let running = match self.running.take() {
            Some(running) => running,
            None => self.mute.clone().map_or_else(|| self.start(), Err).inspect_err(|fault| {
                self.mute = fault.is_hang().then(|| fault.clone());
            })?,
        };
        Ok(self.running.insert(running))
    }

    fn start(&self) -> Result<Running, Misbehaviour> {
        let mut link = (self.subject.start)()?;
        let full_hello = link.hello()?;
        let mut hello = full_hello.clone();
        if !self.profiles.is_empty() {
            hello.profiles.retain(|profile| *profile == Profile::Core || self.profiles.contains(profile));
        }
        if self.hurries {
            link.hurry();
        }
        Ok(Running { link, hello, full_hello })
    }
}
