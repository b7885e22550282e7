//! Frame files: read, planned in every way, checked, written, read again.

#![no_main]

#[path = "../../tests/suite/fuzzed/mod.rs"]
#[allow(dead_code, unused_imports, reason = "each target runs one of the functions")]
mod fuzzed;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    fuzzed::frame_json(bytes);
});
