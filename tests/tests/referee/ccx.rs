//! Runs the program `ccx` in a scratch folder under a time limit, and reads its numbers.

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::channel;
use std::time::Duration;

use crate::deck::System;

/// Longest time of one run; the largest of the full form takes a tenth of it on an idle machine.
const LIMIT: Duration = Duration::from_secs(900);

/// CalculiX as found on the PATH.
pub struct Ccx {
    version: String,
}

/// Number as printed, with seven digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Printed {
    pub value: f64,
    /// Half a unit of the last digit: the largest rounding of the printed number.
    pub half_unit: f64,
}

/// Numbers that one run prints.
///
/// Shapes: for each node of the system; nodes without an element have zeros.
pub struct Results {
    pub displacement: Vec<[Printed; 3]>,
    pub force: Vec<[Printed; 3]>,
}

impl Ccx {
    /// Looks for `ccx`; prints that the test is skipped if it is missing.
    pub fn find() -> Option<Self> {
        let output = Command::new("ccx").arg("-v").stdin(Stdio::null()).output();
        let Ok(output) = output else {
            println!("skipped: ccx is not on the PATH (Debian: apt-get install calculix-ccx)");
            return None;
        };
        let version = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        println!("ccx: {version}");
        Some(Self { version })
    }

    /// Runs CalculiX on one deck.
    ///
    /// # Panics
    /// If it fails, takes too long, or does not print every node; with its output.
    pub fn run(&self, folder: &Path, deck: &str, system: &System) -> Results {
        self.try_run(folder, deck, system).unwrap_or_else(|said| panic!("{said}"))
    }

    /// Runs a deck that CalculiX may give up on, because its iterations do not converge.
    ///
    /// # Errors
    /// Output of CalculiX, if it ends with an error.
    ///
    /// # Panics
    /// If it takes too long, or ends without an error and without printing every node.
    pub fn try_run(&self, folder: &Path, deck: &str, system: &System) -> Result<Results, String> {
        let text = self.printed(folder, deck)?;
        let read = |title| read_block(&text, title, system);
        match (read("displacements"), read("forces")) {
            (Some(displacement), Some(force)) => Ok(Results { displacement, force }),
            _ => panic!("ccx ({}) has not printed every node:\n{text}", self.version),
        }
    }

    /// Text that CalculiX prints for one deck.
    ///
    /// # Errors
    /// Output of CalculiX, if it ends with an error.
    ///
    /// # Panics
    /// If it takes too long.
    pub fn printed(&self, folder: &Path, deck: &str) -> Result<String, String> {
        let results = folder.join("referee.dat");
        // A result of the run before must not be taken for one of this run.
        let _ = std::fs::remove_file(&results);
        std::fs::write(folder.join("referee.inp"), deck).unwrap();
        let child = Command::new("ccx")
            .arg("referee")
            .current_dir(folder)
            .env("OMP_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        wait(child)?;
        Ok(std::fs::read_to_string(&results).unwrap_or_default())
    }
}

/// Waits for the end of the program, which closes its output; returns the output, as an error if the
/// program ended with one.
fn wait(mut child: Child) -> Result<String, String> {
    let mut output = child.stdout.take().unwrap();
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let mut said = Vec::new();
        let read = output.read_to_end(&mut said);
        // The receiver is gone only if the limit has passed.
        let _ = sender.send(read.map(|_| said));
    });
    let Ok(said) = receiver.recv_timeout(LIMIT) else {
        child.kill().unwrap();
        child.wait().unwrap();
        panic!("ccx was not done after {LIMIT:?}");
    };
    let status = child.wait().unwrap();
    let said = String::from_utf8_lossy(&said.unwrap()).into_owned();
    if status.success() {
        Ok(said)
    } else {
        Err(format!("ccx ended with {status}; it said:\n{said}"))
    }
}

/// Rows `node x y z` under the heading that begins with `title`, if every node used has one.
fn read_block(text: &str, title: &str, system: &System) -> Option<Vec<[Printed; 3]>> {
    let nothing = Printed { value: 0.0, half_unit: 0.0 };
    let mut of_node = vec![[nothing; 3]; system.vertices.len()];
    let mut seen = vec![false; system.vertices.len()];
    let mut lines = text.lines().skip_while(|line| !line.trim_start().starts_with(title)).skip(1);
    let rows = lines.by_ref().map(|line| line.split_whitespace().collect::<Vec<_>>());
    for row in rows.skip_while(Vec::is_empty).take_while(|row| row.len() == 4) {
        let node = row[0].parse::<usize>().ok()?.checked_sub(1)?;
        *seen.get_mut(node)? = true;
        for axis in 0..3 {
            of_node[node][axis] = Printed::parse(row[axis + 1])?;
        }
    }
    (seen == system.used).then_some(of_node)
}

impl Printed {
    /// Parses a number in Fortran's form, which omits the `E` before an exponent of three digits.
    pub fn parse(text: &str) -> Option<Self> {
        let split = match text.find(['E', 'e', 'D']) {
            Some(at) => (&text[..at], &text[at + 1..]),
            None => {
                let at = text.rfind(['+', '-']).filter(|at| *at > 0)?;
                (&text[..at], &text[at..])
            }
        };
        let (digits, exponent) = (split.0, split.1.parse::<i32>().ok()?);
        let decimals = digits.split_once('.')?.1.len();
        let value = format!("{digits}e{exponent}").parse().ok()?;
        let half_unit = format!("5e{}", exponent - decimals as i32 - 1).parse().ok()?;
        Some(Self { value, half_unit })
    }
}

#[test]
fn printed_numbers_know_their_last_digit() {
    let number = |text| Printed::parse(text).unwrap();
    assert_eq!(number("-1.234568E-05"), Printed { value: -1.234568e-5, half_unit: 5e-12 });
    assert_eq!(number("6.000000E+02"), Printed { value: 600.0, half_unit: 5e-5 });
    assert_eq!(number("1.500000-101"), Printed { value: 1.5e-101, half_unit: 5e-108 });
    for text in ["", "NaN", "-", "1.5", "********"] {
        assert_eq!(Printed::parse(text), None, "{text}");
    }
}
