//! The game on a table.

use crate::table::{Table, index};
use palpate::glam::{DMat3, DVec3};
use palpate::locate::{Approach, Lying, Maps, Real, Standing, World};
use palpate::onboard::Verdict;
use palpate::play::{Hidden, decompress};
use palpate::probe::Probe;
use palpate::probe::Scene;
use std::f64::consts::TAU;
use std::sync::Arc;

impl Table {
    pub(crate) fn lay(&mut self, object: u32, weight: f64) -> Option<usize> {
        let object = index(object);
        let (numbers, name) = self.input.split_at_checked(72)?;
        let numbers: Vec<f64> = numbers.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        let rotation = DMat3::from_cols_slice(&numbers);
        let placement = String::from_utf8(name.to_vec()).ok()?;
        let (mesh, length) = (self.meshes.get(object)?, *self.lengths.get(object)?);
        let lying = Lying::new(Arc::new(Scene::new(mesh, length).ok()?), rotation, placement, weight);
        let [from, to] = mesh.bounds().map(|corner| corner.as_dvec3());
        let scale = length / (to - from).max_element();
        let exact = |vertex: &[f32; 3]| DVec3::from(vertex.map(f64::from));
        let turned = |vertex: &[f32; 3]| rotation * (exact(vertex) - (from + to) / 2.0) * scale;
        let placed: Vec<_> = mesh.vertices.iter().map(turned).collect();
        let low = placed.iter().copied().reduce(|low, at| low.min(at))?;
        // The middle of its box is over the origin, its lowest point on the table.
        let corner = -lying.half();
        self.output = placed
            .iter()
            .flat_map(|at| {
                let [x, y, _] = (*at - low + corner).to_array();
                [x, y, at.z - low.z]
            })
            .collect();
        self.press.standing.get_mut(object)?.placements.push(lying);
        Some(self.output.len())
    }

    pub(crate) fn open_maps(&mut self, [height, position, lost, drift, drift_yaw]: [f64; 5]) -> Option<usize> {
        // A page is one game, and its maps and objects are there as long as the page is.
        let maps = Maps::new(Vec::leak(decompress(&self.input)?)).ok()?;
        let press = &mut self.press;
        let standing: &'static [Standing] = Vec::leak(std::mem::take(&mut press.standing));
        if standing.is_empty() || standing.iter().any(|object| object.placements.is_empty()) {
            return None;
        }
        let probe: &'static Probe = Box::leak(Box::new(press.probe));
        let real = Real { height, position, lost, drift, drift_yaw, ..Real::default() };
        let range = f64::from(maps.range()) / 1e3 - 1.0;
        press.opened = Some((World { standing, probe, real, range, seed: 0 }, maps));
        Some(0)
    }

    pub(crate) fn hide(&mut self, object: u32, seed: u32) -> Option<usize> {
        let (world, maps) = self.press.opened?;
        let world = World { seed: seed.into(), ..world };
        self.press.hidden = Some(Hidden::new(&world, maps, object.into())?);
        Some(0)
    }

    pub(crate) fn choose(&mut self) -> Option<usize> {
        let Approach { x, y, roll } = self.press.hidden.as_mut()?.choose();
        self.output = vec![f64::from(x) / 1e3, f64::from(y) / 1e3, roll.into()];
        Some(0)
    }

    pub(crate) fn press(&mut self, x: f64, y: f64, roll: u32) -> Option<usize> {
        // Saturates, and wraps around a turn.
        let [x, y] = [x, y].map(|millimeters| (millimeters * 1e3) as i32);
        let [roll, ..] = roll.to_le_bytes();
        let pressed = self.press.hidden.as_mut()?.press(Approach { x, y, roll })?;
        self.output = pressed.heights.map(|height| height.unwrap_or(f64::NAN)).to_vec();
        self.output.push(pressed.lowest);
        Some(0)
    }

    pub(crate) fn belief(&mut self) -> Option<usize> {
        let ((world, maps), hidden) = (self.press.opened?, self.press.hidden.as_ref()?);
        let locating = &hidden.locating;
        let verdict = match locating.verdict() {
            Verdict::Undecided => 0,
            Verdict::Recognized { .. } => 1,
            Verdict::Unknown => 2,
            Verdict::GaveUp => 3,
        };
        self.output = vec![f64::from(verdict), locating.best() as f64, locating.touches() as f64];
        self.output.extend(locating.posteriors());
        let ghosts = hidden.ghosts();
        for ghost in &ghosts {
            let pose = &ghost.pose;
            let name = maps.placement_name(pose.placement);
            let placements = &world.standing.get(ghost.object)?.placements;
            let placement = placements.iter().position(|lying| lying.name == name)?;
            let [x, y] = pose.position.map(|micrometers| f64::from(micrometers) / 1e3);
            let [within_x, within_y] = pose.within.map(|micrometers| f64::from(micrometers) / 1e3);
            let radians = |turn: u16| f64::from(turn) / 65_536.0 * TAU;
            let turns = pose.yaw_within.map(|within| [pose.yaw, within].map(radians));
            let [yaw, within_yaw] = turns.unwrap_or([f64::NAN; 2]);
            let found = [ghost.object as f64, placement as f64, x, y, yaw, ghost.share, within_x, within_y, within_yaw];
            self.output.extend(found);
        }
        Some(ghosts.len())
    }

    pub(crate) fn truth(&mut self) -> Option<usize> {
        let truth = self.press.hidden.as_ref()?.truth();
        let [x, y] = truth.place;
        self.output = vec![truth.object as f64, truth.placement as f64, x, y, truth.yaw];
        Some(0)
    }
}
