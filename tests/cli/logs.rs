//! What the log of a daemon and `skyway replay` tell its operator.

#![expect(clippy::disallowed_types, reason = "a port at which nothing listens")]

use crate::binary::{Server, Workspace, skyway};
use std::net::TcpListener;

/// The id that an answer begins with.
fn id_in(answer: &str) -> String {
    let (_, id) = answer.split_once(r#""id":""#).expect("an id");
    id.split('"').next().expect("an id").to_owned()
}

#[test]
fn an_answer_is_explained_from_its_id_alone() {
    let desk = Workspace::new();
    let store = desk.path("edge.db");
    let edge = Server::start(
        &desk,
        &["edge", "--store", &store, "--log", "skyway_edge=debug"],
    );
    let closed = r#"{"nodes":[450],"reason":"fire"}"#;
    let headers = "content-type: application/json\r\n";
    let closure = id_in(&Server::ask(
        edge.address,
        "POST /v1/closures",
        headers,
        closed,
    ));
    let report = r#"{"type":"navigational","service":{"from":379,"to":406},"destination":450}"#;
    let id = id_in(&Server::ask(
        edge.address,
        "POST /v1/failures",
        headers,
        report,
    ));
    assert_eq!(edge.end(), 0);

    // Its line in the log.
    let log = desk.read("log");
    let line = log
        .lines()
        .find(|line| line.contains(&id) && line.contains("answered"))
        .expect("a line");
    for part in [
        "DEBUG",
        "answered",
        r#"outcome="diverted""#,
        r#"stage="global""#,
    ] {
        assert!(line.contains(part), "no {part} in {line}");
    }

    // What it was computed from, and why nothing better comes out, from the file that the edge left behind.
    let told = skyway(&["replay", &id, "--store", &store]).exits(0).stdout;
    for part in [
        "with 1 closure in force\n",
        r#"asked: {"type":"navigational","airborne":true,"service":{"from":"379","to":"406"}"#,
        "\nrecorded: diverted, 112.220 m\ncomputed: diverted, 112.220 m; by exact, searched: global\n",
        &format!("\ncut off by: closure '{closure}'\nthe same answer\n"),
    ] {
        assert!(told.contains(part), "no {part} in {told}");
    }
    let told = skyway(&["replay", &id, "--store", &store, "--json"])
        .exits(0)
        .json();
    assert_eq!(told["record"]["id"], *id);
    assert_eq!(told["record"]["world"]["closures"][0]["id"], *closure);
}

#[test]
fn an_edge_says_once_why_it_cannot_follow() {
    let desk = Workspace::new();
    // Nothing listens on the port of a listener that is gone.
    let gone = TcpListener::bind("127.0.0.1:0").expect("a port");
    let url = format!("http://{}", gone.local_addr().expect("an address"));
    drop(gone);
    let edge = Server::start(&desk, &["edge", "--no-store", "--registry-url", &url]);
    // Questions fail again and again.
    loop {
        let status = Server::ask(edge.admin, "GET /status", "", "");
        let failures = status.split_once(r#""transport":"#).map(|(_, rest)| rest);
        let count = failures.and_then(|rest| rest.split(['}', ',']).next()?.parse::<u32>().ok());
        if count >= Some(3) {
            break;
        }
    }
    assert_eq!(edge.end(), 0);
    let log = desk.read("log");
    let told: Vec<&str> = log.lines().filter(|line| line.contains("WARN")).collect();
    let [line] = *told else {
        panic!("it is told once: {log}");
    };
    assert!(line.contains("the registry is not followed"), "{line}");
    assert!(line.contains("the registry does not answer"), "{line}");
}

#[test]
fn an_edge_says_when_it_follows_again() {
    let desk = Workspace::new();
    let registry_desk = Workspace::new();
    let store = registry_desk.path("registry.db");
    let registry = Server::start(&registry_desk, &["registry", "--store", &store]);
    let url = format!("http://{}", registry.address);
    let edge = Server::start(&desk, &["edge", "--no-store", "--registry-url", &url]);
    let is_told = |what: &str| desk.read("log").lines().any(|line| line.contains(what));
    // The registry has no network yet, so that there is nothing to follow.
    while !is_told("the registry is not followed") {}
    assert!(!is_told("the registry is followed again"));
    let network = skyway(&["network", "convert", "--to", "geojson", "--quiet"]).exits(0);
    let headers = "content-type: application/geo+json\r\n";
    let line = "PUT /v1/networks/sydney";
    Server::ask(registry.address, line, headers, &network.stdout);
    while !is_told("the registry is followed again") {}
    assert_eq!(edge.end(), 0);
    assert_eq!(registry.end(), 0);
}
