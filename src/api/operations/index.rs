//! The table turned round: from paths to operations, for each daemon.

use super::{Daemon, Operation, TABLE};
use http::Method;
use rustc_hash::FxHashMap;
use std::sync::LazyLock;

/// What a path offers.
pub(super) type Routes = Vec<(&'static Method, Operation)>;

/// A path with ids in it, as axum writes them: `{id}` is one segment, `{*file}` all that follow.
struct Template {
    path: &'static str,
    routes: Routes,
}

/// The operations of a daemon by their paths.
pub(super) struct Index {
    grpc: FxHashMap<&'static str, Operation>,
    exact: FxHashMap<&'static str, Routes>,
    templates: Vec<Template>,
}

static EDGE: LazyLock<Index> = LazyLock::new(|| Index::build(Daemon::Edge));
static REGISTRY: LazyLock<Index> = LazyLock::new(|| Index::build(Daemon::Registry));

/// The index of a daemon.
pub(super) fn of(daemon: Daemon) -> &'static Index {
    match daemon {
        Daemon::Edge => &EDGE,
        Daemon::Registry => &REGISTRY,
    }
}

impl Index {
    fn build(daemon: Daemon) -> Self {
        let mut index = Self {
            grpc: FxHashMap::default(),
            exact: FxHashMap::default(),
            templates: Vec::new(),
        };
        for row in TABLE.iter().filter(|row| row.operation.is_of(daemon)) {
            if let Some(path) = row.grpc {
                index.grpc.insert(path, row.operation);
            }
            for (method, path) in row.rest {
                index.routes_to_add(path).push((method, row.operation));
            }
        }
        index
    }

    fn routes_to_add(&mut self, path: &'static str) -> &mut Routes {
        if !path.contains('{') {
            return self.exact.entry(path).or_default();
        }
        let same = |template: &Template| template.path == path;
        let place = self.templates.iter().position(same).unwrap_or_else(|| {
            self.templates.push(Template {
                path,
                routes: Routes::new(),
            });
            self.templates.len() - 1
        });
        &mut self.templates[place].routes
    }

    /// The operation behind a gRPC path.
    pub(super) fn grpc(&self, path: &str) -> Option<Operation> {
        self.grpc.get(path).copied()
    }

    /// What a path offers: one look for a path without an id, else a walk along the few templates.
    pub(super) fn routes(&self, path: &str) -> Option<&Routes> {
        self.exact.get(path).or_else(|| {
            let template = self.templates.iter().find(|template| template.fits(path))?;
            Some(&template.routes)
        })
    }
}

impl Template {
    fn fits(&self, path: &str) -> bool {
        let (mut wanted, mut rest) = (self.path, path);
        loop {
            if wanted.starts_with("{*") {
                return !rest.is_empty();
            }
            let (expected, more_wanted) = split(wanted);
            let (found, more) = split(rest);
            let fits = match expected.starts_with('{') {
                true => !found.is_empty(),
                false => found == expected,
            };
            match (more_wanted, more) {
                _ if !fits => return false,
                (None, None) => return true,
                (Some(next_wanted), Some(next)) => (wanted, rest) = (next_wanted, next),
                _ => return false,
            }
        }
    }
}

/// The first segment, and what follows its slash.
fn split(path: &str) -> (&str, Option<&str>) {
    match path.split_once('/') {
        Some((first, rest)) => (first, Some(rest)),
        None => (path, None),
    }
}
