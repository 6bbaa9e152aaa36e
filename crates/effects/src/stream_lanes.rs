//! Streams of several trials side by side, the same name's in each: the draws of [`Stream`] to the bit, W at
//! a time.
//!
//! A draw is a function of its address here as there, so that it does not matter how many lanes there are
//! nor which trials they hold. Normals outside of their layer, 1.2 % of them, are drawn one by one.

use crate::Address;
use crate::stream::{HALF_WIDTHS, LAYERS, Stream, StreamName, mix, next_word, normal_inside, state};

/// The streams of W trials in one run.
#[derive(Debug, Clone)]
pub struct StreamsLanes<const W: usize> {
    seed: u64,
    trial: [u64; W],
    place: [u64; W],
}

impl<const W: usize> StreamsLanes<W> {
    /// Of an address's trial and the W − 1 that follow it.
    #[inline(always)]
    #[must_use]
    pub fn of(first: &Address) -> Self {
        let seed = mix(first.seed);
        let (mut trial, mut place) = ([0; W], [0; W]);
        for lane in 0..W {
            trial[lane] = mix(first.trial.wrapping_add(lane as u64) ^ seed);
            place[lane] = mix(first.place() ^ trial[lane]);
        }
        Self { seed, trial, place }
    }

    /// The stream of a name in every lane, at its beginning.
    #[inline(always)]
    #[must_use]
    pub fn stream(&self, name: StreamName) -> StreamLanes<W> {
        let mut words = [[0; W]; 4];
        for lane in 0..W {
            put(&mut words, lane, state(self.seed, self.trial[lane], self.place[lane], name));
        }
        StreamLanes { words }
    }
}

/// The table that normals are looked up in. Whoever draws has it as a variable: what nobody else has an
/// address of the compiler knows to be apart from the draws, and only then it makes vectors of the loop.
#[derive(Debug, Clone, Copy)]
pub struct NormalTable([f64; LAYERS + 1]);

impl NormalTable {
    /// The table.
    #[inline(always)]
    #[must_use]
    pub fn load() -> Self {
        Self(*HALF_WIDTHS)
    }
}

/// Draws of one name in W trials, in order.
#[derive(Debug, Clone)]
pub struct StreamLanes<const W: usize> {
    /// The generators' states, word by word.
    words: [[u64; W]; 4],
}

impl<const W: usize> StreamLanes<W> {
    /// The next N standard normal draws of every lane.
    #[inline(always)]
    pub fn normals<const N: usize>(&mut self, table: &NormalTable) -> [[f64; W]; N] {
        // As the table: variables, and nobody else's.
        let (mut draws, mut after, mut outside) = ([[0.0; W]; N], [[0; W]; 4], [0; W]);
        for lane in 0..W {
            let (mut state, mut any) = (take(&self.words, lane), 0_u64);
            for draws in &mut draws {
                let (word, next) = next_word(state);
                let (x, is_inside) = normal_inside(word, &table.0);
                state = next;
                draws[lane] = x;
                any |= u64::from(!is_inside);
            }
            outside[lane] = any;
            put(&mut after, lane, state);
        }
        if outside.iter().fold(0, |any, outside| any | outside) != 0 {
            for lane in 0..W {
                if outside[lane] != 0 {
                    let (of_lane, state) = draw_again::<N>(take(&self.words, lane));
                    for n in 0..N {
                        draws[n][lane] = of_lane[n];
                    }
                    put(&mut after, lane, state);
                }
            }
        }
        self.words = after;
        draws
    }

    /// The next draw of every lane, uniform in [0, 1).
    #[inline(always)]
    pub fn uniform(&mut self) -> [f64; W] {
        /// 2⁻⁵³, which the 53 high bits of a word are counted in.
        const UNIT: f64 = 0.5 * f64::EPSILON;
        let mut draws = [0.0; W];
        #[allow(clippy::needless_range_loop)] // arrays side by side
        for lane in 0..W {
            let (word, after) = next_word(take(&self.words, lane));
            draws[lane] = UNIT * (word >> 11) as f64;
            put(&mut self.words, lane, after);
        }
        draws
    }

    /// The next draw of every lane, uniform in [−half_width, half_width).
    #[inline(always)]
    pub fn uniform_about_zero(&mut self, half_width: f64) -> [f64; W] {
        let mut draws = self.uniform();
        for draw in &mut draws {
            *draw = half_width * (2.0 * *draw - 1.0);
        }
        draws
    }
}

/// A lane's next N draws, of which one is outside of its layer, and the state after them.
#[inline(never)]
fn draw_again<const N: usize>(state: [u64; 4]) -> ([f64; N], [u64; 4]) {
    let mut stream = Stream::at(state);
    let draws = stream.normals();
    (draws, stream.state())
}

/// A lane's state.
#[inline(always)]
const fn take<const W: usize>([a, b, c, d]: &[[u64; W]; 4], lane: usize) -> [u64; 4] {
    [a[lane], b[lane], c[lane], d[lane]]
}

/// A lane's state to its place.
#[inline(always)]
const fn put<const W: usize>(words: &mut [[u64; W]; 4], lane: usize, [a, b, c, d]: [u64; 4]) {
    words[0][lane] = a;
    words[1][lane] = b;
    words[2][lane] = c;
    words[3][lane] = d;
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::{InstructionSet, Kernel};

    /// Sixty draws of W trials, of both kinds.
    struct SixtyDraws<const W: usize> {
        first: Address,
    }

    impl<const W: usize> Kernel for SixtyDraws<W> {
        type Output = Vec<[f64; W]>;
        #[inline(always)]
        fn call(self) -> Vec<[f64; W]> {
            let table = NormalTable::load();
            let mut stream = StreamsLanes::<W>::of(&self.first).stream(StreamName::new("wheel").nth(2));
            let mut drawn = Vec::new();
            for _ in 0..10 {
                drawn.extend(stream.normals::<4>(&table));
                drawn.push(stream.uniform());
                drawn.extend(stream.normals::<1>(&table));
            }
            drawn
        }
    }

    /// 800 trials, in which 460 draws are outside of their layer. Rejects, as was tried: the state after a
    /// draw outside taken from the words that went before, a trial's number that stands still.
    #[test]
    fn lanes_draw_what_each_trial_draws_for_any_width_and_instruction_set() {
        fn check<const W: usize>(set: InstructionSet) {
            for block in 0..800 / W {
                let first = Address { seed: 7, point: 3, trial: (block * W) as u64, run: 5 };
                let drawn = set.run(SixtyDraws::<W> { first });
                for lane in 0..W {
                    let address = Address { trial: first.trial + lane as u64, ..first };
                    let mut stream = address.stream(StreamName::new("wheel").nth(2));
                    for six in drawn.chunks(6) {
                        for (k, drawn) in six.iter().enumerate() {
                            let expected = if k == 4 { stream.uniform() } else { stream.normal() };
                            assert_eq!(drawn[lane].to_bits(), expected.to_bits(), "{} {W} {lane}", set.name());
                        }
                    }
                }
            }
        }
        for set in InstructionSet::available() {
            check::<1>(set);
            check::<8>(set);
            check::<16>(set);
        }
    }
}
