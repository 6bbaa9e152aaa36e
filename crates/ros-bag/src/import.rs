//! The dataset of a bag, and what was taken for what.

use std::path::PathBuf;

use dataset::import::csv::{Rates, RobotGiven};
use dataset::{Dataset, Run, wrap_warnings};
use kinematics::Wheels;

use crate::assembly::Assembly;
use crate::bag::Bag;
use crate::choice::{self, Reference};
use crate::clock::{self, Clock, Times};
use crate::error::RosBagError;
use crate::gyro_column::GyroColumn;
use crate::rows::{self, BothRows, GyroRows, Others, Rows, WheelSource};
use crate::scan_walls::{self, ScanSource};
use crate::took::Took;
use crate::topics::{Survey, Topic};
use crate::truth::{self, TruthReader};
use crate::wheel_pair::{Resampling, WheelPair};
use crate::wheels::{WheelFields, WheelQuantity, WheelReader};

/// All that a user may say.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// Topic of the wheels, or `LEFT_TOPIC[.field],RIGHT_TOPIC[.field]`.
    pub wheels: Option<String>,
    /// Topic of the poses of an outside instrument; `none` where wheels and a gyroscope are all there is.
    pub truth: Option<String>,
    /// Topic of the scans of a lidar in which walls are sought; where none is said, the only one of a bag
    /// that has no poses.
    pub scan: Option<String>,
    /// Topic of a gyroscope's rates; where nothing is said, the only one of the bag; `none` leaves it out.
    pub gyro: Option<String>,
    /// Which joints or fields are the wheels.
    pub fields: WheelFields,
    /// Parent and child frame of the poses, in a topic of transforms.
    pub truth_frames: Option<(String, String)>,
    /// Files that define types which the bag itself does not: `…/PACKAGE/msg/TYPE.msg`, or
    /// `PACKAGE/TYPE=FILE`. Usual types are known.
    pub definitions: Vec<PathBuf>,
    /// What a speed holds for.
    pub rates: Option<Rates>,
    /// Runs are cut at standstills and gaps that are longer, seconds.
    pub cut_s: Option<f64>,
    /// The robot.
    pub robot: RobotGiven,
    /// Joints of the wheels by the robot's own files, for topics that hold them.
    pub known_wheels: Option<Wheels<String>>,
}

/// A dataset from a bag.
#[derive(Debug, Clone, PartialEq)]
pub struct FromBag {
    /// The dataset.
    pub dataset: Dataset,
    /// What was taken for what.
    pub took: Took,
    /// What is no error but should be known, one line each.
    pub warnings: Vec<String>,
}

/// The dataset of a bag whose topics are known.
///
/// # Errors
/// [`RosBagError`] of the first fault; what could not be read of a damaged bag is a warning.
pub(crate) fn import_of(bag: &Bag, survey: &Survey, options: &Options) -> Result<FromBag, RosBagError> {
    let path = &bag.path;
    let wheels = match &options.wheels {
        Some(topics) => match WheelPair::parse(survey, topics, options.fields.quantity)? {
            Some(pair) => WheelTopics::Two(pair),
            None => WheelTopics::One(survey.named("--wheels", topics)?),
        },
        None => WheelTopics::One(choice::wheels(survey, path)?),
    };
    let named = [&options.truth, &options.scan].map(Option::as_deref);
    let Reference { truth, scan } = choice::reference(survey, path, named)?;
    let (gyro, gyro_open) = match &options.gyro {
        Some(topic) if topic == choice::NONE => (None, None),
        Some(topic) => (Some(choice::named_gyro(survey, topic)?), None),
        None => choice::gyro(survey),
    };
    if truth.is_none() && scan.is_none() && gyro.is_none() {
        return Err(choice::nothing_beside_the_wheels(path, gyro_open));
    }
    if let Some(truth) = truth.filter(|truth| wheels.has(&truth.name)) {
        let why = "its poses are computed from its wheels; --truth takes poses of an outside instrument".to_owned();
        return Err(truth.unusable(why));
    }
    let WheelReading { source, what: wheels_what, counter_bits } = wheels.reading(options)?;
    let reader = |truth: &Topic| TruthReader::new(truth, options.truth_frames.as_ref(), &survey.mounted);
    let truth_reader = truth.map(reader).transpose()?;
    let of_truth = truth.map(|topic| &topic.name[..]).zip(truth_reader.as_ref());
    let others = Others { truth: of_truth, gyro: gyro.map(|topic| &topic.name[..]) };
    let both = rows::read(bag, &source, others)?;

    let given = RobotGiven { counter_bits: options.robot.counter_bits.or(counter_bits), ..options.robot };
    let is_counted = both.quantity == WheelQuantity::Ticks;
    let what = || match &source {
        WheelSource::One(topic, _) => format!("wheels are {wheels_what} of {topic}"),
        WheelSource::Two(..) => format!("wheels are {wheels_what}"),
    };
    let (robot, geometry) = given.nominal(is_counted, path, what)?;
    let mut warnings = both.losses.clone();
    warnings.extend(both.wheels.warnings());
    warnings.extend(both.truth.iter().flat_map(Rows::warnings));
    let own_estimate = truth.filter(|truth| choice::is_own_estimate(truth, options.truth_frames.as_ref()));
    if let Some(truth) = own_estimate {
        warnings.push(format!(
            "topic {}: poses of this name and type are mostly computed from the wheels themselves; calibration needs an independent instrument",
            truth.name
        ));
    }
    let clocks = clocks(&both, &mut warnings)?;
    warnings.extend(gyro_open);
    let must_have_gyro = options.gyro.is_some() || (truth.is_none() && scan.is_none());
    let gyro = gyro_column(&both, clocks[0], options, must_have_gyro, &mut warnings)?;
    let has_gyro = gyro.is_some();
    let (rates, cut_s) = (options.rates.unwrap_or(Rates::IntervalEnd), options.cut_s);
    let has_scans = options.scan.is_some();
    let assembly = Assembly { bag, both: &both, clocks, robot, geometry, rates, cut_s, has_scans };
    let (mut dataset, spans) = assembly.dataset(gyro, &mut warnings)?;
    if truth.is_none() && scan.is_none() {
        dataset.runs.retain(Run::has_gyro);
        refuse_no_run(&dataset, &both, options)?;
    }
    if let Some(truth) = own_estimate {
        warnings.extend(truth::scale_covariances(&mut dataset, &truth.name));
    }
    let mut scans = None;
    if let Some(scan) = scan {
        let source = ScanSource { bag, topic: scan, clock: clocks[0] };
        let taken = scan_walls::add_walls(&mut dataset, &spans, source, &survey.mounted, &mut warnings)?;
        scans = Some((&scan.name[..], taken));
        dataset.runs.retain(|run| !run.truth.is_empty() || !run.walls.is_empty());
        let notes = dataset.provenance.notes.take().unwrap_or_default();
        dataset.provenance.notes = Some(format!("{notes}, walls of {} ({})", scan.name, scan.type_name));
    }
    let truth_what = truth_reader.as_ref().map(TruthReader::describe);
    let took = Took::of(&both, wheels_what, truth_what, clocks, has_gyro, scans);
    warnings.extend(wrap_warnings(&dataset).iter().map(ToString::to_string));
    Ok(FromBag { dataset, took, warnings })
}

/// The topics of the wheels.
enum WheelTopics<'a> {
    One(&'a Topic),
    Two(WheelPair),
}

/// How the wheels are read, of what, and the width of their counters where the topic's type says it.
struct WheelReading {
    source: WheelSource,
    what: String,
    counter_bits: Option<u8>,
}

impl WheelTopics<'_> {
    fn reading(self, options: &Options) -> Result<WheelReading, RosBagError> {
        Ok(match self {
            Self::One(topic) => {
                let (reader, counter_bits) = WheelReader::new(topic, &options.fields)?;
                let what = reader.describe();
                WheelReading { source: WheelSource::One(topic.name.clone(), reader), what, counter_bits }
            }
            Self::Two(pair) => {
                let rates = options.rates.unwrap_or(Rates::IntervalEnd);
                let counter_bits = options.robot.counter_bits;
                let resampling = Resampling { quantity: pair.quantity, rates, counter_bits };
                let what = pair.describe();
                WheelReading { source: WheelSource::Two(pair, resampling), what, counter_bits: None }
            }
        })
    }

    fn has(&self, topic: &str) -> bool {
        match self {
            Self::One(wheels) => wheels.name == topic,
            Self::Two(pair) => [&pair.left, &pair.right].iter().any(|side| side.topic == topic),
        }
    }
}

/// Of a dataset that has a gyroscope alone beside the wheels.
fn refuse_no_run(dataset: &Dataset, both: &BothRows, options: &Options) -> Result<(), RosBagError> {
    match (&both.gyro, options.cut_s) {
        _ if !dataset.runs.is_empty() => Ok(()),
        (_, Some(cut_s)) => Err(RosBagError::NothingLeft { cut_s }),
        (Some(GyroRows { rows, .. }), None) => {
            let why = "its rates span no interval between two rows of the wheels; record both at once".to_owned();
            Err(rows.unusable(why))
        }
        (None, None) => Ok(()),
    }
}

/// The rates of the gyroscope. One that is not needed and that cannot be used is left out with a warning.
fn gyro_column(
    both: &BothRows,
    clock: Clock,
    options: &Options,
    is_needed: bool,
    warnings: &mut Vec<String>,
) -> Result<Option<GyroColumn>, RosBagError> {
    let Some(rows) = &both.gyro else { return Ok(None) };
    let span_ns = ends(&both.wheels.times, clock);
    match GyroColumn::new(rows, clock, span_ns, options.cut_s.is_some(), warnings) {
        Ok(column) => Ok(Some(column)),
        Err(why) if !is_needed => {
            warnings.push(format!("{why}; the gyroscope was left out"));
            Ok(None)
        }
        Err(why) => Err(why),
    }
}

/// The first and the last time of a topic.
fn ends(times: &[Times], clock: Clock) -> (i64, i64) {
    let times = times.iter().filter_map(|times| times.by(clock));
    times.clone().min().zip(times.max()).unwrap_or_default()
}

/// The clocks of wheels and poses; both by receipt where stamps and receipts do not meet.
fn clocks(both: &BothRows, warnings: &mut Vec<String>) -> Result<[Clock; 2], RosBagError> {
    // Scans go by the wheels' clock.
    let truth = both.truth.as_ref().map(|truth| (&truth.times[..], &truth.topic));
    let (truth_times, truth_topic) = truth.unwrap_or((&both.wheels.times, &both.wheels.topic));
    let all = [&both.wheels.times[..], truth_times];
    let topics = [&both.wheels.topic, truth_topic];
    let clocks = all.map(clock::clock);
    for (clock, topic) in clocks.iter().zip(topics).take(if truth.is_some() { 2 } else { 1 }) {
        if *clock == Clock::Receipt {
            warnings.push(format!(
                "topic {topic}: no header stamps; the times of receipt are used, which are late and irregular"
            ));
        }
    }
    let ends = |index: usize, clock: Clock| ends(all[index], clock);
    let meet = |clocks: [Clock; 2]| {
        let ((first, last), (from, to)) = (ends(0, clocks[0]), ends(1, clocks[1]));
        first <= to && from <= last
    };
    if meet(clocks) {
        return Ok(clocks);
    }
    let receipts = [Clock::Receipt; 2];
    if clocks[0] != clocks[1] && meet(receipts) {
        warnings.push(
            "stamps and times of receipt are of two clocks; the times of receipt are used for both topics".to_owned(),
        );
        return Ok(receipts);
    }
    let span = |index: usize| {
        let (first, last) = ends(index, clocks[index]);
        format!("{:.3} to {:.3} s", first as f64 / 1e9, last as f64 / 1e9)
    };
    Err(RosBagError::TwoClocks {
        wheels: topics[0].clone(),
        wheels_span: span(0),
        truth: topics[1].clone(),
        truth_span: span(1),
    })
}
