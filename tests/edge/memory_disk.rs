//! A disk in memory, for tests and simulations: it has what was committed, breaks when it is told to, and
//! forgets all else in a crash.

use skyway::edge::{Pending, StoreFault, StoreFile, Table, Transaction};
use std::collections::BTreeMap;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::watch;

/// How a disk is broken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Breakage {
    /// It is not.
    #[default]
    None,
    /// It is full: nothing is written.
    Full,
    /// It says that it failed, but has written.
    Doubtful,
    /// It does not answer.
    Hanging,
}

#[derive(Debug, Default)]
struct Disk {
    rows: BTreeMap<(Table, String), String>,
    number: u64,
    writer: u64,
    commits: u64,
    /// Commits after which the disk hangs by itself.
    hangs_after: Option<u64>,
    breakage: Breakage,
    /// Counts crashes: files opened before the last one are gone.
    crashes: u64,
}

/// A disk with one file. Copies of it are the same disk.
#[derive(Clone, Debug)]
pub(crate) struct MemoryDisk {
    disk: Arc<Mutex<Disk>>,
    mended: watch::Sender<u64>,
}

impl Default for MemoryDisk {
    fn default() -> Self {
        Self {
            disk: Arc::default(),
            mended: watch::Sender::new(0),
        }
    }
}

impl MemoryDisk {
    /// Opens the file.
    pub(crate) fn open(&self) -> Box<dyn StoreFile> {
        Box::new(MemoryFile {
            disk: self.clone(),
            crashes: self.lock().crashes,
        })
    }

    /// Breaks the disk, or mends it.
    pub(crate) fn set(&self, breakage: Breakage) {
        {
            let mut disk = self.lock();
            disk.breakage = breakage;
            disk.hangs_after = None;
        }
        self.mended.send_modify(|times| *times += 1);
    }

    /// Lets the disk hang once it has done this many more commits.
    pub(crate) fn hang_after(&self, commits: u64) {
        let mut disk = self.lock();
        disk.hangs_after = Some(disk.commits + commits);
    }

    /// Ends the process that has the file open: nothing that it writes from now on reaches the disk, which works again.
    pub(crate) fn crash(&self) {
        {
            let mut disk = self.lock();
            disk.crashes += 1;
            disk.breakage = Breakage::None;
            disk.hangs_after = None;
        }
        self.mended.send_modify(|times| *times += 1);
    }

    /// What the disk has of a table.
    pub(crate) fn rows(&self, table: Table) -> Vec<(String, String)> {
        let disk = self.lock();
        let rows = disk.rows.iter().filter(|((of, _), _)| *of == table);
        rows.map(|((_, key), body)| (key.clone(), body.clone()))
            .collect()
    }

    // The disk is whole after every call, so a panic elsewhere cannot spoil it.
    fn lock(&self) -> MutexGuard<'_, Disk> {
        self.disk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits while the disk hangs.
    async fn turn(&self) {
        let mut mended = self.mended.subscribe();
        loop {
            mended.borrow_and_update();
            if !self.lock().hangs() {
                return;
            }
            if mended.changed().await.is_err() {
                std::future::pending::<()>().await;
            }
        }
    }
}

impl Disk {
    fn hangs(&self) -> bool {
        self.breakage == Breakage::Hanging
            || self.hangs_after.is_some_and(|after| self.commits >= after)
    }

    fn write(&mut self, transaction: &Transaction) -> Result<(), StoreFault> {
        if self.number + 1 != transaction.number {
            return Err(StoreFault::Taken);
        }
        self.number = transaction.number;
        self.writer = transaction.writer;
        self.commits += 1;
        for row in &transaction.rows {
            let place = (row.table, row.key.clone());
            match &row.body {
                Some(body) => self.rows.insert(place, body.clone()),
                None => self.rows.remove(&place),
            };
        }
        Ok(())
    }
}

#[derive(Debug)]
struct MemoryFile {
    disk: MemoryDisk,
    crashes: u64,
}

impl MemoryFile {
    /// The disk, once it answers; an error where it has crashed since.
    async fn reach(&self) -> Result<MutexGuard<'_, Disk>, StoreFault> {
        self.disk.turn().await;
        let disk = self.disk.lock();
        match disk.crashes == self.crashes {
            true => Ok(disk),
            false => Err(StoreFault::Taken),
        }
    }
}

fn full() -> StoreFault {
    StoreFault::Full {
        message: "no space left on device".to_owned(),
    }
}

impl StoreFile for MemoryFile {
    fn number(&mut self) -> Pending<'_, u64> {
        Box::pin(async move { Ok(self.reach().await?.number) })
    }

    fn load(&mut self, table: Table) -> Pending<'_, Vec<(String, String)>> {
        Box::pin(async move {
            drop(self.reach().await?);
            Ok(self.disk.rows(table))
        })
    }

    fn sizes(&mut self, table: Table) -> Pending<'_, Vec<(String, u64)>> {
        Box::pin(async move {
            let rows = self.load(table).await?.into_iter();
            Ok(rows.map(|(key, body)| (key, body.len() as u64)).collect())
        })
    }

    fn read<'a>(&'a mut self, table: Table, key: &'a str) -> Pending<'a, Option<String>> {
        Box::pin(async move {
            let disk = self.reach().await?;
            Ok(disk.rows.get(&(table, key.to_owned())).cloned())
        })
    }

    fn commit<'a>(&'a mut self, transaction: &'a Transaction) -> Pending<'a, ()> {
        Box::pin(async move {
            let mut disk = self.reach().await?;
            match disk.breakage {
                Breakage::Full => Err(full()),
                Breakage::Doubtful => {
                    disk.write(transaction)?;
                    Err(full())
                }
                Breakage::None | Breakage::Hanging => disk.write(transaction),
            }
        })
    }

    fn reopen(&mut self) -> Pending<'_, (u64, u64)> {
        Box::pin(async move {
            let disk = self.reach().await?;
            Ok((disk.number, disk.writer))
        })
    }

    fn close(self: Box<Self>) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        Box::pin(std::future::ready(()))
    }
}
