//! Parallel loops with named [schedules](crate::base::schedule).
//!
//! A loop hands its body whole ranges of indices, never single ones, and each index to exactly one worker. Bodies
//! write only the rows of their own range, so the result cannot depend on the schedule or on the number of threads.
//! Its `unsafe` code is tested below against plain sequential loops.

use std::marker::PhantomData;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use crate::base::schedule::Schedule;

/// The most worker threads that may be asked for.
pub const MAX_THREADS: usize = 1024;
/// A team of threads that lives as long as the simulations which share it.
#[derive(Debug)]
pub struct Workers {
    pool: Arc<rayon::ThreadPool>,
    schedule: Schedule,
}

/// The threads could not be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start {threads} threads: {reason}")]
pub struct ThreadsUnavailable {
    pub threads: usize,
    pub reason: String,
}

impl Workers {
    /// Starts `threads` workers; worker `k` stays on CPU `cpus[k % cpus.len()]`, or anywhere when `cpus` is empty.
    pub fn new(threads: usize, schedule: Schedule, cpus: &[usize]) -> Result<Self, ThreadsUnavailable> {
        let failed = |reason: String| ThreadsUnavailable { threads, reason };
        if threads == 0 || threads > MAX_THREADS {
            return Err(failed(format!("allowed are 1 to {MAX_THREADS}")));
        }
        let cpus = cpus.to_vec();
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|k| format!("worker-{k}"))
            .start_handler(move |k| {
                if !cpus.is_empty() {
                    pin_current_thread(cpus[k % cpus.len()]);
                }
            })
            .build()
            .map_err(|error| failed(error.to_string()))?;
        Ok(Workers { pool: Arc::new(pool), schedule })
    }

    /// The same threads with another schedule.
    pub fn with_schedule(&self, schedule: Schedule) -> Self {
        Workers { pool: Arc::clone(&self.pool), schedule }
    }

    /// The number of threads that really run.
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Runs `body` on one of the workers, from where its loops start fastest.
    pub fn install<R: Send>(&self, body: impl FnOnce() -> R + Send) -> R {
        self.pool.install(body)
    }

    /// The team with the schedule it was made with: for loops over particles.
    pub fn scheduled(&self) -> Team<'_> {
        Team { pool: Some(&self.pool), schedule: self.schedule }
    }

    /// The team with contiguous shares: for loops over equal rows, where each thread should meet the same memory again.
    pub fn shared_evenly(&self) -> Team<'_> {
        Team { pool: Some(&self.pool), schedule: Schedule::Static }
    }

    /// The team that works by the schedule on pieces of so many rows, whose chunks still count rows.
    pub fn scheduled_over(&self, rows_a_piece: usize) -> Team<'_> {
        Team { pool: Some(&self.pool), schedule: self.schedule.over_pieces_of(rows_a_piece) }
    }

    /// The team with shares dealt out four rows at a time: for loops over unequal rows, where each thread should meet the same
    /// memory again.
    pub fn dealt_out(&self) -> Team<'_> {
        Team { pool: Some(&self.pool), schedule: Schedule::Dealt(const { NonZeroUsize::new(4).unwrap() }) }
    }

    /// A column of `len` copies of `value`, each page first touched by the thread that gets its part of an even share.
    pub fn column<T: Copy + Send + Sync + Default>(&self, len: usize, value: T) -> Vec<T> {
        let mut column = vec![T::default(); len];
        self.shared_evenly().fill(Rows::new(&mut column), |_, part| part.fill(value));
        column
    }
}

/// Pinning is a wish: where it cannot be had the thread runs on unpinned.
#[cfg(target_os = "linux")]
fn pin_current_thread(cpu: usize) {
    let mut set = rustix::thread::CpuSet::new();
    if cpu < rustix::thread::CpuSet::MAX_CPU {
        set.set(cpu);
        let _ = rustix::thread::sched_setaffinity(None, &set);
    }
}

#[cfg(not(target_os = "linux"))]
fn pin_current_thread(_cpu: usize) {}

/// Who runs a loop, and how its iterations are dealt.
#[derive(Debug, Clone, Copy)]
pub struct Team<'a> {
    pool: Option<&'a rayon::ThreadPool>,
    schedule: Schedule,
}

impl Team<'_> {
    /// The calling thread alone.
    pub const SERIAL: Team<'static> = Team { pool: None, schedule: Schedule::Static };

    /// The same threads with contiguous shares.
    pub fn evenly(self) -> Self {
        Team { schedule: Schedule::Static, ..self }
    }

    /// Calls `body` with ranges that together cover `0..len`, each index once and none of them empty: a worker for whom
    /// nothing is left is not asked, so that a body may take the first index of its range for one of its own.
    pub fn run(self, len: usize, body: impl Fn(Range<usize>) + Sync) {
        let body = |range: Range<usize>| {
            if !range.is_empty() {
                body(range);
            }
        };
        let Some(pool) = self.pool else {
            return body(0..len);
        };
        match self.schedule {
            Schedule::Static => {
                pool.broadcast(|worker| {
                    let share = |k: usize| len / worker.num_threads() * k + k.min(len % worker.num_threads());
                    body(share(worker.index())..share(worker.index() + 1));
                });
            }
            Schedule::Dealt(chunk) => {
                let chunk = chunk.get();
                pool.broadcast(|worker| {
                    for start in (worker.index() * chunk..len).step_by(worker.num_threads() * chunk) {
                        body(start..len.min(start + chunk));
                    }
                });
            }
            Schedule::Dynamic(chunk) => {
                let next = AtomicUsize::new(0);
                pool.broadcast(|_| {
                    while let Some(range) = claim(&next, len, |_| chunk.get()) {
                        body(range);
                    }
                });
            }
            Schedule::Guided(chunk) => {
                let next = AtomicUsize::new(0);
                pool.broadcast(|worker| {
                    let threads = worker.num_threads();
                    while let Some(range) = claim(&next, len, |left| chunk.get().max(left / threads)) {
                        body(range);
                    }
                });
            }
            Schedule::Rayon(chunk) => pool.install(|| {
                let chunk = chunk.get();
                (0..len.div_ceil(chunk))
                    .into_par_iter()
                    .with_max_len(1)
                    .for_each(|k| body(k * chunk..len.min((k + 1) * chunk)));
            }),
        }
    }

    /// Calls `body` with ranges that cover the rows of `columns`, and with exactly those rows of each column.
    pub fn fill<C: Columns>(self, columns: C, body: impl Fn(Range<usize>, C::Part) + Sync) {
        let rows = match columns.rows() {
            ABSENT => return,
            rows => rows,
        };
        let raw = columns.into_raw();
        self.run(rows, |range| {
            // SAFETY: `run` hands out each index once, so no two parts overlap; `range` lies within `rows`; and the
            // exclusive borrows inside `columns` outlive `run`, which returns only when every body has returned.
            let part = unsafe { C::part(raw, range.clone()) };
            body(range, part);
        });
    }
}

/// The next range of `0..len` that nobody has claimed yet; `size` gives its length from what is left.
fn claim(next: &AtomicUsize, len: usize, size: impl Fn(usize) -> usize) -> Option<Range<usize>> {
    let mut start = next.load(Ordering::Relaxed);
    loop {
        if start >= len {
            return None;
        }
        let end = len.min(start + size(len - start));
        match next.compare_exchange_weak(start, end, Ordering::Relaxed, Ordering::Relaxed) {
            Ok(_) => return Some(start..end),
            Err(now) => start = now,
        }
    }
}

/// Columns of equally many rows that one loop fills together.
///
/// # Safety
/// `part` must touch only the memory of the rows in `range`, and `rows` must bound the ranges for which that is valid.
pub unsafe trait Columns {
    type Raw: Copy + Send + Sync;
    type Part;

    fn rows(&self) -> usize;
    fn into_raw(self) -> Self::Raw;
    /// # Safety
    /// `raw` stems from a borrow that is still alive, `range` lies within its rows, and no other part overlaps it.
    unsafe fn part(raw: Self::Raw, range: Range<usize>) -> Self::Part;
}

/// The number of rows of a column that is not there.
const ABSENT: usize = usize::MAX;

/// A slice seen as rows of `width` elements; the last row may be shorter.
#[derive(Debug)]
pub struct Rows<'a, T> {
    slice: &'a mut [T],
    width: usize,
    /// Whether an empty slice stands for a column that is not there, rather than for no rows.
    optional: bool,
}

impl<'a, T> Rows<'a, T> {
    /// One element a row.
    pub fn new(slice: &'a mut [T]) -> Self {
        Rows { slice, width: 1, optional: false }
    }

    /// `width` elements a row, at least one.
    pub fn of_width(slice: &'a mut [T], width: usize) -> Self {
        Rows { slice, width: width.max(1), optional: false }
    }

    /// One element a row or, where the slice is empty, a column that is not there: each part of it is empty, and it does
    /// not limit the rows of the columns beside it.
    pub fn if_there(slice: &'a mut [T]) -> Self {
        Rows { slice, width: 1, optional: true }
    }
}

/// Where a [`Rows`] lies, so that several threads can each make their own part of it.
#[derive(Debug)]
pub struct RawRows<T> {
    start: *mut T,
    len: usize,
    width: usize,
}

impl<T> Clone for RawRows<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for RawRows<T> {}

// SAFETY: a `RawRows` is only turned back into disjoint exclusive slices, which may be sent when their elements may.
unsafe impl<T: Send> Send for RawRows<T> {}
// SAFETY: as above; sharing the address alone gives no access.
unsafe impl<T: Send> Sync for RawRows<T> {}

// SAFETY: `part` reaches the elements `range * width` alone, clipped to the slice.
unsafe impl<'a, T: Send> Columns for Rows<'a, T> {
    type Raw = RawRows<T>;
    type Part = &'a mut [T];

    fn rows(&self) -> usize {
        match self.slice.len() {
            0 if self.optional => ABSENT,
            len => len.div_ceil(self.width),
        }
    }

    fn into_raw(self) -> RawRows<T> {
        RawRows { start: self.slice.as_mut_ptr(), len: self.slice.len(), width: self.width }
    }

    unsafe fn part(raw: RawRows<T>, range: Range<usize>) -> &'a mut [T] {
        let from = (range.start * raw.width).min(raw.len);
        let to = (range.end * raw.width).min(raw.len);
        // SAFETY: `from..to` lies within the borrowed slice, and the caller keeps parts disjoint and the borrow alive.
        unsafe { std::slice::from_raw_parts_mut(raw.start.add(from), to - from) }
    }
}

/// A slice seen as rows of unequal length, one behind the other: row `k` is `slice[start[k]..start[k + 1]]`.
#[derive(Debug)]
pub struct PackedRows<'a, T> {
    slice: &'a mut [T],
    start: &'a [u32],
}

impl<'a, T> PackedRows<'a, T> {
    /// `start` has one entry more than there are rows; it never falls, and ends within the slice.
    pub fn new(slice: &'a mut [T], start: &'a [u32]) -> Self {
        let ends_within = start.last().is_some_and(|&end| end as usize <= slice.len());
        assert!(ends_within && start.is_sorted(), "packed rows lie one behind the other within their slice");
        PackedRows { slice, start }
    }
}

/// Where [`PackedRows`] lie.
#[derive(Debug)]
pub struct RawPackedRows<'a, T> {
    rows: RawRows<T>,
    start: &'a [u32],
}

impl<T> Clone for RawPackedRows<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for RawPackedRows<'_, T> {}

// SAFETY: `part` reaches `start[range.start]..start[range.end]` alone; `start` never falls, so that ranges which do not
// overlap reach parts which do not, and ends within the slice.
unsafe impl<'a, T: Send> Columns for PackedRows<'a, T> {
    type Raw = RawPackedRows<'a, T>;
    type Part = &'a mut [T];

    fn rows(&self) -> usize {
        self.start.len() - 1
    }

    fn into_raw(self) -> RawPackedRows<'a, T> {
        RawPackedRows { rows: Rows::new(self.slice).into_raw(), start: self.start }
    }

    unsafe fn part(raw: RawPackedRows<'a, T>, range: Range<usize>) -> &'a mut [T] {
        let elements = raw.start[range.start] as usize..raw.start[range.end] as usize;
        // SAFETY: these elements lie within the slice, and the caller keeps parts disjoint and the borrow alive.
        unsafe { Rows::part(raw.rows, elements) }
    }
}

macro_rules! columns_of_several {
    ($($name:ident),+) => {
        // SAFETY: each member keeps to the rows of `range`, and the shortest bounds the range.
        #[allow(non_snake_case)]
        unsafe impl<$($name: Columns),+> Columns for ($($name,)+) {
            type Raw = ($($name::Raw,)+);
            type Part = ($($name::Part,)+);

            fn rows(&self) -> usize {
                let ($($name,)+) = self;
                let rows = [$($name.rows()),+];
                let fewest = rows.into_iter().fold(ABSENT, usize::min);
                let equal = rows.iter().all(|&r| r == fewest || r == ABSENT);
                assert!(equal, "columns of one loop have equally many rows: {rows:?}");
                fewest
            }

            fn into_raw(self) -> Self::Raw {
                let ($($name,)+) = self;
                ($($name.into_raw(),)+)
            }

            unsafe fn part(raw: Self::Raw, range: Range<usize>) -> Self::Part {
                let ($($name,)+) = raw;
                // SAFETY: the caller's promise holds for every member.
                unsafe { ($($name::part($name, range.clone()),)+) }
            }
        }
    };
}

columns_of_several!(A, B);
columns_of_several!(A, B, C);
columns_of_several!(A, B, C, D);
columns_of_several!(A, B, C, D, E);

/// Columns of which the workers of a loop take rows, each as many as it turns out to need, one share behind the other. Who gets
/// which rows depends on who comes first: only what does not depend on where it lies may be kept so.
#[derive(Debug)]
pub struct Shares<C: Columns> {
    raw: C::Raw,
    rows: usize,
    wanted: AtomicUsize,
    columns: PhantomData<fn() -> C>,
}

impl<C: Columns> Shares<C> {
    pub fn new(columns: C) -> Self {
        let rows = columns.rows();
        assert!(rows != ABSENT, "only rows that are there can be taken");
        Shares { raw: columns.into_raw(), rows, wanted: AtomicUsize::new(0), columns: PhantomData }
    }

    /// The next rows, and the first one's index; nothing where fewer are left.
    pub fn take(&self, count: usize) -> Option<(usize, C::Part)> {
        let first = self.wanted.fetch_add(count, Ordering::Relaxed);
        let range = first..first + count;
        // SAFETY: the counter only grows, so that no two ranges overlap; this one lies within the rows; and the borrows that
        // `C` holds are alive as long as it is named in the type of `self`.
        (range.end <= self.rows).then(|| (first, unsafe { C::part(self.raw, range) }))
    }

    /// How many rows were asked for, those that were not there among them.
    pub fn wanted(&self) -> usize {
        self.wanted.load(Ordering::Relaxed)
    }
}

/// What the workers of loops borrow for a while, kept from loop to loop: as many as were ever lent at once.
#[derive(Debug, Default)]
pub struct Spares<T>(Mutex<Vec<T>>);

impl<T: Default> Spares<T> {
    /// One that was given back, or a new one.
    pub fn borrow(&self) -> T {
        self.all().pop().unwrap_or_default()
    }

    pub fn give_back(&self, spare: T) {
        self.all().push(spare);
    }

    /// Bytes of those that nobody has borrowed.
    pub fn bytes(&self, of: impl Fn(&T) -> usize) -> usize {
        self.all().iter().map(of).sum()
    }

    /// A worker that panicked while it held the list left a list.
    fn all(&self) -> MutexGuard<'_, Vec<T>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Lowest index at which something happened in a parallel loop: the same whichever thread came first.
#[derive(Debug)]
pub struct FirstIndex(AtomicUsize);

impl Default for FirstIndex {
    fn default() -> Self {
        FirstIndex(AtomicUsize::new(usize::MAX))
    }
}

impl FirstIndex {
    /// Records that it happened at `index`.
    pub fn record(&self, index: usize) {
        self.0.fetch_min(index, Ordering::Relaxed);
    }

    /// The lowest recorded index.
    pub fn get(&self) -> Option<usize> {
        Some(self.0.load(Ordering::Relaxed)).filter(|&index| index != usize::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schedules() -> Vec<Schedule> {
        [
            "static",
            "static:1",
            "static:5",
            "dynamic:1",
            "dynamic:64",
            "guided:1",
            "guided:7",
            "rayon:1",
            "rayon:1000",
        ]
        .iter()
        .map(|name| name.parse().unwrap())
        .collect()
    }

    #[test]
    fn shares_are_disjoint_and_say_how_much_was_wanted() {
        let workers = Workers::new(3, "dynamic:1".parse().unwrap(), &[]).unwrap();
        let (mut numbers, mut marks) = (vec![0usize; 100], vec![0u8; 100]);
        let shares = Shares::new((Rows::new(&mut numbers), Rows::new(&mut marks)));
        workers.scheduled().run(14, |range| {
            for k in range {
                if let Some((first, (numbers, marks))) = shares.take(k) {
                    assert_eq!((numbers.len(), marks.len()), (k, k));
                    numbers.iter_mut().enumerate().for_each(|(at, number)| *number += first + at + 1);
                    marks.iter_mut().for_each(|mark| *mark += 1);
                }
            }
        });
        assert_eq!(shares.wanted(), (0..14).sum::<usize>());
        assert!(numbers[..91].iter().enumerate().all(|(k, &number)| number == k + 1));
        assert_eq!((&marks[..91], &marks[91..]), (&[1; 91][..], &[0; 9][..]));
        assert_eq!(Shares::new(Rows::new(&mut marks)).take(101), None);
    }

    #[test]
    fn every_schedule_fills_each_row_once_like_the_plain_loop() {
        for schedule in schedules() {
            for threads in 1..=3 {
                let workers = Workers::new(threads, schedule, &[]).unwrap();
                for len in [0, 1, 2, 63, 64, 65, 1000] {
                    let (mut single, mut triple) = (vec![0usize; len], vec![0usize; 3 * len]);
                    workers.scheduled().fill(
                        (Rows::new(&mut single), Rows::of_width(&mut triple, 3)),
                        |range, part| {
                            assert!(!range.is_empty(), "{schedule} {threads} {len}");
                            for (k, i) in range.enumerate() {
                                part.0[k] += i + 1;
                                part.1[3 * k..3 * k + 3].iter_mut().for_each(|t| *t += i + 1);
                            }
                        },
                    );
                    assert!(
                        single.iter().enumerate().all(|(i, &v)| v == i + 1),
                        "{schedule} {threads} {len}"
                    );
                    assert!(
                        triple.iter().enumerate().all(|(i, &v)| v == i / 3 + 1),
                        "{schedule} {threads} {len}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_short_last_row_is_clipped() {
        let mut values = vec![0; 10];
        Team::SERIAL.fill(Rows::of_width(&mut values, 4), |range, part| {
            assert_eq!((range, part.len()), (0..3, 10));
            part.fill(1);
        });
        assert_eq!(values, [1; 10]);
    }

    #[test]
    fn packed_rows_are_filled_once_each() {
        let start: Vec<u32> = (0..=200_u32).map(|k| k * k / 7).collect();
        let row_of = |place: usize| start.partition_point(|&first| first as usize <= place) - 1;
        for schedule in schedules() {
            let workers = Workers::new(3, schedule, &[]).unwrap();
            let mut values = vec![0; start[200] as usize + 5];
            workers.scheduled().fill(PackedRows::new(&mut values, &start), |rows, part| {
                let first = start[rows.start];
                for row in rows {
                    let places = (start[row] - first) as usize..(start[row + 1] - first) as usize;
                    part[places].iter_mut().for_each(|value| *value += row + 1);
                }
            });
            let filled = values.iter().enumerate();
            assert!(filled.take(start[200] as usize).all(|(place, &v)| v == row_of(place) + 1), "{schedule}");
            assert!(values.ends_with(&[0; 5]), "what lies behind the last row is left alone");
        }
    }

    #[test]
    #[should_panic(expected = "one behind the other")]
    fn packed_rows_that_overlap_are_refused() {
        PackedRows::new(&mut [0; 4], &[0, 3, 2, 4]);
    }

    #[test]
    fn threads_out_of_range_are_refused() {
        for threads in [0, MAX_THREADS + 1] {
            assert!(Workers::new(threads, Schedule::Static, &[]).is_err());
        }
    }
}
