//! The longest way from `main` to the filter's update, function by function: whoever follows a diagnosis to
//! the numbers reads so many functions and no more. Parallel maps over closures (`refit_each`) do not count.

use syn::visit::{self, Visit};
use syn::{Block, Ident, ImplItemFn, ItemFn};

use crate::text;

/// Functions on the way at the most.
const MOST: usize = 18;

/// File and function, each of which calls the next one.
const WAY: &[(&str, &str)] = &[
    ("src/main.rs", "main"),
    ("src/command.rs", "main"),
    ("src/command.rs", "run"),
    ("src/diagnose.rs", "run"),
    ("crates/diagnose/src/diagnosis.rs", "diagnose"),
    ("crates/diagnose/src/search/mean_structure.rs", "mean_structure"),
    ("crates/diagnose/src/search/mean_structure.rs", "search_among_all"),
    ("crates/diagnose/src/search/selection.rs", "search"),
    ("crates/diagnose/src/search/selection.rs", "grown"),
    ("crates/diagnose/src/search/rivals.rs", "rivals"),
    ("crates/diagnose/src/fits/augmented_model.rs", "refit"),
    ("crates/estimation/src/model_fit.rs", "extended_from"),
    ("crates/estimation/src/optimizer.rs", "fit_from"),
    ("crates/estimation/src/pass.rs", "pass"),
    ("crates/estimation/src/pass.rs", "filter"),
    ("crates/estimation/src/pass.rs", "filter_segment"),
    ("crates/estimation/src/filter.rs", "call"),
    ("crates/estimation/src/filter.rs", "update"),
];

/// What the functions of a name mention, each in a list of its own.
struct Mentions<'n> {
    name: &'n str,
    found: Vec<Names>,
}

/// Names in a function.
#[derive(Default)]
struct Names(Vec<String>);

impl<'ast> Visit<'ast> for Names {
    fn visit_ident(&mut self, name: &'ast Ident) {
        self.0.push(name.to_string());
    }
}

impl Mentions<'_> {
    fn function(&mut self, name: &Ident, block: &Block) {
        if name == self.name {
            let mut names = Names::default();
            names.visit_block(block);
            self.found.push(names);
        }
    }
}

impl<'ast> Visit<'ast> for Mentions<'_> {
    fn visit_item_fn(&mut self, item: &'ast ItemFn) {
        self.function(&item.sig.ident, &item.block);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast ImplItemFn) {
        self.function(&item.sig.ident, &item.block);
        visit::visit_impl_item_fn(self, item);
    }
}

fn mentions(path: &str, name: &str) -> Vec<Names> {
    let mut mentions = Mentions { name, found: Vec::new() };
    mentions.visit_file(&syn::parse_file(&text(path)).expect("a source"));
    mentions.found
}

/// Whether a function calls another one, whose run by a set of instructions is a call too.
fn calls(path: &str, name: &str, next: &str) -> bool {
    let next = if next == "call" { "FilterRun" } else { next };
    mentions(path, name).iter().any(|names| names.0.iter().any(|name| name == next))
}

#[test]
fn the_way_from_main_to_the_filter_is_short_and_as_listed() {
    assert!(WAY.len() <= MOST, "{} functions from main to the filter's update", WAY.len());
    for pair in WAY.windows(2) {
        let [(path, name), (_, next)] = pair else { unreachable!("pairs") };
        assert!(calls(path, name, next), "{path}: {name} does not call {next}: list every function on the way");
    }
    let (path, last) = WAY[WAY.len() - 1];
    assert!(!mentions(path, last).is_empty(), "{path} has no {last}");
    assert!(!calls("src/command.rs", "main", "update"), "a call that is none is seen as none");
}
