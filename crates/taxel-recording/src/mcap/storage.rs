//! Where a recording is written to.

use std::io::{Result, Write};

/// A file as the writer needs it; tests log what is written, or let it fail.
pub trait Storage: Write {
    /// Waits until what was written would survive a power cut.
    ///
    /// # Errors
    /// Those of the disk.
    fn sync(&mut self) -> Result<()>;

    /// Cuts the file to `length` bytes: what was written behind them is not whole.
    ///
    /// # Errors
    /// Those of the disk.
    fn cut(&mut self, length: u64) -> Result<()>;
}

impl Storage for Vec<u8> {
    fn sync(&mut self) -> Result<()> {
        Ok(())
    }

    fn cut(&mut self, length: u64) -> Result<()> {
        self.truncate(usize::try_from(length).unwrap_or(usize::MAX));
        Ok(())
    }
}
