//! WGSL files with textual, once-only `#import`.
//!
//! ```text
//!   passes/a.wgsl                      flattened
//!     #import "shared/rng.wgsl"   →      (text of shared/rng.wgsl, once)
//!     fn a() { … }                       fn a() { … }
//! ```
//!
//! Imports are hoisted to where they stand the first time a file is met; a second import of a file, however deep, adds
//! nothing. Every line keeps its origin, so errors point into the file a person edits. A textual scheme, not a
//! module system: names are global, as in WGSL itself, and the flattened text is plain WGSL for any tool.
//!
//! `#import "b.wgsl" as "a.wgsl"` lets one file stand in for another: later imports of `a.wgsl` add nothing. So a root file of
//! three lines makes a second version of a shader, with another implementation of functions that it imports.
//! [`WgslSources::with_stand_in`](crate::WgslSources::with_stand_in) does so for every shader of a set.

use crate::error::{ShaderError, ShaderPlace, names};
use std::{collections::BTreeMap, collections::HashSet, sync::Arc};

/// WGSL texts by path. Cheap to clone.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Texts {
    files: Arc<BTreeMap<String, Arc<str>>>,
    /// Imported paths, and what is imported in their place.
    stand_ins: Arc<BTreeMap<String, String>>,
}

impl Texts {
    /// Adds a text; a path met again takes the new one.
    pub(crate) fn insert(&mut self, path: &str, text: Arc<str>) {
        Arc::make_mut(&mut self.files).insert(path.to_owned(), text);
    }

    /// Lets `stand_in` be imported where `path` is asked for.
    pub(crate) fn replace(&mut self, path: &str, stand_in: &str) -> Result<(), ShaderError> {
        if let Some(path) = [path, stand_in].into_iter().find(|path| !self.files.contains_key(*path)) {
            return Err(self.unknown(path));
        }
        Arc::make_mut(&mut self.stand_ins).insert(path.to_owned(), stand_in.to_owned());
        Ok(())
    }

    /// What is imported where `path` is asked for.
    pub(crate) fn resolve<'a>(&'a self, path: &'a str) -> &'a str {
        self.stand_ins.get(path).map_or(path, String::as_str)
    }

    pub(crate) fn get(&self, path: &str) -> Option<&Arc<str>> {
        self.files.get(path)
    }

    fn unknown(&self, path: &str) -> ShaderError {
        ShaderError::UnknownFile { path: path.to_owned(), known: names(self.paths()) }
    }

    /// All paths, sorted.
    pub(crate) fn paths(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Paths of which the texts differ, sorted.
    pub(crate) fn changed(&self, other: &Self) -> Vec<String> {
        let mut paths: Vec<&str> = self.paths().chain(other.paths()).filter(|path| self.get(path) != other.get(path)).collect();
        paths.sort_unstable();
        paths.dedup();
        paths.into_iter().map(str::to_owned).collect()
    }

    /// The file at `path` with every import replaced by the imported text.
    pub(crate) fn flatten(&self, path: &str) -> Result<FlatWgsl, ShaderError> {
        if !self.files.contains_key(path) {
            return Err(self.unknown(path));
        }
        let mut flat = FlatWgsl::default();
        self.append(path, &mut flat, &mut HashSet::new())?;
        Ok(flat)
    }

    /// Appends `path` and what it imports, depth first, on an explicit stack: import chains may be long.
    fn append(&self, path: &str, flat: &mut FlatWgsl, seen: &mut HashSet<String>) -> Result<(), ShaderError> {
        let mut stack: Vec<(u32, std::iter::Enumerate<std::str::Lines<'_>>)> = Vec::new();
        if let Some(text) = self.get(path) {
            seen.insert(path.to_owned());
            stack.push((flat.file(path), text.lines().enumerate()));
        }
        while let Some((file, lines)) = stack.last_mut() {
            let file = *file;
            let Some((index, line)) = lines.next() else {
                stack.pop();
                continue;
            };
            let number = index as u32 + 1;
            if !line.trim_start().starts_with('#') {
                flat.push(file, number, line);
                continue;
            }
            let place = || ShaderPlace::new(flat.files[file as usize].clone(), number);
            let Some((import, replaced)) = import_paths(line) else {
                return Err(ShaderError::Directive { place: place(), line: line.trim().to_owned() });
            };
            let found =
                |path: &str| self.get(path).ok_or_else(|| ShaderError::UnknownImport { place: place(), path: path.to_owned() });
            let import = self.resolve(import);
            let text = found(import)?;
            if let Some(replaced) = replaced {
                found(replaced)?;
                seen.insert(replaced.to_owned());
            }
            if seen.insert(import.to_owned()) {
                let file = flat.file(import);
                stack.push((file, text.lines().enumerate()));
            }
        }
        Ok(())
    }
}

/// The paths of `#import "path"` or `#import "path" as "other path"`, with an optional comment behind it.
fn import_paths(line: &str) -> Option<(&str, Option<&str>)> {
    let (path, tail) = quoted(line.trim().strip_prefix("#import")?)?;
    let (replaced, tail) = match tail.strip_prefix("as") {
        Some(tail) => quoted(tail).map(|(path, tail)| (Some(path), tail))?,
        None => (None, tail),
    };
    let tail = tail.trim_start_matches(';').trim_start();
    (tail.is_empty() || tail.starts_with("//")).then_some((path, replaced))
}

/// The text between quotes that `text` begins with, and what follows.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let (inside, tail) = text.trim_start().strip_prefix('"')?.split_once('"')?;
    (!inside.is_empty()).then_some((inside, tail.trim_start()))
}

/// Flattened WGSL that remembers where each line came from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FlatWgsl {
    source: String,
    files: Vec<String>,
    lines: Vec<(u32, u32)>,
}

impl FlatWgsl {
    /// A single text with no imports; `label` stands for the file.
    pub(crate) fn single(label: &str, source: &str) -> Self {
        let mut flat = Self::default();
        let file = flat.file(label);
        for (index, line) in source.lines().enumerate() {
            flat.push(file, index as u32 + 1, line);
        }
        flat
    }

    fn file(&mut self, path: &str) -> u32 {
        self.files.push(path.to_owned());
        self.files.len() as u32 - 1
    }

    fn push(&mut self, file: u32, line: u32, text: &str) {
        self.source.push_str(text);
        self.source.push('\n');
        self.lines.push((file, line));
    }

    /// The flattened text.
    pub fn source(&self) -> &str {
        &self.source
    }

    /// File and line (from 1) of the flattened text's line `line` (from 1). Past the end: the last line.
    pub fn locate(&self, line: u32) -> (&str, u32) {
        let index = (line.max(1) as usize - 1).min(self.lines.len().saturating_sub(1));
        match self.lines.get(index) {
            Some(&(file, line)) => (self.files.get(file as usize).map_or("", String::as_str), line),
            None => (self.files.first().map_or("", String::as_str), 0),
        }
    }

    pub(crate) fn place(&self, span: naga::Span) -> ShaderPlace {
        if !span.is_defined() {
            return self.root();
        }
        let (file, line) = self.locate(span.location(&self.source).line_number);
        ShaderPlace::new(file, line)
    }

    pub(crate) fn root(&self) -> ShaderPlace {
        ShaderPlace::new(self.files.first().cloned().unwrap_or_default(), 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::WgslSources;

    fn sources() -> WgslSources {
        WgslSources::new().with(&[
            ("a.wgsl", "// a\n#import \"s/b.wgsl\"\n  #import \"s/c.wgsl\" // twice by way of b\nfn a() {}"),
            ("s/b.wgsl", "#import \"s/c.wgsl\"\n#import \"a.wgsl\"\nfn b() {}"),
            ("s/c.wgsl", "fn c() {}\n"),
            ("bad.wgsl", "fn x() {}\n#import \"nowhere.wgsl\""),
            ("worse.wgsl", "#define X"),
        ])
    }

    #[test]
    fn imports_are_textual_and_once_only() {
        let flat = sources().flatten("a.wgsl").unwrap();
        assert_eq!(flat.source(), "// a\nfn c() {}\nfn b() {}\nfn a() {}\n");
        assert_eq!(flat.locate(1), ("a.wgsl", 1));
        assert_eq!(flat.locate(2), ("s/c.wgsl", 1));
        assert_eq!(flat.locate(3), ("s/b.wgsl", 3));
        assert_eq!(flat.locate(4), ("a.wgsl", 4));
        assert_eq!(flat.locate(99), ("a.wgsl", 4), "past the end is the last line");
    }

    #[test]
    fn one_file_stands_in_for_another() {
        let sources = sources().with(&[
            ("d.wgsl", "#import \"s/d.wgsl\" as \"s/c.wgsl\" // another c\n#import \"a.wgsl\""),
            ("s/d.wgsl", "fn c() { }"),
            ("nobody.wgsl", "\n#import \"s/d.wgsl\" as \"s/e.wgsl\""),
            ("odd.wgsl", "#import \"s/d.wgsl\" as s/c.wgsl"),
        ]);
        assert_eq!(sources.flatten("d.wgsl").unwrap().source(), "fn c() { }\n// a\nfn b() {}\nfn a() {}\n");
        let error = sources.flatten("nobody.wgsl").unwrap_err().to_string();
        assert!(error.starts_with("nobody.wgsl:2: `#import \"s/e.wgsl\"`"), "{error}");
        let error = sources.flatten("odd.wgsl").unwrap_err().to_string();
        assert!(error.starts_with("odd.wgsl:1: cannot read"), "{error}");
    }

    #[test]
    fn a_set_may_have_a_file_stand_in_for_another() {
        let sources = sources().with(&[("s/d.wgsl", "fn c() { }")]);
        let standing = sources.with_stand_in("s/c.wgsl", "s/d.wgsl").unwrap();
        assert_eq!(standing.flatten("a.wgsl").unwrap().source(), "// a\nfn c() { }\nfn b() {}\nfn a() {}\n");
        assert_eq!(standing.flatten("s/c.wgsl").unwrap().source(), "fn c() {}\n", "only imports are replaced");
        assert_eq!((standing.imported("s/c.wgsl"), standing.imported("s/b.wgsl")), ("s/d.wgsl".into(), "s/b.wgsl".into()));
        assert_eq!(standing.with(&[]).flatten("a.wgsl").unwrap().locate(2), ("s/d.wgsl", 1), "also in sets made of it");
        assert_eq!(sources.flatten("a.wgsl").unwrap().locate(2), ("s/c.wgsl", 1), "the set itself is as it was");
        let error = sources.with_stand_in("s/c.wgsl", "s/e.wgsl").unwrap_err().to_string();
        assert!(error.contains("`s/e.wgsl`") && error.contains("`s/d.wgsl`"), "{error}");
    }

    #[test]
    fn missing_files_and_odd_directives_are_named() {
        let error = sources().flatten("bad.wgsl").unwrap_err().to_string();
        assert!(error.starts_with("bad.wgsl:2: `#import \"nowhere.wgsl\"`"), "{error}");
        let error = sources().flatten("none.wgsl").unwrap_err().to_string();
        assert!(error.contains("`none.wgsl`") && error.contains("`s/b.wgsl`"), "{error}");
        let error = sources().flatten("worse.wgsl").unwrap_err().to_string();
        assert!(error.starts_with("worse.wgsl:1: cannot read `#define X`"), "{error}");
    }

    #[test]
    fn an_empty_file_has_a_place() {
        let flat = FlatWgsl::single("empty", "");
        assert_eq!(flat.locate(1), ("empty", 0));
    }
}
