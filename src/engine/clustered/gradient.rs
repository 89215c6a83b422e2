//! The textbook's pressure gradient on clusters: `a_i = -(D / (n0_g rho)) sum_j (p_j - pmin_i) r_ij w(r_ij, re_g) / r_ij^2`,
//! gathered in one walk as `sum_j p_j g_ij - pmin_i sum_j g_ij` with the minimum found on the way.

use std::ops::Range;

use super::{add_weighted, from_lanes, load, walk};
use crate::base::simd::{Kernel, LANES, Simd};
use crate::engine::kernel;
use crate::engine::search::clusters::{Clusters, Lanes, with_pressure};

/// Sums of some clusters of fluid and bodies; pressures stand beside the points of slots.
pub struct Gradient<'a> {
    pub clusters: &'a Clusters,
    pub kernel: kernel::Kernel,
    pub pieces: Range<usize>,
    pub sums: &'a mut [Lanes],
}

impl Kernel for Gradient<'_> {
    type Out = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Gradient { clusters, kernel, pieces, sums } = self;
        let (re, re2, one) =
            (s.splat(kernel.radius_m), s.splat(kernel.radius_m * kernel.radius_m), s.splat(-1.0));
        let most = s.splat(1.0 / kernel.floor_m);
        let points = &clusters.slots.points[..];
        let small = clusters.small_reaches(kernel.radius_m);
        for (cluster, sums) in pieces.zip(sums) {
            let x = load(s, &clusters.slots.lanes[cluster]);
            let first = cluster * LANES;
            let own: [f64; LANES] = std::array::from_fn(|k| points[first + k][3]);
            let zero = s.splat(0.0);
            let (mut least, mut weighted, mut plain) = (s.load(&own), [zero; 3], [zero; 3]);
            for lists in with_pressure(&clusters.mobile) {
                let near = lists.of(cluster);
                for (j, choice) in walk(near, near.reaching(small)) {
                    let point = &points[j];
                    let r = from_lanes(s, point, &x);
                    let r2 = s.dot(r, r);
                    let within = s.both(s.mask(choice), s.below(r2, re2));
                    let over = s.min(s.reciprocal_sqrt(r2), most);
                    let g = s.keep(within, s.mul(s.mul_add(re, over, one), s.mul(over, over)));
                    let p = s.splat(point[3]);
                    least = s.select(within, s.min(p, least), least);
                    add_weighted(s, &mut weighted, s.mul(p, g), r);
                    add_weighted(s, &mut plain, g, r);
                }
            }
            for d in 0..3 {
                s.store(s.neg_mul_add(least, plain[d], weighted[d]), &mut sums[d]);
            }
        }
    }
}
