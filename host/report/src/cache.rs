//! Cache of what was already measured, so that an interrupted report can be resumed.
//!
//! Each stage's result is a file in the report's `.stages` directory, named after the stage and the key of everything
//! that it depends on: the settings, the objects' meshes, the program (its version and its executable's bytes), and the
//! emulator's images. Another key is another file, so an outdated result is never reused.

use super::results::json;
use palpate::chip::instructions::Chip;
use palpate::error::{Error, Result};
use palpate::mesh::{Instance, Object};
use palpate::output::replace_json;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

const CHECKSUM: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);

/// Directory in which a report keeps the results of its stages.
pub(super) const DIRECTORY: &str = ".stages";

/// Results of stages, kept in a directory.
#[derive(Debug)]
pub(super) struct Cache {
    directory: PathBuf,
    key: u64,
}

/// A stage's result and how long it took.
#[derive(Clone, Debug, PartialEq, Serialize, serde::Deserialize)]
pub(super) struct Stage<T> {
    /// The result.
    pub(super) result: T,
    /// Seconds that it took when it was measured.
    pub(super) seconds: f64,
}

impl Cache {
    /// The results under `directory` that belong to these settings and objects; all others are removed, and with
    /// `resume` off these as well.
    ///
    /// # Errors
    /// [`Error::Io`] if the directory cannot be read or made.
    pub(super) fn open(directory: &Path, settings: &impl Serialize, objects: &[Object], resume: bool) -> Result<Self> {
        let cache = Self { directory: directory.join(DIRECTORY), key: key(settings, objects, &Surroundings::here())? };
        let io = |source| Error::io(&cache.directory, "keep the stages of the report", source);
        std::fs::create_dir_all(&cache.directory).map_err(io)?;
        for entry in std::fs::read_dir(&cache.directory).map_err(io)? {
            let path = entry.map_err(io)?.path();
            let own = path.file_name().is_some_and(|name| name.to_string_lossy().contains(&cache.suffix()));
            if !(resume && own) && path.is_file() {
                std::fs::remove_file(&path).map_err(io)?;
            }
        }
        Ok(cache)
    }

    /// The result of `stage`: from its file, or measured now and written there. A file that cannot be read back is
    /// measured again.
    ///
    /// # Errors
    /// Errors of `measure`, and [`Error::Io`].
    pub(super) fn stage<T: Serialize + DeserializeOwned>(
        &self,
        stage: &str,
        measure: impl FnOnce() -> Result<T>,
    ) -> Result<Stage<T>> {
        let path = self.path(stage, "json");
        if let Some(kept) = std::fs::read(&path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()) {
            return Ok(kept);
        }
        let began = Instant::now();
        let result = measure()?;
        let stage = Stage { result, seconds: began.elapsed().as_secs_f64() };
        replace_json(&path, &stage)?;
        Ok(stage)
    }

    /// Path of the file of something that belongs to this report.
    pub(super) fn path(&self, name: &str, extension: &str) -> PathBuf {
        self.directory.join(format!("{name}{}{extension}", self.suffix()))
    }

    fn suffix(&self) -> String {
        format!("-{:016x}.", self.key)
    }
}

/// Conditions that results depend on besides settings and objects.
#[derive(Clone, Debug, PartialEq)]
struct Surroundings {
    /// A checksum of the program's version and bytes.
    program: u64,
    /// For each emulated chip a checksum of the image that measures costs on it, where it can be measured.
    images: Vec<Option<u64>>,
}

impl Surroundings {
    /// Versions of this process. If the program's file cannot be read, nothing is reused. Where another
    /// program loads this library, the library is identified by its version alone.
    fn here() -> Self {
        let mut program = CHECKSUM.digest();
        program.update(env!("CARGO_PKG_VERSION").as_bytes());
        match std::env::current_exe().and_then(std::fs::read) {
            Ok(bytes) => program.update(&bytes),
            Err(_) => {
                program.update(&std::process::id().to_le_bytes());
                let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
                program.update(&now.as_nanos().to_le_bytes());
            }
        }
        let image = |chip: Chip| {
            let bytes = if chip.is_there() { std::fs::read(chip.image()).ok() } else { None };
            bytes.map(|bytes| CHECKSUM.checksum(&bytes))
        };
        Self { program: program.finalize(), images: [Chip::M4F, Chip::M0Plus].map(image).to_vec() }
    }
}

/// A checksum of everything that results depend on.
fn key(settings: &impl Serialize, objects: &[Object], surroundings: &Surroundings) -> Result<u64> {
    let mut digest = CHECKSUM.digest();
    digest.update(&surroundings.program.to_le_bytes());
    for image in &surroundings.images {
        digest.update(&[u8::from(image.is_some())]);
        digest.update(&image.unwrap_or(0).to_le_bytes());
    }
    let settings = json("settings", settings)?.to_string();
    digest.update(&(settings.len() as u64).to_le_bytes());
    digest.update(settings.as_bytes());
    for object in objects {
        digest.update(&(object.name.len() as u64).to_le_bytes());
        digest.update(object.name.as_bytes());
        digest.update(&object.millimeters.unwrap_or_default().to_le_bytes());
        digest.update(&(object.instances().len() as u64).to_le_bytes());
        for Instance { mesh, .. } in object.instances() {
            digest.update(&(mesh.vertices.len() as u64).to_le_bytes());
            mesh.vertices.iter().flatten().for_each(|c| digest.update(&c.to_le_bytes()));
            digest.update(&(mesh.triangles.len() as u64).to_le_bytes());
            mesh.triangles.iter().flatten().for_each(|i| digest.update(&i.to_le_bytes()));
        }
    }
    Ok(digest.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::mesh::Mesh;

    fn object(x: f32) -> Object {
        Object::new("fork", Mesh { vertices: vec![[x, 0.0, 0.0]], triangles: vec![] })
    }

    #[test]
    fn a_stage_is_measured_once_and_again_after_any_change() {
        let directory = tempfile::tempdir().unwrap();
        let measured = |settings: &str, object, resume| {
            let cache = Cache::open(directory.path(), &settings, &[object], resume).unwrap();
            let mut fresh = false;
            let stage = cache.stage("one", || {
                fresh = true;
                Ok(vec![1.5])
            });
            assert_eq!(stage.unwrap().result, [1.5]);
            fresh
        };
        assert!(measured("a", object(1.0), true));
        assert!(!measured("a", object(1.0), true));
        assert!(measured("b", object(1.0), true));
        assert!(measured("b", object(2.0), true));
        assert!(!measured("b", object(2.0), true));
        assert!(measured("b", object(2.0), false));
        assert_eq!(std::fs::read_dir(directory.path().join(".stages")).unwrap().count(), 1);
    }

    #[test]
    fn a_stage_that_failed_or_was_cut_off_is_measured_again() {
        let directory = tempfile::tempdir().unwrap();
        let cache = Cache::open(directory.path(), &1, &[], true).unwrap();
        assert!(cache.stage::<u32>("one", || Err(Error::Cancelled)).is_err());
        std::fs::write(cache.path("one", "json"), b"{\"result\": 3, \"sec").unwrap();
        assert_eq!(cache.stage("one", || Ok(4)).unwrap().result, 4);
        assert_eq!(cache.stage("one", || Ok(5)).unwrap().result, 4);
    }

    #[test]
    fn a_result_of_another_build_or_measured_without_the_emulator_is_not_reused() {
        let surroundings = |program, image| Surroundings { program, images: vec![image, None] };
        let key = |surroundings| super::key(&"settings", &[object(1.0)], &surroundings).unwrap();
        let own = key(surroundings(1, Some(7)));
        assert_eq!(own, key(surroundings(1, Some(7))));
        for other in [surroundings(2, Some(7)), surroundings(1, None), surroundings(1, Some(8))] {
            assert_ne!(own, key(other.clone()), "{other:?}");
        }
        assert_eq!(Surroundings::here(), Surroundings::here(), "the running program cannot be read");
    }
}
