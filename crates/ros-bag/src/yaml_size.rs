//! How large a YAML document becomes once its aliases are expanded: the loader copies what an anchor names
//! wherever an alias stands, so that ten lines of ten aliases each make 10¹⁰ nodes.

use std::collections::HashMap;

use yaml_rust2::Event;
use yaml_rust2::parser::{EventReceiver, Parser};

use crate::settings::MAX_YAML_NODES;

/// Counts nodes without making them.
#[derive(Default)]
struct Counter {
    /// Nodes so far of each sequence and mapping that is open, with the number of its anchor.
    open: Vec<(usize, u64)>,
    /// Nodes of what has an anchor. Looked up, never iterated.
    anchored: HashMap<usize, u64>,
    total: u64,
}

impl Counter {
    fn node(&mut self, anchor: usize, nodes: u64) {
        if anchor > 0 {
            self.anchored.insert(anchor, nodes);
        }
        match self.open.last_mut() {
            Some((_, around)) => *around = around.saturating_add(nodes),
            None => self.total = self.total.saturating_add(nodes),
        }
    }
}

impl EventReceiver for Counter {
    fn on_event(&mut self, event: Event) {
        match event {
            Event::Scalar(_, _, anchor, _) => self.node(anchor, 1),
            Event::Alias(anchor) => {
                let nodes = self.anchored.get(&anchor).copied().unwrap_or(1);
                self.node(0, nodes);
            }
            Event::SequenceStart(anchor, _) | Event::MappingStart(anchor, _) => self.open.push((anchor, 1)),
            Event::SequenceEnd | Event::MappingEnd => {
                if let Some((anchor, nodes)) = self.open.pop() {
                    self.node(anchor, nodes);
                }
            }
            _ => {}
        }
    }
}

/// Nodes of a text; an error where it is no YAML, or becomes larger than [`MAX_YAML_NODES`].
pub(crate) fn expanded_nodes(text: &str) -> Result<u64, String> {
    let mut counter = Counter::default();
    Parser::new_from_str(text).load(&mut counter, true).map_err(|error| format!("no YAML: {error}"))?;
    if counter.total > MAX_YAML_NODES {
        return Err(format!("more than {MAX_YAML_NODES} nodes once its aliases are expanded"));
    }
    Ok(counter.total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aliases_count_as_what_they_name() {
        assert_eq!(expanded_nodes("[1, 2]"), Ok(3));
        assert_eq!(expanded_nodes("a: &x [1, 2]\nb: [*x, *x]\n"), Ok(1 + 1 + 3 + 1 + 1 + 2 * 3));
        assert_eq!(expanded_nodes(""), Ok(0));
    }

    #[test]
    fn a_few_lines_of_aliases_that_multiply_are_refused() {
        let mut text = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n".to_owned();
        for level in 1..12 {
            let inside = vec![format!("*a{}", level - 1); 10].join(", ");
            text += &format!("a{level}: &a{level} [{inside}]\n");
        }
        let why = expanded_nodes(&text).expect_err("10¹² nodes");
        assert!(why.contains("once its aliases are expanded"), "{why}");
        let deep = "[".repeat(1_000_000);
        assert!(expanded_nodes(&deep).expect_err("deep").contains("recursion limit"));
    }
}
