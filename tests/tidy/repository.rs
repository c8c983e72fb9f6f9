//! The files of the repository, as far as the rules look at them.

use std::fs;
use std::path::Path;

use crate::rust::{Token, code_of, tokens};

/// A file of the repository, as far as the rules look at it.
pub(crate) struct File {
    /// From the root of the repository, with `/`.
    pub(crate) path: String,
    pub(crate) executable: bool,
    pub(crate) text: String,
}

impl File {
    pub(crate) fn is_rust(&self) -> bool {
        self.path.ends_with(".rs")
    }

    pub(crate) fn is_script(&self) -> bool {
        let in_place = self.path.starts_with("scripts/") || self.path.starts_with(".ci/");
        let name = self.path.rsplit('/').next().unwrap_or_default();
        in_place && (!name.contains('.') || name.ends_with(".sh") || self.text.starts_with("#!"))
    }

    /// The folder of its crate below `crates/`, and its path in the sources there; `None` before the path of a file in `src/`.
    pub(crate) fn place(&self) -> Option<(Option<&str>, &str)> {
        if let Some(inside) = self.path.strip_prefix("src/") {
            return Some((None, inside));
        }
        let (name, inside) = self.path.strip_prefix("crates/")?.split_once('/')?;
        Some((Some(name), inside.strip_prefix("src/")?))
    }

    pub(crate) fn tokens(&self) -> Vec<Token> {
        tokens(&code_of(&self.text))
    }

    /// How many `super` lead from this file to the root of the crate.
    pub(crate) fn depth(&self) -> usize {
        let (_, inside) = self.place().unwrap_or((None, &self.path));
        let below_src = 1 + inside.matches('/').count();
        if self.path.ends_with("/mod.rs") {
            below_src - 1
        } else {
            below_src
        }
    }
}

/// Every file, the contents of those that are text we write.
pub(crate) fn repository() -> Vec<File> {
    let mut files = Vec::new();
    collect(Path::new(env!("CARGO_MANIFEST_DIR")), "", &mut files);
    assert!(
        files.iter().any(|file| file.path == "src/lib.rs"),
        "this is not the repository"
    );
    files
}

fn collect(root: &Path, folder: &str, files: &mut Vec<File>) {
    for entry in fs::read_dir(root.join(folder)).expect("a readable folder") {
        let entry = entry.expect("a readable entry");
        let name = entry
            .file_name()
            .into_string()
            .expect("file names are UTF-8");
        let path = if folder.is_empty() {
            name.clone()
        } else {
            format!("{folder}/{name}")
        };
        let kind = entry.file_type().expect("a kind of file");
        if kind.is_dir() {
            if ![".git", "target", "node_modules", "__pycache__"].contains(&name.as_str()) {
                files.push(File {
                    path: path.clone(),
                    executable: false,
                    text: String::new(),
                });
                collect(root, &path, files);
            }
        } else {
            let ours = [".rs", ".md", ".toml", ".proto"]
                .iter()
                .any(|end| name.ends_with(end))
                || folder.starts_with("scripts")
                || folder.starts_with(".ci");
            let bytes = if ours {
                fs::read(entry.path()).expect("a readable file")
            } else {
                vec![]
            };
            let text = String::from_utf8_lossy(&bytes).into_owned();
            files.push(File {
                path,
                executable: is_executable(&entry),
                text,
            });
        }
    }
}

#[cfg(unix)]
fn is_executable(entry: &fs::DirEntry) -> bool {
    use std::os::unix::fs::PermissionsExt;
    entry
        .metadata()
        .is_ok_and(|metadata| metadata.permissions().mode() & 0o111 == 0o111)
}

#[cfg(not(unix))]
fn is_executable(_: &fs::DirEntry) -> bool {
    true
}
