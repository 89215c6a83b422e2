//! From values to places along an axis: scales, automatic ranges and ticks.

use anyhow::{Context, Result};

use super::{Axis, Scale};

/// Larger values would overflow while a range is padded, and no measurement comes near them.
const LARGEST: f64 = 1e300;

/// The mantissas at which a tick or the end of a decimal range looks natural.
const ROUND_MANTISSAS: [f64; 3] = [1.0, 2.0, 5.0];

impl Scale {
    /// The place of a value in the unit in which the axis is even; none if the axis has no such
    /// place.
    pub(super) fn place(self, value: f64) -> Option<f64> {
        if !value.is_finite() || value.abs() > LARGEST {
            return None;
        }
        match self {
            Scale::Linear => Some(value),
            Scale::Log2 => (value > 0.0).then(|| value.log2()),
            Scale::Log10 => (value > 0.0).then(|| value.log10()),
        }
    }

    fn value(self, place: f64) -> f64 {
        match self {
            Scale::Linear => place,
            Scale::Log2 => place.exp2(),
            Scale::Log10 => 10f64.powf(place),
        }
    }
}

/// The direction of an axis: categories need room on both sides, and heights should start at zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    Across,
    Up,
}

/// A labelled place on an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub(super) place: f64,
    pub(super) label: String,
}

/// An axis with its range settled.
#[derive(Debug, Clone)]
pub(super) struct Ruler {
    scale: Scale,
    low: f64,
    high: f64,
    /// The labelled places.
    pub(super) ticks: Vec<Tick>,
    /// Places of fainter grid lines between the ticks.
    pub(super) faint: Vec<f64>,
}

impl Ruler {
    /// Settles the range from the axis itself or, where it leaves that open, from the values to be
    /// shown.
    pub(super) fn new(axis: &Axis, values: &[f64], direction: Direction) -> Result<Self> {
        let scale = axis.scale;
        let places: Vec<f64> = values.iter().filter_map(|&value| scale.place(value)).collect();
        let given = explicit_ticks(axis);
        let (low, high) = match axis.range {
            Some(range) => explicit_range(axis, range)?,
            None => match extent(places.iter().chain(given.iter().flatten().map(|tick| &tick.place))) {
                Some(span) => automatic_range(scale, span, given.as_deref(), direction),
                None => {
                    return Ok(Self { scale, low: 0.0, high: 1.0, ticks: Vec::new(), faint: Vec::new() });
                }
            },
        };
        let (mut ticks, mut faint) = match given {
            Some(ticks) => (ticks, Vec::new()),
            None => automatic_ticks(scale, low, high),
        };
        let slack = (high - low) * 1e-9;
        let inside = |place: f64| (low - slack..=high + slack).contains(&place);
        ticks.retain(|tick| inside(tick.place));
        faint.retain(|&place| inside(place));
        Ok(Self { scale, low, high, ticks, faint })
    }

    /// Turns every other tick into a faint line, for labels that have no room side by side.
    pub(super) fn thin(&mut self) {
        let ticks = std::mem::take(&mut self.ticks);
        for (index, tick) in ticks.into_iter().enumerate() {
            match index % 2 {
                0 => self.ticks.push(tick),
                _ => self.faint.push(tick.place),
            }
        }
    }

    /// How far along the axis a value lies: 0 at its start, 1 at its end, and beyond these outside
    /// it.
    pub(super) fn fraction(&self, value: f64) -> Option<f64> {
        self.scale.place(value).map(|place| self.fraction_of_place(place))
    }

    pub(super) fn fraction_of_place(&self, place: f64) -> f64 {
        (place - self.low) / (self.high - self.low)
    }
}

fn explicit_ticks(axis: &Axis) -> Option<Vec<Tick>> {
    let mut ticks: Vec<Tick> = axis
        .ticks
        .as_ref()?
        .iter()
        .filter_map(|(value, label)| Some(Tick { place: axis.scale.place(*value)?, label: label.clone() }))
        .collect();
    ticks.sort_by(|one, other| one.place.total_cmp(&other.place));
    Some(ticks)
}

fn explicit_range(axis: &Axis, (low, high): (f64, f64)) -> Result<(f64, f64)> {
    let places = axis.scale.place(low).zip(axis.scale.place(high));
    let range = places.filter(|(low, high)| high - low > 1e-9 * low.abs().max(high.abs()));
    range.with_context(|| {
        let Axis { label, scale, .. } = axis;
        format!("the axis {label:?} cannot run from {low:?} to {high:?} on a {scale:?} scale")
    })
}

fn extent<'p>(places: impl Iterator<Item = &'p f64>) -> Option<(f64, f64)> {
    places.fold(None, |span, &place| match span {
        None => Some((place, place)),
        Some((low, high)) => Some((place.min(low), place.max(high))),
    })
}

fn automatic_range(
    scale: Scale,
    span: (f64, f64),
    ticks: Option<&[Tick]>,
    direction: Direction,
) -> (f64, f64) {
    match (scale, ticks, direction) {
        (Scale::Linear, Some(ticks), Direction::Across) => category_range(span, ticks),
        (Scale::Linear, _, _) => linear_range(span, direction),
        (Scale::Log2, _, _) => binary_range(span),
        (Scale::Log10, _, _) => decimal_range(span),
    }
}

/// Half a step of free room beside the first and the last category.
fn category_range((low, high): (f64, f64), ticks: &[Tick]) -> (f64, f64) {
    let steps = ticks.windows(2).map(|pair| pair[1].place - pair[0].place);
    let step = steps.filter(|step| *step > 0.0).fold(f64::INFINITY, f64::min);
    let room = if step.is_finite() { step / 2.0 } else { 0.5 };
    if high - low + 2.0 * room > 1e-9 * low.abs().max(high.abs()) {
        (low - room, high + room)
    } else {
        linear_range((low, high), Direction::Across)
    }
}

fn linear_range((low, high): (f64, f64), direction: Direction) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    let room = if high - low > 1e-9 * size {
        (high - low) * 0.05
    } else if size > f64::MIN_POSITIVE {
        size * 0.1
    } else {
        1.0
    };
    let starts_at_zero = direction == Direction::Up && low >= 0.0 && low - room < 0.25 * high.max(room);
    (if starts_at_zero { 0.0 } else { low - room }, high + room)
}

/// Ends on half powers of two, never right at a value and never less than an octave apart.
fn binary_range((low, high): (f64, f64)) -> (f64, f64) {
    let room = if high - low < 1.0 { 0.5 } else { 0.02 * (high - low) };
    (((low - room) * 2.0).floor() / 2.0, ((high + room) * 2.0).ceil() / 2.0)
}

/// Ends on one, two or five times a power of ten, never right at a value.
fn decimal_range((low, high): (f64, f64)) -> (f64, f64) {
    let room = 0.02 + 0.02 * (high - low);
    let round_places = |place: f64| {
        let decade = place.floor();
        [1.0, 2.0, 5.0, 10.0].map(|mantissa: f64| decade + mantissa.log10())
    };
    let (low, high) = (low - room, high + room);
    let below = round_places(low).into_iter().filter(|place| *place <= low);
    let above = round_places(high).into_iter().filter(|place| *place >= high);
    (below.fold(low.floor(), f64::max), above.fold(high.floor() + 1.0, f64::min))
}

fn automatic_ticks(scale: Scale, low: f64, high: f64) -> (Vec<Tick>, Vec<f64>) {
    match scale {
        Scale::Linear => (even_ticks(scale, low, high), Vec::new()),
        Scale::Log2 if high.floor() - low.ceil() < 1.0 => (even_ticks(scale, low, high), Vec::new()),
        Scale::Log2 => (binary_ticks(low, high), Vec::new()),
        Scale::Log10 if high - low < 0.7 => (even_ticks(scale, low, high), Vec::new()),
        Scale::Log10 => decimal_ticks(low, high),
    }
}

/// Ticks at even steps of the value, for linear axes and for logarithmic ones too short for powers.
fn even_ticks(scale: Scale, low: f64, high: f64) -> Vec<Tick> {
    let (low, high) = (scale.value(low), scale.value(high));
    let step = even_step(high - low);
    let (first, last) = ((low / step - 1e-6).ceil() as i64, (high / step + 1e-6).floor() as i64);
    let tick = |count: i64| {
        let value = count as f64 * step;
        Some(Tick { place: scale.place(value)?, label: even_label(value, step, low.abs().max(high.abs())) })
    };
    (first..=last).filter_map(tick).collect()
}

/// One, two or five times a power of ten, such that the span holds five to ten steps.
fn even_step(span: f64) -> f64 {
    let decade = 10f64.powf((span / 5.0).log10().floor());
    let fits = ROUND_MANTISSAS.iter().map(|mantissa| mantissa * decade).rfind(|step| *step <= span / 5.0);
    fits.unwrap_or(decade)
}

fn even_label(value: f64, step: f64, largest: f64) -> String {
    let exponent = (step.log10() + 1e-6).floor() as i32;
    if largest >= 1e6 || exponent < -5 {
        let power = (largest.log10() + 1e-6).floor() as i32;
        let digits = usize::try_from(power - exponent).unwrap_or(0).min(9);
        let mantissa = value / 10f64.powi(power);
        return if value == 0.0 {
            "0".to_owned()
        } else {
            format!("{}×{}", plain(mantissa, digits), power_of(10, power))
        };
    }
    plain(value, usize::try_from(-exponent).unwrap_or(0))
}

fn binary_ticks(low: f64, high: f64) -> Vec<Tick> {
    let (first, last) = (low.ceil() as i32, high.floor() as i32);
    let stride = (last - first) / 14 + 1;
    let label = |power: i32| match power {
        0..=16 => plain(f64::from(power).exp2(), 0),
        -3..=-1 => plain(f64::from(power).exp2(), power.unsigned_abs() as usize),
        _ => power_of(2, power),
    };
    let on_stride = (first..=last).filter(|power| power.rem_euclid(stride) == 0);
    on_stride.map(|power| Tick { place: f64::from(power), label: label(power) }).collect()
}

/// Labels decades, and on a short axis twos and fives as well; the other digits get faint lines.
fn decimal_ticks(low: f64, high: f64) -> (Vec<Tick>, Vec<f64>) {
    let (first, last) = (low.floor() as i32, high.ceil() as i32);
    let stride = (last - first) / 9 + 1;
    let labels_between = high - low <= 2.2;
    let label = if first >= -3 && last <= 5 { short_label } else { power_label };
    let (mut ticks, mut faint) = (Vec::new(), Vec::new());
    for decade in first..=last {
        for digit in 1..=9 {
            let mantissa = f64::from(digit);
            let place = f64::from(decade) + mantissa.log10();
            let labelled = match digit {
                1 => decade.rem_euclid(stride) == 0,
                _ => labels_between && ROUND_MANTISSAS.contains(&mantissa),
            };
            match labelled {
                true => ticks.push(Tick { place, label: label(digit, decade) }),
                false if stride == 1 || digit == 1 => faint.push(place),
                false => {}
            }
        }
    }
    (ticks, faint)
}

fn short_label(digit: i32, decade: i32) -> String {
    let decimals = usize::try_from(-decade).unwrap_or(0);
    plain(f64::from(digit) * 10f64.powi(decade), decimals)
}

/// For axes with very large or very small values, where a row of zeros would have to be counted.
fn power_label(digit: i32, decade: i32) -> String {
    match (digit, decade) {
        (_, 0) => digit.to_string(),
        (1, _) => power_of(10, decade),
        _ => format!("{digit}×{}", power_of(10, decade)),
    }
}

/// A number with a true minus sign, and without one where it rounds to zero.
fn plain(value: f64, decimals: usize) -> String {
    let digits = format!("{:.decimals$}", value.abs());
    let is_zero = digits.chars().all(|letter| matches!(letter, '0' | '.'));
    if value < 0.0 && !is_zero { format!("−{digits}") } else { digits }
}

/// About three significant digits, as the total above a bar needs.
pub(super) fn three_digits(value: f64) -> String {
    let exponent = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    match exponent {
        -4..=5 => plain(value, usize::try_from(2 - exponent).unwrap_or(0)),
        _ => format!("{}×{}", plain(value / 10f64.powi(exponent), 2), power_of(10, exponent)),
    }
}

fn power_of(base: i32, exponent: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raise = |letter: char| letter.to_digit(10).map_or('⁻', |digit| RAISED[digit as usize]);
    let raised: String = exponent.to_string().chars().map(raise).collect();
    format!("{base}{raised}")
}
