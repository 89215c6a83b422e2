//! A hint to the processor that memory will soon be read.

/// Asks for the cache lines of `slice[range]`, clipped to the slice. Changes nothing but the time of later reads; does
/// nothing on processors other than x86-64.
#[inline(always)]
pub fn prefetch<T>(slice: &[T], range: std::ops::Range<usize>) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        const LINE_BYTES: usize = 64;
        let step = (LINE_BYTES / size_of::<T>().max(1)).max(1);
        let end = range.end.min(slice.len());
        for k in (range.start..end).step_by(step) {
            // SAFETY: a prefetch never faults and changes no memory, and `k` lies within the slice.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(slice.as_ptr().add(k).cast()) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (slice, range);
}
