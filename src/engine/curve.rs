//! Values over time, given at points and straight between them.

/// `N` values at ascending times. Before the first and after the last point they stay as they are there.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve<const N: usize> {
    /// Seconds, ascending; at least one.
    pub time_s: Vec<f64>,
    /// One entry a time.
    pub value: Vec<[f64; N]>,
}

impl<const N: usize> Curve<N> {
    /// The values at a time, seconds.
    pub fn at(&self, time_s: f64) -> [f64; N] {
        let after = self.time_s.partition_point(|&t| t <= time_s);
        if after == 0 || after == self.time_s.len() {
            return self.value[after.saturating_sub(1)];
        }
        let (from, to) = (self.time_s[after - 1], self.time_s[after]);
        let share = (time_s - from) / (to - from);
        let (a, b) = (self.value[after - 1], self.value[after]);
        std::array::from_fn(|k| a[k] + share * (b[k] - a[k]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_lie_on_the_lines_between_points_and_stay_beyond_them() {
        let curve = Curve { time_s: vec![1.0, 2.0, 4.0], value: vec![[0.0], [10.0], [-10.0]] };
        for (time_s, value) in [(0.0, 0.0), (1.0, 0.0), (1.25, 2.5), (2.0, 10.0), (3.0, 0.0), (9.0, -10.0)] {
            assert_eq!(curve.at(time_s), [value], "at {time_s} s");
        }
    }
}
