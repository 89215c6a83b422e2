//! Eight numbers at once, in the widest vectors of the processor at hand.
//!
//! A [`Kernel`] is written once over [`Simd`], compiled once for each kind of processor, and [`dispatch`] runs the version
//! for this one. A `Simd` is a token: it exists only where the processor was asked for what its operations need, so that
//! they are safe to call. [`Portable`] is plain Rust, the twin that the others are tested against; the compiler makes NEON of it.
//! Every operation is rounded as IEEE 754 says, fused ones once, so that all give the same bits.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

use crate::base::dispatch::{Level, Work, at_most};

/// How many numbers.
pub const LANES: usize = 8;

/// Vectors of eight numbers and what can be done to them.
pub trait Simd: Copy + Send + Sync {
    /// Eight 64-bit numbers.
    type F: Copy;
    /// A choice among them.
    type M: Copy;

    fn splat(self, value: f64) -> Self::F;
    fn load(self, from: &[f64; LANES]) -> Self::F;
    fn store(self, value: Self::F, to: &mut [f64; LANES]);
    /// Widens eight 32-bit numbers.
    fn load_narrow(self, from: &[f32; LANES]) -> Self::F;
    /// The nearest 32-bit numbers.
    fn narrowed(self, value: Self::F) -> Self::F;
    /// Gives the numbers, in turn, to the lanes of `bits`, and zero to the others.
    fn expand(self, from: &[f64; LANES], bits: u8) -> Self::F;
    /// The same, widened.
    fn expand_narrow(self, from: &[f32; LANES], bits: u8) -> Self::F;
    /// Writes the lanes of `bits`, one behind the other; what stands behind them, eight numbers in all, is written over.
    fn pack(self, value: Self::F, bits: u8, to: &mut [f64; LANES]);
    /// The same, rounded to 32-bit numbers.
    fn pack_narrow(self, value: Self::F, bits: u8, to: &mut [f32; LANES]);
    fn add(self, a: Self::F, b: Self::F) -> Self::F;
    fn sub(self, a: Self::F, b: Self::F) -> Self::F;
    fn mul(self, a: Self::F, b: Self::F) -> Self::F;
    /// `a b + c`, rounded once.
    fn mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `c - a b`, rounded once.
    fn neg_mul_add(self, a: Self::F, b: Self::F, c: Self::F) -> Self::F;
    /// `a` where it is below `b`, `b` elsewhere.
    fn min(self, a: Self::F, b: Self::F) -> Self::F;
    /// Where `a < b`.
    fn below(self, a: Self::F, b: Self::F) -> Self::M;
    /// `a` where chosen, zero elsewhere.
    fn keep(self, mask: Self::M, a: Self::F) -> Self::F;
    /// `a` where chosen, `b` elsewhere.
    fn select(self, mask: Self::M, a: Self::F, b: Self::F) -> Self::F;
    fn both(self, a: Self::M, b: Self::M) -> Self::M;
    /// Bit k for lane k.
    fn bits(self, mask: Self::M) -> u8;
    /// The lanes of a number's bits.
    fn mask(self, bits: u8) -> Self::M;
    /// Writes `first + k` for every bit k, one behind the other, and tells how many; what stands behind them, eight numbers
    /// in all, is written over.
    fn compress(self, first: u32, bits: u8, to: &mut [u32]) -> usize;
    /// `1 / sqrt(a)` to 3.5 %, by halving the exponent.
    fn guess_reciprocal_sqrt(self, a: Self::F) -> Self::F;

    /// `1 / sqrt(a)` of normal positive numbers to two units in the last place; of zero more than 1e150.
    ///
    /// Two steps of fourth order of Householder's iteration in `e = 1 - a y^2`: from 3.5 % to 7e-6, and to rounding.
    #[inline(always)]
    fn reciprocal_sqrt(self, a: Self::F) -> Self::F {
        self.closer(a, self.closer(a, self.guess_reciprocal_sqrt(a)))
    }

    /// A step of fourth order from `y` towards `1 / sqrt(a)`.
    #[inline(always)]
    fn closer(self, a: Self::F, y: Self::F) -> Self::F {
        let e = self.neg_mul_add(self.mul(a, y), y, self.splat(1.0));
        let series = self.mul_add(e, self.splat(0.3125), self.splat(0.375));
        self.mul_add(self.mul(e, y), self.mul_add(e, series, self.splat(0.5)), y)
    }

    /// The sum of a product's three components, `a . b`.
    #[inline(always)]
    fn dot(self, a: [Self::F; 3], b: [Self::F; 3]) -> Self::F {
        self.mul_add(a[0], b[0], self.mul_add(a[1], b[1], self.mul(a[2], b[2])))
    }

    /// The square of the distance from each lane's point to one point.
    #[inline(always)]
    fn distance2(self, point: &[f64; 4], x: &[Self::F; 3]) -> Self::F {
        let (dx, dy, dz) = (
            self.sub(self.splat(point[0]), x[0]),
            self.sub(self.splat(point[1]), x[1]),
            self.sub(self.splat(point[2]), x[2]),
        );
        self.dot([dx, dy, dz], [dx, dy, dz])
    }

    /// The numbers of a vector, in memory.
    #[inline(always)]
    fn array(self, value: Self::F) -> [f64; LANES] {
        let mut to = [0.0; LANES];
        self.store(value, &mut to);
        to
    }
}

/// Something that is computed with whatever vectors there are.
pub trait Kernel {
    type Out;

    /// Must be `#[inline(always)]`, as must be what it calls, to be compiled with the features of the processor.
    fn run<S: Simd>(self, simd: S) -> Self::Out;
}

/// Of each choice of lanes how many of those chosen stand before each lane.
#[cfg(target_arch = "x86_64")]
static BEFORE: [[u8; LANES]; 256] = {
    let mut before = [[0; LANES]; 256];
    let mut bits = 0;
    while bits < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < LANES {
            before[bits][lane] = count & (LANES as u8 - 1);
            count += (bits >> lane & 1) as u8;
            lane += 1;
        }
        bits += 1;
    }
    before
};

/// Of the guess: what makes half the exponent's bits, negated, closest to the logarithm of the root's reciprocal.
const GUESS: u64 = 0x5FE6_EB50_C7B5_37A9;

/// No more than what every processor has.
#[derive(Debug, Clone, Copy)]
pub struct Portable;

/// [`Simd::compress`] without vectors.
#[inline(always)]
fn compress(first: u32, bits: u8, to: &mut [u32]) -> usize {
    let to = &mut to[..LANES];
    let mut count = 0;
    for k in 0..LANES {
        to[count & (LANES - 1)] = first + k as u32;
        count += usize::from(bits >> k & 1);
    }
    count
}

/// [`Simd::expand`] without vectors.
#[inline(always)]
fn expand<T: Copy + Default>(from: &[T; LANES], bits: u8) -> [T; LANES] {
    let mut next = 0;
    std::array::from_fn(|k| {
        let chosen = bits >> k & 1 == 1;
        let value = if chosen { from[next & (LANES - 1)] } else { T::default() };
        next += usize::from(chosen);
        value
    })
}

/// [`Simd::pack`] without vectors.
#[inline(always)]
fn pack<T: Copy>(values: [T; LANES], bits: u8, to: &mut [T; LANES]) {
    let mut count = 0;
    for (k, value) in values.into_iter().enumerate() {
        to[count & (LANES - 1)] = value;
        count += usize::from(bits >> k & 1);
    }
}

#[inline(always)]
fn each(f: impl FnMut(usize) -> f64) -> [f64; LANES] {
    std::array::from_fn(f)
}

/// Makes [`Portable`]'s operations. They are inlined where the processor's own vectors are meant, on AArch64; a processor of
/// the other kind that has neither AVX2 nor AVX-512 is too old for speed to matter, and calls make the program smaller.
macro_rules! plain {
    ($(fn $name:ident($($arg:ident: $type:ty),*) $(-> $out:ty)? $body:block)+) => {
        impl Simd for Portable {
            type F = [f64; LANES];
            type M = [bool; LANES];

            $(
                #[cfg_attr(target_arch = "aarch64", inline(always))]
                #[cfg_attr(not(target_arch = "aarch64"), inline(never))]
                fn $name(self, $($arg: $type),*) $(-> $out)? $body
            )+
        }
    };
}

plain! {
    fn splat(value: f64) -> [f64; LANES] {
        [value; LANES]
    }
    fn load(from: &[f64; LANES]) -> [f64; LANES] {
        *from
    }
    fn store(value: [f64; LANES], to: &mut [f64; LANES]) {
        *to = value;
    }
    fn load_narrow(from: &[f32; LANES]) -> [f64; LANES] {
        each(|k| f64::from(from[k]))
    }
    fn narrowed(value: [f64; LANES]) -> [f64; LANES] {
        value.map(|v| f64::from(v as f32))
    }
    fn expand(from: &[f64; LANES], bits: u8) -> [f64; LANES] {
        expand(from, bits)
    }
    fn expand_narrow(from: &[f32; LANES], bits: u8) -> [f64; LANES] {
        expand(from, bits).map(f64::from)
    }
    fn pack(value: [f64; LANES], bits: u8, to: &mut [f64; LANES]) {
        pack(value, bits, to)
    }
    fn pack_narrow(value: [f64; LANES], bits: u8, to: &mut [f32; LANES]) {
        pack(value.map(|v| v as f32), bits, to)
    }
    fn add(a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each(|k| a[k] + b[k])
    }
    fn sub(a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each(|k| a[k] - b[k])
    }
    fn mul(a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each(|k| a[k] * b[k])
    }
    fn mul_add(a: [f64; LANES], b: [f64; LANES], c: [f64; LANES]) -> [f64; LANES] {
        each(|k| a[k].mul_add(b[k], c[k]))
    }
    fn neg_mul_add(a: [f64; LANES], b: [f64; LANES], c: [f64; LANES]) -> [f64; LANES] {
        each(|k| (-a[k]).mul_add(b[k], c[k]))
    }
    fn min(a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each(|k| if a[k] < b[k] { a[k] } else { b[k] })
    }
    fn below(a: [f64; LANES], b: [f64; LANES]) -> [bool; LANES] {
        std::array::from_fn(|k| a[k] < b[k])
    }
    fn keep(mask: [bool; LANES], a: [f64; LANES]) -> [f64; LANES] {
        each(|k| if mask[k] { a[k] } else { 0.0 })
    }
    fn select(mask: [bool; LANES], a: [f64; LANES], b: [f64; LANES]) -> [f64; LANES] {
        each(|k| if mask[k] { a[k] } else { b[k] })
    }
    fn both(a: [bool; LANES], b: [bool; LANES]) -> [bool; LANES] {
        std::array::from_fn(|k| a[k] & b[k])
    }
    fn bits(mask: [bool; LANES]) -> u8 {
        (0..LANES).fold(0, |bits, k| bits | u8::from(mask[k]) << k)
    }
    fn mask(bits: u8) -> [bool; LANES] {
        std::array::from_fn(|k| bits >> k & 1 == 1)
    }
    fn compress(first: u32, bits: u8, to: &mut [u32]) -> usize {
        compress(first, bits, to)
    }
    fn guess_reciprocal_sqrt(a: [f64; LANES]) -> [f64; LANES] {
        a.map(|a| f64::from_bits(GUESS.wrapping_sub(a.to_bits() >> 1)))
    }
}

/// Makes a [`Simd`] of intrinsics. Every one of them needs the features that its token stands for.
#[cfg(target_arch = "x86_64")]
macro_rules! intrinsics {
    ($token:ident, $f:ty, $m:ty, { $(fn $name:ident($($arg:ident: $type:ty),*) $(-> $out:ty)? $body:block)+ }) => {
        impl Simd for $token {
            type F = $f;
            type M = $m;

            $(
                #[inline(always)]
                #[allow(unused_unsafe, reason = "some operations on masks need no intrinsic")]
                fn $name(self, $($arg: $type),*) $(-> $out)? {
                    // SAFETY: a token exists only where `dispatch` found the features; arrays are as long as the access.
                    unsafe { $body }
                }
            )+
        }
    };
}

/// One register of 512 bits.
#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub struct Avx512(());

#[cfg(target_arch = "x86_64")]
intrinsics!(Avx512, __m512d, __mmask8, {
    fn splat(value: f64) -> __m512d {
        _mm512_set1_pd(value)
    }
    fn load(from: &[f64; LANES]) -> __m512d {
        _mm512_loadu_pd(from.as_ptr())
    }
    fn store(value: __m512d, to: &mut [f64; LANES]) {
        _mm512_storeu_pd(to.as_mut_ptr(), value)
    }
    fn load_narrow(from: &[f32; LANES]) -> __m512d {
        _mm512_cvtps_pd(_mm256_loadu_ps(from.as_ptr()))
    }
    fn narrowed(value: __m512d) -> __m512d {
        _mm512_cvtps_pd(_mm512_cvtpd_ps(value))
    }
    // Permuted rather than expanded, here and below: some processors take ten cycles to expand from memory.
    fn expand(from: &[f64; LANES], bits: u8) -> __m512d {
        let before = _mm512_cvtepu8_epi64(_mm_loadl_epi64(BEFORE[usize::from(bits)].as_ptr().cast()));
        _mm512_maskz_permutexvar_pd(bits, before, _mm512_loadu_pd(from.as_ptr()))
    }
    fn expand_narrow(from: &[f32; LANES], bits: u8) -> __m512d {
        let before = _mm256_cvtepu8_epi32(_mm_loadl_epi64(BEFORE[usize::from(bits)].as_ptr().cast()));
        _mm512_cvtps_pd(_mm256_maskz_permutexvar_ps(bits, before, _mm256_loadu_ps(from.as_ptr())))
    }
    fn pack(value: __m512d, bits: u8, to: &mut [f64; LANES]) {
        _mm512_storeu_pd(to.as_mut_ptr(), _mm512_maskz_compress_pd(bits, value))
    }
    fn pack_narrow(value: __m512d, bits: u8, to: &mut [f32; LANES]) {
        _mm256_storeu_ps(to.as_mut_ptr(), _mm256_maskz_compress_ps(bits, _mm512_cvtpd_ps(value)))
    }
    fn add(a: __m512d, b: __m512d) -> __m512d {
        _mm512_add_pd(a, b)
    }
    fn sub(a: __m512d, b: __m512d) -> __m512d {
        _mm512_sub_pd(a, b)
    }
    fn mul(a: __m512d, b: __m512d) -> __m512d {
        _mm512_mul_pd(a, b)
    }
    fn mul_add(a: __m512d, b: __m512d, c: __m512d) -> __m512d {
        _mm512_fmadd_pd(a, b, c)
    }
    fn neg_mul_add(a: __m512d, b: __m512d, c: __m512d) -> __m512d {
        _mm512_fnmadd_pd(a, b, c)
    }
    fn min(a: __m512d, b: __m512d) -> __m512d {
        _mm512_min_pd(a, b)
    }
    fn below(a: __m512d, b: __m512d) -> __mmask8 {
        _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b)
    }
    fn keep(mask: __mmask8, a: __m512d) -> __m512d {
        _mm512_maskz_mov_pd(mask, a)
    }
    fn select(mask: __mmask8, a: __m512d, b: __m512d) -> __m512d {
        _mm512_mask_mov_pd(b, mask, a)
    }
    fn both(a: __mmask8, b: __mmask8) -> __mmask8 {
        a & b
    }
    fn bits(mask: __mmask8) -> u8 {
        mask
    }
    fn mask(bits: u8) -> __mmask8 {
        bits
    }
    fn compress(first: u32, bits: u8, to: &mut [u32]) -> usize {
        let to = &mut to[..LANES];
        let all =
            _mm256_add_epi32(_mm256_set1_epi32(first as i32), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
        _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm256_maskz_compress_epi32(bits, all));
        bits.count_ones() as usize
    }
    fn guess_reciprocal_sqrt(a: __m512d) -> __m512d {
        let halved = _mm512_srli_epi64::<1>(_mm512_castpd_si512(a));
        _mm512_castsi512_pd(_mm512_sub_epi64(_mm512_set1_epi64(GUESS as i64), halved))
    }
});

/// Two registers of 256 bits.
#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub struct Avx2(());

#[cfg(target_arch = "x86_64")]
type Pair = [__m256d; 2];

#[cfg(target_arch = "x86_64")]
intrinsics!(Avx2, Pair, Pair, {
    fn splat(value: f64) -> Pair {
        [_mm256_set1_pd(value); 2]
    }
    fn load(from: &[f64; LANES]) -> Pair {
        [_mm256_loadu_pd(from.as_ptr()), _mm256_loadu_pd(from[4..].as_ptr())]
    }
    fn store(value: Pair, to: &mut [f64; LANES]) {
        _mm256_storeu_pd(to.as_mut_ptr(), value[0]);
        _mm256_storeu_pd(to[4..].as_mut_ptr(), value[1]);
    }
    fn load_narrow(from: &[f32; LANES]) -> Pair {
        [_mm256_cvtps_pd(_mm_loadu_ps(from.as_ptr())), _mm256_cvtps_pd(_mm_loadu_ps(from[4..].as_ptr()))]
    }
    fn narrowed(value: Pair) -> Pair {
        [_mm256_cvtps_pd(_mm256_cvtpd_ps(value[0])), _mm256_cvtps_pd(_mm256_cvtpd_ps(value[1]))]
    }
    fn expand(from: &[f64; LANES], bits: u8) -> Pair {
        let values = expand(from, bits);
        [_mm256_loadu_pd(values.as_ptr()), _mm256_loadu_pd(values[4..].as_ptr())]
    }
    fn expand_narrow(from: &[f32; LANES], bits: u8) -> Pair {
        let before = _mm256_cvtepu8_epi32(_mm_loadl_epi64(BEFORE[usize::from(bits)].as_ptr().cast()));
        let lanes = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        let chosen = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(i32::from(bits)), lanes), lanes);
        let values = _mm256_permutevar8x32_ps(_mm256_loadu_ps(from.as_ptr()), before);
        let values = _mm256_and_ps(values, _mm256_castsi256_ps(chosen));
        [_mm256_cvtps_pd(_mm256_castps256_ps128(values)), _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(values))]
    }
    fn pack(value: Pair, bits: u8, to: &mut [f64; LANES]) {
        let mut values = [0.0; LANES];
        _mm256_storeu_pd(values.as_mut_ptr(), value[0]);
        _mm256_storeu_pd(values[4..].as_mut_ptr(), value[1]);
        pack(values, bits, to)
    }
    fn pack_narrow(value: Pair, bits: u8, to: &mut [f32; LANES]) {
        let mut values = [0.0; LANES];
        _mm_storeu_ps(values.as_mut_ptr(), _mm256_cvtpd_ps(value[0]));
        _mm_storeu_ps(values[4..].as_mut_ptr(), _mm256_cvtpd_ps(value[1]));
        pack(values, bits, to)
    }
    fn add(a: Pair, b: Pair) -> Pair {
        [_mm256_add_pd(a[0], b[0]), _mm256_add_pd(a[1], b[1])]
    }
    fn sub(a: Pair, b: Pair) -> Pair {
        [_mm256_sub_pd(a[0], b[0]), _mm256_sub_pd(a[1], b[1])]
    }
    fn mul(a: Pair, b: Pair) -> Pair {
        [_mm256_mul_pd(a[0], b[0]), _mm256_mul_pd(a[1], b[1])]
    }
    fn mul_add(a: Pair, b: Pair, c: Pair) -> Pair {
        [_mm256_fmadd_pd(a[0], b[0], c[0]), _mm256_fmadd_pd(a[1], b[1], c[1])]
    }
    fn neg_mul_add(a: Pair, b: Pair, c: Pair) -> Pair {
        [_mm256_fnmadd_pd(a[0], b[0], c[0]), _mm256_fnmadd_pd(a[1], b[1], c[1])]
    }
    fn min(a: Pair, b: Pair) -> Pair {
        [_mm256_min_pd(a[0], b[0]), _mm256_min_pd(a[1], b[1])]
    }
    fn below(a: Pair, b: Pair) -> Pair {
        [_mm256_cmp_pd::<_CMP_LT_OQ>(a[0], b[0]), _mm256_cmp_pd::<_CMP_LT_OQ>(a[1], b[1])]
    }
    fn keep(mask: Pair, a: Pair) -> Pair {
        [_mm256_and_pd(mask[0], a[0]), _mm256_and_pd(mask[1], a[1])]
    }
    fn select(mask: Pair, a: Pair, b: Pair) -> Pair {
        [_mm256_blendv_pd(b[0], a[0], mask[0]), _mm256_blendv_pd(b[1], a[1], mask[1])]
    }
    fn both(a: Pair, b: Pair) -> Pair {
        [_mm256_and_pd(a[0], b[0]), _mm256_and_pd(a[1], b[1])]
    }
    fn bits(mask: Pair) -> u8 {
        (_mm256_movemask_pd(mask[0]) | _mm256_movemask_pd(mask[1]) << 4) as u8
    }
    fn mask(bits: u8) -> Pair {
        let (bits, low) = (_mm256_set1_epi64x(i64::from(bits)), _mm256_setr_epi64x(1, 2, 4, 8));
        let high = _mm256_slli_epi64::<4>(low);
        [low, high].map(|lanes| _mm256_castsi256_pd(_mm256_cmpeq_epi64(_mm256_and_si256(bits, lanes), lanes)))
    }
    fn compress(first: u32, bits: u8, to: &mut [u32]) -> usize {
        compress(first, bits, to)
    }
    fn guess_reciprocal_sqrt(a: Pair) -> Pair {
        let guess = _mm256_set1_epi64x(GUESS as i64);
        let [low, high] = [_mm256_castpd_si256(a[0]), _mm256_castpd_si256(a[1])];
        let (low, high) = (_mm256_srli_epi64::<1>(low), _mm256_srli_epi64::<1>(high));
        [
            _mm256_castsi256_pd(_mm256_sub_epi64(guess, low)),
            _mm256_castsi256_pd(_mm256_sub_epi64(guess, high)),
        ]
    }
});

/// A kernel as work whose level tells which token may be made. Only [`at_most`] calls it, with a level that the processor has.
struct AtLevel<K>(K);

impl<K: Kernel> Work for AtLevel<K> {
    type Output = K::Out;

    #[inline(always)]
    fn run(self, level: Level) -> K::Out {
        match level {
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => self.0.run(Avx512(())),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => self.0.run(Avx2(())),
            _ => self.0.run(Portable),
        }
    }
}

/// Runs `kernel` with the widest vectors of this processor.
#[inline]
pub fn dispatch<K: Kernel>(kernel: K) -> K::Out {
    dispatch_at_most(Level::Avx512, kernel)
}

/// Runs `kernel` with the widest vectors of this processor that are not above `limit`.
#[inline]
pub fn dispatch_at_most<K: Kernel>(limit: Level, kernel: K) -> K::Out {
    at_most(limit, AtLevel(kernel))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every operation once, on numbers of many sizes.
    struct Everything([[f64; LANES]; 3]);

    impl Kernel for Everything {
        type Out = (Vec<[u64; LANES]>, u8, Vec<u32>);

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Self::Out {
            let [a, b, c] = [s.load(&self.0[0]), s.load(&self.0[1]), s.load(&self.0[2])];
            let (below, some) = (s.below(a, b), s.mask(0b1011_0010));
            let chosen = s.bits(below);
            let narrow = self.0[0].map(|value| value as f32);
            let results = [
                s.splat(self.0[0][3]),
                s.load_narrow(&narrow),
                s.narrowed(b),
                s.expand(&self.0[2], chosen),
                s.expand_narrow(&narrow, chosen),
                s.add(a, b),
                s.sub(a, b),
                s.mul(a, b),
                s.mul_add(a, b, c),
                s.neg_mul_add(a, b, c),
                s.min(a, b),
                s.keep(below, a),
                s.select(some, a, b),
                s.keep(s.both(some, below), c),
                s.reciprocal_sqrt(a),
                s.dot([a, b, c], [c, a, b]),
            ];
            let bits = results.map(|value| s.array(value).map(f64::to_bits));
            let mut packed = [0; LANES];
            let count = s.compress(7, chosen, &mut packed);
            let (mut wide, mut narrow) = ([0.0; LANES], [0.0; LANES]);
            s.pack(c, chosen, &mut wide);
            s.pack_narrow(c, chosen, &mut narrow);
            let packed = packed[..count].iter().copied();
            let packed = packed.chain(narrow[..count].iter().map(|value| value.to_bits()));
            let wide = each(|k| if k < count { wide[k] } else { 0.0 }).map(f64::to_bits);
            (bits.iter().copied().chain([wide]).collect(), chosen, packed.collect())
        }
    }

    #[test]
    fn all_vectors_give_the_bits_of_plain_rust() {
        let mut random = fastrand::Rng::with_seed(3);
        for _ in 0..1000 {
            let mut number = || (random.f64() + 0.1) * 10f64.powi(random.i32(-12..12));
            let numbers = std::array::from_fn(|_| std::array::from_fn(|_| number()));
            let plain = Everything(numbers).run(Portable);
            for limit in [Level::Portable, Level::Avx2, Level::Avx512] {
                assert_eq!(dispatch_at_most(limit, Everything(numbers)), plain, "{limit:?}");
            }
        }
    }

    #[test]
    fn reciprocal_roots_are_good_to_two_units_in_the_last_place() {
        let mut random = fastrand::Rng::with_seed(5);
        for _ in 0..20_000 {
            let value = (random.f64() + 0.5) * 2f64.powi(random.i32(-300..300));
            let found = Portable.reciprocal_sqrt([value; LANES])[0];
            assert!((found * value.sqrt() - 1.0).abs() <= 4.0 * f64::EPSILON, "{value}: {found}");
        }
        assert!(Portable.reciprocal_sqrt([0.0; LANES])[0] > 1e150);
    }
}
