//! Protocol buffers' wire format, and the few of ONNX's messages that trees need: <https://protobuf.dev/programming-guides/encoding/>,
//! `onnx.proto` 1.16.
//!
//! Nothing is copied but numbers; a message that ends early is an error.

use std::collections::BTreeMap;

/// A field's content.
#[derive(Clone, Copy)]
pub(super) enum Field<'a> {
    Varint(u64),
    Fixed32([u8; 4]),
    Fixed64([u8; 8]),
    Bytes(&'a [u8]),
}

/// Calls `see` with each field's number and content; `None` if the message or a field does not make sense.
pub(super) fn fields<'a>(mut bytes: &'a [u8], mut see: impl FnMut(u64, Field<'a>) -> Option<()>) -> Option<()> {
    while !bytes.is_empty() {
        let key = varint(&mut bytes)?;
        let field = match key & 7 {
            0 => Field::Varint(varint(&mut bytes)?),
            1 => Field::Fixed64(chunk(&mut bytes)?),
            2 => {
                let length = usize::try_from(varint(&mut bytes)?).ok()?;
                let (content, rest) = bytes.split_at_checked(length)?;
                bytes = rest;
                Field::Bytes(content)
            }
            5 => Field::Fixed32(chunk(&mut bytes)?),
            _ => return None,
        };
        see(key >> 3, field)?;
    }
    Some(())
}

fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

fn chunk<const N: usize>(bytes: &mut &[u8]) -> Option<[u8; N]> {
    let (&chunk, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(chunk)
}

impl<'a> Field<'a> {
    pub(super) fn bytes(self) -> Option<&'a [u8]> {
        if let Self::Bytes(bytes) = self { Some(bytes) } else { None }
    }

    pub(super) fn text(self) -> Option<&'a str> {
        std::str::from_utf8(self.bytes()?).ok()
    }

    /// An integer: protocol buffers write negative ones in two's complement.
    pub(super) fn integer(self) -> Option<i64> {
        if let Self::Varint(value) = self { Some(value.cast_signed()) } else { None }
    }

    /// Appends integers: one, or several packed.
    fn integers(self, to: &mut Vec<i64>) -> Option<()> {
        match self {
            Self::Bytes(mut packed) => {
                while !packed.is_empty() {
                    to.push(varint(&mut packed)?.cast_signed());
                }
            }
            one => to.push(one.integer()?),
        }
        Some(())
    }

    /// Appends f32 or f64 numbers: one, or several packed.
    fn numbers(self, is_double: bool, to: &mut Vec<f64>) -> Option<()> {
        match self {
            Self::Fixed32(bytes) => to.push(f32::from_le_bytes(bytes).into()),
            Self::Fixed64(bytes) => to.push(f64::from_le_bytes(bytes)),
            Self::Bytes(packed) if is_double => to.extend(doubles(packed)?),
            Self::Bytes(packed) => to.extend(singles(packed)?),
            Self::Varint(_) => return None,
        }
        Some(())
    }
}

fn singles(bytes: &[u8]) -> Option<impl Iterator<Item = f64>> {
    let (numbers, rest) = bytes.as_chunks();
    rest.is_empty().then(|| numbers.iter().map(|bytes| f32::from_le_bytes(*bytes).into()))
}

fn doubles(bytes: &[u8]) -> Option<impl Iterator<Item = f64>> {
    let (numbers, rest) = bytes.as_chunks();
    rest.is_empty().then(|| numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)))
}

/// An operation of the graph.
#[derive(Default)]
pub(super) struct Node<'a> {
    pub(super) operation: &'a str,
    pub(super) inputs: Vec<&'a str>,
    pub(super) outputs: Vec<&'a str>,
    pub(super) attributes: BTreeMap<&'a str, Attribute<'a>>,
}

/// An attribute; of its fields one is filled.
#[derive(Default)]
pub(super) struct Attribute<'a> {
    pub(super) integer: Option<i64>,
    pub(super) text: Option<&'a str>,
    pub(super) numbers: Vec<f64>,
    pub(super) integers: Vec<i64>,
    pub(super) texts: Vec<&'a str>,
}

/// The graph: its operations, and its inputs with the number of their columns, if stated.
#[derive(Default)]
pub(super) struct Graph<'a> {
    pub(super) nodes: Vec<Node<'a>>,
    pub(super) inputs: Vec<(&'a str, Option<usize>)>,
}

/// A model: who made it, its version of `ai.onnx.ml`, and its graph.
#[derive(Default)]
pub(super) struct Model<'a> {
    pub(super) producer: String,
    pub(super) opset: i64,
    pub(super) graph: Graph<'a>,
}

pub(super) fn model(bytes: &[u8]) -> Option<Model<'_>> {
    let mut model = Model::default();
    fields(bytes, |number, field| {
        match number {
            2 | 3 => {
                let separator = if model.producer.is_empty() { "" } else { " " };
                model.producer = format!("{}{separator}{}", model.producer, field.text()?);
            }
            7 => model.graph = graph(field.bytes()?)?,
            8 => {
                let (mut domain, mut version) = ("", 0);
                fields(field.bytes()?, |number, field| {
                    match number {
                        1 => domain = field.text()?,
                        2 => version = field.integer()?,
                        _ => {}
                    }
                    Some(())
                })?;
                if domain == "ai.onnx.ml" {
                    model.opset = version;
                }
            }
            _ => {}
        }
        Some(())
    })?;
    Some(model)
}

fn graph(bytes: &[u8]) -> Option<Graph<'_>> {
    let mut graph = Graph::default();
    fields(bytes, |number, field| {
        match number {
            1 => graph.nodes.push(node(field.bytes()?)?),
            11 => graph.inputs.push(input(field.bytes()?)?),
            _ => {}
        }
        Some(())
    })?;
    Some(graph)
}

/// An input's name, and the last of its dimensions.
fn input(bytes: &[u8]) -> Option<(&str, Option<usize>)> {
    let (mut name, mut columns) = ("", None);
    fields(bytes, |number, field| {
        match number {
            1 => name = field.text()?,
            // type → tensor_type → shape → dim → dim_value
            2 => fields(field.bytes()?, |number, field| {
                let tensor = if number == 1 { field.bytes()? } else { &[] };
                fields(tensor, |number, field| {
                    let shape = if number == 2 { field.bytes()? } else { &[] };
                    fields(shape, |_, dimension| {
                        columns = None;
                        fields(dimension.bytes()?, |number, field| {
                            if number == 1 {
                                columns = usize::try_from(field.integer()?).ok();
                            }
                            Some(())
                        })
                    })
                })
            })?,
            _ => {}
        }
        Some(())
    })?;
    Some((name, columns))
}

fn node(bytes: &[u8]) -> Option<Node<'_>> {
    let mut node = Node::default();
    fields(bytes, |number, field| {
        match number {
            1 => node.inputs.push(field.text()?),
            2 => node.outputs.push(field.text()?),
            4 => node.operation = field.text()?,
            5 => {
                let (name, attribute) = attribute(field.bytes()?)?;
                node.attributes.insert(name, attribute);
            }
            _ => {}
        }
        Some(())
    })?;
    Some(node)
}

fn attribute(bytes: &[u8]) -> Option<(&str, Attribute<'_>)> {
    let (mut name, mut attribute) = ("", Attribute::default());
    fields(bytes, |number, field| {
        match number {
            1 => name = field.text()?,
            3 => attribute.integer = Some(field.integer()?),
            // Text that is not UTF-8 belongs to attributes that are not read.
            4 => attribute.text = field.text(),
            5 => tensor(field.bytes()?, &mut attribute)?,
            7 => field.numbers(false, &mut attribute.numbers)?,
            8 => field.integers(&mut attribute.integers)?,
            9 => attribute.texts.push(field.text()?),
            _ => {}
        }
        Some(())
    })?;
    Some((name, attribute))
}

/// A tensor of f32, f64 or bytes, as numbers or integers of an attribute.
fn tensor<'a>(bytes: &'a [u8], attribute: &mut Attribute<'a>) -> Option<()> {
    let (mut kind, mut raw) = (0, None);
    fields(bytes, |number, field| {
        match number {
            2 => kind = field.integer()?,
            4 => field.numbers(false, &mut attribute.numbers)?,
            5 | 7 => field.integers(&mut attribute.integers)?,
            9 => raw = Some(field.bytes()?),
            10 => field.numbers(true, &mut attribute.numbers)?,
            _ => {}
        }
        Some(())
    })?;
    match (raw, kind) {
        (None, _) => {}
        (Some(raw), 1) => attribute.numbers.extend(singles(raw)?),
        (Some(raw), 11) => attribute.numbers.extend(doubles(raw)?),
        (Some(raw), 2) => attribute.integers.extend(raw.iter().map(|&byte| i64::from(byte))),
        // Of a type that no tree has: read as empty, and found to be too short where it is used.
        (Some(_), _) => {}
    }
    Some(())
}
