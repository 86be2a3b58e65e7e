//! A long row of numbers, in memory of one's own or in a file that all processes of a machine share.

use std::any::Any;
use std::ops::Deref;
use std::sync::Arc;
use toolkit::files::Map;

/// What stands in a file as it stands in memory.
///
/// # Safety
///
/// All bytes are a value, and no bytes lie between its parts.
pub unsafe trait Plain: Copy + Send + Sync + 'static {}

// SAFETY: numbers of one size.
unsafe impl Plain for [u32; 3] {}
// SAFETY: likewise.
unsafe impl Plain for nalgebra::Vector3<f64> {}

/// The row, which never changes.
#[derive(Debug, Clone)]
pub struct Row<T: Plain> {
    /// For as long as this value is there.
    items: &'static [T],
    holder: Arc<dyn Any + Send + Sync>,
}

impl<T: Plain> Row<T> {
    /// In memory of one's own.
    pub fn own(items: Vec<T>) -> Self {
        let holder = Arc::new(items);
        // SAFETY: this value holds them, and nobody changes them.
        let items = unsafe { std::slice::from_raw_parts(holder.as_ptr(), holder.len()) };
        Self { items, holder }
    }

    /// The `count` items that begin at byte `at` of a file; then `at` is where they end. `None`: the file is shorter, or they are not
    /// aligned.
    pub fn shared(map: &Arc<Map>, at: &mut usize, count: usize) -> Option<Self> {
        let end = at.checked_add(count.checked_mul(size_of::<T>())?)?;
        let items = map.get(*at..end)?.as_ptr().cast::<T>();
        *at = end;
        // SAFETY: they lie within the map, which this value holds and which does not move, and any bytes are an item.
        let items = items.is_aligned().then(|| unsafe { std::slice::from_raw_parts(items, count) })?;
        Some(Self { items, holder: map.clone() })
    }

    /// True if it is in a file.
    pub fn is_shared(&self) -> bool {
        self.holder.is::<Map>()
    }

    /// Its bytes.
    pub fn bytes(&self) -> &[u8] {
        // SAFETY: of so many bytes each belongs to a number.
        unsafe { std::slice::from_raw_parts(self.items.as_ptr().cast(), size_of_val(self.items)) }
    }
}

impl<T: Plain> Deref for Row<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        self.items
    }
}

impl<T: Plain> Default for Row<T> {
    fn default() -> Self {
        Self::own(Vec::new())
    }
}
