//! What the command line says of itself: help, version, completions, manual pages, colours.

use crate::binary::{Workspace, skyway, skyway_in, skyway_unread};

const COMMANDS: &[&[&str]] = &[
    &[],
    &["reroute"],
    &["compose"],
    &["compare"],
    &["evaluate"],
    &["verify"],
    &["pack"],
    &["pack", "show"],
    #[cfg(feature = "edge")]
    &["pack", "rotate"],
    #[cfg(feature = "edge")]
    &["pack", "revoke"],
    &["network"],
    &["network", "build"],
    &["network", "generate"],
    &["network", "info"],
    &["network", "convert"],
    &["network", "criticality"],
    &["network", "draw"],
    #[cfg(feature = "edge")]
    &["zone"],
    #[cfg(feature = "edge")]
    &["zone", "import"],
    #[cfg(feature = "edge")]
    &["zone", "export"],
    #[cfg(feature = "edge")]
    &["demo"],
    #[cfg(feature = "edge")]
    &["edge"],
    #[cfg(feature = "edge")]
    &["registry"],
    #[cfg(feature = "edge")]
    &["replay"],
    #[cfg(feature = "edge")]
    &["service"],
    #[cfg(feature = "edge")]
    &["service", "publish"],
    #[cfg(feature = "edge")]
    &["delivery"],
    #[cfg(feature = "edge")]
    &["delivery", "order"],
    #[cfg(feature = "edge")]
    &["delivery", "track"],
    #[cfg(feature = "edge")]
    &["delivery", "cancel"],
    #[cfg(feature = "edge")]
    &["config"],
    #[cfg(feature = "edge")]
    &["config", "check"],
    #[cfg(feature = "edge")]
    &["config", "show"],
    #[cfg(feature = "edge")]
    &["config", "sample"],
    #[cfg(feature = "edge")]
    &["token"],
    &["completions"],
    &["man"],
];

#[test]
fn help_of_every_command() {
    for command in COMMANDS {
        let arguments = [*command, &["--help"]].concat();
        let run = skyway(&arguments).exits(0);
        assert_eq!(run.stderr, "");
        let name = ["help", &command.join("-")].join("-");
        assert!(run.stdout.contains("\nExamples:\n"), "{command:?}");
        assert!(run.stdout.contains("\nExit codes: 0"), "{command:?}");
        insta::assert_snapshot!(name.trim_end_matches('-'), run.stdout);
    }
}

#[test]
fn the_version_is_that_of_the_package() {
    let run = skyway(&["--version"]).exits(0);
    assert_eq!(
        run.stdout,
        format!("skyway {}\n", env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn arguments_that_make_no_sense_exit_with_2() {
    let runs: &[&[&str]] = &[
        &[],
        &["fly"],
        &["reroute"],
        &["compare", "--destination", "9"],
        &["reroute", "--service", "1,2", "--requests", "x"],
        &["reroute", "--requests", "x", "--strategy", "radius"],
        &["reroute", "--service", "1,2", "--strategy", "fastest"],
        &["reroute", "--service", "1,2", "--horizon", "soon"],
        &["reroute", "--service", "1,2", "--at", "yesterday"],
        &["reroute", "--service", "1,2", "--cell-size", "0"],
        &["reroute", "--service", "1,2", "--val-ratio", "nan"],
        &[
            "compose",
            "--source",
            "1",
            "--destination",
            "2",
            "--airspeed",
            "0",
        ],
        &["network", "generate", "--nodes", "0"],
        &["network", "draw", "--width", "10"],
        &["network", "draw", "--destination", "450"],
    ];
    for arguments in runs {
        let run = skyway(arguments).exits(2);
        assert_eq!(run.stdout, "", "{arguments:?}");
        assert_ne!(run.stderr, "", "{arguments:?}");
    }
}

#[test]
fn every_shell_gets_completions() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let run = skyway(&["completions", shell]).exits(0);
        assert!(run.stdout.contains("two_phased"), "{shell}");
    }
}

#[test]
fn every_command_has_a_manual_page() {
    let main_page = skyway(&["man"]).exits(0).stdout;
    assert!(main_page.contains(".TH skyway 1"), "{main_page}");
    let desk = Workspace::new();
    skyway(&["man", "--dir", &desk.path("man1")]).exits(0);
    let pages = desk.list("man1");
    assert_eq!(pages.len(), COMMANDS.len(), "{pages:?}");
    assert!(pages.contains(&"skyway-network-build.1".to_owned()));
}

#[test]
fn colours_are_for_terminals_and_for_those_who_ask() {
    let arguments = ["network", "info"];
    let is_coloured = |arguments: &[&str], environment: &[(&str, &str)]| {
        let run = skyway_in(arguments, environment).exits(0);
        run.stdout.contains('\u{1b}')
    };
    let always = ["network", "info", "--color", "always"];
    let never = ["network", "info", "--color", "never"];
    assert!(!is_coloured(&arguments, &[]));
    assert!(is_coloured(&always, &[]));
    assert!(is_coloured(&arguments, &[("CLICOLOR_FORCE", "1")]));
    let both = [("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")];
    assert!(!is_coloured(&arguments, &both));
    assert!(!is_coloured(&never, &[("CLICOLOR_FORCE", "1")]));
}

#[test]
fn data_goes_to_standard_output_and_talk_to_standard_error() {
    let run = skyway(&["network", "info", "--json"]).exits(0);
    assert_eq!(run.json()["name"], "Sydney CBD");
    assert!(run.stderr.starts_with("Sydney CBD: 476 nodes"), "{run:?}");
    let quiet = skyway(&["network", "info", "--json", "--quiet"]).exits(0);
    assert_eq!(quiet.stderr, "");
    assert_eq!(quiet.stdout, run.stdout);
}

/// `skyway … | head` is no failure.
#[test]
fn a_reader_who_goes_away_is_no_failure() {
    let run = skyway_unread(&["network", "convert", "--to", "geojson", "--quiet"]);
    assert_eq!(run.exits(0).stderr, "");
}
