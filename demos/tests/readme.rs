//! The README's example is the one that compiles.

use std::path::Path;

#[test]
fn the_readme_shows_the_example_as_it_is() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let Ok(readme) = std::fs::read_to_string(root.join("../README.md")) else {
        println!("SKIPPED: no README.md beside the package");
        return;
    };
    let example = std::fs::read_to_string(root.join("examples/compose.rs")).unwrap();
    let after = readme.split_once("```rust\n").expect("a Rust example in the README").1;
    let shown = after.split_once("\n```").expect("the end of the example").0;
    let indented = |line: &str| if line.is_empty() { String::new() } else { format!("    {line}") };
    let shown: Vec<String> = shown.lines().map(indented).collect();
    assert!(example.contains(&shown.join("\n")), "README.md and demos/examples/compose.rs differ");
}
