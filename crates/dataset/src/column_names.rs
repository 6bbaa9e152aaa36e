//! What usual names of columns mean: for the importer of CSV files, and for what the reader says of a table
//! whose columns are named otherwise.

use crate::column_words::{
    COUNTED, HEADING, LEFT, NEVER, NUMBERED, OF_ROTATION, OF_WHEEL, OTHER_THAN_RATES, OUTSIDE, OWN, RATE, RIGHT, RUN,
    SPEED, TIME, YAW_RATE,
};
use crate::name_units::{take_unit, tokens_of, without_bracketed_unit};
use crate::unit::Unit;

/// What a column of a log can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Quantity {
    /// Which run a row belongs to.
    Run,
    /// When.
    Time,
    /// Nanoseconds beside the whole seconds of the time.
    Nanoseconds,
    /// The left wheel.
    Left,
    /// The right wheel.
    Right,
    /// Forward speed of the robot by its wheels.
    Speed,
    /// Yaw rate of the robot by its wheels.
    YawRate,
    /// Yaw rate of the robot by a gyroscope.
    Gyro,
    /// Position in the room.
    X,
    /// Position in the room.
    Y,
    /// Heading in the room.
    Heading,
    /// Component of the orientation's quaternion.
    Qx,
    /// Component of the orientation's quaternion.
    Qy,
    /// Component of the orientation's quaternion.
    Qz,
    /// Component of the orientation's quaternion.
    Qw,
}

impl Quantity {
    /// All, in the order in which they are shown.
    pub const ALL: [Self; 15] = [
        Self::Run,
        Self::Time,
        Self::Nanoseconds,
        Self::Left,
        Self::Right,
        Self::Speed,
        Self::YawRate,
        Self::Gyro,
        Self::X,
        Self::Y,
        Self::Heading,
        Self::Qx,
        Self::Qy,
        Self::Qz,
        Self::Qw,
    ];

    /// The name that `--map` uses.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Run => "run",
            Self::Time => "t",
            Self::Nanoseconds => "nanosec",
            Self::Left => "left",
            Self::Right => "right",
            Self::Speed => "v",
            Self::YawRate => "omega",
            Self::Gyro => "gyro",
            Self::X => "x",
            Self::Y => "y",
            Self::Heading => "theta",
            Self::Qx => "qx",
            Self::Qy => "qy",
            Self::Qz => "qz",
            Self::Qw => "qw",
        }
    }

    /// Whether it says where the robot stood.
    pub(crate) const fn is_of_pose(self) -> bool {
        matches!(self, Self::X | Self::Y | Self::Heading | Self::Qx | Self::Qy | Self::Qz | Self::Qw)
    }

    /// Whether it says how the robot moved, by its own instruments.
    pub(crate) const fn is_of_robot(self) -> bool {
        matches!(self, Self::Left | Self::Right | Self::Speed | Self::YawRate | Self::Gyro)
    }

    /// Whether it can be in a unit: of a wheel its counts, its angle, its contact's path, or their rates.
    pub(crate) fn accepts(self, unit: Unit) -> bool {
        match self {
            Self::Nanoseconds => unit == Unit::Ns,
            Self::Run | Self::Qx | Self::Qy | Self::Qz | Self::Qw => false,
            Self::Time => Unit::TIMES.contains(&unit),
            Self::Left | Self::Right => Unit::WHEELS.contains(&unit) || Unit::LENGTHS.contains(&unit),
            Self::Speed => unit.is_of_contact(),
            Self::YawRate | Self::Gyro => unit.is_rate() && !unit.is_of_contact(),
            Self::X | Self::Y => Unit::LENGTHS.contains(&unit),
            Self::Heading => Unit::ANGLES.contains(&unit),
        }
    }

    /// The quantity of a `--map` name.
    #[must_use]
    pub fn of_key(key: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|quantity| quantity.key() == key)
    }
}

/// What a name says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NameReading {
    pub(crate) quantity: Quantity,
    pub(crate) unit: Option<Unit>,
    /// Of several columns of one quantity the one of the highest rank is meant; two of it are ambiguous.
    pub(crate) rank: u8,
    /// The robot's own estimate: no outside instrument's.
    pub(crate) is_own: bool,
    /// An outside instrument's, by name.
    pub(crate) is_outside: bool,
    /// The name says that the wheel is a rate.
    pub(crate) is_rate: bool,
    /// The name says that the wheel is counted.
    pub(crate) is_counted: bool,
    /// The name says that the wheel is an angle.
    pub(crate) is_angle: bool,
}

impl NameReading {
    const fn of(quantity: Quantity) -> Self {
        Self {
            quantity,
            unit: None,
            rank: 0,
            is_own: false,
            is_outside: false,
            is_rate: false,
            is_counted: false,
            is_angle: false,
        }
    }
}

/// Reads a column's name; `None` where it says nothing of these quantities.
pub(crate) fn read_name(name: &str) -> Option<NameReading> {
    let (name, mut unit) = without_bracketed_unit(name);
    let mut tokens = tokens_of(&name);
    if unit.is_none() {
        unit = take_unit(&mut tokens);
    }
    let has = |words: &[&str]| tokens.iter().any(|token| words.contains(&token.as_str()));
    let reading = |quantity, rank| Some(NameReading { unit, rank, ..NameReading::of(quantity) });
    if tokens.is_empty() {
        // "ms" alone is a time; "mm" alone says nothing.
        return unit.filter(|unit| Unit::TIMES.contains(unit)).and_then(|_| reading(Quantity::Time, 2));
    }
    // An Imu's angular velocity about z; of a gyroscope also without the axis.
    let of_axis = |axes: &[&str]| tokens.iter().any(|token| axes.contains(&token.as_str()));
    if has(&["gyro", "gyroscope", "imu"]) && !has(OTHER_THAN_RATES) {
        let is_rate = has(&["gyro", "gyroscope"]) || has(YAW_RATE) || (has(HEADING) && has(RATE));
        let is_about_z =
            of_axis(&["z", "wz", "gz", "yaw"]) || (!of_axis(&["x", "y", "wx", "wy", "gx", "gy"]) && tokens.len() == 1);
        return (is_rate && is_about_z).then(|| NameReading { unit, rank: 2, ..NameReading::of(Quantity::Gyro) });
    }
    if tokens.len() == 1 && of_axis(&["gz", "gyroz", "zgyro"]) {
        return reading(Quantity::Gyro, 1);
    }
    if has(NEVER) {
        return None;
    }
    if has(RUN) && tokens.iter().all(|token| RUN.contains(&&**token) || NUMBERED.contains(&&**token)) {
        return reading(Quantity::Run, 1);
    }
    if has(TIME) && !has(&["x", "y", "z"]) {
        let of_header = has(&["header"]) && has(&["stamp"]);
        let rank = match tokens.len() {
            _ if of_header => 4,
            1 => 3,
            _ => 2,
        };
        return reading(Quantity::Time, rank);
    }
    if let Some((quantity, words)) = side(&tokens) {
        let has = |known: &[&str]| words.iter().any(|word| known.contains(&word.as_str()));
        // `rpm_left`; no other word, as a German wheel is a Rad.
        let unit = unit.or(has(&["rpm"]).then_some(Unit::Rpm));
        // An encoder's rate is no reading of its counter.
        let of_rate = ["rate", "speed", "velocity", "vel", "rpm"];
        let is_counted = unit == Some(Unit::Ticks) || (has(COUNTED) && !has(&of_rate));
        let is_rate = !is_counted && (unit.is_some_and(Unit::is_rate) || has(RATE));
        let rank = match (is_counted, is_rate) {
            (true, _) => 3,
            (false, true) => 1,
            (false, false) => 2,
        };
        let is_angle = !is_counted && !is_rate && has(&["position", "pos", "angle", "ang", "phi", "theta", "winkel"]);
        return Some(NameReading { unit, rank, is_rate, is_counted, is_angle, ..NameReading::of(quantity) });
    }
    let last = tokens.last().map_or("", String::as_str);
    let is_own = has(OWN);
    let is_outside = !is_own && has(OUTSIDE);
    let rank = match (is_own, is_outside) {
        (true, _) => 0,
        (false, true) => 2,
        (false, false) => 1,
    };
    let pose = |quantity| Some(NameReading { unit, rank, is_own, is_outside, ..NameReading::of(quantity) });
    let moving = has(RATE) || has(&["linear", "angular", "lin"]);
    match (last, has(OF_ROTATION)) {
        ("qx", _) | ("x", true) => return pose(Quantity::Qx),
        ("qy", _) | ("y", true) => return pose(Quantity::Qy),
        ("qz", _) | ("z", true) => return pose(Quantity::Qz),
        ("qw", _) | ("w", true) => return pose(Quantity::Qw),
        ("x" | "px" | "xpos" | "posx", _) if !moving => return pose(Quantity::X),
        ("y" | "py" | "ypos" | "posy", _) if !moving => return pose(Quantity::Y),
        ("x", _) if has(&["linear", "lin"]) || has(SPEED) => return reading(Quantity::Speed, 1),
        ("z", _) if has(&["angular"]) || has(YAW_RATE) => return reading(Quantity::YawRate, 1),
        ("x" | "y" | "z", _) => return None,
        _ => {}
    }
    let turning = has(HEADING);
    if has(YAW_RATE) || (turning && has(RATE)) {
        return reading(Quantity::YawRate, 1);
    }
    if has(SPEED) {
        return reading(Quantity::Speed, 1);
    }
    if turning { pose(Quantity::Heading) } else { None }
}

/// The likely meaning of the columns of a table, as `--map` is written: one column a quantity.
pub(crate) fn likely_mapping(names: &[String]) -> Vec<(Quantity, String)> {
    let best = |quantity: Quantity| {
        let readings = names.iter().filter_map(|name| Some((read_name(name)?, name)));
        let of_it = readings.filter(|(reading, _)| reading.quantity == quantity && !reading.is_own);
        // The first of the highest rank.
        of_it.reduce(|best, next| if next.0.rank > best.0.rank { next } else { best }).map(|(_, name)| name.clone())
    };
    Quantity::ALL.into_iter().filter_map(|quantity| Some((quantity, best(quantity)?))).collect()
}

/// The wheel that a name speaks of, and its other words.
fn side(tokens: &[String]) -> Option<(Quantity, Vec<String>)> {
    if tokens.iter().any(|token| ["x", "y", "z"].contains(&token.as_str())) {
        return None;
    }
    for (quantity, words, letter) in [(Quantity::Left, LEFT, "l"), (Quantity::Right, RIGHT, "r")] {
        if let Some(at) = tokens.iter().position(|token| words.contains(&token.as_str())) {
            let others = tokens.iter().enumerate().filter(|(index, _)| *index != at);
            return Some((quantity, others.map(|(_, token)| token.clone()).collect()));
        }
        let known = |word: &str| COUNTED.contains(&word) || RATE.contains(&word) || OF_WHEEL.contains(&word);
        for token in tokens {
            let full = if quantity == Quantity::Left { "left" } else { "right" };
            let rest = [full, letter].into_iter().find_map(|affix| {
                let rest = token.strip_prefix(affix).filter(|rest| known(rest));
                rest.or_else(|| token.strip_suffix(affix).filter(|rest| known(rest)))
            });
            if let Some(rest) = rest {
                return Some((quantity, vec![rest.to_owned()]));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use Quantity::{Gyro, Heading, Left, Qw, Qz, Right, Run, Speed, Time, X, Y, YawRate};

    fn read(name: &str) -> Option<(Quantity, Option<Unit>)> {
        read_name(name).map(|reading| (reading.quantity, reading.unit))
    }

    #[test]
    fn usual_names_and_their_units_are_known() {
        for name in ["t", "time", "Time", "stamp", "timestamp", "ts", "Zeit", "field.header.stamp", "%time"] {
            assert_eq!(read(name), Some((Time, None)), "{name}");
        }
        for (name, unit) in [
            ("time_ms", Unit::Ms),
            ("t_s", Unit::S),
            ("time [us]", Unit::Us),
            ("stamp(ns)", Unit::Ns),
            ("ms", Unit::Ms),
            ("Zeit in s", Unit::S),
        ] {
            assert_eq!(read(name), Some((Time, Some(unit))), "{name}");
        }
        assert_eq!(read("v [cm/s]"), Some((Speed, Some(Unit::CmPerS))));
        assert_eq!(read("speed_kmh"), Some((Speed, Some(Unit::KmPerH))));
        for name in ["enc_l", "left_encoder", "ticksLeft", "lw", "encL", "leftWheel", "links", "wl", "l"] {
            assert_eq!(read(name), Some((Left, None)), "{name}");
        }
        assert!(read_name("left_encoder_rate").is_some_and(|reading| reading.is_rate && !reading.is_counted));
        for name in ["gyro_z", "gyro", "imu.angular_velocity.z", "gz", "imu_yaw_rate"] {
            assert_eq!(read(name), Some((Gyro, None)), "{name}");
        }
        assert_eq!(read("ticks_right"), Some((Right, None)));
        assert_eq!(read("right_ticks"), Some((Right, Some(Unit::Ticks))));
        assert_eq!(read("vel_r_rad_s"), Some((Right, Some(Unit::RadPerS))));
        assert_eq!(read("left wheel speed (deg/s)"), Some((Left, Some(Unit::DegPerS))));
        assert_eq!(read("right_m_per_s"), Some((Right, Some(Unit::MPerS))));
        assert_eq!(read("left_rpm"), Some((Left, Some(Unit::Rpm))));
        assert_eq!(read("rpm_right"), Some((Right, Some(Unit::Rpm))));
        for (name, quantity) in
            [("x", X), ("pos_y", Y), ("gt.x", X), ("pose.position.y", Y), ("posX", X), ("yaw", Heading)]
        {
            assert_eq!(read(name), Some((quantity, None)), "{name}");
        }
        assert_eq!(read("x_mm"), Some((X, Some(Unit::Mm))));
        assert_eq!(read("Y (mm)"), Some((Y, Some(Unit::Mm))));
        assert_eq!(read("heading [deg]"), Some((Heading, Some(Unit::Deg))));
        assert_eq!(read("pose.orientation.w"), Some((Qw, None)));
        assert_eq!(read("qz"), Some((Qz, None)));
        assert_eq!(read("twist.linear.x"), Some((Speed, None)));
        assert_eq!(read("twist.angular.z"), Some((YawRate, None)));
        assert_eq!(read("yaw_rate"), Some((YawRate, None)));
        assert_eq!(read("v"), Some((Speed, None)));
        assert_eq!(read("run_id"), Some((Run, None)));
    }

    #[test]
    fn what_is_something_else_is_not_taken() {
        for name in [
            "cmd_v",
            "imu.angular_velocity.x",
            "imu.orientation.z",
            "battery",
            "accel_x",
            "linear.y",
            "sigma_x",
            "",
            "comment",
        ] {
            assert_eq!(read_name(name), None, "{name}");
        }
        assert!(read_name("odom_x").is_some_and(|reading| reading.is_own));
        assert!(!read_name("x").is_some_and(|reading| reading.is_own));
    }

    #[test]
    fn the_likely_mapping_prefers_counts_and_the_outside_instrument() {
        let names = ["stamp", "vel_l", "enc_l", "enc_r", "odom_x", "gt_x", "gt_y", "x"].map(str::to_owned);
        let mapping = likely_mapping(&names);
        let named = |quantity| mapping.iter().find(|(found, _)| *found == quantity).map(|(_, name)| name.as_str());
        assert_eq!((named(Time), named(Left), named(Right)), (Some("stamp"), Some("enc_l"), Some("enc_r")));
        assert_eq!((named(X), named(Y), named(Heading)), (Some("gt_x"), Some("gt_y"), None));
    }
}
