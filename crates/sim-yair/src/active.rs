//! The effects at work in a simulated robot, each called at the stages at which it acts and at no other.

use effects::{Command, Forward, LaneForm, PoseReading, Readout, RunStart, SampleClock, Step, StreamName};

/// Effects in the order in which they act.
pub(crate) struct ActiveEffects {
    effects: Vec<(StreamName, Box<dyn Forward>)>,
    at: HookIndex,
}

/// Who acts at which hook: positions, in order.
#[derive(Debug, Default)]
struct HookIndex {
    on_run_start: Vec<usize>,
    seed_run: Vec<usize>,
    start_motion: Vec<usize>,
    command: Vec<usize>,
    motor: Vec<usize>,
    wheel: Vec<usize>,
    floor: Vec<usize>,
    encoder: Vec<usize>,
    readout: Vec<usize>,
    clock: Vec<usize>,
    instrument: Vec<usize>,
}

/// For each hook the method that calls it of every effect that acts there.
macro_rules! calls {
    ($($(#[$doc:meta])* $hook:ident($($argument:ident: $Type:ty)?);)*) => {
        $(
            $(#[$doc])*
            #[inline]
            pub(crate) fn $hook(&mut self $(, $argument: &mut $Type)?) {
                for &position in &self.at.$hook {
                    self.effects[position].1.$hook($($argument)?);
                }
            }
        )*
    };
}

impl ActiveEffects {
    /// Effects by the names of their streams.
    pub(crate) fn new(effects: Vec<(StreamName, Box<dyn Forward>)>) -> Self {
        let mut at = HookIndex::default();
        for (position, (_, effect)) in effects.iter().enumerate() {
            let hooks = effect.hooks();
            for (acts, roster) in [
                (hooks.on_run_start, &mut at.on_run_start),
                (hooks.seed_run, &mut at.seed_run),
                (hooks.start_motion, &mut at.start_motion),
                (hooks.command, &mut at.command),
                (hooks.motor, &mut at.motor),
                (hooks.wheel, &mut at.wheel),
                (hooks.floor, &mut at.floor),
                (hooks.encoder, &mut at.encoder),
                (hooks.readout, &mut at.readout),
                (hooks.clock, &mut at.clock),
                (hooks.instrument, &mut at.instrument),
            ] {
                if acts {
                    roster.push(position);
                }
            }
        }
        Self { effects, at }
    }

    /// A run begins: each effect that draws gets its stream from `stream`.
    #[inline]
    pub(crate) fn seed_run(&mut self, stream: impl Fn(StreamName) -> effects::Stream) {
        for &position in &self.at.seed_run {
            let (name, effect) = &mut self.effects[position];
            effect.seed_run(stream(*name));
        }
    }

    calls! {
        /// A run begins, at its place in the session.
        on_run_start(run: RunStart<'_>);
        /// A motion begins.
        start_motion();
        /// What the wheels are told.
        command(command: Command);
        /// How the shafts turn.
        motor(step: Step);
        /// Between the encoder's axis and the tread.
        wheel(step: Step);
        /// Between the tread and the room.
        floor(step: Step);
        /// Between the encoder's axis and the counter.
        encoder(step: Step);
        /// Between the counter and the log.
        readout(readout: Readout);
        /// When counters are read and what time the row bears.
        clock(sample: SampleClock);
        /// What the outside sees.
        instrument(reading: PoseReading);
    }

    /// What the effects do where trials are driven side by side, each with its stream's name; `None` when one
    /// must be asked trial by trial.
    pub(crate) fn lane_forms(&self) -> Option<Vec<(StreamName, LaneForm)>> {
        self.effects.iter().map(|(name, effect)| Some((*name, effect.lane_form()?))).collect()
    }

    /// Is a motion told and counted the same way at every trial, whatever is drawn?
    pub(crate) fn leave_commands_and_counters_alone(&self) -> bool {
        self.at.command.is_empty() && self.at.encoder.is_empty()
    }

    /// Does every row bear the time at which it is due?
    pub(crate) fn leave_clocks_alone(&self) -> bool {
        self.at.clock.is_empty()
    }

    /// Does an effect change what the outside sees?
    #[inline]
    pub(crate) fn act_on_instruments(&self) -> bool {
        !self.at.instrument.is_empty()
    }

    /// Does an effect depend on how fast the wheels turn?
    pub(crate) fn depend_on_speed(&self) -> bool {
        self.effects.iter().any(|(_, effect)| effect.depends_on_speed())
    }
}
