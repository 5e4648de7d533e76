//! Random squeezes of real and generated meshes, each asked for in one request: found, refused, wrong,
//! and what it cost; beside the motion followed alone, and a slow oracle where it is refused.
//!
//! `squeezes [COUNT [FIRST_SEED]]`, default 80 from 0. Meshes come from `shared/meshes` beside the
//! workspace or from where `SOFTGRASP_SHARED` points, and from the generator.
#![allow(clippy::print_stdout, reason = "a table on standard output is what it is for")]

mod oracle;
mod squeeze;

use std::time::Instant;

use softgrasp_core::solve::equilibrium::Wish;
use squeeze::Squeeze;

fn main() {
    let numbers: Vec<u64> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let (count, first) = (numbers.first().copied().unwrap_or(80), numbers.get(1).copied());
    let first = first.unwrap_or(0);
    let objects = squeeze::objects();
    let mut sums = Sums::default();
    println!("seed object nodes element poisson law forces | followed s | found s | oracle | text");
    for seed in first..first + count {
        let squeeze = Squeeze::random(&objects, seed);
        let (mut followed, mut found) = (squeeze.path(), squeeze.path());
        let goal = squeeze.goal();
        let start = Instant::now();
        let by_following = followed.advance(&goal, &Wish::EXACT);
        let followed_s = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let by_all_means = found.find(&goal, &Wish::EXACT);
        let found_s = start.elapsed().as_secs_f64();
        // The oracle where it can say more: of what is refused, and of what only one of both found.
        let is_sure = by_following.is_ok() && by_all_means.is_ok();
        let apart = squeeze::off(found.displacement(), followed.displacement());
        let oracle = if is_sure && apart < 1e-6 { None } else { Some(oracle::solve(&squeeze)) };
        let of_oracle = match &oracle {
            None => "-".to_owned(),
            Some(None) => "none".to_owned(),
            Some(Some(q)) => match &by_all_means {
                Ok(_) => format!("{:.0e}", squeeze::off(found.displacement(), q)),
                Err(_) => "found".to_owned(),
            },
        };
        let text = match &by_all_means {
            Ok(e) => format!(
                "J {:.2} pieces {} factors {} solves {} residual {:.0e}{}",
                e.jacobian_min,
                e.substeps,
                e.factors,
                e.linear_solves,
                e.residual_rel,
                if e.jumped { " jumped" } else { "" }
            ),
            Err(error) => error.to_string(),
        };
        let of_following = match &by_following {
            Ok(_) if is_sure => format!("ok {apart:.0e}"),
            Ok(_) => "ok".to_owned(),
            Err(_) => "refused".to_owned(),
        };
        println!(
            "{seed} {} | {of_following} {followed_s:.2} | {} {found_s:.2} | {of_oracle} | {text}",
            squeeze.name,
            if by_all_means.is_ok() { "ok" } else { "refused" },
        );
        sums.add(by_following.is_ok(), by_all_means.is_ok(), &oracle, found_s);
    }
    println!("{sums:?}");
}

/// What all squeezes come to.
#[derive(Debug, Default)]
#[allow(dead_code, reason = "they are printed")]
struct Sums {
    squeezes: u32,
    followed: u32,
    found: u32,
    lost_that_was_followed: u32,
    refused: u32,
    refused_where_the_oracle_finds: u32,
    refused_s_max: f64,
    found_s_max: f64,
}

impl Sums {
    fn add(&mut self, followed: bool, found: bool, oracle: &Option<Option<Vec<f64>>>, s: f64) {
        self.squeezes += 1;
        self.followed += u32::from(followed);
        self.found += u32::from(found);
        self.lost_that_was_followed += u32::from(followed && !found);
        self.refused += u32::from(!found);
        let oracle_found = matches!(oracle, Some(Some(_)));
        self.refused_where_the_oracle_finds += u32::from(!found && oracle_found);
        let most = if found { &mut self.found_s_max } else { &mut self.refused_s_max };
        *most = most.max(s);
    }
}
