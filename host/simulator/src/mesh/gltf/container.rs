//! The parts of a glTF file: its JSON, and the bytes of its buffers, in this file or in others.

use super::damaged;
use super::document::{Buffer, Document};
use crate::error::{Error, Place, Result};
use crate::mesh::unread::{self, is_pointer};
use crate::mesh::words;
use base64::Engine;
use std::borrow::Cow;
use std::io::Read;
use std::path::{Component, Path};

/// The JSON of a file, where it starts in it, and the buffer that follows it in a GLB file.
pub(super) struct Parts<'a> {
    pub(super) json: &'a [u8],
    pub(super) start: u64,
    binary: Option<&'a [u8]>,
}

/// Takes a file apart, which is a GLB file or JSON.
pub(super) fn parts<'a>(bytes: &'a [u8], path: &Path) -> Result<Parts<'a>> {
    if !bytes.starts_with(b"glTF") {
        let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        return Ok(Parts { json, start: (bytes.len() - json.len()) as u64, binary: None });
    }
    let number = |offset: usize| bytes.get(offset..)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes));
    let wrong = |offset: usize, what: String| words::damaged("GLB", what).at(Place::byte(path, offset as u64));
    match (number(4), number(8)) {
        (Some(2), Some(length)) if length as usize == bytes.len() => {}
        (Some(2), Some(length)) => {
            return Err(wrong(8, format!("it states a length of {length} bytes, but has {}", bytes.len())));
        }
        (Some(version), Some(_)) => return Err(super::other_version(version).at(Place::byte(path, 4))),
        _ => return Err(wrong(bytes.len(), "it ends in its header".into())),
    }
    let (mut json, mut binary) = (None, None);
    let mut offset = 12;
    while offset < bytes.len() {
        let (Some(length), Some(kind)) = (number(offset), number(offset + 4)) else {
            return Err(wrong(offset, "it ends in the header of a chunk".into()));
        };
        let start = offset + 8;
        let end = start.checked_add(length as usize).filter(|&end| end <= bytes.len());
        let end = end.ok_or_else(|| wrong(offset, format!("its chunk of {length} bytes goes beyond its end")))?;
        let chunk = bytes.get(start..end).unwrap_or_default();
        match (kind, &json) {
            (0x4E4F_534A, None) => json = Some((chunk, start as u64)),
            (_, None) => return Err(wrong(offset, "its first chunk is not JSON".into())),
            (0x004E_4942, Some(_)) if binary.is_none() => binary = Some(chunk),
            // Chunks of unknown kinds must be skipped.
            _ => {}
        }
        offset = end;
    }
    let (json, start) = json.ok_or_else(|| wrong(bytes.len(), "it has no chunk of JSON".into()))?;
    Ok(Parts { json, start, binary })
}

/// Bytes of the document's buffers, in the stated number; none for a buffer without a source.
pub(super) fn buffers<'a>(
    document: &Document,
    parts: &Parts<'a>,
    path: &Path,
    folder: Option<&Path>,
) -> Result<Vec<Option<Cow<'a, [u8]>>>> {
    let load = |(index, buffer): (usize, &Buffer)| match &buffer.uri {
        // Only the first buffer may be in the file itself.
        None if index > 0 => Ok(None),
        None => parts.binary.map(|binary| cut(Cow::Borrowed(binary), index, buffer, path)).transpose(),
        Some(uri) => outside(uri, index, buffer, path, folder)
            .and_then(|bytes| cut(Cow::Owned(bytes), index, buffer, path))
            .map(Some),
    };
    document.buffers.iter().enumerate().map(load).collect()
}

/// A buffer, cut to its stated length.
fn cut<'a>(bytes: Cow<'a, [u8]>, index: usize, buffer: &Buffer, path: &Path) -> Result<Cow<'a, [u8]>> {
    let (length, stated) = (bytes.len(), buffer.byte_length);
    let stated = usize::try_from(stated).ok().filter(|&stated| stated <= length);
    let stated = stated.ok_or_else(|| {
        damaged(path, format!("buffers[{index}] states {} bytes, but {length} are there", buffer.byte_length))
    })?;
    Ok(match bytes {
        Cow::Borrowed(bytes) => Cow::Borrowed(bytes.get(..stated).unwrap_or_default()),
        Cow::Owned(mut bytes) => {
            bytes.truncate(stated);
            Cow::Owned(bytes)
        }
    })
}

/// The bytes of a data URI, or of a file beside the glTF file.
fn outside(uri: &str, index: usize, buffer: &Buffer, path: &Path, folder: Option<&Path>) -> Result<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        let encoded = data.split_once(";base64,").map(|(_, encoded)| encoded);
        let encoded = encoded.ok_or_else(|| damaged(path, format!("buffers[{index}] is a data URI without base64")))?;
        let decoded = base64::engine::general_purpose::STANDARD.decode(encoded.trim_ascii());
        return decoded.map_err(|error| damaged(path, format!("buffers[{index}] is not valid base64: {error}")));
    }
    let unsupported = |what: String, instead| Err(unread::unsupported(what, instead).at(Place::file(path)));
    let name = unescaped(uri);
    let beside = Path::new(&name);
    let is_beside =
        beside.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir | Component::ParentDir));
    if uri.contains("://") || !is_beside {
        let what = format!("the buffer at {:?}, which is not beside the file,", short(uri));
        return unsupported(what, "Export it as GLB, which holds its buffers");
    }
    let Some(folder) = folder else {
        let what = format!("the buffer in another file, {:?},", short(uri));
        return unsupported(what, "Export it as GLB, which holds its buffers");
    };
    let place = folder.join(beside);
    let io = |source| Error::io(&place, "read the buffer of a glTF file", source);
    let file = std::fs::File::open(&place).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if !metadata.is_file() || metadata.len() < buffer.byte_length {
        let mut head = Vec::new();
        if metadata.is_file() {
            file.take(1024).read_to_end(&mut head).map_err(io)?;
        }
        if is_pointer(&head) {
            return Err(unread::pointer().at(Place::file(&place)));
        }
        let what = format!("buffers[{index}] of {} states {} bytes", path.display(), buffer.byte_length);
        return Err(damaged(&place, format!("{what}, but the file has {}", metadata.len())));
    }
    let mut bytes = Vec::new();
    file.take(buffer.byte_length).read_to_end(&mut bytes).map_err(io)?;
    Ok(bytes)
}

fn short(uri: &str) -> String {
    uri.chars().take(80).collect()
}

/// Decodes a URI's `%20` and the like; invalid escapes stay.
fn unescaped(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let [first, others @ ..] = rest {
        let digit = |index: usize| others.get(index).and_then(|&digit| char::from(digit).to_digit(16));
        match (first, digit(0), digit(1)) {
            (b'%', Some(high), Some(low)) => {
                bytes.push((16 * high + low) as u8);
                rest = others.get(2..).unwrap_or_default();
            }
            _ => {
                bytes.push(*first);
                rest = others;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
