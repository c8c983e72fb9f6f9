//! Every page: its files, their promises, and that it asks no other server.

use super::served::{HTML, PROMISES, Page};
use super::{edge, shop};
use crate::refusal::Refusal;
use axum::body::Body;
use axum::response::Response;
use http::{Request, StatusCode, header};
use http_body_util::BodyExt;
use std::future::Future;
use std::pin::pin;
use std::sync::LazyLock;
use std::task::{Context, Poll, Waker};
use tower::ServiceExt;

static PAGES: [&LazyLock<Page>; 2] = [&edge::PAGE, &shop::PAGE];

/// Nothing here waits, so one look is enough.
fn now<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => value,
        Poll::Pending => unreachable!("the page waits for nothing"),
    }
}

fn ask(page: &'static Page, path: &str, if_none_match: Option<&str>) -> Response {
    let mut request = Request::builder().uri(path);
    if let Some(tags) = if_none_match {
        request = request.header(header::IF_NONE_MATCH, tags);
    }
    let request = request.body(Body::empty()).expect("a request");
    now(page.router().oneshot(request)).expect("an answer")
}

fn text(response: Response) -> String {
    let bytes = now(response.into_body().collect())
        .expect("a body")
        .to_bytes();
    String::from_utf8(bytes.to_vec()).expect("text")
}

#[test]
fn every_file_is_served_with_its_type_and_the_promises() {
    for page in PAGES {
        let below = page.files.iter();
        let below = below.map(|file| (format!("/page/{}", file.name), file.media_type));
        for (path, media_type) in [("/".to_owned(), HTML)].into_iter().chain(below) {
            let response = ask(page, &path, None);
            assert_eq!(response.status(), StatusCode::OK, "{path}");
            assert_eq!(response.headers()[header::CONTENT_TYPE], media_type);
            for (name, value) in PROMISES {
                assert_eq!(response.headers()[name], value, "{path}");
            }
        }
        let missing = ask(page, "/page/mod.rs", None);
        assert_eq!(missing.status(), StatusCode::NOT_FOUND);
        assert!(missing.extensions().get::<Refusal>().is_some());
    }
}

#[test]
fn what_is_known_is_not_sent_again() {
    let page = &edge::PAGE;
    let first = ask(page, "/page/page.js", None);
    let etag = first.headers()[header::ETAG]
        .to_str()
        .expect("text")
        .to_owned();
    for tags in [&*etag, &format!("\"other\", W/{etag}"), "*"] {
        let again = ask(page, "/page/page.js", Some(tags));
        assert_eq!(again.status(), StatusCode::NOT_MODIFIED, "{tags}");
        assert_eq!(again.headers()[header::ETAG], *etag);
        assert_eq!(text(again), "");
    }
    let other = ask(page, "/page/page.js", Some("\"other\""));
    assert_eq!(other.status(), StatusCode::OK);
}

#[test]
fn a_page_names_only_files_it_has_and_nobody_else() {
    for page in PAGES {
        let index = text(ask(page, "/", None));
        let quoted = index.split('"').filter(|part| part.starts_with("/page/"));
        for path in quoted {
            assert_eq!(ask(page, path, None).status(), StatusCode::OK, "{path}");
        }
        for document in page.files.iter().chain([&page.index]) {
            let text = document.text;
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
        let texts = page.files.iter().map(|file| file.text);
        for import in texts.flat_map(|text| text.split("from \"./").skip(1)) {
            let name = import.split('"').next().unwrap_or_default();
            let has = page.files.iter().any(|file| file.name == name);
            assert!(has, "{name}");
        }
    }
}
