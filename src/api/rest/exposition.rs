//! The two formats of `GET /metrics`: `OpenMetrics` 1.0, and the older text format of Prometheus, 0.0.4.
//!
//! They differ in more than their names. The older one knows no exemplars, no units, no end, and no `info`, and a
//! counter's help and type go by the name of its samples, with `_total`: by another name they would be lost.

use http::{HeaderMap, header};

/// The type of what is written in `OpenMetrics`.
pub(super) const OPENMETRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
/// The type of the older format.
pub(super) const PLAIN: &str = "text/plain; version=0.0.4; charset=utf-8";

/// Whether who asks is told in `OpenMetrics`: everyone but those who like the older format better.
pub(super) fn reads_openmetrics(headers: &HeaderMap) -> bool {
    let accepted = headers.get_all(header::ACCEPT).iter();
    let accepted = accepted.filter_map(|value| value.to_str().ok());
    let ranges: Vec<(String, f64)> = accepted
        .flat_map(|value| value.split(','))
        .map(range)
        .collect();
    let liking = |name: &str| {
        let found = ranges.iter().filter(|(range, _)| range == name);
        found.map(|&(_, quality)| quality).reduce(f64::max)
    };
    match (liking("application/openmetrics-text"), liking("text/plain")) {
        (Some(open), plain) => open >= plain.unwrap_or_default(),
        (None, plain) => plain.is_none_or(|quality| quality == 0.0),
    }
}

/// A media range without its parameters, and how much it is liked.
fn range(text: &str) -> (String, f64) {
    let mut parts = text.split(';').map(str::trim);
    let name = parts.next().unwrap_or_default().to_ascii_lowercase();
    let quality = parts.find_map(|part| part.strip_prefix("q=")?.trim().parse().ok());
    (name, quality.unwrap_or(1.0))
}

/// The same in the older format. No label of ours has a ` # ` in its value.
pub(super) fn in_older_format(openmetrics: &str) -> String {
    let mut plain = String::with_capacity(openmetrics.len());
    let mut help = None;
    for line in openmetrics.lines() {
        let mut words = line.splitn(4, ' ');
        match (words.next(), words.next(), words.next(), words.next()) {
            (Some("#"), Some("HELP"), Some(name), text) => help = Some((name, text)),
            (Some("#"), Some("TYPE"), Some(name), Some(kind)) => {
                let (name, kind) = match kind {
                    "counter" => (format!("{name}_total"), kind),
                    "info" => (format!("{name}_info"), "gauge"),
                    "unknown" => (name.to_owned(), "untyped"),
                    _ => (name.to_owned(), kind),
                };
                if let Some((_, text)) = help.take() {
                    let text = text.unwrap_or_default();
                    plain.push_str(&format!("# HELP {name} {text}\n"));
                }
                plain.push_str(&format!("# TYPE {name} {kind}\n"));
            }
            (Some("#"), ..) => {}
            _ => {
                plain.push_str(line.split_once(" # {").map_or(line, |(sample, _)| sample));
                plain.push('\n');
            }
        }
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;
    use http::HeaderValue;

    fn is_open(accept: &[&'static str]) -> bool {
        let mut headers = HeaderMap::new();
        for value in accept {
            headers.append(header::ACCEPT, HeaderValue::from_static(value));
        }
        reads_openmetrics(&headers)
    }

    #[test]
    fn everyone_is_told_in_the_format_that_they_like_best() {
        assert!(is_open(&[]) && is_open(&["*/*"]) && is_open(&["text/html, */*;q=0.8"]));
        let of_today = "application/openmetrics-text;version=1.0.0;q=0.5,text/plain;version=0.0.4;q=0.3,*/*;q=0.2";
        assert!(is_open(&[of_today]));
        assert!(!is_open(&["text/plain;version=0.0.4;q=1,*/*;q=0.1"]));
        assert!(!is_open(&[
            "text/plain",
            "application/openmetrics-text; q=0.4"
        ]));
        assert!(!is_open(&["Text/Plain"]));
    }

    #[test]
    fn the_older_format_has_every_help_and_type_by_the_name_of_its_samples() {
        let text = "# HELP a Requests answered.\n# TYPE a counter\na_total{b=\"c\"} 3 # {trace_id=\"7\"} 0.1 1.0\n\
            # HELP d_seconds Time.\n# TYPE d_seconds histogram\n# UNIT d_seconds seconds\nd_seconds_sum 0.5\n\
            # HELP e Which.\n# TYPE e info\ne_info{version=\"1\"} 1\n\
            # HELP f Any.\n# TYPE f unknown\nf 1\n# EOF\n";
        assert_eq!(
            in_older_format(text),
            "# HELP a_total Requests answered.\n# TYPE a_total counter\na_total{b=\"c\"} 3\n\
            # HELP d_seconds Time.\n# TYPE d_seconds histogram\nd_seconds_sum 0.5\n\
            # HELP e_info Which.\n# TYPE e_info gauge\ne_info{version=\"1\"} 1\n\
            # HELP f Any.\n# TYPE f untyped\nf 1\n"
        );
    }
}
