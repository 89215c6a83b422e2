//! Memory in large pages. What a loop goes through again and again, megabyte after megabyte, otherwise has the processor look up
//! every fourth kilobyte anew. Large pages are a wish: where the system has none to give, everything works as before.

/// An empty column with room for `capacity` elements, in large pages if the system gives any.
pub fn with_large_pages<T>(capacity: usize) -> Vec<T> {
    let column = Vec::with_capacity(capacity);
    wish_for_large_pages(&column);
    column
}

/// Bytes of a large page on the processors that have them in this size.
#[cfg(target_os = "linux")]
const LARGE: usize = 2 << 20;

#[cfg(target_os = "linux")]
fn wish_for_large_pages<T>(column: &Vec<T>) {
    use rustix::mm::{Advice, madvise};
    let start = column.as_ptr().addr();
    let (first, last) =
        (start.next_multiple_of(LARGE), (start + column.capacity() * size_of::<T>()) / LARGE * LARGE);
    if first < last {
        let pages = column.as_ptr().wrapping_byte_add(first - start);
        // SAFETY: these bytes lie within the column's own memory, and the advice changes how they are mapped, not what they hold.
        let _refused = unsafe { madvise(pages.cast_mut().cast(), last - first, Advice::LinuxHugepage) };
    }
}

#[cfg(not(target_os = "linux"))]
fn wish_for_large_pages<T>(_column: &Vec<T>) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_in_large_pages_is_like_any_other() {
        for capacity in [0, 1, 1000, 3 << 20] {
            let mut column: Vec<u32> = with_large_pages(capacity);
            assert!(column.is_empty() && column.capacity() >= capacity);
            let start = column.as_ptr();
            column.extend(0..capacity as u32);
            assert_eq!(column.as_ptr(), start);
            assert!((0..).zip(&column).all(|(k, &number)| k == number));
        }
    }
}
