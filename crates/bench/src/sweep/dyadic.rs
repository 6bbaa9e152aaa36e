//! Sums whose last bit does not depend on who adds what when.
//!
//! Floating-point addition is not associative, so the order is fixed by the numbers of the summands and by
//! nothing else: summand k is leaf k of one binary tree, and only siblings are merged. Threads, waves,
//! interruptions and shards each hold some of the tree's nodes; put together they give the same root. A range
//! of n summands needs at most 2 log₂ n nodes.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// What can be summed.
pub(crate) trait Merge: Clone {
    /// Adds the summands that follow.
    fn merge(&mut self, following: &Self);
}

/// A node of the tree: the sum of `1 << level` leaves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Node<T> {
    level: u32,
    sum: T,
}

/// The sum of the leaves of a range, as the fewest nodes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct DyadicSum<T> {
    first: u64,
    next: u64,
    nodes: Vec<Node<T>>,
}

impl<T: Merge> DyadicSum<T> {
    /// An empty sum that begins at leaf `first`.
    pub(crate) const fn starting_at(first: u64) -> Self {
        Self { first, next: first, nodes: Vec::new() }
    }

    /// The first leaf.
    pub(crate) const fn first(&self) -> u64 {
        self.first
    }

    /// The leaf that is to come next.
    pub(crate) const fn next(&self) -> u64 {
        self.next
    }

    /// Adds the next leaf.
    pub(crate) fn push(&mut self, sum: T) {
        self.append(Node { level: 0, sum });
    }

    /// Adds the sum of the leaves that follow; false, and nothing done, when it does not begin where this one
    /// ends.
    #[must_use]
    pub(crate) fn join(&mut self, following: Self) -> bool {
        let fits = following.first == self.next;
        if fits {
            for node in following.nodes {
                self.append(node);
            }
        }
        fits
    }

    /// Whether the nodes are those of the leaves from the first to the next one, and `holds` of each with its
    /// leaves.
    pub(crate) fn is_whole(&self, holds: impl Fn(Range<u64>, &T) -> bool) -> bool {
        let mut reached = self.first;
        let is_next = |node: &Node<T>| {
            let leaves = 1_u64.checked_shl(node.level).filter(|leaves| reached.is_multiple_of(*leaves));
            let next = leaves.and_then(|leaves| reached.checked_add(leaves)).filter(|next| *next <= self.next);
            let Some(next) = next else { return false };
            let range = reached..next;
            reached = next;
            holds(range, &node.sum)
        };
        self.nodes.iter().all(is_next) && reached == self.next
    }

    fn append(&mut self, mut node: Node<T>) {
        let mut start = self.next;
        self.next += 1 << node.level;
        // The one before is the sibling when it is as large and stands at an even place.
        while let Some(before) = self
            .nodes
            .pop_if(|before| before.level == node.level && (start - (1 << node.level)).is_multiple_of(2 << node.level))
        {
            start -= 1 << node.level;
            let mut sum = before.sum;
            sum.merge(&node.sum);
            node = Node { level: node.level + 1, sum };
        }
        self.nodes.push(node);
    }

    /// The whole sum, nodes from left to right; `None` when it is empty.
    pub(crate) fn total(&self) -> Option<T> {
        let (first, rest) = self.nodes.split_first()?;
        let mut sum = first.sum.clone();
        rest.iter().for_each(|node| sum.merge(&node.sum));
        Some(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[derive(Debug, Clone, PartialEq)]
    struct Rounded(f64);

    impl Merge for Rounded {
        fn merge(&mut self, following: &Self) {
            self.0 += following.0;
        }
    }

    fn of(leaves: Range<u64>, value: impl Fn(u64) -> f64) -> DyadicSum<Rounded> {
        let mut sum = DyadicSum::starting_at(leaves.start);
        leaves.for_each(|leaf| sum.push(Rounded(value(leaf))));
        sum
    }

    proptest! {
        #[test]
        fn any_cuts_give_the_same_bits(n in 1_u64..300, a in 0_u64..300, b in 0_u64..300, seed in 0.1_f64..0.9) {
            // Magnitudes over sixteen decades: any other order of additions differs in its last bits.
            let value = |leaf: u64| ((leaf as f64 + seed) * 7.3).sin() * 10_f64.powi((leaf % 17) as i32 - 8);
            let whole = of(0..n, value);
            let (a, b) = (a.min(b).min(n), a.max(b).min(n));
            let mut joined = of(0..a, value);
            // The last two shards are put together first.
            let mut rest = of(a..b, value);
            prop_assert!(rest.join(of(b..n, value)));
            prop_assert!(joined.join(rest));
            prop_assert_eq!(&joined, &whole);
            prop_assert_eq!(joined.total().map(|sum| sum.0.to_bits()), whole.total().map(|sum| sum.0.to_bits()));
            prop_assert!(whole.nodes.len() <= 9, "{}", whole.nodes.len());
        }
    }

    #[test]
    fn plain_running_sums_would_not_do() {
        let value = |leaf: u64| 0.1 + leaf as f64;
        let running = (0..100).map(value).fold(0.0, |sum, x| sum + x);
        let parts = (0..50).map(value).fold(0.0, |sum, x| sum + x) + (50..100).map(value).fold(0.0, |sum, x| sum + x);
        assert_ne!(running, parts);
    }

    #[test]
    fn only_what_follows_can_be_joined() {
        let value = |leaf: u64| leaf as f64;
        let mut sum = of(0..5, value);
        assert!(!sum.join(of(6..9, value)));
        assert!(!sum.join(of(4..9, value)));
        assert_eq!((sum.first(), sum.next()), (0, 5));
        assert!(sum.join(of(5..9, value)));
        assert_eq!(sum.total(), Some(Rounded(36.0)));
        assert_eq!(DyadicSum::<Rounded>::starting_at(3).total(), None);
    }
}
