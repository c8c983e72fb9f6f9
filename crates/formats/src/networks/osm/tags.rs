//! What the tags of OpenStreetMap say of a building.

/// Height of a storey where only their number is known, in metres.
pub(super) const STOREY_M: f64 = 3.5;
const FOOT_M: f64 = 0.3048;
const INCH_M: f64 = 0.0254;

/// What is known of a building.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct BuildingTags {
    pub(super) name: Option<String>,
    pub(super) height_m: Option<f64>,
    pub(super) min_height_m: Option<f64>,
    /// Tags of its height that cannot be read.
    pub(super) unread: Vec<String>,
}

/// The tags of a building or of a part of one; `None` for anything else.
pub(super) fn building_tags<'t>(
    tags: impl Iterator<Item = (&'t str, &'t str)>,
) -> Option<BuildingTags> {
    let mut is_building = false;
    let mut read = BuildingTags::default();
    let [mut height, mut levels, mut min_height, mut min_level] = [None; 4];
    for (key, value) in tags {
        match key {
            "building" | "building:part" => is_building |= value != "no",
            "name" => read.name = Some(value.to_owned()),
            "height" => height = Some(value),
            "building:levels" => levels = Some(value),
            "min_height" => min_height = Some(value),
            "building:min_level" => min_level = Some(value),
            _ => {}
        }
    }
    if !is_building {
        return None;
    }
    let mut told = |key: &str, value: Option<&str>, measured: Option<f64>| {
        if let (Some(value), None) = (value, measured) {
            read.unread.push(format!("{key}={value}"));
        }
        measured.filter(|height_m| *height_m > 0.0)
    };
    let [stated_m, counted_m] = [height.and_then(metres), levels.and_then(storeys_m)];
    let stated_m = told("height", height, stated_m);
    read.height_m = match stated_m {
        Some(height_m) => Some(height_m),
        None => told("building:levels", levels, counted_m),
    };
    // Where it is unknown the building begins at the ground, which is the safe side.
    let min_height_m = min_height.and_then(metres);
    let min_height_m = min_height_m.or_else(|| min_level.and_then(storeys_m));
    read.min_height_m = min_height_m.filter(|height_m| *height_m > 0.0);
    Some(read)
}

fn storeys_m(text: &str) -> Option<f64> {
    number(text).map(|storeys| storeys * STOREY_M)
}

/// A length as mappers write it: `12`, `12.5 m`, `40 ft`, `39'4"`.
fn metres(text: &str) -> Option<f64> {
    let text = text.trim();
    if let Some((feet, inches)) = text.split_once('\'') {
        let inches = inches.trim().trim_end_matches('"');
        let inches = match inches {
            "" => 0.0,
            inches => number(inches)?,
        };
        return Some(number(feet)? * FOOT_M + inches * INCH_M);
    }
    let end = text.find(|letter: char| letter.is_ascii_alphabetic());
    let (figure, unit) = text.split_at(end.unwrap_or(text.len()));
    let unit_m = match unit {
        "" | "m" | "metre" | "metres" | "meter" | "meters" => 1.0,
        "ft" | "feet" | "foot" => FOOT_M,
        _ => return None,
    };
    number(figure).map(|figure| figure * unit_m)
}

/// A number without sign or exponent.
fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    let is_plain = text
        .chars()
        .all(|letter| letter.is_ascii_digit() || letter == '.');
    text.parse().ok().filter(|_| is_plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_read_as_mappers_write_them() {
        for (text, height_m) in [
            ("12", Some(12.0)),
            (" 12.5 ", Some(12.5)),
            ("12 m", Some(12.0)),
            ("12m", Some(12.0)),
            ("40 ft", Some(40.0 * FOOT_M)),
            ("39'4\"", Some(39.0 * FOOT_M + 4.0 * INCH_M)),
            ("39'", Some(39.0 * FOOT_M)),
            ("about 10", None),
            ("10-12", None),
            ("-3", None),
            ("1e3", None),
            ("12 km", None),
            ("inf", None),
            ("", None),
        ] {
            assert_eq!(metres(text), height_m, "{text}");
        }
    }

    #[test]
    fn the_height_is_stated_or_else_counted_in_storeys() {
        let height_m = |tags: &[(&str, &str)]| {
            let building = [("building", "yes")]
                .into_iter()
                .chain(tags.iter().copied());
            building_tags(building).expect("a building").height_m
        };
        assert_eq!(
            height_m(&[("height", "20"), ("building:levels", "9")]),
            Some(20.0)
        );
        assert_eq!(height_m(&[("building:levels", "4")]), Some(4.0 * STOREY_M));
        assert_eq!(
            height_m(&[("height", "tall"), ("building:levels", "4")]),
            Some(14.0)
        );
        assert_eq!(height_m(&[("height", "0")]), None);
        assert_eq!(height_m(&[]), None);
    }

    #[test]
    fn buildings_and_their_parts_are_told_from_the_rest() {
        let is_building =
            |key: &str, value: &str| building_tags([(key, value)].into_iter()).is_some();
        assert!(is_building("building", "yes"));
        assert!(is_building("building", "office"));
        assert!(is_building("building:part", "yes"));
        assert!(!is_building("building", "no"));
        assert!(!is_building("highway", "primary"));
        let tags = [
            ("building", "yes"),
            ("height", "ten"),
            ("min_height", "3"),
            ("name", "Hall"),
        ];
        let told = building_tags(tags.into_iter()).expect("a building");
        assert_eq!(
            (told.name.as_deref(), told.min_height_m),
            (Some("Hall"), Some(3.0))
        );
        assert_eq!(told.unread, ["height=ten"]);
    }
}
