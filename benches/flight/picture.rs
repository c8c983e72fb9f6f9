//! The flight model as a picture: watt hours per kilometre over payload, airspeed and wind.

use skyway::flight::{Airframe, Wind};
use skyway::geo::Point;
use std::fmt::Write as _;

const PANEL_WIDTH: f64 = 250.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 45.0;
const RIGHT: f64 = 15.0;
const TOP: f64 = 50.0;
const BOTTOM: f64 = 45.0;
const MOST_WH_PER_KM: f64 = 16.0;
/// The payload of the panels that do not vary it, in kilograms.
const PAYLOAD_KG: f64 = 0.5;
const POINTS: u32 = 80;

/// What is varied in a panel.
struct Panel {
    title: &'static str,
    unit: &'static str,
    from: f64,
    until: f64,
    step: f64,
    lines: Vec<Line>,
}

/// A name, a colour (Okabe and Ito's, which the colour-blind tell apart), and Wh/km, or none where it cannot be flown.
struct Line {
    name: &'static str,
    colour: &'static str,
    wh_per_km: Box<dyn Fn(f64) -> Option<f64>>,
}

fn line(
    name: &'static str,
    colour: &'static str,
    wh_per_km: impl Fn(f64) -> Option<f64> + 'static,
) -> Line {
    Line {
        name,
        colour,
        wh_per_km: Box::new(wh_per_km),
    }
}

/// By the formulas alone: neither gusts nor payload are held against a limit.
fn wh_per_km(airframe: &Airframe, payload_kg: f64, wind: Wind) -> Option<f64> {
    let east = Point::new(1.0, 0.0);
    let leg = airframe.level_leg(payload_kg, 1_000.0, east, wind, None);
    leg.ok().map(|leg| leg.energy * airframe.battery_wh)
}

fn panels() -> [Panel; 3] {
    let (default, heavier) = (Airframe::phantom3, Airframe::m100);
    let blowing = |east_mps: f64, north_mps: f64| Wind {
        east_mps,
        north_mps,
    };
    let at_speed = |frame: Airframe, airspeed_mps: f64| {
        let frame = Airframe {
            airspeed_mps,
            ..frame
        };
        wh_per_km(&frame, PAYLOAD_KG, Wind::CALM)
    };
    [
        Panel {
            title: "payload, calm",
            unit: "kg",
            from: 0.0,
            until: 1.0,
            step: 0.25,
            lines: vec![
                line("Phantom 3, 16 m/s", "#0072b2", move |payload_kg| {
                    wh_per_km(&default(), payload_kg, Wind::CALM)
                }),
                line("M100, 12 m/s", "#d55e00", move |payload_kg| {
                    let within = payload_kg <= heavier().max_payload_kg;
                    within.then(|| wh_per_km(&heavier(), payload_kg, Wind::CALM))?
                }),
            ],
        },
        Panel {
            title: "airspeed, calm, 0.5 kg",
            unit: "m/s",
            from: 4.0,
            until: 20.0,
            step: 4.0,
            lines: vec![
                line("Phantom 3", "#0072b2", move |speed_mps| {
                    at_speed(default(), speed_mps)
                }),
                line("M100", "#d55e00", move |speed_mps| {
                    at_speed(heavier(), speed_mps)
                }),
            ],
        },
        Panel {
            title: "wind, 0.5 kg",
            unit: "m/s",
            from: 0.0,
            until: 10.0,
            step: 2.0,
            lines: vec![
                line("ahead", "#d55e00", move |wind_mps| {
                    wh_per_km(&default(), PAYLOAD_KG, blowing(-wind_mps, 0.0))
                }),
                line("across", "#009e73", move |wind_mps| {
                    wh_per_km(&default(), PAYLOAD_KG, blowing(0.0, wind_mps))
                }),
                line("behind", "#0072b2", move |wind_mps| {
                    wh_per_km(&default(), PAYLOAD_KG, blowing(wind_mps, 0.0))
                }),
            ],
        },
    ]
}

/// The picture, as SVG.
pub(crate) fn energy() -> String {
    let width = 3.0 * PANEL_WIDTH;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <title>Energy over payload, airspeed and wind</title>\n\
         <rect width=\"{width}\" height=\"{HEIGHT}\" fill=\"#ffffff\"/>\n"
    );
    for (place, panel) in panels().iter().enumerate() {
        draw_panel(&mut svg, panel, place as f64 * PANEL_WIDTH);
    }
    svg.push_str("</svg>\n");
    svg
}

fn draw_panel(svg: &mut String, panel: &Panel, offset: f64) {
    let (left, right) = (offset + LEFT, offset + PANEL_WIDTH - RIGHT);
    let bottom = HEIGHT - BOTTOM;
    let x = |value: f64| left + (right - left) * (value - panel.from) / (panel.until - panel.from);
    let y = |value: f64| bottom - (bottom - TOP) * value / MOST_WH_PER_KM;
    let _ = writeln!(
        svg,
        "<text x=\"{left:.1}\" y=\"20\" font-weight=\"bold\">Wh/km over {}</text>",
        panel.title
    );
    for wh in [0.0, 4.0, 8.0, 12.0, 16.0] {
        let _ = writeln!(
            svg,
            "<path stroke=\"#dddddd\" d=\"M{left:.1} {0:.1}H{right:.1}\"/>\n\
             <text x=\"{1:.1}\" y=\"{2:.1}\" text-anchor=\"end\" fill=\"#444444\">{wh}</text>",
            y(wh),
            left - 6.0,
            y(wh) + 4.0
        );
    }
    let ticks = ((panel.until - panel.from) / panel.step).round() as u32;
    for tick in 0..=ticks {
        let value = panel.from + f64::from(tick) * panel.step;
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#444444\">{value}</text>",
            x(value),
            bottom + 18.0
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{right:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#444444\">{}</text>",
        bottom + 34.0,
        panel.unit
    );
    let mut name_x = left;
    for line in &panel.lines {
        let path = path_of(panel, line, x, y);
        let _ = writeln!(
            svg,
            "<path fill=\"none\" stroke=\"{0}\" stroke-width=\"2\" d=\"{path}\"/>\n\
             <text x=\"{name_x:.1}\" y=\"38\" fill=\"{0}\">{1}</text>",
            line.colour, line.name
        );
        name_x += 10.0 + 7.2 * line.name.len() as f64;
    }
}

/// The line as far as it can be flown and is not above the panel.
fn path_of(panel: &Panel, line: &Line, x: impl Fn(f64) -> f64, y: impl Fn(f64) -> f64) -> String {
    let mut path = String::new();
    for point in 0..=POINTS {
        let share = f64::from(point) / f64::from(POINTS);
        let value = panel.from + share * (panel.until - panel.from);
        let wh_per_km = (line.wh_per_km)(value).filter(|&wh| wh <= MOST_WH_PER_KM);
        if let Some(wh) = wh_per_km {
            let command = if path.is_empty() { 'M' } else { 'L' };
            let _ = write!(path, "{command}{:.1} {:.1}", x(value), y(wh));
        }
    }
    path
}
