//! Blocks: structures that may grow, written behind their length.
//!
//! A reader skips the fields behind those it knows. Fields that a shorter block does not hold are
//! read as zero bytes: 0, false, none, empty, the first variant. So either side may learn a field
//! without a new version of the format.

use wincode::config::{Configuration, Serialize};
use wincode::{SchemaRead, SchemaReadOwned, SchemaWrite};

use crate::{DecodeError, EncodeError, PART_LEN_MAX};

/// bincode's default format (fixed integers, u64 lengths, u32 tags); no list inside the part may
/// take more memory than the part may have bytes.
pub(crate) type PartFormat = Configuration<true, PART_LEN_MAX>;

/// A structure inside a part, in bytes: `u64` length, then its fields.
#[derive(Clone, Debug, Default, PartialEq, Eq, SchemaRead, SchemaWrite)]
pub(crate) struct Block(Vec<u8>);

/// Zero bytes behind a short block: more than any structure has before its first list.
const MISSING_LEN_MAX: usize = 1024;

impl Block {
    /// Block with the encoded fields of a structure.
    ///
    /// # Errors
    /// [`EncodeError::Part`] for a text or list that is too long.
    pub(crate) fn of<T>(fields: &T) -> Result<Self, EncodeError>
    where
        T: SchemaWrite<PartFormat, Src = T>,
    {
        let mut bytes = Vec::with_capacity(256);
        T::serialize_into(&mut bytes, fields, PartFormat::new())
            .map_err(|source| EncodeError::Part { source })?;
        Ok(Self(bytes))
    }

    /// The block with the encoded fields of a further structure behind its own.
    ///
    /// # Errors
    /// [`EncodeError::Part`] for a text or list that is too long.
    pub(crate) fn and<T>(mut self, fields: &T) -> Result<Self, EncodeError>
    where
        T: SchemaWrite<PartFormat, Src = T>,
    {
        self.0.extend(Self::of(fields)?.0);
        Ok(self)
    }

    /// Structure that the block begins with, and the bytes behind it.
    ///
    /// # Errors
    /// [`DecodeError::Part`] for a value that does not exist, as an unknown enum tag.
    pub(crate) fn read_first<T>(&self) -> Result<(T, &[u8]), DecodeError>
    where
        T: SchemaReadOwned<PartFormat> + for<'a> SchemaRead<'a, PartFormat, Dst = T>,
    {
        let mut window = self.0.as_slice();
        match T::get(&mut window) {
            Ok(fields) => Ok((fields, window)),
            Err(_) => Ok((read_fields(&self.0)?, &[])),
        }
    }

    /// Structure that the block holds.
    ///
    /// # Errors
    /// [`DecodeError::Part`] for a value that does not exist, as an unknown enum tag.
    pub(crate) fn read<T>(&self) -> Result<T, DecodeError>
    where
        T: SchemaReadOwned<PartFormat> + for<'a> SchemaRead<'a, PartFormat, Dst = T>,
    {
        read_fields(&self.0)
    }

    /// The block without some bytes at its end, which a reader takes for zero.
    pub(crate) fn without_last(mut self, bytes: usize) -> Self {
        self.0.truncate(self.0.len().saturating_sub(bytes));
        self
    }

    /// Whether the block holds no field at all.
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Structure whose fields `bytes` begin with; shorter bytes are read as if zeros followed.
///
/// # Errors
/// [`DecodeError::Part`] for a value that does not exist, as an unknown enum tag.
pub(crate) fn read_fields<T>(bytes: &[u8]) -> Result<T, DecodeError>
where
    T: for<'a> SchemaRead<'a, PartFormat, Dst = T>,
{
    let mut window = bytes;
    if let Ok(fields) = T::get(&mut window) {
        return Ok(fields);
    }
    // Rare: the writer is older than this side, or the value is wrong and is told so below.
    let mut longer = bytes.to_vec();
    longer.resize(bytes.len() + MISSING_LEN_MAX, 0);
    T::get(&mut longer.as_slice()).map_err(|source| DecodeError::Part { source })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[derive(Clone, Debug, PartialEq, SchemaRead, SchemaWrite)]
    struct Old {
        count: u32,
        name: String,
    }

    #[derive(Clone, Debug, PartialEq, SchemaRead, SchemaWrite)]
    struct New {
        count: u32,
        name: String,
        is_flagged: bool,
        share: Option<f64>,
        notes: Vec<String>,
    }

    proptest! {
        #[test]
        fn older_and_newer_structures_read_each_other(count: u32, name in ".{0,20}", share: f64) {
            let old = Old { count, name: name.clone() };
            let notes = vec!["a".to_owned()];
            let new = New { count, name, is_flagged: true, share: Some(share), notes };
            prop_assert_eq!(Block::of(&new).unwrap().read::<Old>().unwrap(), old.clone());
            let read: New = Block::of(&old).unwrap().read().unwrap();
            let bare = New { is_flagged: false, share: None, notes: vec![], ..new };
            prop_assert_eq!(read, bare);
            let both = Block::of(&old).unwrap().and(&7_u32).unwrap();
            let (read, rest) = both.read_first::<Old>().unwrap();
            prop_assert_eq!((read, read_fields::<u32>(rest).unwrap()), (old, 7));
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..60)) {
            let _ = read_fields::<New>(&bytes);
        }
    }

    #[test]
    fn value_that_does_not_exist_is_refused_though_zeros_would_follow() {
        let flag =
            New { count: 1, name: String::new(), is_flagged: true, share: None, notes: vec![] };
        let Block(mut bytes) = Block::of(&flag).unwrap();
        bytes[12] = 2;
        assert!(matches!(read_fields::<New>(&bytes), Err(DecodeError::Part { .. })));
    }
}
