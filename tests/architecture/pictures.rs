//! The screenshots of the documents show what the pages say: `.ci/run pictures` writes the texts that can be
//! read in each into docs/report-pictures.json, and the pages that the commands write now have these texts.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use serde::Deserialize;

use crate::commands::run;
use crate::{root, text};

/// A screenshot in docs/report-pictures.json.
#[derive(Deserialize)]
struct Picture {
    /// The folder of the page.
    page: String,
    /// What writes the page, in the folder of the tutorial; or the tutorial itself.
    command: String,
    texts: Vec<String>,
}

/// The texts of a page outside its scripts and styles.
fn texts(page: &str) -> BTreeSet<String> {
    let mut texts = BTreeSet::new();
    let mut rest = page;
    while let Some((before, tag)) = rest.split_once('<') {
        let plain = [("&lt;", "<"), ("&gt;", ">"), ("&#34;", "\""), ("&#39;", "'"), ("&amp;", "&")]
            .iter()
            .fold(before.to_owned(), |plain, (entity, sign)| plain.replace(entity, sign));
        texts.insert(plain.split_whitespace().collect::<Vec<_>>().join(" "));
        let code = ["script", "style"].into_iter().find(|name| tag.starts_with(name));
        let after = code.and_then(|name| tag.split_once(&format!("</{name}"))).map_or(tag, |(_, after)| after);
        rest = after.split_once('>').map_or("", |(_, after)| after);
    }
    texts
}

/// In `folder` the commands of docs/tutorial.md have been run.
pub(crate) fn pictures_show_what_the_pages_say(folder: &Path) {
    let pictures: BTreeMap<String, Picture> =
        serde_json::from_str(&text("docs/report-pictures.json")).expect("what the pictures show");
    let screenshots: BTreeSet<String> = fs::read_dir(root().join("docs"))
        .expect("documents")
        .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".webp"))
        .collect();
    assert_eq!(pictures.keys().cloned().collect::<BTreeSet<_>>(), screenshots, "pictures, and what they show");
    for (name, picture) in pictures {
        let page = folder.join(&picture.page).join("report.html");
        if !page.is_file() {
            run(&picture.command, folder).expect("a command of simulated data");
        }
        let said = texts(&fs::read_to_string(&page).expect("a page"));
        assert!(!picture.texts.is_empty(), "{name} shows nothing");
        for shown in picture.texts {
            assert!(said.contains(&shown), "docs/{name} shows what its page does not say (.ci/run pictures): {shown}");
        }
    }
}

#[test]
fn texts_of_a_page_are_read_without_its_code() {
    let page = "<p>a <b>b&amp;lt;</b>\n c&#39;s  d</p><script>x < 1</script><i>e</i>";
    let expected = ["", "a", "b&lt;", "c's d", "e"].map(str::to_owned);
    assert_eq!(texts(page), BTreeSet::from(expected));
}
