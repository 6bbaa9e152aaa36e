//! Datasets that are larger than the memory, part by part: one thread reads, others compute.

use std::ops::Range;
use std::sync::mpsc::{Receiver, channel, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

use dataset::{Blocks, Dataset, DatasetError, Warning};

use crate::settings::COMMON;

/// Successive blocks of one run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Dataset and run.
    pub run: (usize, usize),
    /// Its blocks.
    pub blocks: Range<usize>,
}

impl Part {
    /// A run of `count` blocks in parts as long as each other, of `most` blocks at the most.
    pub fn of_run(run: (usize, usize), count: usize, most: usize) -> impl Iterator<Item = Self> {
        let cuts = count.div_ceil(most.max(1)).max(1);
        (0..cuts).map(move |cut| Self { run, blocks: cut * count / cuts..(cut + 1) * count / cuts })
    }
}

/// What `of_part` makes of each part's rows, in the order of the parts; `notice` gets each dataset's index
/// and warnings.
///
/// # Errors
/// The first fault in the files, or the error of the first part in the order in which they end.
pub fn over_parts<T: Send, E: From<DatasetError> + Send>(
    datasets: &mut [Blocks],
    parts: &[Part],
    of_part: impl Fn(&Part, Dataset) -> Result<T, E> + Sync,
    mut notice: impl FnMut(usize, &Warning),
) -> Result<Vec<T>, E> {
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(COMMON.max_part_threads);
    let mut results = std::thread::scope(|scope| -> Result<Vec<(usize, T)>, E> {
        // No part waits in memory: the reading thread waits for a worker.
        let (give, take) = sync_channel::<(usize, Dataset)>(0);
        let take = Arc::new(Mutex::new(take));
        let (hand_in, collect) = channel();
        for _ in 0..workers {
            let (take, hand_in, of_part) = (Arc::clone(&take), hand_in.clone(), &of_part);
            scope.spawn(move || {
                while let Some((number, part)) = next(&take) {
                    let result = of_part(&parts[number], part).map(|result| (number, result));
                    if hand_in.send(result).is_err() {
                        break;
                    }
                }
            });
        }
        drop((hand_in, take));
        for (number, Part { run: (dataset, run), blocks }) in parts.iter().enumerate() {
            let loaded = datasets[*dataset].read(*run, blocks.clone())?;
            loaded.warnings.iter().for_each(|warning| notice(*dataset, warning));
            // The workers have stopped; what they handed in has the reason.
            if give.send((number, loaded.dataset)).is_err() {
                break;
            }
        }
        drop(give);
        collect.into_iter().collect()
    })?;
    results.sort_unstable_by_key(|(number, _)| *number);
    Ok(results.into_iter().map(|(_, result)| result).collect())
}

fn next<T>(take: &Mutex<Receiver<T>>) -> Option<T> {
    take.lock().unwrap_or_else(PoisonError::into_inner).recv().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_cut_into_parts_of_one_length_that_hold_each_block_once() {
        let blocks = |count, most| Part::of_run((1, 2), count, most).map(|part| part.blocks).collect::<Vec<_>>();
        assert_eq!(blocks(7, 3), [0..2, 2..4, 4..7]);
        assert_eq!(blocks(6, 3), [0..3, 3..6]);
        let whole = |count: usize, most| blocks(count, most).into_iter().eq(std::iter::once(0..count));
        assert!(whole(3, 3) && whole(1, 32));
    }
}
