//! The `.wgsl` files of a folder, read again when they change.

use crate::{error::ShaderError, wgsl::Texts};
use std::{
    collections::BTreeMap,
    fs,
    io::{self, ErrorKind},
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, SystemTime},
};

/// The files in and below a folder, as last read.
#[derive(Clone, Debug)]
pub(super) struct Folder {
    root: PathBuf,
    files: BTreeMap<String, File>,
    /// Why the folder itself could not be read.
    fault: Option<ShaderError>,
}

#[derive(Clone, Debug)]
struct File {
    stamp: Stamp,
    text: Result<Arc<str>, ShaderError>,
}

/// Tells an edited file without reading it.
#[derive(Clone, Copy, Debug)]
struct Stamp {
    modified: Option<SystemTime>,
    len: u64,
    /// Whether it was written so shortly before it was read that a second write may bear the same date.
    fresh: bool,
}

/// No file system in use dates files more coarsely (FAT: 2 s).
const COARSEST_DATE: Duration = Duration::from_secs(2);

impl Stamp {
    fn of(metadata: &fs::Metadata) -> Self {
        let modified = metadata.modified().ok();
        let age = modified.and_then(|modified| SystemTime::now().duration_since(modified).ok());
        Self { modified, len: metadata.len(), fresh: age.is_none_or(|age| age < COARSEST_DATE) }
    }

    /// Whether a file last read at `self` and now at `other` can only be the same.
    fn settles(self, other: Self) -> bool {
        !self.fresh && (self.modified, self.len) == (other.modified, other.len)
    }
}

impl Folder {
    /// A folder of which nothing is read yet.
    pub(super) fn new(root: &Path) -> Self {
        Self { root: root.to_owned(), files: BTreeMap::new(), fault: None }
    }

    /// Reads what is new; whether any text is another than before.
    pub(super) fn scan(&mut self) -> bool {
        let mut found = BTreeMap::new();
        let mut changed = false;
        let fault = walk(&self.root, &mut |path, file, metadata| {
            let stamp = Stamp::of(metadata);
            let old = self.files.remove(&path);
            let kept = old.as_ref().filter(|old| old.stamp.settles(stamp)).map(|old| old.text.clone());
            let Some(text) = kept.or_else(|| read(&path, file)) else {
                // Deleted between the listing and the reading.
                changed |= old.is_some();
                return;
            };
            changed |= old.is_none_or(|old| old.text != text);
            found.insert(path, File { stamp, text });
        })
        .err()
        .map(|error| unreadable(&self.root.to_string_lossy(), &error.to_string()));
        if fault.is_some() {
            // What could not be listed is not deleted.
            found.append(&mut self.files);
        }
        changed |= !self.files.is_empty() || fault != self.fault;
        self.files = found;
        self.fault = fault;
        changed
    }

    /// `embedded`, with the folder's files in place of those of the same path.
    pub(super) fn over(&self, embedded: &Texts) -> Result<Texts, Vec<ShaderError>> {
        let mut texts = embedded.clone();
        let mut errors: Vec<ShaderError> = self.fault.iter().cloned().collect();
        for (path, file) in &self.files {
            match &file.text {
                Ok(text) => texts.insert(path, Arc::clone(text)),
                Err(error) => errors.push(error.clone()),
            }
        }
        if errors.is_empty() { Ok(texts) } else { Err(errors) }
    }
}

/// Calls `visit` with every `.wgsl` file below `root`: its path from there, with forward slashes, and its metadata.
/// Links to folders are not followed, so no tree is endless.
fn walk(root: &Path, visit: &mut dyn FnMut(String, &Path, &fs::Metadata)) -> io::Result<()> {
    let mut folders = vec![(root.to_owned(), String::new())];
    while let Some((folder, prefix)) = folders.pop() {
        let entries = match fs::read_dir(&folder) {
            Err(error) if error.kind() == ErrorKind::NotFound && !prefix.is_empty() => continue,
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            let path = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if entry.file_type()?.is_dir() {
                folders.push((entry.path(), path + "/"));
            } else if entry.path().extension().is_some_and(|extension| extension == "wgsl")
                && let Ok(metadata) = fs::metadata(entry.path())
                && metadata.is_file()
            {
                visit(path, &entry.path(), &metadata);
            }
        }
    }
    Ok(())
}

/// The text of a file, or why there is none; `None` if it is gone.
fn read(path: &str, file: &Path) -> Option<Result<Arc<str>, ShaderError>> {
    match fs::read_to_string(file) {
        Ok(text) => Some(Ok(Arc::from(text))),
        Err(error) if error.kind() == ErrorKind::NotFound => None,
        Err(error) if error.kind() == ErrorKind::InvalidData => {
            Some(Err(unreadable(path, "it is not UTF-8; save it as UTF-8 text")))
        }
        Err(error) => Some(Err(unreadable(path, &error.to_string()))),
    }
}

fn unreadable(path: &str, message: &str) -> ShaderError {
    ShaderError::Unreadable { path: path.to_owned(), message: message.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_changed_is_read() {
        let root = tempfile::tempdir().unwrap();
        let write = |path: &str, text: &str| fs::write(root.path().join(path), text).unwrap();
        let age = |path: &str, seconds: u64| {
            let file = fs::File::options().write(true).open(root.path().join(path)).unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(seconds)).unwrap();
        };
        fs::create_dir_all(root.path().join("deep/er")).unwrap();
        write("deep/er/a.wgsl", "one");
        write("notes.txt", "no shader");
        age("deep/er/a.wgsl", 60);
        let mut folder = Folder::new(root.path());
        assert!(folder.scan(), "everything is new at first");
        assert_eq!(folder.over(&Texts::default()).unwrap().paths().collect::<Vec<_>>(), ["deep/er/a.wgsl"]);
        assert!(!folder.scan());
        write("deep/er/a.wgsl", "two");
        age("deep/er/a.wgsl", 30);
        assert!(folder.scan(), "another date");
        // A settled file of the same date and length is not read: the price of a cheap poll.
        let date = fs::metadata(root.path().join("deep/er/a.wgsl")).unwrap().modified().unwrap();
        write("deep/er/a.wgsl", "too");
        fs::File::options().write(true).open(root.path().join("deep/er/a.wgsl")).unwrap().set_modified(date).unwrap();
        assert!(!folder.scan());
        // A fresh one is, however coarse the dates are.
        write("b.wgsl", "one");
        assert!(folder.scan());
        let date = fs::metadata(root.path().join("b.wgsl")).unwrap().modified().unwrap();
        write("b.wgsl", "two");
        fs::File::options().write(true).open(root.path().join("b.wgsl")).unwrap().set_modified(date).unwrap();
        assert!(folder.scan(), "written twice within the clock's tick");
        fs::remove_dir_all(root.path().join("deep")).unwrap();
        assert!(folder.scan() && !folder.scan(), "a deletion is a change, once");
        assert_eq!(folder.over(&Texts::default()).unwrap().paths().collect::<Vec<_>>(), ["b.wgsl"]);
        fs::remove_dir_all(root.path()).unwrap();
        assert!(folder.scan() && !folder.scan(), "a folder that is gone is reported once");
        let errors = folder.over(&Texts::default()).unwrap_err();
        assert!(matches!(&errors[..], [ShaderError::Unreadable { .. }]), "{errors:?}");
    }
}
