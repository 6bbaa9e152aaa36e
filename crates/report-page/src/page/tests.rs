//! The page as a browser gets it.

use super::*;
use crate::bars::{Bar, Bars};
use crate::chart::{Axis, Mark, Series};
use crate::content_policy::hash;
use crate::error_picture::{ModelErrors, RunErrors};
use crate::path_picture::PathRun;
use crate::report::{MadeBy, Section, Tile, Tone};
use crate::role::Role;
use crate::sketch::{Manoeuvre, Sketch};

/// What a run may be called, and a note may say.
const HOSTILE: &str = "</script><script>alert(1)</script><!-- \" onerror='x' \u{2028} <b>&amp;";

fn a_chart() -> Chart {
    let series = Series {
        name: HOSTILE.to_owned(),
        role: Role::ExtendedModel,
        mark: Mark::Points,
        values: vec![Some(1.0), Some(2.0)],
        half_widths: vec![Some(0.1), Some(0.1)],
    };
    Chart {
        title: HOSTILE.to_owned(),
        caption: HOSTILE.to_owned(),
        x: Axis::new("x", "m"),
        y: Axis::new("y", ""),
        at: vec![0.0, 1.0],
        names: vec![HOSTILE.to_owned(), "b".to_owned()],
        series: vec![series],
    }
}

fn a_report() -> Report {
    let text = || HOSTILE.to_owned();
    let mut table = Table::new(HOSTILE, &[HOSTILE, "n"]);
    table.row([Cell::id(HOSTILE), Cell::number("1")]);
    let path = PathPicture {
        title: text(),
        caption: text(),
        tracks: vec![(text(), Role::Truth)],
        runs: vec![PathRun { name: text(), tracks: vec![vec![[0.0, 0.0], [1.0, 1.0]]], marks: vec![[0.5, 0.5]] }],
    };
    let sketches = vec![
        Sketch { manoeuvre: Manoeuvre::Circle { radius_m: 0.5 }, caption: text() },
        Sketch { manoeuvre: Manoeuvre::Spin { turn_rad: 6.0 }, caption: text() },
    ];
    let section = Section::new("all", HOSTILE)
        .text(HOSTILE)
        .with(Block::Warning(text()))
        .with(Block::List(vec![text()]))
        .with(Block::Code(text(), text()))
        .with(Block::Table(table))
        .with(Block::Path(path))
        .with(Block::Errors(ErrorPicture {
            title: text(),
            caption: text(),
            models: vec![(text(), Role::Nominal)],
            runs: vec![RunErrors {
                name: text(),
                t_s: vec![0.0, 1.0],
                distance_m: vec![0.0, 1.0],
                models: vec![Some(ModelErrors { position_m: vec![0.0, 1.0], heading_rad: Vec::new() })],
            }],
        }))
        .with(Block::Charts(vec![a_chart(), a_chart()]))
        .with(Block::Sketches(sketches))
        .with(Block::Svg(text(), "<svg xmlns='http://www.w3.org/2000/svg'/>".to_owned()));
    let appendix = Section::new("more", HOSTILE).with(Block::Chart(a_chart()));
    Report {
        command: text(),
        subject: text(),
        tone: Tone::Found,
        headline: text(),
        lead: text(),
        bars: Some(Bars {
            title: text(),
            bars: vec![Bar { name: text(), role: Role::Nominal, value: 1.0, interval: Some((0.5, 2.0)), text: text() }],
            note: text(),
        }),
        tiles: vec![Tile { label: text(), value: text(), note: text(), section: "all".to_owned() }],
        sections: vec![section],
        appendix: vec![appendix],
        made_by: MadeBy { version: text(), command_line: text(), datasets: vec![text()] },
    }
}

/// The texts between the tags of a name, with the opening tags.
fn elements<'p>(page: &'p str, name: &str) -> Vec<(&'p str, &'p str)> {
    let (open, close) = (format!("<{name}"), format!("</{name}>"));
    let element = |rest: &'p str| {
        let (tag, rest) = rest.split_once('>').expect("a tag ends");
        (tag, rest.split_once(&close).expect("an element ends").0)
    };
    page.split(&open).skip(1).map(element).collect()
}

#[test]
fn nothing_that_a_user_wrote_leaves_its_place() {
    let page = a_report().render().expect("a page");
    assert!(!page.contains("<script>alert") && !page.contains("<b>"));
    assert!(!page.contains("<!-- "));
    let scripts = elements(&page, "script");
    let data: Vec<_> = scripts.iter().filter(|(tag, _)| tag.contains("application/json")).collect();
    // One path, three charts; and the scripts of the page.
    assert_eq!((data.len(), scripts.len()), (5, 5 + SCRIPTS.len()));
    // Quotes, which end attributes, are there in data alone.
    let without_data = data.iter().fold(page.clone(), |page, (_, text)| page.replace(text, ""));
    assert!(page.contains("onerror='x'") && !without_data.contains("onerror='x'"));
    for (_, text) in data {
        let value: serde_json::Value = serde_json::from_str(text).expect("JSON");
        assert!(value.to_string().contains("alert(1)"), "the text is there all the same: {value}");
    }
}

#[test]
fn the_policy_has_the_hashes_of_what_stands_in_the_page_and_allows_nothing_else() {
    let page = a_report().render().expect("a page");
    let policy = page.split_once("Content-Security-Policy\" content=\"").expect("a policy").1;
    let policy = policy.split_once('"').expect("its end").0;
    assert!(policy.starts_with("default-src 'none'; ") && !policy.contains("unsafe"), "{policy}");
    let hashed = elements(&page, "style").into_iter().chain(elements(&page, "script"));
    let hashes: Vec<String> = hashed.filter(|(tag, _)| !tag.contains("json")).map(|(_, text)| hash(text)).collect();
    assert_eq!(hashes.len(), 1 + SCRIPTS.len());
    assert!(hashes.iter().all(|hash| policy.contains(hash.as_str())), "{policy}");
    assert_eq!(policy.matches("'sha256-").count(), hashes.len());
    // The policy would refuse it, and the page would look broken.
    assert!(!page.contains(" style=") && !page.contains(" onclick="));
    let sources = page.split("src=\"").skip(1).chain(page.split("href=\"").skip(1));
    assert!(sources.clone().count() > 4);
    for source in sources {
        assert!(source.starts_with("data:") || source.starts_with('#'), "{}", &source[..40.min(source.len())]);
    }
}

#[test]
fn every_picture_has_a_title_a_description_and_its_numbers() {
    let page = a_report().render().expect("a page");
    let figures = elements(&page, "figure");
    let pictures: Vec<_> = figures.iter().filter(|(tag, _)| tag.contains("picture")).collect();
    assert_eq!(pictures.len(), 5);
    for (_, picture) in pictures {
        for part in ["<h3>", "role=\"img\"", "aria-label=\"", "<details", "<table", "<caption>"] {
            assert!(picture.contains(part), "no {part}");
        }
    }
    let drawings = elements(&page, "svg");
    assert_eq!(drawings.len(), 3);
    // The bars of the first screen are cells of a table that has their numbers.
    for (tag, drawing) in drawings.into_iter().filter(|(tag, _)| !tag.contains("aria-hidden")) {
        assert!(tag.contains("role=\"img\"") && drawing.contains("<title>") && drawing.contains("<desc>"));
    }
    assert!(elements(&page, "figure").iter().any(|(_, figure)| figure.contains("<img alt=\"")));
}

#[test]
fn a_page_that_is_too_large_is_refused_and_long_tables_say_what_they_leave_out() {
    let mut report = a_report();
    let mut long = Table::new("long", &["k"]);
    (0..300).for_each(|k| long.row([Cell::number(format!("{k}"))]));
    report.sections.push(Section::new("long", "long").with(Block::Table(long)));
    let page = report.render().expect("a page");
    assert!(page.contains("100 more rows") && page.contains(">199<") && !page.contains(">200<"));
    report.sections.push(Section::new("large", "large").text("x".repeat(MAX_BYTES)));
    assert!(matches!(report.render(), Err(PageError::TooLarge { .. })));
}
