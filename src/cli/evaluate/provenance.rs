//! Where the figures of a run come from: commit, compiler, machine, parameters.

use super::Evaluate;
use crate::cli::stop::Stop;
use crate::cli::{clock, files};
use crate::evaluate::Method;
use crate::evaluate::record::Provenance;
use std::path::Path;

const UNKNOWN: &str = "unknown";
/// Where Linux tells the name of the processor.
const PROCESSOR: &str = "/proc/cpuinfo";

/// All that is known before anything is computed.
pub(super) fn told(evaluate: &Evaluate) -> Result<Provenance, Stop> {
    let repetitions = evaluate.repetitions();
    let named = |name: &str, value: String| (name.to_owned(), value);
    Ok(Provenance {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        commit: commit(),
        compiler: env!("SKYWAY_COMPILER").to_owned(),
        profile: env!("SKYWAY_PROFILE").to_owned(),
        checks_assertions: cfg!(debug_assertions),
        machine: machine()?,
        started: clock::now().to_string(),
        seed: evaluate.seed,
        quick: evaluate.quick,
        command: command(),
        parameters: vec![
            named("methods", Method::all().len().to_string()),
            named("repetitions at most", repetitions.most.to_string()),
            named(
                "time for the repetitions of a method on one failure, at most",
                format!("{} µs", repetitions.budget_us),
            ),
            named("threads for timing", "1".to_owned()),
        ],
        networks: Vec::new(),
    })
}

/// The commit of the source this was built from, where that is still there and under version control.
#[expect(
    clippy::disallowed_types,
    reason = "the door to git, which alone knows the commit and whether anything was changed since"
)]
fn commit() -> String {
    let told = std::process::Command::new("git")
        .args(["-C", env!("CARGO_MANIFEST_DIR"), "describe"])
        .args(["--always", "--dirty", "--abbrev=12"])
        .output();
    let told = told.ok().filter(|told| told.status.success());
    told.and_then(|told| String::from_utf8(told.stdout).ok())
        .map_or_else(|| UNKNOWN.to_owned(), |commit| commit.trim().to_owned())
}

#[expect(
    clippy::disallowed_methods,
    reason = "the door to the machine: how many cores there are"
)]
fn machine() -> Result<String, Stop> {
    let cores = std::thread::available_parallelism().map_err(Stop::failed)?;
    let known = match files::exists(Path::new(PROCESSOR)) {
        true => files::read_text(Path::new(PROCESSOR))?,
        false => String::new(),
    };
    let model = known
        .lines()
        .find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let model = model.map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    Ok(format!("{model}, {cores} cores, {}", std::env::consts::OS))
}

#[expect(
    clippy::disallowed_methods,
    reason = "the door to the arguments and the working folder, which a report repeats"
)]
fn command() -> String {
    let folder = std::env::current_dir().unwrap_or_default();
    let arguments = std::env::args().skip(1);
    let arguments = arguments.map(|argument| relative(&argument, &folder));
    let words = std::iter::once("skyway".to_owned()).chain(arguments);
    words.collect::<Vec<String>>().join(" ")
}

/// An argument as anyone can repeat it: a path below the working folder is told from there, as a
/// report is published and the folders of its machine mean nothing elsewhere.
fn relative(argument: &str, folder: &Path) -> String {
    let (flag, path) = match argument.split_once('=') {
        Some((flag, path)) if flag.starts_with("--") => (format!("{flag}="), path),
        _ => (String::new(), argument),
    };
    let below = Path::new(path).strip_prefix(folder).ok();
    match below
        .filter(|_| folder.is_absolute())
        .and_then(Path::to_str)
    {
        None => argument.to_owned(),
        Some("") => format!("{flag}."),
        Some(below) => format!("{flag}{below}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_below_the_working_folder_are_told_from_there() {
        let told = |argument: &str| relative(argument, Path::new("/home/ana/skyway"));
        assert_eq!(
            told("/home/ana/skyway/target/evaluation"),
            "target/evaluation"
        );
        assert_eq!(told("--out=/home/ana/skyway/target"), "--out=target");
        assert_eq!(told("/home/ana/skyway"), ".");
        assert_eq!(told("/home/ana/skyway-old/out"), "/home/ana/skyway-old/out");
        assert_eq!(told("target/evaluation"), "target/evaluation");
        assert_eq!(told("--fresh"), "--fresh");
    }
}
