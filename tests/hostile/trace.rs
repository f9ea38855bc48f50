//! Stops the process that serves shared memory at the system call of a given number, and kills it and its server there.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::sys::ptrace::{self, Options};
use nix::sys::signal::{Signal, kill};
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::Pid;

use crate::machine::Server;

/// Longest time without a system call, and longest time in all, after which there is nothing more to count: a server that is
/// idle still looks at its clock.
const QUIET: Duration = Duration::from_millis(1000);
const LONGEST: Duration = Duration::from_secs(4);

/// Follows these threads, and every thread and process that they start.
pub fn follow(threads: &[Pid]) {
    let options = Options::PTRACE_O_TRACESYSGOOD
        | Options::PTRACE_O_TRACECLONE
        | Options::PTRACE_O_TRACEFORK
        | Options::PTRACE_O_TRACEVFORK
        | Options::PTRACE_O_TRACEEXEC
        | Options::PTRACE_O_EXITKILL;
    for thread in threads {
        // a thread that has ended meanwhile needs no tracing
        if ptrace::seize(*thread, options).is_ok() {
            let _ = ptrace::interrupt(*thread);
        }
    }
}

/// The threads of a process.
pub fn threads(process: Pid) -> Vec<Pid> {
    let tasks = std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    tasks.filter_map(|task| task.file_name().to_str()?.parse().ok()).map(Pid::from_raw).collect()
}

/// The process that a thread belongs to.
fn process_of(thread: Pid) -> Option<i32> {
    let status = std::fs::read_to_string(format!("/proc/{thread}/status")).ok()?;
    status.lines().find_map(|line| line.strip_prefix("Tgid:"))?.trim().parse().ok()
}

/// Lets what is followed run until the processes other than the server have made this many system calls, and kills the server
/// there. The number of calls that were made: fewer, where no more came.
pub fn kill_at(server: &Server, number: u64) -> u64 {
    let (mut calls, begin) = (0, Instant::now());
    let mut last = begin;
    let root = server.pid();
    let mut processes: BTreeMap<i32, Option<i32>> = BTreeMap::new();
    loop {
        match waitpid(None, Some(WaitPidFlag::__WALL | WaitPidFlag::WNOHANG)) {
            Ok(WaitStatus::StillAlive) => {
                if last.elapsed() > QUIET || begin.elapsed() > LONGEST {
                    break;
                }
                std::thread::sleep(Duration::from_micros(50));
            }
            Ok(WaitStatus::PtraceSyscall(thread)) => {
                let process = *processes.entry(thread.as_raw()).or_insert_with(|| process_of(thread));
                if process.is_some_and(|process| process != root.as_raw()) {
                    // a call stops twice: before and after
                    calls += 1;
                    last = Instant::now();
                    if calls >= number || begin.elapsed() > LONGEST {
                        break;
                    }
                }
                resume(thread, None);
            }
            Ok(WaitStatus::PtraceEvent(thread, ..)) => {
                processes.remove(&thread.as_raw());
                resume(thread, None);
            }
            Ok(WaitStatus::Stopped(thread, signal)) => {
                // the stop that comes with being followed is nobody's signal
                let own = matches!(signal, Signal::SIGSTOP | Signal::SIGTRAP);
                resume(thread, (!own).then_some(signal));
            }
            Ok(WaitStatus::Exited(process, _) | WaitStatus::Signaled(process, ..)) if process == root => {
                break;
            }
            Ok(_) => {}
            Err(Errno::ECHILD) => break,
            Err(error) => panic!("waiting: {error}"),
        }
    }
    // a child that has not become the process of shared memory yet does not end with its server, and holds its sockets
    for process in processes.into_values().flatten().chain([root.as_raw()]) {
        let _ = kill(Pid::from_raw(process), Signal::SIGKILL);
    }
    // everything that was followed is killed with its tracer or its server, and is reaped here
    let end = Instant::now() + Duration::from_secs(5);
    while Instant::now() < end {
        match waitpid(None, Some(WaitPidFlag::__WALL | WaitPidFlag::WNOHANG)) {
            Err(_) => break,
            Ok(WaitStatus::StillAlive) => std::thread::sleep(Duration::from_micros(200)),
            Ok(
                WaitStatus::PtraceSyscall(thread)
                | WaitStatus::PtraceEvent(thread, ..)
                | WaitStatus::Stopped(thread, _),
            ) => {
                let _ = process_of(thread).map(|process| kill(Pid::from_raw(process), Signal::SIGKILL));
            }
            Ok(_) => {}
        }
    }
    calls
}

fn resume(thread: Pid, signal: Option<Signal>) {
    // one that was killed meanwhile has nothing to resume
    let _ = ptrace::syscall(thread, signal);
}
