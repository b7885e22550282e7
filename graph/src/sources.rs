//! Sets of WGSL files, and the shaders parsed from them.
//!
//! A set is embedded in the program, or live: then files of a folder stand in for embedded ones of the same path, and
//! [`WgslSources::poll`] takes up what was edited.
//!
//! ```text
//!   embedded          folder             live set
//!   a.wgsl            a.wgsl (edited)    a.wgsl (edited)
//!   shared/rng.wgsl                      shared/rng.wgsl
//! ```
//!
//! A set parses each file once, however many shaders are made from it.

use crate::{
    error::ShaderError,
    reload::{Live, Reload},
    shader::{ComputeShader, RasterShader, Shader, Source, stem},
    wgsl::{FlatWgsl, Texts},
};
use std::{
    collections::HashMap,
    fmt,
    path::Path,
    sync::{Arc, Mutex, PoisonError},
};

/// A set of WGSL files by path. Clones are the same set.
#[derive(Clone, Debug, Default)]
pub struct WgslSources {
    /// The embedded texts.
    texts: Texts,
    parsed: Arc<Mutex<Parsed>>,
    live: Option<Arc<Live>>,
}

impl WgslSources {
    /// An empty set.
    pub fn new() -> Self {
        Self::default()
    }

    /// The set with `files` added: `(path from the root, text)`. A path met again takes the new text; in a live set the
    /// folder's files still come first.
    pub fn with(&self, files: &[(&str, &str)]) -> Self {
        let mut texts = self.texts.clone();
        for (path, text) in files {
            texts.insert(path, Arc::from(*text));
        }
        let live = self.live.as_ref().map(|live| live.over(&texts));
        Self { texts, parsed: Arc::default(), live }
    }

    /// The set in which every `#import` of `path` takes the file `stand_in`: another implementation of the same functions, for all
    /// shaders at once.
    ///
    /// # Errors
    /// [`ShaderError::UnknownFile`] if the set lacks one of the two.
    pub fn with_stand_in(&self, path: &str, stand_in: &str) -> Result<Self, ShaderError> {
        let mut texts = self.texts.clone();
        texts.replace(path, stand_in)?;
        let live = self.live.as_ref().map(|live| live.over(&texts));
        Ok(Self { texts, parsed: Arc::default(), live })
    }

    /// The file that an `#import` of `path` takes: `path` itself, or what stands in for it.
    pub fn imported(&self, path: &str) -> String {
        self.texts.resolve(path).to_owned()
    }

    /// The `.wgsl` files in and below `folder`, as a live set.
    ///
    /// # Errors
    /// If the folder or a file in it cannot be read.
    pub fn from_dir(folder: impl AsRef<Path>) -> Result<Self, ShaderError> {
        Self::new().watch(folder)
    }

    /// The set made live: `.wgsl` files in and below `folder` replace those of the same path, now and at every
    /// [`WgslSources::poll`]. A file deleted there gives way to the embedded one again.
    ///
    /// # Errors
    /// If the folder or a file in it cannot be read.
    pub fn watch(&self, folder: impl AsRef<Path>) -> Result<Self, ShaderError> {
        let live = Live::new(folder.as_ref(), &self.texts)?;
        Ok(Self { texts: self.texts.clone(), parsed: Arc::default(), live: Some(live) })
    }

    /// Takes up what changed in the folder of a live set; `None` if nothing did. Call it between frames.
    ///
    /// Every shader made from the set follows, with its constants, or none does: shaders of one frame share structs
    /// through imports, so half a change is worse than none. Where the new texts cannot be used, the shaders keep their
    /// last good version and the report says why. Looks at the date and length of every file, and reads those that changed.
    ///
    /// New texts that are right by themselves may no longer fit the passes that bind them. That shows when the next frame
    /// is declared, as the ordinary error; mend either side, or go back by [`WgslSources::reject`].
    ///
    /// ```
    /// # use lightloom_graph::{ComputeShader, WgslSources};
    /// # let folder = tempfile::tempdir()?;
    /// # let write = |text: &str| std::fs::write(folder.path().join("fill.wgsl"), text);
    /// # write("@compute @workgroup_size(64) fn fill() {}")?;
    /// let sources = WgslSources::from_dir(&folder)?;
    /// let fill = ComputeShader::new(&sources, "fill.wgsl")?;
    /// # write("@compute @workgroup_size(64) fn fill() { oops }")?;
    /// // Between two frames:
    /// if let Some(reload) = sources.poll() {
    ///     eprintln!("{reload}");
    /// #   let error = "fill.wgsl:1: expected assignment or increment/decrement, found \"}\"";
    /// #   assert_eq!(reload.errors[0].to_string(), error);
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn poll(&self) -> Option<Reload> {
        self.live.as_ref()?.poll()
    }

    /// Goes back to the texts from before the last successful [`WgslSources::poll`], until a file changes again; `None`
    /// if there are none. For programs that would sooner show the last frame that worked than an error.
    pub fn reject(&self) -> Option<Reload> {
        self.live.as_ref()?.reject()
    }

    /// All paths, sorted.
    pub fn paths(&self) -> Vec<String> {
        self.now().paths().map(str::to_owned).collect()
    }

    /// The file at `path` with every import replaced by the imported text.
    ///
    /// # Errors
    /// If the file or an import of it does not exist, or a line starts with `#` and is no import.
    pub fn flatten(&self, path: &str) -> Result<FlatWgsl, ShaderError> {
        self.now().flatten(path)
    }

    fn now(&self) -> Texts {
        self.live.as_ref().map_or_else(|| self.texts.clone(), |live| live.texts())
    }

    pub(crate) fn live(&self) -> Option<&Arc<Live>> {
        self.live.as_ref()
    }

    /// The shader in the file `path` of a set that is not live.
    pub(crate) fn shader<S: Shader>(&self, path: &str) -> Result<S, ShaderError> {
        self.parsed.lock().unwrap_or_else(PoisonError::into_inner).shader(&self.texts, path)
    }
}

/// What was parsed from one set of texts, by path.
#[derive(Default)]
pub(crate) struct Parsed {
    sources: HashMap<String, Arc<Source>>,
    pub(crate) compute: HashMap<String, ComputeShader>,
    pub(crate) raster: HashMap<String, RasterShader>,
}

impl Parsed {
    /// The shader in the file `path`.
    pub(crate) fn shader<S: Shader>(&mut self, texts: &Texts, path: &str) -> Result<S, ShaderError> {
        if let Some(found) = S::shelf(self).get(path) {
            return Ok(found.clone());
        }
        let source = match self.sources.get(path) {
            Some(found) => Arc::clone(found),
            None => Arc::new(Source::parse(texts.flatten(path)?)?),
        };
        self.sources.insert(path.to_owned(), Arc::clone(&source));
        let shader = S::build(stem(path), source)?;
        S::shelf(self).insert(path.to_owned(), shader.clone());
        Ok(shader)
    }

    /// What stays true with other texts: the files that flatten to the same.
    pub(crate) fn carried(&self, texts: &Texts) -> Self {
        let same = |path: &str| {
            let flat = texts.flatten(path).ok();
            flat.is_some() && flat.as_ref() == self.sources.get(path).map(|source| &source.flat)
        };
        let mut kept = Self::default();
        for (path, source) in self.sources.iter().filter(|(path, _)| same(path)) {
            kept.sources.insert(path.clone(), Arc::clone(source));
            kept.compute.extend(self.compute.get(path).map(|shader| (path.clone(), shader.clone())));
            kept.raster.extend(self.raster.get(path).map(|shader| (path.clone(), shader.clone())));
        }
        kept
    }
}

impl fmt::Debug for Parsed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.sources.keys()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_parsed_once() {
        let wgsl = "override size: u32 = 64;
            @compute @workgroup_size(size) fn both() {}
            @vertex fn both_vertex() -> @builtin(position) vec4f { return vec4f(0.0); }
            @fragment fn both_fragment() {}";
        let sources = WgslSources::new().with(&[("both.wgsl", wgsl), ("copy/both.wgsl", wgsl)]);
        let first = ComputeShader::new(&sources, "both.wgsl").unwrap();
        let clone = sources.clone();
        let again = ComputeShader::new(&clone, "both.wgsl").unwrap();
        let raster = RasterShader::new(&sources, "both.wgsl").unwrap();
        let variant = again.clone().with_constant("size", 32.0).unwrap();
        assert!(Arc::ptr_eq(&first.core, &again.core), "the second shader is the first");
        assert!(Arc::ptr_eq(&first.core.source, &raster.core.source), "and compute and raster share their source");
        assert!(Arc::ptr_eq(&first.core.source, &variant.core.source), "as do variants");
        assert_ne!(first.core, variant.core, "though they are other shaders");
        let other = ComputeShader::new(&sources, "copy/both.wgsl").unwrap();
        assert!(!Arc::ptr_eq(&first.core.source, &other.core.source), "another file is another source");
        assert_eq!(first.core, other.core, "of the same text");
        let larger = sources.with(&[("both.wgsl", "@compute @workgroup_size(8) fn both() {}")]);
        assert_eq!(ComputeShader::new(&larger, "both.wgsl").unwrap().workgroup_size(), [8, 1, 1], "another set parses anew");
    }
}
