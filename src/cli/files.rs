//! Files and standard input: the only door to them.
//!
//! `-` is standard input or output. What is compressed with gzip is read as what it holds; what is
//! written to a name that ends in `.gz` is compressed. Errors name the path.

use super::output::Output;
use super::stop::Stop;
use crate::formats::ForeignFormat;
use flate2::Compression;
use flate2::read::MultiGzDecoder;
use flate2::write::GzEncoder;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::Path;

/// Nothing larger is read, compressed or not. A network of a million nodes has 1.1 GB.
const MAX_FILE_BYTES: u64 = 4 << 30;
/// The two bytes that every gzip file begins with (RFC 1952).
const GZIP_MAGIC: [u8; 2] = [0x1f, 0x8b];
/// What some editors put before UTF-8 text; it says nothing that a reader does not know.
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();
/// What stands for standard input or output.
const STANDARD_STREAM: &str = "-";

/// True for the name of standard input or output.
pub(super) fn is_standard_stream(path: &Path) -> bool {
    path.as_os_str() == STANDARD_STREAM
}

/// Reads a whole file as text.
pub(super) fn read_text(path: &Path) -> Result<String, Stop> {
    text_of(path, read_bytes(path)?)
}

/// Reads a whole file, whatever is in it.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>, Stop> {
    let mut bytes = Vec::new();
    let bounded = open(path)?.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes);
    bounded.map_err(|error| cannot_read(path, &error))?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        let limit = MAX_FILE_BYTES >> 20;
        let problem = format!("{} is larger than {limit} MiB", path.display());
        return Err(Stop::failed(problem));
    }
    Ok(bytes)
}

/// What was read of a file as text; what is known not to be text is called by its name.
pub(super) fn text_of(path: &Path, bytes: Vec<u8>) -> Result<String, Stop> {
    if let Some(format) = ForeignFormat::of_bytes(&bytes) {
        let (path, name, remedy) = (path.display(), format.name(), format.instead_of_text());
        return Err(Stop::failed(format!("{path} is {name}, {remedy}")));
    }
    String::from_utf8(bytes).map_err(|error| {
        let place = error.utf8_error().valid_up_to();
        Stop::failed(format!(
            "{} is not UTF-8 text: see byte {place}",
            path.display()
        ))
    })
}

/// Opens a file to read it piece by piece, without the byte order mark that it may begin with.
pub(super) fn open(path: &Path) -> Result<Box<dyn BufRead>, Stop> {
    let mut raw: Box<dyn BufRead> = if is_standard_stream(path) {
        standard_input()
    } else {
        open_file(path).map_err(|error| cannot_read(path, &error))?
    };
    let head = raw.fill_buf().map_err(|error| cannot_read(path, &error))?;
    let mut text: Box<dyn BufRead> = if head.starts_with(&GZIP_MAGIC) {
        Box::new(BufReader::new(MultiGzDecoder::new(raw)))
    } else {
        raw
    };
    let head = text.fill_buf().map_err(|error| cannot_read(path, &error))?;
    if head.starts_with(BYTE_ORDER_MARK) {
        text.consume(BYTE_ORDER_MARK.len());
    }
    Ok(text)
}

/// True when there is a file of this name.
#[expect(clippy::disallowed_methods, reason = "the door to files")]
pub(super) fn exists(path: &Path) -> bool {
    path.is_file()
}

/// True when there is a folder of this name.
#[expect(clippy::disallowed_methods, reason = "the door to files")]
pub(super) fn is_folder(path: &Path) -> bool {
    path.is_dir()
}

/// True when there is anything of this name.
#[expect(clippy::disallowed_methods, reason = "the door to files")]
pub(super) fn is_there(path: &Path) -> bool {
    path.exists()
}

/// Writes a whole file of text, or standard output.
pub(super) fn write_text(path: &Path, text: &str, output: &Output) -> Result<(), Stop> {
    write_bytes(path, text.as_bytes(), output)
}

/// Writes a whole file, or standard output.
pub(super) fn write_bytes(path: &Path, bytes: &[u8], output: &Output) -> Result<(), Stop> {
    if is_standard_stream(path) {
        return output.raw(bytes);
    }
    let is_compressed = path.extension().is_some_and(|ending| ending == "gz");
    let bytes = match is_compressed {
        true => compressed(bytes),
        false => Ok(bytes.to_vec()),
    };
    bytes
        .and_then(|bytes| write_file(path, &bytes))
        .map_err(|error| Stop::failed(format!("cannot write {}: {error}", path.display())))
}

/// Writes a whole file so that no reader ever finds half of it: beside its place, then moved there.
pub(super) fn replace_text(path: &Path, text: &str) -> Result<(), Stop> {
    replace(path, text.as_bytes())
        .map_err(|error| Stop::failed(format!("cannot write {}: {error}", path.display())))
}

/// Removes a file or a directory with all in it, if it is there.
#[expect(clippy::disallowed_methods, reason = "the door to files")]
pub(super) fn remove(path: &Path) -> Result<(), Stop> {
    let removed = match path.is_dir() {
        true => std::fs::remove_dir_all(path),
        false => std::fs::remove_file(path),
    };
    match removed {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            let problem = format!("cannot remove {}: {error}", path.display());
            Err(Stop::failed(problem))
        }
        _ => Ok(()),
    }
}

/// Makes a directory with all above it, unless it is there.
#[expect(clippy::disallowed_methods, reason = "the door to files")]
pub(super) fn create_directory(path: &Path) -> Result<(), Stop> {
    std::fs::create_dir_all(path).map_err(|error| {
        Stop::failed(format!(
            "cannot make the directory {}: {error}",
            path.display()
        ))
    })
}

fn compressed(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes)?;
    encoder.finish()
}

#[expect(clippy::disallowed_types, reason = "the door to files")]
fn open_file(path: &Path) -> io::Result<Box<dyn BufRead>> {
    let file = std::fs::File::open(path)?;
    Ok(Box::new(BufReader::new(file)))
}

/// Writes a file whole or not at all. What is no regular file, as a pipe or `/dev/stdout`, is written to; a link stays.
#[expect(clippy::disallowed_methods, reason = "the door to files")]
fn write_file(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let may_be_replaced = path
        .metadata()
        .is_ok_and(|found| found.is_file() && !found.permissions().readonly());
    // What has its name there is open elsewhere, also where it is a regular file.
    let is_open = ["/dev", "/proc"]
        .iter()
        .any(|folder| path.starts_with(folder));
    let place = match path.canonicalize() {
        Ok(file) if may_be_replaced && !is_open => file,
        Err(_) if !path.is_symlink() => path.to_owned(),
        _ => return std::fs::write(path, bytes),
    };
    match replace(&place, bytes) {
        // A file may be writable in a folder that is not, or be mounted there by itself.
        Err(error) if is_fixed(&error) => std::fs::write(path, bytes),
        replaced => replaced,
    }
}

/// True where a folder does not let its entries be changed.
fn is_fixed(error: &io::Error) -> bool {
    let kinds = [
        io::ErrorKind::PermissionDenied,
        io::ErrorKind::ReadOnlyFilesystem,
        io::ErrorKind::ResourceBusy,
    ];
    kinds.contains(&error.kind())
}

/// Writes beside a place, then moves there; the permissions of an older file stay.
#[expect(clippy::disallowed_methods, reason = "the door to files")]
fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    let beside = Path::new(&beside);
    let written = std::fs::write(beside, bytes)
        .and_then(|()| match path.metadata() {
            Ok(older) => std::fs::set_permissions(beside, older.permissions()),
            Err(_) => Ok(()),
        })
        .and_then(|()| std::fs::rename(beside, path));
    if written.is_err() {
        // The error that is told is the first one.
        let _ = std::fs::remove_file(beside);
    }
    written
}

#[expect(clippy::disallowed_methods, reason = "the door to standard input")]
fn standard_input() -> Box<dyn BufRead> {
    Box::new(BufReader::new(io::stdin()))
}

fn cannot_read(path: &Path, error: &io::Error) -> Stop {
    Stop::failed(format!("cannot read {}: {error}", path.display()))
}
