//! A page as it is sent: its files, each with its entity tag, and what holds for every one.

use crate::refusal::{Code, Refusal};
use axum::Router;
use axum::body::Body;
use axum::extract::Path;
use axum::response::Response;
use axum::routing::get;
use http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use sha2::{Digest, Sha256};

pub(super) const HTML: &str = "text/html; charset=utf-8";
pub(super) const CSS: &str = "text/css; charset=utf-8";
pub(super) const SCRIPT: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";

/// A file below `/page/`: its name, its media type, and what is in it.
pub(super) type File = (&'static str, &'static str, &'static str);

/// The files that every page has.
const OF_EVERY_PAGE: [File; 6] = [
    ("base.css", CSS, include_str!("base.css")),
    ("icon.svg", SVG, include_str!("icon.svg")),
    ("api.js", SCRIPT, include_str!("api.js")),
    ("canvas.js", SCRIPT, include_str!("canvas.js")),
    ("view.js", SCRIPT, include_str!("view.js")),
    ("words.js", SCRIPT, include_str!("words.js")),
];

/// What holds for every file: nothing from elsewhere runs, loads, frames or is asked.
pub(super) const PROMISES: [(HeaderName, &str); 5] = [
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
pub(super) struct Document {
    pub(super) name: &'static str,
    pub(super) media_type: &'static str,
    pub(super) text: &'static str,
    etag: String,
}

impl Document {
    fn new(name: &'static str, media_type: &'static str, text: &'static str) -> Self {
        Self {
            name,
            media_type,
            text,
            etag: format!("\"{}\"", hex::encode(&Sha256::digest(text)[..8])),
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

/// A page: the document at `/`, and its files below `/page/`.
#[derive(Debug)]
pub(super) struct Page {
    pub(super) index: Document,
    pub(super) files: Vec<Document>,
}

impl Page {
    /// The page of a document and files of its own, beside those that every page has.
    pub(super) fn new(index: &'static str, own: &[File]) -> Self {
        let files = OF_EVERY_PAGE.iter().chain(own);
        Self {
            index: Document::new("", HTML, index),
            files: files
                .map(|(name, media_type, text)| Document::new(name, media_type, text))
                .collect(),
        }
    }

    /// Its routes.
    pub(super) fn router(&'static self) -> Router {
        Router::new()
            .route("/", get(async |asked: HeaderMap| self.index.answer(&asked)))
            .route(
                "/page/{*file}",
                get(async |Path(name): Path<String>, asked: HeaderMap| self.file(&name, &asked)),
            )
    }

    fn file(&'static self, name: &str, asked: &HeaderMap) -> Response {
        if let Some(document) = self.files.iter().find(|document| document.name == name) {
            return document.answer(asked);
        }
        let mut response = Response::new(Body::empty());
        *response.status_mut() = StatusCode::NOT_FOUND;
        // The gate tells a refusal that it finds here, with the id of the request.
        let refusal = Refusal::new(Code::NotFound, format!("the page has no file '{name}'"));
        response.extensions_mut().insert(refusal);
        response
    }
}
