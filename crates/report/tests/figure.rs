//! What a figure's SVG and PNG contain, and what is refused. Rejected when tried: an inverted y axis, one bar
//! left out, NaN let through, a rasteriser without the font.

#[cfg(feature = "png")]
use report::Colour;
use report::{Axis, Figure, Location, Marks, Panel, Range, ReportError, Scale, Series};
#[cfg(feature = "png")]
use resvg::tiny_skia::Pixmap;
use roxmltree::{Document, Node};

fn fixed(low: f64, high: f64) -> Axis {
    Axis::new("length", "m").range(Range::Fixed { low, high })
}

fn bars(edges: &[f64], heights: &[f64]) -> Marks {
    Marks::Bars { edges: edges.to_vec(), heights: heights.to_vec() }
}

/// One of each kind of mark.
fn everything() -> Figure {
    let x = vec![0.0, 4.0, 10.0];
    let points = vec![(2.0, 1.0), (4.0, 3.0), (8.0, -1.0)];
    let panel = Panel::new(
        "all & <kinds>",
        fixed(0.0, 10.0),
        Axis::new("error", "mm").range(Range::Fixed { low: -5.0, high: 5.0 }),
    )
    .series(Series::new("band", Marks::Band { x, low: vec![-2.0; 3], high: vec![2.0; 3] }))
    .series(Series::new("bars", bars(&[0.0, 1.0, 3.0], &[2.0, -1.0])))
    .series(Series::new("points", Marks::Points { points, y_error: Some(vec![0.5; 3]) }))
    .series(Series::line("line", [(0.0, 4.0), (10.0, -4.0)]))
    .series(Series::new("zero", Marks::HorizontalLine { y: 0.0 }))
    .series(Series::new("start", Marks::VerticalLine { x: 5.0 }));
    Figure::new("One of each").caption("scenario s.toml, seed 7").panel(panel)
}

fn with_class<'a>(document: &'a Document<'a>, class: &str) -> Vec<Node<'a, 'a>> {
    let in_legend = |node: &Node| node.ancestors().any(|parent| parent.attribute("class") == Some("legend"));
    document.descendants().filter(|node| node.attribute("class") == Some(class) && !in_legend(node)).collect()
}

fn attribute(node: &Node, name: &str) -> f64 {
    node.attribute(name).and_then(|text| text.parse().ok()).unwrap_or_else(|| panic!("{name} of {node:?}"))
}

#[test]
fn golden_structure_of_one_of_each() {
    let svg = everything().to_svg().expect("drawable");
    let document = Document::parse(&svg).expect("XML");
    for (class, number) in [
        ("panel", 1),
        ("series", 6),
        ("band", 1),
        ("bar", 2),
        ("point", 3),
        ("error", 3),
        ("cap", 6),
        ("line", 1),
        ("reference", 2),
    ] {
        assert_eq!(with_class(&document, class).len(), number, "{class}");
    }
    let texts: Vec<&str> = document
        .descendants()
        .filter(|node| node.has_tag_name("text"))
        .filter_map(|node| node.text().map(str::trim))
        .collect();
    let said =
        ["One of each", "all & <kinds>", "length (m)", "error (mm)", "band", "bars", "points", "line", "zero", "start"];
    for text in said.into_iter().chain(["scenario s.toml, seed 7", "−4", "10"]) {
        assert_eq!(texts.iter().filter(|&&found| found == text).count(), 1, "{text}");
    }
    assert!(svg.contains("sans-serif"), "a browser without DejaVu Sans has something to fall back to");
}

#[test]
fn a_known_point_lands_at_its_pixel() {
    let svg =
        everything().panel(Panel::new("", fixed(0.0, 1.0), fixed(0.0, 1.0)).series(Series::points("p", [(0.5, 0.25)])));
    let svg = svg.to_svg().expect("drawable");
    let document = Document::parse(&svg).expect("XML");
    let frame = with_class(&document, "frame")[1];
    let [x, y, w, h] = ["x", "y", "width", "height"].map(|name| attribute(&frame, name));
    let panels = with_class(&document, "panel");
    let point =
        panels[1].descendants().find(|node| node.attribute("class") == Some("point")).expect("there is a point");
    // The fifth name of the figure has a triangle on its tip: its path begins there, 1.35 × 3.8 px below the
    // point.
    let d = point.attribute("d").expect("a path");
    let corner: Vec<f64> = d[1..].split(['L', ' ']).filter_map(|number| number.parse().ok()).take(2).collect();
    assert!((corner[0] - (x + 0.5 * w)).abs() < 0.02, "{d} in {frame:?}");
    assert!((corner[1] - 1.35 * 3.8 - (y + 0.75 * h)).abs() < 0.02, "{d} in {frame:?}");
}

#[test]
fn a_logarithmic_axis_puts_the_geometric_mean_in_the_middle() {
    let axis = fixed(1.0, 100.0).scale(Scale::Log);
    let panel = Panel::new("", axis.clone(), axis).series(Series::points("p", [(10.0, 10.0)]));
    let svg = Figure::new("log").panel(panel).to_svg().expect("drawable");
    let document = Document::parse(&svg).expect("XML");
    let (frame, point) = (with_class(&document, "frame")[0], with_class(&document, "point")[0]);
    let middle = |at: &str, length: &str| attribute(&frame, at) + attribute(&frame, length) / 2.0;
    assert!((attribute(&point, "cx") - middle("x", "width")).abs() < 0.02);
    assert!((attribute(&point, "cy") - middle("y", "height")).abs() < 0.02);
}

#[test]
fn with_equal_aspect_a_metre_is_a_metre() {
    let corners = [(0.0, 0.0), (4.0, 0.0), (4.0, 9.0)];
    let auto = || Axis::new("x", "m");
    for (x, y) in [(auto(), auto()), (fixed(-1.0, 5.0), fixed(-1.0, 10.0)), (fixed(-20.0, 20.0), fixed(-1.0, 10.0))] {
        let panel = Panel::new("", x, y).series(Series::points("p", corners)).equal_aspect();
        let svg = Figure::new("plane").panel(panel).to_svg().expect("drawable");
        let document = Document::parse(&svg).expect("XML");
        let at = |k: usize| {
            let point = with_class(&document, "point")[k];
            (attribute(&point, "cx"), attribute(&point, "cy"))
        };
        let (across, up) = ((at(1).0 - at(0).0) / 4.0, (at(1).1 - at(2).1) / 9.0);
        // Coordinates are rounded to 0.01 px and lengths are at least 4 m.
        assert!((across - up).abs() < 0.01 && up > 5.0, "{across} {up}");
    }
}

#[test]
fn bars_stand_on_zero_and_a_legend_covers_no_mark() {
    let heights: Vec<f64> = (0..20).map(|k| 50.0 + f64::from(k % 2)).collect();
    let edges: Vec<f64> = (0..=20).map(f64::from).collect();
    let panel = Panel::new("", Axis::new("x", "m"), Axis::dimensionless("trials"))
        .series(Series::new("n", bars(&edges, &heights)));
    let svg = Figure::new("bars").panel(panel).to_svg().expect("drawable");
    let document = Document::parse(&svg).expect("XML");
    let frame = with_class(&document, "frame")[0];
    let bottom = attribute(&frame, "y") + attribute(&frame, "height");
    for bar in with_class(&document, "bar") {
        assert!((attribute(&bar, "y") + attribute(&bar, "height") - bottom).abs() < 0.03, "{bar:?}");
    }
    let legend = document.descendants().find(|node| node.attribute("class") == Some("legend")).expect("a legend");
    let text = legend.descendants().find(|node| node.has_tag_name("text")).expect("an entry");
    assert!(attribute(&text, "y") > bottom, "the frame is full of bars, so the legend is below");
}

#[test]
fn a_name_keeps_its_colour_in_all_panels_and_points_beyond_the_axes_are_counted() {
    let line = |name: &str| Series::line(name, [(0.0, 0.0), (1.0, 1.0)]);
    let panel = |first: &str, second: &str| {
        Panel::new("", fixed(0.0, 1.0), fixed(0.0, 1.0)).series(line(first)).series(line(second))
    };
    let outside = Series::points("far", [(0.5, 0.5), (2.0, 0.5), (0.5, -1.0)]);
    let svg =
        Figure::new("two").panel(panel("a", "b")).panel(panel("b", "a").series(outside)).to_svg().expect("drawable");
    let document = Document::parse(&svg).expect("XML");
    let strokes: Vec<_> = with_class(&document, "line").iter().map(|line| line.attribute("stroke")).collect();
    assert!(strokes[0] == strokes[3] && strokes[1] == strokes[2] && strokes[0] != strokes[1], "{strokes:?}");
    assert!(svg.contains("far (2 beyond the axes)") && with_class(&document, "point").len() == 1);
}

#[test]
fn equal_figures_have_equal_bytes() {
    assert_eq!(everything().to_svg().expect("drawable"), everything().to_svg().expect("drawable"));
    #[cfg(feature = "png")]
    assert_eq!(everything().to_png(1.0).expect("drawable"), everything().to_png(1.0).expect("drawable"));
}

#[cfg(feature = "png")]
#[test]
fn the_png_has_the_svg_s_size_the_colours_of_all_series_and_visible_text() {
    let svg = everything().to_svg().expect("drawable");
    let document = Document::parse(&svg).expect("XML");
    let picture = Pixmap::decode_png(&everything().to_png(2.0).expect("drawable")).expect("a PNG");
    assert_eq!(picture.width(), 1800);
    assert_eq!(f64::from(picture.height()), 2.0 * attribute(&document.root_element(), "height"));
    let number_of = |hex: &str| {
        let channel = |at: usize| u8::from_str_radix(&hex[at..at + 2], 16).expect("a colour");
        let wanted = [channel(1), channel(3), channel(5), 255];
        picture.data().chunks(4).filter(|pixel| *pixel == wanted).count()
    };
    // The four names get the first four colours; the edges of the band are translucent, so its legend and
    // area are not looked for here.
    for colour in &Colour::IN_TURN[1..4] {
        assert!(number_of(colour.hex()) > 100, "{colour:?}");
    }
    // Above the panel there is nothing but the title, so ink there is text.
    let top = 2 * 45 * 1800 * 4;
    let ink = picture.data()[..top].chunks(4).filter(|pixel| *pixel == [0x22, 0x22, 0x22, 255]).count();
    assert!(ink > 300, "{ink} pixels of the title; without a font there are none");
}

#[test]
fn what_cannot_be_drawn_is_refused_by_name() {
    let of =
        |series: Series, x: Axis, y: Axis| Figure::new("F").panel(Panel::new("P", x, y).series(series)).to_svg().err();
    let auto = || Axis::new("length", "m");
    let refused = |marks: Marks| of(Series::new("S", marks), auto(), auto()).expect("refused").to_string();
    let location = "figure \"F\", panel \"P\", series \"S\": ";
    let points = |points: &[(f64, f64)], y_error: Option<&[f64]>| Marks::Points {
        points: points.to_vec(),
        y_error: y_error.map(<[f64]>::to_vec),
    };
    let band =
        |x: &[f64], low: &[f64], high: &[f64]| Marks::Band { x: x.to_vec(), low: low.to_vec(), high: high.to_vec() };
    let cases = [
        (points(&[], None), "0 points; at least 1 are needed"),
        (Marks::Line { points: vec![(0.0, 0.0)] }, "1 points; at least 2 are needed"),
        (points(&[(0.0, 1.0), (1.0, f64::NAN)], None), "y[1] = NaN cannot be drawn"),
        (points(&[(f64::INFINITY, 1.0)], None), "x[0] = inf cannot be drawn"),
        (points(&[(0.0, 1.0)], Some(&[0.1, 0.2])), "2 y_error; 1 are expected"),
        (points(&[(0.0, 1.0)], Some(&[-0.1])), "y_error[0] = -0.1 is negative"),
        (points(&[(0.0, 1.0)], Some(&[f64::NAN])), "y_error[0] = NaN cannot be drawn"),
        (band(&[0.0, 1.0], &[0.0], &[1.0, 1.0]), "1 low; 2 are expected"),
        (band(&[0.0, 1.0], &[0.0, 3.0], &[1.0, 1.0]), "low[1] = 3 is above high[1] = 1"),
        (band(&[1.0, 1.0], &[0.0, 0.0], &[1.0, 1.0]), "x[1] = 1 is not above 1, the one before"),
        (bars(&[0.0, 1.0], &[1.0, 2.0]), "2 edges; 3 are expected"),
        (bars(&[0.0, 2.0, 1.0], &[1.0, 2.0]), "edges[2] = 1 is not above 2, the one before"),
        (Marks::HorizontalLine { y: f64::NAN }, "y[0] = NaN cannot be drawn"),
    ];
    for (marks, reason) in cases {
        assert_eq!(refused(marks), format!("{location}{reason}"));
    }
    let log = || auto().scale(Scale::Log);
    let at = Location { figure: "F".into(), panel: "P".into(), series: "S".into() };
    let zero = of(Series::points("S", [(1.0, 1.0), (2.0, 0.0)]), auto(), log());
    assert!(matches!(zero, Some(ReportError::NotPositive { location, what: "y", index: 1, .. }) if location == at));
    for y in [log(), fixed(1.0, 2.0)] {
        let error = of(Series::new("S", bars(&[0.0, 1.0], &[1.0])), auto(), y);
        assert!(matches!(error, Some(ReportError::BarsWithoutZero { .. })), "{error:?}");
    }
    let error = of(Series::new("S", Marks::VerticalLine { x: 2.0 }), fixed(0.0, 1.0), auto());
    assert!(matches!(error, Some(ReportError::ReferenceOutside { value: 2.0, .. })), "{error:?}");
    let error = of(Series::points("two\nlines", [(0.0, 0.0)]), auto(), auto());
    assert!(matches!(error, Some(ReportError::NoGlyph { character: '\n', .. })), "{error:?}");
    let error = of(Series::points("S", [(0.0, 0.0)]), fixed(1.0, 1.0), auto());
    assert!(matches!(error, Some(ReportError::AxisRange { .. })), "{error:?}");
    let logs = Panel::new("P", log(), log()).series(Series::points("S", [(1.0, 1.0)])).equal_aspect();
    assert!(matches!(Figure::new("F").panel(logs).to_svg(), Err(ReportError::EqualAspectOnLog { .. })));
    assert!(matches!(Figure::new("F").to_svg(), Err(ReportError::NoPanels { .. })));
    let empty = Figure::new("F").panel(Panel::new("P", auto(), auto()));
    assert!(matches!(empty.to_svg(), Err(ReportError::NoSeries { .. })));
    assert!(matches!(everything().columns(0).to_svg(), Err(ReportError::Columns { columns: 0, .. })));
    #[cfg(feature = "png")]
    for scale in [0.0, f64::NAN, 1e6] {
        assert!(matches!(everything().to_png(scale), Err(ReportError::PngScale { .. })));
    }
}

#[test]
fn files_are_written_whole_and_readable() {
    let folder = tempfile::tempdir().expect("a folder");
    let inner = folder.path().join("pictures");
    let written = everything().write(&inner, "all").expect("written");
    let svg = inner.join("all.svg");
    assert!(written.contains(&svg), "{written:?}");
    assert_eq!(std::fs::read_to_string(&svg).expect("there"), everything().to_svg().expect("drawable"));
    #[cfg(feature = "png")]
    assert_eq!(std::fs::read(inner.join("all.png")).expect("there"), everything().to_png(2.0).expect("drawable"));
    assert_eq!(std::fs::read_dir(&inner).expect("a folder").count(), written.len(), "no temporary file is left");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = |path: &std::path::Path| std::fs::metadata(path).expect("there").permissions().mode() & 0o777;
        let plain = inner.join("plain");
        std::fs::write(&plain, "").expect("written");
        for path in &written {
            assert_eq!(mode(path), mode(&plain), "{}", path.display());
        }
    }
    let blocked = everything().write(&svg, "below-a-file");
    assert!(matches!(blocked, Err(ReportError::Write { .. })), "{blocked:?}");
}

/// Every place bears its name, however long: a name that is wider than its place goes on below.
#[test]
fn places_of_a_named_axis_bear_their_names() {
    let names = ["carpet_nap", "contact_patch_wheelbase_of_a_wide_robot", "slip_speed", "wear", "backlash", "bumps"];
    let points = (1..).map(f64::from).zip([0.0, 2.0, 1.0, 3.0, 1.0, 2.0]).collect();
    let panel = Panel::new("", Axis::named("if the cause is", names.map(str::to_owned)), Axis::new("error", "mm"))
        .series(Series::new("prediction", Marks::Points { points, y_error: None }));
    let svg = Figure::new("Predictions").panel(panel).to_svg().expect("drawable");
    let document = Document::parse(&svg).expect("XML");
    let texts: Vec<(String, f64, f64)> = document
        .descendants()
        .filter(|node| node.has_tag_name("text"))
        .map(|node| (node.text().unwrap_or_default().trim().to_owned(), attribute(&node, "x"), attribute(&node, "y")))
        .collect();
    let place = |text: &str| texts.iter().find(|(of, ..)| of == text).unwrap_or_else(|| panic!("{text}: {texts:?}"));
    let (first, last) = (place("carpet_nap"), place("bumps"));
    assert!(first.1 < last.1 && first.2 == last.2);
    // The long name is in pieces, one below the other, in the column of its place.
    let pieces: Vec<&(String, f64, f64)> =
        texts.iter().filter(|(text, x, _)| *x == place("wide_robot").1 && names[1].contains(&text[..])).collect();
    let whole: String = pieces.iter().map(|(text, ..)| text.as_str()).collect();
    assert_eq!(whole, names[1]);
    assert!(pieces.len() > 1 && pieces.windows(2).all(|pair| pair[0].2 < pair[1].2), "{pieces:?}");
    // The axis' own name is below all of them.
    assert!(place("if the cause is").2 > pieces[pieces.len() - 1].2 + 10.0);
}
