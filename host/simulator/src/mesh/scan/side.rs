//! The side of a surface on which outside is, for each of its points.
//!
//! Normals say it, or the places of sensors; without either, or where they contradict each other, neighbors do (Hoppe et al.,
//! *Surface Reconstruction from Unorganized Points*, 1992): along a minimum spanning tree of edges between neighbors, a normal
//! points to the side of the one before it, as seen in the mirror between both (König and Gumhold, *Consistent Propagation of
//! Normal Orientations in Point Clouds*, 2009), so that normals follow the surface around its edges. The sign of the whole is
//! that of the sensor, or that of the volume. Winding numbers judge the result (Jacobson, Kavan and Sorkine-Hornung, *Robust
//! Inside-Outside Segmentation using Generalized Winding Numbers*, 2013).

use super::near::{Near, Neighbor, farthest};
use super::smooth;
use super::{Point, Points, Sensors};
use crate::error::MeshProblem;
use crate::mesh::facts::short;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Most nodes of the graph of neighbors.
const NODES: usize = 40_000;

/// Edges from each node to its neighbors.
const EDGES: usize = 10;

/// Least cosine between the normals of neighbors that say something about each other's side.
const PARALLEL: f64 = 0.8;

/// Nodes about which the surface winds, to know if it is right side out.
const SAMPLES: usize = 300;

/// Least mean winding number of a surface that encloses something; a half if all of it is right side out.
const WINDING: f64 = 0.15;

/// Largest length of the sum of all normals, in the area, of a surface that closes.
const CLOSED: f64 = 0.25;

/// Least such length of a surface that was seen from one side.
const OPEN: f64 = 0.5;

/// Largest share of points behind others, as seen from the sensor: those at edges and on steep sides.
const HIDDEN: f64 = 0.2;

/// Largest share of directions that may be wrong without a word.
const FEW: f64 = 0.02;

/// Directions outward, and notes on how they were found.
pub(super) struct Sides {
    pub(super) outward: Vec<DVec3>,
    pub(super) notes: Vec<String>,
}

/// The outward directions of points at these places, which are counted from `offset`.
pub(super) fn sides(points: &Points, places: &[DVec3], offset: DVec3) -> Result<Sides, MeshProblem> {
    let Points { measured: points, sensors, .. } = points;
    let is_unset = *sensors == Sensors::Points && points.iter().all(|point| point.viewpoint == Some([0.0; 3]));
    let is_default = is_unset || *sensors == Sensors::Default;
    let is_image = *sensors == Sensors::Images;
    let mut given: Vec<Option<DVec3>> =
        points.iter().map(|point| point.normal.and_then(|normal| DVec3::from(normal).try_normalize())).collect();
    let low = places.iter().fold(DVec3::INFINITY, |low, &place| low.min(place));
    let high = places.iter().fold(DVec3::NEG_INFINITY, |high, &place| high.max(place));
    let seen = |(point, &place): (&Point, &DVec3)| {
        let eye = point.viewpoint.map(|eye| DVec3::from(eye) - offset)?;
        // A sensor among the points is a default that nobody set.
        let is_outside = eye.cmplt(low).any() || eye.cmpgt(high).any();
        (is_outside || is_image).then(|| (eye - place).try_normalize())?
    };
    let seen: Option<Vec<DVec3>> = points.iter().zip(places).map(seen).collect();
    let eye = points.first().and_then(|point| point.viewpoint).map(|eye| DVec3::from(eye) - offset);
    let several = points.windows(2).any(|pair| pair[0].viewpoint != pair[1].viewpoint);
    if let Some(outward) = seen.as_ref().filter(|_| (several || is_image) && given.iter().all(Option::is_none)) {
        return Ok(Sides { outward: outward.clone(), notes: Vec::new() });
    }

    let mut notes = Vec::new();
    let graph = Graph::new(places, &mut given, &mut notes);
    let own = (2 * given.iter().flatten().count() >= points.len()).then(|| completed(&given, places));
    let viewed: Option<Vec<DVec3>> = seen.as_deref().map(|seen| match &own {
        Some(own) => own.iter().zip(seen).map(|(&normal, seen)| toward(normal, *seen)).collect(),
        None => seen.to_vec(),
    });
    let [seen_at, own_at, viewed_at] =
        [&seen, &own, &viewed].map(|values| values.as_deref().map(|values| graph.at(values)));
    // A default says nothing against normals.
    let sensor = seen_at.as_deref().filter(|_| own.is_none() || !is_default);
    let by_neighbors = graph.by_neighbors(sensor, own_at.as_deref(), is_default);
    let is_known = by_neighbors.is_signed && !by_neighbors.judged.is_split && by_neighbors.judged.is_sure();
    let is_good = |outward: &[DVec3]| {
        let judged = graph.judged(outward);
        by_neighbors.is_alike(outward)
            || (!judged.is_split
                && judged.is_sure()
                && (!is_known || judged.winding >= 0.9 * by_neighbors.judged.winding))
    };
    match (own, viewed) {
        (Some(own), Some(viewed)) if !is_default && viewed_at.as_deref().is_some_and(is_good) => {
            let turned = differ(&own, &viewed);
            if turned > 0.0 {
                notes.push(format!("normals disagree with the viewpoint: {} turned", percent(turned)));
            }
            Ok(Sides { outward: viewed, notes })
        }
        (Some(own), viewed) if own_at.as_deref().is_some_and(is_good) => {
            if let Some(viewed) = viewed.filter(|_| !is_default) {
                let turned = percent(differ(&own, &viewed));
                notes.push(format!(
                    "normals disagree with the viewpoint at {turned} of the points, and agree with each other: they decide"
                ));
            }
            Ok(Sides { outward: own, notes })
        }
        (Some(own), _) if is_known => {
            let outward = graph.spread(&by_neighbors.outward, &given, places);
            let turned = differ(&own, &outward);
            notes.push(match turned > 0.99 {
                true => "all normals point inward: they are turned".into(),
                false => format!("normals have no common side: {} turned to that of their neighbors", percent(turned)),
            });
            Ok(Sides { outward, notes })
        }
        (None, Some(viewed)) if eye.is_some_and(|eye| graph.hidden(eye) <= HIDDEN) => {
            Ok(Sides { outward: viewed, notes })
        }
        (None, viewed) if is_known => {
            notes.push(
                match viewed {
                    Some(_) => {
                        "not all points can be seen from the viewpoint: their neighbors say which side is outside"
                    }
                    None => "without normals and viewpoints, the points' neighbors say which side is outside",
                }
                .into(),
            );
            Ok(Sides { outward: graph.spread(&by_neighbors.outward, &given, places), notes })
        }
        (None, Some(viewed)) if !is_default => {
            let hidden = eye.map_or(0.0, |eye| graph.hidden(eye));
            notes.push(format!(
                "{} of the points lie behind others, as seen from the viewpoint: is it right?",
                percent(hidden)
            ));
            Ok(Sides { outward: viewed, notes })
        }
        _ => Err(MeshProblem::NoSide),
    }
}

fn toward(normal: DVec3, seen: DVec3) -> DVec3 {
    if normal.dot(seen) < 0.0 { -normal } else { normal }
}

/// Share of directions that point to the other side.
fn differ(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).filter(|(a, b)| a.dot(**b) < 0.0).count() as f64 / a.len() as f64
}

fn percent(share: f64) -> String {
    format!("{} %", short(100.0 * share))
}

/// An edge between neighbors.
struct Edge {
    ends: [u32; 2],
    /// Cosine between their normals, one of them seen in the mirror between both: its sign says if they point to the same
    /// side.
    agreement: f64,
}

/// Planes of some of the points, and edges between neighbors.
struct Graph {
    /// The points' numbers.
    nodes: Vec<usize>,
    places: Vec<DVec3>,
    /// Their feet on the planes: less noisy, and worse where a sheet is thin.
    feet: Vec<DVec3>,
    /// Unit normals, whose signs mean nothing.
    normals: Vec<DVec3>,
    areas: Vec<f64>,
    /// Neighbors by place, and by foot.
    pairs: [Vec<[usize; 2]>; 2],
}

/// Normals that the neighbors agree on.
struct ByNeighbors {
    outward: Vec<DVec3>,
    /// Parts of the graph: the sign of each is known less well than those within it.
    parts: Vec<Vec<usize>>,
    /// True if the signs of most parts are known.
    is_signed: bool,
    judged: Judged,
}

/// Quality of outward directions.
struct Judged {
    winding: f64,
    openness: f64,
    /// True if neighbors often point to opposite sides.
    is_split: bool,
    /// True if they do, and lie apart, each on its own side, as those of a thin sheet do.
    is_thin: bool,
}

impl Judged {
    fn is_sure(&self) -> bool {
        self.winding >= WINDING || self.openness >= OPEN || self.is_thin
    }
}

impl Graph {
    /// The graph of points. Normals of the file that do not stand on the surface are forgotten.
    fn new(places: &[DVec3], given: &mut [Option<DVec3>], notes: &mut Vec<String>) -> Self {
        let near = Near::new(places);
        let count = smooth::neighbors_of_planes(&near, places);
        let step = places.len().div_ceil(NODES);
        let plane = |index: usize, near: &[Neighbor]| {
            let farthest = farthest(near).max(f64::MIN_POSITIVE);
            let (middle, spread) = smooth::spread(near, farthest, places);
            let (_, normal) = smooth::least_axis(spread);
            let area = std::f64::consts::PI * farthest / near.len() as f64;
            let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
            // Neighbors spread along the surface, and less along its normal than in the mean of all directions.
            let stands = given[index].map(|given| given.dot(spread * given) < 0.25 * trace);
            (index, (places[index] + normal * (middle - places[index]).dot(normal), normal, area, stands))
        };
        let mut planes = near.some(|index| index % step == 0, count, 1, |_, _| true, plane);
        planes.sort_unstable_by_key(|(index, _)| *index);
        let standing: Vec<bool> = planes.iter().filter_map(|(_, (.., stands))| *stands).collect();
        // Of random directions a third stands on a plane by chance, and half on a wire.
        if 10 * standing.iter().filter(|stands| **stands).count() < 6 * standing.len() {
            given.fill(None);
            notes.push("the normals do not stand on the surface, and are not used".into());
        }
        let is_smooth = count == smooth::FEWEST;
        let normal = |index: usize, plane: DVec3| given[index].filter(|_| is_smooth).unwrap_or(plane);
        let nodes: Vec<usize> = planes.iter().map(|(index, _)| *index).collect();
        let places: Vec<DVec3> = nodes.iter().map(|&node| places[node]).collect();
        let feet: Vec<DVec3> = planes.iter().map(|(_, (foot, ..))| *foot).collect();
        Self {
            pairs: [pairs(&places), pairs(&feet)],
            nodes,
            places,
            feet,
            normals: planes.iter().map(|(index, (_, plane, ..))| normal(*index, *plane)).collect(),
            areas: planes.iter().map(|(_, (_, _, area, _))| *area * step as f64).collect(),
        }
    }

    /// Values of points at the nodes.
    fn at(&self, values: &[DVec3]) -> Vec<DVec3> {
        self.nodes.iter().map(|&node| values[node]).collect()
    }

    /// The better one of the normals that neighbors by place and by foot agree on.
    fn by_neighbors(&self, seen: Option<&[DVec3]>, own: Option<&[DVec3]>, is_default: bool) -> ByNeighbors {
        let [by_place, by_foot] = &self.pairs;
        let [one, other] = [(&self.places, by_place), (&self.feet, by_foot)]
            .map(|(places, pairs)| self.signed(self.oriented(places, pairs), seen, own, is_default));
        if other.judged.winding > one.judged.winding { other } else { one }
    }

    /// Normals that agree along the surest edges between neighbors, those of a spanning tree, and between its parts along
    /// most of them; and the parts that are left, whose signs are not known.
    fn oriented(&self, places: &[DVec3], pairs: &[[usize; 2]]) -> (Vec<DVec3>, Vec<Vec<usize>>) {
        let edge = |ends: [usize; 2]| {
            let [normal, other] = ends.map(|end| self.normals[end]);
            let between = (places[ends[1]] - places[ends[0]]).try_normalize();
            let mirrored = between.map_or(normal, |between| normal - 2.0 * normal.dot(between) * between);
            Edge { ends: ends.map(|end| end as u32), agreement: mirrored.dot(other) }
        };
        let mut edges: Vec<Edge> = pairs.iter().copied().map(edge).collect();
        edges.sort_unstable_by(|a, b| b.agreement.abs().total_cmp(&a.agreement.abs()).then(a.ends.cmp(&b.ends)));
        let mut signs = Signs::new(self.nodes.len());
        let surest = edges.partition_point(|edge| edge.agreement.abs() > PARALLEL);
        for Edge { ends: [one, two], agreement } in &edges[..surest] {
            signs.join(*one, *two, *agreement < 0.0);
        }
        loop {
            let mut votes: BTreeMap<(u32, u32), f64> = BTreeMap::new();
            for Edge { ends, agreement } in &edges {
                let [(one, is_turned), (two, is_other_turned)] = ends.map(|end| signs.first(end));
                if one != two {
                    let vote = if is_turned == is_other_turned { *agreement } else { -agreement };
                    *votes.entry((one.min(two), one.max(two))).or_default() += vote;
                }
            }
            let mut votes: Vec<_> = votes.into_iter().collect();
            votes.sort_by(|(a, one), (b, two)| two.abs().total_cmp(&one.abs()).then(a.cmp(b)));
            let mut is_changed = false;
            for ((one, two), vote) in votes {
                // Votes on parts that have been joined in this round are counted again in the next one.
                if signs.first(one).0 == one && signs.first(two).0 == two {
                    is_changed |= signs.join(one, two, vote < 0.0);
                }
            }
            if !is_changed {
                break;
            }
        }
        let mut parts: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        let mut outward = self.normals.clone();
        for (index, normal) in outward.iter_mut().enumerate() {
            let (first, is_turned) = signs.first(index as u32);
            parts.entry(first).or_default().push(index);
            if is_turned {
                *normal = -*normal;
            }
        }
        (outward, parts.into_values().collect())
    }

    /// Gives each part the sign of the sensor, of the volume if the part is closed, or of most normals of the file.
    fn signed(
        &self,
        (mut outward, parts): (Vec<DVec3>, Vec<Vec<usize>>),
        seen: Option<&[DVec3]>,
        own: Option<&[DVec3]>,
        is_default: bool,
    ) -> ByNeighbors {
        let mut unknown = 0;
        for part in &parts {
            let most = |of: Option<&[DVec3]>| {
                let votes = part.iter().filter_map(|&node| Some(of?[node].dot(outward[node])));
                votes.fold([0.0, 0.0], |[sum, all], vote| [sum + vote, all + vote.abs()])
            };
            let ([view, views], [normal, normals]) = (most(seen), most(own));
            let [openness, volume] = self.enclosed(&outward, part);
            let sign = if view.abs() > views * if is_default { 0.9 } else { 0.5 } {
                view
            } else if openness < CLOSED {
                volume
            } else if normal.abs() > 0.2 * normals {
                normal
            } else {
                unknown += part.len();
                volume
            };
            if sign < 0.0 {
                part.iter().for_each(|&node| outward[node] = -outward[node]);
            }
        }
        let judged = self.judged(&outward);
        ByNeighbors { outward, parts, is_signed: 10 * unknown <= self.nodes.len(), judged }
    }

    /// The length of the sum of some nodes' normals, in their area, which is 0 for a closed surface and 1 for a plane; and
    /// the volume, up to a factor.
    fn enclosed(&self, outward: &[DVec3], some: &[usize]) -> [f64; 2] {
        let area: f64 = some.iter().map(|&node| self.areas[node]).sum();
        let middle = some.iter().map(|&node| self.places[node] * self.areas[node]).sum::<DVec3>() / area;
        let sum: DVec3 = some.iter().map(|&node| outward[node] * self.areas[node]).sum();
        let volume = some.iter().map(|&node| (self.places[node] - middle).dot(outward[node]) * self.areas[node]).sum();
        [sum.length() / area, volume]
    }

    fn judged(&self, outward: &[DVec3]) -> Judged {
        let (mut parallel, mut opposite, mut apart) = (0, 0.0, 0.0);
        for &[one, two] in &self.pairs[0] {
            let cosine = outward[one].dot(outward[two]);
            parallel += usize::from(cosine.abs() > PARALLEL);
            if cosine < -PARALLEL {
                opposite += 1.0;
                let between = self.places[one] - self.places[two];
                let height = between.dot(outward[one] - outward[two]) / (2.0 * between.length());
                apart += f64::from(i8::from(height > 0.01) - i8::from(height < -0.01));
            }
        }
        let share = opposite / parallel.max(1) as f64;
        // Of normals turned at random as many lie apart as on the wrong sides of each other.
        let apart = apart / f64::max(opposite, 1.0);
        let all: Vec<usize> = (0..self.nodes.len()).collect();
        let [openness, _] = self.enclosed(outward, &all);
        Judged {
            winding: self.winding(outward),
            openness,
            is_split: share * (1.0 - 5.0 * apart) > 0.2,
            is_thin: share > 0.05 && apart > 0.3,
        }
    }

    /// The mean winding number of the surface about some of its nodes.
    fn winding(&self, outward: &[DVec3]) -> f64 {
        let samples: Vec<DVec3> = self.places.iter().step_by(self.nodes.len().div_ceil(SAMPLES)).copied().collect();
        let around = |&sample: &DVec3| -> f64 {
            let nodes = self.places.iter().zip(outward).zip(&self.areas);
            let angle = |((place, normal), area): ((&DVec3, &DVec3), &f64)| {
                let between = *place - sample;
                let squared = between.length_squared();
                // The closest ones are in the plane of the sample, as far as noise lets them.
                if squared > *area { area * between.dot(*normal) / (squared * squared.sqrt()) } else { 0.0 }
            };
            nodes.map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
        };
        let all: Vec<f64> = samples.par_iter().map(around).collect();
        all.iter().sum::<f64>() / all.len() as f64
    }

    /// Share of nodes that lie far behind others, as seen from a place.
    fn hidden(&self, eye: DVec3) -> f64 {
        let middle = self.places.iter().sum::<DVec3>() / self.places.len() as f64;
        let Some(ahead) = (middle - eye).try_normalize() else { return 1.0 };
        let (right, down) = ahead.any_orthonormal_pair();
        let seen: Vec<DVec3> = self.places.iter().map(|place| *place - eye).collect();
        let seen: Vec<DVec3> = seen
            .iter()
            .map(|at| DVec3::new(at.dot(right) / at.dot(ahead), at.dot(down) / at.dot(ahead), at.dot(ahead)))
            .collect();
        let low = seen.iter().fold(DVec3::INFINITY, |low, &at| low.min(at));
        let size = seen.iter().fold(DVec3::NEG_INFINITY, |high, &at| high.max(at)) - low;
        // A place among the points sees in all directions.
        if low.z <= 0.0 {
            return 1.0;
        }
        // Some four nodes in a cell.
        let cell = (4.0 * size.x * size.y / seen.len() as f64).sqrt().max(f64::MIN_POSITIVE);
        let number = |at: &DVec3| [at.x - low.x, at.y - low.y].map(|distance| (distance / cell) as u64);
        let mut nearest: BTreeMap<[u64; 2], f64> = BTreeMap::new();
        for at in &seen {
            let depth = nearest.entry(number(at)).or_insert(at.z);
            *depth = depth.min(at.z);
        }
        let hidden = seen.iter().filter(|at| at.z > nearest.get(&number(at)).copied().unwrap_or(at.z) + 0.3 * size.z);
        hidden.count() as f64 / seen.len() as f64
    }

    /// Outward directions of all points by those of the nodes: normals of the file, turned to the side of the nearest node.
    fn spread(&self, outward: &[DVec3], given: &[Option<DVec3>], places: &[DVec3]) -> Vec<DVec3> {
        let near = Near::new(&self.places);
        let at = |(place, given): (&DVec3, &Option<DVec3>)| {
            let node = near.nearest_one(*place).map_or(DVec3::Z, |node| outward[node]);
            given.map_or(node, |given| toward(given, node))
        };
        places.par_iter().zip(given).map(at).collect()
    }
}

/// Pairs of neighbors.
fn pairs(places: &[DVec3]) -> Vec<[usize; 2]> {
    let neighbors = Near::new(places).each(
        EDGES + 1,
        1,
        |_, _| true,
        |index, near| near.iter().map(|(_, other)| *other as usize).filter(|other| *other != index).collect::<Vec<_>>(),
    );
    let pairs = neighbors.iter().enumerate().flat_map(|(one, others)| {
        // A pair that both have is taken once.
        let is_new = |two: &usize| one < *two || !neighbors[*two].contains(&one);
        others.iter().copied().filter(is_new).map(move |two| [one, two]).collect::<Vec<_>>()
    });
    pairs.collect()
}

/// Normals of a file, with those of the nearest points where it has none.
fn completed(given: &[Option<DVec3>], places: &[DVec3]) -> Vec<DVec3> {
    let known: Vec<usize> = (0..given.len()).filter(|&index| given[index].is_some()).collect();
    let near = Near::new(&known.iter().map(|&index| places[index]).collect::<Vec<_>>());
    let nearest = |(own, place): (&Option<DVec3>, &DVec3)| own.or_else(|| given[known[near.nearest_one(*place)?]]);
    given.iter().zip(places).filter_map(nearest).collect()
}

impl ByNeighbors {
    /// True if others have the same directions, except for few and for the signs of small parts.
    fn is_alike(&self, outward: &[DVec3]) -> bool {
        let turned = |node: &&usize| self.outward[**node].dot(outward[**node]) < 0.0;
        let counts: Vec<[usize; 2]> =
            self.parts.iter().map(|part| [part.iter().filter(turned).count(), part.len()]).collect();
        let differ: usize = counts.iter().map(|[turned, all]| *turned.min(&(all - turned))).sum();
        let turned: usize = counts.iter().map(|[turned, _]| *turned).sum();
        differ as f64 <= FEW * outward.len() as f64 && 2 * turned <= outward.len()
    }
}

/// Sets of nodes whose directions are known up to a common sign.
struct Signs {
    above: Vec<u32>,
    is_turned: Vec<bool>,
}

impl Signs {
    fn new(count: usize) -> Self {
        Self { above: (0..count as u32).collect(), is_turned: vec![false; count] }
    }

    /// The first of a node's set, and whether the node is turned against it.
    fn first(&mut self, node: u32) -> (u32, bool) {
        let (mut at, mut is_turned) = (node, false);
        while self.above[at as usize] != at {
            let above = self.above[at as usize];
            // Halves the path to the first.
            let beyond = self.above[above as usize];
            if beyond != above {
                self.is_turned[at as usize] ^= self.is_turned[above as usize];
                self.above[at as usize] = beyond;
            }
            is_turned ^= self.is_turned[at as usize];
            at = self.above[at as usize];
        }
        (at, is_turned)
    }

    /// Joins the sets of two nodes, turned against each other or not; false if they are in one set already.
    fn join(&mut self, one: u32, two: u32, is_turned: bool) -> bool {
        let [(one, first), (two, second)] = [one, two].map(|node| self.first(node));
        if one != two {
            self.above[one.max(two) as usize] = one.min(two);
            self.is_turned[one.max(two) as usize] = is_turned ^ first ^ second;
        }
        one != two
    }
}
