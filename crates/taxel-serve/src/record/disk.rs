//! The file of a recording.

use std::fs::File;
use std::io::{Result, Write};
use std::path::Path;
use std::sync::mpsc;
use std::thread::JoinHandle;

use taxel_recording::mcap::Storage;

use crate::save::created;

/// A file on a disk.
#[derive(Debug)]
pub(crate) struct DiskFile(File);

impl DiskFile {
    /// Makes the file, see [`created`].
    pub(crate) fn create(path: &Path, replace: bool) -> Result<Self> {
        created(path, replace).map(Self)
    }
}

impl Write for DiskFile {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.0.flush()
    }
}

impl Storage for DiskFile {
    fn sync(&mut self) -> Result<()> {
        self.0.sync_data()
    }

    fn cut(&mut self, length: u64) -> Result<()> {
        use std::io::{Seek as _, SeekFrom};
        self.0.set_len(length)?;
        self.0.seek(SeekFrom::Start(length)).map(drop)
    }
}

/// A storage that can wait for the disk on another thread, so that writing goes on meanwhile.
pub(crate) trait Syncs {
    /// A call that waits until what was written before it would survive a power cut.
    fn syncer(&self) -> Result<Box<dyn FnMut() -> Result<()> + Send>>;
}

impl Syncs for DiskFile {
    fn syncer(&self) -> Result<Box<dyn FnMut() -> Result<()> + Send>> {
        let file = self.0.try_clone()?;
        Ok(Box::new(move || file.sync_data()))
    }
}

/// Waits for the disk, on a thread of its own.
#[derive(Debug)]
pub(crate) struct SyncThread {
    asked: mpsc::SyncSender<()>,
    thread: JoinHandle<()>,
}

impl SyncThread {
    /// `failed` hears why the disk failed.
    pub(crate) fn begin(
        mut sync: Box<dyn FnMut() -> Result<()> + Send>,
        failed: impl Fn(&std::io::Error) + Send + 'static,
    ) -> Self {
        let (asked, asks) = mpsc::sync_channel::<()>(1);
        let thread = std::thread::spawn(move || {
            for () in asks {
                if let Err(error) = sync() {
                    return failed(&error);
                }
            }
        });
        Self { asked, thread }
    }

    /// Asks for one; it is enough if one waits already.
    pub(crate) fn ask(&self) {
        let _ = self.asked.try_send(());
    }

    pub(crate) fn end(self) {
        drop(self.asked);
        let _ = self.thread.join();
    }
}
