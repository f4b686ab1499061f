//! What was measured already, so that an interrupted report goes on where it was.
//!
//! Each stage's result is a file in the report's `.stages` directory, named after the stage and the key of everything
//! that it depends on: settings, tool version, and the objects' meshes. Another key is another file, so no old result is
//! ever taken for a new one.

use crate::error::{Error, Result};
use crate::mesh::Object;
use crate::output::write_json;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};
use std::time::Instant;

const CHECKSUM: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);

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
        let cache = Self { directory: directory.join(".stages"), key: key(settings, objects)? };
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
    /// measured anew.
    ///
    /// # Errors
    /// What `measure` returns, or [`Error::Io`].
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
        write_json(&path, &stage)?;
        Ok(stage)
    }

    /// Where the file of something that belongs to this report is kept.
    pub(super) fn path(&self, name: &str, extension: &str) -> PathBuf {
        self.directory.join(format!("{name}{}{extension}", self.suffix()))
    }

    fn suffix(&self) -> String {
        format!("-{:016x}.", self.key)
    }
}

/// A checksum of all that results depend on.
fn key(settings: &impl Serialize, objects: &[Object]) -> Result<u64> {
    let settings = serde_json::to_vec(settings)
        .map_err(|e| Error::data(format!("cannot write the settings as JSON: {e}"), "Report this as a bug."))?;
    let mut digest = CHECKSUM.digest();
    digest.update(env!("CARGO_PKG_VERSION").as_bytes());
    digest.update(&settings);
    for object in objects {
        digest.update(object.name.as_bytes());
        digest.update(&object.mesh.vertices.len().to_le_bytes());
        object.mesh.vertices.iter().flatten().for_each(|c| digest.update(&c.to_le_bytes()));
        object.mesh.triangles.iter().flatten().for_each(|i| digest.update(&i.to_le_bytes()));
    }
    Ok(digest.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;

    fn object(x: f32) -> Object {
        Object { name: "fork".into(), mesh: Mesh { vertices: vec![[x, 0.0, 0.0]], triangles: vec![] } }
    }

    #[test]
    fn a_stage_is_measured_once_and_anew_after_any_change() {
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
    fn a_stage_that_failed_or_was_cut_off_is_measured_anew() {
        let directory = tempfile::tempdir().unwrap();
        let cache = Cache::open(directory.path(), &1, &[], true).unwrap();
        assert!(cache.stage::<u32>("one", || Err(Error::data("no", "Try."))).is_err());
        std::fs::write(cache.path("one", "json"), b"{\"result\": 3, \"sec").unwrap();
        assert_eq!(cache.stage("one", || Ok(4)).unwrap().result, 4);
        assert_eq!(cache.stage("one", || Ok(5)).unwrap().result, 4);
    }
}
