//! A geometry: sources of numbers, and primitives over them.

use super::numbers::numbers;
use super::{Wrong, children, damaged, named, unsupported, wrong};
use crate::mesh::exact::{Bounds, rounded};
use crate::mesh::polygon::Cutter;
use crate::mesh::triangles::too_many_vertices;
use crate::mesh::words::no_such_vertex;
use glam::DVec3;
use roxmltree::Node;

/// Gives the element of a name that an element's attribute refers to.
type Find<'f, 'a, 'input> = &'f dyn Fn(Node<'a, 'input>, &str, &str) -> Result<Node<'a, 'input>, Wrong>;

/// The surface of a geometry, where it is defined.
#[derive(Debug, Default)]
pub(super) struct Geometry {
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    bounds: Bounds,
}

impl Geometry {
    /// Reads a geometry, of positions no more than `left`, which is lowered; `find` gives the element of a name that an
    /// element's attribute refers to.
    pub(super) fn read<'a, 'input>(
        geometry: Node<'a, 'input>,
        left: &mut u64,
        find: Find<'_, 'a, 'input>,
    ) -> Result<Self, Wrong> {
        let mut read = Self::default();
        for other in geometry.children().filter(Node::is_element) {
            let name = other.tag_name().name();
            if ["spline", "convex_mesh", "brep"].contains(&name) {
                return Err(unsupported(other, format!("the geometry <{name}>"), "Export it as triangles"));
            }
        }
        // Which vertices were read already, and where they start: primitives share them.
        let mut known = Vec::new();
        for primitive in children(geometry, "mesh").flat_map(|mesh| mesh.children()).filter(Node::is_element) {
            let name = primitive.tag_name().name();
            let Some(kind) = Kind::of(name) else { continue };
            let lists = Lists::of(primitive, kind)?;
            if lists.is_empty() {
                continue;
            }
            let (stride, offset, vertices) = vertex_input(primitive, find)?;
            let (base, count) = match known.iter().find(|(node, _)| *node == vertices.id()) {
                Some((_, range)) => *range,
                None => {
                    let range = read.add_vertices(vertices, left, find)?;
                    known.push((vertices.id(), range));
                    range
                }
            };
            let corners = Corners { primitive, stride, offset, base, count };
            read.add(kind, &lists, &corners)?;
        }
        Ok(read)
    }

    /// Appends the positions of `<vertices>`; returns their start and number.
    fn add_vertices<'a, 'input>(
        &mut self,
        vertices: Node<'a, 'input>,
        left: &mut u64,
        find: Find<'_, 'a, 'input>,
    ) -> Result<(u32, u32), Wrong> {
        let is_position = |input: &Node<'_, '_>| input.attribute("semantic") == Some("POSITION");
        let input = children(vertices, "input").find(is_position);
        let input = input.ok_or_else(|| wrong(vertices, damaged("<vertices> without positions".into())))?;
        let source = find(input, "source", "source")?;
        let accessor = children(source, "technique_common").flat_map(|common| children(common, "accessor")).next();
        let accessor = accessor.ok_or_else(|| wrong(source, damaged("a <source> without an <accessor>".into())))?;
        let array = find(accessor, "source", "float_array")?;
        let values = numbers::<f64>(array)?;
        *left = left
            .checked_sub(values.len() as u64)
            .ok_or_else(|| wrong(vertices, damaged("its geometries share one <float_array> far too often".into())))?;
        if let Some(stated) = whole(array, "count")?.filter(|&stated| stated != values.len() as u64) {
            let what = format!("<float_array> states {stated} numbers, but has {}", values.len());
            return Err(wrong(array, damaged(what)));
        }
        let axes = axes(accessor);
        let count = whole(accessor, "count")?.ok_or_else(|| wrong(accessor, damaged("no count".into())))?;
        let (stride, offset) = (whole(accessor, "stride")?.unwrap_or(1), whole(accessor, "offset")?.unwrap_or(0));
        let widest = axes.iter().max().copied().unwrap_or_default() as u64;
        let last = count.checked_sub(1).map(|last| last.checked_mul(stride)?.checked_add(offset)?.checked_add(widest));
        if last.is_some_and(|last| last.is_none_or(|last| last >= values.len() as u64)) || stride <= widest {
            let what = format!("{count} positions in steps of {stride} need more than {} numbers", values.len());
            return Err(wrong(accessor, damaged(what)));
        }
        let too_many = |_| wrong(accessor, too_many_vertices());
        let range = (u32::try_from(self.vertices.len()).map_err(too_many)?, u32::try_from(count).map_err(too_many)?);
        let positions = values.get(offset as usize..).unwrap_or_default().chunks(stride as usize).take(count as usize);
        let first = self.vertices.len();
        self.vertices.extend(
            positions.map(|numbers| DVec3::from(axes.map(|axis| numbers.get(axis).copied().unwrap_or_default()))),
        );
        self.vertices[first..].iter().for_each(|vertex| self.bounds.add(vertex.to_array()));
        Ok(range)
    }

    /// Appends the triangles of a primitive.
    fn add(&mut self, kind: Kind, lists: &Lists, corners: &Corners<'_, '_>) -> Result<(), Wrong> {
        let (mut cutter, mut face) = (Cutter::default(), Vec::new());
        let Self { vertices, triangles, bounds } = self;
        let offset = bounds.offset();
        // As they are kept: so a polygon is cut alike in every format.
        let kept = |vertex: &DVec3| rounded(vertex.to_array(), offset).map(f64::from);
        let place = |index: u32| vertices.get(index as usize).map_or([0.0; 3], kept);
        for (number, indices) in lists.indices.iter().enumerate() {
            corners.take(indices, &mut face)?;
            let whole = face.as_slice();
            match kind {
                Kind::Triangles => {
                    let (faces, rest) = whole.as_chunks::<3>();
                    corners.expect(faces.len() as u64, rest.is_empty())?;
                    triangles.extend_from_slice(faces);
                }
                Kind::Polylist => {
                    let mut rest = whole;
                    for &arity in &lists.arities {
                        let (polygon, others) = rest.split_at_checked(arity as usize).ok_or_else(|| corners.short())?;
                        rest = others;
                        cutter.cut(polygon, place, triangles);
                    }
                    corners.expect(lists.arities.len() as u64, rest.is_empty())?;
                }
                Kind::Polygons => {
                    cutter.cut(whole, place, triangles);
                    if number + 1 == lists.indices.len() {
                        corners.expect(lists.indices.len() as u64, true)?;
                    }
                }
                Kind::Fans => {
                    let others = whole.get(1..).unwrap_or_default();
                    triangles.extend(others.array_windows().filter_map(|&[b, c]| Some([*whole.first()?, b, c])));
                }
                Kind::Strips => triangles.extend(
                    whole.array_windows().enumerate().map(
                        |(number, &[a, b, c])| {
                            if number % 2 == 1 { [b, a, c] } else { [a, b, c] }
                        },
                    ),
                ),
            }
        }
        Ok(())
    }
}

/// Rule that turns a primitive's corners into triangles. Lines are no surface.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Triangles,
    Polylist,
    Polygons,
    Fans,
    Strips,
}

impl Kind {
    fn of(name: &str) -> Option<Self> {
        match name {
            "triangles" => Some(Self::Triangles),
            "polylist" => Some(Self::Polylist),
            "polygons" => Some(Self::Polygons),
            "trifans" => Some(Self::Fans),
            "tristrips" => Some(Self::Strips),
            _ => None,
        }
    }
}

/// The numbers of a primitive: lists of indices, and for a polylist how many corners each polygon has.
struct Lists {
    indices: Vec<Vec<u32>>,
    arities: Vec<u32>,
}

impl Lists {
    fn of(primitive: Node<'_, '_>, kind: Kind) -> Result<Self, Wrong> {
        if let Some(holes) = children(primitive, "ph").next() {
            return Err(unsupported(holes, "a polygon with holes (<ph>)", "Export it as triangles"));
        }
        let indices = children(primitive, "p").map(numbers).collect::<Result<Vec<_>, _>>()?;
        let arities = match children(primitive, "vcount").next() {
            Some(counts) if kind == Kind::Polylist => numbers(counts)?,
            _ => Vec::new(),
        };
        if indices.len() > 1 && [Kind::Triangles, Kind::Polylist].contains(&kind) {
            return Err(wrong(primitive, damaged("a primitive with several <p>, which must have one".into())));
        }
        let lists = Self { indices, arities };
        if lists.is_empty() && whole(primitive, "count")?.is_some_and(|count| count > 0) {
            return Err(wrong(primitive, damaged("a primitive without the indices that it counts".into())));
        }
        Ok(lists)
    }

    /// Exporters write primitives of nothing, often without inputs.
    fn is_empty(&self) -> bool {
        self.indices.iter().all(Vec::is_empty) && self.arities.is_empty()
    }
}

/// Position of the vertices among a primitive's indices.
struct Corners<'a, 'input> {
    primitive: Node<'a, 'input>,
    /// Number of indices of a corner.
    stride: usize,
    /// Position of the vertex among them.
    offset: usize,
    /// The first of the vertices, and how many they are.
    base: u32,
    count: u32,
}

impl Corners<'_, '_> {
    /// The vertices of a list of indices.
    fn take(&self, indices: &[u32], face: &mut Vec<u32>) -> Result<(), Wrong> {
        face.clear();
        let corners = indices.chunks_exact(self.stride);
        if !corners.remainder().is_empty() {
            return Err(self.short());
        }
        for corner in corners {
            let index = corner.get(self.offset).copied().unwrap_or(u32::MAX);
            if index >= self.count {
                return Err(wrong(self.primitive, no_such_vertex(index, self.count.into())));
            }
            face.push(self.base + index);
        }
        Ok(())
    }

    /// The faces must be whole, and as many as stated.
    fn expect(&self, faces: u64, are_whole: bool) -> Result<(), Wrong> {
        let stated = whole(self.primitive, "count")?.unwrap_or(faces);
        if !are_whole {
            return Err(self.short());
        }
        if stated != faces {
            let name = self.primitive.tag_name().name();
            return Err(wrong(self.primitive, damaged(format!("<{name}> states {stated} faces, but has {faces}"))));
        }
        Ok(())
    }

    fn short(&self) -> Wrong {
        wrong(self.primitive, damaged("the indices of a primitive do not make whole faces".into()))
    }
}

/// Number of indices of a primitive's corner, position of the vertex among them, and the `<vertices>`.
fn vertex_input<'a, 'input>(
    primitive: Node<'a, 'input>,
    find: Find<'_, 'a, 'input>,
) -> Result<(usize, usize, Node<'a, 'input>), Wrong> {
    /// A corner has a vertex, and perhaps a normal, some colors and textures.
    const MOST: u64 = 256;
    let (mut stride, mut vertices) = (0, None);
    for input in children(primitive, "input") {
        let offset = whole(input, "offset")?.unwrap_or(0);
        if offset >= MOST {
            return Err(wrong(input, damaged(format!("the offset {offset} of an input is too large"))));
        }
        stride = stride.max(offset as usize + 1);
        if input.attribute("semantic") == Some("VERTEX") {
            vertices = Some((offset as usize, find(input, "source", "vertices")?));
        }
    }
    let missing = || wrong(primitive, damaged("a primitive without an input of vertices".into()));
    let (offset, vertices) = vertices.ok_or_else(missing)?;
    Ok((stride, offset, vertices))
}

/// Positions of x, y and z among the numbers of an element: those that are named so, or the first three.
fn axes(accessor: Node<'_, '_>) -> [usize; 3] {
    let names: Vec<Option<&str>> =
        accessor.children().filter(|&child| named(child, "param")).map(|child| child.attribute("name")).collect();
    let found = ["X", "Y", "Z"].map(|axis| names.iter().position(|&name| name == Some(axis)));
    match found {
        [Some(x), Some(y), Some(z)] => [x, y, z],
        _ => [0, 1, 2],
    }
}

/// An attribute that is a whole number, if it is there.
fn whole(node: Node<'_, '_>, attribute: &str) -> Result<Option<u64>, Wrong> {
    let Some(text) = node.attribute(attribute) else { return Ok(None) };
    text.trim().parse().map(Some).map_err(|_| {
        let shown: String = text.chars().take(40).collect();
        wrong(node, damaged(format!("the {attribute} {shown:?} is not a whole number")))
    })
}
