//! The entries of clusters' rows as they lie in memory: of each column its number, a bit a lane that has a value, and those values
//! one behind the other (the format SPC5 of Bramas & Kus, PeerJ Computer Science 4:e151, 2018). Half of all lanes have none.

use crate::base::large_pages::with_large_pages;
use crate::base::parallel::{Rows, Shares};
use crate::base::simd::{LANES, Simd};
use crate::engine::pressure::values::Value;
use crate::engine::search::clusters::make_room;

/// A precision that values can be kept in.
pub trait Kept: Value {
    /// What is left of values that are kept.
    fn kept<S: Simd>(s: S, values: S::F) -> S::F;
    /// Keeps those of some lanes, one behind the other; what stands behind them is written over.
    fn pack<S: Simd>(s: S, values: S::F, lanes: u8, to: &mut [Self; LANES]);
    /// Those of some lanes, zero in the others.
    fn unpack<S: Simd>(s: S, from: &[Self; LANES], lanes: u8) -> S::F;
}

impl Kept for f64 {
    #[inline(always)]
    fn kept<S: Simd>(_: S, values: S::F) -> S::F {
        values
    }

    #[inline(always)]
    fn pack<S: Simd>(s: S, values: S::F, lanes: u8, to: &mut [f64; LANES]) {
        s.pack(values, lanes, to);
    }

    #[inline(always)]
    fn unpack<S: Simd>(s: S, from: &[f64; LANES], lanes: u8) -> S::F {
        s.expand(from, lanes)
    }
}

impl Kept for f32 {
    #[inline(always)]
    fn kept<S: Simd>(s: S, values: S::F) -> S::F {
        s.narrowed(values)
    }

    #[inline(always)]
    fn pack<S: Simd>(s: S, values: S::F, lanes: u8, to: &mut [f32; LANES]) {
        s.pack_narrow(values, lanes, to);
    }

    #[inline(always)]
    fn unpack<S: Simd>(s: S, from: &[f32; LANES], lanes: u8) -> S::F {
        s.expand_narrow(from, lanes)
    }
}

/// The entries of some clusters while they are worked out, or where they are few.
#[derive(Debug, Default)]
pub(super) struct Entries<V> {
    columns: Vec<u32>,
    /// Of each column the lanes that have a value.
    lanes: Vec<u8>,
    /// The values of all lanes of all columns, and room for eight more.
    values: Vec<V>,
    ends: Vec<End>,
}

/// How many columns and values stand before a place among those of a block.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct End {
    columns: u32,
    values: u32,
}

impl End {
    /// Where the k-th of clusters begins that end at `ends`.
    #[inline(always)]
    pub fn start_of(ends: &[End], k: usize) -> End {
        if k == 0 { End::default() } else { ends[k - 1] }
    }

    /// Values between an earlier place and this one.
    pub fn values_after(self, start: End) -> usize {
        (self.values - start.values) as usize
    }
}

/// Columns that follow one another, and their values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a, V> {
    pub columns: &'a [u32],
    pub lanes: &'a [u8],
    /// Those of the first column come first; what follows those of the last is not the run's.
    values: &'a [V],
}

impl<'a, V: Kept> Run<'a, V> {
    pub const NONE: Run<'static, V> = Run { columns: &[], lanes: &[], values: &[] };

    /// Shows the columns in which a lane has a value.
    pub fn for_each_in(self, lane: usize, mut visit: impl FnMut(u32, f64)) {
        let mut next = 0;
        for (&column, &lanes) in self.columns.iter().zip(self.lanes) {
            if lanes >> lane & 1 == 1 {
                let before = lanes & !(0xFF << lane);
                visit(column, self.values[next + before.count_ones() as usize].widened());
            }
            next += lanes.count_ones() as usize;
        }
    }

    /// Eight numbers from one on, of which the first are a column's values.
    #[inline(always)]
    pub fn values_from(self, first: usize) -> &'a [V; LANES] {
        self.values[first..].first_chunk().expect("values have room for eight more behind them")
    }
}

impl<V: Kept> Entries<V> {
    pub fn clear(&mut self) {
        self.columns.clear();
        self.lanes.clear();
        self.values.clear();
        self.ends.clear();
    }

    /// Where what was appended last ends.
    pub fn end(&self) -> End {
        End { columns: self.columns.len() as u32, values: self.values.len().saturating_sub(LANES) as u32 }
    }

    /// Ends a cluster.
    pub fn end_cluster(&mut self) {
        self.ends.push(self.end());
    }

    /// Room for so many columns behind those that are there, their lanes and values.
    #[inline(always)]
    pub fn room_for(&mut self, columns: usize) -> (&mut [u32], &mut [u8], &mut [V]) {
        let End { columns: start, values: start_of_values } = self.end();
        let (start, start_of_values) = (start as usize, start_of_values as usize);
        make_room(&mut self.columns, start + columns, 0);
        make_room(&mut self.lanes, start + columns, 0);
        make_room(&mut self.values, start_of_values + (columns + 1) * LANES, V::default());
        (&mut self.columns[start..], &mut self.lanes[start..], &mut self.values[start_of_values..])
    }

    /// Keeps so many of the columns and values that were written where [`room_for`](Entries::room_for) made room after `end`.
    #[inline(always)]
    pub fn keep(&mut self, end: End, columns: usize, values: usize) {
        self.columns.truncate(end.columns as usize + columns);
        self.lanes.truncate(end.columns as usize + columns);
        self.values.truncate(end.values as usize + values + LANES);
    }

    /// Those of the k-th cluster that stand before `end`.
    #[inline(always)]
    pub fn up_to(&self, k: usize, end: End) -> Run<'_, V> {
        let start = End::start_of(&self.ends, k);
        let range = start.columns as usize..end.columns as usize;
        Run {
            columns: &self.columns[range.clone()],
            lanes: &self.lanes[range],
            values: &self.values[start.values as usize..],
        }
    }

    /// Where the k-th cluster ends.
    pub fn end_of(&self, k: usize) -> End {
        self.ends[k]
    }

    /// The columns from one place to another.
    pub fn columns_between(&self, from: End, to: End) -> &[u32] {
        &self.columns[from.columns as usize..to.columns as usize]
    }

    /// Where each cluster ends.
    pub fn ends(&self) -> &[End] {
        &self.ends
    }

    pub fn bytes(&self) -> usize {
        self.columns.capacity() * size_of::<u32>()
            + self.lanes.capacity()
            + self.values.capacity() * size_of::<V>()
            + self.ends.capacity() * size_of::<End>()
    }
}

/// The entries of all blocks, each block's one behind the other. They are gone through in every iteration of the solver, and lie in
/// large pages for it.
#[derive(Debug, Default)]
pub(super) struct Store<V> {
    columns: Vec<u32>,
    lanes: Vec<u8>,
    values: Vec<V>,
}

/// Where the entries of a block begin in a [`Store`].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    columns: usize,
    values: usize,
}

impl<V: Kept> Store<V> {
    /// To be filled anew by several threads.
    pub fn shares(&mut self) -> StoreShares<'_, V> {
        StoreShares {
            columns: Shares::new((Rows::new(&mut self.columns), Rows::new(&mut self.lanes))),
            values: Shares::new(Rows::new(&mut self.values)),
        }
    }

    /// Makes it at least so large, and an eighth larger if it was not; what it held is lost.
    pub fn make_room(&mut self, wanted: Place) {
        *self = Store { columns: Vec::new(), lanes: Vec::new(), values: Vec::new() };
        let [columns, values] = [wanted.columns, wanted.values].map(|count| count + count / 8);
        self.columns = with_large_pages(columns);
        self.columns.resize(columns, 0);
        self.lanes = with_large_pages(columns);
        self.lanes.resize(columns, 0);
        self.values = with_large_pages(values);
        self.values.resize(values, V::default());
    }

    /// What a block that begins at `place` has from one end to the next.
    #[inline(always)]
    pub fn run(&self, place: Place, from: End, to: End) -> Run<'_, V> {
        let range = place.columns + from.columns as usize..place.columns + to.columns as usize;
        Run {
            columns: &self.columns[range.clone()],
            lanes: &self.lanes[range],
            values: &self.values[place.values + from.values as usize..],
        }
    }

    pub fn bytes(&self) -> usize {
        self.columns.capacity() * size_of::<u32>()
            + self.lanes.capacity()
            + self.values.capacity() * size_of::<V>()
    }
}

/// A [`Store`] that is being filled.
#[derive(Debug)]
pub(super) struct StoreShares<'a, V: Kept> {
    columns: Shares<(Rows<'a, u32>, Rows<'a, u8>)>,
    values: Shares<Rows<'a, V>>,
}

impl<V: Kept> StoreShares<'_, V> {
    /// Takes up the entries of a block; tells where, or nothing where there is no room.
    pub fn take_up(&self, entries: &Entries<V>) -> Option<Place> {
        let columns = self.columns.take(entries.columns.len());
        let values = self.values.take(entries.values.len());
        let ((columns_from, (columns, lanes)), (values_from, values)) = (columns?, values?);
        columns.copy_from_slice(&entries.columns);
        lanes.copy_from_slice(&entries.lanes);
        values.copy_from_slice(&entries.values);
        Some(Place { columns: columns_from, values: values_from })
    }

    /// How large the store would have to be for what it was to take up.
    pub fn wanted(&self) -> Place {
        Place { columns: self.columns.wanted(), values: self.values.wanted() }
    }
}
