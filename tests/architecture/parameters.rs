//! Parameters have names: what two values are that travel together stands in a type with fields, and not in
//! a tuple that each function takes apart.
//!
//! Rejected by what was tried: `fn f((tests, level): (f64, f64))`, in a trait, an impl and a function.

use std::fs;
use std::path::Path;

use syn::visit::{self, Visit};
use syn::{FnArg, Pat, Signature};

use crate::{files, root, text};

/// Named functions that take a tuple apart in their parameters.
#[derive(Default)]
struct Found(Vec<String>);

impl<'ast> Visit<'ast> for Found {
    fn visit_signature(&mut self, of: &'ast Signature) {
        let is_tuple = |of: &FnArg| matches!(of, FnArg::Typed(of) if matches!(*of.pat, Pat::Tuple(_)));
        if of.inputs.iter().any(is_tuple) {
            self.0.push(of.ident.to_string());
        }
        visit::visit_signature(self, of);
    }
}

fn found(source: &str) -> Result<Vec<String>, syn::Error> {
    let mut found = Found::default();
    found.visit_file(&syn::parse_file(source)?);
    Ok(found.0)
}

#[test]
fn named_functions_take_no_tuples_apart_in_their_parameters() {
    let mut folders = vec!["src".to_owned()];
    for entry in fs::read_dir(root().join("crates")).expect("the crates stand here") {
        let name = entry.expect("readable").file_name().to_string_lossy().into_owned();
        folders.push(format!("crates/{name}/src"));
    }
    let is_rust = |path: &Path| path.extension().is_some_and(|extension| extension == "rs");
    let mut complaints = Vec::new();
    for path in folders.iter().flat_map(|folder| files(folder)).filter(|path| is_rust(path)) {
        let of_file = found(&text(&path)).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        complaints.extend(of_file.iter().map(|name| format!("{}: {name}", path.display())));
    }
    assert!(complaints.is_empty(), "give these values a parameter each, or a type: {complaints:#?}");
}

#[test]
fn planted_tuples_are_found_and_closures_arrays_and_structs_are_not() {
    let source = "
        fn a((tests, level): (f64, f64)) {}
        trait T { fn b(&self, (x, y): (f64, f64)) {} }
        impl T for S { fn c((x, y): &(f64, f64)) { let f = |(x, y): (f64, f64)| x; } }
        fn d([x, y]: [f64; 2], S { z }: S, pair: (f64, f64)) {}
    ";
    assert_eq!(found(source).expect("Rust"), ["a", "b", "c"]);
}
