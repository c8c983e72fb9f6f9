//! What surrounds the map: title, frame and coordinates, legend, locator, scale, north, attribution.

use super::Picture;
use super::legend::Legend;
use super::lettering::{shortened, wrapped};
use super::measures::{draw_coordinates, draw_scale, grouped};
use super::search_areas::summary;
use super::style::{BLUE, FONTS, FRAME, INK, LETTER_PX, NODE, QUIET_INK, SMALL_LETTER_PX};
use super::svg::{Document, PathData, Px, Spot};
use super::view::{BESIDE_MAP_PX, View};
use crate::geo::{Bounds, Point};

/// Height of the letters of the title, in pixels.
const TITLE_PX: f64 = 15.0;
/// Above the title, and from the top of one line to that of the next, in pixels.
const ABOVE_TITLE_PX: f64 = 8.0;
const TITLE_LINE_PX: f64 = TITLE_PX + 7.0;
const SUMMARY_LINE_PX: f64 = LETTER_PX + 5.0;
/// Room for scale, north and locator, to the right of the legend, in pixels.
const CORNER_PX: f64 = 150.0;
/// The locator is at most this large, in pixels.
const LOCATOR_PX: f64 = 96.0;
/// The map shows nearly everything, and needs no locator, from this share of the network on.
const NEARLY_ALL: f64 = 0.8;

/// The figure's layout, from top to bottom.
pub(super) struct Sheet<'a> {
    picture: &'a Picture<'a>,
    view: &'a View,
    title: &'a str,
    summary: Vec<String>,
    attribution: Vec<String>,
    width_px: f64,
    height_px: f64,
    map: Spot,
    below_map: Spot,
    legend_width_px: f64,
    has_locator: bool,
}

impl<'a> Sheet<'a> {
    pub(super) fn new(picture: &'a Picture<'a>, view: &'a View, legend: &Legend) -> Self {
        let topology = picture.topology;
        let title = picture.options.title.as_deref().unwrap_or(topology.name());
        let summary = match (&picture.flight, &picture.recomposition) {
            (Some(flown), _) => wrapped(&flown.summary, LETTER_PX, view.width_px),
            (None, Some(drawn)) => wrapped(&summary(drawn.answer), LETTER_PX, view.width_px),
            (None, None) => Vec::new(),
        };
        let title_px = if title.is_empty() { 0.0 } else { TITLE_LINE_PX };
        let top_px = ABOVE_TITLE_PX + title_px + summary.len() as f64 * SUMMARY_LINE_PX;
        let map = Spot::new(BESIDE_MAP_PX, top_px);
        let below_map = map.moved(0.0, view.height_px + 24.0);
        let legend_width_px = view.width_px - CORNER_PX;
        let has_locator = needs_locator(topology.bounds(), view.bounds);
        let corner_height_px = if has_locator { 44.0 + LOCATOR_PX } else { 40.0 };
        let block_px = legend.height_px(legend_width_px).max(corner_height_px);
        let attribution = wrapped(topology.attribution(), SMALL_LETTER_PX, view.width_px);
        let small_print_px = attribution.len() as f64 * (SMALL_LETTER_PX + 3.0);
        Self {
            picture,
            view,
            title,
            summary,
            attribution,
            width_px: view.width_px + 2.0 * BESIDE_MAP_PX,
            height_px: (below_map.y + block_px + 10.0 + small_print_px).ceil(),
            map,
            below_map,
            legend_width_px,
            has_locator,
        }
    }

    /// Puts the map, drawn already, into its frame and everything else around it.
    pub(super) fn draw(&self, map: &str, legend: &Legend) -> String {
        let topology = self.picture.topology;
        let mut document = Document::default();
        let (width, height) = (Px(self.width_px), Px(self.height_px));
        document.open(
            "svg",
            format_args!(
                "xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" role=\"img\" font-family=\"{FONTS}\" font-size=\"{LETTER_PX}\" fill=\"{INK}\""
            ),
        );
        document.words("title", format_args!(""), self.name());
        document.words("desc", format_args!(""), &self.description());
        define_hatching(&mut document);
        document.leaf(
            "rect",
            format_args!("width=\"{width}\" height=\"{height}\" fill=\"#ffffff\""),
        );
        self.draw_title(&mut document);
        self.draw_map(map, &mut document);
        draw_coordinates(topology.frame(), self.view, self.map, &mut document);
        legend.draw(self.below_map, self.legend_width_px, &mut document);
        self.draw_corner(&mut document);
        self.draw_attribution(&mut document);
        document.finish()
    }

    fn name(&self) -> &str {
        match self.title.is_empty() {
            true => self.picture.topology.name(),
            false => self.title,
        }
    }

    fn description(&self) -> String {
        let topology = self.picture.topology;
        let nodes = grouped(topology.node_count() as f64);
        let segments = grouped(topology.segment_count() as f64);
        let mut text = format!("Skyway network with {nodes} nodes and {segments} segments.");
        let zones = self.picture.zones.len();
        if zones > 0 {
            text.push_str(&format!(" No-fly zones: {zones}."));
        }
        if !self.summary.is_empty() {
            text.push_str(&format!(" {}.", self.summary.join(" ")));
        }
        text
    }

    fn draw_title(&self, document: &mut Document) {
        let x = Px(self.map.x);
        let mut top = ABOVE_TITLE_PX;
        if !self.title.is_empty() {
            let title = shortened(self.title, TITLE_PX * 1.05, self.view.width_px);
            let y = Px(top + TITLE_PX - 2.0);
            document.words(
                "text",
                format_args!("x=\"{x}\" y=\"{y}\" font-size=\"{TITLE_PX}\" font-weight=\"bold\""),
                &title,
            );
            top += TITLE_LINE_PX;
        }
        for line in &self.summary {
            let y = Px(top + LETTER_PX - 3.0);
            document.words(
                "text",
                format_args!("x=\"{x}\" y=\"{y}\" fill=\"{QUIET_INK}\""),
                line,
            );
            top += SUMMARY_LINE_PX;
        }
    }

    /// The map is an image of its own inside the figure, which cuts off what lies outside.
    fn draw_map(&self, map: &str, document: &mut Document) {
        let (x, y) = (Px(self.map.x), Px(self.map.y));
        let (width, height) = (Px(self.view.width_px), Px(self.view.height_px));
        document.open(
            "svg",
            format_args!(
                "x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" overflow=\"hidden\""
            ),
        );
        document.nest(map);
        document.close();
        document.leaf(
            "rect",
            format_args!(
                "x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"{FRAME}\" stroke-width=\"0.8\""
            ),
        );
    }

    /// Scale, north and locator, to the right of the legend.
    fn draw_corner(&self, document: &mut Document) {
        let right = self.map.x + self.view.width_px;
        let top = self.below_map.y + 4.0;
        let mut scale_right = right;
        if self.picture.topology.frame().is_geographic() {
            draw_north(Spot::new(right - 7.0, top), document);
            scale_right -= 26.0;
        }
        draw_scale(Spot::new(scale_right, top + 22.0), self.view, document);
        if self.has_locator {
            self.draw_locator(Spot::new(right, top + 40.0), document);
        }
    }

    /// The whole network, small, with a box around what the map shows; its upper right corner is at a spot.
    fn draw_locator(&self, corner: Spot, document: &mut Document) {
        let topology = self.picture.topology;
        let network = topology.bounds();
        let scale = LOCATOR_PX / network.longer_side_m();
        let (width_px, height_px) = (network.width_m() * scale, network.height_m() * scale);
        let left = corner.x - width_px - 3.0;
        let place = |point: Point| {
            let (east, south) = (point.x - network.min.x, network.max.y - point.y);
            Spot::new(left + east * scale, corner.y + south * scale)
        };
        let mut nodes = PathData::default();
        for &position in topology.positions() {
            nodes.dot(place(position));
        }
        document.path(
            &nodes,
            format_args!("stroke=\"{NODE}\" stroke-width=\"1.1\" stroke-linecap=\"round\""),
        );
        let frame = Bounds {
            min: network.min,
            max: network.max,
        };
        let shown = [self.view.bounds.min, self.view.bounds.max].map(|corner| {
            place(Point::new(
                corner.x.clamp(frame.min.x, frame.max.x),
                corner.y.clamp(frame.min.y, frame.max.y),
            ))
        });
        let around = |low: Spot, high: Spot, grown: f64| {
            let (low, high) = (low.moved(-grown, grown), high.moved(grown, -grown));
            PathData::through(
                [
                    low,
                    Spot::new(high.x, low.y),
                    high,
                    Spot::new(low.x, high.y),
                ],
                true,
            )
        };
        let low = Spot::new(left, corner.y + height_px);
        document.path(
            &around(low, Spot::new(left + width_px, corner.y), 3.0),
            format_args!("fill=\"none\" stroke=\"{FRAME}\" stroke-width=\"0.6\""),
        );
        document.path(
            &around(shown[0], shown[1], 1.0),
            format_args!(
                "fill=\"{BLUE}\" fill-opacity=\"0.12\" stroke=\"{BLUE}\" stroke-width=\"1.2\""
            ),
        );
    }

    fn draw_attribution(&self, document: &mut Document) {
        let line_px = SMALL_LETTER_PX + 3.0;
        for (index, line) in self.attribution.iter().rev().enumerate() {
            let x = Px(self.map.x);
            let y = Px(self.height_px - 6.0 - index as f64 * line_px);
            document.words(
                "text",
                format_args!(
                    "x=\"{x}\" y=\"{y}\" font-size=\"{SMALL_LETTER_PX}\" fill=\"{QUIET_INK}\""
                ),
                line,
            );
        }
    }
}

/// The pattern of no-fly zones.
fn define_hatching(document: &mut Document) {
    document.open("defs", format_args!(""));
    document.open(
        "pattern",
        format_args!(
            "id=\"no-fly\" width=\"7\" height=\"7\" patternUnits=\"userSpaceOnUse\" patternTransform=\"rotate(45)\""
        ),
    );
    document.leaf(
        "rect",
        format_args!("width=\"7\" height=\"7\" fill=\"#cc79a7\" fill-opacity=\"0.16\""),
    );
    document.leaf(
        "path",
        format_args!("d=\"M0 0v7\" stroke=\"#a8487c\" stroke-width=\"2\" stroke-opacity=\"0.7\""),
    );
    document.close();
    document.close();
}

fn draw_north(top: Spot, document: &mut Document) {
    let tip = top.moved(0.0, 11.0);
    let left = [tip, tip.moved(-5.0, 16.0), tip.moved(0.0, 12.0)];
    let right = [tip, tip.moved(5.0, 16.0), tip.moved(0.0, 12.0)];
    let edge = format!("stroke=\"{INK}\" stroke-width=\"0.8\" stroke-linejoin=\"round\"");
    document.path(
        &PathData::through(left, true),
        format_args!("fill=\"{INK}\" {edge}"),
    );
    document.path(
        &PathData::through(right, true),
        format_args!("fill=\"#ffffff\" {edge}"),
    );
    let (x, y) = (Px(top.x), Px(top.y + 8.0));
    document.words(
        "text",
        format_args!("x=\"{x}\" y=\"{y}\" text-anchor=\"middle\" font-weight=\"bold\""),
        "N",
    );
}

fn needs_locator(network: Bounds, shown: Bounds) -> bool {
    let overlap = |low: f64, high: f64, shown_low: f64, shown_high: f64| {
        let size = high - low;
        if size > 0.0 {
            ((high.min(shown_high) - low.max(shown_low)) / size).max(0.0)
        } else {
            1.0
        }
    };
    let across = overlap(network.min.x, network.max.x, shown.min.x, shown.max.x);
    let along = overlap(network.min.y, network.max.y, shown.min.y, shown.max.y);
    network.longer_side_m() > 0.0 && across * along < NEARLY_ALL
}
