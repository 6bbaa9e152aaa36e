//! Records in longer pieces, for whoever asks what hardly changes from one row of a fast log to the next.
//!
//! Rows a hundred times a second are ten to a look that comes ten times a second. A covariate that is a matter of tenths of a second is as well asked of five of
//! them together; wheels that turn on, each at its own speed, go the same arc but for the square of what their speeds change by in the meantime.

use kinematics::Wheels;

use crate::records::{Chain, Records, Seen};
use crate::thinning::{Leg, Selection};
use crate::wheel_angles::Piece;

/// Records whose pieces have been put together, and the same looks taken of them.
pub(crate) struct Coarse<'a> {
    pub(crate) records: Records<'a>,
    pub(crate) selections: Vec<Selection>,
}

impl<'a> Coarse<'a> {
    /// Pieces of one way of turning put together, up to so long; looks stay where they are. `None` where that leaves more than half of them.
    pub(crate) fn of(records: &Records<'a>, selections: &[Selection], longest_s: f64) -> Option<Self> {
        let (chains, ends): (Vec<_>, Vec<_>) =
            records.chains.iter().map(|chain| put_together(chain, longest_s)).unzip();
        let pieces = |chains: &[Chain<'_>]| chains.iter().map(|chain| chain.pieces.len()).sum::<usize>();
        if 2 * pieces(&chains) > pieces(&records.chains) {
            return None;
        }
        let of_chain = |(legs, ends): (&Vec<Leg>, &Vec<usize>)| {
            let of_leg = |leg: &Leg| Leg { pieces: ends[leg.pieces.start]..ends[leg.pieces.end], ..leg.clone() };
            legs.iter().map(of_leg).collect()
        };
        let selections =
            selections.iter().map(|of| Selection { legs: of.legs.iter().zip(&ends).map(of_chain).collect() }).collect();
        let records = Records { chains, unused: records.unused.clone(), ids: records.ids.clone() };
        Some(Self { records, selections })
    }
}

/// A chain with its pieces put together between its looks, and how many there are now for each number of them before: it is told where a look is, and means nothing elsewhere.
fn put_together<'a>(chain: &Chain<'a>, longest_s: f64) -> (Chain<'a>, Vec<usize>) {
    let mut ends = Vec::with_capacity(chain.pieces.len() + 1);
    let mut together: Vec<Piece> = Vec::new();
    let mut seen_before = vec![false; chain.pieces.len() + 1];
    chain.looks.iter().for_each(|look| seen_before[look.after] = true);
    for (piece, seen_before) in chain.pieces.iter().zip(seen_before) {
        ends.push(together.len());
        match together.last_mut() {
            Some(last)
                if !seen_before
                    && last.dt_s + piece.dt_s <= longest_s * (1.0 + 1e-9)
                    && turns_on(last.wheel_rad, piece.wheel_rad) =>
            {
                last.dt_s += piece.dt_s;
                last.wheel_rad = last.wheel_rad.zip_with(piece.wheel_rad, |last, rad| last + rad);
                last.row_s[1] = piece.row_s[1];
            }
            _ => together.push(*piece),
        }
    }
    ends.push(together.len());
    together.shrink_to_fit();
    let looks = chain.looks.iter().map(|look| Seen { after: ends[look.after], ..*look }).collect();
    (Chain { pieces: together, looks, ..*chain }, ends)
}

/// Whether both wheels turn on as they did: neither turns back, begins or stands still.
fn turns_on(last: Wheels<f64>, next: Wheels<f64>) -> bool {
    let as_before = last.zip_with(next, |last, next| last * next > 0.0 || (last == 0.0 && next == 0.0));
    as_before.left && as_before.right
}
