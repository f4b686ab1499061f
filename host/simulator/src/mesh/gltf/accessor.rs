//! Numbers out of buffers, every index checked.

use super::document::{Accessor, Document, Extensions, SparsePart};
use super::extension::{COMPRESSED, QUANTIZED};
use crate::error::{Error, Result};
use crate::mesh::{unread::unsupported, words};
use std::borrow::Cow;

/// Data that accessors read from.
pub(super) struct Data<'a> {
    pub(super) document: &'a Document,
    pub(super) buffers: Vec<Option<Cow<'a, [u8]>>>,
    /// The most elements of an accessor whose elements stand nowhere: zeros, a few of them replaced.
    pub(super) most_zeros: u64,
}

pub(super) fn damaged(what: String) -> Error {
    words::damaged("glTF", what)
}

/// The numbers of components.
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

impl<'a> Data<'a> {
    /// The positions that an accessor gives; `extensions` are those of the primitive that asks.
    pub(super) fn positions(&self, index: u32, extensions: &Extensions) -> Result<Vec<[f32; 3]>> {
        let accessor = self.accessor(index)?;
        if accessor.shape == "VEC3" && accessor.component_type != FLOAT {
            let what = format!("positions that are not floats ({QUANTIZED})");
            return Err(unsupported(what, "Export it without quantization"));
        }
        if accessor.shape != "VEC3" || accessor.normalized {
            return Err(damaged(format!("accessors[{index}] gives positions, but is not VEC3 of floats")));
        }
        let vertex = |bytes: &[u8]| {
            let mut vertex = [0.0; 3];
            let (words, _) = bytes.as_chunks::<4>();
            vertex.iter_mut().zip(words).for_each(|(value, word)| *value = f32::from_le_bytes(*word));
            vertex
        };
        self.elements(index, accessor, 12, extensions, [0.0; 3], vertex)
    }

    /// The indices that an accessor gives.
    pub(super) fn indices(&self, index: u32, extensions: &Extensions) -> Result<Vec<u32>> {
        let accessor = self.accessor(index)?;
        if accessor.shape != "SCALAR" || accessor.normalized {
            return Err(damaged(format!("accessors[{index}] gives indices, but is not SCALAR")));
        }
        let size = size_of_index(accessor.component_type, &format!("accessors[{index}]"))?;
        self.elements(index, accessor, size, extensions, 0, unsigned)
    }

    fn accessor(&self, index: u32) -> Result<&'a Accessor> {
        let missing = || damaged(format!("accessors[{index}] is missing"));
        self.document.accessors.get(index as usize).ok_or_else(missing)
    }

    fn elements<T: Copy>(
        &self,
        index: u32,
        accessor: &Accessor,
        size: u64,
        extensions: &Extensions,
        zero: T,
        read: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>> {
        let name = format!("accessors[{index}]");
        let mut elements: Vec<T> = match accessor.buffer_view {
            Some(view) => self.slices(view, accessor.byte_offset, size, accessor.count, &name)?.map(&read).collect(),
            // A compressed accessor may say nothing of where its elements are, and an accessor without them is all zeros.
            None if accessor.sparse.is_none() => return Err(self.without_data(&name, extensions)),
            None if accessor.count > self.most_zeros => {
                return Err(damaged(format!("{name} has {} elements, more than the file can hold", accessor.count)));
            }
            None => vec![zero; accessor.count as usize],
        };
        let Some(sparse) = &accessor.sparse else { return Ok(elements) };
        let part =
            |part: &SparsePart, size: u64| self.slices(part.buffer_view, part.byte_offset, size, sparse.count, &name);
        let places = part(&sparse.indices, size_of_index(sparse.indices.component_type.unwrap_or_default(), &name)?)?;
        for (place, value) in places.zip(part(&sparse.values, size)?) {
            let place = unsigned(place);
            let element = elements.get_mut(place as usize);
            *element
                .ok_or_else(|| damaged(format!("{name} replaces its element {place}, which it does not have")))? =
                read(value);
        }
        Ok(elements)
    }

    /// The bytes of each of `count` elements of `size` bytes.
    fn slices(&self, view: u32, offset: u64, size: u64, count: u64, name: &str) -> Result<impl Iterator<Item = &[u8]>> {
        let missing = || damaged(format!("bufferViews[{view}], where {name} is, is missing"));
        let found = self.document.buffer_views.get(view as usize).ok_or_else(missing)?;
        let buffer = self.buffers.get(found.buffer as usize);
        let buffer =
            buffer.ok_or_else(|| damaged(format!("buffers[{}], where {name} is, is missing", found.buffer)))?;
        let Some(buffer) = buffer else { return Err(self.without_data(name, &found.extensions)) };
        let end = found.byte_offset.checked_add(found.byte_length).filter(|&end| end <= buffer.len() as u64);
        let end = end.ok_or_else(|| damaged(format!("bufferViews[{view}] goes beyond the end of its buffer")))?;
        // Within the buffer, so both are within memory.
        let bytes = buffer.get(found.byte_offset as usize..end as usize).unwrap_or_default();
        let stride = found.byte_stride.unwrap_or(size);
        if stride < size {
            return Err(damaged(format!("bufferViews[{view}] has a stride of {stride} bytes for elements of {size}")));
        }
        let last = count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        let needed = last.and_then(|last| last.checked_add(offset));
        if needed.is_none_or(|needed| needed > bytes.len() as u64) {
            return Err(damaged(format!("{name} of {count} elements goes beyond the end of bufferViews[{view}]")));
        }
        let (offset, stride, size) = (offset as usize, stride as usize, size as usize);
        Ok((0..count as usize)
            .map(move |i| bytes.get(offset + i * stride..).and_then(|rest| rest.get(..size)).unwrap_or_default()))
    }

    /// Reason why there are no elements: an extension that compresses them, or damage.
    fn without_data(&self, name: &str, extensions: &Extensions) -> Error {
        let own = extensions.iter().flat_map(|extensions| extensions.keys());
        let known = |name: &&String| COMPRESSED.contains(&name.as_str());
        match own.chain(&self.document.extensions_used).find(known) {
            Some(extension) => super::extension::unsupported(extension),
            None => damaged(format!("{name} has no elements: no buffer view with bytes")),
        }
    }
}

fn size_of_index(component: u32, name: &str) -> Result<u64> {
    match component {
        UNSIGNED_BYTE => Ok(1),
        UNSIGNED_SHORT => Ok(2),
        UNSIGNED_INT => Ok(4),
        other => {
            Err(damaged(format!("{name} gives indices of the type {other}, which are not unsigned whole numbers")))
        }
    }
}

/// A whole number of one, two or four bytes.
fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte))
}
