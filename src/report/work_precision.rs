//! Error against time: what no run beats, and how fast time grows as the error falls.

/// Those of `(time, error)` that no other one beats in both, by ascending time.
pub fn pareto(mut points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut front: Vec<(f64, f64)> = Vec::new();
    for (time, error) in points {
        if front.last().is_none_or(|(_, least)| error < *least) {
            front.push((time, error));
        }
    }
    front
}

/// `s` of `time ~ error^-s`: the slope of the least-squares line through the logarithms; `None` below three points.
pub fn exponent(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    let mean = |value: fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / n;
    let (mean_x, mean_y) = (mean(|p| p.1.ln()), mean(|p| p.0.ln()));
    let product: f64 = points.iter().map(|p| (p.1.ln() - mean_x) * (p.0.ln() - mean_y)).sum();
    let square: f64 = points.iter().map(|p| (p.1.ln() - mean_x).powi(2)).sum();
    (points.len() >= 3 && square > 0.0).then(|| -product / square)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pareto_front_holds_what_nothing_beats() {
        let points = vec![(4.0, 0.1), (1.0, 0.4), (2.0, 0.5), (2.0, 0.2), (8.0, 0.1)];
        assert_eq!(pareto(points), vec![(1.0, 0.4), (2.0, 0.2), (4.0, 0.1)]);
    }

    #[test]
    fn the_exponent_is_that_of_a_power_law() {
        let points: Vec<(f64, f64)> = [0.4, 0.2, 0.1f64].map(|error| (3.0 * error.powf(-5.0), error)).into();
        assert!((exponent(&points).unwrap() - 5.0).abs() < 1e-12);
        assert_eq!(exponent(&points[..2]), None);
    }
}
