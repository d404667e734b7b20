//! The next instance of each lane, made while the lane still plays.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use pogema_core::{Error, Instance};

/// Where the instances of a batch come from.
///
/// What it gives may depend on the lane and on the number of the episode, and on nothing else, so that a batch
/// plays the same episodes on any number of threads. Any such function is one.
pub trait Instances: Send + Sync {
    /// The instance of an episode of a lane, both counted from 0.
    ///
    /// # Errors
    /// If there is none.
    fn instance(&self, lane: usize, episode: u64) -> Result<Instance, Error>;
}

impl<F: Fn(usize, u64) -> Result<Instance, Error> + Send + Sync> Instances for F {
    fn instance(&self, lane: usize, episode: u64) -> Result<Instance, Error> {
        self(lane, episode)
    }
}

/// How far the next instance of a lane is.
enum Progress {
    /// Nobody has begun it.
    Wanted(u64),
    /// The background thread is at it.
    InWork,
    Ready(Result<Instance, Error>),
    Taken,
}

struct Slot {
    progress: Mutex<Progress>,
    ready: Condvar,
}

impl Slot {
    fn lock(&self) -> MutexGuard<'_, Progress> {
        // A panic of the source is caught, so that no progress is ever half written.
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

struct Shared {
    source: Box<dyn Instances>,
    slots: Vec<Slot>,
    is_over: AtomicBool,
}

impl Shared {
    fn make(&self, lane: usize, episode: u64) -> Result<Instance, Error> {
        let made = catch_unwind(AssertUnwindSafe(|| self.source.instance(lane, episode)));
        made.unwrap_or_else(|_| {
            Err(Error::instance(format!("the source panicked at lane {lane}, episode {episode}")))
        })
    }

    fn prepare(&self, lane: usize) {
        let mut progress = self.slots[lane].lock();
        let Progress::Wanted(episode) = *progress else { return };
        *progress = Progress::InWork;
        drop(progress);
        let made = self.make(lane, episode);
        *self.slots[lane].lock() = Progress::Ready(made);
        self.slots[lane].ready.notify_all();
    }
}

/// Makes instances ahead, on a thread of its own.
pub struct Preparer {
    shared: Arc<Shared>,
    /// Lanes that want an instance; closed when the batch is dropped.
    wanted: Option<Sender<usize>>,
    thread: Option<JoinHandle<()>>,
}

impl Preparer {
    /// Begins with the first episode of each lane.
    pub fn new(source: Box<dyn Instances>, num_lanes: usize) -> Result<Self, Error> {
        let slot = |_| Slot { progress: Mutex::new(Progress::Wanted(0)), ready: Condvar::new() };
        let slots = (0..num_lanes).map(slot).collect();
        let shared = Arc::new(Shared { source, slots, is_over: AtomicBool::new(false) });
        let (wanted, lanes) = channel();
        let thread = std::thread::Builder::new().name("pogema instances".into());
        let theirs = Arc::clone(&shared);
        let thread = thread
            .spawn(move || work(&theirs, &lanes))
            .map_err(|error| Error::external("thread that prepares instances", error))?;
        Ok(Self { shared, wanted: Some(wanted), thread: Some(thread) })
    }

    /// The next instance of a lane: at once if it is ready, else made here, or waited for if it is in work.
    pub fn take(&self, lane: usize) -> Result<Instance, Error> {
        let slot = &self.shared.slots[lane];
        let mut progress = slot.lock();
        loop {
            match std::mem::replace(&mut *progress, Progress::Taken) {
                Progress::Ready(made) => return made,
                Progress::Wanted(episode) => {
                    drop(progress);
                    return self.shared.make(lane, episode);
                }
                Progress::InWork => {
                    *progress = Progress::InWork;
                    progress = slot.ready.wait(progress).unwrap_or_else(PoisonError::into_inner);
                }
                // INVARIANT: a lane asks for its next instance before it takes it.
                Progress::Taken => return Err(Error::external("batch", "no instance was requested")),
            }
        }
    }

    /// Asks for the instance of an episode.
    pub fn want(&self, lane: usize, episode: u64) {
        *self.shared.slots[lane].lock() = Progress::Wanted(episode);
        if let Some(wanted) = &self.wanted {
            // Without the thread the lane makes its instance itself.
            let _ = wanted.send(lane);
        }
    }
}

fn work(shared: &Shared, lanes: &Receiver<usize>) {
    for lane in lanes {
        if shared.is_over.load(Relaxed) {
            return;
        }
        shared.prepare(lane);
    }
}

impl Drop for Preparer {
    fn drop(&mut self) {
        self.shared.is_over.store(true, Relaxed);
        self.wanted = None;
        if let Some(thread) = self.thread.take() {
            // INVARIANT: the thread catches the panics of the source and has none of its own.
            let _ = thread.join();
        }
    }
}
