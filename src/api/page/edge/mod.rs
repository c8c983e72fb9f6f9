//! What an edge does, as a live picture.

use super::served::{CSS, File, Page, SCRIPT};
use axum::Router;
use std::sync::LazyLock;

const FILES: [File; 7] = [
    ("page.css", CSS, include_str!("page.css")),
    ("page.js", SCRIPT, include_str!("page.js")),
    ("airspace.js", SCRIPT, include_str!("airspace.js")),
    ("circle.js", SCRIPT, include_str!("circle.js")),
    ("drawing.js", SCRIPT, include_str!("drawing.js")),
    ("panels.js", SCRIPT, include_str!("panels.js")),
    ("world.js", SCRIPT, include_str!("world.js")),
];

pub(super) static PAGE: LazyLock<Page> =
    LazyLock::new(|| Page::new(include_str!("index.html"), &FILES));

/// The routes of the page: `/`, and its files below `/page/`.
pub fn router() -> Router {
    PAGE.router()
}
