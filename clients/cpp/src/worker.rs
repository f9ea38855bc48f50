//! A thread of the library's own, in a program that belongs to somebody else.
#![allow(unsafe_code, reason = "system calls")]

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle, Thread};
use std::time::Duration;

/// Longest wait for a thread that was asked to end: one that looks up a name or opens what a crash left can take minutes.
const PATIENCE: Duration = Duration::from_secs(2);

/// A thread that ends when its body does.
pub struct Worker {
    handle: JoinHandle<()>,
    /// Nothing ever comes; it is closed when the body is done.
    running: Receiver<()>,
}

impl Worker {
    /// Runs a body on a thread on which SIGPIPE is blocked: a peer that has closed a connection is an error of the call that
    /// writes, and the program's own handling of the signal stays as it is.
    pub fn spawn(name: &str, body: impl FnOnce() + Send + 'static) -> std::io::Result<Self> {
        let (until_done, running) = channel();
        let body = move || {
            let _until_done: Sender<()> = until_done;
            block_sigpipe();
            body();
        };
        let handle = thread::Builder::new().name(name.into()).spawn(body)?;
        Ok(Self { handle, running })
    }

    /// The thread, to be woken.
    pub fn thread(&self) -> &Thread {
        self.handle.thread()
    }

    /// Waits for the end of a thread that was asked to end. One that does not end in time is left to itself: it owns what it
    /// uses, and ends later.
    pub fn end(self) {
        if self.running.recv_timeout(PATIENCE) != Err(RecvTimeoutError::Timeout) {
            // a panic of it has been told to the connection
            let _ = self.handle.join();
        }
    }
}

/// On this thread alone. Threads that it starts inherit it.
fn block_sigpipe() {
    // SAFETY: the set lives on this stack and is made empty before it is used.
    unsafe {
        let mut signals = std::mem::MaybeUninit::<libc::sigset_t>::uninit();
        libc::sigemptyset(signals.as_mut_ptr());
        libc::sigaddset(signals.as_mut_ptr(), libc::SIGPIPE);
        libc::pthread_sigmask(libc::SIG_BLOCK, signals.as_ptr(), std::ptr::null_mut());
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::os::fd::AsRawFd;
    use std::os::unix::net::UnixStream;
    use std::time::Instant;

    use super::*;

    #[test]
    fn a_write_to_a_peer_that_is_gone_is_an_error_and_no_signal() {
        // what a C program has: Rust's test runner ignores the signal
        // SAFETY: the default disposition of a signal.
        unsafe { libc::signal(libc::SIGPIPE, libc::SIG_DFL) };
        let (result, written) = channel();
        let worker = Worker::spawn("test", move || {
            let (ours, theirs) = UnixStream::pair().unwrap();
            drop(theirs);
            // SAFETY: one byte of a static text is read. `write`, since the standard library would ask for no signal itself.
            let count = unsafe { libc::write(ours.as_raw_fd(), c"x".as_ptr().cast(), 1) };
            result.send((count, std::io::Error::last_os_error().kind())).unwrap();
        });
        assert_eq!(written.recv().unwrap(), (-1, std::io::ErrorKind::BrokenPipe));
        worker.unwrap().end();
    }

    #[test]
    fn a_thread_that_does_not_end_is_left_to_itself() {
        let (release, wait) = channel::<()>();
        let worker = Worker::spawn("test", move || {
            let _ = wait.recv();
        })
        .unwrap();
        let start = Instant::now();
        worker.end();
        assert!(start.elapsed() >= PATIENCE);
        drop(release);
    }
}
