//! Rows of the two topics: one pass over the bag.

use crate::bag::Bag;
use crate::cdr;
use crate::clock::{self, Clock, Ordered, Times};
use crate::definition::Definitions;
use crate::error::RosBagError;
use crate::frame_chain::Moved;
use crate::gyro::{self, GyroReading};
use crate::mcap_file::Channel;
use crate::topics::definitions;
use crate::truth::{TruthReader, TruthReading};
use crate::value::Value;
use crate::wheel_pair::{self, Resampling, WheelPair};
use crate::wheels::{WheelQuantity, WheelReader};

/// Received this much before or after a run's wheels, a message may still be of the run, seconds.
pub(crate) const RECEIPT_MARGIN_S: f64 = 1.0;

/// Rows of one topic.
#[derive(Debug)]
pub(crate) struct Rows<T> {
    pub(crate) topic: String,
    pub(crate) type_name: String,
    pub(crate) times: Vec<Times>,
    pub(crate) values: Vec<T>,
    /// Messages that are about something else.
    pub(crate) others: u64,
    /// Messages whose numbers are NaN or infinite.
    pub(crate) not_finite: u64,
    /// Messages that are not what the definition says, and why the first is not.
    pub(crate) faulty: u64,
    pub(crate) first_fault: Option<(u64, String)>,
    messages: u64,
    decoder: Option<Definitions>,
}

impl<T> Rows<T> {
    pub(crate) fn new(topic: &str, type_name: &str) -> Self {
        Self {
            topic: topic.to_owned(),
            type_name: type_name.to_owned(),
            times: Vec::new(),
            values: Vec::new(),
            others: 0,
            not_finite: 0,
            faulty: 0,
            first_fault: None,
            messages: 0,
            decoder: None,
        }
    }

    pub(crate) fn push(&mut self, times: Times, value: T, is_finite: bool) {
        if is_finite {
            self.times.push(times);
            self.values.push(value);
        } else {
            self.not_finite += 1;
        }
    }

    /// Decodes a message; none of one that is faulty.
    pub(crate) fn decode(&mut self, channel: &Channel, message: &[u8]) -> Result<Option<Value>, RosBagError> {
        self.messages += 1;
        if self.decoder.is_none() {
            self.decoder = Some(definitions(channel)?);
        }
        let decoded = self.decoder.as_ref().map(|definitions| cdr::decode(definitions, message));
        Ok(decoded.and_then(|decoded| decoded.map_err(|why| self.note_fault(why)).ok()))
    }

    pub(crate) fn note_fault(&mut self, why: String) {
        self.faulty += 1;
        let number = self.messages;
        self.first_fault.get_or_insert((number, why));
    }

    /// Rows that were taken.
    pub(crate) const fn len(&self) -> usize {
        self.values.len()
    }

    /// Refuses a topic of which nothing could be read.
    pub(crate) fn refuse_none(&self, what: &str) -> Result<(), RosBagError> {
        if self.values.len() >= 2 {
            return Ok(());
        }
        if let Some((number, why)) = self.first_fault.clone() {
            return Err(RosBagError::Message { topic: self.topic.clone(), number, why });
        }
        let why = format!("{} of {} messages have {what}; two are needed at least", self.values.len(), self.messages);
        Err(self.unusable(why))
    }

    /// That the topic does not hold what it was to be used for.
    pub(crate) fn unusable(&self, why: String) -> RosBagError {
        RosBagError::Unusable { topic: self.topic.clone(), type_name: self.type_name.clone(), why }
    }

    /// Rows in the order of time, with what was left out said.
    pub(crate) fn in_order(
        &self,
        clock: Clock,
        may_restart: bool,
        warnings: &mut Vec<String>,
    ) -> Result<Vec<(usize, i64)>, RosBagError> {
        let Ordered { rows, duplicates, unstamped } = clock::ordered(&self.topic, &self.times, clock, may_restart)?;
        for (count, why) in
            [(duplicates, "at the instant of another"), (unstamped, "without a header stamp, which others have,")]
        {
            if count > 0 {
                warnings.push(format!("topic {}: {count} messages {why} were left out", self.topic));
            }
        }
        Ok(rows)
    }

    /// What was left out, one line a reason.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let topic = &self.topic;
        let mut lines = Vec::new();
        if self.others > 0 {
            lines.push(format!("topic {topic}: {} of {} messages are of something else", self.others, self.messages));
        }
        if self.not_finite > 0 {
            lines.push(format!("topic {topic}: {} messages with NaN or infinity were left out", self.not_finite));
        }
        if let Some((number, why)) = &self.first_fault {
            lines.push(format!("topic {topic}: {} messages were left out; of message {number}: {why}", self.faulty));
        }
        lines
    }
}

/// Rows of the wheels, with what their numbers are.
pub(crate) type WheelRows = Rows<[f64; 2]>;

/// What was read of a bag.
pub(crate) struct BothRows {
    pub(crate) wheels: WheelRows,
    pub(crate) quantity: WheelQuantity,
    /// None where walls are what was measured.
    pub(crate) truth: Option<Rows<TruthReading>>,
    pub(crate) gyro: Option<GyroRows>,
    pub(crate) losses: Vec<String>,
}

/// Rows of the gyroscope.
pub(crate) struct GyroRows {
    pub(crate) rows: Rows<GyroReading>,
    /// The frame of its axes, as its first message says.
    pub(crate) frame: String,
}

/// The topics beside the wheels.
#[derive(Clone, Copy)]
pub(crate) struct Others<'a> {
    pub(crate) truth: Option<(&'a str, &'a TruthReader)>,
    pub(crate) gyro: Option<&'a str>,
}

/// Where the wheels are.
pub(crate) enum WheelSource {
    /// Both in the messages of one topic.
    One(String, WheelReader),
    /// Each on its own.
    Two(WheelPair, Resampling),
}

/// Reads wheels, poses and, where it is asked for, the gyroscope.
pub(crate) fn read(bag: &Bag, wheels: &WheelSource, others: Others<'_>) -> Result<BothRows, RosBagError> {
    match wheels {
        WheelSource::One(topic, reader) => read_one(bag, topic, reader, others),
        WheelSource::Two(pair, resampling) => read_two(bag, pair, *resampling, others),
    }
}

fn read_one(
    bag: &Bag,
    wheel_topic: &str,
    wheel_reader: &WheelReader,
    others: Others<'_>,
) -> Result<BothRows, RosBagError> {
    let mut wheels: WheelRows = Rows::new(wheel_topic, "");
    let mut quantity = None;
    let mut visited = visit(bag, others, |channel, received_ns, message| {
        if channel.topic == wheel_topic {
            wheels.type_name.clone_from(&channel.type_name);
            if let Some(value) = wheels.decode(channel, message)? {
                match wheel_reader.read(&value) {
                    Ok(Some(reading)) if *quantity.get_or_insert(reading.quantity) == reading.quantity => {
                        let is_finite = reading.left.is_finite() && reading.right.is_finite();
                        wheels.push(Times::of(&value, received_ns), [reading.left, reading.right], is_finite);
                    }
                    Ok(_) => wheels.others += 1,
                    Err(why) => wheels.note_fault(why),
                }
            }
        }
        Ok(())
    })?;
    wheels.refuse_none("both wheels")?;
    visited.chain_poses(others, &wheels.times)?;
    let Visited { truth, gyro, losses, .. } = visited;
    truth.as_ref().map_or(Ok(()), |truth| truth.refuse_none("a pose"))?;
    let quantity = quantity.unwrap_or(WheelQuantity::Angles);
    Ok(BothRows { wheels, quantity, truth, gyro, losses })
}

fn read_two(bag: &Bag, pair: &WheelPair, resampling: Resampling, others: Others<'_>) -> Result<BothRows, RosBagError> {
    let sides = [&pair.left, &pair.right];
    let mut rows: [Rows<f64>; 2] = sides.map(|side| Rows::new(&side.topic, &side.type_name));
    let mut visited = visit(bag, others, |channel, received_ns, message| {
        for (side, rows) in sides.iter().zip(&mut rows) {
            if channel.topic != side.topic {
                continue;
            }
            if let Some(value) = rows.decode(channel, message)? {
                match value.number(&side.path) {
                    Some(number) => rows.push(Times::of(&value, received_ns), number, number.is_finite()),
                    None => {
                        let numbers = value.paths_of_numbers().join(", ");
                        rows.note_fault(format!("no number at {:?}; there are {numbers}", side.path));
                    }
                }
            }
        }
        Ok(())
    })?;
    visited.chain_poses(others, &rows[0].times)?;
    let Visited { truth, gyro, mut losses, .. } = visited;
    for rows in &rows {
        rows.refuse_none("the wheel's number")?;
        losses.extend(rows.warnings());
    }
    truth.as_ref().map_or(Ok(()), |truth| truth.refuse_none("a pose"))?;
    let [left, right] = &rows;
    let paired = wheel_pair::pair(pair, (&left.times, &left.values), (&right.times, &right.values), resampling)?;
    if paired.left_out > 0 {
        losses.push(format!(
            "topic {}: {} of {} messages are without one of {} around them and were left out",
            left.topic,
            paired.left_out,
            left.values.len(),
            right.topic
        ));
    }
    let mut wheels: WheelRows = Rows::new(&pair.topics(), &left.type_name);
    (wheels.times, wheels.values) = (paired.times, paired.values);
    Ok(BothRows { wheels, quantity: pair.quantity, truth, gyro, losses })
}

/// What is beside the wheels, and what was lost.
struct Visited {
    truth: Option<Rows<TruthReading>>,
    /// The transforms of a chain whose poses are not computed yet.
    moved: Option<Moved>,
    gyro: Option<GyroRows>,
    losses: Vec<String>,
}

impl Visited {
    /// Makes the poses of a chain of transforms, beside the wheels' times.
    fn chain_poses(&mut self, others: Others<'_>, wheels: &[Times]) -> Result<(), RosBagError> {
        let chain = others.truth.and_then(|(_, reader)| reader.chain());
        let Some(((chain, moved), rows)) = chain.zip(self.moved.take()).zip(self.truth.as_mut()) else { return Ok(()) };
        let (placed, note) = chain.poses(&moved, wheels).map_err(|why| rows.unusable(why))?;
        for placed in &placed {
            rows.push(placed.times, TruthReading::of_chain(placed), true);
        }
        rows.not_finite += moved.unreadable;
        self.losses.extend(note.map(|note| format!("topic {}: {note}", rows.topic)));
        Ok(())
    }
}

/// One pass over the bag: poses and gyroscope, and every message to `wheels` too.
fn visit(
    bag: &Bag,
    Others { truth, gyro }: Others<'_>,
    mut wheels: impl FnMut(&Channel, u64, &[u8]) -> Result<(), RosBagError>,
) -> Result<Visited, RosBagError> {
    let mut gyro = gyro.map(|topic| GyroRows { rows: Rows::new(topic, ""), frame: String::new() });
    let mut truth = truth.map(|(topic, reader)| (Rows::new(topic, ""), reader));
    let mut moved = truth.as_ref().and_then(|(_, reader)| Some(reader.chain()?.moved()));
    let losses = bag.visit(|channel, received_ns, message| {
        wheels(channel, received_ns, message)?;
        if let Some(GyroRows { rows, frame }) = gyro.as_mut().filter(|gyro| gyro.rows.topic == channel.topic) {
            rows.type_name.clone_from(&channel.type_name);
            if let Some(value) = rows.decode(channel, message)? {
                if rows.messages == 1 {
                    value.text("header.frame_id").unwrap_or_default().clone_into(frame);
                }
                match gyro::read(&value) {
                    Ok(reading) => {
                        let is_finite = reading.yaw_rate_rad_s.is_finite();
                        rows.push(Times::of(&value, received_ns), reading, is_finite);
                    }
                    Err(why) => rows.note_fault(why),
                }
            }
        }
        if let Some((truth, truth_reader)) = truth.as_mut().filter(|(truth, _)| truth.topic == channel.topic) {
            truth.type_name.clone_from(&channel.type_name);
            if let Some(value) = truth.decode(channel, message)? {
                if let Some((chain, moved)) = truth_reader.chain().zip(moved.as_mut()) {
                    chain.take(&value, received_ns, moved);
                }
                match truth_reader.read(&value) {
                    Ok(readings) => {
                        for (stamped, reading) in readings {
                            let is_finite = reading.x_m.is_finite() && reading.y_m.is_finite();
                            truth.push(Times::of(stamped, received_ns), reading, is_finite);
                        }
                    }
                    Err(why) => truth.note_fault(why),
                }
            }
        }
        Ok(())
    })?;
    Ok(Visited { truth: truth.map(|(rows, _)| rows), moved, gyro, losses: losses.lines() })
}
