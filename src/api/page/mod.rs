//! The live page at `/`: what an edge does, as a picture that needs nothing but the edge itself.
//!
//! The files are part of the program and are sent as they are written: no build step, no libraries, no
//! requests to anyone else. The page is a client of the REST interface like any other.

use crate::edge::{Code, Refusal};
use axum::Router;
use axum::body::Body;
use axum::extract::Path;
use axum::response::Response;
use axum::routing::get;
use http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use sha2::{Digest, Sha256};
use std::fmt::Write;
use std::sync::LazyLock;

const HTML: &str = "text/html; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";

/// The document at `/`.
const INDEX: &str = include_str!("index.html");

/// The files below `/page/`, with their media types.
const FILES: [(&str, &str, &str); 10] = [
    ("page.css", CSS, include_str!("page.css")),
    ("icon.svg", SVG, include_str!("icon.svg")),
    ("page.js", SCRIPT, include_str!("page.js")),
    ("airspace.js", SCRIPT, include_str!("airspace.js")),
    ("api.js", SCRIPT, include_str!("api.js")),
    ("circle.js", SCRIPT, include_str!("circle.js")),
    ("drawing.js", SCRIPT, include_str!("drawing.js")),
    ("panels.js", SCRIPT, include_str!("panels.js")),
    ("view.js", SCRIPT, include_str!("view.js")),
    ("world.js", SCRIPT, include_str!("world.js")),
];

/// What holds for every file: nothing from elsewhere runs, loads, frames or is asked.
const PROMISES: [(HeaderName, &str); 5] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'; object-src 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (header::X_FRAME_OPTIONS, "DENY"),
    // Kept by browsers, and asked for again each time: after an upgrade no old script meets a new edge.
    (header::CACHE_CONTROL, "no-cache"),
];

/// A file as it is sent.
#[derive(Debug)]
struct Document {
    name: &'static str,
    media_type: &'static str,
    text: &'static str,
    etag: String,
}

impl Document {
    fn new(name: &'static str, media_type: &'static str, text: &'static str) -> Self {
        let mut etag = String::from("\"");
        for byte in &Sha256::digest(text)[..8] {
            // Writing to text cannot fail.
            let _ = write!(etag, "{byte:02x}");
        }
        etag.push('"');
        Self {
            name,
            media_type,
            text,
            etag,
        }
    }

    fn answer(&'static self, asked: &HeaderMap) -> Response {
        let is_known = asked
            .get_all(header::IF_NONE_MATCH)
            .iter()
            .any(|tags| names(tags, &self.etag));
        let mut response = match is_known {
            true => Response::new(Body::empty()),
            false => Response::new(Body::from(self.text)),
        };
        if is_known {
            *response.status_mut() = StatusCode::NOT_MODIFIED;
        }
        let headers = response.headers_mut();
        headers.insert(
            header::CONTENT_TYPE,
            HeaderValue::from_static(self.media_type),
        );
        if let Ok(etag) = HeaderValue::from_str(&self.etag) {
            headers.insert(header::ETAG, etag);
        }
        for (name, value) in PROMISES {
            headers.insert(name, HeaderValue::from_static(value));
        }
        response
    }
}

/// Whether an `If-None-Match` names a tag, strong or weak (RFC 9110, section 13.1.2).
fn names(tags: &HeaderValue, etag: &str) -> bool {
    let Ok(tags) = tags.to_str() else {
        return false;
    };
    let mut tags = tags.split(',').map(str::trim);
    tags.any(|tag| tag == "*" || tag.strip_prefix("W/").unwrap_or(tag) == etag)
}

static INDEX_DOCUMENT: LazyLock<Document> = LazyLock::new(|| Document::new("", HTML, INDEX));
static DOCUMENTS: LazyLock<Vec<Document>> = LazyLock::new(|| {
    let files = FILES.into_iter();
    files
        .map(|(name, media_type, text)| Document::new(name, media_type, text))
        .collect()
});

/// The routes of the page: `/`, and its files below `/page/`.
pub fn router() -> Router {
    Router::new()
        .route(
            "/",
            get(async |asked: HeaderMap| INDEX_DOCUMENT.answer(&asked)),
        )
        .route("/page/{*file}", get(file))
}

async fn file(Path(name): Path<String>, asked: HeaderMap) -> Response {
    if let Some(document) = DOCUMENTS.iter().find(|document| document.name == name) {
        return document.answer(&asked);
    }
    let mut response = Response::new(Body::empty());
    *response.status_mut() = StatusCode::NOT_FOUND;
    // The gate tells a refusal that it finds here, with the id of the request.
    let refusal = Refusal::new(Code::NotFound, format!("the page has no file '{name}'"));
    response.extensions_mut().insert(refusal);
    response
}

#[cfg(test)]
mod tests {
    use super::*;
    use http::Request;
    use http_body_util::BodyExt;
    use std::future::Future;
    use std::pin::pin;
    use std::task::{Context, Poll, Waker};
    use tower::ServiceExt;

    /// Nothing here waits, so one look is enough.
    fn now<T>(future: impl Future<Output = T>) -> T {
        match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(value) => value,
            Poll::Pending => unreachable!("the page waits for nothing"),
        }
    }

    fn ask(path: &str, if_none_match: Option<&str>) -> Response {
        let mut request = Request::builder().uri(path);
        if let Some(tags) = if_none_match {
            request = request.header(header::IF_NONE_MATCH, tags);
        }
        let request = request.body(Body::empty()).expect("a request");
        now(router().oneshot(request)).expect("an answer")
    }

    fn text(response: Response) -> String {
        let bytes = now(response.into_body().collect())
            .expect("a body")
            .to_bytes();
        String::from_utf8(bytes.to_vec()).expect("text")
    }

    #[test]
    fn every_file_is_served_with_its_type_and_the_promises() {
        let paths = FILES.map(|(name, media_type, _)| (format!("/page/{name}"), media_type));
        for (path, media_type) in [("/".to_owned(), HTML)].into_iter().chain(paths) {
            let response = ask(&path, None);
            assert_eq!(response.status(), StatusCode::OK, "{path}");
            assert_eq!(response.headers()[header::CONTENT_TYPE], media_type);
            for (name, value) in PROMISES {
                assert_eq!(response.headers()[name], value, "{path}");
            }
        }
        let missing = ask("/page/mod.rs", None);
        assert_eq!(missing.status(), StatusCode::NOT_FOUND);
        assert!(missing.extensions().get::<Refusal>().is_some());
    }

    #[test]
    fn what_is_known_is_not_sent_again() {
        let first = ask("/page/page.js", None);
        let etag = first.headers()[header::ETAG]
            .to_str()
            .expect("text")
            .to_owned();
        for tags in [&*etag, &format!("\"other\", W/{etag}"), "*"] {
            let again = ask("/page/page.js", Some(tags));
            assert_eq!(again.status(), StatusCode::NOT_MODIFIED, "{tags}");
            assert_eq!(again.headers()[header::ETAG], *etag);
            assert_eq!(text(again), "");
        }
        let other = ask("/page/page.js", Some("\"other\""));
        assert_eq!(other.status(), StatusCode::OK);
    }

    #[test]
    fn the_page_names_only_files_it_has_and_nobody_else() {
        let index = text(ask("/", None));
        let quoted = index.split('"').filter(|part| part.starts_with("/page/"));
        for path in quoted {
            assert_eq!(ask(path, None).status(), StatusCode::OK, "{path}");
        }
        let texts = FILES.iter().map(|(_, _, text)| *text);
        for text in texts.chain([INDEX]) {
            for line in text.lines() {
                let from_elsewhere = ["http://", "https://", "url(", "@import", "eval("]
                    .iter()
                    .any(|mark| {
                        line.contains(mark) && !line.contains("http://www.w3.org/2000/svg")
                    });
                assert!(!from_elsewhere, "{line}");
            }
            // What the policy forbids would silently not work.
            assert!(!text.contains(" style=") && !text.contains("innerHTML"));
        }
        let imports = FILES
            .iter()
            .flat_map(|(_, _, text)| text.split("from \"./").skip(1));
        for import in imports {
            let name = import.split('"').next().unwrap_or_default();
            assert!(FILES.iter().any(|(file, _, _)| *file == name), "{name}");
        }
    }
}
