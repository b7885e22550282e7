//! Planning without a peer, for compilers that zenfg refuses; see `report.rs`. Its columns are NaN.

mod frames;
#[path = "no_peer.rs"]
mod peer;
mod report;

fn main() {
    report::main();
}
