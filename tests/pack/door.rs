//! The door to C: a program in C reads packs, and says what this reader says.

#![expect(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "tests compile and run programs"
)]

use crate::drafts::{covered, key};
use skyway_pack_c::CPack;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The library that C links with, as this build has made it: the newest one beside the test.
fn library() -> PathBuf {
    // So that it is built, and looked at.
    assert!(size_of::<CPack>() > 0);
    let test = std::env::current_exe().expect("a path");
    let folder = test.parent().expect("a folder");
    let entries = fs::read_dir(folder).expect("readable");
    let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let is_library = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("libskyway_pack_c") && name.ends_with(".a")
    };
    let written = |path: &PathBuf| path.metadata().and_then(|facts| facts.modified()).ok();
    let newest = files.filter(is_library).max_by_key(written);
    newest.expect("libskyway_pack_c.a beside the test")
}

fn compiled(folder: &Path) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let program = folder.join("flight_controller");
    let compiled = Command::new("gcc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-I"])
        .arg(root.join("crates/pack-c/include"))
        .arg(root.join("tests/pack/flight_controller.c"))
        .arg(library())
        .args(["-lpthread", "-ldl", "-lm", "-o"])
        .arg(&program)
        .output()
        .expect("gcc");
    let told = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success(), "{told}");
    program
}

#[test]
fn a_program_in_c_reads_a_pack() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = compiled(folder.path());
    let mut bytes = covered(4).write(&key()).expect("a pack");
    let (pack, public) = (folder.path().join("a.pack"), folder.path().join("a.key"));
    fs::write(&pack, &bytes).expect("written");
    fs::write(&public, key().public()).expect("written");
    let told = |leg: &str, battery: &str| {
        let run = Command::new(&program)
            .args([&pack, &public])
            .args([leg, battery])
            .output()
            .expect("it runs");
        String::from_utf8(run.stdout).expect("text")
    };
    let head = "night-mail version 2, 4 legs\n";
    assert_eq!(
        told("1", "65535"),
        format!(
            "{head}detour: 1002 (1620216000, -338790000) 1003 (1620324000, -338880000) 2 (1512216000, -338880000), \
             on with leg 2\n"
        )
    );
    assert_eq!(
        told("3", "3000"),
        format!("{head}alternate: 2003 (1728324000, -338790000), land\n")
    );
    assert_eq!(told("1", "100"), format!("{head}nothing known\n"));
    assert_eq!(told("9", "65535"), format!("{head}nothing known\n"));
    bytes[200] ^= 1;
    fs::write(&pack, &bytes).expect("written");
    assert!(told("1", "65535").starts_with("refused: -1"));
}

/// The program is what the documentation shows.
#[test]
fn the_documentation_shows_this_program() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = fs::read_to_string(root.join("docs/pack.md")).expect("readable");
    let program =
        fs::read_to_string(root.join("tests/pack/flight_controller.c")).expect("readable");
    assert!(page.contains(&program), "docs/pack.md has another program");
}
