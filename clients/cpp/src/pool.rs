//! Memory for what a call needs in passing. iceoryx2 takes a small block for every question and gives it back with the answer;
//! within a call such blocks come from a place that is set aside here, so that the system's allocator, and whoever holds its
//! locks, is never waited for. Everything else of the library goes to the system's allocator as ever.
#![allow(unsafe_code, reason = "an allocator is unsafe by its trait")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::{Cell, UnsafeCell};
use std::sync::atomic::{AtomicU64, Ordering};

/// Size of a block [bytes]; what is larger is not asked for in a call.
const BLOCK: usize = 512;
/// Blocks: each open question holds one, so that this is more than the clients that a server takes.
const BLOCKS: usize = 256;

thread_local! {
    /// Whether this thread is in a call.
    static IN_CALL: Cell<bool> = const { Cell::new(false) };
}

/// Says that this thread is in a call, until it is dropped.
pub struct InCall;

impl InCall {
    /// From now on.
    pub fn begin() -> Self {
        IN_CALL.set(true);
        Self
    }
}

impl Drop for InCall {
    fn drop(&mut self) {
        IN_CALL.set(false);
    }
}

#[repr(align(64))]
struct Blocks(UnsafeCell<[[u8; BLOCK]; BLOCKS]>);

// SAFETY: a block belongs to whoever set its bit.
unsafe impl Sync for Blocks {}

struct Pool {
    blocks: Blocks,
    /// A bit for each block that is taken.
    taken: [AtomicU64; BLOCKS / 64],
}

#[global_allocator]
static POOL: Pool = Pool {
    blocks: Blocks(UnsafeCell::new([[0; BLOCK]; BLOCKS])),
    taken: [const { AtomicU64::new(0) }; BLOCKS / 64],
};

impl Pool {
    fn start(&self) -> *mut u8 {
        self.blocks.0.get().cast()
    }

    /// A block of its own, unless all are taken.
    fn take(&self) -> Option<*mut u8> {
        for (word, taken) in self.taken.iter().enumerate() {
            let mut seen = taken.load(Ordering::Relaxed);
            while seen != u64::MAX {
                let bit = seen.trailing_ones() as usize;
                let with = seen | 1 << bit;
                match taken.compare_exchange_weak(seen, with, Ordering::Acquire, Ordering::Relaxed) {
                    Ok(_) => return Some(self.start().wrapping_add((64 * word + bit) * BLOCK)),
                    Err(now) => seen = now,
                }
            }
        }
        None
    }

    /// Which block a pointer is, if it is one.
    fn place(&self, pointer: *mut u8) -> Option<usize> {
        let offset = (pointer as usize).wrapping_sub(self.start() as usize);
        (offset < BLOCK * BLOCKS).then_some(offset / BLOCK)
    }
}

// SAFETY: a block is as large and as aligned as was asked for, belongs to one owner, and goes back by its own address; what is
// none goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Pool {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let fits = layout.size() <= BLOCK && layout.align() <= 64;
        // a thread that is ending has no flag any more
        if fits
            && IN_CALL.try_with(Cell::get).unwrap_or(false)
            && let Some(block) = self.take()
        {
            return block;
        }
        // SAFETY: the caller keeps the contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        match self.place(pointer) {
            Some(place) => {
                self.taken[place / 64].fetch_and(!(1 << (place % 64)), Ordering::Release);
            }
            // SAFETY: the caller keeps the contract, and it is no block.
            None => unsafe { System.dealloc(pointer, layout) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn within_a_call_small_blocks_come_from_here_and_go_back() {
        let is_ours = |boxed: &mut [u8; 100]| POOL.place(boxed.as_mut_ptr()).is_some();
        assert!(!is_ours(&mut Box::new([1; 100])));
        let call = InCall::begin();
        let mut kept: Vec<_> = (0..8_u8).map(|i| Box::new([i; 100])).collect();
        assert!(POOL.place((&mut [0_u8; 4 * BLOCK]).as_mut_ptr()).is_none());
        drop(call);
        for (i, boxed) in kept.iter_mut().enumerate() {
            assert!(is_ours(boxed) && boxed.iter().all(|&byte| usize::from(byte) == i));
        }
        // given back outside of the call, they are there for the next
        drop(kept);
        let call = InCall::begin();
        for _ in 0..10 * BLOCKS {
            assert!(is_ours(&mut Box::new([1; 100])));
        }
        drop(call);
    }
}
