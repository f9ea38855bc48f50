//! A flag that one thread waits for until a deadline and another sets: no lock, no allocation.
#![allow(unsafe_code, reason = "system calls")]

use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::sync::Arc;
use std::time::Instant;

use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

/// An eventfd.
pub struct Event(OwnedFd);

impl Event {
    /// An event that is not set.
    pub fn new() -> io::Result<Self> {
        // SAFETY: no memory is passed.
        let fd = unsafe { libc::eventfd(0, libc::EFD_NONBLOCK | libc::EFD_CLOEXEC) };
        if fd < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: the descriptor is new and nobody else's.
        Ok(Self(unsafe { OwnedFd::from_raw_fd(fd) }))
    }

    /// Registers it with the runtime of this thread, to be waited for there.
    pub fn register(self: &Arc<Self>) -> io::Result<AsyncFd<Arc<Self>>> {
        // SAFETY: the descriptor is open for as long as the event is there, which the registration keeps.
        let registered = unsafe { AsyncFd::register_with_interest(Arc::clone(self), Interest::READABLE) };
        registered.map_err(|error| error.into_parts().1)
    }

    /// Sets it. It stays set until it is cleared.
    pub fn set(&self) {
        let one = 1_u64;
        // SAFETY: eight bytes are read from `one`. It fails only where the counter is full, and then it is set.
        unsafe { libc::write(self.0.as_raw_fd(), (&raw const one).cast(), size_of::<u64>()) };
    }

    /// Clears it.
    pub fn clear(&self) {
        let mut count = 0_u64;
        // SAFETY: eight bytes are written to `count`. It fails only where it is clear.
        unsafe { libc::read(self.0.as_raw_fd(), (&raw mut count).cast(), size_of::<u64>()) };
    }

    /// Waits until it is set; false where it is not until the deadline.
    pub fn wait(&self, deadline: Instant) -> bool {
        let mut poll = libc::pollfd { fd: self.0.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let seconds = libc::time_t::try_from(left.as_secs()).unwrap_or(libc::time_t::MAX);
            let timeout = libc::timespec { tv_sec: seconds, tv_nsec: left.subsec_nanos().into() };
            // SAFETY: one descriptor and one time are passed, no signal mask.
            let ready = unsafe { libc::ppoll(&raw mut poll, 1, &raw const timeout, std::ptr::null()) };
            // a signal is no reason to go
            if ready > 0 || left.is_zero() {
                return ready > 0;
            }
        }
    }
}

impl AsRawFd for Event {
    fn as_raw_fd(&self) -> RawFd {
        self.0.as_raw_fd()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::time::Duration;

    use super::*;

    #[test]
    fn it_is_waited_for_until_it_is_set_or_the_deadline() {
        let event = Event::new().unwrap();
        let start = Instant::now();
        assert!(!event.wait(start), "a deadline that has passed is one look");
        assert!(!event.wait(start + Duration::from_millis(5)));
        assert!(start.elapsed() >= Duration::from_millis(5));
        std::thread::scope(|scope| {
            scope.spawn(|| event.set());
            assert!(event.wait(start + Duration::from_secs(60)));
        });
        assert!(event.wait(start), "it stays set");
        event.clear();
        assert!(!event.wait(start));
    }
}
