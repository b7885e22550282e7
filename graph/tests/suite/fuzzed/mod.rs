//! What the fuzz targets run (see `graph/fuzz`), here with a few hundred inputs of a fixed seed.
//!
//! The targets include this folder by its path, so that both run the same code and the library grows no interface for it.

mod declaration;
mod frame_json;
mod invariants;

pub(crate) use {declaration::declaration, frame_json::frame_json};

#[cfg(test)]
mod tests {
    use super::{declaration, frame_json};
    use proptest::{
        collection::vec,
        prelude::{Just, ProptestConfig, Strategy, any},
        prop_oneof,
        test_runner::{RngSeed, TestRunner},
    };
    use std::cell::Cell;

    static FRAME: &str = r#"{"frame": "f", "resources": [
        {"name": "out", "kind": "buffer", "origin": "imported", "bytes": 4},
        {"name": "a", "kind": "texture", "origin": "transient", "format": "rgba16float", "size": [64, 32, 1], "mips": 3},
        {"name": "b", "kind": "texture", "origin": "transient", "format": "rgba16float", "size": [64, 32, 1], "mips": 3},
        {"name": "h", "kind": "buffer", "origin": "history", "bytes": 300},
        {"name": "k", "kind": "buffer", "origin": "transient", "bytes": 1000, "keep": true}],
      "passes": [
        {"name": "p", "kind": "raster", "writes": [{"resource": "a"}]},
        {"name": "q", "kind": "compute", "reads": ["a", "h"], "writes": [{"resource": "b"}]},
        {"name": "r", "kind": "compute", "reads": ["b"], "writes": [{"resource": "a"}, {"resource": "k"}]},
        {"name": "s", "kind": "transfer", "reads": ["a"], "writes": [{"resource": "out", "preserve": true}], "side_effect": true}]}"#;

    /// What is put in place of a part of a frame.
    fn patch() -> impl Strategy<Value = String> {
        let words = ["a", "b", "h", "k", "out", "p", "0", "1", "-1", "18446744073709551615", "4294967295", "0.5", "true", "null"];
        let more = ["transient", "imported", "history", "\"bytes\": 18446744073709551615", "{}", "[]", "\"", ",", "}", "\u{0}"];
        prop_oneof![
            proptest::sample::select([&words[..], &more[..]].concat()).prop_map(str::to_owned),
            "[a-z]{0,3}",
            Just(String::new())
        ]
    }

    fn runner(cases: u32) -> TestRunner {
        let rng_seed = RngSeed::Fixed(0x11_6874);
        TestRunner::new(ProptestConfig { cases, rng_seed, failure_persistence: None, ..ProptestConfig::default() })
    }

    #[test]
    fn frames_and_mutations_of_them() {
        assert!(frame_json(FRAME.as_bytes()), "the frame itself is sound");
        let planned = Cell::new(0);
        // Words and numbers of the frame replaced, so that most of what comes out is JSON and some of it a frame.
        let words: Vec<(usize, &str)> = FRAME
            .split(|c: char| !c.is_ascii_alphanumeric())
            .filter(|word| !word.is_empty())
            .map(|word| (word.as_ptr() as usize - FRAME.as_ptr() as usize, word))
            .collect();
        let mutation = vec((0..words.len(), patch()), 0..4);
        runner(400)
            .run(&mutation, |mut mutation| {
                mutation.sort_by_key(|(word, _)| std::cmp::Reverse(*word));
                mutation.dedup_by_key(|(word, _)| *word);
                let mut text = FRAME.to_owned();
                for (word, patch) in mutation {
                    let (at, word) = words[word];
                    text.replace_range(at..at + word.len(), &patch);
                }
                planned.set(planned.get() + u32::from(frame_json(text.as_bytes())));
                Ok(())
            })
            .unwrap();
        assert!(planned.get() > 100, "only {} of 400 were planned", planned.get());
    }

    #[test]
    fn bytes_that_are_no_frame() {
        runner(200)
            .run(&vec(any::<u8>(), 0..200), |bytes| {
                frame_json(&bytes);
                Ok(())
            })
            .unwrap();
    }

    #[test]
    fn sequences_of_calls() {
        let planned = Cell::new(0);
        runner(600)
            .run(&vec(any::<u8>(), 0..300), |bytes| {
                planned.set(planned.get() + u32::from(declaration(&bytes)));
                Ok(())
            })
            .unwrap();
        assert!(planned.get() > 100, "only {} of 600 were planned", planned.get());
    }
}
