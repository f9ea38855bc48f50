//! The administrator's jobs, one after the other: reading bundles takes milliseconds, which must not stand before a query,
//! and whoever asks for it a thousand times must not get a thousand threads. One job runs and one waits; the same question as
//! the one that waits is answered with it, any other is refused.

use std::fmt;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::runtime::Handle;
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::{mpsc, oneshot};
use tokio::time::Instant;

use super::{AUDIT, Reloader};
use crate::service::access::Caller;
use wade_wire::Refusal;
use wade_wire::UnknownVehicle;
use wade_wire::proto::Reloaded;

/// Longest pause between two jobs.
const LONGEST_PAUSE: Duration = Duration::from_secs(1);

/// What an administrator asks for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Job {
    /// Read a vehicle's bundle again; all where the name is empty.
    Reload {
        /// The vehicle.
        vehicle: String,
        /// Only where it is read from this folder; from any where the path is empty.
        bundle: PathBuf,
    },
    /// Serve a vehicle no more.
    Unload(String),
}

impl fmt::Display for Job {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reload { vehicle, .. } if vehicle.is_empty() => f.write_str("reload every vehicle"),
            Self::Reload { vehicle, bundle } if bundle.as_os_str().is_empty() => {
                write!(f, "reload {vehicle}")
            }
            Self::Reload { vehicle, bundle } => write!(f, "reload {vehicle} from {}", bundle.display()),
            Self::Unload(vehicle) => write!(f, "unload {vehicle}"),
        }
    }
}

impl Job {
    /// Reads a vehicle's bundle again, whichever folder it is in.
    pub fn reload(vehicle: String) -> Self {
        Self::Reload { vehicle, bundle: PathBuf::new() }
    }

    /// Whether this job does what the other one asks for.
    fn covers(&self, other: &Self) -> bool {
        let every = |job: &Self| match job {
            Self::Reload { vehicle, bundle } => vehicle.is_empty() && bundle.as_os_str().is_empty(),
            Self::Unload(_) => false,
        };
        let any_folder = matches!(other, Self::Reload { bundle, .. } if bundle.as_os_str().is_empty());
        self == other || (every(self) && any_folder)
    }
}

type Outcome = Result<Vec<Reloaded>, UnknownVehicle>;

#[derive(Debug)]
struct Waiting {
    job: Job,
    askers: Vec<Asker>,
}

/// Who waits for a job.
#[derive(Debug)]
struct Asker {
    by: String,
    /// What he asked for, which the job covers.
    job: String,
    sender: oneshot::Sender<Outcome>,
}

impl Asker {
    fn note(&self, refused: &str) {
        let Self { by, job, .. } = self;
        tracing::info!(target: AUDIT, by, job, refused, "administration");
    }
}

#[derive(Debug, Default)]
struct Queue {
    running: bool,
    waiting: Option<Waiting>,
}

/// The jobs of a server.
#[derive(Debug)]
pub struct Jobs {
    reloader: Arc<Reloader>,
    queue: Arc<Mutex<Queue>>,
    /// Wakes whoever does them, who ends with the last of these.
    wake: mpsc::Sender<()>,
}

impl Jobs {
    /// No job yet, and the task that will do them on this runtime, whose thread reads files meanwhile.
    pub fn start(reloader: Arc<Reloader>, runtime: &Handle) -> Arc<Self> {
        let (wake, mut woken) = mpsc::channel(1);
        let worker = Worker { reloader: Arc::clone(&reloader), queue: Arc::default() };
        let queue = Arc::clone(&worker.queue);
        runtime.spawn(async move {
            while woken.recv().await.is_some() {
                worker.work().await;
            }
        });
        Arc::new(Self { reloader, queue, wake })
    }

    /// Has a job done for a caller, and waits for it.
    pub async fn run(&self, job: Job, caller: Option<&Caller>) -> Result<Vec<Reloaded>, Refusal> {
        let asked = job.clone();
        let by = caller.map_or_else(|| "nobody".to_owned(), ToString::to_string);
        let outcome = self.submit(job, by)?.await;
        let mut reloaded = outcome.map_err(|_| Refusal::TooManyJobs)??;
        if let Job::Reload { vehicle, .. } = asked
            && !vehicle.is_empty()
        {
            reloaded.retain(|one| one.vehicle == vehicle);
            if reloaded.is_empty() {
                self.reloader.engine.vehicle(&vehicle)?;
            }
        }
        Ok(reloaded)
    }

    /// Puts a job in its place: before the task, beside one that waits, or nowhere.
    fn submit(&self, job: Job, by: String) -> Result<oneshot::Receiver<Outcome>, Refusal> {
        let (sender, answer) = oneshot::channel();
        let asker = Asker { by, job: job.to_string(), sender };
        let mut queue = self.lock();
        match &mut queue.waiting {
            Some(waiting) if waiting.job.covers(&job) => waiting.askers.push(asker),
            Some(_) => {
                asker.note("another job waits");
                return Err(Refusal::TooManyJobs);
            }
            None => queue.waiting = Some(Waiting { job, askers: vec![asker] }),
        }
        // a task that was woken and has not looked yet finds this job as well
        if let Err(TrySendError::Closed(())) = self.wake.try_send(()) {
            queue.waiting = None;
            return Err(Refusal::TooManyJobs);
        }
        note(&queue, &self.reloader);
        Ok(answer)
    }

    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn note(queue: &Queue, reloader: &Reloader) {
    let jobs = usize::from(queue.running) + usize::from(queue.waiting.is_some());
    reloader.metrics.set_admin_jobs(jobs);
}

/// What the task has.
#[derive(Debug)]
struct Worker {
    reloader: Arc<Reloader>,
    queue: Arc<Mutex<Queue>>,
}

impl Worker {
    /// Does what waits until nothing does.
    async fn work(&self) {
        while let Some(Waiting { job, askers }) = self.next() {
            let start = Instant::now();
            let outcome = self.perform(&job);
            let elapsed = start.elapsed();
            let refused = match &outcome {
                Ok(vehicles) => {
                    let refused = vehicles.iter().filter(|one| !one.refusal.is_empty());
                    refused.map(|one| one.vehicle.as_str()).collect::<Vec<_>>().join(" ")
                }
                Err(unknown) => unknown.to_string(),
            };
            for asker in askers {
                // here, since it was done: whoever asked may have hung up
                asker.note(&refused);
                let _ = asker.sender.send(outcome.clone());
            }
            let waits = self.lock().waiting.is_some();
            if waits {
                // whoever asks without end takes half a core at most
                tokio::time::sleep(elapsed.min(LONGEST_PAUSE)).await;
            }
        }
    }

    fn next(&self) -> Option<Waiting> {
        let mut queue = self.lock();
        let waiting = queue.waiting.take();
        queue.running = waiting.is_some();
        note(&queue, &self.reloader);
        waiting
    }

    fn perform(&self, job: &Job) -> Outcome {
        match job {
            Job::Reload { vehicle, bundle } => {
                let reloaded = if bundle.as_os_str().is_empty() {
                    self.reloader.reload(vehicle)?
                } else {
                    self.reloader.reload_from(vehicle, bundle)?
                };
                let reloaded = reloaded.into_iter().map(|reload| Reloaded {
                    vehicle: reload.vehicle,
                    bundle_version: reload.served_version,
                    refusal: reload.refusal.map(|refusal| refusal.to_string()).unwrap_or_default(),
                    elsewhere: reload.elsewhere,
                });
                Ok(reloaded.collect())
            }
            Job::Unload(vehicle) => self.reloader.unload(vehicle).map(|()| Vec::new()),
        }
    }

    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::Job;

    #[test]
    fn reading_every_bundle_covers_each_and_nothing_else() {
        let from = |name: &str, bundle: &str| Job::Reload { vehicle: name.into(), bundle: bundle.into() };
        let reload = |name: &str| from(name, "");
        assert!(reload("").covers(&reload("husky")) && reload("husky").covers(&reload("husky")));
        assert!(!reload("husky").covers(&reload("")) && !reload("husky").covers(&reload("warthog")));
        assert!(!reload("").covers(&Job::Unload("husky".into())));
        let elsewhere = from("husky", "/srv/husky");
        assert!(
            elsewhere.covers(&elsewhere)
                && !reload("").covers(&elsewhere)
                && !elsewhere.covers(&reload("husky"))
        );
    }
}
