//! Numbers that decide something stand in a crate's settings, each with its unit, its meaning and its
//! source, and docs/settings.md lists them. With YAIR_UPDATE_DOCS=1 the document is written anew.
//!
//! A number that decides something is a constant of a numeric type, or an array of them, whose value has a
//! literal. Constants that name another constant are derived from it (a column's index, a sum), and
//! constants of tests, which stand under `#[cfg(test)]` or in a folder `tests/`, decide nothing: both may
//! stand anywhere.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use syn::parse::{Parse, ParseStream};
use syn::visit::{self, Visit};
use syn::{
    Attribute, Expr, ExprLit, ExprPath, Ident, ImplItemConst, Item, ItemConst, ItemMacro, ItemStatic, Lit, Meta, Token,
    Type,
};

use crate::{files, root, text};

/// The sources of the crates whose settings are listed. Each has a file `settings.rs` or a folder
/// `settings/`.
const SOURCES: [&str; 6] = [
    "crates/preflight/src",
    "crates/estimation/src",
    "crates/calib/src",
    "crates/diagnose/src",
    "crates/fleet/src",
    "crates/dataset/src",
];

/// Settings of crates whose other constants stand where they are used: constants of laws, and limits on what
/// files may say.
const OTHERS: [&str; 2] = ["crates/effects/src", "crates/ros-bag/src"];

/// Folders and files whose constants are limits on what files may say, or of arithmetic.
const ELSEWHERE: [&str; 5] = [
    "crates/dataset/src/fingerprint.rs",
    "crates/dataset/src/import/",
    "crates/dataset/src/read/",
    "crates/dataset/src/replicates.rs",
    "crates/dataset/src/table/",
];

const NUMERIC: [&str; 11] = ["f32", "f64", "u8", "u16", "u32", "u64", "usize", "i32", "i64", "isize", "Duration"];

/// How the last sentence of a setting's comment begins.
const ORIGINS: [&str; 5] = ["Derived: ", "Budgeted: ", "Tuned: ", "Convention: ", "Published: "];

const DOCUMENT: &str = "docs/settings.md";

const HEAD: &str = "# Settings

Every number that decides something, with its unit, its meaning and where it is from: *derived* from an equation,
*budgeted* of an error budget, *tuned* on something, or a *convention*. This file is generated from the sources:
`YAIR_UPDATE_DOCS=1 cargo test --release --test architecture settings`.
";

/// A row of the table.
#[derive(Debug, PartialEq)]
struct Setting {
    name: String,
    value: String,
    meaning: String,
    source: String,
}

fn is_setting(path: &str) -> bool {
    path.ends_with("/settings.rs") || path.contains("/settings/")
}

fn is_test(path: &str) -> bool {
    path.ends_with("/tests.rs") || path.contains("/tests/")
}

/// The text of the comments on an item, or on a file.
fn comment(attributes: &[Attribute]) -> String {
    let line = |attribute: &Attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            Expr::Lit(ExprLit { lit: Lit::Str(line), .. }) => Some(line.value().trim().to_owned()),
            _ => None,
        },
        _ => None,
    };
    attributes.iter().filter_map(line).collect::<Vec<_>>().join(" ")
}

/// Meaning and source of a comment; the source is its last sentence.
fn split(comment: &str) -> Option<(String, String)> {
    let at = ORIGINS.iter().filter_map(|origin| comment.find(origin)).min()?;
    let (meaning, source) = (comment[..at].trim(), comment[at..].trim());
    (!meaning.is_empty() && source.ends_with('.')).then(|| (meaning.to_owned(), source.to_owned()))
}

/// The fields of `rules::settings!`, each with its comment.
struct Fields(Vec<(Ident, Vec<Attribute>)>);

impl Parse for Fields {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        input.parse::<Ident>()?;
        let mut fields = Vec::new();
        while !input.is_empty() {
            let attributes = input.call(Attribute::parse_outer)?;
            fields.push((input.parse()?, attributes));
            input.parse::<Token![:]>()?;
            input.parse::<Type>()?;
            input.parse::<Token![=]>()?;
            input.parse::<Expr>()?;
            input.parse::<Token![,]>()?;
        }
        Ok(Self(fields))
    }
}

/// The fields that a macro declares; none of another macro.
fn fields(item: &ItemMacro) -> syn::Result<Vec<(Ident, Vec<Attribute>)>> {
    let is_of_settings = item.mac.path.segments.last().is_some_and(|last| last.ident == "settings");
    if is_of_settings { Ok(item.mac.parse_body::<Fields>()?.0) } else { Ok(Vec::new()) }
}

/// How many settings a macro declares.
pub(crate) fn settings_of_macro(item: &ItemMacro) -> usize {
    fields(item).map_or(0, |fields| fields.len())
}

/// The settings of a file in its order: constants, and fields of `rules::settings!`.
fn settings(path: &str, source: &str) -> Result<Vec<Setting>, String> {
    let unreadable = |error: syn::Error| format!("{path}: {error}");
    let file = syn::parse_file(source).map_err(unreadable)?;
    let mut found = Vec::new();
    for item in file.items {
        let (declared, end) = match item {
            Item::Const(item) => (vec![(item.ident, item.attrs)], ";\n"),
            Item::Macro(item) => (fields(&item).map_err(unreadable)?, ",\n"),
            Item::Mod(_) | Item::Use(_) => continue,
            _ => return Err(format!("{path}: settings are constants, or fields of a struct, and nothing else")),
        };
        for (name, attributes) in declared {
            let (meaning, source_of) = split(&comment(&attributes))
                .ok_or_else(|| format!("{path}: {name} needs unit, meaning, and a last sentence from {ORIGINS:?}"))?;
            let declared = source.split_once(&format!(" {name}: ")).map(|(_, rest)| rest);
            let value = declared.and_then(|rest| rest.split_once(" = ")?.1.split_once(end));
            let value = value.map(|(value, _)| value.split_whitespace().collect::<Vec<_>>().join(" "));
            let value = value.ok_or_else(|| format!("{path}: {name} has no value"))?;
            found.push(Setting { name: name.to_string(), value, meaning, source: source_of });
        }
    }
    Ok(found)
}

/// Constants that should be settings, by name.
#[derive(Default)]
struct Strays(Vec<String>);

impl Strays {
    fn constant(&mut self, name: &str, of: &Type, value: &Expr) {
        let mut parts = Parts::default();
        parts.visit_expr(value);
        if is_one_of(&NUMERIC, of) && parts.has_number && !parts.has_constant {
            self.0.push(name.to_owned());
        }
    }
}

/// Whether a type is one of these, or an array of one.
pub(crate) fn is_one_of(names: &[&str], of: &Type) -> bool {
    match of {
        Type::Array(array) => is_one_of(names, &array.elem),
        Type::Path(path) => path.path.segments.last().is_some_and(|last| names.iter().any(|name| last.ident == name)),
        _ => false,
    }
}

/// What a value is made of.
#[derive(Default)]
struct Parts {
    has_number: bool,
    has_constant: bool,
}

impl<'ast> Visit<'ast> for Parts {
    fn visit_lit(&mut self, literal: &'ast Lit) {
        self.has_number |= matches!(literal, Lit::Int(_) | Lit::Float(_));
    }

    fn visit_expr_path(&mut self, path: &'ast ExprPath) {
        let last = path.path.segments.last().map(|last| last.ident.to_string()).unwrap_or_default();
        self.has_constant |= last.len() > 1 && last.chars().all(|c| c.is_uppercase() || c.is_numeric() || c == '_');
    }
}

impl<'ast> Visit<'ast> for Strays {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Mod(item) => &item.attrs[..],
            Item::Fn(item) => &item.attrs,
            Item::Impl(item) => &item.attrs,
            Item::Const(item) => &item.attrs,
            _ => &[],
        };
        let is_test = |attribute: &Attribute| {
            attribute.path().is_ident("cfg") && attribute.parse_args::<Ident>().is_ok_and(|of| of == "test")
        };
        if !attributes.iter().any(is_test) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_const(&mut self, item: &'ast ItemConst) {
        self.constant(&item.ident.to_string(), &item.ty, &item.expr);
        visit::visit_item_const(self, item);
    }

    fn visit_item_static(&mut self, item: &'ast ItemStatic) {
        self.constant(&item.ident.to_string(), &item.ty, &item.expr);
    }

    fn visit_impl_item_const(&mut self, item: &'ast ImplItemConst) {
        self.constant(&item.ident.to_string(), &item.ty, &item.expr);
    }
}

fn strays(source: &str) -> Vec<String> {
    let mut found = Strays::default();
    found.visit_file(&syn::parse_file(source).expect("a source"));
    found.0
}

/// The document of the settings files of some crates.
fn document(sources: &[&str]) -> Result<String, String> {
    let mut all = HEAD.to_owned();
    for folder in sources {
        let name = folder.split('/').nth(1).unwrap_or(folder);
        let _ = write!(all, "\n## `{name}`\n");
        let mut count = 0;
        for path in paths(folder).iter().filter(|path| is_setting(path)) {
            let source = text(path);
            let settings = settings(path, &source)?;
            if settings.is_empty() {
                continue;
            }
            count += settings.len();
            let about = syn::parse_file(&source).map_err(|error| error.to_string())?;
            let _ = write!(all, "\n{} ([{path}](../{path}))\n\n", comment(&about.attrs));
            all.push_str("| name | value | unit and meaning | source |\n| --- | --- | --- | --- |\n");
            for Setting { name, value, meaning, source } in settings {
                let cell = |text: &str| text.replace('|', "\\|");
                let _ = writeln!(all, "| `{name}` | `{value}` | {} | {} |", cell(&meaning), cell(&source));
            }
        }
        if count == 0 {
            return Err(format!("{folder} has no settings"));
        }
    }
    Ok(all)
}

/// The Rust files under a folder, as paths from the repository's root.
fn paths(folder: &str) -> Vec<String> {
    let relative = |path: std::path::PathBuf| path.strip_prefix(root()).ok()?.to_str().map(str::to_owned);
    files(folder).into_iter().filter_map(relative).filter(|path| path.ends_with(".rs")).collect()
}

#[test]
fn every_setting_has_a_source_and_the_document_lists_it() {
    let expected = document(&[&SOURCES[..], &OTHERS].concat()).unwrap_or_else(|why| panic!("{why}"));
    if std::env::var("YAIR_UPDATE_DOCS").is_ok_and(|value| value == "1") {
        std::fs::write(root().join(DOCUMENT), &expected).expect("written");
    }
    let found = text(DOCUMENT);
    let line = found.lines().zip(expected.lines()).position(|(found, expected)| found != expected);
    assert!(
        found == expected,
        "{DOCUMENT}, line {}: run YAIR_UPDATE_DOCS=1 cargo test --release --test architecture settings",
        line.unwrap_or_else(|| found.lines().count().min(expected.lines().count())) + 1
    );
}

#[test]
fn numbers_that_decide_something_stand_in_the_settings() {
    let mut complaints = BTreeMap::new();
    let is_exempt = |path: &str| is_setting(path) || is_test(path) || ELSEWHERE.iter().any(|of| path.starts_with(of));
    for path in SOURCES.iter().flat_map(|folder| paths(folder)).filter(|path| !is_exempt(path)) {
        let found = strays(&text(&path));
        if !found.is_empty() {
            complaints.insert(path, found);
        }
    }
    assert!(complaints.is_empty(), "move these to the crate's settings: {complaints:#?}");
}

#[test]
fn planted_numbers_are_found_and_indices_are_not() {
    let source = "
        const LEVEL: f64 = 0.05;
        const SCALES: [f64; 2] = [0.1, 1.0];
        const WAIT: std::time::Duration = std::time::Duration::from_secs(3);
        fn f() { const INNER: usize = 3; }
        struct A;
        impl A { const OWN: u32 = 7; }
        const AT: usize = SLIDES + 2;
        const WORDS: [(&str, f64); 1] = [(\"speed\", 0.02)];
        #[cfg(test)]
        mod tests { const TOLERANCE: f64 = 1e-9; }
    ";
    assert_eq!(strays(source), ["LEVEL", "SCALES", "WAIT", "INNER", "OWN"]);
}

#[test]
fn a_setting_without_a_source_is_refused() {
    let sound =
        "/// Seconds. A time.\n/// Tuned: by hand; no record\n/// of what on.\npub const T_S: [f64; 2] = [1.0, 2.0];\n";
    let row = |name: &str, value: &str| Setting {
        name: name.to_owned(),
        value: value.to_owned(),
        meaning: "Seconds. A time.".to_owned(),
        source: "Tuned: by hand; no record of what on.".to_owned(),
    };
    assert_eq!(settings("settings.rs", sound), Ok(vec![row("T_S", "[1.0, 2.0]")]));
    let field = "rules::settings! {\n    Times\n    /// Seconds. A time.\n    /// Tuned: by hand; no record\n    /// of what on.\n    t_s: f64 = 1e-3,\n}\n";
    assert_eq!(settings("settings.rs", field), Ok(vec![row("t_s", "1e-3")]));
    assert!(settings("settings.rs", &field.replace("Tuned", "Chosen")).is_err());
    assert!(settings("settings.rs", "/// Seconds. A time.\npub const T_S: f64 = 1.0;\n").is_err());
    assert!(settings("settings.rs", "/// Tuned: by hand.\npub const T_S: f64 = 1.0;\n").is_err());
    assert!(settings("settings.rs", "pub fn f() {}\n").is_err());
}
