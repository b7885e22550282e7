//! Planning beside zenfg; see `report.rs`.

mod frames;
mod peer;
mod report;

fn main() {
    report::main();
}
