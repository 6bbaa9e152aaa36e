//! Files of a crate do not use each other in circles: a crate can be read from its lowest file up.
//!
//! The graph has a node per file and an arrow from a file to each file that defines an item which it names,
//! by `use` or by a path in code. A name that a parent re-exports counts as an arrow to the file that defines
//! the item, so that a re-export hides nothing; the `mod` and `pub use` lines themselves are no arrows. What
//! stands under `#[cfg(test)]` is left out. Methods are found by their type, not by name: a method call makes
//! no arrow.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use syn::buffer::{Cursor, TokenBuffer};
use syn::visit::{self, Visit};
use syn::{Attribute, ImplItemFn, Item, ItemMacro, ItemMod, ItemUse, Macro, UseTree, VisRestricted, Visibility};

use crate::root;

/// A module's path from the crate's root, or a path in the source text.
type Names = Vec<String>;

/// For each file the files that it uses, each with the items that it uses of it.
type Graph = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

#[test]
fn no_files_of_a_crate_use_each_other_in_circles() {
    let mut crates = BTreeMap::from([("yair".to_owned(), root().join("src"))]);
    for entry in fs::read_dir(root().join("crates")).expect("the crates stand here") {
        let entry = entry.expect("readable");
        crates.insert(entry.file_name().to_string_lossy().into_owned(), entry.path().join("src"));
    }
    let mut found = Vec::new();
    for (name, source) in &crates {
        let mut files = BTreeMap::new();
        read(source, "", &mut files);
        let graph = graph(&files);
        assert!(files.len() == 1 || !graph.is_empty(), "{name}: no arrow between {} files", files.len());
        found.extend(circles(&graph).iter().map(|circle| format!("{name}:\n{circle}")));
    }
    let found = found.join("\n");
    assert!(found.is_empty(), "files use each other in circles; move what both need into a file below both\n\n{found}");
}

/// The circles of a crate of small files.
fn circles_of(files: &[(&str, &str)]) -> Vec<String> {
    let files = files.iter().map(|(file, text)| ((*file).to_owned(), (*text).to_owned())).collect();
    circles(&graph(&files))
}

#[test]
fn planted_circles_are_found_however_they_are_named() {
    let circle = "    a.rs -> b.rs by B\n    b.rs -> a.rs by A\n";
    let both_ways = [
        // By modules, from above and from beside.
        ("mod a; mod b;", "use crate::b::B; pub struct A(B);", "pub struct B; pub fn f(_: super::a::A) {}"),
        // By re-exports, renamed, as a glob, and in a group.
        ("mod a; mod b; pub use a::A; pub use b::B;", "use crate::B; pub struct A(B);", "pub struct B(crate::A);"),
        (
            "mod a; mod b; pub(crate) use a::A as First; pub use b::*;",
            "use crate::{B as Second}; pub struct A(Second);",
            "use super::*; pub struct B(First);",
        ),
        // In tokens that need not be Rust, and in what a table of contents lists.
        (
            "mod a; mod b;",
            "pub struct A; fn f() { show!(of => crate::b::B::new) }",
            "use crate::a::A; pub struct B(A);",
        ),
        (
            "macro_rules! contents { ($($m:ident :: $T:ident)*) => { $(mod $m; pub use $m::$T;)* }; }\ncontents! { a::A b::B }",
            "pub struct A(crate::B);",
            "pub struct B(crate::A);",
        ),
    ];
    for (lib, a, b) in both_ways {
        let circles = circles_of(&[("lib.rs", lib), ("a.rs", a), ("b.rs", b)]);
        assert!(circles.iter().any(|found| found.contains(circle)), "{lib} {a} {b}: {circles:?}");
    }
    let parent =
        [("lib.rs", "mod a; const N: u8 = 1; fn f() -> u8 { a::g() }"), ("a.rs", "pub fn g() -> u8 { crate::N }")];
    assert_eq!(circles_of(&parent), ["    a.rs -> lib.rs by N\n    lib.rs -> a.rs by g\n"]);
}

#[test]
fn re_exports_and_tests_make_no_circle() {
    let a = "use crate::B; pub struct A(B);";
    for b in [
        "pub struct B;",
        "pub struct B; #[cfg(test)] mod tests { use crate::A; }",
        "/// Of [`crate::A`].\npub struct B;",
    ] {
        assert_eq!(
            circles_of(&[("lib.rs", "mod a; mod b; pub use a::A; pub use b::B;"), ("a.rs", a), ("b.rs", b)]),
            [""; 0]
        );
    }
    // A parent that re-exports its children, of which one uses what another defines; and a file of tests
    // alone.
    let folder = [
        ("lib.rs", "mod a;"),
        ("a/mod.rs", "mod b; mod c; #[cfg(test)] mod tests; pub use b::B; pub use c::C;"),
        ("a/b.rs", "pub struct B;"),
        ("a/c.rs", "use super::B; pub struct C(B);"),
        ("a/tests.rs", "use super::C; use crate::a::b::B;"),
    ];
    assert_eq!(circles_of(&folder), [""; 0]);
}

/// The Rust files below a folder, by their paths in it.
fn read(folder: &Path, within: &str, files: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.expect("readable").path();
        let name = format!("{within}{}", path.file_name().unwrap_or_default().to_string_lossy());
        if path.is_dir() {
            read(&path, &format!("{name}/"), files);
        } else if name.ends_with(".rs") {
            files.insert(name, fs::read_to_string(&path).expect("source is UTF-8"));
        }
    }
}

/// What a module defines and what it brings into scope.
#[derive(Debug, Default)]
struct Module {
    file: String,
    items: BTreeSet<String>,
    /// Name and path; no name for all that a path holds.
    imports: Vec<(Option<String>, Names)>,
}

/// A crate's modules, and all paths that its code names.
#[derive(Debug, Default)]
struct Crate {
    modules: BTreeMap<Names, Module>,
    tests: BTreeSet<Names>,
    /// Where it stands, and the path.
    uses: BTreeSet<(Names, Names)>,
    /// `module::Item` in a call of a macro that makes items, such as a table of contents.
    listed: Vec<(Names, Names)>,
}

/// The graph of a crate's files; `main.rs` or `lib.rs` is its root.
fn graph(files: &BTreeMap<String, String>) -> Graph {
    let root = if files.contains_key("main.rs") { "main" } else { "lib" };
    let mut krate = Crate::default();
    for (file, text) in files {
        let stem = file.trim_end_matches(".rs");
        let mut module: Names = stem.split('/').map(str::to_owned).collect();
        if stem == root || module.last().is_some_and(|last| last == "mod") {
            module.pop();
        }
        krate.modules.entry(module.clone()).or_default().file.clone_from(file);
        let syntax = syn::parse_file(text).unwrap_or_else(|error| panic!("{file}: {error}"));
        Reader { file, module, krate: &mut krate }.visit_file(&syntax);
    }
    krate.import_listed();
    let mut graph = Graph::new();
    for (module, path) in krate.uses.iter().filter(|(module, _)| !krate.is_test(module)) {
        let file = &krate.modules[module].file;
        for (other, item) in krate.definitions(module, path, &mut Vec::new()) {
            if other != *file {
                graph.entry(file.clone()).or_default().entry(other).or_default().insert(item);
            }
        }
    }
    graph
}

impl Crate {
    fn is_test(&self, module: &[String]) -> bool {
        (1..=module.len()).any(|length| self.tests.contains(&module[..length]))
    }

    /// Files and items that a path means in a module: several where one name is a module's, a type's and a
    /// function's. `followed` are the imports on the way there, each of which is followed once.
    fn definitions(
        &self,
        module: &[String],
        path: &[String],
        followed: &mut Vec<(Names, usize)>,
    ) -> BTreeSet<(String, String)> {
        let mut found = BTreeSet::new();
        let Some((name, rest)) = path.split_first() else { return found };
        match name.as_str() {
            "crate" => return self.definitions(&[], rest, followed),
            "self" => return self.definitions(module, rest, followed),
            "super" => return self.definitions(&module[..module.len().saturating_sub(1)], rest, followed),
            _ => {}
        }
        let child = [module, std::slice::from_ref(name)].concat();
        if !rest.is_empty() && self.modules.keys().any(|path| path.starts_with(&child)) {
            return self.definitions(&child, rest, followed);
        }
        let Some(scope) = self.modules.get(module) else { return found };
        if scope.items.contains(name) {
            found.insert((scope.file.clone(), name.clone()));
        }
        for (place, (imported, import)) in scope.imports.iter().enumerate() {
            let import = match imported {
                Some(imported) if imported == name => [import, rest].concat(),
                None => [import, path].concat(),
                Some(_) => continue,
            };
            let step = (module.to_vec(), place);
            if !followed.contains(&step) {
                followed.push(step);
                found.extend(self.definitions(module, &import, followed));
                followed.pop();
            }
        }
        found
    }

    /// A table of contents uses the items that it lists, wherever its macro declares their modules, and
    /// re-exports them.
    fn import_listed(&mut self) {
        for (module, path) in std::mem::take(&mut self.listed) {
            let Some((item, within)) = path.split_last() else { continue };
            let defines = |(of, scope): &(&Names, &Module)| of.ends_with(within) && scope.items.contains(item);
            let defining = self.modules.iter().find(defines).map(|(of, _)| of.clone());
            let Some(mut full) = defining.filter(|_| !within.is_empty()) else { continue };
            full.insert(0, "crate".to_owned());
            full.push(item.clone());
            self.modules.entry(module.clone()).or_default().imports.push((Some(item.clone()), full.clone()));
            self.uses.insert((module, full));
        }
    }
}

/// Takes what a file defines, imports and names into its crate.
struct Reader<'a> {
    file: &'a str,
    module: Names,
    krate: &'a mut Crate,
}

impl Reader<'_> {
    fn scope(&mut self) -> &mut Module {
        self.krate.modules.entry(self.module.clone()).or_default()
    }

    fn names(&mut self, path: Names) {
        self.krate.uses.insert((self.module.clone(), path));
    }

    fn imports(&mut self, tree: &UseTree, before: &[String], is_re_export: bool) {
        let (path, name) = match tree {
            UseTree::Path(path) => {
                return self.imports(&path.tree, &[before, &[path.ident.to_string()]].concat(), is_re_export);
            }
            UseTree::Group(group) => {
                return group.items.iter().for_each(|tree| self.imports(tree, before, is_re_export));
            }
            UseTree::Glob(_) => return self.scope().imports.push((None, before.to_vec())),
            // `use place::{self}` brings in the place itself.
            UseTree::Name(name) if name.ident == "self" => {
                (before.to_vec(), before.last().cloned().unwrap_or_default())
            }
            UseTree::Name(name) => ([before, &[name.ident.to_string()]].concat(), name.ident.to_string()),
            UseTree::Rename(name) => ([before, &[name.ident.to_string()]].concat(), name.rename.to_string()),
        };
        if !is_re_export {
            self.names(path.clone());
        }
        self.scope().imports.push((Some(name), path));
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast Item) {
        let (attributes, name): (&[Attribute], _) = match item {
            Item::Const(item) => (&item.attrs, Some(&item.ident)),
            Item::Enum(item) => (&item.attrs, Some(&item.ident)),
            Item::Fn(item) => (&item.attrs, Some(&item.sig.ident)),
            Item::Impl(item) => (&item.attrs, None),
            Item::Macro(item) => (&item.attrs, item.ident.as_ref()),
            Item::Mod(item) => (&item.attrs, None),
            Item::Static(item) => (&item.attrs, Some(&item.ident)),
            Item::Struct(item) => (&item.attrs, Some(&item.ident)),
            Item::Trait(item) => (&item.attrs, Some(&item.ident)),
            Item::Type(item) => (&item.attrs, Some(&item.ident)),
            Item::Use(item) => (&item.attrs, None),
            _ => panic!("{}: an item of a kind that this test does not know", self.file),
        };
        if attributes.iter().any(is_test) {
            if let Item::Mod(item) = item {
                self.krate.tests.insert([&self.module[..], &[item.ident.to_string()]].concat());
            }
            return;
        }
        if let Some(name) = name {
            self.scope().items.insert(name.to_string());
        }
        visit::visit_item(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'ast ImplItemFn) {
        if !item.attrs.iter().any(is_test) {
            visit::visit_impl_item_fn(self, item);
        }
    }

    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        self.module.push(item.ident.to_string());
        if item.content.is_some() {
            self.file.clone_into(&mut self.scope().file);
        }
        visit::visit_item_mod(self, item);
        self.module.pop();
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        if item.leading_colon.is_none() {
            self.imports(&item.tree, &[], !matches!(item.vis, Visibility::Inherited));
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.leading_colon.is_none() {
            self.names(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        }
        visit::visit_path(self, path);
    }

    fn visit_item_macro(&mut self, item: &'ast ItemMacro) {
        visit::visit_item_macro(self, item);
        let paths = paths(&item.mac);
        if item.ident.is_none() {
            self.krate.listed.extend(paths.into_iter().map(|path| (self.module.clone(), path)));
            return;
        }
        // What a macro of the file defines stands in the file.
        const KEYWORDS: [&str; 7] = ["const", "enum", "fn", "static", "struct", "trait", "type"];
        for pair in paths.windows(2) {
            if let ([keyword], [name]) = (&pair[0][..], &pair[1][..])
                && KEYWORDS.contains(&keyword.as_str())
            {
                self.scope().items.insert(name.clone());
            }
        }
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        self.visit_path(&call.path);
        for path in paths(call) {
            self.names(path);
        }
    }

    fn visit_attribute(&mut self, _: &'ast Attribute) {}

    fn visit_vis_restricted(&mut self, _: &'ast VisRestricted) {}
}

/// `#[cfg(test)]`?
fn is_test(attribute: &Attribute) -> bool {
    attribute.path().is_ident("cfg") && attribute.parse_args::<syn::Path>().is_ok_and(|path| path.is_ident("test"))
}

/// The paths and single names among a macro's tokens, which need not be Rust.
fn paths(call: &Macro) -> Vec<Names> {
    let mut found = Vec::new();
    paths_from(TokenBuffer::new2(call.tokens.clone()).begin(), &mut found);
    found
}

fn paths_from(mut cursor: Cursor<'_>, found: &mut Vec<Names>) {
    // The two tokens before: after `.` stands a field or a method, after `::` the end of a path that began
    // with a type.
    let mut before = [' '; 2];
    while !cursor.eof() {
        if let Some((inside, _, _, after)) = cursor.any_group() {
            paths_from(inside, found);
            (cursor, before) = (after, [' '; 2]);
        } else if let Some((name, mut after)) = cursor.ident() {
            let mut path = vec![name.to_string()];
            while let Some((name, further)) = colons(after).and_then(Cursor::ident) {
                path.push(name.to_string());
                after = further;
            }
            if before[1] != '.' && before != [':', ':'] {
                found.push(path);
            }
            (cursor, before) = (after, [' '; 2]);
        } else if let Some((punct, after)) = cursor.punct() {
            (cursor, before) = (after, [before[1], punct.as_char()]);
        } else if let Some((_, after)) = cursor.token_tree() {
            (cursor, before) = (after, [' '; 2]);
        }
    }
}

/// What follows `::`.
fn colons(cursor: Cursor<'_>) -> Option<Cursor<'_>> {
    let (first, after) = cursor.punct()?;
    let (second, after) = after.punct()?;
    (first.as_char() == ':' && second.as_char() == ':').then_some(after)
}

/// Each circle with its files and, for each arrow, one item that makes it.
fn circles(graph: &Graph) -> Vec<String> {
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        graph.keys().map(|file| (file.as_str(), reachable(graph, file))).collect();
    let mut done = BTreeSet::new();
    let mut found = Vec::new();
    for (&file, beyond) in &reached {
        if !beyond.contains(file) || done.contains(file) {
            continue;
        }
        let circle: BTreeSet<&str> =
            beyond.iter().copied().filter(|other| reached.get(other).is_some_and(|back| back.contains(file))).collect();
        let mut text = String::new();
        for from in &circle {
            for (to, items) in graph[*from].iter().filter(|(to, _)| circle.contains(to.as_str())) {
                let item = items.first().map_or("", String::as_str);
                text.push_str(&format!("    {from} -> {to} by {item}\n"));
            }
        }
        found.push(text);
        done.extend(circle);
    }
    found
}

/// Every file to which arrows lead from a file.
fn reachable<'g>(graph: &'g Graph, from: &str) -> BTreeSet<&'g str> {
    let mut reached = BTreeSet::new();
    let mut open = vec![from];
    while let Some(file) = open.pop() {
        for other in graph.get(file).into_iter().flat_map(BTreeMap::keys) {
            if reached.insert(other.as_str()) {
                open.push(other);
            }
        }
    }
    reached
}
