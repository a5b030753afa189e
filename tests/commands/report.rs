//! Every page is one well-formed, self-contained, readable HTML file, whatever the numbers and
//! names in it.

use errsep::report::plot::{
    Axis, Bar, Bars, Chart, HeatMap, HeatMaps, Mark, Panels, Plot, Polar, PolarTrace, Series,
};
use errsep::report::{
    Cell, Figure, KeyFigure, Page, Provenance, Section, Standing, Table, diagnosis, reversal,
};
use proptest::prelude::*;
use scraper::{Html, Selector};

/// Text that would break out of an element, an attribute, a script or a style.
const HOSTILE: &str =
    r#"</script><script>alert("1")</script><img src=x onerror='alert(1)'>]]>&amp;"#;

fn select<'a>(html: &'a Html, css: &str) -> Vec<scraper::ElementRef<'a>> {
    html.select(&Selector::parse(css).unwrap()).collect()
}

/// What must hold of any page, returned parsed.
fn checked(page: &Page) -> Html {
    let text = page.render();
    assert_eq!(
        text,
        page.render(),
        "the same page must give the same bytes"
    );
    let html = Html::parse_document(&text);
    assert!(html.errors.is_empty(), "not well-formed: {:?}", html.errors);

    for attribute in ["src", "srcset", "action", "data", "xlink:href"] {
        assert!(select(&html, &format!("[{}]", attribute.replace(':', "\\:"))).is_empty());
    }
    for link in select(&html, "[href]") {
        let target = link.attr("href").unwrap().strip_prefix('#').unwrap();
        assert_eq!(select(&html, &format!("#{target}")).len(), 1);
    }
    for style in select(&html, "style") {
        let css = style.text().collect::<String>();
        assert!(!css.contains("url(") && !css.contains("@import"));
    }
    assert_eq!(
        select(&html, "script").len(),
        2,
        "values and our own script, nothing else"
    );
    let values = select(&html, "script#plot-values")[0]
        .text()
        .collect::<String>();
    let values: serde_json::Value = serde_json::from_str(&values).unwrap();

    assert_eq!(select(&html, "h1").len(), 1);
    assert_eq!(select(&html, "html[lang]").len(), 1);
    for table in select(&html, "table") {
        let columns = table
            .select(&Selector::parse("thead th[scope=col]").unwrap())
            .count();
        assert!(columns > 0);
        for row in table.select(&Selector::parse("tbody tr").unwrap()) {
            assert_eq!(
                row.select(&Selector::parse("th[scope=row]").unwrap())
                    .count(),
                1
            );
            assert_eq!(row.child_elements().count(), columns);
        }
    }
    for figure in select(&html, "figure") {
        let caption = figure
            .select(&Selector::parse("figcaption").unwrap())
            .next()
            .unwrap();
        assert!(!caption.text().collect::<String>().trim().is_empty());
    }
    for svg in select(&html, "svg.plot") {
        assert!(!svg.attr("aria-label").unwrap().is_empty());
        sound(&svg.html());
        if let Some(place) = svg.attr("data-values") {
            assert!(values.get(place.parse::<usize>().unwrap()).is_some());
        }
    }
    html
}

/// No attribute of a drawing holds a number that is none.
fn sound(svg: &str) {
    let fragment = Html::parse_fragment(svg);
    for element in select(&fragment, "*") {
        for (name, value) in element.value().attrs() {
            let number = matches!(
                name,
                "d" | "x" | "y" | "width" | "height" | "cx" | "cy" | "r" | "viewBox"
            );
            if number {
                assert!(
                    !value.contains("NaN") && !value.contains("inf"),
                    "{name}={value}"
                );
            }
        }
    }
}

fn page_with(plot: impl Into<Plot>) -> Page {
    Page::new("Plot", "data")
        .section(Section::new("One").figure(Figure::new("Plot", "A plot.", plot)))
}

fn axes() -> Chart {
    Chart::new(Axis::new("x", "mm"), Axis::new("y", "µm"))
}

#[test]
fn hostile_text_stays_text_everywhere() {
    let chart = Chart::new(Axis::new(HOSTILE, HOSTILE), Axis::new(HOSTILE, HOSTILE))
        .titled(HOSTILE)
        .series(
            Series::line(HOSTILE, vec![0.0, 1.0], vec![0.0, 1.0])
                .band(HOSTILE, vec![0.0; 2], vec![1.0; 2])
                .extra(HOSTILE, vec![0.0; 2]),
        )
        .horizontal(0.5, HOSTILE)
        .vertical(0.5, HOSTILE)
        .stretch(0.2, 0.4, HOSTILE)
        .annotate(0.5, 0.5, HOSTILE);
    let mut map = HeatMap::new(HOSTILE, [HOSTILE]);
    map.add(0, 1.0, 1.0);
    let page = Page::new(HOSTILE, HOSTILE)
        .summary(Standing::Bad, HOSTILE)
        .section(
            Section::new(HOSTILE)
                .paragraph(HOSTILE)
                .list([HOSTILE])
                .note(HOSTILE)
                .warning(HOSTILE)
                .verbatim(HOSTILE)
                .key_figures([KeyFigure::new(HOSTILE, 1.0, HOSTILE).meaning(HOSTILE)])
                .table(
                    Table::new(HOSTILE, [HOSTILE, HOSTILE]).row([HOSTILE.into(), HOSTILE.into()]),
                )
                .figure(Figure::new(
                    HOSTILE,
                    HOSTILE,
                    Panels::new([chart.clone(), chart.clone()]),
                ))
                .figure(Figure::new(HOSTILE, HOSTILE, chart))
                .figure(Figure::new(
                    HOSTILE,
                    HOSTILE,
                    HeatMaps::new(Axis::new(HOSTILE, HOSTILE), HOSTILE, HOSTILE, [map]),
                ))
                .figure(Figure::new(
                    HOSTILE,
                    HOSTILE,
                    Polar::new(Axis::new(HOSTILE, HOSTILE)).trace(PolarTrace::circle(
                        HOSTILE,
                        1.0,
                        (0.0, 0.0),
                    )),
                ))
                .figure(Figure::new(
                    HOSTILE,
                    HOSTILE,
                    Bars::new(Axis::new(HOSTILE, HOSTILE))
                        .bar(Bar::new(HOSTILE, 1.0).note(HOSTILE))
                        .rule(0.5, HOSTILE),
                )),
        )
        .provenance(Provenance {
            version: HOSTILE.into(),
            command: HOSTILE.into(),
            inputs: vec![(HOSTILE.into(), HOSTILE.into())],
            seed: Some(1),
            date: Some(HOSTILE.into()),
        });
    let html = checked(&page);
    assert!(select(&html, "img").is_empty());
    assert_eq!(select(&html, "h1")[0].text().collect::<String>(), HOSTILE);
}

#[test]
fn a_million_points_make_a_small_file_that_says_so() {
    let n = 1_000_000;
    let x: Vec<f64> = (0..n).map(f64::from).collect();
    let mut y: Vec<f64> = x.iter().map(|x| (x * 1e-4).sin()).collect();
    y[777_777] = 5.0;
    let page = page_with(axes().series(Series::line("reading", x, y)));
    let html = checked(&page);
    assert!(page.render().len() < 400_000);
    let caption = select(&html, "figcaption")[0].text().collect::<String>();
    assert!(caption.contains("of 1000000 points"), "{caption}");
    let values = select(&html, "script#plot-values")[0]
        .text()
        .collect::<String>();
    let values: serde_json::Value = serde_json::from_str(&values).unwrap();
    let heights = values[0]["series"][0]["y"].as_array().unwrap();
    assert!(
        heights.iter().any(|v| v == 5.0),
        "the one spike must survive"
    );
}

#[test]
fn what_is_empty_is_left_out() {
    let html = checked(&reversal::page(&reversal::View::default()));
    assert!(select(&html, "section").is_empty() && select(&html, "nav").is_empty());
    checked(&diagnosis::page(&diagnosis::View::default()));
}

#[test]
fn sorted_columns_say_so() {
    let table = Table::new("", ["name", "size"])
        .row(["a".into(), Cell::number(1.0)])
        .row(["b".into(), Cell::number(2.0)])
        .sorted_by(1, errsep::report::Order::Descending);
    let html = checked(&Page::new("t", "s").section(Section::new("One").table(table)));
    assert_eq!(select(&html, "th[aria-sort=descending]").len(), 1);
    let first = select(&html, "tbody tr th")[0].text().collect::<String>();
    assert_eq!(first, "b");
}

#[test]
fn a_plot_of_its_own_is_an_xml_file_without_variables() {
    let panels = Panels::new([
        axes()
            .titled("a < b")
            .series(Series::line("one & two", vec![0.0, 1.0], vec![0.0, 1.0])),
        axes()
            .series(Series::points("one & two", vec![0.0, 1.0], vec![0.0, 1.0]).mark(Mark::Cross)),
    ]);
    let svg = Plot::from(panels).to_svg();
    let document = roxmltree::Document::parse(&svg).unwrap();
    assert_eq!(document.root_element().tag_name().name(), "svg");
    assert!(!svg.contains("var("));
}

/// A number of any size, or none at all.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -10.0..10.0f64,
        1 => any::<f64>(),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(0.0),
    ]
}

fn curve() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    (
        prop::collection::vec(any_number(), 0..40),
        prop::collection::vec(any_number(), 0..40),
    )
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]

    #[test]
    fn no_numbers_break_a_chart(
        (x, y) in curve(), (lower, upper) in curve(), logs in any::<(bool, bool)>(),
        place in any_number(),
    ) {
        let axis = |name: &str, log: bool| {
            let axis = Axis::new(name, "");
            if log { axis.log() } else { axis }
        };
        let chart = Chart::new(axis("x", logs.0), axis("y", logs.1))
            .series(Series::line("a", x.clone(), y.clone()).band("b", lower, upper).mark(Mark::Ring))
            .series(Series::columns("c", y.clone(), x.clone(), place))
            .horizontal(place, "h")
            .vertical(place, "v")
            .stretch(place, 1.0, "s")
            .annotate(place, place, "n");
        checked(&page_with(chart.clone()));
        checked(&page_with(Panels::new([chart, axes()])));
        checked(&page_with(Chart::histogram("h", Axis::new("v", ""), &x)));
    }

    #[test]
    fn no_numbers_break_the_other_plots((x, y) in curve(), place in any_number()) {
        let mut map = HeatMap::new("map", ["a", "b"]);
        for (k, (x, y)) in x.iter().zip(&y).enumerate() {
            map.add(k % 3, *x, *y);
        }
        checked(&page_with(HeatMaps::new(Axis::new("x", "mm"), "v", "µm", [map])));
        checked(&page_with(
            Polar::new(Axis::new("r", "µm"))
                .trace(PolarTrace::new("t", x.clone(), y.clone()).mark(Mark::Dot))
                .trace(PolarTrace::circle("c", place, (place, 1.0))),
        ));
        checked(&page_with(
            Bars::new(Axis::new("b", ""))
                .bars(x.iter().zip(&y).map(|(a, b)| Bar::new("n", *a).interval(*b, place)))
                .rule(place, "r"),
        ));
    }
}
