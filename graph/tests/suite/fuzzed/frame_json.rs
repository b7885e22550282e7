//! Frame files from bytes.

use super::invariants::check;
use lightloom_graph::Declaration;

/// Reads the bytes as a frame file; what is accepted is planned, written and read again. Whether it could be planned.
pub(crate) fn frame_json(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    match Declaration::from_frame_json(text) {
        Err(error) => {
            assert!(!error.to_string().is_empty(), "a refusal says why");
            false
        }
        Ok(declaration) => {
            let planned = check(&declaration).is_some();
            let again = Declaration::from_frame_json(&declaration.to_frame_json()).expect("what was written can be read");
            assert_eq!(again.to_frame_json(), declaration.to_frame_json(), "and says the same");
            planned
        }
    }
}
