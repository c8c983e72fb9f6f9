//! The page and its plots: complete, well-formed, escaped, and in need of nothing from outside.

use super::example::{HOSTILE, run};
use super::plot::classes;
use super::{PlotError, html, plot};
use crate::evaluate::record::{Point, Run, Scale};
use roxmltree::Document;

fn plots(run: &Run) -> Vec<(String, String)> {
    let pictures = run.figures.iter().map(|figure| {
        let svg = plot(figure).expect("the example can be drawn");
        (figure.slug.clone(), svg)
    });
    pictures.collect()
}

fn page(run: &Run) -> String {
    html(run, &plots(run))
}

/// Where elements with some attribute stand, below and to the right of the origin.
fn numbers<'a>(
    picture: &'a Document<'_>,
    element: &'a str,
    name: &'a str,
) -> impl Iterator<Item = f64> + 'a {
    let elements = picture
        .descendants()
        .filter(move |node| node.has_tag_name(element));
    elements.filter_map(move |node| node.attribute(name)?.parse().ok())
}

#[test]
fn plots_are_well_formed_and_stay_within_their_borders() {
    for (slug, svg) in plots(&run()) {
        let picture =
            Document::parse(&svg).unwrap_or_else(|problem| panic!("{slug}: {problem}\n{svg}"));
        let root = picture.root_element();
        let view = root.attribute("viewBox").unwrap_or_default();
        let size: Vec<f64> = view
            .split(' ')
            .filter_map(|side| side.parse().ok())
            .collect();
        let [_, _, width, height] = size[..] else {
            panic!("{slug}: viewBox {view}")
        };
        assert!(
            numbers(&picture, "text", "x").all(|x| (0.0..=width).contains(&x)),
            "{slug}"
        );
        assert!(
            numbers(&picture, "text", "y").all(|y| (0.0..=height).contains(&y)),
            "{slug}"
        );
        let kinds: Vec<&str> = root
            .children()
            .map(|child| child.tag_name().name())
            .collect();
        assert_eq!(kinds[..2], ["title", "desc"], "{slug}");
    }
}

#[test]
fn every_point_of_a_figure_is_drawn_once() {
    for figure in run().figures {
        let svg = plot(&figure).expect("the example can be drawn");
        let picture = Document::parse(&svg).expect("well-formed");
        let tips = picture.descendants().filter(|node| {
            node.has_tag_name("title")
                && node
                    .parent_element()
                    .is_some_and(|it| it.has_tag_name("path"))
        });
        let points: usize = figure.series.iter().map(|series| series.points.len()).sum();
        assert_eq!(tips.count(), points, "{}", figure.slug);
    }
}

#[test]
fn what_has_no_place_is_refused() {
    let run = run();
    let with_point = |change: fn(&mut Point)| {
        let mut figure = run.figures[0].clone();
        change(&mut figure.series[2].points[1]);
        plot(&figure)
    };
    for change in [
        (|point| point.y = 0.0) as fn(&mut Point),
        |point| point.y = f64::NAN,
        |point| point.low = f64::NEG_INFINITY,
        |point| point.x = -1.0,
    ] {
        let refused = with_point(change);
        assert!(
            matches!(&refused, Err(PlotError::NoPlace { slug, series, .. }) if slug == "time-by-size" && series == "two-phased"),
            "{refused:?}"
        );
    }
    let mut empty = run.figures[0].clone();
    empty.series.clear();
    assert!(matches!(plot(&empty), Err(PlotError::Empty { .. })));
    let mut upright = run.figures[2].clone();
    upright.y.scale = Scale::Categories(Vec::new());
    assert!(matches!(
        plot(&upright),
        Err(PlotError::CategoriesUpright { .. })
    ));
    let mut beyond = run.figures[2].clone();
    beyond.series[1].points[0].x = 3.0;
    assert!(matches!(plot(&beyond), Err(PlotError::NoPlace { .. })));
}

#[test]
fn the_page_shows_every_claim_reading_figure_and_note() {
    let run = run();
    let page = page(&run);
    for claim in &run.claims {
        assert!(
            page.contains(&format!("id=\"claim-{}\"", claim.id)),
            "{}",
            claim.id
        );
        for reading in [&claim.joint, &claim.closest, &claim.exact]
            .into_iter()
            .flatten()
        {
            assert!(page.contains(&reading.name), "{}", reading.name);
        }
    }
    for figure in &run.figures {
        assert!(
            page.contains(&format!("id=\"figure-{}\"", figure.slug)),
            "{}",
            figure.slug
        );
    }
    for note in &run.notes {
        assert!(page.contains(&note.title), "{}", note.title);
    }
    let expected = [
        "[60.0, 62.7]</span>",
        "2 of 36",
        "random: 3 of 20, no difference on 8",
        "61.2× <span",
        "\u{2212}3.50\u{202f}%",
        ">9\u{202f}%</td>",
        "✓ reproduced",
        "It drew 2000 failures on 20 networks of 1000 to 5000 nodes; 12 of them leave no way",
        "19\u{202f}880 distances",
        "Times are no result.",
        "A short run.",
    ];
    for text in expected {
        assert!(page.contains(text), "missing: {text}");
    }
}

#[test]
fn the_page_escapes_words_and_asks_for_nothing_from_outside() {
    let page = page(&run());
    assert!(page.contains("&lt;script&gt;alert"));
    assert!(!page.contains("<script"), "a name became an element");
    assert!(!page.contains(HOSTILE));
    let addresses = page.matches("http://").count() + page.matches("https://").count();
    let namespaces = page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count();
    assert_eq!(addresses, namespaces);
    for outside in ["url(", "@import", "src=", "<link", "<object", "<iframe"] {
        assert!(!page.contains(outside), "{outside}");
    }
}

#[test]
fn ids_are_unique_and_links_have_their_goals() {
    let page = page(&run());
    let values = |attribute: &str| {
        let parts = page.split(attribute).skip(1);
        let mut values: Vec<String> = parts
            .filter_map(|rest| rest.split('"').next())
            .map(str::to_owned)
            .collect();
        values.sort();
        values
    };
    let ids = values(" id=\"");
    let mut unique = ids.clone();
    unique.dedup();
    assert_eq!(ids, unique);
    for goal in values("href=\"#") {
        assert!(ids.contains(&goal), "#{goal}");
    }
}

#[test]
fn a_run_without_anything_is_a_page_too() {
    let empty = Run {
        figures: Vec::new(),
        claims: Vec::new(),
        sentences: Vec::new(),
        notes: Vec::new(),
        ..run()
    };
    let page = html(&empty, &[]);
    assert!(!page.contains("id=\"claims\"") && page.contains("id=\"provenance\""));
    // A figure whose plot is missing keeps its values.
    let page = html(&run(), &[]);
    assert!(page.contains("no picture") && page.contains("id=\"figure-sydney-time\""));
}

#[test]
fn the_dark_page_has_a_colour_for_every_series() {
    let style = include_str!("style.css");
    for class in classes() {
        assert!(
            style.contains(&format!(".plot .{class} {{ color: ")),
            "{class}"
        );
    }
}

#[test]
fn the_same_run_gives_the_same_page() {
    assert_eq!(page(&run()), page(&run()));
}
