#!/usr/bin/env bash
# Builds the program `lightloom` and runs it with the arguments given; installs a software Vulkan driver where there is none.
# Without arguments: compares all strategies on a built-in scene and writes a report.
set -euo pipefail
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
. "$root/demos/setup.sh"

need_rust
need_cxx
need_vulkan

# The program runs in the caller's directory, so that the paths given to it mean what they say.
exec cargo run --release --locked --manifest-path "$root/demos/Cargo.toml" --bin lightloom -- "$@"
