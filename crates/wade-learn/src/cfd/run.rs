//! Many cases at a time, resumable: a case is done when its outcome is written.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};

use super::case::{self, Inputs, Settings};
use super::claim::Claim;
use super::openfoam::OpenFoam;
use super::placement::Placement;
use super::plan::{Campaign, Case};
use super::solve::{Outcome, SolveError, method, solve};
use crate::files::write_whole;
use wade_core::digest::sha256;
use wade_core::vehicle::Vehicle;

/// Disk that one case takes while it runs, with room [bytes].
pub const DISK_PER_CASE: u64 = 2 << 30;

/// File in a case folder with the hash of what wade wrote there.
const SEAL: &str = "inputs.sha256";

/// What happens, as it happens.
#[derive(Debug)]
pub enum Event {
    /// A case begins.
    Started {
        /// Its name.
        id: String,
    },
    /// It diverged and begins again with smaller steps.
    Retried {
        /// Its name.
        id: String,
        /// Why.
        reason: String,
    },
    /// Its outcome is written.
    Done {
        /// The outcome.
        outcome: Box<Outcome>,
    },
    /// Another run has it or is done with it.
    Left {
        /// Its name.
        id: String,
    },
    /// It is set aside; its folder stays.
    Failed {
        /// Its name.
        id: String,
        /// Why.
        reason: String,
    },
}

/// Why nothing was started.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A file that cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Too little room.
    #[error("{path} has {available_mib} MiB free, {jobs} cases at a time need {needed_mib} MiB")]
    Disk {
        /// Folder of the work.
        path: PathBuf,
        /// What is free.
        available_mib: u64,
        /// What is needed.
        needed_mib: u64,
        /// Cases at a time.
        jobs: usize,
    },
    /// A case folder that somebody changed.
    #[error(
        "{path} is not as wade wrote it: move it away to keep it, or remove it to compute the case again"
    )]
    Edited {
        /// The file that differs.
        path: PathBuf,
    },
    /// An outcome that does not belong to the plan.
    #[error(
        "{path} is the outcome of another state, other settings or another hull than `{id}` has now: bring them back, name another folder of work, or move it away to compute the case again"
    )]
    Foreign {
        /// The outcome.
        path: PathBuf,
        /// The case.
        id: String,
    },
    /// An outcome that does not parse.
    #[error("{path}: {message}: remove it to compute the case again")]
    Outcome {
        /// The outcome.
        path: PathBuf,
        /// Where and what.
        message: String,
    },
}

/// Where cases are computed.
#[derive(Debug, Clone)]
pub struct Work {
    /// Its folder: `<case>/` while a case runs, `outcomes/<case>.json` after it.
    pub folder: PathBuf,
    /// Keep the folders of cases that are done.
    pub keep: bool,
}

impl Work {
    /// The outcome of a case of a campaign, if it is done.
    pub fn outcome(&self, campaign: &Campaign, case: &Case) -> Result<Option<Outcome>, RunError> {
        let path = self.outcome_path(&case.id);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(RunError::Io { path, source }),
        };
        let outcome: Outcome = match serde_json::from_str(&text) {
            Ok(outcome) => outcome,
            Err(error) => return Err(RunError::Outcome { path, message: error.to_string() }),
        };
        let is_ours = outcome.case == *case
            && outcome.settings == campaign.settings
            && outcome.hull_sha256 == campaign.hull_sha256;
        if is_ours { Ok(Some(outcome)) } else { Err(RunError::Foreign { path, id: case.id.clone() }) }
    }

    /// Where the reason stands why a case was set aside.
    pub fn failure_path(&self, id: &str) -> PathBuf {
        self.folder.join("failed").join(format!("{id}.txt"))
    }

    fn outcome_path(&self, id: &str) -> PathBuf {
        self.folder.join("outcomes").join(format!("{id}.json"))
    }

    fn store(&self, outcome: &Outcome) -> Result<(), RunError> {
        let path = self.outcome_path(&outcome.case.id);
        let text = serde_json::to_string(outcome)
            .map_err(|error| RunError::Outcome { path: path.clone(), message: error.to_string() })?;
        put(&path, &text)
    }

    /// Refuses a folder that was left by a run that was cut off and then changed.
    fn check_untouched(&self, id: &str) -> Result<(), RunError> {
        let folder = self.folder.join(id);
        let Ok(seal) = std::fs::read_to_string(folder.join(SEAL)) else {
            return Ok(());
        };
        for line in seal.lines() {
            let Some((sum, name)) = line.split_once("  ") else { continue };
            // the solver itself replaces the fields of the start and the end of the run
            let path = folder.join(name);
            let is_ours = !name.starts_with("0/") && name != "system/controlDict";
            if is_ours && std::fs::read(&path).is_ok_and(|bytes| sha256(&bytes) != sum) {
                return Err(RunError::Edited { path });
            }
        }
        Ok(())
    }
}

/// What a campaign computes with.
#[derive(Debug, Clone, Copy)]
pub struct Machine<'a> {
    /// The vehicle.
    pub vehicle: &'a Vehicle,
    /// What the cases are of, and how they are computed.
    pub campaign: &'a Campaign,
    /// The solver.
    pub solver: &'a OpenFoam,
    /// Where.
    pub work: &'a Work,
    /// Compute those again that are done by an older [`method`].
    pub outdated: bool,
}

impl Machine<'_> {
    /// Computes every case that is not done, `jobs` at a time; `hear` is called on this thread.
    ///
    /// Everything that can be refused is refused before the first case starts.
    pub fn run(&self, cases: &[Case], jobs: usize, hear: &mut dyn FnMut(Event)) -> Result<(), RunError> {
        let folder = &self.work.folder;
        std::fs::create_dir_all(folder).map_err(|source| RunError::Io { path: folder.clone(), source })?;
        check_disk(folder, jobs)?;
        let mut queue = VecDeque::new();
        for case in cases {
            if !self.is_done(case)? {
                self.work.check_untouched(&case.id)?;
                queue.push_back(case);
            }
        }
        let queue = Mutex::new(queue);
        let (sender, receiver): (Sender<Event>, Receiver<Event>) = channel();
        std::thread::scope(|scope| {
            for _ in 0..jobs.max(1) {
                let (sender, queue) = (sender.clone(), &queue);
                scope.spawn(move || {
                    while let Some(case) = next(queue) {
                        self.one(case, &sender);
                    }
                });
            }
            drop(sender);
            receiver.iter().for_each(hear);
        });
        Ok(())
    }

    fn is_done(&self, case: &Case) -> Result<bool, RunError> {
        let is_new = |outcome: Outcome| !self.outdated || outcome.method == method(case);
        Ok(self.work.outcome(self.campaign, case)?.is_some_and(is_new))
    }

    fn one(&self, case: &Case, events: &Sender<Event>) {
        // the receiver lives until every sender is gone
        let tell = |event| drop(events.send(event));
        tell(Event::Started { id: case.id.clone() });
        let fail = |reason: String| {
            // the event says it too; the file is for who comes later
            let _ = put(&self.work.failure_path(&case.id), &reason);
            tell(Event::Failed { id: case.id.clone(), reason });
        };
        let claim = match self.claim(case) {
            Ok(Some(claim)) => claim,
            Ok(None) => return tell(Event::Left { id: case.id.clone() }),
            Err(error) => return fail(error.to_string()),
        };
        let settings = self.campaign.settings;
        let mut outcome = self.attempt(case, &claim, settings, 1);
        if let Err(error) = &outcome
            && error.is_divergence()
        {
            tell(Event::Retried { id: case.id.clone(), reason: error.to_string() });
            outcome = self.attempt(case, &claim, settings.cautious(), 2);
        }
        let stored = outcome.map_err(|error| error.to_string()).and_then(|outcome| {
            self.work.store(&outcome).map_err(|error| error.to_string())?;
            Ok(outcome)
        });
        match stored {
            Ok(outcome) => {
                if !self.work.keep {
                    // only room is lost where it stays
                    let _ = std::fs::remove_dir_all(self.work.folder.join(&case.id));
                }
                let _ = std::fs::remove_file(self.work.failure_path(&case.id));
                tell(Event::Done { outcome: Box::new(outcome) });
            }
            Err(reason) => fail(reason),
        }
    }

    /// None where another run computes the case, or has done so since this one began.
    fn claim(&self, case: &Case) -> Result<Option<Claim>, RunError> {
        let (locks, folder) = (self.work.folder.join("locks"), self.work.folder.join(&case.id));
        let claim =
            Claim::take(&locks, &case.id, &folder).map_err(|source| RunError::Io { path: folder, source })?;
        Ok(if self.is_done(case)? { None } else { claim })
    }

    fn attempt(
        &self,
        case: &Case,
        claim: &Claim,
        settings: Settings,
        number: u32,
    ) -> Result<Outcome, SolveError> {
        let folder = self.work.folder.join(&case.id);
        let io = |source| SolveError::Io { path: folder.clone(), source };
        if folder.exists() {
            std::fs::remove_dir_all(&folder).map_err(io)?;
        }
        std::fs::create_dir_all(&folder).map_err(io)?;
        let inputs = Inputs { vehicle: self.vehicle, case, settings: &settings, solver: self.solver };
        let files = inputs.files(&Placement::new(self.vehicle, case));
        case::write(&folder, &files).map_err(io)?;
        // last, so that it stands for whole files
        let seal: String =
            files.iter().map(|(name, text)| format!("{}  {name}\n", sha256(text.as_bytes()))).collect();
        std::fs::write(folder.join(SEAL), seal).map_err(io)?;
        solve(&folder, claim, self.campaign, &inputs, number)
    }
}

fn next<'a>(queue: &Mutex<VecDeque<&'a Case>>) -> Option<&'a Case> {
    // a poisoned queue is still a queue: the worker that panicked holds no half of it
    queue.lock().unwrap_or_else(std::sync::PoisonError::into_inner).pop_front()
}

/// Writes a file as a whole or not at all.
fn put(path: &Path, text: &str) -> Result<(), RunError> {
    let io = |source| RunError::Io { path: path.to_owned(), source };
    let folder = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder).map_err(io)?;
    write_whole(path, text.as_bytes()).map_err(io)
}

fn check_disk(folder: &Path, jobs: usize) -> Result<(), RunError> {
    let stat = nix::sys::statvfs::statvfs(folder)
        .map_err(|code| RunError::Io { path: folder.to_owned(), source: code.into() })?;
    let available = stat.blocks_available() as u64 * stat.fragment_size() as u64;
    let needed = DISK_PER_CASE * jobs as u64;
    if available >= needed {
        return Ok(());
    }
    let mib = |bytes: u64| bytes >> 20;
    Err(RunError::Disk {
        path: folder.to_owned(),
        available_mib: mib(available),
        needed_mib: mib(needed),
        jobs,
    })
}
