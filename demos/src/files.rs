//! Writing files whole: a file appears under its name complete, or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use crate::Error;

/// Makes the folder that `file` will lie in, so that a wrong path is known before the work and not after it.
pub(crate) fn prepare_parent(file: &Path) -> Result<(), Error> {
    if file.is_dir() {
        return Err(Error::write(file, &"it is a folder; name a file in it"));
    }
    match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => prepare_folder(folder),
        _ => Ok(()),
    }
}

/// Makes a folder and all above it.
pub(crate) fn prepare_folder(folder: &Path) -> Result<(), Error> {
    fs::create_dir_all(folder).map_err(|error| Error::write(folder, &error))
}

/// Writes beside `file` first and renames, so that an interruption leaves the old contents or the new.
pub(crate) fn write_whole(file: &Path, bytes: &[u8]) -> Result<(), Error> {
    prepare_parent(file)?;
    let partial = partial_name(file);
    let written = fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, file));
    written.map_err(|error| {
        // The first error is the one to tell.
        let _ = fs::remove_file(&partial);
        Error::write(file, &error)
    })
}

fn partial_name(file: &Path) -> PathBuf {
    let mut name = file.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.partial", std::process::id()));
    file.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_made_and_nothing_partial_stays() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a/b/c.txt");
        write_whole(&file, b"one").unwrap();
        write_whole(&file, b"two").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"two");
        assert_eq!(fs::read_dir(file.parent().unwrap()).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_in_place_of_a_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = write_whole(folder.path(), b"x").unwrap_err();
        assert!(error.to_string().contains("it is a folder"), "{error}");
        let below_a_file = folder.path().join("f");
        fs::write(&below_a_file, b"").unwrap();
        let error = write_whole(&below_a_file.join("g"), b"x").unwrap_err();
        assert!(error.to_string().starts_with("cannot write"), "{error}");
        assert_eq!(error.exit_status(), 1);
    }
}
