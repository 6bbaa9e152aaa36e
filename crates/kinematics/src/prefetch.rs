//! Memory asked for before it is used.
//!
//! A processor that waits for memory does not compute, and it holds only so many unfinished stores: an
//! ordinary store first reads the line it writes to. Lines asked for some groups of steps ahead are there
//! when their turn comes. Nothing depends on it but time, and where a processor has no such instruction
//! nothing is done.

/// Bytes of a line of the caches.
const LINE: usize = 64;

/// Asks for the lines of what is soon read.
#[inline(always)]
pub(crate) fn prefetch_read<T, const N: usize>(values: &[T; N]) {
    for_each_line(values, |value| {
        #[cfg(target_arch = "x86_64")]
        safe_arch::prefetch_t0(value);
        #[cfg(not(target_arch = "x86_64"))]
        let _ = value;
    });
}

/// Asks for the lines of what is soon written.
#[inline(always)]
pub(crate) fn prefetch_write<T, const N: usize>(values: &[T; N]) {
    for_each_line(values, |value| {
        #[cfg(target_arch = "x86_64")]
        safe_arch::prefetch_et0(value);
        #[cfg(not(target_arch = "x86_64"))]
        let _ = value;
    });
}

/// A value of each line: sixteen of them take up whole lines.
#[inline(always)]
fn for_each_line<T, const N: usize>(values: &[T; N], ask_for: impl Fn(&T)) {
    for sixteen in values.as_chunks::<16>().0 {
        for line in 0..const { size_of::<[T; 16]>() / LINE } {
            ask_for(&sixteen[(line * LINE).div_ceil(size_of::<T>())]);
        }
    }
}
