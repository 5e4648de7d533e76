//! `softgrasp-bench REPORT`: measured figures, each with its error.

fn main() -> anyhow::Result<()> {
    softgrasp_bench::command::main("softgrasp-bench", softgrasp_bench::measure)
}
