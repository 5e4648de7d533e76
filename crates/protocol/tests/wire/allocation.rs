//! Counts the memory that the current thread asks for.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

#[global_allocator]
static COUNTING: Counting = Counting;

thread_local! {
    static ASKED_LEN: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

/// Result of `work`, and the bytes it asked for (freed or not).
pub fn counted<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = ASKED_LEN.get();
    let result = work();
    (result, ASKED_LEN.get() - before)
}

fn count(len: usize) {
    // A thread that is ending may have lost its counter; nobody asks it any more.
    let _ = ASKED_LEN.try_with(|asked| asked.set(asked.get().saturating_add(len)));
}

// SAFETY: every call is passed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller keeps `GlobalAlloc`'s contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller keeps `GlobalAlloc`'s contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, ptr: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        count(new_size);
        // SAFETY: the caller keeps `GlobalAlloc`'s contract.
        unsafe { System.realloc(ptr, layout, new_size) }
    }

    unsafe fn dealloc(&self, ptr: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps `GlobalAlloc`'s contract.
        unsafe { System.dealloc(ptr, layout) }
    }
}

#[test]
fn the_counter_counts() {
    let (kept, asked) = counted(|| vec![1_u8; 12_345]);
    assert_eq!(kept.len(), 12_345);
    assert!((12_345..20_000).contains(&asked), "{asked} bytes");
}
