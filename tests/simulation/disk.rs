//! The disk of an edge: one in memory that keeps what was committed through a crash, and takes its time for a commit.

use crate::memory_disk::MemoryDisk;
use crate::rounds::Chance;
use skyway::edge::{Pending, StoreFile, Table, Transaction};
use std::pin::Pin;
use std::time::Duration;

/// One in this many commits takes long.
const SLOW_ONE_IN: u64 = 25;
const SLOW_MS: u64 = 500;
const QUICK_MS: u64 = 12;

/// The file of an edge, as one life of it has it open.
#[derive(Debug)]
pub(crate) struct SlowFile {
    file: Box<dyn StoreFile>,
    chance: Chance,
}

impl SlowFile {
    pub(crate) fn open(disk: &MemoryDisk, chance: Chance) -> Box<dyn StoreFile> {
        Box::new(Self {
            file: disk.open(),
            chance,
        })
    }

    /// How long one half of a commit takes: before it is done, or before it is told.
    fn draw(&mut self) -> Duration {
        let most_ms = match self.chance.below(SLOW_ONE_IN) {
            0 => SLOW_MS,
            _ => QUICK_MS,
        };
        Duration::from_millis(self.chance.below(most_ms))
    }
}

impl StoreFile for SlowFile {
    fn number(&mut self) -> Pending<'_, u64> {
        self.file.number()
    }

    fn load(&mut self, table: Table) -> Pending<'_, Vec<(String, String)>> {
        self.file.load(table)
    }

    fn sizes(&mut self, table: Table) -> Pending<'_, Vec<(String, u64)>> {
        self.file.sizes(table)
    }

    fn read<'a>(&'a mut self, table: Table, key: &'a str) -> Pending<'a, Option<String>> {
        self.file.read(table, key)
    }

    fn commit<'a>(&'a mut self, transaction: &'a Transaction) -> Pending<'a, ()> {
        Box::pin(async move {
            tokio::time::sleep(self.draw()).await;
            self.file.commit(transaction).await?;
            tokio::time::sleep(self.draw()).await;
            Ok(())
        })
    }

    fn reopen(&mut self) -> Pending<'_, (u64, u64)> {
        self.file.reopen()
    }

    fn close(self: Box<Self>) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        self.file.close()
    }
}
