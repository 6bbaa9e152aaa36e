//! Runs as chains: how the wheels turned, cut at the instants at which the instrument looked, and what it saw.
//!
//! Poses and positions make one chain a run and start free at its first look; where the log does not reach from one look to the next, a new chain begins. A
//! displacement is a chain of its own: it starts where the instrument stood, which is known exactly in its own frame. Displacements that follow each other
//! lead through the run: what goes with the heading in the room, or remembers, goes on from one to the next.

use dataset::{RunInfo, Session};
use kinematics::{Increment, Pose, Wheels, wrap_to_pi};

use crate::model::Model;
use crate::wheel_angles::{Piece, SAME_INSTANT_S, WheelTrack};

/// A motion whose chord is less than this share of its way hardly shows where it went.
const LEAST_CHORD: f64 = 0.3;

/// Errors of displacements that are worth finding last for about three of them: e^(−1/3) is 0.7.
const FADES: f64 = 0.7;

/// What the instrument saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    pub(crate) t_s: f64,
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) theta_rad: Option<f64>,
    /// How many pieces of the chain end before it.
    pub(crate) after: usize,
}

/// Where a chain starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Start {
    /// At its first look, with that look's errors.
    Seen,
    /// With the instrument at the origin of its own frame.
    Origin,
}

/// Counts and looks without a gap.
#[derive(Debug, Clone)]
pub struct Chain<'a> {
    /// Which run: session and run in the order given.
    pub run: (usize, usize),
    /// The run.
    pub info: &'a RunInfo,
    pub(crate) start: Start,
    /// It starts where the chain before it ended: a displacement after a displacement.
    pub(crate) goes_on: bool,
    pub(crate) pieces: Vec<Piece>,
    pub(crate) looks: Vec<Seen>,
    /// Angle of each wheel at the first piece, by its counter, radians.
    pub(crate) wheel_rad: Wheels<f64>,
    /// What the session's runs drove before, metres by nominal values.
    pub(crate) session_m: f64,
}

impl Chain<'_> {
    /// It is a displacement: the instrument says how it moved between two instants, not where it is.
    #[must_use]
    pub fn is_displacement(&self) -> bool {
        self.start == Start::Origin
    }

    /// Do what this chain and the next hold belong to one series, in which an instrument's errors may last? Displacements of one run do; poses of two chains have
    /// a gap between them that no counts lead over.
    pub(crate) fn is_in_series_with(&self, next: &Self) -> bool {
        self.is_displacement() && next.is_displacement() && self.run == next.run
    }

    /// For each look, when the look before was and how far each wheel turned since, radians; for a first look that nothing leads to, nothing.
    #[must_use]
    pub fn since_look_before(&self) -> Vec<(f64, Wheels<f64>)> {
        let start_s = match self.start {
            Start::Seen => self.looks.first().map(|look| look.t_s),
            Start::Origin => self.pieces.first().map(|piece| piece.t_s),
        };
        let (mut before_s, mut after) = (start_s.unwrap_or(0.0), 0);
        let of = |look: &Seen| {
            let turned = self.pieces[after..look.after].iter();
            let turned = turned.fold(Wheels::both(0.0), |sum, piece| sum.zip_with(piece.wheel_rad, |a, b| a + b));
            let since = (before_s, turned);
            (before_s, after) = (look.t_s, look.after);
            since
        };
        self.looks.iter().map(of).collect()
    }

    /// For each look, whether a wheel changed its speed since the look before, or in the half second before this one where that is longer, by more than a fifth of the
    /// fastest that either went in the chain.
    #[must_use]
    pub fn changes_of_speed(&self) -> Vec<bool> {
        const BEFORE_S: f64 = 0.5;
        const SHARE: f64 = 0.2;
        let speed = |piece: &Piece| piece.wheel_rad.map(|rad| if piece.dt_s > 0.0 { rad / piece.dt_s } else { 0.0 });
        let fastest = self.pieces.iter().map(speed).map(|of| of.left.abs().max(of.right.abs())).fold(0.0, f64::max);
        let changes = |(look, (before_s, _)): (&Seen, (f64, Wheels<f64>))| {
            let from_s = (look.t_s - BEFORE_S).min(before_s);
            let near = self.pieces[..look.after].iter().rev().take_while(|piece| piece.t_s + piece.dt_s > from_s);
            let (mut low, mut high) = (Wheels::both(f64::INFINITY), Wheels::both(f64::NEG_INFINITY));
            for of in near.map(speed) {
                low = low.zip_with(of, f64::min);
                high = high.zip_with(of, f64::max);
            }
            let change = high.zip_with(low, |high, low| high - low);
            change.left.max(change.right) > SHARE * fastest
        };
        self.looks.iter().zip(self.since_look_before()).map(changes).collect()
    }

    /// The pose of the first look, with its time and the pieces before it, and the time and the pose of the last; `None` where a look has no heading.
    #[allow(clippy::type_complexity)]
    pub(crate) fn ends(&self) -> Option<(Pose, (f64, usize), (f64, Pose))> {
        let pose = |look: &Seen| Some(Pose::new(look.x_m, look.y_m, look.theta_rad?));
        let last = self.looks.last()?;
        let (start, first) = match self.start {
            Start::Seen => {
                let first = self.looks.first()?;
                (pose(first)?, (first.t_s, first.after))
            }
            Start::Origin => (Pose::IDENTITY, (self.pieces.first()?.t_s, 0)),
        };
        Some((start, first, (last.t_s, pose(last)?)))
    }

    fn end_error(&self, model: &Model) -> Option<(f64, f64)> {
        let body_from_sensor = model.instrument(self.run).body_from_sensor;
        let pose = |look: &Seen| Some(Pose::new(look.x_m, look.y_m, look.theta_rad?) * body_from_sensor.inverse());
        let start = match self.start {
            Start::Seen => pose(self.looks.first()?)?,
            Start::Origin => body_from_sensor.inverse(),
        };
        let end = pose(self.looks.last()?)?;
        let reckoned = self.pieces.iter().fold(start, |pose, piece| pose * model.increment(piece.wheel_rad).arc());
        let off_rad = wrap_to_pi(reckoned.theta_rad - end.theta_rad).abs();
        Some((reckoned.position().distance_m(end.position()), off_rad))
    }
}

/// All that sessions hold for the likelihood.
#[derive(Debug, Clone)]
pub struct Records<'a> {
    /// The chains in the order of sessions, runs and time.
    pub chains: Vec<Chain<'a>>,
    /// Runs without wheels or with fewer than two looks.
    pub unused: Vec<(usize, usize)>,
    /// Ids of all runs by session.
    pub ids: Vec<Vec<String>>,
}

impl<'a> Records<'a> {
    /// The chains of sessions.
    #[must_use]
    pub fn of(sessions: &[Session<'a>]) -> Self {
        let mut records = Self { chains: Vec::new(), unused: Vec::new(), ids: Vec::new() };
        for (number, session) in sessions.iter().enumerate() {
            let mut session_m = 0.0;
            records.ids.push(session.runs.iter().map(|run| run.info().id.clone()).collect());
            for (position, run) in session.runs.iter().enumerate() {
                let before = records.chains.len();
                if let Some(track) = WheelTrack::of(run, session.robot) {
                    let base = Chain {
                        run: (number, position),
                        info: run.info(),
                        start: Start::Seen,
                        goes_on: false,
                        pieces: Vec::new(),
                        looks: Vec::new(),
                        wheel_rad: track.first_rad(),
                        session_m,
                    };
                    add_poses(&mut records.chains, &base, &track, looks_of(run));
                    add_displacements(&mut records.chains, &base, &track, run.run());
                    let way_m = |(diameter_m, side): (f64, &Vec<f64>)| {
                        side.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>() * 0.5 * diameter_m
                    };
                    let turns = track.turns();
                    session_m += 0.5
                        * (way_m((session.robot.left_wheel_diameter_m, &turns.left))
                            + way_m((session.robot.right_wheel_diameter_m, &turns.right)));
                }
                if records.chains.len() == before {
                    records.unused.push((number, position));
                }
            }
        }
        records
    }

    /// The records of a part of one run, as those of that run among others.
    pub(crate) fn belonging_to(mut self, run: (usize, usize)) -> Self {
        self.chains.iter_mut().for_each(|chain| chain.run = run);
        self
    }

    /// How many looks there are, starts left out.
    #[must_use]
    pub fn looks(&self) -> usize {
        self.chains.iter().map(|chain| chain.looks.len()).sum()
    }

    /// How far a wheel goes from look to look by a model, on average, metres.
    #[must_use]
    pub fn way_between_looks_m(&self, model: &Model) -> f64 {
        let of = |piece: &Piece| {
            let way_m = model.m_per_rad.zip_with(piece.wheel_rad, |m_per_rad, rad| (m_per_rad * rad).abs());
            0.5 * (way_m.left + way_m.right)
        };
        let way_m: f64 = self.chains.iter().flat_map(|chain| &chain.pieces).map(of).sum();
        #[allow(clippy::cast_precision_loss)]
        let looks = self.looks().max(1) as f64;
        way_m / looks
    }

    /// When a look of a chain was, seconds from the run's start.
    #[must_use]
    pub fn look_s(&self, chain: usize, look: usize) -> Option<f64> {
        Some(self.chains.get(chain)?.looks.get(look)?.t_s)
    }

    /// Final errors of dead reckoning in a run, from the first look of each chain to its last: of the position, metres, and of the heading, radians.
    pub(crate) fn end_errors(&self, run: (usize, usize), model: &Model) -> impl Iterator<Item = (f64, f64)> {
        self.chains.iter().filter(move |chain| chain.run == run).filter_map(|chain| chain.end_error(model))
    }

    /// The heading of the instrument on the robot, roughly, from the directions in which it and the wheels say that the robot went between looks, each weighed
    /// by its length; a spin has none, and an arc errs as much one way as its mirror image the other.
    pub(crate) fn sensor_heading_rad(&self, model: &Model) -> f64 {
        let (mut dot, mut cross) = (0.0, 0.0);
        for chain in &self.chains {
            let mut before = match chain.start {
                Start::Seen => None,
                Start::Origin => Some((Pose::IDENTITY, 0)),
            };
            for look in &chain.looks {
                let Some(theta_rad) = look.theta_rad else { return 0.0 };
                let pose = Pose::new(look.x_m, look.y_m, theta_rad);
                if let Some((seen, after)) = before {
                    let (mut moved, mut way_m) = (Pose::IDENTITY, 0.0);
                    for piece in &chain.pieces[after..look.after] {
                        let travel_m = model.m_per_rad.zip_with(piece.wheel_rad, |m_per_rad, rad| m_per_rad * rad);
                        let increment = Increment::from_travel(travel_m, model.separation_m);
                        way_m += increment.distance_m.abs();
                        moved = moved * increment.arc();
                    }
                    // Where a loop ends, it ends by its errors: they have no direction.
                    if moved.x_m.hypot(moved.y_m) > LEAST_CHORD * way_m {
                        let seen = seen.to(pose);
                        dot += moved.x_m * seen.x_m + moved.y_m * seen.y_m;
                        cross += seen.x_m * moved.y_m - seen.y_m * moved.x_m;
                    }
                }
                before = Some((pose, look.after));
            }
        }
        if dot == 0.0 && cross == 0.0 { 0.0 } else { cross.atan2(dot) }
    }

    /// How far from where a chain begins the robot was seen at the most, metres; root mean square over the chains.
    #[must_use]
    pub fn extent_m(&self) -> f64 {
        let squares: f64 = self
            .chains
            .iter()
            .map(|chain| {
                let (x_m, y_m) = match (chain.start, chain.looks.first()) {
                    (Start::Seen, Some(first)) => (first.x_m, first.y_m),
                    _ => (0.0, 0.0),
                };
                let far = chain.looks.iter().map(|look| (look.x_m - x_m).powi(2) + (look.y_m - y_m).powi(2));
                far.fold(0.0, f64::max)
            })
            .sum();
        #[allow(clippy::cast_precision_loss)]
        let chains = self.chains.len().max(1) as f64;
        (squares / chains).sqrt()
    }

    /// Are the looks of two chains of one series, so that one may resemble the other: looks of one chain, or displacements of one run?
    #[must_use]
    pub fn are_in_series(&self, chain: usize, next: usize) -> bool {
        let both = self.chains.get(chain).zip(self.chains.get(next));
        chain == next || both.is_some_and(|(chain, next)| chain.is_in_series_with(next))
    }

    /// What the product of two innovations counts for whether errors last, one being so many looks after the other. What lasts after a look is in the filter's state:
    /// the next look shows it. Nothing follows displacements, and all that come later resemble the one before, the less the later.
    #[must_use]
    pub fn weight_of_pair(&self, chain: usize, next: usize, lag: i32) -> f64 {
        if chain == next {
            f64::from(u8::from(lag == 1))
        } else if self.are_in_series(chain, next) {
            FADES.powi(lag - 1)
        } else {
            0.0
        }
    }

    /// Does a chain start where the one before it ended: a displacement after a displacement?
    #[must_use]
    pub fn goes_on(&self, chain: usize) -> bool {
        self.chains.get(chain).is_some_and(|chain| chain.goes_on)
    }

    /// Times between looks that follow each other, of displacements between their ends, seconds.
    pub fn times_between(&self) -> impl Iterator<Item = f64> + '_ {
        let series = self.chains.chunk_by(Chain::is_in_series_with);
        series.flat_map(|series| {
            let ends_s: Vec<f64> = series.iter().flat_map(|chain| &chain.looks).map(|look| look.t_s).collect();
            // Displacements may end together, or in any order; what is no time is not between.
            let between_s = ends_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|between_s| *between_s > 0.0);
            between_s.collect::<Vec<f64>>()
        })
    }
}

/// The looks of a run: its truth, positions alone included, or else its marked points.
fn looks_of(run: &dataset::RunView<'_>) -> Vec<(f64, f64, f64, Option<f64>)> {
    let truth = &run.run().truth;
    if truth.is_empty() {
        let poses = run.observed_poses().into_iter();
        poses.map(|(t_s, pose)| (t_s, pose.x_m, pose.y_m, Some(pose.theta_rad))).collect()
    } else {
        truth.iter().map(|sample| (sample.t_s, sample.x_m, sample.y_m, sample.theta_rad())).collect()
    }
}

fn add_poses<'a>(
    chains: &mut Vec<Chain<'a>>,
    base: &Chain<'a>,
    track: &WheelTrack<'_>,
    looks: Vec<(f64, f64, f64, Option<f64>)>,
) {
    let mut cursor = track.cursor();
    let mut chain: Option<Chain<'a>> = None;
    let mut close = |chain: Option<Chain<'a>>| {
        chains.extend(chain.filter(|chain| chain.looks.len() > 1).map(|mut chain| {
            chain.pieces.shrink_to_fit();
            chain.looks.shrink_to_fit();
            chain
        }));
    };
    for (t_s, x_m, y_m, theta_rad) in looks {
        let Some(before_s) = chain.as_ref().and_then(|chain| chain.looks.last()).map(|look| look.t_s) else {
            chain = begin(base, &mut cursor, (t_s, x_m, y_m, theta_rad));
            continue;
        };
        let joined = chain.as_mut().is_some_and(|chain| {
            let reaches = cursor.pieces(before_s, t_s, &mut chain.pieces);
            if reaches {
                chain.looks.push(Seen { t_s, x_m, y_m, theta_rad, after: chain.pieces.len() });
            }
            reaches
        });
        if !joined {
            close(chain.take());
            chain = begin(base, &mut cursor, (t_s, x_m, y_m, theta_rad));
        }
    }
    close(chain);
}

fn begin<'a>(
    base: &Chain<'a>,
    cursor: &mut crate::wheel_angles::Cursor<'_, '_>,
    (t_s, x_m, y_m, theta_rad): (f64, f64, f64, Option<f64>),
) -> Option<Chain<'a>> {
    let wheel_rad = cursor.angle_rad(t_s)?.zip_with(base.wheel_rad, |turned, first| first + turned);
    Some(Chain { wheel_rad, looks: vec![Seen { t_s, x_m, y_m, theta_rad, after: 0 }], ..base.clone() })
}

fn add_displacements<'a>(chains: &mut Vec<Chain<'a>>, base: &Chain<'a>, track: &WheelTrack<'_>, run: &dataset::Run) {
    let mut cursor = track.cursor();
    let mut last_s = f64::NEG_INFINITY;
    for seen in &run.displacements {
        let Some(turned_rad) = cursor.angle_rad(seen.t0_s) else { continue };
        let wheel_rad = turned_rad.zip_with(base.wheel_rad, |turned, first| first + turned);
        let mut pieces = Vec::new();
        if cursor.pieces(seen.t0_s, seen.t1_s, &mut pieces) {
            let pose = Pose::new(seen.dx_m, seen.dy_m, seen.dtheta_rad);
            let look = Seen {
                t_s: seen.t1_s,
                x_m: pose.x_m,
                y_m: pose.y_m,
                theta_rad: Some(pose.theta_rad),
                after: pieces.len(),
            };
            let goes_on = (seen.t0_s - last_s).abs() <= SAME_INSTANT_S;
            last_s = seen.t1_s;
            chains.push(Chain { start: Start::Origin, goes_on, pieces, looks: vec![look], wheel_rad, ..base.clone() });
        }
    }
}
