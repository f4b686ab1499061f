//! The side of a surface on which outside is, for each of its points.
//!
//! Normals say it, or the places of sensors; without either, or where they contradict each other, neighbors do (Hoppe et al.,
//! *Surface Reconstruction from Unorganized Points*, 1992): along a minimum spanning tree of edges between neighbors, a normal
//! points to the side of the one before it, as seen in the mirror between both (König and Gumhold, *Consistent Propagation of
//! Normal Orientations in Point Clouds*, 2009), so that normals follow the surface around its edges. The sign of the whole is
//! that of the sensor, or that of the volume.

use super::near::{Near, farthest};
use super::smooth::{self, FEWEST};
use super::{Point, Points, Sensors};
use crate::error::MeshProblem;
use crate::mesh::facts::short;
use glam::DVec3;
use std::collections::BTreeMap;

/// Edges from each point to its neighbors.
const EDGES: usize = 10;

/// Least agreement of neighbors' planes, as a cosine, at which their normals say something about each other.
const SURE: f64 = 0.8;

/// Largest share of points whose outward directions may be wrong without a word.
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
    let mut normals: Vec<Option<DVec3>> =
        points.iter().map(|point| point.normal.and_then(|normal| DVec3::from(normal).try_normalize())).collect();
    let low = places.iter().fold(DVec3::INFINITY, |low, &place| low.min(place));
    let high = places.iter().fold(DVec3::NEG_INFINITY, |high, &place| high.max(place));
    let seen = |(point, &place): (&Point, &DVec3)| {
        let eye = point.viewpoint.map(|eye| DVec3::from(eye) - offset)?;
        // A sensor among the points is a default that nobody set.
        let is_outside = eye.cmplt(low).any() || eye.cmpgt(high).any();
        (is_outside || is_image).then(|| (eye - place).try_normalize())?
    };
    let seen: Vec<Option<DVec3>> = points.iter().zip(places).map(seen).collect();
    let share = |count: usize| count as f64 / points.len() as f64;
    let is_seen = seen.iter().all(Option::is_some);
    let several = points.windows(2).any(|pair| pair[0].viewpoint != pair[1].viewpoint);
    if normals.iter().all(Option::is_none) && is_seen && (several || is_image) {
        return Ok(Sides { outward: seen.into_iter().flatten().collect(), notes: Vec::new() });
    }
    let mut notes = Vec::new();
    let graph = Graph::new(places, &mut normals, &mut notes);
    let by_neighbors = graph.oriented(places);
    let own = (2 * normals.iter().flatten().count() >= points.len()).then(|| graph.completed(&normals));
    let toward = |outward: &[DVec3]| -> Vec<DVec3> {
        let turn = |(&normal, seen): (&DVec3, &Option<DVec3>)| match seen {
            Some(seen) if normal.dot(*seen) < 0.0 => -normal,
            _ => normal,
        };
        outward.iter().zip(&seen).map(turn).collect()
    };
    let viewed = is_seen.then(|| toward(own.as_deref().unwrap_or(&by_neighbors.outward)));
    let differ = |a: &[DVec3], b: &[DVec3]| share(a.iter().zip(b).filter(|(a, b)| a.dot(**b) < 0.0).count());
    // Normals without a side, up to the sign of each part.
    let contradict = |outward: &[DVec3]| {
        by_neighbors.differ(outward) > FEW
            && graph.conflicts(places, outward) > 2 * graph.conflicts(places, &by_neighbors.outward)
    };
    match (own, viewed) {
        (Some(own), Some(viewed)) if !is_default && !contradict(&viewed) => {
            let turned = differ(&own, &viewed);
            if turned > 0.0 {
                notes.push(format!("normals disagree with the viewpoint: {} turned", percent(turned)));
            }
            Ok(Sides { outward: viewed, notes })
        }
        (Some(own), viewed) if !contradict(&own) => {
            if let Some(viewed) = viewed.filter(|_| !is_default) {
                let turned = percent(differ(&own, &viewed));
                notes.push(format!(
                    "normals disagree with the viewpoint at {turned} of the points, and agree with each other: they decide"
                ));
            }
            Ok(graph.right_side_out(places, own, notes))
        }
        (None, Some(viewed)) if !contradict(&viewed) => {
            Ok(Sides { outward: seen.into_iter().flatten().collect(), notes })
        }
        (own, _) => {
            let outward = graph
                .signed(places, by_neighbors, &seen, own.as_deref(), is_default)
                .filter(|outward| graph.conflicts(places, outward) as f64 <= 0.05 * graph.edges.len() as f64)
                .ok_or(MeshProblem::NoSide)?;
            notes.push(match own {
                Some(own) => format!(
                    "normals have no common side: {} turned to that of their neighbors",
                    percent(differ(&own, &outward))
                ),
                None if is_seen => {
                    "the viewpoint cannot have seen all points: their neighbors say which side is outside".into()
                }
                None => "without normals and viewpoints, the points' neighbors say which side is outside".into(),
            });
            Ok(Sides { outward, notes })
        }
    }
}

fn percent(share: f64) -> String {
    format!("{} %", short(100.0 * share))
}

/// An edge between neighbors.
struct Edge {
    ends: [u32; 2],
    /// Cosine between their planes' normals, one of them seen in the mirror between both: its sign says if the normals point
    /// to the same side.
    agreement: f64,
}

/// Planes of points, and edges between neighbors.
struct Graph {
    /// Unit normals, whose signs mean nothing.
    normals: Vec<DVec3>,
    areas: Vec<f64>,
    edges: Vec<Edge>,
}

/// Directions that the neighbors agree on, up to the sign of each part of the graph.
struct Oriented {
    outward: Vec<DVec3>,
    /// The part of each point.
    parts: Vec<usize>,
    count: usize,
}

impl Graph {
    /// The graph of points; normals of a file are its planes' normals, unless they do not stand on the surface, when they are
    /// forgotten.
    fn new(places: &[DVec3], normals: &mut [Option<DVec3>], notes: &mut Vec<String>) -> Self {
        let plane = |_: usize, near: &[(f64, u32)]| {
            let farthest = farthest(near);
            let (_, _, normal) = smooth::plane(near, farthest.max(f64::MIN_POSITIVE), places);
            let mut near = near.to_vec();
            near.sort_unstable_by(|(a, i), (b, j)| a.total_cmp(b).then(i.cmp(j)));
            let neighbors: Vec<u32> = near.into_iter().skip(1).take(EDGES).map(|(_, other)| other).collect();
            (normal, farthest, neighbors)
        };
        let planes = Near::new(places).each(FEWEST, 1, |_, _| true, plane);
        let given = normals.iter().zip(&planes).filter_map(|(normal, plane)| Some(normal.as_ref()?.dot(plane.0).abs()));
        let (standing, all) =
            given.fold((0, 0), |(standing, all), cosine| (standing + usize::from(cosine > 0.5), all + 1));
        // Half of random directions stand on a surface by chance.
        if (standing as f64) < 0.6 * f64::from(all) {
            normals.fill(None);
            notes.push("the normals do not stand on the surface, and are not used".into());
        }
        let own: Vec<DVec3> = normals.iter().zip(&planes).map(|(normal, plane)| normal.unwrap_or(plane.0)).collect();
        let mut edges = Vec::with_capacity(EDGES * places.len());
        for (index, (_, _, neighbors)) in planes.iter().enumerate() {
            for &other in neighbors {
                let (one, two) = (index as u32, other);
                // An edge that both ends have is taken once.
                if one > two && planes[two as usize].2.contains(&one) {
                    continue;
                }
                let between = (places[two as usize] - places[index]).try_normalize();
                let normal = own[index];
                let mirrored = between.map_or(normal, |between| normal - 2.0 * normal.dot(between) * between);
                edges.push(Edge { ends: [one, two], agreement: mirrored.dot(own[two as usize]) });
            }
        }
        edges.sort_unstable_by(|a, b| b.agreement.abs().total_cmp(&a.agreement.abs()).then(a.ends.cmp(&b.ends)));
        Self { normals: own, areas: planes.into_iter().map(|plane| plane.1).collect(), edges }
    }

    /// Directions that agree along the surest edges: those of a spanning tree, and between its parts most of them.
    fn oriented(&self, places: &[DVec3]) -> Oriented {
        let mut signs = Signs::new(places.len());
        let surest = self.edges.partition_point(|edge| edge.agreement.abs() > SURE);
        for Edge { ends: [one, two], agreement } in &self.edges[..surest] {
            signs.join(*one, *two, *agreement < 0.0);
        }
        loop {
            let mut votes: BTreeMap<(u32, u32), f64> = BTreeMap::new();
            for Edge { ends, agreement } in &self.edges {
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
                // Votes of parts that have been joined in this round are counted again in the next one.
                if signs.first(one).0 == one && signs.first(two).0 == two {
                    is_changed |= signs.join(one, two, vote < 0.0);
                }
            }
            if !is_changed {
                break;
            }
        }
        let mut numbers = BTreeMap::new();
        let mut outward = Vec::with_capacity(places.len());
        let parts = (0..places.len() as u32).map(|index| {
            let (first, is_turned) = signs.first(index);
            let normal = self.normals[index as usize];
            outward.push(if is_turned { -normal } else { normal });
            let next = numbers.len();
            *numbers.entry(first).or_insert(next)
        });
        let parts = parts.collect();
        Oriented { outward, parts, count: numbers.len() }
    }

    /// Number of edges whose ends disagree. None where they lie apart, each on its own side: there a sheet has both.
    fn conflicts(&self, places: &[DVec3], outward: &[DVec3]) -> usize {
        let (mut all, mut apart) = (0, 0.0);
        for Edge { ends, agreement } in &self.edges {
            let [one, two] = ends.map(|end| end as usize);
            let is_same = self.normals[one].dot(outward[one]) * self.normals[two].dot(outward[two]) > 0.0;
            if agreement.abs() > SURE && is_same != (*agreement > 0.0) {
                all += 1;
                let between = places[one] - places[two];
                let height = between.dot(outward[one] - outward[two]) / (2.0 * between.length());
                apart += f64::from(i8::from(height > 0.1) - i8::from(height < -0.1));
            }
        }
        if apart > 0.2 * f64::from(all) { 0 } else { all as usize }
    }

    /// Directions of all points where some have none: that of the neighbors.
    fn completed(&self, normals: &[Option<DVec3>]) -> Vec<DVec3> {
        let mut known: Vec<f64> = normals.iter().map(|normal| f64::from(u8::from(normal.is_some()))).collect();
        while known.contains(&0.0) {
            let mut votes = vec![0.0; known.len()];
            for Edge { ends, agreement } in &self.edges {
                let [one, two] = ends.map(|end| end as usize);
                votes[one] += agreement * known[two];
                votes[two] += agreement * known[one];
            }
            let mut is_changed = false;
            for (sign, vote) in known.iter_mut().zip(votes) {
                if *sign == 0.0 && vote != 0.0 {
                    *sign = vote.signum();
                    is_changed = true;
                }
            }
            if !is_changed {
                known.iter_mut().filter(|sign| **sign == 0.0).for_each(|sign| *sign = 1.0);
            }
        }
        self.normals.iter().zip(known).map(|(normal, sign)| *normal * sign).collect()
    }

    /// Normals of a file, turned if they all point inward: if they close, and enclose less than nothing.
    fn right_side_out(&self, places: &[DVec3], outward: Vec<DVec3>, mut notes: Vec<String>) -> Sides {
        let [openness, volume] = self.enclosed(places, &outward, 0..places.len());
        if volume >= 0.0 {
            return Sides { outward, notes };
        }
        if openness > OPEN {
            notes.push("the normals point inward, as those of a hollow do".into());
            return Sides { outward, notes };
        }
        notes.push("all normals point inward: they are turned".into());
        Sides { outward: outward.into_iter().map(|normal| -normal).collect(), notes }
    }

    /// Length of the sum of normals, by the area of their points, in that area, which is 0 for a closed surface and 1 for a
    /// plane; and the volume, up to a factor.
    fn enclosed(
        &self,
        places: &[DVec3],
        outward: &[DVec3],
        chosen: impl Iterator<Item = usize> + Clone,
    ) -> [f64; 2] {
        let chosen = || chosen.clone();
        let area: f64 = chosen().map(|index| self.areas[index]).sum();
        let middle = chosen().map(|index| places[index] * self.areas[index]).sum::<DVec3>() / area;
        let sum: DVec3 = chosen().map(|index| outward[index] * self.areas[index]).sum();
        let volume = chosen().map(|index| (places[index] - middle).dot(outward[index]) * self.areas[index]).sum();
        [sum.length() / area, volume]
    }

    /// Outward directions, if the sign of most parts can be known: by a sensor, the volume of those that are closed, or most of
    /// the normals.
    fn signed(
        &self,
        places: &[DVec3],
        Oriented { mut outward, parts, count }: Oriented,
        seen: &[Option<DVec3>],
        own: Option<&[DVec3]>,
        is_default: bool,
    ) -> Option<Vec<DVec3>> {
        let mut members = vec![Vec::new(); count];
        parts.iter().enumerate().for_each(|(index, &part)| members[part].push(index));
        let mut unknown = 0;
        for members in &members {
            let most = |of: &dyn Fn(usize) -> Option<DVec3>| {
                let votes = members.iter().filter_map(|&index| Some(of(index)?.dot(outward[index])));
                votes.fold([0.0, 0.0], |[sum, all], vote| [sum + vote, all + vote.abs()])
            };
            let [view, views] = most(&|index| seen[index]);
            let [normal, all_normals] = most(&|index| own.map(|own| own[index]));
            let [openness, volume] = self.enclosed(places, &outward, members.iter().copied());
            let view_is_sure = views > 0.0 && view.abs() > if is_default { 0.9 } else { 0.5 } * views;
            let sign = if view_is_sure {
                view
            } else if openness < OPEN {
                volume
            } else if normal.abs() > 0.2 * all_normals {
                normal
            } else {
                unknown += members.len();
                volume
            };
            if sign < 0.0 {
                members.iter().for_each(|&index| outward[index] = -outward[index]);
            }
        }
        (10 * unknown <= places.len()).then_some(outward)
    }
}

/// Sum of normals over a surface's area, from which it is open.
const OPEN: f64 = 0.25;

impl Oriented {
    /// Share of points whose direction is another one, with the sign of each part that leaves the fewest.
    fn differ(&self, outward: &[DVec3]) -> f64 {
        let mut votes = vec![[0, 0]; self.count];
        for ((own, other), &part) in self.outward.iter().zip(outward).zip(&self.parts) {
            votes[part][usize::from(own.dot(*other) < 0.0)] += 1;
        }
        votes.iter().map(|[same, turned]| *same.min(turned)).sum::<usize>() as f64 / outward.len() as f64
    }
}

/// Sets of points whose directions are known up to a common sign.
struct Signs {
    above: Vec<u32>,
    is_turned: Vec<bool>,
}

impl Signs {
    fn new(count: usize) -> Self {
        Self { above: (0..count as u32).collect(), is_turned: vec![false; count] }
    }

    /// The first of a point's set, and whether the point is turned against it.
    fn first(&mut self, point: u32) -> (u32, bool) {
        let (mut at, mut is_turned) = (point, false);
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

    /// Joins the sets of two points, which are turned against each other or not; false if they are in one set.
    fn join(&mut self, one: u32, two: u32, is_turned: bool) -> bool {
        let [(one, first), (two, second)] = [one, two].map(|point| self.first(point));
        if one != two {
            self.above[one.max(two) as usize] = one.min(two);
            self.is_turned[one.max(two) as usize] = is_turned ^ first ^ second;
        }
        one != two
    }
}
