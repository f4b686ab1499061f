//! Universal Binary JSON, as XGBoost writes it: <https://ubjson.org>, draft 12.
//!
//! Everything that XGBoost uses and a little more. Numbers that JSON does not have (NaN, infinities) become null.

use serde_json::{Map, Number, Value};

/// Values inside values; XGBoost's go to 8.
const MAX_DEPTH: usize = 64;

/// The value that `bytes` hold, or the byte from which on they hold none.
pub(super) fn read(bytes: &[u8]) -> Result<Value, u64> {
    let mut reader = Reader { bytes, at: 0 };
    let marker = reader.marker();
    let value = marker.and_then(|marker| reader.value(marker, 0)).filter(|_| reader.at == bytes.len());
    value.ok_or(reader.at as u64)
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N).and_then(|bytes| bytes.try_into().ok())
    }

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    /// The next type marker; N is for nothing.
    fn marker(&mut self) -> Option<u8> {
        loop {
            let [marker] = self.array()?;
            if marker != b'N' {
                return Some(marker);
            }
        }
    }

    fn value(&mut self, marker: u8, depth: usize) -> Option<Value> {
        if depth > MAX_DEPTH {
            return None;
        }
        Some(match marker {
            b'Z' => Value::Null,
            b'T' => true.into(),
            b'F' => false.into(),
            b'd' => number(f32::from_be_bytes(self.array()?).into()),
            b'D' => number(f64::from_be_bytes(self.array()?)),
            b'C' => char::from(self.array::<1>()?[0]).to_string().into(),
            b'S' | b'H' => self.string()?.into(),
            b'[' => self.list(depth)?,
            b'{' => self.object(depth)?,
            _ => self.integer(marker)?.into(),
        })
    }

    fn integer(&mut self, marker: u8) -> Option<i64> {
        Some(match marker {
            b'i' => i8::from_be_bytes(self.array()?).into(),
            b'U' => u8::from_be_bytes(self.array()?).into(),
            b'I' => i16::from_be_bytes(self.array()?).into(),
            b'u' => u16::from_be_bytes(self.array()?).into(),
            b'l' => i32::from_be_bytes(self.array()?).into(),
            b'm' => u32::from_be_bytes(self.array()?).into(),
            b'L' => i64::from_be_bytes(self.array()?),
            _ => return None,
        })
    }

    fn length(&mut self) -> Option<usize> {
        let marker = self.marker()?;
        self.integer(marker).and_then(|length| usize::try_from(length).ok())
    }

    fn string(&mut self) -> Option<String> {
        let length = self.length()?;
        self.take(length).and_then(|bytes| String::from_utf8(bytes.into()).ok())
    }

    /// The type and the number of values that a container may state.
    fn header(&mut self) -> Option<(Option<u8>, Option<usize>)> {
        let mut kind = None;
        if self.peek() == Some(b'$') {
            self.at += 1;
            kind = Some(self.array::<1>()?[0]);
        }
        let mut count = None;
        if self.peek() == Some(b'#') {
            self.at += 1;
            count = Some(self.length()?);
        }
        // A type needs a number; and values of no bytes could be any number of.
        let is_bounded = !matches!(kind, Some(b'Z' | b'T' | b'F' | b'N')) && (kind.is_none() || count.is_some());
        is_bounded.then_some((kind, count))
    }

    fn list(&mut self, depth: usize) -> Option<Value> {
        let (kind, count) = self.header()?;
        // Each value has at least one byte, so that damaged counts end with the bytes.
        let mut values = Vec::new();
        while count.is_none_or(|count| values.len() < count) {
            let marker = match kind {
                Some(kind) => kind,
                None => self.marker()?,
            };
            if count.is_none() && marker == b']' {
                break;
            }
            values.push(self.value(marker, depth + 1)?);
        }
        Some(Value::Array(values))
    }

    fn object(&mut self, depth: usize) -> Option<Value> {
        let (kind, count) = self.header()?;
        let mut values = Map::new();
        let mut read = 0;
        while count.is_none_or(|count| read < count) {
            if count.is_none() && self.peek() == Some(b'}') {
                self.at += 1;
                break;
            }
            let key = self.string()?;
            let marker = match kind {
                Some(kind) => kind,
                None => self.marker()?,
            };
            values.insert(key, self.value(marker, depth + 1)?);
            read += 1;
        }
        Some(Value::Object(values))
    }
}

fn number(value: f64) -> Value {
    Number::from_f64(value).map_or(Value::Null, Value::Number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn containers_with_and_without_counts_and_types_are_read() {
        let bytes = b"{U\x01a[$d#L\0\0\0\0\0\0\0\x02\x3f\x80\0\0\x7f\xc0\0\0i\x01b[Ti\xffSU\x02hi]U\x01c{}}";
        assert_eq!(read(bytes), Ok(json!({"a": [1.0, null], "b": [true, -1, "hi"], "c": {}})));
        assert_eq!(read(b"{#U\x01U\x01kZ"), Ok(json!({"k": null})));
    }

    #[test]
    fn what_ends_early_or_claims_too_much_ends_with_the_byte() {
        let whole = b"{U\x01a[$d#L\0\0\0\0\0\0\0\x02\x3f\x80\0\0\x7f\xc0\0\0}";
        for end in 0..whole.len() {
            assert!(read(&whole[..end]).is_err());
        }
        assert!(read(b"[$d#L\x7f\xff\xff\xff\xff\xff\xff\xff").is_err());
        assert!(read(b"[$Z#L\x7f\xff\xff\xff\xff\xff\xff\xff").is_err(), "values of no bytes");
        assert!(read(b"[#L\xff\xff\xff\xff\xff\xff\xff\xff").is_err(), "a negative number");
        assert!(read(&[b'['; 100_000]).is_err(), "deep nesting");
        assert_eq!(read(b"ZZ"), Err(1), "something after the value");
    }
}
