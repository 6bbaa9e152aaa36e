//! The size of the crates that decide about a log: each number may fall, and rises only with a line in
//! docs/size.md that says what the rise won (CONTRIBUTING.md, "The rule of acceptance").

use std::collections::BTreeMap;
use std::path::Path;

use syn::visit::{self, Visit};
use syn::{BinOp, Expr, ExprBinary, ExprLit, Item, Lit};

use crate::settings::{is_one_of, settings_of_macro};
use crate::{files, root, text};

/// Crates whose code decides about a log.
const CORE: [&str; 5] = ["dataset", "preflight", "estimation", "diagnose", "effects"];

/// What is counted of each.
const MEASURES: [&str; 5] = ["lines", "constants", "literals", "files", "depth"];

/// Types of constants that are numbers.
const NUMERIC: [&str; 8] = ["f64", "f32", "usize", "u8", "u16", "u32", "u64", "i64"];

/// A crate's lines that are no tests, its constants that are numbers or lists of them, its numbers other than
/// 0, 1 and 2 in comparisons, its files, and how deep its folders go.
fn counts(folder: &Path) -> [usize; 5] {
    let mut counts = [0; 5];
    for file in files(folder.to_str().expect("a path")) {
        let within = file.strip_prefix(root().join(folder)).expect("inside").to_owned();
        let is_test = within.components().any(|part| part.as_os_str().to_string_lossy().starts_with("tests"));
        if is_test || file.extension().is_none_or(|extension| extension != "rs") {
            continue;
        }
        let source = text(&file);
        // Tests of a file are its end.
        let body = source.split("#[cfg(test)]\nmod tests {").next().unwrap_or(&source);
        let mut found = Found::default();
        found.visit_file(&syn::parse_file(body).unwrap_or_else(|error| panic!("{}: {error}", file.display())));
        counts[0] += body.lines().count();
        counts[1] += found.constants;
        counts[2] += found.literals;
        counts[3] += 1;
        counts[4] = counts[4].max(within.components().count());
    }
    counts
}

#[derive(Default)]
struct Found {
    constants: usize,
    literals: usize,
}

fn is_counted_number(of: &Expr) -> bool {
    match of {
        Expr::Unary(of) => is_counted_number(&of.expr),
        Expr::Lit(ExprLit { lit: Lit::Int(number), .. }) => !["0", "1", "2"].contains(&number.base10_digits()),
        Expr::Lit(ExprLit { lit: Lit::Float(number), .. }) => {
            number.base10_parse::<f64>().is_ok_and(|value| ![0.0, 1.0, 2.0].contains(&value))
        }
        _ => false,
    }
}

impl<'ast> Visit<'ast> for Found {
    fn visit_item(&mut self, item: &'ast Item) {
        match item {
            Item::Const(constant) => self.constants += usize::from(is_one_of(&NUMERIC, &constant.ty)),
            Item::Macro(item) => self.constants += settings_of_macro(item),
            _ => {}
        }
        visit::visit_item(self, item);
    }

    fn visit_expr_binary(&mut self, binary: &'ast ExprBinary) {
        let compares = matches!(
            binary.op,
            BinOp::Lt(_) | BinOp::Le(_) | BinOp::Gt(_) | BinOp::Ge(_) | BinOp::Eq(_) | BinOp::Ne(_)
        );
        let numbers = [&binary.left, &binary.right].into_iter().filter(|side| is_counted_number(side));
        self.literals += if compares { numbers.count() } else { 0 };
        visit::visit_expr_binary(self, binary);
    }
}

/// The document's table of limits, by crate.
fn limits(document: &str) -> BTreeMap<String, Vec<usize>> {
    rows(document, "## Limits")
        .filter_map(|cells| {
            let numbers = cells.get(1..)?.iter().map(|cell| cell.parse()).collect::<Result<Vec<usize>, _>>().ok()?;
            Some((cells[0].trim_matches('`').to_owned(), numbers))
        })
        .collect()
}

/// What rose, by crate and measure: by how much in all.
fn rises(document: &str) -> BTreeMap<(String, String), usize> {
    let mut rises = BTreeMap::new();
    for cells in rows(document, "## Rises") {
        let [name, measure, by, won] = &cells[..] else { continue };
        let Ok(by) = by.parse::<usize>() else { continue };
        assert!(won.split_whitespace().count() >= 5, "docs/size.md: {name}, {measure}: what did the rise win?");
        *rises.entry((name.trim_matches('`').to_owned(), measure.clone())).or_insert(0) += by;
    }
    rises
}

/// The cells of the rows of the table under a heading.
fn rows<'a>(document: &'a str, heading: &str) -> impl Iterator<Item = Vec<String>> + use<'a> {
    let section = document.split_once(heading).map_or("", |(_, rest)| rest);
    let section = section.split("\n## ").next().unwrap_or_default();
    let rows = section.lines().filter(|line| line.starts_with('|'));
    rows.map(|line| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect())
}

/// What is larger than its limit and the rises that the document names allow.
fn complaints(document: &str, counted: &BTreeMap<String, [usize; 5]>) -> Vec<String> {
    let (limits, rises) = (limits(document), rises(document));
    let mut complaints = Vec::new();
    for (name, counts) in counted {
        let Some(limit) = limits.get(name).filter(|limit| limit.len() == MEASURES.len()) else {
            complaints.push(format!("{name} has no row of {} numbers under Limits", MEASURES.len()));
            continue;
        };
        for (place, measure) in MEASURES.iter().enumerate() {
            let allowed = limit[place] + rises.get(&(name.clone(), (*measure).to_owned())).unwrap_or(&0);
            if counts[place] > allowed {
                let by = counts[place] - allowed;
                complaints.push(format!("| `{name}` | {measure} | {by} | … what it won, by which replay |"));
            }
        }
    }
    complaints
}

#[test]
fn what_decides_about_a_log_grows_only_by_what_it_wins() {
    let count = |name: &&str| ((*name).to_owned(), counts(Path::new(&format!("crates/{name}/src"))));
    let counted: BTreeMap<String, [usize; 5]> = CORE.iter().map(count).collect();
    let found = complaints(&text("docs/size.md"), &counted);
    assert!(
        found.is_empty(),
        "write under Rises in docs/size.md, or make it smaller ({counted:?}):\n{}",
        found.join("\n")
    );
}

#[test]
fn a_rise_without_a_line_is_found_and_one_with_a_line_is_not() {
    let document = |rises: &str| {
        format!("## Limits\n\n| crate | lines |\n| --- | --- |\n| `a` | 10 | 1 | 1 | 1 | 1 |\n\n## Rises\n\n{rises}\n")
    };
    let counted = BTreeMap::from([("a".to_owned(), [12, 1, 1, 1, 1])]);
    assert_eq!(complaints(&document(""), &counted).len(), 1);
    let won = "| `a` | lines | 2 | 3 points of detected, of 2400 |";
    assert_eq!(complaints(&document(won), &counted), Vec::<String>::new());
    assert_eq!(complaints(&document(&won.replace("| 2 |", "| 1 |")), &counted).len(), 1);
    let unknown = BTreeMap::from([("b".to_owned(), [0; 5])]);
    assert_eq!(complaints(&document(""), &unknown).len(), 1);
}

#[test]
fn numbers_in_comparisons_and_constants_are_counted_and_others_are_not() {
    let mut found = Found::default();
    let source = "const A: f64 = 3.0;\nconst B: [usize; 2] = [1, 2];\nconst C: &str = \"\";\nfn f(x: f64, n: usize) -> bool { x > 0.5 && n == 3 && x < -4.0 && x > 0.0 && n >= 1 && x * 7.0 < A }\n";
    found.visit_file(&syn::parse_file(source).expect("Rust"));
    assert_eq!([found.constants, found.literals], [2, 3]);
}
