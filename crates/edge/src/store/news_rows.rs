//! Rows of news: a row for each entry, as the registry is told it.

use super::codec::{read, write};
use super::file::StoreFault;
use skyway_contract::NewsEntry;

pub(super) fn write_news(entry: &NewsEntry) -> String {
    write(entry)
}

pub(super) fn read_news(number: u64, body: &str) -> Result<NewsEntry, StoreFault> {
    let entry: NewsEntry = read("news", &number.to_string(), body)?;
    match entry.number == number {
        true => Ok(entry),
        false => Err(StoreFault::damaged(format!(
            "news {number} has the number {}",
            entry.number
        ))),
    }
}
