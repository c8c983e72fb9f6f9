//! The folder of a run: what it holds, and which run it belongs to.
//!
//! `settings.json` names the run. A cell counts as computed once `rows/<cell>.json` is there, which is written last.

use crate::cli::files;
use crate::cli::stop::Stop;
use crate::evaluate::record::{Figure, NetworkFacts};
use crate::evaluate::{
    CellRows, Design, Network, read_failures, read_rows, write_failures, write_figure, write_rows,
};
use crate::formats;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

const SETTINGS: &str = "settings.json";
/// All that a run leaves in its folder. Its settings go last: they say that the rest is a run's.
const CONTENTS: [&str; 7] = [
    "rows",
    "figures",
    "summary.csv",
    "run.json",
    "report.html",
    "findings.md",
    SETTINGS,
];
/// Settings that runs of every version have.
const SETTINGS_OF_ANY_RUN: [&str; 3] = ["version", "commit", "seed"];

/// The folder of a run.
#[derive(Debug)]
pub(super) struct Folder {
    root: PathBuf,
}

impl Folder {
    /// Opens the folder of a run, or makes it; one that holds another run is refused.
    pub(super) fn open(
        root: &Path,
        identity: &[(String, String)],
        fresh: bool,
    ) -> Result<Self, Stop> {
        let folder = Self {
            root: root.to_owned(),
        };
        if fresh {
            folder.check_that_a_run_left_it()?;
            for name in CONTENTS {
                files::remove(&folder.path(name))?;
            }
        }
        let settings = folder.path(SETTINGS);
        if files::exists(&settings) {
            folder.check(&files::read_text(&settings)?, identity)?;
            return Ok(folder);
        }
        for name in ["rows", "figures"] {
            files::create_directory(&folder.path(name))?;
        }
        let settings: Map<String, Value> = identity
            .iter()
            .map(|(name, value)| (name.clone(), Value::String(value.clone())))
            .collect();
        let text = format!("{:#}\n", Value::Object(settings));
        folder.write(SETTINGS, &text)?;
        Ok(folder)
    }

    /// Only what a run left may be removed: others have folders of the same names.
    fn check_that_a_run_left_it(&self) -> Result<(), Stop> {
        let is_there = |name: &&&str| files::is_there(&self.path(name));
        let Some(found) = CONTENTS.iter().find(is_there) else {
            return Ok(());
        };
        let settings = self.path(SETTINGS);
        if files::exists(&settings) {
            let held = settings_of(&files::read_text(&settings)?).unwrap_or_default();
            if SETTINGS_OF_ANY_RUN
                .iter()
                .all(|&name| held.contains_key(name))
            {
                return Ok(());
            }
        }
        Err(Stop::failed(format!(
            "--fresh removes what a run left, and {} has no {SETTINGS} of a run beside {found}; name another folder with --out",
            self.root.display()
        )))
    }

    fn check(&self, text: &str, identity: &[(String, String)]) -> Result<(), Stop> {
        let refused = |what: String| {
            let root = self.root.display();
            Stop::failed(format!(
                "{root} holds another run: {what}; begin anew with --fresh, or name another folder with --out"
            ))
        };
        let Some(settings) = settings_of(text) else {
            return Err(refused(format!("its {SETTINGS} is not that of a run")));
        };
        for (name, value) in identity {
            let held = settings.get(name).and_then(Value::as_str).unwrap_or("none");
            if held != value {
                return Err(refused(format!("its {name} is {held}, not {value}")));
            }
        }
        Ok(())
    }

    /// The path of something in the folder.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// Writes a file of the folder.
    pub(super) fn write(&self, name: &str, text: &str) -> Result<(), Stop> {
        files::replace_text(&self.path(name), text)
    }

    /// The rows of a cell that has been computed.
    pub(super) fn cell(&self, name: &str) -> Result<Option<CellRows>, Stop> {
        let facts = self.path(&format!("rows/{name}.json"));
        if !files::exists(&facts) {
            return Ok(None);
        }
        let spoilt = |what: &str| {
            let path = self.path(&format!("rows/{name}"));
            Stop::failed(format!(
                "{}: {what}; begin anew with --fresh",
                path.display()
            ))
        };
        let facts: NetworkFacts = serde_json::from_str(&files::read_text(&facts)?)
            .map_err(|error| spoilt(&error.to_string()))?;
        let text = |suffix: &str| files::read_text(&self.path(&format!("rows/{name}{suffix}")));
        let failures =
            read_failures(&text(".failures.csv")?).map_err(|error| spoilt(&error.to_string()))?;
        let rows = read_rows(&text(".csv")?).map_err(|error| spoilt(&error.to_string()))?;
        match CellRows::sorted(facts, failures, rows) {
            None => Err(spoilt("its rows are not whole")),
            found => Ok(found),
        }
    }

    /// Keeps the rows of a cell, and gives them back.
    pub(super) fn keep(&self, name: &str, cell: CellRows) -> Result<CellRows, Stop> {
        let mut rows: Vec<_> = cell.rows.values().flatten().cloned().collect();
        rows.sort_by_key(|row| row.failure);
        let rows = write_rows(&rows).map_err(Stop::failed)?;
        let failures = write_failures(&cell.failures).map_err(Stop::failed)?;
        let facts = serde_json::to_string_pretty(&cell.facts).map_err(Stop::failed)?;
        self.write(&format!("rows/{name}.csv"), &rows)?;
        self.write(&format!("rows/{name}.failures.csv"), &failures)?;
        self.write(&format!("rows/{name}.json"), &(facts + "\n"))?;
        Ok(cell)
    }

    /// Writes the points of every plot, and the plots.
    pub(super) fn write_figures(
        &self,
        figures: &[Figure],
        plots: &[(String, String)],
    ) -> Result<(), Stop> {
        for figure in figures {
            let text = write_figure(figure).map_err(Stop::failed)?;
            self.write(&format!("figures/{}.csv", figure.slug), &text)?;
        }
        for (slug, svg) in plots {
            self.write(&format!("figures/{slug}.svg"), svg)?;
        }
        Ok(())
    }
}

/// What a file says of its run; nothing where it is no object.
fn settings_of(text: &str) -> Option<Map<String, Value>> {
    serde_json::from_str(text).ok()
}

/// What tells the networks of a design apart from others: a fingerprint of their texts.
pub(super) fn fingerprint(design: &Design) -> String {
    let texts: Vec<&str> = design
        .cells
        .iter()
        .flat_map(|cell| &cell.networks)
        .filter_map(|network| match network {
            Network::Text(text) => Some(text.as_str()),
            Network::Generated(_) => None,
        })
        .collect();
    format!("SHA-256 {}", hex::encode(formats::fingerprint(&texts)))
}
