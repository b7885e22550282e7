//! What the fuzz targets run (see `graph/fuzz`), here with a few hundred inputs of a fixed seed.
//!
//! The targets include this folder by its path, so that both run the same code and the library grows no interface for it.

mod declaration;
mod frame_json;
mod invariants;
mod known;
mod passes;
mod shaders;

pub(crate) use {declaration::declaration, frame_json::frame_json};

#[cfg(test)]
mod tests {
    use super::{declaration, frame_json};
    use lightloom_graph::{Access, Declaration, Plan, SlotKind};
    use proptest::{
        collection::vec,
        prelude::{Just, ProptestConfig, Strategy, any},
        prop_oneof,
        test_runner::{RngSeed, TestRunner},
    };
    use std::{cell::Cell, ops::Range};

    /// Sequences of calls that are tried.
    const CALLS: u32 = 600;

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

    /// Whether a frame and its plan have something.
    type Fact = fn(&Declaration, &Plan) -> bool;

    /// What frames must have for the invariants to say anything: a name, and whether a frame and its plan have it.
    const FACTS: [(&str, Fact); 9] = [
        ("parts of textures", |frame, _| accesses(frame).any(|access| !access.part.is_all())),
        ("merged draws", |_, plan| plan.steps.iter().any(|step| step.len() > 1)),
        ("folded clears", |frame, plan| {
            let begins_with = |step: &Range<usize>| &frame.passes[plan.order[step.start]].name;
            plan.steps.iter().any(|step| step.len() > 1 && begins_with(step).starts_with("clear"))
        }),
        ("shared arenas", |_, plan| plan.slots.iter().any(|slot| slot.kind == SlotKind::Arena && slot.resources.len() > 1)),
        ("shared objects", |_, plan| plan.slots.iter().any(|slot| slot.kind == SlotKind::Object && slot.resources.len() > 1)),
        ("culled passes", |_, plan| !plan.culled.is_empty()),
        ("another order", |_, plan| !plan.order.is_sorted()),
        ("another order and pinned passes", |frame, plan| {
            !plan.order.is_sorted() && plan.order.iter().filter(|&&pass| frame.passes[pass].pinned).count() > 1
        }),
        ("indirect calls", |frame, _| accesses(frame).any(|access| *access.binding == *"indirect arguments")),
    ];

    fn accesses(frame: &Declaration) -> impl Iterator<Item = &Access> {
        frame.passes.iter().flat_map(|pass| &pass.accesses)
    }

    #[test]
    fn sequences_of_calls() {
        let (planned, having) = (Cell::new(0), FACTS.map(|_| Cell::new(0)));
        runner(CALLS)
            .run(&vec(any::<u8>(), 0..500), |bytes| {
                if let Some((frame, plan)) = declaration(&bytes) {
                    planned.set(planned.get() + 1);
                    for ((_, has), count) in FACTS.iter().zip(&having) {
                        count.set(count.get() + u32::from(has(&frame, &plan)));
                    }
                }
                Ok(())
            })
            .unwrap();
        assert!(planned.get() > CALLS / 4, "only {} of {CALLS} were planned", planned.get());
        for ((fact, _), count) in FACTS.iter().zip(&having) {
            assert!(count.get() > 10, "{fact} in only {} of {} frames", count.get(), planned.get());
        }
    }
}
