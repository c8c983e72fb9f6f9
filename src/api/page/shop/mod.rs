//! The shop window of a registry: where customers search, order and follow deliveries.

use super::served::{CSS, File, Page, SCRIPT};
use axum::Router;
use std::sync::LazyLock;

const FILES: [File; 7] = [
    ("shop.css", CSS, include_str!("shop.css")),
    ("shop.js", SCRIPT, include_str!("shop.js")),
    ("clock.js", SCRIPT, include_str!("clock.js")),
    ("map.js", SCRIPT, include_str!("map.js")),
    ("network.js", SCRIPT, include_str!("network.js")),
    ("offers.js", SCRIPT, include_str!("offers.js")),
    ("tracking.js", SCRIPT, include_str!("tracking.js")),
];

pub(super) static PAGE: LazyLock<Page> =
    LazyLock::new(|| Page::new(include_str!("index.html"), &FILES));

/// The routes of the page: `/`, and its files below `/page/`.
pub fn router() -> Router {
    PAGE.router()
}
