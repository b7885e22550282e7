//! Shaders that follow the files they were made from.
//!
//! ```text
//!   folder ──► candidate texts ──► every shader, parsed, validated, with its constants
//!                                    │ all well              │ an error
//!                                    ▼                       ▼
//!                              they run from now on    the old ones run on; the error is reported
//! ```
//!
//! A shader that follows holds a [`Follower`], which its clones share; a variant made by `with_constant` has one of its own.
//! A pass takes the follower's version when it is declared and keeps that one, so a frame in flight is never touched. A
//! shader of a set that is not live has no follower and pays nothing.
//!
//! All shaders of a set change in one step, or none. Taking up each shader for itself was rejected: where two shaders
//! import one struct and only one of them still compiles, the one would write what the other no longer understands.
//! There is no thread and no system watcher: a poll costs a `stat` per file, and happens where the program wants it.

mod folder;

use crate::{
    error::{ShaderError, names},
    shader::Shader,
    sources::Parsed,
    wgsl::Texts,
};
use folder::Folder;
use std::{
    fmt,
    path::Path,
    sync::{Arc, Mutex, MutexGuard, PoisonError, Weak},
};

/// What [`WgslSources::poll`](crate::WgslSources::poll) did.
///
/// Its text is for a developer to read: what runs now, or each mistake with file, line and mend.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Reload {
    /// Files whose text differs from the text that ran before; sorted.
    pub files: Vec<String>,
    /// Labels of the shaders that run another version now; sorted.
    pub shaders: Vec<String>,
    /// Why the new texts cannot be used. If there are any, no shader has changed.
    pub errors: Vec<ShaderError>,
}

impl fmt::Display for Reload {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let files = names(self.files.iter().map(String::as_str));
        match (self.errors.is_empty(), self.files.is_empty(), self.shaders.is_empty()) {
            (true, true, _) => f.write_str("the shader files are again those that run"),
            (true, false, true) => write!(f, "changed: {files}; no shader in use is another for it"),
            (true, false, false) => {
                write!(f, "changed: {files}; running anew: {}", names(self.shaders.iter().map(String::as_str)))
            }
            (false, ..) => {
                if self.files.is_empty() {
                    f.write_str("the shader files cannot be used")?;
                } else {
                    write!(f, "changed: {files}, which cannot be used")?;
                }
                f.write_str("; the last good version runs on until this is mended:")?;
                self.errors.iter().try_for_each(|error| write!(f, "\n  - {error}"))
            }
        }
    }
}

/// A live set of texts and the shaders that follow it.
pub(crate) struct Live {
    state: Mutex<State>,
}

struct State {
    /// The texts under the folder's.
    embedded: Texts,
    folder: Folder,
    /// The texts that run: the last good ones.
    texts: Texts,
    /// The texts that ran before them.
    before: Option<Texts>,
    /// What was parsed from `texts`.
    parsed: Parsed,
    followers: Vec<Weak<dyn Follow>>,
}

impl Live {
    /// The files of `folder` over `embedded`.
    pub(crate) fn new(folder: &Path, embedded: &Texts) -> Result<Arc<Self>, ShaderError> {
        let mut folder = Folder::new(folder);
        folder.scan();
        let texts = folder.over(embedded).map_err(|mut errors| errors.swap_remove(0))?;
        Ok(Self::of(embedded, folder, texts))
    }

    /// The same folder over other embedded texts, with no followers yet.
    pub(crate) fn over(&self, embedded: &Texts) -> Arc<Self> {
        let folder = self.lock().folder.clone();
        // Where the folder cannot be read just now, the next poll says so.
        let texts = folder.over(embedded).unwrap_or_else(|_| embedded.clone());
        Self::of(embedded, folder, texts)
    }

    fn of(embedded: &Texts, folder: Folder, texts: Texts) -> Arc<Self> {
        let (embedded, before, parsed, followers) = (embedded.clone(), None, Parsed::default(), Vec::new());
        Arc::new(Self { state: Mutex::new(State { embedded, folder, texts, before, parsed, followers }) })
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn texts(&self) -> Texts {
        self.lock().texts.clone()
    }

    /// The shader in the file `path`, which follows.
    pub(crate) fn shader<S: Shader>(self: &Arc<Self>, path: &str) -> Result<(S, Arc<Follower<S>>), ShaderError> {
        self.follow(&mut self.lock(), path, Vec::new())
    }

    fn follow<S: Shader>(
        self: &Arc<Self>,
        state: &mut State,
        path: &str,
        constants: Vec<(String, f64)>,
    ) -> Result<(S, Arc<Follower<S>>), ShaderError> {
        let State { texts, parsed, followers, .. } = state;
        let shader: S = make(parsed, texts, path, &constants)?;
        let version = Mutex::new(Version { now: shader.clone(), next: None });
        let follower = Arc::new(Follower { live: Arc::clone(self), path: path.to_owned(), constants, version });
        if followers.len() == followers.capacity() {
            followers.retain(|follower| follower.strong_count() > 0);
        }
        let weak: Weak<Follower<S>> = Arc::downgrade(&follower);
        followers.push(weak);
        Ok((shader, follower))
    }

    pub(crate) fn poll(&self) -> Option<Reload> {
        let mut state = self.lock();
        if !state.folder.scan() {
            return None;
        }
        let candidate = state.folder.over(&state.embedded);
        Some(match candidate {
            Ok(texts) => state.adopt(texts),
            Err(errors) => Reload { errors, ..Reload::default() },
        })
    }

    pub(crate) fn reject(&self) -> Option<Reload> {
        let mut state = self.lock();
        let texts = state.before.take()?;
        let reload = state.adopt(texts);
        // What was rejected is no version to go back to.
        state.before = None;
        Some(reload)
    }
}

impl fmt::Debug for Live {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Live").finish_non_exhaustive()
    }
}

impl State {
    /// Runs every follower on `texts`, or none.
    fn adopt(&mut self, texts: Texts) -> Reload {
        let mut reload = Reload { files: texts.changed(&self.texts), ..Reload::default() };
        if reload.files.is_empty() {
            return reload;
        }
        let mut parsed = self.parsed.carried(&texts);
        self.followers.retain(|follower| follower.strong_count() > 0);
        let followers: Vec<Arc<dyn Follow>> = self.followers.iter().filter_map(Weak::upgrade).collect();
        for follower in &followers {
            match follower.prepare(&mut parsed, &texts) {
                Ok(changed) => reload.shaders.extend(changed),
                // Shaders that share an import share its mistakes.
                Err(error) if reload.errors.contains(&error) => {}
                Err(error) => reload.errors.push(error),
            }
        }
        let good = reload.errors.is_empty();
        for follower in &followers {
            follower.settle(good);
        }
        if good {
            self.before = Some(std::mem::replace(&mut self.texts, texts));
            self.parsed = parsed;
            reload.shaders.sort_unstable();
            reload.shaders.dedup();
        } else {
            reload.shaders.clear();
        }
        reload
    }
}

/// The version of one shader that is to be used.
pub(crate) struct Follower<S> {
    live: Arc<Live>,
    path: String,
    /// As they were set, by name: another text may number its overrides otherwise.
    constants: Vec<(String, f64)>,
    version: Mutex<Version<S>>,
}

struct Version<S> {
    now: S,
    next: Option<S>,
}

impl<S: Shader> Follower<S> {
    /// The last good version.
    pub(crate) fn latest(&self) -> S {
        self.lock().now.clone()
    }

    /// The last good version with one more constant.
    pub(crate) fn with_constant(&self, name: &str, value: f64) -> Result<(S, Arc<Self>), ShaderError> {
        let mut constants = self.constants.clone();
        constants.retain(|(other, _)| other != name);
        constants.push((name.to_owned(), value));
        self.live.follow(&mut self.live.lock(), &self.path, constants)
    }

    fn lock(&self) -> MutexGuard<'_, Version<S>> {
        self.version.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S> fmt::Debug for Follower<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Follower").field("path", &self.path).field("constants", &self.constants).finish_non_exhaustive()
    }
}

/// The shader in `path` with its constants.
fn make<S: Shader>(parsed: &mut Parsed, texts: &Texts, path: &str, constants: &[(String, f64)]) -> Result<S, ShaderError> {
    constants.iter().try_fold(parsed.shader(texts, path)?, |shader: S, (name, value)| shader.set_constant(name, *value))
}

/// A follower, whatever kind of shader it follows with.
trait Follow: Send + Sync {
    /// Makes the version for `texts` and sets it aside; its label, if it differs from the one in use.
    fn prepare(&self, parsed: &mut Parsed, texts: &Texts) -> Result<Option<String>, ShaderError>;
    /// Takes what was set aside, or drops it.
    fn settle(&self, good: bool);
}

impl<S: Shader> Follow for Follower<S> {
    fn prepare(&self, parsed: &mut Parsed, texts: &Texts) -> Result<Option<String>, ShaderError> {
        let base: S = parsed.shader(texts, &self.path)?;
        if Arc::ptr_eq(&base.core().source, &self.lock().now.core().source) {
            return Ok(None);
        }
        let next: S = make(parsed, texts, &self.path, &self.constants)?;
        let label = next.core().label.to_string();
        self.lock().next = Some(next);
        Ok(Some(label))
    }

    fn settle(&self, good: bool) {
        let mut version = self.lock();
        if let Some(next) = version.next.take()
            && good
        {
            version.now = next;
        }
    }
}
