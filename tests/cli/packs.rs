//! `skyway pack`: a pack in a file, and whether it is believed.

use crate::binary::{Workspace, read_bytes, repository, skyway};
use serde_json::json;

/// A pack that was written once, and the key that signed it.
const PUBLIC: &str = "6kpsY+KcUgq+9VB7Ey7F+ZVHdq6+vnuSQh7qaRRG0iw=";

fn golden() -> String {
    repository("tests/pack/golden/format-1.pack")
        .display()
        .to_string()
}

#[test]
fn a_pack_is_shown_as_a_table() {
    let run = skyway(&["pack", "show", &golden()]).exits(0);
    insta::assert_snapshot!("pack-show", run.stdout);
}

#[test]
fn a_pack_is_shown_as_json() {
    let shown = skyway(&["pack", "show", &golden(), "--key", PUBLIC, "--json"])
        .exits(0)
        .json();
    assert_eq!(shown["plan"], "night-mail");
    assert_eq!(shown["signature"], "holds");
    assert_eq!(shown["not_after"], "2026-11-27T11:00:00Z");
    let leg = &shown["legs"][1];
    assert_eq!(leg["if_closed"], "detour");
    assert_eq!(leg["detour"]["way"]["rejoins_leg"], 2);
    assert_eq!(leg["detour"]["way"]["hops"][0]["to"]["index"], 1_002);
    assert_eq!(leg["alternate"]["way"]["reserve_used"], true);
    assert_eq!(shown["legs"][2]["lands_before"], true);
}

/// Where the signature does not hold the exit code says so.
#[test]
fn a_pack_that_is_not_to_be_believed_exits_with_1() {
    let desk = Workspace::new();
    let keys = |state: &str, id: &str| {
        let keys = json!({"keys": [{"id": id, "public_key": PUBLIC, "state": state}]});
        desk.write(&format!("{state}-{id}.json"), keys.to_string())
    };
    let id = "ea4a6c63e29c520a";
    let with_keys = |file: &str| ["pack", "show", &golden(), "--keys", file].map(str::to_owned);
    for (file, code) in [
        (keys("active", id), 0),
        (keys("retired", id), 0),
        (keys("revoked", id), 1),
        (keys("active", "0000000000000000"), 1),
    ] {
        let arguments = with_keys(&file);
        skyway(&arguments.each_ref().map(String::as_str)).exits(code);
    }
    let other = "AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8=";
    skyway(&["pack", "show", &golden(), "--key", other]).exits(1);
    skyway(&["pack", "show", &golden(), "--key", "AAEC"]).exits(2);
    let mut bent = read_bytes(&golden());
    bent[300] ^= 1;
    let bent = desk.write("bent.pack", bent);
    let run = skyway(&["pack", "show", &bent, "--key", PUBLIC]);
    assert!(run.exits(1).stdout.contains("DOES NOT HOLD"));
    let text = desk.write("text", "{}");
    let run = skyway(&["pack", "show", &text]).exits(1);
    assert!(
        run.stderr.contains("do not begin as a pack"),
        "{}",
        run.stderr
    );
}

#[cfg(feature = "edge")]
#[test]
fn keys_are_rotated_and_revoked_in_their_file() {
    let desk = Workspace::new();
    let file = desk.path("edge.db.keys");
    let id = |run: crate::binary::Run| run.stdout.trim().to_owned();
    let first = id(skyway(&["pack", "rotate", &file]).exits(0));
    let refused = skyway(&["pack", "revoke", &file, &first]).exits(1);
    assert!(
        refused.stderr.contains("rotate first"),
        "{}",
        refused.stderr
    );
    let second = id(skyway(&["pack", "rotate", &file]).exits(0));
    assert_ne!(first, second);
    skyway(&["pack", "revoke", &file, &first]).exits(0);
    let text = desk.read("edge.db.keys");
    assert_eq!(text.matches("seed = ").count(), 1, "{text}");
    assert_eq!(text.matches("retired_at = ").count(), 1, "{text}");
    assert_eq!(text.matches("revoked_at = ").count(), 1, "{text}");
    desk.permit("edge.db.keys", 0o644);
    let refused = skyway(&["pack", "rotate", &file]).exits(1);
    assert!(refused.stderr.contains("chmod 600"), "{}", refused.stderr);
}
