//! Gives memory that the program has freed back to the system.

/// Asks the allocator to give back to the system the pages that hold nothing any more, in all its pools
/// of memory. Otherwise it keeps them, as holes between what is still held: the next large piece of
/// memory then lies beside the holes instead of in them. Takes some milliseconds for a gigabyte.
///
/// Does something with the C library of GNU only; other allocators have no such request.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn give_back_freed_memory() {
    // SAFETY: the call takes a plain number and may be made at any time by any thread.
    let _ = unsafe { nix::libc::malloc_trim(0) };
}

/// Does nothing with this C library.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn give_back_freed_memory() {}

/// Lets pieces of memory of a mebibyte and more go back to the system as soon as they are freed. Without
/// it the allocator raises this size by itself to the largest piece that was ever freed (32 MiB), and
/// then holds a third more than the program does. Each such piece costs its pages anew.
///
/// To be called before other threads are there. Does something with the C library of GNU only.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub fn give_back_large_pieces_at_once() {
    use nix::libc::{M_MMAP_THRESHOLD, mallopt};
    // SAFETY: the call takes plain numbers.
    let _ = unsafe { mallopt(M_MMAP_THRESHOLD, 1 << 20) };
}

/// Does nothing with this C library.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub fn give_back_large_pieces_at_once() {}

#[cfg(all(test, target_os = "linux", target_env = "gnu"))]
mod tests {
    use super::*;

    /// Resident memory of this process, bytes.
    fn resident() -> usize {
        let statm = std::fs::read_to_string("/proc/self/statm").expect("the system tells");
        let pages: usize = statm.split_whitespace().nth(1).expect("a number").parse().expect("it");
        4096 * pages
    }

    #[test]
    fn holes_between_what_is_held_go_back_to_the_system() {
        // Pieces that are too small to be mapped by themselves; every second one goes.
        let mut pieces: Vec<Vec<u8>> = (0..4000).map(|_| vec![1; 32 << 10]).collect();
        for piece in pieces.iter_mut().step_by(2) {
            *piece = Vec::new();
        }
        let before = resident();
        give_back_freed_memory();
        let after = resident();
        assert!(before.saturating_sub(after) > 40 << 20, "{before} before, {after} after");
        assert!(pieces[1].iter().all(|byte| *byte == 1));
    }
}
