//! Two wheels on two topics: the right wheel's numbers at the left wheel's instants.
//!
//! Counts and angles are interpolated linearly between the two messages around an instant, counts rounded
//! to whole ones. A speed holds over the interval that ends at its message, so the right wheel's is the
//! mean over the left wheel's interval; speeds of the instant are interpolated. Left messages without a
//! right one on both sides near by are left out.

use dataset::import::csv::Rates;
use dataset::median;

use crate::clock::{self, Clock, Times};
use crate::error::RosBagError;
use crate::topics::{Survey, Topic};
use crate::wheels::WheelQuantity;

/// Ratio of the two topics' rates, and of a step to the usual one, from which on there is nothing to
/// interpolate: half the speed of a wheel that starts is missed within some steps.
const MAX_RATE_RATIO: f64 = 4.0;

/// Integers of `std_msgs`, which are counts where nobody says what they are.
pub(crate) const COUNT_TYPES: [&str; 8] = [
    "std_msgs/msg/Int8",
    "std_msgs/msg/Int16",
    "std_msgs/msg/Int32",
    "std_msgs/msg/Int64",
    "std_msgs/msg/UInt8",
    "std_msgs/msg/UInt16",
    "std_msgs/msg/UInt32",
    "std_msgs/msg/UInt64",
];

/// The number of one wheel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct WheelNumber {
    pub(crate) topic: String,
    pub(crate) type_name: String,
    pub(crate) path: String,
}

/// Both wheels, and what their numbers are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct WheelPair {
    pub(crate) left: WheelNumber,
    pub(crate) right: WheelNumber,
    pub(crate) quantity: WheelQuantity,
}

impl WheelPair {
    /// Of `LEFT_TOPIC[.field],RIGHT_TOPIC[.field]`; none of a single topic.
    pub(crate) fn parse(
        survey: &Survey,
        wheels: &str,
        quantity: Option<WheelQuantity>,
    ) -> Result<Option<Self>, RosBagError> {
        let Some((left, right)) = wheels.split_once(',') else { return Ok(None) };
        let (left, right) = (number(survey, left.trim())?, number(survey, right.trim())?);
        let refuse = |why: &str| {
            let (topic, type_name) = (left.topic.clone(), left.type_name.clone());
            RosBagError::Unusable { topic, type_name, why: why.to_owned() }
        };
        if left == right {
            return Err(refuse("it is named for both wheels; say --wheels LEFT_TOPIC,RIGHT_TOPIC"));
        }
        let are_counts = [&left, &right].iter().all(|of| COUNT_TYPES.contains(&&of.type_name[..]));
        let quantity = match quantity {
            Some(WheelQuantity::Twist) => {
                return Err(refuse("a twist is of the robot, not of a wheel; say --as ticks, rad, radps or mps"));
            }
            Some(quantity) => quantity,
            None if are_counts => WheelQuantity::Ticks,
            None => return Err(refuse("what its numbers are is not plain; say --as ticks, rad, radps or mps")),
        };
        Ok(Some(Self { left, right, quantity }))
    }

    /// What is read, for the user.
    pub(crate) fn describe(&self) -> String {
        let Self { left, right, .. } = self;
        format!("left {} of {}, right {} of {} at the left's instants", left.path, left.topic, right.path, right.topic)
    }

    /// Both topics, for the user.
    pub(crate) fn topics(&self) -> String {
        format!("{},{}", self.left.topic, self.right.topic)
    }
}

/// A topic and the path of a number in its messages.
fn number(survey: &Survey, text: &str) -> Result<WheelNumber, RosBagError> {
    let (name, path) = text.split_once('.').map_or((text, None), |(name, path)| (name, Some(path)));
    let topic: &Topic = survey.named("--wheels", name)?;
    let path = match path {
        Some(path) => path.to_owned(),
        None => match &topic.numbers[..] {
            [only] => only.clone(),
            all => {
                let numbers = if all.is_empty() { "none".to_owned() } else { all.join(", ") };
                let why =
                    format!("which number is the wheel's is not plain; say {name}.PATH; its numbers are {numbers}");
                return Err(topic.unusable(why));
            }
        },
    };
    Ok(WheelNumber { topic: topic.name.clone(), type_name: topic.type_name.clone(), path })
}

/// What of two topics was put together.
#[derive(Debug, Default)]
pub(crate) struct Paired {
    /// Times of the left wheel's messages, and both numbers.
    pub(crate) times: Vec<Times>,
    pub(crate) values: Vec<[f64; 2]>,
    /// Messages of the left wheel that are without a right one.
    pub(crate) left_out: usize,
}

/// How the right wheel's numbers are taken over.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Resampling {
    pub(crate) quantity: WheelQuantity,
    pub(crate) rates: Rates,
    pub(crate) counter_bits: Option<u8>,
}

/// One wheel's messages in the order of time: nanoseconds and number.
fn series(topic: &str, times: &[Times], values: &[f64], clock: Clock) -> Result<Vec<(i64, f64)>, RosBagError> {
    let ordered = clock::ordered(topic, times, clock, false)?;
    Ok(ordered.rows.into_iter().map(|(row, time_ns)| (time_ns, values[row])).collect())
}

fn median_step_s(series: &[(i64, f64)]) -> f64 {
    median(series.windows(2).map(|pair| clock::seconds(pair[0].0, pair[1].0))).unwrap_or(f64::INFINITY)
}

/// Puts the right wheel's numbers beside the left's.
pub(crate) fn pair(
    of: &WheelPair,
    left: (&[Times], &[f64]),
    right: (&[Times], &[f64]),
    resampling: Resampling,
) -> Result<Paired, RosBagError> {
    // Stamps of one and receipts of the other would be two clocks.
    let clocks = [left.0, right.0].map(clock::clock);
    let clock = if clocks == [Clock::Stamps; 2] { Clock::Stamps } else { Clock::Receipt };
    let left_series = series(&of.left.topic, left.0, left.1, clock)?;
    let right_series = series(&of.right.topic, right.0, right.1, clock)?;
    let refuse = |why: String| {
        let (topic, type_name) = (of.topics(), of.left.type_name.clone());
        RosBagError::Unusable { topic, type_name, why }
    };
    let [left_s, right_s] = [&left_series, &right_series].map(|series| median_step_s(series));
    if !(left_s / right_s <= MAX_RATE_RATIO && right_s / left_s <= MAX_RATE_RATIO) {
        return Err(refuse(format!(
            "the left wheel has a message every {left_s:.4} s and the right one every {right_s:.4} s; a wheel in {MAX_RATE_RATIO} times as long steps cannot be paired with the other"
        )));
    }
    let integral = Integral::of(&right_series, right_s);
    let mut paired = Paired::default();
    let mut before_ns = None;
    for (time_ns, value) in &left_series {
        let at = match (resampling.quantity.is_rate(), resampling.rates) {
            (true, Rates::IntervalEnd) => integral.mean(before_ns, *time_ns),
            _ => around(&right_series, *time_ns, right_s).map(|of| of.value(resampling)),
        };
        before_ns = Some(*time_ns);
        let Some(right) = at else {
            paired.left_out += 1;
            continue;
        };
        let times = match clock {
            Clock::Stamps => Times { stamp_ns: Some(*time_ns), received_ns: *time_ns },
            Clock::Receipt => Times { stamp_ns: None, received_ns: *time_ns },
        };
        paired.times.push(times);
        paired.values.push([*value, right]);
    }
    if paired.values.len() < 2 {
        return Err(refuse("fewer than two messages of the left wheel are among those of the right one".to_owned()));
    }
    Ok(paired)
}

/// The messages before and after an instant.
struct Around {
    from: f64,
    to: f64,
    share: f64,
}

impl Around {
    fn value(&self, resampling: Resampling) -> f64 {
        let Self { from, to, share } = *self;
        let is_counted = resampling.quantity == WheelQuantity::Ticks;
        // The shortest way round of a counter that wraps, from the nearer of the two.
        let turn = resampling.counter_bits.filter(|_| is_counted).map(|bits| 2.0_f64.powi(bits.into()));
        let step = turn.map_or(to - from, |turn| {
            let step = (to - from).rem_euclid(turn);
            if step > 0.5 * turn { step - turn } else { step }
        });
        let value = if share < 0.5 { from + share * step } else { to - (1.0 - share) * step };
        if is_counted { value.round() } else { value }
    }
}

/// None outside, and within a gap.
fn around(series: &[(i64, f64)], time_ns: i64, step_s: f64) -> Option<Around> {
    let after = series.partition_point(|(at_ns, _)| *at_ns < time_ns);
    let (to_ns, to) = *series.get(after)?;
    if to_ns == time_ns {
        return Some(Around { from: to, to, share: 1.0 });
    }
    let (from_ns, from) = *series.get(after.checked_sub(1)?)?;
    let (whole_s, part_s) = (clock::seconds(from_ns, to_ns), clock::seconds(from_ns, time_ns));
    (whole_s <= MAX_RATE_RATIO * step_s).then_some(Around { from, to, share: part_s / whole_s })
}

/// The integral of speeds that each hold over the interval that ends at their message.
struct Integral {
    sums: Vec<(i64, f64)>,
    first_rate: f64,
    step_s: f64,
}

impl Integral {
    fn of(series: &[(i64, f64)], step_s: f64) -> Self {
        let (mut sum, mut before_ns) = (0.0, None);
        let mut sums = Vec::with_capacity(series.len());
        for (time_ns, rate) in series {
            sum += before_ns.map_or(0.0, |before_ns| rate * clock::seconds(before_ns, *time_ns));
            sums.push((*time_ns, sum));
            before_ns = Some(*time_ns);
        }
        Self { sums, first_rate: series.first().map_or(0.0, |(_, rate)| *rate), step_s }
    }

    fn at(&self, time_ns: i64) -> Option<f64> {
        let Around { from, to, share } = around(&self.sums, time_ns, self.step_s)?;
        Some(from + share * (to - from))
    }

    /// Over the interval that ends at an instant; nothing ends at the first.
    fn mean(&self, from_ns: Option<i64>, to_ns: i64) -> Option<f64> {
        let to = self.at(to_ns)?;
        let from = from_ns.and_then(|from_ns| Some((from_ns, self.at(from_ns)?)));
        Some(from.map_or(self.first_rate, |(from_ns, from)| (to - from) / clock::seconds(from_ns, to_ns)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wheel_pair(quantity: WheelQuantity) -> WheelPair {
        let number = |topic: &str| WheelNumber {
            topic: topic.to_owned(),
            type_name: "std_msgs/msg/Int32".to_owned(),
            path: "data".to_owned(),
        };
        WheelPair { left: number("/left"), right: number("/right"), quantity }
    }

    fn receipts(times_ms: &[i64]) -> Vec<Times> {
        times_ms.iter().map(|time| Times { stamp_ns: None, received_ns: time * 1_000_000 }).collect()
    }

    fn paired(
        quantity: WheelQuantity,
        counter_bits: Option<u8>,
        rates: Rates,
        left_ms: &[i64],
        right: (&[i64], &[f64]),
    ) -> Result<Vec<[f64; 2]>, String> {
        let zeros = vec![0.0; left_ms.len()];
        let resampling = Resampling { quantity, rates, counter_bits };
        let (left_times, right_times) = (receipts(left_ms), receipts(right.0));
        pair(&wheel_pair(quantity), (&left_times, &zeros), (&right_times, right.1), resampling)
            .map(|paired| paired.values)
            .map_err(|error| error.to_string())
    }

    #[test]
    fn counts_are_interpolated_to_whole_ones_and_over_a_wrap() {
        let of = |bits, values: &[f64]| {
            let right = (&[50, 150, 250][..], values);
            let found = paired(WheelQuantity::Ticks, bits, Rates::IntervalEnd, &[0, 100, 160, 200, 300], right);
            found.map(|rows| rows.into_iter().map(|row| row[1]).collect::<Vec<f64>>())
        };
        // The instants 0 and 300 ms are outside; a tenth of 30 counts is 3.
        assert_eq!(of(None, &[0.0, 10.0, 40.0]), Ok(vec![5.0, 13.0, 25.0]));
        // 250, 260 and 290 of a counter of 8 bits; 255 is before the wrap, 263 and 275 behind it.
        assert_eq!(of(Some(8), &[250.0, 4.0, 34.0]), Ok(vec![-1.0, 7.0, 19.0]));
    }

    #[test]
    fn speeds_are_means_over_the_left_wheels_intervals_or_of_the_instant() {
        let right = (&[0, 100, 200, 300][..], &[9.0, 1.0, 3.0, 5.0][..]);
        let left = [50, 150, 250];
        let means = paired(WheelQuantity::Speeds, None, Rates::IntervalEnd, &left, right).expect("rows");
        // From 50 to 150 ms half the time 1, half the time 3.
        assert!((means[1][1] - 2.0).abs() < 1e-12 && (means[2][1] - 4.0).abs() < 1e-12, "{means:?}");
        let instants = paired(WheelQuantity::Speeds, None, Rates::Instantaneous, &left, right).expect("rows");
        assert_eq!(instants, [[0.0, 5.0], [0.0, 2.0], [0.0, 4.0]]);
    }

    #[test]
    fn other_rates_gaps_and_other_times_are_no_pair() {
        let right = (&[0, 1000, 2000][..], &[0.0, 1.0, 2.0][..]);
        let of = |left_ms: &[i64], right| paired(WheelQuantity::Angles, None, Rates::IntervalEnd, left_ms, right);
        let refused = of(&[0, 100, 200, 300], right).expect_err("rates");
        assert!(refused.contains("every 0.1000 s and the right one every 1.0000 s"), "{refused}");
        assert!(of(&[5000, 6000, 7000], right).is_err_and(|why| why.contains("fewer than two messages")));
        // Nothing is made up for a second in which the right wheel is silent.
        let gap = (&[0, 100, 200, 1200, 1300][..], &[0.0, 1.0, 2.0, 12.0, 13.0][..]);
        let rows = of(&[50, 150, 250, 1150, 1250], gap).expect("rows");
        assert_eq!(rows.iter().map(|row| row[1]).collect::<Vec<f64>>(), [0.5, 1.5, 12.5]);
    }
}
