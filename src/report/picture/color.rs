//! Colours of values: viridis, whose steps look equally large, in grey and to most colour-blind readers too.

/// Every eighth of the 256 colours of viridis (van der Walt & Smith 2015, matplotlib, CC0).
const VIRIDIS: [[u8; 3]; 33] = [
    [68, 1, 84],
    [71, 13, 96],
    [72, 24, 106],
    [72, 35, 116],
    [71, 45, 123],
    [69, 55, 129],
    [66, 64, 134],
    [62, 73, 137],
    [59, 82, 139],
    [55, 91, 141],
    [51, 99, 141],
    [47, 107, 142],
    [44, 114, 142],
    [41, 122, 142],
    [38, 130, 142],
    [35, 137, 142],
    [33, 145, 140],
    [31, 152, 139],
    [31, 160, 136],
    [34, 167, 133],
    [40, 174, 128],
    [50, 182, 122],
    [63, 188, 115],
    [78, 195, 107],
    [94, 201, 98],
    [112, 207, 87],
    [132, 212, 75],
    [152, 216, 62],
    [173, 220, 48],
    [194, 223, 35],
    [216, 226, 25],
    [236, 229, 27],
    [253, 231, 37],
];

/// Rigid bodies: a colour that viridis does not have (vermilion of Okabe & Ito).
pub const BODY: [u8; 3] = [213, 94, 0];

/// The colour of a share from 0 to 1, interpolated linearly between those of the table. What is no number has the first.
pub fn viridis(share: f64) -> [u8; 3] {
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let place = share * (VIRIDIS.len() - 1) as f64;
    let below = (place as usize).min(VIRIDIS.len() - 2);
    let (from, to, rest) = (VIRIDIS[below], VIRIDIS[below + 1], place - below as f64);
    [0, 1, 2].map(|c| (f64::from(from[c]) + rest * (f64::from(to[c]) - f64::from(from[c]))).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_goes_from_dark_to_light_without_a_step_back() {
        let lightness =
            |[r, g, b]: [u8; 3]| 0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b);
        let steps: Vec<f64> = (0..=100).map(|k| lightness(viridis(f64::from(k) / 100.0))).collect();
        assert!(steps.is_sorted());
        assert_eq!((viridis(0.0), viridis(1.0)), (VIRIDIS[0], VIRIDIS[32]));
        assert_eq!((viridis(-1.0), viridis(f64::NAN)), (VIRIDIS[0], VIRIDIS[0]));
    }
}
