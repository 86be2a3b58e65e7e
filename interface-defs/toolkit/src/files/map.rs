//! A file as memory: what several processes of a machine map is there once.

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};
use std::fs::File;
use std::io;
use std::ops::Deref;
use std::ptr::NonNull;

/// All bytes of a file, read from the disk where they are looked at. Whoever cuts the file short ends the process that looks behind its end.
#[derive(Debug)]
pub struct Map {
    bytes: NonNull<u8>,
    length: usize,
}

// SAFETY: the bytes are only read, and belong to this value alone.
unsafe impl Send for Map {}
// SAFETY: likewise.
unsafe impl Sync for Map {}

impl Map {
    /// Of a file, which must not be empty.
    pub fn of(file: &File) -> io::Result<Self> {
        let length = usize::try_from(file.metadata()?.len()).map_err(io::Error::other)?;
        // SAFETY: the system chooses a place where nothing is.
        let at = unsafe { mmap(std::ptr::null_mut(), length, ProtFlags::READ, MapFlags::SHARED, file, 0) }?;
        Ok(Self { bytes: NonNull::new(at.cast()).ok_or(io::ErrorKind::InvalidInput)?, length })
    }
}

impl Deref for Map {
    type Target = [u8];

    #[inline]
    fn deref(&self) -> &[u8] {
        // SAFETY: so many bytes are mapped there until this value is dropped.
        unsafe { std::slice::from_raw_parts(self.bytes.as_ptr(), self.length) }
    }
}

impl Drop for Map {
    fn drop(&mut self) {
        // SAFETY: nobody has a reference to these bytes any more.
        let _ = unsafe { munmap(self.bytes.as_ptr().cast(), self.length) };
    }
}
