//! `skyway config` and `skyway token`: what a supervisor sees of a configuration, and where secrets go.

use crate::binary::{Server, Workspace, read, read_bytes, repository, skyway, skyway_in};
use serde_json::Value;

const TOKEN_LETTERS: usize = "sky_".len() + 64;

#[test]
fn the_sample_is_the_one_in_the_repository_and_is_valid() {
    let sample = skyway(&["config", "sample"]).exits(0).stdout;
    assert_eq!(sample, read(&repository("deploy/edge.toml")));
    let desk = Workspace::new();
    let file = desk.write("edge.toml", &sample);
    let run = skyway(&["config", "check", "--quiet", "--config", &file]).exits(0);
    assert_eq!((&*run.stdout, &*run.stderr), ("ok\n", ""));
}

#[test]
fn every_fault_is_told_and_the_exit_code_is_that_of_configurations() {
    let desk = Workspace::new();
    let file = desk.write("edge.toml", "lisen = 1\nlisten = \"0.0.0.0:1\"\n");
    let environment = [("SKYWAY_EDGE_LOG_FORMAT", "xml")];
    let check = [
        "config",
        "check",
        "--config",
        &file,
        "--set",
        "limits.batch",
    ];
    let network = ["--network", "sidney"];
    let store = ["--store", &desk.write("empty.db", "")];
    let check = [&check[..], &network, &store].concat();
    let run = skyway_in(&check, &environment).exits(78);
    let told: Vec<&str> = run.stderr.lines().collect();
    // One run tells all of it: of the file, the environment, the flags, who may call, the network and the store.
    let expected = [
        "error: file FILE:1: there is no setting 'lisen'; did you mean listen?",
        "error: env SKYWAY_EDGE_LOG_FORMAT: log.format: 'xml' is not text or json",
        "error: flag --set limits.batch: write NAME=VALUE, as in limits.body=2MiB",
        "error: file FILE:2: listen = 0.0.0.0:1",
        "error: file FILE:2: listen = 0.0.0.0:1",
        "error: flag --network: there is no file sidney",
        "error: flag --store: ",
    ];
    assert_eq!(told.len(), expected.len(), "{run:#?}");
    for (line, begins) in told.iter().zip(expected) {
        let line = line.replace(&file, "FILE");
        assert!(line.starts_with(begins), "{line}, not {begins}");
    }
    assert!(told[6].contains("it is empty"), "{run:#?}");
    assert_eq!(run.stdout, "");
    let missing = desk.path("missing.toml");
    let run = skyway(&["config", "show", "--config", &missing]).exits(78);
    assert!(run.stderr.starts_with("error: cannot read "), "{run:?}");
    let run = skyway(&["config", "check", "--network", "sidney"]).exits(78);
    assert_eq!(
        run.stderr,
        "error: flag --network: there is no file sidney; the bundled networks are sydney and corridor\n"
    );
}

#[test]
fn a_flag_that_names_its_setting_does_not_name_it_twice() {
    let of = |set: &[&str]| {
        let run = skyway(&[&["config", "check", "--quiet"], set].concat()).exits(78);
        run.stderr
    };
    assert_eq!(
        of(&["--set", "limits.body=x"]),
        "error: flag --set limits.body: 'x' is not a size such as 512B, 16KiB, 1MiB or 1GiB\n"
    );
    assert_eq!(
        of(&["--set", "flight.reserve_fraction=-1"]),
        "error: flag --set flight.reserve_fraction: -1 is not from 0 to 0.9\n"
    );
    assert_eq!(
        of(&["--set", "flight.stop=2h"]),
        "error: flag --set flight.stop: 2h is not from 0s to 1h\n"
    );
    assert_eq!(
        of(&["--set", "limits.batch=7", "--set", "limits.batch=8"]),
        "error: flag --set limits.batch is set twice; keep one of the flags\n"
    );
    let named = of(&["--log", "loud"]);
    assert!(
        named.starts_with("error: flag --log: log.filter: 'loud' is not"),
        "{named}"
    );
}

#[test]
fn who_said_what_is_told_line_by_line_and_as_json() {
    let desk = Workspace::new();
    let file = desk.write("edge.toml", "[limits]\nbatch = 7\n");
    let environment = [("SKYWAY_EDGE_LISTEN", "127.0.0.1:0")];
    let show = [
        "config", "show", "--origin", "--config", &file, "--log", "debug",
    ];
    let run = skyway_in(&show, &environment).exits(0);
    for line in [
        "listen = \"127.0.0.1:0\"  # env SKYWAY_EDGE_LISTEN".to_owned(),
        format!("batch = 7  # file {file}:2"),
        "filter = \"debug\"  # flag --log".to_owned(),
        "network = \"sydney\"  # default".to_owned(),
    ] {
        assert!(
            run.stdout.lines().any(|shown| shown == line),
            "{line}: {run:?}"
        );
    }
    let json = skyway_in(&[&show[..], &["--json"]].concat(), &environment).exits(0);
    assert_eq!(json.json()["limits"]["batch"]["value"], 7);
    assert_eq!(json.json()["log"]["filter"]["origin"], "flag --log");
}

#[test]
fn a_token_is_told_once_and_the_file_has_its_digest() {
    let new = skyway(&["token", "--role", "operator", "--subject", "*"]).exits(0);
    let token = new.stdout.trim_end();
    assert!(
        token.starts_with("sky_") && token.len() == TOKEN_LETTERS,
        "{new:?}"
    );
    assert!(!new.stderr.contains(token), "{new:?}");
    let again = skyway(&["token", "--role", "operator", "--subject", "*"]).exits(0);
    assert_ne!(again.stdout, new.stdout);
    let json = skyway(&["token", "--role", "drone", "--subject", "acme", "--json"]).exits(0);
    assert_eq!(json.stderr, "");
    let told = json.json();
    let stanza = told["stanza"].as_str().unwrap_or_default();
    assert!(stanza.contains(told["sha256"].as_str().unwrap_or("no digest")));
    skyway(&["token", "--role", "anyone", "--subject", "*"]).exits(2);
    skyway(&["token", "--role", "drone", "--subject", "two words"]).exits(2);
}

/// Off loopback: with tokens that only their owner can read, and with a warning.
#[cfg(unix)]
#[test]
fn tokens_are_for_their_owner_only() {
    let desk = Workspace::new();
    let new = skyway(&["token", "--role", "drone", "--subject", "*"]).exits(0);
    let tokens = desk.write("tokens.toml", &new.stderr);
    let check = |json: bool| {
        let verb: &[&str] = if json {
            &["show", "--json"]
        } else {
            &["check"]
        };
        let flags = [
            "--quiet",
            "--listen",
            "10.0.0.4:80",
            "--tokens-file",
            &tokens,
        ];
        let plain = ["--set", "allow_plaintext=true"];
        skyway(&[&["config"], verb, &flags, &plain].concat())
    };
    desk.permit("tokens.toml", 0o640);
    let refused = check(false).exits(78).stderr.replace(&tokens, "FILE");
    assert_eq!(
        refused,
        "error: flag --tokens-file: others than its owner have access to FILE (mode 640); chmod 600 FILE\n"
    );
    desk.permit("tokens.toml", 0o600);
    let run = check(false).exits(0);
    assert!(
        run.stderr
            .starts_with("warning: listen = 10.0.0.4:80 serves"),
        "{run:?}"
    );
    let shown = check(true).exits(0);
    let digest: Vec<&str> = new.stderr.split('"').collect();
    assert!(!shown.stdout.contains(digest[1]), "{shown:?}");
    assert_eq!(shown.json()["tokens_file"], Value::from(tokens.as_str()));
}

#[test]
fn who_checks_the_file_of_the_other_daemon_is_told_so() {
    let desk = Workspace::new();
    let of_registry = desk.write("registry.toml", "[changes]\nkeep = 500\n");
    let run = skyway(&["config", "check", "--config", &of_registry]).exits(78);
    let last = run.stderr.lines().last();
    let advice = "error: this configures a registry: check it with --registry";
    assert_eq!(last, Some(advice), "{}", run.stderr);
    let of_edge = desk.write("edge.toml", "[plans]\nheadway = \"20s\"\n");
    let check = ["config", "check", "--registry", "--config", &of_edge];
    let run = skyway(&check).exits(78);
    let last = run.stderr.lines().last();
    let advice = "error: this configures an edge: check it without --registry";
    assert_eq!(last, Some(advice), "{}", run.stderr);
    // What is wrong for both is told as it is.
    let of_nobody = desk.write("nobody.toml", "[changes]\nkept = 500\n");
    let run = skyway(&["config", "check", "--config", &of_nobody]).exits(78);
    assert!(!run.stderr.contains("--registry"), "{}", run.stderr);
}

#[test]
#[expect(
    clippy::disallowed_methods,
    reason = "a test looks whether a file was made"
)]
fn the_store_of_a_registry_is_checked_without_being_made() {
    let desk = Workspace::new();
    let check = |store: &str| skyway(&["config", "check", "--registry", "--store", store]);
    let store = desk.path("registry.db");
    check(&store).exits(0);
    assert!(
        !std::path::Path::new(&store).exists(),
        "a check makes nothing"
    );
    check("postgres://skyway@localhost/skyway").exits(0);
    for (store, says) in [
        (
            "mysql://localhost/skyway",
            "neither a file nor a PostgreSQL database",
        ),
        (
            "postgres://localhost:port/skyway",
            "the database is no store",
        ),
        (&desk.path("missing/registry.db"), "there is no folder"),
        (&desk.path(""), "is a folder; name a file"),
    ] {
        let run = check(store).exits(78);
        let is_told = run.stderr.starts_with("error: flag --store: ") && run.stderr.contains(says);
        assert!(is_told, "{store}: {run:?}");
    }
    let show = [
        "config",
        "show",
        "--registry",
        "--origin",
        "--store",
        "mine.db",
    ];
    let run = skyway(&show).exits(0);
    assert!(run.stdout.contains("mine.db"), "{run:?}");
}

#[test]
fn a_store_that_cannot_be_opened_is_a_fault_and_one_that_is_checked_is_left_as_it_is() {
    let desk = Workspace::new();
    let (edge, registry) = (desk.path("edge.db"), desk.path("registry.db"));
    let check = |registry: bool, store: &str| {
        let whose: &[&str] = if registry { &["--registry"] } else { &[] };
        skyway(&[&["config", "check", "--quiet", "--store", store], whose].concat())
    };
    for (role, store) in [("edge", &edge), ("registry", &registry)] {
        let daemon = Server::start(&Workspace::new(), &[role, "--store", store]);
        check(role == "registry", store).exits(0);
        assert_eq!(daemon.end(), 0);
        check(role == "registry", store).exits(0);
    }
    let left = [read_bytes(&edge), read_bytes(&registry)];
    let torn = desk.write(
        "torn.db",
        "no database at all, but long enough to be taken for one",
    );
    for (is_registry, store, says) in [
        (false, &registry, "it has tables of something else"),
        (true, &edge, "it has tables of something else"),
        (false, &torn, "is no store"),
        (true, &torn, "no store"),
        (false, &desk.path("missing/edge.db"), "there is no folder"),
        (false, &desk.path(""), "is a folder; name a file"),
    ] {
        let run = check(is_registry, store).exits(78);
        let is_told = run.stderr.starts_with("error: flag --store: ") && run.stderr.contains(says);
        assert!(is_told, "{store}: {run:?}");
    }
    assert_eq!([read_bytes(&edge), read_bytes(&registry)], left);
    let foreign = skyway(&[
        "edge",
        "--quiet",
        "--store",
        &registry,
        "--listen",
        "127.0.0.1:0",
    ]);
    assert_ne!(foreign.code, 0);
    assert!(
        foreign.stderr.contains("tables of something else"),
        "{foreign:?}"
    );
    assert_eq!(read_bytes(&registry), left[1], "nothing was made in it");
}
