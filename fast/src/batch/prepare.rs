//! Preparation of the next instance of each lane while the lane still plays.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use pogema_core::{Error, Instance};

/// A source of the instances of a batch.
///
/// An instance may depend only on the lane and on the number of the episode, so that a batch plays the same episodes on
/// any number of threads. Functions of these two numbers implement this trait.
pub trait Instances: Send + Sync {
    /// Returns the instance of an episode of a lane, both counted from 0.
    ///
    /// # Errors
    /// If the source has no such instance.
    fn instance(&self, lane: usize, episode: u64) -> Result<Instance, Error>;
}

impl<F: Fn(usize, u64) -> Result<Instance, Error> + Send + Sync> Instances for F {
    fn instance(&self, lane: usize, episode: u64) -> Result<Instance, Error> {
        self(lane, episode)
    }
}

/// The progress of the next instance of a lane.
enum Progress {
    /// The instance of this episode is requested, but no thread has started on it.
    Requested(u64),
    /// The background thread is generating the instance.
    Generating,
    Ready(Result<Instance, Error>),
    Taken,
}

struct Slot {
    progress: Mutex<Progress>,
    ready: Condvar,
}

impl Slot {
    fn lock(&self) -> MutexGuard<'_, Progress> {
        // A panic of the source is caught, so a poisoned lock still holds a valid progress.
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

struct Shared {
    source: Mutex<Arc<dyn Instances>>,
    slots: Vec<Slot>,
    is_over: AtomicBool,
}

impl Shared {
    fn make(&self, lane: usize, episode: u64) -> Result<Instance, Error> {
        let source = Arc::clone(&self.source.lock().unwrap_or_else(PoisonError::into_inner));
        make(&*source, lane, episode)
    }

    fn prepare(&self, lane: usize) {
        let mut progress = self.slots[lane].lock();
        let Progress::Requested(episode) = *progress else { return };
        *progress = Progress::Generating;
        drop(progress);
        let made = self.make(lane, episode);
        let mut progress = self.slots[lane].lock();
        // If the progress has changed, the lane has requested another instance meanwhile, and the generated instance
        // may come from an old source.
        if matches!(*progress, Progress::Generating) {
            *progress = Progress::Ready(made);
            self.slots[lane].ready.notify_all();
        }
    }
}

/// Asks a source for an instance; a panic of the source becomes an error.
pub fn make(source: &dyn Instances, lane: usize, episode: u64) -> Result<Instance, Error> {
    let made = catch_unwind(AssertUnwindSafe(|| source.instance(lane, episode)));
    made.unwrap_or_else(|_| {
        Err(Error::instance(format!("the source panicked at lane {lane}, episode {episode}")))
    })
}

/// A background thread that generates instances in advance.
pub struct Preparer {
    shared: Arc<Shared>,
    /// The lanes with a requested instance. The channel closes when the preparer is dropped.
    requests: Option<Sender<usize>>,
    thread: Option<JoinHandle<()>>,
}

impl Preparer {
    /// Starts the thread. The first episode of each lane counts as requested, and the call that takes it generates it.
    pub fn new(source: Arc<dyn Instances>, num_lanes: usize) -> Result<Self, Error> {
        let slot = |_| Slot { progress: Mutex::new(Progress::Requested(0)), ready: Condvar::new() };
        let slots = (0..num_lanes).map(slot).collect();
        let shared = Arc::new(Shared { source: Mutex::new(source), slots, is_over: AtomicBool::new(false) });
        let (requests, lanes) = channel();
        let thread = std::thread::Builder::new().name("pogema instances".into());
        let theirs = Arc::clone(&shared);
        let thread = thread
            .spawn(move || work(&theirs, &lanes))
            .map_err(|error| Error::external("thread that prepares instances", error))?;
        Ok(Self { shared, requests: Some(requests), thread: Some(thread) })
    }

    /// Takes the next instance of a lane.
    ///
    /// If it is in progress, this call waits for it. If the background thread has not started on it, this call
    /// generates it.
    pub fn take(&self, lane: usize) -> Result<Instance, Error> {
        let slot = &self.shared.slots[lane];
        let mut progress = slot.lock();
        loop {
            match std::mem::replace(&mut *progress, Progress::Taken) {
                Progress::Ready(made) => return made,
                Progress::Requested(episode) => {
                    drop(progress);
                    return self.shared.make(lane, episode);
                }
                Progress::Generating => {
                    *progress = Progress::Generating;
                    progress = slot.ready.wait(progress).unwrap_or_else(PoisonError::into_inner);
                }
                // INVARIANT: a lane requests its next instance before it takes it.
                Progress::Taken => return Err(Error::external("batch", "no instance was requested")),
            }
        }
    }

    /// Replaces the source. Instances that are ready or in progress still come from the old one.
    pub fn replace(&self, source: Arc<dyn Instances>) {
        *self.shared.source.lock().unwrap_or_else(PoisonError::into_inner) = source;
    }

    /// Requests the instance of an episode. This instance replaces any other instance of the lane.
    pub fn request(&self, lane: usize, episode: u64) {
        *self.shared.slots[lane].lock() = Progress::Requested(episode);
        if let Some(requests) = &self.requests {
            // If the thread has ended, the lane generates its instance itself.
            let _ = requests.send(lane);
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
        self.requests = None;
        if let Some(thread) = self.thread.take() {
            // INVARIANT: the thread catches panics of the source and does not panic otherwise.
            let _ = thread.join();
        }
    }
}
