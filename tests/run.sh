#!/usr/bin/env bash
# Runs every test of the workspace; arguments go to cargo-nextest, or to cargo test where nextest is not installed.
# LIGHTLOOM_REQUIRE=1 makes a test that this machine cannot run fail instead of printing SKIPPED.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. demos/setup.sh

need_rust
need_cxx
need_vulkan

# What is opt-in, the graph's placement in shared Vulkan memory and ray-tracing pipelines, is built for the tests, which skip it
# where a device cannot.
features=(--features lightloom-graph/placement,lightloom-passes/ray-pipeline)

if cargo nextest --version >/dev/null 2>&1; then
  cargo nextest run --locked --workspace "${features[@]}" "$@"
  # Examples in the documentation, which nextest leaves out; arguments choose among the other tests.
  if [ $# -eq 0 ]; then
    cargo test --locked --workspace "${features[@]}" --doc
  fi
else
  # Few at a time: each test that opens a software adapter uses every core by itself.
  export RUST_TEST_THREADS="${RUST_TEST_THREADS:-2}"
  cargo test --locked --workspace "${features[@]}" "$@"
fi
