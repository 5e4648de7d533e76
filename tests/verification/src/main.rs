//! `softgrasp-verify REPORT`: answers against closed forms, bounds and promises; nothing is timed.

fn main() -> anyhow::Result<()> {
    softgrasp_bench::command::main("softgrasp-verify", softgrasp_verification::measure)
}
