//! The tests of `placement.rs` again, under Vulkan's validation layer. What it cannot see: it orders aliased buffers, and images of
//! equal descriptions, but not images of different ones.

use crate::layer::{complaint, layer, under};

#[test]
fn the_layer_has_nothing_to_say_about_placement() {
    let Some(library) = layer() else { return };
    let Some(text) = under(&library, &["placement::"], &[]) else { return };
    for line in text.lines().filter(|line| line.contains("SKIPPED")) {
        println!("{line}");
    }
    assert_eq!(complaint(&text, &[]), None, "the first of the layer's complaints");
}

#[test]
fn the_layer_sees_memory_that_was_not_handed_over() {
    // Without this the silence above would prove nothing.
    let Some(library) = layer() else { return };
    let Some(text) = under(&library, &["placement::misuse", "--ignored"], &[]) else { return };
    if text.contains("SKIPPED") {
        return;
    }
    assert!(text.contains("SYNC-HAZARD-WRITE-AFTER-WRITE"), "{text}");
}
