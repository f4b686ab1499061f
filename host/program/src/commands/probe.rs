//! Options for the probe and the sizes of objects.

use super::progress::Bar;
use super::real::only_captured;
use super::remark;
use palpate::capture;
use palpate::ensemble::StatedProbe;
use palpate::error::{Kind, problem};
use palpate::mesh::facts::sides;
use palpate::mesh::source::{self, Search};
use palpate::mesh::{BACKGROUND, Object, builtin};
use palpate::probe::file::ProbeFile;
use palpate::probe::noise::Noise;
use palpate::progress::Progress;
use palpate::touches::{Dataset, Origin};
use palpate::with;
use palpate::{Error, Result};
use palpate_shared::format::Length;
use std::cell::OnceCell;
use std::path::PathBuf;

/// The probe.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct ProbeArguments {
    /// The probe: published (the default), or a file that states it
    #[arg(long, value_name = "FILE", default_value = PUBLISHED, hide_default_value = true)]
    probe: PathBuf,
    /// Contents of the file, once they were read: a pipe cannot be read twice.
    #[arg(skip)]
    contents: OnceCell<ProbeFile>,
}

/// The name of the probe that needs no file.
const PUBLISHED: &str = "published";

impl ProbeArguments {
    /// The probe file; none for the published probe.
    fn path(&self) -> Option<&PathBuf> {
        Some(&self.probe).filter(|path| path.as_os_str() != PUBLISHED)
    }

    /// The error, with the probe file's name unless it names a file.
    pub(crate) fn named(&self, error: Error) -> Error {
        match self.path() {
            Some(path) => error.in_file(path),
            None => error,
        }
    }

    /// Contents of the file, if one is given.
    pub(crate) fn read(&self) -> Result<Option<ProbeFile>> {
        let Some(path) = self.path() else { return Ok(None) };
        let file = match self.contents.get() {
            Some(file) => *file,
            None => ProbeFile::read(path)?,
        };
        Ok(Some(*self.contents.get_or_init(|| file)))
    }

    /// The probe that a model of this data set states: that of the data set, or, where it states none, that of the file.
    ///
    /// # Errors
    /// If both state one and they differ.
    pub(crate) fn of_dataset(&self, file: Option<&ProbeFile>, dataset: &Dataset) -> Result<Option<StatedProbe>> {
        let own = StatedProbe::of(dataset);
        let Some(file) = file else { return Ok(own) };
        // A file says nothing of the scene.
        let scene = own.map(|own| own.scene).unwrap_or_default();
        let given = StatedProbe { probe: file.probe, unit: file.unit, scene, ..StatedProbe::default() };
        let name = self.path().map_or_else(String::new, |path| path.display().to_string());
        StatedProbe::compare_with([&name, "the data set"], Some(given.trained()), u32::MAX, dataset)?;
        // Recordings need not state the stroke that a file states.
        let stroke = given.probe.stroke.filter(|_| dataset.is_recorded());
        let own = own.map(|own| StatedProbe { probe: with!(own.probe, stroke = own.probe.stroke.or(stroke)), ..own });
        Ok(own.or(Some(given)))
    }

    /// Noise to add to the touches of a data set: the file's under `[real]`, without a file `usual`, and
    /// nothing where the touches were captured with such a file and have it already.
    ///
    /// # Errors
    /// If the data set was captured with another `[real]`.
    pub(crate) fn noise(&self, file: Option<&ProbeFile>, dataset: &Dataset, usual: Noise) -> Result<Noise> {
        let there = dataset.real();
        let asked = file.map(|file| file.real).filter(|real| !real.is_none());
        match asked {
            None if there.is_none() => Ok(usual),
            Some(real) if there.is_none() && real.grazing.is_none() => Ok(real),
            Some(_) if there.is_none() => Err(self.named(only_captured())),
            Some(real) if real != there => {
                let name = self.path().map_or_else(String::new, |path| path.display().to_string());
                Err(StatedProbe::differs([&name, "the data set"], &format!("[real]: {real}; and {there}")))
            }
            _ => Ok(Noise::default()),
        }
    }
}

/// The probe file, and whether objects keep their true sizes.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct SizeArguments {
    #[command(flatten)]
    pub(crate) probe: ProbeArguments,
    #[command(flatten)]
    pub(crate) units: UnitArguments,
}

/// True sizes of objects, and their instances.
#[derive(clap::Args, Clone, Debug, Default)]
pub(crate) struct UnitArguments {
    /// Objects keep their size, in mm: the unit of meshes that state none (mm, cm, m, in, NAME=cm), or stated
    #[arg(long, value_name = "UNIT,…", value_parser = mesh_unit, value_delimiter = ',')]
    true_size: Vec<MeshUnit>,
    /// Treat each subdirectory as one object, or make N variants of each built-in one
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "0", value_parser = instances)]
    instances: Option<usize>,
    /// Leave out bad meshes; also untouchable ones
    #[arg(long)]
    skip_bad: bool,
}

impl UnitArguments {
    /// The objects of the sources, with their true sizes as far as they are known.
    pub(crate) fn objects(&self, sources: &[String], seed: u64) -> Result<Vec<Object>> {
        let mut objects = reading(|| match self.instances {
            None => self.load(sources),
            Some(count) => self.of_instances(sources, count, seed),
        })?;
        tell(&objects);
        self.add_units(&mut objects)?;
        Ok(objects)
    }

    fn load(&self, sources: &[String]) -> Result<Vec<Object>> {
        let search = Search {
            instances: self.instances.is_some(),
            prefers_units: self.true_size.contains(&MeshUnit::Stated),
            skips_bad: self.skip_bad,
        };
        let loaded = source::load(sources, search)?;
        loaded.notes.iter().for_each(|note| remark(&format!("palpate: {note}")));
        Ok(loaded.objects)
    }

    fn of_instances(&self, sources: &[String], count: usize, seed: u64) -> Result<Vec<Object>> {
        if count == 0 {
            return self.load(sources);
        }
        let (mut objects, mut others) = (Vec::new(), Vec::new());
        let mut background = false;
        for source in sources {
            let names = builtin::names();
            match source.as_str() {
                "builtin" => objects.extend(names.map(String::from)),
                BACKGROUND if !std::path::Path::new(BACKGROUND).exists() => background = true,
                name if names.contains(&name) && !std::path::Path::new(name).exists() => objects.push(name.into()),
                _ => others.push(source.clone()),
            }
        }
        let varied = objects.iter().map(|name| builtin::instances(name, count, seed));
        let mut objects: Vec<Object> = varied.collect::<Result<_>>()?;
        if background {
            objects.push(builtin::background(count, seed)?);
        }
        if !others.is_empty() {
            objects.extend(self.load(&others)?);
        }
        objects.sort_by(|a, b| a.name.cmp(&b.name));
        match objects.windows(2).find(|pair| pair[0].name == pair[1].name) {
            Some(pair) => {
                let name = &pair[0].name;
                Err(source::same_name(name, ["builtin".into(), name.into()]))
            }
            None => Ok(objects),
        }
    }

    /// One object, with its true size, if known.
    pub(crate) fn object(&self, source: &str) -> Result<Object> {
        let mut object = [reading(|| source::object(source))?];
        tell(&object);
        self.add_units(&mut object)?;
        let [object] = object;
        Ok(object)
    }

    fn add_units(&self, objects: &mut [Object]) -> Result<()> {
        for unit in &self.true_size {
            match unit {
                MeshUnit::Stated => {}
                MeshUnit::Unstated(millimeters) => {
                    objects.iter_mut().for_each(|object| object.millimeters = object.millimeters.or(Some(*millimeters)))
                }
                MeshUnit::Of(name, millimeters) => {
                    let known = || objects.iter().map(|object| object.name.clone()).collect::<Vec<_>>().join(", ");
                    let Some(place) = objects.iter().position(|object| object.name == *name) else {
                        return Err(Error::setting("true_size", name, format!("the name of an object: {}", known())));
                    };
                    objects[place].millimeters = Some(*millimeters);
                }
            }
        }
        if !self.is_true_size() {
            return Ok(());
        }
        for object in &*objects {
            for instance in object.instances() {
                let of = if instance.name == object.name { String::new() } else { format!(", {}", instance.name) };
                let size = object.true_size(instance).map(|size| format!("{}{of}: {} mm", object.name, sides(size)));
                size.iter().for_each(|size| remark(size));
            }
        }
        let unknown = objects.iter().filter(|object| object.millimeters.is_none()).map(|object| object.name.as_str());
        match unknown.collect::<Vec<_>>().join(", ") {
            name if name.is_empty() => Ok(()),
            names => Err(problem!("{names}: the true size is unknown, because the mesh states no unit")
                .fix("State the unit of the mesh: mm, cm, m or in. See --true-size.")),
        }
    }

    /// Objects keep their true size, in the unit that each mesh states, unless the option says otherwise.
    pub(crate) fn imply_true_size(&mut self) {
        if self.true_size.is_empty() {
            self.true_size.push(MeshUnit::Stated);
        }
    }

    /// Objects keep their true size; a mesh that states no unit is in the built-in objects', unless the option says otherwise.
    pub(crate) fn imply_unit(&mut self) {
        if self.true_size.is_empty() {
            self.true_size.push(MeshUnit::Unstated(10.0));
        }
    }

    /// True if objects are touched at their true size.
    pub(crate) fn is_true_size(&self) -> bool {
        !self.true_size.is_empty()
    }
}

impl SizeArguments {
    /// The objects of the sources, with their true sizes as far as they are known.
    pub(crate) fn objects(&self, sources: &[String], seed: u64) -> Result<Vec<Object>> {
        self.units.objects(sources, seed)
    }

    /// One object, with its true size, if known.
    pub(crate) fn object(&self, source: &str) -> Result<Object> {
        self.units.object(source)
    }

    /// The objects without those that cannot be touched, if that is wanted.
    ///
    /// # Errors
    /// Errors of [`capture::untouchable`], and if no object is left.
    pub(crate) fn touchable(&self, objects: Vec<Object>, origin: &Origin) -> Result<Vec<Object>> {
        if !self.units.skip_bad {
            return Ok(objects);
        }
        let Some(error) = capture::untouchable(&objects, origin, &())? else { return Ok(objects) };
        let Kind::Untouchable { objects: bad, .. } = error.kind() else { return Err(error) };
        let is_bad = |object: &Object| bad.contains(&object.name);
        if objects.iter().all(is_bad) {
            return Err(error);
        }
        remark(&format!("palpate: left out: {}", error.what()));
        Ok(objects.into_iter().filter(|object| !is_bad(object)).collect())
    }

    /// Probe and unit of a capture: those of the file, or else of `base`.
    ///
    /// # Errors
    /// If the file cannot be used, or is in another unit than objects are touched in.
    pub(crate) fn origin(&self, base: Origin) -> Result<Origin> {
        let unit = if self.units.is_true_size() { Length::Millimeter } else { base.unit };
        let Some(file) = self.probe.read()? else { return Ok(Origin { unit, ..base }) };
        let problem = |message: &str| {
            let path = self.probe.path().cloned().unwrap_or_default();
            Err(ProbeFile::unusable(message).in_file(path))
        };
        match (unit, file.unit) {
            (Length::Tenth, Length::Millimeter) => {
                problem("its unit is mm, which needs objects at their true size (--true-size UNIT)")
            }
            (Length::Millimeter, Length::Tenth) => problem(
                "its unit is a tenth of the object's longest side, where objects have their true size (unit = \"mm\")",
            ),
            _ => Ok(Origin { probe: file.probe, unit, ..base }),
        }
    }

    /// True if objects are touched at their true size with a probe that was not stated: the published one is in units.
    pub(crate) fn lacks_probe(&self) -> bool {
        self.units.is_true_size() && self.probe.path().is_none()
    }
}

/// Source of a probe for objects at their true size.
pub(crate) const IN_MILLIMETERS: &str = "a file that states it in millimeters, since the published one is in units: such as \
     probe.toml with the lines unit = \"mm\", radius = 1.5, spacing = 15, speed = 100, one below the other";

/// Refuses objects at their true size without a probe.
pub(crate) fn refuse_unstated(size: &SizeArguments) -> Result<()> {
    match size.lacks_probe() {
        true => Err(Error::setting("probe", "not given", IN_MILLIMETERS)),
        false => Ok(()),
    }
}

/// Reads objects, and shows meanwhile that it goes on.
pub(super) fn reading<T>(read: impl FnOnce() -> T) -> T {
    let bar = Bar::new();
    bar.begin("reading objects", None);
    read()
}

/// Tells on stderr how objects were found and read, where that may surprise.
pub(super) fn tell(objects: &[Object]) {
    for object in objects {
        object.notes.iter().for_each(|note| remark(&format!("{}: {note}", object.name)));
    }
}

/// Units of meshes, and how many millimeters they are.
const UNITS: [(&str, f64); 4] = [("mm", 1.0), ("cm", 10.0), ("m", 1_000.0), ("in", 25.4)];

/// Unit of a true size.
#[derive(Clone, Debug, PartialEq)]
enum MeshUnit {
    /// The unit that each mesh states.
    Stated,
    /// Unit of meshes that state none, in millimeters.
    Unstated(f64),
    /// Unit of the object of this name, regardless of its mesh, in millimeters.
    Of(String, f64),
}

fn mesh_unit(text: &str) -> Result<MeshUnit, String> {
    let (name, unit) = match text.rsplit_once('=') {
        Some((name, unit)) => (Some(name.to_owned()), unit),
        None => (None, text),
    };
    let found = UNITS.into_iter().find(|(name, _)| *name == unit).map(|(_, millimeters)| millimeters);
    match (name, found) {
        (None, None) if text == "stated" => Ok(MeshUnit::Stated),
        (None, Some(millimeters)) => Ok(MeshUnit::Unstated(millimeters)),
        (Some(name), Some(millimeters)) => Ok(MeshUnit::Of(name, millimeters)),
        _ => Err("use mm, cm, m or in for meshes that state no unit, NAME=cm for one object, or stated".to_owned()),
    }
}

fn instances(text: &str) -> Result<usize, String> {
    let wanted = "give a number such as 20, or none; write what to touch before the option";
    text.parse().map_err(|_| wanted.to_owned())
}
